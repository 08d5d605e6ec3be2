"""Heave, height and position of a sensor moved to base_link by roll, pitch and yaw."""

from __future__ import annotations

import numpy as np

from ....sim.tables.attitude import rotation
from ..signals import Signal
from .mapping_file import Entry

MOVED = ("x", "y", "z", "heave", "latitude", "longitude")
ANGLES = ("roll", "pitch", "yaw")
EARTH = 6_371_000.0  # m


def at_base_link(signals: dict[str, tuple[Signal, Entry]], missing: list[str]) -> None:
    """Move the signals of MOVED in place; what was taken as zero, and what it is worth, goes into `assumed`."""
    angles: dict[str, Signal] = {name: signals[name][0] for name in ANGLES if name in signals}
    for name in MOVED:
        if name not in signals:
            continue
        signal, entry = signals[name]
        if entry.lever_arm is None:
            signal.assumed.append(_worth(name, angles))
            continue
        if not any(entry.lever_arm):
            continue
        need = ("roll", "pitch") if name in ("z", "heave") else ("roll", "pitch", "yaw")
        lacking = [one for one in need if one not in angles]
        if lacking:
            text = f"{name}: the lever arm is not taken out, there is no {' and no '.join(lacking)}"
            missing.append(text)
            signal.assumed.append(text)
            continue
        if name in ("latitude", "longitude") and "latitude" not in signals:
            continue
        away = _away(signal.time, angles, np.array(entry.lever_arm))
        if name == "z":
            signal.value = signal.value - away[:, 2]
        elif name == "heave":
            signal.value = signal.value - (away[:, 2] - entry.lever_arm[2])
        elif name in ("x", "y"):
            signal.value = signal.value - away[:, 0 if name == "x" else 1]
        elif name == "latitude":
            signal.value = signal.value - away[:, 1] / EARTH
        else:
            latitude = signals["latitude"][0]
            at = float(np.median(latitude.value))
            signal.value = signal.value - away[:, 0] / (EARTH * np.cos(at))


def _away(time: np.ndarray, angles: dict[str, Signal], arm: np.ndarray) -> np.ndarray:
    """Place of the sensor from base_link in axes of the world [n, 3]."""
    turned = np.zeros((len(time), 3))
    for k, name in enumerate(ANGLES):
        if name in angles:
            one = angles[name]
            origin = one.time[0]
            turned[:, k] = np.interp((time - origin).astype(float), (one.time - origin).astype(float), one.value)
    return rotation(turned) @ arm


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
    return f"{text}; the position is that of the sensor"
