"""I10, S2, S3: bags that are cut off, flipped, no bags at all, or enormous."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np

from cable_sim_ros.io.recordings.recovery import recover

from .apart import apart
from .bags import chunks_of, giants, known_bag, max_memory, mcap_of, read
from .verdict import IS, MAX, Found, Metric, holds, stress

CUTS = 64


@stress("a bag cut off at 64 places; 1000 flipped bits", "whole chunks on both sides delivered, one line, <= 10 s")
def damaged(quick: bool) -> Found:
    """I10: a bag cut off at 64 places; 1000 flipped bits, in the file and in its metadata."""
    flips = 100 if quick else 1000
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        known_bag(folder / "whole", 1500)
        chunks = chunks_of(folder / "whole")
        whole = mcap_of(folder / "whole").read_bytes()
        metadata = (folder / "whole" / "metadata.yaml").read_bytes()
        bag = folder / "bag"
        bag.mkdir()
        count = {"failed": 0, "missing": 0, "unsaid": 0, "wrong": 0, "lines": 0}
        slowest = 0.0
        rng = np.random.default_rng(11)
        cuts = np.linspace(9, len(whole) - 1, CUTS).astype(int)
        bits = rng.integers(0, 8 * len(whole), flips)
        meta_bits = rng.integers(0, 8 * len(metadata), flips // 4)
        for kind, place in [("cut", c) for c in cuts] + [("flip", b) for b in bits] + [("meta", b) for b in meta_bits]:
            data, about = bytearray(whole), bytearray(metadata)
            if kind == "cut":
                del data[place:]
            else:
                (data if kind == "flip" else about)[place // 8] ^= 1 << (place % 8)
            (bag / "whole_0.mcap").write_bytes(data)
            (bag / "metadata.yaml").write_bytes(about)
            begun = time.process_time()
            try:
                messages, damage, error = read(bag)
            except Exception:  # a traceback for the user
                count["failed"] += 1
                continue
            slowest = max(slowest, time.process_time() - begun)
            untouched = [
                m
                for first, behind, inside in chunks
                for m in inside
                if kind == "meta" or (behind <= place if kind == "cut" else not first <= place // 8 < behind)
            ]
            everything = sum(len(inside) for *_, inside in chunks)
            got = {m.time: m.data for m in messages}
            count["missing"] += any(got.get(m.time) != m.data for m in untouched)
            count["wrong"] += any(got[m.time] != m.data for *_, inside in chunks for m in inside if m.time in got)
            count["unsaid"] += len(messages) < everything and not damage and not error
            count["lines"] += "\n" in str(damage) or "\n" in error
        back = _recovered(folder, whole, chunks, rng.integers(0, 8 * len(whole), 20))
    metrics = [
        Metric("tracebacks", count["failed"], "", 0, MAX),
        Metric("bags with an untouched chunk missing", count["missing"], "", 0, MAX),
        Metric("bags with a changed message", count["wrong"], "", 0, MAX),
        Metric("bags that lost a message without a word", count["unsaid"], "", 0, MAX),
        Metric("more than one line said", count["lines"], "", 0, MAX),
        Metric("recovered bags with an untouched chunk missing", back, "", 0, MAX),
        Metric("slowest read, CPU", slowest, "s", 10.0, MAX),
    ]
    return Found(metrics)


def _recovered(folder: Path, whole: bytes, chunks, bits) -> int:
    """Bags whose untouched chunks are not all in what `recover` makes of them."""
    missing = 0
    for number, bit in enumerate(bits):
        source, target = folder / f"flipped{number}.mcap", folder / f"back{number}"
        data = bytearray(whole)
        data[bit // 8] ^= 1 << (bit % 8)
        source.write_bytes(data)
        recover(source, target)
        times = {m.time for m in read(target)[0]}
        kept = (inside for first, behind, inside in chunks if not first <= bit // 8 < behind)
        missing += any(m.time not in times for inside in kept for m in inside)
        shutil.rmtree(target)
    return missing


@stress("paths that are no bags", "refused in one line, <= 10 s each")
def no_bags(quick: bool) -> Found:
    """S2: paths that are no bags: missing, special and looping files, 5000 characters, files outside of the bag."""
    outside, failed, slowest = 0, [], 0.0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        known_bag(folder / "secret", 10)
        (folder / "text").write_text("text")
        (folder / "empty.mcap").write_bytes(b"")
        os.mkfifo(folder / "fifo")
        (folder / "loop").symlink_to(folder / "loop")
        (folder / "directory").mkdir()
        trees = {
            "outward": "rosbag2_bagfile_information: {relative_file_paths: ['../secret/secret_0.mcap']}",
            "absolute": "rosbag2_bagfile_information: {relative_file_paths: [/etc/passwd]}",
            "typed": "rosbag2_bagfile_information: {relative_file_paths: 5}",
            "brackets": "[" * 20_000,
            "anchors": "a: &a [x, x]\n" + "".join(f"{b}: &{b} [*{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi")),
            "huge": "rosbag2_bagfile_information: " + "x" * 2_000_000,
        }
        for name, text in trees.items():
            (folder / name).mkdir()
            (folder / name / "metadata.yaml").write_text(text)
        (folder / "piped").mkdir()
        os.mkfifo(folder / "piped" / "x.mcap")
        names = ["", "missing", "text", "empty.mcap", "fifo", "loop", "directory", "n" * 5000, "a\0b", "piped", *trees]
        for path in [*(folder / name for name in names), Path("/dev/zero"), Path("/proc/self/mem"), Path(".." * 3000)]:
            begun = time.process_time()
            try:
                messages, _, error = read(path)
            except Exception as problem:  # a traceback for the user
                failed.append(f"{str(path)[-20:]!r}: {type(problem).__name__}")
                continue
            slowest = max(slowest, time.process_time() - begun)
            outside += bool(messages)
            if not error or "\n" in error or len(error) > 600:
                failed.append(f"{str(path)[-20:]!r}: {error[:80]!r}")
    metrics = [
        Metric("paths not refused in one line", len(failed), "", 0, MAX),
        Metric("messages from outside of the bag", outside, "", 0, MAX),
        Metric("slowest refusal, CPU", slowest, "s", 10.0, MAX),
    ]
    return Found(metrics, failed)


@stress("gigabytes in a bag: messages, chunks, lengths, zeros", "rest delivered; memory <= 1 GB, <= 10 s")
def enormous(quick: bool) -> Found:
    """S3: gigabytes in a bag: a message, a chunk, a length that leads nowhere, compressed and plain zeros."""
    metrics = []
    with tempfile.TemporaryDirectory() as scratch:
        for what, path in giants(Path(scratch)).items():
            messages, said, seconds, memory = apart(_read_giant, path)
            metrics += [
                Metric(f"{what}: messages of 200", messages, "", 200, IS),
                holds(f"{what}: said", said),
                Metric(f"{what}: memory", memory, "MB", 1000.0, MAX),
                Metric(f"{what}: CPU", seconds, "s", 10.0, MAX),
            ]
    return Found(metrics)


def _read_giant(path: Path) -> tuple[int, bool, float, float]:
    begun = time.process_time()
    messages, damage, error = read(path)
    return len(messages), bool(damage or error), time.process_time() - begun, max_memory()
