"""docs/topics.md against the code: topics, rates and QoS."""

import re
from pathlib import Path

import pytest

from cable_sim_ros.io.messages import channels, markers
from cable_sim_ros.io.messages.messages import KINDS
from cable_sim_ros.ros import node
from cable_sim_ros.ros.blocks import NodeBlock
from cable_sim_ros.ros.services import control

pytestmark = pytest.mark.check

PAGE = (Path(__file__).parents[2] / "docs" / "topics.md").read_text("utf-8")
OUT, _, IN = PAGE.partition("## In")
OURS = channels.EVERY


def rows(part):
    return {name: cells.split(" | ") for name, cells in re.findall(r"^\| `([\w/]+)` \| (.*) \|$", part, re.M)}


def report(qos):
    reliability = {1: "reliable", 2: "best effort"}[int(qos.reliability)]
    return f"{reliability}, {qos.depth}"


def test_every_channel_stands_on_the_page_as_it_is():
    page = rows(OUT)
    said = " ".join(OUT.split()).partition("best effort with a depth of 5,")[2].partition(".")[0]
    lossy = set(re.findall(r"`([\w/]+)`", said))
    for channel in OURS:
        kind, _, rate, _ = page[channel.topic]
        assert kind == channel.msgtype.replace("/msg/", "/"), channel.topic
        often = f"{channel.rate:g} Hz" if channel.rate else "every reading" if channel.new else "every tick"
        assert rate == often, channel.topic
        offered = "best effort, 5" if channel.topic in lossy else "reliable, 10"
        assert offered == report(node.QOS[channel.qos]), channel.topic
    others = {markers.TOPIC, node.AGES_TOPIC, "/diagnostics", "/clock"}
    assert set(page) == {channel.topic for channel in OURS} | others
    assert f"have a depth of {node.STEPPED_QOS['reliable'].depth}," in " ".join(PAGE.split())


def test_every_input_stands_on_the_page_as_it_is():
    page = rows(IN)
    assert set(page) == {topic for _, topic in KINDS.values()}
    kinds = {topic: msgtype.replace("/msg/", "/") for msgtype, topic in KINDS.values()}
    for topic, cells in page.items():
        assert cells[0] == kinds[topic]
    depth = f"depth of {node.INPUT_DEPTH[False]} ({node.INPUT_DEPTH[True]} in lockstep)"
    assert f"asks for best effort, so that it hears every publisher, with a {depth}" in " ".join(PAGE.split())


def test_services_may_wait_as_the_page_says():
    assert f"{control.WAITING} calls may wait" in " ".join(PAGE.split()) and control.SERVICES.depth == control.WAITING
    assert NodeBlock.model_fields["autostart"].default is True
