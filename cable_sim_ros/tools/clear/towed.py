"""A tow on a straight course in calm water, hauled in or made faster and let out again: the towbody's way, simulated.

The scene on a coarse mesh, in steps chosen by their error: depths within 0.1 m of its own mesh (docs/clear.md), a
hundredth of its cost. A tow at rest answers the same whenever it is told to act: one simulated answer serves every
begin.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, cos, radians, sin
from typing import Any, NamedTuple

import numpy as np

from ...errors import CableSimError
from ...physics.heave_compensation import SetpointLaw
from ...physics.towbody import BodyModel
from ...physics.winch import DrumModel
from ...sim.inputs import ShipMotion, WinchCommand
from ...sim.layout import layout_of
from ...sim.mesh.mesh_kinds import FeedMesh
from ...sim.mesh_blocks import Mesh
from ...sim.scene import Scene
from ...sim.simulator import Simulator
from ..ensemble.plan import with_drag

SOLVER = {"tick": 1.0, "tension_error": 0.1, "position_error": 0.5, "tolerance": 1e-4}
ACCURACY = {"tension": 0.2, "position": 10.0}
CALM = ("setpoint", "drive", "rules", "instruments", "heave", "mesh")  # blocks that are left at their defaults
LEAD = 20  # s of motion that are told at once
SETTLED = 2.0  # times scope over speed, in which a tow comes to rest after an action
SHORTEST, LONGEST = 60.0, 1800.0  # s, of that
POINTS = 161  # of an answer, in its action and in what follows
SHARES = np.array([0.0, 0.1, 0.3, 0.6, 1.0])  # of the largest action, that are simulated
GENTLE = 0.5  # m/s^2, with which the winch starts and stops: harder ones cost steps and move no towbody
LEAST_SPEED = 0.2  # m/s, below which a tow hangs


class ClearError(CableSimError):
    """The tow cannot be looked ahead."""


class Action(NamedTuple):
    """What is done: cable hauled in [m], speed added [m/s]; both evenly over the time that the slower of them takes."""

    haul: float
    speed: float


class Tow(NamedTuple):
    """A steady tow, and how its winch and ship can act. scope [m], speed [m/s], rate of the winch [m/s], acceleration
    of the ship [m/s^2]; mesh: None: made for it."""

    scene: Scene
    scope: float
    speed: float
    rate: float
    acceleration: float
    mesh: FeedMesh | None = None

    def meshed(self) -> Tow:
        """The same with a mesh that its copies can share: it takes static shapes of many scopes to make."""
        return self._replace(mesh=layout_of(calm(self.scene, self.speed, self.scope, self.rate)).mesh)

    @property
    def settles(self) -> int:
        """Seconds in which it comes to rest."""
        return ceil(min(max(SETTLED * self.scope / self.speed, SHORTEST), LONGEST))

    def starts(self, action: Action) -> float:
        """Seconds in which the winch comes to its rate, and to rest again."""
        return self.rate / min(self.scene.winch.max_acceleration, GENTLE) if action.haul else 0.0

    def lasts(self, action: Action) -> float:
        """Seconds that an action takes, without those."""
        return max(action.haul / self.rate, action.speed / self.acceleration)


def calm(scene: Scene, tow_speed: float, scope: float, rate: float) -> Scene:
    """The scene on a coarse mesh, without waves, instruments and motion of its ship. Raises ClearError, SceneError."""
    if scene.towbody.model is BodyModel.VEHICLE or scene.winch.drum is not DrumModel.FEED:
        raise ClearError(
            f"{scene.name}: towbody.model = {scene.towbody.model.value}, winch.drum = {scene.winch.drum.value}: no "
            f"towbody is towed on a winch that hauls in, so nothing was judged. Give a scene with winch.drum: feed"
        )
    if tow_speed < LEAST_SPEED:
        raise ClearError(
            f"{scene.name}: the ship makes {tow_speed:.3g} m/s, below {LEAST_SPEED:g}: the towbody hangs and comes to "
            f"no shoal; nothing was judged. Look again under way"
        )
    most = (
        sum(section.length for section in scene.cable.sections.values())
        - layout_of(scene).route.inboard
        - scene.winch.dead_length
    )
    if scope > most:
        raise ClearError(
            f"{scene.name}: {scope:.4g} m of scope are more than the {most:.4g} m of cable that can be paid out; "
            f"nothing was judged. Give a shorter --scope"
        )
    blocks: dict[str, Any] = {name: type(one)() for name in CALM if (one := getattr(scene, name, None)) is not None}
    water = scene.water.model_copy(
        update={name: type(getattr(scene.water, name))() for name in ("waves", "turbulence", "current_variation")}
    )
    if scene.setpoint is not None:
        blocks["setpoint"] = type(scene.setpoint)(algorithm=SetpointLaw.HOLD)
    winch = scene.winch.model_copy(
        update={
            "scope": scope,
            "cable_on_drum": None,
            "max_rate": rate,
            "max_acceleration": min(scene.winch.max_acceleration, GENTLE),
            "command_timeout": 0.5,  # lengths are orders, no stream
            "command_delay": 0.0,
            "command_acceleration": None,
            "least_scope": None,
            "most_scope": None,
        }
    )
    ship = scene.ship.model_copy(update={"tow_speed": tow_speed, "max_gap": 60.0})
    coarse = {
        "solver": scene.solver.model_copy(update=SOLVER),
        "accuracy": scene.accuracy.model_copy(update=ACCURACY),
        "mesh": Mesh(inboard=1, sheave=4),
    }
    return scene.model_copy(update={**blocks, **coarse, "water": water, "winch": winch, "ship": ship})


class Way(NamedTuple):
    """Of a towbody, each second from the beginning: depth below the mean water surface, place ahead of where the ship's
    reference point was at the beginning, scope [n], m."""

    depth: np.ndarray
    place: np.ndarray
    scope: np.ndarray


def sail(tow: Tow, action: Action, begin: float, out: float | None, seconds: int, scene: Scene | None = None) -> Way:
    """The tow simulated: the action from ``begin`` [s] on, taken back from ``out`` on, None: not.

    scene: in place of the tow's, of another drag. Raises StartError, SolverError, ClearError, SceneError.
    """
    lasts = tow.lasts(action)
    rate = action.haul / lasts if action.haul else tow.rate
    sim = Simulator(calm(scene or tow.scene, tow.speed, tow.scope, rate), tow.mesh)
    sim.start()
    heading = radians(sim.scene.ship.heading_deg)
    ways = np.array([cos(heading), sin(heading)])
    payout = float(sim.frame["payout"])
    orders = [(begin, payout - action.haul)] if action.haul else []
    orders += [(out, payout)] if action.haul and out is not None else []
    for when, length in orders:
        sim.push(WinchCommand(payout=length, time_ns=round(when * 1e9)))
    parts: list[np.ndarray] = []
    told = 0
    while len(parts) * LEAD < seconds:
        while action.speed and told <= (len(parts) + 1) * LEAD:
            told += 1
            gone, more = ahead(action.speed, lasts, told - begin)
            if out is not None:
                back, less = ahead(action.speed, lasts, told - out)
                gone, more = gone - back, more - less
            x, y = (ways * (tow.speed * told + gone)).tolist()
            u, v = (ways * (tow.speed + more)).tolist()
            sim.push(
                ShipMotion(
                    time_ns=told * 10**9,
                    position=(x, y, sim.scene.ship.reference_height),
                    velocity=(u, v, 0.0),
                    attitude=(0.0, 0.0, heading),
                    rate=(0.0, 0.0, 0.0),
                )
            )
        parts.append(sim.run(min(LEAD, seconds - len(parts) * LEAD)))
    frames = np.concatenate(parts)
    return Way(-frames["body_position"][:, 2], frames["body_position"][:, :2] @ ways, frames["scope"])


def ahead(speed: float, lasts: float, t: Any) -> tuple[Any, Any]:
    """How far [m] the ship is ahead of its old way t [s] after it began to go faster by ``speed`` [m/s] within
    ``lasts`` [s], and by how much it does [m/s]."""
    share = np.clip(np.asarray(t) / lasts, 0.0, 1.0)
    return speed * (0.5 * lasts * share**2 + np.maximum(np.asarray(t) - lasts, 0.0)), speed * share


class Answer(NamedTuple):
    """What actions change of a tow at rest: depth and place behind the ship [m].

    done [POINTS, 2]: over the whole action; a share of it goes the same way up to its end. [SHARES, POINTS, 2]: after:
    from the end of the action until the tow is at rest, undone and back: the same for taking it back.
    """

    tow: Tow
    action: Action
    done: np.ndarray
    after: np.ndarray
    undone: np.ndarray
    back: np.ndarray

    def part(self, share: float) -> Action:
        """A share of the action."""
        return Action(share * self.action.haul, share * self.action.speed)

    def way(self, share: float, begin: float, out: float | None, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Change of depth and place [m] at times t [s] by a share of the action from ``begin`` to ``out`` [s]."""
        action = self.part(share)
        starts, whole = self.tow.starts(self.action), self.tow.lasts(self.action)
        lasts, since = max(share, 1e-9) * whole, t - begin
        end, whole = lasts + starts, whole + starts
        change = _at(self.done, np.minimum(since, lasts + 0.5 * starts) / whole)
        change = change + _between(self.after - self.after[:, :1], share, (since - end) / self.tow.settles)
        gone = ahead(action.speed, lasts, since)[0]
        if out is not None:
            since = t - out
            change = change + _between(self.undone, share, since / end)
            change = change + _between(self.back - self.back[:, :1], share, (since - end) / self.tow.settles)
            gone = gone - ahead(action.speed, lasts, since)[0]
        return change[:, 0], change[:, 1] + gone


def _at(table: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Rows of a table [POINTS, 2] over 0 to 1, at x [n]; held beyond."""
    return np.stack([np.interp(x, np.linspace(0.0, 1.0, POINTS), column) for column in table.T], axis=1)


def _between(tables: np.ndarray, share: float, x: np.ndarray) -> np.ndarray:
    """Rows at x [n] of the table of a share, between those of SHARES."""
    k = min(int(np.searchsorted(SHARES, share, "right")) - 1, len(SHARES) - 2)
    w = (share - SHARES[k]) / (SHARES[k + 1] - SHARES[k])
    return _at((1.0 - w) * tables[k] + w * tables[k + 1], x)


def answer_of(tow: Tow, scene: Scene, action: Action) -> tuple[Answer, tuple[float, float]]:
    """The simulated answer of a tow to shares of an action, and its depth and place ahead of the ship at rest [m]."""
    done, parts = np.zeros((POINTS, 2)), np.zeros((3, len(SHARES), POINTS, 2))
    rest, settles, at = (0.0, 0.0), tow.settles, np.linspace(0.0, 1.0, POINTS)
    for k, share in enumerate(SHARES.tolist()[1:], 1):
        one = Action(share * action.haul, share * action.speed)
        lasts, end = tow.lasts(one), tow.lasts(one) + tow.starts(one)
        first, turn = 1.0, 1.0 + ceil(end) + settles
        way = sail(tow, one, first, turn, int(turn + ceil(end) + settles + 1), scene)
        t = np.arange(1.0, len(way.depth) + 1.0)
        gone = tow.speed * t + ahead(one.speed, lasts, t - first)[0] - ahead(one.speed, lasts, t - turn)[0]
        rest = float(way.depth[0]), float(way.place[0] - gone[0])
        change = np.stack([way.depth - rest[0], way.place - gone - rest[1]], axis=1)

        def cut(begin: float, length: float, change: np.ndarray = change, t: np.ndarray = t) -> np.ndarray:
            return np.stack([np.interp(begin + length * at, t, column) for column in change.T], axis=1)

        done = cut(first, end)
        parts[0, k] = cut(first + end, settles)
        parts[1, k] = cut(turn, end) - cut(turn, 0.0)
        parts[2, k] = cut(turn + end, settles)
    return Answer(tow, action, done, *parts), rest


class Copy(NamedTuple):
    """A tow of the copies, its answers by the name of the action, depth and place ahead of the ship at rest [m]."""

    tow: Tow
    answers: dict[str, Answer]
    depth: float
    behind: float


def copies_of(
    tow: Tow, actions: dict[str, Action], drag: float, speed: float, progress: Callable[[str, float, float], None]
) -> dict[str, Copy]:
    """The tow itself, one of less drag, and a slower and a faster one: at the ends of their 95 % ranges.

    drag: share; speed: m/s; progress is called before each action, and may raise. Raises as `sail`.
    """
    asked = {
        "itself": (1.0, 0.0),
        "drag": (1.0 - drag, 0.0),
        "slower": (1.0, -min(speed, 0.5 * tow.speed)),
        "faster": (1.0, speed),
    }
    found: dict[str, Copy] = {}
    tow = tow.meshed()
    for name, (factor, more) in asked.items():
        one, scene = tow._replace(speed=tow.speed + more), with_drag(tow.scene, factor)
        answers, rest = {}, None
        for k, (kind, action) in enumerate(actions.items()):
            progress("towing", len(found) * len(actions) + k, len(asked) * len(actions))
            answers[kind], rest = answer_of(one, scene, action)
        if rest is None:  # nothing can be done
            way = sail(one, Action(0.0, 0.0), 0.0, None, 1, scene)
            rest = float(way.depth[0]), float(way.place[0]) - one.speed
        found[name] = Copy(one, answers, *rest)
    return found
