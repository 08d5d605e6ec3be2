"""The solid sheave: flank, round rim and cheek of its two halves, and what leaving it means."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cable_sim_ros.lab.stress.sheave_depth import depth
from cable_sim_ros.physics.contact import latch, loads, touch, touch_drum
from cable_sim_ros.physics.surface import AXIS, CREST, RIM, SPIN, TOP, beside, margin, surface_row
from cable_sim_ros.physics.tow import pierced

STIFFNESS, SEAT = 1e9, 0.255
ROW = surface_row((0, 0, 0), SEAT, np.pi / 3, 0.01, 0.008, STIFFNESS, 0.0)
ROW[AXIS + 1] = 1.0
WIDTH = ROW[CREST] + ROW[RIM]
AROUND = (st.floats(-1.2 * WIDTH, 1.2 * WIDTH), st.floats(-0.1, 1.2 * ROW[TOP]))


def looked(y: float, h: float):
    return touch((0.0, y, SEAT + h), (0.0, 0.0, 0.0), ROW)


def force(y: float, h: float) -> np.ndarray:
    """Line load along the axis and outward."""
    o = looked(y, h)
    return o[9] * np.array(o[7])[1:] + o[13] * np.array(o[8])[1:]


def energy(y: float, h: float) -> float:
    o = looked(y, h)
    return 0.4 * STIFFNESS * (max(o[4], 0.0) ** 2.5 + max(o[5], 0.0) ** 2.5)


@given(*AROUND)
@settings(max_examples=300, deadline=None)
def test_the_force_is_that_of_a_potential(y, h):
    """Going round and back through rim and cheek neither gains nor loses; inside, where normals change, is left out."""
    step = 1e-8
    if looked(y, h)[4] > 0.9 * ROW[RIM] or abs(y) < 10.0 * step:
        return
    slope = np.array((energy(y + step, h) - energy(y - step, h), energy(y, h + step) - energy(y, h - step)))
    assert force(y, h) == pytest.approx(-slope / (2.0 * step), rel=1e-4, abs=1.0)


@given(*AROUND)
@settings(max_examples=200, deadline=None)
def test_the_two_halves_mirror_each_other(y, h):
    if y == 0.0:
        return
    assert force(-y, h) == pytest.approx(force(y, h) * (-1.0, 1.0), rel=1e-12, abs=1e-9)
    assert loads(looked(-y, h)) == loads(looked(y, h))[::-1]


@given(*AROUND)
@settings(max_examples=300, deadline=None)
def test_it_pushes_where_the_way_out_says_there_is_a_sheave(y, h):
    """The force is there inside and only there, and a small way along it leads outward."""
    way, pushed = depth(ROW, y, h), force(y, h)
    if way < -1e-12:
        assert not pushed.any()
    elif way > 1e-9 and h > -0.01 and way < 0.9 * ROW[RIM]:
        ahead = np.array((y, h)) + 1e-6 * way * pushed / np.linalg.norm(pushed)
        assert depth(ROW, *ahead) < way


def test_cheek_and_rim():
    pressed = STIFFNESS * 1e-3**1.5
    assert force(WIDTH - 1e-3, -0.1) == pytest.approx((pressed, 0.0)), "the cheek pushes along the axis alone"
    assert force(ROW[CREST], ROW[TOP] - 1e-3) == pytest.approx((0.0, pressed)), "the crest straight outward"
    assert not force(WIDTH + 1e-6, -0.1).any() and not force(ROW[CREST], ROW[TOP] + 1e-6).any()


@pytest.mark.parametrize("share", [0.5, 1.0])
@pytest.mark.parametrize("joint", ["flank", "cheek"])
def test_no_step_where_rim_meets_flank_and_cheek(joint, share):
    """Across both joints the force goes on, at a depth of half and of nearly the whole rim."""
    inner = ROW[RIM] - share * 0.9 * ROW[RIM]
    angle = {"flank": np.radians(150.0), "cheek": 0.0}[joint]
    middle = np.array((ROW[CREST], ROW[TOP] - ROW[RIM]))

    def at(turn: float) -> np.ndarray:
        return force(*(middle + inner * np.array((np.cos(angle + turn), np.sin(angle + turn)))))

    assert at(1e-9) == pytest.approx(at(-1e-9), rel=1e-6, abs=1e-3)


@given(st.tuples(*[st.floats(-0.4, 0.4)] * 3), st.tuples(*[st.floats(-2.0, 2.0)] * 3))
@settings(max_examples=100, deadline=None)
def test_a_drum_is_the_groove_without_a_second_flank(place, speed):
    row = surface_row((0, 0, 0), SEAT, None, 0.0, 0.0, STIFFNESS, 0.3)
    row[AXIS + 1], row[SPIN + 1] = 1.0, 0.7
    er, t, rho, vr, f, stiff, damped = touch_drum(place, speed, row)
    o = touch(place, speed, row)
    assert (f, stiff, damped, rho) == (o[9], o[10], o[11], o[2]) and o[13] == 0.0
    np.testing.assert_array_equal((er, t, vr), (o[0], o[1], o[6]))


def test_margin_tells_of_a_cable_beside():
    assert margin(0.0, -1e-4, ROW) == pytest.approx(0.0101)
    assert margin(0.004, 0.007, ROW) == pytest.approx(0.003)
    assert margin(0.0, 0.02, ROW) == pytest.approx(-0.01)
    assert margin(0.05, -0.2, ROW) == margin(-0.05, -0.2, ROW) == pytest.approx(ROW[CREST] - 0.05)
    assert (beside(0.05, -0.1, ROW), beside(-0.05, -0.1, ROW), beside(0.05, 0.1, ROW), beside(0.0, -0.1, ROW)) == (
        1.0,
        -1.0,
        0.0,
        0.0,
    )


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [(0.05, 0.03, 0), (0.05, -0.05, 2), (-0.03, 0.05, 2), (0.05, 0.0, 1), (0.03, WIDTH - 1e-3, 0)],
)
def test_a_step_through_the_disc_is_seen(before, after, found):
    arc = np.linspace(0.0, 0.4, 5)
    old, q = np.zeros((5, 6)), np.zeros((5, 6))
    for table, y in ((old, before), (q, after)):
        table[:, 1], table[:, 2], table[:, 5] = y, -arc, -1.0
    assert pierced(arc, q, np.zeros((5, 6)), old, ROW, 0.01) == found


def test_a_detachment_with_its_rebounds_is_one_event():
    events = np.array((0, 1, 0))
    pressed = [True, False, True, True, False] + 30 * [True] + [False, True]
    off = [latch(on, events, 1_000_000 * t, 20_000_000) for t, on in enumerate(pressed)]
    assert off == [False] + 24 * [True] + 10 * [False] + 2 * [True]
    assert events[0] == 2
