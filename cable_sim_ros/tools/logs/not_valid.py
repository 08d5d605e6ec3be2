"""What a device says itself of its values: its flags of "not valid", by kind of sentence, telegram or message.

A value that its device calls not valid is no value: it counts as missing for every reader, and is counted.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from .log import Log, Source

ANGLES = ("roll", "pitch", "heading")
RATE, FORCE = "angular_velocity", "linear_acceleration"


class Flag(NamedTuple):
    """source: pattern of its name or its kind; column: of the flag; bad: its values that say "not valid"; fields: of
    which, (): all that have a unit; of: pattern of the source that has the flag, "": the same; disputed: makers differ
    over the flag, so one that says so of every record says nothing."""

    source: str
    column: str
    bad: tuple[float, ...]
    fields: tuple[str, ...] = ()
    of: str = ""
    disputed: bool = False


NMEA = "NMEA 0183 ???"
FLAGS = (
    Flag("NMEA 0183 GGA", "quality", (0,)),
    *(Flag(NMEA, column, (0,)) for column in ("status", "valid", "mi", "posMode")),
    Flag("NMEA 0183 VBW", "waterspdstatus", (0,), ("longwaterspd", "transwaterspd")),
    Flag("NMEA 0183 VBW", "groundspdstatus", (0,), ("longgroundspd", "transgroundspd")),
    Flag("*PSXN,23", "roll_pitch_quality", (2,), ("roll", "pitch"), of="*PSXN,20"),
    Flag("*PSXN,23", "heading_quality", (2,), ("heading",), of="*PSXN,20"),
    Flag("*PSXN,23", "height_quality", (2,), ("heave",), of="*PSXN,20"),
    Flag("*PASHR", "imu", (0,), (*ANGLES, "heave"), disputed=True),
    Flag("*PASHR,ATT", "reset", (1,), ANGLES),
    *(Flag("*PHOCT", f"{name}_valid", (0,), (name,)) for name in ANGLES),
    *(Flag("*PTNTHPR", f"{name}_valid", (0,), (name,)) for name in ANGLES),
    Flag("*PHOCT", "motion_valid", (0,), ("heave", "heave_at_arm", "surge", "sway")),
    Flag("*PFEC,GPhve", "valid", (0,), ("heave",)),
    Flag("*tss1", "settled", (0,), ("heave", "roll", "pitch")),
    Flag("profiler *", "Suspect Timestamp", (1,)),
    Flag("129029/*", "method", (0,), ("latitude", "longitude", "altitude")),
    Flag("vehicle_local_position*", "xy_valid", (0,), ("x", "y")),
    Flag("vehicle_local_position*", "z_valid", (0,), ("z",)),
    Flag("vehicle_local_position*", "v_xy_valid", (0,), ("vx", "vy")),
    Flag("vehicle_local_position*", "v_z_valid", (0,), ("vz",)),
    Flag("sensor_msgs/msg/NavSatFix", "status.status", (-1,), ("latitude", "longitude", "altitude")),
    *(
        Flag("sensor_msgs/msg/Imu", f"{what}_covariance[0]", (-1,), tuple(f"{what}.{axis}" for axis in axes))
        for what, axes in (("orientation", "xyzw"), (RATE, "xyz"), (FORCE, "xyz"))
    ),
)


def without_invalid(log: Log) -> Log:
    """The log with NaN for each value that its device calls not valid."""
    for source in log.sources.values():
        for flag in FLAGS:
            if len(source) and (fnmatchcase(source.name, flag.source) or fnmatchcase(source.kind, flag.source)):
                _take_out(log, source, flag)
    return log


def _take_out(log: Log, source: Source, flag: Flag) -> None:
    told = next((one for name, one in log.sources.items() if fnmatchcase(name, flag.of)), None) if flag.of else source
    fields = [name for name in flag.fields or source.units if name in source.columns and name != flag.column]
    if told is None or flag.column not in told.columns or not fields:
        return
    bad = np.isin(told.columns[flag.column], flag.bad)
    if told is not source:
        at = last_before(source, told)
        if at is None:
            return
        bad = (at >= 0) & bad[np.maximum(at, 0)]
    count = int(bad.sum())
    what = f"{told.name}.{flag.column} = {' or '.join(f'{value:g}' for value in flag.bad)}"
    if not count:
        return
    if flag.disputed and count == len(source):
        text = f"{what} in all {count} records: 'not valid' by some makers, unused by others; the values are kept"
        source.doubts = (*source.doubts, text)
        return
    for name in fields:
        source.columns[name] = np.where(bad, np.nan, source.columns[name])
    log.notices.append(
        f"{source.name}: {count} of {len(source)} records are not valid by the device ({what}): no "
        f"{', '.join(fields[:8])} there"
    )


def stamps_of_both(one: Source, other: Source) -> tuple[np.ndarray, np.ndarray] | None:
    """Of the clock that two sources have in common, the logger's first; None where there is none."""
    for clock in ("logged", "device"):
        ours, theirs = getattr(one, clock), getattr(other, clock)
        if ours is not None and theirs is not None:
            return ours, theirs
    return None


def last_before(source: Source, told: Source) -> np.ndarray | None:
    """Record of another source at or before each of a source, -1 before its first; None: no clock in common."""
    both = stamps_of_both(source, told)
    if both is None:
        return None
    order = np.argsort(both[1], kind="stable")
    at = np.searchsorted(both[1][order], both[0], "right") - 1
    return np.where(at >= 0, order[np.maximum(at, 0)], -1)
