"""Tick output: what one tick answers. One table declares every published quantity with unit and meaning."""

from __future__ import annotations

from enum import IntFlag

import numpy as np


class Flag(IntFlag):
    """Health flags of a tick; several may be set. Name, bit and meaning are declared here and nowhere else."""

    text: str

    def __new__(cls, bit: int, text: str = ""):
        flag = int.__new__(cls, bit)
        flag._value_, flag.text = bit, text
        return flag

    NONE = 0
    NEWTON_FAILED = 1, "no solution at the smallest step: the tick was rolled back, the run halted"
    HALVED = 2, "the tick needed shorter substeps"
    SLACK = 4, "an element carries less than no tension"
    DETACHED = 8, "the cable left the sheave or its groove"
    PENETRATION = 16, "deepest contact above the limit of the scene"
    COARSE_AT_SURFACE = 32, "an element longer than 0.4 radii touches the sheave, or one longer than a radius the drum"
    MOTION_STALE = 64, "newest motion sample older than ship.stale_after"
    MOTION_BLENDING = 128, "a changed motion source (or the start) is being taken up"
    COMMAND_STALE = 256, "a rate command, or a stream of lengths, ran into winch.command_timeout: the winch holds"
    DRUM_END = 512, "the winch is at an end stop, drum empty or what hangs on the line at the sheave: it stopped"
    NOT_FINITE = 1024, "a non-finite number was found: the tick was rolled back, the run halted"
    SEABED = 2048, "cable or towbody lies on the seabed"
    WINCH_LIMIT = 4096, "the winch is at a soft limit of the scene (winch.least_scope, winch.most_scope): it stopped"
    SLACK_ENERGY = 8192, "slack cable gained more energy from the integration than solver.energy_share of the work"
    SETPOINT_LIMITED = 16384, "the set-point law asks for more than its limits give it (setpoint.max_...)"
    COMMAND_LIMITED = 32768, "a command asks for more than rate or travel of the winch allow: carried out at that"
    LOW_FLOW = 65536, "flow past the towbody below towbody.least_flow_speed: its heading is held"
    WINCH_SATURATED = 131072, "winch.max_rate or winch.max_acceleration held the servo for half of the tick or more"
    RINGING_DAMPED = (
        262144,
        "the time steps damped ringing of more than 0.05 of the working tension away: peaks are low",
    )
    MOTOR_LIMITED = 524288, "the motor gave all that its curve and power allow for half of the tick or more"
    BRAKE_SLIPPED = 1048576, "the drum turned against its brake"
    SURFACE_CROSSED = 2097152, "towbody or a body on the line is in the water surface"
    STALLED = 4194304, "a wing or fin of a rigid body is stalled: it bears about what a plate does"
    FLAP_STALE = 8388608, "a commanded flap ran into its flap_timeout: it goes to its flap_neutral"
    FLAP_LIMITED = 16777216, "a flap is commanded beyond its flap_range: it goes to the end of that"
    VEHICLE_STALE = 33554432, "newest pose of the vehicle older than vehicle.stale_after"
    VEHICLE_BLENDING = 67108864, "a pose of the vehicle that jumped (or the first one) is being taken up"
    VEHICLE_LIMITED = (
        134217728,
        "the vehicle is out of the cable's reach or in the seabed, and its end stays behind, or pulls beyond its limit",
    )


# the same as plain numbers, each by its own name: kernels know no enums
globals().update({flag.name: flag.value for flag in Flag})


class Source(IntFlag):
    """Where the ship motion of a tick came from."""

    MEAN = 0  # mean track of the scene
    ODOMETRY = 1
    IMU = 2


def field(name: str, unit: str, meaning: str, *, shape: tuple[int, ...] = (), kind: str = "f8"):
    """A row of FIELDS: name, shape, dtype, unit, meaning."""
    return name, shape, kind, unit, meaning


def whole(name: str, meaning: str):
    """A row of a whole number: a count, a mode, 0 or 1."""
    return field(name, "1", meaning, kind="i8")


FIELDS = (
    field("time", "ns", "simulation time, integer nanoseconds on the clock of the motion data", kind="i8"),
    whole("tick", "ticks since the start"),
    field("ship_position", "m", "base_link in odom", shape=(3,)),
    field("ship_quaternion", "1", "attitude of base_link in odom, x y z w", shape=(4,)),
    field("ship_velocity", "m/s", "velocity of base_link in odom", shape=(3,)),
    field("ship_rate", "rad/s", "angular velocity in odom", shape=(3,)),
    field("sheave_position", "m", "sheave centre in odom", shape=(3,)),
    field("sheave_velocity", "m/s", "velocity of the sheave centre in odom", shape=(3,)),
    field("sheave_ahead_rate", "m/s", "speed of the sheave along the ship's heading, less the ship's mean speed"),
    field("sheave_port_rate", "m/s", "speed of the sheave to port of that, less the ship's mean drift"),
    field("sheave_up_rate", "m/s", "speed of the sheave up"),
    field("surface_elevation", "m", "height of the water surface where the sheave is; 0 without waves"),
    field("tension", "N", "effective tension where the cable leaves the sheave outboard"),
    field("tension_vector", "N", "pull of the outboard cable on the sheave, axes of sheave_link", shape=(3,)),
    field(
        "departure_angle",
        "rad",
        "angle of the cable from the downward vertical, no sign, read a quarter of the radius or 4 sqrt(EI/T), the "
        "longer one, beyond its last contact with the sheave; further out it hangs steeper, mostly by less than 1 deg",
    ),
    field("tension_drum", "N", "tension at the drum"),
    field("tension_tick_min", "N", "least tension where the cable leaves the sheave in any time step of the tick"),
    field("tension_tick_max", "N", "largest tension there in any time step of the tick"),
    field("tension_least", "N", "least element tension along the cable in any time step of the tick"),
    field("tension_most", "N", "largest element tension along the cable in any time step of the tick"),
    field("tension_body", "N", "tension at the towbody"),
    field(
        "tension_damped",
        "N",
        "amplitude of the ringing of the tension that the time steps have damped away, an estimate",
    ),
    field("amplification_mean", "1", "mean computed drag factor of strumming over the cable in the water; viv off: 1"),
    field("strum_amplitude_most", "1", "largest amplitude of strumming along the cable, in diameters; viv off: 0"),
    field("body_position", "m", "towbody in odom", shape=(3,)),
    field("body_velocity", "m/s", "towbody velocity in odom", shape=(3,)),
    field("body_acceleration", "m/s^2", "towbody acceleration in odom", shape=(3,)),
    field(
        "body_quaternion", "1", "towbody attitude in odom, x y z w: level, x forward against the local flow", shape=(4,)
    ),
    field(
        "slam_estimate",
        "N",
        "slam that every other figure lacks: rho/2 C_s A w^2 with C_s = 5 of a body that enters the water, less that "
        "of the added mass",
    ),
    field("body_rate", "rad/s", "towbody angular velocity in odom: about z alone", shape=(3,)),
    field("payout", "m", "unstretched cable off the drum, positive out"),
    field("payout_rate", "m/s", "rate of pay-out"),
    field("payout_acceleration", "m/s^2", "acceleration of pay-out"),
    field("payout_rate_tick_max", "m/s", "largest speed of pay-out either way within the tick"),
    field("payout_acceleration_tick_max", "m/s^2", "largest acceleration of pay-out either way within the tick"),
    field("payout_setpoint", "m", "pay-out the servo is steering to"),
    field("rate_limited", "1", "share of the tick in which winch.max_rate held the servo"),
    field("acceleration_limited", "1", "share of the tick in which winch.max_acceleration held the servo"),
    field("travel_limited", "1", "share of the tick in which an end of the travel held or braked the servo"),
    field("command_limited", "1", "share of the tick in which a command asked for more than rate or travel"),
    field("ramp_limited", "1", "share of the tick in which winch.command_acceleration held the commanded rate"),
    field("scope", "m", "unstretched cable from the point above the sheave's axis to the towbody"),
    field("layback", "m", "horizontal distance from the sheave centre to the towbody"),
    field("cable_on_drum", "m", "unstretched cable left on the drum"),
    field("drum_turns", "1", "turns of cable left on the drum"),
    whole("drum_layer", "layers under the one that the cable runs off; without winch.lay_width: 0"),
    field("drum_lay_radius", "m", "radius of the cable's centreline there"),
    field("drum_lay", "m", "place across the drum at which the cable leaves it, from its middle to port"),
    field("payout_counter", "m", "payout as a counter on the drum shows it: stretched as the cable was wound"),
    field("drum_angle", "rad", "drum angle, positive hauling in"),
    field("drum_rate", "rad/s", "drum speed, positive hauling in"),
    field("drum_torque", "N m", "torque of the cable on the drum, positive turning it out"),
    whole("winch_mode", "mode of the winch in force, in the order of drive.mode: 0 follow to 4 emergency_stop"),
    field("motor_pull", "N", "pull of the motor at the drum, positive hauling in; 0 where drive.model is not motor"),
    field("motor_power", "W", "power of the motor on the drum, positive hauling in"),
    field("motor_limited", "1", "share of the tick in which the motor gave all it can"),
    field("brake_pull", "N", "pull of brake and dry friction at the drum, positive against paying out"),
    field("brake_set", "1", "brake, 0 open to 1 set"),
    field("brake_slip", "m", "way of the cable against its brake since the start, either way"),
    field("brake_heat", "J", "heat of the brake since the start"),
    whole("drive_rounds", "times that cable and drum were solved in the tick; 0 where the drum is driven exactly"),
    field("tension_drum_tick_max", "N", "largest tension at the drum in any time step of the tick"),
    field("winch_power_tick_min", "W", "least power of the winch on the cable in any time step of the tick"),
    field(
        "winch_power_tick_max",
        "W",
        "largest power of the winch on the cable in any time step of the tick; negative where it pays out and brakes",
    ),
    field("contact_force", "N", "resultant of the cable on the sheave, axes of sheave_link", shape=(3,)),
    field("contact_resultant", "N", "norm of contact_force"),
    field("contact_resultant_tick_max", "N", "largest contact_resultant in any time step of the tick"),
    field("contact_total", "N", "sum of the line loads of flanks, rims and cheeks, no directions"),
    field(
        "sheave_friction",
        "N",
        "friction of the sheave along the cable, from its moment: tension at the drum less that outboard",
    ),
    field("wrap_angle", "rad", "arc between the first and the last loaded contact point on the sheave"),
    field("lifted_fraction", "1", "part of the geometric wrap that carries no load"),
    field(
        "groove_margin",
        "m",
        "least distance below the groove top along the wrap; past a rim minus the way from it; -depth: so far or more",
    ),
    field(
        "swivel_angle",
        "rad",
        "angle of a block that swivels about the line of the inboard cable, to port; without sheave.swivel: 0",
    ),
    whole("contact_stations", "rows of the contact table that are filled"),
    field("penetration", "m", "deepest penetration of drum and sheave in any time step of the tick"),
    field("seabed_length", "m", "unstretched length of cable that lies on the seabed"),
    whole("detachments", "detachments since the start; each lasts until the cable has pressed for contact.reseat_time"),
    field("kinetic_energy", "J", "of cable, bodies, terminations and a drum that a motor turns"),
    field("strain_energy", "J", "axial and bending"),
    field("potential_energy", "J", "of weight less buoyancy"),
    field(
        "work_supplied", "J", "work of the winch, its motor where it has one, and hull on the cable end since the start"
    ),
    field("work_water", "J", "work of the water since the start: drag, buoyancy, added mass, lift"),
    field("work_contact", "J", "work of drum, sheave and seabed on cable and towbody since the start"),
    field("dissipated", "J", "energy lost in the cable's material, and at a motor's drum, since the start"),
    field(
        "friction_heat",
        "J",
        "heat of the cable's friction on sheave, drum and seabed since the start; work_contact is already less by it",
    ),
    field("energy_residual", "J", "stored less start, plus dissipated, less work: error of the integration"),
    field("mru_surge", "m", "reading of the MRU, forward; of a device that is not aboard every reading is 0"),
    field("mru_sway", "m", "reading of the MRU, to port"),
    field("mru_heave", "m", "reading of the MRU, up"),
    field("mru_surge_rate", "m/s", "reading of the MRU, forward, without the ship's mean velocity"),
    field("mru_sway_rate", "m/s", "reading of the MRU, to port, without it"),
    field("mru_heave_rate", "m/s", "reading of the MRU, up"),
    field("mru_roll", "rad", "reading of the MRU, positive port up"),
    field("mru_pitch", "rad", "reading of the MRU, positive bow down"),
    field("mru_roll_rate", "rad/s", "reading of the MRU"),
    field("mru_pitch_rate", "rad/s", "reading of the MRU"),
    field("mru_sheave_position", "m", "sheave centre in odom as the readings of the MRU give it", shape=(3,)),
    field("mru_sheave_velocity", "m/s", "its velocity in odom", shape=(3,)),
    field("mru_sheave_ahead_rate", "m/s", "sheave_ahead_rate of that"),
    field("mru_sheave_port_rate", "m/s", "sheave_port_rate of that"),
    field("mru_sheave_up_rate", "m/s", "sheave_up_rate of that"),
    field("encoder_payout", "m", "pay-out that the encoder on the drum shows"),
    field("encoder_rate", "m/s", "rate of pay-out that it shows"),
    field("metering_payout", "m", "cable that the metering sheave has counted, stretched as it passed"),
    field("metering_rate", "m/s", "rate of pay-out that it shows"),
    field("load_pin", "N", "load pin of the sheave: resultant of both legs in its direction"),
    field("load_pin_tension", "N", "that over instruments.load_pin.calibration"),
    field("usbl_position", "m", "newest acoustic fix of the towbody in odom", shape=(3,)),
    field("depth_reading", "m", "pressure sensor of the towbody, as depth: with the pressure of the waves; 0 in air"),
    field(
        "readings_new",
        "1",
        "devices with a reading of this tick: 1 MRU, 2 encoder, 4 metering sheave, 8 load pin, 16 fix, 32 depth, "
        "64 attitude of the towbody, 128 altimeter",
        kind="i8",
    ),
    field(
        "vehicle_position",
        "m",
        "reference point of the vehicle in odom; without a vehicle 0, as what follows",
        shape=(3,),
    ),
    field("vehicle_velocity", "m/s", "velocity of the vehicle's reference point in odom", shape=(3,)),
    field("vehicle_force", "N", "force of the cable on the vehicle in odom", shape=(3,)),
    field("vehicle_moment", "N m", "its moment about the vehicle's reference point in odom", shape=(3,)),
    field("vehicle_power", "W", "power of the vehicle on the cable: minus the force times the velocity of the end"),
    field("vehicle_off", "m", "distance from the vehicle's attachment to the end of the cable: above 0 where limited"),
    field("vehicle_age", "s", "simulation time less stamp of the newest pose of the vehicle (negative: ahead)"),
    whole("iterations", "Newton iterations of the tick"),
    whole("substeps", "time steps of the tick"),
    field("residual", "N", "largest residual left by the last step"),
    whole("motion_source", "Source of the ship motion"),
    field("motion_age", "s", "simulation time less stamp of the newest motion sample (negative: ahead)"),
    field("command_age", "s", "simulation time less arrival of the winch command carried out; negative: none yet"),
    whole("status", "Flag bits"),
    field("slam", "N", "force of water entry at the end of the tick, the largest of the bodies; 0: no entry"),
    field("fish_roll", "rad", "roll of the towbody that its attitude sensor shows, port side up"),
    field("fish_pitch", "rad", "pitch that it shows, nose down, as in REP 103"),
    field("fish_heading", "rad", "heading that it shows, from east to north"),
    field("altitude_reading", "m", "altimeter of the towbody: height of its tow point above the seabed"),
)

TICK_OUTPUT = np.dtype([(name, kind, shape) for name, shape, kind, _, _ in FIELDS], align=True)

# columns of the two tables that go with a tick output
SHAPE_COLUMNS = (("x", "m"), ("y", "m"), ("z", "m"), ("tension", "N"), ("arc_length", "m"))  # odom, one row a node
# behind them in the shape table: the gradient dr/ds of the node, from which the cubic between nodes follows
SLOPE_COLUMNS = (("slope_x", "1"), ("slope_y", "1"), ("slope_z", "1"))  # zero where links are straight
# how the element that begins at the node strums, where viv is on; the last node repeats the one before. In the shape
# table what is not in SHAPE_COLUMNS follows the slopes
STRUM_COLUMNS = (
    *SHAPE_COLUMNS[:3],
    ("normal_speed", "m/s"),  # of the mean flow across the cable
    ("shedding_frequency", "Hz"),
    ("mode", "1"),  # number of the mode of the span from the sheave to the towbody with that frequency
    ("amplitude", "1"),  # of the antinodes, in diameters
    ("amplification", "1"),  # drag factor in force
)
WIDTH, STRUMMING = len(SHAPE_COLUMNS) + len(SLOPE_COLUMNS), len(STRUM_COLUMNS) - 3  # of the shape table, of its parts
CONTACT_COLUMNS = (  # sheave_link axes, one row a contact point of the sheave, inboard to outboard
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
    ("wrap_angle", "rad"),  # about the sheave axis from its top, positive outboard (aft)
    ("load_port", "N/m"),
    ("load_starboard", "N/m"),  # line load of each half: flank, rim, cheek
    ("gap", "m"),  # distance of the centreline from its seat in the groove; negative: pressed in
    ("arc_length", "m"),  # unstretched arc length from the drum end
    ("length", "m"),  # length of cable the contact point stands for
)
BODY_COLUMNS = (  # odom, one row a body on the line, in the order of the scene
    *SHAPE_COLUMNS[:3],
    ("tension_above", "N"),  # of the cable on its inboard side
    ("tension_below", "N"),  # on its outboard side
    ("arc_length", "m"),
    ("roll", "rad"),  # port side up
    ("pitch", "rad"),  # nose down, as in REP 103
)
# columns at the end of the shape table, where a body is rigid: roll and pitch at its node, and in row k the angle of
# the flap of wing k in the order of the bodies, rad
TURNED = 3
MAX_CONTACT_POINTS = 512


def body_rows(shape: np.ndarray, places: tuple[float, ...]) -> np.ndarray:
    """Bodies on the line [..., bodies, BODY_COLUMNS] out of shape tables [..., nodes, 5 or more].

    places: unstretched arc length [m] of each, where a node is. The tension jumps there: on each side it is drawn on
    from the two next nodes, off by the second difference of the tension from node to node; of a side with a single
    node it is the tension there.
    """
    rows = np.zeros((*shape.shape[:-2], len(places), len(BODY_COLUMNS)))
    count, tension, arc = shape.shape[-2], shape[..., 3], shape[..., 4]
    for k, place in enumerate(places):
        n = int(np.abs(arc.reshape(-1, count)[0] - place).argmin())
        rows[..., k, :3], rows[..., k, 5] = shape[..., n, :3], arc[..., n]
        if (shape.shape[-1] - WIDTH) % STRUMMING == TURNED:
            rows[..., k, 6:] = shape[..., n, -TURNED:-1]
        for column, side in ((3, -1), (4, 1)):
            near, far = n + side, n + 2 * side
            rows[..., k, column] = tension[..., near]
            if 0 <= far < count:
                slope = (tension[..., near] - tension[..., far]) / (arc[..., near] - arc[..., far])
                rows[..., k, column] += slope * (arc[..., n] - arc[..., near])
    return rows


def strum_table(shape: np.ndarray) -> np.ndarray:
    """Strumming [nodes, STRUM_COLUMNS] out of a shape table [nodes, 8, 10, 13 or 15]; no rows where viv is off."""
    if shape.shape[1] < WIDTH + STRUMMING:
        return np.zeros((0, len(STRUM_COLUMNS)))
    return np.concatenate((shape[:, :3], shape[:, WIDTH : WIDTH + STRUMMING]), axis=1)
