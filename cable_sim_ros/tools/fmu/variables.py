"""Variables of the FMU: name, unit, meaning; one table for both versions of FMI.

World: odom, ENU, z = 0 at the mean water surface. Ship: base_link, x forward, y to port, z up. SI units.
"""

from __future__ import annotations

from typing import NamedTuple

REAL, INTEGER, BOOLEAN, STRING = "Real", "Integer", "Boolean", "String"
NO_COMMAND, RATE, LENGTH = 0, 1, 2  # of winch.mode
OK, DOUBTFUL, FAILED = 0, 1, 2  # of verdict


class Variable(NamedTuple):
    """A variable: kind REAL to STRING; role input, output or parameter; unit "" where there is none."""

    name: str
    kind: str
    role: str
    unit: str
    meaning: str


def _vector(name: str, role: str, unit: str, meaning: str, axes: str = "xyz") -> list[Variable]:
    return [Variable(f"{name}.{axis}", REAL, role, unit, f"{meaning}, {axis}") for axis in axes]


def _number(name: str, unit: str, meaning: str) -> Variable:
    return Variable(name, REAL, "output", unit, meaning)


AT_END = "at the end of the step that follows"
INPUTS = (
    *_vector("ship.position", "input", "m", f"base_link in odom {AT_END}"),
    *_vector("ship.velocity", "input", "m/s", f"derivative of ship.position, odom, {AT_END}"),
    Variable("ship.attitude.roll", REAL, "input", "rad", f"of Rz Ry Rx, positive port side up, {AT_END}"),
    Variable("ship.attitude.pitch", REAL, "input", "rad", f"positive bow down, {AT_END}"),
    Variable("ship.attitude.yaw", REAL, "input", "rad", f"from east to north, {AT_END}"),
    *_vector("ship.rate", "input", "rad/s", f"angular velocity in base_link {AT_END}"),
    Variable("winch.mode", INTEGER, "input", "", "0 no command, the winch holds; 1 winch.rate; 2 winch.length"),
    Variable(
        "winch.rate", REAL, "input", "m/s", "commanded rate of pay-out, positive out, from the beginning of the step"
    ),
    Variable("winch.length", REAL, "input", "m", "commanded pay-out, from the beginning of the step"),
)
PARAMETERS = (
    Variable(
        "ship.from_scene", BOOLEAN, "parameter", "", "true: the ship goes ahead at ship.tow_speed, inputs ship.* unused"
    ),
    Variable("settings", STRING, "parameter", "", "numbers of the scene by key, as in water.density=1000; gravity=9.8"),
)
OUTPUTS = (
    *_vector("force.world", "output", "N", "pull of the outboard cable on the ship, odom"),
    *_vector("force.ship", "output", "N", "pull of the outboard cable on the ship, base_link"),
    *_vector("force.point_world", "output", "m", "point of application: where the cable leaves the sheave, odom"),
    *_vector("force.point_ship", "output", "m", "point of application, base_link"),
    *_vector("force.moment_ship", "output", "N m", "moment of that pull about the origin of base_link, base_link"),
    _number("cable.tension", "N", "effective tension where the cable leaves the sheave outboard"),
    _number("cable.tension_least", "N", "least of it in any time step of the last communication step"),
    _number("cable.tension_largest", "N", "largest of it in any time step of the last communication step"),
    _number("cable.tension_drum", "N", "tension at the drum"),
    _number("cable.tension_body", "N", "tension at the towbody"),
    _number("cable.departure_angle", "rad", "angle of the departing cable from the downward vertical, no sign"),
    _number("winch.payout", "m", "unstretched cable off the drum, positive out"),
    _number("winch.payout_rate", "m/s", "rate of pay-out"),
    _number("winch.scope", "m", "unstretched cable from above the sheave's axis to the towbody"),
    _number("winch.cable_on_drum", "m", "unstretched cable left on the drum"),
    *_vector("body.position", "output", "m", "towbody in odom"),
    *_vector("body.velocity", "output", "m/s", "towbody velocity in odom"),
    *_vector("body.quaternion", "output", "", "towbody attitude in odom", "xyzw"),
    _number("body.depth", "m", "depth of the towbody below the mean water surface"),
    _number("body.layback", "m", "horizontal distance from the sheave centre to the towbody"),
    _number("health.energy_residual", "J", "error of the integration since the start"),
    _number("health.tension_damped", "N", "ringing of the tension that the time steps have damped away"),
    _number("health.penetration", "m", "deepest penetration of drum and sheave in the last tick"),
    _number("health.motion_misfit", "1", "largest misfit of ship positions and velocities so far, of what is allowed"),
    Variable("health.status", INTEGER, "output", "", "Flag bits of the last tick: docs/flags.md"),
    Variable("health.status_any", INTEGER, "output", "", "Flag bits of any tick since the start"),
    Variable("health.verdict", INTEGER, "output", "", "verdict so far: 0 ok, 1 doubtful, 2 failed"),
)
VEHICLE_INPUTS = (  # of a scene with a vehicle at the far end
    *_vector("vehicle.position", "input", "m", f"reference point of the vehicle in odom {AT_END}"),
    *_vector("vehicle.velocity", "input", "m/s", f"derivative of vehicle.position, odom, {AT_END}"),
    Variable("vehicle.attitude.roll", REAL, "input", "rad", f"of Rz Ry Rx, positive port side up, {AT_END}"),
    Variable("vehicle.attitude.pitch", REAL, "input", "rad", f"positive bow down, {AT_END}"),
    Variable("vehicle.attitude.yaw", REAL, "input", "rad", f"from east to north, {AT_END}"),
    *_vector("vehicle.rate", "input", "rad/s", f"angular velocity in its own axes {AT_END}"),
)
VEHICLE_OUTPUTS = (
    *_vector("vehicle.force", "output", "N", "force of the cable on the vehicle, odom"),
    *_vector("vehicle.moment", "output", "N m", "moment of that force about the reference point, odom"),
    _number("vehicle.off", "m", "distance from its attachment to the end of the cable: above 0 beyond its reach"),
)
UNITS = {  # exponents of the base units
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "1": {},
}
