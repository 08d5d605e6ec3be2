"""Limits that several floors keep, in a module that imports nothing."""

LONGEST_RUN = 1e7  # s of anything that is simulated, played or run
MAX_TOW_SPEED = 15.0  # m/s, of ship.tow_speed
