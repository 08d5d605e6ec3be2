"""Layback by the ways of the trade: functions of what a survey measures.

Datum: the sheave's centre. Cable out counts from there to the towbody, depth is positive down from the mean water
surface, height is that of the sheave above it, all m; layback is the horizontal distance from the sheave to the
towbody, never negative. NaN where a way has no solution. Survey software adds the distance from sheave to antenna.

Sources. Pythagoras, and a factor on the cable: HYPACK, "Using a Towfish with the Cable Counter" (toyo.co.jp FAQ 4057):
a straight pole from A-frame to fish, corrected cable = catenary factor x cable, corrected depth = depth + height;
Klein, operator tips, "layback". Layback from tow point to fish, cable out from the tow point: Triton Isis user's manual
(2004) 8.7.1, which adds the offset to the antenna. Follow the dog: CARIS HIPS and SIPS, Compute Towfish Navigation.
Catenary: the equation of a hanging chain; through a measured depth: cruise report AZ-99 of R/V Urania (CNR), tow-fish
position from wire out and depth.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from ...io.sources.csv_table import CONSEQUENCE, MotionError, head_of, numbers_of

IN_TABLE = ("winch.scope", "ship.tow_speed", "layback_max_m")
FACTOR = 0.9  # of the cable out; HYPACK's towfish driver explains its factor with 0.9
STILL = 1e-9  # m


def pythagoras(cable: np.ndarray, depth: np.ndarray, height: np.ndarray | float) -> np.ndarray:
    """sqrt(cable^2 - (depth + height)^2): a straight cable; NaN where it is shorter than the fish is deep."""
    length, down = np.asarray(cable, float), np.asarray(depth, float) + height
    square = length * length - down * down
    return np.where((square >= 0.0) & (length >= 0.0), np.sqrt(np.maximum(square, 0.0)), np.nan)


def cable_factor(cable: np.ndarray, factor: float = FACTOR) -> np.ndarray:
    """Cable out times a factor of 0 to 1; NaN for a negative cable out."""
    if not 0.0 < factor <= 1.0:
        raise ValueError(f"factor = {factor:g} is outside (0, 1]")
    cable = np.asarray(cable, float)
    return np.where(cable >= 0.0, factor * cable, np.nan)


def catenary(
    cable: np.ndarray, weight: float, body_weight: float, body_drag: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Layback and drop [m] of a chain of ``weight`` [N/m] under water that the drag [N] of the body alone draws aft.

    x = H/w (asinh(V/H) - asinh(W/H)), z = (sqrt(H^2 + V^2) - sqrt(H^2 + W^2)) / w with V = W + w L: inextensible, no
    drag on the cable. body_weight: W, N under water.
    """
    cable, pull = np.asarray(cable, float), np.asarray(body_drag, float)
    top = body_weight + weight * cable
    drawn = np.where(pull > STILL, pull, 1.0)
    if abs(weight) < STILL:  # it bears nothing: straight
        tension = np.maximum(np.hypot(pull, body_weight), STILL)
        return cable * pull / tension, cable * body_weight / tension
    over = drawn / weight * (np.arcsinh(top / drawn) - np.arcsinh(body_weight / drawn))
    drop = (np.hypot(pull, top) - np.hypot(pull, body_weight)) / weight
    good = cable >= 0.0
    return np.where(good, np.where(pull > STILL, over, 0.0), np.nan), np.where(good, drop, np.nan)


def catenary_of_depth(cable: np.ndarray, depth: np.ndarray, height: np.ndarray | float) -> np.ndarray:
    """Layback of the chain of this length that lies level at the fish: a ln((L + h)/(L - h)), a = (L^2 - h^2)/(2 h).

    NaN where the cable is not longer than the fish is deep below the sheave.
    """
    cable, down = np.asarray(cable, float), np.asarray(depth, float) + height
    cable, down = np.broadcast_arrays(cable, down)
    good = (cable > np.abs(down)) & (cable > 0.0)
    length, sag = np.where(good, cable, 2.0), np.where(good, down, 1.0)
    flat = np.abs(sag) < 1e-6 * length
    lean = np.where(flat, 1.0, sag)
    over = (length * length - lean * lean) / (2.0 * lean) * np.log((length + lean) / (length - lean))
    return np.where(good, np.where(flat, length, over), np.nan)


def follow_the_dog(sheave: np.ndarray, leash: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Places [n, 2] of a fish that is drawn along by a leash: at each place of the sheave [n, 2] it lies ``leash`` [n]
    from it towards where it was. first: its direction from the sheave at the beginning [2].

    Where the leash is NaN the fish is NaN, and goes on with the last leash that there was.
    """
    sheave, leash = np.asarray(sheave, float), np.asarray(leash, float)
    found = np.full(sheave.shape, np.nan)
    known = leash[np.isfinite(leash)]
    if not len(known):
        return found
    length, way = float(known[0]), np.asarray(first, float) / max(float(np.hypot(*first)), STILL)
    fish = sheave[0] + length * way
    for k, place in enumerate(sheave):
        given = bool(np.isfinite(leash[k]))
        length = float(leash[k]) if given else length
        behind = fish - place
        size = float(np.hypot(*behind))
        way = behind / size if size > STILL else way
        fish = place + length * way
        if given:
            found[k] = fish
    return found


def along_the_track(sheave: np.ndarray, layback: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Places [n, 2] of a fish that lies ``layback`` [n] behind on the way that the sheave [n, 2] went. first: direction
    of the way before its beginning, seen backwards [2]. NaN where the layback is."""
    sheave, layback = np.asarray(sheave, float), np.asarray(layback, float)
    gone = np.cumsum(np.hypot(*np.diff(sheave, axis=0, prepend=sheave[:1]).T))
    reach = float(np.nanmax(layback, initial=1.0))
    way = np.vstack([sheave[0] + reach * np.asarray(first, float), sheave])
    marks = np.concatenate([[-reach], gone])
    return np.column_stack([np.interp(gone - layback, marks, way[:, k]) for k in (0, 1)])


class Table(NamedTuple):
    """Laybacks [cables, speeds] m by cable out [m] and speed [m/s], both ascending; NaN where there is none."""

    cable: np.ndarray
    speed: np.ndarray
    layback: np.ndarray


def looked_up(table: Table | None, cable: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Laybacks [n] between the rows of a table, linear in both; NaN outside of it and without one."""
    if table is None:
        return np.full(len(cable), np.nan)
    axes = (table.cable, table.speed)
    within = RegularGridInterpolator(axes, table.layback, bounds_error=False, fill_value=np.nan)
    return within(np.column_stack([cable, np.round(speed, 6)]))


def read_table(path: Path) -> Table:
    """The table.csv of `cable-sim table` over cable out and speed. Raises MotionError."""
    names, below = head_of(path, ",".join(IN_TABLE))
    missing = [name for name in IN_TABLE if names.count(name) != 1]
    others = [name for name in names if "." in name and name not in IN_TABLE]
    if missing or others:
        what = f"no column '{missing[0]}'" if missing else f"a column '{others[0]}', and only cable and speed are known"
        raise MotionError(
            f"{path}: has {what}; {CONSEQUENCE}. Make it with cable-sim table SCENE --scope ... --speed ..."
        )
    at = [names.index(name) for name in IN_TABLE]
    lines = [(i, [row[k] for k in at if k < len(row)]) for i, row in below]
    lines = [line for line in lines if len(line[1]) < len(at) or line[1][2].strip()]  # a tow that failed has none
    _, rows = numbers_of(path, IN_TABLE, lines)
    cables, speeds = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    if len(cables) < 2 or len(speeds) < 2:
        raise MotionError(
            f"{path}: has {len(cables)} cables out and {len(speeds)} speeds with a layback, at least 2 of each are "
            f"needed; {CONSEQUENCE}. Give cable-sim table more values of --scope and --speed"
        )
    found = np.full((len(cables), len(speeds)), np.nan)
    found[np.searchsorted(cables, rows[:, 0]), np.searchsorted(speeds, rows[:, 1])] = rows[:, 2]
    return Table(cables, speeds, found)


def astern(sheave: np.ndarray, layback: np.ndarray, course: np.ndarray) -> np.ndarray:
    """Places [n, 2] straight behind the sheave; course: rad from east to north."""
    course = np.asarray(course, float)
    ahead = np.column_stack([np.cos(course), np.sin(course)])
    return np.asarray(sheave, float) - np.asarray(layback, float)[:, None] * ahead
