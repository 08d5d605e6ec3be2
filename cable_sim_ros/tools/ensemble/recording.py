"""The band over a recording of a tow: table, picture, and how much of the recorded run lies in it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...files import write_csv
from ...io.bags.bag import BagError, BagReader, Damage, report
from ...io.messages.channels import channel_of
from ...io.messages.messages import COMMANDED, KINDS
from ...io.recordings.recorded_run import HEALTH as HEALTH_CHANNEL
from ...io.recordings.recorded_run import scene_of_recording
from ...sim.scene import Scene
from .copies import FIGURES, Band, Ensemble, EnsembleEnded, Lost, figures_of, level_of, of_recorded
from .follow import HEALTH, Follower, Heard
from .plan import EnsemblePlan

COMMAND_TOPICS = {topic: kind for kind, (_, topic) in KINDS.items() if kind in COMMANDED}
PIECE = 50  # messages that are decoded at once: so many are lost at most where a tow begins again
APART = 0.25  # of the mean width of a band, rms: a copy 0 that is further from the tow does not follow it
ROUND_OFF = 1e-3  # of the largest figure of its unit: a band may have no width
UNITS = [unit for *_, unit in FIGURES.values()]
LEFT_OUT = 0.05  # of the tow that was heard, that may be in no band
CSV_NAME, PICTURE, JSON_NAME = "ensemble.csv", "ensemble.png", "ensemble.json"


class Followed(NamedTuple):
    """The band over a recording: time [s since its first tick output], bands low, median, high, nominal and the
    recorded tow [n, FIGURES], all copies [copies, n, FIGURES]; settled [n]: had the copies, where the tow was joined
    under way; lost copies; notes; flags: what tick outputs say against the figures; damage: what of the bag could not
    be read; CPU time of following and of the static starts [s]; simulated by one copy [s]; heard: of the tow [s]."""

    time: np.ndarray
    low: np.ndarray
    median: np.ndarray
    high: np.ndarray
    nominal: np.ndarray
    tow: np.ndarray
    values: np.ndarray
    settled: np.ndarray
    lost: list[Lost]
    notes: list[str]
    flags: list[str]
    damage: str
    cpu: float
    start_cpu: float
    simulated: float
    heard: float

    @property
    def members(self) -> int:
        """Copies in the band."""
        return len(self.values)

    @property
    def counted(self) -> np.ndarray:
        """Bands that figures are made of [n]: where the copies had settled, all where they never had."""
        return self.settled if self.settled.any() else np.ones(len(self.settled), bool)


def scene_kept(path: str | os.PathLike, given: str | None) -> Scene:
    """The scene of a recording, or the one given in its place. Raises BagError where there is none."""
    with BagReader(path) as bag:
        about = bag.custom_data
    return scene_of_recording(about, path, given, "what was towed is not known: nothing was simulated")


def heard_of(path: str | os.PathLike, damage: Damage | None = None) -> Iterator[Heard]:
    """What a node's neighbour would have heard of a recording, at its end `damage`. BagError where it has no tick
    outputs."""
    found = False
    with BagReader(path) as bag:
        for message in bag:
            channel = channel_of(message.topic, message.msgtype)
            if channel is HEALTH_CHANNEL:
                found = True
                yield Heard(message.time, HEALTH, message.data)
                continue
            kind = next((k for topic, k in COMMAND_TOPICS.items() if message.topic.endswith(f"/{topic}")), None)
            if kind is not None and message.msgtype == KINDS[kind][0]:
                yield Heard(message.time, kind, message.data)
        report(bag, damage)
    if not found:
        raise BagError(
            f"bag '{path}' has no topic '{HEALTH_CHANNEL.topic}', so it is no recording of a tow: nothing was "
            f"simulated. Simulate one first: cable-sim run SCENE --motion {path} --out DIR"
        )


def follow_recording(
    path: str | os.PathLike,
    scene: Scene,
    plan: EnsemblePlan,
    ensemble: Ensemble | None = None,
    progress: Callable[[str, float, float], None] = lambda *_: None,
) -> Followed:
    """The band over a recording. Raises EnsembleEnded, BagError."""
    follower, used = Follower(scene, plan, ensemble), time.process_time()
    bands: list[Band] = []
    tows: list[np.ndarray] = []
    settled: list[bool] = []
    lost: list[Lost] = []
    waiting: list[Heard] = []
    begins: list[int] = []
    damage = Damage()

    def drain(last: bool = False) -> None:
        follower.hear(waiting)
        waiting.clear()
        while True:
            band = follower.advance(last)
            lost.extend(one for one in follower.ensemble.lost if one not in lost)  # of every start
            if band is None:
                if follower.ready(last):
                    continue  # the copies began again
                return
            bands.append(band)
            begins.append(follower.began)
            settled.append(not follower.settling)
            tows.append(figures_of(np.array([follower.tow])))
            progress("following", (int(band.time[0]) - begins[0]) * 1e-9, 0.0)

    for item in heard_of(path, damage):
        waiting.append(item)
        if len(waiting) >= PIECE:
            drain()
    drain()
    drain(last=True)
    if not bands:
        raise EnsembleEnded(f"bag '{path}': the recording is shorter than one band, {plan.every:g} s; nothing is told")
    flags = follower.ensemble.flagged()
    count = min(band.members for band in bands)
    joined = (np.concatenate([getattr(band, name) for band in bands]) for name in Band._fields[:-1])
    times, low, median, high, nominal = joined
    return Followed(
        (times - begins[0]) * 1e-9,
        low,
        median,
        high,
        nominal,
        np.concatenate(tows),
        np.concatenate([band.values[:count] for band in bands], axis=1),
        np.array(settled),
        lost,
        list(follower.notes),
        [*flags.values(), *of_recorded(follower.seen, flags), *follower.doubts],
        str(damage) if damage else "",
        time.process_time() - used - follower.ensemble.start_cpu,
        follower.ensemble.start_cpu,
        len(bands) * follower.every * follower.tick * 1e-9,
        follower.heard * follower.tick * 1e-9,
    )


def figures(one: Followed, plan: EnsemblePlan) -> dict[str, Any]:
    """For JSON: by figure the mean and largest width of the band, the share of the time that the recorded tow is in
    it, and how far copy 0 is from the recorded tow, of the bands that count; cost."""
    counted = one.counted
    found: dict[str, Any] = {
        "ensemble": plan.ensemble,
        "copies": one.members,
        "seed": plan.seed,
        "level": level_of(one.members),
        "duration_s": float(one.time[-1]),
        "heard_s": one.heard,
        "bands": len(one.time),
        "bands_settled": int(one.settled.sum()),
        "lost": [{"copy": lost.number, "draw": str(lost.draw), "why": lost.why} for lost in one.lost],
        "start_cpu_s": one.start_cpu,
        "cpu_s": one.cpu,
        "cpu_per_copy_and_second": one.cpu / max(one.simulated * (one.members + 1), 1e-9),
        "figures": {},
    }
    inside = (one.tow >= one.low) & (one.tow <= one.high)
    for k, (name, (_, _, _, unit)) in enumerate(FIGURES.items()):
        width = (one.high[:, k] - one.low[:, k])[counted]
        found["figures"][name] = {
            "unit": unit,
            "width_mean": float(width.mean()),
            "width_max": float(width.max()),
            "recorded_inside": float(inside[counted, k].mean()),
            "copy_0_apart_max": float(np.abs(one.nominal[:, k] - one.tow[:, k])[counted].max()),
            "copy_0_apart_rms": float(np.sqrt(np.mean((one.nominal[:, k] - one.tow[:, k])[counted] ** 2))),
        }
    return found


def doubts_of(one: Followed, told: dict[str, Any], plan: EnsemblePlan) -> list[str]:
    """Why the bands cannot be taken as they are, beside flags; told: of `figures`."""
    found = []
    left = one.heard - one.simulated
    if left > max(2.0 * plan.every, LEFT_OUT * one.heard):
        found.append(f"{left:.3g} s of the {one.heard:.4g} s of the tow that were heard are in no band")
    sizes = {unit: np.abs(one.tow[:, [k for k, u in enumerate(UNITS) if u == unit]]).max() for unit in UNITS}
    for name, row in told["figures"].items():
        if row["copy_0_apart_rms"] > max(APART * row["width_mean"], ROUND_OFF * sizes[row["unit"]]):
            found.append(
                f"copy 0 is {row['copy_0_apart_rms']:.3g} {row['unit']} rms from the recorded {name}, more than "
                f"{APART:g} of the width of the band, {row['width_mean']:.3g} {row['unit']}: the copies do not follow "
                "this tow, as of another scene, a value that was changed under way, or ticks too coarse for its motion"
            )
    return found


def write_table(path: Path, one: Followed) -> None:
    """ensemble.csv: time, and of each figure low, median, high, copy 0 and the recorded tow, with units."""
    kinds = ("low", "median", "high", "copy_0", "recorded")
    heads = ["time_s", *(f"{name}_{kind}_{unit}" for name, (*_, unit) in FIGURES.items() for kind in kinds)]
    stack = np.stack([one.low, one.median, one.high, one.nominal, one.tow], axis=-1)
    pairs = zip(one.time.tolist(), stack.reshape(len(stack), -1).tolist(), strict=True)
    write_csv(path, heads, ([f"{second:.3f}", *(f"{value:.6g}" for value in row)] for second, row in pairs))
