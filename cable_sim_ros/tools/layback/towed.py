"""The interval of a tow that manoeuvres: copies of it at both ends of each range, under the same motion and winch.

As for the static tows (laid.py) half the differences between both ends add as squares, at every moment: a tow
that does not manoeuvre has the same interval by both. A speed is wrong along the course of the moment, so that its two
copies have a ship of their own; places count from their own sheaves.

Does a tow manoeuvre? The criterion by which an interval is that of copies, and not that of steady tows.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, hypot, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...physics.inputs import make_inputs
from ...runs.mean_track import angles_along
from ...runs.stepping import Progress
from ...sim.inputs import ShipMotion, WinchCommand, push
from ...sim.scene import Scene
from ...sim.tables.current import at_start, flow_of
from ..ensemble.copies import Band, Ensemble, EnsembleEnded
from ..ensemble.plan import NOMINAL, Draw, EnsemblePlan, Ranges, fits
from ..ensemble.recording import APART, follow_recording

MOVING = 0.2  # m/s, under which the ship has no course of its own
PASSED = 2.0  # times its cable out that a ship has gone since a manoeuvre, until the tow is a steady one again
COURSE, SPEED, CABLE, CURRENT = 5.0, 0.05, 0.02, 0.05  # deg, shares, m/s: changes within that way that are none

NO_LEVER = (0.0, 0.0, 0.0)
SIZE = 5  # half-widths of an interval: layback, along, across, depth, heading


def strength(scene: Scene) -> float:
    """Largest current of a scene over the depth, without its variation, m/s."""
    water = scene.water.model_copy(update={"current_variation": type(scene.water.current_variation)()})
    deep = sum(section.length for section in scene.cable.sections.values())
    return max(hypot(*flow_of(water, 0.0)(-part * deep)) for part in np.linspace(0.0, 1.0, 9).tolist())


def manoeuvres(
    seconds: np.ndarray,
    velocity: np.ndarray,
    yaw: np.ndarray,
    cable: np.ndarray,
    scene: Scene,
    since: float = 0.0,
    last: int = 0,
) -> np.ndarray:
    """Does the tow manoeuvre [n]: has course, speed or cable out changed by more than COURSE, SPEED, CABLE while the
    ship went the last PASSED times its cable out, or the current of the scene by more than CURRENT since the start?

    velocity [n, 2], m/s; yaw [n] rad; cable [n] m; since: s of the first sample since the start of the tow; last: only
    of so many samples at the end, 0: of all.
    """
    speed = np.hypot(*velocity.T)
    course = np.unwrap(np.where(speed >= MOVING, np.arctan2(velocity[:, 1], velocity[:, 0]), yaw))
    state = np.column_stack([course / np.radians(COURSE), speed, cable])
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(seconds))])
    first = np.searchsorted(way, way - PASSED * cable)
    asked = range(len(seconds))[-last:]
    found = np.zeros(len(asked), bool)
    for i, k in enumerate(asked):
        least, most = state[first[k] : k + 1].min(axis=0), state[first[k] : k + 1].max(axis=0)
        allowed = np.array([1.0, SPEED * max(most[1], MOVING), CABLE * max(most[2], 1.0)])
        found[i] = (most - least > allowed).any()
    current = strength(scene)
    if current > 0.0 and scene.water.current_variation.time is not None:
        turned = [
            factor * np.exp(1j * turn)
            for factor, turn in (at_start(scene.water, s) for s in (0.0, *since + seconds[asked]))
        ]
        found |= current * np.abs(np.array(turned[1:]) - turned[0]) > CURRENT
    return found


class Copied(NamedTuple):
    """Half-widths of 95 % [n, SIZE], m and rad, at seconds [n] since the beginning; copies; notes: lines."""

    seconds: np.ndarray
    band: np.ndarray
    copies: int
    notes: list[str]


def ends_of(ranges: Ranges, flows: bool) -> list[Draw]:
    """The two ends of each range, one after the other; flows: the scene has a current, which may be turned."""
    widths = {"drag": ranges.drag, "speed": ranges.speed, "east": ranges.current, "north": ranges.current}
    widths |= {"turn_deg": ranges.current_turn_deg * flows, "payout": ranges.payout}
    around = [(name, getattr(NOMINAL, name), half) for name, half in widths.items() if half > 0.0]
    return [NOMINAL._replace(**{name: at + sign * half}) for name, at, half in around for sign in (1.0, -1.0)]


def body_places(frames: np.ndarray, lever: tuple[float, float, float] = NO_LEVER) -> np.ndarray:
    """Places [n, 3] in odom of a point of the towbody; lever: in towbody_link, x ahead, y to port, z up, m."""
    if lever == NO_LEVER:
        return frames["body_position"]
    x, y, z, w = frames["body_quaternion"].T
    axis, arm = np.column_stack([x, y, z]), np.array(lever)
    turn = 2.0 * np.cross(axis, arm)
    return frames["body_position"] + arm + w[:, None] * turn + np.cross(axis, turn)


def yaw_of(quaternion: np.ndarray) -> np.ndarray:
    """Yaw [n] rad of quaternions [n, 4], x y z w; without jumps."""
    return np.unwrap(angles_along(quaternion)[2])


def turned(yaw: np.ndarray, ahead: np.ndarray | float, port: np.ndarray | float) -> np.ndarray:
    """East and north [n, 2] of what lies ahead and to port [m] at a yaw [n] rad."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.column_stack([ahead * c - port * s, ahead * s + port * c])


class Towed(Ensemble):
    """Copies at the ends of the ranges, then ``twins``. Its figures are east and north of the sheave, depth [m] and yaw
    [rad] of the towbody, or of a point of it."""

    def __init__(
        self, scene: Scene, ranges: Ranges, lever: tuple[float, float, float] = NO_LEVER, twins: tuple[Draw, ...] = ()
    ) -> None:
        """Raises EnsembleError where the scene cannot have copies."""
        self.lever = lever
        self.ends = ends_of(ranges, strength(scene) > 0.0)
        self.asked = [NOMINAL, *self.ends, *twins]
        plan = EnsemblePlan(half_widths=ranges.model_copy(update={"payout": 0.0}))
        fits(plan, scene, "the copies of the interval")
        super().__init__(scene, plan, draws=self.asked)

    def start(
        self,
        time_ns: int = 0,
        position: tuple[float, float] = (0.0, 0.0),
        heading: float | None = None,
        scope: float | None = None,
    ) -> None:
        """As Ensemble.start; all copies are needed."""
        speed = self.scene.ship.tow_speed
        self.draws = [
            one._replace(speed=0.0, values={**one.values, "ship.tow_speed": max(speed + one.speed, 0.0)})
            if one.speed
            else one
            for one in self.asked
        ]
        super().start(time_ns, position, heading, scope)
        self._own = [n for n, one in enumerate(self.asked) if n in self._sims and (one.speed or one.payout)]
        for number in self._own:
            self._sims[number].inputs = make_inputs()
        self._way, self._last = np.zeros(2), (time_ns, np.zeros(2))

    def push(self, item: ShipMotion | WinchCommand) -> None:
        """As Ensemble.push; a copy with another speed or length is told another."""
        super().push(item)
        heads = np.zeros(2)
        if isinstance(item, ShipMotion):
            heads = np.array(_heads(item))
            before, was = self._last
            self._way = self._way + 0.5e-9 * (item.time_ns - before) * (heads + was)
            self._last = item.time_ns, heads
        for number in self._own:
            sim, draw = self._sims.get(number), self.asked[number]
            if sim is None:
                continue
            told = item
            if isinstance(item, ShipMotion) and draw.speed:
                (x, y, z), (u, v, w) = item.position, item.velocity
                (a, b), (c, d) = (draw.speed * self._way).tolist(), (draw.speed * heads).tolist()
                told = replace(item, position=(x + a, y + b, z), velocity=(u + c, v + d, w))
            elif isinstance(item, WinchCommand) and item.payout is not None:
                told = replace(item, payout=item.payout + draw.payout)
            push(sim.inputs, told, self.now, sim.scene.ship.max_gap)

    def figures(self, frames: np.ndarray) -> np.ndarray:
        """East, north, depth, yaw [n, 4]."""
        place = body_places(frames, self.lever)
        away = place[:, :2] - frames["sheave_position"][:, :2]
        return np.column_stack([away, -place[:, 2], yaw_of(frames["body_quaternion"])])

    def interval(self, nominal: np.ndarray, copies: np.ndarray) -> np.ndarray:
        """Half-widths [n, SIZE]; nominal: figures of copy 0 [n, 4], copies: of all others. Raises EnsembleEnded."""
        if self.lost:
            raise EnsembleEnded(f"copy {self.lost[0].number} ({self.lost[0].draw}) was given up: {self.lost[0].why}")
        return half_widths(nominal, copies[: len(self.ends)])


def _heads(item: ShipMotion) -> tuple[float, float]:
    """Direction of the course, of the heading where the ship hardly moves."""
    east, north = item.velocity[:2]
    course = atan2(north, east) if hypot(east, north) >= MOVING else item.angles[2]
    return cos(course), sin(course)


def half_widths(nominal: np.ndarray, copies: np.ndarray) -> np.ndarray:
    """Roots of the sums of squares of half the differences of pairs of copies [2 k, n, 4], in the axes of the layback
    of copy 0 [n, 4]: [n, SIZE]."""
    size = np.maximum(np.hypot(*nominal[:, :2].T), 1e-9)
    c, s = nominal[:, 0] / size, nominal[:, 1] / size
    layback = np.hypot(copies[..., 0], copies[..., 1])
    along = copies[..., 0] * c + copies[..., 1] * s
    across = copies[..., 1] * c - copies[..., 0] * s
    turned = np.unwrap(copies[..., 3], axis=1)
    parts = np.stack([layback, along, across, copies[..., 2], turned], axis=-1)
    halves = 0.5 * (parts[0::2] - parts[1::2])
    halves[..., 4] = 0.5 * np.angle(np.exp(2j * halves[..., 4]))
    return np.sqrt((halves**2).sum(axis=0))


def joined(bands: list[Band]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [n] ns, figures of copy 0 [n, 4] and of the others [copies, n, 4] of bands that follow each other."""
    return (
        np.concatenate([band.time for band in bands]),
        np.concatenate([band.nominal for band in bands]),
        np.concatenate([band.values for band in bands], axis=1),
    )


def of_recording(path: Path, scene: Scene, frames: np.ndarray, towed: Towed, progress: Progress) -> Copied:
    """The interval of copies that follow a recording; frames: its tick outputs. Raises EnsembleEnded, BagError."""
    plan = towed.plan
    count = len(towed.ends)
    one = follow_recording(path, scene, plan, towed, lambda _, done, all_: progress(f"{count} copies", done, all_))
    band, settled = towed.interval(one.nominal, one.values), one.settled
    if not settled.any():
        raise EnsembleEnded("the tow was joined under way, and its copies never settled")
    seconds, own = one.time[settled], towed.figures(frames)
    at = (frames["time"] - frames["time"][0]) * 1e-9
    gap = [np.interp(seconds, at, own[:, k]) - one.nominal[settled, k] for k in range(3)]
    off, width = (float(np.sqrt(np.mean(np.sum(np.square(part), axis=0)))) for part in (gap, band[settled, 1:4].T))
    notes = [f"the copies: {text}" for text in (*one.notes, *one.flags)]
    if off > APART * width:
        raise EnsembleEnded(
            f"copy 0 is {off:.3g} m rms from the towbody, of {width:.3g} m: they do not follow this tow"
        )
    return Copied(seconds, band[settled], count, notes)
