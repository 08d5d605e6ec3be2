"""Gradients of the figures of a static tow with respect to numbers of its scene.

A number p of the scene moves the nodes at rest by du/dp = -K^-1 dr/dp (static_tangent.py), and a figure f(u, p) by
df/dp = df/du du/dp + direct part. dr/dp and f are differenced between two scenes that differ in p alone, set out on the
mesh of the scene: no tow is brought to rest for it. K is that of Newton's method, which leaves out how a body turns with
the flow at its depth and how strumming follows the shape; what it leaves out is put in by corrections with the same K.

Each gradient is held against the difference of the two static tows beside the scene, brought to rest from the tangent
on. Where that fails, or its slopes to either side differ, the figure has no gradient there and the reason is given.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from math import degrees
from typing import Any, NamedTuple

import numpy as np

from ..physics.parameter import Declared, declared
from ..physics.state import FLOW, NOW
from .layout import layout_of
from .live_parameters import changed, value_of
from .scene import Scene
from .simulator import Simulator
from .static_tangent import Balance, SetOut, Tangent

STEP = 1e-4  # of a number: 10 times less and the round-off of a tension counts, 10 times more and its curvature
PROBE = 1e-5  # of a number, of what K leaves out: beyond, the geometry of stiff cable that is moved straight counts
LEFT_OUT, ROUNDS = 1e-6, 40  # of the nodes' answer, that K may leave out: less is the round-off of a correction
TIGHT = 1e-12  # solver.tolerance of the start: its round-off
SETTLED, CORRECTIONS = 1e-10, 40  # m: last correction of a tow at rest; at most so many
# slopes to either side differ by more: of the larger, and of the figure for the number's whole value (round-off)
KINK, ROUND_OFF = 0.01, 5e-5
HOW = ("solver.", "mesh.", "accuracy.")  # how a tow is computed, not what it is
NOTHING_DONE = "it has no gradient"


class Figure(NamedTuple):
    """A published figure of a static tow."""

    name: str
    unit: str
    meaning: str
    of: Callable[[np.record], float]


FIGURES = (
    Figure("tension_n", "N", "tension where the cable leaves the sheave", lambda f: f.tension),
    Figure("tension_drum_n", "N", "tension at the drum", lambda f: f.tension_drum),
    Figure("body_depth_m", "m", "depth of the towbody", lambda f: -f.body_position[2]),
    Figure("layback_m", "m", "horizontal distance from sheave to towbody", lambda f: f.layback),
    Figure("departure_angle_deg", "deg", "departure angle from the downward vertical", lambda f: degrees(f.departure_angle)),
)
NAMES = tuple(figure.name for figure in FIGURES)


def figures_of(frame: np.record) -> np.ndarray:
    """FIGURES of a tick output [figures]."""
    return np.array([float(figure.of(frame)) for figure in FIGURES])


class Slope(NamedTuple):
    """Gradient of one figure to one number, per unit of it; beside: the difference of the static tows beside the scene
    for the same; refused: why there is no gradient, ""."""

    figure: str
    slope: float
    beside: float
    refused: str = ""


class Gradient(NamedTuple):
    """Of one number: key, unit, value; slopes of FIGURES; note: what is to be known of them; refused: why there are
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


def declaration(key: str) -> Declared | None:
    """How a number of a scene is declared, by its key."""
    plain, _ = split(key)
    for one in declared(Scene):
        if re.fullmatch(re.escape(one.key).replace("<name>", r"[^.]+"), plain):
            return one
    return None


class StaticGradients:
    """A scene at rest, of which gradients are asked. Raises StartError where it has no static tow.

    values [figures]: FIGURES of the static tow.
    """

    def __init__(self, scene: Scene):
        self.scene = changed(scene, "solver.tolerance", TIGHT)
        self.mesh = layout_of(scene).mesh
        sim = Simulator(self.scene, self.mesh)
        sim.start()
        self._flow = sim.state.nodes[NOW, FLOW].copy()
        self._base = SetOut(self.scene, self.mesh, self._flow)
        self.q = sim.state.q.copy()
        self._balance = self._base.at(self.q)
        self._tangent = self._base.tangent()
        if self._tangent is not None:
            self.q, self._balance = rested(self._base, self._tangent, self.q)
            self._tangent = self._base.tangent()
        self.values = figures_of(self._balance.frame)

    def __call__(self, key: str) -> Gradient:
        """The gradients of FIGURES to the number of a key. Raises LookupError, AttributeError or TypeError where the
        scene has no such key."""
        value, known = number_at(self.scene, key), declaration(key)
        unit = "" if known is None or known.unit == "1" else known.unit
        shown = None if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
        try:
            return Gradient(key, unit, shown, *self._along(key, self._step(key, value, known)))
        except NoGradient as why:
            return Gradient(key, unit, shown, refused=str(why))

    def _step(self, key: str, value: Any, known: Declared | None) -> float:
        """The step to either side. Raises NoGradient."""
        if key.startswith(HOW) or known is None:
            raise NoGradient("says how the tow is computed, not what it is: the mesh is held")
        if value is None:
            raise NoGradient(f"has no value in the scene, what counts in its place is computed: give one, --set {key}=")
        if isinstance(value, bool) or not isinstance(value, float):
            raise NoGradient(f"= {value!r:.40} is no number that changes by a little")
        if value == 0.0:
            raise NoGradient("is 0: a step in proportion to it is none, and 1 % of it is nothing; give a value, --set")
        step, low, high = STEP * abs(value), known.low, known.high
        low = known.above if known.above is not None else low
        if (low is not None and value - step <= low) or (high is not None and value + step > high):
            raise NoGradient(f"is at the bound of its range {known.interval} {known.unit}: it has one side alone")
        return step

    def beside(self, key: str, step: float) -> SetOut:
        """The scene with the number of a key larger by ``step``, set out on the mesh of the scene."""
        scene = with_number(self.scene, key, number_at(self.scene, key) + step)
        return SetOut(scene, self.mesh, self._flow)

    def _along(self, key: str, step: float) -> tuple[tuple[Slope, ...], str]:
        """Slopes to a number by a step [its unit], and what is to be known of them. Raises NoGradient."""
        more, less = self.beside(key, step), self.beside(key, -step)
        above, below = more.at(self.q), less.at(self.q)
        same = np.array_equal(above.residual, below.residual) and np.array_equal(
            figures_of(above.frame), figures_of(below.frame)
        )
        if same:
            return tuple(Slope(name, 0.0, 0.0) for name in NAMES), "has no part in the static tow"
        if self._tangent is None:
            raise NoGradient("the tangent of the tow is singular: a part of it may move without a force")
        answer = self._answer((above.residual - below.residual) / (2.0 * step), abs(step) * PROBE / STEP)
        after = [figures_of(one.at(self.q + h * answer).frame) for one, h in ((more, step), (less, -step))]
        slopes = (after[0] - after[1]) / (2.0 * step)
        ends = [rested(one, self._tangent, self.q + h * answer) for one, h in ((more, step), (less, -step))]
        return tuple(
            self._slope(k, float(slope), [one for _, one in ends], step) for k, slope in enumerate(slopes)
        ), ""

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
        """One figure, k, with the slopes to the tows at rest beside the scene."""
        above, below = (float(FIGURES[k].of(one.frame)) for one in ends)
        here, value = float(self.values[k]), step / STEP
        up, down = (above - here) / step, (here - below) / step
        found = Slope(NAMES[k], slope, 0.5 * (up + down))
        allowed = KINK * max(abs(up), abs(down)) + ROUND_OFF * abs(here) / value
        if not (abs(up - down) <= allowed and abs(slope - found.beside) <= allowed):
            moved = any(contact_of(one.frame) != contact_of(self._balance.frame) for one in ends)
            print("DBG", NAMES[k], up, down, allowed)
            why = "the contact points that are loaded change" if moved else "its slopes to either side differ"
            return found._replace(refused=f"{why} within {100.0 * STEP:g} % of the number: {NOTHING_DONE}")
        return found


def contact_of(frame: np.record) -> tuple[float, ...]:
    """What tells one set of loaded contact points on the sheave from another."""
    return int(frame.contact_stations), round(float(frame.wrap_angle), 9)


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
    raise NoGradient(f"the tow beside the scene does not come to rest within {CORRECTIONS} corrections")
