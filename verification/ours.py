"""The product on the benchmark scenes P1 to P6: the rig, set up from the numbers of the reference files."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from cable_sim_ros.physics.contact import Contact
from cable_sim_ros.physics.contact_surface import surface_row
from cable_sim_ros.physics.drag_laws import DragLaw
from cable_sim_ros.physics.integrate import Solver
from cable_sim_ros.physics.section import CableModel
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.rig.rig import HALVED, History, Rig, cable_of, load_of

from .scenes import reference

DEEP = -1000.0  # m, where the stream scenes are set up: everything is wet
COARSEST = ((0.6, 3), (0.3, 4), (0.1, 4))  # mesh of P5: finest at the towbody, where the cable is most curved
CLEAR = 0.5  # m of straight cable next to the sheave of P4 that is not read


class Ours(NamedTuple):
    """One run of the product; history columns as in the reference file."""

    setting: str
    elements: int
    dt_s: float  # 0: statics
    history: np.ndarray
    cpu_s: float  # stepping only
    simulated_s: float  # 1 for statics
    iterations: int
    steps: int


class Setting(NamedTuple):
    """Mesh as ((length share, elements), ...) from the first node, step [s], rho_inf, model of the elements."""

    mesh: tuple[tuple[float, int], ...]
    dt: float = 0.0
    rho: float = Solver().rho_inf
    model: CableModel = CableModel.ANCF

    @property
    def elements(self) -> int:
        return sum(n for _, n in self.mesh)

    def __str__(self) -> str:
        links = " links" if self.model is CableModel.SEGMENTS else ""
        return mesh_text(self.mesh) + links + (f", {1e3 * self.dt:g} ms, rho_inf {self.rho:g}" if self.dt else "")


def mesh_text(mesh: tuple[tuple[float, int], ...]) -> str:
    """A mesh as the tables show it."""
    return " + ".join(f"{n} on {fraction:g}" for fraction, n in mesh) if len(mesh) > 1 else f"{mesh[0][1]}"


def even(n: int, dt: float = 0.0, rho: float = Solver().rho_inf) -> Setting:
    """Equal elements."""
    return Setting(((1.0, n),), dt, rho)


def links(*settings: Setting) -> tuple[Setting, ...]:
    """The same on links."""
    return tuple(setting._replace(model=CableModel.SEGMENTS) for setting in settings)


def _rig(p: dict, length: float, setting: Setting, held: dict, tension: float, wet: dict | None = None, **more) -> Rig:
    """The line of a scene; wet: drag of its sections, without it they are in air; more: of Rig."""
    cable = cable_of(
        [{"length": fraction * length, "elements": n} | (wet or {}) for fraction, n in setting.mesh],
        mass_per_length=p["mu"],
        axial_stiffness=p["EA"],
        bending_stiffness=p["EI"],
        diameter=p.get("d", 0.01),
        model=setting.model,
        **({"added_mass_coefficient": p["Ca"]} if wet else {"compression_share": 1.0}),
    )
    return Rig(cable, held=held, tension=tension, gravity=p["g"], solver=Solver(rho_inf=setting.rho), **more)


def _every(interval: float, dt: float) -> int:
    return max(int(round(interval / dt)), 1)


def _run(rig: Rig, setting: Setting, duration: float, interval: float, columns, first, **more) -> Ours:
    """March and time it; ``columns(history)`` -> [samples, columns], ``first``: the row at t = 0."""
    begin = time.process_time()
    report = rig.run(duration, setting.dt, every=_every(interval, setting.dt), rules=HALVED, **more)
    cpu = time.process_time() - begin
    history = np.vstack((first, np.column_stack((report.time, columns(report)))))
    return Ours(str(setting), setting.elements, setting.dt, history, cpu, duration, report.iterations, report.steps)


def _tip_and_top(h: History, height: float = 0.0) -> np.ndarray:
    return np.column_stack((h.q[:, -1, 0], h.q[:, -1, 2] - height, np.linalg.norm(h.reaction[:, 0, :3], axis=1)))


def catenary(setting: Setting) -> Ours:
    """P1: s, x, z, T at the nodes."""
    p = reference("P1").params
    length, span = p["L"], p["span"]
    rig = _rig(p, length, setting, {0: "r", -1: "r"}, tension=p["mu"] * p["g"] * length)
    s = rig.arc / length
    sag = np.sqrt(max(length**2 - span**2, 0.0) * 3.0 / 16.0)
    g = np.column_stack((np.full_like(s, span / length), 0.0 * s, -4.0 * sag / length * (1.0 - 2.0 * s)))
    r = np.column_stack((span * s, 0.0 * s, -4.0 * sag * s * (1.0 - s)))
    rig.place(r, g / np.linalg.norm(g, axis=1)[:, None])
    begin = time.process_time()
    steps = rig.settle()
    cpu = time.process_time() - begin
    q = rig.state.q
    tension = p["EA"] * (np.linalg.norm(q[:, 3:], axis=1) - 1.0)
    ends = np.linalg.norm(rig.state.reaction[[0, -1], :3], axis=1)
    tension[[0, -1]] = ends
    history = np.column_stack((rig.arc, q[:, 0], q[:, 2], tension))
    return Ours(str(setting), setting.elements, 0.0, history, cpu, 1.0, rig.iterations, steps)


def released(setting: Setting) -> Ours:
    """P2: t, tip_x, tip_z, top_tension of a cable pinned and released level."""
    p = reference("P2").params
    rig = _rig(p, p["L"], setting, {0: "r"}, tension=p["mu"] * p["g"] * p["L"])
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.balance()
    first = (0.0, p["L"], 0.0, float(np.linalg.norm(rig.state.reaction[0, :3])))
    return _run(rig, setting, p["T"], p["dt_out"], _tip_and_top, first)


def cantilever(setting: Setting) -> Ours:
    """P3, released straight under gravity: t, tip_x, tip_z."""
    p = reference("P3").params
    rig = _rig(p, p["L"], setting, {0: "rg"}, tension=p["mu"] * p["g"] * p["L"])
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.balance()
    return _run(rig, setting, p["T"], p["dt_out"], lambda h: h.q[:, -1, [0, 2]], (0.0, p["L"], 0.0))


def pulled_over(setting: Setting) -> Ours:
    """P4, two masses over a fixed frictionless sheave: t, x, T_right (where the cable leaves the sheave)."""
    p = reference("P4").params
    rc, weight = p["Rc"], p["g"] * max(p["m1"], p["m2"])
    half_turn = np.pi * rc
    length = p["l1"] + half_turn + p["l2"]
    stiffness = weight / rc / (Contact().penetration_limit * p["d"]) ** 1.5
    # at rest with the tension of the first instant (massless cable): left mass held, right one partly carried
    start_tension = 2.0 * p["m1"] * p["m2"] / (p["m1"] + p["m2"]) * p["g"]
    rig = _rig(
        p,
        length,
        setting,
        {0: "r"},
        tension=weight,
        bodies={0: p["m1"], -1: p["m2"]},
        surfaces=[surface_row((0.0, 0.0, 0.0), rc, None, 0.0, 0.0, stiffness, 0.3)],
        loads=[load_of(-1, (0.0, 0.0, p["m2"] * p["g"] - start_tension))],
    )
    s = rig.arc - p["l1"]
    angle = np.clip(s / rc, 0.0, np.pi)
    down_left, down_right = np.maximum(-s, 0.0), np.maximum(s - half_turn, 0.0)
    r = np.column_stack((-rc * np.cos(angle), 0.0 * s, rc * np.sin(angle) - down_left - down_right))
    g = np.column_stack((np.sin(angle), 0.0 * s, np.cos(angle)))
    rig.place(r, g * (1.0 + start_tension / p["EA"]))
    rig.settle()
    rig.release(0)
    rig.balance()
    start, middle = rig.state.q[-1, 2], 0.5 * (rig.arc[1:] + rig.arc[:-1])
    tangent = p["l1"] + half_turn  # arc length of the material at the right tangent point before it moves
    first = (0.0, 0.0, leaving_tension(middle, tangent, rig.state.tension))

    def columns(h):
        travel = start - h.q[:, -1, 2]
        return np.column_stack(
            (travel, [leaving_tension(middle, tangent - x, row) for x, row in zip(travel, h.tension, strict=True)])
        )

    return _run(rig, setting, p["T"], p["dt_out"], columns, first)


def leaving_tension(middle: np.ndarray, tangent: float, tension: np.ndarray) -> float:
    """Tension [N] at arc length tangent [m], where the cable leaves the sheave of P4, from that of the elements
    (middle [m]): it is linear along the straight part, and near the jump of curvature an element's own varies."""
    clear = middle > tangent + CLEAR
    return float(np.polyval(np.polyfit(middle[clear], tension[clear], 1), tangent))


def ramped_heave(p: dict, times: np.ndarray) -> np.ndarray:
    """Position, velocity, acceleration [times, 1, 9] of the top point of P5: (1 - cos)/2 ramp on a sine."""
    t, w = times, 2.0 * np.pi * p["f_h"]
    k, on = np.pi / p["ramp"], times < p["ramp"]
    ramp = np.where(on, 0.5 * (1.0 - np.cos(k * t)), 1.0)
    d_ramp, dd_ramp = np.where(on, 0.5 * k * np.sin(k * t), 0.0), np.where(on, 0.5 * k * k * np.cos(k * t), 0.0)
    sin, cos = np.sin(w * t), np.cos(w * t)
    out = np.zeros((len(t), 1, 9))
    out[:, 0, 2] = DEEP + p["A_h"] * ramp * sin
    out[:, 0, 5] = p["A_h"] * (d_ramp * sin + ramp * w * cos)
    out[:, 0, 8] = p["A_h"] * (dd_ramp * sin + 2.0 * d_ramp * w * cos - ramp * w * w * sin)
    return out


def towed(setting: Setting) -> Ours:
    """P5 and P6: t, tip_x, tip_z, top_tension of a cable in a stream whose top heaves."""
    p = reference("P5").params
    law = {"drag_law": DragLaw.CROSSFLOW, "drag_coefficient": p["Cdn"], "tangential_coefficient": np.pi * p["Cdt"]}
    tension, water = p["Wnet"] + p["w"] * p["L"], Water(density=p["rho"], current=(p["U"], 0.0))
    body = Towbody(mass=p["M"], net_weight=p["Wnet"])
    rig = _rig(p, p["L"], setting, {0: "r"}, tension, law, water=water, bodies={-1: body})
    rig.straight((0.0, 0.0, DEEP), (1.0, 0.0, -0.5))
    rig.settle()
    first = (0.0, rig.state.q[-1, 0], rig.state.q[-1, 2] - DEEP, float(np.linalg.norm(rig.state.reaction[0, :3])))
    heaved = {"moved": (0,), "motion": lambda t: ramped_heave(p, t)}
    return _run(rig, setting, p["T"], p["dt_out"], lambda h: _tip_and_top(h, DEEP), first, **heaved)
