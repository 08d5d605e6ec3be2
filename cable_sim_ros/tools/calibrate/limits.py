"""Defaults of a calibration that the command line shows too; imports nothing."""

HOLD_OUT = 0.333  # of the record, its last part
MAX_LAG = 2.0  # s, either way
