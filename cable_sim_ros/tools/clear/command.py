"""`cable-sim clear`: does the towbody clear the ground ahead, and what clears it, by when."""

from __future__ import annotations

import sys
from math import degrees, hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import (
    FILE,
    Answer,
    Number,
    answers,
    asks_json,
    drawn,
    folder_option,
    need_ros,
    node_options,
    progress_bar,
    ready,
    set_option,
)
from ...errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK
from ...terminal import print_table, say

if TYPE_CHECKING:
    from .advice import Allowances, Wanted
    from .towed import Tow


@click.command()
@click.argument("scene", required=False, metavar="[SCENE|STATE.npz]")
@click.option("--profile", type=FILE, metavar="FILE", help="CSV of the ground ahead: distance_m,depth_m.")
@click.option("--scope", type=Number(0.1, 2e4, "m"), help="Cable out, in place of that of scene or state.")
@click.option("--speed", type=Number(0.0, 15.0, "m/s"), help="Speed of the ship, in place of that of scene or state.")
@click.option("--margin", type=Number(0.0, 1000.0, "m"), default=5.0, help="Clearance to keep. Default: 5.")
@click.option("--rate", type=Number(1e-3, 50.0, "m/s"), help="Rate of the winch. Default: winch.max_rate.")
@click.option("--least-scope", type=Number(0.1, 2e4, "m"), help="Haul no further. Default: a quarter of the scope.")
@click.option("--max-speed", type=Number(0.1, 15.0, "m/s"), help="Go no faster. Default: the speed is kept.")
@click.option("--acceleration", type=Number(1e-3, 1.0, "m/s^2"), default=0.02, help="Of the ship. Default: 0.02.")
@click.option("--hole", type=Number(0.1, 1e5, "m"), default=100.0, help="Points further apart: a hole. Default: 100.")
@click.option(
    "--range",
    "ranges",
    multiple=True,
    metavar="KEY=VALUE",
    help="Half-width of 95 %: drag (share), speed (m/s), sounding (m), sounding_share. May be repeated.",
)
@set_option("A value of the scene by its key; not of a state.")
@folder_option("Folder for clear.json and clear.png; not beside a node.")
@click.option(
    "--corridor",
    type=Number(0.1, 1e4, "m"),
    default=25.0,
    help="Points so far beside, and 5 % of their distance, count. Default: 25.",
)
@click.option("--age", type=Number(1.0, 1e5, "s"), default=600.0, help="A profile is fresh for so long. Default: 600.")
@node_options(wait=60.0)
@answers
def clear(scene, profile, ranges, settings, out, namespace, wait, open_, **asked) -> Answer:
    """Does a steady tow clear the ground ahead; else the least haul, or speed, that does, and by when.

    With --profile, of SCENE or a saved state; without, beside a running node (SCENE: in place of its own), with the
    topic clear/profile: docs/clear.md. Exit codes: 0 clear as it is towed; 1 not; 2 bad input; 4 not all was judged.
    """
    from ..ensemble.plan import ranges_of
    from .advice import Allowances, Wanted

    known, lines = ranges_of(ranges, Allowances)
    wanted = Wanted(**asked)
    if profile is None:
        given = [f"--{name}" for name in ("scope", "speed") if asked[name] is not None]
        given += [name for name, value in (("--out", out), ("--set", settings), ("--json", asks_json())) if value]
        if given:
            raise click.UsageError(f"{given[0]} needs a profile; nothing was judged. Give --profile FILE as well")
        need_ros()
        from .beside import beside

        sys.exit(beside(wanted, known, scene, namespace, wait, open_))
    if scene is None:
        raise click.UsageError(f"{profile}: over it what is towed? Nothing was judged. Give SCENE or STATE.npz")
    ready(out)
    return _of_files(_tow_of(scene, settings, wanted), profile, wanted, known, lines, out)


def _tow_of(source: str, settings: tuple[str, ...], wanted: Wanted) -> tuple[Tow, float | None]:
    """The tow of a scene, or of a state, and then how deep its towbody is."""
    from ...io.scenes.load import load_scene
    from ...runs.settings import apply_to_scene, settings_of
    from ...sim.simulator import Simulator
    from .towed import ClearError

    if source.lower().endswith(".npz"):
        if settings:
            raise click.UsageError("--set is of a scene, and a state has its own; nothing was judged. Leave it out")
        sim = Simulator.load(source)
        frame, (u, v, _) = sim.frame, sim.frame["ship_velocity"].tolist()
        yaw = float(sim.state.now.ship.mean_coord[5])
        ship = sim.scene.ship.model_copy(update={"heading_deg": degrees(yaw)})
        scene = sim.scene.model_copy(update={"ship": ship})
        return wanted.tow(scene, float(frame["scope"]), hypot(u, v)), -float(frame["body_position"][2])
    scene = apply_to_scene(load_scene(source), settings_of(settings))
    scope = wanted.scope or scene.winch.scope
    if scope is None:
        raise ClearError(f"{scene.name}: has no winch.scope; nothing was judged. Give --scope, the cable out in m")
    return wanted.tow(scene, scope, scene.ship.tow_speed), None


def _of_files(
    found: tuple[Tow, float | None], file: Path, wanted: Wanted, known: Allowances, lines: list[str], out: Path | None
) -> Answer:
    from .advice import Passage, actions_of, advise, deeper_than_the_wire, plot, told
    from .profile import read_profile
    from .towed import ClearError, copies_of

    (tow, depth), ground = found, read_profile(file, wanted.hole)
    for option, given, now in (
        (
            "--least-scope",
            wanted.least_scope,
            f"more than the {tow.scope:g} m of cable out: nothing could be hauled in",
        ),
        ("--max-speed", wanted.max_speed, f"less than the {tow.speed:g} m/s of the ship: it could not go faster"),
    ):
        if given is not None and (given > tow.scope if option == "--least-scope" else given < tow.speed):
            raise ClearError(f"{option} {given:g} is {now}; nothing was judged. Leave it out, or give another")
    report, passage = deeper_than_the_wire(tow, ground, wanted.margin, known), None
    if report is None:
        with progress_bar("copies of the tow") as progress:
            copies = copies_of(
                tow, actions_of(tow, wanted.least(tow.scope), wanted.max_speed), known.drag, known.speed, progress
            )
        passage = Passage(copies, ground, wanted.margin, known, wanted.deeper(copies, depth))
        report = advise(passage)
    report = {"scene": tow.scene.name, "profile": str(file), "answer": told(report), **report, "assumed": lines}
    files = drawn(lambda: plot(passage, report, out / "clear.png")) if out is not None and passage is not None else []
    open_ends = report["state"] == "unknown" or bool(report["notes"])
    code = CODE_FAILED if report["state"] in ("act", "cannot") else CODE_DOUBTFUL if open_ends else CODE_OK
    return Answer(report, lambda: _tell(report), out and out / "clear.json", files, code=code)


def _tell(report: dict[str, Any]) -> None:
    state, _, rest = report["answer"].partition(": ")
    say(f"{report['scene']}: {state}: {rest}")
    rows = []
    for way in report["ways"] if "ways" in report else ():
        one = way if way["clears"] else way["all_now"]
        times = ("", "", "", "never")
        if way["clears"]:
            out = way["let_out_from_s"]
            back = "-" if out is None else f"{out:.0f}"
            times = (f"{way['haul_m']:.1f}", f"{way['speed_more_mps']:.2f}", f"{way['begin_by_s']:.0f}", back)
        rows.append((way["way"], *times, f"{one['clearance_m']:.1f}", f"{one['allowance_m']:.1f}"))
    if rows:
        heads = ("way", "haul m", "faster m/s", "begin by s", "back from s", "clearance m", "not known m")
        print_table("What clears the ground, alone; times from now", heads, rows, left=("way",))
    for line in [*(f"note: {note}" for note in report["notes"]), *report["assumed"]]:
        say(line)
