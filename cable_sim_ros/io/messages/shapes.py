"""What stands in the picture beside the cable: ship, sheave, drum, bodies as points and triangles, in their own axes.

The hull is a symbol: a scene says where sheave and winch are, not what ship carries them.
"""

from __future__ import annotations

from math import pi, radians, tan
from typing import NamedTuple

import numpy as np

from ...sim.scene import Scene

ROUND = 64  # corners of what is round


class Mesh(NamedTuple):
    """Corners [n, 3] and triangles [m, 3]."""

    corners: np.ndarray
    faces: np.ndarray


def revolved(profile: np.ndarray, axis: int, count: int = ROUND) -> Mesh:
    """A profile of (radius, way along the axis) [n, 2] turned about x (axis 0) or y (1)."""
    angle = np.linspace(0.0, 2.0 * pi, count, endpoint=False)
    radius, along = np.repeat(profile[None, :, 0], count, 0), np.repeat(profile[None, :, 1], count, 0)
    a, b = radius * np.cos(angle)[:, None], radius * np.sin(angle)[:, None]
    corners = np.stack((along, a, b) if axis == 0 else (a, along, b), axis=-1).reshape(-1, 3)
    n = len(profile)
    i, j = np.meshgrid(np.arange(count), np.arange(n - 1), indexing="ij")
    here, there = i * n + j, (i + 1) % count * n + j
    faces = np.concatenate(
        [np.stack(t, axis=-1).reshape(-1, 3) for t in ((here, here + 1, there), (there, here + 1, there + 1))]
    )
    return Mesh(corners, faces)


def half_width(scene: Scene, cable: float) -> float:
    """Half the width [m] of the sheave between its rims."""
    wheel = scene.sheave
    return wheel.groove_depth * tan(radians(0.5 * wheel.throat_angle_deg)) + 0.5 * cable


def sheave_core(scene: Scene, cable: float) -> Mesh:
    """The wheel up to the root of the groove."""
    r, w = scene.sheave.radius, 0.6 * half_width(scene, cable)
    return revolved(np.array([(0.0, -w), (0.97 * r, -w), (r, -0.4 * w), (r, 0.4 * w), (0.97 * r, w), (0.0, w)]), 1)


def sheave_flanges(scene: Scene, cable: float) -> Mesh:
    """Flanks and cheeks of the groove: seen through, as the cable lies between them."""
    r, top = scene.sheave.radius, scene.sheave.radius + scene.sheave.groove_depth
    w, plate = half_width(scene, cable), 0.05 * scene.sheave.radius
    side = np.array([(0.75 * r, w + plate), (top, w + plate), (top, w), (r, 0.0)])
    parts = [revolved(side * (1.0, sign), 1) for sign in (-1.0, 1.0)]
    return Mesh(
        np.concatenate([part.corners for part in parts]),
        np.concatenate([parts[0].faces, parts[1].faces + len(parts[0].corners)]),
    )


def rims(scene: Scene, cable: float) -> np.ndarray:
    """Both rims as segments [n, 2, 3], and spokes on either side."""
    top, w = scene.sheave.radius + scene.sheave.groove_depth, half_width(scene, cable)
    angle = np.linspace(0.0, 2.0 * pi, ROUND + 1)
    circle = top * np.column_stack((np.cos(angle), 0.0 * angle, np.sin(angle)))
    lines = []
    for y in (-w - 0.05 * scene.sheave.radius, w + 0.05 * scene.sheave.radius):
        ring = circle + (0.0, y, 0.0)
        lines.append(np.stack((ring[:-1], ring[1:]), axis=1))
    return np.concatenate(lines)


def drum(scene: Scene) -> Mesh:
    """The drum with its flanges; its width is made up, two radii, where the scene has no lay width."""
    r, half = scene.winch.drum_radius, drum_half(scene)
    side = np.array([(0.0, -1.1 * half), (1.5 * r, -1.1 * half), (1.5 * r, -half), (r, -half)])
    return revolved(np.concatenate((side, side[::-1] * (1.0, -1.0))), 1)


def drum_half(scene: Scene) -> float:
    """Half the width [m] of the drum."""
    width = getattr(scene.winch, "lay_width", None)
    return 0.5 * width if width else scene.winch.drum_radius


def drum_marks(scene: Scene) -> np.ndarray:
    """Spokes on both flanges [n, 2, 3], by which it is seen to turn."""
    r, half = 1.5 * scene.winch.drum_radius, 1.12 * drum_half(scene)
    angle = np.linspace(0.0, 2.0 * pi, 6, endpoint=False)
    out = r * np.column_stack((np.cos(angle), 0.0 * angle, np.sin(angle)))
    return np.concatenate([np.stack((0.0 * out + (0, y, 0), out + (0, y, 0)), axis=1) for y in (-half, half)])


class Hull(NamedTuple):
    """A ship of the size that the places of sheave and winch ask for. legs: of the frame that carries the sheave."""

    mesh: Mesh
    edges: np.ndarray
    legs: np.ndarray
    length: float
    deck: float


def hull(scene: Scene) -> Hull:
    """The ship as a symbol, in base_link: x forward, z up from the water."""
    wheel, winch, r = np.array(scene.sheave.position), np.array(scene.winch.position), scene.sheave.radius
    reach = max(abs(wheel[0]), abs(winch[0]), 8.0 * r)
    length = 2.2 * reach
    over = wheel[0] + 2.5 * r if wheel[0] < 0.0 else -0.5 * length  # a sheave aft hangs over the stern
    stern, beam = min(over, winch[0] - 3.0 * scene.winch.drum_radius), 0.19 * length
    bow = stern + length
    deck = min(float(winch[2]) - 1.5 * scene.winch.drum_radius, float(wheel[2]) - 2.0 * r)
    deck = max(deck, 0.01 * length)
    keel = -beam / 4.0
    x = np.array([0.0, 0.03, 0.25, 0.6, 0.8, 0.92, 1.0])
    half = np.array([0.43, 0.46, 0.5, 0.5, 0.38, 0.19, 0.0])
    sheer = np.array([0.0, 0.0, 0.0, 0.0, 0.02, 0.05, 0.09]) * length
    rings = []
    for height, narrow, rise, short in ((deck, 1.0, 1.0, 0.0), (0.0, 0.95, 0.0, 0.04), (keel, 0.7, 0.0, 0.10)):
        at = stern + (bow - stern) * (x - short * x**3 + (0.5 * short if height == keel else 0.0) * (1 - x) ** 3)
        side = np.column_stack((at, narrow * beam * half, height + rise * sheer))
        rings.append(np.concatenate((side, (side * (1.0, -1.0, 1.0))[-2::-1])))
    n = len(rings[0])
    corners = np.concatenate(rings)
    faces = []
    for k in range(len(rings) - 1):
        for i in range(n):
            j = (i + 1) % n
            a, b, c, d = k * n + i, k * n + j, (k + 1) * n + i, (k + 1) * n + j
            faces += [(a, c, b), (b, c, d)]
    for base in (0, (len(rings) - 1) * n):  # deck and bottom, between port and starboard
        faces += [(base + i, base + i + 1, base + n - 1 - i) for i in range(n // 2)]
        faces += [(base + i + 1, base + n - 2 - i, base + n - 1 - i) for i in range(n // 2)]
    ring = rings[0]
    edges = np.stack((ring, np.roll(ring, -1, axis=0)), axis=1)
    foot = max(6.0 * r, 0.25 * beam)
    ends = [np.array([stern + 0.5 * r, wheel[1] + side * foot, deck]) for side in (-1.0, 1.0)]
    tops = [wheel + (0.0, side * 1.6 * r, 3.6 * r) for side in (-1.0, 1.0)]
    hang = [wheel + (0.0, side * 0.45 * r, 0.0) for side in (-1.0, 1.0)]
    high = [wheel + (0.0, side * 0.45 * r, 3.6 * r) for side in (-1.0, 1.0)]
    legs = np.array(
        [(ends[0], tops[0]), (ends[1], tops[1]), (tops[0], tops[1]), (hang[0], high[0]), (hang[1], high[1])]
    )
    return Hull(Mesh(corners, np.array(faces)), edges, legs, length, deck)


def torpedo(length: float, diameter: float) -> Mesh:
    """A body with a round nose, ahead along x."""
    s = np.linspace(0.0, 0.5 * pi, 8)
    nose = 0.5 * min(diameter, length)
    ahead = np.column_stack((0.5 * diameter * np.cos(s), 0.5 * length - nose + nose * np.sin(s)))
    tail = np.array([(0.0, -0.5 * length), (0.35 * diameter, -0.5 * length), (0.5 * diameter, -0.25 * length)])
    return revolved(np.concatenate((tail, ahead)), 0, 32)


def fins(length: float, diameter: float) -> Mesh:
    """Four fins at the tail of a body."""
    x0, x1, out = -0.5 * length, -0.5 * length + min(0.2 * length, 1.5 * diameter), 1.0 * diameter
    corners: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []
    for k in range(4):
        c, s = np.cos(0.5 * pi * k), np.sin(0.5 * pi * k)
        at = len(corners)
        for x, r in ((x0, 0.3 * diameter), (x0, out), (0.5 * (x0 + x1), out), (x1, 0.4 * diameter)):
            corners.append((x, r * c, r * s))
        faces += [(at, at + 1, at + 2), (at, at + 2, at + 3)]
    return Mesh(np.array(corners), np.array(faces))


def lattice(count: tuple[int, int]) -> np.ndarray:
    """Triangles of a patch of (n, m) corners, row by row."""
    n, m = count
    i, j = np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij")
    a = (i * m + j).ravel()
    return np.concatenate((np.stack((a, a + m, a + 1), 1), np.stack((a + 1, a + m, a + m + 1), 1)))
