"""Experiments over processes: the same as in one, named by what --quick left out; a process that ends is said."""

import os
import subprocess
import sys
from contextlib import nullcontext
from inspect import signature

import numpy as np
import pytest

from cable_sim_ros.errors import RunError
from verification import experiments
from verification.experiments import EXPERIMENTS, Comparison, Result, module_of, repeat, run, sendable
from verification.experiments.flume import CHOSEN, trace
from verification.experiments.table import as_data, digest, page
from verification.experiments.workers import here, workers


def test_runs_are_the_same_bit_for_bit_in_processes_and_in_their_order():
    """A run of the flume, half a second; another of other steps shows that runs can differ."""
    asked = [("simplified", 0.5, 2, CHOSEN), ("no motion", 0.5, 1, CHOSEN._replace(step=0.02))]
    with workers(2) as over:
        assert list(over(divmod, [(k, 3) for k in range(20)])) == [divmod(k, 3) for k in range(20)]
        (apart,) = over(trace, asked[:1])
    one, other = here(trace, asked)
    assert np.array_equal(apart.path, one.path) and apart.volume == one.volume and apart.track == one.track
    assert len(one.path) == pytest.approx(2 * len(other.path), abs=2)
    assert not np.array_equal(one.path[::2], other.path), "the test compares nothing"


def test_a_process_that_ends_is_said_with_a_remedy():
    with workers(2) as over, pytest.raises(RunError, match=r"process .* ended .* no result was written.* --workers 1"):
        list(over(os._exit, [(3,)]))


def test_workers_take_one_thread_before_anything_is_loaded():
    """OpenBLAS looks at its environment once, when numpy loads it: what the worker begins with must not load it."""
    code = "import sys, cable_sim_ros.tools.sweeps.threads; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_an_experiment_sent_by_a_process_has_its_rows_page_and_picture(tmp_path, monkeypatch):
    """Drag is the shortest with tables of its own: 1 s."""
    whole = run("drag", None)
    monkeypatch.setattr(experiments, "run", lambda *_, **__: whole)
    sent = sendable("drag", None, False, True)
    assert as_data(sent) == as_data(whole) and page([sent]) == page([whole])
    assert digest([sent]) == digest([whole])
    assert sent.plot(tmp_path / "new").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(RuntimeError, match="no picture was asked for"):
        sendable("drag", None, False, False).plot(tmp_path)


def test_the_page_of_the_manual_has_every_miss_with_its_reason_and_of_what_is_kept_the_nearest():
    rows = [
        Comparison("near", "N", 10.9, 10.0, 1.0, "A"),
        Comparison("nearer", "N", 10.1, 10.0, 1.0, "A"),
        Comparison("off", "N", 12.0, 10.0, 1.0, "A", "the sea"),
        Comparison("open", "N", 12.0, 10.0, None, "B", "the ship"),
        Comparison("open too", "N", 12.0, None, None, "B"),
    ]
    short = digest([Result("pulley", rows, [{"choice": "other", "x": 1.0}], lambda folder: folder)])
    assert "2 within what is allowed, 1 missed, 2 not judged." in " ".join(short.split())
    assert "| A | 2 | 1 | near | N | 10 | 10.9 | 1 |" in short
    assert "| off | N | 10 | 12 | 1 | MISSED | A | the sea |" in short and "| B | the ship |" in short
    assert "nearer" not in short and "open too" not in short and "other |" not in short


def test_results_come_in_the_order_of_their_names(monkeypatch):
    handed = []
    monkeypatch.setattr(experiments, "hands_out", lambda name: name == "flume")
    monkeypatch.setattr(experiments, "run", lambda name, *_: handed.append(name) or name)
    monkeypatch.setattr(experiments, "sendable", lambda name, *_: name)
    monkeypatch.setattr(experiments, "workers", lambda count: nullcontext(here))
    assert repeat(("drag", "flume", "viv"), None, count=2) == ["drag", "flume", "viv"] and handed == ["flume"]
    assert repeat(("viv",), None, count=2) == ["viv"] and handed == ["flume", "viv"], "alone: in this process"


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_what_quick_leaves_out_is_said(name):
    module = module_of(name)
    assert ("quick" in signature(module.experiment).parameters) == bool(getattr(module, "QUICK", ""))


@pytest.mark.nightly
def test_a_quick_result_says_so_on_its_page_and_in_its_data():
    result = run("wake", None, quick=True)
    assert "table A3 alone" in as_data(result)["shortened"]
    assert "\n\nShortened by `--quick`: table A3 alone" in page([result])
    assert as_data(run("load_cell", None, quick=True))["shortened"] == "", "it has no shorter form"
