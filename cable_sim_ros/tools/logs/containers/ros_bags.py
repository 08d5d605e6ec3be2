"""Bags of ROS 1 and ROS 2: each topic a source whose columns are the numbers of its messages by field path.

A type is that of the definition in the bag, else of the installed types; a topic without either is named in a notice.
The stamp of a message's header is the device's clock, the log time the logger's.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory

import numpy as np
import zstandard

from ....errors import told_as
from ....files import open_file
from ....io.bags.bag import BagError, read_metadata
from ..log import Log, LogError, Losses, Source
from .bag_files import MCAP, ROS1, SQLITE, Item, Topic, messages_of
from .leaves import MAX_COLUMNS, MAX_ELEMENTS, Codec, Definition, codec

MAX_NUMBERS = 2**28  # of one log, 2 GB
BLOCK = 4096  # rows that are lists
LAST = 2**63 - 1  # ns


class Collector:
    """Records of one source as they come; `source` makes columns of them."""

    def __init__(self, name: str, kind: str, columns: Sequence[str]) -> None:
        self.name, self.kind, self.columns = name, kind, list(columns)
        self.left_out: set[str] = set()  # columns above the limit
        self._rows: list[list[float]] = []
        self._blocks: list[np.ndarray] = []
        self._more: dict[str, tuple[array, array]] = {}  # column: numbers of records, values
        self._logged, self._device = array("q"), array("q")
        self._stamped = True

    def __len__(self) -> int:
        return len(self._logged)

    @property
    def numbers(self) -> int:
        """That its columns will have."""
        return len(self) * (len(self.columns) + len(self._more))

    def add(self, fixed: list[float], more: Mapping[str, float], logged: int, device: int | None) -> None:
        """One record; times in ns. OverflowError for one that no clock shows, before anything is kept."""
        stamp = device if device is not None else 0
        if not (0 <= logged <= LAST and -LAST <= stamp <= LAST):
            raise OverflowError("a time is beyond the year 2262")
        number = len(self._logged)
        for column, value in more.items():
            kept = self._more.get(column)
            if kept is None:
                if len(self._more) + len(self.columns) >= MAX_COLUMNS:
                    self.left_out.add(column[:80] if len(self.left_out) < MAX_COLUMNS else "")
                    continue
                kept = self._more[column] = array("q"), array("d")
            kept[0].append(number)
            kept[1].append(value)
        self._logged.append(logged)
        self._device.append(stamp)
        self._stamped = self._stamped and device is not None
        self._rows.append(fixed)
        if len(self._rows) == BLOCK:
            self._pack()

    def _pack(self) -> None:
        self._blocks.append(np.array(self._rows, np.float64).reshape(len(self._rows), len(self.columns)))
        self._rows = []

    def source(self) -> Source:
        """The source; a device's clock that always shows zero is none. LogError where its numbers are too many."""
        if self.numbers > MAX_NUMBERS:
            raise LogError(f"{self.name}: {self.numbers} numbers are more than {MAX_NUMBERS}; cut the log into parts")
        self._pack()
        rows = np.concatenate(self._blocks)
        columns = {name: np.ascontiguousarray(rows[:, k]) for k, name in enumerate(self.columns)}
        for name, (numbers, values) in self._more.items():
            column = np.full(len(self), np.nan)
            column[np.frombuffer(numbers, np.int64)] = np.frombuffer(values, np.float64)
            columns[name] = column
        device = np.array(self._device, np.int64)
        told = self._stamped and bool(device.any())
        return Source(self.name, self.kind, np.array(self._logged, np.int64), device if told else None, columns)


KINDS = ("*.mcap", "*.db3", "*.mcap.zstd", "*.db3.zstd")
ZSTD = b"\x28\xb5\x2f\xfd"
MAX_MESSAGE = 1_000_000  # bytes; a larger one holds a picture or a cloud
MAX_GROWTH = 100  # decompressed bytes for each byte of a compressed bag
PICTURES = {f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "PointCloud", "PointCloud2")}
UNDECODED = "message that does not fit its definition"


def recognise(head: bytes, path: Path) -> bool:
    """A file of a bag, or a folder of them."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file() or any(next(path.glob(kind), None) is not None for kind in KINDS)
    return head.startswith((MCAP, SQLITE, ROS1)) or (head.startswith(ZSTD) and path.suffix == ".zstd")


def read(path: Path) -> Log:
    """Read a bag, or what is left of it. LogError if nothing of it can be read."""
    log = Log(str(path), "bag", {}, 0)
    topics: dict[Topic, _Reader] = {}
    numbers = 0
    for topic, time, data in _items(path, log):
        reader = topics.get(topic)
        if reader is None:
            reader = topics[topic] = _Reader(topic, [r.collector for r in topics.values()])
        before = reader.collector.numbers
        reader.take(time, data, log.losses)
        numbers += reader.collector.numbers - before
        if numbers > MAX_NUMBERS:
            log.losses.add(f"rest behind {MAX_NUMBERS} numbers; cut the bag into parts", f"message of {topic.name}")
            break
    found = {id(reader.collector): reader.collector for reader in topics.values() if len(reader.collector)}
    for collector in found.values():
        log.sources[collector.name] = collector.source()
        log.records += len(collector)
    for reader in topics.values():
        log.notices += [note for note in reader.notices() if note not in log.notices]
    if not topics and not log.losses:
        log.notices.append("the bag has no messages")
    return log


def _items(path: Path, log: Log) -> Iterator[Item]:
    def notice(text: str) -> None:
        log.notices.append(text)

    with ExitStack() as stack:
        with told_as(LogError, f"{path}: cannot be read", "; nothing was read"):
            files, squeezed = _files(path, log)
            if any(file.suffix == ".zstd" for file in files):
                folder = Path(stack.enter_context(TemporaryDirectory()))
                files = [_unpacked(file, folder, k) if file.suffix == ".zstd" else file for k, file in enumerate(files)]
        problems = []
        for file in files:
            try:
                for topic, time, data in messages_of(file, log.losses, notice):
                    yield topic, time, _expanded(data) if squeezed else data
            except (LogError, OSError) as error:
                problems.append(str(error))
                log.losses.add("file of the bag that cannot be read", f"{file.name}: {error}")
        if len(problems) == len(files):
            raise LogError(problems[0] if str(path) in problems[0] else f"{path}: {problems[0]}")


def _files(path: Path, log: Log) -> tuple[list[Path], bool]:
    """Files of a bag, and whether each message is compressed by itself."""
    if not path.is_dir():
        return [path], False
    there = sorted(file for kind in KINDS for file in path.glob(kind))
    try:
        info = read_metadata(path)
    except BagError as error:
        log.notices.append(f"metadata.yaml is not used: {' '.join(str(error).split())[:200]}")
        if not there:
            raise LogError(f"{path}: holds no bag ({' '.join(str(error).split())[:300]}); nothing was read") from None
        return there, False
    files = [path / PurePath(name).name for name in info["relative_file_paths"]]  # never outside of the bag
    files = [file if file.is_file() else file.with_name(file.name + ".zstd") for file in files]
    if not all(file.is_file() for file in files):
        if not there:
            raise LogError(f"{path}: metadata.yaml names files that are not there; nothing was read. Copy them too")
        log.notices.append("metadata.yaml names files that are not there, and is not used")
        files = there
    return files, str(info.get("compression_mode") or "").lower() == "message"


def _unpacked(file: Path, folder: Path, number: int) -> Path:
    """A compressed file of a bag, decompressed; cut where it grows beyond all measure or its data is damaged."""
    target = folder / f"{number}_{file.stem}"
    left = 64_000_000 + MAX_GROWTH * file.stat().st_size
    with open_file(file, "rb") as source, target.open("wb") as sink:
        try:
            with zstandard.ZstdDecompressor(max_window_size=2**27).stream_reader(source) as stream:
                while left > 0 and (block := stream.read(1_000_000)):
                    sink.write(block)
                    left -= len(block)
        except (zstandard.ZstdError, MemoryError):
            pass  # the reader of what came before says where it ends
    return target


def _expanded(data: bytes) -> bytes:
    try:
        return zstandard.ZstdDecompressor().decompressobj().decompress(data) if len(data) < MAX_MESSAGE else data
    except (zstandard.ZstdError, MemoryError):
        return b""  # no message: counted as one that does not fit


class _Reader:
    """Takes the messages of a topic into columns, or says why not."""

    def __init__(self, topic: Topic, others: list[Collector]) -> None:
        self.topic, self.why = topic, ""
        self._count = self._large = 0
        self._long: Counter[str] = Counter()
        parts = [part for part in topic.name.split("/") if part]
        kind = topic.msgtype if topic.msgtype.count("/") != 1 else "/msg/".join(topic.msgtype.split("/"))
        found: Codec | None = None
        if any(part.startswith("_") for part in parts):
            self.why = "a hidden topic, as of services"
        elif topic.msgtype.endswith(("_Event", "_Request", "_Response")):
            self.why = f"a service, {topic.msgtype}"
        elif kind in PICTURES:
            self.why = f"pictures or clouds, {kind}"
        else:
            try:
                found = codec(topic.msgtype, topic.encoding, topic.schema_encoding, topic.schema)
            except Definition as error:
                self.why = f"{topic.msgtype or 'of no type'}: {error}"
        self.codec = found
        name = topic.name
        for other in others:  # the same topic in another file of the bag, or of another connection
            if other.name == name and len(other) and (other.kind != kind or found and other.columns != found.columns):
                name = f"{topic.name} ({kind})"
        again = [other for other in others if other.name == name]
        same = again and found and again[-1].columns == found.columns
        self.collector = again[-1] if same else Collector(name, kind, found.columns if found else [])

    def take(self, time: int, data: bytes, losses: Losses) -> None:
        """One message."""
        self._count += 1
        if self.codec is None:
            return
        if len(data) > MAX_MESSAGE:
            self._large += 1
            return
        try:
            values = self.codec.read(data)
            self.collector.add(values.fixed, values.more, time, values.stamp)
        except Exception:  # code that rosbags wrote for a definition of the file
            losses.add(UNDECODED, f"message {self._count} of {self.topic.name}")
            return
        for path, length in values.long.items():
            if len(self._long) < 100:
                self._long[path] = max(self._long[path], length)

    def notices(self) -> list[str]:
        """What was left out of the topic."""
        name, found = self.topic.name, []
        if self.why:
            found.append(f"{name}: {self._count} messages are left out ({self.why})")
        if self._large:
            found.append(f"{name}: {self._large} messages above {MAX_MESSAGE} bytes are left out")
        if self.codec is not None and not self.collector.numbers and self._count:
            found.append(f"{name}: {self.topic.msgtype} has no numbers")
        arrays = list(self.codec.left_out) if self.codec else []
        arrays += [f"{path[:80]} with up to {length} elements" for path, length in self._long.items()]
        if arrays:
            more = f" and {len(arrays) - 5} more" if len(arrays) > 5 else ""
            found.append(f"{name}: left out, above {MAX_ELEMENTS} elements: {', '.join(arrays[:5])}{more}")
        if self.collector.left_out:
            found.append(f"{name}: {len(self.collector.left_out)} columns behind the first {MAX_COLUMNS} are left out")
        return found
