"""The sender of telegrams: over a real socket, on the grid of simulation time, and every refusal."""

from __future__ import annotations

import math
import re
import socket
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import datagrams

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.ros.blocks import NodeBlock
from cable_sim_ros.ros.parameters import ParameterError, settle
from cable_sim_ros.tools.telegrams import tss1
from cable_sim_ros.tools.telegrams.blocks import Telegrams
from cable_sim_ros.tools.telegrams.fields import TelegramError
from cable_sim_ros.tools.telegrams.sender import Sender

pytestmark = pytest.mark.check

PAGE = Path(__file__).parents[2] / "docs" / "telegrams.md"
TICK = 10_000_000  # ns
FIRST = 1_400_000_000_000_000_000  # ns, on the grid of every rate here


@pytest.fixture(scope="module")
def scene():
    return load_scene("full_scale")


def port_of(receiver):
    return receiver.getsockname()[1]


def row(k, **values):
    rows = np.zeros(1, TICK_OUTPUT)
    rows["time"], rows["tick"], rows["ship_quaternion"][0, 3] = FIRST + k * TICK, k, 1.0
    rows["payout"], rows["tension"] = 100.0 + k, 1000.0
    for name, value in values.items():
        rows[name] = value
    return rows[0]


def sender_of(scene, log=lambda *_: None, **blocks):
    return Sender(SimpleNamespace(settings=SimpleNamespace(scene=scene), log=log), Telegrams(**blocks))


def test_telegrams_go_out_at_their_rates_of_simulation_time(scene, receivers):
    winch, tss = receivers(), receivers()
    lines = []
    sender = sender_of(
        scene,
        lambda level, text: lines.append(text),
        lci90i={"port": port_of(winch), "rate": 20.0, "name": "X"},
        tss1={"port": port_of(tss), "rate": 30.0},
    )
    for k in range(1, 101):
        sender.tick(row(k))
    found = [data.split(b",") for data in datagrams(winch)]
    assert [part[1][-6:] for part in found] == [b"%06.3f" % (20 + k / 100) for k in range(5, 101, 5)]
    assert [float(part[5]) for part in found] == [100.0 + k for k in range(5, 101, 5)]
    assert {part[2] for part in found} == {b"X"}
    motion = [data for data in datagrams(tss) if tss1.LINE.fullmatch(data)]
    assert len(motion) == 30 and sender.links[1].counts() == {
        "sent": 30,
        "withheld": 0,
        "missed": 0,
        "unheard": 0,
        "failed": 0,
    }
    (status,) = sender.statuses()
    assert status.level == 0 and status.message == "lci90i: 20 sent; tss1: 30 sent"
    assert status.values["lci90i_newest"].startswith("01RD,2014-05-13T16:53:21.000,X,")
    assert status.values["lci90i_source"] == "tension, speed, pay-out of truth" and status.values["tss1_sent"] == "30"
    assert lines[0] == (f"telegrams lci90i to 127.0.0.1 port {port_of(winch)}, 20 Hz: tension, speed, pay-out of truth")
    assert sender.metrics()["telegrams"]["tss1"]["sent"] == 30
    sender.close()


def test_what_ticks_skipped_is_counted_and_a_new_start_is_not(scene, receivers):
    winch = receivers()
    sender = sender_of(scene, lci90i={"port": port_of(winch), "rate": 20.0})
    sender.tick(row(5))
    sender.tick(row(25))  # the publisher was overtaken: 10, 15, 20 were due
    assert sender.links[0].counts()["missed"] == 3 and len(datagrams(winch)) == 2
    sender.tick(row(1, time=FIRST + 10**12))  # another start, at another time
    sender.tick(row(5))  # and back
    assert sender.links[0].counts()["missed"] == 3 and len(datagrams(winch)) == 2
    sender.close()


def test_a_value_that_does_not_fit_is_withheld_counted_and_said(scene, receivers):
    winch = receivers()
    sender = sender_of(scene, lci90i={"port": port_of(winch)})
    sender.tick(row(5))
    sender.tick(row(10, payout=-1e6))
    sender.tick(row(15, tension=math.nan))
    assert len(datagrams(winch)) == 1
    assert sender.links[0].counts() == {"sent": 1, "withheld": 2, "missed": 0, "unheard": 0, "failed": 0}
    (status,) = sender.statuses()
    assert status.level == 1 and status.message == (
        "lci90i withheld: tension is no number, its field holds -9999999 to 99999999 lb"
    )
    sender.close()


def test_nobody_listening_is_said_and_holds_nothing_up(scene, receivers):
    gone = receivers()
    port = port_of(gone)
    gone.close()
    sender = sender_of(scene, lci90i={"port": port})
    for k in range(5, 55, 5):
        sender.tick(row(k))
    counts = sender.links[0].counts()
    assert counts["sent"] == 10 and counts["failed"] == 0 and counts["unheard"] >= 8
    (status,) = sender.statuses()
    assert status.level == 0 and status.message == f"lci90i: 10 sent, nobody listens on 127.0.0.1 port {port}"
    late = receivers(port)
    sender.tick(row(55))
    sender.tick(row(60))
    assert len(datagrams(late)) == 2 and "nobody" not in sender.statuses()[0].message
    sender.close()


def test_a_port_that_another_sender_uses_is_refused(scene, receivers):
    winch = receivers()
    port = port_of(winch)
    first = sender_of(scene, lci90i={"port": port})
    with pytest.raises(TelegramError) as error:
        sender_of(scene, psxn={"port": port})
    assert str(error.value) == (
        f"parameter 'telegrams.psxn.port' = {port}: 1 other socket of this host sends to it; nothing was started. "
        f"Give another port, or end the other sender"
    )
    first.close()
    sender_of(scene, psxn={"port": port}).close()


def test_without_a_port_nothing_is_opened(scene):
    sender = sender_of(scene)
    assert not sender.links and sender.statuses() == [] and sender.metrics() == {}
    assert NodeBlock().telegrams == Telegrams()


def test_ipv6_of_this_host_goes_too(scene):
    try:
        listener = socket.socket(socket.AF_INET6, socket.SOCK_DGRAM)
        listener.bind(("::1", 0))
    except OSError:
        pytest.skip("this machine has no ::1")
    listener.setblocking(False)
    sender = sender_of(scene, address="::1", lci90i={"port": listener.getsockname()[1]})
    sender.tick(row(5))
    assert len(datagrams(listener)) == 1
    with pytest.raises(TelegramError, match="1 other socket of this host"):
        sender_of(scene, address="::1", lci90i={"port": listener.getsockname()[1]})
    sender.close()
    listener.close()


def test_the_reader_on_the_page_reads_it(scene, receivers, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.S)
    begin, loop = code.replace("5001", "0").split("while True:")
    space: dict = {}
    exec(begin, space)
    sender = sender_of(scene, lci90i={"port": port_of(space["listener"])})
    for k in (5, 10):
        sender.tick(row(k, payout_rate=0.5))
    exec("for _ in range(2):" + loop, space)
    sender.close()
    space["listener"].close()
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("2014-05-13T16:53:20.050 1000.8") and told[1].endswith(" N 0.5 m/s 110.0 m")


WRONG = [  # overrides, parts of the text
    (
        {"telegrams.address": "192.168.0.4", "telegrams.psxn.port": 5000},
        ["telegrams.address' = '192.168.0.4' is no loopback address", "nothing was started", "Give 127.0.0.1"],
    ),
    ({"telegrams.address": "localhost", "telegrams.psxn.port": 5000}, ["'localhost' is no loopback address"]),
    ({"telegrams.address": "0.0.0.0", "telegrams.psxn.port": 5000}, ["'0.0.0.0' is no loopback address"]),
    ({"telegrams.address": "::ffff:127.0.0.1", "telegrams.psxn.port": 5000}, ["is no loopback address"]),
    ({"telegrams.psxn.port": 514}, ["telegrams.psxn.port' = 514: ports below 1024", "Give a port from 1024 to 65535"]),
    ({"telegrams.psxn.port": 70000}, ["telegrams.psxn.port", "70000", "from 0 to 65535"]),
    ({"telegrams.psxn.port": 8400}, ["telegrams.psxn.port' = 8400: ports 8400 to 8649 are those of ROS domain 4"]),
    (
        {"telegrams.psxn.port": 5000, "telegrams.lci90i.port": 5000},
        ["telegrams.psxn.port' = 5000 is that of telegrams.lci90i too", "nothing was started", "or 0 for no telegram"],
    ),
    (
        {"telegrams.tss1.port": 5000, "telegrams.tss1.rate": 200.0},
        ["telegrams.tss1.rate' = 200 Hz", "one telegram a tick of 0.01 s", "nothing was started", "at most 100 Hz"],
    ),
    ({"telegrams.tss1.port": 5000, "telegrams.tss1.rate": 0.0}, ["telegrams.tss1.rate", "from 0.01 Hz to 1000 Hz"]),
    (
        {"telegrams.lci90i.port": 5000, "telegrams.lci90i.name": "A,B"},
        ["telegrams.lci90i.name' = 'A,B' does not fit", "nothing was started", "without a comma"],
    ),
    ({"telegrams.lci90i.tension_unit": "kN"}, ["telegrams.lci90i.tension_unit", "kN", "lb, kgf, daN"]),
]


@pytest.mark.parametrize("overrides, parts", WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_what_cannot_be_sent_is_refused_in_one_line(overrides, parts, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "4")
    with pytest.raises(ParameterError) as error:
        settle(overrides)
    assert "\n" not in str(error.value)
    for part in parts:
        assert part in str(error.value), str(error.value)


def test_what_can_be_sent_is_taken(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "4")
    given = {"telegrams.lci90i.port": 8399, "telegrams.psxn.port": 1024, "telegrams.tss1.rate": 500.0}
    assert settle(given).node.telegrams.lci90i.port == 8399
    assert settle({"telegrams.address": "10.0.0.1"}).node.telegrams.address == "10.0.0.1"  # no telegram is on
