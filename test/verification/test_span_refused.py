"""What a span refuses, in its own keys and with its own exit code; a span that sheds nothing, and one not steady."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.scenes import yaml12
from cable_sim_ros.io.scenes.document import find_span
from cable_sim_ros.io.scenes.load import SceneError
from cable_sim_ros.physics.drag_laws import DragLaw
from cable_sim_ros.sim.rig.rig import RigError
from cable_sim_ros.tools.spans.in_time import wake_run as runs
from cable_sim_ros.tools.spans.in_time.wake_run import FIELDS, SpanRow, run_span
from cable_sim_ros.tools.spans.load import load_span, span_from_dict
from cable_sim_ros.tools.spans.span_file import SpanDragLaw
from verification.experiments.wake import changed

CASE = {"length": 2.0, "tension": 200.0, "wind": 0.302}
DOCS = Path(__file__).parents[2] / "docs"


def data(case=None, **values):
    report = yaml12.parse(Path(find_span("span_in_wind")).read_text("utf-8"))[0]
    return {"span": report["span"] | {"cases": {"a": CASE | (case or {})}} | values}


def refusal(case=None, **values):
    with pytest.raises(SceneError) as caught:
        span_from_dict(data(case, **values), "here")
    return "\n".join(caught.value.problems)


def command(tmp_path, *arguments, case=None, **values):
    path = tmp_path / "mine.yaml"
    path.write_text(yaml12.dump(data(case, **values)), "utf-8")
    return CliRunner().invoke(main, ["span", str(path), *arguments])


@pytest.mark.parametrize(
    ("case", "values", "parts"),
    [
        ({}, {"fluid": {"current": [0, 5]}}, ("span.fluid has current = [0, 5]", "give span.cases.<name>.wind")),
        ({}, {"elements": 17}, ("span.elements = 17 is odd", "Give 16 or 18")),
        ({}, {"drag_law": "dymore"}, ("span.drag_law = 'dymore' is none of its values",)),
        ({}, {"sheave": {"radius": 0.005}}, ("span.cases.a.tension = 200 N", "0.0554", "more than 0.006 m, 40 % of")),
        ({"length": 0.1}, {}, ("span.cases.a.length = 0.1 m", "less than 0.1106 m", "or span.ends pinned")),
        ({"length": 5.0, "tension": 20.0}, {}, ("span.cases.a.tension = 20 N", "less than 31.08 N")),
        ({"wind": 5.0}, {}, ("span.elements = 16", "more than 0.05889", "50 Hz", "Give at least 34")),
        (
            {"wind": 30.0},
            {},
            ("span.cases.a.wind = 30 m/s", " m, more than ", "Give less wind, or a smaller span.sheave.radius"),
        ),
        ({"wind": 90.0, "length": 100.0}, {"ends": "pinned"}, ("It would take",)),
        ({"wind": -1.0}, {}, ("span.cases.a.wind = -1.0 m/s is outside [0, 100] m/s",)),
        ({}, {"cases": {"one": 3}}, ("span.cases.one = 3 is a number, expected a block of keys", "wind: 0.3")),
        ({}, {"dampingratio": 0.1}, ("span.dampingratio = 0.1: there is no such key", "mean span.damping_ratio")),
        ({}, {"cases": {}}, ("span.cases has no case; nothing was started. Give length, tension and wind",)),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, dict) else "",
)
def test_a_refusal_has_key_bound_and_remedy(case, values, parts):
    text = refusal(case, **values)
    assert all(part in text for part in ("here: span.", "nothing was started", *parts)), text
    assert "cable.sections" not in text and "ribbon" not in text


def test_what_a_refusal_asks_for_is_taken():
    minimum = float(refusal(sheave={"radius": 0.005}).split("Make span.sheave.stiffness at least ")[1].split()[0])
    for case, values in (
        ({}, {"sheave": {"radius": 0.005, "stiffness": 1.01 * minimum}}),
        ({"length": 0.1}, {"ends": "pinned"}),
        ({"wind": 5.0}, {"elements": 34}),
        ({"wind": 30.0}, {"wake": {"law": "off"}}),
    ):
        span_from_dict(data(case, **values), "here")


def test_what_cannot_work_is_not_offered():
    assert {law.value for law in DragLaw} - {law.value for law in SpanDragLaw} == {"ribbon", "dymore"}
    keys = CliRunner().invoke(main, ["span", "x", "--keys"]).output
    assert "crossflow" in keys and not any(word in keys for word in ("dymore", "ribbon", "current"))


@pytest.mark.parametrize(
    ("case", "values"), [({"wind": 30.0}, {}), ({"length": 0.1}, {}), ({}, {"drag_law": "ribbon"})]
)
def test_refused_input_leaves_with_2_and_names_the_file_and_line(tmp_path, case, values):
    result = command(tmp_path, "--json", case=case, **values)
    assert result.exit_code == 2 and result.stdout == ""
    assert "mine.yaml:" in result.stderr and "span." in result.stderr


def test_a_span_of_python_is_checked_as_a_file_is():
    span = load_span("span_in_wind")
    case = changed(span.cases["case_1"], wind=30.0)
    with pytest.raises(SceneError, match="span_in_wind: span.cases.a.wind = 30 m/s with elements"):
        run_span(span.model_copy(update={"cases": {"a": case}}))


@pytest.mark.parametrize(
    ("where", "flag", "what"),
    [("span_line", "NO_START", "finds no rest in its wind"), ("vibrate", "HALTED", "could not be run on")],
)
def test_the_json_of_a_span_that_fails_is_that_of_a_span(tmp_path, monkeypatch, where, flag, what):
    def fails(*_):
        raise RigError("no static equilibrium")

    monkeypatch.setattr(runs, "span_line", lambda *_: None)
    monkeypatch.setattr(runs, where, fails)
    result = command(tmp_path, "--json")
    assert result.exit_code == 1
    report = json.loads(result.stdout)
    assert report["problem"].endswith(f"mine.yaml: span.cases.a {what}: no static equilibrium; no case has figures")
    reason = report["verdict"]["reasons"][0]
    assert report["verdict"]["state"] == "failed" and reason["flag"] == flag
    assert "vertical_rms_m" in reason["figures"] and not any("tension" in name for name in reason["figures"])


def test_where_nothing_is_shed_there_is_no_wake(tmp_path):
    result = command(tmp_path, "--json", case={"wind": 0.03}, ends="pinned", steps=30, elements=4)
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    row = report["cases"][0]
    assert row["reynolds"] == pytest.approx(40.0) and report["verdict"]["state"] == "ok"
    names = ("wake_frequency_hz", "wake_amplitude", "wake_shift_percent", "lock_in_width_percent", "steady")
    assert all(row[name] is None for name in (*names, "vertical_frequency_hz", "streamwise_frequency_hz"))
    assert row["vertical_peak_m"] < 1e-9
    assert report["notices"] == [
        "a: nothing is shed, the Reynolds number 40 is not above 47: no wake, and no vibration by it"
    ]
    shown = command(tmp_path, case={"wind": 0.03}, ends="pinned", steps=30, elements=4, wake={"law": "off"})
    assert "note: a: nothing is shed, for span.wake.law is off" in shown.output and "verdict: ok" in shown.output


def test_what_is_not_steady_is_doubtful(tmp_path):
    """Beside resonance, damped by the air alone, it beats for longer than the 400 periods of a run."""
    result = command(tmp_path, "--json", case={"wind": 0.31}, damping_ratio=0.0, ends="pinned", steps=30, elements=4)
    report = json.loads(result.stdout)
    assert not report["cases"][0]["steady"] and result.exit_code == 4
    reason = report["verdict"]["reasons"][0]
    assert report["verdict"]["state"] == "doubtful" and reason["flag"] == "NOT_STEADY"
    assert "vertical_peak_m" in reason["figures"] and "wake_amplitude" in reason["figures"]
    assert "a: over the last 20 of 400 periods the amplitude goes on changing, by more than 2 %" in reason["text"]
    assert "More span.damping_ratio (= 0) is steady sooner" in result.stderr


def test_the_fields_of_a_case_are_declared():
    assert tuple(FIELDS) == SpanRow._fields
