"""How long each topic of motion was refused for what its parts say of each other, and what was used in its place."""

from __future__ import annotations

from ..messages.messages import CAUSES

IMU, ODOMETRY = "imu/data", "odom"
TOPICS = {"imu": IMU, "odometry": ODOMETRY}  # by kind of message
LONGEST = 1.0  # s that one message stands for, at most


class Refusals:
    """One for both topics; what is counted outlives a jump of the clock."""

    def __init__(self) -> None:
        self._seconds: dict[str, dict[str, float]] = {IMU: {}, ODOMETRY: {}}  # by topic and cause
        self._newest: dict[str, int] = {}  # stamp of the newest message of a topic, refused or not, ns
        self._cause: dict[str, str] = {}  # of its refusal; "": it was taken

    def judged(self, topic: str, cause: str, stamp: int) -> None:
        """A message was held against itself and the others; cause: why it is refused, "" where it is not."""
        since = (stamp - self._newest.get(topic, stamp)) * 1e-9
        self._newest[topic], self._cause[topic] = stamp, cause
        if cause and since > 0.0:
            seconds = self._seconds[topic]
            seconds[cause] = seconds.get(cause, 0.0) + min(since, LONGEST)

    def refused(self, kind: str, cause: str) -> None:
        """A message of a kind was refused, for whatever cause."""
        self._cause[TOPICS.get(kind, kind)] = cause

    def why(self, kind: str) -> str:
        """Cause, and what to do, of the newest message of a kind where it was refused; "" where it was not."""
        cause = self._cause.get(TOPICS[kind], "")
        return f"{cause}: {CAUSES[cause]}" if cause else ""

    def report(self, witnessed: bool) -> list[tuple[str, float]]:
        """Text and seconds for each topic that was refused; witnessed: the odometry fits a refused IMU, which then
        casts no doubt on it."""
        found = []
        for topic, other in ((IMU, ODOMETRY), (ODOMETRY, IMU)):
            causes = self._seconds[topic]
            if not causes or (topic == IMU and other in self._newest and witnessed):
                continue
            cause = max(causes, key=lambda name: causes[name])
            found.append(
                (f"{topic} was refused ({cause}): {CAUSES[cause]}; {self._instead(other)}", sum(causes.values()))
            )
        return found

    def _instead(self, other: str) -> str:
        if other not in self._newest:
            return "nothing else came, so that the ship was on its mean track meanwhile"
        beside = sum(self._seconds[other].values())
        if beside:
            return f"{other} was refused too, for {beside:.3g} s"
        if other == IMU:
            return "imu/data alone gave the motion, about a mean track"
        return "odom was used, but could not be held against it: what is wrong with the one may be wrong with both"
