"""Bodies and cables in still water and in a stream: sinking, swinging, crossing the surface."""

from __future__ import annotations

from math import pi, radians

import numpy as np

from cable_sim_ros.physics.ancf import BUOYANCY
from cable_sim_ros.physics.drag_laws import DragLaw
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.rig.rig import Rig, RigError, cable_of

from ..cables import uniform
from .family import Case, Level, Values, family
from .measure import crossings
from .wet import DEEP, NUMBER, STRAIN, crossflow

THREAD = {"mass_per_length": 1e-5, "diameter": 1e-4, "added_mass_coefficient": 0.0}  # least the product takes
UNEVEN = 0.381966  # of the length in the first section: no boundary of elements at a round depth


@family(
    "cable through the surface",
    "length_m diameter_m mass_per_length_kg_m fluid_density Cd current_m_s",
    how="tension: the vertical reaction of a cable that hangs from its upper end; horizontal "
    "reaction: every node held vertical, the reactions added up; meshed unevenly",
)
def through_the_surface(case: Case, level: Level) -> Values:
    """Reactions at each depth of immersion the outputs name."""
    length, diameter, mass = case.numbers("length_m diameter_m mass_per_length_kg_m")
    density, cd, current = case.numbers("fluid_density Cd current_m_s")
    gravity, n, law = case.gravity, level.mesh(8), crossflow(cd)
    weight = mass * gravity * length

    def rig_at(wet: float, speed: float, held: dict) -> Rig:
        sections = [{"length": part * length, "elements": n // 2, **law} for part in (UNEVEN, 1.0 - UNEVEN)]
        cable = cable_of(sections, diameter=diameter, mass_per_length=mass, axial_stiffness=weight / STRAIN)
        water = Water(density=density, current=(speed, 0.0))
        rig = Rig(cable, held=held, tension=weight, gravity=gravity, water=water)
        rig.straight((0.0, 0.0, length - wet), (0.0, 0.0, -1.0))
        rig.settle()
        return rig

    of = {}
    for name, m in case.asked(rf"top tension, ({NUMBER}) m.* under water"):
        of[name] = float(rig_at(float(m[1]), 0.0, {0: "r"}).state.reaction[0, 2])
    for name, m in case.asked(
        rf"horizontal reaction at the top, ({NUMBER}) m under water(?:, current ({NUMBER}) m/s)?"
        r".*"
    ):
        speed = float(m[2]) if m[2] else current
        rig = rig_at(float(m[1]), speed, {i: "rg" for i in range(n + 1)})
        of[name] = abs(float(rig.state.reaction[:, 0].sum()))
    return Values(of, n, 0.0)


def until(rig: Rig, speed, step: float, change: float = 1e-5) -> float:
    """Run on until ``speed``() changes by less than a share of itself while the run grows by half; returns it."""
    span, before = 10 * step, speed()
    for _ in range(60):
        rig.run(span, step, every=int(round(span / step)))
        now = speed()
        if abs(now - before) <= change * abs(now):
            return now
        before, span = now, 10 * step * np.ceil(1.5 * span / (10 * step))
    raise RigError("no terminal speed was reached")


def fall(case: Case, rig: Rig, node: int, step: float) -> dict[str, float]:
    """Speeds and depths at the times asked for, then the terminal speed."""
    asked = case.asked(rf"(speed|drop|depth|acceleration) at ({NUMBER}) s")
    start, of, now = rig.state.q[node, 2], {}, 0.0
    rig.balance()
    for t in sorted({float(m[2]) for _, m in asked}):
        if t > now:
            steps = max(int(np.ceil((t - now) / step - 1e-9)), 1)
            rig.run(t - now, (t - now) / steps, every=steps)
            now = t
        report = {
            "speed": -rig.state.v[node, 2],
            "drop": start - rig.state.q[node, 2],
            "depth": start - rig.state.q[node, 2],
            "acceleration": -rig.state.a[node, 2],
        }
        of.update({name: float(report[m[1]]) for name, m in asked if float(m[2]) == t})
    for name, _ in case.asked("terminal speed"):
        of[name] = float(until(rig, lambda: -rig.state.v[node, 2], step))
    return of


@family(
    "sinking level cable",
    "length_m diameter_m mass_per_length_kg_m fluid_density Cn Ca",
    how="both ends free, level and at rest deep in still water, EI 0; the middle node is the answer",
)
def sinking_cable(case: Case, level: Level) -> Values:
    """A level free cable that sinks broadside."""
    length, diameter, mass = case.numbers("length_m diameter_m mass_per_length_kg_m")
    density, cn, ca = case.numbers("fluid_density Cn Ca")
    n, gravity = level.mesh(4), case.gravity
    weight = mass * gravity * length
    cable = uniform(length, n, mass, weight / STRAIN, crossflow(cn), diameter=diameter, added_mass_coefficient=ca)
    rig = Rig(cable, held={}, tension=weight, gravity=gravity, water=Water(density=density))
    rig.straight((0.0, 0.0, -DEEP), (1.0, 0.0, 0.0))
    step = level.step(0.01)
    of = fall(case, rig, n // 2, step)
    sag = float(np.ptp(rig.state.q[:, 2]))
    return Values(of, n, step, [f"height differs by {sag:.1g} m along the cable at the end"])


def sphere_of(case: Case) -> Towbody:
    """The sphere of a case as the product's body."""
    radius, density = case.number("sphere_radius_m"), case.number("fluid_density")
    displaced = 4.0 / 3.0 * pi * radius**3 * density
    mass, area = case.number("mass_kg"), pi * radius**2 * case.number("Cd", 0.0)
    return Towbody(
        mass=mass,
        net_weight=(mass - displaced) * case.gravity,
        added_mass=(case.number("Ca", 0.0) * displaced,) * 3,
        drag_area=(area,) * 3,
    )


def thread(case: Case, length: float, held: dict, stiffness: float, tension: float, body: Towbody) -> Rig:
    """A body on one element without water's load, of the least mass the product takes: the solver wants a line."""
    cable = cable_of([{"length": length, "elements": 1, "drag_law": DragLaw.OFF}], axial_stiffness=stiffness, **THREAD)
    water = Water(density=case.number("fluid_density"))
    rig = Rig(cable, held=held, tension=tension, gravity=case.gravity, bodies={1: body}, water=water)
    rig.change_elements({BUOYANCY: 0.0})
    return rig


@family(
    "sinking sphere",
    "sphere_radius_m mass_kg fluid_density Ca Cd",
    how="the product's body deep in still water, at the lower end of one free element of 10 mm that weighs 1e-7 kg",
)
def sinking_sphere(case: Case, level: Level) -> Values:
    """A sphere let go in still water."""
    sphere = sphere_of(case)
    net = max(abs(sphere.net_weight), 1e-3 * sphere.mass * case.gravity)
    rig = thread(case, 0.01, {0: "g", 1: "g"}, max(net, 1.0), net, sphere)
    rig.straight((0.0, 0.0, -DEEP), (0.0, 0.0, -1.0))
    step = level.step(0.01)
    return Values(fall(case, rig, 1, step), 1, step)


@family(
    "submerged pendulum",
    "sphere_radius_m mass_kg fluid_density Ca line_length_m amplitude_deg",
    how="the product's body on one element of 1e-5 kg/m without drag, buoyancy and added mass; settled hanging, "
    "then let go at the amplitude; frequency from the crossings of the vertical",
)
def submerged_pendulum(case: Case, level: Level) -> Values:
    """Small swing of a submerged sphere."""
    sphere, top = sphere_of(case), np.array((0.0, 0.0, -DEEP))
    if sphere.net_weight <= 0.0:
        raise RigError("the sphere floats up; this family hangs it")
    rig = thread(case, case.number("line_length_m"), {0: "r"}, sphere.net_weight / STRAIN, sphere.net_weight, sphere)
    rig.straight(top, (0.0, 0.0, -1.0))
    rig.settle()
    tension = float(np.linalg.norm(rig.state.reaction[0, :3]))
    stretch = 1.0 + tension / rig.cable.axial_stiffness
    angle = radians(case.number("amplitude_deg"))
    rig.straight(top, (np.sin(angle), 0.0, -np.cos(angle)), stretch)
    rig.balance()
    step, zeros, now, at, last = level.step(0.02), [], 0.0, None, None
    span = max(100 * step, 1.0)
    for _ in range(200):
        path = rig.run(span, step)
        rel = path.q[:, -1, :3] - top
        swing = np.arctan2(rel[:, 0], -rel[:, 2])
        t = now + path.time
        if last is not None:
            t, swing = np.append(at, t), np.append(last, swing)
        zeros += list(crossings(t, swing, 0.0))
        now, at, last = t[-1], t[-1], swing[-1]
        if len(zeros) >= 7:
            break
    else:
        raise RigError("the sphere does not swing through the vertical")
    frequency = pi * (len(zeros) - 1) / (zeros[-1] - zeros[0])
    of = {"angular frequency": float(frequency), "period": float(2.0 * pi / frequency), "static line tension": tension}
    return Values(of, 1, step)
