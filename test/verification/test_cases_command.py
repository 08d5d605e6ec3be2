"""cable-sim case: answers in the contract's form, every refusal with its text."""

import json

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands

CASE = {
    "id": "x",
    "inputs": {"length_m": 100.0, "wet_weight_N_m": 3.0, "body_wet_weight_N": 500.0, "EA_N": 1e6},
    "outputs": [{"name": "top tension", "unit": "N", "tol_rel": 0.001}, {"name": "colour", "unit": ""}],
}


def run(tmp_path, data, *more):
    path = tmp_path / "x.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data), "utf-8")
    return CliRunner().invoke(commands.main, ["case", str(path), *more])


def test_values_in_the_form_of_the_contract(tmp_path):
    done = run(tmp_path, CASE | {"outputs": CASE["outputs"][:1]}, "--json")
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert set(report) == {"id", "outputs", "elements", "dt_s", "cpu_s", "notes"}
    assert report["outputs"][0]["value"] == pytest.approx(800.0, rel=1e-6)


def test_a_missing_value_is_null_with_a_note_and_code_1(tmp_path):
    done = run(tmp_path, CASE, "--json", "--fidelity", "realtime")
    assert done.exit_code == 1
    report = json.loads(done.stdout)
    assert report["outputs"][1]["value"] is None and any("no value for: colour" in n for n in report["notes"])


@pytest.mark.parametrize(
    "data, text",
    [
        ("{", "this is no JSON"),
        ({"id": "x", "inputs": {}}, "the key 'outputs' is missing or no list; nothing was run"),
        (CASE | {"outputs": [{}]}, "outputs: every entry needs a 'name'; nothing was run"),
        (
            CASE | {"inputs": CASE["inputs"] | {"length_m": "long"}},
            "inputs.length_m = 'long' is no finite number; the case was not run",
        ),
    ],
)
def test_refusals(tmp_path, data, text):
    done = run(tmp_path, data)
    assert done.exit_code == 2 and text in done.stderr


def test_inputs_of_no_family_are_told(tmp_path):
    done = run(tmp_path, CASE | {"inputs": {"wings": 2}}, "--json")
    assert done.exit_code == 1
    assert json.loads(done.stdout)["notes"] == ["no family of cases takes the inputs wings"]
