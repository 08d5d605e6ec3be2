"""Many tows at once: what is varied, the engine that runs the cases, the table that keeps their rows."""
