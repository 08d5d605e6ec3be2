"""Ship plan: where the ship goes, in a line of text or a file, and its track.

An item is a time in seconds from the start of the run, an order, its value and how long it takes: `60 starboard 90
over 120`, `300 speed 1 over 60`. The ship begins with ship.tow_speed along ship.heading_deg; orders of the same kind do
not overlap, a turn and a change of speed may. Rates begin and end with a ramp of RAMP of the time.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import radians
from typing import NamedTuple

import numpy as np

from ...limits import MAX_TOW_SPEED
from ...physics.ship import Ship
from .winch_plan import CONSEQUENCE, LONGEST, PlanError, Words, hint, number, out_of_order, parts_of, plain, text_of

WORDS = Words("ship plan", "'60 starboard 90 over 120, 300 speed 1 over 60'")
SIDES = {"port": 1.0, "starboard": -1.0}  # order -> sign of the yaw
UNITS = {**dict.fromkeys(SIDES, "deg"), "speed": "m/s"}
MAX_TURN = 3600.0  # deg of one order
MAX_TURN_RATE = 10.0  # deg/s, at most of a turn: more than a tug's
MAX_ACCELERATION = 1.0  # m/s^2: more than that of a ship
MIN_OVER = 1.0  # s
EVERY = 0.02  # s
RAMP = 0.2  # of an order, at its beginning and at its end
PEAK = 1.0 / (1.0 - RAMP)  # largest rate of an order over its mean one


class ShipItem(NamedTuple):
    """From ``time`` [s] on: order, a key of UNITS, its value [deg, m/s] and how long it takes [s]."""

    time: float
    order: str
    value: float
    over: float

    @property
    def end(self) -> float:
        """When it is carried out [s]."""
        return self.time + self.over

    @property
    def turns(self) -> bool:
        """Is it a turn?"""
        return self.order in SIDES

    def __str__(self) -> str:
        return f"{plain(self.time)} {self.order} {plain(self.value)} over {plain(self.over)}"


class Phase(NamedTuple):
    """A part of a run under a plan: its begin and end [s] and what the ship does in it."""

    begin: float
    end: float
    text: str


@dataclass(frozen=True, init=False)
class ShipPlan:
    """Orders to the ship in the order of time: ``ShipPlan("60 starboard 90 over 120, 300 speed 1 over 60")``.

    port, starboard: turn by so many degrees; speed: go over to so many m/s through the world frame, ahead. The ship
    goes where it points, level, at ``ship.reference_height``. ``str`` of a plan is its text; every: s between messages
    of its track, which a plan without turns may have further apart. Raises PlanError.
    """

    items: tuple[ShipItem, ...]
    every: float = EVERY

    def __init__(self, text: str, where: str = WORDS.name, every: float = EVERY) -> None:
        parts = parts_of(text, where, WORDS)
        items = [_item(f"{where}, item {k} '{part}'", part) for k, part in enumerate(parts, 1)]
        for k, item in enumerate(items):
            name, same = f"{where}, item {k + 1} '{parts[k]}'", [one for one in items[:k] if one.turns == item.turns]
            if k and item.time < items[k - 1].time:
                raise out_of_order(name, item.time, items[k - 1].time)
            if same and item.time < same[-1].end:
                raise PlanError(
                    f"{name}: begins at {item.time:g} s, before '{same[-1]}' ends at {same[-1].end:g} s; {CONSEQUENCE}."
                    f" Begin it then, or give that less time"
                )
        object.__setattr__(self, "items", tuple(items))
        object.__setattr__(self, "every", every)

    @classmethod
    def of(cls, given: ShipPlan | str | os.PathLike) -> ShipPlan:
        """A plan, its text, or its file. A string is a text where it begins with a number, else a path."""
        return given if isinstance(given, ShipPlan) else cls(*text_of(given, WORDS))

    def __str__(self) -> str:
        return ", ".join(map(str, self.items))

    @property
    def last(self) -> float:
        """When the last item is carried out [s]."""
        return max(item.end for item in self.items)

    def check(self, ship: Ship) -> None:
        """Can a ship that begins as the scene says do it? Raises PlanError."""
        speed = ship.tow_speed
        for k, item in enumerate(self.items, 1):
            begun, speed = speed, speed if item.turns else item.value
            change, unit, most = (
                (item.value, "deg/s", MAX_TURN_RATE) if item.turns else (abs(speed - begun), "m/s^2", MAX_ACCELERATION)
            )
            if PEAK * change > most * item.over:
                raise PlanError(
                    f"ship plan, item {k} '{item}': needs {PEAK * change / item.over:.3g} {unit}, more than {most:g} "
                    f"{unit} of any ship; {CONSEQUENCE}. Give it {PEAK * change / most:.3g} s or more"
                )

    def track(self, t: np.ndarray, ship: Ship) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates [n, 6] of base_link, m and rad, and their rates at evenly spaced times from 0 on [s]."""
        yaw, turning = np.full(len(t), radians(ship.heading_deg)), np.zeros(len(t))
        speed, begun = np.full(len(t), ship.tow_speed), ship.tow_speed
        for item in self.items:
            done, rate = _ramped((t - item.time) / item.over)
            if item.turns:
                by = SIDES[item.order] * radians(item.value)
                yaw, turning = yaw + by * done, turning + by * rate / item.over
            else:
                speed, begun = speed + (item.value - begun) * done, item.value
        value, moves = np.zeros((len(t), 6)), np.zeros((len(t), 6))
        moves[:, 0], moves[:, 1], moves[:, 5] = speed * np.cos(yaw), speed * np.sin(yaw), turning
        step = np.diff(t, prepend=t[0])[:, None]
        value[:, :2] = np.cumsum(0.5 * step * (moves[:, :2] + np.roll(moves[:, :2], 1, axis=0)), axis=0)
        value[:, 2], value[:, 5] = ship.reference_height, yaw
        return value, moves

    def phases(self, seconds: float, ship: Ship) -> list[Phase]:
        """The parts of a run of so many seconds: between the beginnings and ends of the items."""
        marks = sorted({0.0, seconds, *(at for item in self.items for at in (item.time, item.end))})
        found, speed = [], ship.tow_speed
        for begin, end in zip(marks, marks[1:]):
            if begin >= seconds:
                break
            under = [item for item in self.items if item.time <= begin < item.end]
            over = [item for item in self.items if item.end <= begin and not item.turns]
            speed = over[-1].value if over else speed
            said = [f"{one.order} {plain(one.value)} {UNITS[one.order]}" for one in under]
            found.append(Phase(begin, min(end, seconds), " and ".join(said) or f"straight at {plain(speed)} m/s"))
        return found


def _ramped(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What is done of an order at shares u of its time, and the rate per share; the rate is a trapezoid."""
    u = np.clip(u, 0.0, 1.0)
    rest = np.minimum(u, 1.0 - u)
    rate = PEAK * np.minimum(rest / RAMP, 1.0)
    half = np.where(rest < RAMP, 0.5 * PEAK * rest * rest / RAMP, PEAK * (rest - 0.5 * RAMP))
    return np.where(u <= 0.5, half, 1.0 - half), rate


def _item(where: str, text: str) -> ShipItem:
    """One item. Raises PlanError."""
    words = text.split()
    time = number(where, "time", words[0], "s", 0.0, LONGEST)
    order = words[1] if len(words) > 1 else ""
    if order not in UNITS:
        raise PlanError(f"{where}: '{order}' is no order; {CONSEQUENCE}. {hint(order, tuple(UNITS))}")
    if len(words) != 5 or words[3] != "over":
        raise PlanError(
            f"{where}: {order} takes a value in {UNITS[order]} and how long it takes; {CONSEQUENCE}. Write 'TIME "
            f"{order} VALUE over SECONDS', with a comma or a line end between items"
        )
    low, high = (0.0, MAX_TURN) if order in SIDES else (-MAX_TOW_SPEED, MAX_TOW_SPEED)
    value = number(where, order, words[2], UNITS[order], low, high)
    return ShipItem(time, order, value, number(where, "over", words[4], "s", MIN_OVER, LONGEST))
