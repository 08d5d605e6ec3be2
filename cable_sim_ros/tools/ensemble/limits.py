"""Bounds and defaults of an ensemble that the command line shows too; imports nothing."""

LEAST_COPIES, COPIES, MAX_COPIES = 5, 50, 1000
SEED, MAX_SEED = 1, 2**31 - 1
