"""What a job needs of its winch: peaks of a run with their times, beside what the winch of its scene has; and the
smallest that suffices: its limits raised until none is reached, then the peaks of the job.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ...errors import RunError
from ...physics.winch_drive import DriveModel
from ...runs.passage import EVENTS, events
from ...runs.summary import Run, since_first, tick_length
from ...sim.layout import layout_of
from ...sim.live_parameters import value_of
from ...sim.rules.watch import breaking_load, working_load
from ...sim.scene import Scene
from ...sim.statics.route import DRUM_RESERVE

SEED = "water.waves.seed"
ROUNDS = 6  # of raised limits
MORE = 1.5  # times a limit that held the winch
BEYOND = 1.05  # times a peak that is above its limit
Simulate = Callable[[Mapping[str, Any]], Run]


class Need(NamedTuple):
    """One row: what was needed, when, and what there is (None: nothing that limits it); held: share of the run in
    which the limit held the winch though more was asked for."""

    name: str
    unit: str
    needed: float
    at_s: float
    has: float | None
    meaning: str
    held: float = 0.0
    floor: bool = False  # has is the least that may be, not the largest

    @property
    def short(self) -> str:
        """Why the winch does not suffice here, "" where it does."""
        if self.name == "least_tension":
            return "least_tension: the cable goes slack" if self.needed <= 0.0 else ""
        if self.floor and self.has is not None and self.needed < self.has:
            what = f"{self.name} {self.needed:.4g} {self.unit} at {self.at_s:.5g} s"
            return f"{what}, below {self.has:.4g} {self.unit}: it may go slack in another wave"
        if not self.floor and self.has is not None and self.needed > self.has:
            off = 100.0 * (self.has - self.needed) / self.has if self.has else -100.0
            what = f"{self.name} {self.needed:.4g} {self.unit} needed at {self.at_s:.5g} s"
            return f"{what}, has {self.has:.4g} ({off:.2g} %)"
        if self.held > 0.0 and self.name in JUDGED:
            return f"{self.name} saturated in {100.0 * self.held:.3g} % of the run: more was asked for than was given"
        return ""

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        margin = None if self.has is None else (self.has - self.needed) * (-1.0 if self.floor else 1.0)
        return {
            "need": self.name,
            "unit": self.unit,
            "needed": self.needed,
            "at_s": self.at_s,
            "has": self.has,
            "margin": margin,
            "margin_share": None if margin is None or not self.has else margin / self.has,
            "held_share": self.held,
            "meaning": self.meaning,
        }


STAYS = 0.1  # of the weight in water: DNV-RP-H103 (2011) 4.4.4, the sea takes 0.9 of the least static weight at most
LIMITS = {"splash_tension_least": "; has, at least: a tenth of the net weight of the towbody, DNV-RP-H103 4.4.4"}
# name, unit, meaning; docs/json.md has the same table
NEEDS = (
    ("rate", "m/s", "largest speed of the cable, either way; has: winch.max_rate"),
    ("acceleration", "m/s^2", "largest acceleration of the cable; has: winch.max_acceleration; of a motor none"),
    ("line_pull", "N", "largest tension at the drum; has: drive.curve_pull at rest"),
    ("torque", "N m", "of the motor about the drum, where least of it is left; has: its curve at that speed"),
    ("power", "W", "largest power into the cable; has: the largest of curve and drive.max_power"),
    ("power_back", "W", "largest power out of the cable, to be braked or fed back; has: as power"),
    ("brake_load", "N", "largest tension at the drum, as the set brake would hold it; has: drive.brake_pull"),
    ("cable_length", "m", "largest scope; has: all but what stays on the drum"),
    ("working_load", "N", "largest tension along the cable; has: the working load of rules"),
    ("breaking_load", "N", "the same; has: the breaking load"),
    ("least_tension", "N", "least tension along the cable, which must not be slack"),
    *((name, unit, meaning + LIMITS.get(name, "")) for name, unit, meaning in EVENTS),
)
MEANING = {name: (unit, meaning) for name, unit, meaning in NEEDS}
SERVO_NOTE = (
    "drive.model is {model}: the drum follows whatever the cable pulls, torque and power are what the cable took; a "
    "motor needs more, for the inertia of its drum. Give drive.model: motor"
)
HELD_NOTE = "a limit held the winch: what it gave is not all that was asked for ({names})"
TOP_NOTE = "the winch ran at winch.max_rate in {:.3g} % of the run while no more was asked: top rate, or it caught up"
JUDGED = ("rate", "torque")  # of what a limit holds; a step of a commanded rate asks for any acceleration
OVER = 1e-3  # of winch.max_rate: a set-point that moves faster asks for more


class _Peaks:
    """Largest and least of fields of a run, with their times."""

    def __init__(self, frames: np.recarray) -> None:
        self.frames = frames
        self.times = since_first(frames) * 1e-9 + tick_length(frames)  # a tick output is the end of its tick

    def need(
        self, name: str, values: np.ndarray, has: Any = None, where: np.ndarray | None = None, held: float = 0.0
    ) -> Need | None:
        """Row of the tick with the largest value, or of the largest of ``where``; has: a number, or one a tick. None
        where the tick outputs do not know it."""
        decide = np.asarray(values if where is None else where, float)
        known = np.isfinite(decide) & np.isfinite(values)
        if not known.any():
            return None
        at = int(np.argmax(np.where(known, decide, -np.inf)))
        limit = None if has is None else float(np.broadcast_to(has, len(values))[at])
        unit, meaning = MEANING[name]
        return Need(name, unit, float(values[at]), round(float(self.times[at]), 9), limit, meaning, held)


def needs_of(frames: np.recarray, scene: Scene) -> list[Need]:
    """What the winch of a scene needed in a run, over all its tick outputs."""
    peaks, drive, winch = _Peaks(frames), scene.drive, scene.winch
    motor = drive.model is DriveModel.MOTOR
    gear = lay_gear(frames, scene)
    lay = (winch.drum_radius + 0.5 * scene.cable.diameter) / gear
    speed = np.abs(frames["payout_rate"])
    over = _mean(saturated(frames, winch.max_rate))
    rows = [
        peaks.need("rate", frames["payout_rate_tick_max"], winch.max_rate, held=over),
        peaks.need(
            "acceleration",
            frames["payout_acceleration_tick_max"],
            None if motor else winch.max_acceleration,
            held=0.0 if motor else _mean(frames["acceleration_limited"]),
        ),
    ]
    pull = frames["tension_drum_tick_max"]
    if motor:
        can = gear * motor_pull(scene, speed * gear)
        given = np.abs(frames["motor_pull"])
        most = most_power(scene)
        rows += [
            peaks.need("line_pull", pull, gear * drive.curve_pull[0], where=pull - gear * drive.curve_pull[0]),
            peaks.need("torque", given * lay, can * lay, where=given - can, held=_mean(frames["motor_limited"])),
            peaks.need("power", frames["motor_power"], most),
            peaks.need("power_back", -frames["motor_power"], most),
            peaks.need("brake_load", pull, gear * drive.brake_pull, where=pull - gear * drive.brake_pull),
        ]
    else:
        rows += [
            peaks.need("line_pull", pull),
            peaks.need("torque", frames["drum_torque"]),
            peaks.need("power", frames["winch_power_tick_max"]),
            peaks.need("power_back", -frames["winch_power_tick_min"]),
            peaks.need("brake_load", pull),
        ]
    stays = winch.dead_length + DRUM_RESERVE * layout_of(scene).route.drum
    rows.append(
        peaks.need(
            "cable_length",
            frames["scope"],
            frames["scope"] + frames["cable_on_drum"] - stays,
            held=_mean(frames["travel_limited"]),
        )
    )
    if (load := working_load(scene)) is not None:
        rows.append(peaks.need("working_load", frames["tension_most"], load))
    rows.append(peaks.need("breaking_load", frames["tension_most"], breaking_load(scene)))
    least = peaks.need("least_tension", -frames["tension_least"])
    rows.append(None if least is None else least._replace(needed=-least.needed + 0.0))
    for event in events(frames).values():
        floor = event.name == "splash_tension_least"
        has = STAYS * scene.towbody.net_weight if floor and scene.towbody.net_weight > 0.0 else None
        unit, meaning = MEANING[event.name]
        rows.append(Need(event.name, unit, event.value, event.at_s, has, meaning, floor=floor))
    return [row for row in rows if row is not None]


def lay_gear(frames: np.recarray, scene: Scene) -> np.ndarray:
    """Radius of the first layer, for which the drive is given, over that of the layer that runs off, each tick."""
    radius = scene.winch.drum_radius + 0.5 * scene.cable.diameter
    return radius / np.where(np.isfinite(frames["drum_lay_radius"]), frames["drum_lay_radius"], radius)


def saturated(frames: np.recarray, most: float) -> np.ndarray:
    """Share of each tick in which the largest rate [m/s] held a winch of which more was asked, or that catches up with
    that; one that is commanded to run at its largest rate is not saturated."""
    limited = np.nan_to_num(frames["rate_limited"])
    asked = np.abs(np.diff(frames["payout_setpoint"], prepend=frames["payout_setpoint"][:1])) / tick_length(frames)
    more = (asked > (1.0 + OVER) * most) | (frames["command_limited"] > 0.0)
    episode = np.cumsum(np.diff((limited > 0.0).astype(int), prepend=0) == 1)
    return np.where(np.isin(episode, episode[more & (limited > 0.0)]), limited, 0.0)


def motor_pull(scene: Scene, speed: np.ndarray) -> np.ndarray:
    """What the motor can pull [N] on the first layer at speeds [m/s] of the cable there."""
    drive = scene.drive
    pull = np.interp(speed, drive.curve_speed, drive.curve_pull, right=0.0)
    return pull if drive.max_power is None else np.minimum(pull, drive.max_power / np.maximum(speed, 1e-12))


def most_power(scene: Scene) -> float:
    """Largest power of the motor [W], by its curve and drive.max_power."""
    drive, most = scene.drive, 0.0
    ends = list(zip(drive.curve_speed, drive.curve_pull, strict=True))
    for (v0, f0), (v1, f1) in zip(ends, ends[1:]):
        slope = (f1 - f0) / (v1 - v0)
        tops = [v0, v1] + ([0.5 * (v0 - f0 / slope)] if slope < 0.0 else [])  # of v (f0 + slope (v - v0))
        most = max([most, *(v * (f0 + slope * (v - v0)) for v in tops if v0 <= v <= v1)])
    return most if drive.max_power is None else min(most, drive.max_power)


def plan_of(frames: np.recarray, scene: Scene, metrics: Mapping[str, Any]) -> dict[str, Any]:
    """The plan as JSON: rows, notes, and from ``metrics`` of the run its rules and verdict."""
    rows = needs_of(frames, scene)
    notes = []
    if scene.drive.model is not DriveModel.MOTOR:
        notes.append(SERVO_NOTE.format(model=scene.drive.model.value))
    top = _mean(frames["rate_limited"]) - _mean(saturated(frames, scene.winch.max_rate))
    if top > 0.0:
        notes.append(TOP_NOTE.format(100.0 * top))
    held = [f"{row.name} {100.0 * row.held:.3g} % of the run" for row in rows if row.held > 0.0]
    if held:
        notes.append(HELD_NOTE.format(names=", ".join(held)))
    kept = ("scene", "motion", "winch", "setpoint", "duration_s", "rao", "rules", "verdict")
    return {
        "plan": [row.as_dict() for row in rows],
        "sufficient": not any(row.short for row in rows),
        "short": [row.short for row in rows if row.short],
        "notes": notes,
        **{key: metrics[key] for key in kept if key in metrics},
    }


def _mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else 0.0


class NoWinch(RunError):
    """No winch was found that suffices, or a run of the search failed."""


def sizes_of(run: Run) -> dict[str, float]:
    """What each limit of the winch must be, over what it is, by its key: of a run in which none of them held."""
    frames, scene = run.frames, run.scene
    assert scene is not None
    rows = {row.name: row for row in needs_of(frames, scene)}
    drive = scene.drive
    found = {"winch.max_rate": _over(rows["rate"])}
    if drive.model is not DriveModel.MOTOR:
        return found | {"winch.max_acceleration": _over(rows["acceleration"])}
    gear = lay_gear(frames, scene)
    curve = gear * np.interp(np.abs(frames["payout_rate"]) * gear, drive.curve_speed, drive.curve_pull, right=0.0)
    pull = np.abs(frames["motor_pull"])
    used = np.divide(pull, curve, out=np.where(pull > 0.0, np.inf, 0.0), where=curve > 0.0)
    found["drive.curve_pull"] = max(float(np.nanmax(used)), _over(rows["line_pull"]))
    if drive.max_power is not None:
        found["drive.max_power"] = max(rows["power"].needed, rows["power_back"].needed) / drive.max_power
    if drive.brake_pull > 0.0:
        found["drive.brake_pull"] = _over(rows["brake_load"])
    return found


def _over(row: Need) -> float:
    return row.needed / row.has if row.has else np.inf if row.needed > 0.0 else 0.0


def _raised(run: Run, sizes: Mapping[str, float]) -> dict[str, float]:
    """Factors on the limits that held the winch, or that a peak is above."""
    assert run.scene is not None
    held = {row.name for row in needs_of(run.frames, run.scene) if row.held > 0.0 and row.short}
    keys = {"rate": ("winch.max_rate",), "torque": ("drive.curve_pull", "drive.max_power")}
    out = {key: BEYOND * size for key, size in sizes.items() if size > 1.0 and np.isfinite(size)}
    for name in held & keys.keys():
        out |= {key: max(MORE, out.get(key, 0.0)) for key in keys[name] if key in sizes}
    return out


def smallest(simulate: Simulate, scene: Scene, seeds: int) -> dict[str, Any]:
    """The smallest winch for a job in so many seeds of the sea, from that of the scene on.

    simulate: a run of the job with other values by key. Returns the limits by key with what decided each, the seeds,
    what the winch of the scene lacks by seed, and the number of runs. Raises NoWinch.
    """
    first = scene.water.waves.seed
    names = [first + k for k in range(seeds)]
    values: dict[str, Any] = {}
    lacks: dict[int, list[str]] = {}
    for round_ in range(ROUNDS):
        raised: dict[str, float] = {}
        sizes: dict[int, dict[str, float]] = {}
        for seed in names:
            run = simulate(values | ({SEED: seed} if seeds > 1 else {}))
            if run.scene is None or not len(run.frames) or run.problem:
                raise NoWinch(f"seed {seed}: the run failed ({run.problem}), so no smallest winch is known")
            scene, sizes[seed] = run.scene, sizes_of(run)
            if not round_:
                lacks[seed] = [row.short for row in needs_of(run.frames, scene) if row.short]
            for key, factor in _raised(run, sizes[seed]).items():
                raised[key] = max(factor, raised.get(key, 1.0))
        if not raised:
            return {
                "seeds": names,
                "runs": (round_ + 1) * seeds,
                "lacks": {str(seed): texts for seed, texts in lacks.items() if texts},
                "limits": [_limit(scene, key, sizes) for key in sizes[first]]
                + [{"key": key, "least": values[key], "seed": first} for key in values.keys() - sizes[first].keys()],
            }
        values |= {key: _scaled(scene, key, factor) for key, factor in raised.items()}
        ends = scene.drive.curve_speed[-1] if scene.drive.model is DriveModel.MOTOR else np.inf
        if (stretch := values.get("winch.max_rate", 0.0) / ends) > 1.0:  # a motor has pull up to its largest rate
            values["drive.curve_speed"] = [stretch * one for one in scene.drive.curve_speed]
    told = ", ".join(f"{key} = {value}" for key, value in values.items())
    raise NoWinch(f"no winch was found that suffices, up to {told}: the job asks for more, or the cable decides")


def _scaled(scene: Scene, key: str, factor: float) -> Any:
    value = value_of(scene, key)
    return [factor * one for one in value] if key == "drive.curve_pull" else factor * value


def _limit(scene: Scene, key: str, sizes: Mapping[int, Mapping[str, float]]) -> dict[str, Any]:
    seed = max(sizes, key=lambda one: sizes[one][key])
    return {"key": key, "least": _scaled(scene, key, sizes[seed][key]), "seed": seed}
