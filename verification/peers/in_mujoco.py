"""MuJoCo: a planar chain of rigid links, RK4 (its implicit integrators are of first order and need far more steps).

P2: hinges carry the bending stiffness; no stretch. P5, P6: its own fluid force (square law on each side of the box of
equal inertia, which in the plane is the crossflow law) with the stream as wind; a link is split into ``points`` rigid
pieces, so that drag is integrated along it. The frame heaves with the tow point: wind and gravity carry its velocity
and acceleration, held at their mid-step values. The stretch of the whole cable sits in one sliding joint in mid-length.
The reaction comes from the accelerations of all pieces less the forces on them.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from ..ours import DEEP, Ours, ramped_heave
from ..scenes import reference
from .common import Setting, static_places

SETTLE = 400.0  # s before the heave, from the reference's static shape: the last of the approach takes 50 s by e


class _Seen(NamedTuple):
    """At the given instants, planar (x, z): tip [m], force [N] that gravity and inertia ask of everything else; of the
    pieces (first axis after time) velocity [m/s] in the frame and direction."""

    tip: np.ndarray
    force: np.ndarray
    velocity: np.ndarray
    tangent: np.ndarray


def _numbers(values) -> str:
    return " ".join(f"{x:.17g}" for x in values)


def _inertial(x: float, mass: float, moments) -> str:
    return f'<inertial pos="{x:.17g} 0 0" mass="{mass:.17g}" diaginertia="{_numbers(moments)}"/>'


def _model(links, options: str, end: str = "") -> Any:
    """Links as (length, joints, inertials of its rigid pieces), one hanging from the other; ``end``: what ends them."""
    import mujoco

    inner, outer, at = "", "", 0.0
    for length, joints, (first, *others) in links:
        inner += f'<body pos="{at:.17g} 0 0">{joints}{first}' + "".join(f"<body>{piece}</body>" for piece in others)
        outer, at = outer + "</body>", length
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler balanceinertia="true"/><option integrator="RK4" {options}>'
        '<flag contact="disable" constraint="disable"/></option>'
        f'<worldbody>{inner}{end}<site name="tip" pos="{at:.17g} 0 0"/>{outer}</worldbody></mujoco>'
    )


def _integrate(model: Any, data: Any, setting: Setting, p: dict, gravity=None, wind=None):
    """Coordinates and velocities [instants, joints] every dt_out, and CPU time [s]. gravity, wind: their vertical
    component, one a step."""
    import mujoco

    every, count = max(int(round(p["dt_out"] / setting.dt)), 1), int(round(p["T"] / setting.dt))
    q, v = np.zeros((2, count // every + 1, model.nv))
    q[0], v[0] = data.qpos, data.qvel
    begin = time.process_time()
    for k in range(1, len(q)):
        if gravity is None:
            mujoco.mj_step(model, data, every)
        else:
            for i in range((k - 1) * every, k * every):
                model.opt.gravity[2], model.opt.wind[2] = gravity[i], wind[i]
                mujoco.mj_step(model, data)
        q[k], v[k] = data.qpos, data.qvel
    return q, v, time.process_time() - begin


def _see(model: Any, data: Any, q, v, gravity, wind) -> _Seen:
    """Replays the given states with gravity and wind of their instants [each]; not timed."""
    import mujoco

    seen = []
    for q_k, v_k, gravity_k, wind_k in zip(q, v, gravity, wind, strict=True):
        data.qpos[:], data.qvel[:] = q_k, v_k
        model.opt.gravity[2], model.opt.wind[2] = gravity_k, wind_k
        mujoco.mj_forward(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        arm = data.xipos[1:] - data.subtree_com[1]
        turning, moving = data.cvel[1:, :3], data.cvel[1:, 3:]
        velocity = moving + np.cross(turning, arm)
        # spatial acceleration, gravity subtracted, at the centre of the whole; the material one of each piece
        acceleration = data.cacc[1:, 3:] + np.cross(data.cacc[1:, :3], arm) + np.cross(turning, velocity)
        seen.append(
            (data.site_xpos[0].copy(), model.body_mass[1:] @ acceleration, velocity, data.xmat[1:, 0::3].copy())
        )
    return _Seen(*(np.array(x)[..., [0, 2]] for x in zip(*seen, strict=True)))


def mujoco_released(setting: Setting) -> Ours:
    """P2: t, tip_x, tip_z, top_tension."""
    import mujoco

    p, n = reference("P2").params, setting.elements
    link, mass = p["L"] / n, p["mu"] * p["L"] / n
    inertia = mass * link**2 / 12.0
    links = [
        (
            link,
            f'<joint type="hinge" axis="0 1 0" stiffness="{p["EI"] / link if i else 0.0}"/>',
            [_inertial(0.5 * link, mass, (1e-9, inertia, inertia))],
        )
        for i in range(n)
    ]
    model = _model(links, f'timestep="{setting.dt}" gravity="0 0 {-p["g"]}"')
    data = mujoco.MjData(model)
    q, v, cpu = _integrate(model, data, setting, p)
    still = np.zeros(len(q))
    seen = _see(model, data, q, v, still - p["g"], still)
    report = np.column_stack((p["dt_out"] * np.arange(len(q)), seen.tip, np.linalg.norm(seen.force, axis=1)))
    return Ours(str(setting), n, setting.dt, report, cpu, p["T"], 0, int(round(p["T"] / setting.dt)))


def _wet_piece(x: float, length: float, p: dict) -> str:
    """A piece whose box of equal inertia has the drag of the cable: 2 rho r_x r_y = rho C_n d l / 2 across,
    2 rho r_y r_z = rho C_t pi d l / 2 along, and the moment of inertia m l^2 / 12 of a thin rod about y."""
    ratio, mass = np.pi * p["Cdt"] / p["Cdn"], p["mu"] * length
    half_x = 0.5 * length / np.hypot(1.0, ratio)
    square = np.square((half_x, p["Cdn"] * p["d"] * length / (4.0 * half_x), ratio * half_x))
    return _inertial(x, mass, mass / 3.0 * (square.sum() - square))


def _towed_model(setting: Setting, lengths: np.ndarray, p: dict) -> Any:
    links, middle = [], int(np.argmin(abs(np.cumsum(lengths) - 0.5 * p["L"]))) + 1
    for i, length in enumerate(lengths):
        piece = length / setting.points
        stretch = f'<joint type="slide" axis="1 0 0" stiffness="{p["EA"] / p["L"]}"/>' if i == middle else ""
        links.append(
            (
                length,
                stretch + '<joint type="hinge" axis="0 1 0"/>',
                [_wet_piece((j + 0.5) * piece, piece, p) for j in range(setting.points)],
            )
        )
    end = f'<body pos="{lengths[-1]:.17g} 0 0">{_inertial(0.0, p["M"], (1e-9, 1e-9, 1e-9))}</body>'
    return _model(
        links, f'timestep="{setting.dt}" gravity="0 0 {-p["g"]}" density="{p["rho"]}" wind="{p["U"]} 0 0"', end
    )


def mujoco_towed(setting: Setting) -> Ours:
    """P5 and P6: t, tip_x, tip_z, top_tension."""
    import mujoco

    p = reference("P5").params
    arc = setting.arc(p["L"])
    model = _towed_model(setting, np.diff(arc), p)
    data, hinge = mujoco.MjData(model), model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
    # the towbody is the last piece of the last link
    lift = model.body_mass[1:] * (p["g"] - p["w"] / p["mu"])
    lift[-1] = p["M"] * p["g"] - p["Wnet"]
    data.xfrc_applied[1:, 2] = lift
    ahead = np.diff(static_places(arc), axis=0)
    data.qpos[hinge] = np.diff(-np.arctan2(ahead[:, 1], ahead[:, 0]), prepend=0.0)
    mujoco.mj_step(model, data, int(round(SETTLE / setting.dt)))
    count = int(round(p["T"] / setting.dt))
    middle = ramped_heave(p, setting.dt * (np.arange(count) + 0.5))[:, 0]
    q, v, cpu = _integrate(model, data, setting, p, -p["g"] - middle[:, 8], -middle[:, 5])
    times = p["dt_out"] * np.arange(len(q))
    top = ramped_heave(p, times)[:, 0]
    seen = _see(model, data, q, v, -p["g"] - top[:, 8], -top[:, 5])
    pieces = np.repeat(np.diff(arc) / setting.points, setting.points)
    force = seen.force - (0.0, lift.sum()) - _drag(seen, pieces, top, p)
    report = np.column_stack((times, seen.tip + top[:, [0, 2]] - (0.0, DEEP), np.linalg.norm(force, axis=1)))
    return Ours(str(setting), setting.elements, setting.dt, report, cpu, p["T"], 0, count)


def _drag(seen: _Seen, lengths: np.ndarray, top: np.ndarray, p: dict) -> np.ndarray:
    """Drag [instants, 2] (N) of the whole cable by the law of the scene, at the pieces."""
    flow = np.array((p["U"], 0.0)) - seen.velocity[:, : len(lengths)] - top[:, None, [3, 5]]
    tangent = seen.tangent[:, : len(lengths)]
    along = (flow * tangent).sum(2, keepdims=True) * tangent
    across = flow - along
    size_along, size_across = (np.linalg.norm(x, axis=2, keepdims=True) for x in (along, across))
    line = p["Cdn"] * size_across * across + np.pi * p["Cdt"] * size_along * along
    return 0.5 * p["rho"] * p["d"] * (lengths[:, None] * line).sum(1)
