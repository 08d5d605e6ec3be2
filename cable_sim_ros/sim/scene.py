"""Scene: what a user writes. One YAML file, SI units, every number checked at load against its declaration."""

from __future__ import annotations

from ..physics.cable_assembly import Cable
from ..physics.contact import Contact
from ..physics.contact_surface import Seabed, Sheave
from ..physics.heave_compensation import Setpoint
from ..physics.integrate import Solver
from ..physics.parameter import REQUIRED, Block, choice, quantity
from ..physics.sensor_models import Faults, Instruments
from ..physics.ship import Ship
from ..physics.towbody import LineBody, Towbody
from ..physics.vehicle import Vehicle
from ..physics.viv_amplification import Viv
from ..physics.water import Water
from ..physics.winch import Winch
from ..physics.winch_drive import Drive
from ..physics.wind import Air
from .mesh_blocks import Accuracy, Mesh
from .rule_blocks import Rules


class Scene(Block):
    """A shipboard tow: cable from the drum over the sheave to the towbody."""

    name: str = choice(REQUIRED, "name of the scene")
    gravity: float = quantity(9.81, "m/s^2", 0.0, 30.0, "gravitational acceleration")
    ship: Ship = choice(Ship(), "ship")
    water: Water = choice(Water(), "water")
    air: Air = choice(Air(), "wind on what is above the water")
    cable: Cable = choice(REQUIRED, "cable")
    viv: Viv = choice(Viv(), "strumming of the cable, and the drag factor computed from it")
    winch: Winch = choice(REQUIRED, "winch")
    drive: Drive = choice(Drive(), "drive of the winch: what turns its drum")
    setpoint: Setpoint = choice(Setpoint(), "set-point of the winch")
    instruments: Instruments = choice(Instruments(), "instruments aboard, beside the truth")
    faults: Faults = choice(Faults(), "what is wrong with instruments, command path and drive")
    sheave: Sheave = choice(REQUIRED, "sheave")
    seabed: Seabed = choice(Seabed(), "seabed under the tow")
    contact: Contact = choice(Contact(), "contact of the cable with drum and sheave")
    towbody: Towbody = choice(REQUIRED, "towbody")
    vehicle: Vehicle = choice(Vehicle(), "vehicle at the far end, of towbody.model vehicle")
    bodies: dict[str, LineBody] = choice({}, "bodies on the line between drum and towbody")
    rules: Rules = choice(Rules(), "rules on watch, which change nothing of the tow")
    solver: Solver = choice(Solver(), "time integration")
    accuracy: Accuracy = choice(Accuracy(), "errors that the mesh may add")
    mesh: Mesh = choice(Mesh(), "mesh written by hand, for a winch that feeds cable")
