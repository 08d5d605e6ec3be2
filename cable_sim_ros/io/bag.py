"""rosbag2 directories with MCAP storage: write, read, and recover one that was cut off.

A bag is a directory with ``metadata.yaml`` (version 9) and ``<name>_0.mcap`` (ros2 profile, ``ros2msg`` schemas
with all dependencies, CDR messages). Layout after rosbag2's own metadata and MCAP storage code, Jazzy and later.
The same calls give the same bytes: nothing in the file comes from a clock, a host or a process.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import yaml
from mcap import records
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag2 import ReaderError

from .. import __version__
from .typestore import ROS_DISTRO, definition, type_hash

CHUNK_SIZE = 256 * 1024  # bytes; larger chunks compress no better and stall the writer longer
INFINITE = {"sec": 9223372036, "nsec": 854775807}


class BagError(Exception):
    """A bag that cannot be written or read; the text says what, what follows, and what to do."""


class Message(NamedTuple):
    """One recorded message: topic, type, log time [ns] and CDR bytes."""

    topic: str
    msgtype: str
    time: int
    data: bytes


def qos_profile(name: str) -> list[dict]:
    """Offered QoS of a topic as metadata version 9 writes it; name: "reliable", "sensor" or "" (not known)."""
    if not name:
        return []
    depth, reliability = {"reliable": (10, "reliable"), "sensor": (5, "best_effort")}[name]
    return [
        {
            "history": "keep_last",
            "depth": depth,
            "reliability": reliability,
            "durability": "volatile",
            "deadline": INFINITE,
            "lifespan": INFINITE,
            "liveliness": "automatic",
            "liveliness_lease_duration": INFINITE,
            "avoid_ros_namespace_conventions": False,
        }
    ]


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data):  # an anchor is legal YAML, but no rosbag2 writes one
        return True


def _dump(tree: object) -> str:
    return yaml.dump(tree, Dumper=_Dumper, sort_keys=False, default_flow_style=False, width=10_000)


class BagWriter:
    """Writes one bag.

    path: directory to make, its parents too; custom_data: str -> str, kept in the metadata (scene, hashes,
    versions); chunk_size: bytes before compression. Topics are registered by `declare` or by the first `add`.
    Only `close` writes index and counts; without it `recover` gives back what was flushed.
    """

    def __init__(
        self, path: str | os.PathLike, *, custom_data: dict[str, str] | None = None, chunk_size: int = CHUNK_SIZE
    ) -> None:
        self.path = Path(path)
        self.custom_data = {str(key): str(value) for key, value in (custom_data or {}).items()}
        try:
            self.path.mkdir(parents=True)
        except FileExistsError:
            raise BagError(
                f"bag '{self.path}' exists already: it is not overwritten, nothing was recorded; "
                f"give another path or remove the old bag"
            ) from None
        self.file_name = f"{self.path.name}_0.mcap"
        self._topics: dict[str, dict] = {}  # topic -> its metadata, in order of registration
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._first: int | None = None  # log times, ns
        self._last: int | None = None
        self._file = open(self.path / self.file_name, "wb")
        try:
            self._mcap = Writer(self._file, chunk_size=chunk_size, compression=CompressionType.ZSTD)
            self._mcap.start(profile="ros2", library=f"cable_sim_ros {__version__}")
            self._write_metadata()
            self._file.flush()
        except BaseException:
            self.abort()
            raise

    @property
    def message_count(self) -> int:
        """Messages added so far."""
        return sum(topic["message_count"] for topic in self._topics.values())

    def declare(
        self,
        topic: str,
        msgtype: str,
        qos: str = "",
        *,
        schema: str | None = None,
        digest: str | None = None,
        profiles: str | None = None,
    ) -> None:
        """Register a topic; repeated calls are ignored.

        msgtype: "package/msg/Name"; qos: see `qos_profile`. schema, digest, profiles: text, type hash and QoS YAML
        to use instead of our own, for a type that came from another bag. ValueError for an unknown type.
        """
        if topic in self._topics:
            return
        schema = definition(msgtype) if schema is None else schema
        digest = type_hash(msgtype) if digest is None else digest
        offered = qos_profile(qos) if profiles is None else yaml.safe_load(profiles) or []
        if msgtype not in self._schemas:
            self._schemas[msgtype] = self._mcap.register_schema(msgtype, "ros2msg", schema.encode())
        self._channels[topic] = self._mcap.register_channel(
            topic,
            "cdr",
            self._schemas[msgtype],
            {"offered_qos_profiles": _dump(offered).strip() if offered else "", "topic_type_hash": digest},
        )
        self._topics[topic] = {
            "topic_metadata": {
                "name": topic,
                "type": msgtype,
                "serialization_format": "cdr",
                "offered_qos_profiles": offered,
                "type_description_hash": digest,
            },
            "message_count": 0,
        }

    def add(
        self, topic: str, msgtype: str, time_ns: int, data: bytes | memoryview, publish_time_ns: int | None = None
    ) -> None:
        """Append one message. time_ns: log time; publish_time_ns: source time, log time if not given; data: CDR."""
        if self._file.closed:
            raise BagError(
                f"bag '{self.path}' is closed: a message of '{topic}' was not recorded; start a new recording"
            )
        if time_ns < 0:
            raise ValueError(
                f"time {time_ns} ns of a message of '{topic}' is negative: a bag cannot hold it; "
                f"start the simulation clock at 0 or later"
            )
        if topic not in self._topics:
            self.declare(topic, msgtype)
        entry = self._topics[topic]
        if msgtype != entry["topic_metadata"]["type"]:
            raise ValueError(
                f"topic '{topic}' was recorded as {entry['topic_metadata']['type']} and now comes as "
                f"{msgtype}: the message is refused; one topic has one type"
            )
        self._mcap.add_message(
            self._channels[topic],
            time_ns,
            bytes(data),
            time_ns if publish_time_ns is None else publish_time_ns,
            sequence=entry["message_count"],
        )
        entry["message_count"] += 1
        self._first = time_ns if self._first is None else min(self._first, time_ns)
        self._last = time_ns if self._last is None else max(self._last, time_ns)

    def flush(self) -> None:
        """End the chunk in progress and hand it to the operating system: it then survives the end of the process."""
        self._mcap.flush()

    def close(self) -> None:
        """Write index and metadata and close; a second call does nothing. OSError: the bag is as after a crash."""
        if self._file.closed:
            return
        try:
            self._mcap.add_metadata("rosbag2", {"serialized_metadata": _dump(self._metadata()).strip()})
            self._mcap.finish()
            self._file.close()
            self._write_metadata()
        except BaseException:
            self.abort()
            raise

    def abort(self) -> None:
        """Close the file as it is, without index; `recover` reads it."""
        try:
            self._file.close()
        except OSError:
            pass  # what could not be written before cannot be written now

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def _metadata(self) -> dict:
        start = {"nanoseconds_since_epoch": self._first or 0}
        duration = {"nanoseconds": (self._last or 0) - (self._first or 0)}
        return {
            "version": 9,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": self.message_count,
            "topics_with_message_count": list(self._topics.values()),
            "compression_format": "",
            "compression_mode": "",  # the chunks are compressed, not files or messages
            "relative_file_paths": [self.file_name],
            "files": [
                {
                    "path": self.file_name,
                    "starting_time": start,
                    "duration": duration,
                    "message_count": self.message_count,
                }
            ],
            "custom_data": self.custom_data,
            "ros_distro": ROS_DISTRO,
        }

    def _write_metadata(self) -> None:
        scratch = self.path / "metadata.yaml.tmp"
        scratch.write_text(_dump({"rosbag2_bagfile_information": self._metadata()}), "utf-8")
        scratch.replace(self.path / "metadata.yaml")  # at no time half a file


def read_metadata(path: str | os.PathLike) -> dict:
    """The ``rosbag2_bagfile_information`` of a bag directory; BagError if there is none."""
    try:
        return yaml.safe_load((Path(path) / "metadata.yaml").read_text("utf-8"))["rosbag2_bagfile_information"]
    except (OSError, yaml.YAMLError, KeyError, TypeError) as error:
        raise BagError(
            f"'{path}' is not a bag directory ({type(error).__name__}: {error}): nothing was read; "
            f"give the directory that holds metadata.yaml"
        ) from None


def read_bag(path: str | os.PathLike) -> Iterator[Message]:
    """Messages of a bag in order of log time, of any rosbag2 storage; BagError if it cannot be read."""
    if Path(path).is_dir():
        read_metadata(path)  # says plainly what is wrong with it, readers do not
    try:
        with AnyReader([Path(path)]) as reader:
            for connection, time, data in reader.messages():
                yield Message(connection.topic, connection.msgtype, time, bytes(data))
    except FileNotFoundError:
        raise BagError(f"bag '{path}' does not exist: nothing was read; give the directory of a bag") from None
    except (AnyReaderError, ReaderError) as error:
        raise BagError(
            f"bag '{path}' cannot be read ({error}): if the recording was cut off, recover it into a new bag first"
        ) from None


class Recovery(NamedTuple):
    """What `recover` gave back: messages, their time span [s], and why reading ended ("" = the bag was whole)."""

    messages: int
    duration: float
    ended_by: str


def recover(src: str | os.PathLike, dst: str | os.PathLike) -> Recovery:
    """Copy every message that can still be read from a cut-off bag into a new one.

    src: bag directory or .mcap file; dst: bag directory to make. Schemas, QoS, times and custom data are kept.
    BagError if src holds no MCAP file or dst exists.
    """
    src = Path(src)
    files = [src] if src.is_file() else sorted(src.glob("*.mcap"))
    if not files:
        raise BagError(f"'{src}' holds no .mcap file: nothing to recover; give a bag directory or an .mcap file")
    try:
        custom_data = read_metadata(src if src.is_dir() else src.parent).get("custom_data")
    except BagError:
        custom_data = None
    ended_by, first, last = "", None, None
    with BagWriter(dst, custom_data=custom_data) as writer:
        for file in files:
            schemas, channels = {}, {}
            for record in _records(file):
                if isinstance(record, records.Schema):
                    schemas[record.id] = record
                elif isinstance(record, records.Channel):
                    channels[record.id] = record
                    schema = schemas[record.schema_id]
                    writer.declare(
                        record.topic,
                        schema.name,
                        schema=schema.data.decode(),
                        digest=record.metadata.get("topic_type_hash", ""),
                        profiles=record.metadata.get("offered_qos_profiles", ""),
                    )
                elif isinstance(record, records.Message):
                    channel = channels[record.channel_id]
                    writer.add(
                        channel.topic,
                        schemas[channel.schema_id].name,
                        record.log_time,
                        record.data,
                        record.publish_time,
                    )
                    first = record.log_time if first is None else min(first, record.log_time)
                    last = record.log_time if last is None else max(last, record.log_time)
                elif isinstance(record, Exception):
                    ended_by = f"{file.name}: {type(record).__name__} {record}".rstrip()
    return Recovery(writer.message_count, ((last or 0) - (first or 0)) * 1e-9, ended_by)


def _records(file: Path) -> Iterator[object]:
    """Records of an MCAP file up to the first that cannot be read; that failure is the last item."""
    with open(file, "rb") as stream:
        reader = iter(StreamReader(stream, validate_crcs=True).records)
        while True:
            try:
                yield next(reader)
            except StopIteration:
                return
            except Exception as error:  # a torn record may fail in any way: end of file, zstd, checksum, unpacking
                yield error
                return
