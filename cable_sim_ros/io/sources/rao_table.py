"""Response amplitude operators of a ship in a CSV file, docs/sea_motion.md.

A row is one period and one heading; each degree of freedom has an amplitude in m/m or deg/m and a phase. With the wave
Re(A e^(i theta)) at the mean place of base_link, theta growing with time for a ship at rest, the motion is
Re(R A e^(i theta)), R = amplitude e^(i phase): the phase is the lead over the crest. R is interpolated in frequency by
amplitude and phase, the shorter way round, and in heading linearly, real and imaginary part (it may change its
sign there); beyond the first and the last period and heading it is held.
"""

from __future__ import annotations

import difflib
import os
import warnings
from cmath import phase, rect
from collections.abc import Sequence
from math import cos, degrees, pi, radians, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .csv_table import CONSEQUENCE, MotionError, head_of, numbers_of
from .motion_table import MotionWarning

FREEDOMS = ("surge", "sway", "heave", "roll", "pitch", "yaw")  # x y z of base_link, about x y z: REP-103
ACROSS = (1, 3, 5)  # sway, roll, yaw: of waves from the other side they have the other sign
ROTATIONS = (3, 4, 5)
PERIOD, HEADING = "period_s", "heading_deg"
COLUMNS = (PERIOD, HEADING, *(f"{name}_{part}" for name in FREEDOMS for part in ("amplitude", "phase_deg")))
PERIODS = (0.3, 1000.0)  # s
HEADINGS = (0.0, 360.0)  # deg
MOST = 50.0  # m/m and deg/m: of no ship
TURN = 720.0  # deg, of a phase
COARSE = 30.0  # deg between headings: 3.4 % half-way
APART = 120.0  # deg between phases of neighbouring periods, beyond which it is a change of sign rather than a turn
MATTERS = 0.1  # of the largest amplitude
WIDEST = 90.0  # deg between headings: beyond it a straight line between them means nothing
ON_PLANE = 0.01  # of its largest amplitude: what sway, roll or yaw may have in waves along the centre plane
SLOPE = 0.05  # of the slope of the wave: less in the longest wave is no angle in deg/m
EDGE = 1e-9  # of a frequency; deg


class Wave(NamedTuple):
    """A regular wave as the ship meets it: frequency [rad/s] and number [1/m], direction it goes to from ahead to port
    [rad], frequency of encounter [rad/s], negative where the ship overtakes it."""

    omega: float
    number: float
    heading: float
    encounter: float


class RaoTable:
    """Responses of a file to a wave. Raises MotionError for a file that is no such table."""

    def __init__(self, path: str | os.PathLike) -> None:
        where = self.path = Path(path)
        self.title = str(where)  # what responds
        names, below = head_of(where, f"{PERIOD},{HEADING},heave_amplitude,heave_phase_deg")
        _check_names(where, names)
        lines, data = numbers_of(where, names, below)
        if not lines:
            raise MotionError(f"{where}: has no row below its names; {CONSEQUENCE}. Give a row for each {PERIOD}")
        _check_cells(where, names, lines, data)
        table = {name: data[:, names.index(name)] for name in names}
        self.periods, self.headings, index = _grid(where, lines, table[PERIOD], table[HEADING])
        self.omega = [2.0 * pi / period for period in reversed(self.periods)]  # rising
        self.symmetric = self.headings[-1] <= 180.0
        values = np.zeros((6, len(self.omega), len(self.headings)), complex)
        for k, name in enumerate(FREEDOMS):
            if f"{name}_amplitude" not in table:
                continue
            scale = radians(1.0) if k in ROTATIONS else 1.0
            rows = zip(table[f"{name}_amplitude"].tolist(), np.radians(table[f"{name}_phase_deg"]).tolist())
            for (i, j), (amplitude, lead) in zip(index, rows):
                values[k, len(self.omega) - 1 - i, j] = scale * complex(amplitude * cos(lead), amplitude * sin(lead))
        self.missing = [name for name in FREEDOMS if f"{name}_amplitude" not in table]
        self._settle_plane(values)
        _look_at_units(where, self.periods[-1], self.headings, values[:, 0])
        self.reversed, self.apart = self._phases(values)
        self._bearings, columns = _around(self.headings, self.symmetric)
        self._values = values[:, :, columns].transpose(1, 2, 0).tolist()  # [frequency][bearing][freedom]

    def _settle_plane(self, values: np.ndarray) -> None:
        """Of a table that is mirrored, take out sway, roll and yaw in waves along the centre plane."""
        if not self.symmetric:
            return
        for k in ACROSS:
            most = np.abs(values[k]).max()
            for j, heading in enumerate(self.headings):
                if heading not in (0.0, 180.0):
                    continue
                worst = np.abs(values[k, :, j]).max()
                if worst > ON_PLANE * most:
                    unit = degrees(1.0) if k in ROTATIONS else 1.0
                    raise MotionError(
                        f"{self.path}: {FREEDOMS[k]}_amplitude goes up to {unit * worst:.4g} at {HEADING} = "
                        f"{heading:g} deg, above {100.0 * ON_PLANE:g} % of its largest, {unit * most:.4g}: with "
                        f"headings from 0 to 180 alone the ship is symmetric, and has none in waves along its centre "
                        f"plane; {CONSEQUENCE}. Set it to 0 there, or give headings up to 360"
                    )
                values[k, :, j] = 0.0

    def _phases(self, values: np.ndarray) -> tuple[list[str], float]:
        """Freedoms whose phase turns by more than APART between periods that both matter; the largest turn, deg."""
        found, most = [], 0.0
        for k, name in enumerate(FREEDOMS):
            size = np.abs(values[k])
            both = np.minimum(size[1:], size[:-1]) > MATTERS * max(float(size.max()), 1e-300)
            turn = np.degrees(np.abs(np.angle(values[k, 1:] * np.conj(values[k, :-1]))))
            if both.any() and (turn := float(turn[both].max())) > APART:
                found.append(name)
                most = max(most, turn)
        return found, most

    def about(self) -> dict[str, object]:
        """For the JSON."""
        return {
            "source": self.title,
            "period_s": [self.periods[0], self.periods[-1]],
            "heading_deg": [self.headings[0], self.headings[-1]],
            "symmetric": self.symmetric,
        }

    def notes(self) -> list[str]:
        """What was taken without being given."""
        found = []
        if what := ", ".join(self.missing):
            found.append(f"{self.path} has no columns of {what}: the ship does not move so")
        widest = max((b - a for a, b in zip(self._bearings, self._bearings[1:])), default=0.0)
        if widest > COARSE:
            found.append(
                f"{self.path}: headings up to {widest:g} deg apart: half-way between them responses that go with the "
                f"cosine or sine of the heading (surge, sway, roll, pitch) come out up to "
                f"{100.0 * (1.0 - cos(radians(0.5 * widest))):.2g} % too small; give headings every {COARSE:g} deg"
            )
        if self.reversed:
            found.append(
                f"{self.path}: {', '.join(self.reversed)}: phases of neighbouring periods up to {self.apart:.3g} deg "
                f"apart, above {APART:g} deg: interpolated linearly, as through a zero, and if it turns up to "
                f"{100.0 * (1.0 - cos(radians(0.5 * self.apart))):.2g} % too small; give periods between"
            )
        return found

    def covers(self, wave: Wave) -> bool:
        """Does the table reach as far as this wave?"""
        bearing, low, high = self._bearing(wave)[0], self._bearings[0], self._bearings[-1]
        inside = self.omega[0] * (1.0 - EDGE) <= wave.omega <= self.omega[-1] * (1.0 + EDGE)
        return inside and low - EDGE <= bearing <= high + EDGE

    def response(self, wave: Wave) -> list[complex]:
        """Six responses, m and rad for a metre of amplitude."""
        bearing, mirrored = self._bearing(wave)
        i, s = _between(self.omega, wave.omega)
        j, t = _between(self._bearings, bearing)
        here, there = self._values[i], self._values[min(i + 1, len(self.omega) - 1)]
        next_ = min(j + 1, len(self._bearings) - 1)
        found = [
            (1.0 - t) * _turned(here[j][k], there[j][k], s) + t * _turned(here[next_][k], there[next_][k], s)
            for k in range(6)
        ]
        return [-x if mirrored and k in ACROSS else x for k, x in enumerate(found)]

    def _bearing(self, wave: Wave) -> tuple[float, bool]:
        """Heading of a wave as the table counts it, deg, and whether its mirror image is meant."""
        bearing = degrees(wave.heading) % 360.0
        if self.symmetric and bearing > 180.0:
            return 360.0 - bearing, True
        return bearing, False


def _turned(a: complex, b: complex, s: float) -> complex:
    """Between two neighbouring periods: amplitude and phase, linear where the phase turns by more than APART."""
    angle = phase(b * a.conjugate())
    if angle == 0.0 or abs(angle) > radians(APART):
        return (1.0 - s) * a + s * b
    return rect((1.0 - s) * abs(a) + s * abs(b), phase(a) + s * angle)


def _check_names(path: Path, names: Sequence[str]) -> None:
    for name in names:
        if name not in COLUMNS:
            near = difflib.get_close_matches(name, COLUMNS, 1)
            hint = f"Did you mean {near[0]}?" if near else f"Known: {', '.join(COLUMNS)}"
            raise MotionError(f"{path}: there is no column '{name}'; {CONSEQUENCE}. {hint}")
        if list(names).count(name) > 1:
            raise MotionError(f"{path}: there are two columns {name}; {CONSEQUENCE}. Keep one of them")
    for name in (PERIOD, HEADING):
        if name not in names:
            raise MotionError(
                f"{path}: there is no column {name}; {CONSEQUENCE}. Give it: a row is a period and a heading"
            )
    for name in FREEDOMS:
        pair = [f"{name}_{part}" for part in ("amplitude", "phase_deg")]
        given = [column for column in pair if column in names]
        if len(given) == 1:
            other = pair[1 - pair.index(given[0])]
            raise MotionError(f"{path}: {given[0]} has no {other} beside it; {CONSEQUENCE}. Give both, or neither")
    if len(names) == 2:
        raise MotionError(
            f"{path}: has no response beside {PERIOD} and {HEADING}; {CONSEQUENCE}. Known: {', '.join(COLUMNS)}"
        )


def _check_cells(path: Path, names: Sequence[str], lines: Sequence[int], data: np.ndarray) -> None:
    for c, name in enumerate(names):
        low, high, unit, remedy = _bounds(name)
        bad = (data[:, c] < low) | (data[:, c] > high)
        if bad.any():
            k = int(np.argmax(bad))
            raise MotionError(
                f"{path}:{lines[k]}: {name} = {data[k, c]:g} {unit} is outside [{low:g}, {high:g}] {unit}; "
                f"{CONSEQUENCE}. {remedy}"
            )


def _bounds(name: str) -> tuple[float, float, str, str]:
    """Least and most of a column, its unit, and what to do about a value beyond."""
    if name == PERIOD:
        return *PERIODS, "s", "Give the period of the wave in s, not its frequency or length"
    if name == HEADING:
        return *HEADINGS, "deg", "Count from 0, following seas, to 360; add 360 to negative ones"
    if name.endswith("phase_deg"):
        return -TURN, TURN, "deg", "Give the lead over the crest in degrees"
    unit = "deg/m" if name.partition("_")[0] in [FREEDOMS[k] for k in ROTATIONS] else "m/m"
    return 0.0, MOST, unit, "Give it for a metre of wave amplitude; turn a negative one by 180 deg of phase"


def _grid(
    path: Path, lines: Sequence[int], period: np.ndarray, heading: np.ndarray
) -> tuple[list[float], list[float], list[tuple[int, int]]]:
    """Periods and headings, rising, and which of them each row is of. Raises MotionError for doubled rows and holes."""
    periods, headings = sorted(set(period.tolist())), sorted(set(heading.tolist()))
    index = [(periods.index(p), headings.index(h)) for p, h in zip(period.tolist(), heading.tolist())]
    first: dict[tuple[int, int], int] = {}
    for line, cell in zip(lines, index):
        if cell in first:
            raise MotionError(
                f"{path}:{line}: {PERIOD} = {periods[cell[0]]:g} s at {HEADING} = {headings[cell[1]]:g} deg stands in "
                f"line {first[cell]} too; {CONSEQUENCE}. Keep one of the rows"
            )
        first[cell] = line
    for j, h in enumerate(headings):
        for i, p in enumerate(periods):
            if (i, j) not in first:
                raise MotionError(
                    f"{path}: has no row of {PERIOD} = {p:g} s at {HEADING} = {h:g} deg, of {len(periods)} periods and "
                    f"{len(headings)} headings; {CONSEQUENCE}. Give every period at every heading"
                )
    cyclic = [*headings, headings[0] + 360.0] if headings[-1] > 180.0 else headings
    for a, b in zip(cyclic, cyclic[1:]):
        if b - a > WIDEST:
            raise MotionError(
                f"{path}: {HEADING} goes from {a:g} to {b % 360.0:g} deg in one step of {b - a:g} deg, above "
                f"{WIDEST:g} deg: what is between is not known; {CONSEQUENCE}. Give headings between, or 0 to 180 of "
                f"a symmetric ship"
            )
    return periods, headings, index


def _look_at_units(path: Path, period: float, headings: Sequence[float], longest: np.ndarray) -> None:
    """Warn of roll and pitch that do not follow the slope of the longest wave; longest [6, headings]: rad/m."""
    slope = (2.0 * pi / period) ** 2 / 9.81
    for k, along in ((3, sin), (4, cos)):
        j = int(np.argmax([abs(along(radians(h))) for h in headings]))
        share = abs(along(radians(headings[j])))
        found = abs(longest[k, j])
        if share > 0.5 and 0.0 < found < SLOPE * share * slope:
            warnings.warn(
                f"{path}: {FREEDOMS[k]}_amplitude = {degrees(found):.3g} deg/m in the longest wave, {period:g} s, at "
                f"{headings[j]:g} deg, where the slope of the wave is {degrees(share * slope):.3g} deg/m: is the "
                f"column in rad/m? It is taken as deg/m",
                MotionWarning,
                stacklevel=5,
            )


def _around(headings: Sequence[float], symmetric: bool) -> tuple[list[float], list[int]]:
    """Bearings to interpolate between, and the column of the table that each has; a full circle is closed."""
    columns = list(range(len(headings)))
    if symmetric or (headings[0] == 0.0 and headings[-1] == 360.0):
        return list(headings), columns
    last = len(headings) - 1
    return [headings[-1] - 360.0, *headings, headings[0] + 360.0], [last, *columns, 0]


def _between(at: Sequence[float], x: float) -> tuple[int, float]:
    """Interval of rising points in which x lies, and where in it, 0 to 1; held beyond the ends."""
    if x <= at[0] or len(at) == 1:
        return 0, 0.0
    i = int(np.searchsorted(at, x)) - 1
    if i >= len(at) - 1:
        return len(at) - 1, 0.0
    return i, (x - at[i]) / (at[i + 1] - at[i])
