"""A look at the beginning of a bag before anything is simulated: motion that nothing can be made of is refused.

A node learns within seconds that its sensors speak in other axes, and stops using them. A bag is known as a whole, so
the run says so at once instead of a tow whose ship lies still.
"""

from __future__ import annotations

from ..io.messages.fault_hypotheses import DOUBTS
from ..io.motion.arrival_order import Intake, Took
from ..io.motion.motion import TOPICS, MotionIngest
from ..io.sources.motion_table import MotionError
from ..io.sources.recorded_tow import RecordedTow
from ..physics.heave_filter import Convention, Heave, MotionInput
from ..physics.inputs import make_inputs
from ..sim.scene import Scene
from ..sim.verdict import Reason, refused_motion

GLANCE, LOOK = 1.0, 20.0  # s of motion: where the first convicts nobody, the rest is not looked at
MAX = 20_000  # messages
NED = ("motion_ned", "gravity_sign", "attitude_ned", "heave_sign")


def look(tow: RecordedTow, scene: Scene, motion: MotionInput, heave: Heave) -> None:
    """Raise MotionError where every source of motion stands convicted after the first LOOK seconds; note which do."""
    intake, received = Intake(make_inputs(), scene, motion, heave), dict[str, int]()
    for event in tow.events[:MAX]:
        if not event.is_motion:
            continue
        after = (event.time - tow.start) * 1e-9
        if intake.motion(event) is Took.JUMPED:
            return
        received[event.kind] = received.get(event.kind, 0) + 1
        if after > LOOK or (after > GLANCE and not any(intake.ingest.convicted.values())):
            break
    found = {TOPICS[kind]: intake.ingest.convicted[TOPICS[kind]] for kind in received}
    if not found or not all(found.values()):
        tow.unfit = {kind for kind in received if found[TOPICS[kind]]}
        return
    said = "; ".join(f"{topic} ({cause}): {DOUBTS[cause]}" for topic, cause in found.items())
    remedy = ""
    if set(found.values()) & set(NED) and motion.convention is Convention.ENU:
        remedy = " Is it in NED axes? Then give --convention ned."
    if "gravity_sign" in found.values() and not motion.force_reversed:
        remedy += " Does the driver send gravity for specific force? Then --set motion.force_reversed=true."
    raise MotionError(
        f"{tow.path}: none of the ship's motion can be used. {said}. Nothing was simulated: it would be a tow on its "
        f"mean track.{remedy} See the causes in docs/motion.md"
    )


def doubts(ingest: MotionIngest, length: float) -> tuple[Reason, ...]:
    """Reasons that refused sources of motion give to the verdict; length: of the motion, s."""
    return refused_motion(ingest.refusals(), length)
