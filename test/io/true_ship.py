"""A ship in three waves on any course, and what its IMU and odometry send: exact, or with something wrong with it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import radians

import numpy as np
from scipy.signal import detrend
from test_motion import T0, S, imu, odometry

from cable_sim_ros.sim.tables.attitude import angles_of, body_rates, quaternion, rotation

G = 9.81
WAVES = ((0.6, 1.0, 0.0), (0.95, 0.4, 1.0), (1.5, 0.12, 2.0))  # rad/s, share, phase
SIZE = np.array([0.5, 0.4, 1.1, radians(3.0), radians(2.0), radians(1.0)])  # of sea 1
IMU, ODOMETRY = imu(T0), odometry(T0)


@dataclass(frozen=True)
class Motion:
    """n samples; world: ENU; body: x forward, y left, z up."""

    t: np.ndarray  # s
    position: np.ndarray
    turn: np.ndarray  # [n, 3, 3] body to world
    velocity: np.ndarray  # body
    rate: np.ndarray  # body
    force: np.ndarray  # body


def sail(seconds, hertz=50.0, sea=1.0, heading=0.7, speed=2.2, turning=0.0, height=0.0, begin=0.0, size=SIZE):
    """The true motion of base_link. heading: rad, speed: m/s, turning: rad/s."""
    t = begin + np.arange(round(seconds * hertz)) / hertz
    x, v, a = (np.zeros((len(t), 6)) for _ in range(3))
    for i in range(6):
        for w, fraction, phase in WAVES:
            angle, maximum = w * t + phase + 1.3 * i, sea * size[i] * fraction
            x[:, i] += maximum * np.sin(angle)
            v[:, i] += maximum * w * np.cos(angle)
            a[:, i] -= maximum * w * w * np.sin(angle)
    course = heading + turning * t
    ahead = np.stack([np.cos(course), np.sin(course)], axis=1)
    if turning:
        x[:, 0] += speed / turning * (np.sin(course) - np.sin(heading))
        x[:, 1] -= speed / turning * (np.cos(course) - np.cos(heading))
    else:
        x[:, :2] += speed * t[:, None] * ahead
    v[:, :2] += speed * ahead
    a[:, :2] += speed * turning * np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    x[:, 2] += height
    x[:, 5] += course
    v[:, 5] += turning
    turn = rotation(x[:, 3:])
    back = turn.transpose(0, 2, 1)
    rate = np.stack(body_rates(x[:, 3], x[:, 4], v[:, 3:].T), axis=1)
    body = np.einsum("nij,nj->ni", back, v[:, :3])
    force = np.einsum("nij,nj->ni", back, a[:, :3] + [0, 0, G])
    return Motion(t, x[:, :3], turn, body, rate, force)


def rotor(turn):
    """x y z w [n, 4] of rotations [n, 3, 3]."""
    roll, yaw = np.arctan2(turn[:, 2, 1], turn[:, 2, 2]), np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
    return quaternion(np.stack([roll, -np.arcsin(np.clip(turn[:, 2, 0], -1, 1)), yaw], axis=1))


def stamped(template, size, stamps, numbers):
    """Messages: a serialised one with its stamp and doubles replaced."""
    head, name = template[:4], template[12:-size]
    for stamp, row in zip(stamps, numbers):
        yield head + np.array([stamp // S, stamp % S], "<u4").tobytes() + name + row.astype("<f8").tobytes()


def imu_messages(m: Motion):
    d = np.zeros((len(m.t), 37))
    d[:, :4], d[:, 13:16], d[:, 25:28] = rotor(m.turn), m.rate, m.force
    return list(stamped(IMU, 296, stamps(m), d))


def odometry_messages(m: Motion):
    d = np.zeros((len(m.t), 85))
    d[:, :3], d[:, 3:7], d[:, 43:46], d[:, 46:49] = m.position, rotor(m.turn), m.velocity, m.rate
    return list(stamped(ODOMETRY, 680, stamps(m), d))


def stamps(m: Motion):
    return [T0 + round(t * S) for t in m.t.tolist()]


SWAP = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])  # ENU to NED and back
FLIP = np.diag([1.0, -1, -1])


def ned(m: Motion) -> Motion:
    """The same motion in north-east-down axes."""
    turn = SWAP @ m.turn @ FLIP
    return replace(
        m, position=m.position @ SWAP, turn=turn, velocity=m.velocity @ FLIP, rate=m.rate @ FLIP, force=m.force @ FLIP
    )


def world(m: Motion, vector):
    return np.einsum("nij,nj->ni", m.turn, vector)


def noisy(m: Motion, fraction: float, seed: int) -> Motion:
    """Normal noise of a share of what the waves do to each quantity, on everything that is sent."""
    random = np.random.default_rng(seed)

    def add(x):
        return x + fraction * detrend(x, axis=0).std(axis=0) * random.standard_normal(x.shape)

    angles = np.unwrap(np.array([angles_of(*q) for q in rotor(m.turn).tolist()]), axis=0)
    return replace(
        m,
        position=add(m.position),
        turn=rotation(add(angles)),
        velocity=add(m.velocity),
        rate=add(m.rate),
        force=add(m.force),
    )
