"""The element that crosses the water surface: its load integrated exactly on the wet interval, Westin (2018) (78)-(84).

The roots of z(xi) = 0 bound the wet intervals; Gauss points are mapped onto each, so the force is continuous for any
element length and needs no smoothing width. The moving bound adds N_i f(xi*) (x) N_j e_z / z' to the tangent.
In waves z counts from the surface over the element, which is taken as linear between its nodes.
"""

from ..compiler.jit import LANES, driver, inline
from .ancf import HALF_RHO_D, IDLE, LENGTH
from .drag import amplified, mean_lanes, point_lanes, water_load, water_tangent
from .hermite import W4, X4, shape, slope
from .sea import ELEVATION
from .water_kinematics import push_cut, stream_cut
from .workspace import RISE

THIRD = 1.0 / 3.0
ROUND_OFF = 4e-16  # of a place in [0, 1]


@inline
def height(z, x):
    """Cubic with Hermite data z[4] at x in [0, 1]."""
    n = shape(x)
    return n[0] * z[0] + n[1] * z[1] + n[2] * z[2] + n[3] * z[3]


@inline
def height_slope(z, x):
    """Derivative of height() to x."""
    d = slope(x)
    return d[0] * z[0] + d[1] * z[1] + d[2] * z[2] + d[3] * z[3]


@driver
def wet_intervals(z, bounds):
    """Wet intervals (z < 0) of the cubic with Hermite data z[4]: bounds: from, to, from, to ...; returns how many."""
    # monomials of z(x) and the interior extrema that split it into monotone pieces
    c1, c2 = z[1], -3.0 * z[0] - 2.0 * z[1] + 3.0 * z[2] - z[3]
    c3 = 2.0 * z[0] + z[1] - 2.0 * z[2] + z[3]
    edges = (0.0, 1.0, 1.0, 1.0)
    a, b, c = 3.0 * c3, 2.0 * c2, c1
    disc = b * b - 4.0 * a * c
    if disc > 0.0:
        s = disc**0.5
        q = -0.5 * (b + s) if b > 0.0 else -0.5 * (b - s)
        e1 = q / a if a != 0.0 else 2.0
        e2 = c / q if q != 0.0 else 2.0
        low, high = min(e1, e2), max(e1, e2)
        low = min(max(low, 0.0), 1.0)
        high = min(max(high, 0.0), 1.0)
        edges = (0.0, low, high, 1.0)
    count = 0
    start = 0.0
    wet = height(z, 0.0) < 0.0
    for i in range(3):
        lo, hi = edges[i], edges[i + 1]
        if hi <= lo:
            continue
        zl, zh = height(z, lo), height(z, hi)
        if (zl < 0.0) == (zh < 0.0):
            continue
        x = lo + (hi - lo) * zl / (zl - zh)
        for _ in range(60):  # Newton on a monotone piece, halved where it would leave it: at a tangency
            there = height(z, x)
            if (there < 0.0) == (zl < 0.0):
                lo = x
            else:
                hi = x
            rate, last = height_slope(z, x), x
            x = x - there / rate if rate != 0.0 else lo
            if not lo < x < hi:
                x = 0.5 * (lo + hi)
            if abs(x - last) <= ROUND_OFF:
                break
        if wet:
            bounds[2 * count], bounds[2 * count + 1] = start, x
            count += 1
        else:
            start = x
        wet = not wet
    if wet:
        bounds[2 * count], bounds[2 * count + 1] = start, 1.0
        count += 1
    return count


@driver
def raise_lanes(group, around, rise):
    """Elevation of the surface over both nodes of the elements of a group into rise [2, LANES]; around: see Work."""
    count = around.shape[0] - 1
    for lane in range(LANES):
        e = min(LANES * group + lane, count - 1)
        rise[0, lane], rise[1, lane] = around[e, ELEVATION], around[e + 1, ELEVATION]


@driver
def immersion(x, p, rise, wet):
    """Per lane 1 (wet), 0 (dry, or no water at all), -1 (crossing), by the hull of its Bezier points.

    rise: elevation of the surface over both nodes [2, LANES], linear in between.

    Returns wet, crossing of any lane.
    """
    any_wet, any_crossing = False, False
    for e in range(LANES):
        z0, z3 = x[2, e] - rise[0, e], x[8, e] - rise[1, e]
        tilt = rise[1, e] - rise[0, e]
        z1, z2 = z0 + THIRD * (x[5, e] - tilt), z3 - THIRD * (x[11, e] - tilt)
        low, high = min(min(z0, z1), min(z2, z3)), max(max(z0, z1), max(z2, z3))
        wet[e] = 0.0 if low >= 0.0 or p[HALF_RHO_D, e] == 0.0 else (1.0 if high < 0.0 else -1.0)
    for e in range(LANES):
        any_wet = any_wet or wet[e] > 0.0
        any_crossing = any_crossing or wet[e] < 0.0
    return any_wet, any_crossing


@driver
def repeat(table, e, out):
    """Column e of a table in every lane of ``out``."""
    for row in range(out.shape[0]):
        value = table[row, e]
        for lane in range(LANES):
            out[row, lane] = value


@driver
def waterline(e, work, rows, current, streams, change, tangent):
    """Load of the partly wet element in lane e of a group, subtracted from force[12, e] and k[144, e] of the work.

    One Gauss point a lane of the work tables; the last lanes hold the moving bounds. rows: element table of the group
    [ROWS, LANES]; streams: of the group [0 or 1, 4, STREAM_ROWS, LANES], see sea.py.
    """
    x, n, d, t, force, k = work.cut_x, work.cut_n, work.cut_d, work.point, work.force, work.k
    p = work.cut_p[:]  # of the type of a group's: the same compiled drag
    weight, at, ends, bounds = work.cut[0], work.cut[1], work.cut[2], work.cut[3]
    rise, tilt = work.lane[RISE, e], work.lane[RISE + 1, e] - work.lane[RISE, e]
    z = (work.x[2, e] - rise, work.x[5, e] - tilt, work.x[8, e] - rise - tilt, work.x[11, e] - tilt)
    count = wet_intervals(z, bounds)
    if count == 0:
        return
    repeat(work.x, e, x)
    repeat(rows, e, p)
    p[IDLE, 0] = 0.0
    second = amplified(p)
    if second:
        repeat(work.mean_v, e, work.cut_mean)
    for lane in range(LANES):
        weight[lane] = 0.0
        at[lane] = 0.0
        ends[lane] = 0.0
    length = rows[LENGTH, e]
    lane = 0
    for i in range(count):
        low, high = bounds[2 * i], bounds[2 * i + 1]
        for g in range(4):
            at[lane] = low + (high - low) * X4[g]
            weight[lane] = (high - low) * W4[g] * length
            lane += 1
        if low > 0.0:
            at[lane], ends[lane] = low, -1.0
            lane += 1
        if high < 1.0:
            at[lane], ends[lane] = high, 1.0
            lane += 1
    used = lane
    for lane in range(LANES):
        s, ds = shape(at[lane]), slope(at[lane])
        n[0, lane], n[1, lane], n[2, lane], n[3, lane] = s
        d[0, lane], d[1, lane], d[2, lane], d[3, lane] = ds
        if ends[lane] != 0.0:
            weight[lane] = length  # the load per xi there, which the tangent needs
    point_lanes(x, p, n, d, current, t)
    if streams.shape[0] > 0:
        stream_cut(streams, e, work)
    if second:
        mean_lanes(work.cut_mean, n, t)
    load, ka, kb = work.load[0], work.by_place[0], work.by_slope[0]
    if tangent:
        water_tangent(t, p, change, weight, second, (load, ka, kb))
    else:
        water_load(t, p, weight, second, load)
    if streams.shape[0] > 0:
        push_cut(work)
    for lane in range(used):
        if ends[lane] == 0.0:
            for i in range(4):
                for c in range(3):
                    force[3 * i + c, e] -= n[i, lane] * load[c, lane]
    if not tangent:
        return
    for lane in range(used):
        side = ends[lane]
        if side == 0.0:
            for i in range(4):
                for j in range(4):
                    a, b = n[i, lane] * n[j, lane], n[i, lane] * d[j, lane]
                    for c in range(9):
                        k[9 * (4 * i + j) + c, e] -= a * ka[c, lane] + b * kb[c, lane]
            continue
        rate = height_slope(z, at[lane])
        if abs(rate) < 1e-12:
            continue
        for i in range(4):
            for j in range(4):
                s = side * n[i, lane] * n[j, lane] / rate
                for c in range(3):
                    k[9 * (4 * i + j) + 3 * c + 2, e] += s * load[c, lane]
