"""Winch plans: text and back, every refusal, the commands that carry them out to the tick."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cable_sim_ros.io.scenes.winch_plan import UNITS, PlanError, WinchPlan
from cable_sim_ros.physics.inputs import COMMAND_ROWS, make_inputs, push_command
from cable_sim_ros.physics.state import records
from cable_sim_ros.physics.winch import DRUM, WINCH
from cable_sim_ros.physics.winch_command import command
from cable_sim_ros.sim.loop import look

pytestmark = pytest.mark.check

TICK, S = 10_000_000, 1_000_000_000
START = 7 * S + 3


def drum_of(**values):
    """A drum with 450 m paid out of 466, of which 8 m are inboard."""
    row = records(1, DRUM)[0]
    usual = {"max_rate": 2.0, "timeout": 0.5, "payout_0": 450.0, "total": 466.0, "inboard": 8.0}
    usual |= {f"min_{end}": -430.0 for end in ("length", "limit", "reach")}
    usual |= {f"max_{end}": 15.0 for end in ("length", "limit", "reach")} | {"ramp": 1e9}  # as good as none
    for name, value in (usual | values).items():
        row[name] = value
    return row


items = st.tuples(st.sampled_from(sorted(UNITS)), st.floats(0.0, 1e5), st.booleans())
texts = st.lists(items, min_size=1, max_size=6).flatmap(
    lambda orders: st.lists(st.integers(0, 10**15 - 1000), min_size=len(orders), max_size=len(orders), unique=True).map(
        lambda times: ", ".join(
            " ".join(
                [
                    repr(t * 1e-9),
                    order,
                    *([repr(-value if minus and order == "rate" else value)] if UNITS[order] else []),
                ]
            )
            for t, (order, value, minus) in zip(sorted(times), orders)
        )
    )
)


@given(texts)
def test_a_plan_is_its_text(text):
    plan = WinchPlan(text)
    assert WinchPlan(str(plan)) == plan and str(WinchPlan(str(plan))) == str(plan)
    assert WinchPlan(str(plan).replace(", ", "\n# a line\n")) == plan


def test_a_mode_stands_beside_the_orders():
    plan = WinchPlan("0 rate 0.5, 1 mode brake, 2 mode follow, 2 hold")
    assert str(plan) == "0 rate 0.5, 1 mode brake, 2 mode follow, 2 hold" and plan == WinchPlan(str(plan))
    drum = drum_of()
    orders = WinchPlan("0 rate 0.5, 2 hold")
    assert list(plan.commands(drum, START, START, START + 3 * S)) == list(
        orders.commands(drum, START, START, START + 3 * S)
    )
    assert [row[:3] for row in plan.modes()] == [(1.0, "drive.mode", "brake"), (2.0, "drive.mode", "follow")]
    assert plan.mode_at(0, TICK) == (100, "") and plan.mode_at(100, TICK) == (100, "brake")
    assert plan.mode_at(250, TICK)[1] == "follow"


def test_a_plan_from_text_file_and_plan(tmp_path):
    plan = WinchPlan("0 hold, 60 rate 0.5, 360 hold")
    assert (
        plan.items == ((0.0, "hold", 0.0, ""), (60.0, "rate", 0.5, ""), (360.0, "hold", 0.0, "")) and plan.last == 360.0
    )
    path = tmp_path / "haul.txt"
    path.write_text("# a haul\n0 hold   # until it settles\n\n60 rate 0.5, 360 hold,\n")
    assert WinchPlan.of(path) == WinchPlan.of(str(path)) == WinchPlan.of(str(plan)) == WinchPlan.of(plan) == plan
    numbered = tmp_path / "1 haul.txt"
    numbered.write_text("5 length 3")
    assert str(WinchPlan.of(str(numbered))) == "5 length 3"
    assert str(WinchPlan("0.5 rate -0, 1e3 scope 1e2")) == "0.5 rate 0, 1000 scope 100"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "winch plan: has no item; nothing was simulated. Write for example '0 hold, 60 rate 0.5, 360 hold'"),
        (" # 0 hold", "has no item"),
        ("0 hold, 5", "winch plan, item 2 '5': has no order; nothing was simulated. Known: hold, "),
        ("0 mode", "mode takes one word, here are 0; nothing was simulated. Write 'TIME mode WORD', with a comma"),
        ("0 mode brake now", "mode takes one word, here are 2; nothing was simulated"),
        ("0 mode breake", "'breake' is no mode of the drive; nothing was simulated. Did you mean brake?"),
        ("0 mode x", "Known: follow, tension, render, brake, emergency_stop"),
        ("1 mode brake, 0 hold", "item 2 '0 hold': time = 0 s is not after that of the item before, 1 s; nothing"),
        ("1 mode brake, 1 hold, 1 mode follow", "item 3 '1 mode follow': time = 1 s is not after that of the item"),
        ("0 rat 0.5", "item 1 '0 rat 0.5': 'rat' is no order; nothing was simulated. Did you mean rate?"),
        ("0 fire", "'fire' is no order; nothing was simulated. Known: hold, rate, length, scope, mode"),
        ("0 rate", "rate takes one value in m/s, here are 0; nothing was simulated. Write 'TIME rate VALUE'"),
        ("0 length 3 m", "length takes one value in m, here are 2; nothing was simulated. Write 'TIME length VALUE'"),
        ("0 hold 3", "hold takes no value, here are 1; nothing was simulated. Write 'TIME hold', with a comma"),
        ("1s hold", "time = 1s is no finite number; nothing was simulated. Give one in [0, 1e+06] s, without its unit"),
        ("0 rate nan", "rate = nan is no finite number; nothing was simulated. Give one in [-100000, 100000] m/s"),
        ("0 rate 1e308", "rate = 1e+308 m/s is outside [-100000, 100000] m/s; nothing was simulated. Check its sign"),
        ("0 scope -3", "scope = -3 m is outside [0, 100000] m; nothing was simulated. Check its sign and unit"),
        ("-1 hold", "time = -1 s is outside [0, 1e+06] s; nothing was simulated. Check its sign and unit"),
        ("9 hold, 9 rate 1", "item 2 '9 rate 1': time = 9 s is not after that of the item before, 9 s; nothing was "),
    ],
)
def test_what_is_no_plan_is_refused(text, said):
    with pytest.raises(PlanError) as error:
        WinchPlan(text)
    assert said in str(error.value)


def test_a_file_that_is_none_is_refused(tmp_path):
    with pytest.raises(PlanError, match=r"winch plan nowhere.txt: cannot be read \(No such file or directory\); "):
        WinchPlan.of("nowhere.txt")
    path = tmp_path / "plan.bin"
    path.write_bytes(b"\xff\xfe0")
    with pytest.raises(PlanError, match=r"cannot be read \(it is no UTF-8 text\); .* or the plan itself, for example"):
        WinchPlan.read(path)
    path.write_text("0 hold\n1 stop")
    with pytest.raises(PlanError, match="plan.bin, item 2 '1 stop': 'stop' is no order"):
        WinchPlan.read(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0 hold, 1 rate -2.5", "item 2 '1 rate -2.5': rate = -2.5 m/s is beyond winch.max_rate = 2 m/s; "),
        ("1 rate -2.5", "; nothing was simulated. Give a rate in [-2, 2] m/s, or raise winch.max_rate"),
        ("0 length 465.1", "length = 465.1 m is outside the winch's travel, [20.000, 465.000] m; "),
        ("0 scope 11.9", "scope = 11.9 m is outside the winch's travel, [12.000, 457.000] m; nothing was simulated."),
    ],
)
def test_what_the_winch_cannot_do_is_refused(text, said):
    with pytest.raises(PlanError) as error:
        WinchPlan(text).check(drum_of())
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("limits", "remedy"),
    [
        ({}, "or more cable"),
        ({"max_limit": 10.0, "max_reach": 10.0}, "or other winch.least_scope and winch.most_scope"),
        ({"max_reach": 2.0}, "or more fine elements on that side of the sheave (cable.sections.*.elements)"),
    ],
)
def test_a_length_outside_the_travel_is_refused_with_what_would_widen_it(limits, remedy):
    with pytest.raises(PlanError) as error:
        WinchPlan("0 length 466").check(drum_of(**limits))
    assert f"Give a length within it, {remedy}" in str(error.value)


def test_what_the_winch_can_do_is_taken():
    WinchPlan("0 length 465, 1 scope 457, 2 rate -2, 3 length 20, 4 scope 12").check(drum_of())


def followed(text, seconds, **values):
    """Commanded length [ticks] relative to the start, by the kernel that the tick calls."""
    inputs, drum, winch, lengths = make_inputs(), drum_of(**values), records(1, WINCH)[0], []
    plan, stale = WinchPlan(text), 0
    plan.check(drum)
    for k in range(round(seconds / 0.01)):
        now = START + k * TICK
        for item in plan.commands(drum, START, now, now + TICK):
            push_command(
                inputs,
                item.time_ns,
                np.nan if item.payout is None else item.payout,
                np.nan if item.rate is None else item.rate,
            )
        look(inputs)
        command(now + TICK, 0.01, drum, inputs, winch)
        lengths.append(winch.commanded)
        stale += winch.stale
    assert stale == 0, "no time-out may strike"
    return np.array(lengths)


@pytest.mark.parametrize("timeout", [0.01, 0.013, 0.5, 3600.0])
def test_a_rate_lasts_to_the_tick_whatever_the_time_out(timeout):
    lengths = followed("0 hold, 1 rate 0.5, 4 hold, 5 rate -0.25, 6 hold", 7.0, timeout=timeout)
    assert lengths[99] == 0.0 and lengths[100] == pytest.approx(0.005)
    assert lengths[399:500] == pytest.approx(1.5) and lengths[-1] == pytest.approx(1.25)


def test_lengths_and_scopes_are_approached_at_the_largest_rate_and_held():
    lengths = followed("0.5 length 452, 3 scope 441", 5.0)
    assert lengths[49] == 0.0 and lengths[50] == pytest.approx(0.02) and lengths[150:300] == pytest.approx(2.0)
    assert lengths[-1] == pytest.approx(-1.0), "441 m of scope and 8 m inboard are 449 m off the drum"


@settings(max_examples=30)
@given(st.lists(st.integers(0, 9 * 10**9), max_size=8), st.sampled_from([0.01, 0.1, 0.5, 3.0]))
def test_commands_are_the_same_however_the_run_is_cut(cuts, timeout):
    plan, drum, end = WinchPlan("0.1 rate 1, 3 length 440, 6.0000000001 hold"), drum_of(timeout=timeout), 9 * S
    whole = list(plan.commands(drum, START, START, START + end))
    edges = [START + cut for cut in sorted({0, *cuts, end})]
    assert [c for a, b in zip(edges, edges[1:]) for c in plan.commands(drum, START, a, b)] == whole
    stamps = np.array([c.time_ns for c in whole])
    assert (np.diff(stamps) > 0).all() and np.diff(stamps).max() <= 0.5e9 * timeout + 1
    assert len(list(plan.commands(drum, START, START, START + round(50 * timeout * S)))) < COMMAND_ROWS - 16
