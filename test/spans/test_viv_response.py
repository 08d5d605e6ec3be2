"""Green's function and response: printed values, closed forms, bounds, the other method."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from spans import INCH, span

from cable_sim_ros.tools.spans.in_frequency import grid
from cable_sim_ros.tools.spans.in_frequency import response as greens
from cable_sim_ros.tools.spans.in_frequency.files import changed, load_span
from cable_sim_ros.tools.spans.in_frequency.modes import frequencies, modal_mass, shapes
from cable_sim_ros.tools.spans.in_frequency.response import respond, vibration
from cable_sim_ros.tools.spans.in_frequency.span import Line
from verification.experiments.viv import CASES, as_printed, green, green_rows

pytestmark = pytest.mark.trust


def test_green_s_function_at_the_middle_is_the_printed_one():
    assert all(abs(row.ours - row.measured) <= row.allowed for row in green_rows())


lines = st.builds(
    lambda start, end, mass, stiffness: Line(
        span(
            cable={"mass_per_length": mass, "bending_stiffness": stiffness},
            tension={"start": start, "gradient": (end - start) / 17.0},
        )
    ),
    st.floats(10.0, 1e5), st.floats(10.0, 1e5), st.floats(0.01, 100.0), st.sampled_from((0.0, 1.0, 1e4)),
)  # fmt: skip


@settings(max_examples=60)
@given(lines, st.floats(0.0, 17.0), st.floats(0.0, 17.0), st.floats(1e-3, 1e6), st.floats(1e-6, 3.0))
def test_green_s_function_is_bounded_and_goes_both_ways(line, s, x, omega, ratio):
    """Whatever the mode number; sinh of the travel time would overflow from a few hundred on."""
    with np.errstate(over="raise", invalid="raise"):
        there = green(line, s, x, omega, 2.0 * ratio * omega)
        back = green(line, x, s, omega, 2.0 * ratio * omega)
        waves = greens.wave(greens.damped(omega, 2.0 * ratio * omega), np.linspace(0.0, line.crossing, 50))
    assert np.isfinite(there) and there == pytest.approx(back, rel=1e-9)
    assert np.abs(waves).max() <= 1.0 + 1e-12


def test_mode_numbers_far_beyond_the_range_of_sinh():
    line = Line(span())
    omega = 2.0 * np.pi * 1e5 * frequencies(line, 1)[0]
    s = np.linspace(0.0, 17.0, 9)
    found = green(line, s[:, None], s, omega, 0.2 * omega)
    assert np.isfinite(found).all() and (np.abs(found.diagonal()[1:-1]) > 0.0).all()
    assert abs(found[4, 4]) == pytest.approx(
        0.5 / (abs(greens.damped(omega, 0.2 * omega)) * line.impedance(0.0)), rel=1e-6
    )


def test_constant_tension_in_closed_form():
    line = Line(span())
    mass = float(line.mass(0.0))
    for omega in (1.0, 17.0, 80.0):
        k = np.sqrt((omega**2 - 0.1j * omega**2) * mass / 1500.0)
        s, x = 4.0, 11.0
        expected = np.sin(k * s) * np.sin(k * (17.0 - x)) / (1500.0 * k * np.sin(k * 17.0))
        assert green(line, s, x, omega, 0.1 * omega) == pytest.approx(expected, rel=1e-11)


def test_a_force_at_rest_pulls_the_string_into_a_triangle():
    line = Line(span())
    assert green(line, 4.0, 11.0, 1e-4, 0.0).real == pytest.approx(4.0 * 6.0 / (1500.0 * 17.0), rel=1e-6)


def test_many_modes_add_up_to_it():
    line = Line(span())
    omega, ratio, count = 23.0, 0.05, 4000
    phi = shapes(line, np.array((4.0, 11.0)), count)
    omega_n = 2.0 * np.pi * frequencies(line, count)
    total = (phi[:, 0] * phi[:, 1] / (modal_mass(line) * (omega_n**2 - omega**2 + 2j * ratio * omega**2))).sum()
    assert green(line, 4.0, 11.0, omega, 2.0 * ratio * omega) == pytest.approx(total, rel=1e-4)


@pytest.mark.parametrize("stiffness, gradient, within", [(0.0, 0.0, 1e-3), (150.0, 0.0, 1e-3), (0.0, 40.0, 5e-3)])
def test_the_sweep_is_the_sum_of_green_s_functions_and_near_finite_differences(stiffness, gradient, within):
    line = Line(span(cable={"bending_stiffness": stiffness}, tension={"start": 1500.0, "gradient": gradient}))
    s = np.unique(np.append(np.linspace(0.0, 17.0, 18), 5.3))
    omega = 2.0 * np.pi * np.array((0.9, 2.77, 9.0))
    mu = greens.damped(omega, 0.14 * omega)
    load = np.zeros((len(s), 3, 2))
    load[4, :, 0], load[13, :, 0], load[6, :, 1] = 1.0, -2.0, 3.0
    swept = greens.respond_by_green(line, s, mu, load)
    forces = [[(s[4], 1.0), (s[13], -2.0)], [(s[6], 3.0)]]
    for k, pairs in enumerate(forces):
        total = sum(force * green(line, s[:, None], x, omega, 0.14 * omega) for x, force in pairs)
        assert swept[:, :, k] == pytest.approx(total, abs=1e-12 * np.abs(total).max())
    other = respond(line, s, mu, load, 9.0)
    assert np.abs(other - swept).max() < within * np.abs(swept).max()


SMALL = {"5.6": 0.5393, "5.8": 0.5412, "5.16": 4.078}  # inch, on the source's grid


@pytest.mark.parametrize("case", [case for case in CASES if case.figure in SMALL], ids=lambda case: case.figure)
def test_rms_with_the_printed_ratios_on_the_source_s_grid(case):
    found = vibration(as_printed(case))
    assert found.place_rms_displacement / INCH == pytest.approx(SMALL[case.figure], rel=1e-3)
    assert found.reading == "A" and found.damping_ratios.tolist() == list(case.ratios)
    assert found.place_rms_displacement == pytest.approx(case.rms, rel=case.rms_allowed)


@pytest.mark.parametrize(
    "case, a, b, c", [(CASES[0], 0.541, 0.592, 0.621), (CASES[1], 0.542, 0.591, 0.619)], ids=("5.6", "5.8")
)
def test_rms_converged_and_by_the_other_readings(case, a, b, c):
    span = as_printed(case)
    fine = {"segments": 160, "frequency_step": 0.25 / 8.0, "frequencies": 800}
    assert vibration(changed(span, response=fine)).place_rms_displacement / INCH == pytest.approx(a, rel=5e-3)
    for reading, value in (("B", b), ("C", c)):
        other = vibration(changed(span, lift={"reading": reading}))
        assert other.place_rms_displacement / INCH == pytest.approx(value, rel=1e-3)


def test_the_grids_that_are_chosen_are_converged():
    case = load_span("capozucca_5_7")
    own = {"segments": 200, "frequency_step": None, "frequencies": None}
    chosen = vibration(changed(case, response=own, damping={"segments": 4000}))
    step, number = chosen.frequency_step, len(chosen.frequency)
    finer = {"segments": 400, "frequency_step": step / 2.0, "frequencies": 2 * number}
    other = vibration(changed(case, response=finer, damping={"segments": 8000}))
    assert chosen.place_rms_displacement == pytest.approx(other.place_rms_displacement, rel=1e-3)
    assert chosen.place_rms_acceleration == pytest.approx(other.place_rms_acceleration, rel=5e-3)


def test_finite_differences_give_the_response_of_a_tension_that_nearly_doubles():
    case = load_span("capozucca_5_11")
    wkb, other = (vibration(changed(case, response={"method": method})) for method in ("wkb", "exact"))
    assert other.rms_displacement == pytest.approx(wkb.rms_displacement, abs=0.005 * wkb.rms_displacement.max())
    assert other.place_rms_displacement == pytest.approx(wkb.place_rms_displacement, rel=1e-3)
    assert (wkb.method, other.method) == ("wkb", "exact")


spans = st.builds(
    lambda speed, turbulence, gradient, correlation, stiffness: span(
        tension={"start": 1500.0, "gradient": gradient},
        cable={"bending_stiffness": stiffness},
        flow={"arc": [0.0, 6.0, 17.0], "speed": speed, "turbulence": turbulence},
        lift={"correlation": correlation},
        response={"frequency_step": 0.1, "frequencies": 120},
    ),
    st.lists(st.floats(0.05, 1.5), min_size=3, max_size=3),
    st.floats(0.01, 0.3), st.floats(-40.0, 100.0), st.sampled_from(("gaussian", "exponential")),
    st.sampled_from((0.0, 50.0)),
)  # fmt: skip


@settings(max_examples=25)
@given(spans)
def test_spectra_are_positive_and_their_sum_is_the_mean_square(case):
    found = vibration(case)
    assert (found.displacement_spectrum >= 0.0).all() and np.isfinite(found.displacement_spectrum).all()
    step = found.frequency_step
    assert found.displacement_spectrum.sum() * step == pytest.approx(found.place_rms_displacement**2, rel=1e-12)
    assert found.acceleration_spectrum.sum() * step == pytest.approx(found.place_rms_acceleration**2, rel=1e-12)
    assert found.rms_displacement[0] == found.rms_displacement[-1] == 0.0
    assert found.place_rms_displacement == found.rms_displacement.max()
    assert (found.damping_ratios <= found.damping_whole + 1e-15).all() and (found.damping_ratios > 0.0).all()


def test_the_cable_turned_end_for_end_answers_turned():
    forth = span(tension={"start": 1500.0, "gradient": 60.0}, flow={"arc": [0.0, 6.0, 17.0], "speed": [0.2, 0.7, 0.4]})
    back = span(
        tension={"start": 1500.0 + 60.0 * 17.0, "gradient": -60.0},
        flow={"arc": [0.0, 11.0, 17.0], "speed": [0.4, 0.7, 0.2]},
    )
    a, b = vibration(forth), vibration(back)
    assert a.frequencies == pytest.approx(b.frequencies, rel=1e-12)
    assert a.damping_ratios == pytest.approx(b.damping_ratios, rel=1e-3)
    assert a.rms_displacement == pytest.approx(b.rms_displacement[::-1], rel=2e-3, abs=1e-12)


def test_four_times_the_mean_square_doubles_the_response():
    one = vibration(span(lift={"mean_squares": [0.2, 0.1]}))
    four = vibration(span(lift={"mean_squares": [0.8, 0.4]}))
    assert four.rms_displacement == pytest.approx(2.0 * one.rms_displacement, rel=1e-12)


def test_a_uniform_flow_that_is_fully_correlated_answers_as_one_force():
    """Lift with one pattern over the cable: the response to a uniform load, by its closed form at rest."""
    case = span(
        flow={"speed": [0.4, 0.4], "turbulence": 0.05},
        lift={"correlation_length": 2e4},
        damping={"ratios": [0.1, 0.1]},
        response={"segments": 200},
    )
    line, f = Line(case), np.array((0.4,))
    forces = grid.patterns(case.lift, 2e4, np.linspace(0.0, 17.0, 201))
    assert (np.abs(forces).max(0) > 1e-3).sum() == 1
    found = vibration(case)
    k = int(np.searchsorted(found.frequency, 0.4))
    omega = 2.0 * np.pi * found.frequency[k]
    wave = np.sqrt(omega**2 - 0.2j * omega * 2.0 * np.pi * found.frequencies[0]) * line.crossing / 17.0
    shape = (np.cos(wave * 8.5 - wave * found.place) / np.cos(wave * 8.5) - 1.0) / wave**2 / 1500.0
    q = grid.load(line, case.lift, 0.05, np.array((8.5,)), found.frequency[k : k + 1])[0, 0]
    assert found.displacement_spectrum[k] == pytest.approx(abs(q * shape) ** 2, rel=2e-3)
    assert f[0] == pytest.approx(found.frequency[k], abs=0.2)


def test_the_local_lift_has_the_mean_square_that_was_given():
    case = span(response={"frequency_step": 0.01, "frequencies": 4000})
    f = 0.01 * np.arange(1, 4001)
    spectra = grid.coefficient_spectrum(Line(case), case.lift, 0.07, np.array((0.0, 4.0)), f)
    assert spectra.sum(0) * 0.01 == pytest.approx(sum(case.lift.mean_squares), rel=1e-4)
    assert f[spectra[:, 0].argmax()] == pytest.approx(0.17 * 0.65 / 0.03, abs=0.1)


@pytest.mark.parametrize("law", ["gaussian", "exponential"])
@pytest.mark.parametrize("length, within", [(0.05, 0.012), (0.3, 0.012), (1e-5, 0.012)])
def test_a_correlation_length_shorter_than_a_segment_converges(law, length, within):
    found = [
        vibration(
            span(response={"segments": n}, lift={"correlation": law, "correlation_length": length})
        ).place_rms_displacement
        for n in (50, 150)
    ]
    assert found[0] == pytest.approx(found[1], rel=within)


@pytest.mark.parametrize("law, even", [("gaussian", np.sqrt(2.0 * np.pi)), ("exponential", 2.0)])
def test_the_mean_correlation_of_segments_keeps_the_lift_of_the_cable(law, even):
    """Sum over all distances times the segment: the integral of R; in the limit of many correlation lengths apart."""
    block = span(lift={"correlation": law}).lift
    for length in (1e-4, 0.1, 0.5, 0.98):
        found = grid.correlation(block, length, np.arange(41.0))
        assert found[20].sum() == pytest.approx(even * length, rel=1e-9)
        assert np.linalg.eigvalsh(found).min() > 0.0


def test_the_default_correlation_length_does_not_follow_the_modes_asked_for():
    few, many = (vibration(span(response={"modes": n})) for n in (4, 400))
    assert few.correlation_length == many.correlation_length == 17.0 / 8.0
    assert few.place_rms_displacement == pytest.approx(many.place_rms_displacement, rel=0.02)


@pytest.mark.parametrize(
    "blocks",
    [
        {"water": {"density": 1.2}, "flow": {"speed": [3.0, 2.0], "turbulence": 0.3}},
        {"damping": {"ratios": [0.002] * 4}},
        {"damping": {"ratios": [0.002] * 4}, "tension": {"start": 300.0, "gradient": 100.0}},
    ],
    ids=("air", "light", "light_and_uneven_tension"),
)
def test_uneven_steps_take_all_of_narrow_resonances(blocks):
    """Beside steps twice as fine."""
    case = span(**{**blocks, "response": {"segments": 24, "frequency_step": None, "frequencies": None}})
    found, finer = vibration(case), vibration(changed(case, response={"steps_per_half_width": 6.0}))
    assert np.ptp(found.frequency_width) > 0.0 and len(found.frequency) < 6000
    assert (np.diff(found.frequency) > 0.0).all() and (found.frequency_width > 0.0).all()
    assert found.rms_displacement.max() == pytest.approx(finer.rms_displacement.max(), rel=3e-3)
    assert found.rms_acceleration.max() == pytest.approx(finer.rms_acceleration.max(), rel=3e-3)


def test_uneven_steps_give_what_equal_ones_do():
    response = {"segments": 24, "frequency_step": None, "frequencies": None}
    case = span(damping={"ratios": [0.008] * 4}, response=response)
    found = vibration(case)
    assert np.ptp(found.frequency_width) > 0.0
    step = 0.25 * float((found.damping_ratios * found.frequencies).min())
    number = int(found.frequency[-1] / step)
    even = vibration(changed(case, response={"frequency_step": step, "frequencies": number}))
    assert len(found.frequency) < number / 5 and np.ptp(even.frequency_width) == 0.0
    assert found.rms_displacement.max() == pytest.approx(even.rms_displacement.max(), rel=3e-3)


def test_uneven_steps_find_the_resonances_of_finite_differences():
    """Narrower than WKB is off: 1.5 % there, the ratio 0.002."""
    blocks = {"tension": {"start": 100.0, "gradient": 300.0}, "damping": {"ratios": [0.002] * 4}}
    response = {"segments": 16, "points": 16, "frequency_step": None, "frequencies": None, "method": "exact"}
    case = span(**blocks, lift={"mean_squares": [0.6]}, response={**response, "steps_per_half_width": 1.5})
    finer = changed(case, response={"steps_per_half_width": 3.0})
    assert vibration(case).rms_displacement.max() == pytest.approx(vibration(finer).rms_displacement.max(), rel=0.01)
