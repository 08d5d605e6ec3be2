"""The solid sheave: flank, round rim and cheek of its two halves, and what leaving it means."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import record
from hypothesis import given, settings
from hypothesis import strategies as st

from cable_sim_ros.compiler.jit import NO
from cable_sim_ros.physics.contact import EVENTS, latch, law, touch
from cable_sim_ros.physics.contact_detection import _detect_contact
from cable_sim_ros.physics.contact_surface import (
    beside,
    check_surfaces,
    clearance,
    floor_row,
    groove_gap,
    solid,
    surface_row,
)
from cable_sim_ros.physics.state import NOW, STEP, Q, make_state
from verification.stress.sheave_depth import depth

pytestmark = pytest.mark.check

STIFFNESS, SEAT = 1e9, 0.255
ROW = record(surface_row((0, 0, 0), SEAT, np.pi / 3, 0.01, 0.008, STIFFNESS, 0.0))
SOLID = solid(ROW)
WIDTH = ROW.crest + ROW.rim
AROUND = (st.floats(-1.2 * WIDTH, 1.2 * WIDTH), st.floats(-0.1, 1.2 * ROW.top))


def looked(y: float, h: float):
    return touch(SOLID, STIFFNESS, (0.0, y, SEAT + h), (0.0, 0.0, 0.0))


def force(y: float, h: float) -> np.ndarray:
    """Line load along the axis and outward."""
    gap, own, other = looked(y, h)
    return own.load * np.array(gap.own.normal)[1:] + other.load * np.array(gap.other.normal)[1:]


def energy(y: float, h: float) -> float:
    gap = looked(y, h).gap
    return 0.4 * STIFFNESS * (max(gap.own.depth, 0.0) ** 2.5 + max(gap.other.depth, 0.0) ** 2.5)


@given(*AROUND)
@settings(max_examples=300)
def test_the_force_is_that_of_a_potential(y, h):
    """Going round and back through rim and cheek neither gains nor loses; inside, where normals change, is left out."""
    step = 1e-8
    if looked(y, h).gap.own.depth > 0.9 * ROW.rim or abs(y) < 10.0 * step:
        return
    slope = np.array((energy(y + step, h) - energy(y - step, h), energy(y, h + step) - energy(y, h - step)))
    assert force(y, h) == pytest.approx(-slope / (2.0 * step), rel=1e-4, abs=1.0)


@given(*AROUND)
@settings(max_examples=200)
def test_the_two_halves_mirror_each_other(y, h):
    if y == 0.0:
        return
    assert force(-y, h) == pytest.approx(force(y, h) * (-1.0, 1.0), rel=1e-12, abs=1e-9)
    assert [half.load for half in looked(-y, h)[1:]] == [half.load for half in looked(y, h)[1:]]


@given(*AROUND)
@settings(max_examples=300)
def test_it_pushes_where_the_way_out_says_there_is_a_sheave(y, h):
    """The force is there inside and only there, and a small way along it leads outward."""
    way, pushed = depth(ROW, y, h), force(y, h)
    if way < -1e-12:
        assert not pushed.any()
    elif way > 1e-9 and h > -0.01 and way < 0.9 * ROW.rim:
        ahead = np.array((y, h)) + 1e-6 * way * pushed / np.linalg.norm(pushed)
        assert depth(ROW, *ahead) < way


def test_cheek_and_rim():
    pressed = STIFFNESS * 1e-3**1.5
    assert force(WIDTH - 1e-3, -0.1) == pytest.approx((pressed, 0.0)), "the cheek pushes along the axis alone"
    assert force(ROW.crest, ROW.top - 1e-3) == pytest.approx((0.0, pressed)), "the crest straight outward"
    assert not force(WIDTH + 1e-6, -0.1).any() and not force(ROW.crest, ROW.top + 1e-6).any()


@pytest.mark.parametrize("fraction", [0.5, 1.0])
@pytest.mark.parametrize("joint", ["flank", "cheek"])
def test_no_step_where_rim_meets_flank_and_cheek(joint, fraction):
    """Across both joints the force goes on, at a depth of half and of nearly the whole rim."""
    inner = ROW.rim - fraction * 0.9 * ROW.rim
    angle = {"flank": np.radians(150.0), "cheek": 0.0}[joint]
    middle = np.array((ROW.crest, ROW.top - ROW.rim))

    def at(turn: float) -> np.ndarray:
        return force(*(middle + inner * np.array((np.cos(angle + turn), np.sin(angle + turn)))))

    assert at(1e-9) == pytest.approx(at(-1e-9), rel=1e-6, abs=1e-3)


@given(st.tuples(*[st.floats(-0.4, 0.4)] * 3), st.tuples(*[st.floats(-2.0, 2.0)] * 3))
@settings(max_examples=100)
def test_a_drum_is_the_groove_without_a_second_flank(place, speed):
    row = record(surface_row((0, 0, 0), SEAT, None, 0.0, 0.0, STIFFNESS, 0.3))
    row.spin[1] = 0.7
    drum = solid(row)
    gap, own, other = touch(drum, STIFFNESS, place, speed)
    groove = groove_gap(drum, place, speed)
    assert own == law(drum, STIFFNESS, groove.own, groove.slip) and gap.rho == groove.rho and other.load == 0.0
    np.testing.assert_array_equal((gap.radial, gap.around, gap.slip), (groove.radial, groove.around, groove.slip))
    assert gap.own.depth == groove.own.depth and gap.own.normal == groove.own.normal


def test_clearance_tells_of_a_cable_beside():
    def below(y: float, h: float) -> float:
        return clearance(looked(y, h).gap, SOLID)

    assert below(0.0, -1e-4) == pytest.approx(0.0101)
    assert below(0.004, 0.007) == pytest.approx(0.003)
    assert below(0.0, 0.02) == pytest.approx(-0.01)
    assert below(0.05, -0.2) == below(-0.05, -0.2) == pytest.approx(ROW.crest - 0.05)
    found = [beside(y, h, SOLID) for y, h in ((0.05, -0.1), (-0.05, -0.1), (0.05, 0.1), (0.0, -0.1))]
    assert found == [1.0, -1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [(0.05, 0.03, 0), (0.05, -0.05, 2), (-0.03, 0.05, 2), (0.05, 0.0, 1), (0.03, WIDTH - 1e-3, 0)],
)
def test_a_step_through_the_disc_is_seen(before, after, found):
    state = make_state(np.linspace(0.0, 0.4, 5), [ROW])
    for slot, y in ((STEP, before), (NOW, after)):
        q = state.nodes[slot, Q]
        q[:, 1], q[:, 2], q[:, 5] = y, -state.arc, -1.0
    _detect_contact(state, 0.01, NO)
    assert state.detected[0].entered == found


def test_a_detachment_with_its_rebounds_is_one_event():
    events = record(np.array([(0, 1, 0, 0.0, 0.0)], EVENTS))
    pressed = [True, False, True, True, False] + 30 * [True] + [False, True]
    off = [latch(on, events, 1_000_000 * t, 20_000_000) for t, on in enumerate(pressed)]
    assert off == [False] + 24 * [True] + 10 * [False] + 2 * [True]
    assert events.detachments == 2


@pytest.mark.parametrize("throat", [None, np.pi / 3], ids=["drum", "groove"])
def test_friction_that_would_drive_or_be_no_number_is_refused(throat):
    row = surface_row((0, 0, 0), SEAT, throat, 0.01, 0.008, STIFFNESS, 0.0, 0.4, 0.001)
    assert len(check_surfaces(np.stack([row]))) == 1
    for key, value, text in (
        ("friction", -0.1, r"surface 1: friction = -0\.1 is below 0: .*nothing was made. Give 0 or more"),
        ("slip", 0.0, r"surface 1: slip = 0 m/s beside friction = 0\.4: .*Give a slip above 0"),
    ):
        wrong = row.copy()
        wrong[key] = value
        with pytest.raises(ValueError, match=text):
            make_state(np.linspace(0.0, 1.0, 5), [floor_row(-1.0, 1e6, 0.0, 0.3, 0.01), wrong])
    row["friction"], row["slip"] = 0.0, 0.0
    assert len(check_surfaces(np.stack([row]))) == 1, "without friction a slip speed says nothing"


def test_a_floor_on_which_a_point_at_rest_would_be_no_number_is_refused():
    make_state(np.linspace(0.0, 1.0, 5), [floor_row(-1.0, 1e6, 0.0, 0.0, 0.01)])
    with pytest.raises(ValueError, match=r"surface 0: slip = 0 m/s beside friction = 0\.3: .*Give a slip above 0"):
        make_state(np.linspace(0.0, 1.0, 5), [floor_row(-1.0, 1e6, 0.0, 0.3, 0.0)])
