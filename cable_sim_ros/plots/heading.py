"""What stands over every picture of a run: the scene, what was done with it, and whether the figures can be taken."""

from __future__ import annotations

import textwrap
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from ..io.recordings.recorded_run import RecordedRun
from ..io.scenes.yaml12 import YamlError, parse
from ..runs.summary import since_first
from ..version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STAMP, FAINT = "#c23b33", "#5c6873"
STAMP_WIDTH = 62  # characters of a line
DONE_WIDTH = 125  # characters of what was done
FIRST_DATE, LAST_DATE = 946684800 * 10**9, 4102444800 * 10**9  # ns: the years 2000 to 2100
HOLD = "hold"  # the set-point law that does nothing


def scene_name(run: RecordedRun) -> str:
    """Title of a picture: the scene's name where the recording has it."""
    return run.custom_data.get("scene", "Cable tow")


def what_was_done(run: RecordedRun) -> str:
    """Motion, duration and winch of a run, as far as its recording has them."""
    about = run.custom_data
    motion = about.get("motion")
    time = since_first(run.frames) * 1e-9
    # a tick output stands for what came before it
    seconds = time[-1] + (np.median(np.diff(time)) if len(time) > 1 else 0.0)
    parts = (
        [] if motion is None or motion == "ship plan" else ["no ship motion" if motion == "none" else _motion(motion)]
    )
    parts.append(f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.2g} s")
    if way := about.get("ship_plan"):
        parts.append(f"ship: {way}")
    if plan := about.get("winch_plan"):
        parts.append(f"winch: {plan}")
    if law := _law(about.get("scene_yaml", "")):
        parts.append("no compensation" if law == HOLD else f"compensation {law}")
    return _cut(parts)


def _cut(parts: list[str]) -> str:
    """The parts in one line of at most DONE_WIDTH characters: the longest gives way, behind one of its items."""
    long = max(range(len(parts)), key=lambda k: len(parts[k]))
    room = DONE_WIDTH - sum(len(part) + 2 for k, part in enumerate(parts) if k != long)
    if len(parts[long]) > room:
        parts = [*parts]
        parts[long] = parts[long][: room - 5].rpartition(",")[0] + ", ..."
    return "; ".join(parts)


def _motion(name: str) -> str:
    return name if name.startswith("heave ") else f"ship motion {name}"


def _law(scene: str) -> str:
    """Set-point law of a scene in YAML, "" where the text has none."""
    try:
        data = parse(scene)[0]
    except YamlError:
        return ""
    block = data.get("setpoint") if isinstance(data, dict) else None
    return str(block.get("algorithm", "")) if isinstance(block, dict) else ""


def source_of(run: RecordedRun) -> str:
    """What a picture is made from: version, scene, and the date of the motion where it has one."""
    about, date = run.custom_data, date_of(run)
    parts = [f"simulated by cable_sim_ros {about.get('cable_sim_ros', __version__)}", f"scene {scene_name(run)}"]
    return "; ".join([*parts, *([f"motion from {date}"] if date else [])])


def put_heading(figure: Figure, run: RecordedRun, title: str, stamp: str = "") -> None:
    """Title, what was done under it, and the stamp in the top right corner."""
    figure.text(0.085, 0.945, title, size=18, weight="bold")
    figure.text(0.085, 0.908, what_was_done(run), size=11)
    figure.text(0.085, 0.014, source_of(run), size=9, color=FAINT)
    put_stamp(figure, stamp)


def put_stamp(figure: Figure, stamp: str) -> None:
    """Write over the top right corner why the figures cannot be taken as they are; "" writes nothing."""
    if stamp:
        figure.text(
            0.945,
            0.964,
            textwrap.fill(stamp, STAMP_WIDTH, max_lines=2, placeholder=" ..."),
            size=11,
            weight="bold",
            color="white",
            ha="right",
            va="center",
            bbox={"boxstyle": "round,pad=0.5", "facecolor": STAMP, "edgecolor": "none"},
        )


def force_unit(forces: np.ndarray) -> tuple[float, str]:
    """Factor and unit in which forces [N] read well: kN, N or mN."""
    maximum = float(np.abs(forces).max(initial=0.0))
    return (1e-3, "kN") if maximum >= 1e3 or maximum == 0.0 else (1.0, "N") if maximum >= 1.0 else (1e3, "mN")


def places(maximum: float) -> int:
    """Decimals with which numbers up to ``maximum`` are written: four digits of it, at most two decimals."""
    return max(0, min(2, 4 - len(str(int(abs(maximum))))))


def date_of(run: RecordedRun) -> str:
    """Date and time of the first tick output, by the stamps of the motion; "" where these are no date, as of a heave
    that is made and begins at 0."""
    first = int(run.frames["time"][0]) if len(run.frames) else 0
    if not FIRST_DATE <= first < LAST_DATE:
        return ""
    return f"{datetime.fromtimestamp(first // 10**9, UTC):%Y-%m-%d %H:%M:%S} UTC"
