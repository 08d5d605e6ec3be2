"""Drag factor of strumming computed for two tows of Westin (2018), and where their towbodies land: nothing is tuned.

Flume: Calnan's sphere on a nylon line, 4.3, its place measured. Full scale: chapter 5, where the depth is that of the
thesis's own simulation with a factor of 3.54 on all of the cable. The tows are the shipped scenes with viv switched on;
places are those of the product's static start, rates of the water across the cable those that it computes itself.
"""

from __future__ import annotations

import tempfile
from math import degrees, hypot, pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cable_sim_ros.compiler.jit import plain
from cable_sim_ros.physics.tick_output import STRUM_COLUMNS
from cable_sim_ros.physics.viv_amplification import amplification, amplitude
from cable_sim_ros.plots.strumming import draw_strum
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.tables.viv_tables import strum_rules, strum_sections

from ..shipped import quiet, scene_with, started
from . import Comparison, Result, unjudged

LAW = "govardhan_williamson"
FLUME = {"viv.law": LAW, "viv.damping_ratio": 0.02, "cable.sections.line.drag_amplification": 1.0,
         "cable.sections.line.drag_law": "driscoll_nahon"}  # fmt: skip
FULL = {"viv.law": LAW, "viv.damping_ratio": 0.01, "cable.sections.bare.drag_amplification": 1.0,
        "cable.sections.faired.drag_amplification": 1.0}  # fmt: skip
FRESH = {"towbody.lift_area": -722.0 / (0.5 * 1026.0 * 2.2**2)}  # the wing's 722 N, as printed for fresh water
SECONDS, QUICK_SECONDS = 60.0, 10.0  # of the tow that is drawn
QUICK = f"no assumption made otherwise, {QUICK_SECONDS:g} s of {SECONDS:g} s drawn"
SMALL = 0.005  # m, the least sheave: next to a point, from which the statics have the line hang
POINT = {"sheave.radius": SMALL, "sheave.position": [0.0, 0.0, 0.46 - SMALL], "cable.bending_stiffness": 0.0,
         "cable.bending_damping": 0.0}  # fmt: skip
MEASURED = (-0.708, -0.685)  # m, from the top of the winch
THESIS, THESIS_DEPTH = "Westin (2018) 4.3, Calnan's measurement", 108.0
STATICS = "statics in the plane, no bending, no sheave"
# factor on the drag of the ribbon: depth [m], angle [deg] and tension [N] at the sheave; with the computed factor on
# the drag across the bare part, and on that along it too
RIBBONS = {
    1.0: ((161.7, 76.5, 2337.0), (161.9, 76.6, 2506.0)),
    1.5: ((137.8, 76.7, 2549.0), (137.8, 76.8, 2717.0)),
    2.0: ((121.1, 77.0, 2780.0), (121.1, 77.0, 2946.0)),
}
BARE = "cable.sections.bare.drag_amplification"
DAMPINGS = {  # of the flume's line, and what to say of them
    0.005: "computed, not tuned; the law is far below its range (Re 68 to 89)",
    0.02: "",
    0.061: "damping measured in air, of a stretched line: more than any in bending",
}
STATIC_PLACES = {0.005: (-0.7097, -0.6871), 0.02: (-0.7073, -0.6893), 0.061: (-0.7005, -0.6956)}
FACCHINETTI = {"epsilon": 0.3, "coupling": 12.0, "lift": 0.3, "drag": 2.0}
COLUMN = {name: k for k, (name, _) in enumerate(STRUM_COLUMNS)}


class Landing(NamedTuple):
    """A tow at rest."""

    x: float  # m, from above the sheave's axis, forward positive
    z: float  # m, from the top of the sheave
    depth: float  # m, under water
    angle: float  # deg, from the vertical at the sheave
    tension: float  # N, at the sheave
    factor: float  # mean drag factor where the cable strums; 1 where it does not
    table: np.ndarray  # [nodes, STRUM_COLUMNS]


def land(scene: Scene) -> Landing:
    """Where a tow comes to rest."""
    sim = started(scene)
    frame, table = sim.frame, sim.strum
    place, sheave = frame.body_position, frame.sheave_position
    top = float(sheave[2]) + scene.sheave.radius
    strumming = table[:-1, COLUMN["amplitude"]] > 0.0
    length = np.diff(sim.state.arc)
    factor = 1.0
    if strumming.any():
        factor = float(np.average(table[:-1, COLUMN["amplification"]][strumming], weights=length[strumming]))
    return Landing(
        float(place[0] - sheave[0]),
        float(place[2]) - top,
        -float(place[2]),
        degrees(float(frame.departure_angle)),
        float(frame.tension),
        factor,
        table,
    )


def factor_at(scene: Scene, section: int, speed: float) -> float:
    """Drag factor of one section at a normal speed [m/s] by the formulas as they stand, without their bounds."""
    rules, row = strum_rules(scene)[0], strum_sections(scene)[section]
    a = plain(amplitude)(int(rules["law"]), float(row["mass_damping"]), float(row["reynolds"]) * speed)
    return float(plain(amplification)(int(rules["formula"]), int(rules["antinode"]), a))


def facchinetti(alpha: float, zeta: float, st: float) -> float:
    """A/d of a cylinder on springs with Facchinetti's wake oscillator at its best detuning, harmonic balance.

    alpha: (m* + C_m) zeta. Its amplitudes are known to be low in water: shown beside the fits, used by nothing.
    """
    from scipy.optimize import brentq

    epsilon, coupling = FACCHINETTI["epsilon"], FACCHINETTI["coupling"]
    mu = 0.25 * pi * alpha / zeta
    m, best = FACCHINETTI["lift"] / (16.0 * pi**2 * st**2 * mu), 0.0
    for delta in np.linspace(0.3, 3.0, 136):
        damping = 2.0 * zeta * delta + FACCHINETTI["drag"] / (4.0 * pi * st * mu)

        def square(w: float, delta: float = delta, damping: float = damping) -> float:
            return (delta**2 - w * w) ** 2 + (damping * w) ** 2

        def left(w: float, delta: float = delta) -> float:
            return (1.0 - w * w) * square(w) + coupling * m * w * w * (delta**2 - w * w)

        w = np.linspace(0.05, 4.0, 160)
        signs = np.sign([left(x) for x in w])
        for i in np.flatnonzero(signs[1:] != signs[:-1]):
            root = brentq(left, w[i], w[i + 1])
            lock = coupling * m * root**2 * damping / (epsilon * square(root))
            best = max(best, 2.0 * m * sqrt((1.0 + lock) / square(root)))
    return best


OTHERWISE: dict[str, dict[str, Any]] = {  # of either tow
    "Skop & Griffin": {"viv.law": "skop_griffin"},
    "Sarpkaya": {"viv.law": "sarpkaya"},
    "rms of the antinode": {"viv.rms": "antinode"},
    "Blevins' factor": {"viv.amplification": "blevins"},
    "mean of the power over a standing wave (multiplier 0.85)": {"viv.multiplier": 0.85},
    "multiplier 0.6": {"viv.multiplier": 0.6},
    "multiplier 1.4": {"viv.multiplier": 1.4},
    "lock-in band 0.2": {"viv.lock_in_band": 0.2},
}
OTHERWISE_FLUME: dict[str, dict[str, Any]] = {
    "damping ratio 0.005": {"viv.damping_ratio": 0.005},
    "damping ratio 0.061 (measured in air, axial)": {"viv.damping_ratio": 0.061},
    **OTHERWISE,
    "0.11 in f_n": {"cable.sections.line.drag_law": "driscoll_nahon_printed"},
    "no strumming": {"viv.law": "off"},
    "factor 1.527 by hand": {"viv.law": "off", "cable.sections.line.drag_amplification": 1.527},
}
OTHERWISE_FULL: dict[str, dict[str, Any]] = {
    "damping ratio 0.005": {"viv.damping_ratio": 0.005},
    "damping ratio 0.05": {"viv.damping_ratio": 0.05},
    **OTHERWISE,
    "0.11 in f_n": {"cable.sections.bare.drag_law": "driscoll_nahon_printed"},
    "ribbon drag times 1.5": {"cable.sections.faired.drag_amplification": 1.5},
    "ribbon drag times 2": {"cable.sections.faired.drag_amplification": 2.0},
    "ribbon drag times 2.5": {"cable.sections.faired.drag_amplification": 2.5},
    "ribbon strums too (law of the bare cable)": {"cable.sections.faired.drag_law": "driscoll_nahon"},
    "no force of the wing": {"towbody.lift_area": 0.0},
    "no strumming": {"viv.law": "off"},
    "factor 3.54 by hand, 0.11, all of it": {
        "viv.law": "off",
        "cable.sections.bare.drag_law": "driscoll_nahon_printed",
        "cable.sections.bare.drag_amplification": 3.54,
        "cable.sections.faired.drag_amplification": 3.54,
    },
}


def miss(landing: Landing) -> float:
    """Distance [mm] from the measured place in the flume."""
    return 1e3 * hypot(landing.x - MEASURED[0], landing.z - MEASURED[1])


def flume_rows() -> list[Comparison]:
    """What the flume says."""
    ours = factor_at(scene_with("flume", FLUME), 0, 0.25)
    rows = [Comparison("flume: factor at 0.25 m/s, damping 0.02", "1", ours, 1.536, 0.005, "formulas by hand")]
    factor = "tuned by hand to 1.737 with 0.11; with 0.011 that is 1.527"
    for zeta, text in DAMPINGS.items():
        scene = scene_with("flume", FLUME | {"viv.damping_ratio": zeta})
        found, name = land(scene), f"flume, damping {zeta:g}"
        rows.append(Comparison(f"{name}: x", "m", found.x, MEASURED[0], 0.013, THESIS, text))
        rows.append(Comparison(f"{name}: z", "m", found.z, MEASURED[1], 0.013, THESIS, ""))
        rows.append(Comparison(f"{name}: miss", "mm", miss(found), None, 13.0, THESIS, "theory: 3 to 13 mm"))
        rows.append(Comparison(f"{name}: mean factor", "1", found.factor, 1.737, None, "Westin (2018) 4.3.1", factor))
        found = land(scene_with("flume", FLUME | POINT | {"viv.damping_ratio": zeta}))
        for axis, ours, printed in zip("xz", (found.x, found.z), STATIC_PLACES[zeta], strict=True):
            rest = "sheave of 5 mm, the least" if axis == "x" else ""
            rows.append(Comparison(f"{name}, limp, from a point: {axis}", "m", ours, printed, 0.002, STATICS, rest))
    return rows


def _against(name: str, found: Landing, printed: tuple[float, float, float], why: str) -> list[Comparison]:
    """Depth, angle and tension of a tow at full scale beside those of the statics."""
    rows = zip(
        ("depth", "angle at the sheave", "tension at the sheave"), ("m", "deg", "N"),
        (found.depth, found.angle, found.tension), printed, (0.5, 0.1, 5.0), strict=True,
    )  # fmt: skip
    return [Comparison(f"{name}: {what}", unit, *numbers, STATICS, why) for what, unit, *numbers in rows]


def full_rows() -> list[Comparison]:
    """What the tow at full scale says."""
    scene = scene_with("full_scale", FULL)
    ours = factor_at(scene, 0, 0.75)
    rows = [Comparison("full scale: factor at 0.75 m/s, damping 0.01", "1", ours, 2.09, 0.005, "formulas by hand")]
    for times, (across, both) in RIBBONS.items():
        tow = FULL | FRESH | {"cable.sections.faired.drag_amplification": times}
        found, name = land(scene_with("full_scale", tow)), f"full scale, ribbon drag times {times:g}"
        rows += _against(name, found, across, "the wing as there, 722 N")
        hand = land(scene_with("full_scale", tow | {"viv.law": "off", BARE: found.factor, f"{BARE}_of": "both"}))
        rows += _against(f"{name}, mean factor by hand, along too", hand, both, "the factor on both, as there")
    found = land(scene)
    rows.append(Comparison("full scale as shipped: depth", "m", found.depth, THESIS_DEPTH, None, "Westin (2018) 5.2",
                           "his 3.54 holds more than strumming: drag of the ribbon, and 0.11 in f_n"))  # fmt: skip
    rows.append(Comparison("full scale: mean factor on the bare part", "1", found.factor, 3.54, None,
                           "Westin (2018) 5.2, chosen", "measured on strumming cables: 1.3 to 2.7"))  # fmt: skip
    strumming = found.table[:, COLUMN["amplitude"]] > 0.0
    for column, what, unit, text in (
        ("normal_speed", "speed across the cable", "m/s", ""),
        ("shedding_frequency", "shedding frequency", "Hz", "12 to 22 Hz for 0.6 to 1.1 m/s"),
        ("mode", "mode", "1", "near 140"),
    ):
        values = found.table[strumming, COLUMN[column]]
        for end, value in (("lowest", values.min()), ("highest", values.max())):
            rows.append(unjudged(f"full scale, {end} {what}", unit, float(value), STATICS, text))
    return rows


def experiment(progress, seconds: float, quick: bool = False) -> Result:
    """Both tows, and every assumption made otherwise; seconds: of the tow that is drawn.

    quick: no assumption made otherwise, less drawn.
    """
    progress("flume", 0, 4)
    rows = flume_rows()
    progress("full scale", 1, 4)
    rows += full_rows()
    choices = []
    for k, (name, base, changes) in enumerate(
        (("flume", FLUME, OTHERWISE_FLUME), ("full_scale", FULL, OTHERWISE_FULL))
    ):
        progress(f"{name}, other choices", 2 + k, 4)
        first = land(scene_with(name, base))
        unit = 1e3 if name == "flume" else 1.0
        for what, values in () if quick else changes.items():
            found = land(scene_with(name, base | values))
            change = {"x": unit * (found.x - first.x), "z": unit * (found.z - first.z)}
            change |= {"computed factor": found.factor - first.factor}
            change |= {"tension": unit * (found.tension - first.tension)}
            choices.append({"choice": f"{name}: {what}"} | change)
    chosen = "chosen otherwise: what changes; flume in mm and mN, full scale in m and N"
    return Result("viv_tow", rows, choices, lambda folder: draw(folder / "strumming.png", seconds), chosen)


def draw(path: Path, duration: float) -> Path:
    """Strumming along the tow at full scale in a heave of 1 m, 8 s. RuntimeError where matplotlib is missing."""
    from cable_sim_ros.runs import offline

    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, quiet():
        run = offline.run(scene_with("full_scale", FULL), heave=(1.0, 8.0), duration=duration, out=folder)
        return draw_strum(run.bag, path, title="full_scale, law of Govardhan & Williamson, damping ratio 0.01")
