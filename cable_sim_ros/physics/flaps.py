"""Flaps of rigid bodies: the angle each is commanded, and how far it has come.

A flap goes to the newest angle at its rate, within its range. After its time-out without another it goes to its neutral
angle; one that was never commanded stands as the scene has it.
"""

from __future__ import annotations

import numpy as np

from ..compiler.jit import driver, link, opaque
from .attitude import ATTITUDE
from .inputs import FLAP_ROWS
from .noise import gauss, spoiled
from .rigid_model import Rigid
from .sensor_models import BIAS, DRIFT, FROZEN, LATE, LOST, NOISE, RUNAWAY, STUCK
from .state import NOW, State

CHANCE = 79  # seed of the noise of a fault
SPARE = 8  # rows of the ring that may be written while it is read
NEVER = -(2**62)  # ns: no command has come
STALE, LIMITED = 1, 2  # bits of ATTITUDE said
ASKED_WITHIN = 1e-6  # rad; asking for so much beyond the range is no more than a printed figure's rounding


@driver
def hear(body, attitude, inputs, end):
    """Take the rows of the ring that count by ``end`` [ns] and are newer than what was heard."""
    fault, head = attitude.fault, inputs.flap_seen[0]
    delay = np.int64(fault.amount * 1e9) if fault.kind == LATE else np.int64(0)
    first = head
    while first > max(0, head - FLAP_ROWS + SPARE) and inputs.flap_time[(first - 1) % FLAP_ROWS] > attitude.heard:
        first -= 1
    for number in range(first, head):
        row = number % FLAP_ROWS
        time = inputs.flap_time[row]
        if time + delay > end:
            break
        attitude.heard = time
        if fault.kind == LOST and time > fault.since:
            continue
        for i in range(body.wings[0], body.wings[1]):
            angle = inputs.flap[row, i]
            if not np.isnan(angle):
                attitude.demanded[i - body.wings[0]], attitude.since[i - body.wings[0]] = angle, time


@driver
def goal_of(wing, attitude, k, end, ticks):
    """Angle [rad] that flap k of a body goes to and its largest rate [rad/s]; has it run into its time-out?"""
    fault, since = attitude.fault, attitude.since[k]
    after = (end - fault.since) * 1e-9
    if fault.kind == FROZEN:
        return attitude.flap[k], wing.rate, False
    if fault.kind == STUCK:
        return fault.amount, wing.rate, False
    if fault.kind == RUNAWAY:
        return (wing.range if fault.amount > 0.0 else -wing.range), abs(fault.amount), False
    if wing.timeout > 0 and since != NEVER and end - since > wing.timeout:
        return wing.neutral, wing.rate, True
    goal = attitude.demanded[k]
    if fault.kind == BIAS or fault.kind == DRIFT or fault.kind == NOISE:
        goal = spoiled(fault, goal, 0, after, gauss(CHANCE, ticks, k) if fault.kind == NOISE else 0.0)
    return goal, wing.rate, False


@driver
def _move_flaps(rigid, state, inputs, end, h) -> None:
    """Take the flaps on for a step of h [s] that ends at ``end`` [ns]."""
    for i in range(rigid.bodies.shape[0]):
        body, attitude = rigid.bodies[i], state.attitude[NOW, i]
        hear(body, attitude, inputs, end)
        attitude.said = 0
        for n in range(body.wings[0], body.wings[1]):
            wing, k = rigid.wings[n], n - body.wings[0]
            if wing.lift_of_flap == 0.0:
                continue
            goal, rate, stale = goal_of(wing, attitude, k, end, state.memory[NOW].time.ticks)
            if stale:
                attitude.said |= STALE
            if abs(goal) > wing.range + ASKED_WITHIN:
                attitude.said |= LIMITED
            goal = min(max(goal, -wing.range), wing.range)
            attitude.flap[k] += min(max(goal - attitude.flap[k], -rate * h), rate * h)


move_flaps = opaque(_move_flaps)


def put_flap(state: State, body: int, k: int, angle: float) -> None:
    """Demand an angle [rad] of flap k of a rigid body, from the next tick on, as if it had never been commanded."""
    state.attitude["demanded"][:, body, k], state.attitude["since"][:, body, k] = angle, NEVER


def clear_attitudes(state: State, rigid: Rigid) -> None:
    """No rotation from the world's axes, the flaps as the scene has them."""
    state.attitude[:] = np.zeros((), ATTITUDE)
    state.attitude["quaternion"][..., 3] = 1.0
    state.attitude["heard"], state.attitude["since"] = NEVER, NEVER
    for i, body in enumerate(rigid.bodies):
        first, last = body["wings"]
        for name in ("flap", "demanded"):
            state.attitude[name][:, i, : last - first] = rigid.wings["begins"][first:last]


def link_flaps(rigid, state, inputs) -> None:
    """Compile or load what moves flaps and publish it, where there is a rigid body."""
    link(_move_flaps, rigid, state, inputs, 0, 0.0, needed=len(rigid.bodies) > 0)
