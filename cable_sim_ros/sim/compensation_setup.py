"""What the set-point laws take from the scene and from the static start, and the caution about what they ask for."""

from __future__ import annotations

from collections.abc import Iterator
from math import acos, cos, degrees, radians, sqrt

import numpy as np

from ..physics.heave_compensation import EXCESS_TENSION, SetpointLaw
from ..physics.section import material_of
from ..physics.setpoint_limits import KNEE
from ..physics.winch_drive import DriveModel
from .problem import Problem, rounded_down
from .scene import Scene
from .statics.route import StartError, first_angle

STEEPEST, FLATTEST = radians(-85.0), radians(85.0)  # of a nominal angle
# gain of constant_tension times sqrt(EA m), of a loop that is late by PROMPT [s], and of any; its integral time at
# least [s]. A mass on a stiff cable swings up with them where the drive has dead time (docs/setpoints.md)
MATCHED, PROMPT, LEAST, SOONEST = 0.4, 0.05, 0.05, 0.1
# k t_r (1 + t_r / t_i) dT/dL, by which the law adds to a mean error: as chosen, and the most that a scene may have;
# return that is chosen [s]: at most, and at least, above which waves of some seconds are still taken out
SURE, UNSURE, LONGEST_RETURN, SHORTEST_RETURN = 0.2, 0.5, 60.0, 2.0
WATERLINE = (SetpointLaw.SIMPLIFIED_WATERLINE, SetpointLaw.RIGOROUS_WATERLINE)


def declare(setpoint: np.record, scene: Scene, algorithm: int, yaw: float) -> None:
    """Fill a SETPOINT record, all zero, before the static start; algorithm: place in LAWS; yaw: of the mean track."""
    block = scene.setpoint
    setpoint.algorithm = setpoint.engaged = algorithm
    setpoint.track[2] = yaw
    setpoint.angle = radians(block.nominal_angle_deg or 0.0)
    setpoint.washout, setpoint.transfer = block.washout_period, block.transfer_time
    setpoint.departure_time = block.angle_filter_time
    setpoint.max_gain, setpoint.max_amplitude = block.max_gain, block.max_amplitude
    setpoint.max_excess = block.max_excess
    declare_tension(setpoint.tension, scene)
    declare_feed_forward(setpoint.feed_forward, scene)
    setpoint.prediction.on = block.prediction
    setpoint.prediction.horizon = horizon(scene)


def declare_tension(law: np.record, scene: Scene) -> None:
    """What constant_tension takes from the scene."""
    block, winch = scene.setpoint, scene.winch
    law.wanted, law.time = block.tension, block.tension_filter_time
    law.max_rate = winch.max_rate if block.tension_max_rate is None else block.tension_max_rate
    late = block.tension_filter_time + scene.drive.dead_time + scene.solver.tick + lag(scene)
    gain = min(MATCHED, max(LEAST, MATCHED * (PROMPT / late) ** 2)) / impedance(scene)
    law.gain = gain if block.tension_gain is None else block.tension_gain
    given = block.tension_integral_time
    law.integral_time = max(SOONEST, late) if given is None else given


def take_slope(law: np.record, scene: Scene, slope: float) -> None:
    """Choose the return of constant_tension by dT/dL of the tow at rest [N/m], so that a mean error does not run away.

    Raises StartError where the numbers of the scene leave none that holds.
    """
    block, inverse = scene.setpoint, 1.0 / law.integral_time
    law.slope = slope
    given = block.tension_return_time
    push = max(slope, 0.0)
    if given is not None:
        law.back = 1.0 / given if given > 0.0 else 0.0
        if push > 0.0 and law.gain * push * (law.back + inverse) > UNSURE * law.back**2:
            raise StartError(unsteady(law, scene, back_of(law.gain, push, inverse, UNSURE)), 0.0)
        return
    law.back = max(back_of(law.gain, push, inverse, SURE), 1.0 / LONGEST_RETURN)
    if law.back * SHORTEST_RETURN <= 1.0:
        return
    law.back = 1.0 / SHORTEST_RETURN
    most = SURE * law.back**2 / (push * (law.back + inverse))
    if block.tension_gain is not None:
        raise StartError(
            f"{scene.name}: setpoint.tension_gain = {law.gain:g} m/(N s): paying out raises the tension of this tow at "
            f"rest by {slope:.3g} N/m, and with that gain it would have to go back to its length within "
            f"{SHORTEST_RETURN:g} s, as fast as waves come; nothing was started. Give {rounded_down(most, 2):g} "
            "m/(N s) or less, or a longer setpoint.tension_integral_time",
            0.0,
        )
    law.gain = most


def back_of(gain: float, push: float, inverse: float, share: float) -> float:
    """1/t_r at which k t_r (1 + t_r / t_i) dT/dL is a share; inverse: 1/t_i."""
    return (gain * push + sqrt((gain * push) ** 2 + 4.0 * share * gain * push * inverse)) / (2.0 * share)


def unsteady(law: np.record, scene: Scene, back: float) -> str:
    """Why a return that the scene gives does not hold; back: 1/s, that which just does."""
    return (
        f"{scene.name}: setpoint.tension_return_time = {scene.setpoint.tension_return_time:g} s: paying out raises the "
        f"tension of this tow at rest by {law.slope:.3g} N/m, so that setpoint.algorithm = constant_tension would pay "
        f"out, or haul in, more and more; nothing was started. With tension_gain = {law.gain:.3g} m/(N s) and "
        f"tension_integral_time = {law.integral_time:.3g} s give {rounded_down(1.0 / back, 2):g} s or less (0 is "
        "never), or leave it out"
    )


def lag(scene: Scene) -> float:
    """How late [s] the drive is with a rate, without its dead time."""
    drive = scene.drive
    if drive.model is DriveModel.SERVO:
        return 1.0 / scene.winch.derivative_gain if scene.winch.derivative_gain > 0.0 else 1.0
    return (2.0 * drive.damping if drive.damping > 0.0 else 1.0) / drive.bandwidth


def declare_feed_forward(law: np.record, scene: Scene) -> None:
    """The inverse of the drive that the feed-forward takes from the scene, see physics/setpoint_feed_forward.py."""
    drive, winch = scene.drive, scene.winch
    law.on, law.bandwidth = scene.setpoint.feed_forward, scene.setpoint.feed_forward_bandwidth
    if drive.model is DriveModel.SERVO:
        if winch.derivative_gain > 0.0:  # else the check refuses it, and while it is off it asks for nothing
            law.second, law.back = 1.0 / winch.derivative_gain, winch.proportional_gain / winch.derivative_gain
        return
    w = drive.bandwidth
    law.second = lag(scene)
    law.third = 1.0 / w**2 if drive.damping > 0.0 else 0.0
    law.back = 0.25 * w if drive.length_gain is None else drive.length_gain


def horizon(scene: Scene) -> float:
    """How far [s] the prediction looks ahead."""
    given = scene.setpoint.horizon
    return scene.drive.dead_time if given is None else given


def take_rest(now: np.record, scene: Scene) -> None:
    """What the laws take from the static start: height and place of the sheave, departure angle, tension."""
    setpoint, measured = now.setpoint, now.measured
    setpoint.height, setpoint.track[:2] = now.sheave.position[2], now.sheave.position[:2]
    setpoint.departure = measured.departure
    if scene.setpoint.nominal_angle_deg is None:
        setpoint.angle = min(max(measured.departure, STEEPEST), FLATTEST)
    setpoint.tension.at_start = measured.tension
    rate = scene.setpoint.max_excess_rate
    setpoint.max_excess_rate = EXCESS_TENSION * measured.tension / impedance(scene) if rate is None else rate


def impedance(scene: Scene) -> float:
    """Largest sqrt(EA m) of the sections [N s/m]: the tension of an axial wave over the rate that sends it."""
    cable = scene.cable
    materials = [material_of(cable, section) for section in cable.sections.values()]
    return max(sqrt(material.axial_stiffness * material.mass_per_length) for material in materials)


def setpoint_warnings(scene: Scene, speed: float) -> Iterator[Problem]:
    """A waterline law on a cable so flat that it is limited; speed of the water past the tow [m/s]."""
    block = scene.setpoint
    if block.algorithm not in WATERLINE:
        return
    given = block.nominal_angle_deg
    theta = min(first_angle(scene, speed) if given is None else abs(radians(given)), FLATTEST)
    gain = 1.0 / cos(theta)
    if gain <= KNEE * block.max_gain:
        return
    what = "estimated" if given is None else "setpoint.nominal_angle_deg"
    yield Problem(
        "setpoint.algorithm",
        f"= {block.algorithm.value}: 1/cos({degrees(theta):.0f} deg) = {gain:.1f} m of pay-out per m of heave (the "
        f"angle is {what}), of which {cos(theta):.2g} m is the motion of the sheave along the cable; the rest strains "
        f"the tow. It is limited to a gain of {block.max_gain:g} (setpoint.max_gain), {block.max_excess:g} m "
        "(setpoint.max_excess) and setpoint.max_excess_rate, with the flag SETPOINT_LIMITED",
        "Take simplified_sheave; the waterline laws are for cables steeper than "
        f"{degrees(acos(1.0 / (KNEE * block.max_gain))):.0f} deg",
    )
