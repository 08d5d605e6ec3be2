"""Measured tows by the table: each simulated as it was made, numbers fitted over all, depths with intervals."""
