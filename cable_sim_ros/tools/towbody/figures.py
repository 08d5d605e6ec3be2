"""Trim over speed, fins over tow point, and the polar of a body with an attitude."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, hypot, inf
from typing import Any

import numpy as np

from ...errors import CableSimError
from ...io.scenes.load import override
from ...physics.state import FLOW, NOW, Q
from ...physics.towbody import BodyModel, Towbody, facing
from ...sim.checks.attitude_checks import critical_speed, fin_area, least_fin
from ...sim.scene import Scene
from ...sim.simulator import Simulator
from ...sim.statics.route import StartError
from ...sim.trim import UnstableTrim, rigid_names, trim
from .alone import Alone, least_scale, moved, oscillations
from .stability_map import stability_map

PITCHES = tuple(float(x) for x in range(-30, 31, 2))  # deg, of the polar
AHEAD = 0.0, 0.05, 0.1, 0.2, 0.3  # of the length, from where the tow point is


class NoAttitude(CableSimError, ValueError):
    """The body asked for has none."""


def body_of(scene: Scene, name: str) -> tuple[str, Towbody]:
    """Key and body. Raises NoAttitude."""
    known = {"towbody": scene.towbody} | {f"bodies.{key}": body for key, body in scene.bodies.items()}
    key = name if name in known else f"bodies.{name}"
    if key not in known:
        raise NoAttitude(f"{scene.name} has no body '{name}'; nothing was computed. Give --body {' or '.join(known)}")
    if known[key].model is not BodyModel.RIGID:
        raise NoAttitude(
            f"{scene.name}: {key}.model = {known[key].model} has no attitude of its own: there is no trim and no "
            f"stability; nothing was computed. Give {key}.model: rigid with inertia and centres (docs/bodies.md)"
        )
    return key, known[key]


def at_speed(scene: Scene, key: str, body: Towbody, speed: float) -> dict[str, Any]:
    """The static tow at a speed of the ship [m/s]: trim, loads and small motions, or why it has none."""
    sim = Simulator(override(scene, {"ship.tow_speed": speed}))
    try:
        sim.start()
    except UnstableTrim as error:
        return {"speed_mps": speed, "unstable": f"unstable in {error.axis}", "body": error.body}
    except StartError:
        return {"speed_mps": speed, "unstable": "no static tow", "body": key}
    i = rigid_names(sim).index(key)
    node = int(sim.model.line.rigid.bodies[i].node)
    nodes = sim.state.nodes[NOW]
    roll, pitch, yaw = (degrees(angle) for angle in trim(sim, i))
    flow = nodes[FLOW, node]
    alone = Alone(scene, body, hypot(*flow[:2].tolist()))
    alone.turn(roll, -pitch, yaw - degrees(facing(flow)))
    drag, lift = alone.drag_and_lift()
    stiffness, modes = np.diag(alone.stiffness()), alone.modes()
    return {
        "speed_mps": speed,
        "unstable": None,
        "roll_deg": roll,
        "pitch_up_deg": -pitch,
        "heading_deg": yaw,
        "depth_m": -float(nodes[Q, node, 2]),
        "drag_n": drag,
        "lift_n": lift,
        "tension_n": float(sim.frame.tension),
        "stall_share": float(sim.state.attitude[NOW, i].attack),
        "stiffness_nm": dict(zip(("roll", "pitch", "yaw"), stiffness.tolist(), strict=True)),
        "fastest_growth_per_s": float(modes.real.max()),
        "oscillations": oscillations(modes),
    }


def figures_of(scene: Scene, name: str, speeds: Sequence[float], mapped: bool = False) -> dict[str, Any]:
    """All figures of a body of a scene; ``mapped``: its stability over tow point and tail too."""
    key, body = body_of(scene, name)
    rows = [at_speed(scene, key, body, speed) for speed in speeds]
    speed = scene.ship.tow_speed or speeds[len(speeds) // 2]
    length = body.length or 1.0
    fins, area = [], fin_area(body)
    for share in AHEAD:
        scale = least_scale(scene, moved(body, share * length), speed) if area else None
        fins.append(
            {
                "ahead_m": share * length,
                "found_m2": None if scale is None else scale * area,
                "formula_m2": least_fin(scene, moved(body, share * length)),
            }
        )
    alone, polar = Alone(scene, body, speed), []
    for pitch in PITCHES:
        alone.turn(pitch=pitch)
        drag, lift = alone.drag_and_lift()
        polar.append({"pitch_up_deg": pitch, "drag_n": drag, "lift_n": lift})
    critical = critical_speed(scene, body)
    return {
        "scene": scene.name,
        "body": key,
        "critical_speed_mps": None if critical == inf else critical,
        "fin_area_m2": area,
        "least_fin_m2": least_fin(scene, body),
        "speeds": rows,
        "fins": fins,
        "polar_speed_mps": speed,
        "polar": polar,
        "map": stability_map(scene, body, speed) if mapped else None,
    }
