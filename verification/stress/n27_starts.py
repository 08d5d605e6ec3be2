"""N27: the static start over stiffness, length, weight, speed and both drums, against the integrated static shape."""

from __future__ import annotations

from collections import Counter
from itertools import product
from typing import NamedTuple

from cable_sim_ros.io.scenes.load import SceneError
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator, StartError

from .tows import finite, shipped
from .verdict import Found, Metric, stress

STIFFNESS, LENGTH = (1e5, 3e5, 1e6, 1e7, 1e8), (10.0, 30.0, 150.0, 600.0)  # EA [N], scope [m]
WEIGHT, SPEED = (100.0, 500.0, 2000.0, 6000.0), (0.0, 1.0, 2.2, 3.0)  # towbody.net_weight [N], ship.tow_speed [m/s]
DRUMS = ("feed", "contact")
FAIRED = 0.2  # of the scope, at most 150 m
NEAR, AWAY = 0.05, 0.2  # the depth may differ from the shape's by this share, and this [m]
OK, SCENE, START, FALSE, CRASH = "at rest", "scene refused", "start refused", "rest that is none", "crash"


class Start(NamedTuple):
    """How one start ended."""

    what: str
    text: str  # of the refusal, or what is wrong
    strain: float  # largest


def tow(stiffness: float, length: float, weight: float, speed: float, drum: str) -> Scene:
    """The shipped tow with these numbers. Raises SceneError."""
    faired = min(FAIRED * length, 150.0)
    values = {
        "cable__axial_stiffness": stiffness,
        "towbody__net_weight": weight,
        "towbody__mass": max(250.0, weight / 6.0),
        "ship__tow_speed": speed,
        "setpoint__algorithm": "hold",
    }
    drag = {"drag_amplification": 2.37, "drag_amplification_of": "both"}
    last = {"length": faired, "drag_law": "ribbon"} | drag
    if drum == "feed":
        sections = {"bare": {"length": length - faired + 20.0} | drag, "faired": last}
        return shipped("full_scale", cable__sections=sections, winch__scope=length, **values)
    sections = {
        "drum": {"length": 5.2, "elements": 22},
        "span": {"length": 3.6, "elements": 2},
        "sheave": {"length": 4.8, "elements": 80},
        "bare": {"length": max(length - faired, 5.0), "elements": 12} | drag,
        "faired": last | {"elements": 12},
    }
    return shipped("full_scale_contact", cable__sections=sections, **values)


def wrong_rest(sim: Simulator) -> str:
    """What is wrong with a tow at rest by its integrated static shape, in words; empty: nothing."""
    frame, scene = sim.frame, sim.scene
    if not finite(sim.output.frame):
        return "a number is not finite"
    if int(frame.status) & Flag.DETACHED or frame.contact_total <= 0.0:
        return "the cable is beside its sheave"
    shape = layout_of(scene).shape(float(frame.scope))
    bed = scene.seabed.depth
    if not shape.closed or (bed is not None and float(shape.place[:, 2].min()) <= -bed):
        return ""  # nothing to compare with: the depth is that of the ground, or the tow comes to the surface
    route = layout_of(scene).route  # what is stretched inboard comes off the sheave
    off = (route.on_drum + route.inboard) * float(shape.tension.max()) / scene.cable.axial_stiffness
    depth = float(frame.body_position[2] - shape.place[0, 2]) + off
    if abs(depth) > NEAR * abs(float(shape.place[0, 2])) + AWAY:
        return f"the body is at {frame.body_position[2]:.4g} m, by its shape at {shape.place[0, 2]:.4g} m"
    if abs(frame.tension / shape.tension[-1] - 1.0) > NEAR:
        return f"the tension is {frame.tension:.5g} N, by its shape {shape.tension[-1]:.5g} N"
    return ""


def begun(*numbers) -> Start:
    """One start, judged."""
    try:
        sim = Simulator(tow(*numbers))
        sim.start()
    except SceneError as error:
        return Start(SCENE, str(error), 0.0)
    except StartError as error:
        return Start(START, str(error), 0.0)
    except Exception as error:  # it is what is looked for
        return Start(CRASH, f"{type(error).__name__}: {error}", 0.0)
    wrong = wrong_rest(sim)
    strain = float(sim.frame.tension_most / sim.scene.cable.axial_stiffness)
    return Start(FALSE if wrong else OK, wrong, strain)


@stress("static start: EA 1e5 to 1e8 N, 10 to 600 m, 100 to 6000 N, 0 to 3 m/s, both drums", "0 crash, 0 false rest")
def starts(quick: bool) -> Found:
    """Every combination, or a few of them."""
    every = list(product(STIFFNESS, LENGTH, WEIGHT, SPEED, DRUMS))[:: 37 if quick else 1]
    found = [(numbers, begun(*numbers)) for numbers in every]
    counts = Counter(start.what for _, start in found)
    soft = [start for _, start in found if start.strain > 0.02]
    metrics = [
        Metric("starts", len(found)),
        *(Metric(what, counts[what]) for what in (OK, SCENE, START)),
        *(Metric(what, counts[what], "", 0) for what in (FALSE, CRASH)),
        Metric("largest strain at rest", float(max(start.strain for _, start in found))),
        Metric("at rest with more than 2 % of strain", sum(start.what == OK for start in soft)),
    ]
    notes = []
    for numbers, start in found:
        if start.what in (START, FALSE, CRASH):
            ea, length, weight, speed, drum = numbers
            report = f"EA {ea:g} N, {length:g} m, {weight:g} N, {speed:g} m/s, {drum}: {start.what}: {start.text}"
            notes.append(report)
    return Found(metrics, notes)
