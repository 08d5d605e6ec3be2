"""A table with the resolution of a motion sensor tows as the exact one does: 188 N of noise were 20 N of signal."""

import numpy as np
import pytest

from cable_sim_ros.runs import offline

pytestmark = pytest.mark.trust
PERIOD, SECONDS = 7.0, 36.0
DIGITS = {"x_m": 2, "y_m": 2, "heave_m": 2, "roll_deg": 1, "pitch_deg": 1, "yaw_deg": 1}


def motion(path, rounded):
    """10 Hz of a regular wave in every coordinate, at 2.06 m/s; rounded: to 1 cm and 0.1 deg."""
    t = np.arange(0.0, SECONDS + 1.0, 0.1)
    sizes = {"x_m": (0.1, 0.5), "y_m": (0.05, 1.9), "heave_m": (0.15, 0.0), "roll_deg": (1.0, 2.3)}
    sizes |= {"pitch_deg": (0.3, 1.0), "yaw_deg": (0.2, 0.3)}
    columns = {name: size * np.sin(2.0 * np.pi * t / PERIOD + phase) for name, (size, phase) in sizes.items()}
    columns["x_m"] += 2.06 * t
    if rounded:
        columns = {name: np.round(values, DIGITS[name]) for name, values in columns.items()}
    rows = zip(t, *columns.values())
    path.write_text("\n".join([",".join(("time_s", *columns)), *(",".join(map(repr, map(float, r))) for r in rows)]))
    return path


def wave(frames):
    """Complex amplitude of the tension at the period of the waves, over the last two of them [N]."""
    kept = frames[-round(2.0 * PERIOD / 0.1) :]
    return np.mean(kept["tension"] * np.exp(-2j * np.pi * kept["time"] * 1e-9 / PERIOD))


def test_a_table_of_a_real_sensor_tows_as_the_exact_one(tmp_path):
    exact, rounded = (
        offline.run("side_scan", motion(tmp_path / f"{name}.csv", name == "rounded"), duration=SECONDS, step="chosen")
        for name in ("exact", "rounded")
    )
    assert rounded.metrics["tension_std_n"] == pytest.approx(exact.metrics["tension_std_n"], rel=0.05)
    seen = wave(rounded.frames) / wave(exact.frames)
    assert abs(seen) == pytest.approx(1.0, abs=0.05) and abs(np.degrees(np.angle(seen))) < 1.0
    report = {row["column"]: row["resolution"] for row in rounded.metrics["motion_rounded"]}
    assert report == pytest.approx({name: 10.0**-digits for name, digits in DIGITS.items()})
    assert sum("smoothed within its rounding" in note for note in rounded.metrics["notices"]) == 6
    # the made-up pitch goes against the surge, rounded or not; nothing else is doubted
    assert [[reason.flag for reason in run.verdict.reasons] for run in (rounded, exact)] == [["PITCH_SIGN"]] * 2
    assert "motion_rounded" not in exact.metrics
