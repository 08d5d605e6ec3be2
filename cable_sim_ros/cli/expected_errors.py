"""Errors that a command reports in one line: their text is the whole message. Anything else keeps its traceback."""

from __future__ import annotations

import json

import click

from ..sim.flag_rules import CODE_FAILED, CODE_INPUT

# by name, so that nothing is imported that a command does not need; ours from that of the user or the data
EXPECTED = {
    "cable_sim_ros.io.load.SceneError": CODE_INPUT,
    "cable_sim_ros.io.bag_writer.BagError": CODE_INPUT,
    "cable_sim_ros.viv.files.SpanError": CODE_INPUT,
    "cable_sim_ros.io.motion_table.MotionError": CODE_INPUT,
    "cable_sim_ros.io.winch_plan.PlanError": CODE_INPUT,
    "cable_sim_ros.io.resources.ResourceError": CODE_INPUT,
    "cable_sim_ros.sim.inputs.InputError": CODE_INPUT,
    "cable_sim_ros.sim.mesh_kinds.MeshError": CODE_INPUT,
    "cable_sim_ros.sim.savefile.SaveError": CODE_INPUT,
    "cable_sim_ros.ros.player.PlayError": CODE_INPUT,
    "cable_sim_ros.ros.parameters.ParameterError": CODE_INPUT,
    "cable_sim_ros.verification.cases.family.CaseError": CODE_INPUT,
    "cable_sim_ros.runs.mesh.CheckError": CODE_FAILED,
    "cable_sim_ros.sim.route.StartError": CODE_FAILED,
    "cable_sim_ros.sim.simulator.SolverError": CODE_FAILED,
    "cable_sim_ros.sim.rig.RigError": CODE_FAILED,
    "cable_sim_ros.runs.span.SpanRunError": CODE_FAILED,
    "cable_sim_ros.start.NotInstalledError": CODE_INPUT,
    "cable_sim_ros.ros.live.LiveInputError": CODE_INPUT,
    "cable_sim_ros.ros.live.LiveError": CODE_FAILED,
}
CAUSES = {"StartError": "NO_START"}  # names in sim/flag_rules.CHECKS; the others halt


def code_of(error: BaseException) -> int | None:
    """Exit code of an expected error, None for one that is a fault of the program."""
    for kind in type(error).__mro__:
        code = EXPECTED.get(f"{kind.__module__}.{kind.__qualname__}")
        if code is not None:
            return code
    return CODE_INPUT if isinstance(error, OSError) else None


def report(error: BaseException, code: int, as_json: bool) -> int:
    """Say it in one line on stderr, and with --json as the verdict of a run that failed; returns the code."""
    click.echo(f"error: {error}", err=True)
    if as_json and code == CODE_FAILED:
        from ..sim.verdict import check, verdict_of

        verdict = getattr(error, "verdict", None)  # of what is no tow
        verdict = verdict or verdict_of([check(CAUSES.get(type(error).__name__, "HALTED"), str(error))])
        click.echo(json.dumps({"problem": str(error), "verdict": verdict.as_dict()}, indent=1))
    return code
