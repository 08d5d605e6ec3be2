"""How fine a mesh the answers at the sheave need: ``cable-sim bench --sheave-mesh``.

Tension, bending stiffness and sheave of the full-scale scene on the bench: weightless, both far lines pulled by dead
forces. Elements of one length over sheave and 6 sqrt(EI/T) beyond, in four positions against the sheave; the error
is that of the worst, against the finest mesh of the sweep. Two surfaces: the scene's own groove and contact stiffness,
and a cylinder so hard that it shows what a rigid sheave would carry.
"""

from __future__ import annotations

from math import ceil, cos, degrees, radians, sin, sqrt

import numpy as np

from cable_sim_ros.physics.contact import Contact
from cable_sim_ros.physics.contact_surface import stiffness
from cable_sim_ros.runs.message_run import Progress
from cable_sim_ros.sim.rig.rig import FOLDING, Rig, RigError, cable_of
from cable_sim_ros.terminal import markdown_table

from .bend import Bend, drum, far_pulls, harden, pieces
from .contact_points import ContactPoints, contact_points

TENSION, STIFF, RADIUS, MASS = 3190.0, 1.4, 0.255, 0.389  # N, N m^2, m, kg/m: config/full_scale.yaml
DIAMETER, HALF_THROAT = 0.010, radians(30.0)
WRAPS = (12.0, 90.0)  # deg: the full-scale scene, and a wrap that is all sheave
RATIOS = (6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.75, 0.5, 0.35, 0.25, 0.15, 0.1)  # element over sqrt(EI/T)
PHASES = (0.0, 0.25, 0.5, 0.75)
HARD = (1e-4, 1e-5, 1e-6, 1e-7)  # penetration over radius, settled one after the other
LIMITS = (Contact().penetration_limit, 0.03, 0.01, 1e-3, 1e-4)  # contact.penetration_limit, shipped first
ENOUGH = 0.05
EDGE = 20.0  # sqrt(EI/T) of free span
ANSWERS = ("resultant", "contact_deg", "lost_deg", "end_reaction", "inside", "distribution")


def scale() -> float:
    """Bending length sqrt(EI/T) [m]."""
    return sqrt(STIFF / TENSION)


def solve(wrap: float, ratio: float, phase: float, limit: float | None) -> ContactPoints | None:
    """Settled contact for a wrap [rad] and elements of ``ratio`` bending lengths; None where it did not settle.

    limit: contact.penetration_limit of the scene's groove; None: the hard cylinder.
    """
    # taut throughout: the share that resists compression only changes how the start gets there
    for fraction in (1.0, FOLDING):
        table = _solve(wrap, ratio, phase, limit, fraction)
        if table is not None:
            return table
    return None


def _solve(wrap: float, ratio: float, phase: float, limit: float | None, fraction: float) -> ContactPoints | None:
    """One try of solve()."""
    size = ratio * scale()
    count = ceil((RADIUS * wrap + 12.0 * scale()) / size) + 1
    leg, zone = EDGE * scale(), count * size
    rest = leg + 0.5 * (RADIUS * wrap - zone)
    total = zone + 2.0 * rest
    bend = Bend(RADIUS, 0.0, wrap, leg + (phase - 0.5) * size)
    cable = cable_of(
        pieces((rest, max(2.0 * scale(), size)), (zone, size), (rest, max(2.0 * scale(), size))),
        mass_per_length=MASS,
        axial_stiffness=1e5 * TENSION,
        bending_stiffness=STIFF,
        compression_share=fraction,
    )
    surface = drum(RADIUS, TENSION)
    if limit is not None:
        surface = drum(RADIUS, TENSION, half_angle=HALF_THROAT, depth=RADIUS)
        surface["stiffness"] = stiffness(Contact().working_tension, RADIUS, sin(HALF_THROAT), 2, limit * DIAMETER)
    rig = Rig(
        cable,
        held={0: "x"},  # level there: keeps the mesh where it is against the sheave, and bears nothing
        tension=TENSION,
        gravity=0.0,
        surfaces=[surface],
        loads=far_pulls(bend, total, TENSION),
    )
    rig.place(*bend.nodes(rig.arc))
    try:
        rig.settle()
        harden(rig, TENSION, () if limit is not None else HARD)
    except RigError:
        return None
    return contact_points(rig)


def answers(table: ContactPoints, wrap: float) -> dict[str, float]:
    """Resultant [N], contact and lost angle [deg], end reaction [N], line load inside [N/m]; nan: there is none."""
    edges, found = table.edges(), table.boundary(wrap, 3.0 * scale())
    of = {
        "resultant": float(np.linalg.norm(table.resultant)),
        "contact_deg": None if edges is None else degrees(edges[1] - edges[0]),
        "lost_deg": found["lost"],
        "end_reaction": found["end"],
        "inside": found["inside"],
    }
    return {name: float("nan") if value is None else value for name, value in of.items()}


def accumulated(table: ContactPoints, places: np.ndarray) -> np.ndarray:
    """Share of the load that lies before these angles, by the boundaries of the contact points."""
    order = np.argsort(table.angle)
    total = np.concatenate(([0.0], np.cumsum((table.weight * table.load)[order])))
    middle = table.angle[order]
    bounds = np.concatenate((middle[:1], 0.5 * (middle[1:] + middle[:-1]), middle[-1:]))
    return np.interp(places, bounds, total / total[-1])


def reference(wrap: float, limit: float | None) -> ContactPoints:
    """The finest mesh of the sweep, in the first position in which it settles. Raises RigError."""
    for phase in PHASES:
        found = solve(wrap, RATIOS[-1], phase, limit)
        if found is not None:
            return found
    raise RigError(
        f"a wrap of {degrees(wrap):g} deg with elements of {RATIOS[-1]:g} bending lengths did not settle in any of "
        f"{len(PHASES)} positions: there is nothing to compare the others with. Take another wrap"
    )


def sweep(wrap_deg: float, limit: float | None) -> dict:
    """Worst errors of each answer for every element length, and the longest element that keeps each within 5 %."""
    wrap = radians(wrap_deg)
    places = np.linspace(-0.2, wrap + 0.2, 801)
    finest = reference(wrap, limit)
    exact = answers(finest, wrap)
    shape = accumulated(finest, places)
    rows = []
    for ratio in RATIOS[:-1]:
        worst = dict.fromkeys(ANSWERS, 0.0)
        for phase in PHASES:
            table = solve(wrap, ratio, phase, limit)
            if table is None:
                worst = dict.fromkeys(ANSWERS, float("nan"))
                break
            for name, value in answers(table, wrap).items():
                worst[name] = np.fmax(worst[name], abs(value / exact[name] - 1.0)) if value == value else float("nan")
            worst["distribution"] = max(worst["distribution"], float(np.abs(accumulated(table, places) - shape).max()))
        rows.append(
            {
                "element_over_bending_length": ratio,
                "element_mm": round(1e3 * ratio * scale(), 2),
                **{name: _plain(worst[name]) for name in ANSWERS},
            }
        )
    return {
        "wrap_deg": wrap_deg,
        "penetration_limit": limit,
        "converged": {name: _plain(value) for name, value in exact.items()},
        "errors": rows,
        "longest_element_within_5_percent": {name: _longest(rows, name) for name in ANSWERS},
    }


def softness(wrap_deg: float, limit: float) -> dict:
    """Converged answers for a contact.penetration_limit."""
    table = reference(radians(wrap_deg), limit)
    found = answers(table, radians(wrap_deg))
    return {
        "wrap_deg": wrap_deg,
        "penetration_limit": limit,
        **{name: _plain(x) for name, x in found.items()},
        "largest_line_load": _plain(float(table.load.max())),
    }


def _plain(x: float) -> float | None:
    return None if x != x else float(f"{x:.3g}" if abs(x) < 10 else f"{x:.6g}")


def _longest(rows: list[dict], name: str) -> float | None:
    """Longest element, over the bending length, from which on every finer one is within 5 %."""
    good = None
    for row in reversed(rows):
        if row[name] is None or row[name] > ENOUGH:
            break
        good = row["element_over_bending_length"]
    return good


def sweeps() -> dict:
    """The rigid cylinder in closed form, the sweeps over the mesh, and converged answers by penetration limit."""
    phi = 2.0 * np.arcsin(0.5 * scale() / RADIUS)
    rigid = {
        "bending_length_mm": 1e3 * scale(),
        "lost_deg": degrees(phi),
        "end_reaction": TENSION * sin(phi),
        "inside": TENSION * cos(phi) / RADIUS,
    }
    return {
        "rigid_cylinder": {k: _plain(v) for k, v in rigid.items()},
        "sweeps": [sweep(wrap, limit) for limit in (None, LIMITS[0]) for wrap in WRAPS],
        "softness": [softness(wrap, limit) for wrap in WRAPS for limit in LIMITS],
    }


def study(repeats: None, progress: Progress) -> tuple[dict, str]:
    """Longest elements and converged answers: as data, and as the tables of docs/accuracy.md."""
    found = sweeps()
    columns = [
        f"{'nearly rigid' if s['penetration_limit'] is None else 'shipped contact'}, {s['wrap_deg']:g} deg"
        for s in found["sweeps"]
    ]
    longest = [(name, *(s["longest_element_within_5_percent"][name] for s in found["sweeps"])) for name in ANSWERS]
    tables = (
        [("longest element over sqrt(EI/T)", *columns), *((name, *map(_shown, row)) for name, *row in longest)],
        [list(found["softness"][0]), *(list(map(_shown, row.values())) for row in found["softness"])],
    )
    return found, "\n\n".join(map(markdown_table, tables))


def _shown(x: float | None) -> str:
    return "-" if x is None else f"{x:g}"
