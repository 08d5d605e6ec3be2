"""Checks of the drum: what each of its two models needs of cable, winch and mesh."""

from __future__ import annotations

from collections.abc import Iterator

from ...physics.water import WaveKind
from ...physics.winch import DrumModel
from ..layout import Layout
from ..mesh.mesh_kinds import MeshError
from ..problem import Limit, Problem, changed, idle
from ..scene import Scene
from ..statics.route import DRUM_RESERVE

WAVES_BEYOND = 1.5  # times accuracy.tension: an estimate is not better


def drum_problems(layout: Layout) -> Iterator[Problem]:
    """Keys that belong to the other model of the drum, and lengths that do not go together."""
    if layout.scene.winch.drum == DrumModel.FEED:
        yield from list(feed_problems(layout)) or limit_problems(layout)
    else:
        yield from contact_problems(layout.scene)


def contact_problems(scene: Scene) -> Iterator[Problem]:
    """A mesh fixed to the material has its elements in the sections, and its cable where winch.wrap lays it."""
    winch = scene.winch
    for name, section in scene.cable.sections.items():
        if section.elements is None:
            yield Problem(
                f"cable.sections.{name}.elements",
                "is missing: with winch.drum = contact the mesh is fixed to the material and written section by "
                "section",
                "Give the number of elements, or leave winch.drum = contact out",
            )
    why = "with winch.drum = contact, winch.wrap and the sections say where the cable lies"
    yield from idle("winch", winch, ("scope", "cable_on_drum", "least_scope", "most_scope"), why, "winch.drum: feed")
    why = "with winch.drum = contact the mesh is cable.sections.*.elements"
    yield from idle("mesh", scene.mesh, changed(scene.mesh)[:1], why, "winch.drum: feed")


def feed_problems(layout: Layout) -> Iterator[Problem]:
    """A winch that feeds takes sections as material only, and needs cable on the drum and outboard."""
    scene, route, winch = layout.scene, layout.route, layout.scene.winch
    for name, section in scene.cable.sections.items():
        why = "a winch that feeds has its mesh made from accuracy; numbers written by hand go to mesh"
        yield from idle(f"cable.sections.{name}", section, ["elements"], why, "winch.drum: contact")
    for name in scene.mesh.sections:
        if name not in scene.cable.sections:
            yield Problem(
                f"mesh.sections.{name}", "is no section of the cable", f"Known: {', '.join(scene.cable.sections)}"
            )
    if winch.scope is not None and winch.cable_on_drum is not None:
        yield Problem(
            "winch.scope",
            f"= {winch.scope:g} m and winch.cable_on_drum = {winch.cable_on_drum:g} m are both given: each says "
            "alone how much cable is out at the start",
            "Leave one of them out",
        )
        return
    stays = winch.dead_length + DRUM_RESERVE * route.drum
    key = "winch.scope" if winch.scope is not None else "winch.cable_on_drum"
    if winch.scope is not None and winch.scope + route.inboard > route.total:
        yield Problem(
            key,
            f"= {winch.scope:g} m and {route.inboard:.4g} m from drum to sheave are more than the "
            f"{route.total:.4g} m that cable.sections add up to",
            f"Make it at most {route.total - route.inboard - stays:.4g} m, or the cable longer",
        )
    elif route.wound < stays * (1 - 1e-9):
        what = "winch.wrap" if winch.scope is None and winch.cable_on_drum is None else key
        yield Problem(
            what,
            f"leaves {route.wound:.4g} m on the drum at the start, but {stays:.4g} m must stay there "
            f"(winch.dead_length = {winch.dead_length:g} m and {DRUM_RESERVE:g} rad of wrap): the winch would "
            "stand beyond the end of its travel",
            f"Leave {stays:.4g} m or more on the drum, by a longer cable or a shorter scope",
        )
    elif route.total - route.wound <= route.inboard:
        yield Problem(
            key if winch.cable_on_drum is not None or winch.scope is not None else "winch.wrap",
            f"leaves {route.wound:.4g} m of the {route.total:.4g} m of cable on the drum: the "
            f"{max(0.0, route.total - route.wound):.4g} m off it do not reach the sheave, {route.inboard:.4g} m on",
            "Make the cable longer, or leave less of it on the drum",
        )


def limit_problems(layout: Layout) -> Iterator[Problem]:
    """Soft limits that leave no travel, or that the start lies beyond."""
    winch, route = layout.scene.winch, layout.route
    scope = route.scope
    low, high = winch.least_scope, winch.most_scope
    if low is not None and high is not None and low >= high:
        yield from Limit("winch.least_scope", low, "<", high, "m", "winch.most_scope").problems(
            "the winch would have no travel", "Make it smaller"
        )
        return
    for key, limit, relation in (("least_scope", low, "<="), ("most_scope", high, ">=")):
        if limit is not None:
            yield from Limit(f"winch.{key}", limit, relation, scope, "m", "the scope at the start").problems(
                "the winch would stand beyond its limit", "Start within it, or give another"
            )


def mesh_problems(layout: Layout) -> Iterator[Problem]:
    """A mesh that cannot be made as asked for; for a scene without other problems."""
    try:
        layout.plan  # noqa: B018  made here
    except MeshError as error:
        yield Problem(error.key, error.text, error.remedy)
        return


def wave_warnings(layout: Layout) -> Iterator[Problem]:
    """Waves of the water that the elements are too long for, from the start to the largest scope."""
    scene = layout.scene
    plan = layout.plan if scene.water.waves.kind is not WaveKind.OFF else None
    if plan is None:
        return
    start = layout.route.scope
    worst = max(
        (row.tension for row in plan.expected if row.scope >= start and row.tension == row.tension), default=0.0
    )
    lead = f"= {scene.water.waves.period:g} s makes the deviation of the tension err by # of itself"
    bounds, most = f"{WAVES_BEYOND:g} of accuracy.tension", WAVES_BEYOND * scene.accuracy.tension
    yield from Limit("water.waves.period", worst, "<=", most, "", bounds, lead).problems(
        f"near the surface it needs shorter elements than the mesh of {plan.mesh.nodes - 1} has",
        f"Give accuracy.tension {1.1 * worst:.2g}, leave out numbers under mesh, or a shorter scope (winch.most_scope)",
    )
