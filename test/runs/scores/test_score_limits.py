"""Limits of scores: each bad file in one clear line, cut and flipped ones too; what is violated, what is judged."""

import random

import numpy as np
import pytest
from score_seas import sea, signal

from cable_sim_ros.tools.compare.comparison import compare, exact
from cable_sim_ros.tools.compare.score import Limits, LimitsError, QuantityLimits, judge, load_limits

GOOD = """\
limits: my tow
quantities:
  tension: {bias: 10, rms: 10.5, gain: [0.99, 1.01], lag: 0.2, coherence: 0.99, peak_ratio: [0.9, 1.1]}
  body_depth: {bias: 0.1, largest: 2e-1, correlation: 0.5, damage_ratio: [0.9, 1.1]}
"""


def written(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    "text, told",
    [
        ("quantities: {tension: {bias: 1}}", ["limits", "missing"]),
        ("limits: x", ["quantities", "missing"]),
        ("limits: x\nquantities: {}", ["quantities has none", "nothing would be judged"]),
        ("limits: x\nquantities: {pull: {bias: 1}}", [":2", "quantities.pull is no quantity", "tension"]),
        ("limits: x\nquantities: {tension: {}}", ["quantities.tension has no limit", "would pass whatever it is"]),
        ("limits: x\nquantities:\n  tension:", [":3", "tension: {bias: 10.0}"]),
        ("limits: x\nquantities:\n  tension: 10", [":3", "expected a block of keys"]),
        ("limits: x\nquantities:\n  tension: {bais: 1}", [":3", "bais", "bias"]),
        ("limits: x\nquantities:\n  tension: {bias: -1}", [":3", "-1", "unit of the quantity"]),
        ("limits: x\nquantities:\n  tension: {bias: .nan}", [":3", "nan"]),
        ("limits: x\nquantities:\n  tension: {bias: .inf}", [":3", "inf"]),
        ("limits: x\nquantities:\n  tension: {bias: null}", [":3", "= null limits nothing"]),
        ("limits: x\nquantities:\n  tension: {bias: much}", [":3", "much"]),
        ("limits: x\nquantities:\n  tension: {coherence: 1.5}", [":3", "1.5", "[0, 1]"]),
        ("limits: x\nquantities:\n  tension: {gain: 1}", [":3", "gain"]),
        ("limits: x\nquantities:\n  tension: {gain: [1]}", [":3", "gain"]),
        ("limits: x\nquantities:\n  tension: {gain: [1.1, 0.9]}", [":3", "[1.1, 0.9] is upside down", "lower value"]),
        ("limits: x\nquantities:\n  tension: {gain: [0.9, .inf]}", [":3", "gain"]),
        ("limits: x\nquantities:\n  tension: {gain: [.nan, 1]}", [":3", "gain"]),
        ("scenario: x\nfaults: []", ["a scenario of faults, not a file of limits", "--faults"]),
        ("[1, 2]", ["is a list", "limits: my tow"]),
        ("limits: [", ["YAML"]),
        (b"limits: \xff", ["not UTF-8"]),
        ("", ["limits: my tow"]),
    ],
)
def test_a_bad_file_of_limits_is_refused_in_a_clear_line(tmp_path, text, told):
    path = written(tmp_path / "limits.yaml", text)
    with pytest.raises(LimitsError) as error:
        load_limits(path)
    for words in (str(path), *told):
        assert words in str(error.value)


def test_every_problem_of_a_file_is_told_at_once(tmp_path):
    path = written(tmp_path / "limits.yaml", "limits: x\nquantities:\n  pull: {bias: 1}\n  tension: {gain: [2, 1]}\n")
    with pytest.raises(LimitsError) as error:
        load_limits(path)
    assert len(error.value.problems) == 2


def test_a_file_that_is_not_there_or_a_folder(tmp_path):
    for path, why in ((tmp_path / "none.yaml", "No such file"), (tmp_path, "it is a folder")):
        with pytest.raises(LimitsError, match=why):
            load_limits(path)


def test_cut_at_64_places_and_with_300_flips_it_loads_or_is_refused(tmp_path):
    data, draw, loaded = GOOD.encode(), random.Random(1), 0
    broken = [data[: len(data) * k // 64] for k in range(64)]
    for _ in range(300):
        flipped = bytearray(data)
        flipped[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        broken.append(bytes(flipped))
    path = tmp_path / "limits.yaml"
    for one in broken:
        path.write_bytes(one)
        try:
            loaded += bool(load_limits(path).quantities)
        except LimitsError as error:
            assert error.problems and all(problem.startswith(str(path)) for problem in error.problems)
    assert 0 < loaded < len(broken)


def test_figures_are_judged_against_each_kind_of_limit():
    time, x = sea(31, 120.0)
    scores = compare([signal(time, 3000 + 30 * x)], [signal(time, 2991 + 33 * x)], "a", "b").scores
    bias = scores[0].figures["bias"]
    assert bias == pytest.approx(-9.0, abs=1.0)

    def passed(**given):
        (one,) = judge(Limits(limits="x", quantities={"tension": QuantityLimits(**given)}), scores)
        return one.passed

    assert passed(bias=1.01 * abs(bias)) and not passed(bias=0.99 * abs(bias)), "the magnitude counts"
    assert passed(gain=(1.09, 1.11)) and not passed(gain=(0.9, 1.09)) and not passed(gain=(1.11, 1.2))
    assert passed(coherence=0.99) and passed(correlation=1.0 - 1e-9)
    assert passed(peak_ratio=(1.09, 1.11)) and not passed(damage_ratio=(0.9, 1.0))
    assert passed(lag=0.01) and not passed(largest=1.0)


def test_what_was_not_scored_fails_its_limit_and_says_why():
    time, x = sea(32, 100.0)
    given = Limits(
        limits="x",
        quantities={
            "tension": QuantityLimits(coherence=0.5, lag=1.0),
            "payout": QuantityLimits(bias=1.0),
            "layback": QuantityLimits(bias=1.0),
        },
    )
    short = slice(0, 300)
    found = compare(
        [signal(time[short], x[short]), signal(time[:5], x[:5], "payout")],
        [signal(time[short], x[short]), signal(time[:5], x[:5], "payout")],
        "a",
        "b",
        limits=given,
    )
    texts = {f"{one.quantity}.{one.limit}": one for one in found.judged}
    assert not any(one.passed for one in found.judged) and found.verdict.code == 1
    assert "2 segments of 20 s, fewer than 4" in texts["tension.coherence"].text, "of one segment it is 1 whatever"
    assert "A has 5 values, fewer than 8" in texts["payout.bias"].text
    assert "not in both of the two" in texts["layback.bias"].text


def ticks(**changes):
    run = np.zeros(5, dtype=[("time", np.int64), ("tension", float), ("place", float, 3), ("status", np.int64)])
    run["time"], run["tension"] = np.arange(5) * 10**8, 3.0
    for name, (index, value) in changes.items():
        run[name][index] = value
    return run


def test_two_runs_are_equal_to_the_last_bit_or_what_differs_is_named():
    same = exact(ticks(), ticks())
    assert same.same and "every field of all 5 ticks is equal to the last bit" in same.line()
    one = exact(ticks(), ticks(tension=(3, np.nextafter(3.0, 4.0)), place=((2, 1), 0.5)))
    assert [row.field for row in one.fields] == ["place", "tension"] and not one.same
    assert (one.fields[0].first_s, one.fields[0].largest, one.fields[0].ticks) == (0.2, 0.5, 1)
    assert "2 fields differ, first at 0.2 s: place" in one.line()
    assert [row.field for row in exact(ticks(), ticks(tension=(1, -0.0))).fields] == ["tension"]
    assert [row.field for row in exact(ticks(), ticks(place=((0, 0), -0.0))).fields] == ["place"], "the sign is a bit"
    big = exact(ticks(status=(0, 2**53)), ticks(status=(0, 2**53 + 1)))
    assert [row.field for row in big.fields] == ["status"], "integers are no floats"
    nan = exact(ticks(tension=(0, np.nan)), ticks(tension=(0, np.nan)))
    assert nan.same
    odd = exact(ticks(tension=(0, np.nan)), ticks())
    assert odd.fields[0].nan_ticks == 1 and odd.fields[0].largest == 0.0
    later = ticks()
    later["time"] += 10**8
    assert exact(ticks(), later).common == 4 and not exact(ticks(), later).same
    later["time"] += 1
    assert exact(ticks(), later) is None
