"""Ship motion and winch commands of a bag of any kind: rosbag2 (MCAP, SQLite) or a ROS 1 file."""

from __future__ import annotations

import os
from collections.abc import Iterator

from ..bags.bag import BagError, BagReader, Damage, report
from ..bags.mcap_file import size_text
from ..messages.messages import COMMANDS, KINDS, find_topics

MAX_INPUT = 1_000_000  # bytes; an Imu has 350, and a frame_id of megabytes is no name


def read_motion(
    path: str | os.PathLike, topics: dict[str, str] | None = None, damage: Damage | None = None
) -> Iterator[tuple[int, str, bytes]]:
    """(log time ns, kind, CDR bytes) of a bag.

    kind is one of KINDS; topics: kind -> name where the search by type and name is not to decide.
    Order: time, then topic (those of the winch commands as one), then order of recording. damage: as in `read_bag`;
    larger messages than MAX_INPUT are left out and counted there. BagError if the bag cannot be read or has no ship
    motion.
    """
    with BagReader(path) as reader:
        names = find_topics(reader.topics, topics)
        if not {"imu", "odometry"} & set(names):
            raise BagError(
                f"bag '{path}' has neither {KINDS['imu'][0]} nor {KINDS['odometry'][0]}: no ship motion "
                f"was read; record imu/data or odom"
            )
        kinds = {name: kind for kind, name in names.items()}
        winch = min((name for kind, name in names.items() if kind in COMMANDS), default="")
        place = {name: winch if kind in COMMANDS else name for name, kind in kinds.items()}
        same: list[tuple[str, bytes]] = []  # messages of one time
        now = 0
        for topic, _, time, data in reader.read(kinds):
            if len(data) > MAX_INPUT:
                reader.damage.refused += 1
                reader.damage.add(f"messages of '{topic}' above {size_text(MAX_INPUT)} are left out")
                continue
            if time != now:
                yield from ((now, kinds[name], item) for name, item in sorted(same, key=lambda pair: place[pair[0]]))
                same, now = [], time
            same.append((topic, data))
        yield from ((now, kinds[name], item) for name, item in sorted(same, key=lambda pair: place[pair[0]]))
        report(reader, damage)
