"""Wakes of a line (physics/wake_oscillator.py): table and beginning, and what mesh and step must be able to follow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf, pi, sqrt

import numpy as np

from ..compiler.jit import plain
from ..physics.cable_assembly import Cable
from ..physics.drag_laws import DragLaw
from ..physics.fairing import Fairing, dressed
from ..physics.fluid import Fluid
from ..physics.section import CableModel, Material, Section, material_of
from ..physics.state import NOW, WAKE, State
from ..physics.wake_oscillator import (
    START,
    WAKE_Q,
    WAKE_S,
    WAKE_SECTION,
    WakeLaw,
    WakePhase,
    section_of_node,
    wake_section,
)
from ..physics.water import Water
from .layout import Layout
from .problem import Limit, Problem
from .scene import Scene
from .tables.material import section_ends
from .tables.viv_tables import on, strums

# steps a period of shedding, at least: the time integration then makes the period of a free vibration 0.8 % longer and
# damps it by 0.07 % of critical; and elements a wave of the cable at that frequency
STEPS, ELEMENTS = 30, 6


def has_wakes(cable: Cable) -> bool:
    """Does any section shed vortices?"""
    return any(section.wake.law is not WakeLaw.OFF for section in cable.sections.values())


def wake_table(cable: Cable, water: Water | Fluid) -> np.ndarray:
    """WAKE_SECTION [sections], or none where no section has a wake."""
    if not has_wakes(cable):
        return np.zeros(0, WAKE_SECTION)
    rows = [
        wake_section(section.wake, end, material_of(cable, section).diameter, water.density, water.viscosity)
        for end, section in zip(section_ends(cable).values(), cable.sections.values(), strict=True)
    ]
    return np.array(rows, WAKE_SECTION)


def begin_wakes(state: State, cable: Cable) -> None:
    """Small wakes with the phases that the sections give; the flow past them follows with the first step."""
    wakes = wake_table(cable, Fluid()).view(np.recarray)
    state.nodes[NOW, WAKE] = 0.0
    if len(wakes) == 0:
        return
    blocks = [section.wake for section in cable.sections.values()]
    draws = {wake.seed: np.random.default_rng(wake.seed).uniform(0.0, 2.0 * pi, len(state.arc)) for wake in blocks}
    for n, s in enumerate(state.arc):
        i = _section_of_node(wakes, float(s))
        if wakes[i].on:
            phase = {
                WakePhase.UNIFORM: 0.0,
                WakePhase.ALTERNATING: pi * (n % 2),
                WakePhase.RANDOM: draws[blocks[i].seed][n],
            }[blocks[i].phase]
            state.nodes[NOW, WAKE, n, [WAKE_Q, WAKE_S]] = START * np.cos(phase), START * np.sin(phase)


_section_of_node = plain(section_of_node)


def shedding(cable: Cable, section: Section, speed: float) -> float:
    """Frequency of shedding [Hz] of a section at a flow of ``speed`` [m/s] straight across it; 0 without a wake."""
    if section.wake.law is WakeLaw.OFF:
        return 0.0
    return section.wake.strouhal * speed / material_of(cable, section).diameter


def cable_problems(cable: Cable) -> Iterator[Problem]:
    """Wakes that a cable cannot have: of a faired section, and of links."""
    yield from [
        Problem(
            f"cable.sections.{name}.wake.law",
            f"= {section.wake.law.value} is one of bare cable, and this section is faired (fairing = "
            f"{section.fairing.value}, drag_law = {dressed(section).drag_law.value}): a fairing is there to keep "
            "vortices from being shed",
            "Leave the wake out, or the fairing",
        )
        for name, section in cable.sections.items()
        if section.wake.law is not WakeLaw.OFF
        and (section.fairing is not Fairing.NONE or section.drag_law is DragLaw.RIBBON)
    ]
    if has_wakes(cable) and cable.model is CableModel.SEGMENTS:
        text = "= segments has no wakes: their load needs the shape of an element between its nodes"
        yield Problem("cable.model", text, "Use cable.model = ancf, or leave the wakes out")


def bare_problems(scene: Scene) -> Iterator[Problem]:
    """Wakes that a scene cannot have, whatever its mesh is."""
    yield from cable_problems(scene.cable)
    yield from [
        Problem(
            f"cable.sections.{name}.wake.law",
            f"= {section.wake.law.value} beside viv.law = {scene.viv.law.value}: the same vibration would be computed "
            "twice, in time and as an amplification of the drag",
            "Leave one of them out, or give the section viv_multiplier 0",
        )
        for name, section in scene.cable.sections.items()
        if section.wake.law is not WakeLaw.OFF and on(scene) and strums(section)
    ]


def step_problems(cable: Cable, speed: float, step: float, key: str = "solver.tick") -> Iterator[Problem]:
    """Steps [s] too long for the shedding of a section in a flow of ``speed`` [m/s] across it."""
    for name, section in cable.sections.items():
        frequency = shedding(cable, section, speed)
        period = f"1/{STEPS} of a period of the vortices that cable.sections.{name} sheds at {frequency:.4g} Hz"
        yield from Limit(key, step, "<=", 1.0 / (STEPS * frequency) if frequency else inf, "s", period).problems(
            f"the steps do not follow them (wake.strouhal = {section.wake.strouhal:g} at {speed:.3g} m/s), and their "
            "force would be lost",
            "Make it shorter, or leave the wake of that section out",
        )


def wave_length(own: Material, density: float, frequency: float, tension: float) -> float:
    """Length [m] of the wave that a cable of this material carries at a frequency [Hz] under tension [N], in a fluid:
    EI k^4 + T k^2 = (m + m_a) om^2. inf at no frequency."""
    mass = own.mass_per_length + own.added_mass_coefficient * density * 0.25 * pi * own.diameter**2
    drive = mass * (2.0 * pi * frequency) ** 2
    if drive == 0.0:
        return inf
    stiff = tension + sqrt(tension * tension + 4.0 * own.bending_stiffness * drive)
    return 2.0 * pi * sqrt(stiff / (2.0 * drive))


def element_problems(
    cable: Cable, water: Water | Fluid, speed: float, elements: Iterable[tuple[str, float, float]], remedy: str
) -> Iterator[Problem]:
    """Elements too long for the waves that shedding drives: ``elements`` are (section, longest [m], tension [N])."""
    for name, longest, tension in elements:
        section = cable.sections[name]
        frequency = shedding(cable, section, speed)
        bound = wave_length(material_of(cable, section), water.density, frequency, tension) / ELEMENTS
        wave = f"1/{ELEMENTS} of a wave of this cable at the {frequency:.4g} Hz that it sheds at {speed:.3g} m/s"
        lead = f"= {section.wake.law.value} on elements of"
        yield from Limit(f"cable.sections.{name}.wake.law", longest, "<=", bound, "m", wave, lead).problems(
            f"under {tension:.4g} N the mesh does not carry the vibration", remedy.format(name=name, minimum=bound)
        )


def wake_problems(layout: Layout) -> Iterator[Problem]:
    """What of a tow cannot follow the vortices shed straight across the cable; its elements beyond the sheave."""
    scene, speed = layout.scene, layout.water_speed
    if not has_wakes(scene.cable) or speed == 0.0:
        return
    pulls = min_tensions(layout)
    out = [element for element in layout.elements if element.last > layout.leaves]
    longest = {name: max((b - a for a, b, held in out if held == name), default=0.0) for name in pulls}
    rows = [(name, longest[name], pull) for name, pull in pulls.items()]
    remedy = "Give mesh.sections.{name} or the section more elements, of at most {minimum:.2g} m, or leave its wake out"
    yield from element_problems(scene.cable, scene.water, speed, rows, remedy)
    yield from step_problems(scene.cable, speed, scene.solver.tick)


def min_tensions(layout: Layout) -> dict[str, float]:
    """Least tension [N] in the static shape at the start of each section that is in the water, where vortices are."""
    shape, names = layout.shape(), list(section_ends(layout.scene.cable))
    within = {name: shape.tension[(shape.section == i) & shape.wet] for i, name in enumerate(names)}
    return {name: float(tension.min()) for name, tension in within.items() if len(tension)}


def line_problems(cable: Cable, water: Water | Fluid | None, speed: float, tension: float) -> Iterator[Problem]:
    """What a line of one's own cannot have in its fluid: flow of ``speed`` [m/s], tension [N] of all of it."""
    yield from cable_problems(cable)
    if water is None and has_wakes(cable):
        text = "has a wake in nothing: no fluid, no vortices"
        yield Problem("cable.sections", text, "Give water: a Water or a Fluid")
    if water is None:
        return
    rows = [(name, section.length / section.meshed, tension) for name, section in cable.sections.items()]
    remedy = "Give cable.sections.{name} elements of at most {minimum:.2g} m, or leave its wake out"
    yield from element_problems(cable, water, speed, rows, remedy)


def amplified_warnings(cable: Cable) -> list[Problem]:
    """Sections whose drag is amplified for the vibration that their wake computes."""
    return [
        Problem(
            f"cable.sections.{name}.drag_amplification",
            f"= {section.drag_amplification:g} beside wake.law = {section.wake.law.value}: the amplification stands "
            "for the drag of a vibration that the wake computes, and counts twice where that is large",
            "Leave drag_amplification at 1 where a wake is computed",
        )
        for name, section in cable.sections.items()
        if section.wake.law is not WakeLaw.OFF and section.drag_amplification > 1.0
    ]
