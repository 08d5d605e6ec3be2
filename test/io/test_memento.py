"""What the intake remembers, as JSON and back; what does not fit is an error, never a half of it unnoticed."""

import json
from collections import deque
from types import SimpleNamespace

import numpy as np
import pytest

from cable_sim_ros.io.messages.messages import Command
from cable_sim_ros.io.motion import checkpoint_values
from cable_sim_ros.io.motion.checkpoint import set_back, taken
from cable_sim_ros.physics.heave_filter import Heave
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.physics.tick_output import Source

pytestmark = pytest.mark.check


def through_json(value):
    return json.loads(json.dumps(taken(value)))


def test_every_kind_comes_back(monkeypatch):
    monkeypatch.setitem(
        checkpoint_values.REMEMBERED, "SimpleNamespace", {"plain": list, "several": tuple, "source": Source}
    )
    rows = np.zeros(2, [("a", "f8"), ("b", "i8", 2)]).view(np.recarray)
    rows.b[1] = 3, 4
    value = SimpleNamespace(
        plain=[None, True, 3, "x", 0.1 + 0.2, -float("inf")],
        several=({"imu": [1, (2.0,)]}, {3, 1}, deque([1.5, 2.5], maxlen=2)),
        record=Command(5, float("nan"), 0.5),
        source=Source.IMU,
        data=b"\0\1",
        array=np.arange(6, dtype=np.int32).reshape(2, 3),
        rows=rows,
        inner=SimpleNamespace(count=4),
    )
    fresh = SimpleNamespace(
        **{name: None for name in vars(value)} | {"several": ({}, set(), deque(maxlen=2)), "source": Source.MEAN}
    )
    fresh.rows, fresh.inner = rows.copy(), SimpleNamespace(count=0)
    fresh.rows.b[:] = 0
    back = set_back(fresh, through_json(value))
    assert back is fresh and back.plain == value.plain and back.several == value.several
    assert back.several[2].maxlen == 2 and repr(back.record) == repr(value.record) and back.source is Source.IMU
    assert back.data == b"\0\1" and back.array.tobytes() == value.array.tobytes() and back.array.shape == (2, 3)
    assert back.rows.b.tolist() == [[0, 0], [3, 4]] and back.inner.count == 4


def test_what_settings_made_is_left_alone():
    inputs, block = make_inputs(), Heave()
    value = SimpleNamespace(inputs=inputs, block=block, call=print)
    own = SimpleNamespace(inputs=make_inputs(), block=Heave(period=30.0), call=len)
    tree = through_json(value)
    assert set(map(str, tree["object"].values())) == {"{'own': None}"}
    set_back(own, tree)
    assert own.inputs is not inputs and own.block.period == 30.0 and own.call is len


@pytest.mark.parametrize(
    "tree",
    [
        {"object": {"other": 1}},
        {"object": {"count": {"list": 3}}},
        {"object": {"count": {"array": ["f8", [2], "x"]}}},
        {"object": {"count": {"record": ["Path", [1]]}}},
        {"object": {"count": {"enum": "x"}}},
        {"object": {"count": {"call": "x"}}},
        {"object": {"count": [1]}},
        {"object": {"count": {}}},
    ],
)
def test_what_does_not_fit_is_an_error(tree):
    with pytest.raises(ValueError):
        set_back(SimpleNamespace(count=Source.MEAN), tree)
