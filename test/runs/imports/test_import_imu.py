"""An IMU that tells no orientation: attitude by a filter, heave left to the run."""

import sys

import numpy as np
import pytest
from made_tables import mapping, ship, told

from cable_sim_ros.io.messages.messages import decode_imu
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.tools.logs.imports.attitude import upright
from cable_sim_ros.tools.logs.imports.import_logs import import_logs
from cable_sim_ros.tools.logs.log import LogError
from cable_sim_ros.tools.logs.own_signals import Signal

VECTORS = ("rates: [p,q,r] rad/s frame: flu", "acceleration: [ax,ay,az] m/s^2 frame: flu")


def imu(path, t, up=1.0):
    """A ship that rolls by 5 deg in 12 s and pitches by 2 deg in 9 s, without other accelerations."""
    w, v = 2.0 * np.pi / 12.0, 2.0 * np.pi / 9.0
    roll, pitch = np.radians(5.0) * np.sin(w * t), np.radians(2.0) * np.sin(v * t)
    turned, tilted = np.radians(5.0) * w * np.cos(w * t), np.radians(2.0) * v * np.cos(v * t)
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    rates = {"p": turned, "q": cr * tilted, "r": -sr * tilted}
    return ship(path, t, **rates, ax=-9.81 * sp, ay=9.81 * sr * cp, az=up * 9.81 * cr * cp)


def made(log):
    done = import_logs(log, log.parent / "bag", mapping(log.parent, *VECTORS), force=True)
    events = [event for event in read_tow(log.parent / "bag").events if event.kind == "imu"]
    return done, [decode_imu(event.data) for event in events]


def test_attitude_comes_of_rates_and_accelerations_anew_after_a_gap(tmp_path):
    """0.3 deg: of the filter's default, from a still start; behind 30 days of silence nothing is drawn out."""
    pytest.importorskip("vqf")
    t = np.arange(0.0, 80.0, 0.1)
    done, found = made(imu(tmp_path / "a.csv", t + np.where(t >= 40.0, 2.6e6, 0.0)))
    assert done.figures["motion"] == "imu" and len(found) == len(t)
    phase = np.where(t >= 40.0, 2.6e6, 0.0) + t
    for k, (size, period) in enumerate(((5.0, 12.0), (2.0, 9.0))):
        angle = np.degrees([one.angles[k] for one in found])
        off = angle - size * np.sin(2.0 * np.pi * phase / period)
        assert np.sqrt(np.mean(off**2)) < 0.3, (k, np.abs(off).max())
    assert np.isclose([one.force[2] for one in found], 9.81, atol=0.05).all()
    for words in (
        ("attitude", "VQF"),
        ("1 gaps, after each the filter begins anew",),
        ("yaw: relative",),
        ("heave: not in the log",),
    ):
        assert told(done.assumed, *words), (words, done.assumed)


@pytest.mark.parametrize("own", [False, True])
def test_a_bag_in_ned_without_a_mapping_that_says_so_is_refused(tmp_path, own):
    """Of the ready mapping whatever it is used for; of one's own, where nothing is made of it, it is said."""
    t = np.arange(0.0, 20.0, 0.1)
    one = 1_000_000_000
    signals = [
        Signal(name, one * 1000 + np.round(t * one).astype(np.int64), value, "bag")
        for name, value in (("acceleration_z", -9.8 + 0.1 * np.sin(t)), ("heave", np.sin(t)), ("roll", 0.1 * np.sin(t)))
    ]
    found = {signal.quantity: signal for signal in signals}
    if own:
        assert told(upright(found, False), "-9.8 m/s^2 in the mean", "it is not used")
    else:
        with pytest.raises(LogError, match="axes are turned .NED.*nothing was imported. Give a mapping .*frame: frd"):
            upright(found, True)


def test_what_no_attitude_can_be_made_of_is_one_line(tmp_path, monkeypatch):
    pytest.importorskip("vqf")
    with pytest.raises(LogError, match="rates come at 2 Hz, below 5 Hz no attitude is made of them; nothing was imp"):
        made(imu(tmp_path / "a.csv", np.arange(0.0, 60.0, 0.5)))
    with pytest.raises(LogError, match="is -9.79 m/s.2 in the mean, .* axes are turned .*; nothing was imported"):
        made(imu(tmp_path / "a.csv", np.arange(0.0, 60.0, 0.1), up=-1.0))
    with pytest.raises(LogError, match="have no 5 s without a gap"):
        t = np.arange(0.0, 60.0, 0.1)
        made(imu(tmp_path / "a.csv", t + 10.0 * np.floor(t / 3.0)))
    monkeypatch.setitem(sys.modules, "vqf", None)
    with pytest.raises(LogError, match="vqf, which is not installed; nothing was imported. pip install"):
        made(imu(tmp_path / "a.csv", np.arange(0.0, 20.0, 0.1)))
    assert not (tmp_path / "bag").exists()
