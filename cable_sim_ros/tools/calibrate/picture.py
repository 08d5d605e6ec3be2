"""Picture of a calibration: measured, simulated before and after, one row a signal; what was held out is shaded."""

from __future__ import annotations

from pathlib import Path

from ...plots.canvas import canvas
from ...plots.heading import STAMP
from ...plots.run import BLUE, FAINT, INK, ORANGE, thinned
from ...sim.flag_rules import OK
from .result import Calibration


def draw_calibration(result: Calibration, path: Path) -> Path:
    """Signals over time. RuntimeError where matplotlib is missing."""
    with canvas(path, (13.0, 1.8 + 2.8 * len(result.signals))) as figure:
        axes = figure.subplots(len(result.signals), 1, squeeze=False, sharex=True)[:, 0]
        verdict = result.verdict
        causes = ", ".join(dict.fromkeys(reason.flag for reason in verdict.reasons))
        told = f"verdict: {verdict.state}" + (f" ({causes})" if causes else "")
        color = INK if verdict.state == OK else STAMP
        figure.suptitle(f"{result.scene.name} on {result.name}\n{told}", x=0.01, ha="left", size=13, color=color)
        for axis, one in zip(axes, result.signals, strict=True):
            time = one.observed.time
            axis.plot(*thinned(time, one.observed.value), color=BLUE, lw=1.2, label="measured")
            axis.plot(*thinned(time, one.before), color=FAINT, lw=1.0, label="as given")
            axis.plot(*thinned(time, one.after), color=ORANGE, lw=0.9, label="calibrated")
            if result.held_s is not None:
                axis.axvspan(*result.held_s, color=FAINT, alpha=0.2, lw=0.0)
            left = one.calibrated.held or one.calibrated.fitted
            held = "held out" if one.calibrated.held else "fitted"
            axis.set_title(f"{one.quantity}: left rms {left[1]:.3g} {one.unit} ({held})", fontsize=11)
            axis.set_ylabel(f"[{one.unit}]")
            low, high = axis.get_ylim()
            axis.set_ylim(low, high + 0.25 * (high - low))
            axis.legend(loc="upper right", ncols=3, fontsize=10)
        axes[-1].set_xlabel("time [s]")
    return path
