"""A swaying jumper against a lumped chain solved beside the product, and its statics against the catenary.

The tolerances are those of the published case: 200 N at rest, 1300 N for the extremes of the motion.
"""

from __future__ import annotations

from math import asinh, pi, sinh, sqrt

import numpy as np
import pytest
from case_bench import case_of, check
from scipy.optimize import brentq

from verification.cases import CaseError, run_case

pytestmark = pytest.mark.trust

EXTREME = "{} top-end tension over the last cycles, motion along {}"

PUBLISHED = {
    "diameter_m": 0.396,
    "mass_per_length_kg_m": 165.0,
    "EA_N": 5e8,
    "EI_N_m2": 120800.0,
    "Cd_normal": 1.0,
    "Ca_normal": 1.0,
    "Cd_axial": 0.0,
    "Ca_axial": 0.0,
    "end_fixed_m": [-100.0, 0.0, -55.0],
    "end_moved_m": [0.0, 0.0, -5.0],
    "unstretched_length_m": 170.0,
    "water_depth_m": 100.0,
    "fluid_density": 1000.0,
    "g": 9.807,
    "motion": "top end moved sinusoidally, amplitude 10 m, period 27 s, still water",
}
OTHER = {
    **PUBLISHED,
    "diameter_m": 0.25,
    "mass_per_length_kg_m": 90.0,
    "EI_N_m2": 20000.0,
    "Cd_normal": 1.2,
    "end_fixed_m": [70.0, 0.0, -60.0],
    "end_moved_m": [0.0, 0.0, -30.0],
    "unstretched_length_m": 120.0,
    "fluid_density": 1025.0,
    "g": 9.81,
    "motion": "top end moved sinusoidally, amplitude 5 m, period 16 s",
}


def at_rest(inputs: dict) -> dict:
    """End forces of the inextensible catenary."""
    low, high = np.array(inputs["end_fixed_m"]), np.array(inputs["end_moved_m"])
    span, rise, length = abs(high[0] - low[0]), high[2] - low[2], inputs["unstretched_length_m"]
    w = inputs["g"] * (inputs["mass_per_length_kg_m"] - 0.25 * pi * inputs["diameter_m"] ** 2 * inputs["fluid_density"])
    a = brentq(lambda a: 2.0 * a * sinh(0.5 * span / a) - sqrt(length**2 - rise**2), 0.1 * span, 100.0 * span)
    middle = a * asinh(rise / (2.0 * a * sinh(0.5 * span / a)))  # x of the chord's middle from the lowest point
    up = w * a * sinh((middle + 0.5 * span) / a)
    return {
        "static force at the top end, horizontal": w * a,
        "static force at the bottom end, horizontal": w * a,
        "static force at the top end, vertical": up,
        "static force at the bottom end, vertical": w * length - up,
    }


def chain(inputs: dict, axis: int, amplitude: float, period: float, parts: int = 20) -> tuple[float, float]:
    """Largest and smallest tension of the part at the moved end over the fourth period: masses and springs, explicit.

    All wet, no bending, a hundredth of EA: its strain of about 0.5 % still counts for little.
    """
    length, d, rho, g = (inputs[k] for k in ("unstretched_length_m", "diameter_m", "fluid_density", "g"))
    part, ea = length / parts, 0.02 * inputs["EA_N"]
    mu, water = inputs["mass_per_length_kg_m"], 0.25 * pi * d**2 * rho
    first, last = np.array(inputs["end_fixed_m"]), np.array(inputs["end_moved_m"])
    s = np.linspace(0.0, 1.0, parts + 1)
    r, v = first + s[:, None] * (last - first), np.zeros((parts + 1, 3))
    r[:, 2] -= 0.3 * length * 4.0 * s * (1.0 - s)
    h = 0.3 * part / sqrt(ea / mu)
    still, report = 60.0, []
    for i in range(int((still + 4.0 * period) / h)):
        t = i * h - still
        u = min(max(t / period, 0.0), 1.0)
        w = 2.0 * pi / period
        up, d_up = u**3 * (10 - 15 * u + 6 * u * u), 30 * u * u * (1 - u) ** 2 / period
        r[-1] = last
        r[-1, axis] += amplitude * up * np.sin(w * t) * (t > 0.0)
        v[-1] = 0.0
        v[-1, axis] = amplitude * (d_up * np.sin(w * t) + up * w * np.cos(w * t)) * (t > 0.0)
        link = np.diff(r, axis=0)
        span = np.sqrt(np.einsum("ij,ij->i", link, link))
        along = link / span[:, None]
        pace = np.einsum("ij,ij->i", np.diff(v, axis=0), along)
        tension = ea * (span / part - 1.0) + 0.05 * sqrt(ea * mu) * pace
        pull = tension[:, None] * along
        t_node = along[1:] + along[:-1]
        t_node /= np.sqrt(np.einsum("ij,ij->i", t_node, t_node))[:, None]
        flow = -v[1:-1]
        flow = flow - np.einsum("ij,ij->i", flow, t_node)[:, None] * t_node
        force = (
            pull[1:]
            - pull[:-1]
            + 0.5 * rho * d * part * inputs["Cd_normal"] * flow * np.sqrt(np.einsum("ij,ij->i", flow, flow))[:, None]
        )
        force[:, 2] -= (mu - water) * g * part
        force -= (0.05 if t < -10.0 else 0.0) * mu * part * v[1:-1]
        m, ma = mu * part, inputs["Ca_normal"] * water * part
        lengthwise = np.einsum("ij,ij->i", force, t_node)[:, None] * t_node
        a = (force - lengthwise) / (m + ma) + lengthwise / m
        v[1:-1] += h * a
        r[1:-1] += h * v[1:-1]
        if t > 3.0 * period:
            report.append(tension[-1] + 0.5 * part * (mu - water) * g * along[-1, 2])
    return max(report), min(report)


@pytest.mark.parametrize("inputs", [PUBLISHED, OTHER])
def test_end_forces_at_rest_are_those_of_the_catenary(inputs):
    check(inputs, {name: (value, 0, 200.0) for name, value in at_rest(inputs).items()})


@pytest.mark.parametrize(
    "inputs, axis, amplitude, period",
    [
        pytest.param(PUBLISHED, "x", 10.0, 27.0, marks=pytest.mark.nightly),
        (PUBLISHED, "y", 10.0, 27.0),
        (OTHER, "z", 5.0, 16.0),
    ],
)
def test_tension_extremes_are_those_of_a_lumped_chain(inputs, axis, amplitude, period):
    meant = chain(inputs, "xyz".index(axis), amplitude, period)
    check(inputs, {EXTREME.format(what, axis): (x, 0, 1300.0) for what, x in zip(("largest", "smallest"), meant)})


def test_a_motion_that_is_not_understood_is_refused():
    case = case_of({**PUBLISHED, "motion": "as it likes"}, {EXTREME.format("largest", "x"): (0, 1300.0)})
    with pytest.raises(CaseError, match="inline: inputs.motion"):
        run_case(case)
