"""What water, wind and ground do to a rigid body: loads of hull and wings, water entry, seabed; with derivatives.

Loads are in body axes about the tow point P, see rigid_body.py; tables of derivatives are rows of Work.body.
"""

from __future__ import annotations

from math import sqrt

from ..compiler.jit import driver, inline, opaque
from .attitude import axes, jacobian, to_body, to_world
from .contact_surface import ON_GROUND
from .drag_laws import smooth
from .state import NOW, V
from .towbody import ground_load
from .vec import add, at3, axpy, cross, dot, row3, scale, sub
from .wing import wing_force

SPEED_FLOOR = 1e-3  # m/s
BEARS = 0.01  # of the weight of its body: a wing that bears more at a C_L of 1 counts where it is stalled
# tables of work.body [TABLES, 6, 3]: derivatives of force and moment to velocity and rate, of the loads with the height
# of what they act on to the height of P and to the rotation, and the sums to the place and to the rotation
BY_SPEED, BY_RATE, BY_HEIGHT, BY_PLACE, BY_TURN = range(5)
NONE = (0.0, 0.0, 0.0)


@inline
def row_of(m, i):
    """Row i of a matrix of a record, as a vector."""
    return (m[i, 0], m[i, 1], m[i, 2])


@inline
def times(m, row, column, a):
    """The 3x3 block of a matrix that begins at row and column, times a vector."""
    return (
        m[row, column] * a[0] + m[row, column + 1] * a[1] + m[row, column + 2] * a[2],
        m[row + 1, column] * a[0] + m[row + 1, column + 1] * a[1] + m[row + 1, column + 2] * a[2],
        m[row + 2, column] * a[0] + m[row + 2, column + 1] * a[1] + m[row + 2, column + 2] * a[2],
    )


@inline
def times_rows(m, a):
    """A matrix given by its rows, times a vector."""
    return (dot(m[0], a), dot(m[1], a), dot(m[2], a))


@inline
def plus_rows(table, first, factor, m):
    """table[first:first+3] += factor m, m given by its rows."""
    for k in range(3):
        table[first, k] += factor * m[0][k]
        table[first + 1, k] += factor * m[1][k]
        table[first + 2, k] += factor * m[2][k]


@inline
def hat_times(a, m):
    """hat(a) m by its rows, m given by its rows."""
    return (
        axpy(a[1], m[2], scale(-a[2], m[1])),
        axpy(a[2], m[0], scale(-a[0], m[2])),
        axpy(a[0], m[1], scale(-a[1], m[0])),
    )


@inline
def hat_rows(a):
    """hat(a) by its rows."""
    return ((0.0, -a[2], a[1]), (a[2], 0.0, -a[0]), (-a[1], a[0], 0.0))


@inline
def block(m, row, column):
    """A 3x3 block of a matrix by its rows."""
    return (
        (m[row, column], m[row, column + 1], m[row, column + 2]),
        (m[row + 1, column], m[row + 1, column + 1], m[row + 1, column + 2]),
        (m[row + 2, column], m[row + 2, column + 1], m[row + 2, column + 2]),
    )


@inline
def between(m, n):
    """m n by its rows, both given by their rows."""
    return (
        axpy(m[0][0], n[0], axpy(m[0][1], n[1], scale(m[0][2], n[2]))),
        axpy(m[1][0], n[0], axpy(m[1][1], n[1], scale(m[1][2], n[2]))),
        axpy(m[2][0], n[0], axpy(m[2][1], n[1], scale(m[2][2], n[2]))),
    )


@inline
def scaled(s, m):
    """s m by its rows."""
    return (scale(s, m[0]), scale(s, m[1]), scale(s, m[2]))


@inline
def plus(m, s, n):
    """m + s n by its rows."""
    return (axpy(s, n[0], m[0]), axpy(s, n[1], m[1]), axpy(s, n[2], m[2]))


@inline
def outer(a, b):
    """a b^T by its rows."""
    return (scale(a[0], b), scale(a[1], b), scale(a[2], b))


@inline
def turned_by(place, d):
    """-D hat(place) by its rows, D given by its rows."""
    return (cross(place, d[0]), cross(place, d[1]), cross(place, d[2]))


@inline
def spread(t, d, place, wet):
    """A load f(w) at ``place`` with D = df/dw, given by its rows: its part of the residual's derivatives, of which it
    is minus the load: to the body's velocity D, to its rate -D hat(place), and the same of the moment."""
    turned = turned_by(place, d)
    plus_rows(t[BY_SPEED], 0, wet, d)
    plus_rows(t[BY_RATE], 0, wet, turned)
    plus_rows(t[BY_SPEED], 3, wet, hat_times(place, d))
    plus_rows(t[BY_RATE], 3, wet, hat_times(place, turned))


@inline
def spread_along(t, first, second, place):
    """What loads at places x ahead of ``place`` add to spread(): sums of x D and of x^2 D over them, by their rows."""
    ahead = (1.0, 0.0, 0.0)
    turned = turned_by(ahead, first)
    plus_rows(t[BY_RATE], 0, 1.0, turned)
    plus_rows(t[BY_SPEED], 3, 1.0, hat_times(ahead, first))
    plus_rows(t[BY_RATE], 3, 1.0, hat_times(place, turned))
    plus_rows(t[BY_RATE], 3, 1.0, hat_times(ahead, turned_by(place, first)))
    plus_rows(t[BY_RATE], 3, 1.0, hat_times(ahead, turned_by(ahead, second)))


@inline
def rises(t, force, moment, slope, turn):
    """A load that goes with a wet share, whose slopes to the height of P and to the rotation are given."""
    if slope != 0.0:
        for k in range(3):
            t[BY_HEIGHT, k, 0] -= slope * force[k]
            t[BY_HEIGHT, 3 + k, 0] -= slope * moment[k]
        plus_rows(t[BY_TURN], 0, -1.0, outer(force, turn))
        plus_rows(t[BY_TURN], 3, -1.0, outer(moment, turn))


@inline
def wet_share(place, up, height, half_height):
    """Wet share of what lies at ``place`` on a body whose tow point is ``height`` over the water; its slopes to that
    and to the rotation."""
    dry, slope = smooth(height + dot(place, up), -half_height, half_height)
    return 1.0 - dry, -slope, scale(-slope, cross(place, up))


@driver
def hull_load(body, strips, motion, up, height, t, tangent):
    """Force and moment of crossflow and buoyancy on the hull and of drag along it, moment of the buoyancy about P over
    the direction up, and the wet share of the hull with its slopes to height and rotation.

    motion: velocity through the water and rate, body axes.
    """
    u, omega = motion
    c, b = at3(body.hull_centre, 0), at3(body.buoyancy_centre, 0)
    fy, fz, my, mz, wetness, ahead, slopes, turns = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NONE
    # rows of the strips' derivatives along y and z: their sums, and those times x and x^2 from the hull's centre
    y0, z0, y1, z1, y2, z2 = (NONE, NONE, NONE, NONE, NONE, NONE)
    wy, wz = -(u[1] + omega[2] * c[0] - omega[0] * c[2]), -(u[2] + omega[0] * c[1] - omega[1] * c[0])
    for i in range(body.strips[0], body.strips[1]):
        s = strips[i]
        x, ky, kz = s.along, s.across[0], s.across[1]
        wet, slope, turn = wet_share((c[0] + x, c[1], c[2]), up, height, s.half_height)
        y, z = wy - omega[2] * x, wz + omega[1] * x
        speed = sqrt(y * y + z * z + SPEED_FLOOR * SPEED_FLOOR)
        dy, dz = wet * ky * speed * y, wet * kz * speed * z
        fy, fz, my, mz = fy + dy, fz + dz, my + x * dy, mz + x * dz
        wetness += wet * s.share
        ahead += wet * s.share * x
        slopes, turns = slopes + slope * s.share, axpy(s.share, turn, turns)
        if tangent:
            per = 1.0 / speed
            by_y = scale(wet * ky, (0.0, speed + y * y * per, y * z * per))
            by_z = scale(wet * kz, (0.0, y * z * per, speed + z * z * per))
            y0, y1, y2 = add(y0, by_y), axpy(x, by_y, y1), axpy(x * x, by_y, y2)
            z0, z1, z2 = add(z0, by_z), axpy(x, by_z, z1), axpy(x * x, by_z, z2)
            if slope != 0.0:
                lift, drag = s.share * body.buoyancy, (0.0, ky * speed * y, kz * speed * z)
                place, centre = (c[0] + x, c[1], c[2]), (b[0] + x, b[1], b[2])
                whirl = axpy(lift, cross(centre, up), cross(place, drag))
                rises(t, axpy(lift, up, drag), whirl, slope, turn)
    lever = scale(body.buoyancy, (wetness * b[0] + ahead, wetness * b[1], wetness * b[2]))
    w = -(u[0] + omega[1] * c[2] - omega[2] * c[1])
    size = body.drag * abs(w) * wetness
    drag = (size * w, fy, fz)
    moment = add(add(cross(c, drag), (0.0, -mz, my)), cross(lever, up))
    if tangent:
        spread(t, ((2.0 * size, 0.0, 0.0), y0, z0), c, 1.0)
        spread_along(t, (NONE, y1, z1), (NONE, y2, z2), c)
    return axpy(body.buoyancy * wetness, up, drag), moment, lever, wetness, slopes, turns


@driver
def wing_loads(body, wings, flaps, motion, up, height, t, tangent):
    """Force and moment of the wings; the largest angle of attack over that of stall of those that bear something.

    flaps: angles [rad] of those of the body."""
    u, omega = motion
    force, moment, attack = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
    for i in range(body.wings[0], body.wings[1]):
        wing = wings[i]
        place = at3(wing.place, 0)
        wet, slope, turn = wet_share(place, up, height, wing.half_height)
        past, flap = scale(-1.0, add(u, cross(omega, place))), flaps[i - body.wings[0]]
        f, d, stall, size = wing_force(wing, flap, past, tangent)
        if wet * size > BEARS * body.mass * body.gravity:
            attack = max(attack, stall)
        m = cross(place, f)
        force, moment = axpy(wet, f, force), axpy(wet, m, moment)
        if tangent:
            spread(t, d, place, wet)
            rises(t, f, m, slope, turn)
    return force, moment, attack


@driver
def _air_load(rigid, i, state, u, height, tangent) -> tuple[float, float, float, float, float, float]:
    """Force and moment of the wind on the dry share of strips and wings, with the coefficients they have in water; u:
    velocity through the water, body axes, to which t has the derivatives; height: of P over the water."""
    body, attitude, t, c = rigid.bodies[i], state.attitude[NOW, i], state.work.body, at3(rigid.bodies[i].hull_centre, 0)
    r, omega, w = axes(attitude.quaternion), at3(attitude.rate, 0), state.memory[NOW].wind
    own = to_body(r, sub(row3(state.nodes[NOW, V], body.node), (w[0], w[1], 0.0)))
    off, force, moment = hat_rows(sub(own, u)), NONE, NONE
    strips = body.strips[1] - body.strips[0]
    for k in range(strips + body.wings[1] - body.wings[0]):
        if k < strips:
            s = rigid.strips[body.strips[0] + k]
            place, kx, ky, kz = (c[0] + s.along, c[1], c[2]), body.drag * s.share, s.across[0], s.across[1]
            wet, slope, turn = wet_share(place, r[2], height, s.half_height)
            x, y, z = scale(-1.0, add(own, cross(omega, place)))
            speed = sqrt(y * y + z * z + SPEED_FLOOR * SPEED_FLOOR)
            f = (kx * abs(x) * x, ky * speed * y, kz * speed * z)
            d = (
                (2.0 * kx * abs(x), 0.0, 0.0),
                (0.0, ky * (speed + y * y / speed), ky * y * z / speed),
                (0.0, kz * y * z / speed, kz * (speed + z * z / speed)),
            )
        else:
            wing, flap = rigid.wings[body.wings[0] + k - strips], attitude.flap[k - strips]
            place = at3(wing.place, 0)
            wet, slope, turn = wet_share(place, r[2], height, wing.half_height)
            f, d, _, _ = wing_force(wing, flap, scale(-1.0, add(own, cross(omega, place))), tangent)
        dry, f, d = 1.0 - wet, scale(body.air, f), scaled(body.air, d)
        m = cross(place, f)
        force, moment = axpy(dry, f, force), axpy(dry, m, moment)
        if tangent and dry > 0.0:
            spread(t, d, place, dry)
            rises(t, f, m, -slope, scale(-1.0, turn))
            plus_rows(t[BY_TURN], 0, dry, between(d, off))
            plus_rows(t[BY_TURN], 3, dry, hat_times(place, between(d, off)))
    return force[0], force[1], force[2], moment[0], moment[1], moment[2]


air_load = opaque(_air_load)  # compiled where there is wind


@driver
def enter(body, moved, grown, t, tangent):
    """Force and moment of the water that goes with a hull that goes under: its momenta p and h times the rate at which
    its wet share grows (von Karman 1929); what comes out gives none back.

    moved: velocity through the water and rate, p and h; grown: what that wet share gains with place and rotation.
    """
    u, omega, p, h = moved
    by_place, by_turn = grown
    grows = dot(by_place, u) + dot(by_turn, omega)
    if grows <= 0.0:
        return NONE, NONE
    if tangent:
        for k, momentum in ((0, p), (3, h)):
            by_u, by_omega = outer(momentum, by_place), outer(momentum, by_turn)
            plus_rows(t[BY_SPEED], k, 1.0, plus(by_u, grows, block(body.added, k, 0)))
            plus_rows(t[BY_RATE], k, 1.0, plus(by_omega, grows, block(body.added, k, 3)))
    return scale(-grows, p), scale(-grows, h)


@driver
def stand(body, attitude, state, r, moved, c1, t, tangent):
    """Force, moment (body axes) and power [W] of the ground on the round ends of the hull; with tangent their
    derivatives are added to what sum_up() has made. moved: place and velocity of P."""
    q, v = moved
    omega, force, moment, power, j = at3(attitude.rate, 0), NONE, NONE, 0.0, jacobian(attitude.turned)
    back = ((r[0][0], r[1][0], r[2][0]), (r[0][1], r[1][1], r[2][1]), (r[0][2], r[1][2], r[2][2]))
    for k in range(state.surfaces.shape[0]):
        if state.surfaces[k].carrier != ON_GROUND or body.floor_stiffness == 0.0:
            continue
        for end in range(2):
            ahead = (1.0 - 2.0 * end) * (0.5 * body.length - body.radius)
            place = add(at3(body.hull_centre, 0), (ahead, 0.0, 0.0))
            at, speed = add(q, to_world(r, place)), add(v, to_world(r, cross(omega, place)))
            under = (at[0], at[1], at[2] - body.radius)
            load, rows = ground_load(state.surfaces[k], body.floor_stiffness, under, speed, c1)
            f = to_body(r, load)
            force, moment, power = add(force, f), add(moment, cross(place, f)), power + dot(load, speed)
            if tangent:
                by_place = between(back, rows)
                by_turn = plus(scaled(-1.0, turned_by(place, between(by_place, r))), -1.0, hat_rows(f))
                by_turn = between(by_turn, j)
                plus_rows(t[BY_PLACE], 0, -1.0, by_place)
                plus_rows(t[BY_PLACE], 3, -1.0, hat_times(place, by_place))
                plus_rows(t[BY_TURN], 0, 1.0, by_turn)
                plus_rows(t[BY_TURN], 3, 1.0, hat_times(place, by_turn))
    return force, moment, power
