"""Checks of the drive: a motor that cannot hold the cable, modes without a motor, numbers that act on nothing.

Checks of feed-forward and prediction: a drive that has no inverse, options that act on nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...physics.drum_layers import radius_of
from ...physics.heave_compensation import SetpointLaw
from ...physics.winch import DrumModel
from ...physics.winch_drive import POINTS, DriveModel, WinchMode
from ..compensation_setup import horizon
from ..layout import Layout
from ..problem import Limit, Problem, idle, rounded_down
from ..scene import Scene
from ..tables.drum_layers import layered

WITHOUT = (SetpointLaw.HOLD, SetpointLaw.CONSTANT_TENSION)  # laws that ask for nothing that the ship's motion gives

OF_MOTOR = (
    *("inertia", "controller_mass", "curve_speed", "curve_pull", "max_power", "viscous_friction", "dry_friction"),
    *("set_pull", "brake_pull", "brake_slip", "brake_set_time", "brake_lift_time"),
)
OF_LOOP = "bandwidth", "damping", "length_gain", "dead_band"
OF_LAYERS = "lay_pitch", "lay_rise", "flange_radius"
SLACKER = 0.9  # of what the tow pulls at its start: a set pull below it pays out from the start on
LEAST_DAMPING = 0.1
LIGHT = 0.2  # of the mass of the towbody: a controller that counts with less is soft against the tow
PULLS = (WinchMode.TENSION, WinchMode.RENDER)
AT_START = "with which the tow pulls at its start"
RUNS_OFF = "# at the layer that runs off"
BRAKES = (WinchMode.BRAKE, WinchMode.EMERGENCY_STOP)


def feed_forward_problems(scene: Scene) -> Iterator[Problem]:
    """A drive that cannot be inverted: what is asked of a feed-forward that is set while it runs, too."""
    servo = scene.drive.model is DriveModel.SERVO
    if scene.setpoint.feed_forward and servo and scene.winch.derivative_gain <= 0.0:
        yield Problem(
            "setpoint.feed_forward",
            "= true inverts the servo, but winch.derivative_gain = 0 1/s: without it the servo swings by itself and "
            "its inverse needs the set-point's acceleration at once",
            "Give winch.derivative_gain above 0 1/s, or leave the feed-forward out",
        )


def setpoint_option_warnings(scene: Scene) -> Iterator[Problem]:
    """Options of the laws that act on nothing."""
    block = scene.setpoint
    if block.algorithm in WITHOUT:
        why = f"setpoint.algorithm = {block.algorithm.value} asks for nothing that follows from the ship's motion"
        yield from idle("setpoint", block, ["feed_forward", "prediction"], why, "one of the sheave laws")
    if horizon(scene) == 0.0:
        why = f"{'drive.dead_time' if block.horizon is None else 'setpoint.horizon'} = 0 s, nothing to look ahead to"
        yield from idle("setpoint", block, ["prediction"], why, "setpoint.horizon or drive.dead_time in s")


def mode_problems(scene: Scene) -> Iterator[Problem]:
    """A mode, set pull or time-out that the drive cannot serve: asked of one that is given while it runs, too."""
    drive = scene.drive
    timeout = scene.winch.command_timeout
    yield from Limit("drive.dead_time", drive.dead_time, "<", timeout, "s", "winch.command_timeout").problems(
        "a stream of commands would be stale before it moves the drum", "Make it shorter, or the time-out longer"
    )
    if drive.mode is not WinchMode.FOLLOW and drive.model is not DriveModel.MOTOR:
        yield Problem(
            "drive.mode",
            f"= {drive.mode.value} needs a motor and a brake, but drive.model = {drive.model.value} has none",
            "Give drive.model: motor with inertia, curve and brake, or drive.mode: follow",
        )
    elif drive.mode in PULLS:
        yield from Limit("drive.set_pull", drive.set_pull, ">", 0.0, "N").problems(
            f"drive.mode = {drive.mode.value} pulls with it, and the cable would run off the drum",
            "Give the pull at the drum that is to be kept, in N",
        )
        most = max(drive.curve_pull, default=drive.set_pull)
        yield from Limit("drive.set_pull", drive.set_pull, "<=", most, "N", "the most of drive.curve_pull").problems(
            f"drive.mode = {drive.mode.value} would never come to it", "Give less, or a stronger motor"
        )
    elif drive.mode in BRAKES:
        yield from Limit("drive.brake_pull", drive.brake_pull, ">", 0.0, "N").problems(
            f"drive.mode = {drive.mode.value} hands the cable to the brake, and it would run off the drum",
            "Give the pull at the drum that the set brake holds, in N",
        )


def drive_problems(scene: Scene) -> Iterator[Problem]:
    """What makes a drive senseless."""
    drive = scene.drive
    yield from mode_problems(scene)
    most = 2.0 * drive.damping * drive.bandwidth
    gain = 0.25 * drive.bandwidth if drive.length_gain is None else drive.length_gain
    if drive.model is not DriveModel.SERVO and drive.damping > 0.0:
        twice = "twice drive.damping times drive.bandwidth"
        yield from Limit("drive.length_gain", gain, "<", most, "1/s", twice).problems(
            "the length swings up by itself", f"Give {0.25 * most:.2g} 1/s or less, or more damping"
        )
    if drive.model is not DriveModel.MOTOR:
        return
    yield from Limit("drive.damping", drive.damping, ">=", LEAST_DAMPING).problems(
        "the controller of the motor rings without end",
        "Give 0.7; 0 is a loop of first order for drive.model: rate_loop alone",
    )
    tick = f"the most that solver.tick = {scene.solver.tick:g} s can follow"
    yield from Limit("drive.bandwidth", drive.bandwidth, "<=", 1.0 / scene.solver.tick, "rad/s", tick).problems(
        "", f"Give solver.tick (--every) of {rounded_down(1.0 / drive.bandwidth):g} s or less, or a slower controller"
    )
    yield from Limit("drive.inertia", drive.inertia, ">", 0.0, "kg m^2").problems(
        "drive.model = motor turns it",
        "Give the inertia of motor (times the ratio of its gear squared), drum and wound cable about the drum",
    )
    speeds, pulls = drive.curve_speed, drive.curve_pull
    rising = all(a < b for a, b in zip(speeds, speeds[1:], strict=False))
    if not 2 <= len(speeds) <= POINTS or len(pulls) != len(speeds) or not rising or speeds[0] != 0.0:
        yield Problem(
            "drive.curve_speed",
            f"has {len(speeds)} speeds and drive.curve_pull {len(pulls)} pulls, expected 2 to {POINTS} of each, "
            "speeds rising from 0 m/s",
            "Give the line pull of the motor at these line speeds, as on its data sheet",
        )
    else:
        most = scene.winch.max_rate
        yield from Limit("drive.curve_speed", speeds[-1], ">=", most, "m/s", "winch.max_rate", "ends at").problems(
            "where the motor has no pull left, and the cable would run off the drum",
            "Carry the curve to it or beyond, or make winch.max_rate smaller",
        )
    if scene.winch.drum is DrumModel.CONTACT:
        yield Problem(
            "drive.model",
            "= motor turns a drum that feeds; with winch.drum = contact the cable's end is led on its path",
            "Give winch.drum: feed",
        )


def layer_problems(layout: Layout) -> Iterator[Problem]:
    """Layers that cannot be wound."""
    scene = layout.scene
    winch, drum = scene.winch, layered(scene)
    if winch.lay_width == 0.0:
        return
    if winch.drum is DrumModel.CONTACT:
        text = f"= {winch.lay_width:g} m winds layers, but with winch.drum = contact the drum is one cylinder"
        yield Problem("winch.lay_width", text, "Leave it out, or give winch.drum: feed")
        return
    if drum.lay_turns < 1.0:
        text = f"= {winch.lay_width:g} m is less than one turn of {drum.lay_pitch:.3g} m (winch.lay_pitch)"
        yield Problem("winch.lay_width", text, "Give the width between the flanges")
    elif winch.flange_radius is not None:
        outside = float(radius_of(drum, layout.route.wound)) + 0.5 * scene.cable.diameter
        wound = f"outside {layout.route.wound:.4g} m of cable in layers of winch.lay_width = {winch.lay_width:g} m"
        yield from Limit("winch.flange_radius", winch.flange_radius, ">=", outside, "m", wound).problems(
            "the drum has no room for it", "Wind less cable (winch.cable_on_drum), or give a wider drum"
        )


def holding_problems(layout: Layout) -> Iterator[Problem]:
    """A motor or a brake that cannot hold the tow at its start."""
    scene = layout.scene
    drive = scene.drive
    if drive.model is not DriveModel.MOTOR or any(drive_problems(scene)):
        return
    pull, gear = _pull(layout)
    most, brake = gear * drive.curve_pull[0], gear * drive.brake_pull
    if most <= pull and drive.mode not in BRAKES:
        yield from Limit("drive.curve_pull", most, ">", pull, "N", AT_START, f"begins with {RUNS_OFF}").problems(
            "the motor cannot hold it", "Give a stronger motor, or a lighter or slower tow"
        )
    elif drive.dry_friction > 0.0:
        left = f"what the tow leaves at its start ({pull:.3g} N) of that with which drive.curve_pull begins"
        yield from Limit("drive.dry_friction", drive.dry_friction, "<", (most - pull) / gear, "N", left).problems(
            "the motor cannot haul in", "Give less friction, or a stronger motor"
        )
    if brake > 0.0:
        yield from Limit("drive.brake_pull", brake, ">", pull, "N", AT_START, f"holds {RUNS_OFF}").problems(
            "the brake cannot hold it", "Give a stronger brake, or a lighter or slower tow"
        )


def _pull(layout: Layout) -> tuple[float, float]:
    """What the tow pulls at its start [N], without the weight between sheave and drum, and what makes of a pull of the
    first layer that of the layer that runs off."""
    drum = layered(layout.scene)
    return float(layout.shape().tension.max()), float(drum.radius / radius_of(drum, layout.route.wound))


def pull_warnings(layout: Layout) -> Iterator[Problem]:
    """A motor that the tow overhauls at some speed, or set to less than the tow pulls."""
    drive, fastest = layout.scene.drive, layout.scene.winch.max_rate
    if drive.model is not DriveModel.MOTOR:
        return
    pull, gear = _pull(layout)
    speeds = np.linspace(0.0, fastest, 201)
    most = gear * np.interp(gear * speeds, drive.curve_speed, drive.curve_pull, right=0.0)
    if drive.max_power is not None:
        most[1:] = np.minimum(most[1:], drive.max_power / speeds[1:])
    weak = speeds[most <= pull]
    if len(weak) and weak[0] == 0.0:  # of a scene that begins on its brake
        yield from Limit("drive.curve_pull", most[0], ">", pull, "N", AT_START, "begins with").problems(
            "the motor cannot hold it once the brake lifts", "Give a stronger motor, or leave the brake set"
        )
    elif len(weak):
        least = int(np.argmin(most))  # a curve may dip before it ends
        key, lead = "curve_pull" if drive.max_power is None else "max_power", f"leaves # at {speeds[least]:.4g} m/s"
        yield from Limit(f"drive.{key}", most[least], ">", pull, "N", AT_START, lead).problems(
            f"paid out at {weak[0]:.3g} m/s or faster, it overhauls the motor and runs away until the brake is set",
            f"Give winch.max_rate below {weak[0]:.3g} m/s, or a stronger motor",
        )
    if drive.mode in PULLS:
        slacker = f"{SLACKER:g} of that with which the tow pulls at its start"
        yield from Limit("drive.set_pull", drive.set_pull, ">=", SLACKER * pull, "N", slacker).problems(
            f"drive.mode = {drive.mode.value} pays out from the start on, until less pulls or the travel ends",
            f"Give about {pull:.3g} N or more, or another mode",
        )


def drive_warnings(scene: Scene) -> Iterator[Problem]:
    """Numbers of a motor, a loop or layers that are not there, or gains that hold the tow softly."""
    winch = scene.winch
    yield from _drive_warnings(scene)
    if winch.lay_width == 0.0:
        why = "without winch.lay_width the drum has one layer, of any length"
        yield from idle("winch", winch, OF_LAYERS, why, "winch.lay_width, the width between the flanges")


def _drive_warnings(scene: Scene) -> Iterator[Problem]:
    drive = scene.drive
    if drive.model is DriveModel.MOTOR:
        radius = scene.winch.drum_radius + 0.5 * scene.cable.diameter
        mass, tow = drive.controller_mass or drive.inertia / radius**2, scene.towbody.mass
        key, light = "inertia" if drive.controller_mass is None else "controller_mass", f"{LIGHT:g} of towbody.mass"
        yield from Limit(f"drive.{key}", mass, ">=", LIGHT * tow, "kg", light, "makes # at the cable").problems(
            "the gains of the motor are made for the bare drum and hold the tow softly",
            f"Give drive.controller_mass, {mass + tow:.3g} kg for drum and towbody",
        )
        return
    without = f"drive.model = {drive.model.value} has no"
    yield from idle("drive", drive, OF_MOTOR, f"{without} motor", "drive.model: motor")
    if drive.model is DriveModel.SERVO:
        yield from idle("drive", drive, OF_LOOP, f"{without} rate loop", "drive.model: rate_loop or motor")
