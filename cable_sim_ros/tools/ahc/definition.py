"""What ahc-1 is: scenes, motions, classes and how figures are taken. Declared here alone; a change is another version.

Values are those of full scale. A scene of another scale takes them by Froude's law: lengths times `scale`, times and
velocities times its root; `DIMENSIONS` says which power of `scale` a key goes with.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from fnmatch import fnmatch
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from ...files import read_text
from ...io.scenes.document import share_folder
from ...io.scenes.yaml12 import parse
from ...terminal import markdown_table

VERSION = "ahc-1"
DURATION, START_UP = 120.0, 20.0  # s simulated, and of it left out of the figures
CONTROL = 0.02  # s between two commands of an external controller
BAND = 0.03, 0.6  # Hz, of the waves: decoupling and depth are taken in it
SLACK = (
    0.1  # of the twin's mean: a tension below it is slack, a snap is its way back to the mean; a contact load: lifted
)
TOLERANCE = 1e-3  # of a figure, within which another machine has to repeat it
DIGITS = 6  # of a figure in files
NOTHING: Mapping[str, Any] = MappingProxyType({})
Values = Mapping[str, Any]  # dotted key of the scene -> value
LENGTH, TIME = 1.0, 0.5  # powers of the scale


class Place(NamedTuple):
    """A scene: name, the shipped scene that it is made of, other values of it, values of its limited drive, scale.

    waves: do those of the sea act on the cable? A deep cable feels none of them below some tens of metres, and its
    mesh is too long for them: there the sea moves the ship alone.
    """

    name: str
    base: str
    what: str
    values: Values
    drive: Values
    scale: float = 1.0
    waves: bool = True


class Motion(NamedTuple):
    """Ship motion: a recorded ship about its mean track, or, with values, the simple hull in a sea."""

    name: str
    what: str
    bag: str = ""
    begin: float = 0.0  # s of the bag that are left out
    values: Values = NOTHING


class Class(NamedTuple):
    """What the compensator has to live with.

    values: of the scene; changes: live values at times [s]; gaps: of the motion input, begin and end [s]; fault: begin
    and end [s] of what overshoot and time to safe state count from; twin: class of the held winch beside it.
    """

    name: str
    what: str
    values: Values = NOTHING
    changes: tuple[tuple[float, str, Any], ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()
    fault: tuple[float, float] | None = None
    drive: bool = False  # the limited drive of the scene
    twin: str = "ideal"
    expected: tuple[str, ...] = ()  # flags that belong to the class and make no run doubtful
    scenes: tuple[str, ...] = ("*",)
    motions: tuple[str, ...] = ("*",)


class Cell(NamedTuple):
    """One run of an entrant."""

    scene: str
    motion: str
    condition: str  # name of the class

    def __str__(self) -> str:
        return "/".join(self)


def _motor(inertia: float, pull: float, rate: float, acceleration: float, power: float | None) -> dict[str, Any]:
    """A motor of 6 rad/s with 80 ms of dead time and this pull [N] up to this rate [m/s], three quarters of it at twice
    the rate. There it still has more than the tow: one that runs away is not what is compared."""
    return {
        "drive.model": "motor",
        "drive.inertia": inertia,
        "drive.curve_speed": [0.0, rate, 2.0 * rate],
        "drive.curve_pull": [pull, pull, 0.75 * pull],
        "drive.max_power": power,
        "drive.brake_pull": 2.0 * pull,
        "drive.bandwidth": 6.0,
        "drive.dead_time": 0.08,
        "winch.max_rate": rate,
        "winch.max_acceleration": acceleration,
    }


SCENES = (
    Place(
        "full_scale",
        "full_scale",
        "towbody of 250 kg on 450 m, 2.2 m/s",
        {"solver.tick": 0.01},
        _motor(180.0, 6.4e3, 0.6, 0.5, 4e3),
    ),
    Place(
        "flume",
        "flume",
        "sphere of 10 mm on 1 m, in a stream of 0.33 m/s, scale 1:50",
        {
            "solver.tick": 0.002,
            "winch.max_rate": 0.7,
            "winch.proportional_gain": 12500.0,  # of full scale's: those of the scene lag by 9 % of a wave
            "winch.derivative_gain": 354.0,
            "setpoint.washout_period": 42.4,
            "setpoint.angle_filter_time": 0.71,
            "setpoint.transfer_time": 1.41,
            "setpoint.max_excess": 0.02,
            "setpoint.max_amplitude": 0.4,
            "ship.start_blend": 1.41,
            "ship.source_blend": 0.283,
            "ship.stale_decay": 0.424,
            "ship.stale_after": 0.0707,
            "ship.max_gap": 0.212,
        },
        _motor(2e-5, 0.02, 0.14, 0.8, None),
        0.02,
    ),
    Place(
        "lowered",
        "lowered_ctd",
        "rosette of 400 kg lowered to 1500 m, 0.1 m/s",
        {"solver.tick": 0.01},
        _motor(400.0, 1.6e4, 1.2, 1.0, 2.2e4),
        waves=False,
    ),
    Place(
        "deep",
        "side_scan",
        "body of 1 t on 6 km of 17.3 mm, 0.8 m/s",
        {
            "name": "deep_tow",
            "solver.tick": 0.01,
            "ship.tow_speed": 0.8,
            "cable.diameter": 0.0173,
            "cable.mass_per_length": 1.16,
            "cable.axial_stiffness": 20.3e6,
            "cable.bending_stiffness": 12.5,
            "cable.axial_damping": 927.0,
            "cable.bending_damping": 5.7e-4,
            "cable.sections.armoured.length": 6400.0,
            "winch.scope": 6000.0,
            "winch.drum_radius": 0.6,
            "sheave.radius": 0.5,
            "contact.working_tension": 6e4,
            "towbody.mass": 1000.0,
            "towbody.net_weight": 7000.0,
            "towbody.added_mass": [100.0, 800.0, 800.0],
            "towbody.drag_area": [0.4, 1.5, 1.5],
        },
        _motor(3600.0, 1e5, 1.0, 0.8, 1.2e5),
        waves=False,
    ),
)


def _sea(height: float, period: float, seed: int) -> dict[str, Any]:
    """Head sea, short-crested."""
    return {
        "water.waves.kind": "jonswap",
        "water.waves.height": height,
        "water.waves.period": period,
        "water.waves.towards_deg": 180.0,
        "water.waves.frame": "heading",
        "water.waves.spreading": 10.0,
        "water.waves.components": 40,
        "water.waves.seed": seed,
        "water.ramp": START_UP,
    }


HULL = {"length": 76.0, "beam": 15.0, "draft": 5.0}  # m, of the simple hull that the seas move
MOTIONS = (
    Motion("nbp1406", "recorded, heave of 1.1 m deviation", "nbp1406", 20.0),
    Motion("lmg1903", "recorded, calm", "lmg1903", 20.0),
    Motion("sea_2m", "JONSWAP, Hs 2 m, Tp 8 s", values=_sea(2.0, 8.0, 20140801)),
    Motion("sea_4m", "JONSWAP, Hs 4 m, Tp 10 s", values=_sea(4.0, 10.0, 20190326)),
)

FAULT = 50.0, 80.0  # s
ABOARD = ("mru", "encoder", "metering_sheave", "load_pin", "usbl", "depth")
MEASURED = {"instruments.feed": "instruments", **{f"instruments.{name}.on": True for name in ABOARD}}
SOME, ONE = ("full_scale", "lowered"), ("nbp1406",)  # scenes and motions of what has to do with instruments


def _faulty(target: str, kind: str, size: float, what: str) -> Class:
    """A class with a fault of a sensor, the drive or the command path over FAULT."""
    key = f"faults.{target}"
    begins = ((FAULT[0], f"{key}.size", size),) if size else ()
    changes = (*begins, (FAULT[0], f"{key}.kind", kind), (FAULT[1], f"{key}.kind", "none"))
    return Class(f"{target}_{kind}", what, MEASURED, changes, fault=FAULT, scenes=SOME, motions=ONE)


CLASSES = (
    Class("ideal", "ideal winch, the controller sees the truth"),
    *(
        Class(f"dead_{ms}", f"dead time of the drive, {ms} ms", {"drive.dead_time": 1e-3 * ms})
        for ms in (50, 100, 200, 400)
    ),
    Class("limited", "motor of the scene: curve, power, rate, acceleration", drive=True, expected=("WINCH_SATURATED",)),
    Class(
        "dropouts",
        "no motion input for 0.4 s, later for 4 s: the ship itself goes to its mean track",
        gaps=((40.0, 40.4), (60.0, 64.0)),
        fault=(60.0, 64.0),
        twin="dropouts",
        expected=("MOTION_STALE",),
    ),
    Class("measured", "instruments in place of the truth, without a fault", MEASURED, scenes=SOME, motions=ONE),
    _faulty("mru_heave", "frozen", 0.0, "heave stands still"),
    _faulty("mru_heave", "bias", 0.5, "heave 0.5 m off"),
    _faulty("mru_heave", "drift", 0.05, "heave drifts by 0.05 m/s"),
    _faulty("mru_heave", "noise", 0.1, "noise of 0.1 m on the heave"),
    _faulty("mru_heave", "late", 0.3, "heave 0.3 s late"),
    _faulty("mru_heave", "lost", 0.0, "no heave"),
    _faulty("mru_pitch", "frozen", 0.0, "pitch stands still"),
    _faulty("mru_roll", "frozen", 0.0, "roll stands still"),
    _faulty("encoder", "frozen", 0.0, "encoder stands still"),
    _faulty("encoder", "bias", 0.5, "encoder 0.5 m off"),
    _faulty("metering_sheave", "frozen", 0.0, "metering sheave stands still"),
    _faulty("load_pin", "frozen", 0.0, "load pin stands still"),
    _faulty("usbl", "lost", 0.0, "no fix of the towbody"),
    _faulty("depth", "lost", 0.0, "no depth"),
    _faulty("drive", "frozen", 0.0, "drive stands still"),
    _faulty("command", "lost", 0.0, "no command reaches the winch"),
)

# The track for prediction: what an MRU gives in place of the truth, dead times, a second set of seeds. Its cells are
# beside those of VERSION and have a definition of their own.
MRU = "ahc-1-mru"
HEARD_CONTROL = 0.05  # s between two commands there
HEARING = {  # noise and lag of a good MRU, a choice; its high-pass is 0.15 rad ahead at 10 s
    "instruments.feed": "instruments",
    "instruments.mru.on": True,
    "instruments.mru.latency": 0.04,
    "instruments.mru.heave_period": 100.0,
    "instruments.mru.heave_noise": 0.002,
    "instruments.mru.velocity_noise": 0.005,
    "instruments.mru.angle_noise": 1e-4,
}
SECOND = (
    Motion("sea_2m_b", "sea_2m with a second seed", values=_sea(2.0, 8.0, 20270115)),
    Motion("sea_4m_b", "sea_4m with a second seed", values=_sea(4.0, 10.0, 20270116)),
)
HEARD_MOTIONS = ("nbp1406", "sea_2m", "sea_4m", "sea_2m_b", "sea_4m_b")
HEARD_SCENES = ("full_scale", "lowered", "deep")
HEARD = tuple(
    Class(
        f"heard_{ms}",
        f"an MRU of noise and lag, dead time of the drive, {ms} ms",
        {**HEARING, "drive.dead_time": 1e-3 * ms},
        twin=f"heard_{ms}",
        scenes=HEARD_SCENES,
        motions=HEARD_MOTIONS,
    )
    for ms in (100, 200, 400)
)
# `sealed` of a scene with its seeds and a salt, which a later version opens: nobody tunes to it before
HELD_OUT = "ac400058d407aff9628f308756b06ae70d36c178bd794fba03adf3a7dea8b77b"

DIMENSIONS = {  # power of the scale of a value by its key; keys that are not here have none, or stand with their scene
    "drive.dead_time": TIME,
    "drive.bandwidth": -TIME,
    "winch.command_timeout": TIME,
    "water.waves.height": LENGTH,
    "water.waves.period": TIME,
    "water.ramp": TIME,
}
TWIN = "hold"  # the law of the winch that is held
QUICK = ("full_scale/nbp1406/ideal", "full_scale/nbp1406/dead_200", "lowered/nbp1406/ideal")
QUICK_DURATION, QUICK_START_UP = 20.0, 8.0  # s


def place(name: str) -> Place:
    """A scene by its name."""
    return next(one for one in SCENES if one.name == name)


def motion(name: str) -> Motion:
    """A motion by its name."""
    return next(one for one in (*MOTIONS, *SECOND) if one.name == name)


def condition(name: str) -> Class:
    """A class by its name."""
    return next(one for one in (*CLASSES, *HEARD) if one.name == name)


def version_of(cell: Cell) -> str:
    """The track that a cell belongs to."""
    return MRU if any(one.name == cell.condition for one in HEARD) else VERSION


def cells(patterns: tuple[str, ...] = ("*",), version: str = VERSION) -> list[Cell]:
    """Every cell of a track that one of the patterns of SCENE/MOTION/CLASS fits, in order."""
    return [cell for cell in _all(version) if any(fnmatch(str(cell), pattern) for pattern in patterns)]


def _all(version: str) -> Iterator[Cell]:
    for at in SCENES:
        for moved in MOTIONS if version == VERSION else (*MOTIONS, *SECOND):
            for one in CLASSES if version == VERSION else HEARD:
                if _among(at.name, one.scenes) and _among(moved.name, one.motions):
                    yield Cell(at.name, moved.name, one.name)


def _among(name: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatch(name, pattern) for pattern in patterns)


def seed(name: str) -> int | None:
    """Seed of a motion; None of a recorded one, which needs none."""
    return motion(name).values.get("water.waves.seed")


def scaled(values: Values, scale: float) -> dict[str, Any]:
    """Values of full scale in a scene of another scale."""
    return {
        key: value * scale ** DIMENSIONS[key] if scale != 1.0 and key in DIMENSIONS else value
        for key, value in values.items()
    }


def scene_file(at: Place) -> Path:
    """The shipped scene, whatever lies in the working folder."""
    return share_folder() / "config" / f"{at.base}.yaml"


def bag_of(moved: Motion) -> Path:
    """The shipped bag."""
    return share_folder() / "bags" / moved.bag


def digest(version: str = VERSION) -> str:
    """Twelve letters that say which definition a result belongs to, with what stands in its shipped scenes."""
    data: list[Any] = [
        VERSION,
        *(parse(read_text(scene_file(at)))[0] for at in SCENES),
        *(DURATION, START_UP, CONTROL, BAND, SLACK, HULL, DIMENSIONS),
        *([one._asdict() for one in table] for table in (SCENES, MOTIONS, CLASSES)),
    ]
    if version == MRU:
        data += [MRU, HEARD_CONTROL, HELD_OUT, *([one._asdict() for one in table] for table in (SECOND, HEARD))]
    return hashlib.sha256(json.dumps(data, default=dict, sort_keys=True).encode()).hexdigest()[:12]


def sealed(text: str) -> str:
    """SHA-256 of the data of a YAML text, whatever its layout: what HELD_OUT is of its file. Raises YamlError."""
    return hashlib.sha256(json.dumps(parse(text)[0], sort_keys=True).encode()).hexdigest()


def markdown() -> str:
    """The definition as tables, for docs/ahc.md."""
    parts: list[tuple[str, ...]] = [
        ("scene", "what it is", "shipped scene", "scale", "tick [ms]", "waves on the cable")
    ]
    drives: list[tuple[str, ...]] = [("limited drive of", *(name for name, _ in OF_DRIVE))]
    for at in SCENES:
        tick, waves = 1e3 * at.values["solver.tick"], "yes" if at.waves else "no"
        parts.append((f"`{at.name}`", at.what, f"`{at.base}`", f"{at.scale:g}", f"{tick:g}", waves))
        drives.append((f"`{at.name}`", *(_said(at.drive[key]) for _, key in OF_DRIVE)))
    moved: list[tuple[str, ...]] = [
        ("motion", "what it is", "seed"),
        *((f"`{m.name}`", m.what, str(seed(m.name) or "-")) for m in (*MOTIONS, *SECOND)),
    ]
    classes: list[tuple[str, ...]] = [("class", "what it is", "scenes and motions", "fault [s]")]
    first: dict[tuple[str, ...], str] = {("*", "*"): "all"}
    for one in (*CLASSES, *HEARD):
        among = *one.scenes, *one.motions
        where = first.get(among, ", ".join(among))
        first.setdefault(among, f"as `{one.name}`")
        when = "-" if one.fault is None else f"{one.fault[0]:g} to {one.fault[1]:g}"
        classes.append((f"`{one.name}`", one.what, where, when))
    return "\n\n".join(markdown_table(rows) for rows in (parts, moved, drives, classes))


OF_DRIVE = (  # of the limited drive, for the page
    ("inertia [kg m²]", "drive.inertia"),
    ("pull [N]", "drive.curve_pull"),
    ("at [m/s]", "drive.curve_speed"),
    ("power [W]", "drive.max_power"),
    ("rate [m/s]", "winch.max_rate"),
    ("acceleration [m/s²]", "winch.max_acceleration"),
)


def _said(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(f"{one:g}" for one in value)
    return "-" if value is None else f"{value:g}"
