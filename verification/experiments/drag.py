"""Drag laws beside what is printed of them: coefficients, loading functions, critical angles of a heavy straight cable.

Every figure of ours is a force of the product's own kernels on an element of one law a lane: nothing is computed from
a formula beside them. A critical angle is that of a straight cable towed without an end, at which the forces across it
cancel: w cos h = q G C_N f_n(h).
"""

from __future__ import annotations

import warnings
from math import pi, radians
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.compiler.jit import LANES
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics import drag
from cable_sim_ros.physics.ancf import ADDED_MASS, BUOYANCY, RE_FACTOR, ROWS
from cable_sim_ros.physics.cable_assembly import Cable
from cable_sim_ros.physics.drag_laws import DragLaw, element_rows
from cable_sim_ros.physics.fairing import dressed
from cable_sim_ros.physics.section import Section
from cable_sim_ros.physics.water import Water
from cable_sim_ros.plots.run import canvas
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.terminal import markdown_table

from . import Comparison, Result

DIAMETER, MASS, SPEED, GRAVITY = 0.010, 0.389, 2.2, 9.81  # of Westin's cable and tow
WATER = Water(density=1026.0, viscosity=1.2e-3)
UNIT = 0.5 * WATER.density * DIAMETER  # N/m of a coefficient of 1 at 1 m/s
FAST = 1e3  # m/s
SQUARE = radians(89.995)  # at 90 deg the smooth sign of the flow along the cable is 0
FACTORS = (1.0, 1.737, 2.737, 3.54, 4.54)  # of the drag, total


class Model(NamedTuple):
    """A law with its keys and the critical angles [deg] at FACTORS, from its formula by an independent solution."""

    name: str
    keys: dict
    angles: tuple[float, ...]


def _dymore(constant: float, *angles: float) -> Model:
    return Model(f"DY c_d {constant:g}", {"drag_law": DragLaw.DYMORE, "drag_coefficient": constant}, angles)


MODELS = (
    Model("HK eq. 6, C_N 1.27", {"drag_law": DragLaw.HUSTON_KAMMAN_6}, (17.60, 13.40, 10.70, 9.41, 8.32)),
    Model("HK eq. 10 mended", {"drag_law": DragLaw.HUSTON_KAMMAN_10}, (19.76, 15.49, 12.67, 11.17, 9.87)),
    _dymore(0.5, 27.68, 21.20, 16.97, 14.95, 13.22),
    _dymore(1.0, 19.79, 15.09, 12.04, 10.60, 9.37),
    _dymore(1.2, 18.10, 13.79, 11.00, 9.68, 8.55),
    _dymore(2.0, 14.07, 10.70, 8.53, 7.51, 6.63),
    Model("CZ 3.6, C_dn 1.0", {"drag_law": DragLaw.CAPOZUCCA}, (19.79, 15.09, 12.04, 10.60, 9.37)),
    Model("W (14)+(18), sin^2", {"drag_law": DragLaw.CHOO_CASARELLA}, (18.47, 14.02, 11.16, 9.80, 8.64)),
    Model("W (58)-(61), 0.11", {"drag_law": DragLaw.DRISCOLL_NAHON_PRINTED}, (23.74, 19.31, 16.47, 15.14, 14.02)),
    Model("W (58)-(61), 0.011", {"drag_law": DragLaw.DRISCOLL_NAHON}, (17.51, 12.76, 9.72, 8.29, 7.07)),
    Model("W (145) ribbon, same C_D", {"drag_law": DragLaw.RIBBON}, (14.44, 9.55, 6.60, 5.30, 4.25)),
)
# C_N by Reynolds number, from the mended formulas
COEFFICIENTS = {
    DragLaw.HUSTON_KAMMAN_6: {1: 6.380, 10: 3.224, 50: 2.081, 500: 1.270},
    DragLaw.HUSTON_KAMMAN_10: {1: 10.00, 10: 2.526, 50: 1.666, 500: 1.036, 2000: 0.900, 6000: 0.990, 18810: 1.210},
}
ETA = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0)
FRICTION = 0.02  # c_f of the column beside f_t
# f_n and f_t by angle, and the friction of a cross-flow law: the columns of LOADINGS
LOADING_TABLE = (
    (0.0076, -0.0039, 0.0133, 0.0199, 0.0624, 0.0268, 0.1230),
    (0.0302, 0.0054, 0.0392, 0.0198, 0.0609, 0.0627, 0.1276),
    (0.1170, 0.0631, 0.1267, 0.0198, 0.0555, 0.1597, 0.1307),
    (0.2500, 0.1681, 0.2539, 0.0195, 0.0471, 0.2842, 0.1277),
    (0.5000, 0.3900, 0.4890, 0.0185, 0.0314, 0.5006, 0.1153),
    (0.7500, 0.6413, 0.7271, 0.0165, 0.0157, 0.7169, 0.0960),
    (1.0000, 1.0000, 1.0000, 0.0, 0.0, 1.0000, 0.0295),
)
LOADINGS = (  # law and component: 0 across, 1 along
    ("f_n crossflow", DragLaw.CROSSFLOW, 0),
    ("f_n 0.11", DragLaw.DRISCOLL_NAHON_PRINTED, 0),
    ("f_n 0.011", DragLaw.DRISCOLL_NAHON, 0),
    ("f_t", DragLaw.DRISCOLL_NAHON, 1),
    ("c_f 0.02", DragLaw.CROSSFLOW, 1),
    ("f_n ribbon", DragLaw.RIBBON, 0),
    ("f_t ribbon", DragLaw.RIBBON, 1),
)
OTHERWISE = {  # of the bare part of full_scale
    "0.11 on sin 2 eta as printed": {"drag_law": "driscoll_nahon_printed"},
    "choo_casarella, no drag along": {"drag_law": "choo_casarella"},
    "choo_casarella, c_f 0.01": {"drag_law": "choo_casarella", "friction_coefficient": 0.01},
    "huston_kamman_6": {"drag_law": "huston_kamman_6"},
    "huston_kamman_10": {"drag_law": "huston_kamman_10"},
    "huston_kamman_10_row_2_printed": {"drag_law": "huston_kamman_10_row_2_printed"},
    "dymore, c_d 1.2, c_f 0.01": {"drag_law": "dymore", "drag_coefficient": 1.2, "friction_coefficient": 0.01},
    "capozucca": {"drag_law": "capozucca"},
}


def rows_of(**keys) -> np.ndarray:
    """Element table [ROWS] of a section with these keys on Westin's cable."""
    section, out = dressed(Section(length=1.0, elements=1, **keys)), np.zeros(ROWS)
    cable = Cable(diameter=DIAMETER, mass_per_length=MASS, axial_stiffness=1e6, sections={"all": section})
    for row, value in element_rows(section, cable, WATER, GRAVITY).items():
        out[row] = value
    return out


def forces(rows: np.ndarray, speed: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Drag and buoyancy [n, 2] N/m, across (away from the stream and up) and along a straight cable at rest, kernels
    of the product: element tables [n, ROWS], speed [n] m/s of the water, its angle [n] rad to the cable."""
    out, n = [], len(rows)
    for first in range(0, n, LANES):
        lanes = np.minimum(np.arange(first, first + LANES), n - 1)
        p, t, load = rows[lanes].T.copy(), np.zeros((drag.POINT_ROWS, LANES)), np.zeros((3, LANES))
        p[ADDED_MASS] = 0.0
        c, s = np.cos(angle[lanes]), np.sin(angle[lanes])
        for row in (drag.POINT_V, drag.POINT_W):
            t[row] = speed[lanes]
        t[drag.POINT_U], t[drag.POINT_U + 2] = c, -s  # from the ship down
        drag.water_load(t, p, np.ones(LANES), np.bool_(True), load)
        out.append(np.stack((load[0] * s + load[2] * c, load[0] * c - load[2] * s), 1))
    return np.concatenate(out)[:n]


def critical_angles(models=MODELS, factors=FACTORS) -> np.ndarray:
    """Angle [models, factors] deg from the horizontal at which the forces across a straight heavy cable cancel."""
    rows = np.stack([rows_of(drag_amplification=g, **model.keys) for model in models for g in factors])
    low, high = np.full(len(rows), radians(0.5)), np.full(len(rows), 0.5 * pi)
    speed = np.full(len(rows), SPEED)
    for _ in range(50):
        middle = 0.5 * (low + high)
        lifts = forces(rows, speed, middle)[:, 0] > MASS * GRAVITY * np.cos(middle)
        low, high = np.where(lifts, low, middle), np.where(lifts, middle, high)
    return np.degrees(0.5 * (low + high)).reshape(len(models), len(factors))


def coefficient(law: DragLaw, re: float) -> float:
    """C_N of a cable across a stream of this Reynolds number."""
    return float(_unit_force(rows_of(drag_law=law), re, 0.5 * pi)[0])


def _unit_force(rows: np.ndarray, re: float, angle: float) -> np.ndarray:
    """Force over rho d V^2/2, across and along, at this Reynolds number: by the viscosity of the water, for the floor
    of 1 mm/s does not show at a speed of 1 km/s."""
    rows = rows.copy()
    rows[BUOYANCY], rows[RE_FACTOR] = 0.0, re / FAST
    return forces(rows[None], np.array([FAST]), np.array([angle]))[0] / (UNIT * FAST**2)


def loading_functions() -> np.ndarray:
    """f_n and f_t [angles, LOADINGS] of the product, C_D held at 1."""
    return np.array([[_loading(law, component, eta) for _, law, component in LOADINGS] for eta in ETA])


def _loading(law: DragLaw, component: int, eta: float) -> float:
    """f_n (component 0) or f_t (1) of a law at an angle [deg]."""
    own = {"friction_coefficient": FRICTION} if law is DragLaw.CROSSFLOW else {}
    rows = rows_of(drag_law=law, drag_coefficient=1.0, **own)
    return float(_unit_force(rows, 1.0, min(radians(eta), SQUARE))[component])


def _differences() -> list[Comparison]:
    """Printed figures that are not ours, and why."""
    ten = DragLaw.HUSTON_KAMMAN_10
    reversed_ = rows_of(drag_law=DragLaw.DYMORE, drag_coefficient=1.0, friction_coefficient=0.01)
    reversed_[BUOYANCY] = 0.0
    along = float(forces(reversed_[None], np.array([1.0]), np.array([pi]))[0, 1])
    small = _loading(DragLaw.DRISCOLL_NAHON, 0, 4.0)
    still = float(_unit_force(rows_of(drag_law=ten), 0.05, 0.0)[1])
    said = (
        ("C_N eq. 6 at Re 0.1", "1", coefficient(DragLaw.HUSTON_KAMMAN_6, 0.1), 0.0,
         "HK: 0 up to 0.1 is a guard, the branch above it is 13.13 there and is extended"),
        ("C_T eq. 7 at Re 0.05", "1", still, None, "HK: not defined below 0.1, held there"),
        ("C_N eq. 10 row 1 at Re 10", "1", coefficient(ten, 10.0), 1.45 + 8.55 * 10.0**-0.4,
         "HK: Re^-0.40 printed, -0.90 in W (61): 3.64 printed at 30, where row 2 has 1.83"),
        ("C_N eq. 10 row 2 at Re 50", "1", coefficient(ten, 50.0), 1.0 + 4.0 / 50.0**0.5,
         "HK: 1.0 printed, 1.1 in W (18) and (61); huston_kamman_10_row_2_printed has 1.0"),
        ("C_N eq. 10 row 5 at Re 6000", "1", coefficient(ten, 6000.0), 1.05 + 0.54 * np.log10(6000.0),
         "HK: + 1.05 printed, - 1.05 joins its neighbours 0.90 and 1.21"),
        ("F_1 eq. 12a in reversed flow", "N/m", along, UNIT * pi * 0.01,
         "DY: V_par V_par printed, which loses the sign; 1 m/s, c_f 0.01"),
        ("f_n at 4 deg", "1", small, -0.0042, "W (60a): 0.11 printed, 0.011 by judgement"),
    )  # fmt: skip
    return [Comparison(name, unit, ours, printed, None, why) for name, unit, ours, printed, why in said]


def _otherwise() -> list[dict]:
    """What another law of the bare part changes in the static shape of full_scale."""
    scene = load_scene("full_scale")
    route = layout_of(scene).route
    scope, report = route.scope, []
    for name, keys in ({"as shipped": {}} | OTHERWISE).items():
        with warnings.catch_warnings(action="ignore"):  # laws outside their range are what is compared
            other = override(scene, {f"cable.sections.bare.{key}": value for key, value in keys.items()})
        shape = layout_of(other).shape(scope)
        report.append((name, -shape.place[0, 2], np.degrees(shape.angle), shape.tension[-1]))
    first = report[0]
    return [
        {"choice": name, "depth m": d - first[1], "top angle deg": a - first[2], "top tension N": t - first[3]}
        for name, d, a, t in report[1:]
    ]


def experiment(progress) -> Result:
    """Coefficients, critical angles, loading functions and what differs from the print."""
    rows = [
        Comparison(f"C_N of {law.value} at Re {re}", "1", coefficient(law, re), value, 1e-3, "formula, mended")
        for law, values in COEFFICIENTS.items()
        for re, value in values.items()
    ]
    progress("critical angles", 1, 3)
    for model, ours in zip(MODELS, critical_angles(), strict=True):
        rows += [
            Comparison(f"critical angle, {model.name}, factor {g:g}", "deg", float(a), want, 0.01, "w cos h = q C f_n")
            for g, a, want in zip(FACTORS, ours, model.angles, strict=True)
        ]
    for eta, ours, printed in zip(ETA, loading_functions(), LOADING_TABLE, strict=True):
        rows += [
            Comparison(f"{name} at {eta:g} deg", "1", float(value), want, 1e-4, "formula; negative f_t counts as 0")
            for (name, _, _), value, want in zip(LOADINGS, ours, printed, strict=True)
        ]
    progress("full_scale with other laws", 2, 3)
    return Result(
        "drag",
        rows + _differences(),
        _otherwise(),
        lambda folder: draw(folder / "drag.png"),
        tables=lambda: [*printed_tables(), *page_tables()],
        shown=page_tables,
    )


def printed_tables() -> list[str]:
    """The cases of the print as they are computed."""
    angles = [[m.name, *(f"{x:.2f}" for x in row)] for m, row in zip(MODELS, critical_angles(), strict=True)]
    functions = [
        [f"{eta:g}", *(f"{round(x, 4) + 0.0:.4f}" for x in row)]
        for eta, row in zip(ETA, loading_functions(), strict=True)
    ]
    return [
        "Critical angle [deg] of a long straight cable by total drag factor, `w cos h = G q C_N f_n(h)`:\n"
        "10 mm, 0.389 kg/m, 1026 kg/m3, 1.2e-3 Pa s, 2.2 m/s:",
        markdown_table([["model", *(f"{g:g}" for g in FACTORS)], *angles]),
        "Loading functions; eta in deg, $f_t$ below 0 counts as zero:",
        markdown_table([["eta", *(name for name, _, _ in LOADINGS)], *functions]),
    ]


def page_tables() -> list[str]:
    """What docs/experiments.md has of the laws: what differs from the print and what a law changes."""
    differences = [
        [r.name, "-" if r.measured is None else f"{r.measured:.4g}", f"{r.ours:.4g}", r.source] for r in _differences()
    ]
    choices = _otherwise()
    changes = [[c["choice"], *(f"{x:+.1f}" for name, x in c.items() if name != "choice")] for c in choices]
    return [
        "What does not agree with the print, and why:",
        markdown_table([["figure", "printed", "ours", "why"], *differences]),
        "What another law of the bare part changes in the static shape of `full_scale`:",
        markdown_table([["law", *list(choices[0])[1:]], *changes]),
    ]


DASHES = "-", (0, (6, 2)), (0, (1, 1)), "-.", (0, (8, 2, 1, 2, 1, 2))  # told apart without colours


def draw(path: Path) -> Path:
    """C_N over Re of the laws, and f_n over the angle."""
    re, eta = np.logspace(-1.0, 6.0, 700), np.linspace(0.0, 90.0, 181)
    with canvas(path, (14.0, 6.5), "Drag laws of a cable", "laws and their sources: docs/drag.md") as figure:
        left, right = figure.subplots(1, 2)
        dashes = iter(DASHES)
        for law in (*COEFFICIENTS, DragLaw.HUSTON_KAMMAN_10_ROW_2_PRINTED, DragLaw.CHOO_CASARELLA, DragLaw.CAPOZUCCA):
            left.loglog(re, [coefficient(law, x) for x in re], ls=next(dashes), lw=1.8, label=law.value)
        left.set(title="Coefficient across the stream", xlabel="Reynolds number", ylabel="C_N [-]", ylim=(0.2, 20.0))
        dashes = iter(DASHES)
        for name, law, component in LOADINGS:
            if component == 0:
                right.plot(eta, [_loading(law, 0, x) for x in eta], ls=next(dashes), lw=1.8, label=name)
        right.set(title="Loading function", xlabel="angle between cable and flow [deg]", ylabel="f_n [-]")
        left.legend(loc="upper right", fontsize=9)
        right.legend(loc="upper left")
    return path
