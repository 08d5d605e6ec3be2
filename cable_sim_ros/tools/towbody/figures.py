"""Trim over speed, fins over tow point, and the polar of a body with an attitude.

The map is of the body alone, over the place of its tow point and the area of its tail, found and by formula. In yaw:
tow point ahead of the hull's centre against upright fins; in pitch: tow point over it against level ones. The body is
level and heads into the stream. By formula a turn grows where

    k_h + U^2 (rho/2 sum(S C_L l) - (A - A_x)) < 0

with k_h of weight and buoyancy (none in yaw), l from the tow point back to each wing, and A the added mass across
(Munk 1924): what drag and lift of the wings do at their levers is left out.

Picture of a body with an attitude: polar, pitch and depth over speed, fins over tow point.

A body with an attitude alone, its tow point held in a stream: loads, small motions, and the fins it needs.

Every figure is of the product's own assembly. Pitch is nose up.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, degrees, hypot, inf, radians, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigvals
from scipy.spatial.transform import Rotation

from ...errors import CableSimError
from ...io.scenes.load import override
from ...physics.fluid import Fluid
from ...physics.state import AT_REST, FLOW, NOW, Change, Q
from ...physics.towbody import BodyModel, Towbody, facing
from ...physics.wing import Wing
from ...plots.run import canvas
from ...sim.checks.attitude_checks import critical_speed, fin_area, least_fin
from ...sim.rig.rig import Rig, cable_of
from ...sim.scene import Scene
from ...sim.simulator import Simulator
from ...sim.statics.route import StartError
from ...sim.tables.rigid_tables import SLOPE_OF_A_TAIL, added_of, extent, hull_centre
from ...sim.trim import UnstableTrim, rigid_names, trim

DEPTH = 50.0  # m, far from the surface
MOST_SCALE = 64.0  # of the area of the tail, where its least is sought
HALVINGS = 20
ROLL, PITCH, YAW = range(3)

LIFT, DRAG, FORMULA = "#0b3c5d", "#c23b33", "#7f7f7f"

POINTS = 13  # of each axis
MOST_AREA = 2.0  # times that of its own tail
REACH = {YAW: 0.3, PITCH: 0.1}  # of the length, of the tow point from the hull's centre, or twice what it has
AXES = {YAW: "yaw", PITCH: "pitch"}

PITCHES = tuple(float(x) for x in range(-30, 31, 2))  # deg, of the polar
AHEAD = 0.0, 0.05, 0.1, 0.2, 0.3  # of the length, from where the tow point is


class Alone:
    """The body in a stream of ``speed`` [m/s] from ahead, on a line that bears nothing."""

    def __init__(self, scene: Scene, body: Towbody, speed: float) -> None:
        cable = cable_of([{"length": 1e3, "elements": 1}], mass_per_length=1e-5, axial_stiffness=1.0, diameter=1e-4)
        water = Fluid(density=scene.water.density, current=(-speed, 0.0))
        self.body, self.weight = body, body.net_weight
        self.rig = Rig(cable, held={0: "r"}, bodies={-1: body}, tension=1.0, water=water, gravity=scene.gravity)
        self.rig.straight((0.0, 0.0, 1e3 - DEPTH), (0.0, 0.0, -1.0))

    def turn(self, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> None:
        """Hold it at these angles [deg], pitch nose up, yaw from the stream."""
        self.rig.turn(Rotation.from_euler("ZYX", (yaw, -pitch, roll), degrees=True).as_quat())

    def drag_and_lift(self) -> tuple[float, float]:
        """Along the stream and up [N], without weight and buoyancy."""
        self.rig.residual()
        force = self.rig.state.work.band[-1, :3, 12]
        return -float(force[0]), float(force[2]) + self.weight

    def stiffness(self) -> np.ndarray:
        """Moments to the rotation [N m], the tow point held."""
        self.rig.residual(AT_REST, True)
        return np.array(self.rig.state.attitude[NOW, 0].stiffness)

    def modes(self, axes: Sequence[int] = (ROLL, PITCH, YAW)) -> np.ndarray:
        """Eigenvalues [1/s] of small turns about the held tow point, of these axes, the others held: lambda^2 M +
        lambda C + K, each of the tangent."""
        parts, keep = [], np.ix_(axes, axes)
        for change in (Change(1.0, 1.0, 0.0, 0.0), Change(2.0, 1.0, 0.0, 0.0), Change(1.0, 2.0, 0.0, 0.0)):
            self.rig.state.attitude["turned"][:] = 0.0
            self.rig.residual(change, True)
            parts.append(np.array(self.rig.state.attitude[NOW, 0].stiffness)[keep])
        c, m = parts[1] - parts[0], parts[2] - parts[0]
        k, zero, one = parts[0] - c - m, np.zeros_like(c), np.eye(len(c))
        found = eigvals(np.block([[zero, one], [-k, -c]]), np.block([[one, zero], [zero, m]]))
        return found[np.argsort(abs(found))]


def oscillations(modes: np.ndarray) -> list[dict[str, float]]:
    """Natural period [s] and damping ratio of the modes that swing, the slowest first."""
    return [
        {"period_s": float(2.0 * np.pi / abs(x)), "damping_ratio": float(-x.real / abs(x))}
        for x in modes
        if x.imag > 1e-9
    ]


def of_tail(body: Towbody, wing: Wing, axis: int = YAW) -> bool:
    """Is it behind the hull's centre, and stands so that it holds the body in yaw, or in pitch?"""
    across = (np.sin if axis == YAW else np.cos)(radians(wing.dihedral))
    return wing.place[0] < hull_centre(body)[0] and abs(across) > 0.5


def moved(body: Towbody, ahead: float, up: float = 0.0, scale: float = 1.0, axis: int = YAW) -> Towbody:
    """The body with its tow point so far ahead and up [m] of where it is, and the area of its tail times ``scale``."""
    shift, values = np.array([-ahead, 0.0, -up]), {}
    for name in ("centre_of_gravity", "centre_of_buoyancy", "hull_centre"):
        if (place := getattr(body, name)) is not None:
            values[name] = tuple((np.array(place) + shift).tolist())
    wings = {}
    for name, wing in body.wings.items():
        size = scale**0.5 if of_tail(body, wing, axis) else 1.0
        place = tuple((np.array(wing.place) + shift).tolist())
        wings[name] = wing.model_copy(update={"place": place, "span": wing.span * size, "chord": wing.chord * size})
    return body.model_copy(update=values | {"wings": wings})


def least_scale(scene: Scene, body: Towbody, speed: float, axis: int = YAW) -> float | None:
    """Least share of its tail that holds the body, level, in yaw or pitch, by halving; None: none up to MOST_SCALE."""

    def holds(scale: float) -> bool:
        return bool(Alone(scene, moved(body, 0.0, 0.0, scale, axis), speed).stiffness()[axis, axis] > 0.0)

    low, high = 1e-6, MOST_SCALE
    if holds(low):
        return 0.0
    if not holds(high):
        return None
    for _ in range(HALVINGS):
        middle = (low * high) ** 0.5
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def plot(found: dict[str, Any], path: Path) -> Path:
    """Draw it. RuntimeError where matplotlib is missing."""
    maps = {axis: one for axis, one in (found["map"] or {}).items() if one is not None}
    size = (18.0, 9.0) if maps else (12.0, 9.0)
    with canvas(path, size, f"{found['scene']}: {found['body']}", "keys: docs/bodies.md") as figure:
        (polar, pitch, *upper), (fins, depth, *lower) = figure.subplots(2, 3 if maps else 2)
        for axis, plotted in zip((*upper, *lower), ("yaw", "pitch"), strict=False):
            _draw_map(figure, axis, plotted, maps.get(plotted))
        angles = [row["pitch_up_deg"] for row in found["polar"]]
        polar.plot(angles, [row["lift_n"] for row in found["polar"]], color=LIFT, lw=2, label="lift")
        polar.plot(angles, [row["drag_n"] for row in found["polar"]], color=DRAG, lw=2, label="drag")
        polar.set(title=f"Body alone at {found['polar_speed_mps']:.3g} m/s")
        polar.set(xlabel="pitch, nose up [deg]", ylabel="force [N]")
        polar.legend(frameon=False)
        kept = [row for row in found["speeds"] if row["unstable"] is None]
        lost = [row["speed_mps"] for row in found["speeds"] if row["unstable"] is not None]
        speeds = [row["speed_mps"] for row in kept]
        for axis, key, label in ((pitch, "pitch_up_deg", "pitch, nose up [deg]"), (depth, "depth_m", "depth [m]")):
            axis.plot(speeds, [row[key] for row in kept], "o-", color=LIFT, lw=2, ms=4)
            for i, speed in enumerate(lost):
                axis.axvline(speed, color=DRAG, ls=":", label=None if i else "no stable trim")
            if lost:
                axis.legend(frameon=False)
            axis.set(xlabel="speed [m/s]", ylabel=label)
        pitch.set_title("Trim of the tow")
        depth.set_title("Depth of the tow")
        depth.invert_yaxis()
        known = [row for row in found["fins"] if row["found_m2"] is not None]
        fins.plot([r["ahead_m"] for r in known], [r["found_m2"] for r in known], "o-", color=LIFT, lw=2, label="found")
        places, areas = ([row[key] for row in found["fins"]] for key in ("ahead_m", "formula_m2"))
        fins.plot(places, areas, color=FORMULA, ls="--", label="formula")
        fins.axhline(found["fin_area_m2"], color=DRAG, ls=":", label="its own")
        fins.set(title="Least upright fins, aspect ratio 2", ylim=(0.0, None))
        fins.set(xlabel="tow point ahead of its place [m]", ylabel="area [m²]")
        fins.legend(frameon=False)
    return path


def _draw_map(figure: Any, axis: Any, name: str, one: dict[str, Any] | None) -> None:
    """Growth of a small turn by colour, the boundary found and by formula, the body itself."""
    if one is None:
        axis.set_axis_off()
        axis.text(0.5, 0.5, f"no tail holds it in {name}", ha="center")
        return
    places, areas, growth = one["tow_point_m"], one["tail_area_m2"], np.array(one["growth_per_s"])
    most = float(np.abs(growth).max())
    mesh = axis.pcolormesh(places, areas, growth, cmap="RdBu_r", vmin=-most, vmax=most, shading="gouraud")
    figure.colorbar(mesh, ax=axis, label="growth of a small turn [1/s]")
    wide, thin = {"color": FORMULA, "lw": 5}, {"color": "black", "ls": "--", "lw": 1.5}
    for key, style, label in (("found_m2", wide, "boundary, found"), ("formula_m2", thin, "by formula")):
        known = [(x, y) for x, y in zip(places, one[key], strict=True) if y is not None]
        axis.plot([x for x, _ in known], [y for _, y in known], label=label, **style)
    axis.plot(one["own_tow_point_m"], one["own_area_m2"], "o", color="black", mfc="white", ms=8, label="as it is")
    axis.set(title=f"Stability in {name}, level at {one['speed_mps']:.3g} m/s", ylim=(0.0, areas[-1]))
    axis.set(xlabel=f"tow point {one['tow_point']} [m]", ylabel=f"{'upright' if name == 'yaw' else 'level'} tail [m²]")
    axis.legend(loc="upper right", frameon=True, facecolor="white", framealpha=0.9)


class Sums(NamedTuple):
    """What the formula takes: S C_L l of the tail and of the other wings [m^3], area of the tail at aspect ratio 2."""

    tail: float
    others: float
    area: float


def _sums(body: Towbody, axis: int) -> Sums:
    tail, others, area = 0.0, 0.0, 0.0
    for wing in body.wings.values():
        share = (sin if axis == YAW else cos)(radians(wing.dihedral)) ** 2
        lift = wing.area * wing.slope * share
        if of_tail(body, wing, axis):
            tail, area = tail - lift * wing.place[0], area + lift / SLOPE_OF_A_TAIL
        else:
            others -= lift * wing.place[0]
    return Sums(tail, others, area)


def formula_scale(scene: Scene, body: Towbody, axis: int, speed: float) -> float | None:
    """Least share of its tail by formula; None: none, its tail is ahead of the tow point."""
    assert body.centre_of_gravity is not None and body.centre_of_buoyancy is not None
    gravity, density = scene.gravity, scene.water.density
    added, weight = added_of(body, gravity, density), body.mass * gravity
    across, hold = float(added[1, 1] if axis == YAW else added[2, 2]), 0.0
    if axis == PITCH:
        hold = (weight - body.net_weight) * body.centre_of_buoyancy[2] - weight * body.centre_of_gravity[2]
    sums = _sums(body, axis)
    needed = across - float(added[0, 0]) - hold / speed**2 - 0.5 * density * sums.others
    if needed <= 0.0:
        return 0.0
    return needed / (0.5 * density * sums.tail) if sums.tail > 0.0 else None


def stability_map(scene: Scene, body: Towbody, speed: float, points: int | None = None) -> dict[str, Any]:
    """Maps in yaw and pitch by name; None where the body has no tail to hold that axis."""
    return {name: _of_axis(scene, body, axis, speed, points or POINTS) for axis, name in AXES.items()}


def _of_axis(scene: Scene, body: Towbody, axis: int, speed: float, points: int) -> dict[str, Any] | None:
    area = _sums(body, axis).area
    if area <= 0.0:
        return None
    centre, length = hull_centre(body), extent(body, scene.gravity, scene.water.density)[0]
    own = -centre[0] if axis == YAW else -centre[2]
    places = np.linspace(0.0, max(2.0 * own, REACH[axis] * length), points)
    scales = np.linspace(0.0, MOST_AREA, points)
    scales[0] = 1e-6  # a wing has an area
    growth, found, formula = [], list[float | None](), list[float | None]()
    for place in places:
        shift = (float(place) - own, 0.0) if axis == YAW else (0.0, float(place) - own)
        there = moved(body, *shift)
        growth.append([_growth(scene, moved(there, 0.0, 0.0, float(s), axis), axis, speed) for s in scales])
        for scale, into in (
            (least_scale(scene, there, speed, axis), found),
            (formula_scale(scene, there, axis, speed), formula),
        ):
            into.append(None if scale is None else scale * area)
    return {
        "speed_mps": speed,
        "tow_point": "ahead of the hull's centre" if axis == YAW else "over the hull's centre",
        "tow_point_m": places.tolist(),
        "tail_area_m2": (scales * area).tolist(),
        "growth_per_s": np.array(growth).T.tolist(),  # [areas][places]
        "found_m2": found,
        "formula_m2": formula,
        "own_tow_point_m": own,
        "own_area_m2": area,
    }


def _growth(scene: Scene, body: Towbody, axis: int, speed: float) -> float:
    """Of a small turn about this axis alone [1/s]; below 0 it dies out."""
    return float(Alone(scene, body, speed).modes((axis,)).real.max())


class NoAttitude(CableSimError, ValueError):
    """The body asked for has none."""


def body_of(scene: Scene, name: str) -> tuple[str, Towbody]:
    """Key and body. Raises NoAttitude."""
    known = {"towbody": scene.towbody} | {f"bodies.{key}": body for key, body in scene.bodies.items()}
    key = name if name in known else f"bodies.{name}"
    if key not in known:
        raise NoAttitude(f"{scene.name} has no body '{name}'; nothing was computed. Give --body {' or '.join(known)}")
    if known[key].model is not BodyModel.RIGID:
        raise NoAttitude(
            f"{scene.name}: {key}.model = {known[key].model} has no attitude of its own: there is no trim and no "
            f"stability; nothing was computed. Give {key}.model: rigid with inertia and centres (docs/bodies.md)"
        )
    return key, known[key]


def at_speed(scene: Scene, key: str, body: Towbody, speed: float) -> dict[str, Any]:
    """The static tow at a speed of the ship [m/s]: trim, loads and small motions, or why it has none."""
    sim = Simulator(override(scene, {"ship.tow_speed": speed}))
    try:
        sim.start()
    except UnstableTrim as error:
        return {"speed_mps": speed, "unstable": f"unstable in {error.axis}", "body": error.body}
    except StartError:
        return {"speed_mps": speed, "unstable": "no static tow", "body": key}
    i = rigid_names(sim).index(key)
    node = int(sim.model.line.rigid.bodies[i].node)
    nodes = sim.state.nodes[NOW]
    roll, pitch, yaw = (degrees(angle) for angle in trim(sim, i))
    flow = nodes[FLOW, node]
    alone = Alone(scene, body, hypot(*flow[:2].tolist()))
    alone.turn(roll, -pitch, yaw - degrees(facing(flow)))
    drag, lift = alone.drag_and_lift()
    stiffness, modes = np.diag(alone.stiffness()), alone.modes()
    return {
        "speed_mps": speed,
        "unstable": None,
        "roll_deg": roll,
        "pitch_up_deg": -pitch,
        "heading_deg": yaw,
        "depth_m": -float(nodes[Q, node, 2]),
        "drag_n": drag,
        "lift_n": lift,
        "tension_n": float(sim.frame.tension),
        "stall_share": float(sim.state.attitude[NOW, i].attack),
        "stiffness_nm": dict(zip(("roll", "pitch", "yaw"), stiffness.tolist(), strict=True)),
        "fastest_growth_per_s": float(modes.real.max()),
        "oscillations": oscillations(modes),
    }


def figures_of(scene: Scene, name: str, speeds: Sequence[float], mapped: bool = False) -> dict[str, Any]:
    """All figures of a body of a scene; ``mapped``: its stability over tow point and tail too."""
    key, body = body_of(scene, name)
    rows = [at_speed(scene, key, body, speed) for speed in speeds]
    speed = scene.ship.tow_speed or speeds[len(speeds) // 2]
    length = body.length or 1.0
    fins, area = [], fin_area(body)
    for share in AHEAD:
        there = moved(body, share * length)
        scale = least_scale(scene, there, speed) if area else None
        own = None if scale is None else scale * area
        fins.append({"ahead_m": share * length, "found_m2": own, "formula_m2": least_fin(scene, there)})
    alone, polar = Alone(scene, body, speed), []
    for pitch in PITCHES:
        alone.turn(pitch=pitch)
        drag, lift = alone.drag_and_lift()
        polar.append({"pitch_up_deg": pitch, "drag_n": drag, "lift_n": lift})
    critical = critical_speed(scene, body)
    return {
        "scene": scene.name,
        "body": key,
        "critical_speed_mps": None if critical == inf else critical,
        "fin_area_m2": area,
        "least_fin_m2": least_fin(scene, body),
        "speeds": rows,
        "fins": fins,
        "polar_speed_mps": speed,
        "polar": polar,
        "map": stability_map(scene, body, speed) if mapped else None,
    }
