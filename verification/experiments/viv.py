"""The four printed computations of Capozucca (1988): frequencies, damping, Green's function, rms displacement.

The source is a computation, no experiment: what is measured elsewhere is printed here. Its grids and its printed
damping ratios are used where a row says so.
"""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.plots.run import BLUE, INK, ORANGE, WATER, canvas
from cable_sim_ros.tools.spans.in_frequency import sensitivity
from cable_sim_ros.tools.spans.in_frequency.files import changed, load_span
from cable_sim_ros.tools.spans.in_frequency.modes import frequencies
from cable_sim_ros.tools.spans.in_frequency.response import Vibration, damped, parts, vibration, wave
from cable_sim_ros.tools.spans.in_frequency.span import Line, Reading, Span

from . import Comparison, Result, unjudged
from .table import markdown

INCH, FOOT_PER_POUND, PSI = 0.0254, 0.3048 / 4.4482216152605, 6894.757293168
SOURCE = "Capozucca (1988)"
TOP_QUARTER = "printed as if the top quarter of the current were resonant with mode 14, not 16; cause unknown"
NO_RULE = "no rule that was tried gives all four"
LIFT = "the lift spectrum is not printed"
RISER_LIFT = LIFT + "; the ratios of modes 13 to 16 count too"
FITTED = "fitted, not the default"


class Case(NamedTuple):
    file: str
    figure: str  # of the output
    frequency: float  # Hz, printed, of mode 1
    ratios: tuple[float, ...]  # printed
    allowed: float  # of the ratios, absolute where all modes agree, else a share
    why: dict[int, str]  # of modes that are apart
    rms: float | None  # m, printed, at response.place; None: not in the copy at hand
    rms_allowed: float  # share of it: what the missing lift spectrum leaves open
    rms_why: str
    finer: int  # segments and steps of the converged response, times those of the source


RISER_RATIOS = (0.797, 0.411, 0.275, 0.208, 0.167, 0.140, 0.121, 0.105, 0.093, 0.085, 0.077, 0.070) + (
    0.049, 0.038, 0.049, 0.053,
)  # fmt: skip
CASES = (
    Case("capozucca_5_5", "5.6", 0.923, (0.235, 0.131, 0.068, 0.045), 5e-4, {}, 0.582 * INCH, 0.1, LIFT, 8),
    Case("capozucca_5_7", "5.8", 0.926, (0.234, 0.131, 0.068, 0.044), 5e-4, {}, 0.587 * INCH, 0.1, LIFT, 8),
    Case("capozucca_5_11", "5.12", 1.084, (0.183, 0.105, 0.040, 0.060), 0.02, {1: NO_RULE}, None, 0.1, LIFT, 8),
    Case(
        "capozucca_5_15", "5.16", 0.053, RISER_RATIOS, 0.07, dict.fromkeys((13, 14, 15, 16), TOP_QUARTER), 5.929 * INCH,
        0.4, RISER_LIFT, 2,
    ),
)  # fmt: skip


def as_printed(case: Case) -> Span:
    """The case with the printed damping ratios, on the source's grids."""
    return changed(load_span(case.file), damping={"ratios": case.ratios})


def converged(span: Span, finer: int) -> Span:
    """So many times as many segments and steps of the spectra, and the damping integral converged."""
    r = span.response
    assert r.frequency_step is not None and r.frequencies is not None
    grid = {
        "segments": finer * r.segments,
        "frequency_step": r.frequency_step / finer,
        "frequencies": finer * r.frequencies,
    }
    return changed(span, response=grid, damping={"segments": 4000})


def experiment(progress) -> Result:
    """All four cases."""
    rows: list[Comparison] = []
    shown: list[tuple[Case, Vibration, Vibration]] = []
    for i, case in enumerate(CASES):
        progress(f"fig. {case.figure}", i, len(CASES))
        span = load_span(case.file)
        computed, printed = vibration(span), vibration(as_printed(case))
        fine = vibration(converged(as_printed(case), case.finer))
        shown.append((case, printed, fine))
        rows += mode_rows(case, computed)
        rows += _rms(case, span, printed, fine)
    rows += green_rows() + _stiffness()
    result = Result("viv", rows, [], lambda folder: draw(shown, folder / "viv_response.png"))
    return result._replace(tables=lambda: [markdown(result), *_sensitivity()], shown=_sensitivity)


def _sensitivity() -> list[str]:
    """What each choice otherwise changes in the case of fig. 5.7."""
    changes = sensitivity.sensitivity(load_span("capozucca_5_7"))
    return ["Chosen otherwise, changes in the case of fig. 5.7 (`capozucca_5_7`):", sensitivity.markdown(changes)]


def mode_rows(case: Case, computed: Vibration) -> list[Comparison]:
    """Frequency of mode 1 and the damping ratios."""
    name = f"fig. {case.figure}, frequency of mode 1"
    rows = [Comparison(name, "Hz", float(computed.frequencies[0]), case.frequency, 5e-4, SOURCE)]
    for n, (ours, printed) in enumerate(zip(computed.damping_ratios, case.ratios, strict=True), 1):
        allowed = case.allowed * printed if case.why else case.allowed
        name = f"fig. {case.figure}, damping ratio of mode {n}"
        rows.append(Comparison(name, "-", float(ours), printed, allowed, SOURCE, case.why.get(n, "")))
    return rows


def _rms(case: Case, span: Span, printed: Vibration, fine: Vibration) -> list[Comparison]:
    """Rms displacement at the printed place, by grids, ratios and readings."""
    fraction = printed.place / span.cable.length
    name = f"fig. {case.figure}, rms displacement at {fraction:g} of the length"
    value = None if case.rms is None else 1e3 * case.rms
    allowed = None if value is None else value * case.rms_allowed

    def row(what: str, result: Vibration, reason: str = case.rms_why) -> Comparison:
        ours = 1e3 * result.place_rms_displacement
        return Comparison(f"{name}, {what}", "mm", ours, value, allowed, SOURCE, reason)

    rows = [row("printed ratios, source's grid", printed), row("printed ratios, converged", fine)]
    rows.append(row("own ratios, converged", vibration(converged(span, case.finer))))
    for reading in (Reading.B, Reading.C):
        other = vibration(changed(as_printed(case), lift={"reading": reading}))
        rows.append(row(f"reading {reading.value}, a fit", other, FITTED))
    if case.figure == "5.16":
        low = vibration(changed(as_printed(case), response={"place": 0.125 * span.cable.length}))
        name = f"fig. {case.figure}, rms displacement at 0.125 of the length, printed ratios, source's grid"
        rows.append(unjudged(name, "mm", 1e3 * low.place_rms_displacement, SOURCE, RISER_LIFT))
    return rows


def green(line: Line, s, x, omega, rate) -> np.ndarray:
    """G(s, x) [m/N]: displacement at s by a unit force at x; omega [rad/s], rate = r/m_t [1/s]. Shapes broadcast."""
    low, high = np.minimum(s, x), np.maximum(s, x)
    first, last, left = line.travel_time(low), line.travel_time(high), line.time_left(high)
    amplitude = 1.0 / np.sqrt(line.impedance(s) * line.impedance(x))
    crossing = np.asarray(line.crossing)
    out = 0.0
    for mu, factor in parts(line, damped(omega, rate)):
        both = wave(mu, first) * wave(mu, left) / wave(mu, crossing)
        out = out + factor / mu * both * np.exp(mu.imag * (last - first))
    return out * amplitude


def green_rows() -> list[Comparison]:
    """|G| at the middle for a force there, mode 3, damping ratio 0.068."""
    rows = []
    for case, f, printed in zip(CASES[:2], (2.77, 2.78), (0.0279, 0.0276), strict=True):
        line = Line(load_span(case.file))
        middle, omega = 0.5 * line.length, 2.0 * pi * f
        ours = float(abs(green(line, middle, middle, omega, 2.0 * 0.068 * omega)))
        name, want = f"fig. {case.figure}, Green's function at the middle, {f} Hz", 1e3 * printed * FOOT_PER_POUND
        rows.append(Comparison(name, "mm/N", 1e3 * ours, want, want * 0.006, f"{SOURCE} p. 36"))
    return rows


def _stiffness() -> list[Comparison]:
    """What the pipe's bending stiffness adds to the frequency of mode 16 of the riser."""
    span = load_span(CASES[3].file)
    second_moment = pi / 64.0 * ((9.625 * INCH) ** 4 - (8.375 * INCH) ** 4)
    stiff = changed(span, cable={"bending_stiffness": 29e6 * PSI * second_moment})
    ratio = frequencies(Line(stiff), 16)[15] / frequencies(Line(span), 16)[15]
    name, change = "fig. 5.16, bending stiffness (E = 29e6 psi) on mode 16", 100.0 * float(ratio - 1.0)
    return [Comparison(name, "%", change, 8.0, 1.0, f"{SOURCE} p. 55, (5.21)")]


def draw(shown: list[tuple[Case, Vibration, Vibration]], path: Path) -> Path:
    """Displacement spectra at the printed places, with the rms. RuntimeError where matplotlib is missing."""
    with canvas(
        path,
        (14.0, 9.5),
        "Vibration of a cable in sheared flow: displacement",
        f"figure numbers and printed rms: {SOURCE}",
    ) as figure:
        panels = figure.subplots(2, 2)
        for axis, (case, coarse, fine) in zip(panels.flat, shown, strict=True):
            top = fine.displacement_spectrum.max() * 1e6
            axis.axvspan(*fine.shedding, color=WATER, alpha=0.35, lw=0, label="shedding along the cable")
            for n, f_n in enumerate(fine.frequencies):
                axis.axvline(f_n, color=ORANGE, lw=0.9, ls=(0, (4, 3)), label=None if n else "frequencies of the modes")
            axis.semilogy(fine.frequency, fine.displacement_spectrum * 1e6, color=BLUE, lw=1.8, label="converged grid")
            every = 1 + len(coarse.frequency) // 120
            points = slice(every - 1, None, every)
            axis.plot(
                coarse.frequency[points], coarse.displacement_spectrum[points] * 1e6, "o", color=INK, ms=4,
                label="source's grid",
            )  # fmt: skip
            seen = np.flatnonzero(fine.displacement_spectrum * 1e6 > 1e-5 * top)
            axis.set(xlim=(0.0, fine.frequency[seen[-1]]), ylim=(1e-5 * top, 10.0 * top))
            printed = "not at hand" if case.rms is None else f"{1e3 * case.rms:.2f} mm"
            grids = [f"{1e3 * result.place_rms_displacement:.2f} mm" for result in (coarse, fine)]
            axis.text(
                0.985, 0.96, f"rms printed: {printed}\nours, source's grid: {grids[0]}\nours, converged: {grids[1]}",
                transform=axis.transAxes, ha="right", va="top", linespacing=1.4, size=11, color=INK, zorder=5,
            )  # fmt: skip
            axis.set(title=f"fig. {case.figure}: displacement at {fine.place / fine.arc[-1]:g} of the length")
            axis.set(xlabel="frequency [Hz]", ylabel="density [mm$^2$/Hz]")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return path
