"""What makes a scene senseless or doubtful although every number is in its range."""
