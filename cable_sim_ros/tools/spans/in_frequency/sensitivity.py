"""What the response changes by where a choice is made otherwise: grids, damping ratios, lift, flow."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import NamedTuple

import numpy as np

from ....terminal import markdown_table
from .files import SpanError, changed
from .response import Vibration, vibration
from .span import Correlation, Method, Reading, Region, Shape, Span

COLUMNS = ("choice", "rms there %", "largest rms %", "acceleration %", "zeta_1 %", "least zeta %")


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
