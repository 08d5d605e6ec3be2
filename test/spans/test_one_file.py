"""One span file for both: a case in the frequency domain beside the same case in time; what is told, what refused."""

import json
from math import sqrt

import numpy as np
import pytest
from calling import cable_sim

from cable_sim_ros import viv
from cable_sim_ros.io.scenes.load import SceneError
from cable_sim_ros.physics.parameter import declared
from cable_sim_ros.tools.spans import to_frequency
from cable_sim_ros.tools.spans.in_frequency.response import vibration
from cable_sim_ros.tools.spans.in_frequency.span import Span as Line
from cable_sim_ros.tools.spans.in_time.wake_run import run_span
from cable_sim_ros.tools.spans.load import load_span, span_from_dict
from cable_sim_ros.tools.spans.span_file import SpanFile, natural_frequency
from cable_sim_ros.tools.spans.to_frequency import drag_coefficient, frequency_case, in_span_file, load_cases, problems
from verification.experiments.wake import WATER, changed

pytestmark = pytest.mark.trust

# of a file for `cable-sim viv`: of a span file, the same number
SAME = {
    "cable.length": "span.cases.<name>.length",
    "cable.diameter": "span.cable.diameter",
    "cable.mass_per_length": "span.cable.mass_per_length",
    "cable.added_mass_coefficient": "span.cable.added_mass_coefficient",
    "cable.bending_stiffness": "span.cable.bending_stiffness",
    "tension.start": "span.cases.<name>.tension",
    "water.density": "span.fluid.density",
    "flow.speed": "span.cases.<name>.wind",
    "flow.strouhal": "span.wake.strouhal",
}


@pytest.fixture(scope="module")
def span():
    return load_span("span_in_wind")


def one(span, case="case_1", **values):
    """The span with one case and other values, pinned."""
    return changed(span, cases={"a": span.cases[case]}, **({"ends": "pinned", "elements": 8} | values))


def steady(span):
    """The limit in which both are the same equations: no turbulence, one phase all along."""
    block = changed(span.frequency_domain, turbulence_intensity=2e-3, lift={"correlation_length": 2e4})
    return span.model_copy(update={"frequency_domain": block})


@pytest.mark.parametrize("key", SAME)
def test_what_a_span_file_may_say_the_frequency_domain_takes(key):
    inner = {item.key: item for item in declared(SpanFile)}[SAME[key]]
    outer = {item.key: item for item in declared(Line)}[key]
    assert inner.unit == outer.unit
    assert outer.low is None or inner.low >= outer.low
    assert outer.above is None or inner.low is None or inner.low > outer.above
    assert inner.high <= outer.high


def test_both_have_the_same_natural_frequencies(span):
    for name, case in load_cases("span_in_wind").items():
        found = vibration(case.span).frequencies
        assert found[0] == pytest.approx(natural_frequency(span, span.cases[name]), rel=1e-12)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"wake": {"law": "facchinetti"}},
        # all of it damping on the mass in air, and in bending; the motion does not drive the wake
        {"fluid": WATER, "drag_law": "off", "wake": {"law": "bai_qin", "coupling": 0.0}, "damping_ratio": 0.05},
        {"cable": {"bending_damping": 0.172}, "damping_ratio": 0.05, "wake": {"law": "bai_qin", "coupling": 0.0}},
    ],
    ids=["as shipped", "facchinetti", "in water", "bending damping"],
)
def test_in_a_steady_flow_of_one_phase_both_say_the_same(span, values):
    """The wake turns 0.5 % slower than Strouhal's, at 4 % of damping worth 1 % of the amplitude."""
    values = dict(values)
    if "cable" in values:
        values["cable"] = changed(span.cable, **values["cable"])
    both = one(span, **values)
    case = changed(both.cases["a"], wind=natural_frequency(both, both.cases["a"]) * span.cable.diameter / 0.2)
    both = changed(both, cases={"a": case})
    row = run_span(both).rows[0]
    found = vibration(frequency_case(steady(both), "a").span)
    assert row.steady
    assert found.rms_displacement.max() == pytest.approx(row.vertical_rms_m, rel=0.015)


def test_vortices_that_are_not_complete_lift_less(span):
    """Re = 53.5, half of the force in both."""
    both = one(span, gravity=1e-3)
    both = changed(both, cases={"a": {"length": 15.0, "tension": 200.0, "wind": 53.5 * 1.8e-5 / (1.2 * 0.02)}})
    row = run_span(both).rows[0]
    case = frequency_case(steady(both), "a")
    assert case.span.lift.mean_squares[0] == pytest.approx(0.25 * 0.075)
    assert vibration(case.span).rms_displacement.max() == pytest.approx(row.vertical_rms_m, rel=0.015)


def test_turbulence_and_short_correlation_make_it_less(span):
    parts = [one(span), steady(one(span))]
    less, more = (vibration(frequency_case(part, "a").span).rms_displacement.max() for part in parts)
    assert 0.6 * more < less < 0.9 * more


def test_every_number_is_of_the_file_or_told(span):
    case = load_cases("span_in_wind", ["case_1"])["case_1"]
    told = {taken.key for taken in case.taken}
    every = {item.key for item in declared(Line) if not item.key.startswith("profile.")}  # uniform all along
    assert every - told == set(SAME) - {"flow.strouhal"} | {"name", "flow.arc"}
    values = {taken.key: taken.value for taken in case.taken}
    assert values["lift.mean_squares"] == "0.075"  # (C_L0 q/2)^2/2 of the cycle 2/sqrt(3 a2)
    assert values["flow.turbulence"] == "0.0302 m/s" and values["lift.correlation_length"] == "1 m"
    given = changed(span, frequency_domain={"turbulence_intensity": 0.2, "response": {"segments": 40}})
    taken = {one.key: one.source for one in frequency_case(given, "case_1").taken}
    assert "response.segments" not in taken and not taken["flow.turbulence"].endswith("default")
    default = {one.key: one.source for one in case.taken}
    assert default["response.segments"] == "default" and default["flow.turbulence"].endswith("default")


def test_the_drag_is_that_of_the_law_at_the_wind(span):
    case = span.cases["case_1"]
    assert drag_coefficient(span, case) == pytest.approx(1.1 + 4.0 / sqrt(1.2 * 0.302 * 0.02 / 1.8e-5), rel=1e-9)
    assert drag_coefficient(changed(span, drag_law="off"), case) == 0.0
    assert drag_coefficient(changed(span, drag_law="capozucca"), case) == 1.0
    assert 1.0 < drag_coefficient(changed(span, drag_law="huston_kamman_10"), case) < 2.0


def test_what_is_doubtful_is_said_in_the_words_of_the_file(span):
    def warned(span, name="a"):
        case = frequency_case(span, name)
        return case.warnings(vibration(case.span))

    assert warned(span, "case_1") == []
    (sag,) = warned(span, "case_2")
    assert sag.startswith("span.cases.case_2.tension = 200 N lets the span sag by 4.23")
    (lock,) = warned(one(span, fluid=WATER, damping_ratio=0.02))
    assert lock.startswith("span.cases.a.wind makes a peak of 0.4") and "the span locks in, which the frequency" in lock
    low = changed(span.cases["case_1"], wind=0.2)
    (tail,) = warned(changed(one(span), cases={"a": low}))
    assert tail.startswith("span.cases.a.wind sheds up to 2 Hz, below the first frequency 3.023 Hz: no mode is driven")
    coarse = changed(span.frequency_domain, response={"frequencies": 10})
    (short,) = warned(changed(one(span), frequency_domain=coarse))
    assert short.startswith("span.frequency_domain.response.frequencies = 10 steps end at 1.0")


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"wake": {"law": "off"}}, "span.wake.law = off: nothing is shed, and so nothing vibrates"),
        (
            {"wake": {"law": "bai_qin", "lift_coefficient": 0.0}},
            "= 0 is a mean square of the lift of 0, outside (0, 10]",
        ),
        (
            {"wake": {"law": "bai_qin", "lift_coefficient": 5.0}},
            "= 5 is a mean square of the lift of 20.8, outside (0, 10]",
        ),
        (
            {"cases": {"a": {"length": 2.0, "tension": 200.0, "wind": 0.03}}},
            "span.cases.a.wind = 0.03 m/s has the Reynolds number 40, not above 47: nothing is shed",
        ),
        (
            {"damping_ratio": 0.0, "cases": {"a": {"length": 2.0, "tension": 200.0, "wind": 0.31}}},
            "span.damping_ratio = 0 leaves mode 1 of case a without damping",
        ),
        (
            {"cases": {"a": {"length": 1000.0, "tension": 2.0, "wind": 90.0}}},
            "span.cases.a.wind sheds up to 900 Hz, that of mode ",
        ),
        ({"frequency_domain": {"lift": {"mean_squares": [0.0]}}}, "lift.mean_squares = [0.0] is a lift of zero"),
        ({"frequency_domain": {"response": {"place": 9.0}}}, "= 9 m is more than span.cases.a.length = 2 m"),
    ],
)
def test_what_the_frequency_domain_cannot_serve_is_refused(span, tmp_path, values, text):
    data = json.loads(one(span).model_dump_json()) | values
    path = tmp_path / "a.yaml"
    path.write_text(json.dumps({"span": data}))
    with pytest.raises(SceneError) as error:
        load_cases(path)
    assert text in str(error.value) and "a.yaml:1: " in str(error.value) and "nothing was started" in str(error.value)


def test_a_mesh_too_coarse_for_the_wake_in_time_is_no_matter_of_the_frequency_domain(span):
    data = {"span": json.loads(one(span).model_dump_json())}
    data["span"]["cases"]["a"] |= {"length": 20.0, "wind": 3.0}
    with pytest.raises(SceneError, match="span.elements = 8 makes elements of"):
        span_from_dict(data, "here")
    found = span_from_dict(data, "here", problems)
    assert len(frequency_case(found, "a").span.damping.ratios) > 50


def test_keys_are_renamed_as_whole_words():
    found = in_span_file(to_frequency.Problem("response.place", "= 1 at flow.speed", "Not overflow.speed"), "b")
    assert found[:3] == ("span.frequency_domain.response.place", "= 1 at span.cases.b.wind", "Not overflow.speed")


def test_cases_by_name_and_files_of_the_other_kind(tmp_path):
    assert list(load_cases("span_in_wind")) == ["case_1", "case_2", "case_3", "case_4"]
    assert list(viv.load_cases("span_in_wind", ["case_3"])) == ["case_3"]
    with pytest.raises(SceneError, match="case 'x' is not in span_in_wind; nothing was run. Known: case_1, case_2"):
        load_cases("span_in_wind", ["x"])
    (line,) = load_cases("capozucca_5_5").values()
    assert line.span == viv.load_span("capozucca_5_5") and not line.taken
    assert line.warnings(vibration(line.span)) == viv.warnings(line.span, vibration(line.span))
    with pytest.raises(viv.SpanError, match="capozucca_5_5: has no cases, and case 'a' is asked for"):
        load_cases("capozucca_5_5", ["a"])
    with pytest.raises(viv.SpanError, match="this is a span in a wind, not a span in a flow.*in Python to load_cases"):
        viv.span_from_dict({"span": {}})
    with pytest.raises(SceneError, match="flow stands at the top.*`cable-sim viv`: it has no wake, viscosity"):
        load_span(to_frequency.document.find_viv("capozucca_5_5"))
    broken = tmp_path / "broken.yaml"
    broken.write_text("span: {a: [}\n")
    with pytest.raises(viv.SpanError, match="broken.yaml:1: .*Correct the YAML"):
        load_cases(broken)


def test_the_command_takes_a_span_file(tmp_path):
    pytest.importorskip("matplotlib")
    result = cable_sim("viv", "span_in_wind", "--case", "case_1", "--case", "case_4", "--json", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert report == json.loads((tmp_path / "viv.json").read_text())
    assert report["span"] == "span_in_wind" and [case["case"] for case in report["cases"]] == ["case_1", "case_4"]
    assert report["cases"][0]["max_rms_displacement_m"] == pytest.approx(2.87e-6, rel=0.01)
    assert report["cases"][0]["taken"][0]["key"] == "ends" and report["cases"][0]["cautions"] == []
    assert {path.name for path in tmp_path.glob("*.png")} == {"viv_case_1.png", "viv_case_4.png"}
    assert np.isfinite(report["cases"][1]["displacement_spectrum_m2_hz"]).all()


def test_the_command_prints_what_was_taken_and_warns():
    result = cable_sim("viv", "span_in_wind", "--case", "case_2")
    assert result.exit_code == 0, result.output
    assert "warning: span_in_wind: span.cases.case_2.tension = 200 N lets the span sag" in result.stderr
    assert "taken: ends = sheaves (straight between pinned ends; what lies on the sheaves" in result.stdout
    assert "taken: flow.turbulence = 0.0121 m/s (0.1 of the wind" in result.stdout
    assert "defaults: damping.drag_amplification 1.0" in result.stdout
    assert "taken:" not in cable_sim("viv", "capozucca_5_5").stdout


def test_sensitivity_is_of_one_case(span, tmp_path):
    result = cable_sim("viv", "span_in_wind", "--sensitivity", "--json")
    assert result.exit_code == 2 and "has 4 cases, and --sensitivity is of one" in result.stderr
    short = changed(span.frequency_domain, response={"segments": 50, "points": 25})
    path = tmp_path / "short.yaml"
    path.write_text(json.dumps({"span": json.loads(changed(span, frequency_domain=short).model_dump_json())}))
    result = cable_sim("viv", path, "--sensitivity", "--case", "case_1", "--json")
    rows = {row["choice"]: row["place"] for row in json.loads(result.stdout)}
    assert rows["damping ratios halved"] > 0.5 and abs(rows["half as many segments"]) < 1e-3
