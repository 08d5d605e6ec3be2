"""Tests without a mark of their tier are of the rest; the kernels are compiled once; what a run of a tier cost.

The tiers stand in pytest.ini, the mark of one in the test's file: so a new test runs in CI at least.
"""

from __future__ import annotations

import gc
import json
import re
import signal
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from cable_sim_ros.limits import GARBAGE

# a shell that runs the tests in the background has it ignored, and so would all that they start
signal.signal(signal.SIGINT, signal.default_int_handler)
gc.set_threshold(*GARBAGE)
HERE = Path(__file__).parent
TIERS = {"check", "trust", "rest", "realtime", "nightly", "install"}
WITHOUT_KERNELS = {"install"}  # tiers that run those of other installs
LONG_FILE = re.compile("/(view|ahc|examples|ensemble|ros)/")  # in these folders
COMPILE = """
from cable_sim_ros import Simulator
from cable_sim_ros.sim.rig.rig import warm_up
Simulator("flume").warm_up()
warm_up()
"""
settings.register_profile("repeated", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("repeated")  # no example judged by a clock, and the same ones in every run
_costs: dict[str, float] = defaultdict(float)
_begun = time.monotonic()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Do not import files of which no test is of a tier that is asked for: that takes as long as many tests."""
    words = set(re.findall(r"\w+", config.option.markexpr))
    if not words & TIERS or "not" in words or collection_path.suffix != ".py":
        return None
    text = collection_path.read_text("utf-8")
    tiers = TIERS & set(re.findall(r"mark\.(\w+)", text))
    whole = re.search(r"^pytestmark = \[?\s*pytest\.mark\.(\w+)", text, re.M)
    if whole is None or whole[1] not in TIERS:
        tiers.add("rest")
    return None if tiers & words else True


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave each test the mark of its tier that is nearest to it, or the rest: a file's own may differ from it.

    Long files first: one of them at the end leaves all workers but its own without work.
    """
    items.sort(key=lambda item: not LONG_FILE.search(item.nodeid))
    tiers = [next((mark.name for mark in item.iter_markers() if mark.name in TIERS), "rest") for item in items]
    for node in {node for item in items for node in item.listchain()}:
        node.own_markers[:] = [mark for mark in node.own_markers if mark.name not in TIERS]
    for item, tier in zip(items, tiers, strict=True):
        item.add_marker(tier)


def pytest_collection_finish() -> None:
    """Leave what was imported out of every search for garbage: a fifth of the time of what makes many objects."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernels once, on all cores, before workers begin that would each compile them."""
    option = session.config.option
    workers = getattr(option, "numprocesses", None) or getattr(option, "tx", None)
    if (
        hasattr(session.config, "workerinput")
        or option.collectonly
        or not workers
        or option.markexpr in WITHOUT_KERNELS
    ):
        return
    subprocess.run([sys.executable, "-W", "ignore", "-c", COMPILE], cwd=HERE.parent, stdout=subprocess.DEVNULL)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up what each file costs."""
    _costs[report.nodeid.partition("::")[0]] += report.duration


def pytest_terminal_summary(terminalreporter, config: pytest.Config) -> None:
    """Say what the run cost, and keep it in runs/durations.json."""
    if config.option.collectonly or hasattr(config, "workerinput"):
        return
    wall = time.monotonic() - _begun
    tier = config.option.markexpr or "all"
    terminalreporter.write_line(f"{tier}: {wall:.0f} s of wall time, {sum(_costs.values()):.0f} s in tests")
    folder = HERE.parent / "runs"
    try:
        folder.mkdir(exist_ok=True)
        kept = {"tier": tier, "wall_s": wall, "files_s": dict(sorted(_costs.items(), key=lambda cost: -cost[1]))}
        (folder / f"durations_{tier.replace(' ', '_')}.json").write_text(json.dumps(kept, indent=1) + "\n", "utf-8")
    except OSError as error:  # a source folder that cannot be written
        terminalreporter.write_line(f"durations were not kept: {error}")
