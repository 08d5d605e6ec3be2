"""A recorded run as arrays: what summary, picture and residuals start from."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...sim.scene import Scene
from ..bags.bag import BagError, BagReader, report
from ..messages.channels import CHANNELS, CLOUD, channel_of, decode, decode_frames
from ..scenes.load import load_scene, scene_from_text

PIECE = 4096  # messages that are decoded at once: a message takes five times the memory of its tick output
HEALTH = next(channel for channel in CHANNELS if channel.name == "sim_health")


class RecordedRun(NamedTuple):
    """A run: ``frames`` recarray of TICK_OUTPUT [ticks]; ``shapes`` and ``contacts``: (time [ns], table) pairs,
    columns as in physics/tick_output.py; ``custom_data`` of the bag: scene name and whatever the recorder was given;
    ``strums`` and ``bodies``: as shapes, empty where viv was off, or no body hangs on the line."""

    frames: np.recarray
    shapes: list[tuple[int, np.ndarray]]
    contacts: list[tuple[int, np.ndarray]]
    custom_data: dict[str, str]
    strums: list[tuple[int, np.ndarray]] = []
    bodies: list[tuple[int, np.ndarray]] = []


def scene_of_recording(
    custom_data: Mapping[str, str], path: str | os.PathLike, given: str | os.PathLike | None, unknown: str
) -> Scene:
    """The scene that a recording keeps, or the one given in its place (NAME or FILE).

    unknown: what is not known without, and what was not done then, for the text. Raises BagError, SceneError.
    """
    if given is not None:
        return load_scene(given)
    if not (text := custom_data.get("scene_yaml")):
        raise BagError(f"bag '{path}' keeps no scene, so {unknown}; give --scene NAME or FILE")
    return scene_from_text(text, f"scene kept in {path}")


def places_of(times: list[int], frames: np.recarray) -> np.ndarray:
    """Of each time [ns], in the order of a run, the tick output that has it or comes next; the last one at the end."""
    if (np.diff(frames["time"]) > 0).all():
        return np.minimum(np.searchsorted(frames["time"], times), len(frames) - 1)
    at, places = 0, []
    for time in times:  # the clock went back in between: a time may come again
        later = np.flatnonzero(frames["time"][at:] == time)
        at += int(later[0]) if len(later) else 0
        places.append(at)
    return np.array(places, int)


def load_run(path: str | os.PathLike, tables: bool = True) -> RecordedRun:
    """Read a bag that this package recorded, in whatever namespace; tables: shapes, contacts and strums too.

    BagError if it cannot be read, or has no tick outputs (no ``sim/health``).
    """
    frames: list[bytes] = []
    parts: list[np.recarray] = []
    found: dict[str, list[tuple[int, np.ndarray]]] = {"shape": [], "contact": [], "strum": [], "bodies": []}
    with BagReader(path) as bag:
        for message in bag:
            channel = channel_of(message.topic, message.msgtype)
            if channel is HEALTH:
                frames.append(message.data)
                if len(frames) == PIECE:
                    parts.append(decode_frames(frames))
                    frames.clear()
            elif tables and channel is not None and channel.msgtype == CLOUD:
                fields = decode(channel, message.data)
                time = fields.pop("time")
                for field, table in fields.items():
                    found[field].append((time, table))
        report(bag, None)
    if frames:
        parts.append(decode_frames(frames))
    if not parts:
        raise BagError(
            f"bag '{path}' has no topic '{HEALTH.topic}' of type {HEALTH.msgtype}: there is no run to "
            f"summarise; give a bag that the node or the offline run recorded"
        )
    whole = parts[0] if len(parts) == 1 else np.concatenate(parts).view(np.recarray)
    return RecordedRun(whole, found["shape"], found["contact"], bag.custom_data, found["strum"], found["bodies"])
