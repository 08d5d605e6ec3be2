"""A recorded run as moments that can be drawn: one for each shape of the cable in the bag, with its verdict."""

from __future__ import annotations

import os
import warnings

import numpy as np

from ...io.bags.bag import DamageWarning
from ...io.recordings.recorded_run import load_run, places_of, scene_of_recording
from ...runs import mean_track
from ...runs.summary import since_first
from ...runs.verdict import judge
from ...sim.flag_rules import DAMAGE
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from ...sim.verdict import Reason, Verdict, check
from .moment import NO_CONTACT, Moment, ViewError


class BagRun:
    """Moments of a bag; `run`: as recorded; `seconds`: of each tick output, `times`: of each moment, since the start.

    ViewError where the bag has no shapes, BagError where it keeps no scene and none is given.
    """

    def __init__(self, path: str | os.PathLike, scene: str | None = None) -> None:
        self.path = os.fspath(path)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            self.run = load_run(path)
        for one in said:  # on to the user, who gets exit code 3 for a damaged bag
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
        damage = "; ".join(str(one.message) for one in said if issubclass(one.category, DamageWarning))
        with warnings.catch_warnings():  # said when it was simulated
            warnings.simplefilter("ignore")
            unknown = "that ship, sheave and towbody are not known"
            self.scene = scene_of_recording(self.run.custom_data, self.path, scene, unknown, "nothing was drawn")
        if not self.run.shapes:
            raise ViewError(
                f"bag '{self.path}' has no cable/shape: there is no cable to draw, and nothing was drawn. Record that "
                "topic too, or make a bag that has it: cable-sim replay BAG --out FOLDER"
            )
        frames = self.run.frames
        self.seconds = 1e-9 * since_first(frames)
        self.at = places_of([time for time, _ in self.run.shapes], frames)
        self.times = self.seconds[self.at]
        stamps = [time for time, _ in self.run.contacts]
        self.contact_at = places_of(stamps, frames) if stamps else np.zeros(0, int)
        self.verdict: Verdict = judge(
            frames, self.scene, doubts(self.scene, frames, damage, "ship_plan" in self.run.custom_data)
        )

    def __len__(self) -> int:
        return len(self.times)

    @property
    def length(self) -> float:
        """Seconds from the first moment to the last."""
        return float(self.times[-1] - self.times[0])

    def index(self, seconds: float) -> int:
        """The newest moment at a time since the first moment [s]."""
        at = int(np.searchsorted(self.times - self.times[0], seconds + 1e-6, side="right")) - 1
        return min(max(at, 0), len(self) - 1)

    def moment(self, k: int) -> Moment:
        """What was recorded at place k, the contact of that tick or the last one before it."""
        tick = int(self.at[k])
        place = int(np.searchsorted(self.contact_at, tick, side="right")) - 1
        contact = self.run.contacts[place][1] if place >= 0 else NO_CONTACT
        return Moment(float(self.times[k] - self.times[0]), self.run.frames[tick], self.run.shapes[k][1], contact)


def doubts(scene: Scene, frames: np.recarray, damage: str, planned: bool) -> list[Reason]:
    """What makes a run doubtful beside its flags, as far as a bag tells; planned: its ship went by a plan."""
    yaw = angles_of(*frames[0]["ship_quaternion"].tolist())[2]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # said when it was simulated
        found = [] if planned else mean_track.look(scene, yaw, frames)
        found += mean_track.pitch_sign(frames)
    return [*found, *([check(DAMAGE, damage)] if damage else [])]
