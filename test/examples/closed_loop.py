"""The figures of docs/closed_loop.md: python test/examples/closed_loop.py [--seconds 100] [--only lockstep]

Recorded ship motion nbp1406 into full_scale: the winch held, the built-in set-point, and heave_compensator.py beside
the node, in lockstep and in real time, with dead times of the drive added. Needs a machine that does little else.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

from cable_sim_ros.testing import tow

CONTROLLER = Path(__file__).with_name("heave_compensator.py")
ANGLE = np.radians(78.0)
SKIP = 20.0  # s that do not count: static start, the controller's ramp
DELAYS = (0.05, 0.1, 0.2, 0.4)  # s
TAUS = np.arange(-0.05, 0.6, 0.001)


def run(mode, seconds, law="hold", rate=0, delay=0.0):
    """Tick outputs after SKIP, simulated over wall time, and the task `command` of /diagnostics at the end."""
    parameters = {"setpoint.algorithm": law, "winch.command_delay": delay}
    if mode == "lockstep" and rate:
        parameters["lockstep.command_period"] = 1.0 / rate
    with tow("full_scale", mode=mode, parameters=parameters) as sim:
        if rate:
            sim.run([sys.executable, CONTROLLER, rate, "--ros-args", "-p", f"use_sim_time:={mode == 'lockstep'}"])
        begin = sim.feed("nbp1406", start=20.0, duration=seconds + 5.0)
        sim.advance(1.0)
        begun = time.monotonic()
        frames = sim.wait_until(lambda frames: frames.time[-1] * 1e-9 > begin + seconds, within=seconds + 10, every=1.0)
        speed = (seconds - 1.0) / (time.monotonic() - begun)
        time.sleep(1.2)  # until /diagnostics has said so
        said = sim.diagnostics["command"][2]
    seconds_of = frames.time * 1e-9
    return frames[(seconds_of > begin + SKIP) & (seconds_of <= begin + seconds)], speed, said, sim.metrics


def spectrum(values):
    """Pulsation [rad/s] and spectrum of a signal of 100 Hz, of waves of 1.5 to 30 s."""
    w = 2.0 * np.pi * np.fft.rfftfreq(len(values), 0.01)
    waves = (w > 2.0 * np.pi / 30.0) & (w < 2.0 * np.pi / 1.5)
    return w[waves], np.fft.rfft((values - values.mean()) * np.hanning(len(values)))[waves]


def lateness(frames):
    """By how many seconds the pay-out follows the sheave along the cable: least squares over waves below 5 s.

    Longer ones are led: by every filter that takes the mean speed out, 0.1 s at 10 s.
    """
    track = frames.ship_velocity[:, :2].mean(axis=0)
    ahead = frames.sheave_velocity[:, :2] @ (track / np.hypot(*track))
    w, speed = spectrum(ahead * np.sin(ANGLE) + frames.sheave_velocity[:, 2] * np.cos(ANGLE))
    _, payout = spectrum(frames.payout_rate)
    short = w > 2.0 * np.pi / 5.0
    w, speed, payout = w[short], speed[short], payout[short]
    return float(min(TAUS, key=lambda tau: np.square(abs(payout - speed * np.exp(-1j * w * tau))).sum()))


def lost(held, tau):
    """Share of the compensation that a lateness costs: 2 sin(w tau / 2) of each wave in the held winch's tension."""
    w, tension = spectrum(held.tension)
    power = np.square(abs(tension))
    return float(np.sqrt((power * np.square(2.0 * np.sin(0.5 * w * tau))).sum() / power.sum()))


def row(name, mode, held, frames, speed, said, metrics):
    """One row of the table; held: tick outputs with the winch held."""
    late = lateness(frames) if np.ptp(frames.payout) > 0.01 else None
    age = frames.command_age[frames.command_age >= 0.0]
    return {
        "run": name,
        "mode": mode,
        "tension_std": float(frames.tension.std()),
        "tension_most": float(frames.tension.max()),
        "left": float(frames.tension.std() / held.tension.std()),
        "late_ms": None if late is None else 1e3 * late,
        "lost": None if late is None else lost(held, max(late, 0.0)),
        "command_age_ms": float(1e3 * age.mean()) if len(age) else None,
        "lag_ms": float(said["lag_ms"]) if said.get("lag_clock") == "motion" else None,
        "speed": speed,
        "missed_ticks": metrics.get("missed_ticks"),
    }


def show(one):
    """A row as Markdown."""
    cells = [one["run"], one["mode"], f"{one['tension_std']:.1f}", f"{one['tension_most']:.0f}", f"{one['left']:.1%}"]
    for key, form in (("late_ms", "{:.0f}"), ("lost", "{:.1%}"), ("command_age_ms", "{:.1f}"), ("lag_ms", "{:.1f}")):
        cells.append("-" if one[key] is None else form.format(one[key]))
    print("| " + " | ".join([*cells, f"{one['speed']:.1f}", str(one["missed_ticks"])]) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=100.0)
    parser.add_argument("--only", choices=["realtime", "lockstep"])
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    runs = [("hold", "lockstep", {}), ("simplified_sheave, built in", "lockstep", {"law": "simplified_sheave"})]
    for mode in ("lockstep", "realtime"):
        runs += [(f"PD, {rate} Hz", mode, {"rate": rate}) for rate in (50, 100)]
    runs += [(f"PD, 100 Hz, + {1e3 * delay:.0f} ms", "lockstep", {"rate": 100, "delay": delay}) for delay in DELAYS]
    print("| run | mode | std [N] | largest [N] | left | late [ms] | lost | age [ms] | lag [ms] | speed | missed |")
    print("|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    rows, held = [], None
    for name, mode, options in runs:
        if held is None or given.only in (None, mode):
            found = run(mode, given.seconds, **options)
            held = found[0] if held is None else held
            rows.append(row(name, mode, held, *found))
            show(rows[-1])
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
