"""The tow as a function of its free numbers: simulated signals over time, each set of numbers simulated once.

The mesh is that of the start, so that a small change of a number makes a small change of the signals: differences of
two runs are those of the physics, not of two meshes.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError
from scipy.interpolate import CubicSpline

from ...errors import CableSimError, RunError
from ...io.scenes.load import SceneError, scene_from_dict
from ...io.scenes.winch_plan import WinchPlan
from ...io.sources.recorded_tow import RecordedTow
from ...runs.message_run import MessageRun
from ...runs.offline import start_up
from ...runs.verdict import judge
from ...sim.layout import layout_of
from ...sim.scene import Scene
from ...sim.simulator import Simulator
from ...sim.verdict import Reason, Verdict
from ..compare.pairing import SECOND
from ..logs.own_signals import signals_of_frames
from .free import CalibrateError, Free, data_with
from .observed import USABLE

KEPT = 64  # sets of curves
KEPT_QUANTITIES = {*USABLE, "payout", "speed"}


class TrialError(RunError):
    """A set of numbers within the ranges that cannot be simulated."""


class Curve(NamedTuple):
    """A simulated signal: value and rate of change at times [s from the origin]."""

    value: Callable[[np.ndarray], np.ndarray]
    rate: Callable[[np.ndarray], np.ndarray]


Curves = Mapping[str, Curve]


class TowModel:
    """A scene under a motion. `runs`: simulated so far; `window`: s from `origin` [ns] that count."""

    def __init__(
        self,
        scene: Scene,
        free: list[Free],
        tow: RecordedTow | None,
        duration: float | None,
        plan: WinchPlan | None = None,
        steady: bool = False,
        progress: Callable[[int], None] = lambda runs: None,
    ) -> None:
        self.scene, self.free, self.tow, self.duration = scene, free, tow, duration
        self.plan, self.steady, self.progress = plan, steady, progress
        self.mesh = layout_of(scene).mesh
        self.runs, self.origin, self.window = 0, 0, (0.0, 0.0)
        self._kept: dict[tuple[float, ...], tuple[dict[str, Curve], Verdict, list[str]]] = {}

    def scene_at(self, values: tuple[float, ...]) -> Scene:
        """The scene with these numbers; CalibrateError where it does not allow them."""
        given = {one.key: value for one, value in zip(self.free, values, strict=True)}
        try:
            return Scene.model_validate(data_with(self.scene, given))
        except ValidationError as error:
            raise CalibrateError(f"{self._told(values)}: {error.errors()[0]['msg']}; narrow the range") from None

    def check_ends(self) -> None:
        """Check the scene at both ends of each range, one number at a time. Raises CalibrateError."""
        for one in self.free:
            for value in (one.low, one.high):
                with warnings.catch_warnings(action="ignore"):
                    try:
                        scene_from_dict(data_with(self.scene, {one.key: value}), f"--free {one.key} at {value:g}")
                    except SceneError as error:
                        raise CalibrateError(
                            f"{error}. Or give a range inside: --free {one.key}=LOW:HIGH, now {one.low:g}:{one.high:g}"
                        ) from None

    def __call__(self, values: tuple[float, ...]) -> Curves:
        """Signals of the tow with these numbers, by quantity. Raises TrialError where it cannot be simulated."""
        if values in self._kept:
            self._kept[values] = self._kept.pop(values)  # the newest again
            return self._kept[values][0]
        scene = self.scene_at(values)
        try:
            with warnings.catch_warnings(record=True, action="always") as warned:
                frames, problem, doubts = self._frames(scene)
        except CableSimError as error:
            raise TrialError(f"{self._told(values)}: {error}; narrow the ranges of --free") from None
        self.runs += 1
        self.progress(self.runs)
        if problem:
            raise TrialError(f"{self._told(values)}: the run ended early ({problem}); narrow the ranges of --free")
        if not self._kept:
            self.origin = int(frames["time"][0])
            skip = start_up(scene, self.tow is not None)
            self.window = (skip, (int(frames["time"][-1]) - self.origin) * SECOND)
        if len(self._kept) >= KEPT:
            del self._kept[next(iter(self._kept))]
        curves = {}
        for one in signals_of_frames(frames, ""):
            if one.quantity in KEPT_QUANTITIES:
                curves[one.quantity] = _curve((one.time - self.origin) * SECOND, one.value)
        found = judge(frames, scene, doubts)
        if self.steady:  # a tow at rest lasts no time
            found = found._replace(reasons=tuple(one._replace(seconds=0.0, fraction=0.0) for one in found.reasons))
        texts = dict.fromkeys(str(one.message) for one in warned if issubclass(one.category, UserWarning))
        self._kept[values] = curves, found, list(texts)
        return curves

    def told(self, values: tuple[float, ...]) -> tuple[Verdict, list[str]]:
        """What the run with these numbers says of itself, and of what it warns."""
        self(values)
        return self._kept[values][1:]

    def on_own_mesh(self, values: tuple[float, ...]) -> Curves | None:
        """Signals on the mesh of these numbers, None where the scene has no mesh to hold. Raises TrialError."""
        if self.mesh is None:
            return None
        scene = self.scene_at(values)
        with warnings.catch_warnings(action="ignore"):
            other = TowModel(scene, self.free, self.tow, self.duration, self.plan, self.steady)
            other.origin = self.origin
            curves = other(values)
        self.runs += 1
        return curves

    def _frames(self, scene: Scene) -> tuple[np.recarray, str, list[Reason]]:
        if self.steady:
            sim = Simulator(scene, self.mesh)
            sim.start()
            return np.array([sim.frame]).view(np.recarray), "", []
        one = MessageRun(scene, self.tow, winch=self.plan, mesh=self.mesh)
        stepped = one.run(self.duration, None)
        return stepped.frames, stepped.problem, [*one.doubts, *(self.tow.doubts if self.tow else ())]

    def _told(self, values: tuple[float, ...]) -> str:
        return ", ".join(f"{one.key} = {value:.6g} {one.unit}".strip() for one, value in zip(self.free, values))


def _curve(time: np.ndarray, value: np.ndarray) -> Curve:
    if len(time) < 4:  # a steady tow
        mean = float(np.mean(value))
        return Curve(lambda at: np.full(len(at), mean), lambda at: np.zeros(len(at)))
    spline = CubicSpline(time, value)
    first, last = float(time[0]), float(time[-1])
    return Curve(lambda at: spline(np.clip(at, first, last)), lambda at: spline(np.clip(at, first, last), 1))
