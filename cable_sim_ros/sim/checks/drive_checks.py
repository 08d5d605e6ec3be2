"""Checks of the drive: a motor that cannot hold the cable, modes without a motor, numbers that act on nothing."""

from __future__ import annotations

from ...physics.drum_layers import radius_of
from ...physics.winch import DrumModel
from ...physics.winch_drive import POINTS, DriveModel
from ..layout import Layout
from ..problem import Problem, apart
from ..scene import Scene
from ..tables.drum_layers import layered
from .mode_checks import BRAKES, mode_problems

OF_MOTOR = ("inertia", "curve_speed", "curve_pull", "max_power", "viscous_friction", "dry_friction", "brake_pull")
LEAST_DAMPING = 0.1
LIGHT = 0.2  # of the mass of the towbody: a controller that counts with less is soft against the tow


def drive_problems(scene: Scene) -> list[Problem]:
    """What makes a drive senseless."""
    drive, found = scene.drive, list(mode_problems(scene))
    if drive.dead_time >= scene.winch.command_timeout:
        found.append(
            Problem(
                "drive.dead_time",
                f"= {drive.dead_time:g} s is not below winch.command_timeout = {scene.winch.command_timeout:g} s: "
                "a stream of commands would be stale before it moves the drum",
                "Make it shorter, or the time-out longer",
            )
        )
    most = 2.0 * drive.damping * drive.bandwidth
    gain = 0.25 * drive.bandwidth if drive.length_gain is None else drive.length_gain
    if drive.model is not DriveModel.SERVO and drive.damping > 0.0 and gain >= most:
        found.append(
            Problem(
                "drive.length_gain",
                f"= {gain:g} 1/s is not below {most:.3g} 1/s, twice drive.damping times drive.bandwidth: the length "
                "swings up by itself",
                f"Give {0.25 * most:.2g} 1/s or less, or more damping",
            )
        )
    if drive.model is not DriveModel.MOTOR:
        return found
    if drive.damping < LEAST_DAMPING:
        found.append(
            Problem(
                "drive.damping",
                f"= {drive.damping:g} is below {LEAST_DAMPING:g}: the controller of the motor rings without end",
                "Give 0.7; 0 is a loop of first order for drive.model: rate_loop alone",
            )
        )
    if drive.bandwidth * scene.solver.tick > 1.0:
        found.append(
            Problem(
                "drive.bandwidth",
                f"= {drive.bandwidth:g} rad/s is faster than solver.tick = {scene.solver.tick:g} s can follow, "
                f"{1.0 / scene.solver.tick:.3g} rad/s",
                "Make either smaller",
            )
        )
    if drive.inertia <= 0.0:
        found.append(
            Problem(
                "drive.inertia",
                f"= {drive.inertia:g} kg m^2, but drive.model = motor turns it",
                "Give the inertia of motor (times the ratio of its gear squared), drum and wound cable about the drum",
            )
        )
    speeds, pulls = drive.curve_speed, drive.curve_pull
    rising = all(a < b for a, b in zip(speeds, speeds[1:], strict=False))
    if not 2 <= len(speeds) <= POINTS or len(pulls) != len(speeds) or not rising or speeds[0] != 0.0:
        found.append(
            Problem(
                "drive.curve_speed",
                f"has {len(speeds)} speeds and drive.curve_pull {len(pulls)} pulls, expected 2 to {POINTS} of each, "
                "speeds rising from 0 m/s",
                "Give the line pull of the motor at these line speeds, as on its data sheet",
            )
        )
    elif speeds[-1] < scene.winch.max_rate:
        found.append(
            Problem(
                "drive.curve_speed",
                f"ends at {speeds[-1]:g} m/s, below winch.max_rate = {scene.winch.max_rate:g} m/s, where the motor has "
                "no pull left: the cable would run off the drum",
                f"Carry the curve to {scene.winch.max_rate:g} m/s or more, or make winch.max_rate smaller",
            )
        )
    if scene.winch.drum is DrumModel.CONTACT:
        found.append(
            Problem(
                "drive.model",
                "= motor turns a drum that feeds; with winch.drum = contact the cable's end is led on its path",
                "Give winch.drum: feed",
            )
        )
    return found


def layer_problems(layout: Layout) -> list[Problem]:
    """Layers that cannot be wound."""
    scene = layout.scene
    winch, drum = scene.winch, layered(scene)
    if winch.lay_width == 0.0:
        return []
    if winch.drum is DrumModel.CONTACT:
        text = f"= {winch.lay_width:g} m winds layers, but with winch.drum = contact the drum is one cylinder"
        return [Problem("winch.lay_width", text, "Leave it out, or give winch.drum: feed")]
    if drum.lay_turns < 1.0:
        text = f"= {winch.lay_width:g} m is less than one turn of {drum.lay_pitch:.3g} m (winch.lay_pitch)"
        return [Problem("winch.lay_width", text, "Give the width between the flanges")]
    outside = float(radius_of(drum, layout.route.wound)) + 0.5 * scene.cable.diameter
    if winch.flange_radius is None or outside <= winch.flange_radius:
        return []
    return [
        Problem(
            "winch.flange_radius",
            "= {} m is less than {} m, the outer radius of {:.4g} m of cable in layers of winch.lay_width = {:g} m: "
            "the drum has no room for it".format(
                *apart(winch.flange_radius, outside), layout.route.wound, winch.lay_width
            ),
            "Wind less cable (winch.cable_on_drum), or give a wider drum",
        )
    ]


def holding_problems(layout: Layout) -> list[Problem]:
    """A motor or a brake that cannot hold the tow at its start."""
    scene = layout.scene
    drive = scene.drive
    if drive.model is not DriveModel.MOTOR or drive_problems(scene):
        return []
    pull, found = float(layout.shape().tension.max()), []  # without the weight between sheave and drum
    drum = layered(scene)
    gear = float(drum.radius / radius_of(drum, layout.route.wound))  # pulls are given for the first layer
    most, brake = gear * drive.curve_pull[0], gear * drive.brake_pull
    if most <= pull and drive.mode not in BRAKES:
        found.append(
            Problem(
                "drive.curve_pull",
                "begins with {} N at the layer that runs off, not above the {} N with which the tow pulls at its "
                "start: the motor cannot hold it".format(*apart(most, pull)),
                "Give a stronger motor, or a lighter or slower tow",
            )
        )
    if 0.0 < brake <= pull:
        found.append(
            Problem(
                "drive.brake_pull",
                "holds {} N at the layer that runs off, not above the {} N with which the tow pulls at its start: "
                "the brake cannot hold it".format(*apart(brake, pull)),
                "Give a stronger brake, or a lighter or slower tow",
            )
        )
    return found


def drive_warnings(scene: Scene) -> list[Problem]:
    """Numbers of a motor that is not there, or gains that hold the tow softly."""
    drive = scene.drive
    if drive.model is DriveModel.MOTOR:
        radius = scene.winch.drum_radius + 0.5 * scene.cable.diameter
        mass, tow = drive.controller_mass or drive.inertia / radius**2, scene.towbody.mass
        if mass >= LIGHT * tow:
            return []
        return [
            Problem(
                "drive.inertia" if drive.controller_mass is None else "drive.controller_mass",
                f"makes {mass:.3g} kg at the cable, less than {LIGHT:g} of towbody.mass = {tow:g} kg: the gains of the "
                "motor are made for the bare drum and hold the tow softly",
                f"Give drive.controller_mass, {mass + tow:.3g} kg for drum and towbody",
            )
        ]
    given = [key for key in OF_MOTOR if getattr(drive, key) != type(drive).model_fields[key].default]
    return [
        Problem(
            f"drive.{key}",
            f"has no effect: drive.model = {drive.model.value} has no motor",
            "Leave it out, or give drive.model: motor",
        )
        for key in given
    ]
