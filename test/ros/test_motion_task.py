"""The task `motion` of /diagnostics names what is wrong with the units or axes of a topic; no node is needed."""

import sys
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))
from true_ship import T0, imu_messages, odometry_messages, replace, sail, stamps

from cable_sim_ros.io.messages.fault_hypotheses import DOUBTS
from cable_sim_ros.io.messages.messages import CAUSES
from cable_sim_ros.io.motion.motion import MotionIngest
from cable_sim_ros.physics.heave_filter import Heave, MotionInput
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.ros.report.diagnostics import ERROR, OK, WARN, Watch, verdict_of_node
from cable_sim_ros.ros.report.health import InputHealth
from cable_sim_ros.ros.timing import MARGIN, Distance

pytestmark = pytest.mark.check


def task(status=0, **wrong):
    """The task after 3 s of IMU and odometry, the odometry with something replaced."""
    return watched(status, **wrong)[2]


def watched(status=0, **wrong):
    """The ingest, how to look at the task again, and the task as it is after 3 s."""
    m = sail(3.0)
    it = MotionIngest(make_inputs(), Ship(), Heave())
    sent = replace(m, **{name: getattr(m, name) * factor for name, factor in wrong.items()})
    for stamp, imu, odometry in zip(stamps(m), imu_messages(m), odometry_messages(sent)):
        it.imu(imu, stamp)
        it.odometry(odometry, stamp)
    session = SimpleNamespace(
        state="running", intake=SimpleNamespace(ingest=it), wall=0, refused=Counter(), clock=SimpleNamespace(jumps=0),
        arrivals={"imu": T0, "odometry": T0}, received={"imu": 150, "odometry": 150},
        scene=SimpleNamespace(ship=Ship(), solver=SimpleNamespace(tick=0.01)),
        node=SimpleNamespace(motion=MotionInput()),
        distance=Distance(30_000_000, 500_000_000), loop=SimpleNamespace(count=2500), first_tick=0,
    )  # fmt: skip
    frame = np.zeros(1, [("status", "i8"), ("motion_source", "i8"), ("motion_age", "f8")])[0]
    frame["status"], frame["motion_age"] = status, 2.0
    watch = Watch(session)

    publisher = SimpleNamespace(latest=frame, statuses=Counter())

    def look():
        return watch._motion(publisher, T0)

    look.session, look.statuses = session, publisher.statuses
    return it, look, look()


def test_the_cause_is_named_while_it_lasts():
    status = task(velocity=1.944)
    assert status.level == WARN and status.message == f"odom: {DOUBTS['velocity_knots']}"
    assert status.values["odometry_doubt"] == "velocity_knots" and status.values["imu_doubt"] == "none"
    assert int(status.values["dropped: velocity_knots"]) > 100
    assert status.values["last_notice"].startswith("odom: twist.linear is 1.94 times")


def test_stale_motion_says_why():
    status = task(Flag.MOTION_STALE, rate=57.3)
    assert status.level == ERROR and status.message.endswith(DOUBTS["rate_degrees"])
    good = task()
    assert "doubt" not in good.message and good.values["odometry_doubt"] == "none"


def test_a_refusal_is_reported_with_its_own_cause():
    """Not with that of the refusal before it, which may be over for long."""
    it, look, first = watched()
    it.last_refusal = f"odometry: {DOUBTS['velocity_knots']}"
    it.counts["behind"] += 1
    status = look()
    assert "refused" not in first.message and status.level == WARN
    assert status.message == f"1 message refused in the last second; behind: {CAUSES['behind']}"
    it.counts["behind"] += 1
    assert look().message.startswith("2 messages refused in the last second; behind")


def test_motion_that_is_a_mixture_is_no_good_motion():
    _, look, first = watched()
    assert first.values["blended_percent"] == "-" and first.level == OK
    look.statuses.update({0: 600, int(Flag.MOTION_BLENDING): 400})
    status = look()
    assert (status.values["blended_percent"], status.level) == ("40.000", OK), "two late samples in ten seconds"
    look.statuses[int(Flag.MOTION_BLENDING) | 1] += 2000
    status = look()
    assert (status.values["blended_percent"], status.level) == ("80.000", WARN)
    assert status.message == "80 % of the last ticks mix late or changed motion into that of the ship"
    look.session.first_tick = 600  # a reset 19 s ago: it takes the motion up
    assert look().level == OK


@given(late=st.integers(0, 600), rate=st.integers(2, 400))
def test_a_tow_stays_so_far_behind_that_its_ticks_find_samples(late, rate):
    """late: ms that each sample comes after what the clock takes for its time; rate: Hz."""
    distance, period = Distance(30_000_000, 500_000_000), 1_000_000_000 // rate

    def sail(seconds, delay):
        nonlocal stamp
        for _ in range(seconds * rate):
            stamp += period
            distance.took(stamp, stamp + delay * 1_000_000)
        return distance.delay

    stamp = 0

    def wanted(need):
        return 30_000_000 if need <= 30_000_000 else min(need + MARGIN, 500_000_000)

    assert sail(20, 0) == wanted(period), "a slow sensor's samples are as far apart"
    assert sail(2, late) == wanted(period), "a hold-up is bridged by a blend"
    assert sail(15, late) == wanted(period + late * 1_000_000)
    assert (distance.delay == 30_000_000) == (distance.text() == "")
    assert sail(15, 0) == wanted(period), "and over once it is over"


def test_an_imu_that_comes_and_is_refused_is_not_called_silent():
    """Nor is the run of a node that it alone fed one without a reason."""
    m = sail(4.0)
    it = MotionIngest(make_inputs(), Ship(), Heave())
    for stamp, imu in zip(stamps(m), imu_messages(replace(m, force=-m.force))):
        it.imu(imu, stamp)
    received = {"imu": 0, "odometry": 0}
    session = SimpleNamespace(
        state="running", intake=SimpleNamespace(ingest=it, commands=None), wall=0, received=received,
        scene=SimpleNamespace(ship=Ship()), node=SimpleNamespace(motion=MotionInput()),
    )  # fmt: skip
    health, now = InputHealth(session), int(stamps(m)[-1])
    health.look(now, None)
    received["imu"] = 50
    health.look(now + 10**9, None)
    status = health.status()
    assert status.level == ERROR and "silent" not in status.message
    assert status.message.startswith(f"imu comes but is refused: gravity_sign: {DOUBTS['gravity_sign']}; no motion is")
    ((text, seconds),) = it.refusals()
    report = {"motion_refusals": [[text, seconds]], "motion_s": 0.0}
    never_began = verdict_of_node(SimpleNamespace(scene=None, problem=""), None, report)
    assert [reason.flag for reason in never_began.reasons] == ["MOTION_REFUSED"] and never_began.code == 4
    assert (
        "gravity_sign" in never_began.reasons[0].text
        and verdict_of_node(SimpleNamespace(scene=None, problem=""), None, {}).state == "ok"
    )
