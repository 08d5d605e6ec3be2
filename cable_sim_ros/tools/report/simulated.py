"""What was simulated: the tow from the side, its parts, mesh, steps, versions and seeds, and what the scene says."""

from __future__ import annotations

import enum
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...physics.heave_compensation import SetpointLaw
from ...physics.parameter import REQUIRED, declaration
from ...physics.section import material_of
from ...physics.winch_drive import DriveModel
from ...plots.heading import date_of, force_unit
from ...plots.side import side_view
from ...plots.strips import WIDTH, svg
from ...sim.scene import Scene
from ...version import __version__
from .compared import leaves
from .subject import Figure, Section, Subject, Table, Text, number, unit


def section(subject: Subject) -> Section:
    """The section."""
    found = Section("simulated", "What was simulated")
    if len(subject.frames):
        found.parts.append(side(subject))
    found.parts.append(facts(subject))
    if subject.scene is not None:
        found.parts.append(keys(subject.scene))
    else:
        found.parts.append(Text(["The recording keeps no scene: what its tow was made of is not known."], note=True))
    return found


def side(subject: Subject) -> Figure:
    """The cable from the side."""

    def draw(figure):
        axes = figure.subplots()
        figure.subplots_adjust(left=0.1, right=0.935, bottom=0.13, top=0.91)
        side_view(axes, subject.recorded)

    last = subject.frames[-1]
    depth, aft = -float(last["body_position"][2]), float(last["layback"])
    tension = force_unit(np.array([last["tension"]]))
    words = (
        f"At the end of the run the towbody is {number(depth, 4)} m deep and {number(aft, 4)} m behind the sheave; the "
        f"cable leaves the sheave with {number(tension[0] * float(last['tension']), 4)} {tension[1]}."
    )
    caption = (
        "The cable from the side at the end of the run, coloured by its tension; earlier shapes, but of a haul or a "
        "turn, grey. "
    )
    return Figure(svg("side", (WIDTH, 4.6), draw, layout=None), caption + words, words)


def facts(subject: Subject) -> Table:
    """The tow in a few lines."""
    about, metrics, scene = subject.recorded.custom_data, subject.metrics, subject.scene
    rows: list[tuple[str, str]] = [("scene", str(metrics.get("scene") or about.get("scene", "not known")))]
    if scene is not None:
        rows += list(tow(scene))
    if subject.recorded.shapes:
        nodes, points = len(subject.recorded.shapes[-1][1]), [len(table) for _, table in subject.recorded.contacts]
        contact = f"; {max(points)} contact points at most" if points else ""
        rows.append(("mesh", f"{nodes - 1} elements from drum to towbody, {nodes} nodes{contact}"))
    rows += list(steps(subject))
    if scene is not None:
        seeds = ", ".join(f"{key} {value}" for key, value in seeds_of(scene))
        rows.append(("seeds of what is random", seeds or "none: nothing of this run is random"))
    version = about.get("cable_sim_ros", __version__)
    made = "" if version == __version__ else f"; this report: {__version__}"
    rows.append(("version", f"cable_sim_ros {version}{made}"))
    if date := date_of(subject.recorded):
        rows.append(("date of the motion", f"{date}, by its own stamps"))
    if subject.command:
        rows.append(("command", f"cable-sim {subject.command}"))
    return Table("The tow and the run", ("what", "how"), rows)


def tow(scene: Scene) -> Iterator[tuple[str, str]]:
    """Ship, water, cable, winch, sheave and towbody in words."""
    yield "ship", f"{number(scene.ship.tow_speed)} m/s by the scene, heading {number(scene.ship.heading_deg)}°"
    waves = scene.water.waves
    sea = "no waves"
    if waves.kind.value != "off":
        sea = f"waves {waves.kind.value}, height {number(waves.height)} m, period {number(waves.period)} s"
    current = float(np.hypot(*scene.water.current))
    yield "water", f"{number(scene.water.density)} kg/m³, current {number(current, 3)} m/s at the surface, {sea}"
    for name, part in scene.cable.sections.items():
        own = material_of(scene.cable, part)
        breaks = "" if own.breaking_load is None else f", breaks at {number(own.breaking_load)} N"
        fairing = "" if part.fairing.value == "none" else f", fairing {part.fairing.value}"
        yield (
            f"cable, section {name}",
            f"{number(part.length)} m, diameter {number(1e3 * own.diameter)} mm, {number(own.mass_per_length)} kg/m, "
            f"axial stiffness {number(1e-6 * own.axial_stiffness)} MN{fairing}{breaks}",
        )
    winch, drive = scene.winch, scene.drive.model.value
    law = scene.setpoint.algorithm
    compensation = "no heave compensation" if law is SetpointLaw.HOLD else f"heave compensation {law.value}"
    ideal = " (ideal: follows its set-point whatever the cable pulls)" if scene.drive.model is DriveModel.SERVO else ""
    yield "winch", f"drum radius {number(winch.drum_radius)} m, drive {drive}{ideal}, {compensation}"
    yield "sheave", f"radius {number(scene.sheave.radius)} m, groove {number(1e3 * scene.sheave.groove_depth)} mm deep"
    body = scene.towbody
    yield "towbody", f"{number(body.mass)} kg, weight in water {number(body.net_weight)} N"
    for name, one in scene.bodies.items():
        yield f"body {name} on the line", f"{number(one.mass)} kg"


def steps(subject: Subject) -> Iterator[tuple[str, str]]:
    """Ticks and time steps."""
    metrics = subject.metrics
    if len(subject.frames):
        yield "tick outputs", f"{len(subject.frames)}, one each {number(subject.tick)} s"
    if "step_median_s" in metrics:
        chosen = metrics.get("step_tension_error")
        how = "one a tick" if chosen is None else f"chosen by their error: tension {100.0 * chosen:g} %"
        span = "step_least_s", "step_median_s", "step_largest_s"
        least, median, largest = (number(metrics[name], 3) for name in span)
        yield "time steps", f"{how}; {least} to {largest} s, median {median} s"


def seeds_of(scene: Scene) -> Iterator[tuple[str, int]]:
    """Seeds of what is on."""
    if scene.water.waves.kind.value == "jonswap":
        yield "water.waves.seed", scene.water.waves.seed
    if any(scene.water.turbulence.deviation):
        yield "water.turbulence.seed", scene.water.turbulence.seed
    if any(getattr(getattr(scene.instruments, name), "on", False) for name in type(scene.instruments).model_fields):
        yield "instruments.seed", scene.instruments.seed
    for name, part in scene.cable.sections.items():
        if part.wake.law.value != "off" and part.wake.phase.value == "random":
            yield f"cable.sections.{name}.wake.seed", part.wake.seed


def keys(scene: Scene) -> Table:
    """Every key of the scene that is not as shipped, with what it means."""
    rows = []
    for key, value in leaves(scene.model_dump(mode="json")):
        item = declaration(Scene, key)
        if item is None or key == "name":
            continue
        default = "required" if item.default is REQUIRED else number(plain(item.default))
        if item.default is REQUIRED or plain(item.default) != plain(value):
            rows.append((key, number(value), unit(item.unit), default, item.doc))
    head = ("key", "value", "unit", "default", "meaning")
    return Table("What the scene says: every key that differs from its default, or has none", head, rows, right=(1,))


def plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, enum.Enum):
        return value.value
    return [plain(part) for part in value] if isinstance(value, (list, tuple)) else value
