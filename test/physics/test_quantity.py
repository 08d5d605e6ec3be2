"""Bounds are checked by the Block itself, for whoever builds one.

Name, bit and text of a health flag belong together, wherever one of them stands.
"""

import math
import re
from pathlib import Path

import pydantic
import pytest

from cable_sim_ros.physics import tick_output
from cable_sim_ros.physics.parameter import REQUIRED, Block, declared, interval, quantity
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.ros.report.diagnostics import ALARMS
from cable_sim_ros.sim.scene import Scene

pytestmark = pytest.mark.check

PAGE = Path(__file__).resolve().parents[2] / "docs" / "flags.md"
FLAGS = [flag for flag in Flag if flag]


@pytest.mark.parametrize("flag", FLAGS, ids=lambda flag: flag.name)
def test_the_number_that_kernels_know_is_that_of_the_name(flag):
    """They were matched by position: with two names swapped LOW_FLOW was 32768."""
    assert type(getattr(tick_output, flag.name)) is int and getattr(tick_output, flag.name) == flag.value


def test_each_flag_has_a_bit_and_a_text_of_its_own():
    assert sorted(flag.value for flag in FLAGS) == [1 << k for k in range(len(FLAGS))]
    assert set(Flag.__members__) == {"NONE", *(flag.name for flag in FLAGS)}  # no second name of one bit
    assert len({flag.text for flag in FLAGS}) == len(FLAGS) and all(len(flag.text) > 10 for flag in FLAGS)


# what recordings say: a bit does not change its meaning, and this is not made from the declaration
RECORDED = {"NEWTON_FAILED": 1, "SLACK": 4, "DETACHED": 8, "SEABED": 2048, "SLACK_ENERGY": 8192}
RECORDED |= {"SETPOINT_LIMITED": 16384, "COMMAND_LIMITED": 32768, "LOW_FLOW": 65536}


def test_bits_are_those_of_older_recordings_and_of_the_page():
    rows = re.findall(r"^\| `([A-Z_]+)` \| (\d+) \| (.+?) \|", PAGE.read_text("utf-8"), re.M)
    page = {name: int(bit) for name, bit, text in rows if not text.startswith("s,")}
    assert page == {flag.name: flag.value for flag in FLAGS}
    assert RECORDED.items() <= page.items()


def test_a_flag_keeps_its_text_through_a_sum():
    both = Flag.SLACK | Flag.SEABED
    assert [flag.text for flag in Flag if both & flag] == [Flag.SLACK.text, Flag.SEABED.text]
    assert Flag["SLACK"] is Flag(4) is Flag.SLACK and int(both) == 2052


def test_an_alarm_is_told_once():
    """SLACK_ENERGY had two texts, the first of them dead."""
    assert len(ALARMS) == len(set(ALARMS)) and set(ALARMS) <= set(FLAGS)


class Inner(Block):
    size: float = quantity(REQUIRED, "m", 0.0, 2.0, "size")


class Sample(Block):
    closed: float = quantity(1.0, "m", 0.0, 2.0, "closed interval")
    strict: float = quantity(1.0, "m", None, 2.0, "strict lower bound", above=0.0)
    below: float = quantity(1.0, "m", None, 2.0, "open below")
    count: int = quantity(1, "1", 1, 4, "whole number")
    maybe: float | None = quantity(None, "m", 0.0, 2.0, "may be absent")
    vector: tuple[float, float] = quantity((0.0, 0.0), "m", -1.0, 1.0, "vector")
    word: str = quantity("a", "", None, None, "text")
    table: dict[str, Inner] = quantity({}, "", None, None, "table of blocks")


def refused(kind, **values):
    with pytest.raises(pydantic.ValidationError) as caught:
        Sample(**values)
    return [error for error in caught.value.errors() if error["type"] == kind]


@pytest.mark.parametrize(
    "values",
    [
        {"closed": 0.0},
        {"closed": 2.0},
        {"closed": 1},
        {"strict": 1e-300},
        {"strict": 2.0},
        {"below": -1e300},
        {"count": 1},
        {"count": 4},
        {"maybe": None},
        {"maybe": 2.0},
        {"vector": (1.0, -1.0)},
        {"vector": [1, -1]},
    ],
)
def test_bounds_belong_to_the_interval(values):
    sample = Sample(**values)
    key, value = next(iter(values.items()))
    assert getattr(sample, key) == (tuple(value) if isinstance(value, list) else value)


@pytest.mark.parametrize(
    "values, text",
    [
        ({"closed": -1e-9}, "[0, 2]"),
        ({"closed": 2.000001}, "[0, 2]"),
        ({"strict": 0.0}, "(0, 2]"),
        ({"strict": 3.0}, "(0, 2]"),
        ({"below": 3.0}, "(-inf, 2]"),
        ({"count": 0}, "[1, 4]"),
        ({"count": 5}, "[1, 4]"),
        ({"maybe": -1.0}, "[0, 2]"),
        ({"vector": (0.0, 1.5)}, "[-1, 1]"),
    ],
)
def test_outside_is_refused_with_the_interval(values, text):
    (error,) = refused("out_of_range", **values)
    assert error["ctx"]["interval"] == text and error["ctx"]["unit"]


def test_every_component_outside_is_named():
    (error,) = refused("out_of_range", vector=(-2.0, 2.0))
    assert error["ctx"]["components"] == [0, 1]


@pytest.mark.parametrize(
    "kind, values",
    [
        ("not_a_number", {"closed": "1"}),
        ("not_a_number", {"closed": True}),
        ("not_a_number", {"count": "2"}),
        ("not_a_number", {"count": False}),
        ("not_a_number", {"maybe": "1"}),
        ("not_a_number", {"vector": ("0", 0.0)}),
        ("not_a_number", {"vector": [True, 0.0]}),
        ("finite_number", {"closed": math.nan}),
        ("finite_number", {"closed": math.inf}),
        ("finite_number", {"vector": (0.0, -math.inf)}),
        ("finite_number", {"maybe": math.nan}),
        ("int_from_float", {"count": 1.5}),
        ("extra_forbidden", {"colour": 1}),
    ],
)
def test_text_truth_nan_infinity_fractions_of_a_count_and_unknown_keys_are_refused(kind, values):
    assert refused(kind, **values)


def test_blocks_are_frozen():
    with pytest.raises(pydantic.ValidationError, match="frozen"):
        Sample().closed = 1.0


def test_blocks_in_a_table_are_checked():
    (error,) = refused("out_of_range", table={"a": {"size": 3.0}})
    assert error["loc"] == ("table", "a", "size")


def test_a_default_outside_its_bounds_is_refused():
    class Wrong(Block):
        size: float = quantity(3.0, "m", 0.0, 2.0, "size")

    with pytest.raises(pydantic.ValidationError, match=r"outside \[0, 2\] m"):
        Wrong()


@pytest.mark.parametrize(
    "bounds, text",
    [
        ((None, None), ""),
        ((0.0, None), "[0, inf)"),
        ((None, 1e11), "(-inf, 1e+11]"),
        ((0.1234567, 1), "[0.1234567, 1]"),
    ],
)
def test_interval_as_text(bounds, text):
    assert interval(*bounds) == text


def test_declared_gives_each_number_once_with_its_dotted_key():
    keys = [item.key for item in declared(Sample)]
    assert keys == ["closed", "strict", "below", "count", "maybe", "vector", "word", "table.<name>.size"]


def test_every_number_of_a_scene_states_unit_bounds_and_meaning():
    for item in declared(Scene):
        assert item.doc, item.key
        if item.unit:
            assert item.interval, f"{item.key} has a unit and no bounds"
            low = item.low if item.low is not None else item.above
            assert low is None or item.high is None or low < item.high, item.key
