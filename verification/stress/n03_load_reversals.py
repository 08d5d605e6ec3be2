"""N3: a cable pulled off a drum and pressed on again by random loads, and a tow thrown off its sheave."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.physics.contact import EVENTS, LOADED, Contact, latch
from cable_sim_ros.physics.inputs import push_command, push_motion
from cable_sim_ros.physics.integrate import coefficients
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.rig.rig import WHIPPING, Rig, load_of
from cable_sim_ros.sim.simulator import SolverError

from ..bend import drum
from ..cables import uniform
from ..contact_points import ContactPoints, contact_points
from ..shipped import started
from .sheave_depth import Watch
from .tows import held
from .verdict import MIN, Found, Metric, holds, relative, stress

WINDOW = 0.020  # s after an event
MASS, LENGTH, ELEMENTS, LINEAR = 2.0, 0.6, 6, 0.389  # kg at each end, m, of the bench; kg/m of the shipped cable
STEP = 5e-4  # s
TICK = 2e-3  # s, of the thrown tow
TOWED = 0.5  # m/s, of the thrown tow: at the shipped 2.2 m/s the drag keeps the cable on its sheave in every throw


class Impulse:
    """Impulse [N s] of forces [N] as generalised-alpha gives it to the velocities, from their values at step ends.

    The velocities follow the auxiliary acceleration, Arnold & Bruls (2007) (7)-(8); the mass matrix is constant, so
    each force has its auxiliary force by the same recursion.
    """

    def __init__(self, force: np.ndarray, rho: float):
        self.force, self.auxiliary, self.rho = force, force, rho
        self.total = np.zeros_like(force)

    def step(self, h: float, force: np.ndarray) -> None:
        """A step of h [s] that ended with ``force``."""
        am, af, _, gamma, _, _ = coefficients(h, self.rho)
        new = ((1.0 - af) * force + af * self.force - am * self.auxiliary) / (1.0 - am)
        self.total = self.total + h * ((1.0 - gamma) * self.auxiliary + gamma * new)
        self.force, self.auxiliary = force, new


def changes(pressed: np.ndarray) -> np.ndarray:
    """Where a row of booleans changes."""
    return np.flatnonzero(pressed[1:] != pressed[:-1]) + 1


def max_within(times: np.ndarray, window: float = WINDOW) -> int:
    """Largest number of ``times`` [s] within ``window`` [s] of one of them, itself counted."""
    return max((int(((times >= t) & (times <= t + window)).sum()) for t in times), default=0)


class Bench:
    """A cable across a drum, its ends weighted and led upright, pulled up and pressed down by one force on both."""

    def __init__(self, step: float = STEP):
        n = ELEMENTS
        self.at, self.time = step, 0.0
        cable = uniform(LENGTH, n, LINEAR, 6.786e6, bending_stiffness=1.4, axial_damping=310.0, bending_damping=6.4e-5)
        rig = Rig(
            cable,
            held={0: "xy", n: "xy"},  # ends run in upright guides
            tension=200.0,
            bodies={0: MASS, n: MASS},
            surfaces=[drum(0.255, 4000.0, penetration=1e-3 / 0.255)],
            loads=[load_of(0), load_of(n)],
        )
        s = rig.arc - 0.5 * LENGTH
        rig.place(np.column_stack((s, 0.0 * s, 0.0 * s + 0.2549)), np.tile((1.0, 0.0, 0.0), (n + 1, 1)))
        self.rig = rig
        self.weight = 9.81 * (2.0 * MASS + LINEAR * LENGTH)
        self.pull(-40.0)
        rig.settle()
        self.impulse = Impulse(self.forces(contact_points(rig)), rig.solver.rho_inf)
        self.sampled = 0.0  # N s, step times force at its end
        self.minimum, self.seen = 0.0, []

    def pull(self, load: float) -> None:
        """Upward force on each end [N]."""
        self.rig.model.loads["force"][:, 2] = load

    def forces(self, table: ContactPoints) -> np.ndarray:
        """Upward force of the drum, and of loads and weight [N]."""
        return np.array((table.resultant[2], self.rig.model.loads["force"][:, 2].sum() - self.weight))

    def run(self, seconds: float) -> None:
        """Run on with the present load."""
        for _ in range(round(seconds / self.at)):
            for h in self.rig.steps(self.at, rules=WHIPPING):
                self._look(h)

    def _look(self, h: float) -> None:
        table = contact_points(self.rig)
        force, flanks = self.forces(table), table.flanks
        self.impulse.step(h, force)
        self.time += h
        self.sampled += h * force[0]
        self.minimum = min(self.minimum, float(flanks.min()))
        self.seen.append((self.time, float(flanks.sum(1).max()) > LOADED))

    def momentum(self) -> float:
        """Of the cable and its two end masses, upward [N s]."""
        rig = self.rig
        size, u, w = np.diff(rig.arc), rig.state.v[:, 2], rig.state.v[:, 5]
        cable = 0.5 * (u[:-1] + u[1:]) * size + (w[:-1] - w[1:]) * size**2 / 12.0
        return float(LINEAR * cable.sum() + MASS * (u[0] + u[-1]))

    def events(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Times [s] at which the contact changed, at which the product's flag would have, and its detachments."""
        time, pressed = np.array([t for t, _ in self.seen]), np.array([on for _, on in self.seen])
        record, hold = np.zeros(1, EVENTS).view(np.recarray)[0], round(Contact().reseat_time * 1e9)
        record.seated = 1
        off = np.array([latch(bool(on), record, round(t * 1e9), hold) for t, on in self.seen])
        return time[changes(pressed)], time[changes(off)], int(record.detachments)


def reversed_loads(bench: Bench, count: int, rng) -> tuple[np.ndarray, float, bool]:
    """Pull off and press on ``count`` times: rows, one a pull and its return, of what the drum gave by Impulse, by step
    times force, and what momentum, loads and weight want of it [N s]; its least line load; are all numbers finite?"""
    rows, finite = [], True
    for i in range(count):
        up = i % 2 == 0
        momentum, sampled, given = bench.momentum(), bench.sampled, bench.impulse.total
        bench.pull(bench.weight * (rng.uniform(0.55, 0.9) if up else -rng.uniform(0.1, 2.0)))
        bench.run(rng.uniform(0.02, 0.06) if up else rng.uniform(0.1, 0.3))
        given = bench.impulse.total - given
        rows.append((given[0], bench.sampled - sampled, bench.momentum() - momentum - given[1]))
        state = bench.rig.state
        finite = finite and bool(np.isfinite(state.q).all() and np.isfinite(state.tension).all())
    rows = np.array(rows)
    return rows[::2] + rows[1::2], bench.minimum, finite


@stress(
    "detach and return, 1000 random load reversals",
    "contact never pulls; <= 2 toggles within 20 ms of an event; impulse = momentum change within 2 %",
)
def reversals(quick: bool) -> Found:
    """A cable across a drum pulled off and pressed on by random loads; a tow whose ship drops under it."""
    count, throws = (60, 6) if quick else (1000, 50)
    rng, bench = np.random.default_rng(3), Bench()
    impulses, minimum, finite = reversed_loads(bench, count, rng)
    given, report, wanted = impulses.T
    off, sampled = (
        np.abs(x - wanted) / np.maximum(np.abs(wanted), 0.1 * np.median(np.abs(wanted))) for x in (given, report)
    )
    contact, flag, events = bench.events()
    tow = Thrown()
    notes = tow.throw(throws, rng)
    metrics = [
        Metric("bench, least line load of a flank", minimum, "N/m", 0.0, MIN),
        relative("bench, impulse against momentum change, all", given.sum(), wanted.sum(), 0.02),
        Metric(
            "bench, impulse against momentum change, worst of one detachment and return", float(off.max()), "", 0.02
        ),
        Metric("bench, the same with step times force at its end for the impulse", float(sampled.max())),
        Metric("bench, most changes of the flag within 20 ms of one", max_within(flag), "", 2),
        Metric("bench, most changes of the bare contact within 20 ms of one", max_within(contact)),
        holds("bench, numbers finite", finite),
        Metric("tow, least detachments of a throw", min(tow.detachments, default=0), "", 1, MIN),
        Metric("tow, most changes of the flag within 20 ms of one", max(tow.flag, default=0), "", 2),
        Metric("tow, most changes of the bare contact within 20 ms of one", max(tow.contact, default=0)),
        *(f._replace(name=f"tow, {f.name}") for f in tow.watch.metrics(tow.sim.scene.cable.diameter)),
        holds("tow, back on the sheave after every throw", tow.returned),
    ]
    return Found(
        metrics,
        [
            f"bench: {count} reversals at {1e3 * STEP:g} ms on two masses of {MASS:g} kg, drum of 0.25 m, the shipped "
            f"contact (1 mm at 4 kN, D = 0.3); {events} detachments, {len(contact)} changes of the bare contact",
            "impulse: as generalised-alpha gives it to the velocities; the flag: contact.latch, as in the tick outputs",
            f"tow: at {TOWED:g} m/s, {1e3 * TICK:g} ms ticks; {throws} times from rest the ship drops 0.9 to 3 m at 14 "
            f"to 25 m/s^2, stops and comes back up; {sum(tow.detachments)} detachments",
            *notes,
        ],
    )


class Thrown:
    """A slow tow whose ship drops faster than the cable sinks, each time from the same rest, seen tick by tick.

    From the same rest, for what this is about is coming off and returning: a cable thrown again and again buckles
    sideways in the end and leaves its groove for good. rate: of pay-out [m/s] from the beginning of a throw on.
    """

    def __init__(self, rate: float = 0.0):
        scene = held(solver__tick=TICK, ship__tow_speed=TOWED, winch__command_timeout=3600.0)
        self.rate = rate
        self.sim, self.up = started(scene), scene.ship.reference_height
        self.watch = Watch(self.sim)
        self.ship = np.zeros(3)  # time [s], height [m] and its rate [m/s]
        self._move(0.0, 0.0)
        for _ in range(12):
            self._move(0.0, 1.0)
        self.sim.run(round(11.0 / TICK))  # the start's blend is over after 10 s
        self.rest = self.sim.snapshot(), self.ship.copy()
        self.detachments, self.returned, self.flag, self.contact = [], True, [], []

    def _move(self, a: float, seconds: float) -> None:
        """Constant vertical acceleration [m/s^2] up to the next sample: the ship's cubics follow it exactly."""
        t, z, v = self.ship
        t, z, v = self.ship = np.array((t + seconds, z + v * seconds + 0.5 * a * seconds**2, v + a * seconds))
        push_motion(self.sim.inputs, round(t * 1e9), [TOWED * t, 0, self.up + z, 0, 0, 0, TOWED, 0, v, 0, 0, 0, 1, 1])

    def throw(self, times: int, rng) -> list[str]:
        """Drop the ship and bring it back, so many times; returns what went wrong."""
        notes = []
        for _ in range(times):
            self.sim.restore(self.rest[0])
            if self.rate != 0.0:
                push_command(self.sim.inputs, int(self.sim.state.now.time.now) + 1, np.nan, self.rate)
            self.ship = self.rest[1]
            a, seconds, back = rng.uniform(14.0, 25.0), rng.uniform(0.25, 0.35), 3.0
            gentle = 4.0 * a * seconds**2 / back**2
            for way, time in ((-a, seconds), (a, seconds), (gentle, 0.5 * back), (-gentle, 0.5 * back), (0.0, 2.0)):
                self._move(way, time)
            try:
                self._see(int((self.ship[0] - 0.5) / TICK) - int(self.sim.state.now.time.ticks))
            except SolverError as error:
                self.returned = False
                notes.append(f"tow, {a:.3g} m/s^2 for {seconds:.3g} s: {error}")
        return notes

    def _see(self, ticks: int) -> None:
        """Run one throw and count what is reported of it: it begins seated."""
        frames = self.watch.look(self.sim.run(ticks))
        time, off = frames.time * 1e-9, frames.status & Flag.DETACHED > 0
        self.detachments.append(int(frames.detachments[-1]) - int(frames.detachments[0]))
        self.returned = self.returned and not bool(off[-1])
        self.flag.append(max_within(time[changes(off)]))
        self.contact.append(max_within(time[changes(frames.contact_total > 0.0)]))
