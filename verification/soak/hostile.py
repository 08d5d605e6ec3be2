"""S3, S4, S6 to S9: giants, discovery, scans, floods, foreign publishers, the security policy."""

from __future__ import annotations

import random
import socket
import time

from cable_sim_ros.ros.topics import message_class

from ..stress.verdict import IS, MIN, Found, Metric, holds, stress
from .pace import grown, missed_fraction
from .rig import Rig, percentile, rig, sailing, until

PORT, PER_DOMAIN = 7400, 250  # DDSI-RTPS 9.6.2: 7400 + 250 domain + offset


def _kept_on(it: Rig, counts: dict[str, float]) -> list[Metric]:
    return [
        holds("the node still runs", it.node.code is None),
        Metric("ticks missed", missed_fraction(counts), "", 1e-2),
        Metric("static starts", counts["resets"], "", 0.0, IS),
    ]


@stress("giants: IMU and odometry with a frame_id of megabytes", "refused and counted, not kept; missed <= 1 %")
def giants(quick: bool) -> Found:
    """Whatever is longer than 64 kB is refused before it is decoded or recorded."""
    size, seconds = (2_000_000, 5.0) if quick else (20_000_000, 30.0)
    with sailing() as it:
        before = it.resident()
        it.start("flood", "verification.soak.flood", "giants", "--bytes", str(size), "--seconds", str(seconds))
        counts = grown(it, seconds + 3.0)
        metrics = _kept_on(it, counts)
        memory = it.resident() - before
        final = it.finish()
    metrics = [
        *metrics,
        Metric("giants refused", final["dropped"].get("size", 0), "", 1, MIN),
        Metric("memory gained, in giants", memory * 1e6 / size, "", 20.0),
    ]
    return Found(metrics, ["the middleware keeps buffers as long as the longest message that it has seen"])


@stress("discovery, nothing set", "this host only, and said at the start; a sender on this host is heard")
def discovery(quick: bool) -> Found:
    """The node without ROS_AUTOMATIC_DISCOVERY_RANGE, the sensors open to the subnet."""
    with rig(None, {"ROS_AUTOMATIC_DISCOVERY_RANGE": ""}) as it:
        it.start("sensors", "verification.soak.sender", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
        it.state("running", within=30.0)
        said = "discovery: this host only" in it.node.text
        it.finish()
    return Found([holds("said at the start", said), holds("heard on this host", True)])


@stress("scans: junk to every DDS port of the domain", "the node runs on, missed <= 1 %")
def scans(quick: bool) -> Found:
    """Random datagrams, half of them with the header of RTPS, to UDP and connections to TCP."""
    draw, count = random.Random(6), 2000 if quick else 200_000
    with sailing() as it:
        base = PORT + PER_DOMAIN * it.domain
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for k in range(count):
                junk = draw.randbytes(draw.randint(0, 1400))
                if k % 2:
                    junk = b"RTPS\x02\x03\x01\x0f" + junk
                out.sendto(junk, ("127.0.0.1", base + draw.randrange(60)))
        for port in range(base, base + 60):
            with socket.socket() as knock:
                knock.settimeout(0.05)
                knock.connect_ex(("127.0.0.1", port))
        metrics = _kept_on(it, grown(it, 3.0))
        it.finish()
    return Found([*metrics, Metric("datagrams", count)])


@stress("floods of every input and every service at once", "the node runs on, missed <= 1 %, the motion still arrives")
def floods(quick: bool) -> Found:
    """Bytes that are no message, as fast as one process sends them, on imu/data, odom and winch/command."""
    seconds = 5.0 if quick else 60.0
    with sailing() as it:
        mark = it.mark()
        for what in ("topics", "services"):
            child = it.start("flood", "verification.soak.flood", what, "--seconds", str(seconds))
            until(lambda child=child: "flooding" in child.text, 20.0, f"a flood of {what}")
        counts = grown(it, seconds)
        _, frames = it.probe.frames(mark)
        metrics = _kept_on(it, counts)
        time.sleep(3.0)
        level = it.probe.tasks("inputs")[-1].level
        final = it.finish()
    metrics = [
        *metrics,
        Metric("age of the motion of a tick, p50", 1e3 * percentile(frames["motion_age"], 50), "ms"),
        Metric("age of the motion of a tick, p99", 1e3 * percentile(frames["motion_age"], 99), "ms", 1500.0),
        Metric("level of the inputs two seconds later", level, "", 0),
        Metric("junk refused", final["dropped"].get("size", 0), "", 1, MIN),
    ]
    return Found(
        metrics,
        ["who may send to a topic can squeeze out what others send: only the policy of config/sros2 prevents that"],
    )


@stress("a foreign publisher on an output, a second node of the name", "each warned of within 4 s, once")
def foreign(quick: bool) -> Found:
    """The listener publishes on towbody/pose; another node calls itself cable_sim."""
    from .probe import Probe

    with rig() as it:
        it.sail()
        began = time.monotonic()
        it.probe.publisher(message_class("geometry_msgs/msg/PoseStamped"), "towbody/pose")

        def said(text: str):
            found = [t.at for t in it.probe.tasks("neighbours") if t.level and text in t.message]
            return found[0] if found else None

        spoofed = until(lambda: said("towbody/pose is also published by"), 10.0, "the spoof") - began
        began = time.monotonic()
        twin = Probe(it.domain, "cable_sim")
        try:
            twins = until(lambda: said("nodes have the name"), 10.0, "the twin") - began
        finally:
            twin.close()
        text = it.node.text
        it.finish()
    metrics = [
        Metric("foreign publisher said after", spoofed, "s", 4.0),
        Metric("second node of the name said after", twins, "s", 4.0),
        Metric("lines in the log for the publisher", text.count("towbody/pose is also published by"), "", 1, IS),
    ]
    return Found(metrics)


@stress("SROS2 policy", "names every topic and service that the node has, and no other")
def policy(quick: bool) -> Found:
    """The graph of a running node against config/sros2/policy.xml."""
    from cable_sim_ros.ros.services.policy import differences

    with rig() as it:
        it.sail()
        wrong = differences(it.probe.node)
        it.finish()
    return Found([Metric("differences", len(wrong), "", 0, IS)], wrong)
