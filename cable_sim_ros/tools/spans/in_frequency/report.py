"""A vibration on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ....terminal import print_table, say
from .response import Vibration, leading
from .sensitivity import COLUMNS, Change
from .span import Span

DEFAULT = "default"  # source of a number that is nobody's choice
MAX_MODES = 20  # of the table and the picture
MAX_PLACES = 9  # of the table along the cable


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
