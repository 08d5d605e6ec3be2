"""Instruments that cannot show what is asked of them, and faults that nothing can have."""

from __future__ import annotations

from collections.abc import Iterator

from ...physics.heave_compensation import SetpointLaw
from ...physics.sensor_models import DEVICES, MAX_LATE, PATHS, SIGNALS, TARGETS, FaultKind, Feedback
from ..problem import Limit, Problem, changed, idle
from ..scene import Scene
from ..tables.drum_layers import layered
from ..tables.rigid_tables import flaps_of
from ..tables.sensor_tables import aboard, devices

WITHIN = 0.01  # of a rate, that whole ticks may be off
BY_ANGLE = (SetpointLaw.RIGOROUS_SHEAVE, SetpointLaw.RIGOROUS_WATERLINE)
SIZED = (FaultKind.BIAS, FaultKind.DRIFT, FaultKind.NOISE, FaultKind.LATE, FaultKind.RUNAWAY)
COUNTERS = ("encoder", "metering_sheave")
OF_PATH = {
    "command": ("none", "frozen", "bias", "drift", "noise", "late", "lost", "runaway"),
    "drive": ("none", "frozen", "bias", "drift", "noise", "runaway"),
    "flaps": ("none", "frozen", "bias", "drift", "noise", "late", "lost", "stuck", "runaway"),
}
DEVICE_OF = {fault: DEVICES[device] for _, device, fault in SIGNALS if fault} | {path: path for path in PATHS}


def instrument_problems(scene: Scene) -> Iterator[Problem]:
    """What makes instruments and faults senseless."""
    yield from _rates(scene)
    yield from _encoder(scene)
    yield from feed_problems(scene)
    yield from fault_problems(scene)


def _rates(scene: Scene) -> Iterator[Problem]:
    tick = scene.solver.tick
    for name, device in zip(DEVICES, devices(scene), strict=True):
        if not device.on or device.rate is None:
            continue
        ticks = max(round(1.0 / (device.rate * tick)), 1)
        if abs(1.0 / (device.rate * tick) - ticks) > WITHIN * ticks:
            yield Problem(
                f"instruments.{name}.rate",
                f"= {device.rate:g} Hz is no whole number of ticks of {tick:g} s (solver.tick) between two readings",
                f"Give {1.0 / (ticks * tick):.6g} Hz",
            )


def _encoder(scene: Scene) -> Iterator[Problem]:
    encoder, layers = scene.instruments.encoder, layered(scene)
    if not encoder.on or encoder.layer_error == 0:
        return
    key, radius = "instruments.encoder.layer_error", layers.radius + encoder.layer_error * layers.lay_rise
    if scene.winch.lay_width == 0.0:
        text = f"= {encoder.layer_error}, but without winch.lay_width the drum has no layers"
        yield Problem(key, text, "Give winch.lay_width, or instruments.encoder.slip")
    else:
        lead = f"= {encoder.layer_error} makes the radius"
        yield from Limit(key, radius, ">", 0.0, "m", "", lead).problems("", "Give fewer layers")


def feed_problems(scene: Scene) -> Iterator[Problem]:
    """A law that the instruments aboard cannot serve: what is asked of one that is given while it runs, too."""
    if scene.instruments.feed is Feedback.TRUTH:
        return
    key, law = "instruments.feed", scene.setpoint.algorithm
    if not aboard(scene):
        yield Problem(key, "= instruments, but none is aboard", "Give instruments.mru.on: true and the like")
    elif law is SetpointLaw.CONSTANT_TENSION and not scene.instruments.load_pin.on:
        text = f"= instruments, but setpoint.algorithm = {law.value} goes by the tension, and no load pin is on"
        yield Problem(key, text, "Give instruments.load_pin.on: true, or instruments.feed: truth")
    elif law not in (SetpointLaw.HOLD, SetpointLaw.CONSTANT_TENSION) and not scene.instruments.mru.on:
        text = f"= instruments, but setpoint.algorithm = {law.value} goes by the motion of the sheave, and no MRU is on"
        yield Problem(key, text, "Give instruments.mru.on: true, or setpoint.algorithm: hold")
    elif law in BY_ANGLE:
        text = (
            f"= instruments, but setpoint.algorithm = {law.value} goes by the departure angle, which no instrument "
            "aboard measures"
        )
        yield Problem(key, text, "Take the simplified law, or instruments.feed: truth")


def fault_problems(scene: Scene) -> Iterator[Problem]:
    """A fault that its target cannot have: what is asked of one that is given while it runs, too."""
    for target in TARGETS:
        fault = getattr(scene.faults, target)
        if fault.kind is FaultKind.NONE:
            continue
        key, kind = f"faults.{target}", fault.kind.value
        if target == "flaps" and not flaps_of(scene):
            yield Problem(f"{key}.kind", f"= {kind}, but no body has a flap: there is nothing to be wrong", "Give none")
            continue
        if target in PATHS:
            known = OF_PATH[target]
        else:
            known = tuple(k.value for k in FaultKind if k is not FaultKind.RESET or target in COUNTERS)
            device = DEVICE_OF[target]
            if not getattr(scene.instruments, device).on:
                text = f"= {kind}, but instruments.{device}.on is false: there is nothing to be wrong"
                yield Problem(f"{key}.kind", text, f"Give instruments.{device}.on: true, or kind: none")
                continue
        if kind not in known:
            yield Problem(f"{key}.kind", f"= {kind} is nothing that {target} can have", f"Give {', '.join(known)}")
        elif fault.kind in SIZED and fault.size == 0.0:
            yield Problem(
                f"{key}.size", f"= 0, so that {kind} changes nothing", f"Give {key}.size first, how much it is"
            )
        elif fault.kind is FaultKind.LATE and not 0.0 <= fault.size <= MAX_LATE:
            text = f"= {fault.size:g} s is outside [0, {MAX_LATE:g}] s, by which something may be late"
            yield Problem(f"{key}.size", text, "Give the seconds by which it is late")
        elif fault.kind is FaultKind.NOISE:
            yield from Limit(f"{key}.size", fault.size, ">=", 0.0).problems(
                "it is the deviation of a noise", "Give 0 or more"
            )


def instrument_warnings(scene: Scene) -> Iterator[Problem]:
    """Numbers of an instrument that is not aboard."""
    if scene.setpoint.algorithm is SetpointLaw.CONSTANT_TENSION and scene.instruments.feed is Feedback.INSTRUMENTS:
        yield Problem(
            "instruments.feed",
            "= instruments: constant_tension goes by the load pin, which bears both legs of the cable; where the "
            "departure angle moves, the reading moves with it, and on a sheave with little wrap more than with the "
            "tension. What it then leaves may be more than a held winch does",
            "Compare with instruments.feed: truth, and with setpoint.algorithm: hold",
        )
    if scene.instruments.altimeter.on and scene.seabed.depth is None:
        text = "= true, but there is no seabed under the tow: it gives no reading"
        yield Problem("instruments.altimeter.on", text, "Give seabed.depth, or leave the altimeter out")
    for name, device in zip(DEVICES, devices(scene), strict=True):
        if not device.on:
            key = f"instruments.{name}"
            yield from idle(key, device, changed(device), f"{key}.on is false", f"{key}.on: true")
