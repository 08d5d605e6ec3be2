"""What a sensor tells moved to base_link by roll, pitch and yaw of the same log.

The sensor is at r = R a from base_link, R = Rz(yaw) Ry(pitch) Rx(roll), a its lever arm, and goes faster by
R (omega x a), omega from the rates of change of the angles: rigid-body kinematics.
"""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from scipy.interpolate import CubicSpline

from ....sim.tables.attitude import body_rates, rotation
from ..log import SECOND
from ..own_signals import Signal
from .mapping_file import ANGLES, MOVED, Entry, Frame

EARTH = 6_371_000.0  # m
LONGEST, PERIODS = 1.5, 2.5  # s and periods, the larger counts: over a longer gap of the angles nothing is known
TURN = np.radians(30.0)  # a ship that turns over more has no mean heading along which surge and sway are
Vector = tuple[Frame, np.ndarray, np.ndarray]  # axes, time [n] ns, values [3, n]: of east, north, up or x, y, z


def at_base_link(
    signals: dict[str, tuple[Signal, Entry]],
    velocities: dict[int, Vector],
    remade: Callable[[Vector], dict[str, np.ndarray]],
    missing: list[str],
) -> None:
    """Move the signals of MOVED in place; what was taken as zero, and what it is worth, goes into `assumed`.

    velocities: vectors of which signals were made, by the id of their entry; remade: signals of such a vector.
    """
    angles: dict[str, Signal] = {name: signals[name][0] for name in ANGLES if name in signals}
    middle = float(np.median(signals["latitude"][0].value)) if "latitude" in signals else 0.0
    for name, (signal, entry) in signals.items():
        vector = velocities.get(id(entry))
        if name not in MOVED and vector is None:
            continue
        if entry.lever_arm is None:
            signal.assumed.append(_worth(name, angles))
            continue
        if not any(entry.lever_arm):
            continue
        need = ANGLES if vector is not None else MOVED[name]
        text = _hindrance(name, angles, need)
        if text:
            missing.append(f"{name}: the lever arm is not taken out, {text}")
            signal.assumed.append(missing[-1])
            continue
        kept, away, rate, turn = _moved(signal.time, [angles[one] for one in need], entry.lever_arm, name)
        if not kept.all():
            missing.append(
                f"{name}: {int((~kept).sum())} of {len(kept)} records have no attitude beside them: left out, the "
                f"lever arm cannot be taken out"
            )
        if vector is not None:
            frame, _, values = vector
            there = np.isin(vector[1], signal.time)
            slower = np.einsum("nji,nj->ni", turn, rate) if frame in (Frame.FLU, Frame.FRD) else rate
            value = remade((frame, signal.time, values[:, there] - slower.T))[name]
        else:
            value = signal.value - _put_on(name, away, rate, entry.lever_arm, middle)
        signal.time, signal.value = signal.time[kept], value[kept]


def _put_on(name: str, away: np.ndarray, rate: np.ndarray, arm: tuple[float, float, float], middle: float):
    """What the arm adds to a quantity [n]; middle: latitude [rad] of the log."""
    return {
        "x": away[:, 0],
        "y": away[:, 1],
        "z": away[:, 2],
        "heave": away[:, 2] - arm[2],
        "heave_rate": rate[:, 2],
        "surge": away[:, 0] - arm[0],
        "sway": away[:, 1] - arm[1],
        "latitude": away[:, 1] / EARTH,
        "longitude": away[:, 0] / (EARTH * np.cos(middle)),
    }[name]


def _hindrance(name: str, angles: dict[str, Signal], need: Collection[str]) -> str:
    """Why an arm cannot be taken out, or nothing."""
    lacking = [one for one in need if one not in angles]
    if lacking:
        return f"there is no {' and no '.join(lacking)}"
    if name in ("surge", "sway") and np.ptp(angles["yaw"].value) > TURN:
        return "the ship turns by more than 30 deg, its surge and sway are along no one heading"
    return ""


def _moved(
    time: np.ndarray, angles: list[Signal], arm: tuple[float, float, float], name: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Which times have an attitude; place [n, 3] and velocity of the sensor from base_link in axes of the world, and
    the rotation [n, 3, 3] from the ship's axes to them. angles: roll, pitch and, of MOVED, yaw; name: quantity, surge
    and sway are along the mean yaw."""
    value, rate = np.zeros((len(time), 3)), np.zeros((len(time), 3))
    kept = np.ones(len(time), bool)
    for k, one in enumerate(angles):
        t, at = (one.time - one.time[0]) / SECOND, (time - one.time[0]) / SECOND
        if len(t) < 2:
            kept[:] = False
            continue
        steps = np.diff(t)
        period = float(np.median(steps))
        step = steps[(np.searchsorted(t, at) - 1).clip(0, len(steps) - 1)]
        kept &= (at >= -period) & (at <= t[-1] + period) & (step <= max(LONGEST, PERIODS * period))
        middle = one.value.mean() if k == 2 and name in ("surge", "sway") else 0.0
        curve, at = CubicSpline(t, one.value - middle), at.clip(0.0, t[-1])
        value[:, k], rate[:, k] = curve(at), curve(at, 1)
    turn = rotation(value)
    omega = np.column_stack(body_rates(value[:, 0], value[:, 1], rate.T))
    return kept, turn @ arm, np.einsum("nij,nj->ni", turn, np.cross(omega, arm)), turn


def _turned(angle: Signal) -> float:
    """Deviation of the sine of an angle; 0 for one that stands still but for the last digits."""
    found = float(np.std(np.sin(angle.value)))
    return found if found > 1e-9 else 0.0


def _worth(name: str, angles: dict[str, Signal]) -> str:
    text = f"{name}: lever arm of the sensor taken as zero"
    if name in ("z", "heave"):
        parts = [
            f"{_turned(angles[which]):.2g} m (rms) for each metre {way}"
            for which, way in (("pitch", "forward or aft"), ("roll", "abeam"))
            if which in angles
        ]
        return f"{text}; it is worth {' and '.join(parts)}" if parts else f"{text}; its size is not known"
    what = "position" if name in ("x", "y", "latitude", "longitude") else "motion"
    return f"{text}; the {what} is that of the sensor"
