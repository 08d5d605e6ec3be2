"""A node under test: what it is fed and asked, what goes wrong, and that nothing is left of it."""

import os
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from test_process import poll

pytest.importorskip("rclpy")
pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs real time")

from cable_sim_ros.ros import watchdog  # noqa: E402
from cable_sim_ros.ros.child import MARK  # noqa: E402
from cable_sim_ros.testing import Tow, TowError, tow  # noqa: E402
from cable_sim_ros.testing.arguments import unmet  # noqa: E402
from cable_sim_ros.testing.node_topics import PATIENCE, SPEAK, Link  # noqa: E402

NAN = float("nan")
NODE = "import sys, time; print('so far so good', flush=True); "


def python(code):
    return (sys.executable, "-c", code)


@pytest.mark.parametrize(
    "options, text",
    [
        ({"mode": "fast"}, "mode = 'fast' is not known: nothing was started; give 'realtime' or 'lockstep'"),
        ({"command": python(NODE + "sys.exit(3)")}, "the node ended with code 3\n  so far so good"),
        (
            {"command": python(NODE + "time.sleep(60)"), "ready_within": 0.3},
            r"not ready for motion, within 0.3 s \(state starting\); the first start on a machine compiles for up "
            r"to two minutes: give ready_within=300 or leave it out\n  (so far so good|\(no output\))",
        ),
        (
            {"command": python("import time; time.sleep(60)"), "ready_within": 0.2},
            r"within 0.2 s \(state starting\); the first start .* ready_within=300 or leave it out\n  \(no output\)",
        ),
        ({"ready_within": float("nan")}, "ready_within = nan is no finite number above 0 s: nothing was started"),
        (
            {"folder": "/dev/null/tow"},
            r"folder = '/dev/null/tow' for logs .* \(.*\): nothing was started; give one that",
        ),
        (
            {"mode": "realtime", "parameters": {"time_mode": "lockstep"}},
            r"parameters\['time_mode'\] = 'lockstep' and mode = 'realtime' contradict each other: nothing was started",
        ),
        ({"scene": 42}, "scene = 42 is neither a name nor a path: nothing was started"),
        ({"parameters": {"winch.scope": {1}}}, r"parameter 'winch.scope' = \{1\} is of a type that no parameter has"),
        ({"environment": {"A": 3}}, "the node could not be started: expected str"),
        ({"command": ("/no/such",)}, "the node could not be started: .*No such file"),
        ({"parameters": {"winch.scope": -1.0}, "command": python(NODE + "time.sleep(60)")}, "winch.scope"),
        ({"scene": "no_such", "command": python(NODE + "time.sleep(60)")}, "no_such"),
    ],
)
def test_a_node_that_does_not_start_is_said_with_its_last_lines(options, text, tmp_path):
    with pytest.raises(TowError, match=text):
        tow(**{"folder": tmp_path} | options)
    assert not watchdog.marked(MARK)


def refusals(sim):
    """What is refused before anything happens."""
    for call, text in (
        (
            lambda: sim.advance(0.0),
            r"seconds = 0.0 is no finite number from 0.01 s \(one tick\): nothing was simulated",
        ),
        (lambda: sim.advance(-1), "seconds = -1 is no finite number"),
        (lambda: sim.advance(NAN), "seconds = nan is no finite number"),
        (lambda: sim.wait_until(len, within=NAN), "within = nan is no finite number above 0 s: nothing was simulated"),
        (lambda: sim.wait_until(len, within=1.0, every=0), "every = 0 is no finite number above 0 s"),
        (lambda: sim.command(rate=NAN), "rate = nan is no finite number m/s: nothing was commanded; rate=0.0 stops"),
        (lambda: sim.command(payout=float("inf")), "payout = inf is no finite number m: nothing was commanded"),
        (lambda: sim.command(rate=1, payout=3), "both rate = 1 m/s and payout = 3 m were given: nothing was commanded"),
        (lambda: sim.set("winch.max_rat", 1), "'winch.max_rat' = 1: the node has no such .* mean 'winch.max_rate'"),
        (lambda: sim.set("nosuch", 1), "'nosuch' = 1: the node has no such parameter; .* are in docs/parameters.md"),
        (lambda: sim.set("winch.max_rate", object()), "is of a type that no parameter has .* nothing was changed"),
        (lambda: sim.run("my_controller.py"), "command = 'my_controller.py' is no list of a program and its arguments"),
        (lambda: sim.run([]), r"command = \[\] is no list"),
        (lambda: sim.run(["x"], within=NAN), "within = nan is no finite number from 0 s: nothing was started"),
    ):
        with pytest.raises(TowError, match=text):
            call()


def test_a_step_is_a_whole_number_of_ticks_from_one_on():
    sim = object.__new__(Tow)  # without a node: refused before one is asked
    sim.lockstep = True
    for count, text in (
        (0, "count = 0 is no finite number from 1 tick: nothing was stepped; give whole ticks"),
        (-3, "count = -3 is no finite number"),
        (1.5, r"count = 1.5 is no whole number of ticks: nothing was stepped; advance\(\) takes s"),
    ):
        with pytest.raises(TowError, match=text):
            sim.step(count)


def test_what_was_not_there_at_its_time_is_named_with_its_number():
    values = {"commands_missed": "1", "commands_missed_in_row": "1", "commands_late": "0", "imu_missed": "0"}
    values |= {"clock_s": "7.5", "refused: step_past": "2", "motion_held": "4", "commands_early": "3"}
    assert unmet(values) == {"commands_missed": 1, "refused: step_past": 2, "commands_early": 3}


def link_without_a_node(spoken, controlled=True):
    """A Link as after `feed`, with a controller that has spoken or has not."""
    link = object.__new__(Link)
    link.spoken, link._awaited, link._fed = threading.Event(), controlled, True
    if spoken:
        link.spoken.set()
    return link


def test_the_first_command_is_awaited_before_the_first_step(monkeypatch):
    speak = "cable_sim_ros.testing.node_topics.SPEAK"
    monkeypatch.setattr(speak, 60.0)
    link, looks = link_without_a_node(spoken=False), []
    begun = time.monotonic()
    threading.Timer(0.1, link.spoken.set).start()
    link._first_command(lambda: looks.append(0))
    assert 0.1 <= time.monotonic() - begun < 30.0 and looks, "until it has come; a controller that ends is seen"

    for spoken, controlled, wait in ((True, True, 60.0), (False, False, 60.0), (False, True, 0.3)):
        monkeypatch.setattr(speak, wait)
        link, begun = link_without_a_node(spoken, controlled), time.monotonic()
        link._first_command(lambda: None)
        took = time.monotonic() - begun
        assert took >= 0.3 if wait == 0.3 else took < 30.0
        monkeypatch.setattr(speak, 60.0)
        begun = time.monotonic()
        link._first_command(lambda: None)
        assert time.monotonic() - begun < 30.0, "once"


@pytest.mark.parametrize("fed, patience", [(True, 20.0), (False, SPEAK)])
def test_a_controller_that_came_after_the_motion_is_not_given_the_patience_of_a_busy_machine(
    monkeypatch, fed, patience
):
    """It has nothing to answer while the clock stands, unless it commands by the clock itself."""
    waits = []
    clock = SimpleNamespace(monotonic=lambda: sum(waits))
    monkeypatch.setattr("cable_sim_ros.testing.node_topics.time", clock)
    link = link_without_a_node(spoken=False)
    link.spoken = SimpleNamespace(wait=lambda seconds: waits.append(seconds))
    link._fed, link._patience = fed, 20.0
    link._first_command(lambda: None)
    assert sum(waits) == pytest.approx(patience, abs=0.02)


def test_the_first_commands_of_a_controller_that_came_later_are_awaited_tick_by_tick(monkeypatch):
    """The node knows from the second on when the next is due: before, a busy machine would go on without it."""
    link, looks = link_without_a_node(spoken=False), []
    link._commands, link._unpaced = 0, 60.0

    def command():
        looks.append(0)
        if len(looks) == 5:
            link._commands += 1

    monkeypatch.setattr("cable_sim_ros.testing.node_topics.LOOK", 60.0)
    link._answer(0, command)
    assert len(looks) == 5 and link._unpaced == 60.0 and not link._paced()
    link._commands += 1
    assert link._paced(), "the node waits by itself"
    link._commands, link._unpaced = 0, 0.2
    monkeypatch.setattr("cable_sim_ros.testing.node_topics.LOOK", 0.1)
    for _ in range(2):
        assert not link._paced()
        link._answer(0, lambda: None)
    assert link._paced(), "one that says nothing is waited for so long and no longer"


def test_the_node_waits_longer_for_what_is_known_to_come():
    link, sent = link_without_a_node(spoken=True), []
    link._publishers, link.processes, link._given, link._patience = {}, [SimpleNamespace(code=None)], False, 1.0
    link._wait, link._controlled, link._put = 1.0, True, lambda name, value: sent.append((name, value))
    link._be_patient(True)
    link._be_patient(True)
    assert sent == [("lockstep.wait", PATIENCE)], "once"
    link._be_patient(False)  # the motion ends
    link._be_patient(True)
    link.processes[0].code = -9
    link._be_patient(True)
    assert [value for _, value in sent] == [PATIENCE, 1.0, PATIENCE, 1.0]
    link.processes.clear()
    link._controlled, link._publishers["command"] = False, None  # the test commands itself, when it likes
    link._be_patient(True)
    link._controlled = link._given = True  # by parameter or `set`
    link._be_patient(True)
    assert len(sent) == 4


@pytest.mark.trust
def test_a_node_in_real_time_from_start_to_end(tmp_path):
    scenario = tmp_path / "faults.yaml"
    scenario.write_text("scenario: a\nfaults:\n  b: {at: 0.5, target: encoder, kind: bias, size: 7.0}\n", "utf-8")
    given = {"setpoint.algorithm": "hold", "instruments.encoder.on": True, "faults_file": str(scenario)}
    told = {"PYTHONFAULTHANDLER": "1"}  # where a crash was, on one of many ends with Python 3.13
    with tow(
        "full_scale", parameters=given, folder=tmp_path, record=True, may_be_doubtful=True, environment=told
    ) as sim:
        assert sim.environment["ROS_DOMAIN_ID"] == str(sim.domain) and sim.state == "waiting"
        with pytest.raises(TowError, match=r"step\(\) is for mode='lockstep'"):
            sim.step()
        with pytest.raises(TowError, match="unmet is of mode='lockstep'"):
            assert sim.unmet
        with pytest.raises(TowError, match=r"give rate=\.\.\. in m/s or payout=\.\.\. in m: nothing was commanded"):
            sim.command()
        refusals(sim)
        begin = sim.feed(heave=(1.0, 8.0), duration=60.0)
        frames = sim.advance(1.0)
        assert frames.time[0] * 1e-9 > begin and not (np.diff(frames.time) % 10_000_000).any()
        with pytest.raises(ValueError, match="read-only"):
            frames.tension[0] = 0.0
        frames = sim.wait_until(lambda frames: frames.encoder_payout[-1] > frames.payout_counter[-1] + 6.9, within=10.0)
        assert frames.encoder_payout[0] == frames.payout_counter[0], "the fault of a scenario comes at its time"
        poll(lambda: "faults.encoder.kind = bias, by faults_file" in sim.node.tail(), 60.0)

        sim.command(rate=0.2)
        sim.wait_until(lambda frames: frames.payout_rate.max() > 0.15, within=10.0)
        with pytest.raises(TowError, match=r"not within 0.2 s of simulation; at .* s: tension \d+ N, pay-out"):
            sim.wait_until(lambda frames: frames.payout[-1] < 0.0, within=0.2)
        sim.set("setpoint.algorithm", "simplified_sheave")
        with pytest.raises(TowError, match=r"winch.max_rate = 1.0 was refused"):
            sim.set("winch.max_rate", 1.0)
        assert "static equilibrium" in sim.call("reset")
        with pytest.raises(TowError, match="pause: "):
            sim.call("pause", True)
        from sensor_msgs.msg import Imu

        other = sim._link.client.node.create_publisher(Imu, "imu/data", 10)
        with pytest.raises(TowError, match=rf"2 publishers of imu/data in domain {sim.domain}: "):
            sim.advance(5.0)
        sim._link.client.node.destroy_publisher(other)

        with pytest.raises(TowError, match="mute has no publisher of winch/command or of other commands, within 0.1 s"):
            sim.run(python("import time; time.sleep(60)"), name="mute", within=0.1)
        gives_up = python("print('I give up'); raise SystemExit(7)")
        assert sim.run(gives_up, name="a pilot", within=0.0, may_end=True).wait(60.0) == 7
        sim.run(gives_up, name="the pilot", within=0.0)
        with pytest.raises(TowError, match="the pilot ended with code 7\n  I give up"):
            sim.advance(20.0)
        up = tmp_path / "the other is up"  # in a session of its own by then
        other = f"import pathlib, time; pathlib.Path({str(up)!r}).touch(); time.sleep(60)"
        stray = (
            f"import subprocess, sys, time; subprocess.Popen([sys.executable, '-c', {other!r}], start_new_session=True)"
        )
        sim.processes.clear()
        sim.run(python(f"{stray}; time.sleep(60)"), name="one that leaves another", within=0.0)
        poll(up.exists, 60.0)
    assert len(sim.leftovers) == 1
    assert sim.node.code == 0, sim.node.tail(60)
    assert sim.metrics["state"] == "stopped" and sim.metrics["last"] == "running"
    assert not watchdog.marked(sim._mark)
    assert (sim.recording / "metadata.yaml").is_file()
    sim.close()
    for late in (lambda: sim.advance(1.0), lambda: sim.command(rate=0.0), lambda: sim.set("setpoint.gain", 1.0)):
        with pytest.raises(TowError, match="this tow is closed: nothing was done"):
            late()


def test_of_two_commands_while_the_clock_stands_the_newest_wins(tmp_path):
    """And motion that runs out is no calm sea: it fails the advance, and the verdict the close."""
    parameters = {"setpoint.algorithm": "hold", "lockstep.wait": 0.05}
    sim = tow("full_scale", mode="lockstep", parameters=parameters, folder=tmp_path)
    sim.feed(heave=(0.2, 8.0), duration=1.5)
    begun = sim.advance(0.5).payout[-1]
    ends = sim._link.client.node.get_subscriptions_info_by_topic("/tow_sim/imu/data")
    assert [end.qos_profile.reliability.name for end in ends] == ["RELIABLE"], "what is lost is sent again"
    sim.command(rate=0.5)
    sim.command(rate=-0.5)
    assert sim.advance(0.3).payout[-1] < begun - 0.1
    with pytest.raises(
        TowError, match=r"the motion that was fed ends at .* of the 300 tick outputs to .* feed more, or"
    ):
        sim.advance(3.0)
    assert len(sim.advance(2.0, motion_may_end=True)) == 200 and sim.missing == 0
    with pytest.raises(TowError, match="the run is doubtful: MOTION_STALE for .* give may_be_doubtful=True"):
        sim.close()
    assert sim.metrics["commands_refused"] == {}


KILLED = """
import os, signal
from cable_sim_ros.testing import TowError, tow
sim = tow("full_scale", mode="lockstep", folder={folder!r})
sim.feed(heave=(0.2, 8.0), duration=4.0)
os.kill(sim.node.pid, signal.SIGKILL)
try:
    sim.advance(0.5)
except TowError as error:
    print(error, sim._mark, flush=True)
"""


def test_a_tow_that_nobody_closes_ends_with_its_session(tmp_path):
    """After kill -9 of its node, which is said, and not as a service without an answer; nothing aborts."""
    done = subprocess.run(
        [sys.executable, "-c", KILLED.format(folder=str(tmp_path))], capture_output=True, text=True, timeout=600
    )
    said = done.stdout.splitlines()
    assert done.returncode == 0 and said[0] == "the node ended with code -9", done.stdout + done.stderr
    assert not watchdog.marked(said[-1].split()[-1])
