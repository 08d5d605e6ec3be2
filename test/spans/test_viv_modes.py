"""Frequencies, shapes and damping ratios: printed values, closed forms, limits."""

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.optimize import brentq
from scipy.special import j0, y0
from spans import span

from cable_sim_ros.tools.spans.in_frequency.files import changed, load_span
from cable_sim_ros.tools.spans.in_frequency.modes import (
    damping,
    exact_frequencies,
    frequencies,
    modal_mass,
    region,
    shapes,
)
from cable_sim_ros.tools.spans.in_frequency.response import correlation_length, count_modes, vibration
from cable_sim_ros.tools.spans.in_frequency.span import Line, Region, Shape
from verification.experiments.viv import CASES, mode_rows

pytestmark = pytest.mark.trust

EXACT = (0.92255, 0.92632, 1.08238, 0.052767)  # Hz, of mode 1


@pytest.mark.parametrize("case, exact", list(zip(CASES, EXACT, strict=True)), ids=[case.figure for case in CASES])
def test_frequencies_and_damping_ratios_are_the_printed_ones(case, exact):
    """On the source's grid; those apart have their reason on the page of experiments."""
    span = load_span(case.file)
    rows = [row for row in mode_rows(case, vibration(span)) if not row.why]
    assert all(abs(row.ours - row.measured) <= row.allowed for row in rows) and len(rows) > len(case.ratios) - 4
    assert exact_frequencies(Line(span), 1)[0] == pytest.approx(exact, rel=1e-4)


def test_the_frequency_of_the_text_with_a_tension_that_grows_by_1_pound_a_foot():
    case = changed(load_span("capozucca_5_7"), tension={"gradient": 14.593903})
    assert frequencies(Line(case), 1)[0] == pytest.approx(0.95895, rel=1e-4)
    assert exact_frequencies(Line(case), 1)[0] == pytest.approx(0.95888, rel=1e-4)


def test_masses_by_standard_gravity_would_miss_two_printed_frequencies():
    missed = 0
    for name, printed in ((case.file, case.frequency) for case in CASES):
        case = load_span(name)
        heavier = 32.2 / 32.17405
        case = changed(
            case,
            cable={"mass_per_length": case.cable.mass_per_length * heavier},
            water={"density": case.water.density * heavier},
        )
        missed += round(float(frequencies(Line(case), 1)[0]), 3) != printed
    assert missed == 2


@pytest.mark.parametrize("gradient", [-50.0, 30.0, 400.0])
def test_exact_frequencies_are_those_of_the_bessel_functions(gradient):
    line = Line(span(tension={"start": 1500.0, "gradient": gradient}))
    mass = float(line.mass(0.0))
    ends = np.sqrt(mass * line.tension(np.array((0.0, line.length)))) * 2.0 / abs(gradient)

    def across(omega):
        a, b = omega * ends
        return j0(a) * y0(b) - j0(b) * y0(a)

    exact = exact_frequencies(line, 5)
    for f in exact:
        omega = 2.0 * np.pi * f
        assert brentq(across, 0.99 * omega, 1.01 * omega, xtol=1e-14) == pytest.approx(omega, rel=1e-6)


def test_a_constant_tension_is_the_taut_string():
    line = Line(span())
    mass = 0.9 + 1000.0 * np.pi * 0.03**2 / 4.0
    n = np.arange(1, 9)
    expected = n / (2.0 * 17.0) * np.sqrt(1500.0 / mass)
    assert frequencies(line, 8) == pytest.approx(expected, rel=1e-13)
    assert exact_frequencies(line, 8) == pytest.approx(expected, rel=1e-7)
    s = np.linspace(0.0, 17.0, 33)
    assert shapes(line, s, 8) == pytest.approx(np.sin(n[:, None] * np.pi * s / 17.0), abs=1e-12)
    assert modal_mass(line) == pytest.approx(modal_mass(line, Shape.SINE)) == pytest.approx(0.5 * mass * 17.0)


def test_bending_stiffness_of_a_pinned_beam_under_tension():
    line = Line(span(cable={"bending_stiffness": 150.0}))
    n = np.arange(1, 7)
    wave = n * np.pi / 17.0
    expected = np.sqrt((1500.0 * wave**2 + 150.0 * wave**4) / line.mass(0.0)) / (2.0 * np.pi)
    assert frequencies(line, 6) == pytest.approx(expected, rel=1e-12)
    assert exact_frequencies(line, 6) == pytest.approx(expected, rel=1e-6)


def test_travel_time_of_a_linear_tension_in_closed_form_and_its_limit():
    s = np.linspace(0.0, 17.0, 50)
    still = Line(span()).travel_time(s)
    for w in (-80.0, -1e-9, 1e-12, 1e-5, 500.0, 1e5):
        line = Line(span(tension={"start": 1500.0, "gradient": w}))
        mass = line.mass(0.0)
        if abs(w) > 1e-2:
            closed = 2.0 * np.sqrt(mass) / w * (np.sqrt(1500.0 + w * s) - np.sqrt(1500.0))
            assert line.travel_time(s) == pytest.approx(closed, rel=1e-11)
        else:
            assert line.travel_time(s) == pytest.approx(still * (1.0 - 0.25 * w * s / 1500.0), rel=1e-11)


def test_a_table_of_the_tension_is_the_linear_tension():
    linear = span(tension={"start": 1500.0, "gradient": 40.0})
    arc = [0.0, 3.0, 11.0, 17.0]
    table = span(tension={"start": None}, profile={"arc": arc, "tension": [1500.0 + 40.0 * s for s in arc]})
    s = np.linspace(0.0, 17.0, 77)
    assert Line(table).travel_time(s) == pytest.approx(Line(linear).travel_time(s), rel=1e-13)
    assert exact_frequencies(Line(table), 4) == pytest.approx(exact_frequencies(Line(linear), 4), rel=1e-9)


def test_mass_and_diameter_by_table_against_finite_differences():
    """WKB of a slowly varying line is near the exact frequencies, and nearer in higher modes."""
    line = Line(
        span(
            profile={
                "arc": [0.0, 5.0, 17.0],
                "tension": [1200.0, 1400.0, 2100.0],
                "mass_per_length": [0.9, 1.2, 1.0],
                "diameter": [0.03, 0.028, 0.033],
            },
            tension={"start": None},
        )
    )
    apart = np.abs(frequencies(line, 8) / exact_frequencies(line, 8) - 1.0)
    assert apart[0] < 0.02 and apart[7] < 1e-3
    s = np.linspace(0.0, 17.0, 20001)
    slowness = np.sqrt(line.mass(s) / line.tension(s))
    assert line.crossing == pytest.approx(trapezoid(slowness, s), rel=1e-7)


def ratios(name, **changes):
    case = changed(load_span(name), damping=changes)
    line = Line(case)
    count = count_modes(case, line)
    return damping(line, case.damping, count, correlation_length(case, line)).ratios


@pytest.mark.parametrize(
    "name, converged, each_way",
    [
        ("capozucca_5_5", (0.2409, 0.1276, 0.0684, 0.0454), (0.2346, 0.1252, 0.0678, 0.0446)),
        ("capozucca_5_7", (0.2400, 0.1270, 0.0674, 0.0457), (0.2342, 0.1254, 0.0677, 0.0444)),
        ("capozucca_5_11", (0.2026, 0.1018, 0.0409, 0.0602), (0.2009, 0.1069, 0.0407, 0.0605)),
    ],
)
def test_damping_ratios_converged_and_with_a_driven_part_of_a_correlation_length_each_way(name, converged, each_way):
    assert ratios(name, segments=4000) == pytest.approx(converged, rel=0.01)
    assert ratios(name, region="correlation_length") == pytest.approx(each_way, abs=1e-4)


def test_the_plain_sine_is_apart_from_the_shape_with_its_amplitude():
    sine, wkb = (ratios("capozucca_5_11", segments=4000, mode_shape=shape) for shape in ("sine", "wkb"))
    assert sine[0] / wkb[0] - 1.0 == pytest.approx(-0.03, abs=0.01)
    assert ratios("capozucca_5_5", mode_shape="wkb") == pytest.approx(ratios("capozucca_5_5"), rel=1e-12)


def test_the_whole_cable_damps_a_linear_shear_as_in_closed_form():
    """(4.27): gamma C_D V_r (omega_p / omega_n) / (4 pi^2 (sg + C_a)), where V_r omega_p = 2 pi V_p / D."""
    case = span(
        flow={"speed": [0.0, 0.8]},
        damping={"region": "off", "structural": 1e-6, "motion_factor": 1.1, "drag_coefficient": 1.2},
    )
    line = Line(case)
    found = damping(line, case.damping, 3, 1.0)
    heavier = 0.9 / (1000.0 * np.pi * 0.03**2 / 4.0)  # sg
    omega = 2.0 * np.pi * frequencies(line, 3)
    expected = 1.1 * 1.2 * 2.0 * np.pi * 0.8 / 0.03 / omega / (4.0 * np.pi**2 * (heavier + 1.0))
    assert found.ratios - 1e-6 == pytest.approx(expected, rel=1e-6)
    assert found.whole == pytest.approx(found.ratios) and found.driven == [[], [], []]


def test_a_mode_above_the_top_shedding_frequency_is_driven_nowhere():
    case = span(flow={"speed": [0.65, 0.3]})
    line = Line(case)
    s = np.linspace(0.0, 17.0, 1001)
    f = frequencies(line, 8)
    for law in Region:
        inside = region(line, s, f, law, 1.0).any(1)
        assert not inside[f > line.shedding_range[1]].any()
        assert inside.any() == (law is not Region.OFF)


def test_a_place_of_resonance_in_each_branch_of_a_flow_drives():
    case = span(flow={"arc": [0.0, 8.5, 17.0], "speed": [0.0, 0.65, 0.0]}, damping={"region": "correlation_length"})
    line = Line(case)
    driven = damping(line, case.damping, 3, 0.5).driven
    assert [len(parts) for parts in driven] == [2, 2, 2]
    for (a, b), (c, d) in driven:
        assert (a + d, b + c) == pytest.approx((17.0, 17.0), abs=0.01) and b - a == pytest.approx(1.0, abs=0.02)


SMALL_INPUT = (57.25, 1.125, 0.5764, 349.0, 0.125, ((0.0, 2.15), (1.0, 0.0)))
RISER = (0.0, 0.0), (0.25, 0.5), (0.375, 1.2), (0.5, 1.85), (0.625, 2.7), (0.75, 3.8), (1.0, 4.0)


@pytest.mark.parametrize(
    "name, gradient, printed",
    [
        ("capozucca_5_5", 0.0, SMALL_INPUT),
        ("capozucca_5_7", 0.1, SMALL_INPUT),
        ("capozucca_5_11", 5.0, SMALL_INPUT),
        ("capozucca_5_15", 28.6, (2000.0, 9.625, 60.14, 1e5, 0.02, RISER)),
    ],
)
def test_the_shipped_files_are_the_printed_inputs(name, gradient, printed):
    """Feet, inches and pounds by definition; masses as weight over 32.2 ft/s^2."""
    foot, pound = 0.3048, 4.4482216152605
    slug = pound / foot
    length, diameter, weight, tension, fraction, flow = printed
    case = load_span(name)
    arc, speed = np.array(flow).T
    assert case.cable.length == pytest.approx(length * foot) and case.cable.diameter == pytest.approx(diameter * 0.0254)
    assert case.cable.mass_per_length == pytest.approx(weight / 32.2 * slug / foot, rel=1e-7)
    assert case.water.density == pytest.approx(62.4 / 32.2 * slug / foot**3, rel=1e-7)
    assert case.tension.start == pytest.approx(tension * pound, rel=1e-7)
    assert case.tension.gradient == pytest.approx(gradient * pound / foot, rel=1e-7)
    assert case.lift.correlation_length == pytest.approx(fraction * length * foot)
    assert case.flow.arc == pytest.approx(arc * length * foot) and case.flow.speed == pytest.approx(speed * foot)
    assert case.flow.turbulence == pytest.approx(0.25 * foot) and case.flow.strouhal == 0.17
