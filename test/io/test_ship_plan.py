"""Plans of the ship: text and back, every refusal, the track and its phases."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cable_sim_ros.io.scenes.ship_plan import MAX_TURN_RATE, PEAK, UNITS, PlanError, ShipPlan
from cable_sim_ros.physics.ship import Ship

pytestmark = pytest.mark.check

SHIP = Ship(tow_speed=2.0, heading_deg=30.0)
STEP = 0.1
items = st.tuples(st.sampled_from(sorted(UNITS)), st.floats(0.0, 15.0), st.floats(0.0, 50.0), st.floats(20.0, 90.0))


@st.composite
def plans(draw):
    """Texts of plans whose items follow each other."""
    parts, at = [], 0.0
    for order, value, pause, over in draw(st.lists(items, min_size=1, max_size=5)):
        parts.append(f"{at + pause!r} {order} {value!r} over {over!r}")
        at += pause + over + 1e-6
    return ", ".join(parts)


@given(plans())
def test_a_plan_is_its_text_and_its_rates_are_those_of_its_track(text):
    plan = ShipPlan(text)
    assert ShipPlan(str(plan)) == plan and ShipPlan(str(plan).replace(", ", "\n# a line\n")) == plan
    t = np.arange(0.0, plan.last + 5.0, STEP)
    value, rate = plan.track(t, SHIP)
    turned = sum({"port": 1.0, "starboard": -1.0}.get(one.order, 0.0) * one.value for one in plan.items)
    assert np.degrees(value[-1, 5]) == pytest.approx(30.0 + turned, abs=1e-6)
    speeds = [one.value for one in plan.items if not one.turns]
    assert np.hypot(*rate[-1, :2]) == pytest.approx((speeds or [2.0])[-1], abs=1e-9)
    middle = 0.5 * (rate[1:] + rate[:-1])
    assert np.abs(np.diff(value, axis=0) / STEP - middle).max() < 1e-3
    phases = plan.phases(float(t[-1]), SHIP)
    assert phases[0].begin == 0.0 and phases[-1].end == t[-1]
    assert [one.end for one in phases[:-1]] == [one.begin for one in phases[1:]]


def test_a_zigzag_ends_beside_its_line_and_a_slow_down_says_its_speeds():
    zigzag = ShipPlan("10 port 20 over 20, 60 starboard 40 over 40, 130 port 20 over 20, 200 speed 1 over 60")
    zigzag.check(SHIP)
    value, _ = zigzag.track(np.arange(0.0, 300.0, STEP), Ship(tow_speed=2.0))
    assert value[-1, 5] == pytest.approx(0.0, abs=1e-12) and value[:, 1].max() > 20.0
    said = [phase.text for phase in zigzag.phases(300.0, SHIP)]
    assert (
        said[0] == "straight at 2 m/s"
        and said[1] == "port 20 deg"
        and said[-2:] == ["speed 1 m/s", "straight at 1 m/s"]
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r"ship plan: has no item"),
        ("10 left 20 over 5", r"item 1 '10 left 20 over 5': 'left' is no order; .*Known: port, starboard, speed"),
        ("10 prot 20 over 5", r"Did you mean port\?"),
        ("10 port 20", r"port takes a value in deg and how long it takes; .*'TIME port VALUE over SECONDS'"),
        ("10 port 20 in 5", r"port takes a value in deg and how long"),
        ("10 port -20 over 5", r"port = -20 deg is outside \[0, 3600\] deg"),
        ("10 speed 16 over 50", r"speed = 16 m/s is outside \[-15, 15\] m/s"),
        ("10 port 20 over 0.5", r"over = 0.5 s is outside \[1, 1e\+06\] s"),
        ("-1 port 20 over 5", r"time = -1 s is outside \[0, 1e\+06\] s"),
        ("10 port nan over 5", r"port = nan is no finite number"),
        ("20 port 20 over 5, 10 speed 1 over 5", r"time = 10 s is not after that of the item before, 20 s"),
        ("0 port 20 over 30, 10 port 5 over 5", r"begins at 10 s, before '0 port 20 over 30' ends at 30 s"),
    ],
)
def test_what_is_no_plan_is_refused(text, said):
    with pytest.raises(PlanError, match=said):
        ShipPlan(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("5 port 90 over 10", r"item 1 .*needs 11.2 deg/s, more than 10 deg/s of any ship; .*Give it 11.2 s or more"),
        ("5 port 9 over 10, 20 speed 5 over 2", r"item 2 .*needs 1.88 m/s\^2, more than 1 m/s\^2"),
    ],
)
def test_what_no_ship_does_is_refused(text, said):
    with pytest.raises(PlanError, match=said):
        ShipPlan(text).check(SHIP)
    ShipPlan(f"0 port {MAX_TURN_RATE} over {PEAK + 1e-9}").check(SHIP)
