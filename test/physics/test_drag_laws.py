"""Drag laws: printed and mended coefficients, blends with exact derivatives, reversed flow, no energy, sections."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from bench_cable import Bench
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cable_sim_ros.compiler.jit import LANES
from cable_sim_ros.physics import ancf, drag, mesh_motion
from cable_sim_ros.physics.cable_assembly import Cable
from cable_sim_ros.physics.drag_laws import (
    FITS,
    FRICTION,
    GRAZING,
    HK_6,
    HK_10,
    HK_10_PRINTED,
    LAWS,
    DragLaw,
    choo_casarella,
    fitted,
)
from cable_sim_ros.physics.drag_laws import element_rows as law_rows
from cable_sim_ros.physics.fairing import dressed
from cable_sim_ros.physics.section import Section
from cable_sim_ros.physics.water import Water

pytestmark = pytest.mark.check

LAWS_OF_RE = [law for law in LAWS if law is not DragLaw.OFF]
WATER = Water(density=1026.0, viscosity=1.2e-3)
UNIT = 0.5 * 1026.0 * 0.01  # rho d/2


def section_rows(**keys) -> dict[int, float]:
    section = dressed(Section(length=1.0, elements=1, **keys))
    return law_rows(section, Cable(diameter=0.01, mass_per_length=0.389, axial_stiffness=1e4, sections={}), WATER, 9.81)


def tables(rows: dict[int, float], flow, along=(1.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Element and point table of LANES points with the relative velocity flow [3] or [lanes, 3] past ``along``."""
    p, t = np.zeros((ancf.ROWS, LANES)), np.zeros((drag.POINT_ROWS, LANES))
    for row, value in rows.items():
        p[row] = value
    t[drag.POINT_V : drag.POINT_V + 3] = np.broadcast_to(flow, (LANES, 3)).T
    t[drag.POINT_U : drag.POINT_U + 3] = np.array(along)[:, None]
    return p, t


def force(rows: dict[int, float], flow, along=(1.0, 0.0, 0.0), steady=False) -> np.ndarray:
    """Drag [N/m] of the product's own kernels, [lanes, 3]; steady: the flow is its own mean, which is amplified."""
    p, t = tables(rows | {ancf.BUOYANCY: 0.0, ancf.ADDED_MASS: 0.0}, flow, along)
    t[drag.POINT_W : drag.POINT_W + 3] = t[drag.POINT_V : drag.POINT_V + 3]
    out = np.zeros((3, LANES))
    drag.water_load(t, p, np.ones(LANES), np.bool_(steady), out)
    return out.T


@pytest.mark.parametrize(
    "fit, values",
    [
        (HK_6, {1: 6.380, 10: 3.224, 50: 2.081, 500: 1.270, 2e5: 0.3}),
        (HK_10, {1: 10.00, 10: 2.526, 50: 1.666, 500: 1.036, 2000: 0.900, 6000: 0.990, 18810: 1.210, 2e5: 0.3}),
        (HK_10_PRINTED, {1: 10.00, 10: 2.526, 50: 1.566, 500: 1.036}),
        (FRICTION, {0.01: 10.331, 0.05: 10.331, 1: 1.88, 50: 0.1040, 1e3: 0.062}),
    ],
)
def test_fits_of_the_mended_equations(fit, values):
    for re, value in values.items():
        assert fitted(fit, float(re))[0] == pytest.approx(value, abs=1e-3)


@pytest.mark.parametrize("fit", [HK_6, HK_10, HK_10_PRINTED, FRICTION])
def test_a_fit_has_its_exact_derivative_through_every_blend(fit):
    """Over Re 1e-3 to 1e7, and densely at every bound; and it has no jump, of value or of derivative."""
    bounds = np.unique(FITS[fit, :, 0][np.isfinite(FITS[fit, :, 0])])
    near = (bounds[:, None] + np.linspace(-0.03, 0.03, 241)).ravel()
    re = 10.0 ** np.concatenate((np.linspace(-2.999, 7.0, 1001), near))
    step = 1e-7
    exact = np.array([fitted(fit, x)[1] * x for x in re])  # to ln Re
    found = np.array([(fitted(fit, x * (1 + step))[0] - fitted(fit, x * (1 - step))[0]) / (2 * step) for x in re])
    assert np.abs(found - exact).max() < 2e-5 * max(1.0, np.abs(exact).max())
    for bound in bounds:
        for edge in (bound - 0.025, bound, bound + 0.025):
            below, above = (np.array(fitted(fit, 10.0 ** (edge + s))) for s in (-1e-9, 1e-9))
            assert np.abs(above - below).max() < 1e-5 * max(1.0, np.abs(below).max())


def test_the_blend_is_a_twentieth_of_a_decade_wide():
    for bound in (2.0, np.log10(15e4)):
        i = int(np.flatnonzero(np.isclose(FITS[HK_10, :, 0], bound))[0])
        pieces = [FITS[HK_10, k, 1:] for k in (i, i + 1)]
        for x, (a, b, n, c) in zip((bound - 0.0251, bound + 0.0251), pieces, strict=True):
            assert fitted(HK_10, 10.0**x)[0] == pytest.approx(a + b * 10.0 ** (n * x) + c * x, rel=1e-12)
        lower, upper = (a + b * 10.0 ** (n * bound) + c * bound for a, b, n, c in pieces)
        assert fitted(HK_10, 10.0**bound)[0] == pytest.approx(0.5 * (lower + upper), rel=1e-12)


@pytest.mark.parametrize("law", [law for law in DragLaw if law is not DragLaw.OFF])
def test_reversed_flow_reverses_the_drag(law):
    rows = section_rows(drag_law=law, drag_coefficient=1.2 if LAWS[law].min_drag else None)
    for flow in ((2.0, 0.0, 0.3), (0.4, -1.0, 0.2), (1.5, 0.0, 0.0)):
        there, back = force(rows, flow)[0], force(rows, np.negative(flow))[0]
        np.testing.assert_allclose(back, -there, rtol=1e-12, atol=1e-15)
        assert there @ flow > 0.0 or law is DragLaw.DRISCOLL_NAHON_PRINTED or not LAWS[law].tangential[0]


def test_constants_of_dymore_and_capozucca():
    """(10)-(12) with c_f on pi d, the sign of U_1 mended; (3.5)-(3.6)."""
    flow = np.array((-1.5, 0.8, 0.6))
    normal, along = UNIT * 1.0 * np.array((0.0, 0.8, 0.6)), -UNIT * 1.5**2
    dymore = force(section_rows(drag_law="dymore", drag_coefficient=1.3, friction_coefficient=0.01), flow)[0]
    np.testing.assert_allclose(dymore, 1.3 * normal + (np.pi * 0.01 * along, 0.0, 0.0), rtol=2e-6)
    own = force(section_rows(drag_law="capozucca"), flow)[0]
    np.testing.assert_allclose(own, normal, rtol=2e-6, atol=1e-12)
    given_ = force(section_rows(drag_law="capozucca", drag_coefficient=1.1, friction_coefficient=0.02), flow)[0]
    np.testing.assert_allclose(given_, 1.1 * normal + (np.pi * 0.02 * along, 0.0, 0.0), rtol=2e-6)


def test_huston_kamman_takes_each_coefficient_at_its_own_reynolds_number():
    flow, re = np.array((-0.05, 0.08, 0.06)), 1026.0 * 0.01 / 1.2e-3
    for law, fit in ((DragLaw.HUSTON_KAMMAN_6, HK_6), (DragLaw.HUSTON_KAMMAN_10, HK_10)):
        cn, ct = fitted(fit, re * 0.1)[0], fitted(FRICTION, re * 0.05)[0]
        want = UNIT * np.array((-ct * 0.05**2, cn * 0.1 * 0.08, cn * 0.1 * 0.06))
        np.testing.assert_allclose(force(section_rows(drag_law=law), flow)[0], want, rtol=5e-4)
        fixed = force(section_rows(drag_law=law, tangential_coefficient=0.05), flow)[0]
        assert fixed[0] == pytest.approx(-UNIT * 0.05 * 0.05**2, rel=5e-4) and fixed[1] == pytest.approx(want[1], 5e-4)


def test_choo_casarella_and_crossflow_without_a_constant_are_one():
    flow = np.array((-1.0, 0.8, 0.6))
    named = force(section_rows(drag_law="choo_casarella", tangential_coefficient=0.03), flow)[0]
    assert (named == force(section_rows(drag_law="crossflow", tangential_coefficient=0.03), flow)[0]).all()
    cn = 1.1 + 4.0 / np.sqrt(1026.0 * 0.01 / 1.2e-3)  # of the flow across, 1 m/s of 1.41 m/s
    np.testing.assert_allclose(named, UNIT * np.array((-0.03, 0.8 * cn, 0.6 * cn)), rtol=2e-6)


@given(
    st.sampled_from(DragLaw),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    st.floats(-5.0, 1.2),
    st.sampled_from(("both", "normal")),
)
@settings(max_examples=100)
def test_no_law_adds_energy(law, way, size, of):
    """Drag takes power from any relative flow, from 1e-5 to 16 m/s, amplified or not, but for 0.11 as printed below 8
    degrees."""
    flow = 10.0**size * np.array(way)
    assume(law is not DragLaw.DRISCOLL_NAHON_PRINTED or np.hypot(*flow[1:]) > np.tan(np.radians(8.0)) * abs(flow[0]))
    factor = {"drag_amplification": 2.4, "drag_amplification_of": of}
    rows = section_rows(drag_law=law, drag_coefficient=1.2 if LAWS[law].min_drag else None, **factor)
    plain, more = (force(rows, flow, steady=steady)[0] @ flow for steady in (False, True))
    assert 0.0 <= plain <= more


@pytest.mark.parametrize("law", [law for law in DragLaw if law is not DragLaw.OFF])
def test_a_drag_factor_multiplies_what_the_section_says(law):
    flow, keys = np.array((-1.5, 0.8, 0.6)), {"drag_coefficient": 1.2} if LAWS[law].min_drag else {}
    if law not in (DragLaw.PODE, DragLaw.DRISCOLL_NAHON, DragLaw.DRISCOLL_NAHON_PRINTED, DragLaw.RIBBON):
        keys["tangential_coefficient"] = 0.03
    rest = force(section_rows(drag_law=law, **keys), flow, steady=True)[0]
    for of, along in (("both", 2.4), ("normal", 1.0), (None, 2.4)):
        rows = section_rows(drag_law=law, drag_amplification=2.4, drag_amplification_of=of, **keys)
        np.testing.assert_allclose(force(rows, flow, steady=True)[0], rest * (along, 2.4, 2.4), rtol=1e-12)
        assert (force(rows, flow)[0] == rest).all(), "of the mean flow alone"


def test_a_cable_drawn_along_itself_has_the_coefficient_of_the_whole_speed():
    """879 m of 11 mm hauled straight up at 1 m/s: 113 N; the C_D of 1 mm/s across, 2.6, would make it 258 N."""
    cable = Cable(diameter=0.011, mass_per_length=0.471, axial_stiffness=1e4, sections={})
    rows = law_rows(dressed(Section(length=1.0, elements=1)), cable, WATER, 9.81)
    re, unit = 1026.0 * 0.011 / 1.2e-3, 0.5 * 1026.0 * 0.011
    ft = sum(LAWS[DragLaw.DRISCOLL_NAHON].tangential[:6])
    for speed in (0.1, 1.0, 2.0):
        want = unit * choo_casarella(re * speed)[0] * ft * speed**2
        assert force(rows, (-speed, 0.0, 0.0))[0, 0] == pytest.approx(-want, rel=2e-3), "f_t at 1 mm/s across"
    assert -879.0 * force(rows, (-1.0, 0.0, 0.0))[0, 0] == pytest.approx(113.0, abs=1.0)
    across = 1.01 * GRAZING  # m/s at 1 m/s along: from here on it is that of the flow across the cable
    eta = np.arctan(across)
    c = LAWS[DragLaw.DRISCOLL_NAHON].tangential
    ft = c[0] + sum(c[k] * np.cos(k * eta) + c[5 + k] * np.sin(k * eta) for k in range(1, 6))
    want = unit * choo_casarella(re * across)[0] * ft * (1.0 + across**2)
    assert force(rows, (-1.0, across, 0.0))[0, 0] == pytest.approx(-want, rel=2e-5)
    v = np.geomspace(1e-4, 1.0, 400)
    along = np.concatenate([force(rows, [(-1.0, x, 0.0) for x in v[i : i + LANES]])[:, 0] for i in range(0, 400, 16)])
    assert (np.abs(np.diff(along) / along[:-1]) < 0.02).all(), "no jump between"
    assert np.ptp(along[v < 0.1]) < 0.1 * abs(along[0])


@pytest.mark.parametrize("law", LAWS_OF_RE)
@pytest.mark.parametrize("speed", [1e-4, 2e-3, 0.0117, 0.047, 0.5, 2.2, 12.0, 17.5])
def test_force_has_its_exact_derivative(law, speed):
    """d f/d V of the kernels against differences of their force, in lanes within every blend of C_N and C_T."""
    keys = {"drag_coefficient": 1.2} if LAWS[law].min_drag else {}
    if law is not DragLaw.PODE and not LAWS[law].own_friction:
        keys["tangential_coefficient"] = 0.03
    rows = section_rows(drag_law=law, **keys) | {ancf.BUOYANCY: 0.0, ancf.ADDED_MASS: 0.0}
    angle = np.concatenate(([0.02, 0.07, 0.0995], np.linspace(0.15, 3.12, LANES - 3)))
    flow = speed * np.stack((np.cos(angle), 0.6 * np.sin(angle), 0.8 * np.sin(angle)), 1)
    p, t = tables(rows, flow)
    t[drag.POINT_PER_G] = 1.0
    f, ka, kb = np.zeros((3, LANES)), np.zeros((9, LANES)), np.zeros((9, LANES))
    drag.coefficients(p, t, drag.POINT_V)
    drag.load_tangent_lanes(t, p, 1.0, 0.0, np.ones(LANES), f, ka, kb)
    step = 1e-6 * speed
    for c in range(3):
        found = (force(rows, flow + step * np.eye(3)[c]) - force(rows, flow - step * np.eye(3)[c])) / (2.0 * step)
        exact = -np.stack([ka[3 * r + c] for r in range(3)], 1)  # the load's derivative to -V
        assert np.abs(found - exact).max() < 1e-5 * np.abs(ka).max() + 1e-12
    turn = 1e-6  # of the unit tangent
    for c in range(3):
        sides = []
        for s in (turn, -turn):
            along = np.array((1.0, 0.0, 0.0)) + s * np.eye(3)[c]
            sides.append(force(rows, flow, along / np.linalg.norm(along)))
        exact = np.stack([kb[3 * r + c] for r in range(3)], 1)
        assert np.abs((sides[0] - sides[1]) / (2.0 * turn) - exact).max() < 1e-5 * np.abs(kb).max() + 1e-12


def test_a_whole_cable_of_the_new_laws_has_its_exact_tangent():
    for law in (DragLaw.HUSTON_KAMMAN_6, DragLaw.HUSTON_KAMMAN_10):
        bench = Bench(6, 3, law=law, current=(-1.0, 0.4, 0.02, -0.01))
        bench.wander(top=0.25)
        assert bench.worst() < 1e-6


def test_a_law_leaves_the_lanes_of_others_as_they_are():
    flow = np.array((-1.0, 0.8, 0.6))
    p, t = tables(section_rows(), flow)
    for row, value in section_rows(drag_law="huston_kamman_6").items():
        p[row, 5] = value
    out = np.zeros((3, LANES))
    drag.water_load(t, p, np.ones(LANES), np.bool_(False), out)
    alone, other = force(section_rows(), flow)[0], force(section_rows(drag_law="huston_kamman_6"), flow)[0]
    up = (0.0, 0.0, section_rows()[ancf.BUOYANCY])
    np.testing.assert_allclose(out[:, 4], alone + up, rtol=1e-15)
    np.testing.assert_allclose(out[:, 5], other + up, rtol=1e-15)


def test_rows_of_a_law_that_needs_a_constant():
    for keys in ({"drag_law": "dymore"}, {"drag_law": "pode", "tangential_coefficient": 0.02}):
        with pytest.raises(ValueError, match="needs a constant C_D above 0, .*built. Give drag_coefficient"):
            section_rows(**keys)


def test_an_element_of_two_sections_averages_the_coefficients_of_its_own():
    """C_N of the longer part; C_T of each by its length (both are 10 mm thick)."""
    factor = {"drag_amplification": 2.5, "drag_amplification_of": "normal"}
    parts = (
        {"drag_law": "crossflow", "tangential_coefficient": 0.03, "drag_amplification": 3.0},
        {"drag_law": "huston_kamman_6"} | factor,
    )
    materials = np.zeros((2, ancf.ROWS))
    for row, keys in zip(materials, parts, strict=True):
        for index, value in section_rows(**keys).items():
            row[index] = value
    materials[:, ancf.EA] = 1e4
    zones = np.rec.array([(10.0,), (20.0,)], dtype=[("end", "f8")])
    rows = np.zeros((ancf.ROWS, LANES))
    getattr(mesh_motion.mix, "py_func", mesh_motion.mix)(
        SimpleNamespace(zones=zones, materials=materials), 0, 8.0, 13.0, rows, 2
    )
    assert rows[ancf.EXTRA_DRAG, 2] == pytest.approx(0.4 * 2.0 + 0.6 * 1.5)
    assert rows[ancf.EXTRA_ALONG, 2] == pytest.approx(0.4 * 2.0)
    assert rows[ancf.CN_FIT, 2] == HK_6 and rows[ancf.CD_FIXED, 2] == -1.0
    assert rows[ancf.CT_FIXED, 2] == pytest.approx(0.4 * 0.03) and rows[ancf.CT_OF_RE, 2] == pytest.approx(0.6)
    np.testing.assert_allclose(rows[ancf.FN : ancf.FN + 5, 2], LAWS[DragLaw.CROSSFLOW].normal, rtol=1e-12)
