"""Static shape of a cable whose far end a vehicle holds, and where that is at the start.

The elastic catenary between the sheave and the attachment under the mean load of the cable, weight and drag as one
vector along it: a first guess, and what the mesh is made for. A bight whose legs hang side by side is spread for it.
Independent of the kernels, plain Python.
"""

from __future__ import annotations

from math import acos, asinh, atanh, cos, hypot, pi, radians, sin, sinh, sqrt

import numpy as np

from ...physics.inputs import MOTION_ROWS, Inputs
from ...physics.section import material_of
from ...physics.ship import NO_EPOCH
from ...physics.towbody import BodyModel
from ..scene import Scene
from ..tables.attitude import Vector, to_world
from ..tables.current import Flow, flow_of
from .route import Route
from .static_integration import CableLoads, Rows, cable_loads, line_load
from .static_shape import TowShape, finished

MESH_SPREAD = 0.1  # of the length, between the legs of the bight that a mesh is made for
ROWS = 161
ROUNDS = 6  # of angle at the sheave and length outboard of it
HALVINGS = 200
MIN_PULL = 0.05  # of contact.working_tension: errors of slack cable are judged as if it had that
PER_WORKING = 2.0  # of contact.working_tension: largest pull of a vehicle, where the scene does not say
MIN_LOAD = 1e-3  # of the weight in air: cable that neither sinks nor floats hangs as if it had that


def rotated(attitude: Vector, s: Vector) -> np.ndarray:
    """Rz Ry Rx s for roll, pitch, yaw [rad]."""
    return np.array(to_world(attitude, s))


def pose_of(scene: Scene, yaw: float) -> list[float]:
    """Place [m, x y from base_link at the start] and roll, pitch, yaw [rad] of the vehicle by the scene, the ship
    heading ``yaw``."""
    v = scene.vehicle
    x, y, z = rotated((0.0, 0.0, yaw), v.position or (0.0, 0.0, 0.0))
    roll, pitch, turn = map(radians, v.attitude_deg)
    return [float(x), float(y), float(z), roll, pitch, yaw + turn]


def attachment_of(scene: Scene, pose: list[float]) -> np.ndarray:
    """Where a vehicle at ``pose`` has its cable made fast [3]."""
    roll, pitch, yaw = pose[3:]
    return np.array(pose[:3]) + rotated((roll, pitch, yaw), scene.vehicle.attachment)


def declare_vehicle(now: np.record, scene: Scene, yaw: float, inputs: Inputs) -> None:
    """The vehicle of a start into a MEMORY: at its newest pose by then, or its first one, else by the scene."""
    if scene.towbody.model is not BodyModel.VEHICLE:
        return
    craft, pose = now.vehicle, pose_of(scene, yaw)
    if head := int(inputs.vehicle_head[0]):
        rows = [k % MOTION_ROWS for k in range(max(0, head - MOTION_ROWS + 8), head)]
        row = max((k for k in rows if inputs.vehicle_time[k] <= now.time.start), key=rows.index, default=rows[0])
        since = (int(inputs.vehicle_time[row]) - int(now.time.start)) * 1e-9
        pose = inputs.vehicle[row, :6].tolist()
        for i in range(2):
            pose[i] -= float(now.frame.origin[i]) + float(now.frame.velocity[i]) * since
    craft.mean_coord[:] = pose
    craft.motion.coord[:] = pose
    craft.epoch, craft.holds, craft.blend_at = NO_EPOCH, 1, now.time.start


def max_tension(scene: Scene) -> float:
    """Tension [N] of straight cable beyond which its end no longer follows the vehicle."""
    given = scene.vehicle.max_tension
    return PER_WORKING * scene.contact.working_tension if given is None else given


def mean_compliance(scene: Scene) -> float:
    """Strain of the whole cable per tension [1/N]."""
    sections = scene.cable.sections.values()
    stretch = sum(s.length / material_of(scene.cable, s).axial_stiffness for s in sections)
    return stretch / sum(s.length for s in sections)


def sheave_at(scene: Scene, yaw: float) -> np.ndarray:
    """Centre of the sheave at its mean place [3], x y from base_link, z above the water."""
    return rotated((0.0, 0.0, yaw), scene.sheave.position) + np.array([0.0, 0.0, scene.ship.reference_height])


def straight_length(rel: np.ndarray, radius: float) -> float:
    """Straight cable from the point above the axis of a sheave to a point at ``rel`` from its centre [m]."""
    d = max(float(np.sqrt((rel * rel).sum())), 1.001 * radius)
    return radius * (acos(max(-1.0, min(1.0, float(rel[2]) / d))) - acos(radius / d)) + sqrt(d * d - radius * radius)


def reach_problem(scene: Scene, end: np.ndarray, yaw: float, scope: float, strain: float) -> str:
    """ "" or why a cable of ``scope`` m outboard cannot begin at ``end``; strain: of its largest tension."""
    radius = scene.sheave.radius + 0.5 * scene.cable.diameter
    needed = straight_length(end - sheave_at(scene, yaw), radius)
    at = ", ".join(f"{x:.2f}" for x in end)
    if scene.seabed.depth is not None and end[2] < -scene.seabed.depth:
        return (
            f"the vehicle's attachment at {at} m from the ship lies {-scene.seabed.depth - end[2]:.3g} m below the "
            f"seabed (seabed.depth = {scene.seabed.depth:g} m): give it a place above, or check z (up)"
        )
    if needed <= scope * (1.0 + 0.5 * strain):
        return ""
    return (
        f"the vehicle's attachment at {at} m from the ship is {needed:.4g} m of straight cable away, and {scope:.4g} m "
        f"are out (winch.scope), {scope * (1.0 + 0.5 * strain):.4g} m stretched by half of vehicle.max_tension: pay "
        f"out more, or begin with the vehicle nearer (vehicle.position, or its first pose)"
    )


def vehicle_shape(
    scene: Scene,
    route: Route,
    scope: float,
    heading: float | None = None,
    end: np.ndarray | None = None,
    spread: float = MESH_SPREAD,
) -> TowShape:
    """Static shape with ``scope`` [m] out, see Layout.shape(). end: the attachment, None: that of the scene, which
    comes and goes along its line to the sheave with the scope; spread: least distance of the legs, of the length."""
    yaw = radians(scene.ship.heading_deg) if heading is None else heading
    centre = sheave_at(scene, yaw)
    if end is None:
        end = centre + (attachment_of(scene, pose_of(scene, yaw)) - centre) * (scope / route.scope)
    over, cables = scene.ship.tow_speed, cable_loads(scene)
    flow = flow_of(scene.water, yaw, (over * cos(yaw), over * sin(yaw)))
    sections, ahead = list(scene.cable.sections.values()), np.array([cos(yaw), sin(yaw), 0.0])
    ea = len(cables) / sum(1.0 / c.ea for c in cables)
    angle = 0.25 * pi
    for _ in range(ROUNDS):
        free = max(scope - route.on_sheave(angle) + route.inboard - route.span, 0.01 * scope)
        top = centre + route.sheave * (np.array([0.0, 0.0, sin(angle)]) - route.side * cos(angle) * ahead)
        load = mean_load(cables, flow, end, top)
        s = np.linspace(0.0, free, ROWS)
        place, force = catenary(s, top - end, load, ea, spread, ahead)
        last = force[-1] / max(float(np.sqrt((force[-1] ** 2).sum())), 1e-12)
        aft = 1.0 if float((last * ahead).sum()) * route.side >= 0.0 else -1.0
        angle = 0.5 * (angle + aft * acos(max(-1.0, min(1.0, float(last[2])))))
    bottom = -np.inf if scene.seabed.depth is None else -scene.seabed.depth
    section, done = np.zeros(ROWS, int), 0.0
    for i in reversed(range(len(sections))):
        section[s >= done] = i
        done += sections[i].length
    place = laid(s, place + end, bottom, ea, spread, ahead)
    place[:, :2] -= end[:2]
    pull = np.maximum(np.sqrt((force**2).sum(1)), 1e-12)[:, None]
    bend = -(load - force * ((force * load).sum(1)[:, None] / pull**2)) / pull
    force = force * np.maximum(MIN_PULL * scene.contact.working_tension / pull, 1.0)
    each = zip(section, place[:, 2].tolist(), force.tolist(), strict=True)
    loads = np.array([line_load(cables[i], z, tuple(pull), flow) for i, z, pull in each])
    rows = Rows(s, np.concatenate((place, force), axis=1), section, loads)
    return finished(cables, flow, rows, angle, scope, True, bend)


def laid(s: np.ndarray, place: np.ndarray, bottom: float, ea: float, spread: float, ahead: np.ndarray) -> np.ndarray:
    """Places of a shape of which what would lie below the seabed lies there in a bow to one side, as long as it is."""
    below = np.flatnonzero(place[:, 2] < bottom)
    if len(below) < 3:
        return place
    first, last = int(below[0]), int(below[-1])
    chord = (place[last] - place[first]) * (1.0, 1.0, 0.0)
    level = ahead if float((chord * chord).sum()) < 1e-9 else chord
    aside = np.array([-level[1], level[0], 0.0])
    bow, _ = catenary(s[first : last + 1] - s[first], chord, aside / hypot(*aside.tolist()), ea, spread, level)
    place = place.copy()
    place[first : last + 1] = place[first] + bow
    place[first : last + 1, 2] = bottom
    return place


def mean_load(cables: list[CableLoads], flow: Flow, end: np.ndarray, top: np.ndarray) -> np.ndarray:
    """Load per length [N/m] on the straight cable between its ends, the mean of its sections at five places."""
    chord, total = top - end, np.zeros(3)
    for fraction in (0.1, 0.3, 0.5, 0.7, 0.9):
        z = float(end[2] + fraction * chord[2])
        for c in cables:
            total += np.array(line_load(c, z, tuple(chord.tolist()), flow)) / (5 * len(cables))
    least = MIN_LOAD * max(c.weight for c in cables)
    if float(np.sqrt((total * total).sum())) < least:
        total = np.array([0.0, 0.0, -least])
    return total


def catenary(
    s: np.ndarray, chord: np.ndarray, load: np.ndarray, ea: float, spread: float, ahead: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places [n, 3] and tension vectors [n, 3], pointing up the cable, at lengths s from its end, of a cable to
    ``chord`` from there under a load per length; ahead: the way to spread a bight whose ends stand above each other."""
    w, length = float(np.sqrt((load * load).sum())), float(s[-1])
    down = load / w
    rise = -float((chord * down).sum())
    aside = chord + rise * down
    wide = float(np.sqrt((aside * aside).sum()))
    if wide > 1e-6 * length:
        along = aside / wide
    else:
        along = ahead - float((ahead * down).sum()) * down
        along = along / max(hypot(*along.tolist()), 1e-9)
    wide = max(wide, min(spread * length, 0.5 * sqrt(max(length**2 - rise**2, 0.0))), 1e-4 * length)

    def spans(a: float) -> float:
        return hypot(rise, 2.0 * a * sinh(min(0.5 * wide / a, 300.0)))

    low, high = 1e-3 * wide, max(1e9 * wide, 2.0 * ea / w)
    for _ in range(HALVINGS):
        a = sqrt(low * high)
        # the mean tension is w a, the horizontal one, times length over width
        low, high = (a, high) if spans(a) > length * (1.0 + w * a * spans(a) / (wide * ea)) else (low, a)
    x0 = 0.5 * wide - a * atanh(max(-1.0 + 1e-12, min(1.0 - 1e-12, rise / spans(a))))
    stretched = s * (spans(a) / length)
    x = np.array([x0 + a * asinh(float(p) / a - sinh(x0 / a)) for p in stretched])
    slopes = np.array([float(p) / a - sinh(x0 / a) for p in stretched])
    height = a * (np.sqrt(1.0 + slopes**2) - sqrt(1.0 + sinh(x0 / a) ** 2))
    place = x[:, None] * along - height[:, None] * down
    return place, w * a * (along - slopes[:, None] * down)
