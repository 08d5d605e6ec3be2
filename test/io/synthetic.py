"""A made-up tow: tick outputs and tables that look like a run, without any physics behind them."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.io.bags.bag import BagWriter
from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.channels import Channel, Context, Encoder
from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS, FIELDS, SHAPE_COLUMNS, TICK_OUTPUT

START = 1_700_000_000_000_000_000
SPEED = 2.5  # m/s
PERIOD = 10.0  # s, of the heave
HEAVE = 1.5  # m, amplitude
TENSION = 9000.0  # N, mean
DEPTH = 180.0  # m, mean


def make_frames(count: int, tick_s: float = 0.01, seed: int = 1, start: int = START) -> np.recarray:
    """``count`` tick outputs: steady tow heading 30 degrees, heave of 10 s, every other field random."""
    random = np.random.default_rng(seed)
    frames = np.zeros(count, TICK_OUTPUT)
    for name, shape, kind, _, _ in FIELDS:
        frames[name] = random.integers(0, 5, (count, *shape)) if kind == "i8" else random.normal(size=(count, *shape))
    t = np.arange(count) * tick_s
    wave = np.sin(2 * np.pi * t / PERIOD)
    along = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    frames["time"] = start + (np.arange(count) * round(tick_s * 1e9))
    frames["tick"] = np.arange(count)
    frames["ship_position"] = SPEED * t[:, None] * along + np.array([0, 0, 1.0]) * HEAVE * wave[:, None]
    frames["ship_quaternion"] = [0, 0, np.sin(np.pi / 12), np.cos(np.pi / 12)]
    frames["sheave_position"] = frames["ship_position"] - 30 * along + [0, 0, 6.0]
    lag = np.sin(2 * np.pi * t / PERIOD - 1.0)
    frames["body_position"] = SPEED * t[:, None] * along - 350 * along
    frames["body_position"][:, 2] = 0.4 * HEAVE * lag - DEPTH
    frames["body_quaternion"] = frames["ship_quaternion"]
    frames["tension"] = TENSION + 1500 * np.sin(2 * np.pi * t / PERIOD + 0.6)
    frames["tension_tick_min"] = frames["tension_tick_max"] = frames["tension"]
    angle = 1.05 + 0.05 * wave
    frames["departure_angle"] = angle
    frames["tension_vector"] = (frames["tension"] * np.array([-np.sin(angle), 0 * t, -np.cos(angle)])).T
    frames["contact_resultant"] = 1.2 * frames["tension"]
    frames["contact_resultant_tick_max"] = frames["contact_resultant"]
    frames["wrap_angle"] = 0.9 + 0.05 * wave
    frames["contact_stations"] = 40
    frames["status"] = 0
    frames["iterations"], frames["substeps"] = 3, 1
    return frames.view(np.recarray)


def make_shape(frame: np.void, nodes: int = 41) -> np.ndarray:
    """Cable shape [nodes, 5] from the sheave to the towbody."""
    u = np.linspace(0.0, 1.0, nodes)[:, None]
    a, b = frame["sheave_position"], frame["body_position"]
    xyz = a + (b - a) * np.hstack([u, u, np.sin(0.5 * np.pi * u)])
    tension = frame["tension"] * (1 - 0.7 * u)
    table = np.hstack([xyz, tension, 450 * u])
    assert table.shape[1] == len(SHAPE_COLUMNS)
    return table


def make_contact(frame: np.void) -> np.ndarray:
    """Contact table [contact points, 9], ``contact_stations`` rows filled."""
    n = int(frame["contact_stations"])
    wrap = np.linspace(-0.1, 0.9, n)
    bulge = np.clip(np.sin(np.pi * (wrap + 0.1) / frame["wrap_angle"]), 0, None) * frame["tension"]
    return np.column_stack(
        [
            0.5 * np.sin(wrap),
            0 * wrap,
            0.5 * np.cos(wrap),
            wrap,
            1.1 * bulge,
            0.9 * bulge,
            0.001 - 1e-7 * bulge,
            40 + 0.5 * wrap,
            np.full(n, 0.0125),
        ]
    )


assert len(CONTACT_COLUMNS) == 9


def serialize(channel: Channel, frame, shape, contact, context: Context) -> bytes:
    """CDR bytes of one channel at any tick."""
    ((_, _, data),) = Encoder(context, 1.0, (channel._replace(rate=0.0, new=0),)).encode(frame, shape, contact)
    return data


def canonical(data: bytes, msgtype: str) -> bytes:
    """The same message as the typestore serializes it."""
    return bytes(STORE.serialize_cdr(STORE.deserialize_cdr(data, msgtype), msgtype))


def write_run(path, seconds: float = 10.0, tick_s: float = 0.01, **custom: str) -> np.recarray:
    """Record a made-up run to a bag and return its tick outputs."""
    frames = make_frames(round(seconds / tick_s), tick_s)
    encoder = Encoder(Context(), tick_s)
    with BagWriter(path, custom_data={"scene": "made-up tow", **custom}) as writer:
        encoder.declare(writer)
        for frame in frames:
            for channel, topic, data in encoder.encode(frame, make_shape(frame), make_contact(frame)):
                writer.add(topic, channel.msgtype, int(frame["time"]), data)
    return frames
