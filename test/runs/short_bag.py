"""The first seconds of the shipped motion in place of a whole bag, for tests to change."""

from functools import cache

from cable_sim_ros.io.messages.messages import Event
from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.sources.recorded_tow import RecordedTow, read_tow
from cable_sim_ros.runs import sources


@cache
def shipped(seconds: int) -> tuple[Event, ...]:
    tow = read_tow(find_bag("nbp1406"))
    return tuple(event for event in tow.events if event.time <= tow.start + seconds * 10**9)


def put_short_bag(monkeypatch, seconds: int, kinds=("imu", "odometry")) -> list[Event]:
    """What every bag that a run reads has from now on: these events, as the test leaves them."""
    events = [event for event in shipped(seconds) if event.kind in kinds]

    def read(path, *, imu_only=False, topics=None):
        return RecordedTow("nbp1406", [event for event in events if not (imu_only and event.kind == "odometry")])

    monkeypatch.setattr(sources, "read_tow", read)
    return events
