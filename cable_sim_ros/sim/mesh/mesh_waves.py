"""How short the elements are that follow the water's own waves, and what the waves cost a mesh that has them longer.

A cubic element of length h takes the load of a wave of number k wrong by (k h)^4 of it, and the load falls with the
depth as the velocity does, e^(-k d). Of an irregular sea the longer waves are many and short ones matter little: those
that an element does not see at all are lost with their share of the energy. docs/mesh.md has what was measured.
"""

from __future__ import annotations

import math
from math import pi
from typing import NamedTuple

import numpy as np

from ...physics.sea import AMPLITUDE, BOTTOM, FREQUENCY, NORM, NUMBER
from ...physics.water import WaveKind
from ..scene import Scene
from ..statics.static_shape import TowShape
from ..tables.elementary import exp
from ..tables.sea_tables import wave_number, wave_table

PER_WAVE_ERROR = 6.0  # error of an element, (k h)^4 e^(-k d), over that of the deviation of the tension: measured
PER_LOST = 10.0  # share of the energy of the velocity that is lost, over that of the deviation: measured
TO_WAVES = 0.4  # of accuracy.tension, for elements come out longer here and there than asked for
CREST = 3.0  # deviations of the elevation: as far the surface moves
ABOVE = 1.5  # crests: elements are as short so far up, for the last of them is longer
SIZES = np.array([0.02 * 25000.0 ** (k / 159) for k in range(160)])  # m, tried
MOST_OF_WAVES = 300  # elements, where the waves decide: shorter ones than that asks for are not made


class WaveField(NamedTuple):
    """The waves of a scene as a mesh sees them."""

    speed: np.ndarray  # [n] m/s, of each component at the surface
    number: np.ndarray  # [n] 1/m
    bottom: np.ndarray  # [n] see physics/sea.py
    peak: float  # 1/m, of the regular wave, or of the peak of the spectrum
    peak_bottom: float
    irregular: bool
    crest: float  # m

    def fall(self, depth: np.ndarray) -> np.ndarray:
        """Velocity of the peak's wave at depths [m], over that at the surface."""
        down = exp(-self.peak * depth)
        return np.asarray((down + self.peak_bottom / np.maximum(down, 1e-300)) / (1.0 + self.peak_bottom))

    def energy(self, depth: np.ndarray) -> np.ndarray:
        """[depths, n] share of each component in the energy of the velocity at the surface, at depths [m]."""
        fall = exp(-self.number * depth[:, None])
        fall = (fall + self.bottom / np.maximum(fall, 1e-300)) / (1.0 + self.bottom)
        fraction = self.speed * self.speed
        return np.asarray(fraction * fall * fall / fraction.sum())

    def error(self, depth: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Error of the deviation of the tension, relative, by elements of ``size`` at ``depth`` [m], both [n]."""
        found = self.fall(depth) * _unseen(self.peak * size, 4) / PER_WAVE_ERROR
        if self.irregular:
            lost = (self.energy(depth) * _unseen(self.number * size[:, None], 8)).sum(1)
            found = np.maximum(found, lost / PER_LOST)
        return found

    def size(self, depth: np.ndarray, error: float) -> np.ndarray:
        """Longest elements [n] m at ``depth`` [n] m that err by ``error`` at most; inf: any."""
        depths, back = np.unique(depth.round(2), return_inverse=True)
        fall, energy = self.fall(depths) / PER_WAVE_ERROR, self.energy(depths) / PER_LOST
        longest = np.zeros(len(depths))
        for size in SIZES:
            found = fall * _unseen(self.peak * size, 4)
            if self.irregular:
                found = np.maximum(found, (energy * _unseen(self.number * size, 8)).sum(1))
            longest[found <= error] = size
        return np.asarray(np.where(longest < SIZES[-1], np.maximum(longest, SIZES[0]), np.inf)[back])


def _unseen(turns: np.ndarray | float, power: int) -> np.ndarray:
    """(k h)^4 or (k h)^8, at most 1: products, for a power of numpy's is of the processor."""
    square = np.asarray(turns, float) ** 2
    fourth = square * square
    return np.minimum(1.0, fourth if power == 4 else fourth * fourth)


def wave_density(waves: WaveField | None, shape: TowShape, error: float) -> np.ndarray:
    """Elements per length [n] along a shape that the waves ask for, from the crests down, to err by ``error``."""
    z = shape.place[:, 2]
    if waves is None:
        return np.zeros(len(z))
    return np.where(z < ABOVE * waves.crest, 1.0 / waves.size(np.maximum(-z - waves.crest, 0.0), error), 0.0)


def wave_error(waves: WaveField | None, shape: TowShape, nodes: np.ndarray) -> float:
    """Largest error of an element, of the deviation of the tension; nodes: m from the towbody, ascending."""
    if waves is None:
        return 0.0
    z = np.interp(nodes, shape.s, shape.place[:, 2])
    low, high = np.minimum(z[1:], z[:-1]), np.maximum(z[1:], z[:-1])
    below = np.clip((waves.crest - low) / np.maximum(high - low, 1e-9), 0.0, 1.0)  # share that the water reaches
    return float(waves.error(np.maximum(-high - waves.crest, 0.0), below * np.diff(nodes)).max(initial=0.0))


def wave_field(scene: Scene) -> WaveField | None:
    """The waves of a scene; None where there are none."""
    waves, depth = scene.water.waves, np.inf if scene.seabed.depth is None else scene.seabed.depth
    table = wave_table(waves, scene.gravity, depth)
    if len(table) == 0:
        return None
    peak = float(wave_number(np.array([2.0 * pi / waves.period]), scene.gravity, depth)[0])
    amplitude = table[:, AMPLITUDE]
    return WaveField(
        amplitude * table[:, FREQUENCY] * table[:, NORM],
        table[:, NUMBER],
        table[:, BOTTOM],
        peak,
        math.exp(-2.0 * peak * depth),
        waves.kind is WaveKind.JONSWAP,
        float(min(amplitude.sum(), CREST * np.sqrt(0.5 * (amplitude**2).sum()))),
    )
