"""A recorded run as a Run: its figures made again from what it recorded, and judged."""

from __future__ import annotations

from pathlib import Path

from ..io.bags.bag_writer import BagError
from ..io.recordings.journal import read_journal
from ..io.recordings.recorded_run import load_run
from ..io.scenes.load import scene_from_text
from ..io.sources.recorded_tow import provenance, read_tow
from ..sim.rules.watch import watched
from .offline import judged, start_up
from .sources import in_the_sea, sea_motion_kept
from .summary import Run, summarize


def recorded(path: Path, nothing: str = "no plan is made", instead: str = "cable-sim plan SCENE") -> Run:
    """The recorded run, judged. BagError where it keeps no scene: then ``nothing`` is done, and what to do instead."""
    recorded = load_run(path)
    text = recorded.custom_data.get("scene_yaml")
    if not text:
        raise BagError(
            f"bag '{path}' keeps no scene, so what its winch has is not known: {nothing}; give a bag that the "
            f"node or the offline run recorded, or {instead}"
        )
    tow, about = read_tow(path), recorded.custom_data
    tow.sea_motion, tow.imported = sea_motion_kept(tow), provenance(tow.about)
    with in_the_sea(bool(tow.sea_motion)):
        scene = scene_from_text(text, f"scene kept in {path}")
    metrics = summarize(recorded.frames, skip_s=start_up(scene, True))
    metrics.update(scene=scene.name, motion=about.get("motion", "as recorded"), setpoint=scene.setpoint.algorithm.value)
    metrics.update({"winch": about["winch_plan"]} if "winch_plan" in about else {}, **watched(scene, recorded.frames))
    kept = {"rao": tow.sea_motion, "imported": tow.imported}
    metrics.update({name: one for name, one in kept.items() if one})
    segments = read_journal(tow.journal).segments
    problem = "the solver gave up in the recorded run" if segments and segments[-1].halted else ""
    return judged(Run(recorded.frames, metrics, problem, path, scene=scene), scene)
