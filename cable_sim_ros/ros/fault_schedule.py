"""A scenario of faults in the node: parameters that it sets by itself at times of the run, in real time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..io.scenes.fault_plan import FaultError, TimedFault, load_faults, timed
from ..sim.live_parameters import changed, unacting, unfit
from ..sim.scene import Scene
from ..terminal import clean
from .blocks import NodeBlock, TimeMode

if TYPE_CHECKING:
    from rclpy.node import Node

KEY = "faults_file"


def schedule_of(path: str, scene: Scene, lockstep: bool) -> tuple[list[TimedFault], str]:
    """Parameters of a scenario's file by time, and "" or why it cannot be; no file: none."""
    if not path:
        return [], ""
    if lockstep:
        return [], (
            f"parameter '{KEY}' = '{path}': faults by wall time would fall on other ticks in each run in lockstep; "
            "nothing was started. Set the faults.* parameters between two steps"
        )
    try:
        rows = timed(load_faults(path))
    except FaultError as error:
        return [], f"parameter '{KEY}': {error}"
    if text := unacting(scene, [(int(row.time / scene.solver.tick + 1e-9), row) for row in rows]):
        return [], f"parameter '{KEY}': {text.replace('nothing was changed', 'nothing was started')}"
    for row in rows:
        scene = changed(scene, row.key, row.value)
        if row.key.endswith(".kind") and (text := unfit(scene)):
            return [], f"parameter '{KEY}': {row.where}: {text.replace('nothing was changed', 'nothing was started')}"
    return rows, ""


class FaultSchedule:
    """What of a scenario is due; it begins anew with each start of the simulation."""

    def __init__(self, node: NodeBlock, scene: Scene) -> None:
        """node: parameters that are checked, so that the file can be used."""
        self._rows, _ = schedule_of(node.faults_file, scene, node.time_mode is TimeMode.LOCKSTEP)
        self._next, self._seconds = 0, -1.0

    def due(self, seconds: float) -> list[TimedFault]:
        """What has come due; seconds: of the run. A value that another of its key follows acts for a tick at least:
        the other is due when asked again after it."""
        if seconds < self._seconds:
            self._next = 0
        elif seconds == self._seconds:
            return []
        self._seconds, found = seconds, list[TimedFault]()
        for row in self._rows[self._next :]:
            if row.time > seconds or any(one.key == row.key and one.time < row.time for one in found):
                break
            found.append(row)
        self._next += len(found)
        return found

    def follow(self, node: Node, session: Any) -> None:
        """session: Session. Set the parameters of the node that have come due; call it often."""
        from rclpy.parameter import Parameter

        if not self._rows or session.loop is None or session.state != "running":
            return
        rows = self.due(session.loop.count * session.scene.solver.tick)
        for row, result in zip(rows, node.set_parameters([Parameter(row.key, value=row.value) for row in rows])):
            if not result.successful:
                node.get_logger().error(clean(f"{row.where}: {result.reason}"))
