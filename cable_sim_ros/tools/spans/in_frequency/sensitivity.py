"""What the response changes by where a choice is made otherwise: grids, damping ratios, lift, flow.

A vibration on the terminal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from ....terminal import markdown_table, print_table, say
from .files import SpanError, changed
from .response import Vibration, leading, vibration
from .span import Correlation, Method, Reading, Region, Shape, Span

COLUMNS = ("choice", "rms there %", "largest rms %", "acceleration %", "zeta_1 %", "least zeta %")

DEFAULT = "default"  # source of a number that is nobody's choice
MAX_MODES = 20  # of the table and the picture
MAX_PLACES = 9  # of the table along the cable


class Change(NamedTuple):
    choice: str
    place: float  # of the rms displacement at the place, as a fraction
    largest: float  # of the largest rms displacement
    acceleration: float  # of the rms acceleration at the place
    first_ratio: float  # of the damping ratio of mode 1
    least_ratio: float  # of the least damping ratio


def choices(span: Span, base: Vibration) -> dict[str, dict[str, dict]]:
    """Changes by name: values by block. Left out is what changes nothing, or leaves the range of a key."""
    response, lift, flow = span.response, span.lift, span.flow

    def spectra(factor: float) -> dict:
        if response.frequency_step is None:
            return {"steps_per_half_width": response.steps_per_half_width / factor}
        return {"frequency_step": base.frequency_step * factor, "frequencies": round(len(base.frequency) / factor)}

    def ratios(factor: float) -> dict:
        return {"ratios": (base.damping_ratios * factor).tolist()}

    def region(law: Region) -> dict:
        return {"region": law, "ratios": ()}

    back = [0.0, *(span.cable.length - np.array(flow.arc[-2:0:-1])), span.cable.length]
    reversed_flow = {"arc": back, "speed": flow.speed[::-1]}
    other = {Method.WKB: Method.EXACT, Method.EXACT: Method.WKB}[response.method]
    shape = {Shape.WKB: Shape.SINE, Shape.SINE: Shape.WKB}[span.damping.mode_shape]
    names = {Shape.WKB: "WKB", Shape.SINE: "plain sine"}
    out: dict[str, dict[str, dict]] = {
        "half as many segments": {"response": {"segments": max(4, response.segments // 2)}},
        "twice as many segments": {"response": {"segments": 2 * response.segments}},
        "segments times 4, step of the spectra / 4": {
            "response": {"segments": min(5000, 4 * response.segments), **spectra(0.25)}
        },
        "step of the spectra doubled": {"response": spectra(2.0)},
        "step of the spectra halved": {"response": spectra(0.5)},
        "response by the other method": {"response": {"method": other}},
        "damping ratios - 15 %": {"damping": ratios(0.85)},
        "damping ratios + 15 %": {"damping": ratios(1.15)},
        "damping ratios halved": {"damping": ratios(0.5)},
        "damping integral on 20 segments": {"damping": {"segments": 20, "ratios": ()}},
        "damping integral on 4000 segments": {"damping": {"segments": 4000, "ratios": ()}},
        f"damping with the {names[shape]} shape": {"damping": {"mode_shape": shape, "ratios": ()}},
        "driven part: half the modal spacing": {"damping": region(Region.HALF_SPACING)},
        "driven part: a correlation length each way": {"damping": region(Region.CORRELATION_LENGTH)},
        "no driven part: all of the cable damps": {"damping": region(Region.OFF)},
        "motion factor of the damping 1.3": {"damping": {"motion_factor": 1.3, "ratios": ()}},
        "structural damping doubled": {"damping": {"structural": 2.0 * span.damping.structural, "ratios": ()}},
        "reading A of the lift": {"lift": {"reading": Reading.A}},
        "reading B of the lift": {"lift": {"reading": Reading.B}},
        "reading C of the lift": {"lift": {"reading": Reading.C}},
        "exponential correlation": {"lift": {"correlation": Correlation.EXPONENTIAL}},
        "correlation length / sqrt 2": {"lift": {"correlation_length": base.correlation_length / sqrt(2.0)}},
        "correlation length doubled": {"lift": {"correlation_length": 2.0 * base.correlation_length}},
        "no harmonics": {"lift": {"mean_squares": lift.mean_squares[:1]}},
        "mean squares taken as rms values": {"lift": {"mean_squares": [c * c for c in lift.mean_squares]}},
        "turbulence halved": {"flow": {"turbulence": 0.5 * flow.turbulence}},
        "turbulence doubled": {"flow": {"turbulence": 2.0 * flow.turbulence}},
        "Strouhal number + 10 %": {"flow": {"strouhal": 1.1 * flow.strouhal}},
        "flow the other way round": {"flow": reversed_flow},
    }
    return {name: blocks for name, blocks in out.items() if _differs(span, blocks)}


def _differs(span: Span, blocks: dict[str, dict]) -> bool:
    """Whether a change is allowed and changes something."""
    try:
        return changed(span, **blocks) != span
    except SpanError:
        return False


def sensitivity(span: Span, progress: Callable[[str, int, int], object] = lambda *_: None) -> list[Change]:
    """Each choice made otherwise, by itself. Equal steps and L_c are kept where they are not the choice."""
    base = vibration(span)
    kept: dict[str, float] = {"place": base.place, "modes": len(base.frequencies)}
    if np.ptp(base.frequency_width) == 0.0:
        kept |= {"frequency_step": base.frequency_step, "frequencies": len(base.frequency)}
    fixed = changed(span, response=kept, lift={"correlation_length": base.correlation_length})
    table = choices(fixed, base)
    out = []
    for i, (name, blocks) in enumerate(table.items()):
        progress(name, i, len(table))
        other = vibration(changed(fixed, **blocks))
        pairs = (
            (other.place_rms_displacement, base.place_rms_displacement),
            (other.rms_displacement.max(), base.rms_displacement.max()),
            (other.place_rms_acceleration, base.place_rms_acceleration),
            (other.damping_ratios[0], base.damping_ratios[0]),
            (other.damping_ratios.min(), base.damping_ratios.min()),
        )
        out.append(Change(name, *(float(a / b) - 1.0 for a, b in pairs)))
    return out


def markdown(changes: list[Change]) -> str:
    """The table of docs/experiments.md."""
    return markdown_table([COLUMNS, *((c.choice, *(f"{100.0 * x:+.1f}" for x in c[1:])) for c in changes)])


class Taken(NamedTuple):
    """A number of the frequency domain that a span file does not have under this name."""

    key: str  # of a file for `cable-sim viv`
    value: str
    source: str


def regions(driven: list[tuple[float, float]]) -> str:
    """Power-in regions as text."""
    return ", ".join(f"{a:.4g} to {b:.4g}" for a, b in driven) or "none"


def print_vibration(span: Span, result: Vibration) -> None:
    """Modes, response along the cable, and which choices they rest on."""
    given = " (given)" if span.damping.ratios else ""
    columns = ("mode", "Hz", "exact Hz", f"damping ratio{given}", "if all of it damped", "driven from, to m")
    rows = [
        (
            f"{n + 1}",
            f"{result.frequencies[n]:.5g}",
            f"{result.frequencies_exact[n]:.5g}" if n < len(result.frequencies_exact) else "",
            f"{result.damping_ratios[n]:.4f}",
            f"{result.damping_whole[n]:.4f}",
            regions(result.driven[n]),
        )
        for n in leading(result, MAX_MODES)
    ]
    count = len(result.frequencies)
    some = "" if count <= MAX_MODES else f", {MAX_MODES} of {count}, of the largest response; all stand in --json"
    print_table(f"{result.name}: modes{some}", columns, rows)
    every = max(1, (len(result.arc) - 1) // (MAX_PLACES - 1))
    along = [
        (
            f"{result.arc[i]:.5g}",
            f"{1e3 * result.rms_displacement[i]:.4g}",
            f"{result.diameters[i]:.4g}",
            f"{result.rms_acceleration[i]:.4g}",
        )
        for i in range(0, len(result.arc), every)
    ]
    heads = ("s m", "rms displacement mm", "diameters", "rms acceleration m/s^2")
    print_table("Response along the cable", heads, along)
    low, high = result.shedding
    peak = int(result.rms_displacement.argmax())
    say(
        f"at s = {result.place:.5g} m: rms displacement {1e3 * result.place_rms_displacement:.4g} mm, acceleration "
        f"{result.place_rms_acceleration:.4g} m/s^2\n"
        f"largest rms displacement {1e3 * result.rms_displacement[peak]:.4g} mm = {result.diameters[peak]:.3g} "
        f"diameters at s = {result.arc[peak]:.5g} m\n"
        f"shedding {low:.4g} to {high:.4g} Hz; correlation length {result.correlation_length:.4g} m; reading "
        f"{result.reading} of the lift spectrum\n{result.method} response on {result.segments} segments, spectra of "
        f"{len(result.frequency)} frequencies, the shortest step {result.frequency_step:.3g} Hz",
        lines=True,
    )


def print_taken(taken: Sequence[Taken]) -> None:
    """Numbers that a span file does not have under this name; those by default in one line."""
    if not taken:
        return
    for one in taken:
        if one.source != DEFAULT:
            say(f"taken: {one.key} = {one.value} ({one.source})")
    say("defaults: " + ", ".join(f"{one.key} {one.value}" for one in taken if one.source == DEFAULT))


def print_sensitivity(span: Span, changes: list[Change]) -> None:
    """What each choice made otherwise changes."""
    rows = [(c.choice, *(f"{100.0 * x:+.1f}" for x in c[1:])) for c in changes]
    title = f"{span.name}, chosen otherwise: rms displacement and acceleration at the place"
    print_table(title, COLUMNS, rows, left=COLUMNS[:1])
