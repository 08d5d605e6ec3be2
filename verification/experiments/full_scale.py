"""The tow at full scale, Westin (2018) chapter 5: profile, load on the sheave, three set-points in two seas.

Nothing here was measured but the depth of 108 m, to which he tuned the drag factor: what he prints are results of his
model. Statics are those of `full_scale_westin`. In time his drum of fixed mesh would bring elements of 22.5 m onto the
sheave in the swell of NBP1406 (his segments are as long as his own motion asks), so that there the cable runs through
the mesh (`winch.drum: feed`), with the same cable, drag, body and gains. His motion (DSTO, 118 s) is only plotted: two
others stand for it, so that ratios can be compared, forces hardly.
"""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.load import override
from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS
from cable_sim_ros.plots.run import BLUE, FAINT, ORANGE, canvas
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.summary import after_start
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator

from ..shipped import quiet, scene_with, started
from . import Comparison, Result, unjudged

SOURCE = "Westin (2018) 5"
BARE, FAIRED, SHEAVE = (f"cable.sections.{name}" for name in ("bare", "faired", "sheave"))
NO_FACTOR = {f"{BARE}.drag_amplification": 1.0, f"{FAIRED}.drag_amplification": 1.0}
MESHES = (20, 30, 40, 50, 80)  # elements of 2.5 m on the sheave: his 20 to 50, and one more
SECONDS, QUICK_SECONDS = 140.0, 60.0  # his 118 s and the start
LAWS = {"hold": "no compensation", "simplified_sheave": "simplified", "rigorous_sheave": "rigorous"}
FRIGATE = "simple:length=124,beam=14,draft=4.5"  # a box of the size of an FFG 7
SEA = {"kind": "jonswap", "height": 2.5, "period": 8.8, "towards_deg": 180.0, "spreading": 10.0, "seed": 1}
MOTIONS = ("NBP1406", "frigate")
QUICK = f"{QUICK_SECONDS:g} s of {SECONDS:g} s, one motion of {len(MOTIONS)}"
HIS = {  # tension mean, deviation [N], volume [m^3], contact force: least, largest, deviation [N]
    "hold": (3710.0, 262.8, 0.197, 1240.0, 2030.0, 140.0),
    "simplified_sheave": (3710.0, 23.5, 0.021, 1280.0, 2080.0, 105.0),
    "rigorous_sheave": (None, None, 0.020, None, None, None),
}
QUANTITIES = (
    ("mean tension", "N"),
    ("deviation of the tension", "N"),
    ("ellipsoid volume", "m^3"),
    ("least contact force", "N"),
    ("largest contact force", "N"),
    ("deviation of the contact force", "N"),
)
OTHER_SEA = "another sea than his"


class Load(NamedTuple):
    """Line load on the sheave at rest: angle from the vertical [deg], load [kN/m], resultant [N], contact [deg]."""

    angle: np.ndarray
    load: np.ndarray
    resultant: float
    arc: float


def still(values: dict[str, Any]) -> Simulator:
    """His static tow with other values."""
    return started(scene_with("full_scale_westin", values))


def pressed(elements: int) -> Load:
    """How the load spreads over the sheave with that many elements on its 2.5 m."""
    sim = still({f"{SHEAVE}.elements": elements})
    column = {name: k for k, (name, _) in enumerate(CONTACT_COLUMNS)}
    table = sim.contact
    load = 1e-3 * (table[:, column["load_port"]] + table[:, column["load_starboard"]])
    borne = load > 0.0
    arc = degrees(float(np.sum(table[borne, column["length"]]))) / sim.scene.sheave.radius
    angle = np.degrees(table[:, column["wrap_angle"]])
    return Load(angle, load, float(sim.frame.contact_resultant), arc)


def running(elements: dict[str, int] | None = None, tick: float | None = None) -> Scene:
    """His tow, the cable running through the mesh: 315 m of bare and 135 m of faired cable out, 30 m on the drum.

    elements: of sections, None: made from accuracy; tick: s, None: the scene's.
    """
    data = scene_with("full_scale_westin", {}).model_dump()
    sections = data["cable"]["sections"]
    data["cable"]["sections"] = {
        "bare": {**sections["bare"], "length": 345.0, "elements": None},
        "faired": {**sections["faired"], "elements": None},
    }
    data["winch"] |= {"drum": "feed", "scope": 450.0}
    if elements:
        data["mesh"] = {"sections": {name: {"elements": n} for name, n in elements.items()}}
    if tick:
        data["solver"] |= {"tick": tick}
    with quiet():
        return Scene.model_validate(data)


def towed(motion: str, law: str, seconds: float) -> offline.Run:
    """His tow under one motion with one set-point."""
    with quiet():
        if motion == "NBP1406":
            return offline.run(running(), "nbp1406", duration=seconds, algorithm=law)
        scene = override(running(), {f"water.waves.{key}": value for key, value in SEA.items()})
        return offline.run(scene, rao=FRIGATE, duration=seconds, algorithm=law)


def numbers(run: offline.Run) -> tuple[float, ...]:
    """What QUANTITIES names, without the start."""
    metrics = run.metrics
    force = after_start(run.frames, metrics["skip_s"])[0].contact_resultant
    return (
        float(metrics["tension_mean_n"]),
        float(metrics["tension_std_n"]),
        float(metrics["ellipsoid_volume_points_m3"]),
        float(force.min()),
        float(force.max()),
        float(force.std()),
    )


def static_rows(found: list[tuple[str, Simulator]], loads: dict[int, Load]) -> list[Comparison]:
    """Profile with and without the factor, and the load over the sheave."""
    rows = []
    for name, sim in found:
        tuned, frame = name == "factor 3.54", sim.frame
        depth, allowed, angle, tension = (108.0, 0.5, 74.0, 3710.0) if tuned else (None,) * 4
        source = f"{SOURCE}.2: known, the factor tuned to it" if tuned else f"{SOURCE}.2: not legible"
        why = "his 0.11 in (60a), fresh water, six of twenty elements faired" if tuned else ""
        rows += [
            Comparison(f"{name}: depth", "m", -float(frame.body_position[2]), depth, allowed, source, why, depth),
            unjudged(
                f"{name}: departure angle", "deg", degrees(float(frame.departure_angle)), f"{SOURCE}.2", "", angle
            ),
            unjudged(f"{name}: tension", "N", float(frame.tension), f"{SOURCE}.5", "", tension),
        ]
    finest = loads[max(loads)]
    for elements, load in loads.items():
        name = f"sheave, {elements} elements"
        rows.append(unjudged(f"{name}: resultant", "N", load.resultant, "static"))
        rows.append(unjudged(f"{name}: largest line load", "kN/m", float(load.load.max()), "static"))
        rows.append(unjudged(f"{name}: arc in contact", "deg", load.arc, "static"))
        if load is not finest:
            at = np.interp(finest.angle, load.angle, load.load, 0.0, 0.0)
            apart = 100.0 * float(np.abs(at - finest.load).max() / finest.load.max())
            his = "he finds it converged" if elements == 40 else ""
            rows.append(unjudged(f"{name}: largest difference", "% of largest", apart, f"{SOURCE}.4", his))
    return rows


def moving_rows(found: dict[tuple[str, str], tuple[float, ...]]) -> list[Comparison]:
    """Figures of every run, and what compensation takes off."""
    rows = []
    for (motion, law), values in found.items():
        for k, (what, unit) in enumerate(QUANTITIES):
            name = f"{motion}, {LAWS[law]}: {what}"
            rows.append(unjudged(name, unit, values[k], f"{SOURCE}.5", OTHER_SEA, HIS[law][k]))
    for motion in dict.fromkeys(motion for motion, _ in found):
        for law in [law for law in LAWS if law != "hold" and (motion, law) in found]:
            for k, what in ((1, "deviation of the tension"), (2, "ellipsoid volume"), (5, "deviation of the contact")):
                held = found[motion, "hold"][k]
                if not held > 0.0:  # a run of a few seconds has no deviation yet to take from
                    continue
                ours = 100.0 * (1.0 - found[motion, law][k] / held)
                of, from_ = HIS[law][k], HIS["hold"][k]
                his = None if of is None or from_ is None else 100.0 * (1.0 - of / from_)
                name = f"{motion}, {LAWS[law]}: less {what}"
                rows.append(unjudged(name, "%", ours, f"{SOURCE}.5", OTHER_SEA, his))
    return rows


def experiment(progress, seconds: float, quick: bool = False) -> Result:
    """Statics, contact, three set-points under two motions; seconds: of each run; quick: one motion, shorter."""
    motions = MOTIONS[:1] if quick else MOTIONS
    total = 2 + len(motions) * len(LAWS)
    progress("profile and sheave at rest", 0, total)
    profiles = [("factor 3.54", still({})), ("factor 1", still(NO_FACTOR))]
    loads = {elements: pressed(elements) for elements in MESHES}
    found, runs = {}, {}
    for motion in motions:
        for law in LAWS:
            progress(f"{motion}, {LAWS[law]}", 2 + len(found), total)
            runs[motion, law] = run = towed(motion, law, seconds)
            found[motion, law] = numbers(run)
    rows = static_rows(profiles, loads) + moving_rows(found)
    return Result("full_scale", rows, [], lambda folder: draw(profiles, loads, runs, folder / "full_scale.png"))


def draw(profiles, loads: dict[int, Load], runs: dict, path: Path) -> Path:
    """Profiles, line load by mesh, towbody and tension. RuntimeError where matplotlib is missing."""
    with canvas(path, (14.0, 9.0), "Tow at full scale", "scene full_scale_westin; motion NBP1406") as figure:
        profile, load, body, tension = figure.subplots(2, 2).ravel()
        for (name, sim), style in zip(profiles, ("-", ":"), strict=True):
            shape = sim.shape
            profile.plot(shape[:, 0], shape[:, 2], color=BLUE, ls=style, label=name)
        profile.axhline(-108.0, color=ORANGE, ls="--", lw=1.0, label="known depth")
        profile.set(xlabel="x [m]", ylabel="z [m]", title="profile")
        profile.legend(loc="lower right")
        shades = np.linspace(0.25, 1.0, len(loads))
        for (elements, one), shade in zip(loads.items(), shades, strict=True):
            load.plot(one.angle, one.load, color=BLUE, alpha=shade, marker=".", ms=3, label=f"{elements}")
        load.set(title="sheave at rest, elements", xlim=(-30.0, 50.0))
        load.set(xlabel="angle from the vertical [deg]", ylabel="line load [kN/m]")
        load.legend(loc="upper right")
        for law, colour in (("hold", FAINT), ("simplified_sheave", BLUE)):
            run = runs["NBP1406", law]
            f = after_start(run.frames, run.metrics["skip_s"])[0]
            t = (f.time - run.frames.time[0]) * 1e-9
            place = f.body_position[:, [0, 2]] - np.stack(
                [np.polyval(np.polyfit(t, f.body_position[:, 0], 1), t), 0.0 * t], axis=1
            )
            body.plot(*place.T, color=colour, lw=1.0, label=LAWS[law])
            tension.plot(t, 1e-3 * f.tension, color=colour, lw=1.0, label=LAWS[law])
        body.set(xlabel="x off the mean track [m]", ylabel="z [m]", title="towbody")
        tension.set(xlabel="time [s]", ylabel="tension [kN]", title="tension at the sheave")
        for axis in (body, tension):
            low, high = axis.get_ylim()
            axis.set_ylim(low, high + 0.15 * (high - low))  # room for the names
            axis.legend(loc="upper right", ncols=2)
    return path
