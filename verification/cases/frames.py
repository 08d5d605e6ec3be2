"""Tick outputs: the motion of a ship carried to a point of its hull."""

from __future__ import annotations

import re

import numpy as np

from cable_sim_ros.physics.inputs import EPOCH, MOTION_COLUMNS, make_inputs, push_motion
from cable_sim_ros.physics.ship import MOTION, Ship, evaluate, hull_point, quaternion, ship_ring
from cable_sim_ros.physics.state import MEMORY
from cable_sim_ros.sim.loop import look

from .family import Case, CaseError, Level, Values, family
from .wet import NUMBER

COORDINATES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
RATE = 100  # samples/s of an odometry, in real time
BEFORE, AFTER = 1.0, 1.0  # s of samples around the instant


def harmonics(case: Case, t: float) -> np.record:
    """Coordinates, rates and accelerations at time t, a MOTION record. Raises CaseError."""
    convention = re.sub(r"\s", "", str(case.inputs.get("convention", "x = a sin(w t + ph)"))).lower()
    shift = {"sin": 0.0, "cos": 0.5 * np.pi}.get(next(iter(re.findall(r"sin|cos", convention)), ""))
    if shift is None:
        raise CaseError(
            f"{case.path}: inputs.convention is not understood ('x = a sin(w t + ph)' or with cos); "
            "the case was not run"
        )
    out = np.zeros(1, MOTION).view(np.recarray)[0]
    for i, name in enumerate(COORDINATES):
        parts = case.inputs["harmonics"].get(name, [])
        for part in parts if isinstance(parts, list) else [parts]:
            try:
                a, w, ph = (float(part[k]) for k in ("amplitude", "omega_rad_s", "phase_rad"))
            except (TypeError, KeyError, ValueError):
                raise CaseError(
                    f"{case.path}: inputs.harmonics.{name} needs amplitude, omega_rad_s and phase_rad; the "
                    "case was not run"
                ) from None
            x = w * t + ph + shift
            out.coord[i] += a * np.sin(x)
            out.rate[i] += a * w * np.cos(x)
            out.accel[i] -= a * w * w * np.sin(x)
    return out


def from_samples(case: Case, t: float) -> np.record:
    """The same, as the node has it: odometry samples around t, through the product's interpolation."""
    inputs, memory, epoch = make_inputs(), np.zeros(1, MEMORY).view(np.recarray)[0], 1.0
    memory.ship.epoch = epoch
    first = int(np.floor((t - BEFORE) * RATE))
    origin = int(first / RATE * 1e9)
    for i in range(first, first + int((BEFORE + AFTER) * RATE)):
        at = (i + 0.5) / RATE  # the instants asked for lie between two samples
        row = np.zeros(MOTION_COLUMNS)
        motion = harmonics(case, at)
        row[:6], row[6:12], row[EPOCH] = motion.coord, motion.rate, epoch
        push_motion(inputs, int(round(at * 1e9)) - origin, row)
    look(inputs)
    now = int(round(t * 1e9)) - origin
    evaluate(now, ship_ring(inputs), memory.ship, memory, Ship().stale_decay)
    return memory.ship.motion


@family(
    "ship point",
    "offset_body_m harmonics",
    how=f"the harmonics through the product's pose and point kinematics; in real time samples at {RATE} Hz with "
    "the instant half-way between two of them, through the product's interpolation",
)
def ship_point(case: Case, level: Level) -> Values:
    """Pose and motion of a point of the ship in six-degree-of-freedom harmonics."""
    offset = tuple(float(x) for x in case.inputs["offset_body_m"])
    still, of = (0.0, 0.0, 0.0), {}
    for name, m in case.asked(rf"(.*?)\b(position|velocity|acceleration|quaternion)\b.* at ({NUMBER}) s(?: .*)?"):
        t = float(m[3])
        motion = from_samples(case, t) if level.realtime else harmonics(case, t)
        if m[2] == "quaternion":
            of[name] = [float(y) for y in quaternion(motion.coord)]
        else:
            point = hull_point(motion, offset, still, still)
            of[name] = [float(y) for y in point[("position", "velocity", "acceleration").index(m[2])]]
    return Values(of, 0, 1.0 / RATE if level.realtime else 0.0)
