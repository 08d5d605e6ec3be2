"""docs/contract.md against the code: fields, shapes, names and signatures that it gives."""

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

from cable_sim_ros import Simulator
from cable_sim_ros.physics import substeps
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.physics.state import LineModel, Model, State
from cable_sim_ros.physics.tick_output import SHAPE_COLUMNS, SLOPE_COLUMNS, STRUM_COLUMNS
from cable_sim_ros.sim import build, loop
from cable_sim_ros.sim.rig import rig_entries

pytestmark = pytest.mark.check

PAGE = (Path(__file__).parents[2] / "docs" / "contract.md").read_text("utf-8")


def test_inputs_have_the_fields_of_the_table():
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \[([\d, ]+)\] \|", PAGE, re.M)
    arrays = make_inputs()._asdict()
    counters = [name for name in arrays if name.endswith(("_head", "_seen"))]
    assert [name for name, *_ in rows] == [name for name in arrays if name not in counters]
    assert all((arrays[name].dtype, arrays[name].shape) == (np.int64, (1,)) for name in counters)
    for name, dtype, shape in rows:
        assert (str(arrays[name].dtype), arrays[name].shape) == (dtype, tuple(map(int, shape.split(", ")))), name


@pytest.mark.parametrize("kind", [Model, LineModel, State])
def test_records_have_the_fields_of_the_table(kind):
    (row,) = re.findall(rf"^\| `{kind.__name__}` \| (.*) \|$", PAGE, re.M)
    named = re.findall(r"`([\w.]+)`", row)
    assert set(kind._fields) <= set(named)
    assert {name for name in named if "." not in name} <= set(kind._fields)


def test_what_the_page_calls_is_there():
    block = PAGE.partition("```python\n")[2].partition("```")[0]
    for name in set(re.findall(r"\b(?:sim|Simulator)\.(\w+)", block)):
        assert hasattr(Simulator, name) or name in ("inputs", "model", "state", "output"), name
    missing = {n for n, _ in inspect.getmembers(Simulator) if not n.startswith("_")} - set(re.findall(r"\w+", block))
    assert missing == {"bring_to_rest", "chunk_tables", "set_out", "stiffness", "tolerance"}  # of the product itself
    for name in re.findall(r"keep_inputs|time_ns|position|heading", block):
        assert name in inspect.signature(Simulator.start).parameters


def test_signatures_are_those_of_the_page():
    for function, name in ((loop.drive, "drive"), (build.make_output, "make_output")):
        (given,) = re.findall(rf"{name}\(([\w, ]+)\)", PAGE)
        assert given.split(", ") == list(inspect.signature(getattr(function, "py_func", function)).parameters)
    for name in ("start", "begin", "finish", "unfinished", "link_stepper"):
        assert hasattr(substeps, name) and f"`{name}`" in PAGE
    assert {"SETTLE", "TICKS", "LIVE"} <= set(vars(loop)) and hasattr(rig_entries, "integrate")


def test_tables_of_a_tow_have_the_columns_of_the_page():
    sim = Simulator("side_scan")
    assert sim.shape.shape[1] == len(SHAPE_COLUMNS) and sim.contact.shape[1] == 9
    assert sim.output.shape.shape[2] == len(SHAPE_COLUMNS) + len(SLOPE_COLUMNS)
    assert len(STRUM_COLUMNS) == 8 and "[nodes, 8] STRUM_COLUMNS" in PAGE
