"""What one tick answers: tension, contact and shape read off the state into a Frame row and its two tables.

Tension is the effective tension. Aboard: conjugate to the arc length of an element (see ancf.py), interpolated between
element middles, as at the point where the cable leaves the sheave. Outboard: from the gradient at the nodes. At the
drum: from the force that holds the cable end.
"""

from __future__ import annotations

from math import acos, atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from .ancf import BUOYANCY, EA, MASS_PER_LENGTH, WEIGHT_PER_LENGTH
from .cable import HELD, LOST_POWER, POWERS, SURFACES, WATER
from .contact import LOADED, latch, loads, touch
from .jit import LANES, driver, inline
from .line import ITERATIONS, RESIDUAL, STRAIN, SUBSTEPS
from .shape import W5, X5, point_of, shape
from .ship import AGE, COORD, RATE, SOURCE_NOW, frame_shift, quaternion, spin, unrotate
from .surface import AXIS, RADIUS, margin
from .towbody import BUOYANCY as BODY_BUOYANCY
from .towbody import MASS as BODY_MASS
from .towbody import attitude
from .vec import dot, norm, scale, sub
from .winch import ACCEL_NOW, ANGLE_0, COMMAND_AGE, LENGTH_NOW, PAYOUT_0, RATE_NOW, SEAT, TARGET
from .winch import SIDE as WINCH_SIDE

# sim.frame.Flag as plain numbers for kernels; a test holds the two equal
(
    NEWTON_FAILED,
    HALVED,
    SLACK,
    DETACHED,
    PENETRATION,
    COARSE_AT_SURFACE,
    MOTION_STALE,
    MOTION_BLENDING,
    COMMAND_STALE,
    DRUM_END,
    NOT_FINITE,
) = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)

STORED = POWERS  # entry of State.account: energy [J] stored at the start
SLACK_TENSION = 1e-3  # N below zero at which an element counts as slack
COARSE, COARSE_DRUM = 0.4, 1.0  # element length over radius of sheave and drum


class Output(NamedTuple):
    frame: np.ndarray  # records of sim.frame.FRAME [rows]
    shape: np.ndarray  # [rows, nodes, 5]
    contact: np.ndarray  # [rows, stations, 9]


@driver
def locate(arc, s):
    """Element and xi at unstretched arc length s, clamped to the cable."""
    low, high = 0, arc.shape[0] - 1
    s = min(max(s, arc[0]), arc[high])
    while high - low > 1:
        mid = (low + high) // 2
        if arc[mid] <= s:
            low = mid
        else:
            high = mid
    return low, (s - arc[low]) / (arc[low + 1] - arc[low])


@driver
def tension_at(arc, tension, s):
    """Element tensions interpolated between element middles at arc length s."""
    e, x = locate(arc, s)
    o = e + 1 if x > 0.5 else e - 1
    if o < 0 or o >= tension.shape[0]:
        return tension[e]
    me, mo = 0.5 * (arc[e] + arc[e + 1]), 0.5 * (arc[o] + arc[o + 1])
    w = (s - me) / (mo - me)
    return tension[e] * (1.0 - w) + tension[o] * w


@driver
def node_tension(elements, q, last, n):
    """Tension at a node of a nearly straight cable from its gradient: continuous where the load per length jumps."""
    e = min(n, last - 1)
    ea = elements[e // LANES, EA, e % LANES]
    return ea * (sqrt(q[n, 3] ** 2 + q[n, 4] ** 2 + q[n, 5] ** 2) - 1.0)


@driver
def direction_at(arc, q, s):
    """Unit tangent at arc length s, towards the towbody."""
    e, x = locate(arc, s)
    _, _, g = point_of(arc, q, q, e, x)
    return scale(1.0 / norm(g), g)


@driver
def stations(model, state, table):
    """Contact stations of the sheave into table rows; returns sums and limits used by observe().

    (count, stations loaded in the groove, resultant on the sheave x y z, total of both halves, first and last loaded
    arc length, nearest arc length to the sheave top and its margin, deepest penetration, coarse, loaded length)
    """
    s = state.surfaces[model.sheave]
    c = state.ship[COORD : COORD + 6]
    count, loaded = 0, 0
    fx, fy, fz, total = 0.0, 0.0, 0.0, 0.0
    first, last, deepest, coarse, length_loaded = 0.0, 0.0, 0.0, False, 0.0
    nearest, where, spare = 1e300, 0.0, -model.groove_depth
    for e in range(state.tension.shape[0]):
        length = state.arc[e + 1] - state.arc[e]
        mid, _, _ = point_of(state.arc, state.q, state.v, e, 0.5)
        away = sub(mid, (s[0], s[1], s[2]))
        if norm(away) - 0.55 * length > s[RADIUS] + model.groove_depth:  # 10 % for stretch and curvature
            continue
        for g in range(5):
            r, v, _ = point_of(state.arc, state.q, state.v, e, X5[g])
            o = touch(r, v, s)
            h, d1, d2, n1, n2, f1, f2 = o[3], o[4], o[5], o[7], o[8], o[9], o[13]
            below, w, place = margin(o[17], h, s), W5[g] * length, state.arc[e] + X5[g] * length
            rel = unrotate(c, sub(r, (s[0], s[1], s[2])))
            angle = atan2(-rel[0], rel[2])
            if abs(h) < nearest and rel[2] > 0.0:
                nearest, where, spare = abs(h), place, below
            if f1 + f2 > LOADED:
                fx -= w * (f1 * n1[0] + f2 * n2[0])
                fy -= w * (f1 * n1[1] + f2 * n2[1])
                fz -= w * (f1 * n1[2] + f2 * n2[2])
                total += w * (f1 + f2)
                deepest = max(deepest, max(d1 if f1 > 0.0 else 0.0, d2 if f2 > 0.0 else 0.0))
                coarse = coarse or length > COARSE * s[RADIUS]
                if below > 0.0:
                    first = place if loaded == 0 else first
                    last = place
                    loaded += 1
                    length_loaded += w
            if count < table.shape[0]:
                table[count, 0], table[count, 1], table[count, 2] = rel
                table[count, 3] = angle
                table[count, 5], table[count, 4] = loads(o)
                table[count, 6] = h
                table[count, 7] = place
                table[count, 8] = w
                count += 1
    return count, loaded, (fx, fy, fz), total, first, last, where, spare, deepest, coarse, length_loaded


@inline
def quadratic(a, b, c, d):
    """Mass form of one coordinate: N-weighted a, b, c, d with MASS."""
    return (
        156.0 * (a * a + c * c)
        + 4.0 * (b * b + d * d)
        + 44.0 * (a * b - c * d)
        + 108.0 * a * c
        - 26.0 * (a * d - b * c)
        - 6.0 * b * d
    ) / 420.0


@driver
def energies(elements, body, gravity, arc, q, v):
    """Kinetic energy, potential of weight less buoyancy, potential of the weight alone [J], zero at the surface.

    Of cable and towbody.
    """
    kinetic, potential, dry = 0.0, 0.0, 0.0
    for e in range(arc.shape[0] - 1):
        p = elements[e // LANES]
        lane = e % LANES
        length = arc[e + 1] - arc[e]
        m = 0.5 * p[MASS_PER_LENGTH, lane] * length
        for k in range(3):
            kinetic += m * quadratic(v[e, k], length * v[e, 3 + k], v[e + 1, k], length * v[e + 1, 3 + k])
        z0, z1, z2, z3 = q[e, 2], length * q[e, 5], q[e + 1, 2], length * q[e + 1, 5]
        weight, lift = p[WEIGHT_PER_LENGTH, lane], p[BUOYANCY, lane]
        mean = 0.5 * (z0 + z2) + (z1 - z3) / 12.0
        dry += length * weight * mean
        if max(z0, z2) < 0.0:
            weight -= lift
        elif min(z0, z2) < 0.0:  # crossing the surface
            for g in range(5):
                n = shape(X5[g])
                z = n[0] * z0 + n[1] * z1 + n[2] * z2 + n[3] * z3
                potential -= W5[g] * length * lift * min(z, 0.0)
        potential += length * weight * mean
    last = q.shape[0] - 1
    for k in range(3):
        kinetic += 0.5 * body[BODY_MASS] * v[last, k] * v[last, k]
    z = q[last, 2]
    potential += body[BODY_MASS] * gravity * z - body[BODY_BUOYANCY] * min(z, 0.0)
    return kinetic, potential, dry + body[BODY_MASS] * gravity * z


@inline
def between(a, b):
    """Angle between two unit vectors [rad]."""
    return acos(min(max(dot(a, b), -1.0), 1.0))


@driver
def observe(model, state, output, slot, flags, blending):
    """Fill row ``slot`` of the output from the state; returns the flags with what was seen added."""
    f = output.frame[slot]
    c, d = state.ship[COORD : COORD + 6], state.ship[RATE : RATE + 6]
    omega, _ = spin(c, d, d)
    quat = quaternion(c)
    last = state.q.shape[0] - 1
    ox, oy = frame_shift(state.frame, state.time[0], state.time[1])
    f.time, f.tick = state.time[0], state.time[2]
    for k in range(3):
        o = ox if k == 0 else (oy if k == 1 else 0.0)
        w = state.frame[2] if k == 0 else (state.frame[3] if k == 1 else 0.0)
        f.ship_position[k] = c[k] + o
        f.ship_velocity[k] = d[k] + w
        f.ship_rate[k] = omega[k]
        f.sheave_position[k] = state.sheave[k] + o
        f.sheave_velocity[k] = state.sheave[3 + k] + w
        f.body_position[k] = state.q[last, k] + o
        f.body_velocity[k] = state.v[last, k] + w
        f.body_acceleration[k] = state.a[last, k]
    for k in range(4):
        f.ship_quaternion[k] = quat[k]
    count, loaded, force, total, first, end, where, spare, deepest, coarse, length_loaded = stations(
        model, state, output.contact[slot]
    )
    radius = state.surfaces[model.sheave, RADIUS]
    if loaded == 0:
        first, end = where, where
    ahead = max(0.25 * radius, 4.0 * model.bending_length)
    out = direction_at(state.arc, state.q, end + ahead)
    back = direction_at(state.arc, state.q, first - ahead)
    tension = tension_at(state.arc, state.tension, end + ahead)
    wrap = between(back, out)
    f.tension = tension
    vec = unrotate(c, scale(tension, out))
    res = unrotate(c, force)
    for k in range(3):
        f.tension_vector[k] = vec[k]
        f.contact_force[k] = res[k]
    f.departure_angle = acos(min(max(-out[2], -1.0), 1.0))
    state.measured[0], state.measured[1] = f.departure_angle, tension
    f.contact_resultant, f.contact_total = norm(force), total
    f.wrap_angle = (end - first) / radius if loaded > 0 else 0.0
    f.lifted_fraction = min(max(1.0 - length_loaded / max(wrap * radius, 1e-9), 0.0), 1.0)
    # groove margin over the stations between the two tangent directions, and the nearest one
    body_out, body_back = unrotate(c, out), unrotate(c, back)
    low, high = atan2(-body_back[2], -body_back[0]), atan2(-body_out[2], -body_out[0])
    sheave = state.surfaces[model.sheave]
    for i in range(count):
        row = output.contact[slot, i]
        if min(low, high) <= row[3] <= max(low, high):
            spare = min(spare, margin(row[1], row[6], sheave))
    f.groove_margin = max(spare, -model.groove_depth)
    f.contact_stations = count
    # the drum: penetration of its elements
    for i in range(state.surfaces.shape[0]):
        if i == model.sheave:
            continue
        for e in range(state.tension.shape[0]):
            length = state.arc[e + 1] - state.arc[e]
            r, _, _ = point_of(state.arc, state.q, state.v, e, 0.5)
            if norm(sub(r, (state.surfaces[i, 0], state.surfaces[i, 1], state.surfaces[i, 2]))) > (
                state.surfaces[i, RADIUS] + length
            ):
                break  # the drum holds the first elements
            for g in range(5):
                r, _, _ = point_of(state.arc, state.q, state.v, e, X5[g])
                rel = sub(r, (state.surfaces[i, 0], state.surfaces[i, 1], state.surfaces[i, 2]))
                y = dot(rel, (state.surfaces[i, AXIS], state.surfaces[i, AXIS + 1], state.surfaces[i, AXIS + 2]))
                depth = state.surfaces[i, RADIUS] - sqrt(max(dot(rel, rel) - y * y, 0.0))
                if depth > 0.0:
                    deepest = max(deepest, depth)
                    coarse = coarse or length > COARSE_DRUM * state.surfaces[i, RADIUS]
    f.penetration = deepest
    least, most = 1e300, -1e300
    for e in range(state.tension.shape[0]):
        least, most = min(least, state.tension[e]), max(most, state.tension[e])
    f.tension_least, f.tension_most = least, most
    f.tension_body = node_tension(model.elements, state.q, last, last)
    roll, pitch, yaw = attitude(state.flow[0])
    bq = quaternion((0.0, 0.0, 0.0, roll, pitch, yaw))
    for k in range(4):
        f.body_quaternion[k] = bq[k]
    f.body_rate[0], f.body_rate[1], f.body_rate[2] = state.flow[0, 3], state.flow[0, 4], state.flow[0, 5]
    f.payout = model.winch[PAYOUT_0] + state.winch[LENGTH_NOW]
    f.payout_rate, f.payout_acceleration = state.winch[RATE_NOW], state.winch[ACCEL_NOW]
    f.payout_setpoint = model.winch[PAYOUT_0] + state.winch[TARGET]
    f.drum_angle = model.winch[ANGLE_0] - state.winch[LENGTH_NOW] / model.winch[SEAT]
    f.drum_rate = -state.winch[RATE_NOW] / model.winch[SEAT]
    # torque of the reaction about the drum axis: the cable pulls the drum round with minus the reaction
    local = unrotate(c, (state.reaction[0, 0], state.reaction[0, 1], state.reaction[0, 2]))
    phi = f.drum_angle
    f.drum_torque = model.winch[SEAT] * (model.winch[WINCH_SIDE] * cos(phi) * local[0] - sin(phi) * local[2])
    f.tension_drum = f.drum_torque / model.winch[SEAT]
    kinetic, potential, dry = energies(model.elements, model.bodies[0], model.gravity, state.arc, state.q, state.v)
    f.kinetic_energy, f.strain_energy, f.potential_energy = kinetic, state.health[STRAIN], potential
    stored, account = kinetic + state.health[STRAIN] + dry, state.account
    if state.time[2] == 0:
        account[STORED] = stored
    f.work_supplied, f.work_water, f.work_contact, f.dissipated = (
        account[HELD],
        account[WATER],
        account[SURFACES],
        account[LOST_POWER],
    )
    f.energy_residual = (
        stored - account[STORED] + account[LOST_POWER] - (account[HELD] + account[WATER] + account[SURFACES])
    )
    f.iterations, f.substeps = np.int64(state.health[ITERATIONS]), np.int64(state.health[SUBSTEPS])
    f.residual = state.health[RESIDUAL]
    f.motion_source = np.int64(state.ship[SOURCE_NOW])
    f.motion_age = state.ship[AGE]
    f.command_age = state.winch[COMMAND_AGE]
    detached = latch(
        loaded > 0 and spare > 0.0, state.events, state.time[0], model.reseat_ns if state.time[2] > 0 else 0
    )
    f.detachments = state.events[0]
    if least < -SLACK_TENSION:
        flags |= SLACK
    if detached:
        flags |= DETACHED
    if deepest > model.penetration_limit:
        flags |= PENETRATION
    if coarse:
        flags |= COARSE_AT_SURFACE
    if state.ship[AGE] > model.stale_after:
        flags |= MOTION_STALE
    if blending:
        flags |= MOTION_BLENDING
    f.status = flags
    table = output.shape[slot]
    for n in range(last + 1):
        table[n, 0], table[n, 1], table[n, 2] = state.q[n, 0] + ox, state.q[n, 1] + oy, state.q[n, 2]
        aboard = state.arc[n] < end + ahead  # curved over drum and sheave: the elements know better than the nodes
        table[n, 3] = (
            tension_at(state.arc, state.tension, state.arc[n])
            if aboard
            else node_tension(model.elements, state.q, last, n)
        )
        table[n, 4] = state.arc[n]
    return flags
