"""ROS arguments and parameter files that rclpy itself cannot read: one line and exit code 2, no traceback."""

import pytest

from cable_sim_ros.ros.node import main

HEAD = "/**:\n  ros__parameters:\n    "


@pytest.mark.parametrize(
    "body, part",
    [
        (HEAD + "scene: " + "[" * 20_000, "Error parsing a event near line 3"),
        ("\0\1\2", "Couldn't parse params file"),
        ("[1, 2]", "Sequences cannot be key at line 1"),
        (HEAD + "x: [1, a]", "Sequence should be of same type"),
        (HEAD + "scene: &a [*a]", "Will not support aliasing"),
        (HEAD + "k" * 5000 + ": 1", "Couldn't parse params file"),
        (HEAD + 'scene: "\\ud800"', "Error parsing a event"),
        (HEAD + "input_delay: 1e999", "parameter 'input_delay' must be a floating-point number in s, got '1e999'"),
        (HEAD + "scene: '" + "/x" * 5000 + "'", "File name too long"),
        (HEAD + 'scene: "a\\0b"', "no such scene file"),
        (HEAD + "watre: {density: 1000.0}", "error: parameter 'watre.density' = 1000.0: there is no such parameter;"),
    ],
)
def test_a_parameter_file_that_is_none(body, part, tmp_path, capfd, monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    path = tmp_path / "p.yaml"
    path.write_text(body)
    assert main(["node", "--ros-args", "--params-file", str(path)]) == 2
    errors = capfd.readouterr().err
    assert sum(line.startswith("error: ") for line in errors.splitlines()) == 1
    assert part in errors and "Traceback" not in errors and "nothing was started" in errors or "from 0 s" in errors


@pytest.mark.parametrize("given", [["-p", "x"], ["-r", "bad"], ["-r", "__ns:=//x"], ["--log-level", "zzz"]])
def test_an_argument_that_is_none(given, capfd, monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    assert main(["node", "--ros-args", *given]) == 2
    errors = capfd.readouterr().err
    assert "error: ROS arguments: Couldn't parse" in errors and given[-1] in errors
    assert "; nothing was started. Correct the file or argument it names" in errors and "Traceback" not in errors
