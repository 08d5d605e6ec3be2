"""Picture of a comparison: each quantity over time, and what is left between the two."""

from __future__ import annotations

from pathlib import Path

from ...plots.canvas import canvas
from ...plots.heading import STAMP
from ...plots.run import BLUE, FAINT, INK, ORANGE, PURPLE, thinned
from ...sim.flag_rules import OK
from .comparison import Comparison

MOST = 8  # rows


def draw_comparison(result: Comparison, path: Path) -> Path:
    """A and B, their difference, one row a quantity. RuntimeError where matplotlib is missing."""
    shown = [one for one in result.scores if one.pair is not None][:MOST]
    with canvas(path, (15.0, 1.9 + 2.5 * len(shown)), source="`cable-sim compare` of A and B") as figure:
        axes = figure.subplots(len(shown), 2, width_ratios=(1.6, 1.0), squeeze=False)
        verdict = result.verdict
        color = INK if verdict.state == OK else STAMP
        causes = ", ".join(dict.fromkeys(reason.flag for reason in verdict.reasons))
        told = f"verdict: {verdict.state}" + (f" ({causes})" if causes else "")
        figure.suptitle(f"A: {result.name_a}\nB: {result.name_b}\n{told}", x=0.01, ha="left", size=13, color=color)
        for (both, rest), one in zip(axes, shown, strict=True):
            pair = one.pair
            assert pair is not None
            time = pair.time - pair.time[0]
            both.plot(*thinned(time, pair.a), color=BLUE, lw=1.2, label="A")
            both.plot(*thinned(time, pair.b), color=ORANGE, lw=0.9, label="B")
            both.set_title(one.quantity + (", less the track of A" if pair.line else ""))
            both.set_ylabel(f"[{one.unit}]")
            low, high = both.get_ylim()
            both.set_ylim(low, high + 0.25 * (high - low))
            both.legend(loc="upper right", ncols=2, fontsize=10)
            rest.plot(*thinned(time, pair.b - pair.a), color=PURPLE, lw=0.8)
            rest.axhline(0.0, color=FAINT, lw=0.8)
            bias, rms = one.figures["bias"], one.figures["rms"]
            rest.set_title(f"B less A: mean {bias:.3g}, rms {rms:.3g} {one.unit}", fontsize=11)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
    return path
