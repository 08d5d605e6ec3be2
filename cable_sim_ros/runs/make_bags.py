"""Bags of recorded ship motion: 1 Hz records of two research ships -> sensor_msgs/Imu and nav_msgs/Odometry at 50 Hz.

    cable-sim make-bags --out bags

One C2 cubic spline per degree of freedom goes through the 1 Hz record; attitude, velocity, body rates and specific
force are its analytic values and derivatives, so the two topics agree with each other. The records are NED-like
(surge forward, sway to starboard, heave down, roll + port side up, pitch + bow up, yaw clockwise from north); they
are turned into ENU and x forward, y left, z up here, once. The same data give the same bytes.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt, welch

from ..files import read_text
from ..io.bags.bag import BagError, BagWriter
from ..io.messages.message_classes import Imu, Odometry, imu_bytes, odometry_bytes
from ..io.scenes.document import share_folder
from ..limits import MAX_TOW_SPEED
from ..sim.tables.attitude import body_rates, quaternion, rotation

GRAVITY = 9.81  # m/s^2, as in the scenes
SPEED = 2.2  # m/s, mean speed ahead: that of the tow, in place of the ship's own
RATE = 50  # Hz
CUTOFF = 1.0 / 30.0  # Hz, horizontal displacement and yaw above it are kept
EDGE = 30.0  # s dropped at each end, where the filter is not itself
QUANTUM = 2.0**-34  # values are rounded to 6e-11 SI: coarser steps shake the acceleration between samples
IMU_TOPIC, ODOMETRY_TOPIC = "/tow_sim/imu/data", "/tow_sim/odom"
NAMES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


class Record(NamedTuple):
    """Where a bag comes from."""

    seapath: str  # CSV of the motion sensor, 1 Hz
    derived: str  # CSV of the 6-DOF displacement derived from it, "" = derive it here
    duration: float  # s at most
    ship: str


RECORDS = {
    "nbp1406": Record(
        "nbp1406_seapath330_1hz.csv",
        "nbp1406_6dof_derived_1hz.csv",
        564.0,
        "RVIB Nathaniel B. Palmer, cruise NBP1406, Seapath 330, 2014-08-01, South Atlantic",
    ),
    "lmg1903": Record(
        "lmg1903_seapath_1hz.csv", "", 600.0, "ARSV Laurence M. Gould, cruise LMG1903, Seapath, 2019-03-26, calm water"
    ),
}


class Displacement(NamedTuple):
    """Displacement from the mean track, still NED-like."""

    start: int  # UTC of the first row, ns
    t: np.ndarray  # s, [n]
    motion: np.ndarray  # m and rad, [n, 6]: surge fwd, sway to starboard, heave down, roll, pitch, yaw clockwise
    heading: float  # mean true heading, rad clockwise from north


class Motion(NamedTuple):
    """Ship motion, ENU world and x forward, y left, z up; one row a stamp."""

    time: np.ndarray  # int64 [n], UTC ns
    position: np.ndarray  # m, [n, 3], base_link in odom
    angles: np.ndarray  # rad, [n, 3]: roll, pitch, yaw of Rz Ry Rx
    quaternion: np.ndarray  # [n, 4] x y z w
    velocity: np.ndarray  # m/s, [n, 3], in base_link
    rate: np.ndarray  # rad/s, [n, 3], in base_link
    specific_force: np.ndarray  # m/s^2, [n, 3], in base_link: +g upwards at rest


def read_csv(path: Path) -> tuple[int, dict[str, np.ndarray]]:
    """Columns of a source file and the UTC of t_s = 0 in ns. ValueError if the header does not say it."""
    lines = read_text(path).splitlines()
    comments = [line for line in lines if line.startswith("#")]
    origins = [line.split("t_s:")[1].split("after ")[1].split("Z")[0] for line in comments if "t_s:" in line]
    if not origins:
        raise ValueError(
            f"'{path}' has no comment 't_s: ... after <UTC>Z': the bag would have no time; "
            f"take the file as it is in bags/source"
        )
    whole, _, part = origins[0].partition(".")
    utc = int(datetime.fromisoformat(whole + "+00:00").timestamp()) * 10**9 + int(part.ljust(9, "0") or 0)
    names, *rows = [line.split(",") for line in lines if not line.startswith("#")]
    return utc, dict(zip(names, np.array(rows, float).T, strict=True))


def derive(t: np.ndarray, east: np.ndarray, north: np.ndarray, heading: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """Wave-frequency displacement [n, 6] at the whole seconds after t[0], as the source describes its derived file.

    Horizontal position less a straight line, above 1/30 Hz (4th-order Butterworth, both directions), turned by the
    heading below 1/30 Hz; yaw likewise; attitude [n, 3] (heave down, roll, pitch) as measured. The edges are kept.
    """
    whole = np.arange(int(t[-1] - t[0]) + 1) + t[0]  # stamps may step by 1.01 s: at 6 m/s that would be 6 cm

    def at(values):
        return CubicSpline(t, values)(whole) if np.ptp(np.diff(t)) > 1e-6 else np.array(values, float)

    def wave(values):
        return sosfiltfilt(butter(4, CUTOFF, "highpass", fs=1.0, output="sos"), values)

    def straightened(values):
        return values - np.polynomial.Polynomial.fit(whole, values, 1)(whole)

    east, north, heading = wave(straightened(at(east))), wave(straightened(at(north))), at(np.unwrap(heading))
    yaw = wave(straightened(heading))
    slow = heading - yaw
    surge = north * np.cos(slow) + east * np.sin(slow)
    sway = east * np.cos(slow) - north * np.sin(slow)
    return np.column_stack([surge, sway, *(at(column) for column in attitude.T), yaw])


def displacement(record: Record, data: Path) -> Displacement:
    """The record's displacement from the mean track, from the derived file if there is one."""
    origin, raw = read_csv(data / record.seapath)
    t, heading = raw["t_s"], np.unwrap(raw["heading_rad"])
    if record.derived:
        start, rows = read_csv(data / record.derived)
        seconds = rows["t_s"]
        motion = np.column_stack(
            [rows[name] for name in ("surge_fwd_m", "sway_stbd_m", "heave_down_m", "roll_rad", "pitch_rad", "yaw_rad")]
        )
    else:
        attitude = np.column_stack([raw["heave_down_m"], raw["roll_rad"], raw["pitch_rad"]])
        motion = derive(t, raw["east_m"], raw["north_m"], heading, attitude)[int(EDGE) : -int(EDGE)]
        seconds = np.arange(len(motion), dtype=float)
        start = origin + round((t[0] + EDGE) * 1e9)
    keep = seconds <= record.duration
    since = t + (origin - start) * 1e-9
    mean = heading[(since >= 0.0) & (since <= seconds[keep][-1])].mean()
    return Displacement(start, seconds[keep], motion[keep], float(mean))


def interpolate(moved: Displacement, *, speed: float = SPEED, rate: int = RATE) -> Motion:
    """Motion at `rate` Hz: the displacement about a track at `speed` m/s along the mean heading."""
    step = 10**9 // rate
    time = np.arange(0, round(moved.t[-1] * 1e9) + 1, step)
    surge, sway, heave, roll, pitch, yaw = moved.motion.T
    track = np.pi / 2 - moved.heading  # ENU yaw: from east, anticlockwise
    ahead, left = np.array([np.cos(track), np.sin(track), 0.0]), np.array([-np.sin(track), np.cos(track), 0.0])
    place = np.outer(surge, ahead) - np.outer(sway, left) - np.outer(heave, [0.0, 0.0, 1.0])
    angles = np.column_stack([roll, -pitch, track - yaw])
    spline, t = CubicSpline(moved.t, np.hstack([place, angles])), time * 1e-9
    value, first, second = spline(t), spline(t, 1), spline(t, 2)
    to_body = np.swapaxes(rotation(value[:, 3:]), 1, 2)
    position = value[:, :3] + np.outer(speed * t, ahead)
    force = second[:, :3] + [0.0, 0.0, GRAVITY]
    body_rate = np.column_stack(body_rates(value[:, 3], value[:, 4], first[:, 3:].T))
    return Motion(
        moved.start + time,
        position,
        value[:, 3:],
        quaternion(value[:, 3:]),
        np.einsum("nij,nj->ni", to_body, first[:, :3] + speed * ahead),
        body_rate,
        np.einsum("nij,nj->ni", to_body, force),
    )


def write(path: Path, motion: Motion, custom_data: dict[str, str]) -> None:
    """Write the bag directory."""
    place, turn, velocity, rate, force = (
        (np.round(values / QUANTUM) * QUANTUM + 0.0).tolist()
        for values in (motion.position, motion.quaternion, motion.velocity, motion.rate, motion.specific_force)
    )
    imu, odometry = Imu.__msgtype__, Odometry.__msgtype__
    with BagWriter(path, custom_data=custom_data, chunk_size=2**20) as bag:
        bag.declare(IMU_TOPIC, imu, "sensor")
        bag.declare(ODOMETRY_TOPIC, odometry, "sensor")
        for k, time in enumerate(motion.time.tolist()):
            bag.add(IMU_TOPIC, imu, time, imu_bytes(time, turn[k], rate[k], force[k]))
            bag.add(ODOMETRY_TOPIC, odometry, time, odometry_bytes(time, place[k], turn[k], velocity[k], rate[k]))


def provenance(name: str, moved: Displacement, speed: float) -> dict[str, str]:
    """What the metadata of the bag says about its origin."""
    record = RECORDS[name]
    return {
        "ship": record.ship,
        "source": record.derived or record.seapath,
        "origin": "github.com/OceanDataTools/openrvdas, MIT licence, see bags/source/LICENSE.txt",
        "processing": f"interpolated from 1 Hz to {RATE} Hz by a C2 cubic spline; horizontal displacement and yaw "
        f"above 1/30 Hz; not a recording of an IMU",
        "mean_speed_mps": f"{speed:g} (put in; not the ship's own)",
        "mean_heading_deg": f"{np.degrees(moved.heading) % 360:.2f} (recorded, true)",
        "gravity_mps2": f"{GRAVITY:g}",
        "licence": "MIT",
    }


def metrics(name: str, moved: Displacement) -> list[str]:
    """Rows of the table in bags/README.md: bag, quantity, std, largest, peak period."""
    motion = CubicSpline(moved.t, moved.motion)(np.arange(0, moved.t[-1], 1.0 / RATE))
    rows = []
    for column, label in enumerate(NAMES):
        scale, unit = (1.0, "m") if column < 3 else (np.degrees(1.0), "deg")
        x = motion[:, column] - motion[:, column].mean()
        f, p = welch(x, RATE, nperseg=128 * RATE)
        rows.append(
            f"| {name} | {label} | {x.std() * scale:.2f} {unit} | {abs(x).max() * scale:.2f} {unit} "
            f"| {1 / f[1:][p[1:].argmax()]:.1f} s |"
        )
    return rows


def make_bags(
    out: str | os.PathLike,
    data: str | os.PathLike | None = None,
    *,
    speed: float = SPEED,
    only: Sequence[str] = (),
    force: bool = False,
) -> list[str]:
    """Write the bags into the folder ``out``; returns the rows of the table in bags/README.md.

    data: folder of the source CSV files, None: the shipped ones; speed: mean speed ahead, m/s; only: names of RECORDS,
    none: all; force: replace bags that exist. Raises BagError.
    """
    if not abs(speed) <= MAX_TOW_SPEED:
        raise BagError(
            f"speed = {speed:g} m/s is outside [-{MAX_TOW_SPEED:g}, {MAX_TOW_SPEED:g}] m/s: nothing was written; "
            "give the mean speed ahead"
        )
    rows: list[str] = []
    source = share_folder() / "bags" / "source" if data is None else Path(data)
    chosen = only or tuple(RECORDS)
    for name in chosen:
        if name not in RECORDS:
            raise BagError(f"there is no record '{name}': nothing was written; choose from {', '.join(RECORDS)}")
        if (Path(out) / name).exists() and not force:
            raise BagError(f"'{Path(out) / name}' exists already: nothing was written; give --force to replace it")
    for name in chosen:
        path = Path(out) / name
        try:
            moved = displacement(RECORDS[name], source)
        except (OSError, ValueError) as error:
            raise BagError(f"{error}; '{name}' was not made; give the folder of the source files with --data") from None
        if path.exists():
            shutil.rmtree(path)
        write(path, interpolate(moved, speed=speed), provenance(name, moved, speed))
        rows += metrics(name, moved)
    return rows
