"""Logs made from a run of a shipped scene under a shipped bag, with known errors: each is found within its interval.

`python test/runs/scores/test_made_logs.py` prints what is known and found as a table.

The 95 % intervals hold what they say, over seeds: 20 of them; below 16 has a probability of 3e-3 at 95 %.

The lag and clock intervals are of nine groups of segments that overlap: they held 92 of 100, so 14 are asked of them.
"""

import numpy as np
import pytest
from score_seas import EPOCH, sea, signal

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.io.sources.recorded_tow import RecordedTow, read_tow
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.message_run import MessageRun
from cable_sim_ros.tools.compare.alignment import clock_of
from cable_sim_ros.tools.compare.comparison import compare
from cable_sim_ros.tools.compare.score import score
from cable_sim_ros.tools.logs.own_signals import Signal, signals_of_frames

SEEDS = 20

POUND = 4.4482216
SECONDS = 564.0  # the whole of the bag; a drift is looked for in six minutes or more
# rate [Hz], gain, bias [SI], lag of the log's clock [s], its drift [ppm], noise [SI], resolution and unit of the log
LOGS = {
    "load cell": ("tension", 10.0, 0.95, 40.0, 2.35, 0.0, 5.0, 1.0, 1.0),
    "reversed, in lbf": ("tension", 5.0, 1.02, 0.0, -7.2, 0.0, 2.0, 0.5, -POUND),
    "rate in m/min": ("payout_rate", 20.0, 1.04, 0.02, 12.8, 80.0, 0.02, 0.01, 1.0 / 60.0),
}


@pytest.fixture(scope="module")
def held():
    """Figure -> (held, half width) of each seed; 300 s at 5 Hz, noise in both."""
    found = {name: [] for name in ("bias", "gain", "rms", "lag", "clock")}
    for seed in range(SEEDS):
        rng = np.random.default_rng(1000 + seed)
        time, x = sea(seed, 300.0, 5.0)
        n = len(time)
        measured = 3000.0 + 30.0 * x + 3.0 * rng.standard_normal(n)
        simulated = 3010.0 + 32.0 * x + 3.0 * rng.standard_normal(n)
        later = 3010.0 + 32.0 * sea(seed, 300.0, 5.0, lag=0.25)[1] + 3.0 * rng.standard_normal(n)
        one = score(signal(time, measured), signal(time, simulated))
        two = score(signal(time, measured), signal(time, later))
        three = clock_of(signal(time, measured), signal(time + 11.1, later), EPOCH)
        for name, interval, value in (
            ("bias", one.intervals["bias"], 10.0),
            ("gain", one.intervals["gain"], 32.0 / 30.0),
            ("rms", one.intervals["rms"], np.sqrt(100.0 + 4.0 + 18.0)),
            ("lag", two.intervals["lag_s"], 0.25),
            ("clock", three.interval, 11.35),
        ):
            found[name].append((interval[0] <= value <= interval[1], 0.5 * (interval[1] - interval[0])))
    return {name: np.array(rows, float) for name, rows in found.items()}


@pytest.mark.parametrize(
    "name, least, widest",
    [("bias", 16, 0.6), ("gain", 16, 0.04), ("rms", 16, 0.6), ("lag", 14, 0.03), ("clock", 14, 0.03)],
)
def test_the_interval_holds_the_truth_and_is_not_wide(held, name, least, widest):
    assert held[name][:, 0].sum() >= least
    assert np.median(held[name][:, 1]) < widest


def log_of(signal, rate, gain, bias, lag, ppm, noise, resolution, unit, seed=0):
    """What an instrument would have logged: about its mean times a gain, plus a bias, on a clock of its own."""
    rng = np.random.default_rng(seed)
    time = (signal.time - signal.time[0]) * 1e-9
    at = np.arange(0.0, time[-1], 1.0 / rate)
    value = np.interp(at, time, signal.value)
    value = value.mean() + gain * (value - value.mean()) + bias + noise * rng.standard_normal(len(at))
    value = np.round(value / unit / resolution) * resolution
    stamp = at + lag + 1e-6 * ppm * (at - at.mean())
    return Signal(signal.quantity, signal.time[0] + np.round(stamp * 1e9).astype(np.int64), value, "log")


def rows():
    """Log -> (known, found, interval) by name, and the verdict."""
    tow = read_tow(offline.find_bag("nbp1406"))  # its odometry, at 10 Hz
    thin = RecordedTow(tow.path, [event for event in tow.events if event.kind == "odometry"][::5])
    frames = MessageRun(offline.stepped(load_scene("full_scale"), None, 0.05), thin).run(SECONDS, None).frames
    signals = {one.quantity: one for one in signals_of_frames(frames, "run")}
    found = {}
    for name, (quantity, rate, gain, bias, lag, ppm, noise, resolution, unit) in LOGS.items():
        run = signals[quantity]
        log = log_of(run, rate, gain, bias, lag, ppm, noise, resolution, unit)
        result = compare([log], list(signals.values()), "log", "run", align="all")
        one, clock = result.scores[0], result.clock
        got = {
            "gain": (1.0 / gain, one.figures["gain"], one.intervals["gain"]),
            "lag": (-lag, clock.lag, clock.interval),
        }
        if unit == 1.0 or quantity == "payout_rate":  # a nominal unit of a reversed force moves its mean too
            got["bias"] = (-bias, one.figures["bias"], one.intervals["bias"])
        if ppm:
            got["drift"] = (-ppm, clock.drift_ppm, clock.drift_interval)
        found[name] = (got, result)
    return found


@pytest.fixture(scope="module")
def scored():
    return rows()


@pytest.mark.parametrize("name", LOGS)
def test_the_known_errors_are_found_within_their_intervals(scored, name):
    for what, (known, value, interval) in scored[name][0].items():
        assert interval[0] <= known <= interval[1], (what, known, value, interval)


def test_sign_and_unit_are_named_and_the_verdict_is_doubtful(scored):
    texts = {name: " ".join(one.text for one in result.doubts) for name, (_, result) in scored.items()}
    assert "sign reversed" in texts["reversed, in lbf"] and "A is in lbf (4.448)" in texts["reversed, in lbf"]
    assert "A is in m/min" in texts["rate in m/min"]
    assert "times" not in texts["load cell"]
    assert all(result.verdict.code == 4 for _, result in scored.values())


if __name__ == "__main__":
    print("| log | error | known | found | 95 % interval |\n|---|---|---|---|---|")
    for name, (got, result) in rows().items():
        for what, (known, value, (low, high)) in got.items():
            unit = {"gain": "", "lag": " s", "bias": " N" if name == "load cell" else " m/s", "drift": " ppm"}[what]
            print(f"| {name} | {what} | {known:.4g}{unit} | {value:.4g} | {low:.4g} to {high:.4g} |")
        for one in [one for found in result.found if found.applied for one in found.findings]:
            print(f"| {name} | {one.kind} | | {one.text} | |")
