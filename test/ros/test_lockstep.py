"""Who waits for whom in lockstep: the pure machine, told times and messages."""

from __future__ import annotations

import pytest

from cable_sim_ros.ros.blocks import LockstepParameters as Settings
from cable_sim_ros.ros.lockstep import LONGEST, Do, Lockstep, rate_problem
from cable_sim_ros.ros.parameters import ParameterError, settle

pytestmark = pytest.mark.check

MS = 1_000_000
S = 1_000_000_000


def machine(**settings) -> Lockstep:
    return Lockstep(Settings(**{"rate": 0.0, "start": 1.0} | settings), 10 * MS, 30 * MS)


class World:
    """Wall time that passes as the machine asks for it."""

    def __init__(self, steps: Lockstep, free: bool = False) -> None:
        self.steps, self.free, self.now, self.done = steps, free, 0, []
        self.answer = lambda do: None

    def until(self, ticks: int, within: float = 1e9) -> list:
        """Run to so many more ticks, or so long [s]; returns what was done, as (what, clock ms)."""
        first, end = len(self.done), self.now + round(within * S)
        while sum(what is Do.TICK for what, _ in self.done[first:]) < ticks and self.now < end:
            do, seconds = self.steps.next(self.now, self.free)
            if do is Do.WAIT:
                self.now += max(1, round(seconds * S))
            else:
                self.done.append((do, self.steps.clock // MS))
                self.answer(do)
                if do is Do.TICK:
                    self.steps.step_done(True)
        return self.done[first:]


def test_a_step_is_clock_motion_tick_and_as_fast_as_it_goes_takes_no_time():
    world = World(machine())
    assert world.until(2) == [
        (Do.CLOCK, 1010),
        (Do.MOTION, 1010),
        (Do.TICK, 1010),
        (Do.CLOCK, 1020),
        (Do.MOTION, 1020),
        (Do.TICK, 1020),
    ]
    world.until(1000)
    assert world.now == 0


@pytest.mark.parametrize(
    "rate, free, seconds",
    [(1.0, False, 1.0), (0.1, False, 10.0), (4.0, False, 0.25)]
    + [(0.0, True, 1.0), (4.0, True, 1.0), (0.5, True, 2.0)],
)
def test_the_rate_bounds_simulated_over_wall_time_and_before_motion_it_is_at_most_one(rate, free, seconds):
    world = World(machine(rate=rate), free)
    world.until(1)
    world.until(100)
    assert world.now * 1e-9 == pytest.approx(seconds, abs=0.11 if rate >= 1 or free else 0.2)
    clocks = [clock for what, clock in world.done if what is Do.CLOCK]
    assert clocks == sorted(clocks) and len(clocks) >= 101


def test_a_paused_clock_stands_and_is_said_fifty_times_a_second():
    world = World(machine(paused=True))
    world.until(1, within=1.0)
    assert {what for what, _ in world.done} == {Do.CLOCK} and len(world.done) == pytest.approx(50, abs=2)
    assert world.steps.clock == S and world.steps.doing == "paused"
    world.steps.steps_left = 3
    world.until(3, within=1.0)
    assert world.steps.clock == S + 30 * MS and not world.steps.steps_left
    assert world.until(1, within=0.5)[-1] == (Do.CLOCK, 1030)


def motion(steps: Lockstep, *stamps: int) -> None:
    for stamp in stamps:
        assert steps.motion("odometry", stamp * MS, b"") == ("", 0)


def test_motion_that_is_due_is_waited_for_and_the_wait_is_bounded():
    steps = machine(wait=0.5, silent_after=3)
    world = World(steps)
    motion(steps, 1000, 1010)
    world.until(1)
    assert world.now == 0
    found = world.until(1)
    assert found[0] == (Do.CLOCK, 1020) and found[-1] == (Do.TICK, 1020)
    assert world.now == pytest.approx(0.5 * S, abs=50 * MS), "no motion came"
    assert len([1 for what, _ in found if what is Do.CLOCK]) == pytest.approx(25, abs=2), "the clock is said again"
    assert steps.gate.cadence["odometry"].missed == 1
    world.until(2)
    assert steps.gate.cadence["odometry"].silent and world.now == pytest.approx(1.5 * S, abs=100 * MS)
    world.until(100)
    assert world.now < 1.7 * S, "a silent topic stops nobody"


def command(steps: Lockstep, stamp: int) -> str:
    cause = steps.command(stamp * MS)
    if not cause:
        steps.took(stamp * MS)
    return cause


def test_a_controller_is_waited_for_once_it_has_spoken():
    steps = machine(wait=0.2)
    world = World(steps)
    world.until(3)
    assert world.now == 0
    world.answer = lambda do: do is Do.MOTION and command(steps, steps.clock // MS)
    world.until(20)
    assert world.now == 0 and steps.commands.missed == 0 and steps.late == 0
    world.answer = lambda do: None
    world.until(5)
    assert steps.commands.missed == 4 and not steps.commands.silent
    assert world.now == pytest.approx(0.8 * S, abs=0.1 * S)
    world.until(1)
    assert steps.commands.silent
    silent = world.now
    world.until(100)
    assert world.now == silent and steps.commands.missed == 5
    world.answer = lambda do: do is Do.MOTION and command(steps, steps.clock // MS)
    world.until(10)
    assert not steps.commands.silent and world.now == silent


def test_commands_are_judged_by_their_stamp():
    steps = machine()
    world = World(steps)
    steps.clock = 10 * S
    world.until(1)  # the clock says 10.01 s
    assert command(steps, 10_020) == "step_future"
    assert command(steps, 9_000) == "step_past"
    assert command(steps, 10_010) == "" and command(steps, 10_010) == "step_twice"
    assert steps.late == 0, "it answers the tick: the clock has not gone on"
    assert command(steps, 10_009) == "step_past" and steps.late == 0, "a newer one is taken"
    world.answer = lambda do: do is Do.MOTION and found.append(command(steps, steps.clock // MS))
    found: list = []
    world.until(2)
    assert found == ["", ""] and steps.late == 0 and steps.clock == 10_030 * MS
    world.answer = lambda do: None
    world.until(1, within=0.1)
    assert steps.clock == 10_040 * MS
    assert command(steps, 10_030) == "step_twice" and command(steps, 10_031) == "" and steps.late == 0
    world.until(1)
    world.until(1, within=5.0)
    late = steps.late
    assert steps.clock == 10_060 * MS and command(steps, 10_045) == "" and steps.late == late + 1, "of the step before"
    unstamped = steps.unstamped
    assert command(steps, 0) == "" == command(steps, 0) and command(steps, 1_700_000_000_000) == ""
    assert steps.unstamped == unstamped + 3


def test_neither_pause_nor_a_standstill_of_the_process_trips_a_wait():
    steps = machine(wait=1.0)
    world = World(steps)
    motion(steps, 1000, 1010)
    world.until(1)
    world.until(1, within=0.5)
    assert steps.doing == "waiting for motion"
    steps.paused = True
    world.until(1, within=30.0)
    assert steps.gate.cadence["odometry"].missed == 0
    steps.paused = False
    world.now += 30 * S
    world.until(1, within=0.1)
    assert steps.gate.cadence["odometry"].missed == 0 and LONGEST < S // 2
    motion(steps, 1020)
    world.until(1)
    assert world.done[-1] == (Do.TICK, 1020)


def test_a_hold_stops_everything_and_says_no_clock():
    steps = machine()
    world = World(steps)
    world.until(1)
    steps.held = "another clock"
    assert world.until(1, within=5.0) == [] and steps.doing.startswith("held")
    steps.held = ""
    assert world.until(1)[-1] == (Do.TICK, 1020)


def test_a_clock_that_is_taken_elsewhere_forgets_who_spoke():
    steps = machine()
    World(steps).until(1)
    command(steps, 1_010)
    motion(steps, 1000, 1010)
    steps.go_to(500 * S)
    assert steps.clock == 500 * S and steps.commands.newest is None and not steps.gate.held
    assert command(steps, 499_000) == "" == command(steps, 500_000)


def test_the_rate_is_zero_or_not_too_small():
    assert [bool(rate_problem(value)) for value in (0.0, 0.1, 1.0, 0.05, 1e-9)] == [False] * 3 + [True] * 2
    assert "0.05" in rate_problem(0.05) and "nothing was changed: a slower clock" in rate_problem(0.05)
    with pytest.raises(ParameterError, match="lockstep.rate"):
        settle({"lockstep.rate": 0.05})


def test_a_command_may_keep_the_stamp_of_the_sample_that_it_answers():
    """Its chain has 80 ms of dead time: waited for is the stamp of the clock less that, from the first tick on."""
    steps = machine(wait=0.2, chain_delay=0.08, command_period=0.01)
    world = World(steps)
    steps.commands.expect(steps.clock)
    world.until(7)
    assert world.now == 0 and not steps.commands.missed, "the first sample's command is under way"
    world.answer = lambda do: do is Do.MOTION and found.append(command(steps, steps.clock // MS - 80))
    found: list = []
    world.until(200)
    assert set(found) == {""} and world.now == 0
    assert (steps.commands.missed, steps.late, steps.early) == (0, 0, 0) and steps.commands.slack == 0
    world.answer = lambda do: None
    world.until(2, within=5.0)
    assert steps.commands.missed == 1 and world.now == pytest.approx(0.2 * S, abs=50 * MS), "bounded and counted"
    assert command(steps, steps.clock // MS - 90) == "" and steps.late == 1
    assert command(steps, steps.clock // MS - 70) == "" and steps.early == 1, "10 ms less than declared"
    assert command(steps, steps.clock // MS + 10) == "step_future"


def test_without_its_declaration_such_a_chain_is_late_and_costs_waits():
    steps = machine(wait=0.2, command_period=0.01)
    world = World(steps)
    steps.commands.expect(steps.clock)
    world.answer = lambda do: do is Do.MOTION and command(steps, steps.clock // MS - 80)
    world.until(30)
    assert steps.late and steps.commands.missed and world.now >= 0.2 * S
