"""A node in real time that sends telegrams over UDP, beside its topics, and one whose port is taken."""

from __future__ import annotations

import time

import numpy as np
import pytest
from conftest import datagrams, poll

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.tools.logs.formats import read_log
from cable_sim_ros.tools.telegrams.tss1 import LINE
from verification.soak.probe import Probe

pytestmark = pytest.mark.realtime
MS, DAY = 1_000_000, 86_400_000_000_000  # ns
LB = 4.4482216152605  # N


def test_a_node_sends_what_it_publishes_and_counts_it(world, receivers, tmp_path):
    ears = Probe(world.domain, "ears")
    world.closing.append(ears.close)
    ears.watch()

    sockets = {name: receivers() for name in ("lci90i", "psxn", "pashr", "tss1")}
    ports = {f"telegrams__{name}__port": it.getsockname()[1] for name, it in sockets.items()}
    taken, other = receivers(), receivers()
    other.connect(taken.getsockname())
    refused = world.node(telegrams__tss1__port=taken.getsockname()[1])
    heard: dict[str, list[bytes]] = {name: [] for name in sockets}

    def listen() -> bool:
        for name, it in sockets.items():
            heard[name] += datagrams(it)
        many = min(len(heard[name]) for name in ("psxn", "pashr", "tss1")) > 20 and len(heard["lci90i"]) > 40
        return many and heaved() > 0.3

    def heaved() -> float:
        """Range of the heave that was sent: the ship may begin on a crest, so a number of telegrams is not enough."""
        down = [float(data.split(b"*")[0].split(b",")[5]) for data in heard["psxn"]]
        return max(down) - min(down)

    node = world.node(**ports).until("waiting")
    assert f"telegrams lci90i to 127.0.0.1 port {ports['telegrams__lci90i__port']}, 20 Hz" in node.text
    world.ship(ears).sail()
    poll(listen, "telegrams")
    task = poll(lambda: ears.tasks("telegrams", time.monotonic() - 1.5), "the task")[-1]
    assert node.stop() == 0
    listen()
    assert refused.wait(60.0) == 2
    assert f"error: parameter 'telegrams.tss1.port' = {taken.getsockname()[1]}: 1 other socket" in refused.text
    assert "nothing was started" in refused.text

    _, frames = ears.frames()
    of_time = {int(frame["time"]) // MS * MS: frame for frame in frames}  # telegrams have whole milliseconds
    sources = {}
    for name in ("lci90i", "pashr"):
        (tmp_path / name).write_bytes(b"".join(heard[name]))
        (sources[name],) = read_log(tmp_path / name).sources.values()
    winch, motion = sources["lci90i"], sources["pashr"]
    both = [(k, of_time[time]) for k, time in enumerate(winch.device.tolist()) if time in of_time]
    assert len(both) > 20
    for k, frame in both:
        assert abs(LB * winch.columns["tension"][k] - frame["tension"]) < 2.3
        assert abs(winch.columns["payout"][k] - frame["payout"]) <= 0.051
    of_day = {stamp % DAY: frame for stamp, frame in of_time.items()}
    both = [(k, of_day[time % DAY]) for k, time in enumerate(motion.device.tolist()) if time % DAY in of_day]
    level = load_scene("full_scale").ship.reference_height
    assert len(both) > 10
    for k, frame in both:
        assert abs(motion.columns["heave"][k] + level - frame["ship_position"][2]) < 0.0051
    assert all(map(LINE.fullmatch, heard["tss1"]))
    counts = node.state()["telegrams"]
    assert task.level == 0 and 20 < int(task.values["lci90i_sent"]) <= counts["lci90i"]["sent"]
    for name, count in counts.items():
        assert count["sent"] == len(heard[name]) and count["failed"] == count["unheard"] == 0
        assert count["withheld"] <= (name == "tss1"), "the first tick has no acceleration"
    steps = [round(step / 5e7) for step in np.diff(winch.device).tolist()]
    assert min(steps) == 1 and sum(steps) - len(steps) == counts["lci90i"]["missed"]
