"""rosbag2 directories with MCAP storage, written.

A bag is a directory with ``metadata.yaml`` (version 9) and ``<name>_0.mcap`` (ros2 profile, ``ros2msg`` schemas
with all dependencies, CDR messages). Layout after rosbag2's own metadata and MCAP storage code, Jazzy and later.
The same calls give the same bytes: nothing in the file comes from a clock, a host or a process.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.writer import CompressionType, Writer

from ...errors import CableSimError
from ...version import __version__
from ..scenes.yaml12 import dump, parse
from .typestore import ROS_DISTRO, definition, type_hash

CHUNK_SIZE = 256 * 1024  # bytes; larger chunks compress no better and stall the writer longer
SHOWN = 120  # characters of a path in an error
INFINITE = {"sec": 9223372036, "nsec": 854775807}


class BagError(CableSimError):
    """A bag that cannot be written or read; the text says what, what follows, and what to do."""


class _Sink:
    """The file of a bag. `whole` is where the last whole chunk ends [bytes]; nothing waits in a buffer of ours."""

    def __init__(self, path: Path) -> None:
        self._file = open(os.fspath(path), "xb", buffering=0)
        self.position = self.whole = 0

    def write(self, data: bytes) -> None:
        view = memoryview(data)
        while view:  # a disk that is nearly full takes a part
            try:
                written = self._file.write(view) or 0
            except OSError as error:
                error.filename = self._file.name  # for who reads the text
                raise
            self.position += written
            view = view[written:]

    def tell(self) -> int:
        return self.position

    def flush(self) -> None:
        """Nothing to do; the MCAP writer asks for it."""

    @property
    def closed(self) -> bool:
        return self._file.closed

    def close(self) -> None:
        self._file.close()

    def cut(self) -> None:
        """Close behind the last whole chunk."""
        with contextlib.suppress(OSError):  # a disk that is gone takes no cut either
            self._file.truncate(self.whole)
        self.close()


class _ChunkIndexes:
    """The chunk indexes of a file until its end, on disk: kept as objects they are 24 MB for an hour of recording."""

    def __init__(self, folder: Path) -> None:
        self._file = tempfile.TemporaryFile(dir=folder)

    def append(self, index: ChunkIndex) -> None:
        builder = RecordBuilder()
        index.write(builder)
        self._file.write(builder.end())

    def __iter__(self) -> Iterator[_ChunkIndexes]:
        yield self

    def write(self, builder: RecordBuilder) -> None:
        """All of them at once, as records."""
        self._file.seek(0)
        while block := self._file.read(64 * 1024):
            builder.write(block)

    def close(self) -> None:
        with contextlib.suppress(OSError):  # of a full disk: it had to be thrown away in any case
            self._file.close()


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


class BagWriter:
    """Writes one bag.

    path: directory to make, its parents too; custom_data: str -> str, kept in the metadata (scene, hashes,
    versions); chunk_size: bytes before compression. Topics are registered by `declare` or by the first `add`.
    Only `close` writes index and counts; without it `recover` gives back what was flushed. `message_count`: messages
    added so far; those of them that the operating system has, whole chunks, are `safe_count`.
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
        except (OSError, ValueError) as error:  # ValueError: a NUL in the name
            raise BagError(cannot_make(self.path, error)) from None
        self.file_name = f"{self.path.name}_0.mcap"
        self.message_count = self.safe_count = 0
        self._topics: dict[str, dict] = {}  # topic -> its metadata, in order of registration
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._first: int | None = None  # log times, ns
        self._last: int | None = None
        try:
            self._file = _Sink(self.path / self.file_name)
            self._indexes = _ChunkIndexes(self.path)
            self._mcap = Writer(self._file, chunk_size=chunk_size, compression=CompressionType.ZSTD)  # type: ignore
            self._mcap._Writer__chunk_indices = self._indexes  # type: ignore  # the library has no other way to bound it
            self._mcap.start(profile="ros2", library=f"cable_sim_ros {__version__}")
            self._file.whole = self._file.position
            self._write_metadata()
        except OSError as error:
            shutil.rmtree(self.path, ignore_errors=True)  # made above, and empty
            raise BagError(cannot_make(self.path, error)) from None

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
        offered = qos_profile(qos) if profiles is None else parse(profiles)[0] or []
        if msgtype not in self._schemas:
            self._schemas[msgtype] = self._mcap.register_schema(msgtype, "ros2msg", schema.encode())
        self._channels[topic] = self._mcap.register_channel(
            topic,
            "cdr",
            self._schemas[msgtype],
            {"offered_qos_profiles": dump(offered).strip() if offered else "", "topic_type_hash": digest},
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
        position = self._file.position
        self._mcap.add_message(
            self._channels[topic],
            time_ns,
            bytes(data),
            time_ns if publish_time_ns is None else publish_time_ns,
            sequence=entry["message_count"],
        )
        entry["message_count"] += 1
        self.message_count += 1
        if self._file.position != position:
            self._mark()
        self._first = time_ns if self._first is None else min(self._first, time_ns)
        self._last = time_ns if self._last is None else max(self._last, time_ns)

    def flush(self) -> None:
        """End the chunk in progress and hand it to the operating system: it then survives the end of the process."""
        self._mcap.flush()
        self._mark()

    def _mark(self) -> None:
        self._file.whole, self.safe_count = self._file.position, self.message_count

    def close(self) -> None:
        """Write index and metadata and close; a second call does nothing. OSError: the bag is as after a crash."""
        if self._file.closed:
            return
        try:
            self.flush()
            self._mcap.add_metadata("rosbag2", {"serialized_metadata": dump(self._metadata()).strip()})
            self._mcap.finish()
            self._file.close()
            self._indexes.close()
            self._write_metadata()
        except BaseException:
            self.abort()
            raise

    def abort(self) -> None:
        """Close behind the last whole chunk, without index; `recover` reads it."""
        if not self._file.closed:
            self._file.cut()
        self._indexes.close()

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
        try:
            scratch.write_text(dump({"rosbag2_bagfile_information": self._metadata()}), "utf-8")
            scratch.replace(self.path / "metadata.yaml")  # at no time half a file
        except OSError:
            scratch.unlink(missing_ok=True)
            raise


def cannot_make(path: str | os.PathLike, error: Exception) -> str:
    """Why a bag cannot be made at a place, for the user."""
    reason = error.strerror if isinstance(error, OSError) else error
    return (
        f"bag {shown(os.fspath(path))} cannot be made ({reason}): nothing was recorded; "
        f"give a folder that can be written to"
    )


def shown(value: str) -> str:
    """A path or name as an error shows it: quoted, control characters escaped, long ones shortened."""
    return repr(value) if len(value) <= SHOWN else f"{value[:SHOWN]!r}... ({len(value)} characters)"
