"""Where a run takes its ship motion from (a bag, a table, a heave, a plan, a sea); a replay its scene.

A look at the beginning of a bag before anything is simulated: motion that nothing can be made of is refused.

A node learns within seconds that its sensors speak in other axes, and stops using them. A bag is known as a whole, so
the run says so at once instead of a tow whose ship lies still.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..io.bags.bag_writer import BagError
from ..io.messages.fault_hypotheses import DOUBTS
from ..io.motion.arrival_order import Intake, Took
from ..io.motion.motion import TOPICS
from ..io.scenes.document import find_bag
from ..io.scenes.load import SceneWarning, load_scene, override, scene_from_text
from ..io.scenes.ship_plan import ShipPlan
from ..io.sources.coarse_bag import smooth_odometry
from ..io.sources.motion_table import MotionError, planned, read_table, sine_heave
from ..io.sources.recorded_tow import RecordedTow, at_speed, kept_in, read_tow, take_provenance
from ..io.sources.sea_motion import sea_motion
from ..io.sources.vehicle_motion import Pose, at_rest, with_vehicle
from ..physics.heave_filter import Convention, Heave, MotionInput
from ..physics.inputs import EPOCH, MOTION_ROWS, SOURCE, make_inputs
from ..physics.integrate import TOLERANCE
from ..physics.tick_output import Source
from ..sim.inputs import ShipMotion
from ..sim.layout import layout_of
from ..sim.scene import Scene
from ..sim.tables.attitude import body_rates
from .settings import NOTHING, Settings, apply_to_bag, apply_to_scene, recorded_intake, refuse_without_bag

GLANCE, LOOK = 1.0, 20.0  # s of motion: where the first convicts nobody, the rest is not looked at
MAX = 20_000  # messages
NED = ("motion_ned", "gravity_sign", "attitude_ned", "heave_sign")

HEAVE_SECONDS = 60.0  # s of a run under a sinusoidal heave where no duration is given
PASSES, MIN_SPEED = 2.0, 0.5  # times the way of the cable out that a ship goes after its plan, at m/s at least
RAMPS = 3.0  # of water.ramp, of a run in the waves of the scene, where that is longer
ALONE = "water.waves.ship_motion = independent|.*while the ship does not rise with them"  # not of a ship in the waves


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
        f"mean track.{remedy} See docs/causes.md"
    )


def motion_of(
    scene: Scene,
    motion: str | os.PathLike | None,
    heave: tuple[float, float] | None,
    duration: float | None,
    imu_only: bool,
    settings: Settings = NOTHING,
    topics: Mapping[str, str] = NOTHING,
    rao: str | os.PathLike | None = None,
    ship: ShipPlan | None = None,
) -> RecordedTow | None:
    """Messages of the ship's motion, whatever they come from; None on the mean track."""
    table = motion if motion is not None and Path(motion).suffix.lower() == ".csv" else None
    if heave is not None and motion is not None:
        raise MotionError(f"heave and the motion '{motion}' were both given: nothing was simulated; give one of them")
    if rao is not None and (heave is not None or motion is not None):
        other = "heave" if motion is None else f"the motion '{motion}'"
        raise MotionError(f"rao and {other} were both given: nothing was simulated; give one of them")
    if imu_only and (table is not None or heave is not None or rao is not None):
        of = motion or ("--heave" if rao is None else "--rao")
        raise MotionError(f"{of} gives no IMU messages: nothing was simulated; leave --imu-only out")
    if ship is not None:
        ship.check(scene.ship)
    if ship is not None and (motion is not None or rao is not None):
        raise MotionError(
            f"a ship plan and {'the waves (rao)' if motion is None else f'the motion {motion!r}'} were both given, and "
            f"either says where the ship goes: nothing was simulated; give one of them. A plan goes with a heave alone"
        )
    if heave is not None or table is not None or motion is None:
        kind = "a table" if table else "--heave" if heave else "none" if rao is None else "--rao"
        refuse_without_bag(settings, topics, kind)
    if rao is not None:
        return sea_motion(rao, scene, seconds_of(heave, rao, scene) if duration is None else duration)
    if heave is not None:
        amplitude, period = heave
        return sine_heave(amplitude, period, HEAVE_SECONDS if duration is None else duration, scene.ship, ship)
    if ship is not None:
        return planned(ship, seconds_of(heave, rao, scene, ship) if duration is None else duration, scene.ship)
    if table is not None:
        return read_table(table, scene.ship, scene.sheave.position)
    if motion is None:
        return None
    tow = read_tow(find_bag(motion), imu_only=imu_only, topics=topics)
    apply_to_bag(tow, settings)
    tow.events = at_speed(tow.events, tow.about, scene.ship.tow_speed)
    look(tow, scene, *recorded_intake(tow))
    smooth_odometry(tow, scene.sheave.position)
    take_provenance(tow, scene.sheave.position)
    return tow


def beside_vehicle(
    tow: RecordedTow | None, vehicle: Pose | str | os.PathLike | None, scene: Scene, duration: float | None
) -> RecordedTow | None:
    """The motion of a ship, which may lie on its mean track, and that of a vehicle, if there is one."""
    if vehicle is None:
        return tow
    return with_vehicle(at_rest(scene, duration or HEAVE_SECONDS) if tow is None else tow, vehicle, scene)


def seconds_of(
    heave: tuple[float, float] | None, rao: str | os.PathLike | None, scene: Scene, ship: ShipPlan | None = None
) -> float:
    """Seconds of a run under a motion that has no end, where no duration is given; 0 for another motion.

    After a plan of the ship the towbody comes to where it was done, and the tow to rest.
    """
    if rao is not None:
        return max(HEAVE_SECONDS, RAMPS * scene.water.ramp)
    if ship is not None:
        speed = max([abs(one.value) for one in ship.items if not one.turns][-1:] or [abs(scene.ship.tow_speed)])
        return ship.last + max(HEAVE_SECONDS, PASSES * layout_of(scene).route.scope / max(speed, MIN_SPEED))
    return 0.0 if heave is None else HEAVE_SECONDS


@contextmanager
def in_the_sea(moved: bool) -> Iterator[None]:
    """Leave out the warnings of a scene that hold for a ship whose motion does not follow from the waves."""
    with warnings.catch_warnings():
        if moved:
            warnings.filterwarnings("ignore", f".*({ALONE})", SceneWarning)
        yield


def sea_motion_kept(tow: RecordedTow) -> dict[str, object]:
    """What a bag says of the motion by waves that it recorded; nothing of a bag of other motion."""
    return kept_in(tow.about, "rao") or {}


def notes_of(metrics: Mapping[str, Any], scene: Scene | None = None) -> tuple[str, ...]:
    """Notes for the verdict of a run: what was chosen for the motion of its ship, in the waves or in an import, and for
    the accuracy of its scene."""
    found: list[str] = []
    for key in ("rao", "imported"):
        notes = metrics.get(key, {}).get("notes", ())
        found += [str(note) for note in notes] if isinstance(notes, (list, tuple)) else []
    plan = None if scene is None or scene.solver.tolerance is not None else layout_of(scene).plan
    if scene is not None and plan is not None and plan.tolerance != TOLERANCE:
        found.append(
            f"forces are solved to {plan.tolerance:g} of contact.working_tension in place of {TOLERANCE:g} "
            f"(solver.tolerance), which accuracy.position = {scene.accuracy.position:g} m takes"
        )
    return tuple(found)


def scene_of_bag(
    tow: RecordedTow, scene: Scene | str | os.PathLike | None, algorithm: str | None, settings: Settings
) -> tuple[Scene, bool]:
    """The scene to replay, and whether the bag is to agree with it: not where it keeps another one."""
    text = tow.about.get("scene_yaml")
    own = scene_from_text(text, f"scene kept in {tow.path}") if text else None
    if scene is None and own is None:
        raise BagError(
            f"bag '{tow.path}' keeps no scene, so it is not known which tow it recorded: nothing was simulated; give "
            f"--scene NAME or FILE. For a run under its motion: cable-sim run SCENE --motion {tow.path}"
        )
    scene = as_set(own if scene is None else scene, settings, algorithm)
    return scene, own is None or scene == own


def as_set(scene: Scene | str | os.PathLike | None, settings: Settings, algorithm: str | None) -> Scene:
    """A scene, or that of a name or file, with settings and a set-point algorithm (None: its own) put in."""
    scene = apply_to_scene(scene if isinstance(scene, Scene) else load_scene(scene), settings)  # type: ignore[arg-type]
    return scene if algorithm is None else override(scene, {"setpoint.algorithm": algorithm})


def motion_of_bag(
    bag: str | os.PathLike,
    scene: Scene | str | os.PathLike,
    *,
    imu_only: bool = False,
    settings: Settings = NOTHING,
    topics: Mapping[str, str] = NOTHING,
) -> list[ShipMotion]:
    """The samples of ship motion that a run of ``scene`` under ``bag`` takes, in order of time.

    bag: a directory, an MCAP file, the name of a shipped bag, or a CSV table; scene: whose ship it is (height, speed,
    place of the sheave); imu_only, settings, topics: as of `run`. Each sample has its stamp [ns, of the messages],
    position [m] and velocity [m/s] of base_link in odom, roll, pitch, yaw [rad] and the angular velocity in
    base_link [rad/s]; `jump` is True where the motion does not go on from the sample before. Messages that a run
    refuses have no sample.

    Raises BagError, ResourceError, SceneError, and MotionError where no message can be used or where the clock of the
    stamps jumps: there is no one order of time then.
    """
    scene = scene if isinstance(scene, Scene) else load_scene(scene)
    tow = motion_of(scene, bag, None, None, imu_only, settings, topics)
    assert tow is not None  # for motion None alone
    inputs = make_inputs()
    intake = Intake(inputs, scene, *recorded_intake(tow))
    samples: list[ShipMotion] = []
    epoch = None
    for event in tow.events:
        if not event.is_motion:
            continue
        before = int(inputs.motion_head[0])
        if intake.motion(event) is Took.JUMPED:
            if samples:
                raise MotionError(
                    f"{tow.path}: the stamps jump from {samples[-1].time_ns} ns to {event.time} ns: no list of samples "
                    f"was made, its time would not go up. Cut the bag there, or simulate it with run(), which takes "
                    f"the tow over the jump"
                )
            intake.jump()  # the first stamps were odd
            continue
        for k in range(before, int(inputs.motion_head[0])):
            row = inputs.motion[k % MOTION_ROWS].tolist()
            samples.append(
                ShipMotion(
                    time_ns=int(inputs.motion_time[k % MOTION_ROWS]),
                    position=tuple(row[:3]),
                    velocity=tuple(row[6:9]),
                    attitude=tuple(row[3:6]),
                    rate=body_rates(row[3], row[4], row[9:12]),
                    source=Source(int(row[SOURCE])),
                    jump=epoch is not None and row[EPOCH] != epoch,
                )
            )
            epoch = row[EPOCH]
    if not samples:
        counts = ", ".join(f"{cause} {count}" for cause, count in intake.refusals().items()) or "none came"
        raise MotionError(
            f"{tow.path}: no message of the ship's motion can be used ({counts}): there are no samples. See "
            f"docs/causes.md"
        )
    return samples
