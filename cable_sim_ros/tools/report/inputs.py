"""Inputs as they came: ship motion with what was refused, rounded and noticed, and the commands of the winch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...runs.mean_track import angles_along
from .subject import Section, Subject, Table, Text, counted, number, without_paths

LONG = "period_s", "heading_deg", "notes", "chosen"  # lists, and what the notes of the verdict say
RAO_UNITS = {
    **dict.fromkeys(("length", "beam", "draft", "surge", "sway", "heave"), "m"),
    **dict.fromkeys(("roll", "pitch", "yaw"), "°"),
    "roll_period": "s",
}
ROUNDED = (  # figures of a column that came rounded, and what they are
    ("cutoff_hz", "smoothed above [Hz]"), ("acceleration_rounded", "as rounded"),
    ("acceleration_left", "left wrong"), ("acceleration_motion", "of the motion"),
)  # fmt: skip
MOST = 20  # notes of an import
STILL = 1e-9  # of a quantity: a deviation below is round-off
NAMES = {
    "imu/data": "messages of the motion sensor (imu/data)",
    "odom": "messages of position and attitude (odom)",
    "winch/command": "winch commands (winch/command)",
    "joint_command/position": "winch commands as lengths (joint_command/position)",
    "joint_command/velocity": "winch commands as rates (joint_command/velocity)",
}


def section(subject: Subject) -> Section:
    """The section."""
    found = Section("inputs", "Inputs as they came")
    found.parts.append(Table("Ship motion and winch commands", ("what", "value"), list(rows(subject))))
    rounded = subject.metrics.get("motion_rounded") or []
    if rounded:
        caption = "Columns that came rounded and were smoothed: rms accelerations, m/s² or rad/s²"
        head = ("column", "resolution", *(title for _, title in ROUNDED))
        cells = [
            (str(one["column"]), f"{number(one['resolution'])} {one['unit']}", *(number(one[k], 3) for k, _ in ROUNDED))
            for one in rounded
        ]
        found.parts.append(Table(caption, head, cells, right=(2, 3, 4, 5)))
    found.parts += imported(subject)
    rao = subject.metrics.get("rao")
    if rao:
        pairs = [(name.replace("_", " "), sea(name, value)) for name, value in rao.items() if name not in LONG]
        found.parts.append(Table("Ship moved by the waves of the scene", ("what", "value"), pairs))
    notices = [without_paths(str(text), subject) for text in subject.metrics.get("notices") or ()]
    if notices:
        found.parts.append(Text(notices, note=True))
    return found


def imported(subject: Subject) -> Iterator[Table | Text]:
    """Of motion that was imported from foreign logs: files, what was read and lost, and what was assumed."""
    about = subject.metrics.get("imported")
    if not about:
        return
    pairs = [(name.replace("_", " "), without_paths(number(about[name]), subject)) for name in about if name != "notes"]
    yield Table("Motion imported from logs", ("what", "value"), pairs)
    if about["notes"]:
        lines = [without_paths(str(line), subject) for line in about["notes"][:MOST]]
        left = len(about["notes"]) - MOST
        yield Text([*lines, *([f"{left} more: summary.json"] if left > 0 else [])], note=True)


def sea(name: str, value: Any) -> str:
    """A figure of the motion by response amplitude operators, with its unit."""
    if isinstance(value, Mapping):
        return ", ".join(f"{one} {number(part, 3)} {RAO_UNITS.get(one, '')}".rstrip() for one, part in value.items())
    return f"{number(value)} {RAO_UNITS.get(name, '')}".rstrip()


def rows(subject: Subject) -> Iterator[tuple[str, str]]:
    """What came, and what of it was not taken as it came."""
    metrics, frames = subject.metrics, subject.frames
    motion = str(metrics.get("motion") or subject.recorded.custom_data.get("motion") or "not known")
    yield "source of the ship motion", "none: the ship is towed on its mean track" if motion == "none" else motion
    if metrics.get("imu_only"):
        yield "left out", "position and attitude (odom), as asked"
    for topic, count in subject.counts.items():
        yield NAMES[topic], str(count)
    if len(frames):
        kept = subject.kept
        speed = np.hypot(*kept["ship_velocity"][:, :2].T)
        yield (
            "speed over ground",
            f"{number(float(speed.mean()), 4)} m/s mean, {number(deviation(speed), 2)} m/s deviation",
        )
        for name, angle in zip(("roll", "pitch"), map(np.degrees, angles_along(kept["ship_quaternion"]))):
            yield (name, f"{number(deviation(angle), 3)}° deviation, largest {number(float(np.abs(angle).max()), 3)}°")
        heave = kept["ship_position"][:, 2]
        if not subject.hauled or float(heave.std()) > 0.0:
            yield (
                "heave of the ship's reference point",
                f"{number(float(heave.std()), 3)} m deviation; four times that, as of a significant height, "
                f"{number(4.0 * float(heave.std()), 3)} m",
            )
    for name, what in (("motion_refused", "motion messages refused"), ("commands_refused", "winch commands refused")):
        if name in metrics:
            yield what, number(metrics[name]) if metrics[name] else "none"
    if metrics.get("commands_limited"):
        yield "winch commands that asked for too much", number(metrics["commands_limited"])
    if "clock_jumps" in metrics:
        yield "jumps of the clock", str(metrics["clock_jumps"])
    plan = metrics.get("winch") or subject.recorded.custom_data.get("winch_plan")
    yield "plan of the winch", str(plan) if plan else "none"
    if way := metrics.get("ship") or subject.recorded.custom_data.get("ship_plan"):
        yield "plan of the ship", str(way)
    if metrics.get("winch_modes"):
        yield (
            "time in each mode of the winch",
            ", ".join(f"{word} {number(s, 4)} s" for word, s in metrics["winch_modes"].items()),
        )
    for change in metrics.get("changes") or ():
        yield "value changed in the run", str(change)
    if metrics.get("controller"):
        asked = metrics["controller"]
        yield "controller", f"asked {counted(asked['calls'], 'time')}, one each {number(asked['period_s'])} s"
    if metrics.get("resumed"):
        state = metrics["resumed"]
        yield "goes on from a saved state", f"of {number(state['time_s'])} s; motion: {state['motion']}"


def deviation(values: np.ndarray) -> float:
    """Standard deviation, 0 where it is round-off."""
    found = float(values.std())
    return found if found > STILL * max(float(np.abs(values).max()), STILL) else 0.0
