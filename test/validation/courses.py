"""Courses of a level ship."""

from __future__ import annotations

import numpy as np

from cable_sim_ros import ShipMotion, Simulator

BEGIN = 20.0  # s, of a change


def level(time_ns: int, position, velocity, yaw: float = 0.0, rate: float = 0.0, of=ShipMotion) -> ShipMotion:
    """A sample without roll and pitch; of: the ship, or a vehicle."""
    attitude, turning = (0.0, 0.0, yaw), (0.0, 0.0, rate)
    return of(time_ns=time_ns, position=tuple(position), velocity=tuple(velocity), attitude=attitude, rate=turning)


def sailed(sim: Simulator, speed: float, yaw: float, time: float, seconds: float) -> np.recarray:
    """Tick outputs of a course from 2.2 m/s ahead to ``speed`` [m/s] and ``yaw`` [rad], smoothly in ``time`` [s]."""
    fine = np.arange(0.0, seconds + 12.0, 0.01)
    s = np.clip((fine - BEGIN) / time, 0.0, 1.0)
    s = s * s * (3.0 - 2.0 * s)
    v, psi = 2.2 + s * (speed - 2.2), yaw * s
    velocity = np.column_stack((v * np.cos(psi), v * np.sin(psi), 0.0 * v))
    place, rate, frames = np.cumsum(velocity, axis=0) * 0.01, np.gradient(psi, fine), []
    for i in range(0, len(fine), 50):
        sim.push(level(round(fine[i] * 1e9) + 1, place[i], velocity[i], psi[i], rate[i]))
        if i % 1000 == 50 and i > 50:  # samples reach half a second beyond what is run
            frames.append(sim.run(round(10.0 / sim.scene.solver.tick)))
    return np.concatenate(frames).view(np.recarray)
