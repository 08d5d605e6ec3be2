"""Scene: what a user writes. One YAML file, SI units, every number checked at load against its declaration."""

from __future__ import annotations

from ..physics.cable_assembly import Cable
from ..physics.contact import Contact
from ..physics.contact_surface import Seabed, Sheave
from ..physics.heave_compensation import Setpoint
from ..physics.integrate import Solver
from ..physics.parameter import REQUIRED, Block, quantity
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

    name: str = quantity(REQUIRED, "", None, None, "name of the scene")
    gravity: float = quantity(9.81, "m/s^2", 0.0, 30.0, "gravitational acceleration")
    ship: Ship = quantity(Ship(), "", None, None, "ship")
    water: Water = quantity(Water(), "", None, None, "water")
    air: Air = quantity(Air(), "", None, None, "wind on what is above the water")
    cable: Cable = quantity(REQUIRED, "", None, None, "cable")
    viv: Viv = quantity(Viv(), "", None, None, "strumming of the cable, and the drag factor computed from it")
    winch: Winch = quantity(REQUIRED, "", None, None, "winch")
    drive: Drive = quantity(Drive(), "", None, None, "drive of the winch: what turns its drum")
    setpoint: Setpoint = quantity(Setpoint(), "", None, None, "set-point of the winch")
    instruments: Instruments = quantity(Instruments(), "", None, None, "instruments aboard, beside the truth")
    faults: Faults = quantity(Faults(), "", None, None, "what is wrong with instruments, command path and drive")
    sheave: Sheave = quantity(REQUIRED, "", None, None, "sheave")
    seabed: Seabed = quantity(Seabed(), "", None, None, "seabed under the tow")
    contact: Contact = quantity(Contact(), "", None, None, "contact of the cable with drum and sheave")
    towbody: Towbody = quantity(REQUIRED, "", None, None, "towbody")
    vehicle: Vehicle = quantity(Vehicle(), "", None, None, "vehicle at the far end, of towbody.model vehicle")
    bodies: dict[str, LineBody] = quantity({}, "", None, None, "bodies on the line between drum and towbody")
    rules: Rules = quantity(Rules(), "", None, None, "rules on watch, which change nothing of the tow")
    solver: Solver = quantity(Solver(), "", None, None, "time integration")
    accuracy: Accuracy = quantity(Accuracy(), "", None, None, "errors that the mesh may add")
    mesh: Mesh = quantity(Mesh(), "", None, None, "mesh written by hand, for a winch that feeds cable")
