"""The smallest winch that suffices for a job: its limits raised until none is reached, then the peaks of the job."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...errors import RunError
from ...physics.winch_drive import DriveModel
from ...runs.result import Run
from ...sim.scene import Scene
from .plan import Need, lay_gear, needs_of

SEED = "water.waves.seed"
ROUNDS = 6  # of raised limits
MORE = 1.5  # times a limit that held the winch
OVER = 1.05  # times a peak that is above its limit
Simulate = Callable[[Mapping[str, Any]], Run]


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
    out = {key: OVER * size for key, size in sizes.items() if size > 1.0 and np.isfinite(size)}
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


def _value(scene: Scene, key: str) -> Any:
    block, name = key.split(".")
    return getattr(getattr(scene, block), name)


def _scaled(scene: Scene, key: str, factor: float) -> Any:
    value = _value(scene, key)
    return [factor * one for one in value] if key == "drive.curve_pull" else factor * value


def _limit(scene: Scene, key: str, sizes: Mapping[int, Mapping[str, float]]) -> dict[str, Any]:
    seed = max(sizes, key=lambda one: sizes[one][key])
    return {"key": key, "least": _scaled(scene, key, sizes[seed][key]), "seed": seed}
