"""The tier of every test, and what a run of a tier cost.

check: kernels and bytes, texts, pure parts of the node; starts no process. trust: what a user needs to trust an
installation. nightly: long repetitions. rest: everything else. What is not named here is of the rest, so a new test
runs in CI at least.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import pytest

HERE = Path(__file__).parent
CHECK = {
    "physics",
    "io",
    *(
        f"ros/test_{name}.py"
        for name in "command_task lockstep motion_task overload recording_control rule_task stepped".split()
    ),
    "ros/test_statistics.py",
    "ros/test_telegram_sender.py",
    "ros/test_topics_page.py",
    *(f"house/test_{name}.py" for name in "contract docs face floors manual same_bits versions_found views".split()),
}
TRUST = {
    "spans",
    "sim",
    "runs",
    "validation",
    "io/test_bag.py",  # these two start processes
    "io/test_typestore.py",
    "io/test_motion.py",  # these two take long
    "io/test_plausible.py",
    "house/test_jobs.py",
    "house/test_package.py",
    "house/test_readme.py",
    "ros/test_end_to_end.py::test_topics_frames_stamps_and_recording",
    "testing/test_tow.py::test_a_node_in_real_time_from_start_to_end",
}
REST = {  # of folders named above, long for what they add there
    "io/logs",  # needs the extra `import`
    "io/test_rough_motion.py",
    "io/test_step_guard.py",
    "physics/test_friction.py",
    "physics/test_packed.py",
    "runs/imports",  # needs the extra `import`
    "runs/scores",
    "runs/test_live_changes.py",
    "runs/test_make_bags.py",
    "runs/test_odd_stamps.py",
    "runs/test_picture.py",
    "runs/test_resume.py",
    "sim/test_careless_commands.py",
    "sim/test_swivel.py",
    *(f"validation/test_cases_{name}.py" for name in "contact hydro slack waves".split()),
    "validation/test_setpoint_runs.py",
}
ALONE = {  # of the rest: several processes in real time, which other work on the machine would hold up
    "examples/test_heave_compensator.py",
    "examples/test_dying_controller.py",
    "ensemble/test_ensemble_live.py",
    *(f"ros/test_{name}.py" for name in "clock_player controller end_to_end health inputs joint_command live".split()),
    *(f"ros/test_{name}.py" for name in "lockstep_node real ros2_control ros2_control_lockstep run_is_replay".split()),
    "ros/test_telegrams_node.py",
    "view/test_view_page.py",
}
NIGHTLY = {  # long, and beside what the rest has of them already
    "verification/test_bench.py::test_the_throughput_of_a_sweep_is_a_command",
    "calibrate/test_calibrate_command.py::test_a_run_with_another_drag_is_found_with_noise_and_latency",
    "calibrate/test_calibrate_command.py::test_the_truth_is_in_the_intervals_of_twenty_logs",
    "ensemble/test_ensemble_follow.py::test_twins_of_the_same_ranges_are_inside_and_a_drag_half_as_large_again_is_seen",
    "verification/test_bench.py::test_the_whole_tow_has_both_drums_and_says_what_feeding_brings",
    "verification/test_bench.py::test_a_haul_and_back_is_a_row",
    "validation/test_setpoint_runs.py::test_constant_tension_holds_for_half_an_hour",
}
WITHOUT_KERNELS = {"install"}  # tiers that run those of other installs
COMPILE = """
from cable_sim_ros import Simulator
from cable_sim_ros.sim.rig.rig import warm_up
Simulator("flume").warm_up()
warm_up()
"""
_costs: dict[str, float] = defaultdict(float)
_begun = time.monotonic()


def tier_of(node: str) -> str:
    """check, trust, nightly or rest; node: id of a test below test/, the longest name that is listed counts."""
    name = node.partition("[")[0]
    file = name.partition("::")[0]
    for listed in (name, file, file.rpartition("/")[0], file.partition("/")[0]):
        for tier, names in (("nightly", NIGHTLY), ("trust", TRUST), ("check", CHECK), ("rest", REST)):
            if listed in names:
                return tier
    return "rest"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test with its tier."""
    for item in items:
        file = item.path.relative_to(HERE).as_posix()
        tier = tier_of(f"{file}::{item.nodeid.partition('::')[2]}")
        item.add_marker("alone" if tier == "rest" and file in ALONE else tier)


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
