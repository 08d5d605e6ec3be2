"""A cable with a body towed through still water: straight on, and round a circle."""

from __future__ import annotations

from math import atan2, degrees, hypot, pi

import numpy as np

from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.rig.rig import Rig, cable_of

from ..cables import uniform
from .family import Case, Level, Values, family
from .wet import DEEP, STRAIN, crossflow, drag_law, graded, weigh

STEADY = 2e-5  # share by which a steady turn may still change from one turn to the next
MAX_TURNS = 60


class Tow:
    """Cable and body of a case; the tow point stands DEEP below the surface, for everything is to be wet."""

    def __init__(self, case: Case, level: Level, speed: float, law: dict, mass: float, added: float, ca: float):
        gravity, weight = case.gravity, case.number("body_wet_weight_N")
        density, length, wet, diameter = case.numbers("fluid_density cable_length_m wet_weight_N_m diameter_m")
        area, linear = case.numbers("body_drag_area_CdA_m2 mass_per_length_kg_m")
        drag = 0.5 * density * area * speed**2
        per_length = max(0.5 * density * diameter * law["drag_coefficient"] * speed**2, abs(wet))
        self.end = np.array((drag, 0.0, -weight)) if weight or drag else np.array((0.0, 0.0, -1.0))
        working = hypot(weight, drag) + abs(wet) * length
        sections = graded(length, level.mesh(16), 2.0 * hypot(weight, drag) / per_length, **law)
        ea, water = working / STRAIN, Water(density=density, current=(speed, 0.0))
        cable = cable_of(
            sections, diameter=diameter, mass_per_length=linear, axial_stiffness=ea, added_mass_coefficient=ca
        )
        body = Towbody(mass=mass, net_weight=weight, added_mass=(added,) * 3, drag_area=(area,) * 3)
        self.rig = Rig(cable, held={0: "r"}, tension=working, gravity=gravity, water=water, bodies={-1: body})
        self.notes = weigh(self.rig, wet)
        self.rig.straight((0.0, 0.0, -DEEP), self.end)

    @property
    def tension(self) -> float:
        return float(np.linalg.norm(self.rig.state.reaction[0, :3]))


def critical_angle(case: Case, speed: float, law: dict) -> float:
    """Angle below the horizontal [deg] at which the product's load across a straight line in the stream is nothing.

    A long line without a body settles at this angle too, but for its end without tension; this needs no such end.
    """
    density, wet = case.number("fluid_density"), case.number("wet_weight_N_m")
    cable = uniform(1.0, 1, case.number("mass_per_length_kg_m"), 1e3, law, diameter=case.number("diameter_m"))
    water = Water(density=density, current=(speed, 0.0))
    rig = Rig(cable, held={0: "rg", 1: "rg"}, tension=1.0, gravity=case.gravity, water=water)
    weigh(rig, wet)
    down = 1.0 if wet >= 0.0 else -1.0

    def across(angle: float) -> float:
        c, s = np.cos(angle), np.sin(angle)
        rig.straight((0.0, 0.0, -DEEP), (c, 0.0, -down * s))
        rig.balance()  # everything is held: this only finds what holds it
        load = -rig.state.reaction[:, :3].sum(axis=0)
        return load[0] * s + down * load[2] * c

    low, high = 0.0, 0.5 * pi
    for _ in range(48):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if across(middle) < 0.0 else (low, middle)
    return degrees(0.5 * (low + high))


@family(
    "steady tow",
    "cable_length_m body_wet_weight_N body_drag_area_CdA_m2 wet_weight_N_m speed_m_s drag_law",
    how=f"uniform stream past a cable held at its upper end, EI 0, EA {1 / STRAIN:g} times the working "
    "tension, settled from the line of the body's pull; half of the elements near the body; "
    "critical angle: where the load across one straight, held element is nothing",
)
def straight_tow(case: Case, level: Level) -> Values:
    """A cable and body towed straight."""
    speed, law = case.number("speed_m_s"), drag_law(case)
    weight, gravity = case.number("body_wet_weight_N"), case.gravity
    tow = Tow(case, level, speed, law, max(abs(weight) / gravity, 1e-3), 0.0, 0.0)
    tow.rig.settle()
    top, body, tangent = tow.rig.state.q[0, :3], tow.rig.state.q[-1, :3], tow.rig.state.q[0, 3:]
    of = {
        "tension at the tow point": tow.tension,
        "tension at the body": float(tow.rig.state.tension[-1]),
        "cable angle from horizontal at the tow point": degrees(atan2(-tangent[2], hypot(*tangent[:2]))),
        "body depth below the tow point": float(top[2] - body[2]),
        "layback": float(hypot(*(body - top)[:2])),
    }
    if case.asked(r"critical angle.*"):
        angle = critical_angle(case, speed, law)
        of.update({name: angle for name, _ in case.asked(r"critical angle from horizontal.*")})
    return Values(of, tow.rig.nodes - 1, 0.0, tow.notes)


def around(radius: float, speed: float):
    """Motion table of the tow point on a circle about the origin, from (radius, 0), counterclockwise."""
    rate = speed / radius

    def motion(t: np.ndarray) -> np.ndarray:
        c, s, rows = np.cos(rate * t), np.sin(rate * t), np.zeros((len(t), 1, 9))
        rows[:, 0, 0], rows[:, 0, 1], rows[:, 0, 2] = radius * c, radius * s, -DEEP
        rows[:, 0, 3], rows[:, 0, 4] = -speed * s, speed * c
        rows[:, 0, 6], rows[:, 0, 7] = -rate * speed * c, -rate * speed * s
        return rows

    return motion


def turn_metrics(rig: Rig) -> np.ndarray:
    """Radius and depth of the body, angle by which it trails [rad], tension at the tow point."""
    r = rig.state.q[:, :3]
    bearing = np.unwrap(np.arctan2(r[:, 1], r[:, 0]))  # along the cable, so that it may trail by more than half a turn
    return np.array(
        (hypot(*r[-1, :2]), r[0, 2] - r[-1, 2], bearing[0] - bearing[-1], np.linalg.norm(rig.state.reaction[0, :3]))
    )


@family(
    "circle tow",
    "cable_length_m ship_speed_m_s ship_turn_radius_m body_wet_weight_N body_mass_kg "
    "body_drag_area_CdA_m2 wet_weight_N_m",
    growth=4.0,
    how=f"tow point moved on the circle from a settled straight tow, whole turns until nothing changes by more "
    f"than {STEADY:g} a turn; steps of 0.5 s and finer, in real time the steady turn in steps of 0.5 s and "
    f"then 1/8 turn in shipped; EI 0, EA {1 / STRAIN:g} times the working tension; body alike on all axes",
)
def circle_tow(case: Case, level: Level) -> Values:
    """A cable and body towed in a circle."""
    speed, radius, mass, cn = case.numbers("ship_speed_m_s ship_turn_radius_m body_mass_kg Cn")
    ct, added, ca = (case.number(key, 0.0) for key in ("Ct", "body_added_mass_kg", "Ca_normal"))
    tow = Tow(case, level, speed, crossflow(cn, ct), mass, added, ca)
    rig = tow.rig
    rig.settle()
    # from the stream to still water: the straight tow of the settled shape along +y begins the turn
    shape = rig.state.q.copy()
    r, g = shape[:, :3] + (0.0, 0.0, DEEP), shape[:, 3:]
    turned = np.stack((r[:, 1] + radius, -r[:, 0], r[:, 2] - DEEP), 1)
    rig.place(turned, np.stack((g[:, 1], -g[:, 0], g[:, 2]), 1), v=np.tile((0.0, speed, 0.0), (rig.nodes, 1)))
    rig.state.now.current[:] = 0.0
    turn, motion = 2.0 * pi * radius / abs(speed), around(radius, speed)
    step = 0.5 if level.realtime else level.step(0.5)
    # whole turns end where they began, so that the table of the motion is the same for each
    step, before, turns = turn / np.ceil(turn / step), np.full(4, np.inf), 0
    while turns < MAX_TURNS:
        rig.run(turn, step, every=int(round(turn / step)), moved=(0,), motion=motion)
        turns, now = turns + 1, turn_metrics(rig)
        change = float(np.max(np.abs(now - before) / np.maximum(np.abs(now), 1e-9)))
        if change < STEADY:
            break
        before = now
    notes = [*tow.notes, f"{turns} turns; the last changed a figure by {change:.1g}"]
    if change >= STEADY:
        notes.append("not steady")
    dt = step
    if level.realtime:
        dt = level.step(step)
        steps = int(round(0.125 * turn / dt))
        rig.run(steps * dt, dt, every=steps, moved=(0,), motion=motion)
        now = turn_metrics(rig)
    of = {
        "body circle radius": now[0],
        "body depth": now[1],
        "body depth below the tow point": now[1],
        "angle by which the body trails the ship on the circle": degrees(now[2]),
        "tow-point tension": now[3],
        "body speed": float(np.linalg.norm(rig.state.v[-1, :3])),
    }
    return Values({k: float(v) for k, v in of.items()}, rig.nodes - 1, dt, notes)
