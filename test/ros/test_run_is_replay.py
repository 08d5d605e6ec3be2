"""A run is its replay: whatever reached the node, and however it came, the recording gives the same numbers again.

The node without its network: session, real-time loop, publisher and recorder with the real simulator, fed with messages
that misbehave. In a process of its own, as the loop's thread is compiled code.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest
from conftest import COMPILED, run_script

from cable_sim_ros.io.recordings.journal import read_journal
from cable_sim_ros.io.sources.recorded_tow import read_tow

HERE = Path(__file__).parent
pytestmark = COMPILED

SCRIPT = """
import json, math, sys, threading, time, warnings
from types import SimpleNamespace
warnings.simplefilter("ignore")
from cable_sim_ros.io.messages.channels import CHANNELS, Context, Encoder
from cable_sim_ros.io.messages.messages import Event, stamp_of
from cable_sim_ros.io.recordings.journal import MSGTYPE, TOPIC, Journal
from cable_sim_ros.io.recordings.recorder import Recorder
from cable_sim_ros.ros.parameters import settle
from cable_sim_ros.ros.publisher import TickPublisher
from cable_sim_ros.ros.session import Session
from cable_sim_ros.runs import offline
from test_commands import command
from test_joint_commands import KINDS, joint_command
from test_motion import odometry

S = 1_000_000_000
said = []
scenario = bag + ".yaml"
with open(scenario, "w") as file:
    file.write("scenario: a\\nfaults:\\n  b: {at: 0.2, until: 0.22, target: encoder, kind: bias, size: 7.0}\\n")
given = {"scene": "side_scan", "solver.tick": 0.02, "instruments.encoder.on": True, "faults_file": scenario}
session = Session(settle(given), lambda level, text: said.append((level, text)))
session.configure()
context = Context()
encoder = Encoder(context, 0.02)
heard = SimpleNamespace(publish=lambda data: None, get_subscription_count=lambda: 1)
quiet = {context.topic(channel): heard for channel in CHANNELS}
publisher = TickPublisher(session.built_loop, encoder, quiet, lambda: session.clock.offset)
publisher.start()
recorder = None
begun = time.monotonic_ns()
shift = 0  # ns, of the motion's clock
k = 0

def record():
    global recorder, recorded_from
    recorded_from = session.built_loop.count
    recorder = Recorder(bag, custom_data={"scene_yaml": offline_scene()})
    put = lambda data: recorder.put(f"{context.namespace}/{TOPIC}", MSGTYPE, time.time_ns(), data)
    journal = Journal(put, session.built_sim.inputs)
    publisher.record(recorder, journal)
    session.record(journal)

def offline_scene():
    from cable_sim_ros.io.scenes.load import dump_scene
    return dump_scene(session.scene)

def now():
    return time.monotonic_ns() - begun + 1000 * S + shift

def took(kind, topic, msgtype, data, arrival):
    if recorder is not None:
        recorder.put(f"{context.namespace}/{topic}", msgtype, arrival + session.wall, data)

def move(seconds, odd=None):  # so many s of messages at 50 Hz, longer on a busy machine
    global k
    left = round(seconds / 0.02)
    while left:
        left -= session.state != "waiting"  # the start takes as long as the machine does
        stamp, t = now(), (time.monotonic_ns() - begun) * 1e-9
        wild = odd is not None and k % odd == odd - 1
        height, speed = math.sin(0.8 * t), 0.8 * math.cos(0.8 * t)
        data = odometry(stamp + (3600 * S if wild else 0), (2.0 * t, 0, height), velocity=(2.0, 0, speed))
        arrival = time.monotonic_ns()
        took("odometry", "odom", "nav_msgs/msg/Odometry", data, arrival)
        session.motion(Event(stamp_of(data), arrival, "odometry", data))
        session.poll()
        k += 1
        time.sleep(0.02)

def move_until_jumped(count):
    for _ in range(600):
        move(0.1)
        if session.clock.jumps == count:
            return
    raise AssertionError(f"{session.clock.jumps} jumps of the clock were followed, not {count}")

def order(stamp, position=(), velocity=(), **more):
    data, arrival = command(stamp, list(position), list(velocity), **more), time.monotonic_ns()
    took("command", "winch/command", "sensor_msgs/msg/JointState", data, arrival)
    return session.command(data, arrival)

def joint(kind, interface, value):
    data, arrival = joint_command(now(), interface, [value]), time.monotonic_ns()
    took(kind, KINDS[kind][1], KINDS[kind][0], data, arrival)
    return session.command(data, arrival, kind)

def finish():
    for _ in range(100):  # a loaded machine makes fewer ticks in the same time
        if not 0 <= session.built_loop.count - recorded_from <= 80:
            break
        move(0.1)
    session.built_loop.stop()
    publisher.end_recording()
    stats = recorder.close()
    publisher.close()
    session.close()
    session.built_loop.close()
    again = offline.replay(bag)
    return dict(
        state=session.problem, said=said, resets=session.resets, jumps=session.clock.jumps, dropped=stats.dropped,
        refused=session.intake.commands.refused, motion=session.intake.refused, skipped=publisher.skipped,
        largest=again.metrics["largest_difference"], faults=again.metrics["replay_faults"],
        moved=float(abs(again.frames["payout"] - again.frames["payout"][0]).max()), ticks=len(again.frames))
"""

ODD = """
record()
order(now(), [30.0])  # before motion
session.activate()
move(0.8)
for i in range(8):
    order(now() - 5 * S, velocity=[0.3])  # stamps 5 s old
    order(now(), [1e9])  # absurd
    order(now(), [1.0, 2.0])  # wrong length
    if i % 2:  # the newest over both messages counts
        joint("command_velocity", "velocity", 0.4)
        joint("command_velocity", "velocity", math.inf)
        joint("command_position", "effort", 900.0)
    if i == 6:
        joint("command_position", "position", 199.0)
    move(0.15, odd=5)  # and stamps of motion that are an hour ahead
found = finish()
"""
EVENTS = """
record()
session.activate()
move(0.8)
session.set_live("setpoint.algorithm", "simplified_sheave")
session.set_live("winch.command_timeout", 0.3)
move(0.6)
shift += 3 * S // 2  # ahead by 1.5 s
move_until_jumped(1)
move(0.4)
session.reset()
order(now(), velocity=[0.4])
move(0.7)
shift -= S // 2  # behind by 0.5 s: followed after a second
move_until_jumped(2)
session.set_live("setpoint.algorithm", "hold")
move(0.4)
found = finish()
"""
RESTORED = """
from pathlib import Path
state = Path(bag).parent / "state.npz"
record()
session.activate()
move(1.0)
order(now(), velocity=[0.5])
move(0.4)
answers = [session.save(state)]
move(0.6)
answers.append(session.restore(state))
assert all(done for done, _ in answers), answers
said += [("info", text) for _, text in answers]
move(0.6)
order(now(), velocity=[-0.3])
move(0.5)
found = finish()
"""
MIDDLE = """
session.activate()
move(1.0)
order(now(), velocity=[0.5])
move(0.2)
record()
burning = True
def burn():
    while burning:
        sum(i * i for i in range(3000))
for _ in range(3):
    threading.Thread(target=burn, daemon=True).start()
for _ in range(12):
    order(now(), velocity=[0.5])
    move(0.15)
burning = False
found = finish()
"""


ALL = """
import json, sys
for name, script in json.loads(sys.argv[2]).items():
    space = {"bag": f"{sys.argv[1]}/{name}/bag", "__name__": name}
    exec(compile(script, name, "exec"), space)
    print(json.dumps([name, space["found"]]))
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory) -> tuple[dict, Path]:
    """What each ended with and the folder of their bags; one process for all."""
    folder = tmp_path_factory.mktemp("bags")
    scripts = {"odd": ODD, "events": EVENTS, "middle": MIDDLE, "restored": RESTORED}
    for name in scripts:
        (folder / name).mkdir()
    told = run_script(ALL, str(folder), json.dumps({name: SCRIPT + what for name, what in scripts.items()}))
    return dict(json.loads(line) for line in told.splitlines()), folder


def same(found: dict) -> None:
    assert found["state"] == "" and found["dropped"] == 0 and found["faults"] == []
    assert found["ticks"] == found["largest"]["ticks"] > 60, "every tick is in the recording"
    assert found["largest"]["difference"] == 0.0, found["largest"]


def test_odd_messages(ran):
    """Commands before motion, 5 s old, absurd, of wrong length, of both messages; motion stamped an hour ahead."""
    found = ran[0]["odd"]
    same(found)
    assert found["refused"]["before_motion"] == 1 and found["refused"]["out_of_range"] == 8
    assert found["refused"]["array_length"] == 8 and found["motion"]["stamp_off_clock"] >= 5
    assert found["refused"]["not_finite"] == found["refused"]["effort_only"] == 4
    assert found["moved"] > 0.2, "commands with old stamps move the winch"
    (segment,) = read_journal(read_tow(ran[1] / "odd" / "bag").journal).segments
    faults = [(tick, value) for tick, _, value in segment.sets]
    assert faults == [(10, 7.0), (10, "bias"), (11, "none")], "a fault of one tick, at the ticks of its file"
    kinds = Counter(event.kind for event in read_tow(ran[1] / "odd" / "bag").events if event.is_command)
    assert kinds == {"command": 25, "command_velocity": 8, "command_position": 5}, "each is on its own topic"


def test_resets_jumps_and_switches(ran):
    """The clock jumps ahead by 1.5 s and back by 0.5 s, the algorithm changes twice, the run is reset."""
    found = ran[0]["events"]
    same(found)
    assert found["resets"] == 1 and found["jumps"] == 2
    jumps = [float(text.split("has jumped by ")[1].split(" s")[0]) for _, text in found["said"] if "jumped" in text]
    assert jumps == pytest.approx([1.5, -0.5], abs=0.25)


def test_a_recording_from_the_middle_of_a_loaded_run(ran):
    """Rate commands while three threads keep the processor and the interpreter's lock."""
    found = ran[0]["middle"]
    same(found)
    assert found["moved"] > 0.5


def test_a_state_that_is_restored(ran):
    """Saved while it hauls, restored 0.6 s later: the tow of then at the present, at rest until a command comes."""
    found = ran[0]["restored"]
    same(found)
    texts = [text for _, text in found["said"]]
    assert any(text.startswith("saved at ") for text in texts)
    assert any("it goes on at the present, and the winch holds until it is commanded" in text for text in texts)
    report = read_journal(read_tow(ran[1] / "restored" / "bag").journal)
    assert [segment.start.cause for segment in report.segments] == ["start", "restore"]
