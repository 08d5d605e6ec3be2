"""Flexible pendulums: released level, planar or in space."""

from __future__ import annotations

import re

import numpy as np

from cable_sim_ros.sim.rig.rig import Rig, cable_of

from .family import Case, CaseError, Level, Values, family

ANGULAR = re.compile(r"([-+.\deE]+) rad/s \* x along \+y")
SWING_STEPS = 50  # of a real-time run over sqrt(L/g), at least


@family(
    "flexible pendulum",
    "length_m",
    "mass_per_length_kg_m",
    "EA_N",
    "EI_N_m2",
    how="pinned at the origin, tangent free, no damping, a rod: full EA in compression",
)
def pendulum(case: Case, level: Level) -> Values:
    """Positions of tip and middle at the times asked for."""
    length, n = case.number("length_m"), level.mesh(8)
    times = sorted({float(m[3]) for _, m in case.asked(r"(tip|middle) ([xyz]) at ([\d.eE+-]+) s")})
    mass, ea = case.number("mass_per_length_kg_m"), case.number("EA_N")
    gravity = case.number("g", 9.81)
    rig = Rig(
        cable_of(
            [{"length": length, "elements": n}],
            mass_per_length=mass,
            axial_stiffness=ea,
            bending_stiffness=case.number("EI_N_m2"),
            compression_share=1.0,
        ),
        held={0: "r"},
        tension=mass * length * gravity,
        gravity=gravity,
    )
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    spin = np.zeros((rig.nodes, 3))
    if "initial_velocity" in case.inputs:
        found = ANGULAR.match(str(case.inputs["initial_velocity"]))
        if not found:
            raise CaseError(
                f"{case.path}: inputs.initial_velocity = {case.inputs['initial_velocity']!r} is not "
                "understood ('<w> rad/s * x along +y'); the case was not run"
            )
        spin[:, 1] = float(found[1])
    else:
        spin[:, 2] = -case.number("initial_spin_rad_s", 0.0)
    rig.state.v[:, :3], rig.state.v[:, 3:] = rig.arc[:, None] * spin, spin
    rig.balance()
    of, now, step = {}, 0.0, level.step(1e-3)
    if level.realtime:
        step /= max(int(np.ceil(step * SWING_STEPS / np.sqrt(length / gravity))), 1)
    for t in times:
        rig.run(t - now, step, every=max(int(round((t - now) / step)), 1))
        now = t
        for what, node in (("tip", -1), ("middle", n // 2)):
            for k, axis in enumerate("xyz"):
                of[f"{what} {axis} at {t} s"] = float(rig.state.q[node, k])
    named = {
        name: of[f"{m[1]} {m[2]} at {float(m[3])} s"]
        for name, m in case.asked(r"(tip|middle) ([xyz]) at ([\d.eE+-]+) s")
    }
    notes = [f"in steps of {step:.3g} s: {SWING_STEPS} over sqrt(L/g)"] if level.realtime and step < level.tick else []
    return Values(named, n, step, notes)
