"""A span in a cross wind, run case by case until its vibration is steady: amplitudes, frequencies, how it locks in.

from cable_sim_ros.runs.span import run_span
for row in run_span("span_in_wind").rows:
    print(row.case, row.vertical_peak_m, row.wake_frequency_hz)
"""

from __future__ import annotations

import os
from collections.abc import Callable
from math import ceil
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..io.load import SceneError
from ..io.span_file import load_span
from ..physics.state import NOW, WAKE
from ..physics.wake import START, WAKE_Q
from ..sim.rig import HALVED
from ..sim.span import Span, SpanCase, SpanLine, natural_frequency, shedding_frequency, span_line

BEGIN, LOOK = 25, 20  # periods for a wake to grow, and at the end over which is measured
SETTLE = 1.2  # time constants of the damping, over zeta in periods, that the vibration is given beside
MOST = 400  # periods of a run


class SpanRow(NamedTuple):
    """Figures of a case, SI. Vertical is across the wind, streamwise along it, both in the middle of the span; rms and
    peak are about the mean of the last LOOK periods."""

    case: str
    length_m: float
    tension_n: float
    wind_m_s: float
    natural_frequency_hz: float  # (A24)
    strouhal_frequency_hz: float  # (A25)
    vertical_rms_m: float
    vertical_peak_m: float
    streamwise_rms_m: float
    streamwise_peak_m: float
    streamwise_mean_m: float  # from the drag, against the span without wind
    end_vertical_peak_m: float  # where the span meets the first sheave; 0 where it is pinned
    vertical_frequency_hz: float
    streamwise_frequency_hz: float
    wake_frequency_hz: float
    wake_amplitude: float  # peak of q
    wake_shift_percent: float  # of its frequency against that of the same wake behind a held cable
    lock_in_width_percent: float  # relative detuning over which this motion holds such a wake, on either side
    steady: bool  # do amplitudes of the two halves of what is measured differ by less than 2 %?
    steps: int


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

    def as_data(self) -> dict:
        """What ``--json`` prints."""
        return {"span": self.span.name, "ends": self.span.ends.value, "cases": [row._asdict() for row in self.rows]}


def run_span(
    span: Span | str | os.PathLike,
    cases: list[str] | None = None,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> SpanRun:
    """Run the cases of a span, or of a span file: all, or those named. Raises SceneError, RigError."""
    if not isinstance(span, Span):
        span = load_span(span)
    names = list(span.cases) if cases is None else cases
    unknown = [name for name in names if name not in span.cases]
    if unknown:
        text = f"case '{unknown[0]}' is not in {span.name}; nothing was run. Known: {', '.join(span.cases)}"
        raise SceneError([text])
    rows, histories = [], {}
    for i, name in enumerate(names):
        progress(name, i, len(names))
        line = span_line(span, span.cases[name])
        histories[name] = vibrate(span, span.cases[name], line)
        rows.append(figures(span, name, line, histories[name]))
    return SpanRun(span, rows, histories)


def periods(span: Span) -> int:
    """How many periods of shedding a run has."""
    return min(BEGIN + LOOK + ceil(SETTLE / max(span.damping_ratio, 1e-9)), MOST)


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


def figures(span: Span, name: str, line: SpanLine, told: SpanHistory) -> SpanRow:
    """The figures of a history."""
    case = span.cases[name]
    last = slice(-LOOK * span.steps, None)
    z, y, end, q = (_about_mean(x[last]) for x in (told.vertical, told.streamwise, told.end, told.wake))
    time = told.time[last]
    wake, free = frequency(time, q), held_frequency(span, case)
    size = float(np.abs(q).max())
    drive = span.wake.coupling * float(np.abs(z).max()) / span.cable.diameter
    shed = case.wind > 0.0 and size > START
    return SpanRow(
        case=name,
        length_m=case.length,
        tension_n=case.tension,
        wind_m_s=case.wind,
        natural_frequency_hz=natural_frequency(span, case),
        strouhal_frequency_hz=shedding_frequency(span, case),
        vertical_rms_m=float(z.std()),
        vertical_peak_m=float(np.abs(z).max()),
        streamwise_rms_m=float(y.std()),
        streamwise_peak_m=float(np.abs(y).max()),
        streamwise_mean_m=float(line.rig.state.q[line.middle, 1] - y[-1]),
        end_vertical_peak_m=float(np.abs(end).max()),
        vertical_frequency_hz=frequency(time, z),
        streamwise_frequency_hz=frequency(time, y),
        wake_frequency_hz=wake,
        wake_amplitude=size,
        wake_shift_percent=100.0 * (wake / free - 1.0) if shed else 0.0,
        lock_in_width_percent=50.0 * drive / size if shed else 0.0,
        steady=_steady(z) and _steady(q),
        steps=len(told.time),
    )


def _about_mean(x: np.ndarray) -> np.ndarray:
    """Less its straight line of best fit: what goes on drifting is no vibration."""
    t = np.linspace(-1.0, 1.0, len(x))
    return x - np.polyval(np.polyfit(t, x, 1), t)


def _steady(x: np.ndarray) -> bool:
    half = len(x) // 2
    first, second = x[:half].std(), x[half:].std()
    return bool(abs(second - first) <= 0.02 * max(first, second))


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


def draw_span(run: SpanRun, path: Path) -> Path:
    """Vertical motion in the middle and its wake, one row a case. RuntimeError where matplotlib is missing."""
    try:
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise RuntimeError("matplotlib is not installed: no picture was drawn; install cable_sim_ros[viz]") from None
    from .picture import BLUE, FAINT, ORANGE, STYLE

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(14.0, 1.2 + 2.6 * len(run.rows)), dpi=80, facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(run.rows), 2, width_ratios=(2.0, 1.0), squeeze=False)
        for (whole, close), row in zip(axes, run.rows, strict=True):
            told = run.histories[row.case]
            near = told.time >= told.time[-1] - 3.0 / max(row.wake_frequency_hz, 1e-9)
            scale, unit = _unit(row.vertical_peak_m)
            whole.plot(told.time, scale * told.vertical, color=BLUE, lw=0.7)
            whole.set_title(f"{row.case}: {row.length_m:g} m, {row.tension_n:g} N, wind {row.wind_m_s:g} m/s")
            whole.set_ylabel(f"vertical [{unit}]")
            close.plot(told.time[near], scale * told.vertical[near], color=BLUE, lw=1.6, label=f"vertical [{unit}]")
            other, small = _unit(row.streamwise_peak_m)
            part = told.streamwise[near] - told.streamwise[near].mean()
            close.plot(told.time[near], other * part, color=ORANGE, lw=1.6, label=f"streamwise [{small}]")
            close.plot(told.time[near], told.wake[near], color=FAINT, lw=1.2, ls="--", label="wake q [1]")
            close.set_title("the last three periods")
            low, high = close.get_ylim()
            close.set_ylim(low, high + 0.25 * (high - low))
            close.legend(loc="upper right", ncols=3, fontsize=9)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Software": None})
    return path


def _unit(size: float) -> tuple[float, str]:
    """Factor and unit in which a length [m] reads well."""
    for factor, unit in ((1.0, "m"), (1e3, "mm"), (1e6, "um")):
        if size * factor >= 1.0:
            return factor, unit
    return 1e6, "um"
