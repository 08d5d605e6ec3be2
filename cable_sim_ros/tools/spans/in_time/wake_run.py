"""A span in time, run case by case until its vibration is steady: amplitudes, frequencies, how it locks in.

from cable_sim_ros import run_span
for row in run_span("span_in_wind").rows:
    print(row.case, row.vertical_peak_m, row.wake_frequency_hz)

The line that a case is begins at rest in its wind; Westin (2018), appendix A. Vortices are shed by the span, not by
what lies on the sheaves and hangs from them.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from math import ceil, pi, radians
from typing import NamedTuple

import numpy as np

from ....errors import RunError
from ....physics.contact_surface import surface_row
from ....physics.drag_laws import DragLaw
from ....physics.fluid import Fluid
from ....physics.integrate import Solver
from ....physics.state import NOW, WAKE
from ....physics.wake_oscillator import MIN_RE, WAKE_Q, WakeLaw
from ....sim.build import lock
from ....sim.flag_rules import FAILED
from ....sim.rig.rig import HALVED, Rig, RigError, cable_of, load_of
from ....sim.verdict import Reason, Verdict, verdict_of
from ..load import checked_span, known_cases, load_span
from ..span_file import (
    LEAD_ELEMENTS,
    Span,
    SpanCase,
    SpanEnds,
    natural_frequency,
    reynolds,
    seat_of,
    shedding_frequency,
    sheds,
    wet_lengths,
)

# largest residual over the tension, for the vibration of a span in air moves forces of a millionth of it; and over EA,
# below which round-off leaves it: places count from the middle of the span, which keeps that small
RESIDUAL, ROUND_OFF = 5e-10, 4e-14
ARC_ELEMENTS, TAIL_ELEMENTS = 6, 2

BEGIN, LOOK = 25, 20  # periods for a wake to grow, and at the end over which is measured
SETTLE = 1.2  # time constants of the damping, over zeta in periods, that the vibration is given beside
MAX = 400  # periods of a run
STEADY = 0.02  # share by which the amplitudes of the two halves of LOOK may differ


class SpanLine(NamedTuple):
    """A span at rest in its wind, and the numbers of its nodes in the middle and where it meets the first sheave."""

    rig: Rig
    middle: int
    end: int


def span_line(span: Span, case: SpanCase) -> SpanLine:
    """The line of a case, settled in its wind without vortices. Raises RigError."""
    build = _over_sheaves if span.ends is SpanEnds.SHEAVES else _pinned
    line = build(span, case)
    settings = line.rig.model.settings.copy()
    settings["tolerance"] = max(RESIDUAL * case.tension, ROUND_OFF * span.cable.axial_stiffness)
    line.rig.model = line.rig.model._replace(settings=lock(settings, settings.dtype))
    line.rig.settle(steps=2000)
    return line


def _numbers(span: Span, case: SpanCase) -> dict:
    """What every line is given."""
    return {
        "tension": case.tension,
        "gravity": span.gravity,
        "water": Fluid(**span.fluid.model_dump(), current=(0.0, case.wind)),
        "mass_damping": 4.0 * pi * natural_frequency(span, case) * span.damping_ratio,
        "solver": Solver(max_iterations=50),
    }


def _wet(span: Span) -> dict:
    """What a section in the wind has."""
    return {"wake": span.wake, "drag_law": DragLaw(span.drag_law.value)}


def _pinned(span: Span, case: SpanCase) -> SpanLine:
    elements, wet = span.elements, _wet(span)
    cable = cable_of([{"length": case.length, "elements": elements, **wet}], **span.cable.model_dump())
    pull = load_of(elements, (case.tension, 0.0, 0.0))
    rig = Rig(cable, held={0: "r", -1: "yz"}, loads=[pull], **_numbers(span, case))
    rig.straight((-0.5 * case.length, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0 + case.tension / span.cable.axial_stiffness)
    return SpanLine(rig, elements // 2, 0)


def _over_sheaves(span: Span, case: SpanCase) -> SpanLine:
    own, sheave, elements, wet = span.cable, span.sheave, span.elements, _wet(span)
    (seat, depth), (leads, rest), half = seat_of(span, case), wet_lengths(span, case), sheave.throat_angle_deg / 2.0
    lies = seat - depth
    tail = {"length": sheave.tail, "elements": TAIL_ELEMENTS}
    arc = {"length": 0.5 * pi * lies, "elements": ARC_ELEMENTS}
    lead = {"length": leads, "elements": LEAD_ELEMENTS, **wet}
    free = {"length": rest, "elements": elements, **wet}
    cable = cable_of([tail, arc, lead, free, lead, arc, tail], **own.model_dump())
    end = TAIL_ELEMENTS + ARC_ELEMENTS
    middle = end + LEAD_ELEMENTS + elements // 2
    surfaces = [
        surface_row(
            (x, 0.0, -seat), seat, 2.0 * radians(half), sheave.groove_depth, 0.5 * own.diameter, sheave.stiffness, 0.3
        )
        for x in (-0.5 * case.length, 0.5 * case.length)
    ]
    mass = case.tension / span.gravity
    # nothing else keeps the cable from running off to one side; what vibrates alike on both does not move the middle on
    rig = Rig(cable, held={middle: "x"}, bodies={0: mass, -1: mass}, surfaces=surfaces, **_numbers(span, case))
    stretch = 1.0 + case.tension / own.axial_stiffness
    s = (rig.arc - rig.arc[middle]) * stretch
    r, g = _hanging(np.abs(s), case, lies, own.mass_per_length * span.gravity / case.tension)
    side = np.where(s < 0.0, -1.0, 1.0)
    r = np.column_stack((side * r[:, 0], 0.0 * s, r[:, 1] - seat))
    rig.place(r, stretch * np.column_stack((g[:, 0], 0.0 * s, side * g[:, 1])))
    return SpanLine(rig, middle, end)


def _hanging(s: np.ndarray, case: SpanCase, radius: float, per_tension: float) -> tuple[np.ndarray, np.ndarray]:
    """Half of the first shape, at lengths s [m] from the middle: places from the middle and the height of the sheave's
    centre, and directions outward [n, 2]. A catenary, the arc, straight down; per_tension: weight/tension [1/m]."""
    angle = 0.0
    for _ in range(100):  # at which the cable meets the sheave, against the level
        angle = np.arctan(np.sinh(per_tension * (0.5 * case.length - radius * np.sin(angle))))
    hangs = np.tan(angle) / per_tension
    x = np.arcsinh(per_tension * np.minimum(s, hangs)) / per_tension
    on = np.clip((s - hangs) / radius, 0.0, angle + 0.5 * pi) - angle  # place round the sheave, from its top
    down = np.maximum(s - hangs - radius * (angle + 0.5 * pi), 0.0)
    low = radius * np.cos(angle) - (np.cosh(per_tension * x.max()) - 1.0) / per_tension
    free = s < hangs
    z = np.where(free, low + (np.cosh(per_tension * x) - 1.0) / per_tension, radius * np.cos(on) - down)
    x = np.where(free, x, 0.5 * case.length + radius * np.sin(on))
    slope = np.where(free, np.arctan(per_tension * s), -on)
    return np.column_stack((x, z)), np.column_stack((np.cos(slope), np.sin(slope)))


class SpanRow(NamedTuple):
    """Figures of a case, SI: FIELDS. Vertical is across the wind, streamwise along it, both in the middle of the span;
    rms and peak are about the mean of the last LOOK periods. None: nothing is shed, so that nothing vibrates."""

    case: str
    length_m: float
    tension_n: float
    wind_m_s: float
    natural_frequency_hz: float
    strouhal_frequency_hz: float
    reynolds: float
    vertical_rms_m: float
    vertical_peak_m: float
    streamwise_rms_m: float
    streamwise_peak_m: float
    streamwise_mean_m: float
    end_vertical_peak_m: float
    vertical_frequency_hz: float | None
    streamwise_frequency_hz: float | None
    wake_frequency_hz: float | None
    wake_amplitude: float | None
    wake_shift_percent: float | None
    lock_in_width_percent: float | None
    steady: bool | None
    steps: int


FIELDS = {  # unit and meaning
    "case": ("", "name of the case"),
    "length_m": ("m", "length of the span, as given"),
    "tension_n": ("N", "tension, as given"),
    "wind_m_s": ("m/s", "wind across the span, as given"),
    "natural_frequency_hz": ("Hz", "first natural frequency (A24), with the added mass of the fluid"),
    "strouhal_frequency_hz": ("Hz", "St U/d (A25)"),
    "reynolds": (
        "",
        f"of the wind on the diameter; up to {MIN_RE:g} nothing is shed, and what follows from a wake is null",
    ),
    "vertical_rms_m": ("m", "rms across the wind in the middle of the span"),
    "vertical_peak_m": ("m", "its peak"),
    "streamwise_rms_m": ("m", "rms along the wind in the middle of the span"),
    "streamwise_peak_m": ("m", "its peak"),
    "streamwise_mean_m": ("m", "by the drag, against the span without wind"),
    "end_vertical_peak_m": ("m", "peak across the wind where the span meets the first sheave; 0 where it is pinned"),
    "vertical_frequency_hz": ("Hz", "of the vibration across the wind"),
    "streamwise_frequency_hz": ("Hz", "of that along it"),
    "wake_frequency_hz": ("Hz", "of the wake in the middle"),
    "wake_amplitude": ("", "peak of its q"),
    "wake_shift_percent": ("%", "its frequency against that of the same wake behind a held cable"),
    "lock_in_width_percent": ("%", "detuning, on either side, over which this motion holds such a wake: 50 a3 (Y/d)/q"),
    "steady": (
        "",
        f"do the amplitudes of the two halves of what is measured differ by less than {100.0 * STEADY:g} %?",
    ),
    "steps": ("", "time steps of the run"),
}
MEASURED = tuple(name for name in FIELDS if name.endswith(("_rms_m", "_peak_m")) or name.startswith(("wake", "lock")))


class SpanHistory(NamedTuple):
    """The middle of the span over time."""

    time: np.ndarray  # s
    vertical: np.ndarray  # m, from the rest in the wind
    streamwise: np.ndarray
    end: np.ndarray  # m, vertical, where the span meets the first sheave
    wake: np.ndarray  # q


class SpanRun(NamedTuple):
    span: Span
    rows: list[SpanRow]
    histories: dict[str, SpanHistory]

    @property
    def notices(self) -> list[str]:
        """Cases without vortices."""
        off = self.span.wake.law is WakeLaw.OFF
        return [
            f"{row.case}: nothing is shed, "
            + ("for span.wake.law is off" if off else f"the Reynolds number {row.reynolds:.3g} is not above {MIN_RE:g}")
            + ": no wake, and no vibration by it"
            for row in self.rows
            if not sheds(self.span, row.wind_m_s)
        ]

    @property
    def verdict(self) -> Verdict:
        """Doubtful where a case is not steady."""
        return verdict_of(
            Reason(
                "NOT_STEADY",
                0.0,
                0.0,
                MEASURED,
                f"{row.case}: over the last {LOOK} of {row.steps // self.span.steps} periods the amplitude goes on "
                f"changing, by more than {100.0 * STEADY:g} % from one half to the other: it grows, fades or beats, "
                "and rms and peaks are not those of a steady vibration. More span.damping_ratio "
                f"(= {self.span.damping_ratio:g}) is steady sooner; at the edge of lock-in it beats for ever",
            )
            for row in self.rows
            if row.steady is False
        )

    def as_data(self) -> dict:
        """What ``--json`` prints."""
        return {
            "span": self.span.name,
            "ends": self.span.ends.value,
            "cases": [row._asdict() for row in self.rows],
            "notices": self.notices,
            "verdict": self.verdict.as_dict(),
        }


class SpanRunError(RunError):
    """A case that could not be solved; ``flag``: NO_START, HALTED."""

    def __init__(self, text: str, flag: str):
        super().__init__(text)
        self.verdict = Verdict(FAILED, (Reason(flag, 0.0, 0.0, MEASURED, text),))


def run_span(
    span: Span | str | os.PathLike,
    cases: list[str] | None = None,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> SpanRun:
    """Run the cases of a span, or of a span file: all, or those named. Raises SceneError, SpanRunError."""
    if isinstance(span, Span):
        origin, span = span.name, checked_span(span, span.name)
    else:
        origin, span = os.fspath(span), load_span(span)
    names = list(span.cases) if cases is None else cases
    known_cases(span, names)
    rows, histories = [], {}
    for i, name in enumerate(names):
        progress(name, i, len(names))
        flag = "NO_START"
        try:
            line = span_line(span, span.cases[name])
            flag = "HALTED"
            histories[name] = vibrate(span, span.cases[name], line)
        except RigError as error:
            what = "finds no rest in its wind" if flag == "NO_START" else "could not be run on"
            raise SpanRunError(f"{origin}: span.cases.{name} {what}: {error}; no case has figures", flag) from None
        rows.append(metrics(span, name, line, histories[name]))
    return SpanRun(span, rows, histories)


def periods(span: Span) -> int:
    """How many periods of shedding a run has."""
    return min(BEGIN + LOOK + ceil(SETTLE / max(span.damping_ratio, 1e-9)), MAX)


def vibrate(span: Span, case: SpanCase, line: SpanLine) -> SpanHistory:
    """Let a settled span vibrate until it is steady; without wind by the period of its own."""
    frequency = shedding_frequency(span, case) or natural_frequency(span, case)
    step, count = 1.0 / (span.steps * frequency), periods(span) * span.steps
    rig, rest, seen = line.rig, line.rig.state.q.copy(), np.zeros((count, 4))
    for i in range(count):
        for _ in rig.steps(step, rules=HALVED):
            pass
        moved = rig.state.q[line.middle] - rest[line.middle]
        end = rig.state.q[line.end, 2] - rest[line.end, 2]
        seen[i] = moved[2], moved[1], end, rig.state.nodes[NOW, WAKE, line.middle, WAKE_Q]
    return SpanHistory(step * np.arange(1, count + 1), *seen.T)


def metrics(span: Span, name: str, line: SpanLine, report: SpanHistory) -> SpanRow:
    """The figures of a history."""
    case = span.cases[name]
    last = slice(-LOOK * span.steps, None)
    z, y, end, q = (_about_mean(x[last]) for x in (report.vertical, report.streamwise, report.end, report.wake))
    time = report.time[last]
    wake, free, shed = frequency(time, q), held_frequency(span, case), sheds(span, case.wind)
    size = float(np.abs(q).max())
    drive = span.wake.coupling * float(np.abs(z).max()) / span.cable.diameter
    return SpanRow(
        case=name,
        length_m=case.length,
        tension_n=case.tension,
        wind_m_s=case.wind,
        natural_frequency_hz=natural_frequency(span, case),
        strouhal_frequency_hz=shedding_frequency(span, case),
        reynolds=reynolds(span, case.wind),
        vertical_rms_m=float(z.std()),
        vertical_peak_m=float(np.abs(z).max()),
        streamwise_rms_m=float(y.std()),
        streamwise_peak_m=float(np.abs(y).max()),
        streamwise_mean_m=float(line.rig.state.q[line.middle, 1] - y[-1]),
        end_vertical_peak_m=float(np.abs(end).max()),
        vertical_frequency_hz=frequency(time, z) if shed else None,
        streamwise_frequency_hz=frequency(time, y) if shed else None,
        wake_frequency_hz=wake if shed else None,
        wake_amplitude=size if shed else None,
        wake_shift_percent=100.0 * (wake / free - 1.0) if shed else None,
        lock_in_width_percent=50.0 * drive / size if shed else None,
        steady=_steady(z) and _steady(q) if shed else None,
        steps=len(report.time),
    )


def _about_mean(x: np.ndarray) -> np.ndarray:
    """Less its straight line of best fit: what goes on drifting is no vibration."""
    t = np.linspace(-1.0, 1.0, len(x))
    return x - np.polyval(np.polyfit(t, x, 1), t)


def _steady(x: np.ndarray) -> bool:
    half = len(x) // 2
    first, second = x[:half].std(), x[half:].std()
    return bool(abs(second - first) <= STEADY * max(first, second))


def frequency(time: np.ndarray, x: np.ndarray) -> float:
    """Mean frequency [Hz] of a vibration about zero from its crossings upward; 0: fewer than two."""
    up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    if len(up) < 2:
        return 0.0
    crossings = time[up] - x[up] * (time[up + 1] - time[up]) / (x[up + 1] - x[up])
    return float((len(up) - 1) / (crossings[-1] - crossings[0]))


def held_frequency(span: Span, case: SpanCase) -> float:
    """Frequency [Hz] of the same wake behind a held cable: that of Strouhal, made slower by the damping's work.

    van der Pol's (1 - eps^2/16 + 17 eps^4/3072) with eps = a1: 0.5 % for 0.3.
    """
    e2 = span.wake.growth**2
    return shedding_frequency(span, case) * (1.0 - e2 / 16.0 + 17.0 * e2 * e2 / 3072.0)
