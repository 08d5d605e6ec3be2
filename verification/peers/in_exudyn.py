"""Exudyn: ANCFCable2D, generalised-alpha, planar with z as its second coordinate.

P4: penalty contact of every element, as ``points`` straight segments, with a fixed circle. P5, P6: drag, wet weight and
the towbody are one ObjectGenericODE2 on all nodes, whose force and Jacobian are compiled; drag is integrated at
``points`` Gauss points an element and is in the Jacobian, as lumped or lagged drag costs per cents of heave. Nodes
carry four coordinates, displacement and slope less those of a line along x. The frame heaves with the tow point.
"""

from __future__ import annotations

import sys
import time
from contextlib import redirect_stdout
from functools import cache
from io import StringIO
from math import pi, sqrt
from typing import Any

import numpy as np
from numba import njit

from ..ours import DEEP, Ours, leaving_tension, ramped_heave
from ..scenes import reference
from .common import Setting, silent, static_places, static_tension

APPROACH, APPROACH_STEP = 20.0, 0.05  # s, from the reference's static shape until its own statics converge
TOLERANCE = 1e-6  # of Newton
RHO, RHO_SHEAVE = 0.5, 0.3  # spectral radius; of P4
TINY = 1e-200  # in place of zeros, which sparse matrices may not contain


@njit(error_model="numpy", cache=True)
def _wet(q, v, arc, gauss, shapes, slopes, stream, rise, across, along, force, blocks, by_q, by_v):
    """Adds the drag of a stream (stream, -rise) [m/s] to force [4 nodes] (N, N m) and subtracts its derivatives by q
    and v, times by_q and by_v, from blocks [elements, 8, 8], where there are any. shapes, slopes [points, 4]: Hermite
    on an element of unit length."""
    for e in range(len(arc) - 1):
        length = arc[e + 1] - arc[e]
        for k in range(len(gauss)):
            n = (shapes[k, 0], length * shapes[k, 1], shapes[k, 2], length * shapes[k, 3])
            d = (slopes[k, 0] / length, slopes[k, 1], slopes[k, 2] / length, slopes[k, 3])
            gx, gz, ux, uz = 1.0, 0.0, stream, -rise
            for a in range(4):
                i = 4 * e + 2 * a
                gx, gz = gx + d[a] * q[i], gz + d[a] * q[i + 1]
                ux, uz = ux - n[a] * v[i], uz - n[a] * v[i + 1]
            g = sqrt(gx * gx + gz * gz)
            tx, tz = gx / g, gz / g
            # components along the cable and across it, (-tz, tx)
            s, c = ux * tx + uz * tz, uz * tx - ux * tz
            w = gauss[k] * length
            fs, fc = w * along * abs(s) * s, w * across * abs(c) * c
            fx, fz = fs * tx - fc * tz, fs * tz + fc * tx
            for a in range(4):
                force[4 * e + 2 * a] += n[a] * fx
                force[4 * e + 2 * a + 1] += n[a] * fz
            if len(blocks) == 0:
                continue
            ks, kc = 2.0 * w * along * abs(s), 2.0 * w * across * abs(c)
            # by the velocity of the water; by the angle of the cable, which turns s by c and c by -s
            xx, xz, zz = ks * tx * tx + kc * tz * tz, (ks - kc) * tx * tz, ks * tz * tz + kc * tx * tx
            turn_x, turn_z = ks * c * tx + kc * s * tz - fz, ks * c * tz - kc * s * tx + fx
            for a in range(4):
                for b in range(4):
                    m, t = by_v * n[a] * n[b], by_q * n[a] * d[b] / g
                    blocks[e, 2 * a, 2 * b] += m * xx + t * turn_x * tz
                    blocks[e, 2 * a, 2 * b + 1] += m * xz - t * turn_x * tx
                    blocks[e, 2 * a + 1, 2 * b] += m * xz + t * turn_z * tz
                    blocks[e, 2 * a + 1, 2 * b + 1] += m * zz - t * turn_z * tx


def hermite(points: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss weights [points], cubic shape functions and their slopes [points, 4] on an element of unit length."""
    x, weight = np.polynomial.legendre.leggauss(points)
    x, one = 0.5 * (x + 1.0), np.ones(points)
    cubic = np.array(((1, 0, -3, 2), (0, 1, -2, 1), (0, 0, 3, -2), (0, 0, -1, 1)), float)
    return (
        0.5 * weight,
        np.stack((one, x, x**2, x**3), 1) @ cubic.T,
        np.stack((0 * one, one, 2 * x, 3 * x**2), 1) @ cubic.T,
    )


class Stream:
    """Load of the cable in the stream, seen from a frame that heaves as ``motion`` [instants, 2] (velocity,
    acceleration) at ``times``: drag, wet weight, inertia of the frame; the towbody on the last node."""

    def __init__(self, arc: np.ndarray, points: int, p: dict, times: np.ndarray, motion: np.ndarray) -> None:
        self.arc, self.p, self.times, self.motion, size = arc, p, times, motion, 4 * len(arc)
        self.rule = hermite(points)
        self.drag = 0.5 * p["rho"] * p["d"] * p["Cdn"], 0.5 * p["rho"] * p["d"] * pi * p["Cdt"]
        length = np.diff(arc)
        spread = np.zeros((len(arc), 4))  # of a unit load down the cable
        for k, at in ((0, slice(None, -1)), (1, slice(1, None))):
            spread[at, 1] += 0.5 * length
            spread[at, 3] += (1.0, -1.0)[k] * length**2 / 12.0
        self.mass, self.weight = p["mu"] * spread.ravel(), p["w"] * spread.ravel()
        self.mass[size - 3] += p["M"]
        self.weight[size - 3] += p["Wnet"]
        self.blocks = np.zeros((len(length), 8, 8))
        mine = 4 * np.arange(len(length))[:, None] + np.arange(8)
        # row, column, value of the blocks; shared places are summed
        self.triplets = np.column_stack(
            (np.repeat(mine, 8, axis=1).ravel(), np.tile(mine, 8).ravel(), self.blocks.ravel())
        )

    def _state(self, t: float) -> tuple[float, float]:
        return np.interp(t, self.times, self.motion[:, 0]), np.interp(t, self.times, self.motion[:, 1])

    def force(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Generalised load at displacements q and velocities v of the nodes."""
        rise, lift = self._state(t)
        force = -self.weight - lift * self.mass
        _wet(q, v, self.arc, *self.rule, self.p["U"], rise, *self.drag, force, self.blocks[:0], 0.0, 0.0)
        return force

    def jacobian(self, t: float, q: np.ndarray, v: np.ndarray, by_q: float, by_v: float) -> np.ndarray:
        """Derivative of the left-hand side, by_q and by_v its factors, as [entries, 3]: row, column, value."""
        rise, unused = self._state(t)[0], np.zeros(len(q))
        self.blocks[:] = TINY
        _wet(q, v, self.arc, *self.rule, self.p["U"], rise, *self.drag, unused, self.blocks, by_q, by_v)
        self.triplets[:, 2] = self.blocks.ravel()
        return self.triplets


@cache
def _library() -> tuple[Any, Any]:
    """The compiled module without range checks, which it offers for speed, and its items; its greeting is not shown."""
    sys.exudynFast = True
    with redirect_stdout(StringIO()):
        import exudyn
    return exudyn, exudyn.itemInterface


def _cable(system: Any, arc: np.ndarray, places: np.ndarray, slopes: np.ndarray, p: dict) -> tuple[list, list]:
    """Nodes and elements of a cable, begun at places and slopes [nodes, 2] (its reference is a line along x, from its
    first node, whose displacement therefore is zero)."""
    items = _library()[1]
    line = places[0] + np.column_stack((arc, 0.0 * arc))
    nodes = [
        system.AddNode(
            items.NodePoint2DSlope1(
                referenceCoordinates=[*at, 1.0, 0.0], initialCoordinates=[*(r - at), *(g - (1.0, 0.0))]
            )
        )
        for at, r, g in zip(line, places, slopes, strict=True)
    ]
    more = {"massPerLength": p["mu"], "bendingStiffness": p["EI"], "axialStiffness": p["EA"]}
    return nodes, [
        system.AddObject(
            items.ObjectANCFCable2D(length=length, nodeNumbers=[a, b], useReducedOrderIntegration=1, **more)
        )
        for length, a, b in zip(np.diff(arc), nodes[:-1], nodes[1:], strict=True)
    ]


def _weigh(system: Any, cables: list, gravity: float) -> None:
    items = _library()[1]
    for cable in cables:
        marker = system.AddMarker(items.MarkerBodyMass(bodyNumber=cable))
        system.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0.0, -gravity, 0.0]))


def _sparse(triplets, size: int) -> Any:
    """Square matrix of (row, column, value)."""
    exu = _library()[0]
    matrix = exu.MatrixContainer()
    matrix.SetWithSparseMatrix(np.asarray(triplets, float), size, size)
    return matrix


def _pin(system: Any, node: int) -> tuple[list, list]:
    """Holds a node's place; its two constraints and the sensors of their forces."""
    exu, items = _library()
    ground, *moving = (
        system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=k))
        for n, k in ((system.AddNode(items.NodePointGround()), 0), (node, 0), (node, 1))
    )
    pins = [system.AddObject(items.CoordinateConstraint(markerNumbers=[ground, marker])) for marker in moving]
    return pins, [
        system.AddSensor(
            items.SensorObject(objectNumber=pin, storeInternal=True, outputVariableType=exu.OutputVariableType.Force)
        )
        for pin in pins
    ]


def _watch(system: Any, node: int) -> int:
    """Sensor of a node's place."""
    exu, items = _library()
    return system.AddSensor(
        items.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=exu.OutputVariableType.Position)
    )


def _settings(dt: float, duration: float, interval: float, rho: float, start: float = 0.0) -> Any:
    exu = _library()[0]
    settings = exu.SimulationSettings()
    march = settings.timeIntegration
    march.numberOfSteps, march.startTime, march.endTime = int(round(duration / dt)), start, start + duration
    march.generalizedAlpha.spectralRadius = rho
    march.newton.useModifiedNewton = True
    march.newton.relativeTolerance = TOLERANCE
    march.verboseMode = 0
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = interval
    settings.parallel.numberOfThreads = 1
    return settings


def _settle(system: Any, size: int, duration: float, dt: float) -> None:
    """Brings a system to rest: a while of strongly damped motion, from which its statics converge."""
    exu = _library()[0]
    settings = _settings(dt, duration, duration, RHO)
    system.SolveDynamic(settings, updateInitialValues=True)
    system.systemData.SetODE2Coordinates_t(np.zeros(size), exu.ConfigurationType.Initial)
    system.SolveStatic(settings, updateInitialValues=True)


def _timed(system: Any, settings: Any) -> float:
    begin = time.process_time()
    system.SolveDynamic(settings)
    return time.process_time() - begin


def _told(system: Any, place: int, pulls: list) -> np.ndarray:
    """History: t, x, z, force of the pins."""
    where, force = system.GetSensorStoredData(place), [system.GetSensorStoredData(s)[:, 1] for s in pulls]
    return np.column_stack((where[:, :3], np.hypot(*force)))


def exudyn_released(setting: Setting) -> Ours:
    """P2: t, tip_x, tip_z, top_tension."""
    exu = _library()[0]
    p = reference("P2").params
    arc = setting.arc(p["L"])
    level = np.column_stack((arc, 0.0 * arc)), np.tile((1.0, 0.0), (len(arc), 1))
    with silent():
        system = exu.SystemContainer().AddSystem()
        nodes, cables = _cable(system, arc, *level, p)
        _weigh(system, cables, p["g"])
        (_, pulls), tip = _pin(system, nodes[0]), _watch(system, nodes[-1])
        system.Assemble()
        cpu = _timed(system, _settings(setting.dt, p["T"], p["dt_out"], RHO))
        history = _told(system, tip, pulls)
    return Ours(str(setting), setting.elements, setting.dt, history, cpu, p["T"], 0, int(round(p["T"] / setting.dt)))


def exudyn_towed(setting: Setting) -> Ours:
    """P5 and P6: t, tip_x, tip_z, top_tension; begun on its own static shape."""
    exu, items = _library()
    p = reference("P5").params
    arc, times = setting.arc(p["L"]), setting.dt * np.arange(int(round(p["T"] / setting.dt)) + 1)
    wet = Stream(arc, setting.points, p, APPROACH + times, ramped_heave(p, times)[:, 0][:, [5, 8]])
    places = static_places(arc)
    slopes = np.gradient(places, arc, axis=0)
    slopes *= (1.0 + static_tension(arc) / p["EA"])[:, None] / np.linalg.norm(slopes, axis=1)[:, None]
    with silent():
        system = exu.SystemContainer().AddSystem()
        nodes, _ = _cable(system, arc, places, slopes, p)
        size = 4 * len(arc)
        body = _sparse([(size - 4, size - 4, p["M"]), (size - 3, size - 3, p["M"])], size)
        system.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=nodes,
                massMatrix=body,
                forceUserFunction=lambda mbs, t, item, q, v: wet.force(t, np.asarray(q), np.asarray(v)),
                jacobianUserFunction=lambda mbs, t, item, q, v, a, b: _sparse(
                    wet.jacobian(t, np.asarray(q), np.asarray(v), a, b), size
                ),
            )
        )
        (_, pulls), tip = _pin(system, nodes[0]), _watch(system, nodes[-1])
        system.Assemble()
        _settle(system, size, APPROACH, APPROACH_STEP)
        cpu = _timed(system, _settings(setting.dt, p["T"], p["dt_out"], RHO, APPROACH))
        history = _told(system, tip, pulls)
    history[:, 0] -= APPROACH
    history[:, 2] += ramped_heave(p, history[:, 0])[:, 0, 2] - DEEP
    return Ours(str(setting), setting.elements, setting.dt, history, cpu, p["T"], 0, len(times) - 1)


def _over_sheave(s: np.ndarray, radius: float, start: float, strain: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and slopes [nodes, 2] at arc length s of a stretched cable hung over a circle, its first ``start`` metres
    on the left."""
    along = (1.0 + strain) * (s - start)
    angle, right = np.clip(along / radius, 0.0, np.pi), along - np.pi * radius
    return (
        np.column_stack(
            (-radius * np.cos(angle), radius * np.sin(angle) + np.minimum(along, 0.0) - np.maximum(right, 0.0))
        ),
        (1.0 + strain) * np.column_stack((np.sin(angle), np.cos(angle))),
    )


def _sheave(system: Any, cables: list, wrapped: np.ndarray, setting: Setting, radius: float) -> None:
    """Frictionless contact of every element with a fixed circle about the origin; wrapped: begins in contact."""
    items = _library()[1]
    n, ground = setting.points, system.AddObject(items.ObjectGround())
    circle = system.AddMarker(items.MarkerBodyRigid(bodyNumber=ground))
    for cable, on in zip(cables, wrapped, strict=True):
        shape = system.AddMarker(items.MarkerBodyCable2DShape(bodyNumber=cable, numberOfSegments=n))
        state = system.AddNode(
            items.NodeGenericData(initialCoordinates=[-1e-6 if on else 0.1] * n, numberOfDataCoordinates=n)
        )
        system.AddObject(
            items.ObjectContactCircleCable2D(
                markerNumbers=[circle, shape],
                nodeNumber=state,
                numberOfContactSegments=n,
                circleRadius=radius,
                contactStiffness=setting.penalty,
            )
        )


def _hang(system: Any, node: int, mass: float, load: float) -> int:
    """Puts a point mass [kg] on a node, pulled down by a load [N] that is returned, to be changed."""
    items = _library()[1]
    system.AddObject(items.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.diag((mass, mass, 0.0, 0.0))))
    marker = system.AddMarker(items.MarkerNodePosition(nodeNumber=node))
    return system.AddLoad(items.Force(markerNumber=marker, loadVector=[0.0, -load, 0.0]))


def exudyn_pulled_over(setting: Setting) -> Ours:
    """P4: t, travel, tension where the cable leaves the sheave; begun at rest with the left mass held."""
    exu, items = _library()
    p = reference("P4").params
    radius, tangent = p["Rc"], p["l1"] + np.pi * p["Rc"]
    arc = setting.arc(tangent + p["l2"])
    start_tension = 2.0 * p["m1"] * p["m2"] / (p["m1"] + p["m2"]) * p["g"]
    middle = 0.5 * (arc[1:] + arc[:-1])
    seen = np.flatnonzero(middle > tangent)
    with silent():
        system = exu.SystemContainer().AddSystem()
        nodes, cables = _cable(system, arc, *_over_sheave(arc, radius, p["l1"], start_tension / p["EA"]), p)
        _weigh(system, cables, p["g"])
        _sheave(system, cables, (middle > p["l1"]) & (middle < tangent), setting, radius)
        ends = [
            _hang(system, nodes[k], mass, load) for k, mass, load in ((0, p["m1"], 0.0), (-1, p["m2"], start_tension))
        ]
        pins, _ = _pin(system, nodes[0])
        tip = _watch(system, nodes[-1])
        pulls = [
            system.AddSensor(
                items.SensorBody(
                    bodyNumber=cables[e],
                    localPosition=[middle[e] - arc[e], 0.0, 0.0],
                    storeInternal=True,
                    outputVariableType=exu.OutputVariableType.ForceLocal,
                )
            )
            for e in seen
        ]
        system.Assemble()
        settings = _settings(setting.dt, p["T"], p["dt_out"], RHO_SHEAVE)
        system.SolveStatic(settings, updateInitialValues=True)
        for pin in pins:
            system.SetObjectParameter(pin, "activeConnector", False)
        for load, mass in zip(ends, (p["m1"], p["m2"]), strict=True):
            system.SetLoadParameter(load, "loadVector", [0.0, -mass * p["g"], 0.0])
        cpu = _timed(system, settings)
        place = system.GetSensorStoredData(tip)
        tension = np.column_stack([system.GetSensorStoredData(s)[:, 1] for s in pulls])
    travel = place[0, 2] - place[:, 2]
    left = [leaving_tension(middle[seen], tangent - x, row) for x, row in zip(travel, tension, strict=True)]
    history = np.column_stack((place[:, 0], travel, left))
    return Ours(str(setting), setting.elements, setting.dt, history, cpu, p["T"], 0, len(place) - 1)
