"""What is drawn at once: a tick output with the shape of the cable and the contact that were published with it.

A recorded run is moments, one for each shape of the cable in the bag, with its verdict. Alarms, verdict and figures of
a moment in words; what strip charts show, and their scale; colours of the page; errors that end `cable-sim view` and
`film`: input that cannot be shown (code 2), or a page that cannot be served (1).
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable
from html import escape
from importlib import import_module
from types import ModuleType
from typing import NamedTuple

import numpy as np

from ...errors import CableSimError, RunError, told_as
from ...io.bags.bag import DamageWarning
from ...io.messages.markers import Colours
from ...io.recordings.recorded_run import load_run, places_of, scene_of_recording
from ...physics.tick_output import CONTACT_COLUMNS, SHAPE_COLUMNS, Flag
from ...physics.towbody import BodyModel
from ...runs import mean_track
from ...runs.summary import pitch_and_roll, since_first
from ...runs.verdict import judge
from ...sim.flag_rules import DAMAGE, DOUBTFUL, FAILED, OK, RULES
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from ...sim.verdict import Reason, Verdict, check

RULE = {rule.flag: rule for rule in RULES}
GREEN, AMBER, RED, GREY = "#1f7a4d", "#b45f06", "#b3261e", "#5f6b76"
OF_STATE = {OK: GREEN, DOUBTFUL: AMBER, FAILED: RED}

CHART_POINTS = 240  # pieces of a chart, of which least and largest are kept

COLUMN = {name: k for k, (name, _) in enumerate(CONTACT_COLUMNS)}
ARC = [name for name, _ in SHAPE_COLUMNS].index("arc_length")
POINTS, FINE = 240, 400  # of the cable, about; nodes beyond which it is drawn straight between them
NO_CONTACT = np.zeros((0, len(CONTACT_COLUMNS)))


def alarms(status: int) -> list[tuple[str, str, str]]:
    """(flag, what it says, colour) of each flag set in a status word, the worst first."""
    found = []
    for flag in Flag:
        if flag and status & flag:
            rule = RULE.get(flag.name or "")
            state = rule.state if rule else OK
            alarm = rule is not None and rule.alarm
            rank = 0 if state == FAILED else 1 if alarm and state == DOUBTFUL else 2 if alarm else 3
            colour = RED if state == FAILED else AMBER if alarm else GREY
            found.append((rank, flag.name or "", flag.text, colour))
    return [(name, text, colour) for _, name, text, colour in sorted(found)]


def force(newton: float) -> str:
    """A force as it is read: N below one kN."""
    return f"{newton / 1e3:.2f} kN" if abs(newton) >= 1e3 else f"{newton:.1f} N"


def figures(frame) -> list[tuple[str, str]]:
    """Name and value of what is read off first."""
    speed = float(np.hypot(*frame["ship_velocity"][:2]))
    return [
        ("tension, sheave", force(float(frame["tension"]))),
        ("tension, drum", force(float(frame["tension_drum"]))),
        ("pay-out", f"{float(frame['payout']):.2f} m"),
        ("pay-out rate", f"{float(frame['payout_rate']):+.2f} m/s"),
        ("towbody depth", f"{-float(frame['body_position'][2]):.1f} m"),
        ("layback", f"{float(frame['layback']):.1f} m"),
        ("departure angle", f"{np.degrees(float(frame['departure_angle'])):.1f}°"),
        ("wrap angle", f"{np.degrees(float(frame['wrap_angle'])):.0f}°"),
        ("ship's speed", f"{speed:.2f} m/s"),
        ("sheave height", f"{float(frame['sheave_position'][2]):+.2f} m"),
    ]


def pill(text: str, colour: str) -> str:
    """A word on a coloured ground."""
    return (
        f'<span style="background:{colour};color:#fff;border-radius:4px;padding:2px 8px;font-weight:700">'
        f"{escape(text)}</span>"
    )


def verdict_html(verdict: Verdict, of: str) -> str:
    """State and each reason in a sentence."""
    rows = "".join(f'<div style="margin-top:3px">{escape(str(reason))}</div>' for reason in verdict.reasons)
    return f"<div>{escape(of)} {pill(verdict.state, OF_STATE.get(verdict.state, GREY))}{rows}</div>"


def lines_html(title: str, rows: Iterable[tuple[str, str, str]]) -> str:
    """A line for each name, text and colour; one that says so where there is none."""
    lines = "".join(
        f'<div style="margin-top:3px"><b style="color:{colour}">{escape(name)}</b> {escape(text)}</div>'
        for name, text, colour in rows
    )
    return f"<div>{title}: {f'</div>{lines}' if lines else 'none</div>'}"


def alarms_html(status: int) -> str:
    """Flags of this moment."""
    return lines_html("alarms now", alarms(status))


def figures_html(frame) -> str:
    """`figures`, two in a row."""
    cells = "".join(
        f'<div style="display:flex;justify-content:space-between"><span style="opacity:.7">{escape(name)}</span>'
        f'<b style="font-variant-numeric:tabular-nums">{escape(value)}</b></div>'
        for name, value in figures(frame)
    )
    return f'<div style="display:grid;grid-template-columns:1fr 1fr;gap:1px 18px;font-size:13px">{cells}</div>'


class Strip(NamedTuple):
    """One chart: title with unit, colour, and its value from tick outputs (an array of them)."""

    title: str
    colour: str
    of: Callable[[np.ndarray], np.ndarray]
    least: float  # span of the scale, at least


def strips_of(scene: Scene, forces: Colours) -> tuple[Strip, ...]:
    """The charts of a scene; forces: their unit. A scale spans at least a thousandth of the cable, or so of tension."""
    least = 1e-3 * sum(section.length for section in scene.cable.sections.values())
    swing = 4e-3 * scene.contact.working_tension / forces.divisor
    charts = (
        Strip(f"tension at the sheave [{forces.unit}]", "#1f6fb2", lambda f: f["tension"] / forces.divisor, swing),
        Strip("depth of the towbody [m]", "#d4651b", lambda f: -f["body_position"][..., 2], least),
        Strip("pay-out [m]", "#6a4c9c", lambda f: f["payout"], least),
        Strip("height of the sheave above mean water [m]", "#2a8a5e", lambda f: f["sheave_position"][..., 2], least),
    )
    if scene.towbody.model is not BodyModel.RIGID:
        return charts
    return (*charts, Strip("pitch of the towbody, nose up [deg]", "#c23b33", lambda f: pitch_and_roll(f)[0], 0.5))


def scale(value: np.ndarray, least: float) -> tuple[float, float]:
    """Ends of the scale: what there is with a tenth of room, and at least a span."""
    good = value[np.isfinite(value)]
    if not len(good):
        return 0.0, least
    low, high = float(good.min()), float(good.max())
    span = max(high - low, least, 1e-3 * abs(high))
    middle = 0.5 * (low + high)
    return middle - 0.6 * span, middle + 0.6 * span


class ViewError(CableSimError, ValueError):
    """What was given cannot be drawn; the text says why and what to give."""


class PageError(RunError):
    """What was given is right, but no page or film came of it."""


def need(module: str, what: str, package: str | None = None) -> ModuleType:
    """A module of the extra `view`; ViewError in one line where it is missing. package: its name where it differs."""
    after = "; nothing was drawn. Install it: pip install 'cable_sim_ros[view]'"
    with told_as(ViewError, f"{what} needs {package or module}, which cannot be imported", after, ImportError):
        return import_module(module)


class Moment(NamedTuple):
    """One moment of a tow. seconds: since the start; frame: record of TICK_OUTPUT; shape: columns of SHAPE_COLUMNS;
    contact: of CONTACT_COLUMNS, in the axes of sheave_link."""

    seconds: float
    frame: np.record
    shape: np.ndarray
    contact: np.ndarray


def smooth_shape(shape: np.ndarray) -> np.ndarray:
    """The table with slopes behind it, as `cable_points` takes it: through three nodes each, by arc length.

    A message has no slopes; a parabola's do not overshoot where long elements follow short ones.
    """
    place, arc = shape[:, :3], shape[:, ARC]
    step = np.maximum(np.diff(arc), 1e-9)[:, None]
    chord = np.diff(place, axis=0) / step
    slope = np.empty_like(place)
    slope[1:-1] = (chord[:-1] * step[1:] + chord[1:] * step[:-1]) / (step[1:] + step[:-1])
    slope[0], slope[-1] = (2.0 * chord[0] - slope[1], 2.0 * chord[-1] - slope[-2]) if len(shape) > 2 else chord[[0, 0]]
    return np.column_stack((shape[:, : len(SHAPE_COLUMNS)], slope))


def parts_of(shape: np.ndarray) -> int:
    """Points an element, so that the line looks smooth: fewer where the mesh is fine."""
    return 1 if len(shape) > FINE else min(8, max(4, POINTS // max(len(shape) - 1, 1)))


class BagRun:
    """Moments of a bag; `run`: as recorded; `seconds`: of each tick output, `times`: of each moment, since the start.

    ViewError where the bag has no shapes, BagError where it keeps no scene and none is given.
    """

    def __init__(self, path: str | os.PathLike, scene: str | None = None) -> None:
        self.path = os.fspath(path)
        with warnings.catch_warnings(record=True, action="always") as said:
            self.run = load_run(path)
        for one in said:  # on to the user, who gets exit code 3 for a damaged bag
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
        damage = "; ".join(str(one.message) for one in said if issubclass(one.category, DamageWarning))
        with warnings.catch_warnings(action="ignore"):  # said when it was simulated
            unknown = "that ship, sheave and towbody are not known: nothing was drawn"
            self.scene = scene_of_recording(self.run.custom_data, self.path, scene, unknown)
        if not self.run.shapes:
            raise ViewError(
                f"bag '{self.path}' has no cable/shape: there is no cable to draw, and nothing was drawn. Record that "
                "topic too, or make a bag that has it: cable-sim replay BAG --out FOLDER"
            )
        frames = self.run.frames
        self.seconds = 1e-9 * since_first(frames)
        self.at = places_of([time for time, _ in self.run.shapes], frames)
        self.times = self.seconds[self.at]
        stamps = [time for time, _ in self.run.contacts]
        self.contact_at = places_of(stamps, frames) if stamps else np.zeros(0, int)
        self.verdict: Verdict = judge(
            frames, self.scene, doubts(self.scene, frames, damage, "ship_plan" in self.run.custom_data)
        )

    def __len__(self) -> int:
        return len(self.times)

    @property
    def length(self) -> float:
        """Seconds from the first moment to the last."""
        return float(self.times[-1] - self.times[0])

    def index(self, seconds: float) -> int:
        """The newest moment at a time since the first moment [s]."""
        at = int(np.searchsorted(self.times - self.times[0], seconds + 1e-6, side="right")) - 1
        return min(max(at, 0), len(self) - 1)

    def moment(self, k: int) -> Moment:
        """What was recorded at place k, the contact of that tick or the last one before it."""
        tick = int(self.at[k])
        place = int(np.searchsorted(self.contact_at, tick, side="right")) - 1
        contact = self.run.contacts[place][1] if place >= 0 else NO_CONTACT
        return Moment(float(self.times[k] - self.times[0]), self.run.frames[tick], self.run.shapes[k][1], contact)


def doubts(scene: Scene, frames: np.recarray, damage: str, planned: bool) -> list[Reason]:
    """What makes a run doubtful beside its flags, as far as a bag tells; planned: its ship went by a plan."""
    yaw = angles_of(*frames[0]["ship_quaternion"].tolist())[2]
    with warnings.catch_warnings(action="ignore"):  # said when it was simulated
        found = [] if planned else mean_track.look(scene, yaw, frames)
        found += mean_track.pitch_sign(frames)
    return [*found, *([check(DAMAGE, damage)] if damage else [])]
