"""The mean speed and heading of recorded motion beside those of the scene: a tow that is another one is said so. And is
pitch positive bow down, as the axes here have it? The surge says so."""

from __future__ import annotations

import math
import warnings

import numpy as np

from ..io.scenes.load import SceneWarning
from ..sim.checks.deviation_checks import PITCHED_OVER, pitch_against
from ..sim.scene import Scene
from ..sim.tables.attitude import angles_of
from ..sim.tables.current import HEADING_WITHIN, turned_current
from ..sim.verdict import Reason, check

MEAN_OVER = 30.0  # s, at least, for a mean of the motion: less is the waves'
SPEED_WITHIN = 0.05, 0.1  # of the speed of the scene, m/s, without a word; the larger one counts
DOUBTFUL = 2.0  # times these bounds: a fifth more drag, a tow to one side; another tow than that of the scene


def angles_along(turns: np.ndarray) -> np.ndarray:
    """Roll, pitch and yaw [3, ...] of unit quaternions [..., 4], x y z w; numpy's own depend on the processor."""
    turns = np.asarray(turns, float)
    return np.array([angles_of(*turn) for turn in turns.reshape(-1, 4).tolist()]).T.reshape(3, *turns.shape[:-1])


def before(scene: Scene, heading: float | None) -> None:
    """Warn, before the start, of a current that the motion's heading [rad] turns; None: the scene's heading.

    It makes no run doubtful: a current that stands in the world is that of nature where the heading is the true one.
    """
    turned = "" if heading is None else turned_current(scene, heading)
    if turned:
        warnings.warn(f"{scene.name}: {turned}", SceneWarning, stacklevel=6)


def look(scene: Scene, heading: float | None, frames: np.recarray) -> list[Reason]:
    """Warn where the motion of a run makes another tow of the scene; the reasons that make the run doubtful.

    heading: of the start, rad; None: the scene's.
    """
    off, times = off_track(scene, heading, frames)
    if off:
        warnings.warn(f"{scene.name}: {off}", SceneWarning, stacklevel=4)
    return [check("MEAN_TRACK", off)] if times > DOUBTFUL else []


def off_track(scene: Scene, heading: float | None, frames: np.recarray) -> tuple[str, float]:
    """How ship and mean track go apart: the set-point laws take the difference for motion to compensate; "" if not.

    heading: of the start, rad; None: the scene's. The take-up after the start is left out. Returns the text and by how
    many times the bounds they go apart.
    """
    tick, ship = scene.solver.tick, scene.ship
    kept = frames[round(ship.start_blend / tick) :]
    seconds = (len(kept) - 1) * tick
    if seconds < MEAN_OVER:
        return "", 0.0
    yaw = angles_along(kept["ship_quaternion"])[2]
    ahead = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    speed = float(np.sum(np.diff(kept["ship_position"][:, :2], axis=0) * ahead[1:])) / seconds
    begun = math.radians(ship.heading_deg) if heading is None else heading
    mean = math.atan2(ahead[:, 1].mean(), ahead[:, 0].mean())
    turned = math.degrees(math.remainder(mean - begun, 2.0 * math.pi))
    found, ways = [], []
    faster = abs(speed - ship.tow_speed) / max(SPEED_WITHIN[0] * abs(ship.tow_speed), SPEED_WITHIN[1])
    if faster > 1.0:
        found.append(f"mean speed of the motion is {speed:.3g} m/s, ship.tow_speed is {ship.tow_speed:.3g} m/s")
        ways.append(
            f"Set ship.tow_speed to {speed:.3g} m/s" if speed > 0.0 else "Give motion that goes ahead along its heading"
        )
    if abs(turned) > HEADING_WITHIN:
        began = math.degrees(begun)
        found.append(f"mean heading of the motion is {began + turned:.4g} deg, that of the start is {began:.4g} deg")
        ways.append("Give motion along one heading")
    if not found:
        return "", 0.0
    return (
        f"{', '.join(found)}: the ship follows the motion, but the static start and the mean track of the set-point "
        f"laws begin with the second number. {'. '.join(ways)}",
        max(faster, abs(turned) / HEADING_WITHIN),
    )


def pitch_sign(frames: np.recarray) -> list[Reason]:
    """A reason to doubt the run whose pitch goes against its surge; none where one of them is missing or too small.

    A ship on a long wave slides down its slope: bow up is pulled astern, bow down ahead, with a share of g times the
    angle. Between the acceleration ahead and the pitch (positive bow down, x forward, z up) recorded ships have
    correlations of +0.90 (NBP1406) and +0.60 (LMG1903, calm); a pitch that is positive bow up, as most sensors
    count it, has their negatives.
    """
    time = (frames["time"] - frames["time"][0]) * 1e-9 if len(frames) else np.zeros(0)
    if len(time) < 10 or time[-1] < PITCHED_OVER:
        return []
    _, pitch, yaw = angles_along(np.asarray(frames["ship_quaternion"], float))
    pitch = np.degrees(pitch)
    velocity = np.asarray(frames["ship_velocity"], float)
    surge = np.gradient(velocity[:, 0] * np.cos(yaw) + velocity[:, 1] * np.sin(yaw), time)
    with np.errstate(invalid="ignore", divide="ignore"):
        agree = float(np.corrcoef(surge, pitch)[0, 1])
    return list(pitch_against(float(pitch.std()), float(surge.std()), agree))
