"""The journal of a recording: what it says where entries are missing, damaged, overwritten, or of another scene."""

from __future__ import annotations

import base64
import json
import re
from typing import get_args

import numpy as np
import pytest

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.recordings.journal import MSGTYPE, Journal, Sample, Start, encoded, packed, read_journal, state_of
from cable_sim_ros.physics.inputs import MOTION_COLUMNS, MOTION_ROWS, make_inputs, push_command, push_motion

pytestmark = pytest.mark.check


def rings(inputs):
    return {f"inputs_{name}": array.copy() for name, array in inputs._asdict().items()}


BEGIN = Start(0, (0.0, 0.0), None)


def begun(start=BEGIN, parameters=None):
    """Rings, and the journal of a run that has begun with the messages that it writes."""
    inputs, messages = make_inputs(), []
    journal = Journal(messages.append, inputs)
    journal.start(0, start, parameters or {}, rings(inputs))
    return inputs, messages, journal


def written():
    """Messages of a run of six ticks, each with three new samples, and a command at the third."""
    inputs, messages, journal = begun(Start(1000, (1.0, 2.0), 0.5), {"winch.command_timeout": 0.7})
    for tick in range(6):
        for _ in range(3):
            head = int(inputs.motion_head[0])
            push_motion(inputs, 1000 + head, [float(head)] * 14)
        if tick == 2:
            push_command(inputs, 1007, np.nan, -0.25)
        journal.tick(tick, *inputs.heads)
    journal.end(6, "end")
    return messages


def test_what_is_written_is_read_back_tick_by_tick():
    report = read_journal(written())
    (segment,) = report.segments
    assert report.faults == [] and segment.ticks == 6 and not segment.halted
    assert segment.start == Start(1000, (1.0, 2.0), 0.5, "start")
    assert segment.parameters == {"winch.command_timeout": 0.7}
    assert segment.heads().tolist() == [[3 * tick, int(tick > 2), 0, 0] for tick in range(1, 7)]
    again = make_inputs()
    segment.load(again)
    segment.push(again, 18, 1, 0, 0)
    assert again.motion_time[:18].tolist() == list(range(1000, 1018)) and again.motion[17, 0] == 17.0
    assert again.command_time[0] == 1007 and np.isnan(again.command[0, 0]) and again.command[0, 1] == -0.25


def test_the_order_of_the_messages_does_not_matter():
    (there,), (back,) = read_journal(written()).segments, read_journal(written()[::-1]).segments
    assert there.heads().tolist() == back.heads().tolist() and there.motion == back.motion


def test_missing_and_damaged_entries_are_said():
    messages = written()
    assert read_journal([*messages[:2], *messages[3:]]).faults == ["1 of 8 entries are missing"]
    report = read_journal([*messages, b"\0\1\0\0junk"])
    assert len(report.faults) == 1 and report.faults[0].startswith("an entry cannot be read (")
    (fault,) = read_journal([encoded({"n": 0, "tick": 0, "start": {"cause": "start"}})]).faults
    assert fault.startswith("entry 0 cannot be used (start.time: Field required")


def test_samples_that_the_ring_has_lost_are_counted():
    inputs, messages, journal = begun()
    for k in range(MOTION_ROWS + 100):
        push_motion(inputs, k, [0.0] * 14)
    journal.tick(0, MOTION_ROWS + 100, 0, 0, 0)
    journal.lose(1, 7)
    first, second = read_journal(messages).faults
    assert first == "108 samples or ticks before tick 0 are not known"
    assert second == "7 samples or ticks before tick 1 are not known"


@pytest.mark.parametrize("ended, halted", [("halted", True), ("recording ended", False)])
def test_a_halt_and_a_reset_after_it(ended, halted):
    inputs, messages, journal = begun()
    journal.tick(3, 0, 0, 0, 0)
    journal.end(4, ended)
    journal.start(5, Start(9, (0.0, 0.0), 0.0, "reset"), {}, rings(inputs))
    journal.tick(5, 0, 0, 0, 0)
    journal.end(7, "end")
    first, second = read_journal(messages).segments
    assert first.halted is halted and first.ticks == (4 if halted else 5) and second.ticks == 2
    assert second.start.cause == "reset" and second.first == 5


def entry(message) -> dict:
    return json.loads(STORE.deserialize_cdr(message, MSGTYPE).data)


def changed(place: int, **values) -> list[bytes]:
    messages = written()
    messages[place] = encoded(entry(messages[place]) | values)
    return messages


@pytest.mark.parametrize(
    ("place", "values", "text"),
    [
        (2, {"motion": [[1] * 3]}, r"entry 2 cannot be used \(motion.0.3: Field required, got \[1, 1, 1\]\)"),
        (2, {"motion": [[1009, *[float("inf")] * 14]]}, "entry 2 .*motion.0.1: Input should be .* got inf"),
        (2, {"motion": [[1e999] * 15]}, r"entry 2 cannot be used \(motion.0.0: Input should be a"),
        (2, {"motion": [[1000, *[0.0] * 14]]}, "entry 2 .*of a sample, 1000 ns, does not advance past 1002 ns"),
        (2, {"motion": [[2000 + k, *[0.0] * 14] for k in range(1025)]}, "entry 2 .*motion: List .* at most 1024"),
        (2, {"commands": [[5, "fast", None]]}, r"entry 2 cannot be used \(commands.0.1: "),
        (2, {"set": ["winch.command_timeout"]}, r"entry 2 cannot be used \(set: Input should be an object"),
        (2, {"set": {"winch.command_timeout": [1]}}, r"entry 2 cannot be used \(set.winch.command_timeout"),
        (2, {"lost": -1}, r"entry 2 cannot be used \(lost: "),
        (2, {"tick": 1.5}, r"entry 2 cannot be used \(tick: "),
        (4, {"tick": 1}, r"entry 4 cannot be used \(it is of tick 1, behind one of tick 2\)"),
        (2, {"end": 5}, r"entry 2 cannot be used \(end: "),
        (2, {"n": 3}, "entry 3 is there twice, the second is left out"),
        (0, {"start": "now"}, r"entry 0 cannot be used \(start: "),
    ],
)
def test_an_entry_that_is_none_is_left_out_and_said(place, values, text):
    faults = read_journal(changed(place, **values)).faults
    assert re.match(text, faults[0]), faults
    assert all("\n" not in fault and len(fault) < 300 for fault in faults)


@pytest.mark.parametrize(
    ("state", "text"),
    [
        ("!", "the state in the journal cannot be read"),
        (packed(rings(make_inputs()))[:200], "the state in the journal cannot be read"),
        ("UEsDBA==", "its end is missing"),
        (packed(rings(make_inputs()) | {"inputs_motion": np.zeros(65_000_000, np.uint8)}), "more than 64000000"),
        (packed(rings(make_inputs()) | {"inputs_motion_head": np.array([-5])}), "-5 were written and 0 seen"),
        (packed(rings(make_inputs()) | {"inputs_motion": np.zeros(3)}), r"'inputs_motion' is f\[3\]"),
        (packed(rings(make_inputs()) | {"other": np.zeros(3)}), "'other.npy' is not part of it"),
        (packed({}), "'inputs_motion_time' is missing"),
    ],
)
def test_a_state_that_is_none_is_left_out_and_said(state, text):
    begun = entry(written()[0])
    begun["start"]["state"] = state
    report = read_journal([encoded(begun), *written()[1:]])
    assert report.segments == [] and re.search(text, report.faults[0]), report.faults


def test_faults_without_number_are_counted():
    report = read_journal([encoded({"n": "x"})] * 500)
    assert len(report.faults) == 21 and report.faults[-1] == "and 480 more"


def test_a_sample_has_the_columns_of_the_ring():
    assert len(get_args(Sample)) == 1 + MOTION_COLUMNS


def test_a_state_as_numpy_packs_it_is_read(tmp_path):
    """So recorders before the common packing did; their bags stay readable."""
    empty = rings(make_inputs())
    np.savez_compressed(tmp_path / "state.npz", **empty)
    state = state_of(base64.b64encode((tmp_path / "state.npz").read_bytes()).decode())
    assert state.rings.keys() == empty.keys()


def test_a_recording_from_before_there_were_vehicles_has_empty_rings_of_them():
    arrays = {f"inputs_{name}": array for name, array in make_inputs()._asdict().items() if "vehicle" not in name}
    state = state_of(packed(arrays))
    assert not state.rings["inputs_vehicle_head"][0] and state.rings["inputs_vehicle"].shape == (MOTION_ROWS, 14)
    del arrays["inputs_motion"]
    with pytest.raises(ValueError, match="'inputs_motion' is missing"):
        state_of(packed(arrays))
