"""Friction of a whole tow on its sheave and drum: what the keys do, what they are refused for, what they cost."""

from __future__ import annotations

import re
from math import cos, exp, pi, sin
from typing import NamedTuple

import numpy as np
import pytest
from underway import at_rate, cautioned, refused, sail, scene_with

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.contact_surface import SHEAVE_ROW
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.runs.verdict import judge
from cable_sim_ros.sim.checks.friction_checks import may_miss
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.live_parameters import set_live
from cable_sim_ros.sim.statics.route import Route
from verification.experiments.drum import hanging
from verification.shipped import started

pytestmark = pytest.mark.trust

STANDS = {"sheave.friction": 0.1, "sheave.bearing_friction": 10.0}
TURNS = {"sheave.friction": 0.1, "sheave.bearing_friction": 0.02}
RATE, SPAN_WEIGHT = 0.5, 3.816  # m/s, N/m


class Haul(NamedTuple):
    scene: object
    frames: np.ndarray

    @property
    def end(self) -> np.ndarray:
        return self.frames[-50:]

    def mean(self, name: str) -> float:
        return float(self.end[name].mean())

    @property
    def log_ratio(self) -> float:
        return float(np.log(self.end["tension_drum"] / self.end["tension"]).mean())

    @property
    def wrap(self) -> float:
        """Turn of the cable over the sheave: from the chord to the drum and its sag to the departing cable."""
        sag = 0.5 * SPAN_WEIGHT * Route(self.scene).span / self.mean("tension_drum")
        return 0.5 * pi - self.mean("departure_angle") + Route(self.scene).tilt + sag


@pytest.fixture(scope="module")
def haul():
    """A tow under a ship that goes straight on, its winch at a rate [m/s] for some seconds."""
    done = {}

    def made(changes: dict, rate: float = -RATE, name: str = "full_scale", seconds: float = 4.0) -> Haul:
        key = (name, rate, seconds, *changes.items())
        if key not in done:
            scene = scene_with(name, setpoint__algorithm="hold", **changes)
            done[key] = Haul(scene, at_rate(started(scene), rate, round(100 * seconds), 10))
        return done[key]

    return made


@pytest.mark.parametrize("rate", [-RATE, RATE], ids=["hauls", "pays_out"])
@pytest.mark.parametrize("changes, per_radian", [(STANDS, 0.1 / sin(pi / 6)), (TURNS, 0.02)], ids=["stands", "turns"])
def test_the_drum_bears_more_hauling_in_and_less_paying_out(haul, changes, per_radian, rate):
    """By Euler's ratio over the turn of the cable, within 3 % of its logarithm: the wrap is known to its sag."""
    free, rubs = haul({}, rate), haul(changes, rate)
    log_ratio = -np.sign(rate) * (rubs.log_ratio - free.log_ratio)
    assert log_ratio == pytest.approx(per_radian * rubs.wrap, rel=0.03)
    force = rubs.mean("tension_drum") - rubs.mean("tension") - free.mean("tension_drum") + free.mean("tension")
    assert rubs.mean("sheave_friction") == pytest.approx(force, rel=0.03, abs=1.0)
    assert rubs.mean("tension") == pytest.approx(free.mean("tension"), rel=1e-3), "outboard nothing changes"
    assert rubs.frames["iterations"].sum() <= 1.1 * free.frames["iterations"].sum(), "as hard to solve as without"


@pytest.mark.parametrize("height", [0.6, -9.4], ids=["quarter turn", "near half a turn"])
def test_a_bearing_bears_the_resultant_of_both_sides(height):
    """Drum level with the sheave or 10 m below it: journal friction of |T1 + T2|, their vectors. The sum of the radial
    loads, T times the wrap, is 11 % more at 90 deg and 57 % at 180."""
    bearing = 0.05
    rubs = {"sheave__friction": 0.3, "sheave__bearing_friction": bearing}
    scene = hanging(2000.0, 8.0, winch__position=[-34.8, 0.0, height], **rubs)
    sim = started(scene)
    sim.push(WinchCommand(rate=-0.1, time_ns=1))
    end = sim.run(200)[-50:]
    inner, outer = end["tension_drum"].mean(), end["tension"].mean()
    above = 0.6 - height  # and radii of 0.305 m and 0.255 m
    turn = 0.5 * pi + np.arctan2(above, 2.0) - np.arcsin(0.05 / np.hypot(2.0, above))
    resultant = np.sqrt(inner**2 + outer**2 - 2.0 * inner * outer * cos(turn))
    assert end["sheave_friction"].mean() == pytest.approx(bearing * resultant, rel=0.01)
    assert end["sheave_friction"].mean() == pytest.approx(inner - outer, rel=0.06)


def test_the_heat_is_the_friction_over_the_cable_that_ran_through(haul):
    rubs = haul(STANDS)
    heat, end = rubs.frames["friction_heat"], slice(-50, None)
    assert (np.diff(heat) >= 0.0).all()
    power = np.diff(heat[end]).mean() / rubs.scene.solver.tick
    assert power == pytest.approx(rubs.mean("sheave_friction") * RATE, rel=0.01)
    residual = [np.ptp(haul(changes).frames["energy_residual"][end]) for changes in ({}, STANDS)]
    assert residual[1] < 1.5 * residual[0] + 0.01 * power * 0.5, "the account closes as without"


def test_a_winch_that_reverses_under_a_sheave_that_stands():
    """Compensated heave: the drum feels every reversal, the cable outboard none, and steps stay as easy."""
    report = []
    for changes in ({}, STANDS):
        sim, frames, w = started(scene_with(**changes)), [], 2.0 * pi / 8.0
        for k in range(1600):
            t = 0.01 * (k + 2)
            sail(sim, t, 0.5 * sin(w * t), 0.5 * w * cos(w * t))
            if k % 20 == 19:
                frames.append(sim.run(20))
        report.append(np.concatenate(frames)[800:])
    free, rubs = report
    assert rubs["tension"].std() == pytest.approx(free["tension"].std(), rel=0.05)
    assert rubs["tension_drum"].std() > 2.0 * free["tension_drum"].std()
    swing = np.ptp(rubs["sheave_friction"])  # from one side to the other: twice the friction of a steady haul
    wrap = 0.5 * pi - rubs["departure_angle"].mean() + Route(sim.scene).tilt
    assert swing == pytest.approx(2.0 * rubs["tension"].mean() * (exp(0.2 * wrap) - 1.0), rel=0.15)
    assert rubs["iterations"].sum() < 1.25 * free["iterations"].sum()
    assert (rubs["substeps"] > 1).mean() < 0.01


def test_without_friction_no_bit_depends_on_its_other_numbers(haul):
    plain = haul({}, seconds=1.0).frames
    other = haul({"sheave.bearing_friction": 0.5, "contact.slip_speed": 0.1}, seconds=1.0).frames
    assert plain.tobytes() == other.tobytes()
    assert not plain["sheave_friction"].any() and not plain["friction_heat"].any()


def test_a_bearing_seizes_under_way():
    """Live: from the next tick on, kept by a start, without another compilation."""
    sim, report = started(scene_with(setpoint__algorithm="hold", **TURNS)), []
    for bearing in (0.02, 10.0):
        set_live(sim, "sheave.bearing_friction", bearing)
        at_rate(sim, -RATE, 150, 10)
        report.append(float(sim.frame["sheave_friction"]))
    assert report[1] == pytest.approx(10.0 * report[0], rel=0.1)  # 0.1/sin 30 deg over 0.02, at 3 % more tension
    sim.start()
    row = sim.state.surfaces[SHEAVE_ROW]
    assert (row.grip, row.bearing) == pytest.approx((0.1, 5.0)) and sim.scene.sheave.bearing_friction == 10.0


def test_a_drum_that_rubs_turns_with_its_cable(haul):
    """Cable wound on a drum goes with it: no heat to speak of, and the torque is that of the whole tension."""
    free = haul({}, name="full_scale_contact", seconds=2.0)
    rubs = haul({"winch.drum_friction": 0.1}, name="full_scale_contact", seconds=2.0)
    assert rubs.mean("tension_drum") == pytest.approx(free.mean("tension_drum"), rel=0.01)
    slides = RATE * 2.0 * rubs.mean("tension") * (1.0 - exp(-0.1 * 2.0 * pi))  # a turn that would slide
    assert 0.0 < rubs.frames["friction_heat"][-1] < 0.01 * slides
    lost = [np.abs(each.frames["energy_residual"]).max() for each in (free, rubs)]
    assert lost[1] < 10.0 * lost[0]


def test_friction_on_a_drum_that_feeds_is_refused():
    assert "winch.drum_friction = 0.2 has no effect: with winch.drum" in refused(scene_with, winch__drum_friction=0.2)


@pytest.mark.parametrize(
    "changes, text",
    [
        ({"sheave.friction": 0.1}, r"sheave.friction = 0.1 has no effect: .* turns with the cable.* 0.2 or more"),
        ({"sheave.bearing_friction": 0.02}, r"sheave.bearing_friction = 0.02 has no effect: .*give sheave.friction"),
        (TURNS | {"contact.slip_speed": 0.5}, r"contact.slip_speed = 0.5 m/s is more than 0.25 m/s, 0.05 of winch.m"),
    ],
)
def test_friction_that_acts_on_nothing_or_in_part_is_said(changes, text):
    assert re.search(text, "\n".join(cautioned(scene_with, **changes)))


def test_a_held_winch_is_said_to_have_its_friction_in_part():
    """T (exp(mu wrap / sin 30 deg) - 1) of the working tension; a law that moves the winch brings no such word."""
    (said,) = cautioned(scene_with, **STANDS, setpoint__algorithm="hold")
    assert "contact.slip_speed = 0.001 m/s: while the winch is held" in said and "up to 226 N at contact" in said
    assert not cautioned(scene_with, **STANDS)


def test_a_run_with_a_held_winch_is_doubtful_of_its_pull():
    """Slower than 3 slip speeds for more than a twentieth of the run; without friction, or hauling, it is ok."""
    held = scene_with(**TURNS)
    frames = np.zeros(100, TICK_OUTPUT).view(np.recarray)
    frames.time, frames.payout_rate, frames.scope = np.arange(100) * 10_000_000, 0.5, 450.0
    assert judge(frames, held).state == "ok"
    frames.payout_rate[:6] = -0.0029
    (reason,) = judge(frames, held).reasons
    assert reason.flag == "FRICTION_SLIP" and "for 6 % of the run" in reason.text
    assert "winch_pull_max_n" in reason.metrics
    tension = held.contact.working_tension
    wrap = (layout_of(held).leaves - layout_of(held).tangent) / layout_of(held).route.sheave
    assert may_miss(held) == pytest.approx(tension * (exp(held.sheave.bearing_friction * wrap) - 1.0))
    frames.payout_rate[5] = 0.0031
    assert judge(frames, held).state == "ok", "5 % are borne"
    frames.payout_rate = 0.0
    assert judge(frames, load_scene("full_scale")).state == "ok"


def test_the_drum_counts_with_what_may_be_missing():
    scene = scene_with("full_scale_contact", winch__drum_friction=0.1)
    assert may_miss(scene) == pytest.approx(scene.contact.working_tension * (1.0 - exp(-0.1 * scene.winch.wrap)))
