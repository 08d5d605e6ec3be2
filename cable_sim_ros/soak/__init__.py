"""Soak of the real node, R1 to R11 and S3 to S9: stimulus, measured, limit. ``cable-sim soak``."""
