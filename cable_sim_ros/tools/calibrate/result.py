"""What a calibration gives: parameters with intervals, what is left of each signal, verdict.

Picture: measured, simulated before and after, one row a signal; what was held out is shaded. The scene file with other
numbers keeps its comments, its order and its other lines.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from ...errors import told_as
from ...files import read_text, write_text
from ...io.scenes.document import find_scene
from ...io.scenes.load import scene_from_text
from ...plots.heading import STAMP
from ...plots.run import BLUE, FAINT, INK, ORANGE, canvas, thinned
from ...sim.flag_rules import DOUBTFUL, FAILED, OK
from ...sim.scene import Scene
from ...sim.verdict import Reason, Verdict
from .free import CalibrateError
from .observed import Observed

DIGITS = 7  # of a number that was fitted
OF_SIGNAL = ("quantity", "unit", "noise", "noise_stated", "samples", "independent")  # as the JSON has it


def rounded(value: Any) -> Any:
    """A fitted number with as many digits as mean something; whole lists too."""
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def text_with(source: str, values: Mapping[str, Any], head: Sequence[str]) -> str:
    """YAML text of a scene with other values by dotted key; head: lines of a comment at its top."""
    yaml = YAML()  # round trip: comments and quotes are kept
    yaml.version = None
    yaml.preserve_quotes = True
    yaml.width = sys.maxsize
    data = yaml.load(source)
    for key, value in values.items():
        *way, last = key.split(".")
        block = data
        for part in way:
            if not isinstance(block.get(part), CommentedMap):
                block[part] = CommentedMap()  # with defaults until now
            block = block[part]
        old = block.get(last)
        if isinstance(old, CommentedSeq) and isinstance(value, list) and len(old) == len(value):
            for k, one in enumerate(value):
                if old[k] != one:
                    old[k] = one
        elif old != value:
            block[last] = value
    out = StringIO()
    yaml.dump(data, out)
    return "".join(f"# {line}\n" for line in head) + re.sub(r"[ \t]+\n", "\n", out.getvalue())


def write_scene(
    scene: str | os.PathLike, expected: Scene, values: Mapping[str, Any], head: Sequence[str], path: Path
) -> None:
    """Write the file of a scene, or of a shipped one, with other values. CalibrateError where it cannot be written, or
    would not be read back as expected."""
    text = text_with(read_text(find_scene(scene)), values, head)
    read = scene_from_text(text, str(path))
    if read.model_dump(mode="json") != expected.model_dump(mode="json"):
        raise CalibrateError(f"{path}: would not be read back as the calibrated scene; it was not written. Use --json")
    after = ". The figures are above: put them in the scene by hand"
    with told_as(CalibrateError, f"{path}: cannot be written", after):
        write_text(path, text)


class Parameter(NamedTuple):
    """A fitted one: name, unit, start, value, 95 % interval (None: open at the bound), range, is it a free number?

    conditional: what of the instruments the interval takes as exact: signal, kind, such an error [unit], and what that
    moves the value by (None: not known).
    """

    name: str
    unit: str
    start: float
    value: float
    interval: tuple[float | None, float | None]
    limits: tuple[float, float]
    number: bool
    rise: tuple[float | None, float | None]
    conditional: tuple[tuple[str, str, float, str, float | None], ...] = ()


class Left(NamedTuple):
    """What is left of a signal: simulated less measured, mean and rms, on the part fitted and on that held out (None:
    nothing was)."""

    fitted: tuple[float, float]
    held: tuple[float, float] | None

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        parts = {"fitted": self.fitted, "held_out": self.held}
        return {name: None if one is None else {"bias": one[0], "rms": one[1]} for name, one in parts.items()}


@dataclass
class Shown:
    """Of one signal: unit, noise, samples fitted, independent ones, rests as given, with the instrument alone fitted,
    and calibrated; for pictures the observed one and what is simulated before and after at its times."""

    quantity: str
    unit: str
    noise: float
    noise_stated: bool
    samples: int
    independent: float
    given: Left
    instrument: Left | None
    calibrated: Left
    observed: Observed
    before: np.ndarray
    after: np.ndarray


@dataclass
class Calibration:
    """A calibrated scene: its parameters, rests, correlations, cost and verdict. values: of the scene, by key."""

    name: str
    scene: Scene
    parameters: list[Parameter] = field(default_factory=list)
    signals: list[Shown] = field(default_factory=list)
    correlation: list[list[float]] = field(default_factory=list)
    apart: list[tuple[str, ...]] = field(default_factory=list)
    values: dict[str, Any] = field(default_factory=dict)
    reasons: list[Reason] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    converged: bool = True
    solver: str = ""
    profile: bool = True
    steady: bool = False
    fitted_s: tuple[float, float] = (0.0, 0.0)
    held_s: tuple[float, float] | None = None
    runs: int = 0
    cpu_s: float = 0.0

    @property
    def verdict(self) -> Verdict:
        """failed: the fit has not converged; doubtful: bounds, correlations, the part held out; else ok."""
        state = FAILED if not self.converged else DOUBTFUL if self.reasons else OK
        return Verdict(state, tuple(self.reasons), tuple(self.notes))

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {
            "recording": self.name,
            "scene": self.scene.name,
            "steady": self.steady,
            "intervals": "profile" if self.profile else "linear",
            "converged": self.converged,
            "solver": self.solver,
            "parameters": [
                {
                    "name": one.name,
                    "unit": one.unit,
                    "free": one.number,
                    "start": one.start,
                    "value": one.value,
                    "interval": list(one.interval),
                    "range": list(one.limits),
                    "rise": list(one.rise),
                    "conditional_on": [
                        dict(zip(("quantity", "kind", "error", "unit", "moves"), row)) for row in one.conditional
                    ],
                }
                for one in self.parameters
            ],
            "correlation": self.correlation,
            "not_apart": [list(group) for group in self.apart],
            "signals": [
                {
                    **{name: getattr(one, name) for name in OF_SIGNAL},
                    "as_given": one.given.as_dict(),
                    "instrument_alone": None if one.instrument is None else one.instrument.as_dict(),
                    "calibrated": one.calibrated.as_dict(),
                }
                for one in self.signals
            ],
            "fitted_s": list(self.fitted_s),
            "held_out_s": None if self.held_s is None else list(self.held_s),
            "values": self.values,
            "runs": self.runs,
            "cpu_s": self.cpu_s,
            "verdict": self.verdict.as_dict(),
        }


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
