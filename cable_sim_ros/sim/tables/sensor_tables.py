"""Instruments of a scene as numbers for kernels."""

from __future__ import annotations

from math import ceil, nan, radians

import numpy as np

from ...physics.sensor_models import (
    ALTITUDE,
    DEVICES,
    FISH_ROLL,
    FIX,
    HEAVE,
    KINDS,
    MAX_LATE,
    PIN,
    ROLL,
    SENSOR_RULES,
    SIGNAL,
    SIGNALS,
    TARGETS,
    Device,
)
from ...physics.state import NOW, State
from ..scene import Scene
from .drum_layers import layered

MIN_NEWTONS = 0.02  # on the pin per newton of tension
OWN = ("gain", "zero", "filter_time", "noise", "range_noise", "resolution")  # a rate has the gain alone
AGAIN = 2  # ticks more than the latest reading needs


def devices(scene: Scene) -> list[Device]:
    """Instruments in the order of sensor_models.DEVICES, aboard or not."""
    return [getattr(scene.instruments, name) for name in DEVICES]


def aboard(scene: Scene) -> bool:
    """Is any instrument on?"""
    return any(device.on for device in devices(scene))


def remembered(scene: Scene) -> int:
    """Ticks of the truth that instruments need: the longest latency and a fault that is as late as can be."""
    if not aboard(scene):
        return 0
    longest = max(device.latency for device in devices(scene)) + MAX_LATE
    return ceil(longest / scene.solver.tick) + AGAIN


def signal_table(scene: Scene) -> np.ndarray:
    """SIGNAL [COUNT], no rows where no instrument is on."""
    if not aboard(scene):
        return np.zeros(0, SIGNAL)
    table, tick, have = np.zeros(len(SIGNALS), SIGNAL), scene.solver.tick, scene.instruments
    table["gain"], table["maximum"] = 1.0, np.inf
    for row, (name, number, _) in zip(table, SIGNALS, strict=True):
        device = devices(scene)[number]
        row["device"], row["on"], row["rate_of"] = number, device.on, name.endswith("_rate")
        row["every"] = 1 if device.rate is None else round(1.0 / (device.rate * tick))
        row["latency"] = round(device.latency / tick)
        for key in OWN if not row["rate_of"] else ("gain",):
            given = getattr(device, key, ())
            if not isinstance(given, tuple):
                row[key] = given
    mru, fish, fix = have.mru, have.fish_attitude, slice(FIX, FIX + 3)
    table["noise"][:3], table["resolution"][:3] = mru.heave_noise, mru.heave_resolution
    table["noise"][HEAVE + 1 : ROLL] = mru.velocity_noise
    table["noise"][ROLL : ROLL + 2], table["resolution"][ROLL : ROLL + 2] = mru.angle_noise, mru.angle_resolution
    table["zero"][ROLL : ROLL + 2] = mru.angle_zero
    table["maximum"][PIN] = np.inf if have.load_pin.capacity is None else have.load_pin.capacity
    table["outlier"][fix], table["outlier_size"][fix] = have.usbl.outliers, have.usbl.outlier_size
    table["zero"][FISH_ROLL : FISH_ROLL + 3] = fish.zero
    table["on"][ALTITUDE] &= scene.seabed.depth is not None
    table["maximum"][ALTITUDE] = np.inf if have.altimeter.max_range is None else have.altimeter.max_range
    return table


def sensor_rules(scene: Scene) -> np.ndarray:
    """SENSOR_RULES [1], no row where no instrument is on."""
    row = np.zeros(1 if aboard(scene) else 0, SENSOR_RULES)
    if not len(row):
        return row
    have, mru, pin = scene.instruments, scene.instruments.mru, scene.instruments.load_pin
    row["seed"] = have.seed
    row["declared"], row["place"] = mru.position, np.add(mru.position, mru.lever_error)
    row["sheave"], row["seabed"] = scene.sheave.position, scene.seabed.depth or 0.0
    row["period"], row["damping"] = mru.heave_period, mru.heave_damping
    row["alignment"] = round(mru.alignment_time / scene.solver.tick)
    row["leak"], row["settling"] = mru.turn_leak, mru.turn_settling
    row["slip"], row["wrong_layer"] = have.encoder.slip, have.encoder.layer_error * layered(scene)["lay_rise"]
    row["metering_least"] = have.metering_sheave.min_tension or -np.inf
    row["axis"] = nan if pin.axis_deg is None else radians(pin.axis_deg)
    row["transducer"] = np.add(have.usbl.position, have.usbl.lever_error)
    row["transducer_error"], row["transducer_turn"][0, 3:] = have.usbl.lever_error, have.usbl.angle_error
    row["newtons"] = nan if pin.calibration is None else pin.calibration
    return row


def faults_of(state: State, target: str) -> list[tuple[np.record, float]]:
    """FAULT records of a target, and what each is of now; none where there is no such device or body."""
    now = state.memory[NOW]
    if target == "command":
        return [(now.winch.fault, 0.0)]
    if target == "drive":
        return [(now.winch.drive_fault, now.winch.length)]
    if target == "flaps":
        return [(attitude.fault, 0.0) for attitude in state.attitude[NOW]]
    return [(one.fault, one.shown) for one, (_, _, of) in zip(state.sensors.sensed, SIGNALS) if of == target]


def declare_faults(state: State, scene: Scene) -> None:
    """The faults that a scene begins with."""
    for target in TARGETS:
        put_fault(state, scene, target)


def keep_faults(state: State, scene: Scene) -> None:
    """Of a state that was taken back, the faults that the scene has not are put as the scene has them."""
    for target in TARGETS:
        fault, records = getattr(scene.faults, target), faults_of(state, target)
        if records and (records[0][0].kind, records[0][0].amount) != (KINDS.index(fault.kind), fault.size):
            put_fault(state, scene, target)


def put_fault(state: State, scene: Scene, target: str) -> None:
    """The fault that a scene has of a target, from now on."""
    fault, now = getattr(scene.faults, target), state.memory[NOW].time.now
    for record, at in faults_of(state, target):
        record["kind"], record["amount"] = KINDS.index(fault.kind), fault.size
        record["since"], record["at"] = now, at


def pin_problem(state: State, scene: Scene) -> str:
    """ "" or why a load pin cannot be calibrated at the static start."""
    pin = scene.instruments.load_pin
    if not pin.on or pin.calibration is not None or state.sensors.sensing[0].newtons >= MIN_NEWTONS:
        return ""
    axis = "none" if pin.axis_deg is None else f"{pin.axis_deg:g}"
    return (
        f"instruments.load_pin.axis_deg = {axis}: the pin bears {state.sensors.sensing[0].newtons:.3g} N per newton of "
        f"tension along it at the static start, less than {MIN_NEWTONS:g}; no tension can be taken from that, and "
        "nothing was started. Give the direction of the resultant, or instruments.load_pin.calibration"
    )
