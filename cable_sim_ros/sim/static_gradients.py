"""Gradients of the figures of a static tow with respect to numbers of its scene.

A number p of the scene moves the nodes at rest by du/dp = -K^-1 dr/dp (static_tangent.py), and a figure f(u, p) by
df/dp = df/du du/dp + direct part. dr/dp and f are differenced between two scenes that differ in p alone, set out on the
mesh of the scene: no tow is brought to rest for it. K is that of Newton's method, which leaves out how a body turns
with the flow at its depth and how strumming follows the shape: that is put in by corrections with the same K.

Each gradient is held against the difference of the two static tows beside the scene, brought to rest from the tangent
on. Where that fails, or its slopes to either side differ, the figure has no gradient there and the reason is given.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from math import degrees, inf
from typing import Any, NamedTuple

import numpy as np

from ..errors import RunError
from ..physics.parameter import Declared, declaration
from ..physics.state import FLOW, NOW
from ..physics.towbody import BodyModel
from .layout import layout_of
from .live_parameters import changed, value_of
from .scene import Scene
from .simulator import Simulator
from .static_tangent import Balance, SetOut, Tangent

# of a number: with less the round-off of a tension counts, with more the curvature, above all of what presses; the
# next where a figure has no gradient: a sheave that moves under its cable takes the last
STEPS = 1e-4, 1e-5, 1e-6, 1e-7
PROBE = 1e-5  # of a number, of what K leaves out: beyond, the geometry of stiff cable that is moved straight counts
LEFT_OUT, ROUNDS = 1e-6, 40  # of the nodes' answer, that K may leave out: less is the round-off of a correction
TIGHT = 1e-12  # solver.tolerance of the start: its round-off
SETTLED, CORRECTIONS = 1e-10, 40  # m: last correction of a tow at rest; at most so many
KINK = 0.01  # of the larger, that slopes to either side differ by
APART = 2e-3  # of the larger, that a gradient may be beside the difference of the tows; beyond is round-off,
LOST = 0.5  # and more than this is nothing else
HOW = ("solver.", "mesh.", "accuracy.")  # how a tow is computed, not what it is


class Figure(NamedTuple):
    """A published figure of a static tow; round_off: of the figure, of a tow that was brought to rest."""

    name: str
    unit: str
    meaning: str
    of: Callable[[np.record], float]
    round_off: float


FIGURES = (
    Figure("tension_n", "N", "tension where the cable leaves the sheave", lambda f: f.tension, 5e-9),
    Figure("tension_drum_n", "N", "tension at the drum", lambda f: f.tension_drum, 1e-10),
    Figure("body_depth_m", "m", "depth of the towbody", lambda f: -f.body_position[2], 1e-11),
    Figure("layback_m", "m", "horizontal distance from sheave to towbody", lambda f: f.layback, 1e-11),
    Figure(
        "departure_angle_deg", "deg", "departure angle from the vertical", lambda f: degrees(f.departure_angle), 1e-10
    ),
)


class Slope(NamedTuple):
    """Gradient of one figure to one number, per unit of it; beside: the difference of the static tows beside the scene
    for the same; refused: why there is no gradient, ""."""

    figure: str
    slope: float
    beside: float
    refused: str = ""

    @property
    def apart(self) -> float:
        """Gradient and difference, of the larger; infinite where there is no gradient."""
        larger = max(abs(self.slope), abs(self.beside))
        return inf if self.refused else abs(self.slope - self.beside) / larger if larger > 0.0 else 0.0


class Gradient(NamedTuple):
    """Of one number: key, unit, value; slopes of FIGURES; note: what is to be known; refused: why there are
    none, "" where there are."""

    key: str
    unit: str
    value: float | None
    slopes: tuple[Slope, ...] = ()
    note: str = ""
    refused: str = ""


class NoGradient(Exception):
    """Why a number has no gradient."""


def split(key: str) -> tuple[str, int | None]:
    """A key without its component, and that: ``towbody.drag_area[0]``."""
    found = re.fullmatch(r"(.+)\[(\d+)\]", key)
    return (found[1], int(found[2])) if found else (key, None)


def number_at(scene: Scene, key: str) -> Any:
    """What a scene has under a key. Raises LookupError, AttributeError or TypeError where there is no such key."""
    plain, place = split(key)
    value = value_of(scene, plain)
    return value if place is None else value[place]


def with_number(scene: Scene, key: str, value: float) -> Scene:
    """The scene with another number under a key."""
    plain, place = split(key)
    if place is None:
        return changed(scene, plain, value)
    whole = list(value_of(scene, plain))
    whole[place] = value
    return changed(scene, plain, tuple(whole))


class StaticGradients:
    """A scene at rest, of which gradients are asked. Raises StartError where it has no static tow.

    values [figures]: FIGURES of the static tow; frames: its tick output [1].
    """

    def __init__(self, scene: Scene):
        self.scene = changed(scene, "solver.tolerance", TIGHT)
        self.mesh = layout_of(scene).mesh
        sim = Simulator(self.scene, self.mesh)
        sim.start()
        self.frames = np.array([sim.frame]).view(np.recarray)
        self._flow = sim.state.nodes[NOW, FLOW].copy()
        self._base = SetOut(self.scene, self.mesh, self._flow)
        self.q = sim.state.q.copy()
        self._balance = self._base.at(self.q)
        self._tangent, self._why = self._base.tangent(), "the tangent of the tow is singular: a part of it is loose"
        if len(sim.model.line.rigid.bodies):
            self._tangent, self._why = None, "a body with an attitude turns with it, which this tangent leaves out"
        if self.scene.towbody.model is BodyModel.VEHICLE:
            self._tangent, self._why = None, "a vehicle holds the far end, which this tangent leaves free"
        try:
            if self._tangent is not None:
                self.q, self._balance = rested(self._base, self._tangent, self.q)
                self._tangent = self._base.tangent()
        except NoGradient as why:
            self._tangent, self._why = None, str(why)
        self.values = values(self._balance)

    def __call__(self, key: str) -> Gradient:
        """The gradients of FIGURES to the number of a key. Raises LookupError, AttributeError or TypeError where the
        scene has no such key."""
        value, known = number_at(self.scene, key), declaration(Scene, key)
        unit = "" if known is None or known.unit == "1" else known.unit
        shown = None if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
        found, why = None, ""
        try:
            check_number(key, value, known)
        except NoGradient as reason:
            return Gradient(key, unit, shown, refused=str(reason))
        if self._tangent is None:
            return Gradient(key, unit, shown, refused=self._why)
        for step in STEPS:
            try:
                now = self._along(key, step * abs(value))
            except (NoGradient, RunError) as reason:
                why = why or str(reason)
                continue
            if found is None:
                found = now
            pairs = zip(found.slopes, now.slopes, strict=True)
            found = found._replace(slopes=tuple(min(pair, key=lambda slope: slope.apart) for pair in pairs))
            if not any(slope.refused for slope in found.slopes):
                break
        return Gradient(key, unit, shown, refused=why) if found is None else found._replace(unit=unit, value=shown)

    def beside(self, key: str, step: float) -> SetOut:
        """The scene with the number of a key larger by ``step``, set out on the mesh of the scene."""
        scene = with_number(self.scene, key, number_at(self.scene, key) + step)
        return SetOut(scene, self.mesh, self._flow)

    def _along(self, key: str, step: float) -> Gradient:
        """Slopes to a number by a step [its unit]. Raises NoGradient."""
        sides = self.beside(key, step), self.beside(key, -step)
        above, below = (one.at(self.q) for one in sides)
        if np.array_equal(above.residual, below.residual) and (values(above) == values(below)).all():
            nothing = tuple(Slope(figure.name, 0.0, 0.0) for figure in FIGURES)
            return Gradient(key, "", None, nothing, "has no part in the static tow")
        assert self._tangent is not None
        answer = self._answer((above.residual - below.residual) / (2.0 * step), PROBE / STEPS[0] * step)
        moved = self.q + step * answer, self.q - step * answer
        more, less = (values(one.at(q)) for one, q in zip(sides, moved))
        ends = [rested(one, self._tangent, q)[1] for one, q in zip(sides, moved)]
        slopes = ((more - less) / (2.0 * step)).tolist()
        return Gradient(key, "", None, tuple(self._slope(k, slope, ends, step) for k, slope in enumerate(slopes)))

    def _answer(self, load: np.ndarray, probe: float) -> np.ndarray:
        """du/dp [nodes, 6] for dr/dp = ``load``, with what K leaves out; probe: step of p for that. Raises
        NoGradient."""
        tangent = self._tangent
        assert tangent is not None
        answer = -tangent.solve(load)
        for _ in range(ROUNDS):
            above, below = (self._base.at(self.q + h * answer).residual for h in (probe, -probe))
            left = tangent.solve(load + (above - below) / (2.0 * probe))
            size = float(np.abs(left).max())
            if size <= LEFT_OUT * np.abs(answer).max():
                return answer
            if not size < 1e300:
                break
            answer = answer - left
        raise NoGradient("the balance of the tow does not follow its tangent: it has a kink there")

    def _slope(self, k: int, slope: float, ends: list[Balance], step: float) -> Slope:
        """That of figure k, with the slopes to the tows at rest beside the scene."""
        here, (above, below) = float(self.values[k]), (float(values(one)[k]) for one in ends)
        up, down = (above - here) / step, (here - below) / step
        found = Slope(FIGURES[k].name, slope, 0.5 * (up + down))
        larger, seen = max(abs(up), abs(down)), FIGURES[k].round_off * abs(here) / step
        straight = abs(up - down) <= KINK * larger + seen
        if straight and abs(slope - found.beside) <= APART * larger + seen:
            return found if found.apart <= LOST else found._replace(refused=f"is less than its round-off, {seen:.2g}")
        if any(one.loaded != self._balance.loaded for one in ends):
            return found._replace(refused="steps: the contact points that are loaded change beside the scene")
        if straight:
            text = f"does not follow its tangent: {slope:.4g} per unit by that, {found.beside:.4g} by tows beside"
            return found._replace(refused=text)
        return found._replace(refused=f"has a kink: {up:.4g} per unit upwards, {down:.4g} downwards")


def values(balance: Balance) -> np.ndarray:
    """FIGURES of a balance [figures]."""
    return np.array([float(figure.of(balance.frame)) for figure in FIGURES])


def check_number(key: str, value: Any, known: Declared | None) -> None:
    """Raise NoGradient for what is no number of the tow that may change by a little to either side."""
    if key.startswith(HOW):
        raise NoGradient("says how the tow is computed, not what it is; the mesh is held")
    if value is None:
        raise NoGradient(f"has no value in the scene, and what counts in its place is computed: give --set {key}=VALUE")
    if isinstance(value, bool) or not isinstance(value, float) or known is None:
        raise NoGradient(f"= {value!r:.40} is no number that changes by a little")
    if value == 0.0:
        raise NoGradient(f"= 0, and steps are in proportion to it: give --set {key}=VALUE")
    step, low, high = STEPS[0] * abs(value), known.low, known.high
    if known.above is not None:
        low = known.above
    if (low is not None and value - step <= low) or (high is not None and value + step >= high):
        raise NoGradient(
            f"= {value:g} {known.unit} is at the bound of its range {known.interval}: it has one side alone"
        )


def rested(out: SetOut, tangent: Tangent, q: np.ndarray) -> tuple[np.ndarray, Balance]:
    """The nodes at rest [nodes, 6] by corrections with a tangent, from ``q`` on, and their balance. Raises
    NoGradient."""
    for _ in range(CORRECTIONS):
        balance = out.at(q)
        correction = tangent.solve(balance.residual)
        q = q - correction
        if not np.isfinite(q).all():
            break
        if np.abs(correction[:, :3]).max() <= SETTLED:
            return q, out.at(q)
    raise NoGradient(f"the tow at the scene or beside it does not come to rest within {CORRECTIONS} corrections")
