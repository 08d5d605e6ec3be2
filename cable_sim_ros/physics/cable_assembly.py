"""The cable: material, sections, and the assembly of residual and tangent, group by group of 16 elements.

A group is gathered once; each physics adds its part to force[12, LANES] and k[144, LANES] where the group needs it;
the group is scattered once into the block-tridiagonal system. Unknowns of a node: r [m] and g = dr/dp [1].
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..compiler.jit import LANES, driver, inline, link, opaque
from .ancf import (
    EXTRA_DRAG,
    EXTRA_NOW,
    FLOW_0,
    FLOW_1,
    FLOW_RATE_0,
    FLOW_RATE_1,
    IDLE,
    LENGTH,
    PER_LENGTH,
    elastic_lanes,
    elastic_tangent_lanes,
    inertia_lanes,
    inertia_tangent_lanes,
)
from .contact import contact_lanes, contact_point_lanes, contact_tangent_lanes
from .contact_surface import DRUM, GROOVE, NO_TOP, out_of_reach, solid
from .drag import amplified, mean_lanes, point_lanes, spread_force, spread_matrix, water_load, water_tangent
from .hermite import W4, W5, X4, X5, shape, slope
from .link_element import (
    closed_loads,
    drop_axial_lift,
    fold_links,
    is_links,
    link_lanes,
    link_links,
    straighten,
    straighten_mean,
)
from .mesh_convection import convective_tangent_lanes, material_lanes
from .section import Cable as Cable
from .section import Section as Section
from .state import ARC, AT_REST, MEAN, NOW, STRUM, A, Q, V
from .vec import add, dot, get3, scale, sub
from .viv_amplification import EXTRA
from .water_kinematics import N4L, push_points, stream_points
from .waterline import THIRD, immersion, raise_lanes, waterline
from .workspace import ENERGY, LOST, LOST_POWER, NEAR, OWN, RISE, SUM, SURFACES, TENSION, WATER, WEIGHT, WET

CONTACT_POINTS, DRAG_POINTS = np.arange(0, 12)[[5, 4]]  # numpy integers: no version per literal
_N4 = np.array([shape(x) for x in X4])
_D4 = np.array([slope(x) for x in X4])
_N5 = np.array([shape(x) for x in X5])
_D5 = np.array([slope(x) for x in X5])
D4L = np.repeat(_D4[:, :, None], LANES, 2)  # [point, 4, LANES]


@driver
def gather(group, elements, state):
    """Unknowns of one group into lanes; the tail repeats the last element. Lengths come from the arc lengths, and go
    with the flow and EXTRA_NOW into the element table.

    Velocities and accelerations are those of the material. Returns whether it moves through the mesh.
    """
    q, v, a, arc = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, A], state.nodes[NOW, ARC]
    x, p = state.work.lanes[0].x, elements[group]
    count = arc.shape[0] - 1
    flows = False
    p[IDLE, 0] = max(LANES * (group + 1) - count, 0) // 8 * 8
    for lane in range(LANES):
        e = min(LANES * group + lane, count - 1)
        length = arc[e + 1, 0] - arc[e, 0]
        per_length = 1.0 / length
        p[LENGTH, lane] = length
        p[PER_LENGTH, lane] = per_length
        p[EXTRA_NOW, lane] = p[EXTRA_DRAG, lane] + state.nodes[NOW, STRUM, e, EXTRA]
        p[FLOW_0, lane], p[FLOW_1, lane] = arc[e, 1] * per_length, arc[e + 1, 1] * per_length
        p[FLOW_RATE_0, lane], p[FLOW_RATE_1, lane] = arc[e, 2] * per_length, arc[e + 1, 2] * per_length
        flows = flows or arc[e, 1] != 0.0 or arc[e + 1, 1] != 0.0 or arc[e, 2] != 0.0 or arc[e + 1, 2] != 0.0
        for c in range(3):
            x[c, lane] = q[e, c]
            x[3 + c, lane] = length * q[e, 3 + c]
            x[6 + c, lane] = q[e + 1, c]
            x[9 + c, lane] = length * q[e + 1, 3 + c]
            x[12 + c, lane] = v[e, c]
            x[15 + c, lane] = length * v[e, 3 + c]
            x[18 + c, lane] = v[e + 1, c]
            x[21 + c, lane] = length * v[e + 1, 3 + c]
            x[24 + c, lane] = a[e, c]
            x[27 + c, lane] = length * a[e, 3 + c]
            x[30 + c, lane] = a[e + 1, c]
            x[33 + c, lane] = length * a[e + 1, 3 + c]
    if is_links(arc):
        straighten(state.work.lanes[0], p)
    if flows:
        material_lanes(x, p)
    return flows


@inline
def mean_at(nodes, n, c, fraction):
    """Running mean of the material's velocity at node n, and of the rate of its gradient, after a step that takes up
    ``fraction``: component c."""
    v = nodes[NOW, V, n, c] - (nodes[NOW, ARC, n, 1] * nodes[NOW, Q, n, 3 + c] if c < 3 else 0.0)
    return nodes[NOW, MEAN, n, c] + fraction * (v - nodes[NOW, MEAN, n, c])


@driver
def gather_mean(group, p, state, fraction):
    """Running mean of the scaled velocities into lanes, at the end of a step of which it takes up ``fraction``."""
    mean, nodes = state.work.lanes[0].mean_v, state.nodes
    count = nodes.shape[2] - 1
    for lane in range(LANES):
        e = min(LANES * group + lane, count - 1)
        length = p[LENGTH, lane]
        for c in range(6):
            scaled = length if c >= 3 else 1.0
            mean[c, lane] = scaled * mean_at(nodes, e, c, fraction)
            mean[6 + c, lane] = scaled * mean_at(nodes, e + 1, c, fraction)
    if is_links(nodes[NOW, ARC]):
        straighten_mean(state.work.lanes[0])


@driver
def scatter(group, p, state, tangent):
    """Add one group to the system; gradient rows and columns carry the element length.

    Elements come in order: what the second node of an element holds is set, what the first holds is added to.
    """
    tables, band, lower = state.work.lanes[0], state.work.band, state.work.lower
    force, k = tables.force, tables.k
    count = band.shape[0] - 1
    if group == 0:
        open_end(band[0], tangent)
    for lane in range(min(LANES, count - LANES * group)):
        e = LANES * group + lane
        length = p[LENGTH, lane]
        for c in range(3):
            band[e, c, 12] -= force[c, lane]
            band[e, 3 + c, 12] -= length * force[3 + c, lane]
            band[e + 1, c, 12] = -force[6 + c, lane]
            band[e + 1, 3 + c, 12] = -length * force[9 + c, lane]
        if tangent:
            square = length * length
            for c in range(3):
                for d in range(3):
                    r = 3 * c + d
                    band[e, c, d] += k[r, lane]
                    band[e, c, 3 + d] += length * k[9 + r, lane]
                    band[e, c, 6 + d] = k[18 + r, lane]
                    band[e, c, 9 + d] = length * k[27 + r, lane]
                    band[e, 3 + c, d] += length * k[36 + r, lane]
                    band[e, 3 + c, 3 + d] += square * k[45 + r, lane]
                    band[e, 3 + c, 6 + d] = length * k[54 + r, lane]
                    band[e, 3 + c, 9 + d] = square * k[63 + r, lane]
                    lower[e + 1, c, d] = k[72 + r, lane]
                    lower[e + 1, c, 3 + d] = length * k[81 + r, lane]
                    band[e + 1, c, d] = k[90 + r, lane]
                    band[e + 1, c, 3 + d] = length * k[99 + r, lane]
                    lower[e + 1, 3 + c, d] = length * k[108 + r, lane]
                    lower[e + 1, 3 + c, 3 + d] = square * k[117 + r, lane]
                    band[e + 1, 3 + c, d] = length * k[126 + r, lane]
                    band[e + 1, 3 + c, 3 + d] = square * k[135 + r, lane]


@driver
def open_end(row, tangent):
    """Zero the first node's row [6, 16] of the system; without tangent only its right-hand side."""
    for r in range(6):
        row[r, 12] = 0.0
        if tangent:
            for c in range(6):
                row[r, c] = 0.0


@inline
def hull_of(x, e):
    """Middle of the element in lane e, and the square of the length [m] within which its Bezier points lie about it.

    Control points -+h/2 - t, -+(h/2 - g/3) - t about the middle, t = (A - B)/8.
    """
    a, b = get3(x, 3, e), get3(x, 9, e)
    begin, end = get3(x, 0, e), get3(x, 6, e)
    t = scale(0.125, sub(a, b))
    middle = add(scale(0.5, add(begin, end)), t)
    h = scale(0.5, sub(end, begin))
    fx = max(abs(h[0]), max(abs(h[0] - THIRD * a[0]), abs(h[0] - THIRD * b[0]))) + abs(t[0])
    fy = max(abs(h[1]), max(abs(h[1] - THIRD * a[1]), abs(h[1] - THIRD * b[1]))) + abs(t[1])
    fz = max(abs(h[2]), max(abs(h[2] - THIRD * a[2]), abs(h[2] - THIRD * b[2]))) + abs(t[2])
    return middle, fx * fx + fy * fy + fz * fz


@driver
def near_surface(x, surface, near):
    """Can any lane's element touch a surface? Its Bezier points lie within a known distance of its middle."""
    s = solid(surface)
    if s.kind == DRUM or s.kind == GROOVE:
        radius = s.radius + (0.0 if s.top >= NO_TOP else s.top)
        for e in range(LANES):
            middle, bound = hull_of(x, e)
            rel = sub(middle, s.centre)
            ax = dot(rel, s.axis)
            out = dot(rel, rel) - ax * ax - radius * radius - bound  # distance from the axis > radius + sqrt(bound),
            near[e] = 0.0 if out > 0.0 and out * out > 4.0 * radius * radius * bound else 1.0  # without roots
    else:
        for e in range(LANES):
            middle, bound = hull_of(x, e)
            near[e] = 0.0 if out_of_reach(s, middle, sqrt(bound)) else 1.0
    for e in range(LANES):
        if near[e] > 0.0:
            return True
    return False


@driver
def power_of(x, force, count, total):
    """Power [W] of force[12, LANES] on the velocities of the first ``count`` lanes; total [LANES] is work space."""
    if x.shape[1] != LANES or force.shape[1] != LANES or total.shape[0] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        total[e] = (
            force[0, e] * x[12, e]
            + force[1, e] * x[13, e]
            + force[2, e] * x[14, e]
            + force[3, e] * x[15, e]
            + force[4, e] * x[16, e]
            + force[5, e] * x[17, e]
            + force[6, e] * x[18, e]
            + force[7, e] * x[19, e]
            + force[8, e] * x[20, e]
            + force[9, e] * x[21, e]
            + force[10, e] * x[22, e]
            + force[11, e] * x[23, e]
        )
    s = 0.0
    for e in range(count):
        s += total[e]
    return s


@driver
def _water_part(line, state, group, change, wet, crossing, tangent) -> None:
    """Drag, added mass and buoyancy of the group in the lanes into force and k; wet, crossing: see immersion()."""
    work = state.work.lanes[0]
    x, p = work.x, line.elements[group]
    weight, wetness = work.lane[WEIGHT], work.lane[WET]
    streams = state.work.stream[group : group + 1]  # no row: a linear current is all
    m = state.memory[NOW].current
    current = (m[0], m[1], m[2], m[3])
    second, links = amplified(p), is_links(state.nodes[NOW, ARC])
    if second:
        gather_mean(group, p, state, change.fraction)
    if wet:
        for g in range(4):
            for e in range(LANES):
                weight[e] = p[LENGTH, e] * W4[g] if wetness[e] > 0.0 else 0.0
            point_lanes(x, p, N4L[g], D4L[g], current, work.point)
            if streams.shape[0] > 0:
                stream_points(streams, g, work)
            if second:
                mean_lanes(work.mean_v, N4L[g], work.point)
            if tangent:
                water_tangent(work.point, p, change, weight, second, (work.load[g], work.by_place[g], work.by_slope[g]))
            else:
                water_load(work.point, p, weight, second, work.load[g])
            if streams.shape[0] > 0:
                push_points(streams, g, work, p)
        if links and streams.shape[0] == 0:
            closed_loads(work, p, current, second)
        spread_force(_N4, work.load, DRAG_POINTS, work.force)
        if tangent:
            spread_matrix(_N4, _D4, (work.by_place, work.by_slope), DRAG_POINTS, work.mixed, work.k)
    if crossing:
        for e in range(LANES):
            if wetness[e] < 0.0:
                waterline(e, work, p, current, streams, change, tangent)
    if links:
        drop_axial_lift(work, p, tangent)


water_part = opaque(_water_part)


@driver
def _contact_part(line, state, group, change, tangent) -> bool:
    """Contact of the group in the lanes into force and k. Returns whether any surface is near."""
    work = state.work.lanes[0]
    x, p = work.x, line.elements[group]
    weight, near = work.lane[WEIGHT], work.lane[NEAR]
    touched = False
    for i in range(state.surfaces.shape[0]):
        if near_surface(x, state.surfaces[i], near):
            for g in range(CONTACT_POINTS):
                for e in range(LANES):
                    weight[e] = p[LENGTH, e] * W5[g] * near[e]
                contact_point_lanes(x, p, _N5[g], work.point)
                if tangent:
                    contact_tangent_lanes(
                        work.point,
                        state.surfaces[i],
                        change.velocity,
                        weight,
                        (work.load[g], work.by_place[g], work.by_slope[g]),
                    )
                else:
                    contact_lanes(work.point, state.surfaces[i], weight, work.load[g])
            spread_force(_N5, work.load, CONTACT_POINTS, work.force)
            if tangent:
                spread_matrix(_N5, _D5, (work.by_place, work.by_slope), CONTACT_POINTS, work.mixed, work.k)
            touched = True
    return touched


contact_part = opaque(_contact_part)


@driver
def _assemble(line, state, change, tangent) -> float:
    """Residual R = M a + Q_int - Q_ext as -R in band[:, :, 12] and, with tangent, dR/dq.

    line: a LineModel; change: see state.Change. state.tension receives the element tensions [N],
    work.power the powers of the parts. Returns the strain energy [J].
    """
    own, lost, water, pressed = 0.0, 0.0, 0.0, 0.0
    elements, work, tension = line.elements, state.work.lanes[0], state.tension
    x, force, k, lane_sum = work.x, work.force, work.k, work.lane[SUM]
    c1, c2, sigma = change.velocity, change.acceleration, change.damping
    count, links = tension.shape[0], is_links(state.nodes[NOW, ARC])
    total, rise = 0.0, work.lane[RISE : RISE + 2]
    for group in range(elements.shape[0]):
        flows, p = gather(group, elements, state), elements[group]
        if links:
            link_lanes(work, p, change, tangent)
        elif tangent:
            inertia_lanes(x, p, force, sigma)
            elastic_tangent_lanes(x, p, c1, force, work.lane[TENSION], work.lane[ENERGY], work.lane[LOST], work.k9, k)
            inertia_tangent_lanes(p, c2 + sigma * c1, k)
            if flows:
                convective_tangent_lanes(p, c1, k)
        else:
            inertia_lanes(x, p, force, sigma)
            elastic_lanes(x, p, force, work.lane[TENSION], work.lane[ENERGY], work.lane[LOST])
        real = min(LANES, count - LANES * group)
        for lane in range(real):
            tension[LANES * group + lane] = work.lane[TENSION, lane]
            total += work.lane[ENERGY, lane]
            lost += work.lane[LOST, lane]
        before = power_of(x, force, real, lane_sum)
        own += before
        if state.work.stream.shape[0] > 0:
            raise_lanes(group, state.work.around, rise)
        wet, crossing = immersion(x, p, rise, work.lane[WET])
        if wet or crossing:
            water_part(line, state, group, change, wet, crossing, tangent)
            after = power_of(x, force, real, lane_sum)
            water += before - after
            before = after
        if state.surfaces.shape[0] > 0 and contact_part(line, state, group, change, tangent):
            pressed += before - power_of(x, force, real, lane_sum)
        if links:
            fold_links(work, p, tangent)
        scatter(group, p, state, tangent)
    work.power[OWN], work.power[LOST_POWER], work.power[WATER], work.power[SURFACES] = own, lost, water, pressed
    return total


assemble = opaque(_assemble)


def link_assembly(line, state) -> None:
    """Compile or load the assembly and publish it; call before anything that uses it runs."""
    tangent = np.bool_(False)
    link_links(line, state)
    link(_water_part, line, state, 0, AT_REST, tangent, tangent, tangent)
    link(_contact_part, line, state, 0, AT_REST, tangent)
    link(_assemble, line, state, AT_REST, tangent)
