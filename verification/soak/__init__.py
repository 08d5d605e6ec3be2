"""Soak of the real node under load, faults and hostile neighbours: stimulus, measured, limit. ``cable-sim soak``."""
