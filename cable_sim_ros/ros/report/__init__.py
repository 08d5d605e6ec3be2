"""What the node says of itself: diagnostics, health, lockstep, its verdict."""
