"""What the steps miss of the peak of a snap: said with its size, beside a run of small steps."""

from __future__ import annotations

import re

import numpy as np

from cable_sim_ros import load_scene, override
from cable_sim_ros.runs.offline import run


def snapped(tick: float, scope: float = 10.0, heave: float = 1.5) -> tuple[float, str]:
    """Largest tension of a rosette near the surface under a ship that heaves, and what is said of its steps."""
    changes = {"winch.scope": scope, "solver.tick": tick, "setpoint.algorithm": "hold"}
    done = run(override(load_scene("lowered_ctd"), changes), heave=(heave, 4.0), duration=5.0, step="fixed")
    peak = float(np.fmax(done.frames.tension, done.frames.tension_tick_max).max())
    return peak, " ".join(reason.text for reason in done.verdict.reasons if reason.flag == "SNAP_STEP")


def test_a_snap_says_what_the_steps_miss_and_the_step_that_keeps_it():
    fine, nothing = snapped(0.0005)
    assert nothing == ""
    for tick in (0.02, 0.016):  # at 10 ms the tick of the peak may be halved, and its steps miss less
        peak, text = snapped(tick)
        found = re.search(r"may miss (\S+) N of it, (\S+) % \(limit 2 %\)\. Steps of (\S+) s keep it", text)
        assert found is not None and f"steps of {1e3 * tick:g} ms" in text
        missed, good = float(found[1]), float(found[3])
        assert 0.005 * fine < fine - peak < missed < 5.0 * (fine - peak)
    kept, said = snapped(good)
    assert good < 0.01 and said == "" and abs(kept - fine) < 0.02 * fine


def test_a_swell_that_leaves_the_cable_tight_is_no_snap():
    assert snapped(0.02, scope=100.0, heave=0.5)[1] == ""
