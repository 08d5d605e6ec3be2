"""What a recording tells of the instrument that made it."""
