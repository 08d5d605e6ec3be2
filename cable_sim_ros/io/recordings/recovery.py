"""What can still be read of a damaged or cut-off bag, as a new and whole one."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import NamedTuple

from ..bags.bag import BagError, BagReader, BagWriter, Damage, topics_of
from ..bags.mcap_file import McapFile
from ..scenes.yaml12 import YamlError, parse


class Recovery(NamedTuple):
    """What `recover` gave back: messages, their time span [s], and what was lost."""

    messages: int
    duration: float
    damage: Damage


def recover(src: str | os.PathLike, dst: str | os.PathLike) -> Recovery:
    """Copy every message that can still be read of a bag into a new one, also those behind damage.

    src: bag directory or .mcap file; dst: bag directory to make. Schemas, QoS, times and custom data are kept.
    BagError if src holds no message in an MCAP file, or dst cannot be made or written.
    """
    if Path(src).is_dir() and not any(Path(src).glob("*.mcap")):
        raise BagError(f"'{src}' holds no .mcap file: nothing to recover; give a bag directory or an .mcap file")
    with BagReader(src) as reader:
        if not any(file.pieces for file in reader.files):
            raise BagError(_nothing(src, reader.damage))
        writer = BagWriter(dst, custom_data=reader.custom_data)
        try:
            with writer:
                first, last = _copy(reader, writer)
        except OSError as error:
            raise BagError(
                f"'{dst}' cannot be written ({error.strerror}): it holds the first {writer.safe_count} messages "
                f"without an index; give a place with more room"
            ) from None
        if not writer.message_count:
            shutil.rmtree(dst)  # made above, and empty
            raise BagError(_nothing(src, reader.damage))
        return Recovery(writer.message_count, (last - first) * 1e-9, reader.damage)


def _copy(reader: BagReader, writer: BagWriter) -> tuple[int, int]:
    """First and last log time [ns]."""
    first, last = 2**64, 0
    for file in reader.files:
        _declare(file, writer)
    for file, messages in reader.pieces():
        names = topics_of(file)
        for item in messages:
            if item.channel not in names:
                reader.nameless(file, item.channel)
                continue
            try:
                writer.add(*names[item.channel], item.time, item.data, item.published)
            except ValueError as error:  # one topic in two types, or a type of nobody
                reader.damage.add(str(error))
                continue
            first, last = min(first, item.time), max(last, item.time)
    return first, last


def _declare(file: McapFile, writer: BagWriter) -> None:
    for number, (topic, msgtype) in sorted(topics_of(file).items()):
        channel = file.channels[number]
        profiles = channel.metadata.get("offered_qos_profiles", "")
        try:
            known = isinstance(parse(profiles)[0], (list, type(None)))
        except YamlError:
            known = False
        writer.declare(
            topic,
            msgtype,
            schema=file.schemas[channel.schema_id].data.decode("utf-8", "replace"),
            digest=channel.metadata.get("topic_type_hash", ""),
            profiles=profiles if known else "",
        )


def _nothing(src: str | os.PathLike, damage: Damage) -> str:
    why = f" ({damage})" if damage else ""
    return f"'{src}' holds no message of an .mcap file that can be read: nothing to recover, nothing was written{why}"
