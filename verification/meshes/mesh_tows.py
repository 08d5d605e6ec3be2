"""Tows of every size for the promise of a mesh made from an accuracy: plain scenes, from a flume to the deep sea."""

from __future__ import annotations

from typing import Any, NamedTuple

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
    full = {"bare": {"length": 450.0, **g}, "faired": {"length": 150.0, **faired}}
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
        tow("full_scale", full, 450.0, speed=2.2),
        tow("full_scale_no_ei", full, 450.0, speed=2.2, cable=chain),
        tow("full_scale_stiff", full, 450.0, speed=2.2, cable=rods),
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
        tow("last_metres", full, 20.0, speed=2.2, winch={"most_scope": 40.0}),
    ]  # fmt: skip


G = {"drag_amplification": 2.37}
FAIRED = {"drag_law": "ribbon", **G}
SIDE_SCAN = {"mass": 50.0, "net_weight": 357.0, "added_mass": (0.7, 13.6, 13.6), "drag_area": (0.015, 0.2, 0.2)}
SLED = {"mass": 300.0, "net_weight": 1500.0, "drag_area": (0.5, 1.0, 1.0)}
CTD = {"mass": 400.0, "net_weight": 2200.0, "added_mass": (450.0, 450.0, 550.0), "drag_area": (2.2, 2.2, 1.36)}
HYBRID = {**armoured(0.02), "bending_stiffness": 60.0, "bending_damping": 0.1}


class Tow(NamedTuple):
    """A tow with what it is driven by; heave: amplitude [m] and period [s], or none; plan: of the winch."""

    scene: Scene
    heave: tuple[float, float] | None
    plan: str | None


def clump(weight: float, at: str, **more: Any) -> dict[str, Any]:
    """A body on the line of ``weight`` [N] in water, negative: a float."""
    mass = max(weight / 8.0, 12.0)
    size = (abs(weight) / 4e4) ** (2.0 / 3.0)
    area = {"added_mass": (0.3 * mass,) * 3, "drag_area": (size, size, size)}
    return {"mass": mass, "net_weight": weight, "at": at, **area, **more}


def waves(kind: str, height: float, period: float, towards: float = 180.0) -> dict[str, Any]:
    """Waves of the water."""
    return {"waves": {"kind": kind, "height": height, "period": period, "towards_deg": towards}}


def other_tows() -> list[Tow]:
    """The tows of the second table in docs/mesh.md."""
    full: dict[str, dict] = {"bare": {"length": 450.0, **G}, "faired": {"length": 150.0, **FAIRED}}
    wing = {"mass": 100.0, "added_mass": (20.0, 60.0, 60.0), "drag_area": (0.05, 0.3, 0.5)}
    two = {"upper": {"length": 230.0, "drag_amplification": 1.8}, "lower": {"length": 70.0, "drag_amplification": 1.8}}
    three = {"upper": {"length": 150.0}, "middle": {"length": 80.0}, "tail": {"length": 60.0}}
    heavy = {name: section | {"termination_mass": 10.0} for name, section in three.items() if name != "tail"}
    stepped = {
        "armoured": {"length": 200.0},
        "thick": {"length": 60.0, "diameter": 0.018, "mass_per_length": 0.9, "axial_stiffness": 1.5e7},
        "thin": {"length": 60.0, "diameter": 0.006, "mass_per_length": 0.14, "axial_stiffness": 2.4e6},
    }
    tether = {
        "umbilical": {"length": 320.0, "termination_mass": 250.0, "termination_net_weight": 1800.0},
        "tether": {"length": 60.0, "diameter": 0.014, "mass_per_length": 0.2, "axial_stiffness": 1.2e6,
                   "bending_stiffness": 4.0},
    }  # fmt: skip
    scan: dict[str, Any] = {"speed": 2.06, "body": SIDE_SCAN, "sheave": 0.3}
    return [
        Tow(tow("light_depressor", full, 450.0, speed=2.2,
                bodies={"wing": {**wing, "net_weight": 250.0, "at": "bare"}}), (1.0, 8.0), None),
        Tow(tow("heavy_depressor", full, 450.0, speed=2.2,
                bodies={"wing": {**wing, "mass": 320.0, "net_weight": 2500.0, "at": "bare"}}), (1.0, 6.0), None),
        Tow(tow("pressing_wing", full, 400.0, speed=3.0,
                bodies={"wing": {**wing, "net_weight": 200.0, "lift_area": -0.4, "at": "bare"}}), (1.0, 5.0), None),
        Tow(tow("clump", two, 200.0, bodies={"clump": clump(500.0, "upper")}, **scan), (1.0, 8.0), None),
        Tow(tow("termination_20kg", {"upper": two["upper"] | {"termination_mass": 20.0}, "lower": two["lower"]}, 200.0,
                **scan), (1.0, 5.0), None),
        Tow(tow("clump_and_float", three, 240.0, speed=1.5, body=SIDE_SCAN,
                bodies={"clump": clump(600.0, "upper"), "float": clump(-120.0, "middle")}), (1.0, 8.0), None),
        Tow(tow("two_terminations", heavy | {"tail": three["tail"]}, 240.0, speed=2.0), (1.0, 4.5), None),
        Tow(tow("steps_of_diameter", stepped, 280.0, speed=1.8), (1.0, 6.0), None),
        Tow(tow("rov_and_tether", tether, 350.0, speed=0.6, cable=HYBRID, sheave=0.5,
                body={"mass": 120.0, "net_weight": 60.0, "drag_area": (0.5, 0.6, 0.6)}), (1.0, 6.0), None),
        Tow(tow("clump_in_shear", two, 220.0, speed=1.2, body=CTD, bodies={"clump": clump(800.0, "upper")},
                water={"current": (-0.3, 0.4), "current_gradient": (-2e-3, 3e-3)}), (1.0, 8.0), None),
        Tow(tow("weight_on_a_cast", three, 270.0, speed=0.3, cable=armoured(0.011), sheave=0.4, body=CTD,
                bodies={"weight": clump(1500.0, "middle")}), (0.3, 4.0), None),
        Tow(tow("string_of_floats", {f"part_{i}": {"length": 60.0} for i in range(5)}, 260.0, speed=1.2, body=FISH,
                bodies={f"float_{i}": clump(-60.0, f"part_{i}") for i in range(2, 4)}), (1.0, 6.0), None),
        Tow(tow("beads_in_a_flume", {"upper": {"length": 1.9, "termination_mass": 1e-3}, "lower": {"length": 0.6}}, 1.5,
                speed=0.2, cable=THREAD, body=BALL, sheave=0.02), (0.015, 4.0), None),
        Tow(tow("dragged_sled", one(300.0), 250.0, speed=0.5, cable=armoured(0.014), sheave=0.4, body=SLED,
                seabed={"depth": 60.0}), (0.5, 8.0), None),
        Tow(tow("clump_over_the_ground", two, 180.0, speed=1.0, body=SIDE_SCAN, bodies={"clump": clump(900.0, "upper")},
                seabed={"depth": 140.0}), (1.0, 8.0), None),
        Tow(tow("haul_with_depressor", full, 450.0, speed=2.0,
                bodies={"wing": {**wing, "net_weight": 600.0, "at": "bare"}}), None, "0 hold, 10 rate -0.6"),
        Tow(tow("termination_over_the_sheave", {"upper": {"length": 205.0, "termination_mass": 8.0},
                                                "lower": {"length": 95.0}}, 90.0, speed=1.5),
            None, "0 hold, 5 rate 0.5"),
        Tow(tow("sea_of_4_5_s", full, 450.0, speed=2.2, water=waves("jonswap", 1.5, 4.5)), None, None),
        Tow(tow("wave_of_4_s", one(300.0, drag_amplification=1.8), 200.0, water=waves("airy", 1.0, 4.0), **scan), None,
            None),
        Tow(tow("sea_of_6_s_and_clump", two, 200.0, bodies={"clump": clump(500.0, "upper")},
                water=waves("jonswap", 2.0, 6.0, 150.0), **scan), None, None),
    ]  # fmt: skip
