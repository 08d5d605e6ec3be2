"""Mesh motion of a winch that feeds cable: where the nodes stand on the material, and what each element holds.

Arc length s counts from the cable's inner end on the drum. Nodes aboard keep their distance from the drum's tangent
point; nodes outboard keep their share of their zone, the cable between the ends of two sections. The end of a zone is
on the end of its section while that hangs outboard; nearer than ``minimum`` to the last node aboard it waits there and
the material runs on through it, so that an element may hold several sections. Every place is twice differentiable in
the pay-out; no element is ever split or merged. Number and order of nodes are constant. docs/theory.md, section 4.
"""

from ..compiler.jit import LANES, driver, inline
from .ancf import (
    CD_FIXED,
    CN_FIT,
    CT_FIXED,
    CT_OF_RE,
    EA,
    EI,
    EXTRA_ALONG,
    EXTRA_DRAG,
    FN,
    FT,
    HALF_RHO_D,
    ROWS,
    WEIGHT_PER_LENGTH,
)

ABOARD = -1


@inline
def at_least(d, minimum, width):
    """A smooth max(d, least), exact from ``width`` on either side, with its first and second derivative to d."""
    u = (d - minimum) / width
    if u >= 1.0:
        return d, 1.0, 0.0
    if u <= -1.0:
        return minimum, 0.0, 0.0
    return (
        minimum + width * (0.1875 + u * (0.5 + u * (0.375 - 0.0625 * u * u))),
        0.5 + u * (0.75 - 0.25 * u * u),
        0.75 * (1.0 - u * u) / width,
    )


@driver
def flow_of(h, coefficients, old, winch):
    """Rate of the pay-out at the end of a step of h [s], and its acceleration from the rates alone: WINCH.flow.

    The acceleration follows from the rates as an unknown's would, by the formulas of the time integration
    (integrate.py). That of the servo's last instant says nothing of a step: where the rate of a set-point is not quite
    that of its length it changes within every tick and comes back. From the lengths it would be a difference of
    differences, without bound as steps get shorter.
    """
    am, af, _, gamma, _, _ = coefficients
    rate, a, x = old.flow[0], old.flow[1], old.flow[2]
    new = ((winch.rate - rate) / h - (1.0 - gamma) * x) / gamma
    winch.flow[0] = winch.rate
    winch.flow[1] = ((1.0 - am) * new + am * x - af * a) / (1.0 - af)
    winch.flow[2] = new


@driver
def lay_mesh(feed, drum, winch, arc, elements):
    """Arc lengths of the nodes and their rates, arc[nodes, 3 or more], for the pay-out of now; the element table."""
    zones, nodes = feed.zones, feed.nodes
    if zones.shape[0] == 0:
        return
    tangent = drum.total - drum.payout_0 - winch.length  # arc length there, and its rates
    rate, accel = -winch.flow[0], -winch.flow[1]
    last = -1
    for n in range(nodes.shape[0]):
        if nodes[n].zone == ABOARD:
            arc[n, 0], arc[n, 1], arc[n, 2] = tangent + nodes[n].place, rate, accel
            last = n
    zone, begin, end = -1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for n in range(last + 1, nodes.shape[0]):
        while zone < nodes[n].zone:
            zone += 1
            begin = end
            x, d1, d2 = at_least(zones[zone].end - arc[last, 0], zones[zone].minimum, drum.blend)
            if zone == zones.shape[0] - 1:
                x, d1, d2 = zones[zone].end - arc[last, 0], 1.0, 0.0
            end = (x, -d1 * rate, d2 * rate * rate - d1 * accel)
        fraction = nodes[n].place
        for k in range(3):
            arc[n, k] = arc[last, k] + begin[k] + fraction * (end[k] - begin[k])
    fill_elements(feed, drum, arc, elements)


@driver
def fill_elements(feed, drum, arc, elements):
    """Rows of every element from the sections it holds, exact averages over its length."""
    zones, content = feed.zones, feed.content
    close, section, count = 1e-9 * drum.total, 0, content.shape[0]
    for e in range(count):
        begin, end = arc[e, 0], arc[e + 1, 0]
        while section < zones.shape[0] - 1 and zones[section].end <= begin + close:
            section += 1
        rows, lane = elements[e // LANES], e % LANES
        if zones[section].end >= end - close or section == zones.shape[0] - 1:
            if content[e] != section:
                for r in range(ROWS):
                    rows[r, lane] = feed.materials[section, r]
                content[e] = section
        else:
            mix(feed, section, begin, end, rows, lane)
            content[e] = -1
        if e == count - 1 and drum.end_stiffness > 0.0:
            length = end - begin
            minimum = drum.end_stiffness * rows[WEIGHT_PER_LENGTH, lane] * length**3
            rows[EI, lane] = max(feed.materials[zones.shape[0] - 1, EI], minimum)
    tail = count % LANES
    if tail > 0:  # the empty lanes repeat the last element
        rows = elements[elements.shape[0] - 1]
        for lane in range(tail, LANES):
            for r in range(ROWS):
                rows[r, lane] = rows[r, tail - 1]


@driver
def mix(feed, section, begin, end, rows, lane):
    """Rows of an element from ``begin`` to ``end`` that holds several sections, from ``section`` on.

    What adds up along the cable is averaged; compliances are; drag coefficients with the diameter that they multiply.
    Where one part has a constant C_D and the other C_D(Re), or another C_D(Re), the longer part's counts, for both.
    """
    zones, materials = feed.zones, feed.materials
    for r in range(ROWS):
        rows[r, lane] = 0.0
    ea, ei, drag, longest = 0.0, 0.0, 0.0, 0.0
    soft = False
    fixed, fit = -1.0, 0.0
    at, i = begin, section
    while at < end:
        to = end if i == zones.shape[0] - 1 else min(zones[i].end, end)
        m, w = materials[i], (to - at) / (end - begin)
        for r in range(ROWS):
            if FN <= r < FT + 11 or r in (EXTRA_DRAG, EXTRA_ALONG, CT_FIXED, CT_OF_RE):
                rows[r, lane] += w * m[HALF_RHO_D] * m[r]
            else:
                rows[r, lane] += w * m[r]
        drag += w * m[HALF_RHO_D]
        ea += w / m[EA]
        soft = soft or m[EI] <= 0.0
        ei += 0.0 if m[EI] <= 0.0 else w / m[EI]
        if w > longest:
            longest, fixed, fit = w, m[CD_FIXED], m[CN_FIT]
        at, i = to, i + 1
    rows[EA, lane], rows[EI, lane], rows[CD_FIXED, lane] = 1.0 / ea, (0.0 if soft else 1.0 / ei), fixed
    rows[CN_FIT, lane] = fit
    if drag > 0.0:
        for r in range(FN, FT + 11):
            rows[r, lane] /= drag
        for r in (EXTRA_DRAG, EXTRA_ALONG, CT_FIXED, CT_OF_RE):
            rows[r, lane] /= drag
