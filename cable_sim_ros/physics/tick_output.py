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


# name, shape, dtype, unit, meaning
FIELDS = (
    ("time", (), "i8", "ns", "simulation time, integer nanoseconds on the clock of the motion data"),
    ("tick", (), "i8", "1", "ticks since the start"),
    ("ship_position", (3,), "f8", "m", "base_link in odom"),
    ("ship_quaternion", (4,), "f8", "1", "attitude of base_link in odom, x y z w"),
    ("ship_velocity", (3,), "f8", "m/s", "velocity of base_link in odom"),
    ("ship_rate", (3,), "f8", "rad/s", "angular velocity in odom"),
    ("sheave_position", (3,), "f8", "m", "sheave centre in odom"),
    ("sheave_velocity", (3,), "f8", "m/s", "velocity of the sheave centre in odom"),
    ("sheave_ahead_rate", (), "f8", "m/s", "speed of the sheave along the ship's heading, less the ship's mean speed"),
    ("sheave_port_rate", (), "f8", "m/s", "speed of the sheave to port of that, less the ship's mean drift"),
    ("sheave_up_rate", (), "f8", "m/s", "speed of the sheave up"),
    ("surface_elevation", (), "f8", "m", "height of the water surface where the sheave is; 0 without waves"),
    ("tension", (), "f8", "N", "effective tension where the cable leaves the sheave outboard"),
    ("tension_vector", (3,), "f8", "N", "pull of the outboard cable on the sheave, axes of sheave_link"),
    (
        "departure_angle",
        (),
        "f8",
        "rad",
        "angle of the cable from the downward vertical, no sign, read a quarter of the radius or 4 sqrt(EI/T), the "
        "longer one, beyond its last contact with the sheave; further out it hangs steeper, mostly by less than 1 deg",
    ),
    ("tension_drum", (), "f8", "N", "tension at the drum"),
    ("tension_tick_min", (), "f8", "N", "least tension where the cable leaves the sheave in any time step of the tick"),
    ("tension_tick_max", (), "f8", "N", "largest tension there in any time step of the tick"),
    ("tension_least", (), "f8", "N", "least element tension along the cable in any time step of the tick"),
    ("tension_most", (), "f8", "N", "largest element tension along the cable in any time step of the tick"),
    ("tension_body", (), "f8", "N", "tension at the towbody"),
    (
        "tension_damped",
        (),
        "f8",
        "N",
        "amplitude of the ringing of the tension that the time steps have damped away, an estimate",
    ),
    (
        "amplification_mean",
        (),
        "f8",
        "1",
        "mean computed drag factor of strumming over the cable in the water; viv off: 1",
    ),
    ("strum_amplitude_most", (), "f8", "1", "largest amplitude of strumming along the cable, in diameters; viv off: 0"),
    ("body_position", (3,), "f8", "m", "towbody in odom"),
    ("body_velocity", (3,), "f8", "m/s", "towbody velocity in odom"),
    ("body_acceleration", (3,), "f8", "m/s^2", "towbody acceleration in odom"),
    ("body_quaternion", (4,), "f8", "1", "towbody attitude in odom, x y z w: level, x forward against the local flow"),
    (
        "slam_estimate",
        (),
        "f8",
        "N",
        "slam that every other figure lacks: rho/2 C_s A w^2 with C_s = 5 of a body that enters the water, less that "
        "of the added mass",
    ),
    ("body_rate", (3,), "f8", "rad/s", "towbody angular velocity in odom: about z alone"),
    ("payout", (), "f8", "m", "unstretched cable off the drum, positive out"),
    ("payout_rate", (), "f8", "m/s", "rate of pay-out"),
    ("payout_acceleration", (), "f8", "m/s^2", "acceleration of pay-out"),
    ("payout_rate_tick_max", (), "f8", "m/s", "largest speed of pay-out either way within the tick"),
    ("payout_acceleration_tick_max", (), "f8", "m/s^2", "largest acceleration of pay-out either way within the tick"),
    ("payout_setpoint", (), "f8", "m", "pay-out the servo is steering to"),
    ("rate_limited", (), "f8", "1", "share of the tick in which winch.max_rate held the servo"),
    ("acceleration_limited", (), "f8", "1", "share of the tick in which winch.max_acceleration held the servo"),
    ("travel_limited", (), "f8", "1", "share of the tick in which an end of the travel held or braked the servo"),
    ("command_limited", (), "f8", "1", "share of the tick in which a command asked for more than rate or travel"),
    ("ramp_limited", (), "f8", "1", "share of the tick in which winch.command_acceleration held the commanded rate"),
    ("scope", (), "f8", "m", "unstretched cable from the point above the sheave's axis to the towbody"),
    ("layback", (), "f8", "m", "horizontal distance from the sheave centre to the towbody"),
    ("cable_on_drum", (), "f8", "m", "unstretched cable left on the drum"),
    ("drum_turns", (), "f8", "1", "turns of cable left on the drum"),
    ("drum_layer", (), "i8", "1", "layers under the one that the cable runs off; without winch.lay_width: 0"),
    ("drum_lay_radius", (), "f8", "m", "radius of the cable's centreline there"),
    ("drum_lay", (), "f8", "m", "place across the drum at which the cable leaves it, from its middle to port"),
    ("payout_counter", (), "f8", "m", "payout as a counter on the drum shows it: stretched as the cable was wound"),
    ("drum_angle", (), "f8", "rad", "drum angle, positive hauling in"),
    ("drum_rate", (), "f8", "rad/s", "drum speed, positive hauling in"),
    ("drum_torque", (), "f8", "N m", "torque of the cable on the drum, positive turning it out"),
    (
        "winch_mode",
        (),
        "i8",
        "1",
        "mode of the winch in force, in the order of drive.mode: 0 follow to 4 emergency_stop",
    ),
    (
        "motor_pull",
        (),
        "f8",
        "N",
        "pull of the motor at the drum, positive hauling in; 0 where drive.model is not motor",
    ),
    ("motor_power", (), "f8", "W", "power of the motor on the drum, positive hauling in"),
    ("motor_limited", (), "f8", "1", "share of the tick in which the motor gave all it can"),
    ("brake_pull", (), "f8", "N", "pull of brake and dry friction at the drum, positive against paying out"),
    ("brake_set", (), "f8", "1", "brake, 0 open to 1 set"),
    ("brake_slip", (), "f8", "m", "way of the cable against its brake since the start, either way"),
    ("brake_heat", (), "f8", "J", "heat of the brake since the start"),
    (
        "drive_rounds",
        (),
        "i8",
        "1",
        "times that cable and drum were solved in the tick; 0 where the drum is driven exactly",
    ),
    ("tension_drum_tick_max", (), "f8", "N", "largest tension at the drum in any time step of the tick"),
    ("winch_power_tick_min", (), "f8", "W", "least power of the winch on the cable in any time step of the tick"),
    (
        "winch_power_tick_max",
        (),
        "f8",
        "W",
        "largest power of the winch on the cable in any time step of the tick; negative where it pays out and brakes",
    ),
    ("contact_force", (3,), "f8", "N", "resultant of the cable on the sheave, axes of sheave_link"),
    ("contact_resultant", (), "f8", "N", "norm of contact_force"),
    ("contact_resultant_tick_max", (), "f8", "N", "largest contact_resultant in any time step of the tick"),
    ("contact_total", (), "f8", "N", "sum of the line loads of flanks, rims and cheeks, no directions"),
    (
        "sheave_friction",
        (),
        "f8",
        "N",
        "friction of the sheave along the cable, from its moment: tension at the drum less that outboard",
    ),
    ("wrap_angle", (), "f8", "rad", "arc between the first and the last loaded contact point on the sheave"),
    ("lifted_fraction", (), "f8", "1", "part of the geometric wrap that carries no load"),
    (
        "groove_margin",
        (),
        "f8",
        "m",
        "least distance below the groove top along the wrap; past a rim minus the way from it; -depth: so far or more",
    ),
    (
        "swivel_angle",
        (),
        "f8",
        "rad",
        "angle of a block that swivels about the line of the inboard cable, to port; without sheave.swivel: 0",
    ),
    ("contact_stations", (), "i8", "1", "rows of the contact table that are filled"),
    ("penetration", (), "f8", "m", "deepest penetration of drum and sheave in any time step of the tick"),
    ("seabed_length", (), "f8", "m", "unstretched length of cable that lies on the seabed"),
    (
        "detachments",
        (),
        "i8",
        "1",
        "detachments since the start; each lasts until the cable has pressed for contact.reseat_time",
    ),
    ("kinetic_energy", (), "f8", "J", "of cable, bodies, terminations and a drum that a motor turns"),
    ("strain_energy", (), "f8", "J", "axial and bending"),
    ("potential_energy", (), "f8", "J", "of weight less buoyancy"),
    (
        "work_supplied",
        (),
        "f8",
        "J",
        "work of the winch, its motor where it has one, and hull on the cable end since the start",
    ),
    ("work_water", (), "f8", "J", "work of the water since the start: drag, buoyancy, added mass, lift"),
    ("work_contact", (), "f8", "J", "work of drum, sheave and seabed on cable and towbody since the start"),
    ("dissipated", (), "f8", "J", "energy lost in the cable's material, and at a motor's drum, since the start"),
    (
        "friction_heat",
        (),
        "f8",
        "J",
        "heat of the cable's friction on sheave, drum and seabed since the start; work_contact is already less by it",
    ),
    ("energy_residual", (), "f8", "J", "stored less start, plus dissipated, less work: error of the integration"),
    ("mru_surge", (), "f8", "m", "reading of the MRU, forward; of a device that is not aboard every reading is 0"),
    ("mru_sway", (), "f8", "m", "reading of the MRU, to port"),
    ("mru_heave", (), "f8", "m", "reading of the MRU, up"),
    ("mru_surge_rate", (), "f8", "m/s", "reading of the MRU, forward, without the ship's mean velocity"),
    ("mru_sway_rate", (), "f8", "m/s", "reading of the MRU, to port, without it"),
    ("mru_heave_rate", (), "f8", "m/s", "reading of the MRU, up"),
    ("mru_roll", (), "f8", "rad", "reading of the MRU, positive port up"),
    ("mru_pitch", (), "f8", "rad", "reading of the MRU, positive bow down"),
    ("mru_roll_rate", (), "f8", "rad/s", "reading of the MRU"),
    ("mru_pitch_rate", (), "f8", "rad/s", "reading of the MRU"),
    ("mru_sheave_position", (3,), "f8", "m", "sheave centre in odom as the readings of the MRU give it"),
    ("mru_sheave_velocity", (3,), "f8", "m/s", "its velocity in odom"),
    ("mru_sheave_ahead_rate", (), "f8", "m/s", "sheave_ahead_rate of that"),
    ("mru_sheave_port_rate", (), "f8", "m/s", "sheave_port_rate of that"),
    ("mru_sheave_up_rate", (), "f8", "m/s", "sheave_up_rate of that"),
    ("encoder_payout", (), "f8", "m", "pay-out that the encoder on the drum shows"),
    ("encoder_rate", (), "f8", "m/s", "rate of pay-out that it shows"),
    ("metering_payout", (), "f8", "m", "cable that the metering sheave has counted, stretched as it passed"),
    ("metering_rate", (), "f8", "m/s", "rate of pay-out that it shows"),
    ("load_pin", (), "f8", "N", "load pin of the sheave: resultant of both legs in its direction"),
    ("load_pin_tension", (), "f8", "N", "that over instruments.load_pin.calibration"),
    ("usbl_position", (3,), "f8", "m", "newest acoustic fix of the towbody in odom"),
    (
        "depth_reading",
        (),
        "f8",
        "m",
        "pressure sensor of the towbody, as depth: with the pressure of the waves; 0 in air",
    ),
    (
        "readings_new",
        (),
        "i8",
        "1",
        "devices with a reading of this tick: 1 MRU, 2 encoder, 4 metering sheave, 8 load pin, 16 fix, 32 depth, "
        "64 attitude of the towbody, 128 altimeter",
    ),
    (
        "vehicle_position",
        (3,),
        "f8",
        "m",
        "reference point of the vehicle in odom; without a vehicle 0, as what follows",
    ),
    ("vehicle_velocity", (3,), "f8", "m/s", "velocity of the vehicle's reference point in odom"),
    ("vehicle_force", (3,), "f8", "N", "force of the cable on the vehicle in odom"),
    ("vehicle_moment", (3,), "f8", "N m", "its moment about the vehicle's reference point in odom"),
    (
        "vehicle_power",
        (),
        "f8",
        "W",
        "power of the vehicle on the cable: minus the force times the velocity of the end",
    ),
    (
        "vehicle_off",
        (),
        "f8",
        "m",
        "distance from the vehicle's attachment to the end of the cable: above 0 where limited",
    ),
    ("vehicle_age", (), "f8", "s", "simulation time less stamp of the newest pose of the vehicle (negative: ahead)"),
    ("iterations", (), "i8", "1", "Newton iterations of the tick"),
    ("substeps", (), "i8", "1", "time steps of the tick"),
    ("residual", (), "f8", "N", "largest residual left by the last step"),
    ("motion_source", (), "i8", "1", "Source of the ship motion"),
    ("motion_age", (), "f8", "s", "simulation time less stamp of the newest motion sample (negative: ahead)"),
    ("command_age", (), "f8", "s", "simulation time less arrival of the winch command carried out; negative: none yet"),
    ("status", (), "i8", "1", "Flag bits"),
    ("slam", (), "f8", "N", "force of water entry at the end of the tick, the largest of the bodies; 0: no entry"),
    ("fish_roll", (), "f8", "rad", "roll of the towbody that its attitude sensor shows, port side up"),
    ("fish_pitch", (), "f8", "rad", "pitch that it shows, nose down, as in REP 103"),
    ("fish_heading", (), "f8", "rad", "heading that it shows, from east to north"),
    ("altitude_reading", (), "f8", "m", "altimeter of the towbody: height of its tow point above the seabed"),
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
