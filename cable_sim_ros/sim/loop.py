"""The one compiled entry: static start, a number of ticks, or the loop of the node, free of the interpreter lock.

One entry, because every compiled function is optimised anew inside each compiled function that calls it. In real time
tick k takes the simulation to the time t_k on the clock of the motion data; it is due at t_k + mapping on
CLOCK_MONOTONIC. The loop slews its mapping towards the wanted one, so that simulation time never jumps:

* late by less than a period: the tick runs at once, the grid stays;
* behind by 1 to max_catchup periods: the missed ticks run back to back (counted as overruns);
* further behind: the mapping is moved by the whole periods lost (a resync, the deadlines are counted as skipped), and
  the lag is worked off slowly by the slew.

The libc symbols are external functions of the compiled code, not foreign-function pointers: those would keep the entry
out of the on-disk cache.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from numba import types

from ..compiler.jit import by_reference, driver, prepare
from ..physics.output import no_peaks
from ..physics.state import NOW
from ..physics.tick import link_tick, observe, sense, tick
from ..physics.tick_output import Flag
from ..physics.tow import lay, rest

LINUX = sys.platform.startswith("linux")
_INT64 = types.CPointer(types.int64)
_sleep = types.ExternalFunction("clock_nanosleep", types.int32(types.int32, types.int32, _INT64, _INT64))
_clock = types.ExternalFunction("clock_gettime", types.int32(types.int32, _INT64))
_write = types.ExternalFunction("write", types.int64(types.int32, _INT64, types.uint64))

CLOCK_MONOTONIC, TIMER_ABSTIME, SECOND = 1, 1, 1_000_000_000
SLEEP_CHUNK = 50_000_000  # ns, so that a stop is seen soon
MIN_SLEEP = 200_000  # ns given to others by a tick that found its deadline already past
MASS_DAMPING = 0.2  # 1/s, of the pseudo-transient only; it has no part in the equilibrium (trap T8)
LONGEST_STEP = 1000.0  # s, of the pseudo-transient
CREEPING = 1e6  # N left of a start that did not settle, from which there still is something to see
HALT = int(Flag.NEWTON_FAILED | Flag.NOT_FINITE)

MOST_READY = 64
_ready: dict[int, NamedTuple] = {}  # models whose kernels are published, by their place in memory
SETTLE, TICKS, LIVE, LAY = 0, 1, 2, 3  # what to do
TIME, DEADLINE, WAKE, DONE, FLAGS, LAG = range(6)  # columns of a stats row, ns
STATS_COLUMNS = 6
MOTION, COMMAND, VEHICLE, FLAPS = 0, 1, 2, 3  # columns of a heads row: what a tick saw of each ring
HEADS = 4
# control words: the first two are written by Python, the others by the loop; LIVE also reads the settings. UNTIL: count
# at which the loop comes back, for what Python has to do between two ticks; 0: none
(
    STOP,
    TARGET,
    COUNT,
    MAPPING,
    OVERRUNS,
    SKIPPED,
    RESYNCS,
    HALTED,
    REACHED,
    PERIOD,
    SLEW,
    MAX_CATCHUP,
    EVENTFD,
    UNTIL,
    ONE,
    BUFFER,
) = range(16)
CONTROL_WORDS = 17  # BUFFER takes two

if LINUX:

    @driver
    def monotonic(buffer):
        """CLOCK_MONOTONIC in ns; buffer: int64 [2] scratch."""
        _clock(CLOCK_MONOTONIC, buffer.ctypes)
        return buffer[0] * SECOND + buffer[1]

    @driver
    def sleep_until(deadline, control, buffer):
        """Sleep to an absolute deadline in chunks; returns the time of waking."""
        now = monotonic(buffer)
        while now < deadline and control[STOP] == 0:
            until = min(deadline, now + SLEEP_CHUNK)
            buffer[0] = until // SECOND
            buffer[1] = until % SECOND
            _sleep(CLOCK_MONOTONIC, TIMER_ABSTIME, buffer.ctypes, buffer.ctypes)
            now = monotonic(buffer)
        return now

    @driver
    def notify(eventfd, one):
        """Add one to the eventfd."""
        return _write(eventfd, one.ctypes, 8)
else:  # offline only: real time needs Linux

    @driver
    def monotonic(buffer):
        return buffer[0]

    @driver
    def sleep_until(deadline, control, buffer):
        return deadline

    @driver
    def notify(eventfd, one):
        return np.int64(0)


@driver
def look(inputs):
    """Let the next tick see what has been written so far."""
    inputs.motion_seen[0] = inputs.motion_head[0]
    inputs.command_seen[0] = inputs.command_head[0]
    inputs.flap_seen[0] = inputs.flap_head[0]
    inputs.vehicle_seen[0] = inputs.vehicle_head[0]


@driver
def pace(due, control, buffer):
    """Sleep until the tick of simulation time ``due`` [ns]; returns its deadline and the time of waking [ns]."""
    period, slew = control[PERIOD], control[SLEW]
    mapping = control[MAPPING]
    mapping += max(-slew, min(slew, control[TARGET] - mapping))
    deadline = due + mapping
    called = monotonic(buffer)
    wake = sleep_until(deadline, control, buffer)
    if control[STOP] != 0:
        return deadline, wake
    behind = (wake - deadline) // period
    if behind > control[MAX_CATCHUP]:
        mapping += behind * period
        deadline += behind * period
        control[RESYNCS] += 1
        control[SKIPPED] += behind
    if called >= deadline:  # no sleep above: leave the core a moment, a FIFO thread starves it otherwise
        sleep_until(wake + MIN_SLEEP, control, buffer)
    control[MAPPING] = mapping
    return deadline, wake


@driver
def live(model, state, inputs, output, control, stats, heads, buffer, one, count):
    """Tick until control[STOP] or a halt; ``count`` 0: in real time, to control[UNTIL], else that many ticks, each at
    once."""
    rows = stats.shape[0]
    period, last = control[PERIOD], control[COUNT] + count if count > 0 else control[UNTIL]
    due = control[REACHED] + period
    while control[STOP] == 0 and control[HALTED] == 0 and (last == 0 or control[COUNT] < last):
        if count == 0:
            deadline, wake = pace(due, control, buffer)
            if control[STOP] != 0:
                break
        else:
            wake = monotonic(buffer)
            deadline = wake
        slot, seen = control[COUNT] % rows, heads[control[COUNT] % heads.shape[0]]
        look(inputs)
        seen[MOTION], seen[COMMAND] = inputs.motion_seen[0], inputs.command_seen[0]
        seen[FLAPS] = inputs.flap_seen[0]
        seen[VEHICLE] = inputs.vehicle_seen[0]
        flags = tick(model, state, inputs, output, slot)
        done = monotonic(buffer)
        if count == 0 and done - deadline > period:
            control[OVERRUNS] += 1
        stats[slot, TIME] = due
        stats[slot, DEADLINE] = deadline
        stats[slot, WAKE] = wake
        stats[slot, DONE] = done
        stats[slot, FLAGS] = flags
        stats[slot, LAG] = control[MAPPING] - control[TARGET]
        if flags & HALT:
            control[HALTED] = 1
        control[REACHED] = due
        control[COUNT] += 1
        notify(control[EVENTFD], one)
        due += period


@driver
def _drive(model, state, inputs, output, what, count, control, stats, heads):
    """Do one thing with the simulation.

    SETTLE: static start in at most ``count`` steps, tick output into row 0; returns the steps,
    negative where it did not settle, and leaves iterations and residual [N] in the health.
    TICKS: ``count`` ticks into rows 0..count-1; returns the ticks done before a halt. heads, int64 [count, HEADS]:
    what each of them sees of the rings; without a row each sees what has been written.
    LIVE: the real-time loop on the control words and stats rows; returns its tick count. heads: a ring that it fills.
    With a ``count`` above 0 as many ticks, each at once, into the same rings: lockstep.
    LAY: the mesh for the pay-out of now; returns 0.
    """
    model, state, inputs, output = by_reference(model), by_reference(state), by_reference(inputs), by_reference(output)
    if what == SETTLE:
        steps, iterations, left = rest(model, state, MASS_DAMPING, count, LONGEST_STEP)
        if steps >= 0 or left < CREEPING:
            no_peaks(state.memory[NOW].health)
            observe(model, state, output, 0, 0, False)
            if model.sensors.rules.shape[0] > 0:
                sense(model, state, output.frame[0])
        health = state.memory[NOW].health
        health.iterations, health.substeps, health.residual = iterations, 0, left
        return np.int64(steps)
    if what == LAY:
        lay(model, state)
        return np.int64(0)
    if what == TICKS:
        for i in range(count):
            look(inputs)
            if heads.shape[0] > 0:
                inputs.motion_seen[0], inputs.command_seen[0] = heads[i, MOTION], heads[i, COMMAND]
                inputs.flap_seen[0] = heads[i, FLAPS]
                inputs.vehicle_seen[0] = heads[i, VEHICLE]
            if tick(model, state, inputs, output, i) & HALT:
                return np.int64(i)
        return np.int64(count)
    buffer, one = control[BUFFER : BUFFER + 2], control[ONE : ONE + 1]
    live(model, state, inputs, output, control, stats, heads, buffer, one, count)
    return control[COUNT]


def needs(arguments: tuple) -> tuple:
    """What is prepared for these arguments of `drive`."""
    return link_tick, arguments[:4], _drive, arguments


def drive(model, state, inputs, output, what, count, control, stats, heads) -> int:
    """The compiled entry, see _drive; compiles it or loads it from the cache at the first call."""
    arguments = (model, state, inputs, output, what, int(count), control, stats, heads)
    if id(model) not in _ready:  # what it needs is as read-only as it is: looked up once, not in each tick
        prepare(*needs(arguments))
        if len(_ready) >= MOST_READY:
            _ready.clear()
        _ready[id(model)] = model
    return _drive(*arguments)
