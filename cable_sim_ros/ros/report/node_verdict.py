"""How a node ended: the verdict on what it published, from counts and sums, for it keeps no tick outputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...sim.checks.deviation_checks import hauled_into_waves
from ...sim.checks.friction_checks import in_part
from ...sim.verdict import Verdict, check, judge_counts, of_node, overload, verdict_of
from ..publisher import TickPublisher
from ..session import Session


def verdict_of_node(session: Session, publisher: TickPublisher | None, metrics: Mapping[str, Any]) -> Verdict:
    """Verdict on a run that a node published; figures: its final ones. One that published nothing and did not fail is
    ok, unless motion came that it could not use."""
    scene, problem = session.scene, session.problem
    if publisher is None or publisher.latest is None:
        return verdict_of([check("HALTED", problem)] if problem else of_node(metrics))
    found = judge_counts(
        publisher.statuses,
        scene.solver.tick,
        int(publisher.latest["status"]),
        scene=scene,
        others=(
            *overload(scene, publisher.max_tension),
            *hauled_into_waves(scene, publisher.sums.least_scope),
            *in_part(scene, publisher.sums.slow_fraction),
            *of_node(metrics),
        ),
        problem=problem,
        slam=publisher.sums.max_slam,
    )
    known = {reason.flag for reason in found.reasons}
    return verdict_of([*found.reasons, *(more for more in publisher.sums.reasons() if more.flag not in known)])
