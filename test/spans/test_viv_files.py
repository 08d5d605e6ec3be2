"""Spans from files: every refusal and caution in its words, the command, its JSON, the pages."""

import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from calling import cable_sim
from spans import data, span

from cable_sim_ros import viv
from cable_sim_ros.io.scenes import yaml12
from cable_sim_ros.io.scenes.document import find_viv, shipped_viv
from cable_sim_ros.io.scenes.load import SceneError, load_scene
from cable_sim_ros.runs.manual import tables
from cable_sim_ros.tools.spans.in_frequency import checks, files, sensitivity
from cable_sim_ros.tools.spans.in_frequency.response import leading, vibration
from cable_sim_ros.tools.spans.in_frequency.sensitivity import MAX_MODES, print_vibration
from cable_sim_ros.tools.spans.in_frequency.span import Span
from cable_sim_ros.tools.spans.picture_in_frequency import draw
from verification.experiments import run as run_experiment

pytestmark = pytest.mark.trust

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "viv.md").read_text("utf-8")
EXPERIMENTS = (DOCS / "experiments.md").read_text("utf-8").partition("\n## viv\n")[2].partition("\n## ")[0]


@pytest.fixture(autouse=True)
def same_warnings(monkeypatch):
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # main() replaces it


REFUSED = [
    ({"cable": {"length": -3.0}}, "cable.length = -3.0 m is outside [0.01, 20000] m (length L between"),
    ({"cable": {"mass_per_length": 0.0}}, "cable.mass_per_length = 0.0 kg/m is outside (0, 100000] kg/m"),
    ({"flow": {"speed": 0.65}}, "flow.speed = 0.65 is a number, expected a list of numbers in [0, 100] m/s"),
    ({"flow": {"speed": [0.65, -1.0]}}, "flow.speed = [0.65, -1.0] m/s, component 1, is outside [0, 100] m/s"),
    ({"flow": {"speed": [0.65, "x"]}}, "flow.speed = [0.65, 'x'] is a list of 2, expected a list of numbers"),
    ({"damping": {"ratios": [0.1, 0.0]}}, "damping.ratios = [0.1, 0.0], component 1, is outside (0, 5]"),
    ({"tension": {"start": None}}, "tension.start is missing: the tension is nowhere given; nothing was started. Give"),
    ({"profile": {"arc": [0.0, 17.0], "tension": [1500.0, 1600.0]}}, "tension.start = 1500 N and profile.tension both"),
    (
        {"profile": {"arc": [0.0, 17.0], "tension": [1.0, 2.0]}, "tension": {"start": None, "gradient": 3.0}},
        "tension.gradient = 3 N/m has no effect beside the table profile.tension; nothing was started. Leave it out",
    ),
    (
        {"tension": {"start": 1500.0, "gradient": -100.0}},
        "tension.gradient = -100 N/m leaves a tension of -200 N at s = 17 m, not above 0 N",
    ),
    ({"flow": {"arc": [0.0, 8.0, 17.0]}}, "flow.speed has 2 numbers, flow.arc has 3 places; nothing was started"),
    ({"profile": {"arc": [0.0, 17.0], "diameter": [0.03]}}, "has 1 numbers, profile.arc has 2 places"),
    ({"profile": {"arc": [0.0, 17.0]}}, "profile.arc has no column beside it; nothing was started"),
    ({"flow": {"arc": [0.0], "speed": [1.0]}}, "flow.arc has 1 places; nothing was started. Give two at least"),
    (
        {"flow": {"arc": [0.0, 9.0, 9.0], "speed": [1.0, 1.0, 1.0]}},
        "flow.arc does not ascend: 9 m, then 9 m; nothing was started. Sort the table by arc, each once",
    ),
    ({"flow": {"arc": [0.0, 16.0]}}, "flow.arc goes from 0 to 16 m, the cable from 0 to cable.length = 17 m"),
    ({"flow": {"speed": [0.0, 0.0]}}, "flow.speed is zero everywhere: nothing is shed; nothing was started"),
    ({"damping": {"ratios": [0.1, 0.1]}, "response": {"modes": 3}}, "has 2 numbers for response.modes = 3"),
    (
        {"flow": {"speed": [30.0, 30.0]}, "cable": {"diameter": 1e-4}, "tension": {"start": 1.0}},
        "Hz, that of mode 1645024, more than 2000, the last that is computed; nothing was started. Check length",
    ),
    ({"response": {"place": 18.0}}, "response.place = 18 m is more than cable.length = 17 m; nothing was started"),
    (
        {"response": {"frequency_step": 1e-4, "frequencies": None}},
        "takes 263501 steps to the top of the lift spectrum, more than 20000; nothing was started. Give response.freq",
    ),
    (
        {"flow": {"turbulence": 1e-4}, "response": {"frequency_step": None, "frequencies": None}},
        "response.steps_per_half_width = 3 takes ",
    ),
    ({"response": {"frequency_step": 100.0}}, "response.frequency_step = 100 Hz is more than 1.3"),
    ({"lift": {"mean_squares": []}}, "lift.mean_squares = [] is a lift of zero: nothing would move"),
    ({"lift": {"mean_squares": [0.0]}}, "lift.mean_squares = [0.0] is a lift of zero: nothing would move;"),
]


@pytest.mark.parametrize("blocks, text", REFUSED, ids=range(len(REFUSED)))
def test_a_span_is_refused_in_its_words(blocks, text):
    with pytest.raises(viv.SpanError) as error:
        files.span_from_dict(data(**blocks), "my.yaml")
    assert "my.yaml: " in str(error.value) and text in str(error.value), str(error.value)


@pytest.mark.parametrize(
    "content, text",
    [
        (b"", "is empty, expected keys and values such as `cable: {length: 17.45, ...}`; nothing was started"),
        (b"name: a\nship: {tow_speed: 2.0}\n", ":2: ship stands at the top: this is a scene of a tow, not a span"),
        (b"name: \xff\n", "is not UTF-8 text (byte 6); nothing was started. Save the span as UTF-8"),
    ],
)
def test_a_file_that_is_none(content, text, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_bytes(content)
    with pytest.raises(viv.SpanError, match=re.escape(text)):
        viv.load_span(path)


def test_a_span_that_is_given_to_run_is_sent_to_its_command():
    with pytest.raises(SceneError, match="flow stands at the top: this is a span in a flow, not a scene of a tow"):
        load_scene(find_viv("capozucca_5_5"))


WARNINGS = [
    ({"flow": {"speed": [0.1, 0.0]}}, "flow.speed sheds up to 0.5667 Hz, below the first frequency 0.8986 Hz"),
    ({"response": {"segments": 12}}, "response.segments = 12 are 3 for each half wave of mode 4, less than 4"),
    ({"response": {"modes": 1100}}, "response.segments = 20 are 0.01818 for each half wave of mode 1100, less than 4"),
    ({"response": {"modes": 1300}}, "less than 4. Leave response.modes out: 4 modes are shed; 5000 segments"),
    ({"response": {"frequencies": 10}}, "response.frequencies = 10 steps end at 2 Hz, less than"),
    ({"response": {"frequency_step": 1.0}}, "response.frequency_step = 1 Hz is more than 0.33"),
    (
        {
            "damping": {"ratios": [0.003, 0.003, 0.003, 0.003]},
            "response": {"frequency_step": 0.005, "frequencies": 1000},
        },
        "diameters, more than 0.75 diameters: the lift does not grow weaker with the motion here",
    ),
    ({"tension": {"start": 100.0, "gradient": 300.0}}, "response.method = wkb, whose frequencies (WKB) are up to 4.1"),
]


@pytest.mark.parametrize("blocks, text", WARNINGS, ids=range(len(WARNINGS)))
def test_a_doubtful_result_says_so(blocks, text):
    case = span(**blocks)
    found = [files.text_of(problem) for problem in checks.warnings(case, vibration(case))]
    assert any(text in warning for warning in found), found


@pytest.mark.parametrize("name", shipped_viv())
def test_shipped_spans_load_and_raise_no_caution(name):
    case = viv.load_span(name)
    assert not list(checks.warnings(case, vibration(case)))


def test_the_package_imports_when_a_name_is_used():
    assert viv.vibration is vibration and "vibration" in dir(viv) and viv.Vibration.__name__ in viv.__all__
    with pytest.raises(AttributeError, match="no attribute 'vibrate'; it has Span, SpanError"):
        viv.vibrate  # noqa: B018


def test_json_has_the_fields_of_the_contract_and_nothing_else_is_printed(tmp_path):
    result = cable_sim("viv", "capozucca_5_7", "--json", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert set(data) == {*files.FIELDS, files.WARNINGS}
    contract = ["frequencies_hz", "damping_ratios", "arc_m", "rms_displacement_m", "rms_acceleration_m_s2"]
    assert all(isinstance(data[name], list) for name in contract)
    assert len(data["arc_m"]) == len(data["rms_displacement_m"]) == len(data["rms_acceleration_m_s2"]) == 201
    assert data["max_rms_displacement_m"] == max(data["rms_displacement_m"])
    assert data["max_rms_displacement_diameters"] == pytest.approx(data["max_rms_displacement_m"] / 0.028575)
    assert data["place_m"] == pytest.approx(0.125 * data["arc_m"][-1]) and data["reading"] == "A"
    assert data["frequencies_hz"][0] == pytest.approx(0.92632, rel=1e-4) and len(data["modes"]) == 4
    assert json.loads((tmp_path / "viv.json").read_text("utf-8")) == data
    assert (tmp_path / "viv.png").stat().st_size > 50_000


def test_the_table_and_a_caution_on_stderr(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(json.dumps(data(response={"segments": 12})), "utf-8")
    result = cable_sim("viv", path)
    assert result.exit_code == 0, result.output
    assert "small: modes" in result.stdout and "reading A of the lift spectrum" in result.stdout
    assert f"warning: {path}: response.segments = 12 are 3 for each half wave of mode 4" in result.stderr


def test_keys_are_listed_and_stand_on_their_page():
    result = cable_sim("viv", "any", "--keys")
    assert result.exit_code == 0 and result.stdout.endswith("\n".join(tables(Span)))
    assert result.stdout == (DOCS / "viv_keys.md").read_text("utf-8"), (
        "run: cable-sim viv any --keys > docs/viv_keys.md"
    )


def test_the_python_and_the_file_of_the_page_run(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    exec(compile(code, "viv.md", "exec"), {})
    frequency, rms = map(float, capsys.readouterr().out.split())
    assert (frequency, rms) == (pytest.approx(0.92632, rel=1e-4), pytest.approx(0.0137, rel=0.01))
    (text,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.S)
    case = files.span_from_dict(*yaml12.parse(text)[:1], "viv.md")
    result = vibration(case)
    assert not list(checks.warnings(case, result)) and len(result.frequencies) > 10


def test_too_many_modes_for_the_most_segments():
    assert checks._finer(1300, 1300).startswith("Give 5000, the most; they are enough for 1250 modes: take a part of")


def test_a_long_cable_shows_the_modes_of_the_largest_response(tmp_path, capsys, monkeypatch):
    case = span(flow={"speed": [9.0, 8.0]}, response={"segments": 40, "points": 100, "frequencies": 400})
    result = vibration(case)
    assert len(result.frequencies) > 50 and len(files.as_data(case, result)["frequencies_exact_hz"]) == 50
    shown = leading(result, MAX_MODES)
    assert len(shown) == 20 and shown == sorted(shown)
    at_peak = int(np.abs(result.frequencies - result.frequency[result.displacement_spectrum.argmax()]).argmin())
    assert at_peak in shown and leading(result, 1)[0] in shown
    print_vibration(case, result)
    out = capsys.readouterr().out
    head = out.partition("Response along")[0]
    assert f"modes, 20 of {len(result.frequencies)}, of the largest response; all stand in --json" in head
    assert len([line for line in head.splitlines() if line.startswith("│")]) == 20
    drawn = []
    monkeypatch.setattr("cable_sim_ros.plots.run.save", lambda figure, path: drawn.append(figure))
    draw(case, result, tmp_path / "viv.png")
    (figure,) = drawn
    lines = [line for line in figure.axes[0].lines if list(line.get_xdata()) == [line.get_xdata()[0]] * 2]
    assert len(lines) == 20 and len(figure.axes[3].get_yticks()) == 20
    label = next(line.get_label() for axis in figure.axes for line in axis.lines if "no scale" in str(line.get_label()))
    assert label == "shapes of modes 1, 2, 3, 25, no scale"


def test_a_choice_outside_the_range_of_its_key_is_left_out():
    case = span(flow={"strouhal": 0.95})
    assert "Strouhal number + 10 %" not in sensitivity.choices(case, vibration(case))


def numbers(markdown):
    """Rows of a table: names to the numbers after them."""
    found = {}
    for line in markdown.splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split(" | ")]
        if line.startswith("| ") and len(cells) > 2:
            found[cells[0]] = [float(c) for c in cells[1:] if re.fullmatch(r"[-+]?[\d.]+(e-?\d+)?", c)]
    return found


def test_the_sensitivity_of_the_page_of_experiments_is_that_of_the_command(tmp_path):
    result = cable_sim("viv", "capozucca_5_7", "--sensitivity", "--json", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    data = {row["choice"]: row for row in json.loads(result.stdout)}
    page = numbers(EXPERIMENTS.partition("fig. 5.7 (`capozucca_5_7`):")[2])
    for row in data.values():
        assert page[row["choice"]] == pytest.approx([100.0 * x for x in list(row.values())[1:]], abs=0.1), row
    assert data["damping ratios - 15 %"]["place"] == pytest.approx(0.08, abs=0.005)
    assert data["exponential correlation"]["place"] == pytest.approx(-0.13, abs=0.01)
    assert data["flow the other way round"]["place"] == pytest.approx(-0.08, abs=0.005)
    assert data["mean squares taken as rms values"]["place"] == pytest.approx(-0.20, abs=0.015)
    assert abs(data["response by the other method"]["place"]) < 1e-3
    assert (tmp_path / "sensitivity.md").read_text("utf-8").startswith("| choice | rms there % |")
    assert "reading A of the lift" not in data, "what it is already is no choice"


def test_the_sensitivity_is_printed_as_a_table(monkeypatch):
    monkeypatch.setattr(
        sensitivity, "choices", lambda span, base: {"reading B of the lift": {"lift": {"reading": "B"}}}
    )
    result = cable_sim("viv", "capozucca_5_5", "--sensitivity")
    assert result.exit_code == 0 and "reading B of the lift" in result.stdout and "least zeta %" in result.stdout


@pytest.mark.nightly
def test_printed_figures_stand_beside_ours_on_the_page_of_experiments_and_those_apart_say_why(tmp_path):
    result = run_experiment("viv", 1.0)
    page = numbers(EXPERIMENTS.partition("Chosen otherwise")[0])
    for row in result.rows:
        shown = [x for x in (row.measured, row.ours, row.allowed) if x is not None]
        assert row.name not in page or page[row.name] == pytest.approx(shown, rel=1e-3), row.name
    apart = {row.name for row in result.rows if row.measured is not None and abs(row.ours - row.measured) > row.allowed}
    assert apart == {
        "fig. 5.12, damping ratio of mode 1",
        *(f"fig. 5.16, damping ratio of mode {n}" for n in (13, 14, 16)),
    }
    assert all(row.why for row in result.rows if row.name in apart) and apart <= set(page)
    assert all(row.why for row in result.rows if "rms" in row.name)
    assert result.plot(tmp_path).stat().st_size > 50_000
