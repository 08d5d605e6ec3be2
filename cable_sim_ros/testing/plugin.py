"""pytest plugin: the fixture `tow_sim`, which starts nodes under test and ends them after the test.

The report of a test that failed has their last lines. Imports nothing of ROS before the fixture is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from .tow_sim import Tow

TOWS = "_cable_sim_tows"  # attribute of a test's item
SHOWN = 40  # lines of a node in the report


@pytest.fixture
def tow_sim(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[..., Tow]]:
    """Function that starts a node under test, `tow_sim("full_scale", mode="lockstep")`: arguments as of `tow`.

    Each has a folder under tmp_path. All are closed after the test. Skips the test where rclpy is not installed.
    """
    pytest.importorskip("rclpy", reason="tow_sim needs rclpy (pip install 'cable_sim_ros[ros]', or a ROS 2 to source)")
    from .tow_sim import tow

    tows: list[Tow] = []
    setattr(request.node, TOWS, tows)

    def start(scene: str = "full_scale", **options: Any) -> Tow:
        options.setdefault("folder", tmp_path / f"tow_sim{len(tows)}")
        tows.append(tow(scene, **options))
        return tows[-1]

    yield start
    failures = []
    for sim in reversed(tows):
        try:
            sim.close()
        except Exception as error:  # the others are closed all the same
            failures.append(str(error))
    if failures:
        pytest.fail("\n".join(failures), pytrace=False)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Put the last lines of every process of a failed test into its report."""
    outcome = yield
    report = outcome.get_result()  # type: ignore[attr-defined]
    if report.failed:
        for number, sim in enumerate(getattr(item, TOWS, ())):
            for process in (sim.node, *sim.processes):
                report.sections.append((f"{process.name} of tow_sim {number}, last lines", process.tail(SHOWN)))
