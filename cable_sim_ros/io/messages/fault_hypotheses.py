"""Wrong units and axes of motion messages by name: what `plausibility` finds, how it shows, what to do about it.

A guess says how the columns of a comparison would hang together if it were so: rows A with A columns = 0, columns being
what is integrated or measured. The first guess of a table is that nothing is wrong.
"""

from __future__ import annotations

from math import pi

import numpy as np

KNOT = 0.514444  # m/s
UNUSED = "not used while it is so"

# cause of refusal -> what is seen, the probable cause as a question, the remedy
DOUBTS = {
    "rate_degrees": "angular_velocity is 57.3 times the rate of its own attitude: degrees per second? "
    f"{UNUSED}; send rad/s",
    "rate_ned": "angular_velocity about y and z is the negative rate of its own attitude: rates in NED axes (y "
    f"starboard, z down) with an attitude in ENU axes, or the other way round? {UNUSED}; send both in the axes of "
    "motion.convention",
    "rate_world": "angular_velocity fits the rate of its own attitude only when read in world axes: twist in the axes "
    f"of header.frame_id? {UNUSED}; send it in those of child_frame_id",
    "rate_axes": "angular_velocity fits the rate of its own attitude only with axes swapped or reversed: another "
    f"mounting of gyro and attitude? {UNUSED}; bring both to the same axes",
    "rate_absent": f"angular_velocity is zero all the time while the attitude turns: rates not filled in? {UNUSED}; "
    "send the rates",
    "rate_misfit": "the attitude does not turn as angular_velocity says, which has just stepped or is off by degrees "
    f"within half a second: {UNUSED}; check unit, axes and time stamps of both",
    "velocity_misfit": "twist.linear has stepped and the position does not follow it: "
    f"{UNUSED}; check unit, axes and time stamps of both",
    "height_step": "z of the position has stepped by more than half of motion.max_height_offset, which the twist does "
    f"not explain: {UNUSED}; check datum and quality of the height",
    "velocity_knots": f"twist.linear is 1.94 times the speed of the position: knots? {UNUSED}; send m/s",
    "velocity_kmh": f"twist.linear is 3.6 times the speed of the position: km/h? {UNUSED}; send m/s",
    "velocity_world": "twist.linear fits the speed of the position only when read in world axes: twist in the axes of "
    f"header.frame_id? {UNUSED}; send it in those of child_frame_id",
    "velocity_ned": "twist.linear fits the speed of the position only with y and z reversed: twist in NED axes (y "
    f"starboard, z down) with a pose in ENU axes? {UNUSED}; send both in the axes of motion.convention",
    "position_ned": "the position fits twist and attitude only as (y, x, -z): position in NED axes, the rest in ENU? "
    f"{UNUSED}; send all in the axes of motion.convention",
    "heading_north": "the position fits twist and attitude only with x and y swapped: yaw from north, clockwise, or "
    f"the position as (north, east)? {UNUSED}; send yaw from east, anticlockwise, and (east, north), or all in NED "
    "axes with motion.convention: ned",
    "height_sign": f"z of the position goes down when the twist goes up: one of them positive down? {UNUSED}; send "
    "both positive up, or all in NED axes with motion.convention: ned",
    "height_offset": "odometry z keeps away from ship.reference_height by more than motion.max_height_offset: another "
    f"datum (geoid, antenna, keel), or z positive down? {UNUSED}; z must be the height of base_link above the mean "
    "water surface",
    "heave_sign": "the vertical velocity of odom is the negative of what the specific force of imu/data gives: z "
    f"positive down? {UNUSED}; send z positive up, or all in NED axes with motion.convention: ned",
    "motion_ned": "imu/data reads -g along the vertical, and the vertical velocity of odom goes with it: both positive "
    f"down, so that all of the motion is in NED axes? {UNUSED}; set motion.convention: ned (--convention ned)",
    "attitude_ned": "pitch and yaw of odom turn against those of imu/data: odometry in NED axes, IMU in ENU, or the "
    f"other way round? odometry is {UNUSED}; send both in the axes of motion.convention",
    "attitude_axes": "the attitude of odom turns as that of imu/data only with axes swapped or reversed: mounting of "
    f"the IMU (heave.imu_rotation_deg), or axes of the odometry? odometry is {UNUSED}; bring both to base_link",
    "gravity_removed": "specific force is about 0 where it must be +g along the vertical: gravity removed? "
    f"{UNUSED}; send linear_acceleration with gravity (REP 145)",
    "gravity_sign": "specific force along the vertical is about -g where it must be +g: NED axes, or gravity instead "
    f"of specific force? {UNUSED}; set motion.convention (--convention) to the axes of the driver, or "
    "motion.force_reversed where they are right",
    "gravity_units": f"specific force along the vertical is about 1 where it must be 9.81: in g? {UNUSED}; send m/s^2",
    "gravity_direction": "specific force is more than 60 deg off the vertical of the attitude: accelerometer and "
    f"attitude in different axes? {UNUSED}; bring both to the same axes, or set heave.imu_rotation_deg",
}

ROWS = tuple[str, np.ndarray]  # cause, A
I3, O3 = np.eye(3), np.zeros((3, 3))
NED_WORLD = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # its own inverse
NED_BODY = np.diag([1.0, -1.0, -1.0])
DEGREE = pi / 180.0


def _axes() -> list[np.ndarray]:
    """The turns by quarters and single reversals that are not NED, each at full size."""
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    flips = [
        np.diag(d) for d in ((-1.0, -1, 1), (-1.0, 1, 1), (1.0, -1, 1), (1.0, 1, -1), (-1.0, 1, -1), (-1.0, -1, -1))
    ]
    swaps = [swap @ np.diag(d) for d in ((1.0, 1, 1), (1.0, 1, -1), (1.0, -1, 1), (-1.0, 1, 1), (-1.0, -1, -1))]
    return flips + swaps


def rate_guesses(world: bool) -> list[ROWS]:
    """Columns: angles [3], integral of the rates read in body axes [3], and if `world` the same read in world axes."""
    guesses = [("", (I3, -I3, O3)), ("rate_degrees", (I3, -DEGREE * I3, O3)), ("rate_ned", (I3, -NED_BODY, O3))]
    guesses += [("rate_degrees", (I3, -DEGREE * NED_BODY, O3))]
    if world:
        guesses += [("rate_world", (I3, O3, -I3)), ("rate_degrees", (I3, O3, -DEGREE * I3))]
    guesses += [("rate_axes", (I3, -m, O3)) for m in _axes()]
    return [(cause, np.hstack(blocks if world else blocks[:2])) for cause, blocks in guesses]


def velocity_guesses() -> list[ROWS]:
    """Columns: position [3]; integrals of the velocity's parts along body x, y and z, in the world, [3] each; of the
    velocity read in world axes [3]."""

    def body(position: np.ndarray, x: float, y: float, z: float) -> np.ndarray:
        return np.hstack([position, -x * I3, -y * I3, -z * I3, O3])

    world = np.hstack([I3, O3, O3, O3, -I3])
    return [
        ("", body(I3, 1, 1, 1)),
        ("velocity_knots", body(I3, KNOT, KNOT, KNOT)),
        ("velocity_kmh", body(I3, 1 / 3.6, 1 / 3.6, 1 / 3.6)),
        ("velocity_world", world),
        ("height_sign", body(np.diag([1.0, 1.0, -1.0]), 1, 1, 1)),
        ("velocity_ned", body(I3, 1, -1, -1)),
        ("position_ned", body(NED_WORLD, 1, 1, 1)),
        ("heading_north", body(np.abs(NED_WORLD), 1, 1, 1)),
        ("velocity_world", np.hstack([I3, O3, O3, O3, -NED_WORLD])),
        ("velocity_knots", np.hstack([I3, O3, O3, O3, -KNOT * I3])),
    ]


def attitude_guesses() -> list[ROWS]:
    """Columns: angles of the odometry [3], of the IMU [3]."""
    guesses = [("", -I3), ("attitude_ned", -NED_BODY)] + [("attitude_axes", -m) for m in _axes()]
    return [(cause, np.hstack([I3, m])) for cause, m in guesses]


def heave_guesses() -> list[ROWS]:
    """Columns: vertical velocity of the odometry at the IMU, integral of the IMU's vertical acceleration."""
    return [("", np.array([[1.0, -1.0]])), ("heave_sign", np.array([[1.0, 1.0]]))]


def ned_guesses() -> list[ROWS]:
    """Columns: vertical velocity of the odometry at the IMU, integral of the acceleration of an IMU read with z down.

    An IMU in NED axes beside odometry in ENU: they go against each other.
    """
    return [("", np.array([[1.0, 1.0]])), ("motion_ned", np.array([[1.0, -1.0]]))]
