"""Set-point laws and the towbody's heading in whole tows: nothing is torn off, nothing jumps, no sign is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from courses import level

from cable_sim_ros import Simulator
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs import offline
from verification.shipped import started
from verification.stress.tows import shipped

SETTLED = 2000  # ticks of the start that statistics leave out


def seen(frames: np.recarray, flag: Flag) -> float:
    """Share of the ticks with a flag."""
    return float(np.mean((frames.status & flag) != 0))


@pytest.mark.parametrize("scene", ["full_scale", pytest.param("full_scale_contact", marks=pytest.mark.nightly)])
@pytest.mark.parametrize("law", ["simplified_waterline", "rigorous_waterline"])
def test_a_waterline_law_on_a_flat_tow_does_not_destroy_it(scene, law):
    """Recorded motion, 78 deg: halted after 12 s with 102 kN, or ran on beside the sheave with 21 kN."""
    run = offline.run(scene, "nbp1406", duration=40.0, algorithm=law)
    assert run.problem == "" and len(run.frames) == 4000
    assert seen(run.frames, Flag.SLACK | Flag.DETACHED) == 0.0
    assert 1000.0 < run.frames.tension.min() and run.frames.tension.max() < 6000.0
    assert seen(run.frames[SETTLED:], Flag.SETPOINT_LIMITED) > 0.9


@pytest.mark.parametrize("tick", [0.01, pytest.param(0.0025, marks=pytest.mark.nightly)])
def test_the_measured_angle_does_not_rattle_the_winch(tick):
    """Winch acceleration and tension as with the constant angle, whatever the step; were 8 and 1.7 times as much."""
    maximum, std = [], []
    for law in ("simplified_sheave", "rigorous_sheave"):
        frames = offline.run("full_scale", "nbp1406", duration=30.0, algorithm=law, step="fixed", every=tick).frames
        kept = frames[round(20.0 / tick) :]
        maximum.append(float(np.abs(kept.payout_acceleration).max()))
        std.append(float(kept.tension.std()))
        assert seen(frames, Flag.SETPOINT_LIMITED) == 0.0
    assert maximum[0] < 0.8 and maximum[1] < 1.2 * maximum[0]
    assert std[1] < 1.3 * std[0]


def moved(sim: Simulator, seconds: float, place) -> np.recarray:
    """Push ship motion place(t) [m, three of them] sampled at 50 Hz, go on by ``seconds``; returns the tick outputs."""
    begin, tick = float(sim.frame.time) * 1e-9, sim.scene.solver.tick
    frames = []
    for first in np.arange(begin, begin + seconds - 1e-9, 10.0):
        length = min(10.0, begin + seconds - first)
        for t in np.arange(first, first + length + 0.1, 0.02):
            stamp = round(t * 1e9) + 1
            if stamp <= getattr(sim, "_pushed", -1):
                continue
            sim._pushed = stamp
            speed = [(b - a) / 2e-4 for a, b in zip(place(t - 1e-4), place(t + 1e-4), strict=True)]
            sim.push(level(stamp, place(t), speed))
        frames.append(sim.run(round(length / tick)))
    return np.concatenate(frames).view(np.recarray)


def test_another_law_under_way_is_taken_up_without_a_jump():
    """Heave of 1.2 m in 8 s; each change at an instant at which the sheave is high. Was 20 m/s^2 and 4954 N."""
    sim = started(shipped("full_scale", solver__tick=0.02, ship__start_blend=2.0))

    def place(t):
        return (2.2 * t, 0.0, 1.2 * np.sin(2.0 * np.pi / 8.0 * t))

    frames = [moved(sim, 18.0, place)]
    for law in ("hold", "simplified_sheave", "simplified_waterline", "rigorous_sheave"):
        sim.set_algorithm(law)
        frames.append(moved(sim, 16.0, place))
    held, whole = frames[1][-200:], np.concatenate(frames).view(np.recarray)
    assert np.abs(whole.payout_acceleration).max() < 2.0
    assert np.abs(np.diff(whole.tension)).max() < 100.0 and whole.tension.max() < 5000.0
    assert np.ptp(held.payout) < 1e-3 and held.payout[-1] == pytest.approx(450.0 + 8.04, abs=0.1), "back where it began"


def test_under_a_cable_that_leads_forward_compensation_has_the_right_sign():
    """Ship at rest, current of 1 m/s from astern, surge of 1 m in 8 s: the law takes most of the tension's swing."""
    std = {}
    for law in ("hold", "simplified_sheave", "rigorous_sheave"):
        sim = started(
            shipped(
                "side_scan",
                ship__tow_speed=0.0,
                water__current=[1.0, 0.0],
                setpoint__algorithm=law,
                setpoint__washout_period=0.0,
                solver__tick=0.02,
                ship__start_blend=2.0,
            )
        )
        assert sim.frame.body_position[0] > sim.frame.sheave_position[0] + 20.0, "ahead of the sheave"
        assert sim.state.now.setpoint.angle == pytest.approx(-sim.frame.departure_angle, abs=1e-6)
        assert sim.frame.departure_angle > 0.3
        frames = moved(sim, 30.0, lambda t: (np.sin(2.0 * np.pi / 8.0 * t), 0.0, 0.0))
        std[law] = float(frames.tension[-800:].std())
        assert seen(frames, Flag.SLACK | Flag.DETACHED) == 0.0
    assert std["simplified_sheave"] < 0.4 * std["hold"] and std["rigorous_sheave"] < 0.4 * std["hold"]


def yaw_of(frame) -> float:
    """Heading of the towbody [rad]; it is level."""
    x, y, z, w = frame.body_quaternion
    assert abs(x) < 1e-12 and abs(y) < 1e-12, "level, as the forces have it"
    return float(2.0 * np.arctan2(z, w))


def test_the_body_starts_with_the_heading_of_the_flow_at_its_depth():
    """Current of 2 m/s across at the surface that has turned with the depth: it stays as it starts."""
    sim = started(
        shipped("side_scan", water__current=[0.0, 1.0], water__current_gradient=[0.0, -0.02], solver__tick=0.02)
    )
    depth = -float(sim.frame.body_position[2])
    flow = np.array((-2.06, 1.0 - 0.02 * depth))
    assert yaw_of(sim.frame) == pytest.approx(np.arctan2(-flow[1], -flow[0]), abs=1e-3)
    surface = np.arctan2(-1.0, 2.06)
    assert abs(yaw_of(sim.frame) - surface) > 0.3
    frames = sim.run(500)
    assert yaw_of(frames[-1]) == pytest.approx(yaw_of(sim.frame), abs=2e-3)
    assert np.abs(frames.body_rate).max() < 1e-3


def test_a_ship_that_goes_astern_turns_its_body_slowly():
    """From 1 m/s ahead to 1 m/s astern in 40 s: the heading is held where the flow dies, then turns in its own time."""
    sim = started(shipped("side_scan", ship__tow_speed=1.0, solver__tick=0.05, ship__start_blend=2.0))

    def place(t):
        s = min(max(t - 10.0, 0.0), 40.0)
        return (t - s * s / 40.0 - 2.0 * max(t - 50.0, 0.0), 0.0, 0.0)

    frames = moved(sim, 150.0, place)
    assert np.abs(frames.body_rate).max() <= 0.5 * np.pi / 5.0 + 1e-9  # rad/s; was 326
    assert seen(frames, Flag.LOW_FLOW) > 0.0
    turned = np.unwrap([yaw_of(f) for f in frames[::20]])
    assert np.abs(np.diff(turned)).max() < 0.35


def test_in_a_steady_turn_the_added_mass_across_does_not_count():
    """2 m/s round 60 m, a body that follows the flow at once: 2000 kg across, 133 N outward, took it 7.2 m out."""
    speed, radius, out = 2.0, 60.0, {}
    for across in (10.0, 2000.0):
        sim = started(
            shipped(
                "side_scan",
                ship__tow_speed=speed,
                winch__scope=80.0,
                sheave__groove_depth=0.3,
                towbody__drag_area=[0.015, 5.0, 0.2],
                towbody__added_mass=[10.0, across, 10.0],
                cable__mean_flow_time=10.0,
                towbody__flow_time_constant=0.2,
                solver__tick=0.05,
                ship__start_blend=2.0,
            )
        )
        rate, frames = speed / radius, []
        for k in range(301):
            t = 1.0 * k
            yaw = rate * max(t - 2.0, 0.0) if k else 0.0
            place = (radius * np.sin(yaw) + speed * min(t, 2.0), radius * (1.0 - np.cos(yaw)), 0.0)
            velocity = (speed * np.cos(yaw), speed * np.sin(yaw), 0.0)
            turning = rate if t >= 2.0 else 0.0
            sim.push(level(round(t * 1e9) + 1, place, velocity, yaw, turning))
            if k > 1:
                frames.append(sim.run(20)[-1:])
        last = np.concatenate(frames[-40:]).view(np.recarray)
        away = np.hypot(last.body_position[:, 0] - 2.0 * speed, last.body_position[:, 1] - radius)
        assert np.ptp(away) < 0.05, "steady"
        assert last.body_rate[-1, 2] == pytest.approx(rate, rel=1e-3)
        out[across] = float(away.mean())
    assert out[2000.0] == pytest.approx(out[10.0], abs=0.1)


CALM = "full_scale", "full_scale_contact", "full_scale_westin", "lowered_ctd", "recovery_3t", "side_scan"


@pytest.mark.nightly
@pytest.mark.parametrize(
    "name, heave, moved, slackened",
    [
        *((name, 1.0, 0.05, 1e-3) for name in ("full_scale", "side_scan", "lowered_ctd")),
        *((name, 0.05, 0.05, 1e-3) for name in CALM),
        ("flume", 0.002, 1e-3, 1e-4),
    ],
)
def test_constant_tension_holds_for_half_an_hour(name, heave, moved, slackened):
    """By chosen steps: means of a wave before 10, 20 and 30 minutes; with a return of 60 s it ran away."""
    every = 0.05 if name == "recovery_3t" else 0.1  # its rules read at 20 Hz
    how = {"duration": 1800.0, "step": "chosen", "every": every, "algorithm": "constant_tension"}
    run = offline.run(name, heave=(heave, 8.0), **how)
    ends = [slice(round((end - 8.0) / every), round(end / every)) for end in (600.0, 1200.0, 1800.0)]
    payout, tension = (
        np.array([field[part].mean() for part in ends]) for field in (run.frames.payout, run.frames.tension)
    )
    assert run.problem == "" and not any(reason.flag == "SETPOINT_DRIFT" for reason in run.verdict.reasons)
    assert np.ptp(payout) < moved and np.ptp(tension) / tension[0] < slackened
