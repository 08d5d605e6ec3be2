"""A span in a wind: beside a sum of modes and the printed table, locked in, second order in the step; its command."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.scenes.load import SceneError, load_scene
from cable_sim_ros.physics.state import NOW, WAKE
from cable_sim_ros.physics.wake_oscillator import WAKE_Q
from cable_sim_ros.tools.spans.in_frequency.response import vibration
from cable_sim_ros.tools.spans.in_time import wake_run
from cable_sim_ros.tools.spans.in_time.wake_run import run_span, span_line
from cable_sim_ros.tools.spans.load import load_span
from cable_sim_ros.tools.spans.span_file import SpanEnds, natural_frequency
from cable_sim_ros.tools.spans.to_frequency import frequency_case
from verification.experiments import wake
from verification.experiments.wake import PRINTED, WATER, against_modes, changed, lock, printed


@pytest.fixture(scope="module")
def span():
    return load_span("span_in_wind")


@pytest.fixture(scope="module")
def table(span):
    return {row.case: row for row in run_span(span).rows}


def test_natural_frequencies_are_those_of_table_a2(span):
    """18.99 rad/s for case 1, where the table prints 19.9: its wind speed gives 18.98."""
    for name, printed_rad in (("case_1", 18.99), ("case_2", 7.57), ("case_3", 12.0), ("case_4", 16.9)):
        assert 2.0 * np.pi * natural_frequency(span, span.cases[name]) == pytest.approx(printed_rad, rel=5e-3)


@pytest.mark.nightly
def test_table_a3_within_what_is_allowed(table, kept):
    rows = printed(table)
    assert kept(rows) == 6 and len(rows) == 3 * len(PRINTED)
    assert all(row.steady and row.wake_amplitude == pytest.approx(2.7, abs=0.1) for row in table.values())
    assert all(row.vertical_peak_m < 6e-6 and abs(row.wake_shift_percent) < 0.2 for row in table.values())


@pytest.mark.nightly
def test_the_page_has_both_of_the_same_case(span, table):
    """docs/viv.md: natural and vibration frequency, rms in time over sheaves and pinned, in the frequency domain."""
    page = (Path(__file__).parents[2] / "docs" / "viv.md").read_text("utf-8").partition('<a id="both"></a>')[2]
    pinned = {row.case: row for row in run_span(changed(span, ends=SpanEnds.PINNED)).rows}
    block = changed(span.frequency_domain, turbulence_intensity=2e-3, lift={"correlation_length": 2e4})
    steady = span.model_copy(update={"frequency_domain": block})
    for name, row in table.items():
        here, limit = (vibration(frequency_case(one, name).span) for one in (span, steady))
        rms = (
            row.vertical_rms_m,
            pinned[name].vertical_rms_m,
            here.rms_displacement.max(),
            limit.rms_displacement.max(),
        )
        frequencies = f"{here.frequencies[0]:.3f} | {row.vertical_frequency_hz:.3f}"
        assert f"| {name} | {frequencies} | {' | '.join(f'{1e6 * x:.2f}' for x in rms)} |" in page
        assert rms[3] == pytest.approx(rms[1], rel=0.004 if name != "case_2" else 0.033)


def test_a_pinned_span_is_the_sum_of_its_modes(span, kept, monkeypatch):
    runs = []
    monkeypatch.setattr(wake, "run_span", lambda *given: runs.append(run_span(*given)) or runs[-1])
    assert kept(against_modes(span)) == 4
    row = runs[0].rows[0]
    assert row.streamwise_frequency_hz == pytest.approx(2.0 * row.vertical_frequency_hz, rel=2e-3)


@pytest.mark.nightly
def test_in_water_the_wake_locks_in(span):
    """Between 0.8 and 1.3 of the speed of resonance it keeps to the natural frequency, at 0.6 and 2 to its own."""
    water = changed(span, ends=SpanEnds.PINNED, fluid=WATER, damping_ratio=0.02, elements=8)
    report = lock(water, 2.0, 200.0, (0.6, 0.85, 1.25, 2.0), "water")
    assert report.locked.tolist() == [False, True, True, False]
    assert np.abs(report.wake[1:3] - 1.0).max() < 0.06
    np.testing.assert_allclose(report.wake[[0, 3]], report.free[[0, 3]], rtol=0.06)
    assert 0.3 < report.amplitude[1:3].min() and report.amplitude[1:3].max() < 0.8
    assert report.amplitude[[0, 3]].max() < 0.05


def test_wake_and_cable_together_are_of_second_order_in_the_step(span):
    """A span that locks in in water, six periods from rest: place and wake in the middle. Soft, so that round-off of
    the axial force does not show."""
    soft = changed(span.cable, axial_stiffness=1e5)
    water = changed(span, ends=SpanEnds.PINNED, fluid=WATER, elements=4, gravity=1e-3, cable=soft)
    case = changed(water.cases["case_1"], wind=0.27)
    period = span.cable.diameter / (span.wake.strouhal * case.wind)

    def end(steps):
        rig = span_line(water, case).rig
        rig.run(6.0 * period, period / steps)
        return np.array((rig.state.q[2, 2], rig.state.nodes[NOW, WAKE, 2, WAKE_Q]))

    exact = end(1440)
    errors = np.array([np.abs(end(steps) - exact) for steps in (40, 80, 160)])
    assert np.log2(errors[:-1] / errors[1:]).min() > 1.75, errors


def test_the_command_has_a_case_of_table_a3_in_json_and_a_picture(tmp_path, monkeypatch, kept):
    pytest.importorskip("matplotlib")
    runs = []
    monkeypatch.setattr(wake_run, "run_span", lambda *given: runs.append(run_span(*given)) or runs[-1])
    arguments = ["span", "span_in_wind", "--case", "case_1", "--json", "--out", str(tmp_path)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert report == json.loads((tmp_path / "span.json").read_text())
    assert report["span"] == "span_in_wind" and [case["case"] for case in report["cases"]] == ["case_1"]
    assert 4e-6 < report["cases"][0]["vertical_peak_m"] < 6e-6
    assert (tmp_path / "span.png").read_bytes()[:4] == b"\x89PNG"
    (row,) = runs[0].rows
    monkeypatch.setattr(wake, "PRINTED", {"case_1": PRINTED["case_1"]})
    assert kept(printed({"case_1": row})) == 2
    assert row.steady and row.wake_amplitude == pytest.approx(2.7, abs=0.1) and abs(row.wake_shift_percent) < 0.2


def test_a_span_is_no_scene_and_a_scene_is_no_span(span, tmp_path):
    with pytest.raises(SceneError, match="span_in_wind.yaml:3: span stands at the top: this is a span in a wind"):
        load_scene("span_in_wind")
    with pytest.raises(
        SceneError, match="ship stands at the top: this is a scene.*not a span.*`cable-sim run`.*span_in"
    ):
        load_span(Path(__file__).parents[2] / "config" / "flume.yaml")
    with pytest.raises(SceneError, match="no such span file; nothing was started. .*span_in_wind"):
        load_span("nowhere")
    broken = tmp_path / "broken.yaml"
    broken.write_text("span: {a: [}\n")
    with pytest.raises(SceneError, match="broken.yaml:1: .*Correct the YAML"):
        load_span(broken)
    broken.write_bytes(b"span: \xff\n")
    with pytest.raises(SceneError, match="is not UTF-8 text .byte 6.; nothing was started. Save the span as UTF-8"):
        load_span(broken)
    with pytest.raises(SceneError, match="case 'two' is not in span_in_wind; nothing was run. Known: case_1, case_2"):
        run_span(span, ["two"])
