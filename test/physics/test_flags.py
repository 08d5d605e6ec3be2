"""Name, bit and text of a health flag belong together, wherever one of them stands."""

import re
from pathlib import Path

import pytest

from cable_sim_ros.physics import tick_output
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.ros.report.diagnostics import ALARMS

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
