"""Beside a node, without one: what is said where real time is not held, the node falls silent, or copies are lost."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rclpy")

from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.ros.parts import ERROR, OK, WARN
from cable_sim_ros.tools.ensemble.beside import AHEAD_NAMES, BAND_NAMES, WATCHED, Beside, _follow
from cable_sim_ros.tools.ensemble.copies import EnsembleEnded, Stopped
from cable_sim_ros.tools.ensemble.follow import Follower
from cable_sim_ros.tools.ensemble.plan import EnsemblePlan
from cable_sim_ros.tools.ensemble.recording import heard_of, scene_kept


class Voice:
    """Keeps what was said."""

    def __init__(self):
        self.bands, self.places, self.tables, self.statuses = [], [], [], []

    def band(self, stamp, names, values):
        self.bands.append((stamp, dict(zip(names, values, strict=True))))

    def towbody(self, stamp, places, yaws):
        self.places.append(places)

    def ahead(self, stamp, names, table):
        self.tables.append((stamp, names, table))

    def say(self, status, stamp):
        self.statuses.append(status)


@pytest.fixture
def made(bag):
    def make(copies=6, **plan):
        follower = Follower(scene_kept(bag, None), EnsemblePlan.model_validate({"copies": copies, **plan}))
        voice = Voice()
        return Beside(follower, voice), voice

    return make


def until_idle(beside, now):
    while beside.step([], now):
        pass


def test_band_look_ahead_and_status_are_said(bag, made):
    beside, voice = made(ahead={"seconds": 20.0, "every": 5.0})
    items = list(heard_of(bag))
    beside.step(items[:220], 0.0)
    until_idle(beside, 1.0)
    stamp, said = voice.bands[-1]
    assert tuple(said) == BAND_NAMES and said["copies"] == 6.0 and said["level"] == pytest.approx(5 / 7)
    assert said["body_depth.low"] < said["body_depth.median"] < said["body_depth.high"]
    assert not said["behind"] and said["copy_0_apart"] < 1e-2
    assert voice.places[-1].shape == (6, 3) and (voice.places[-1][:, 2] < 0.0).all()
    (begin, names, table), *more = voice.tables
    assert not more and begin == stamp and names == AHEAD_NAMES and table.shape == (20, len(AHEAD_NAMES))
    assert table[-1, names.index("seconds")] == pytest.approx(20.0) and np.isfinite(table).all()
    status = beside.status()
    assert (status.level, status.message) == (OK, "6 copies in real time")
    assert status.values["winch_ahead"] == "the last command held" and "mean way" in status.values["assumed_ahead"]
    assert status.values["flags"] == status.values["flags_since_start"] == ""
    beside.follower.ensemble.newest[1].statuses[int(Flag.SLACK)] += 20
    status = beside.status()
    assert status.level == WARN and status.message.startswith("SLACK in 1 of 6 copies, for up to 1 s")
    assert (status.values["flags"], status.values["flags_since_start"]) == ("SLACK", "")
    beside.follower.ensemble.newest[1].statuses.clear()
    beside.follower.apart = (0.0, 50.0)
    status = beside.status()
    assert status.level == WARN and status.message.startswith("copy 0 is 50 m from the towbody: the copies do not fol")
    beside.follower.apart = (0.0, 0.0)
    beside.follower.doubt("other water")
    assert (beside.status().level, beside.status().message) == (WARN, "other water")
    beside.follower.doubts.clear()
    beside.order("0 haul 3")
    assert beside.follower.notes[-1].startswith("plan refused: ") and beside.follower.orders is None
    beside.order("0 rate 0.2, 10 hold")
    assert beside.status().values["winch_ahead"] == "0 rate 0.2, 10 hold"
    beside.overrun()
    assert beside.let_go == 1 and not beside.follower.running and "were lost" in beside.follower.notes[-1]


class Ear:
    """Has a plan of the winch before the copies begin, and then what a tow says."""

    client = SimpleNamespace(check=lambda: None)

    def __init__(self, items):
        self.parts, self.plans = [[], items, []], ["0 rate 0.2, 10 hold"]

    def items(self):
        return self.parts.pop(0)

    def ordered(self):
        return self.plans.pop() if self.plans else None

    def overflowed(self):
        return False


def test_a_plan_that_comes_before_the_copies_begin_is_kept_for_them(bag, made):
    beside, _ = made(ahead={"seconds": 0.0, "winch": "0 rate 99"})
    ear = Ear(list(heard_of(bag))[:120])
    _follow(beside, ear, lambda: bool(ear.parts))
    notes = beside.follower.notes
    assert any(
        note.startswith("ahead.winch is refused, the last command is held: winch plan, item 1") for note in notes
    )
    assert str(beside.follower.orders) == "0 rate 0.2, 10 hold"


def test_an_end_that_is_asked_for_does_not_wait_for_the_static_starts(bag):
    follower = Follower(scene_kept(bag, None), EnsemblePlan(copies=1000), alive=lambda: False)
    follower.hear(list(heard_of(bag))[:120])
    with pytest.raises(Stopped):
        follower.advance()


def test_where_real_time_is_not_held_copies_go_and_it_is_said(bag, made, monkeypatch):
    beside, voice = made()
    items = list(heard_of(bag))
    beside.step(items[:220], 0.0)
    until_idle(beside, 0.5)
    beside.follower.ensemble.let_go(6)
    monkeypatch.setattr(beside.follower, "advance", lambda: None)  # so slow
    beside.step(items[220:400], 1.0)
    assert beside.behind and beside.status().level == ERROR
    assert "out of real time: the band is" in beside.status().message and "no look-ahead" in beside.status().message
    for k in range(12):
        beside.step(items[400 + 20 * k : 420 + 20 * k], 1.0 + k)
    assert beside.let_go == 1 and len(beside.follower.ensemble.draws) == 6
    assert "no nearer for 10 s: 1 of 6 copies are let go" in beside.follower.notes[-1]
    assert voice.statuses[-1].level == ERROR
    monkeypatch.undo()
    until_idle(beside, 13.0)
    assert not beside.behind and beside.status()[1:3] == (WARN, "1 copies were let go to hold real time, 5 are left")
    monkeypatch.setattr(beside.follower, "advance", lambda: None)
    begun = beside.follower.begun
    beside.step(items[640:], 20.0)
    assert beside.follower.lag > 30.0
    monkeypatch.setattr("cable_sim_ros.tools.ensemble.beside.GIVE_UP", 30.0)
    beside.step([], 20.0 + 0.95 * WATCHED)
    beside.step([], 20.0 + 1.2 * WATCHED)
    assert not beside.follower.running and "the copies begin again at the present" in beside.follower.notes[-1]
    assert beside.follower.begun == begun and len(beside.follower.ensemble.draws) == 6, "no fewer than the fewest"


def test_a_node_that_says_nothing_more_is_said_and_one_that_comes_again_is_followed(bag, made):
    beside, voice = made(ahead={"seconds": 0.0})
    items = list(heard_of(bag))
    beside.step(items[:160], 0.0)
    until_idle(beside, 1.0)
    assert beside.status().level == OK
    beside.step([], 10.0)
    assert voice.statuses[-1][1:3] == (ERROR, "the node says nothing for 10 s: the band is of then")
    count = len(voice.bands)
    beside.step(items[:160], 11.0)
    until_idle(beside, 12.0)
    assert len(voice.bands) > count and beside.follower.begun == 2 and beside.status().level == OK
    assert "the tow began again, or its clock jumped: so did the copies" in beside.follower.notes


def test_copies_that_are_given_up_begin_again_with_the_reason(bag, made, monkeypatch):
    beside, _ = made(ahead={"seconds": 0.0})
    items = list(heard_of(bag))
    beside.step(items[:160], 0.0)

    def ended():
        raise EnsembleEnded("side_scan: 3 of 7 copies were given up")

    monkeypatch.setattr(beside.follower, "advance", ended)
    beside.step([], 1.0)
    assert beside.status()[1:3] == (ERROR, "side_scan: 3 of 7 copies were given up")
    assert beside.follower.notes[-1].endswith("the copies begin again") and not beside.follower.running
    monkeypatch.undo()
    beside.step(items[160:330], 2.0)
    until_idle(beside, 3.0)
    assert beside.status().level == WARN and "joined under way: the copies settle" in beside.status().message


def test_a_look_ahead_that_gives_no_band_leaves_the_copies_as_they_are(bag, made, monkeypatch):
    beside, _ = made(ahead={"seconds": 20.0, "every": 1.0})

    def ended(*_, **__):
        raise EnsembleEnded("6 of 6 copies cannot be looked ahead")

    monkeypatch.setattr(beside.follower.ensemble, "ahead", ended)
    beside.step(list(heard_of(bag))[:220], 0.0)
    for now in range(1, 15):
        beside.step([], 1.0 + 0.1 * now)
    status = beside.status()
    assert beside.follower.begun == 1 and beside.follower.running and not beside.problem
    assert (status.level, status.message) == (WARN, "no look-ahead: 6 of 6 copies cannot be looked ahead")
