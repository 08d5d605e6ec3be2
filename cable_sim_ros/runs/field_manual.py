"""The reference of what a tick answers, made from the declarations: fields, tables, topics of a recording."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..io.bags.bag_writer import qos_profile
from ..io.messages.channels import EVERY, HEALTH, SOMETIMES, TRANSFORMS, Channel, Context, Encoder, decode
from ..io.messages.markers import MAX_RATE, MSGTYPE, TOPIC
from ..io.messages.messages import KINDS
from ..io.recordings import journal
from ..physics.tick_output import (
    BODY_COLUMNS,
    CONTACT_COLUMNS,
    FIELDS,
    MAX_CONTACT_POINTS,
    SHAPE_COLUMNS,
    SLOPE_COLUMNS,
    STRUM_COLUMNS,
    TICK_OUTPUT,
)
from ..terminal import markdown_table

TITLE = """# Fields of a tick

Made by `cable-sim manual fields --out docs/fields.md` from the declarations in the code; do not
edit. SI units. The world is `odom`: ENU, z up, z = 0 at the mean water surface. Flags of `status`:
[flags](flags.md). Types, frames and QoS of the live topics: [topics](topics.md).

| where | how |
|---|---|
| Python, a tick | `frame = sim.tick()`, then `frame.tension`, `frame.body_position` |
| Python, a run | `frames = sim.run(n)`, `run(...).frames`: record array, `frames.body_position[:, 2]` |
| a recording | `load_run("runs/a/tow").frames`, of `cable_sim_ros.testing` ([example](examples.md#read_recording)) |
| topic `sim/health` | `name` the fields, a vector as `body_position.x`, `.y`, `.z`; `position` the values |

## Fields

A record of `TICK_OUTPUT`, {size} bytes. A shape of [3] is a vector x y z, one of [4] a quaternion
x y z w. Every field is in `sim/health`; the last column names the topic that has it beside.

"""
TABLES = """
## Tables

In Python tables of float64, [rows, columns]: `sim.shape`, `sim.contact`, `sim.strum`. As a topic
and in a recording a sensor_msgs/PointCloud2 of float32, little-endian, one point a row, one field a
column, `point_step` 4 bytes times the columns. `load_run` gives them as (time in ns, table).
"""
SHAPE = """
### `cable/shape`

One row a node, from the drum or the fixed end to the towbody. In the compiled
output the slope of the cable follows: {slopes}.
"""
CONTACT = """
### `sheave/contact`

One row for each contact point of the sheave, inboard to outboard; axes of `sheave_link`. The
table has `contact_stations` rows, at most {rows}.
"""
STRUM = """
### `cable/strum`

Where `viv` is on: one row a node, of the element that begins there; the last node repeats the one
before.
"""
BODIES = """
### `cable/bodies`

Where bodies hang on the line: one row each, in the order of the scene. The tensions of its two
sides are drawn on from the next two nodes. Roll and pitch are 0 of a body of `model: level`.
"""
RECORDING = """
## Topics of a recording

A recording is a rosbag2 directory with MCAP storage ([recordings](recordings.md)); messages are
plain CDR, stamps are simulation time. Names are relative to the namespace, `{namespace}`. An offline
run has a tick output each 0.1 s (`--every`), which bounds the rates of this table; the node has one
each tick and takes its rates from the parameters named. What the node records beside these:
[recordings](recordings.md).

"""
FIELD_HEAD = ("field", "type, shape", "unit", "meaning", "also on")
TOPIC_HEAD = ("topic", "type", "rate", "in the node", "QoS: reliability, depth", "fields")
NOT_PUBLISHED = "recorded only"
MEANING = {  # of the columns; KeyError where one has none
    "x": "place along x",
    "y": "place along y",
    "z": "place along z",
    "tension": "effective tension at the node",
    "arc_length": "unstretched arc length from the drum end",
    "roll": "of the body, port side up",
    "pitch": "of the body, nose down (REP 103)",
    "tension_above": "effective tension on the inboard side of the body",
    "tension_below": "that on its outboard side",
    "slope_x": "dr/ds along x",
    "slope_y": "dr/ds along y",
    "slope_z": "dr/ds along z",
    "wrap_angle": "about the axis of the sheave from its top, positive outboard (aft)",
    "load_port": "line load of the port half: flank, rim, cheek",
    "load_starboard": "line load of the starboard half",
    "gap": "distance of the centreline from its seat in the groove; negative: pressed in",
    "length": "length of cable the contact point stands for",
    "normal_speed": "mean flow across the cable",
    "shedding_frequency": "vortex shedding frequency",
    "mode": "mode of the span from the sheave to the towbody with that frequency",
    "amplitude": "of the antinodes, in diameters",
    "amplification": "drag factor in force",
}


def text() -> str:
    """The page in Markdown."""
    also = beside()
    rows = []
    for name, shape, _, unit, meaning in FIELDS:
        kind = f"{TICK_OUTPUT[name].base.name} {list(shape) or ''}".strip()
        rows.append((f"`{name}`", kind, _unit(unit), meaning, ", ".join(also[name])))
    slopes = ", ".join(f"`{name}`" for name, _ in SLOPE_COLUMNS)
    parts = [TITLE.format(size=TICK_OUTPUT.itemsize), _table(FIELD_HEAD, rows)]
    parts += [TABLES, SHAPE.format(slopes=slopes), _columns(SHAPE_COLUMNS)]
    parts += [CONTACT.format(rows=MAX_CONTACT_POINTS), _columns(CONTACT_COLUMNS), STRUM, _columns(STRUM_COLUMNS)]
    parts += [BODIES, _columns(BODY_COLUMNS)]
    parts += [RECORDING.format(namespace=Context().namespace), _table(TOPIC_HEAD, _topics())]
    return "".join(parts)


def beside() -> dict[str, list[str]]:
    """Topics that carry each field beside sim/health, found by reading back a message of each channel."""
    found: dict[str, list[str]] = {name: [] for name, *_ in FIELDS}
    for channel in EVERY:
        for name in carried(channel):
            if name in found and channel.topic != "sim/health" and name != "time":
                found[name].append(f"`{channel.topic}`")
    return found


def carried(channel: Channel) -> list[str]:
    """Names that reading back a message of the channel gives."""
    if channel.read is None:
        return []
    frame = np.zeros(1, TICK_OUTPUT).view(np.recarray)[0]
    frame.readings_new = channel.new
    shape, contact = np.zeros((2, len(SHAPE_COLUMNS) + len(SLOPE_COLUMNS))), np.zeros((1, len(CONTACT_COLUMNS)))
    ((_, _, data),) = Encoder(Context(), 1.0, (channel._replace(rate=0.0),)).encode(frame, shape, contact)
    return list(decode(channel, data))


def _topics() -> Iterable[tuple[str, ...]]:
    for channel in EVERY:
        rate = f"{channel.rate:g} Hz" if channel.rate else "every reading" if channel.new else "every tick"
        fields = [name for name in carried(channel) if name != "time"]
        yield _topic(channel, rate, _own_rate(channel), _fields(channel, fields))
    drawn = Channel("", TOPIC, MSGTYPE, None, None)
    yield _topic(drawn, f"`--markers`, at most {MAX_RATE:g} Hz; none as shipped", "`publish.marker_rate`", "a drawing")
    kept = Channel("", journal.TOPIC, journal.MSGTYPE, None, None, qos="")
    yield _topic(kept, "as it comes", NOT_PUBLISHED, "inputs as each tick took them, JSON")
    for kind, (msgtype, topic) in KINDS.items():
        taken = Channel("", topic, msgtype, None, None, qos="")
        yield _topic(taken, "as it comes", "as it comes", f"input: {kind}, as it was received")


def _fields(channel: Channel, fields: Sequence[str]) -> str:
    if channel.topic == "sim/health":
        return f"all, {len(HEALTH)} numbers"
    if channel is TRANSFORMS:
        return "`odom` to `base_link` to `sheave_link`, `odom` to `towbody_link`"
    if set(fields) & {"shape", "contact", "strum", "bodies"}:
        return "the table above"
    return ", ".join(f"`{name}`" for name in fields)


def _own_rate(channel: Channel) -> str:
    """Parameter of the node that sets the rate (ros/topics.py: rows_of)."""
    if channel is TRANSFORMS or channel in [row for row, _ in SOMETIMES]:
        return "the same"
    return {"sheave_contact": "`publish.contact_rate`", "cable_shape": "`publish.shape_rate`"}.get(
        channel.name, "`publish.state_rate`"
    )


def _topic(channel: Channel, rate: str, node: str, fields: str) -> tuple[str, ...]:
    offered = [f"{q['reliability'].replace('_', ' ')}, {q['depth']}" for q in qos_profile(channel.qos)]
    return (f"`{channel.topic}`", channel.msgtype.replace("/msg/", "/"), rate, node, *(offered or ["-"]), fields)


def _columns(columns: Sequence[tuple[str, str]]) -> str:
    rows = [(f"`{name}`", _unit(unit), MEANING[name]) for name, unit in columns]
    return "\n" + _table(("column", "unit", "meaning"), rows)


def _unit(unit: str) -> str:
    return "-" if unit == "1" else unit


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return markdown_table([head, *rows]) + "\n"
