"""The session in lockstep with the real simulator and no network: the same inputs give the same bits, however they
came and whatever the wall clock did meanwhile."""

from __future__ import annotations

import math
import random
import sys
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import COMPILED

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "io"))
from test_commands import command
from test_joint_commands import joint_command
from test_motion import imu, odometry

from cable_sim_ros import run
from cable_sim_ros.io.bags.bag import BagReader
from cable_sim_ros.io.messages.channels import CHANNELS, Context, Encoder
from cable_sim_ros.io.messages.messages import Event, stamp_of
from cable_sim_ros.io.motion.arrival_order import Intake
from cable_sim_ros.io.recordings.journal import MSGTYPE, TOPIC, Journal, read_journal
from cable_sim_ros.io.recordings.recorder import Recorder
from cable_sim_ros.io.scenes.load import dump_scene, load_scene, override
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.ros import session as module
from cable_sim_ros.ros.parameters import settle
from cable_sim_ros.ros.publisher import DirectPublisher
from cable_sim_ros.ros.report.health import lockstep_metrics, lockstep_status
from cable_sim_ros.ros.stepped import session_of
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.simulator import Simulator

pytestmark = [pytest.mark.check, COMPILED]

MS = 1_000_000
S = 1_000_000_000
TICKS = 60
SCENE = {"scene": "side_scan", "solver.tick": 0.02, "time_mode": "lockstep", "lockstep.start": 100.0}
BEGIN = 100 * S


def ship() -> list[tuple[int, str, bytes]]:
    """2.4 s of a heaving ship in the order of the stamps: IMU at 100 Hz, odometry at 20 Hz."""
    found = []
    for k in range(240):
        stamp, t = BEGIN + 10 * MS * k, 0.01 * k
        up, speed = math.sin(2.0 * t), 2.0 * math.cos(2.0 * t)
        found.append((stamp, "imu", imu(stamp, force=(0, 0, 9.81 - 4.0 * up))))
        if k % 5 == 0:
            found.append((stamp, "odometry", odometry(stamp, (2.0 * t, 0, up), velocity=(2.0, 0, speed))))
    return found


def winch() -> dict[int, bytes]:
    """A command each second tick from half a second on, by /clock."""
    return {
        at: command(at, velocity=[0.5 * math.sin(at * 1e-9)]) for at in range(BEGIN + S // 2, BEGIN + 2 * S, 40 * MS)
    }


class Run:
    """A session, its frames, and wall time that is made up."""

    def __init__(self, monkeypatch, bag: Path | None = None, **parameters) -> None:
        monkeypatch.setattr(module, "quiet", lambda: None)
        self.said: list[str] = []
        self.wall = 0
        self.frames: list[np.ndarray] = []
        self.clocks: list[int] = []
        self.session = session_of(settle(SCENE | parameters), lambda level, text: self.said.append(text))
        self.session.configure()
        self.session.publish_clock = self.clock_said
        self.session.publish_ticks = self.ticked
        self.at_clock = lambda clock: None
        self.heard = lambda topic: 1  # subscribers
        self.publisher = self.recorder = None
        if bag is not None:
            self.record(bag)
        self.session.activate()

    def record(self, bag: Path) -> None:
        session, context = self.session, Context()
        self.published: Counter[str] = Counter()
        quiet = {topic: self.topic(topic) for topic in map(context.topic, CHANNELS)}
        encoder = Encoder(context, session.scene.solver.tick)
        self.publisher = DirectPublisher(
            session.built_loop, encoder, quiet, session.offset, log_time=session.record_time
        )
        self.publisher.start()
        self.recorder = Recorder(bag, custom_data={"scene_yaml": dump_scene(session.scene)})
        journal = Journal(
            lambda data: self.recorder.put(f"{context.namespace}/{TOPIC}", MSGTYPE, session.record_time(), data),
            session.built_sim.inputs,
        )
        self.publisher.record(self.recorder, journal)
        session.record(journal)

    def topic(self, name: str) -> SimpleNamespace:
        """A publisher that counts."""
        return SimpleNamespace(
            publish=lambda data: self.published.update([name]), get_subscription_count=lambda: self.heard(name)
        )

    def clock_said(self, clock: int) -> None:
        if clock not in self.clocks[-1:]:
            self.clocks.append(clock)
        self.at_clock(clock)

    def ticked(self) -> None:
        loop = self.session.built_loop
        self.frames.append(loop.output.frame[(loop.count - 1) % loop.rows].copy())
        if self.publisher is not None:
            self.publisher.drain()

    def give(self, kind: str, data: bytes) -> None:
        self.session.motion(Event(stamp_of(data), -1, kind, data))

    def until(self, ticks: int, within: float = 1e5) -> np.recarray:
        end = self.wall + round(within * S)
        while len(self.frames) < ticks and self.wall < end and self.session.state in ("waiting", "running"):
            self.wall += 1 + round(self.session.advance(self.wall) * S)
        return np.array(self.frames).view(np.recarray)

    def close(self) -> None:
        if self.publisher is not None:
            self.publisher.end_recording()
            assert self.recorder.close().dropped == 0
            self.publisher.close()
        self.session.close()
        self.session.built_loop.close()


def poured(monkeypatch, bag: Path | None = None, messages: list | None = None) -> Run:
    """All motion there before the first step, the topics out of order; commands at their clock."""
    run = Run(monkeypatch, bag, **{"lockstep.rate": 0.0, "lockstep.paused": True})
    messages = ship() if messages is None else messages
    for _, kind, data in [m for m in messages if m[1] == "odometry"] + [m for m in messages if m[1] == "imu"]:
        run.give(kind, data)
    commands = winch()
    run.at_clock = lambda clock: clock in commands and run.session.command(commands[clock], -1)
    run.session.pause(False)
    return run


def test_the_same_bits_poured_in_or_one_by_one_paused_stepped_replayed_and_free_running(monkeypatch, tmp_path):
    first = poured(monkeypatch)
    frames = first.until(TICKS)
    first.close()
    assert len(frames) == TICKS and first.session.steps.commands.missed == 0 == first.session.steps.late
    assert (np.diff(frames.time) == 20 * MS).all() and np.ptp(frames.payout) > 0.05
    assert not frames.status.any() or (frames.status == frames.status[0]).all(), "nothing went stale"
    assert first.session.sim.inputs.motion_head[0] > 20

    second = Run(monkeypatch, tmp_path / "bag", **{"lockstep.rate": 2.0, "lockstep.paused": True})
    messages, commands, chance = ship(), winch(), random.Random(1)

    def sensors(clock: int) -> None:
        """What moves on /clock speaks when it is said, in any order of the topics; the clock is said again too."""
        due = [message for message in messages if message[0] <= clock]
        del messages[: len(due)]
        for kind in chance.sample(["imu", "odometry"], 2):
            for _, _, data in [message for message in due if message[1] == kind]:
                second.give(kind, data)
        if clock in commands:
            assert second.session.command(commands.pop(clock), -1) == ""

    second.at_clock = sensors
    second.until(1, within=0.1)
    assert second.session.shown_state == "waiting" and second.session.paused
    second.session.pause(False)
    second.until(20)
    second.session.pause(True)
    second.until(TICKS, within=3.0)
    assert len(second.frames) == 20, "a paused simulation stands"
    assert second.session.step(5)[0] and not second.session.step(5)[0]
    second.until(TICKS, within=3.0)
    assert len(second.frames) == 25 and second.session.steps_left == 0
    begun = second.wall
    second.session.pause(False)
    again = second.until(TICKS)
    assert (second.wall - begun) * 1e-9 == pytest.approx(35 * 0.02 / 2.0, abs=0.12), "at rate 2"
    second.close()
    assert second.session.steps.gate.cadence["imu"].missed == 0 and second.session.steps.commands.missed == 0
    assert again.tobytes() == frames.tobytes()

    replayed = offline.replay(str(tmp_path / "bag"))
    assert replayed.metrics["replay_faults"] == [] and replayed.metrics["largest_difference"]["difference"] == 0.0
    assert replayed.frames.tobytes() == frames.tobytes()
    assert free_running(first, int(frames.time[0]) - 20 * MS).tobytes() == frames.tobytes()


def free_running(run: Run, begin: int) -> np.recarray:
    """The same messages pushed into a plain Simulator, each as soon as its tick could know it."""
    sim = Simulator(run.session.scene)
    intake = Intake(sim.inputs, run.session.scene)
    messages, commands, frames = ship(), winch(), []
    for k in range(TICKS + 1):
        clock = begin + 20 * MS * k + run.session.delay
        for stamp, kind, data in [message for message in messages if message[0] <= clock]:
            intake.motion(Event(stamp, stamp, kind, data))
        messages = [message for message in messages if message[0] > clock]
        if k == 0:
            now = intake.newest
            row = sim.inputs.motion[int(sim.inputs.motion_head[0]) - 1]
            ahead = (begin - now) * 1e-9
            sim.start(begin, (row[0] + ahead * row[6], row[1] + ahead * row[7]), float(row[5]), keep_inputs=True)
            continue
        if clock in commands:
            intake.command(commands[clock], clock)
        frames.append(sim.tick().copy())
    return np.array(frames).view(np.recarray)


def test_bad_motion_and_bad_commands_are_counted_and_change_nothing(monkeypatch):
    """Stamps a minute off, a command for another step, twice, without a stamp of this clock; then a hole in the motion
    and a controller that is silent."""
    good = poured(monkeypatch)
    frames = good.until(30)
    good.close()
    messages = ship()
    for place, off in ((40, 60 * S), (41, -60 * S)):
        stamp, kind, _ = messages[place]
        messages.insert(place, (stamp, kind, imu(stamp + off) if kind == "imu" else odometry(stamp + off, (9, 9, 9))))
    hole = range(BEGIN + 12 * S // 10, BEGIN + 14 * S // 10)
    messages = [message for message in messages if message[0] not in hole]
    run = poured(monkeypatch, messages=messages)
    commands, session = winch(), run.session

    def controller(clock: int) -> None:
        if clock not in commands:
            return
        wrong = [command(clock + off * MS, velocity=[5.0]) for off in (20, -1100)]
        assert [session.command(data, -1) for data in wrong] == ["step_future", "step_past"]
        assert session.command(commands.pop(clock), -1) == ""
        assert session.command(command(clock, velocity=[5.0]), -1) == "step_twice"

    run.at_clock = controller
    again = run.until(30)
    assert again.tobytes() == frames.tobytes()
    commands.clear()
    run.until(TICKS + 20)
    steps = session.steps
    assert session.refused == {"stamp_off_clock": 2} and session.state == "running"
    assert not steps.gate.cadence["imu"].missed, "what is held says that there is a hole"
    run.until(140)
    assert {kind: c.missed for kind, c in steps.gate.cadence.items()} == {"imu": 5, "odometry": 5}, "the end of motion"
    assert steps.commands.missed == 5 and steps.commands.silent
    assert run.wall < 30 * S, "bounded"
    refused = session.intake.commands.refused
    assert refused["step_future"] == refused["step_past"] == refused["step_twice"] > 1
    status = lockstep_status(session)
    assert status.level == 2 and "silent" in status.message and status.values["refused: step_twice"] != "0"
    assert lockstep_metrics(session)["commands_missed"] == 5
    for stamp in (0, 1_700_000_000 * S):
        assert session.command(command(stamp, velocity=[0.1]), -1) == ""
    assert steps.unstamped == 2 and not steps.commands.silent, "it speaks again"
    assert lockstep_status(session).level < 2
    sailed = [
        (stamp - 60 * S, odometry(stamp - 60 * S, (0, 0, 0), velocity=(2.0, 0, 0))) for stamp, _, _ in ship()[::6]
    ]
    for _, data in sailed[:5]:
        run.give("odometry", data)
    status = lockstep_status(session)
    assert status.level == 2 and "~/reset" in status.message
    assert session.reset() == (True, "waiting for motion")
    for _, data in sailed[5:]:
        run.give("odometry", data)
    assert run.until(150).time[-1] < 50 * S and session.state == "running" and lockstep_status(session).level == 0
    assert any("/clock goes to the stamp of the first motion" in text for text in run.said)
    run.close()


@pytest.mark.parametrize("at, sent", [(BEGIN, "command"), (BEGIN, "command_velocity"), (BEGIN - 20 * MS, "command")])
def test_the_first_command_counts_alike_before_and_after_the_first_motion(monkeypatch, at, sent):
    """Controller and sensors answer the same /clock in any order; one of an earlier clock stays refused.

    sent: kind of the message that comes early; the other is a JointState.
    """
    first = command(at, velocity=[0.4]) if sent == "command" else joint_command(at, "velocity", [0.4])
    results = []
    for early in (True, False):
        run = Run(monkeypatch, **{"lockstep.rate": 0.0, "lockstep.command_period": 10.0, "lockstep.start": 99.9})
        session, held = run.session, [first if early else command(at, velocity=[0.4])]

        def answer(clock, run=run, held=held, early=early):
            if clock == BEGIN:
                for stamp, kind, data in ship():
                    run.give(kind, data) if stamp <= BEGIN + S else None
            if clock == at and early and held:
                assert run.session.command(held.pop(), -1, sent) == "before_motion"

        run.at_clock = answer
        steps = session.steps.next

        def later(*what, steps=steps, held=held, session=session, early=early):
            if not early and held and session.state == "running" and session.steps.clock == BEGIN:
                assert session.command(held.pop(), -1) == ""
            return steps(*what)

        if at == BEGIN:
            session.steps.next = later
        run.until(20)
        results.append((np.array(run.frames).tobytes(), dict(session.intake.commands.refused)))
        run.close()
    assert results[0][0] == results[1][0]
    taken = np.frombuffer(results[0][0], run.session.built_loop.output.frame.dtype)
    assert (taken["command_age"][-1] >= 0.0) == (at == BEGIN)
    assert +Counter(results[0][1]) == ({} if at == BEGIN else {"before_motion": 1})


def test_what_nobody_hears_is_published_for_a_recording_only(monkeypatch, tmp_path):
    run = poured(monkeypatch, tmp_path / "bag")
    run.heard = lambda topic: int(topic.endswith("sim/health"))
    run.until(5)
    run.publisher.end_recording()
    assert run.recorder.close().dropped == 0 and set(run.published.values()) > {5}
    with BagReader(tmp_path / "bag") as reader:
        assert {topic for topic in run.published} <= set(reader.topics)
    run.published.clear()
    run.until(10)
    assert run.published == {"/tow_sim/sim/health": 5} and run.publisher.published == 10
    run.publisher.close()
    run.session.close()
    run.session.built_loop.close()


def test_until_the_first_tick_the_clock_goes_at_real_time_where_steps_are_asked_for_too(monkeypatch):
    """A controller by /clock sees every tick of it, before any of its commands is waited for."""
    run = Run(monkeypatch, **{"lockstep.rate": 0.0, "lockstep.paused": True})
    for _, kind, data in ship():
        run.give(kind, data)
    run.session.step(30)
    run.until(1)
    start = run.clocks.index(BEGIN + 20 * MS)
    assert len(run.clocks) - start == 3 and run.wall >= 40 * MS, "two clocks more, each after 20 ms"
    wall = run.wall
    run.until(30)
    assert run.wall - wall < 20 * MS, "from then on as fast as it goes"
    run.close()


def test_flaps_that_are_announced_are_waited_for_from_the_first_tick_output_on(monkeypatch):
    """They answer it where the clock is said again: only to one that waits. The silence after the fifth is bounded."""
    announced = {"flap_period": 0.02, "chain_delay": 0.03, "rate": 0.0, "wait": 0.5}
    run = Run(monkeypatch, scene="side_scan_fish", **{f"lockstep.{key}": value for key, value in announced.items()})
    for _, kind, data in ship():
        run.give(kind, data)
    answered = []

    def keeper(clock: int) -> None:
        if run.frames and clock == run.said_before and len(answered) < 5 and run.frames[-1]["time"] not in answered:
            answered.append(int(run.frames[-1]["time"]))
            data = command(answered[-1], position=[0.1], names=["tail_port"])
            assert run.session.command(data, -1, "flaps") == ""
        run.said_before = clock

    run.at_clock, run.said_before = keeper, 0
    frames = run.until(6)
    steps = run.session.steps
    assert answered == list(frames.time[:5]) and (steps.late, steps.flaps.missed, steps.commands.missed) == (0, 0, 0)
    wall = run.wall
    run.until(7)
    assert "the newest flap command that was due did not come" in lockstep_status(run.session).message
    run.until(20)
    assert steps.flaps.missed == 5 and steps.flaps.silent and run.wall - wall < 6 * S
    assert "of the flaps is silent" in lockstep_status(run.session).message
    run.session.poll()
    run.session.poll()
    assert sum("no flap command came for the step of /clock" in text for text in run.said) == 1
    run.close()


def test_no_tick_is_no_tick(monkeypatch):
    run = poured(monkeypatch)
    run.until(3)
    loop = run.session.built_loop
    done = loop.count
    loop.step(0)
    loop.run_to(done)
    assert loop.count == done
    run.close()


def test_a_scenario_of_faults_meets_the_ticks_of_an_offline_run(monkeypatch, tmp_path):
    """Again after a reset; one that lasts a tick; three targets."""
    path, changed = tmp_path / "faults.yaml", {"instruments.encoder.on": True, "instruments.depth.on": True}
    path.write_text(
        "scenario: a\nfaults:\n  a: {at: 0.2, until: 0.22, target: encoder, kind: bias, size: 7.0}\n"
        "  b: {at: 0.31, until: 0.4, target: drive, kind: bias, size: 0.5}\n"
        "  c: {at: 0.0, target: depth, kind: lost}\n"
    )
    offline = override(load_scene("side_scan"), changed | {"solver.tick": 0.02})
    wanted = run(offline, duration=0.6, step="fixed", faults=path, out=tmp_path / "run")
    stepped = Run(
        monkeypatch,
        tmp_path / "bag",
        **changed,
        faults_file=str(path),
        **{"lockstep.rate": 0.0, "lockstep.paused": True},
    )
    for _, kind, data in ship():
        stepped.give(kind, data)
    stepped.session.pause(False)
    first = stepped.until(15)
    assert stepped.session.reset()[0] and stepped.session.scene.faults.drive.kind.value == "none"
    frames = stepped.until(45)[15:]
    stepped.close()

    def signs(frames):
        return [
            (int(one.tick), bool(one.encoder_payout > one.payout_counter + 6.9), bool(np.isnan(one.depth_reading)))
            for one in frames
        ]

    assert signs(frames) == signs(wanted.frames) and signs(first) == signs(wanted.frames)[:15]
    assert [tick for tick, biased, _ in signs(frames) if biased] == [11]
    journals = [read_journal(read_tow(bag).journal).segments for bag in (wanted.bag, tmp_path / "bag")]
    (alone,), (_, again) = journals
    assert again.sets == alone.sets and {tick for tick, *_ in alone.sets} == {0, 10, 11, 15, 20}
