"""A tow with bodies by an own calculation: the vertical plane, lumped, its rest by Newton, small heave by frequency.

Written from the equations, with no kernel of the product: links that are springs, point masses, drag at the middle of a
link (Driscoll and Nahon 1996 with C_D of Choo and Casarella 1971), bodies of three degrees of freedom (Kirchhoff's
equations of the plane, Lamb 1932, art. 124; wings of Helmbold 1942). Every body is a joint without moment on its node.
The cable bends through a body's node, as the product's does. No sheave: it is held where it leaves that. Pitch is nose
up, x forward, z up; the ship makes way along x. Sections have the default drag law; no fairings, waves, current.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.sim.scene import Scene

E_FLOOR = 1e-3  # m/s, of the roots of the drag law (docs/theory.md, section 5)
ALONG_HULL = np.polynomial.legendre.leggauss(16)
SHORTEST = 0.02  # m, of a link beside a body, where the cable bends
GROWTH = 1.2
NUDGE = 1e-6  # of the differences that make it linear: m, rad, m/s, m/s^2


class Foil(NamedTuple):
    """A wing as the plane sees it: place, chord and normal in body axes; upright: only its own drag counts."""

    place: np.ndarray
    chord: np.ndarray
    normal: np.ndarray
    size: float  # rho/2 S
    slope: float
    drag: float
    induced: float
    stall: float
    upright: bool


class Plane(NamedTuple):
    """A rigid body in the vertical plane; places from the tow point."""

    node: int
    mass: float
    weight: float
    buoyancy: float
    inertia: float  # about the centre of gravity
    gravity_centre: np.ndarray
    buoyancy_centre: np.ndarray
    hull: np.ndarray  # where added mass and drag are given
    added: tuple[float, float, float]  # along, across, about the hull's centre
    along: float  # rho/2 A C_D
    across: float  # rho/2 d C_c
    length: float
    foils: tuple[Foil, ...]


def spheroid(length: float, diameter: float, water: float) -> tuple[float, float, float]:
    """Added mass along and across [kg] and added inertia [kg m^2] of a spheroid by its integrals (Lamb, art. 114), by
    quadrature: a0, b0 = l b^2 int ds/((l^2 + s)^1.5 (b^2 + s)), .../((l^2 + s)^0.5 (b^2 + s)^2) over s > 0."""
    from scipy.integrate import quad

    l, b = 0.5 * length, 0.5 * diameter
    a0 = l * b * b * quad(lambda s: (l * l + s) ** -1.5 / (b * b + s), 0.0, np.inf)[0]
    b0 = l * b * b * quad(lambda s: (l * l + s) ** -0.5 / (b * b + s) ** 2, 0.0, np.inf)[0]
    e, d = l * l - b * b, l * l + b * b
    turned = e * e * (b0 - a0) / (2.0 * e - d * (b0 - a0)) * water / 5.0
    return a0 / (2.0 - a0) * water, b0 / (2.0 - b0) * water, turned


def _flat(place) -> np.ndarray:
    return np.array([place[0], place[2]])


def _across(place: np.ndarray) -> np.ndarray:
    """Velocity of a place in a turn of 1 rad/s, x to z."""
    return np.array([-place[1], place[0]])


def plane_of(body: Towbody, node: int, gravity: float, density: float) -> Plane:
    """A body of a scene in the plane; without an added mass of its own that of a spheroid."""
    assert body.inertia and body.centre_of_gravity and body.centre_of_buoyancy and body.length and body.diameter
    buoyancy, foils = body.mass * gravity - body.net_weight, []
    added = spheroid(body.length, body.diameter, buoyancy / gravity)
    if body.added_inertia is not None:
        added = (body.added_mass[0], body.added_mass[2], body.added_inertia[1])
    for wing in body.wings.values():
        i, upright = np.radians(wing.incidence), abs(wing.dihedral) > 45.0
        aspect = wing.span / wing.chord
        slope = wing.lift_slope or 2.0 * np.pi * aspect / (2.0 + np.sqrt(4.0 + aspect * aspect))
        chord, normal = np.array([np.cos(i), np.sin(i)]), np.array([-np.sin(i), np.cos(i)])
        induced = 1.0 / (np.pi * wing.span_efficiency * aspect)
        size, stall = 0.5 * density * wing.span * wing.chord, np.radians(wing.stall_angle)
        foils.append(
            Foil(_flat(wing.place), chord, normal, size, slope, wing.drag_coefficient, induced, stall, upright)
        )
    return Plane(
        node,
        body.mass,
        body.mass * gravity,
        buoyancy,
        body.inertia[1],
        _flat(body.centre_of_gravity),
        _flat(body.centre_of_buoyancy),
        _flat(body.hull_centre or body.centre_of_buoyancy),
        added,
        0.5 * density * body.drag_area[0],
        0.5 * density * body.diameter * body.crossflow_coefficient,
        body.length,
        tuple(foils),
    )


def foil_force(foil: Foil, w: np.ndarray) -> np.ndarray:
    """Force of water that comes with w, body axes (Beard and McLain 2012, 4.9-4.10)."""
    wc, wn = w @ foil.chord, 0.0 if foil.upright else w @ foil.normal
    angle, speed = np.arctan2(wn, -wc), np.hypot(wc, wn)
    up, down = np.exp(-25.0 * (angle - foil.stall)), np.exp(25.0 * (angle + foil.stall))
    share = (1.0 + up + down) / ((1.0 + up) * (1.0 + down))
    lift = foil.slope * angle
    drag = foil.drag + (1.0 - share) * foil.induced * lift * lift + share * 2.0 * abs(np.sin(angle)) ** 3
    lift = (1.0 - share) * lift + share * 2.0 * np.sin(angle) ** 2 * np.cos(angle) * np.sign(angle)
    n = foil.normal
    return foil.size * speed * (lift * (wn * foil.chord - wc * n) + drag * (wc * foil.chord + wn * n))


def body_loads(b: Plane, pitch, rate, spin, v, a, flow) -> tuple[np.ndarray, float]:
    """What the cable has to bear at P, world axes, and the moment about P that nothing balances (nose up).

    pitch, its rate and acceleration; v, a of P and flow of the water, world axes.
    """
    c, s = np.cos(pitch), np.sin(pitch)
    back = np.array([[c, s], [-s, c]])  # world to body
    u, own, k = back @ (v - flow), back @ a, back @ np.array([0.0, 1.0])
    gain = own + spin * _across(b.gravity_centre) - rate * rate * b.gravity_centre
    force = b.mass * gain - (b.buoyancy - b.weight) * k
    moment = b.inertia * spin + b.mass * (b.gravity_centre[0] * gain[1] - b.gravity_centre[1] * gain[0])
    lever = b.buoyancy * b.buoyancy_centre - b.weight * b.gravity_centre
    moment -= lever[0] * k[1] - lever[1] * k[0]
    # added mass at the hull's centre: momentum p, its change in axes that turn, Munk's moment
    ax, az, turned = b.added
    uc = u + rate * _across(b.hull)
    pushed = own + spin * _across(b.hull) - rate * rate * b.hull  # acceleration of that centre, body axes
    slip = pushed - rate * _across(uc)  # of the components of uc
    p = np.array([ax * uc[0], az * uc[1]])
    water = np.array([ax * slip[0], az * slip[1]]) + rate * _across(p)
    about = turned * spin + uc[0] * p[1] - uc[1] * p[0]
    # hull: along, and across by Gauss points of its length
    load = np.array([-b.along * abs(uc[0]) * uc[0], 0.0])
    across, twist = 0.0, 0.0
    for x, weight in zip(*ALONG_HULL, strict=True):
        w = -(uc[1] + rate * 0.5 * b.length * x)
        piece = 0.5 * b.length * weight * b.across * np.sqrt(w * w + E_FLOOR**2) * w
        across, twist = across + piece, twist + 0.5 * b.length * x * piece
    load = load + np.array([0.0, across]) - water
    moment -= twist - about + b.hull[0] * load[1] - b.hull[1] * load[0]
    force = force - load
    for foil in b.foils:
        f = foil_force(foil, -(u + rate * _across(foil.place)))
        force, moment = force - f, moment - (foil.place[0] * f[1] - foil.place[1] * f[0])
    return back.T @ force, moment


def drag_coefficient(re: np.ndarray) -> np.ndarray:
    """C_D of Choo and Casarella (1971) for the Reynolds numbers of a tow, 36 to 1e5."""
    return 1.1 + 4.0 / np.sqrt(np.clip(re, 36.0, 1e5))


def cable_drag(v, u, d, density, viscosity) -> tuple[np.ndarray, np.ndarray]:
    """Drag across and along [N/m] of water that comes with v along a cable in the direction u; rows."""
    along = (v * u).sum(axis=1)
    w = v - along[:, None] * u
    vn, at = np.sqrt((w * w).sum(axis=1) + E_FLOOR**2), np.sqrt(along**2 + E_FLOOR**2)
    q2, eta = vn**2 + at**2, np.arctan2(vn, at)
    fn = 0.5 - 0.1 * np.cos(eta) + 0.1 * np.sin(eta) - 0.4 * np.cos(2 * eta) - 0.011 * np.sin(2 * eta)
    ft = 0.01 * np.polynomial.polynomial.polyval(eta, [2.009, -0.3858, 1.9159, -4.1615, 3.5064, -1.1873])
    low = np.minimum((vn / (0.1 * at)) ** 2, 1.0)
    cd = drag_coefficient(density * d * vn / viscosity)
    slow = drag_coefficient(density * d * np.sqrt(q2) / viscosity)
    mixed = slow + low**2 * (3.0 - 2.0 * low) * (cd - slow)
    size = 0.5 * density * d * q2
    return (size * cd * fn / vn)[:, None] * w, (size * mixed * np.maximum(ft, 0.0) * along / at)[:, None] * u


def graded(length: float, size: float, shortest: float) -> list[float]:
    """Links from ``shortest`` [m] at both ends, each GROWTH times the one before, to ``size`` in the middle."""
    ends, left = [], length
    while (each := shortest * GROWTH ** len(ends)) < size and left > 3.0 * each:
        ends.append(each)
        left -= 2.0 * each
    n = max(round(left / size), 1)
    return [*ends, *[left / n] * n, *ends[::-1]]


class LinearTow:
    """The tow of a scene whose cable is out by ``scope``, its upper end held; ``links`` of about ``size`` [m].

    Unknowns: x and z of the nodes from the upper end down, then the pitch of each body, nose up.
    """

    def __init__(self, scene: Scene, size: float = 1.0):
        self.scene, cable = scene, scene.cable
        self.flow = np.array([-scene.ship.tow_speed, 0.0])
        scope, rows, carried = scene.winch.scope, [], {}
        inboard = sum(section.length for section in cable.sections.values()) - scope
        first, begin = 0, 0.0
        for name, section in cable.sections.items():
            out = section.length - max(inboard - begin, 0.0)
            begin += section.length
            if out <= 0.0:
                continue
            lengths = graded(out, size, SHORTEST)
            d, gain = section.diameter or cable.diameter, section.drag_amplification
            mass = section.mass_per_length or cable.mass_per_length
            stiff = cable.bending_stiffness if section.bending_stiffness is None else section.bending_stiffness
            rows += [(length, d, mass, 1.0 if gain is None else gain, stiff) for length in lengths]
            first += len(lengths)
            for body in scene.bodies.values():
                if body.at == name:
                    carried[first] = body
        carried[first] = scene.towbody
        self.rest, self.d, self.mass, self.gain, self.stiff = (np.array(x) for x in zip(*rows, strict=True))
        self.n = first + 1
        density = scene.water.density
        self.bodies = [plane_of(body, node, scene.gravity, density) for node, body in sorted(carried.items())]
        self.displaced = density * np.pi / 4.0 * self.d**2
        self.top = self._departure(np.radians(20.0))
        self.q = self._settle()

    @property
    def places(self) -> np.ndarray:
        """x and z of the nodes at rest [nodes, 2], m."""
        return self.q[: 2 * self.n].reshape(-1, 2)

    @property
    def pitches(self) -> np.ndarray:
        """Trim of the bodies, nose up [rad]."""
        return self.q[2 * self.n :]

    def _departure(self, angle: float) -> np.ndarray:
        """Where the cable leaves the sheave at this angle below the horizontal."""
        sheave = self.scene.sheave
        r = sheave.radius + 0.5 * self.d[0]
        return np.array([sheave.position[0] - r * np.sin(angle), sheave.position[2] + r * np.cos(angle)])

    def residual(self, q, v, a, mean) -> np.ndarray:
        """Forces and moments out of balance; mean: velocity of the nodes, low-passed, against which strumming drags."""
        n, cable = self.n, self.scene.cable
        x, vx, ax, m = (y[: 2 * n].reshape(n, 2) for y in (q, v, a, mean))
        span = x[1:] - x[:-1]
        length = np.hypot(*span.T)
        u = span / length[:, None]
        stretch = ((vx[1:] - vx[:-1]) * u).sum(axis=1) / self.rest
        pull = (cable.axial_stiffness * (length / self.rest - 1.0) + cable.axial_damping * stretch)[:, None] * u
        # the wet part of a link, and where it is
        top, low = x[:-1, 1], x[1:, 1]
        wet = np.clip(-low / np.where(top - low == 0.0, 1.0, top - low), 0.0, 1.0)
        wet = np.where((top <= 0.0) & (low <= 0.0), 1.0, np.where((top > 0.0) & (low > 0.0), 0.0, wet))
        lower = 1.0 - 0.5 * wet  # share of what the wet part bears that goes to the lower node

        def mid(y):
            return (1.0 - lower)[:, None] * y[:-1] + lower[:, None] * y[1:]

        water = self.scene.water
        across, along = cable_drag(self.flow - mid(vx), u, self.d, water.density, water.viscosity)
        strum, _ = cable_drag(self.flow - mid(m), u, self.d, water.density, water.viscosity)
        acceleration = mid(ax)
        normal = acceleration - (acceleration * u).sum(axis=1)[:, None] * u
        each = across + along + (self.gain - 1.0)[:, None] * strum
        each = each - cable.added_mass_coefficient * self.displaced[:, None] * normal
        each[:, 1] += self.displaced * self.scene.gravity
        each = each * (wet * self.rest)[:, None]
        heavy = self.mass * self.rest
        out = np.zeros_like(x)
        for rows, share, sign in ((slice(0, -1), 1.0 - lower, -1.0), (slice(1, None), lower, 1.0)):
            out[rows] += sign * pull - share[:, None] * each + 0.5 * heavy[:, None] * ax[rows]
            out[rows, 1] += 0.5 * heavy * self.scene.gravity
        self._bend(out, u, length)
        moments = []
        for k, body in enumerate(self.bodies):
            at, i = 2 * n + k, body.node
            force, moment = body_loads(body, q[at], v[at], a[at], vx[i], ax[i], self.flow)
            out[i] += force
            moments.append(moment)
        return np.append(out.ravel(), moments)

    def _bend(self, out, u, length) -> None:
        """Moments EI times turn over length at the inner nodes, as pairs of forces on the links beside them."""
        cross = u[:-1, 0] * u[1:, 1] - u[:-1, 1] * u[1:, 0]
        turn = np.arctan2(cross, (u[:-1] * u[1:]).sum(axis=1))
        moment = turn / (0.5 * self.rest[:-1] / self.stiff[:-1] + 0.5 * self.rest[1:] / self.stiff[1:])
        side = np.column_stack((-u[:, 1], u[:, 0]))
        before, after = (moment / length[:-1])[:, None] * side[:-1], (moment / length[1:])[:, None] * side[1:]
        out[:-2] += before
        out[1:-1] -= before + after
        out[2:] += after

    def _differences(self, which: int, q: np.ndarray) -> np.ndarray:
        """Derivative of the residual at rest to place, velocity, acceleration or low-passed velocity.

        A node moves itself and two neighbours to each side: every fifth is nudged at once.
        """
        zero, rows = np.zeros_like(q), np.append(np.repeat(np.arange(self.n), 2), [b.node for b in self.bodies])
        axes = np.append(np.tile([0, 1], self.n), np.full(len(self.bodies), 2))
        out = np.zeros((len(q), len(q)))
        for axis in range(3):
            for colour in range(5):
                nudged = np.flatnonzero((axes == axis) & (rows % 5 == colour))
                parts = [[q, zero, zero, zero], [q, zero, zero, zero]]
                for sign, ends in zip((1.0, -1.0), parts, strict=True):
                    ends[which] = ends[which].copy()
                    ends[which][nudged] += sign * NUDGE
                change = (self.residual(*parts[0]) - self.residual(*parts[1])) / (2.0 * NUDGE)
                for k in nudged:
                    near = abs(rows - rows[k]) <= 2
                    out[near, k] = change[near]
        return out

    def _settle(self) -> np.ndarray:
        """The rest: marched from the fish up, then Newton."""
        from scipy.optimize import brentq

        none, water = np.zeros(2), self.scene.water
        density, viscosity, gravity = water.density, water.viscosity, self.scene.gravity
        pitches, loads = [], {}
        for body in self.bodies:
            pitches.append(brentq(lambda p, b=body: body_loads(b, p, 0.0, 0.0, none, none, self.flow)[1], -0.5, 0.5))
            loads[body.node] = body_loads(body, pitches[-1], 0.0, 0.0, none, none, self.flow)[0]
        x, pull = [none], none
        for k in range(self.n - 2, -1, -1):
            pull = pull + loads.get(k + 1, 0.0)
            mean = pull
            for _ in range(20):
                u = -mean / np.hypot(*mean)
                parts = cable_drag(self.flow[None], u[None], self.d[k : k + 1], density, viscosity)
                each = self.gain[k] * parts[0][0] + parts[1][0]
                each = each + np.array([0.0, (self.displaced[k] - self.mass[k]) * gravity])
                mean = pull - 0.5 * self.rest[k] * each
            pull = pull - self.rest[k] * each
            stretch = 1.0 + np.hypot(*mean) / self.scene.cable.axial_stiffness
            x.append(x[-1] + mean / np.hypot(*mean) * self.rest[k] * stretch)
        x = np.array(x[::-1])
        for _ in range(3):  # the place where it leaves the sheave goes with its angle
            x = x - x[0] + self.top
            q = np.append(x.ravel(), pitches)
            for _ in range(30):
                r = self.residual(q, 0.0 * q, 0.0 * q, 0.0 * q)[2:]
                if abs(r).max() < 1e-4:
                    break
                q[2:] -= np.linalg.solve(self._differences(0, q)[2:, 2:], r)
            else:
                raise RuntimeError(f"no rest: {abs(r).max():g} N are left")
            x, pitches = q[: 2 * self.n].reshape(-1, 2), q[2 * self.n :]
            self.top = self._departure(np.arctan2(x[0, 1] - x[1, 1], x[0, 0] - x[1, 0]))
        return q

    def transfer(self, periods: np.ndarray) -> np.ndarray:
        """Of a heave exp(i w t) of 1 m of the upper end: heave and pitch [rad/m] of each body, [periods, bodies, 2]."""
        k, c, m, strum = (self._differences(which, self.q) for which in range(4))
        out = np.zeros((len(periods), len(self.bodies), 2), complex)
        for row, period in enumerate(periods):
            w = 2.0 * np.pi / period
            late = 1.0 / (1.0 + 1j * w * self.scene.cable.mean_flow_time)
            dynamic = k + 1j * w * (c + late * strum) - w * w * m
            found = np.linalg.solve(dynamic[2:, 2:], -dynamic[2:, 1])
            for i, body in enumerate(self.bodies):
                out[row, i] = found[2 * body.node - 1], found[2 * self.n - 2 + i]
        return out
