"""Limits that several floors keep, in a module that imports nothing."""

LONGEST_RUN = 1e7  # s of anything that is simulated, played or run
MAX_TOW_SPEED = 15.0  # m/s, of ship.tow_speed
GARBAGE = 700, 10, 100  # thresholds of gc: the searches of all objects took a seventh of a start
