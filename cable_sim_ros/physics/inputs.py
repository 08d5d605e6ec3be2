"""Inputs: what a tick is told. Rings of motion samples (of the ship, and of a vehicle at the far end of the cable),
winch commands and angles of flaps, one writer, no lock.

The writer stores the row first and the head last. A tick works on the heads as they stood when it began, `motion_seen`
and the others, which the compiled entry sets: what comes while it runs is for the next one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

MOTION_ROWS = 1024
COMMAND_ROWS = 256
FLAP_ROWS = 128
MAX_WINGS = 16  # of all rigid bodies together
MOTION_COLUMNS = 14  # x y z roll pitch yaw, their six rates, epoch, source
EPOCH, SOURCE = 12, 13


class Inputs(NamedTuple):
    motion_time: np.ndarray  # int64 [MOTION_ROWS], ns
    motion: np.ndarray  # float64 [MOTION_ROWS, MOTION_COLUMNS]
    motion_head: np.ndarray  # int64 [1], samples written since the start
    motion_seen: np.ndarray  # int64 [1], of these, what the tick sees
    command_time: np.ndarray  # int64 [COMMAND_ROWS], ns
    command: np.ndarray  # float64 [COMMAND_ROWS, 2]: pay-out m, rate m/s; NaN = not commanded
    command_head: np.ndarray  # int64 [1]
    command_seen: np.ndarray  # int64 [1]
    vehicle_time: np.ndarray  # int64 [MOTION_ROWS], ns
    vehicle: np.ndarray  # float64 [MOTION_ROWS, MOTION_COLUMNS], as motion
    vehicle_head: np.ndarray  # int64 [1]
    vehicle_seen: np.ndarray  # int64 [1]
    flap_time: np.ndarray  # int64 [FLAP_ROWS], ns
    flap: np.ndarray  # float64 [FLAP_ROWS, MAX_WINGS]: rad, a column a wing; NaN = not commanded
    flap_head: np.ndarray  # int64 [1]
    flap_seen: np.ndarray  # int64 [1]

    @property
    def heads(self) -> tuple[int, int, int, int]:
        """Motion samples, winch commands, samples of the vehicle and rows of flaps written since the start."""
        heads = self.motion_head, self.command_head, self.vehicle_head, self.flap_head
        motion, command, vehicle, flap = (int(head[0]) for head in heads)
        return motion, command, vehicle, flap


def make_inputs() -> Inputs:
    """Empty rings: ship and vehicle follow their mean tracks, the winch holds."""
    motion, z = (MOTION_ROWS, MOTION_COLUMNS), np.zeros
    rings = motion, (COMMAND_ROWS, 2), motion, (FLAP_ROWS, MAX_WINGS)  # ship, winch, vehicle, flaps
    tables = ((z(size[0], np.int64), z(size), z(1, np.int64), z(1, np.int64)) for size in rings)
    return Inputs(*(table for ring in tables for table in ring))


def push_motion(inputs: Inputs, time_ns: int, sample) -> None:
    """Append one motion sample: stamp [ns], 14 numbers (x y z roll pitch yaw, six rates, epoch, source).

    Raises ValueError for a number that is not finite or a stamp that does not advance.
    """
    row = np.asarray(sample, float)
    head = int(inputs.motion_head[0])
    if row.shape != (MOTION_COLUMNS,) or not np.isfinite(row).all():
        raise ValueError(f"motion sample at {time_ns} ns must be {MOTION_COLUMNS} finite numbers, got {sample!r}")
    if head and time_ns <= inputs.motion_time[(head - 1) % MOTION_ROWS]:
        raise ValueError(
            f"motion stamp {time_ns} ns does not advance past "
            f"{int(inputs.motion_time[(head - 1) % MOTION_ROWS])} ns; drop the sample"
        )
    inputs.motion[head % MOTION_ROWS] = row
    inputs.motion_time[head % MOTION_ROWS] = time_ns
    inputs.motion_head[0] = head + 1


def of_vehicle(inputs: Inputs) -> Inputs:
    """The rings as a writer of motion samples sees them that writes those of the vehicle."""
    return inputs._replace(
        motion_time=inputs.vehicle_time,
        motion=inputs.vehicle,
        motion_head=inputs.vehicle_head,
        motion_seen=inputs.vehicle_seen,
    )


def push_command(inputs: Inputs, time_ns: int, payout: float, rate: float) -> None:
    """Append one winch command: pay-out [m] and rate [m/s], positive out; NaN = not commanded."""
    head = int(inputs.command_head[0])
    inputs.command[head % COMMAND_ROWS] = (payout, rate)
    inputs.command_time[head % COMMAND_ROWS] = time_ns
    inputs.command_head[0] = head + 1


def push_flaps(inputs: Inputs, time_ns: int, angles) -> None:
    """Append one row of flap angles [rad, MAX_WINGS]; NaN = not commanded. Its time is later than the row before."""
    head = int(inputs.flap_head[0])
    inputs.flap[head % FLAP_ROWS] = angles
    inputs.flap_time[head % FLAP_ROWS] = time_ns
    inputs.flap_head[0] = head + 1
