"""One command line over everything. Each command imports what it needs when it runs; only the node needs ROS."""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import extensions
from ..errors import CODE_DAMAGED, CODE_FAILED, CODE_OK
from ..files import write_text
from ..limits import LONGEST_RUN, MAX_TOW_SPEED
from ..terminal import clean, print_table, say
from ..version import __version__
from .motion_options import SHIPPED_BAG, motion_options, simulated
from .options import (
    ARGUMENTS,
    FILE,
    Answer,
    Number,
    all_option,
    answers,
    asks_json,
    bag_options,
    bag_scene_option,
    code_of,
    folder_option,
    force_option,
    imu_option,
    junit_option,
    limits_option,
    markers_option,
    need_ros,
    needs_out,
    out_option,
    progress_bar,
    ready,
    report_option,
    reporting,
    setpoint_option,
    settings_options,
    start_option,
    unrecorded,
)
from .options import report as report_error
from .report import answer_of

if TYPE_CHECKING:
    from ..runs.mesh import MeshChange
    from ..sim.mesh.mesh_kinds import MeshPlan
    from ..sim.scene import Scene

JSON = "cable_sim_ros.json"  # of click's context
SHIPPED_SCENE = "full_scale"
PASS_ON = {"ignore_unknown_options": True, "allow_extra_args": True}


class Commands(click.Group):
    """Group that reports an expected error in one line and leaves with its code."""

    def list_commands(self, context: click.Context) -> list[str]:
        """All names, those of tools too."""
        return sorted({*super().list_commands(context), *extensions.found(extensions.COMMANDS)})

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """The command of this name; one of a tool is imported now."""
        points = extensions.found(extensions.COMMANDS).get(name)
        if name in self.commands or points is None:
            return super().get_command(context, name)
        try:
            return extensions.load(
                points, lambda made: "" if isinstance(made, click.Command) else "is no click.Command"
            )
        except extensions.ExtensionError as error:
            return _broken(name, error)

    def resolve_command(self, context: click.Context, args: list[str]) -> tuple:
        """As click's, with what a checkout has beside the product named where it is not installed."""
        if args and args[0] in extensions.absent(extensions.COMMANDS):
            context.fail(
                f"No such command '{args[0]}' here: it stands in verification/, in a checkout of the project; nothing "
                f"was run. Install one in place: pip install -e ."
            )
        return super().resolve_command(context, args)

    def parse_args(self, context: click.Context, args: list[str]) -> list[str]:
        """Keep whether the figures are to be JSON, for an error that comes before them."""
        context.meta[JSON] = "--json" in args
        context.meta[ARGUMENTS] = list(args)
        return super().parse_args(context, args)

    def invoke(self, context: click.Context):
        """Run a command; expected errors become one line on stderr."""
        said: set[str] = set()
        damaged: list[str] = []
        warnings.showwarning = lambda message, category, *_: _warn(str(message), category, said, damaged)
        try:
            result = super().invoke(context)
            if damaged:
                context.exit(CODE_DAMAGED)
            return result
        except click.ClickException as error:
            error.message = clean(error.message, lines=isinstance(error, click.MissingParameter))  # type: ignore[misc]
            raise
        except Exception as error:
            code = code_of(error)
            if code is None:
                raise
            context.exit(report_error(error, code, context.meta[JSON]))


def _broken(name: str, error: extensions.ExtensionError) -> click.Command:
    """Stands in for a command that cannot be used, so that the others can be listed."""

    def end(**_: object) -> None:
        raise error

    settings: dict = PASS_ON | {"help_option_names": []}
    return click.Command(name, context_settings=settings, callback=end, short_help=f"Cannot be used: {error}")


def _warn(message: str, category: type[Warning], said: set[str], damaged: list[str]) -> None:
    """A warning in one line, once: a scene with another number is checked again, under another name."""
    text = message.partition(": ")[2] or message
    if text not in said:
        said.add(text)
        if category.__name__ == "DamageWarning":  # of io/bags/bag.py
            damaged.append(text)
        say(f"warning: {message}", err=True)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "show_default": True})
@click.version_option(__version__, prog_name="cable-sim")
def main() -> None:
    """Simulate a shipboard cable tow: scenes are YAML files or names of shipped ones, bags are rosbag2 directories."""


@main.command(context_settings=PASS_ON)
@click.argument("ros_arguments", nargs=-1, type=click.UNPROCESSED)
def node(ros_arguments: tuple[str, ...]) -> None:
    """The real-time ROS 2 node, seen on this host only unless --open is given.

    ROS arguments are passed on, as in: --ros-args -p scene:=full_scale.
    """
    need_ros()
    from ..ros.node import main as node_main

    sys.exit(node_main(["node", *ros_arguments]))


@main.command()
@click.argument("scene", required=False)
@motion_options
@click.option(
    "--save", type=click.Path(path_type=Path), metavar="FILE", help="Write the state at the end to FILE, for --from."
)
@click.option(
    "--from",
    "begin",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Begin with the state in FILE in place of the static start. SCENE may be left out.",
)
@click.option(
    "--check", is_flag=True, help="Run it again with half the step and twice the elements: do the peaks stay?"
)
@settings_options
@out_option
@markers_option
@report_option
@all_option
@answers
def run(scene, begin, report, out, **asked) -> Answer:
    """Simulate SCENE offline, as fast as it goes."""
    needs_out(asked["markers"], out)
    with reporting(report, out) as reporter:
        result = simulated(scene, begin, out=reporter.folder, **asked)
        reporter.write(result)
    return answer_of(unrecorded(result, out), out)


@main.command()
@click.argument("bag")
@bag_scene_option
@setpoint_option
@settings_options
@out_option
@markers_option
@limits_option
@junit_option
@report_option
@all_option
@answers
def replay(bag, scene, algorithm, convention, topics, settings, out, markers, limits, junit, report) -> Answer:
    """Simulate a recorded BAG again and print the residuals against what it recorded of the tow.

    --limits: the scores of `cable-sim compare`, recorded against simulated, decide the exit code.
    """
    needs_out(markers, out)
    scorer = extensions.part_of_a_run("scores") if limits or junit else None
    if (limits or junit) and scorer is None:
        raise click.UsageError(
            "--limits and --junit need a part named scores among cable_sim.run_parts, and none is installed; nothing "
            "was simulated. Install cable_sim_ros again"
        )
    asked = scorer.load_limits(limits) if scorer and limits else None
    with reporting(report, out) as reporter:
        with progress_bar() as progress:
            from ..runs import offline
            from ..runs.settings import settings_of, topics_of

            result = offline.replay(
                bag,
                scene,
                algorithm=algorithm,
                settings=settings_of(settings, convention),
                topics=topics_of(topics),
                out=reporter.folder,
                markers=markers,
                progress=progress,
            )
        scores = scorer.score_replay(result, bag, asked, out) if scorer else None
        reporter.write(result)
    answer = answer_of(unrecorded(result, out), out)
    return scorer.with_limits(answer, scores, junit) if scorer else answer


@main.command()
@click.argument("bag", default=SHIPPED_BAG)
@click.option("--scene", default=SHIPPED_SCENE, help="Scene to simulate.")
@click.option("--duration", type=Number(1.0, LONGEST_RUN, "s"), default=60.0, help="Seconds of the bag to play.")
@imu_option
@folder_option("Folder for the bag, figures and picture. Default: runs/<date and time>.")
@report_option
@all_option
@answers
def live(bag, scene, duration, imu_only, out, report) -> Answer:
    """Play BAG over real topics into the node, in real time: summary, picture, recorded bag."""
    need_ros()
    from ..io.recordings.recorded_run import load_run
    from ..io.scenes.document import find_bag
    from ..io.scenes.load import load_scene
    from ..ros.play.live import live as run_live
    from ..runs.offline import Run, judged, start_up
    from ..runs.summary import OUTSIDE, summarize, write_summary
    from ..runs.verdict import played
    from ..sim.rules.watch import watched
    from ..sim.verdict import of_node

    path = find_bag(bag)
    tow = load_scene(scene)  # a mistake is reported here, before any process is started
    out = out or Path("runs") / time.strftime("%Y%m%d_%H%M%S")
    ready(out)
    quiet = (lambda *_: None) if asks_json() else None
    with reporting(report, out) as reporter:
        done = run_live(path, scene, duration, out, imu_only=imu_only, speed=tow.ship.tow_speed, progress=quiet)
    recorded = load_run(done["bag"])
    node_metrics = done["node"]
    outside = {name: node_metrics.get(name) for name in OUTSIDE}
    metrics = summarize(recorded.frames, skip_s=start_up(tow, True), **outside)
    metrics.update(scene=recorded.custom_data.get("scene", str(scene)), motion=Path(bag).name, node=node_metrics)
    metrics.update(watched(tow, recorded.frames))
    result = Run(recorded.frames, metrics, node_metrics.get("problem", ""), Path(done["bag"]), scene=tow)
    judged(result, tow, of_node(node_metrics), played(recorded.frames))
    write_summary(out, result)
    reporter.write(result)
    return answer_of(result, out)


@main.command(context_settings=PASS_ON)
@click.argument("bag")
@click.option(
    "--rate",
    type=Number(0.0, 100.0, above=True),
    show_default="1.0",
    help="Speed of sending; stamps keep their spacing.",
)
@click.option("--loop", is_flag=True, help="Begin again at the end, stamps going on.")
@start_option
@click.option("--duration", type=Number(0.0, LONGEST_RUN, "s"), help="Stop after so many seconds of the bag.")
@imu_option
@click.option("--keep-stamps", is_flag=True, help="Send the recorded stamps instead of present ones.")
@click.option("--lockstep", is_flag=True, help="Send by /clock, for a node with time_mode:=lockstep.")
@click.option(
    "--speed",
    type=Number(-MAX_TOW_SPEED, MAX_TOW_SPEED, "m/s"),
    help="Of the ship, for an imported bag whose log has none: ship.tow_speed of the scene.",
)
@bag_options
@click.argument("ros_arguments", nargs=-1, type=click.UNPROCESSED)
def play(bag, convention, topics, **asked) -> None:
    """Play the ship motion of BAG over real topics, as the ship's own sensors would send it.

    It is sent in ENU axes: with --convention ned it is turned.
    """
    need_ros()
    from ..ros.play.player import play_bag
    from ..runs.settings import topics_of

    sent = play_bag(bag, topics=topics_of(topics), ned=convention == "ned", **asked)
    say(f"played {sent} messages", err=True)


class DamagedBag(click.ClickException):
    """Only a part of a bag could be read."""

    exit_code = CODE_DAMAGED


@main.command()
@click.argument("source")
@click.argument("target")
def recover(source: str, target: str) -> None:
    """Copy what can be read of the damaged or cut-off bag SOURCE (a path, or the name of a shipped one) into a new bag
    TARGET. Exit code 3: not all of it."""
    from ..io.recordings.recovery import recover as recover_bag
    from ..io.scenes.document import find_bag

    result = recover_bag(find_bag(source), target)
    say(f"{target}: {result.messages} messages over {result.duration:.2f} s")
    if result.damage:
        raise DamagedBag(str(result.damage))
    say("the source was whole: nothing is missing")


@main.command("make-bags")
@click.option("--out", default="bags", help="Folder for the bags.")
@click.option("--data", help="Folder of the source CSV files. Default: the shipped ones.")
@click.option("--speed", type=Number(-MAX_TOW_SPEED, MAX_TOW_SPEED, "m/s"), default=2.2, help="Mean speed ahead.")
@click.option("--only", multiple=True, metavar="NAME", help="Make this bag only; may be repeated.")
@force_option("Replace bags that exist.")
def make_bags(out: str, data: str | None, speed: float, only: tuple[str, ...], force: bool) -> None:
    """Make the shipped bags of recorded ship motion from their 1 Hz sources."""
    from ..runs.make_bags import make_bags as make

    for row in make(out, data, speed=speed, only=only, force=force):
        say(row)


@main.command()
@click.argument("page", default="parameters")
@click.option("--out", type=FILE, help="File to write. Default: standard output.")
def manual(page, out) -> None:
    """A PAGE of the manual in Markdown, made from the declarations.

    parameters: every key of a scene and of the node; fields: what a tick answers, with units, tables and topics;
    problems: what a scene or a plan is refused for or warned of; causes: why messages of motion and commands are
    refused; mapping_keys: keys, words and units of a mapping of a log.
    """
    from ..runs import field_manual, problem_manual

    own = {"parameters": manual_text, "fields": field_manual.text}
    own |= {"problems": problem_manual.text, "causes": problem_manual.causes_text}
    others = extensions.found(extensions.PAGES)
    if page not in own | others:
        names = ", ".join(own | others)
        raise click.UsageError(f"there is no page '{page}'; nothing was written. Give one of {names}")
    text = own[page]() if page in own else extensions.load(others[page])()
    if out is None:
        say(text, nl=False, lines=True)
    else:
        write_text(out, text)


@main.command()
@click.argument("scene")
@click.option("--check", "checked", is_flag=True, help="Measure it by two and four times the elements, half the step.")
@click.option(
    "--seconds", type=Number(0.0, LONGEST_RUN, "s"), default=60.0, help="Heave of the check; 0: statics alone."
)
@answers
def mesh(scene: str, checked: bool, seconds: float) -> Answer:
    """The mesh made for SCENE: elements, lengths, the reason of each, the expected error.

    With --check, the error that finer meshes and a finer step show beside what is promised; leaves with code 1 where
    it is more.
    """
    from ..runs import mesh as study

    tow, plan = study.plan_of(scene)
    changes: list[MeshChange] = []
    if checked:
        with progress_bar() as progress:
            changes = study.check(tow, plan, progress, seconds)
    report = study.as_json(tow, plan, changes)
    code = CODE_FAILED if changes and not report["kept"] else CODE_OK
    return Answer(report, lambda: _tell_mesh(tow, plan, changes, report), code=code)


def _tell_mesh(scene: Scene, plan: MeshPlan, changes: list[MeshChange], report: dict[str, Any]) -> None:
    words, width = ("part", "where", "reason", "what"), 140
    title = f"{scene.name}: {report['elements']} elements, {report['scope_m']:.4g} m of scope at the start"
    rows = [
        (part.name, part.place, f"{part.elements}", f"{part.shortest:.3g}", f"{part.longest:.3g}", part.reason)
        for part in plan.parts
    ]
    print_table(title, ("part", "where", "elements", "shortest m", "longest m", "reason"), rows, words, width)
    promised = [
        (f"{row.scope:.4g}", f"{100.0 * row.tension:.2g}", f"{row.position:.2g}")
        if row.tension == row.tension
        else (f"{row.scope:.4g}", "none promised", "static shape does not close")
        for row in plan.expected
    ]
    print_table("Expected error", ("scope m", "tension %", "place of the towbody m"), promised, words, width)
    say(f"solver.tick = {scene.solver.tick:g} s is the scene's; for motion of 4 s and longer {plan.tick:g} s would do")
    say(f"forces are solved to {plan.tolerance:g} of contact.working_tension (solver.tolerance)")
    if changes:
        found = [
            (
                change.what,
                f"{100.0 * change.tension:+.3f}",
                "" if change.deviation != change.deviation else f"{100.0 * change.deviation:+.3f}",
                f"{change.position:.4f}",
            )
            for change in changes
        ]
        columns = ("what", "tension, mean %", "tension, deviation %", "place of the towbody m")
        print_table("Error by two and four times the elements and half the step", columns, found, words, width)
        say("within what is promised" if report["kept"] else "MORE than is promised")


NODE_MANUAL = """## Node

Parameters that only the node has, set like those of the scene (`--ros-args -p input_delay:=0.05`).
"""


def manual_text() -> str:
    """The whole parameter manual: scene and node."""
    from ..ros.blocks import NodeBlock
    from ..runs import manual as writer

    return writer.text([(NODE_MANUAL, NodeBlock)])
