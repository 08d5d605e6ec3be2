"""Bags of known messages for the stress of reading and recording."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from cable_sim_ros.io.bags.bag import BagError, BagWriter, Damage, Message, read_bag
from cable_sim_ros.io.bags.mcap_file import HEAD, McapFile

IMU, TOPIC = "sensor_msgs/msg/Imu", "/tow_sim/imu/data"
SIZE = 348  # bytes of an Imu
CHUNK = 20_000  # bytes


def imu(number: int, rng: np.random.Generator) -> bytes:
    """Bytes of the size of an Imu that say which one it is."""
    return b"\0\1\0\0" + struct.pack("<q", number) + rng.bytes(SIZE - 12)


def known_bag(path: Path, count: int) -> None:
    """A bag of `count` messages, 10 ms apart, in chunks of 20 kB."""
    rng = np.random.default_rng(5)
    writer = BagWriter(path, chunk_size=CHUNK, custom_data={"scene": "made up"})
    for k in range(count):
        writer.add(TOPIC, IMU, k * 10_000_000, imu(k, rng))
    writer.close()


def chunks_of(path: Path) -> list[tuple[int, int, list[Message]]]:
    """(first byte, byte behind, messages) of the chunks of a whole bag."""
    with McapFile(mcap_of(path)) as file:
        return [
            (
                piece.offset,
                piece.offset + piece.size,
                [Message(TOPIC, IMU, raw.time, raw.data) for raw in file.messages(piece)],
            )
            for piece in file.pieces
        ]


def mcap_of(path: Path) -> Path:
    """The one MCAP file of a bag."""
    return next(path.glob("*.mcap"))


def read(path: Path) -> tuple[list[Message], Damage, str]:
    """Messages, damage, and the text of a BagError ("" = none). Any other exception is the reader's fault."""
    damage = Damage()
    try:
        return list(read_bag(path, damage)), damage, ""
    except BagError as error:
        return [], damage, str(error)


def giants(folder: Path) -> dict[str, Path]:
    """Bags of 200 messages with something enormous behind the third chunk; what -> bag."""
    import zstandard

    gigabyte = 1 << 30
    bomb = zstandard.compress(bytes(gigabyte >> 3)) * 8  # eight frames of 128 MB each

    def chunk(size: int) -> bytes:
        body = struct.pack("<QQQII", 0, 1, size, 0, 4) + b"zstd" + struct.pack("<Q", len(bomb)) + bomb
        return HEAD.pack(6, len(body)) + body

    middle: dict[str, tuple[bytes, int]] = {  # what: bytes, and a hole behind them
        "message of 1 GB": (HEAD.pack(5, gigabyte), gigabyte),
        "record of 4e18 bytes": (HEAD.pack(5, 1 << 62), gigabyte),
        "chunk of 1 GB": (HEAD.pack(6, gigabyte), gigabyte),
        "compressed gigabyte": (chunk(gigabyte), 0),
        "gigabyte said to be small": (chunk(1000), 0),
        "gigabyte of zeros": (b"", gigabyte),
    }
    made = {}
    for what, (head, hole) in middle.items():
        path = made[what] = folder / what.replace(" ", "_")
        known_bag(path, 200)
        cut, file = chunks_of(path)[3][0], mcap_of(path)
        whole = file.read_bytes()
        with open(file, "wb") as out:
            out.write(whole[:cut] + head)
            out.seek(hole, 1)
            out.write(whole[cut:])
    path = made["frame_id of 100 MB"] = folder / "frame_id"
    rng = np.random.default_rng(5)
    with BagWriter(path, chunk_size=CHUNK) as writer:
        for k in range(201):
            writer.add(TOPIC, IMU, k, bytes(100_000_000) if k == 100 else imu(k, rng))
            if k in (99, 100):
                writer.flush()
    return made


def max_memory() -> float:
    """Largest memory of this process so far [MB]."""
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1e3
