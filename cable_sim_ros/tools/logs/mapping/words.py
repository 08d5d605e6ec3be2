"""Words of a mapping: the quantities of signals, what others log in their place, and vectors of them.

Sources and fields of a log by the names and patterns of a mapping, with the nearest where there is none.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from fnmatch import fnmatchcase
from math import pi
from typing import NamedTuple

from ..devices.sentences import by_place
from ..log import Log, Source
from ..own_signals import QUANTITIES

SHOWN = 8  # names in an error
MOST_SOURCES = 64  # of one entry
OF_TYPE = "type:"  # in front of a type of message, in place of a name


def find_sources(log: Log, patterns: Iterable[str]) -> list[Source]:
    """Sources of the names and patterns, in order of the log; MOST_SOURCES at most."""
    found = [
        source
        for name, source in log.sources.items()
        if len(source)
        and any(
            fnmatchcase(source.kind, one[len(OF_TYPE) :])
            if one.startswith(OF_TYPE)
            else name == one or fnmatchcase(name, one)
            for one in patterns
        )
    ]
    return found[:MOST_SOURCES]


def one_after_another(found: list[Source], fields: Iterable[str]) -> tuple[list[Source], list[Source]]:
    """Sources to take as one, which follow each other in time, and those that are left out: without the fields, or
    beside a longer one."""
    able = [s for s in found if all(column_of(s, name) for name in fields)] or found
    taken: list[Source] = []
    for source in sorted(able, key=len, reverse=True):
        if all(_apart(source, other) for other in taken):
            taken.append(source)
    return [s for s in found if any(s is t for t in taken)], [s for s in found if all(s is not t for t in taken)]


def _apart(one: Source, other: Source) -> bool:
    first, second = (s.stamps for s in (one, other))
    return first is not None and second is not None and bool(first[-1] <= second[0] or second[-1] <= first[0])


def column_of(source: Source, name: str) -> str | None:
    """Column of this name or place, else the first that fits it as a pattern."""
    name = by_place(source.name, name)
    if name in source.columns:
        return name
    return next((column for column in source.columns if fnmatchcase(column, name)), None)


def near(name: str, names: Iterable[str]) -> str:
    """The nearest of the names, and which there are, for an error."""
    names = list(names)
    close = difflib.get_close_matches(name, names, 1, 0.4) or [n for n in names if name.lower() in n.lower()][:1]
    return f"Did you mean {close[0]}? There are: {listed(names)}" if close else f"There are: {listed(names)}"


def listed(names: Iterable[str]) -> str:
    """Names in one line, the first SHOWN of them."""
    names = list(names)
    return ", ".join(n[:80] for n in names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")


class Word(NamedTuple):
    """What a mapping may say of a field.

    quantity: what it becomes; unit: SI unit of the field's values; value of the quantity = factor * value + offset, of
    a pressure divided by density and gravity as well; meaning: with sign and datum.
    """

    quantity: str
    unit: str
    factor: float
    offset: float
    meaning: str
    pressure: bool = False


class VectorWord(NamedTuple):
    """Three fields, or the four of a quaternion: the words that they become by frame, what is to be turned."""

    fields: int
    words: dict[str, tuple[str, ...]]  # frame -> words of the components; of a quaternion the angles that come of it
    meaning: str


ATMOSPHERE = 101_325.0  # Pa

WORDS: dict[str, Word] = {
    **{name: Word(name, one.unit, 1.0, 0.0, one.meaning) for name, one in QUANTITIES.items()},
    "heading": Word("yaw", "rad", -1.0, 0.5 * pi, "of the bow, clockwise from true north"),
    "course_from_north": Word("course", "rad", -1.0, 0.5 * pi, "of the track over ground, clockwise from true north"),
    "pitch_bow_up": Word("pitch", "rad", -1.0, 0.0, "bow up positive"),
    "roll_starboard_up": Word("roll", "rad", -1.0, 0.0, "starboard side up positive"),
    "heave_down": Word("heave", "m", -1.0, 0.0, "of the reference point, down positive"),
    "heave_rate_down": Word("heave_rate", "m/s", -1.0, 0.0, "of the reference point, down positive"),
    "sway_starboard": Word("sway", "m", -1.0, 0.0, "of the reference point, to starboard positive"),
    "height_down": Word("z", "m", -1.0, 0.0, "depth of the reference point below the mean water surface"),
    "roll_rate_starboard_up": Word("roll_rate", "rad/s", -1.0, 0.0, "starboard side up positive"),
    "pitch_rate_bow_up": Word("pitch_rate", "rad/s", -1.0, 0.0, "bow up positive"),
    "yaw_rate_clockwise": Word("yaw_rate", "rad/s", -1.0, 0.0, "of the bow, to starboard positive"),
    "acceleration_starboard": Word("acceleration_y", "m/s^2", -1.0, 0.0, "specific force to starboard"),
    "acceleration_down": Word("acceleration_z", "m/s^2", -1.0, 0.0, "specific force down, -9.8 at rest"),
    "hauling_rate": Word("payout_rate", "m/s", -1.0, 0.0, "hauling in positive"),
    "body_pitch_nose_up": Word("body_pitch", "rad", -1.0, 0.0, "of the towbody, nose up positive"),
    "body_roll_starboard_up": Word("body_roll", "rad", -1.0, 0.0, "of the towbody, starboard side up positive"),
    "body_heading": Word("body_yaw", "rad", -1.0, 0.5 * pi, "of the nose of the towbody, clockwise from north"),
    "body_height": Word("body_depth", "m", -1.0, 0.0, "above the mean water surface"),
    "pressure": Word("body_depth", "Pa", 1.0, 0.0, "of the water at the towbody, without the atmosphere", True),
    "pressure_absolute": Word(
        "body_depth", "Pa", 1.0, -ATMOSPHERE, "at the towbody, with the atmosphere (1013.25 hPa are taken off)", True
    ),
    "departure_from_vertical": Word(
        "departure_angle", "rad", -1.0, 0.5 * pi, "of the cable at the sheave, from the downward vertical"
    ),
}

ANGLES: dict[str, tuple[str, ...]] = {"flu": ("roll", "pitch", "yaw"), "frd": ("roll", "pitch_bow_up", "heading")}
VECTORS: dict[str, VectorWord] = {
    "position": VectorWord(
        3, {"enu": ("x", "y", "z"), "ned": ("y", "x", "height_down")}, "of the reference point, by the axes of `frame`"
    ),
    "displacement": VectorWord(
        3,
        {"flu": ("surge", "sway", "heave"), "frd": ("surge", "sway_starboard", "heave_down")},
        "of the reference point from its mean, along the ship's axes",
    ),
    "attitude": VectorWord(3, ANGLES, "roll, pitch, yaw (Rz Ry Rx)"),
    "quaternion": VectorWord(
        4,
        ANGLES,
        "x, y, z, w: from the ship's axes to the world's (flu: to east, north, up; frd: to north, east, down)",
    ),
    "rates": VectorWord(
        3,
        {
            "flu": ("roll_rate", "pitch_rate", "yaw_rate"),
            "frd": ("roll_rate", "pitch_rate_bow_up", "yaw_rate_clockwise"),
        },
        "angular velocity along the ship's axes",
    ),
    "acceleration": VectorWord(
        3,
        {
            "flu": ("acceleration_x", "acceleration_y", "acceleration_z"),
            "frd": ("acceleration_x", "acceleration_starboard", "acceleration_down"),
        },
        "specific force along the ship's axes",
    ),
    "body_position": VectorWord(
        3,
        {"enu": ("body_x", "body_y", "body_height"), "ned": ("body_y", "body_x", "body_depth")},
        "of the towbody, by the axes of `frame`",
    ),
    "velocity": VectorWord(
        3,
        dict.fromkeys(("enu", "ned", "flu", "frd"), ("velocity",) * 3),
        "over ground, in the world's or the ship's axes: gives speed and heave_rate, in the world's the course too",
    ),
    "pull": VectorWord(3, {"flu": ("tension",) * 3}, "force of the cable on the sheave: its norm is the tension"),
}
