"""The live session against a bag of the same messages: the same winch commands are refused, the others count from the
same time. In a process of its own, because the stand-in takes the place of the simulator's modules; no network."""

import json
from pathlib import Path

from conftest import COMPILED, run_script

HERE = Path(__file__).parent
pytestmark = COMPILED

SCRIPT = """
import json, time
import fake_sim
fake_sim.install()
from cable_sim_ros.io.messages.messages import stamp_of
from cable_sim_ros.io.messages.messages import Event
from cable_sim_ros.io.sources.recorded_tow import Feeder, RecordedTow
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.ros.report.diagnostics import Watch, final_metrics
from cable_sim_ros.ros.parameters import settle
from cable_sim_ros.ros.session import Session
from test_commands import command, decisions, odd_tow, pushed
from test_motion import STEP, T0, S, odometry

session = Session(settle({}), lambda level, text: None)
session.configure()
session.activate()
begun = time.monotonic_ns()
tow = odd_tow(begun - T0)
last = tow.events[-1].arrival
for k in range(1, 12):  # at last the clock jumps ahead by 50 s
    stamp = T0 + 250 * STEP + 50 * S + k * STEP
    arrival = last + k * STEP
    tow.events.append(Event(stamp, arrival, "odometry", odometry(stamp, (10.0, 0, 0), velocity=(2.0, 0, 0))))
    tow.events.append(Event(stamp, arrival + 1, "command", command(stamp, [float(k)])))

def live(event):
    if event.kind == "command":
        return session.command(event.data, event.arrival), session.sim.inputs
    session.motion(event)
    return "", session.sim.inputs

wanted = decisions(tow, live)
state = session.state
watched = {status.name: status.values for status in Watch(session).statuses(None, None, False)}
figures = final_metrics(session, None, None)
commanded = int(session.sim.inputs.command_head[0])
session.reset()
kept = [commanded, int(session.sim.inputs.command_head[0]), session.intake.commands.last]
session.close()
session.loop.close()

bag = RecordedTow("", [event._replace(arrival=event.arrival + session.wall) for event in tow.events])
feeder = Feeder(make_inputs(), bag, session.scene, session.node.motion, session.node.heave)
replayed = []
while not feeder.done:
    feeder.until(10**30)
    replayed += pushed(feeder.inputs)
    if feeder.jumped:
        feeder.follow()
print(json.dumps(dict(
    state=state, watched=watched, figures=figures, kept=kept,
    motion_refused=session.refused, jumps=[session.clock.jumps, feeder.intake.clock.jumps],
    refused=[session.intake.commands.refused, feeder.intake.commands.refused],
    accepted=[session.intake.commands.accepted, feeder.intake.commands.accepted],
    taken=[[row for row in wanted if not isinstance(row, str)], replayed])))
"""


def test_a_bag_with_odd_commands_decides_as_the_session_did(kernel_cache):
    found = json.loads(run_script(SCRIPT, NUMBA_CACHE_DIR=str(kernel_cache)).splitlines()[-1])
    assert found["state"] == "running" and found["motion_refused"] == {"stamp_off_clock": 6}, "one wild, five of a jump"
    assert found["jumps"] == [1, 1]
    commanded, *left = found["kept"]
    assert commanded > 0 and left == [0, None], "a reset forgets the commands: the winch holds"
    live, replayed = found["refused"]
    assert live == replayed and live["before_motion"] == 2 and len(live) == 6
    assert found["accepted"][0] == found["accepted"][1] == len(found["taken"][0]) >= 30
    assert found["figures"]["no_commands"] == int(found["watched"]["command"]["no_command"]) > 3
    assert found["figures"]["commands_refused"] == live and found["figures"]["received"] == {
        "imu": 200,
        "odometry": 211,
    }
    assert found["figures"]["dropped"] == {"stamp_off_clock": 6}
    counted = {key: int(text) for key, text in found["watched"]["command"].items() if key.startswith("refused")}
    assert counted == {f"refused: {cause}": count for cause, count in live.items()}
    motion = found["watched"]["motion"]
    assert motion["dropped: stamp_off_clock"] == "6" and motion["source"] == "odometry"
    assert {"imu_received_hz", "imu_rate_hz", "odometry_received_age_s", "odometry_age_s"} <= set(motion)
    live, replayed = found["taken"]
    assert str(live) == str(replayed), "NaN is not equal to itself, its text is"
