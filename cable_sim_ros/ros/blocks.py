"""What the node needs beside the scene: every number of its own, declared once as Blocks (physics/parameter.py)."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from ..io.messages.markers import MAX_RATE
from ..physics.heave_filter import Heave, MotionInput
from ..physics.parameter import Block, choice, quantity
from .parts import with_parts


class TimeMode(str, Enum):
    """Who drives the time."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"


class Realtime(Block):
    priority: int = quantity(40, "1", 0, 99, "SCHED_FIFO priority of the stepping loop; 0: off", "sched(7)")
    max_catchup: int = quantity(
        3, "1", 0, 100, "missed ticks that are run back to back; further behind, deadlines are skipped and counted"
    )
    max_lag: float = quantity(
        2.0,
        "s",
        0.1,
        5.0,
        "lag behind the motion at which the simulation is taken to the present, the cable as it hangs",
    )


class LockstepParameters(Block):
    rate: float = quantity(
        1.0,
        "1",
        0.0,
        1000.0,
        "simulated over wall time at most; 0: as fast as it goes; else 0.1 or more",
        configure=False,
    )
    paused: bool = choice(False, "begin paused: the clock stands at lockstep.start until ~/pause or ~/step")
    start: float = quantity(1.0, "s", 0.0, 1e9, "what /clock says before the first motion, whose stamp then decides")
    wait: float = quantity(
        1.0,
        "s",
        0.0,
        600.0,
        "wall time that a step waits for its motion, and for its command once a controller has spoken; then it goes on "
        "with the last ones, counted",
        configure=False,
    )
    command_period: float | None = quantity(
        None,
        "s",
        1e-4,
        60.0,
        "simulation time from one command to the next; given, each is waited for from the first tick on; none: as "
        "they come",
    )
    flap_period: float | None = quantity(
        None, "s", 1e-4, 60.0, "the same of flap commands, of which the first answers the first tick output"
    )
    chain_delay: float = quantity(
        0.0,
        "s",
        0.0,
        10.0,
        "by how much the stamps of commands lie behind the /clock at which they come, where the nodes between sample "
        "and command keep the stamp of the sample; 0: the last one stamps with /clock",
    )
    silent_after: int = quantity(
        5, "1", 1, 100_000, "commands missed in a row, after which a controller counts as silent: ERROR, not waited for"
    )
    steps: int = quantity(1, "1", 1, 1_000_000, "ticks of one call of ~/step", configure=False)


class RecordingParameters(Block):
    enabled: bool = choice(False, "record every input and output from activation on; ~/record does so while running")
    root: str = choice("recordings", "folder of all recordings, made with the first; relative to the working directory")
    path: str = choice(
        "",
        "name of the bag to make under recording.root: 1 to 64 of A-Z a-z 0-9 _ -; empty: tow_ with date and time. A "
        "second recording of one run gets _2, _3, ... behind the name",
        configure=False,
    )
    markers: bool = choice(
        False, "record cable/markers too; without, cable-sim replay BAG --markers 10 makes them again"
    )
    least_free: float = quantity(
        200.0, "MB", 0.0, 1e6, "free space of the disk below which no recording begins and one under way ends; 0: none"
    )


class Publish(Block):
    marker_rate: float = quantity(10.0, "Hz", 0.0, MAX_RATE, "rate of cable/markers, for RViz and Foxglove; 0: none")
    marker_tension: float | None = quantity(
        None,
        "N",
        1e-6,
        1e8,
        "tension at the top of the colours of cable/markers; none: 1.25 times contact.working_tension",
    )
    shape_rate: float = quantity(10.0, "Hz", 0.1, 1000.0, "rate of cable/shape")
    contact_rate: float = quantity(20.0, "Hz", 0.1, 1000.0, "rate of sheave/contact")
    state_rate: float = quantity(0.0, "Hz", 0.0, 1000.0, "rate of poses, tension and winch state; 0: every tick")


class Frames(Block):
    odom: str = choice("odom", "world frame: ENU, z up, z = 0 the mean water surface", "REP 105")
    base_link: str = choice("base_link", "ship frame: x forward, y left, z up", "REP 103")
    sheave_link: str = choice("sheave_link", "frame in the sheave centre, axes of the ship")
    towbody_link: str = choice("towbody_link", "frame of the towbody")
    vehicle_link: str = choice(
        "vehicle_link", "frame of the vehicle at the far end: x forward, y left, z up", "REP 103"
    )


class OwnBlock(Block):
    """What the node itself needs beside the scene."""

    scene: str = choice("full_scale", "scene: path of a YAML file or name of a shipped scene")
    autostart: bool = choice(True, "configure and activate at the start, without a manager")
    time_mode: TimeMode = choice(
        TimeMode.REALTIME,
        "realtime: the clock of the motion data, ticks when they are due; lockstep: simulation time drives, by /clock",
    )
    state_file: str = choice(
        "state",
        "name of the file under recording.root that ~/save writes and ~/restore reads: 1 to 64 of A-Z a-z 0-9 _ -; "
        ".npz is put behind it",
        configure=False,
    )
    input_delay: float = quantity(
        0.03,
        "s",
        0.0,
        1.0,
        "the simulation runs this far behind the clock of the motion data, so that each tick lies "
        "between samples; at least one and a half sample intervals",
    )
    statistics_file: str = choice(
        "",
        "JSON file with the state of the node, rewritten as it changes, with the final figures at the end; empty: none",
    )
    faults_file: str = choice("", "scenario of faults of the run, a YAML file; empty: none")
    realtime: Realtime = choice(Realtime(), "real-time loop")
    lockstep: LockstepParameters = choice(LockstepParameters(), "lockstep, where time_mode says so")
    recording: RecordingParameters = choice(RecordingParameters(), "recording")
    publish: Publish = choice(Publish(), "rates")
    frame: Frames = choice(Frames(), "frame names")
    motion: MotionInput = choice(MotionInput(), "motion messages")
    heave: Heave = choice(Heave(), "motion from the IMU alone")


if TYPE_CHECKING:
    NodeBlock = OwnBlock
else:
    NodeBlock = with_parts(OwnBlock)
"""What the node needs beside the scene, its parts included."""
