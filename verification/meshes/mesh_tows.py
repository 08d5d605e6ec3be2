"""Tows of every size for the promise of a mesh made from an accuracy: plain scenes, from a flume to the deep sea."""

from __future__ import annotations

from typing import Any

from cable_sim_ros.sim.scene import Scene

ARMOURED = {  # Westin (2018) Table 8, scaled by diameter where another is given
    "diameter": 0.010,
    "mass_per_length": 0.389,
    "axial_stiffness": 6.786e6,
    "bending_stiffness": 1.40,
    "axial_damping": 310.0,
    "bending_damping": 6.4e-5,
}
THREAD = {  # of a flume, with its ball
    "diameter": 0.45e-3,
    "mass_per_length": 0.2e-3,
    "axial_stiffness": 223.0,
    "bending_stiffness": 2.82e-6,
    "axial_damping": 5.4e-4,
    "bending_damping": 6.8e-12,
}
BALL = {"mass": 1.33e-3, "net_weight": 7.777e-3, "drag_area": (3.69e-5,) * 3}
FISH = {"mass": 250.0, "net_weight": 445.0, "drag_area": (0.0641, 0.9, 1.485), "lift_area": -0.298}


def armoured(diameter: float) -> dict[str, Any]:
    """Cable of steel wires of another diameter [m]."""
    k = diameter / ARMOURED["diameter"]
    power = {"diameter": 1, "mass_per_length": 2, "axial_stiffness": 2, "bending_stiffness": 4, "axial_damping": 2}
    return {name: value * k ** power.get(name, 4) for name, value in ARMOURED.items()}


def tow(
    name: str,
    sections: dict[str, dict],
    scope: float,
    *,
    speed: float = 2.0,
    cable: dict | None = None,
    body: dict | None = None,
    sheave: float = 0.25,
    **blocks: Any,
) -> Scene:
    """A scene whose drum, sheave and contact follow from the sheave's radius [m] and the pull."""
    body = {"added_mass": (0.0, 0.0, 0.0), **(body or FISH)}
    cable = {**(cable or ARMOURED), "sections": sections}
    pull = body["net_weight"] + 1.2 * cable["mass_per_length"] * 9.81 * scope + 0.05
    size = sheave / 0.25
    return Scene.model_validate(
        {
            "name": name,
            "ship": {"tow_speed": speed},
            "water": {"density": 1026.0, "viscosity": 1.2e-3, **blocks.pop("water", {})},
            "cable": cable,
            "winch": {
                "position": (0.0, 0.0, 3.0 * size),
                "drum_radius": 0.3 * size,
                "scope": scope,
                **blocks.pop("winch", {}),
            },
            "sheave": {
                "position": (-8.0 * size, 0.0, 3.6 * size),
                "radius": sheave,
                "groove_depth": max(2.0 * cable["diameter"], 0.1 * sheave),
                "throat_angle_deg": 60.0,
            },
            "contact": {"working_tension": pull},
            "towbody": body,
            **blocks,
        }
    )


BOTH = {"drag_amplification_of": "both"}


def one(length: float, **more: Any) -> dict[str, dict]:
    """A cable of one section; a drag factor is of the drag across and along."""
    both = BOTH if "drag_amplification" in more else {}
    return {"cable": {"length": length, **both, **more}}


def tows() -> list[Scene]:
    """The tows of the table in docs/mesh.md."""
    g = {"drag_amplification": 2.37, **BOTH}
    faired = {"drag_law": "ribbon", **g}
    rope = {"diameter": 0.02, "mass_per_length": 0.35, "axial_stiffness": 2.0e6, "axial_damping": 200.0}
    umbilical = {**armoured(0.03), "bending_stiffness": 2000.0, "bending_damping": 20.0}
    lead = {"mass": 2000.0, "net_weight": 17000.0, "drag_area": (0.5, 1.5, 1.5)}
    light = {"mass": 30.0, "net_weight": 60.0, "drag_area": (0.01, 0.05, 0.05)}
    side_scan = {"mass": 50.0, "net_weight": 357.0, "drag_area": (0.015, 0.2, 0.2)}
    ctd = {"mass": 400.0, "net_weight": 2200.0, "drag_area": (2.2, 2.2, 1.36)}
    chain = {**armoured(0.01), "bending_stiffness": 0.0, "bending_damping": 0.0}
    rods = {**armoured(0.01), "bending_stiffness": 100.0, "bending_damping": 1e-2}
    return [
        tow("flume_10m", one(10.0), 8.0, speed=0.5, cable=THREAD, body=BALL, sheave=0.02),
        tow("flume_10m_slow", one(10.0), 8.0, speed=0.15, cable=THREAD, body=BALL, sheave=0.02),
        tow("tank_30m", one(30.0), 20.0, speed=1.0, cable=armoured(0.004), body=light, sheave=0.1),
        tow("harbour_60m", one(60.0), 40.0, speed=1.5, body=side_scan),
        tow("side_scan_200m", one(250.0, drag_amplification=1.8), 200.0, speed=2.06, body=side_scan, sheave=0.3),
        tow("side_scan_fast", one(250.0, drag_amplification=1.8), 200.0, speed=4.0, body=side_scan, sheave=0.3),
        tow("full_scale", {"bare": {"length": 450.0, **g}, "faired": {"length": 150.0, **faired}}, 450.0, speed=2.2),
        tow("full_scale_no_ei", {"bare": {"length": 450.0, **g}, "faired": {"length": 150.0, **faired}}, 450.0,
            speed=2.2, cable=chain),
        tow("full_scale_stiff", {"bare": {"length": 450.0, **g}, "faired": {"length": 150.0, **faired}}, 450.0,
            speed=2.2, cable=rods),
        tow("faired_300m", {"faired": {"length": 400.0, **faired}}, 300.0, speed=5.0),
        tow("three_cables", {"upper": {"length": 300.0, **g}, "faired": {"length": 100.0, **faired},
            "tail": {"length": 40.0, "drag_amplification": 1.5, **BOTH}}, 350.0, speed=2.5),
        tow("rope_300m", one(350.0, drag_amplification=1.2), 300.0, speed=1.5, cable=rope),
        tow("umbilical_400m", one(500.0), 400.0, speed=1.0, cable=umbilical, body=lead, sheave=1.0),
        tow("heavy_1km", one(1200.0), 1000.0, speed=1.5, body=lead, sheave=0.4),
        tow("light_1km", one(1200.0), 1000.0, speed=2.0, body=light),
        tow("lowered_1500m", one(1600.0), 1500.0, speed=0.0, cable=armoured(0.011), body=ctd, sheave=0.4),
        tow("drifting_1500m", one(1600.0), 1500.0, speed=0.3, cable=armoured(0.011), body=ctd, sheave=0.4),
        tow("shear_1500m", one(1600.0), 1500.0, speed=0.8, cable=armoured(0.011), body=ctd, sheave=0.4,
            water={"current": (-0.5, 0.3), "current_gradient": (-3e-4, 2e-4)}),
        tow("deep_tow_3km", one(3500.0, drag_amplification=1.5), 3000.0, speed=1.0, cable=armoured(0.0173), body=lead,
            sheave=0.5),
        tow("deep_tow_6km", one(6300.0, drag_amplification=1.5), 6000.0, speed=0.8, cable=armoured(0.0173), body=lead,
            sheave=0.5),
        tow("deep_tow_6km_fast", one(6300.0, drag_amplification=1.5), 6000.0, speed=2.0, cable=armoured(0.0173),
            body=lead, sheave=0.5),
        tow("last_metres", {"bare": {"length": 450.0, **g}, "faired": {"length": 150.0, **faired}}, 20.0, speed=2.2,
            winch={"most_scope": 40.0}),
    ]  # fmt: skip
