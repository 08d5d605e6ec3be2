"""Drum, motor and brake of the drive (physics/winch_drive.py) against closed forms.

Free drum: the motor pulls with a constant force, so that its inertia swings on the cable. Frequency and decay in steps
are those that generalised-alpha gives any swing (drum.py): drum and cable are one system, nothing comes late. Wave
theory: a change of the drum's speed by v changes the tension by Z v, Z = sqrt(EA mu), until the wave is back from the
body. Balance of the bare drum: M a = T less what holds it.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cable_sim_ros.plots.run import canvas
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.inputs import ShipMotion, WinchCommand
from cable_sim_ros.sim.live_parameters import set_live
from cable_sim_ros.sim.scene import Scene

from ..shipped import quiet, scene_with, started
from . import Comparison, Result
from .drum import BODY, EA, GRAVITY, MU, WEIGHT, WRAP, amplitude_at, closed, hanging, stepped, swing_of

TICK, FINE, FINEST = 0.01, 0.00125, 0.0003125  # s
NUDGE = 0.004  # of the tension, that a free drum is pulled more with: the cable is as good as linear
FREE = (  # m outboard, inboard; EA over that of the cable; s
    (498.0, 2.0, 1.0, 10.0),
    (4.0, 2.0, 1.0, 1.0),
    (0.5, 0.78, 1.0, 0.5),
    (0.5, 0.78, 2.56, 0.3),  # as stiff as 0.5 m in all
)
DRUMS = 2000.0, 200.0  # kg at the cable
# allowed of the largest tension at 10 ms: of the hard stop what the closed form leaves out, the mass of the cable; of a
# brake besides what so long a step misses of a stop of 55 and 35 ms, 1.5 and 3.6 % (docs/drive.md)
STOPS = (("hard stop", 2000.0, 0.01), ("brake sets under load", 2000.0, 0.02), ("brake sets under load", 200.0, 0.04))
DELAYS = 0.05, 0.1, 0.2, 0.4  # s
PERIOD = 6.0  # s
HEAVE, WAVE = 1.0, 8.0  # m, s
PHASES = 8
LIGHT = 20.0  # kg: stops within a small part of the way of a wave to the body and back
SOON, BACK = (0.03, 0.12), 0.24  # s after the stop: looked at; the wave is back from the body
SET_PULL = 3300.0  # N
QUICK_PARTS = "pendulum", "overhauling load", "heat", "dead time"
QUICK = f"of all parts {', '.join(QUICK_PARTS)} alone"


class Free(NamedTuple):
    """A free drum in steps of ``tick`` s: swing found, that of the closed form, largest gain of the tension [N] and its
    closed form."""

    tick: float
    length: float
    found: float
    decay: float
    exact: float
    peak: float
    peak_exact: float


def free_drum(mass: float, outboard: float, inboard: float, stiffness: float, seconds: float, tick: float) -> Free:
    """The motor begins to pull NUDGE more than the cable: a torque step on a drum with free inertia."""
    sim = started(hanging(mass, outboard, inboard=inboard, tick=tick, cable__axial_stiffness=stiffness * EA))
    still = sim.run(1)[0]
    tension, length = float(still.tension_drum), float(still.payout)
    set_live(sim, "drive.set_pull", (1.0 + NUDGE) * tension)
    set_live(sim, "drive.mode", "tension")
    series = sim.run(round(seconds / tick)).tension_drum
    exact = closed(mass, length, stiffness)
    swing = swing_of(series[1:], tick, stepped(exact, tick).frequency)
    peak = 2.0 * NUDGE * tension * BODY / (BODY + mass)
    return Free(tick, length, swing.frequency, swing.decay, exact, float(series.max()) - tension, peak)


def _row(name: str, unit: str, ours: float, expected: float, share: float, source: str) -> Comparison:
    """A figure that may be off by so large a share of what is expected."""
    return Comparison(name, unit, float(ours), expected, share * abs(expected), source)


def free_rows(cases=FREE, drums=DRUMS) -> list[Comparison]:
    """Frequency at real-time and fine steps, decay, order of the steps, and the torque step."""
    rows = []
    for outboard, inboard, stiffness, seconds in cases:
        for mass in drums:
            runs = [free_drum(mass, outboard, inboard, stiffness, seconds, tick) for tick in (TICK, 0.5 * TICK, FINE)]
            real, half, fine = runs
            much = f", EA x {stiffness:g}" if stiffness != 1.0 else ""
            name, form = f"free drum, {mass:g} kg on {real.length:.3g} m{much}", "rod with end masses"
            swings = [stepped(run.exact, run.tick) for run in runs]
            steps, coarse = f"{form}, in such steps", swings[0]
            rows += [
                _row(f"{name}, no steps", "rad/s", fine.found, fine.exact, 0.03, f"{form}; ours at {1e3 * FINE:g} ms"),
                _row(f"{name}, {1e3 * FINE:g} ms", "rad/s", fine.found, swings[2].frequency, 0.012, steps),
                _row(f"{name}, {1e3 * TICK:g} ms", "rad/s", real.found, coarse.frequency, 0.012, steps),
            ]
            if coarse.decay > 0.5:  # the error of the steps stands out
                order = (coarse.frequency - swings[2].frequency) / (swings[1].frequency - swings[2].frequency)
                apart = (real.found - fine.found) / (half.found - fine.found)
                rows += [
                    _row(f"{name}, decay, {1e3 * TICK:g} ms", "1/s", real.decay, coarse.decay, 0.03, steps),
                    _row(f"{name}, error of 10 over that of 5 ms", "", apart, order, 0.03, steps),
                ]
            if outboard == 4.0:
                name = f"torque step, {mass:g} kg on {real.length:.3g} m, largest gain"
                rows.append(_row(name, "N", fine.peak, fine.peak_exact, 0.01, "2 dF m / (M + m)"))
    return rows


def pendulum_row(mass: float = 200.0, seconds: float = 60.0) -> Comparison:
    """The ship sways for two periods and stands: the body swings below a drum that its motor does not hold."""
    outboard, sway, level = 10.0, 0.005, (0.0, 0.0, 0.0)
    sim = started(hanging(mass, outboard))
    still, height = sim.run(1)[0], sim.scene.ship.reference_height
    tension, begin = float(still.tension_drum), int(still.time)
    set_live(sim, "drive.set_pull", tension)
    set_live(sim, "drive.mode", "tension")
    free = (outboard - 0.5 * pi * WRAP) * (1.0 + tension / EA)  # scope begins above the sheave's axis
    w, parts = sqrt(GRAVITY / free), []
    for k in range(0, round(seconds / TICK), 10):
        for t in ((k + n + 2) * TICK for n in range(10)):
            x, v = (sway * (1.0 - cos(w * t)), sway * w * sin(w * t)) if w * t < 4.0 * pi else (0.0, 0.0)
            place, speed = (x, 0.0, height), (v, 0.0, 0.0)
            time = begin + round(1e9 * t)
            sim.push(ShipMotion(time_ns=time, position=place, velocity=speed, attitude=level, rate=level))
        parts.append(sim.run(10))
    frames = np.concatenate(parts)[2000:]
    swing = swing_of(frames["body_position"][:, 0] - frames["sheave_position"][:, 0], TICK, w)
    name = f"pendulum below a free drum of {mass:g} kg, {outboard:g} m"
    return _row(name, "rad/s", swing.frequency, w, 0.005, "sqrt(g / l), l off the sheave, stretched")


def overhauled(friction: float, seconds: float) -> tuple[np.recarray, float]:
    """A load that pulls 24.5 kN against a motor of 15 kN, let go by the brake; tick outputs, mass at the drum [kg]."""
    mass, pull = 500.0, 15e3
    scene = hanging(
        mass,
        8.0,
        drive__mode="brake",
        drive__curve_pull=[pull, pull],
        drive__viscous_friction=friction,
        drive__brake_lift_time=0.01,
        winch__max_rate=10.0,
    )
    sim = started(scene)
    sim.run(1)
    set_live(sim, "drive.mode", "follow")
    return sim.run(round(seconds / TICK)), mass


def overhauling_rows() -> list[Comparison]:
    """Runaway of an overhauled motor: its acceleration, and its speed where friction bears the rest."""
    frames, mass = overhauled(0.0, 0.6)
    speed, time = frames.payout_rate[20:], 1e-9 * (frames.time[20:] - frames.time[0])
    free = (WEIGHT + MU * GRAVITY * 8.0 - 15e3) / (mass + BODY + MU * 10.0)
    name, friction = "overhauled motor, 15 kN under 24.6 kN", 5e3
    rows = [_row(f"{name}, acceleration", "m/s^2", np.polyfit(time, speed, 1)[0], free, 0.01, "(W - F) / (M + m)")]
    frames, _ = overhauled(friction, 6.0)
    load = WEIGHT + MU * GRAVITY * (8.0 + float(frames.payout[-1] - frames.payout[0]))
    final = (load - 15e3) / friction
    return [
        *rows,
        _row(f"{name}, 5 kN s/m of friction, speed", "m/s", frames.payout_rate[-1], final, 0.01, "(W - F) / d"),
    ]


def paid_out(scene, rate: float, seconds: float):
    """A simulator of a scene whose winch pays out at a rate [m/s]."""
    sim = started(scene)
    sim.push(WinchCommand(rate=rate, time_ns=1))
    sim.run(round(seconds / scene.solver.tick))
    return sim


def heat_row() -> Comparison:
    """The brake alone stops a load under way, so slowly that next to nothing is left in the cable."""
    mass, rate = 2000.0, 1.0
    brake = 1.15 * WEIGHT / 0.8
    scene = hanging(mass, 8.0, drive__brake_pull=brake, drive__brake_set_time=0.5, winch__max_rate=10.0)
    sim = paid_out(scene, rate, 4.0)
    before = float(sim.frame.payout)
    speed = float(sim.frame.payout_rate)
    set_live(sim, "drive.mode", "emergency_stop")
    frames = sim.run(round(4.0 / TICK))
    way = float(frames.payout[-1]) - before
    load = WEIGHT + MU * GRAVITY * (8.0 + 4.0 * rate + 0.5 * way)
    expected = 0.5 * (mass + BODY + MU * 14.0) * speed**2 + load * way
    name, form = f"heat of the brake, {speed:.3g} m/s stopped in {way:.3g} m", "kinetic and potential energy"
    return _row(name, "kJ", 1e-3 * frames.brake_heat[-1], 1e-3 * expected, 0.01, form)


def stops(what: str, ticks: tuple[float, ...], mass: float = 200.0, way: float = 0.05) -> list[np.recarray]:
    """A drum on 6 m of cable, with the body, stopped at the end of its travel or by its brake; by ticks [s]."""
    found = []
    for tick in ticks:
        values: dict[str, Any] = {"drive__brake_set_time": 0.05}
        if what == "hard stop":
            values |= {"drive__brake_pull": 1.05 * WEIGHT, "drive__brake_slip": 0.5}
            values["cable__sections"] = {"all": {"length": 6.085 + way, "drag_law": "off"}}
        else:
            values |= {"drive__brake_pull": 3.0 * WEIGHT}
        sim = paid_out(hanging(mass, 4.0, tick=tick, **values), 0.05, 0.3)
        set_live(sim, "drive.mode", "emergency_stop")
        found.append(sim.run(round(0.3 / tick)))
    return found


def stop_rows(cases=STOPS) -> list[Comparison]:
    """Largest tension after a stop, and what half the step leaves of the error."""
    rows = []
    when, ticks = np.arange(0.02, 0.3, 0.01), (TICK, 0.5 * TICK, 0.25 * TICK, FINEST)
    for what, mass, share in cases:
        runs = stops(what, ticks, mass)
        name, fine = f"{what}, {mass:g} kg on 6 m", runs[-1]
        at = int(np.flatnonzero(fine.payout_rate == 0.0)[0]) - 1
        speed, tension = -float(fine.body_velocity[at, 2]), float(fine.tension_drum[at])
        spring, load = EA / 6.0, WEIGHT + 2.0 * MU * GRAVITY
        peak = load + sqrt((tension - load) ** 2 + spring * (BODY + 2.0 * MU) * speed**2)
        form = "spring and body from the state at the stop"
        rows.append(_row(f"{name}, largest tension, 10 ms", "N", runs[0].tension_drum.max(), peak, share, form))
        places = [
            np.interp(when, tick * np.arange(1, len(run) + 1), run.body_position[:, 2])
            for tick, run in zip(ticks, runs)
        ]
        apart = [float(np.abs(place - places[-1]).max()) for place in places[1:3]]
        name += ", place of the body, error of 5 over that of 2.5 ms"
        rows.append(
            _row(name, "", apart[0] / apart[1], 4.05, 0.2, "order 2, beside 0.3125 ms; 0.2: what is of order 3")
        )
    return rows


def deep(**values: Any) -> Scene:
    """A compensating winch with a light drum over 500 m of cable."""
    return hanging(
        LIGHT,
        498.0,
        tick=0.005,
        setpoint__algorithm="simplified_sheave",
        setpoint__washout_period=0.0,
        drive__bandwidth=20.0,
        drive__brake_set_time=0.01,
        contact__working_tension=2.2e4,
        contact__penetration_limit=0.01,
        mesh={"inboard": 2, "sections": {"all": {"elements": 60, "grading": 1.0}}},
        **values,
    )


def heaved(scene: Scene, seconds: float, heave=(HEAVE, WAVE), changes=()) -> np.recarray:
    """Tick outputs of so many seconds under a heave."""
    with quiet():
        return offline.run(scene, heave=heave, duration=seconds, step="fixed", changes=changes).frames


def emergency_rows(phases: int = PHASES) -> list[Comparison]:
    """The drum stops at every phase of the heave that it compensates: what wave theory says, and the brake's slip."""
    scene, tick = deep(), 0.005
    worst, place, twin = 0.0, 0.0, heaved(scene, 2.0 * WAVE + WAVE + 1.0)
    for k in range(phases):
        begin = 2.0 * WAVE + k * WAVE / phases
        after = heaved(scene, begin + BACK, changes=[(begin, "drive.mode", "emergency_stop")])
        first, last = (round((begin + s) / tick) for s in SOON)
        step = float((after.tension_drum[first:last] - twin.tension_drum[first:last]).mean())
        if step > worst:
            worst, place = step, k / phases
    begin = 2.0 * WAVE
    at = round(begin / tick)
    rate, tension = float(twin.payout_rate[at]), float(twin.tension_drum[at])
    strain = tension / EA
    wave = sqrt(EA * MU) * rate * (1.0 + strain)
    slips = tension + 0.5 * wave
    scene = deep(drive__brake_pull=slips / 0.8)
    weak = heaved(scene, 2.0 * begin, changes=[(begin, "drive.mode", "emergency_stop")]).tension_drum[at:]
    first, bears = "the same, a brake that slips, first peak", "least of wave theory and what the brake bears"
    name = f"emergency stop, worst of {phases} phases of heave, step of the tension"
    return [
        _row(name, "N", worst, wave, 0.03, "sqrt(EA mu) v"),
        Comparison("that phase, of a period after the ship rises fastest", "", place, 0.0, 0.01, "v largest"),
        _row(first, "N", weak[: round(BACK / tick)].max(), min(tension + wave, slips), 0.01, bears),
        _row("the same, largest tension in 16 s", "N", weak.max(), slips / 0.8, 0.03, "the brake's hold"),
    ]


def delay_rows(delays=DELAYS) -> list[Comparison]:
    """What a dead time leaves of a heave of 1 m that an ideal servo compensates."""
    rows = []
    for delay in delays:
        scene = hanging(
            LIGHT,
            498.0,
            setpoint__algorithm="simplified_sheave",
            setpoint__washout_period=0.0,
            drive__model="servo",
            winch__proportional_gain=5000.0,
            winch__derivative_gain=5000.0,
            drive__dead_time=delay,
        )
        frames = heaved(scene, 28.0, (1.0, PERIOD))[-1200:]
        left = frames.sheave_position[:, 2] - frames.payout
        expected = 2.0 * sin(pi * delay / PERIOD)
        found = amplitude_at(left, 1e-9 * (frames.time - frames.time[0]), PERIOD)
        name = f"residual of 1 m of heave in {PERIOD:g} s, {1e3 * delay:g} ms of dead time"
        rows.append(_row(name, "m", found, expected, 0.01, "2 sin(w tau / 2)"))
    return rows


def render_row() -> Comparison:
    """The tow of full_scale under heave, its drum pays out above the set pull."""
    drive = {"model": "motor", "inertia": 50.0 * 0.305**2, "mode": "render", "set_pull": SET_PULL}
    drive |= {"curve_speed": [0.0, 6.0], "curve_pull": [2e4, 1e4]}
    scene = scene_with("full_scale", {f"drive.{key}": value for key, value in drive.items()})
    frames = heaved(scene, 20.0, (2.0, 5.0))
    name, late = "render, full_scale, heave of 2 m in 5 s, largest tension", frames.tension_drum[800:]
    return _row(name, "N", late.max(), SET_PULL, 0.02, "drive.set_pull")


def experiment(progress, quick: bool = False) -> Result:
    """All of it, each row as long as its closed form needs; quick: pendulum, overhauling load, heat and dead time."""
    parts = (
        ("free drum", free_rows),
        ("pendulum", lambda: [pendulum_row()]),
        ("stops", stop_rows),
        ("overhauling load", overhauling_rows),
        ("heat", lambda: [heat_row()]),
        ("emergency stop", emergency_rows),
        ("dead time", delay_rows),
        ("render", lambda: [render_row()]),
    )
    if quick:
        parts = tuple(part for part in parts if part[0] in QUICK_PARTS)
    rows: list[Comparison] = []
    for k, (what, make) in enumerate(parts):
        progress(what, k, len(parts))
        rows += make()

    return Result("drive", rows, [], picture)


def picture(folder: Path) -> Path:
    """Tension at the drum as its brake sets under load, by steps."""
    path, ticks = folder / "drive.png", (TICK, 0.5 * TICK, FINEST)
    with canvas(path, (10.0, 6.0), source="experiment drive of `cable-sim validate`") as figure:
        axis = figure.subplots()
        for tick, run in zip(ticks, stops("brake sets under load", ticks, 200.0)):
            axis.plot(tick * np.arange(1, len(run) + 1), 1e-3 * run.tension_drum, label=f"{1e3 * tick:g} ms")
        axis.set(title="Emergency stop: drum of 200 kg, 6 m of cable, 2.5 t")
        axis.set(xlabel="time since the stop [s]", ylabel="tension at the drum [kN]")
        axis.legend()
    return path
