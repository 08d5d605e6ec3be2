"""Rules on watch: closed forms of the counting, latches, whatever the cut, and every bad input."""

from math import cos, pi

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from underway import cautioned, refused, scene_with

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.sim.rule_blocks import RuleSet, slowest_tick
from cable_sim_ros.sim.rules import rainflow
from cable_sim_ros.sim.rules.latch import RULES
from cable_sim_ros.sim.rules.rainflow import Bends, Rainflow
from cable_sim_ros.sim.rules.watch import rule_watch, watched

pytestmark = pytest.mark.trust

BREAKS = 20_000.0
MOTOR = {
    "drive.model": "motor",
    "drive.inertia": 100.0,
    "drive.curve_speed": [0.0, 6.0],
    "drive.curve_pull": [2e4, 1e4],
    "drive.max_power": 5e4,
}
ALL = MOTOR | {  # every rule
    "rules.set": "unols_3hz",
    "rules.breaking_load": BREAKS,
    "rules.factor_of_safety": 4.0,
    "rules.wire_diameter": 1e-3,
    "rules.bend_radius": 0.2,
    "rules.turns_left": 3.0,
    "rules.slack_tension": 0.0,
    "rules.snap_tension": 3000.0,
    "rules.snap_time": 0.05,
    "rules.lifted_fraction": 0.2,
    "rules.groove_margin": 0.0,
    "rules.saturated_share": 0.5,
    "rules.brake_rise": 10.0,
    "rules.brake_heat_capacity": 1000.0,
    "rules.brake_cooling_time": 20.0,
    "rules.cycle_constant": 50.0,
    "rules.cycle_exponent": 3.0,
    "rules.cycle_least": 0.0,
    "rules.bend_life": 2.0,
    "rules.damage": 0.01,
}


@pytest.fixture(scope="module")
def full():
    return scene_with(**ALL)


def other(scene, **rules):
    """The scene with other thresholds."""
    return scene.model_copy(update={"rules": scene.rules.model_copy(update=rules)})


def frames_of(count, **fields):
    """Tick outputs of 10 ms that break nothing but what ``fields`` make."""
    frames = np.zeros(count, TICK_OUTPUT).view(np.recarray)
    frames.tick, frames.time = np.arange(1, count + 1), 5_000_000_000 + 10_000_000 * np.arange(1, count + 1)
    frames.tension = frames.tension_least = frames.tension_tick_max = frames.tension_most = 2000.0
    frames.drum_turns, frames.groove_margin, frames.payout = 50.0, 0.02, 100.0
    for name, values in fields.items():
        frames[name] = values
    return frames


def rules_of(scene, frames):
    return {row["rule"]: row for row in watched(scene, frames)["rules"]["rules"]}


# ---- counting

HISTORY = [-2, 1, -3, 5, -1, 3, -4, 4, -2]  # ASTM E1049-85, figure 6
COUNTED = {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}


def test_the_history_of_the_standard_has_its_cycles():
    counter = Rainflow(lambda size: size, bin_width=1.0)
    counter.add(HISTORY)
    cycles, largest, table = counter.totals()
    assert {upper - 1.0: count for upper, count in table} == COUNTED
    assert (cycles, largest) == (4.0, 9.0)
    assert counter.damage == sum(size * count for size, count in COUNTED.items())


def test_a_sine_has_its_cycles_and_damage(full):
    """N periods from crest to crest are N cycles of twice the amplitude: damage N R^m/K."""
    periods, amplitude = 25, 1000.0
    phase = 2.0 * pi * np.arange(100 * periods + 1) / 100.0
    found = watched(full, frames_of(len(phase), tension=3000.0 + amplitude * np.cos(phase)))["rules"]
    cycles = found["cycles"]["tension"]
    assert cycles["cycles"] == periods and cycles["largest_range_n"] == pytest.approx(2.0 * amplitude)
    (row,) = cycles["ranges"]  # of a hundredth of the breaking load
    assert row["cycles"] == periods and row["up_to_n"] - 201.0 < 2.0 * amplitude < row["up_to_n"] + 1.0
    assert cycles["damage"] == pytest.approx(periods * (2.0 * amplitude / BREAKS) ** 3 / 50.0)


def by_the_book(history):
    """5.4.4 of the standard, on the whole history: {range: cycles}."""
    values = [history[0]] if history else []
    for value in history[1:]:
        if value != values[-1]:
            values.append(value)
    turns = [
        v for i, v in enumerate(values) if i in (0, len(values) - 1) or (v - values[i - 1]) * (values[i + 1] - v) < 0
    ]
    left, counts = [], {}

    def count(size, cycles):
        counts[size] = counts.get(size, 0.0) + cycles

    for turn in turns:
        left.append(turn)
        while len(left) >= 3 and abs(left[-1] - left[-2]) >= (y := abs(left[-2] - left[-3])):
            if len(left) == 3:
                count(y, 0.5)
                left = left[1:]
            else:
                count(y, 1.0)
                left = [*left[:-3], left[-1]]
    for a, b in zip(left, left[1:]):
        count(abs(b - a), 0.5)
    return counts


@settings(max_examples=200)
@given(st.lists(st.integers(-20, 20), min_size=1, max_size=80), st.lists(st.integers(0, 80), max_size=4))
def test_any_history_in_any_pieces_is_counted_by_the_book(history, cuts):
    counter, at = Rainflow(lambda size: size**3, bin_width=1.0), [0, *sorted(min(c, len(history)) for c in cuts), None]
    for a, b in zip(at, at[1:]):
        counter.add(history[a:b])
    expected = by_the_book(history)
    assert {upper - 1.0: cycles for upper, cycles in counter.totals()[2]} == expected
    assert counter.damage == pytest.approx(sum(size**3 * cycles for size, cycles in expected.items()))


def test_a_motion_that_dies_out_slowly_keeps_bounded_memory(monkeypatch):
    monkeypatch.setattr(rainflow, "LONGEST", 50)
    counter = Rainflow(lambda size: 1.0)
    counter.add([(-1) ** k * (1000.0 - k) for k in range(500)])
    assert len(counter.points) <= 51 and counter.shed == 500 - 1 - 50
    assert counter.totals()[0] == pytest.approx(0.5 * 499)


def test_a_regular_sea_leaves_nothing_open():
    counter = Rainflow(lambda size: 1.0)
    counter.add([1.0, -1.0] * 500)
    assert len(counter.points) <= 3 and counter.closed >= 498.0


def test_small_ranges_are_left_out():
    counter = Rainflow(lambda size: 1.0, least=3.5)
    counter.add(HISTORY)
    assert counter.damage == sum(count for size, count in COUNTED.items() if size >= 3.5)


@pytest.mark.parametrize("amplitude, bendings", [(0.02, 0.0), (0.3, 10.0), (2.0, 20.0)])
def test_bendings_of_a_cable_that_goes_to_and_fro(amplitude, bendings):
    """0.8 m on the sheave, ten periods. Way of 4 cm: none. Of 0.6 m: a piece passes one end, out and back: one
    bending. Of 4 m: it passes both, straight to straight and back: two."""
    bends = Bends(0.8)
    bends.add([100.0 + amplitude * cos(2.0 * pi * k / 200.0) for k in range(2001)])
    assert 0.5 * bends.most == pytest.approx(bendings, abs=0.5)


def test_a_haul_bends_every_piece_once():
    bends = Bends(0.8)
    bends.add(np.linspace(100.0, 50.0, 3000).tolist())
    assert 0.5 * bends.most == 1.0
    inside = bends.halves[bends.halves > 0]
    assert (inside == 2).sum() == pytest.approx(500 - 8, abs=2), "all but those that are on the sheave at the ends"


# ---- latches


def test_a_load_is_read_at_the_rate_of_the_set(full):
    """A peak of 20 ms between two readings of 3 Hz is not seen; at 20 Hz and in any time step it is."""
    tension = np.full(300, 2000.0)
    tension[150:158] = 6000.0  # 1.51 s to 1.58 s; readings of 3 Hz at 1.34 s and 1.67 s
    seen = {}
    for name, kind in {"3": RuleSet.UNOLS_3HZ, "20": RuleSet.UNOLS_20HZ, "any": RuleSet.WATCH}.items():
        scene = other(full, set=kind)
        seen[name] = rules_of(scene, frames_of(300, tension=tension, tension_most=tension))["working_load"]
    assert not seen["3"]["broken"] and seen["3"]["worst"] == 2000.0
    assert seen["20"]["broken"] and seen["20"]["first_s"] == 1.55 and seen["20"]["seconds"] == pytest.approx(0.05)
    assert seen["any"]["first_s"] == 1.51 and seen["any"]["seconds"] == pytest.approx(0.08)
    assert seen["any"]["limit"] == BREAKS / 4.0 and seen["any"]["worst"] == 6000.0


def test_a_rule_is_latched_and_timed(full):
    margin = np.full(500, 0.02)
    margin[100:110], margin[300:350], margin[320] = -0.001, -0.002, -0.004
    row = rules_of(full, frames_of(500, groove_margin=margin))["climb_out"]
    assert row["broken"] and (row["first_s"], row["times"], row["worst"], row["worst_s"]) == (1.01, 2, -0.004, 3.21)
    assert row["seconds"] == pytest.approx(0.6) and row["first_ns"] == 5_000_000_000 + 1_010_000_000


@pytest.mark.parametrize(
    "rule, fields",
    [
        ("turns_left", {"drum_turns": 2.0}),
        ("slack", {"tension_least": -1.0}),
        ("lift_off", {"lifted_fraction": 0.5}),
        ("climb_out", {"groove_margin": -0.001}),
        ("rate_saturated", {"rate_limited": 1.0}),
        ("torque_saturated", {"motor_limited": 1.0}),
        ("power_saturated", {"motor_limited": 1.0, "motor_power": -5e4}),
        ("brake_rise", {"brake_heat": [0.0, 10_500.0, 10_500.0]}),
        ("working_load", {"tension": [2000.0] * 40 + [5001.0] * 60}),
    ],
)
def test_each_rule_is_broken_by_its_own(full, rule, fields):
    """And nothing else is, but damage."""
    count = max((len(v) for v in fields.values() if isinstance(v, list)), default=3)
    rows = rules_of(full, frames_of(count, **fields))
    assert [name for name, row in rows.items() if row["broken"] and "damage" not in name] == [rule]
    assert not any(row["broken"] for row in rules_of(full, frames_of(count)).values())


def test_a_snap_is_a_peak_soon_after_slack(full):
    """snap_time 0.05 s: five ticks."""
    least, most = np.full(100, 500.0), np.full(100, 2000.0)
    least[50] = -5.0
    for late, broken in ((5, True), (6, False)):
        peak = most.copy()
        peak[50 + late] = 4000.0
        row = rules_of(full, frames_of(100, tension_least=least, tension_tick_max=peak))["snap"]
        assert row["broken"] is broken
        assert (row["first_s"], row["worst"]) == ((0.56, 4000.0) if broken else (None, 2000.0))


def test_ratios_are_of_the_scene(full):
    rows = rules_of(other(full, bend_radius=0.26), frames_of(3))
    assert rows["sheave_ratio"]["worst"] == pytest.approx(2.0 * 0.25 / 0.010) and not rows["sheave_ratio"]["broken"]
    assert rows["wire_ratio"]["worst"] == pytest.approx(500.0) and rows["wire_ratio"]["limit"] == 400.0
    assert rows["bend_radius"]["worst"] == pytest.approx(0.25 + 0.005) and rows["bend_radius"]["broken"]
    assert rows["bend_radius"]["seconds"] == pytest.approx(0.03), "for the whole run"


def test_the_brake_cools(full):
    """10 kJ into 1 kJ/K, then 20 s time constant: 10 K e^(-t/20 s)."""
    scene = other(full, brake_rise=5.0)
    heat = np.full(4001, 10_000.0)
    heat[0] = 0.0
    row = rules_of(scene, frames_of(4001, brake_heat=heat))["brake_rise"]
    assert row["worst"] == pytest.approx(10.0)
    assert row["seconds"] == pytest.approx(20.0 * np.log(2.0), abs=0.02)


def test_damage_is_latched_at_the_cycle_that_makes_it(full):
    """Cycles of 10 kN: (1/2)^3/50 each, so that 0.01 is passed in the fifth; 100 ticks a cycle."""
    phase = 2.0 * pi * np.arange(1001) / 100.0
    row = rules_of(full, frames_of(1001, tension=8000.0 + 5000.0 * np.cos(phase)))["tension_damage"]
    assert row["broken"] and row["first_s"] == pytest.approx(4.5, abs=0.03), "half a cycle more than four"
    assert row["worst"] == pytest.approx(10 / 400.0) and row["worst_s"] == 10.01
    assert row["seconds"] == pytest.approx(10.01 - row["first_s"] + 0.01)


def test_an_older_recording_says_what_it_cannot_judge(full):
    report = watched(full, frames_of(3, lifted_fraction=np.nan))["rules"]
    assert {"rule": "lift_off", "why": "no reading, or none in the recording"} in report["not_watched"]


def test_a_new_start_is_no_motion_of_the_cable(full):
    """~/reset: the pay-out jumps back by 40 m, ticks count from 1 again."""
    frames = frames_of(400, payout=np.concatenate((np.linspace(100.0, 140.0, 200), np.full(200, 100.0))))
    frames.tick[200:] -= 200
    found = watched(full, frames)["rules"]["cycles"]["bending"]
    frames.tick[200:] += 200
    assert (found["most"], watched(full, frames)["rules"]["cycles"]["bending"]["most"]) == (1.0, 2.0)


def wild(seed, count):
    """Tick outputs that break everything now and then."""
    random = np.random.default_rng(seed)
    walk = np.cumsum(random.normal(0.0, 0.05, count))
    tension = 3000.0 + 4000.0 * np.sin(np.arange(count) / 7.0) + random.normal(0.0, 700.0, count)
    tick = np.arange(1, count + 1)
    tick[count // 2 :] -= count // 2 * int(random.integers(0, 2))
    return frames_of(
        count,
        tick=tick,
        tension=tension,
        tension_most=tension + 50.0,
        tension_tick_max=tension + 20.0,
        tension_least=tension - 4000.0,
        payout=100.0 + walk,
        drum_turns=3.0 + walk,
        lifted_fraction=random.uniform(0.0, 0.3, count),
        groove_margin=np.where(random.uniform(size=count) < 0.1, np.nan, random.normal(0.01, 0.01, count)),
        rate_limited=random.uniform(0.0, 0.7, count),
        motor_limited=random.uniform(0.0, 0.7, count),
        motor_power=random.choice([0.0, 5e4], count),
        brake_heat=np.cumsum(random.exponential(100.0, count)),
    )


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.integers(1, 400), st.lists(st.integers(0, 400), max_size=6))
@example(104, 126, [52])  # a piece without a reading, between two that break the rule
def test_the_result_does_not_depend_on_the_cut(full, seed, count, cuts):
    frames = wild(seed, count)
    whole, pieces = rule_watch(full), rule_watch(full)
    whole.add(frames)
    at = [0, *sorted(min(c, count) for c in cuts), count]
    for a, b in zip(at, at[1:]):
        pieces.add(frames[a:b])
        pieces.report()  # and asking changes nothing
    assert pieces.report() == whole.report()


def test_wild_ticks_break_every_rule_that_can_be(full):
    """Or the test above would compare nothing."""
    report = watched(full, wild(1, 400))["rules"]
    assert set(report["broken"]) == {rule.name for rule in RULES} - {"sheave_ratio", "wire_ratio", "bend_radius"}


# ---- scenes


def test_off_by_default_and_free():
    scene = load_scene("full_scale")
    assert scene.rules.set.value == "none" and rule_watch(scene) is None and watched(scene, frames_of(2)) == {}


def test_an_offline_run_has_a_tick_for_every_reading(full):
    assert slowest_tick(other(full, set=RuleSet.UNOLS_20HZ).rules) == 0.05
    assert slowest_tick(load_scene("full_scale").rules) == 1.0


SWL = {"set": "watch", "working_load": 4000.0}
REFUSED = [  # keys of the rules, what is said of one
    ({"set": "unols"}, "set = 'unols'"),
    ({"set": "watch"}, "set = watch, but no threshold is given: nothing would be watched"),
    ({"set": "unols_3hz"}, "factor_of_safety is not given, but rules.set = unols_3hz reads the tension"),
    ({"set": "watch", "factor_of_safety": 5.0}, "factor_of_safety = 5 counts from a breaking load, and that of a"),
    (SWL | {"factor_of_safety": 5.0, "breaking_load": 2e4}, "working_load = 4000 N and rules.factor_"),
    (SWL | {"factor_of_safety": 0.5}, "factor_of_safety = 0.5"),
    (SWL | {"snap_tension": 5000.0}, "snap_tension = 5000 cannot be judged without rules.slack_tension"),
    (SWL | {"cycle_constant": 10.0}, "cycle_constant = 10 cannot be judged without rules.cycle_exponent"),
    (SWL | {"cycle_exponent": 4.0}, "cycle_exponent = 4 cannot be judged without rules.cycle_constant"),
    (SWL | {"cycle_exponent": 4.0, "cycle_constant": 10.0}, "cycle_constant = 10 counts from a breaking load"),
    (SWL | {"wire_ratio": 400.0}, "wire_ratio = 400 cannot be judged without rules.wire_diameter"),
    (SWL | {"wire_diameter": 0.01}, "wire_diameter = 0.01 m is not below cable.diameter = 0.01 m"),
    (SWL | {"brake_rise": 50.0, "brake_heat_capacity": 1e4}, "brake_rise = 50 K has no effect: drive"),
    (SWL | {"set": "unols_20hz", "tension_rate": 3.0}, "tension_rate = 3 Hz is less than 20 Hz"),
    (SWL | {"set": "unols_3hz", "sheave_ratio": 20.0}, "sheave_ratio = 20 is less than 40"),
    (SWL | {"set": "unols_3hz", "wire_ratio": 100.0, "wire_diameter": 1e-3}, "wire_ratio = 100 is less than 400, that"),
    (SWL | {"tension_rate": 500.0}, "tension_rate = 500 Hz is more than 100 Hz, 1 in solver.tick"),
    ({"set": "watch", "turns_left": 3.0, "tension_rate": 3.0}, "tension_rate = 3 Hz, but no working load is given"),
    (SWL | {"lifted_fraction": 1.5}, "lifted_fraction = 1.5"),
    (SWL | {"turns_left": -1.0}, "turns_left = -1"),
    (SWL | {"damage": 0.0}, "damage = 0"),
    (SWL | {"brake": 1.0}, "brake = 1.0: there is no such key"),
]


@pytest.mark.parametrize(
    "drive, rules, text",
    [
        *(({}, *one) for one in REFUSED),
        (MOTOR, SWL | {"brake_rise": 50.0}, "brake_rise = 50 cannot be judged without rules.brake_heat_capacity"),
    ],
)
def test_what_makes_no_sense_is_refused(drive, rules, text):
    said = refused(scene_with, **drive, **{f"rules.{key}": value for key, value in rules.items()})
    (line,) = [line for line in said.splitlines() if f"rules.{text}" in line]
    assert "nothing was started" in line


def test_thresholds_that_nobody_watches_are_said():
    (said,) = cautioned(scene_with, rules__turns_left=3.0)
    assert "rules.turns_left = 3 has no effect: rules.set = none" in said
