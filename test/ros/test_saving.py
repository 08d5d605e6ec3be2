"""Save and restore of a session in lockstep, with the real simulator and without a network: back to the saved time, and
on from there bit for bit; what is refused leaves everything as it was."""

from __future__ import annotations

import math
import os
import sys
from collections import deque
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from conftest import COMPILED

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))

from hostile_files import crafted, flipped, flipped_inside, members_of, with_notes
from test_commands import command
from test_motion import imu, odometry
from test_stepped import Run, poured

from cable_sim_ros.cli import commands
from cable_sim_ros.io.bags.bag import BagReader
from cable_sim_ros.io.messages.messages import Event
from cable_sim_ros.io.motion.checkpoint import taken
from cable_sim_ros.io.motion.checkpoint_values import declared
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.plots.run import caption
from cable_sim_ros.ros.parameters import settle
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.step_choice import stepped
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.saved.savefile import differences
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.sim.verdict import Verdict

S = 1_000_000_000
pytestmark = COMPILED


class Harness(Run):
    """A session that stands at /clock 1 s until it is stepped."""

    def __init__(self, monkeypatch, **parameters) -> None:
        super().__init__(monkeypatch, **{"lockstep.start": 1.0, "lockstep.paused": True} | parameters)

    def feed(self, first: int, last: int, kind: str = "odometry", heading: float = 0.0) -> None:
        """Motion of 50 Hz from 1 s on, samples first to last; every tenth brings a command for its time."""
        for k in range(first, last):
            stamp, t = S + 20_000_000 * k, 0.02 * k
            up, rate = 0.4 * math.sin(0.9 * t), 0.36 * math.cos(0.9 * t)
            if kind == "odometry":
                angles = (0.0, 0.0, heading)
                data = odometry(stamp, (2.0 * t, 0.0, up), angles=angles, velocity=(2.0, 0.0, rate))
            else:
                data = imu(stamp, force=(0.0, 0.0, 9.81 - 0.81 * up))
            self.session.motion(Event(stamp, stamp, kind, data))

    def order(self, rate: float) -> str:
        return self.session.command(command(self.session.steps.clock, [], [rate]), 0)

    def step(self, count: int) -> list[bytes]:
        """So many ticks; their tick outputs."""
        before = len(self.frames)
        begun, text = self.session.step(count)
        assert begun, text
        self.until(before + count)
        return [frame.tobytes() for frame in self.frames[before:]]


@pytest.fixture
def make(monkeypatch):
    made = []

    def make(**parameters):
        made.append(Harness(monkeypatch, **parameters))
        return made[-1]

    yield make
    for harness in made:
        harness.close()


@pytest.mark.parametrize("name", ["full_scale", "side_scan", "lowered_ctd", "flume"])
def test_the_options_of_the_page_make_the_scene_of_a_node(name):
    """docs/control.md: cable-sim run ... --step fixed --every 0.01 saves what a node of that scene takes."""
    here = settle({"scene": name}).scene
    assert differences(stepped(load_scene(name), "fixed", 0.01), here) == []
    page = (Path(__file__).parents[2] / "docs" / "control.md").read_text("utf-8")
    assert "--step fixed --every 0.01 --save recordings/state.npz" in page
    assert differences(stepped(load_scene(name), "chosen", None), here), "what a run does by itself is refused"


@pytest.mark.parametrize("kind", ["odometry", "imu"])
def test_what_goes_on_from_a_file_is_what_would_have_gone_on(make, tmp_path, kind):
    one, path = make(), tmp_path / "new" / "tow.npz"
    one.feed(0, 200, kind)
    one.step(40)
    assert one.order(0.3) == ""
    one.step(30)
    saved, text = one.session.save(path)
    assert saved and "saved at 2." in text and str(path) in text
    clock = one.session.steps.clock
    first = one.step(20)
    assert one.order(-0.2) == ""
    whole = first + one.step(60)
    others = [make()] if kind == "odometry" else []  # another node, which has heard nothing yet
    for harness in (one, *others):
        done, text = harness.session.restore(path)
        assert text.removesuffix("; the clock goes back to it") in harness.said
        assert done and "the clock goes back to it" in text and harness.session.steps.clock == clock
        assert harness.session.state == "running" and harness.session.paused
        again = harness.step(20)
        assert harness.order(-0.2) == ""
        assert again + harness.step(60) == whole
    assert len({frame["payout"] for frame in one.frames}) > 30, "the commands moved the winch"


def _ingest(node: dict, part: str) -> dict:
    """Attributes of a part of the ingest of motion, in the notes of a node."""
    return node["intake"]["object"]["ingest"]["object"][part]["object"]


def test_a_state_that_does_not_fit_leaves_the_tow_as_it_was(make, tmp_path):
    it, path = make(), tmp_path / "tow.npz"
    it.feed(0, 200)
    it.step(30)
    assert it.session.save(path)[0]
    other_file = tmp_path / "other.npz"
    before, intake, clock = it.step(10), it.session.notes()["intake"], it.session.steps.clock
    for change in (
        lambda node: node["steps"]["object"].pop("clock"),
        lambda node: node.pop("intake"),
        lambda node: node["intake"]["object"].update(clock={"object": {}}),
        lambda node: node["steps"]["object"].update(clock="now"),
        lambda node: node["steps"]["object"].update(gate=None),
        lambda node: node["intake"]["object"]["ingest"]["object"].update(settings=5),
        lambda node: node["intake"]["object"].update(inputs=5),
        lambda node: node.update(spoken=1),
        lambda node: _ingest(node, "refused")["_cause"].update(dict=[["odom", "no such cause"]]),
        lambda node: _ingest(node, "refused")["_seconds"].update(dict=[["odom", {"dict": [["heave_scale", 1.0]]}]]),
        lambda node: _ingest(node, "_watch")["causes"].update(dict=[["odom", ""]]),
    ):
        done, text = it.session.restore(
            with_notes(path, other_file, lambda notes, change=change: change(notes["node"]))
        )
        assert not done and "other.npz: is damaged (its notes of the node do not fit" in text
        assert it.session.state == "running" and it.session.steps.clock == clock
        assert it.session.notes()["intake"] == intake
    assert it.step(10) != before, "what was refused has not stopped it"
    it.session.set_live("winch.command_timeout", 0.9)
    done, text = it.session.restore(path)
    assert done and (
        "live parameters stay as they are here: winch.command_timeout is 0.5 s in the file, 0.9 s here" in text
    )
    assert it.step(10) == before, "no command, so the time-out has no part in it"
    other = make(**{"winch.max_rate": 1.5, "cable.diameter": 0.009})
    done, text = other.session.restore(path)
    assert not done and other.session.state == "waiting" and "tow.npz: is the state of another scene: " in text
    assert "cable.diameter is " in text and "m in the file, 0.009 m here" in text and "winch.max_rate is " in text
    assert text.endswith(
        "nothing was loaded. Start 'side_scan' with the values of the file, or save it anew with those of here"
    )
    other.session.deactivate()
    text = "the node is ready: activate it first; nothing was restored"
    assert other.session.restore(path) == (False, text)
    (tmp_path / "file").write_text("x")
    done, text = it.session.save(tmp_path / "file" / "tow.npz")
    assert not done and "file: cannot be made (File exists); nothing was saved" in text


def test_a_state_of_another_clock_is_taken_to_the_present(make, tmp_path):
    """Of an offline run: the tow as it hangs, under the motion that comes; of another heading it is refused."""
    path = tmp_path / "run.npz"
    scene = override(load_scene("side_scan"), {"solver.tick": 0.02})
    run = offline.run(scene, heave=(0.5, 8.0), duration=1.0, winch="0 rate 0.5", save=path)
    it = make()
    done, text = it.session.restore(path)
    assert done and text.startswith("restored the tow of 2.000 s from ") and text.endswith("; waiting for motion")
    assert f"restored the tow of 2.000 s from {path}" in it.said
    it.feed(0, 200)
    it.step(50)
    assert it.frames[0]["payout"] == pytest.approx(run.frames["payout"][-1], abs=0.01)
    assert it.frames[-1]["payout"] == pytest.approx(it.frames[0]["payout"], abs=0.05), "it holds"
    alone = Simulator.load(path)  # the same, its winch told to hold: braking from 0.5 m/s moves the tension too
    alone.push(WinchCommand(rate=0.0, time_ns=2 * S + 2))
    assert it.frames[0]["tension"] == pytest.approx(alone.tick()["tension"], rel=0.02)
    turned = make()
    turned.feed(0, 100, heading=1.0)
    turned.step(20)
    done, text = turned.session.restore(path)
    assert not done and turned.session.state == "running"
    assert "the ship heads 0 deg in the state and 57 deg in the motion: the tow would be swept round by 57 deg" in text
    assert text.endswith("more than 30 deg; nothing was restored. Turn the ship, or use ~/reset")
    late = make()
    assert late.session.restore(path)[0]
    late.feed(0, 100, heading=1.0)
    assert late.step(20) == []
    assert late.session.state == "failed" and late.session.problem.startswith("not restored: the ship heads 0 deg")


def under_way(monkeypatch, bag: Path | None = None) -> Run:
    monkeypatch.setattr(Simulator, "warm_up", lambda self, progress=None: 0.0)
    return poured(monkeypatch, bag)


def test_a_recording_has_every_restore_and_is_replayed_bit_for_bit(monkeypatch, tmp_path):
    """Time goes back in the bag to what it says again, with other numbers, and not as far as before."""
    run, state = under_way(monkeypatch, tmp_path / "bag"), tmp_path / "tow.npz"
    run.until(40)
    assert run.session.save(state)[0]
    run.until(90)
    assert run.session.restore(state)[0]
    run.until(105)
    run.at_clock = lambda clock: None  # no command comes any more
    assert run.session.restore(state)[0]
    frames = run.until(130)
    run.close()
    assert frames[40:55].tobytes() == frames[90:105].tobytes() and np.ptp(frames.payout[40:]) > 0.01
    assert (frames.time[105:] == frames.time[40:65]).all() and (frames.tension[105:] != frames.tension[40:65]).any()
    with BagReader(tmp_path / "bag") as reader:
        log = [message.time for message in reader.as_written(reader.topics)]
    assert log == sorted(log), "readers go by these"
    again = offline.replay(tmp_path / "bag", out=tmp_path / "again")
    third = offline.replay(again.bag)
    for found in (again, third):
        assert found.frames.tobytes() == frames.tobytes()
        assert found.metrics["replay_faults"] == [] and found.verdict.state == "ok"
        assert found.metrics["largest_difference"] == {"field": "", "difference": 0.0, "ticks": 130}
        assert found.metrics["recorded_ticks"] == 130
        assert {row.count for row in found.residuals} == {130} and max(row.largest for row in found.residuals) < 1e-9

    def lacking(path, **_):
        tow = read_tow(path)
        for table in (tow.outputs, tow.behind):
            table["sim_health"] = table["sim_health"][:25]
        return tow

    monkeypatch.setattr(offline, "read_tow", lacking)
    found = offline.replay(tmp_path / "bag")
    text = "25 ticks are in the bag and 130 were simulated, of which 25 are the same and could be compared"
    assert found.metrics["replay_faults"] == [text] and found.verdict.code == 4 and found.run_verdict.state == "ok"


def test_a_recording_that_goes_back_behind_its_beginning_is_summed_up(monkeypatch, tmp_path):
    run, state = under_way(monkeypatch), tmp_path / "tow.npz"
    run.until(10)
    assert run.session.save(state)[0]
    run.until(40)
    run.record(tmp_path / "bag")
    run.until(50)
    assert run.session.restore(state)[0]
    run.until(60)
    run.close()
    again = offline.replay(tmp_path / "bag", out=tmp_path / "again")
    assert again.verdict.state == "ok" and again.metrics["ticks"] == 20
    assert again.metrics["duration_s"] == pytest.approx(19 * 0.02) and again.metrics["skip_s"] > 0.0
    assert caption(load_run(again.bag), again.metrics["skip_s"]), "what its picture says"


def test_what_the_run_was_flagged_for_is_not_the_verdict_on_its_replay(monkeypatch, tmp_path):
    """A cable that would have parted; the replay is that run to the last bit."""
    monkeypatch.setattr(Simulator, "warm_up", lambda self, progress=None: 0.0)
    scene = override(load_scene("side_scan"), {"cable.breaking_load": 300.0})
    flagged = offline.run(scene, heave=(0.5, 8.0), duration=0.3, out=tmp_path)
    assert flagged.verdict.state == "doubtful" and flagged.verdict.reasons[0].flag == "OVERLOAD"
    again = offline.replay(flagged.bag)
    assert again.frames.tobytes() == flagged.frames.tobytes() and again.verdict == Verdict()
    assert again.run_verdict == flagged.verdict and again.metrics["run_verdict"]["state"] == "doubtful"
    done = CliRunner().invoke(commands.main, ["replay", str(flagged.bag)])
    assert done.exit_code == 0 and "verdict: ok" in done.output.splitlines()
    assert any(line.startswith("the run itself: doubtful: ") for line in done.output.splitlines())


def test_files_of_somebody_who_means_harm_are_refused_and_the_node_lives(make, tmp_path):
    """A sample of hostile_run.py: crafted, flipped, and flipped below the checksum: refused, or a tow that goes on."""
    it, path = make(), tmp_path / "tow.npz"
    it.feed(0, 100)
    it.step(20)
    assert it.session.save(path)[0]
    good = path.read_bytes()
    members, rng = members_of(good), np.random.default_rng(3)
    before = it.step(5)
    assert it.session.restore(path)[0]
    files = {what: made() for what, made in crafted(good)[::16]}
    files |= {f"bit {bit}": flipped(good, bit) for bit in rng.integers(0, 8 * len(good), 20).tolist()}
    os.mkfifo(tmp_path / "pipe")
    for what, data in files.items():
        path.write_bytes(data)
        state = it.session.built_sim.snapshot()
        done, text = it.session.restore(path)
        assert not done and "\n" not in text and str(path) in text, what
        assert all((state[name] == array).all() for name, array in it.session.built_sim.snapshot().items()), what
    assert not it.session.restore(tmp_path / "pipe")[0]
    assert it.step(5) == before
    for _ in range(6):
        path.write_bytes(flipped_inside(members, rng))
        if it.session.restore(path)[0]:
            it.step(2)
            assert it.session.state in ("running", "halted")
        path.write_bytes(good)
        assert it.session.restore(path)[0] and it.session.state == "running"
    assert it.step(5) == before


def test_what_a_session_remembers_is_declared(make):
    """Of an attribute that may be absent or holds several, a file could bring anything: it needs a row."""
    it = make()
    it.feed(0, 100)
    it.feed(0, 100, "imu")
    it.step(20)
    missing, seen = set(), set()

    def look(thing):
        if id(thing) in seen or not hasattr(thing, "__dict__") or "own" in taken(thing):
            return
        seen.add(id(thing))
        for name, value in vars(thing).items():
            several = isinstance(value, (list, tuple, dict, set, deque)) or value is None
            if several and taken(value) != {"own": None} and not declared(type(thing).__name__, name):
                if not (isinstance(value, dict) and all(hasattr(part, "__dict__") for part in value.values())):
                    missing.add(f"{type(thing).__name__}.{name}")
            for part in value.values() if isinstance(value, dict) else [value]:
                look(part)

    look(it.session.intake)
    look(it.session.steps)
    assert not missing, "rows of io/motion/checkpoint_values.py"
