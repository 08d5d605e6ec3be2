"""Tows for the stress tests: scenes from the shipped one, and ship motion as exact analytic samples."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.physics.inputs import EPOCH, MOTION_COLUMNS, SOURCE, push_command, push_motion
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator

from ..shipped import scene_with

RATE = 50.0  # Hz of the motion samples; between them the ship moves on cubics of position and rate
CHUNK = 10.0  # s of motion pushed at a time: the ring of inputs holds 1024 samples


HELD = {"setpoint__algorithm": "hold", "solver__tick": 0.02}


def shipped(name: str = "full_scale", **values) -> Scene:
    """A shipped scene with other values, ``__`` in a key standing for the dot."""
    return scene_with(name, {key.replace("__", "."): value for key, value in values.items()})


def held(name: str = "full_scale", **values) -> Scene:
    """The shipped tow with its winch held, 20 ms ticks."""
    return shipped(name, **HELD | values)


def reel(sim: Simulator, rate: float, seconds: float, sea: Sea | None = None) -> np.recarray:
    """Command ``rate`` [m/s, positive out] and run on for ``seconds``; the scene's time-out must be longer."""
    push_command(sim.inputs, int(sim.state.now.time.now) + 1, np.nan, rate)
    return sail(sim, sea, seconds)


def weights(sim: Simulator) -> float:
    """Weight that hangs below the sheave in still water [N], from where the cable lies."""
    scene, line = sim.scene, sim.shape
    cable, water = scene.cable, scene.water
    dry = cable.mass_per_length * scene.gravity
    wet = dry - water.density * 0.25 * np.pi * cable.diameter**2 * scene.gravity
    hanging = line[int(line[:, 2].argmax()) :]  # from the top of the sheave on
    top = float(np.interp(-sim.frame.sheave_position[2], -hanging[:, 2], hanging[:, 4]))
    surface = max(float(np.interp(0.0, -hanging[:, 2], hanging[:, 4])), top)
    body = scene.towbody.net_weight if line[-1, 2] < 0.0 else scene.towbody.mass * scene.gravity
    return body + dry * (surface - top) + wet * (line[-1, 4] - surface)


class Sea:
    """Ship motion of sines: amplitude [m, rad], period [s] and phase [rad] of each of x y z roll pitch yaw.

    Samples carry value and rate, exact; ``ahead`` [m/s] along ``heading`` [rad] from ``place`` [m] is added.
    """

    def __init__(self, scene: Scene, place=(0.0, 0.0), heading: float = 0.0, **waves):
        self.mean = np.array((*place, scene.ship.reference_height, 0.0, 0.0, heading))
        self.ahead = scene.ship.tow_speed * np.array((np.cos(heading), np.sin(heading)))
        self.waves = np.zeros((6, 3))
        self.waves[:, 1] = 1.0
        for name, wave in waves.items():
            self.waves[("surge", "sway", "heave", "roll", "pitch", "yaw").index(name)] = wave
        self.turn = heading

    def samples(self, t: np.ndarray) -> np.ndarray:
        """[times, MOTION_COLUMNS]; surge and sway are those along and across the heading."""
        a, period, phase = self.waves.T
        w = 2.0 * np.pi / period
        angle = w * t[:, None] + phase
        q, v = a * np.sin(angle), a * w * np.cos(angle)
        c, s = np.cos(self.turn), np.sin(self.turn)
        for table in (q, v):
            table[:, 0], table[:, 1] = c * table[:, 0] - s * table[:, 1], s * table[:, 0] + c * table[:, 1]
        out = np.zeros((len(t), MOTION_COLUMNS))
        out[:, :6], out[:, 6:12] = q + self.mean, v
        out[:, :2] += self.ahead * t[:, None]
        out[:, 6:8] += self.ahead
        out[:, EPOCH], out[:, SOURCE] = 1.0, 1.0
        return out

    def push(self, sim: Simulator, first: int, last: int, rate: float = RATE) -> None:
        """Samples number ``first`` to ``last`` - 1 at ``rate`` [Hz] into the inputs."""
        step = round(1e9 / rate)
        for i, row in enumerate(self.samples(np.arange(first, last) / rate), first):
            push_motion(sim.inputs, i * step, row)


def sail(sim: Simulator, sea: Sea | None, seconds: float, rate: float = RATE, keep=None) -> list | np.ndarray:
    """Run a started tow through ``seconds`` of a sea; returns all tick outputs, or what ``keep(frames)`` makes of each
    part.

    Samples go one second ahead of the tow. The tow may have run before: the sea goes on.
    """
    tick = sim.scene.solver.tick
    left, parts = round(seconds / tick), []
    while left > 0:
        count = min(left, max(round(CHUNK / tick), 1))
        end = (int(sim.state.now.time.ticks) + count) * tick
        if sea is not None:
            sea.push(sim, int(sim.inputs.motion_head[0]), int(np.ceil((end + 1.0) * rate)), rate)
        frames = sim.run(count)
        parts.append(frames if keep is None else keep(frames))
        left -= count
    return np.concatenate(parts).view(np.recarray) if keep is None else parts


def finite(frames: np.ndarray) -> bool:
    """No NaN or infinity in any number of the tick outputs."""
    return all(bool(np.isfinite(frames[name]).all()) for name in frames.dtype.names)
