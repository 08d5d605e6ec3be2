"""I11, I12, I14, I16, S1: recordings on a bad disk, killed, in the wrong place, and with too much to write."""

from __future__ import annotations

import errno
import os
import resource
import signal
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader

from cable_sim_ros.io.bags.bag import BagError, BagWriter
from cable_sim_ros.io.recordings.recorder import Recorder, RecorderStats
from cable_sim_ros.io.recordings.recording_place import MAX_NAME, Names, name_problem, root_problem
from cable_sim_ros.io.recordings.recovery import recover

from .apart import apart, start_apart
from .bags import IMU, TOPIC, imu, read
from .verdict import IS, MAX, Found, Metric, holds, stress

RATE = 1100.0  # messages/s of a node at 100 Hz that records all its topics
ROOMS = (20_000, 60_000, 200_000)  # bytes


@stress("disk full, over its quota, slow, below least_free", "accepted = written + dropped; recovered = written")
def bad_disk(quick: bool) -> Found:
    """I11: disk full, over its quota, slow, and below the space that is to be left."""
    metrics = []
    count = 2000 if quick else 20_000
    with tempfile.TemporaryDirectory() as scratch:
        cases = [(f"full after {room // 1000} kB", "full", room) for room in ROOMS]
        cases += [("over its quota", "quota", 60_000), ("slow", "slow", 0), ("below least_free", "free", 0)]
        for what, kind, room in cases:
            path = Path(scratch) / f"{kind}{room}"
            stats = apart(_record_badly, path, kind, room, count)
            lost_count = count - stats.written - stats.dropped - stats.waiting
            metrics += [
                Metric(f"{what}: accepted - written - dropped", lost_count, "", 0, IS),
                holds(f"{what}: reason given", bool(stats.error) or kind == "slow"),
                Metric(f"{what}: recovered - written", _recovered(path) - stats.written, "", 0, IS),
                Metric(f"{what}: written", stats.written),
            ]
    return Found(metrics)


def _record_badly(path: Path, kind: str, room: int, count: int) -> RecorderStats:
    """Counts of a recording of `count` messages; kind: what is wrong with the disk; room: bytes it takes."""
    rng = np.random.default_rng(7)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    if kind == "full":
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
    recorder = Recorder(path, queue_size=500, flush_s=0.02, poll_s=0.002, least_free=10**18 if kind == "free" else 0)
    _spoil(recorder, kind, room)
    for k in range(count):
        recorder.put(TOPIC, IMU, k, imu(k, rng))
        if k % 20 == 0:
            time.sleep(0.002)
    return recorder.close(timeout=60.0)


def _spoil(recorder: Recorder, kind: str, room: int) -> None:
    sink = recorder.writer._file
    write = sink.write

    def late(data: bytes) -> None:
        time.sleep(0.01)
        write(data)

    def over(data: bytes) -> None:
        if sink.position + len(data) > room:
            write(data[: room - sink.position])  # as a file system does: a part, then the error
            raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))
        write(data)

    if kind in ("slow", "quota"):
        sink.write = late if kind == "slow" else over  # type: ignore[method-assign]


def _recovered(path: Path) -> int:
    """Messages that a stock reader finds in what `recover` makes of a bag."""
    target = path.with_name(f"{path.name}_back")
    try:
        recover(path, target)
    except BagError:
        return 0
    return len(_stock(target))


def _stock(path: Path) -> list[int]:
    """Times of the messages of a bag as rosbags reads it."""
    with AnyReader([path]) as reader:
        return [time for _, time, _ in reader.messages()]


@stress("kill -9 between 0.1 and 2.5 s after the start, 100 times", "recovered for stock readers, <= 1 s lost")
def killed(quick: bool) -> Found:
    """I12: kill -9 between 0.1 and 2.5 s after the start."""
    number = 10 if quick else 100
    unreadable = unsaid = 0
    max_lost = max_lost_early = 0.0
    delays = np.random.default_rng(1).permutation(np.linspace(0.1, 2.5, number))
    with tempfile.TemporaryDirectory() as scratch:
        for batch in np.array_split(delays, -(-number // 10)):
            running = []
            for delay in batch:
                path = Path(scratch) / f"{delay:.4f}"
                child, pipe = start_apart(_record_for_ever, path)
                begun = pipe.recv()
                timer = threading.Timer(delay, child.kill)
                timer.start()
                running.append((path, child, pipe, delay, begun))
            for path, child, pipe, delay, begun in running:
                child.join(30.0)
                last = begun
                try:
                    while True:
                        last = pipe.recv()
                except EOFError:
                    pipe.close()
                try:
                    target = path.with_name(f"{path.name}_back")
                    unsaid += not recover(path, target).damage
                    times = _stock(target)
                    lost = (last - times[-1]) * 1e-9
                except Exception:
                    unreadable += 1
                    continue
                max_lost = max(max_lost, lost)
                if delay < 1.0:
                    max_lost_early = max(max_lost_early, lost / delay)
    metrics = [
        Metric("killed", number),
        Metric("bags not readable after recover", unreadable, "", 0, MAX),
        Metric("recovered without a word on the loss", unsaid, "", 0, MAX),
        Metric("most lost", max_lost, "s", 1.25, MAX),  # a second, and the poll of a loaded machine
        Metric("most lost of a bag below 1 s, over its length", max_lost_early, "", 1.0, MAX),
    ]
    return Found(metrics)


def _record_for_ever(pipe, path: Path) -> None:
    rng = np.random.default_rng(7)
    recorder = Recorder(path)
    for k in range(10**9):
        now = time.time_ns()
        recorder.put(TOPIC, IMU, now, imu(k, rng))
        if k % 5 == 0:
            pipe.send(now)
        time.sleep(0.01)


@stress("places that cannot be written to: existing, read-only, too long", "one line with the reason, nothing harmed")
def wrong_places(quick: bool) -> Found:
    """I14: places that cannot be written to: existing, read-only, a file, a link, too long."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        folder.chmod(0o755)
        BagWriter(folder / "there").close()
        (folder / "file").write_text("x")
        (folder / "link").symlink_to(folder / "nowhere")
        (folder / "locked").mkdir(mode=0o555)
        places = {
            "exists already": [folder / "there", folder / "file", folder / "link"],
            "cannot be made": [folder / ("n" * 5000), folder / "file" / "x", Path("/proc/x/y"), folder / "a\0b"],
        }
        wrong = [
            f"{str(p)[-20:]!r}: {t[:80]}" for word, of in places.items() for p in of if word not in (t := _made(p))
        ]
        locked = apart(_as_nobody, folder / "locked" / "run")
        if "Permission denied" not in locked:
            wrong.append(f"locked: {locked}")
    return Found([Metric("places not refused with their reason", len(wrong), "", 0, MAX)], wrong)


def _made(path: Path) -> str:
    try:
        BagWriter(path).close()
    except BagError as error:
        return str(error) if "\n" not in str(error) and len(str(error)) < 600 else "not one line"
    return "made"


def _as_nobody(path: Path) -> str:
    if os.getuid() == 0:
        os.setuid(65534)  # the superuser may write anywhere
    return f"{_made(path)}; {root_problem(str(path.parent), 0)}"


@stress("three times the rate that the disk takes", "accepted = written + dropped exactly; what is to be kept is kept")
def accounting(quick: bool) -> Found:
    """I16: three times the rate that the disk takes, some of the messages to be kept."""
    seconds = 1.5 if quick else 20.0
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "run"
        stats, accepted, kept = apart(_record_fast, path, seconds)
        messages, damage, error = read(path)
    numbers = [int.from_bytes(m.data[4:12], "little") for m in messages]
    metrics = [
        Metric("accepted - written - dropped", accepted - stats.written - stats.dropped, "", 0, IS),
        Metric("in the bag - written", len(messages) - stats.written, "", 0, IS),
        Metric("dropped of those to be kept", stats.kept_dropped, "", 0, IS),
        Metric("missing of those to be kept", kept - sum(k % 50 == 0 for k in numbers), "", 0, IS),
        Metric("damaged", bool(damage) or bool(error), "", False, IS),
        Metric("dropped over accepted", stats.dropped / accepted),
    ]
    return Found(metrics)


def _record_fast(path: Path, seconds: float) -> tuple[RecorderStats, int, int]:
    """Counts, messages put, those of them to be kept. The disk takes a third of the rate."""
    rng = np.random.default_rng(7)
    recorder = Recorder(path, queue_size=200)
    add = recorder.writer.add

    def slow(*message) -> None:
        time.sleep(1.0 / RATE)
        add(*message)

    recorder.writer.add = slow  # type: ignore[method-assign]
    begun, k, kept = time.monotonic(), 0, 0
    while time.monotonic() - begun < seconds:
        for _ in range(33):
            keep = k % 50 == 0
            recorder.put(TOPIC, IMU, k, imu(k, rng), keep=keep)
            kept += keep
            k += 1
        time.sleep(0.01)
    return recorder.close(timeout=60.0), k, kept


@stress(
    "10 000 names of recordings; recording on and off 2000 times",
    "none leaves the root, none grows, each refusal says why",
)
def names(quick: bool) -> Found:
    """S1: names of recordings: paths, links, control characters, 5000 characters, and 10 000 made-up ones."""
    rng = np.random.default_rng(2)
    bad = [".", "..", "/", "/tmp/x", "a/b", "../x", "a\\b", "~", "a b", "a\n", "\0", "a\0", "é", "$HOME", "-."]
    bad += ["x" * 65, "x" * 5000]
    letters = [chr(c) for c in (*range(1, 128), 0xE9, 0x202E, 0x1F600)]
    made_up = ["".join(rng.choice(letters, rng.integers(1, 8))) for _ in range(1000 if quick else 10_000)]
    plain = set("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-")
    taken = [n for n in bad + made_up if not set(n) <= plain and not name_problem("recording.path", n)]
    good = ["a", "A-b_9", "x" * MAX_NAME, "-", "tow_20260101_000000"]
    refused = [n for n in good + [m for m in made_up if set(m) <= plain] if name_problem("recording.path", n)]
    unsaid = [n for n in bad if not all(word in name_problem("recording.path", n) for word in ("path'", "A-Z", "root"))]
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch) / "root"
        places, files, threads = Names(str(root)), len(os.listdir("/proc/self/fd")), threading.active_count()
        begun, toggles = time.perf_counter(), 100 if quick else 1000
        for _ in range(toggles):
            for wanted in ("", "x" * MAX_NAME):
                with Recorder(places.next(wanted)) as recorder:
                    places.made()
                    recorder.put(TOPIC, IMU, 1, b"")
        spent = time.perf_counter() - begun
        opened = len(os.listdir("/proc/self/fd")) - files + threading.active_count() - threads
        found = [path.name for path in root.iterdir()]
        outside = [path.name for path in Path(scratch).iterdir() if path != root]
    metrics = [
        Metric("names taken that are none", len(taken), "", 0, MAX),
        Metric("refusals without key, rule and remedy", len(unsaid), "", 0, MAX),
        Metric("names refused that are some", len(refused), "", 0, MAX),
        Metric("made outside of the root", len(outside), "", 0, MAX),
        Metric("longest name made", max(map(len, found)), "characters", MAX_NAME, MAX),
        Metric("recordings missing of those made", 2 * toggles - len(found), "", 0, IS),
        Metric("time of a recording begun and ended", spent / toggles / 2, "s", 0.2, MAX),
        Metric("files and threads left open", opened, "", 0, MAX),
    ]
    return Found(metrics, [repr(n) for n in taken + refused + unsaid])
