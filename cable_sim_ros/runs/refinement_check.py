"""`cable-sim run --check`: the same run with half the step and twice the elements, and what that settles.

Peaks of a cable that comes tight after slack depend on mesh and step until both are fine enough; so does where a drum
goes that its motor or brake does not lead back, and where a towbody goes after a stop. Two runs that agree say that
they are; two that do not say by how much they are not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..io.scenes.live_changes import Change
from ..io.scenes.load import override
from ..io.scenes.winch_plan import WinchPlan
from ..io.sources.recorded_tow import RecordedTow
from ..physics.winch import DrumModel
from ..sim.flag_rules import PEAKS
from ..sim.layout import layout_of
from ..sim.mesh.mesh_kinds import FeedMesh
from ..sim.scene import Scene
from ..sim.verdict import check, verdict_of
from .message_run import MessageRun
from .stepping import Progress
from .summary import Run, summarize

SETTLED = ("SLACK", "SNAP_STEP", "RINGING_DAMPED", "RENDER_PLACE")  # doubtful because of mesh and step alone
AGREED = 0.02  # of the largest tension, and of the deviation
ORDER = 4.0  # half the step is a quarter of the error: chosen steps are asked for that


def finer(scene: Scene) -> tuple[Scene, FeedMesh | None]:
    """The scene with half the step, and its mesh with every element halved; None where the scene itself has it."""
    solver = scene.solver
    values: dict[str, Any] = {"solver.tick": 0.5 * solver.tick}
    if solver.tension_error is not None:
        values["solver.tension_error"] = solver.tension_error / ORDER
        values["solver.position_error"] = solver.position_error / ORDER
    plan = layout_of(scene).plan
    if plan is None or scene.winch.drum != DrumModel.FEED:
        for name, section in scene.cable.sections.items():
            values[f"cable.sections.{name}.elements"] = 2 * section.meshed
        return override(scene, values), None
    return override(scene, values), plan.mesh.doubled


def compare(
    result: Run,
    scene: Scene,
    motion: Callable[[], RecordedTow | None],
    duration: float | None,
    winch: WinchPlan | None,
    progress: Progress,
    changes: Iterable[Change] = (),
) -> Run:
    """Run again, finer; `check` in the figures has each figure of both, and a verdict that peaks alone made doubtful
    becomes ok where they agree.

    motion: makes the messages of the ship's motion anew; duration: s, None: all there is. Raises as `offline.run`.
    """
    if result.problem or not len(result.frames):
        return result
    fine, mesh = finer(scene)
    one = MessageRun(fine, motion(), progress=progress, winch=winch, mesh=mesh, changes=changes)
    driven = one.run(duration, None)
    metrics, reasons = result.metrics, list(result.verdict.reasons)
    if driven.problem:
        reasons.append(check("CHECK", f"the finer run did not come to its end, nothing was compared: {driven.problem}"))
        metrics["check"] = {"agreed": False, "problem": driven.problem}
    else:
        again = summarize(driven.frames, skip_s=metrics["skip_s"])
        report: dict[str, Any] = {name: [metrics[name], again[name]] for name in ("tension_mean_n", *PEAKS)}
        found = moved(result.frames, driven.frames, metrics["skip_s"])
        texts = [*apart(metrics, again).values(), *too_far(found, scene).values()]
        metrics["check"] = {"agreed": not any(texts), "steps": [metrics["steps"], again["steps"]], **report, **found}
        if any(texts):
            reasons.append(check("CHECK", "; ".join(text for text in texts if text)))
        else:
            reasons = [reason for reason in reasons if reason.flag not in SETTLED]
    result.verdict = verdict_of(reasons)._replace(notes=result.verdict.notes)
    metrics["verdict"] = result.verdict.as_dict()
    return result


def apart(metrics: dict[str, Any], again: dict[str, Any]) -> dict[str, str]:
    """Of each figure of PEAKS, by how much two runs differ where that is more than AGREED, in words; "" where not."""
    found, largest = {}, abs(again["tension_max_n"])
    for name in PEAKS:
        ours, theirs = metrics[name], again[name]
        known = ours is not None and theirs is not None
        size = theirs if name == "tension_std_n" and known else largest
        far = known and abs(ours - theirs) > AGREED * size
        found[name] = (
            f"{name} = {ours:.4g} N became {theirs:.4g} N with half the step and twice the elements" if far else ""
        )
    return found


def moved(frames: np.recarray, finer: np.recarray, skip_s: float) -> dict[str, float]:
    """Largest distance [m] between the towbodies and the pay-outs of two runs at the ticks of the coarser, after
    ``skip_s``."""
    since = frames["time"] - frames["time"][0] >= skip_s * 1e9
    _, ours, theirs = np.intersect1d(frames["time"][since], finer["time"], return_indices=True)
    ours, fine = frames[since][ours], finer[theirs]
    away = np.sqrt(((ours["body_position"] - fine["body_position"]) ** 2).sum(axis=1))
    return {
        "body_moved_m": float(away.max(initial=0.0)),
        "payout_moved_m": float(np.abs(ours["payout"] - fine["payout"]).max(initial=0.0)),
    }


def too_far(found: dict[str, float], scene: Scene) -> dict[str, str]:
    """Of each of `moved`, in words that it is more than the position that the scene asks for; "" where not."""
    limit = scene.solver.position_error if scene.accuracy.position is None else scene.accuracy.position
    return {
        name: f"{name} = {value:.3g} m with half the step and twice the elements, asked for: {limit:g} m (accuracy."
        f"position). Steps of {0.5 * scene.solver.tick:g} s, or solver.tension_error and position_error a quarter"
        if value > limit
        else ""
        for name, value in found.items()
    }
