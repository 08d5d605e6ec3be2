"""A rigid body on a node of the cable: attitude, added mass as a matrix, hull by strips, wings. Six degrees of freedom.

The node of the cable is its tow point P, a joint that bears no moment. Body axes x forward, y to port, z up; all places
from P. Loads of the water are those of Kirchhoff (Lamb 1932, art. 124), so that Munk's moment comes out of the added
mass; across, the hull is strips (Allen and Perkins 1951), wings: wing.py. Out of the water each strip and wing has the
wet share of its own height, the added mass that of the hull.

The rotation of a step is one more unknown of the node, condensed onto its place: of [[K, B], [C, D]] the cable sees
K - B D^-1 C, so that the system stays block-tridiagonal.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np

from ..compiler.jit import driver, link, opaque
from .attitude import _copy_attitudes, axes, jacobian, to_body, to_world, turn_from
from .rigid_loads import (
    BY_HEIGHT,
    BY_PLACE,
    BY_RATE,
    BY_SPEED,
    BY_TURN,
    _air_load,
    air_load,
    between,
    block,
    enter,
    hat_rows,
    hull_load,
    plus,
    plus_rows,
    rises,
    row_of,
    scaled,
    stand,
    times,
    times_rows,
    wing_loads,
)
from .sea import ELEVATION, EXTRA, ORBIT, RATE, SHEAR
from .state import AT_REST, FLOW, NOW, STEP, A, Q, V
from .towbody import LAG, TURNING, facing
from .vec import add, at3, axpy, cross, dot, norm, row3, scale, sub
from .workspace import SURFACES

ONE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@driver
def sum_up(body, attitude, r, moved, change, wet, t):
    """Derivatives of the residual to place (world axes) and rotation into t[BY_PLACE] and t[BY_TURN].

    r: rows of R; moved, body axes: velocity through the water u, its momenta p and h, acceleration R^T (a - V') through
    it, R^T a of the body and R^T V' of the water, direction up, fall of the current with the height; wet: share of the
    hull, its buoyancy [N] and the moment of that about P over the direction up.
    """
    u, p, h, through, own, water, up, fall = moved
    wetness, lift, lever = wet
    c1, c2, sigma = change.velocity, change.acceleration, change.damping
    omega, g, m = at3(attitude.rate, 0), at3(body.gravity_centre, 0), body.mass
    a11, a12 = block(body.added, 0, 0), block(body.added, 0, 3)
    a21, a22 = block(body.added, 3, 0), block(body.added, 3, 3)
    inertia, turns, arm = block(body.inertia, 0, 0), hat_rows(omega), hat_rows(g)
    speeds, rates = t[BY_SPEED], t[BY_RATE]
    plus_rows(speeds, 0, wetness, between(turns, a11))
    plus_rows(speeds, 3, wetness, between(turns, a21))
    plus_rows(speeds, 3, -wetness, hat_rows(p))
    plus_rows(speeds, 3, wetness, between(hat_rows(u), a11))
    plus_rows(rates, 0, -wetness, hat_rows(p))
    plus_rows(rates, 0, wetness, between(turns, a12))
    plus_rows(rates, 3, -wetness, hat_rows(h))
    plus_rows(rates, 3, wetness, between(turns, a22))
    plus_rows(rates, 3, wetness, between(hat_rows(u), a12))
    plus_rows(rates, 0, -m, between(turns, arm))
    plus_rows(rates, 0, -m, hat_rows(cross(omega, g)))
    plus_rows(rates, 3, 1.0, between(turns, inertia))
    plus_rows(rates, 3, -1.0, hat_rows(times_rows(inertia, omega)))
    j = jacobian(attitude.turned)
    turn_u, turn_own, turn_up = between(hat_rows(u), j), between(hat_rows(own), j), between(hat_rows(up), j)
    turn_water = between(hat_rows(water), j)
    turn_du = plus(between(hat_rows(through), j), -1.0, between(turns, turn_u))
    turn_du = plus(turn_du, c1, hat_rows(u))
    back = ((r[0][0], r[1][0], r[2][0]), (r[0][1], r[1][1], r[2][1]), (r[0][2], r[1][2], r[2][2]))
    whole, displaced = c2 + sigma * c1, wetness * body.displaced
    half(t, 0, j, (a11, a12, ONE, arm), (wetness, c1, c2, whole * m, -whole * m), (turns, turn_u, turn_du, back))
    half(t, 3, j, (a21, a22, arm, inertia), (wetness, c1, c2, whole * m, whole), (turns, turn_u, turn_du, back))
    out = t[BY_TURN]
    plus_rows(out, 0, m, turn_own)
    plus_rows(out, 3, m, between(arm, turn_own))
    plus_rows(out, 0, m * body.gravity - lift, turn_up)
    plus_rows(out, 3, m * body.gravity, between(arm, turn_up))
    plus_rows(out, 3, -1.0, between(hat_rows(lever), turn_up))
    plus_rows(out, 0, -displaced, turn_water)
    plus_rows(out, 3, -displaced, between(hat_rows(at3(body.buoyancy_centre, 0)), turn_water))
    falls = to_body(r, fall)
    for k in range(2):
        flow = plus(block(speeds, 3 * k, 0), -wetness, between(a21 if k else a11, turns))
        d = times_rows(flow, falls)
        for i in range(3):
            t[BY_PLACE, 3 * k + i, 2] += d[i] + t[BY_HEIGHT, 3 * k + i, 0]


@driver
def half(t, at, j, parts, factors, turned):
    """The three rows from ``at`` on of t[BY_PLACE] and t[BY_TURN], but for what weight, buoyancy and the acceleration
    of body and water have in the latter: with velocity, acceleration and rates of the rotation."""
    by_flow, by_gain, by_own, by_rate = parts
    wetness, c1, c2, own, rate = factors
    turns, turn_u, turn_du, back = turned
    out = t[BY_TURN]
    raised, speeds = block(out, at, 0), block(t[BY_SPEED], at, 0)
    for i in range(3):
        for k in range(3):
            out[at + i, k] = 0.0
    plus_rows(out, at, 1.0, between(raised, j))
    plus_rows(out, at, 1.0, between(speeds, turn_u))
    plus_rows(out, at, wetness, between(by_flow, turn_du))
    plus_rows(out, at, c1, block(t[BY_RATE], at, 0))
    plus_rows(out, at, wetness * c2, by_gain)
    plus_rows(out, at, rate, by_rate)
    inner = plus(scaled(c2 * wetness, by_flow), own, by_own)
    inner = plus(inner, c1, plus(speeds, -wetness, between(by_flow, turns)))
    plus_rows(t[BY_PLACE], at, 1.0, between(inner, back))


@driver
def couple(attitude, r, force, band, t):
    """Add the derivatives to the node's row of the system, that of the rotation condensed; keep what is asked later.

    force: residual of it, body axes.
    """
    j = jacobian(attitude.turned)
    by_turn = plus(block(t[BY_TURN], 0, 0), -1.0, between(hat_rows(force), j))
    b, k = between(r, by_turn), between(r, block(t[BY_PLACE], 0, 0))
    c, d = block(t[BY_PLACE], 3, 0), block(t[BY_TURN], 3, 0)
    e = (cross(d[1], d[2]), cross(d[2], d[0]), cross(d[0], d[1]))  # columns of the inverse but for the determinant
    per = 1.0 / dot(d[0], e[0])
    inverse = (
        scale(per, (e[0][0], e[1][0], e[2][0])),
        scale(per, (e[0][1], e[1][1], e[2][1])),
        scale(per, (e[0][2], e[1][2], e[2][2])),
    )
    follows, carries = between(inverse, c), between(b, inverse)
    k = plus(k, -1.0, between(b, follows))
    for i in range(3):
        for n in range(3):
            band[i, n] += k[i][n]
            attitude.stiffness[i, n], attitude.inverse[i, n] = d[i][n], inverse[i][n]
            attitude.follows[i, n], attitude.carries[i, n] = follows[i][n], carries[i][n]


@driver
def clear(t):
    """Zero the tables of the derivatives."""
    for i in range(t.shape[0]):
        for j in range(t.shape[1]):
            for k in range(t.shape[2]):
                t[i, j, k] = 0.0


@driver
def _rigid_load(rigid, i, state, change, tangent) -> float:
    """Subtract the residual of body i from its node's row of the system, and with tangent add its derivative; that of
    the moment stays in its attitude. Returns the power [W] the water gives to the body."""
    body, attitude = rigid.bodies[i], state.attitude[NOW, i]
    n, t, now = body.node, state.work.body, state.memory[NOW]
    band, water, current = state.work.band[n], state.work.around[n], now.current
    q, v, a = row3(state.nodes[NOW, Q], n), row3(state.nodes[NOW, V], n), row3(state.nodes[NOW, A], n)
    fall = (current[2] + water[SHEAR], current[3] + water[SHEAR + 1], 0.0)
    flow = (
        current[0] + water[EXTRA] - fall[0] * q[2] + water[ORBIT],
        current[1] + water[EXTRA + 1] - fall[1] * q[2] + water[ORBIT + 1],
        water[EXTRA + 2] + water[ORBIT + 2],
    )
    gains = at3(water, RATE)
    r, omega, alpha = axes(attitude.quaternion), at3(attitude.rate, 0), at3(attitude.acceleration, 0)
    up, u = r[2], to_body(r, sub(v, flow))
    own, through, pushed = to_body(r, axpy(change.damping, v, a)), to_body(r, sub(a, gains)), to_body(r, gains)
    if tangent:
        clear(t)
    height = q[2] - water[ELEVATION]
    force, moment, lever, wetness, slope, tilt = hull_load(body, rigid.strips, (u, omega), up, height, t, tangent)
    lift, turn, attitude.attack = wing_loads(body, rigid.wings, attitude.flap, (u, omega), up, height, t, tangent)
    force, moment = add(force, lift), add(moment, turn)
    blown, twisted = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if body.air > 0.0:
        x, y, z, mx, my, mz = air_load(rigid, i, state, u, height, tangent)
        blown, twisted = (x, y, z), (mx, my, mz)
        attitude.blown = dot(blown, to_body(r, v)) + dot(twisted, omega)
    p = add(times(body.added, 0, 0, u), times(body.added, 0, 3, omega))
    h = add(times(body.added, 3, 0, u), times(body.added, 3, 3, omega))
    gain = sub(through, cross(omega, u))
    inert = add(add(times(body.added, 0, 0, gain), times(body.added, 0, 3, alpha)), cross(omega, p))
    twist = add(add(times(body.added, 3, 0, gain), times(body.added, 3, 3, alpha)), add(cross(omega, h), cross(u, p)))
    push = scale(body.displaced, pushed)
    inert, twist = sub(push, inert), sub(cross(at3(body.buoyancy_centre, 0), push), twist)
    if tangent:
        rises(t, inert, twist, slope, tilt)
    force, moment = axpy(wetness, inert, force), axpy(wetness, twist, moment)
    attitude.wet, attitude.slam = wetness, 0.0
    if slope != 0.0:
        blow, whirl = enter(body, (u, omega, p, h), (scale(slope, up), tilt), t, tangent)
        force, moment, attitude.slam = add(force, blow), add(moment, whirl), norm(blow)
    power = dot(force, to_body(r, v)) + dot(moment, omega)
    force, moment = add(force, blown), add(moment, twisted)
    m, g, turned = body.mass, at3(body.gravity_centre, 0), axpy(change.damping, omega, alpha)
    whirl = add(cross(turned, g), cross(omega, cross(omega, g)))
    left = sub(scale(m, add(axpy(body.gravity, up, own), whirl)), force)
    spin = times(body.inertia, 0, 0, omega)
    still = scale(m, cross(g, axpy(body.gravity, up, own)))
    left_moment = sub(add(add(times(body.inertia, 0, 0, turned), cross(omega, spin)), still), moment)
    if tangent:
        moved = (u, p, h, through, own, pushed, up, fall)
        sum_up(body, attitude, r, moved, change, (wetness, wetness * body.buoyancy, lever), t)
    if body.floor_stiffness > 0.0:
        force, moment, rubbed = stand(body, attitude, state, r, (q, v), change.velocity, t, tangent)
        left, left_moment = sub(left, force), sub(left_moment, moment)
        state.work.lanes[0].power[SURFACES] += rubbed
        attitude.ground = norm(force)
    if tangent:
        couple(attitude, r, left, band, t)
    world = to_world(r, left)
    for k in range(3):
        band[k, 12] -= world[k]
        attitude.moment[k] = left_moment[k]
    return power


@driver
def _condense(line, state) -> float:
    """Take the moments that are not balanced into the balance of the nodes; returns the largest, as a force [N]."""
    worst = 0.0
    for i in range(line.rigid.bodies.shape[0]):
        body, attitude = line.rigid.bodies[i], state.attitude[NOW, i]
        for k in range(3):
            if line.held[body.node, k] == 0.0:
                state.work.band[body.node, k, 12] += dot(row_of(attitude.carries, k), at3(attitude.moment, 0))
            size = abs(attitude.moment[k]) / body.length
            if not size < 1e300:
                return np.inf
            worst = max(worst, size)
    return worst


@driver
def _follow_nodes(line, state) -> None:
    """Correction of the attitudes, from the moments and from the nodes' in work.step."""
    for i in range(line.rigid.bodies.shape[0]):
        attitude, n = state.attitude[NOW, i], line.rigid.bodies[i].node
        moment, step = at3(attitude.moment, 0), row3(state.work.step, n)
        for k in range(3):
            attitude.correction[k] = -dot(row_of(attitude.inverse, k), moment) - dot(row_of(attitude.follows, k), step)


@driver
def _correct_attitudes(state, change, part) -> None:
    """Add this part of the corrections to the attitudes."""
    for i in range(state.attitude.shape[1]):
        attitude = state.attitude[NOW, i]
        for k in range(3):
            d = part * attitude.correction[k]
            attitude.turned[k] += d
            attitude.rate[k] += change.velocity * d
            attitude.acceleration[k] += change.acceleration * d
        turn_from(state.attitude[STEP, i], attitude)


@driver
def _foresee_attitudes(state, h, ratio, fraction, rule) -> None:
    """Predict the attitudes at the end of a step of h [s], ``ratio`` times as long as the last, as the nodes are; rule:
    see integrate.coefficients()."""
    am, af, beta, gamma, _, _ = rule
    for i in range(state.attitude.shape[1]):
        attitude, old = state.attitude[NOW, i], state.attitude[STEP, i]
        for k in range(3):
            old.auxiliary[k] = old.acceleration[k] + ratio * (old.auxiliary[k] - old.acceleration[k])
            rise, x = fraction * attitude.gain[k], old.auxiliary[k]
            new = (old.acceleration[k] + (1.0 - af) * rise - am * x) / (1.0 - am)
            attitude.turned[k] = h * old.rate[k] + h * h * ((0.5 - beta) * x + beta * new)
            attitude.rate[k] = old.rate[k] + h * ((1.0 - gamma) * x + gamma * new)
            attitude.acceleration[k] = old.acceleration[k] + rise
        turn_from(old, attitude)


@driver
def _conclude_attitudes(state, rule) -> None:
    """Auxiliary accelerations of a solved step, and what its accelerations gained."""
    am, af = rule[0], rule[1]
    for i in range(state.attitude.shape[1]):
        attitude, old = state.attitude[NOW, i], state.attitude[STEP, i]
        for k in range(3):
            gained = (1.0 - af) * attitude.acceleration[k] + af * old.acceleration[k]
            attitude.auxiliary[k] = (gained - am * old.auxiliary[k]) / (1.0 - am)
            attitude.gain[k] = attitude.acceleration[k] - old.acceleration[k]


@driver
def _turn_error(line, state, fraction) -> float:
    """Error of the solved step in the attitudes: of the place of a nose [m]; fraction: see step_error.local_error()."""
    worst = 0.0
    for i in range(line.rigid.bodies.shape[0]):
        body, attitude, old = line.rigid.bodies[i], state.attitude[NOW, i], state.attitude[STEP, i]
        change = scale(fraction, sub(at3(attitude.acceleration, 0), at3(old.acceleration, 0)))
        load = add(times(body.inertia, 0, 0, change), times(body.added, 3, 3, change))
        d = (
            dot(row_of(attitude.inverse, 0), load),
            dot(row_of(attitude.inverse, 1), load),
            dot(row_of(attitude.inverse, 2), load),
        )
        worst = max(worst, 0.5 * body.length * sqrt(dot(d, d)))
    return worst


@driver
def _begin_still(state, h) -> None:
    """Begin a step of backward Euler of h [s] with the attitudes as they are; keep them in slot STEP."""
    for i in range(state.attitude.shape[1]):
        attitude = state.attitude[NOW, i]
        state.attitude[STEP, i] = attitude
        for k in range(3):
            attitude.turned[k], attitude.acceleration[k], attitude.rate[k] = 0.0, -attitude.rate[k] / h, 0.0


@driver
def _rest_attitudes(state) -> None:
    """No rate and no acceleration of the attitudes."""
    for i in range(state.attitude.shape[1]):
        attitude = state.attitude[NOW, i]
        for k in range(3):
            attitude.rate[k], attitude.acceleration[k] = 0.0, 0.0
            attitude.auxiliary[k], attitude.gain[k] = 0.0, 0.0


@driver
def _rigid_energies(line, state) -> tuple[float, float, float]:
    """Kinetic energy, potential energy and that of the weights alone [J] of the rigid bodies."""
    kinetic, potential, dry = 0.0, 0.0, 0.0
    for i in range(line.rigid.bodies.shape[0]):
        body, attitude = line.rigid.bodies[i], state.attitude[NOW, i]
        z, v = state.nodes[NOW, Q, body.node, 2], row3(state.nodes[NOW, V], body.node)
        r, omega, g = axes(attitude.quaternion), at3(attitude.rate, 0), at3(body.gravity_centre, 0)
        moved = dot(to_body(r, v), cross(omega, g))
        kinetic += 0.5 * (body.mass * (dot(v, v) + 2.0 * moved) + dot(omega, times(body.inertia, 0, 0, omega)))
        weight = body.mass * body.gravity * (z + dot(r[2], g))
        dry += weight
        potential += weight - body.buoyancy * min(z + dot(r[2], at3(body.buoyancy_centre, 0)), 0.0)
    return kinetic, potential, dry


@driver
def _head_bodies(line, state) -> None:
    """Heading and rate of turn of the rigid bodies into the flow past them, in their rows of state.FLOW."""
    for i in range(line.rigid.bodies.shape[0]):
        attitude, flow = state.attitude[NOW, i], state.nodes[NOW, FLOW, line.rigid.bodies[i].node]
        r = axes(attitude.quaternion)
        miss = atan2(r[1][0], r[0][0]) - facing(flow)
        flow[LAG], flow[TURNING] = atan2(sin(miss), cos(miss)), dot(r[2], at3(attitude.rate, 0))


rigid_load, condense, follow_nodes = opaque(_rigid_load), opaque(_condense), opaque(_follow_nodes)
foresee_attitudes, correct_attitudes = opaque(_foresee_attitudes), opaque(_correct_attitudes)
conclude_attitudes, turn_error = opaque(_conclude_attitudes), opaque(_turn_error)
begin_still, rest_attitudes = opaque(_begin_still), opaque(_rest_attitudes)
head_bodies, rigid_energies = opaque(_head_bodies), opaque(_rigid_energies)


def link_rigid(line, state) -> None:
    """Compile or load what computes rigid bodies and publish it, where there is one; call before what uses it runs."""
    rule, there = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), len(line.rigid.bodies) > 0
    windy, still = there and bool(line.rigid.bodies["air"].max() > 0.0), (0.0, 0.0, 0.0)
    link(_air_load, line.rigid, 0, state, still, 0.0, np.bool_(False), needed=windy)
    link(_rigid_load, line.rigid, 0, state, AT_REST, np.bool_(False), needed=there)
    for kernel in (_condense, _follow_nodes, _rigid_energies, _head_bodies):
        link(kernel, line, state, needed=there)
    link(_copy_attitudes, state.attitude, 0, 0, needed=there)
    link(_rest_attitudes, state, needed=there)
    link(_foresee_attitudes, state, 0.0, 0.0, 0.0, rule, needed=there)
    link(_correct_attitudes, state, AT_REST, 0.0, needed=there)
    link(_conclude_attitudes, state, rule, needed=there)
    link(_begin_still, state, 0.0, needed=there)
    link(_turn_error, line, state, 0.0, needed=there)
