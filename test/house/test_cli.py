"""Every command helps, every mistake is one line on stderr and code 2, every run ends with its verdict."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.cli.options import Answer, Heave, Number, answers, code_of, drawn
from cable_sim_ros.io.sources.motion_table import MotionError
from cable_sim_ros.limits import MAX_TOW_SPEED
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.message_run import MessageRun
from cable_sim_ros.sim.simulator import Simulator, SolverError
from cable_sim_ros.sim.statics.route import StartError

COMMANDS = commands.main.list_commands(None)


@pytest.fixture(autouse=True)
def same_warnings(monkeypatch):
    import warnings

    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # main() replaces it


def call(*arguments):
    return CliRunner().invoke(commands.main, [str(a) for a in arguments])


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_helps(command):
    result = call(command, "--help")
    assert result.exit_code == 0 and result.output.startswith("Usage:")
    options = [p for p in commands.main.get_command(None, command).params if isinstance(p, click.Option)]
    undocumented = [p.name for p in options if not p.help]
    assert not undocumented


@pytest.mark.parametrize(
    "line, text",
    [
        ("run no_such_scene", "error: no_such_scene: no such scene file; nothing was started."),
        ("run full_scale --motion no_such_bag", "error: no_such_bag: no such bag file; nothing was started."),
        ("run full_scale --setpoint holt", "Did you mean hold?"),
        ("run full_scale --motion none.csv", "error: none.csv: no such file; nothing was simulated."),
        ("run full_scale --heave 1.2", "'1.2' is not an amplitude in m and a period in s, as in 1.2,8"),
        ("run full_scale --heave a,b", "'a,b' is not an amplitude in m and a period in s"),
        ("run full_scale --heave 1.2,0", "error: heave of 1.2 m in 0 s: the period is outside [1, 600] s"),
        ("run full_scale --heave 1,8 --motion nbp1406", "error: heave and the motion 'nbp1406' were"),
        ("run full_scale --heave 1,8 --motion none", "--heave and --motion none contradict each other"),
        ("run full_scale --rao simple --motion none", "--rao and --motion none contradict each other"),
        ("run full_scale --rao simple --heave 1,8", "error: rao and heave were both given: nothing"),
        ("run full_scale --rao simple", "error: full_scale: --rao moves the ship in the waves of the scene"),
        ("run full_scale --winch '0 stop'", "error: winch plan, item 1 '0 stop': 'stop' is no order; nothing was"),
        ("run full_scale --winch haul.txt", "error: winch plan haul.txt: cannot be read (No such file or"),
        ("run full_scale --winch '0 rate 9'", "rate = 9 m/s is beyond winch.max_rate = 5 m/s; nothing was"),
        ("run full_scale --duration 0", "Invalid value for '--duration'"),
        ("run full_scale --markers nan", "'--markers': nan is not a finite number; nothing was done"),
        ("run full_scale --markers -1", "'--markers': -1 Hz is outside [0, 1000] Hz; nothing was done"),
        ("run full_scale --markers 10", "--markers writes into the bag of --out; nothing was simulated"),
        ("run full_scale --every 2", "'--every': 2 s is outside [0.0001, 1] s; nothing was done"),
        ("run full_scale --step long", "Invalid value for '--step'"),
        ("run full_scale --step fixed --every 0.5", "override of full_scale: solver.tick = 0.5 s is more than 0.1 s"),
        ("run", "Missing argument 'SCENE' (or --from FILE)"),
        ("run --from no_such_state", "error: no_such_state: cannot be read (No such file or directory)"),
        ("run full_scale --motion none --save no/such/folder/x", "error: no/such/folder/x: cannot be written (No such"),
        ("replay no_such_bag", "error: no_such_bag: no such bag file"),
        ("recover no_such_bag x", "error: no_such_bag: no such bag file"),
        ("recover lmg1903 /dev/null", "error: bag '/dev/null' exists already"),
        ("case deep.json", "error: deep.json: is nested deeper than Python reads; nothing was run."),
        ("run side_scan --motion long.csv", "error: long.csv:3: is no row of a table (field larger than"),
        ("validate drag --out deep.json/x", "--out deep.json/x: cannot be made or written (Not a"),
        ("stress N1 --out deep.json/x", "--out deep.json/x: cannot be made or written"),
        ("bench P1 --out /dev/null/x", "cannot be made or written (Not a directory); nothing was run."),
        ("viv capozucca_5_5 --out /dev/null/x", "cannot be made or written (Not a directory); nothing was"),
        ("span span_in_wind --out /dev/null/x", "cannot be made or written (Not a directory); nothing was"),
        ("soak R1 --out /dev/null/x", "cannot be made or written (Not a directory); nothing was run."),
        ("play nbp1406 --ros-args -r", "error: ROS arguments: Couldn't parse trailing -r flag. No remap rule found.; "),
        ("play nbp1406 --ros-args -p x", "error: ROS arguments: Couldn't parse parameter override rule: '-p x'."),
        ("live no_such_bag", "error: no_such_bag: no such bag file"),
        ("live --scene no_such_scene", "error: no_such_scene: no such scene file"),
        ("manual --out no/such/folder/x.md", "error: "),
        ("make-bags --speed nan", "nan is not a finite number; nothing was done. Give one in [-15, 15] m/s"),
        ("make-bags --only nbp", "error: there is no record 'nbp': nothing was written"),
        ("bench P1 --features", "--haul, --ticks, --lockstep, --water and --sweep each stand alone"),
        ("bench --features --sheave-mesh", "--features, --account, --sheave-mesh, --mesh, --haul, --ticks, --lockstep"),
        ("bench --sheave-mesh --repeats 2", "--sheave-mesh repeats nothing"),
        ("bench --mesh --repeats 2", "--mesh repeats nothing"),
        ("bench P7 --haul", "each stand alone"),
        ("bench --ticks --repeats 2", "--ticks repeats nothing"),
        ("mesh no_such_scene", "error: no_such_scene: no such scene file; nothing was started."),
        ("viv no_such_span", "error: no_such_span: no such span file; nothing was started."),
        ("span no_such_span", "error: no_such_span: no such span file; nothing was started."),
        ("span span_in_wind --case x", "error: case 'x' is not in span_in_wind; nothing was run."),
        ("run span_in_wind", "span_in_wind.yaml:3: span stands at the top: this is a span in a wind, not a scene"),
        ("play nbp1406 --lop", "error: --lop: no option of play; nothing was played."),
        ("play nbp1406 --rate 0", "Invalid value for '--rate': 0 is outside (0, 100]; nothing was done"),
        ("play nbp1406 --lockstep --rate 1", "error: --rate 1 with --lockstep: /clock says when a message is sent; no"),
        ("play no_such_bag", "error: no_such_bag: no such bag file"),
    ],
)
def test_a_mistake_is_told_in_one_line(line, text, tmp_path, monkeypatch):
    arguments = shlex.split(line)
    if arguments[0] in ("live", "play"):
        pytest.importorskip("rclpy")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deep.json").write_text("[" * 100_000)
    (tmp_path / "long.csv").write_text(f"time_s,heave_m\n0,0\n1,{'0' * 200_000}\n")
    result = call(*arguments)
    assert result.exit_code == 2 and text in result.stderr and "Traceback" not in result.stderr
    assert not result.stdout
    if arguments[0] != "run" or len(arguments) > 2:
        assert result.exception is None or isinstance(result.exception, SystemExit)


def numbers():
    """Every number of the command line: command, option, type."""
    for name in commands.main.list_commands(None):
        command = commands.main.get_command(None, name)
        for option in command.params:
            if isinstance(option.type, (click.types.FloatParamType, click.types.IntParamType, Heave)):
                yield name, option


def test_every_number_is_finite_and_in_a_range():
    """nan compares false with every bound, so that a check of bounds alone lets it through."""
    found = dict.fromkeys(name for name, _ in numbers())
    assert set(found) >= {"run", "live", "play", "mesh", "plan", "validate", "make-bags", "replay", "bench"}
    for name, option in numbers():
        if isinstance(option.type, click.types.FloatParamType):
            assert isinstance(option.type, Number), (name, option.name)
        elif isinstance(option.type, click.types.IntParamType):
            assert None not in (option.type.min, option.type.max), (name, option.name)
        for value in ("nan", "inf", "-inf", "1e999"):
            with pytest.raises(click.BadParameter):
                option.type.convert(value if not isinstance(option.type, Heave) else f"1,{value}", option, None)


def test_the_speed_of_a_bag_is_that_of_a_scene():
    limits = Ship.model_json_schema()["properties"]["tow_speed"]
    assert (limits["low"], limits["high"]) == (-MAX_TOW_SPEED, MAX_TOW_SPEED)


def test_a_mistake_of_ours_keeps_its_traceback(monkeypatch):
    def broken(*arguments, **options):
        raise ValueError("ours")

    monkeypatch.setattr(offline, "run", broken)
    result = call("run", "full_scale")
    assert isinstance(result.exception, ValueError)


@pytest.mark.parametrize("code", [0, 4])
def test_an_answer_is_printed_written_and_left_with(code, tmp_path):
    def no_matplotlib():
        raise RuntimeError("matplotlib is not installed")

    @click.command()
    @answers
    def one():
        files = [("picture", Path("p.png")), ("state", None), *drawn(no_matplotlib)]
        return Answer(
            {"a": 1}, lambda: click.echo("table"), tmp_path / "a.json", files, ["odd"], ["verdict: that"], code
        )

    text, said = '{\n "a": 1\n}\n', f"picture:   p.png\nfigures:   {tmp_path / 'a.json'}\n"
    done, as_json = CliRunner().invoke(one), CliRunner().invoke(one, ["--json"])
    assert done.exit_code == as_json.exit_code == code and (tmp_path / "a.json").read_text() == text
    warned = "warning: matplotlib is not installed\nodd\n"
    assert (done.stdout, done.stderr) == (f"table\n{said}verdict: that\n", warned)
    assert (as_json.stdout, as_json.stderr) == (text, warned + said + ("verdict: that\n" if code else ""))


def test_json_is_all_that_is_printed():
    result = call("run", "full_scale", "--motion", "none", "--duration", "0.1", "--json")
    assert result.exit_code == 0, result.output
    metrics = json.loads(result.stdout)
    assert metrics["body_depth_m"] > 0 and len(metrics["body_position_m"]) == 3
    assert (metrics["ticks"], metrics["step_tension_error"]) == (1, 0.005)


def test_steps_are_fixed_and_frames_as_far_apart_as_asked_for():
    arguments = ("run", "full_scale", "--motion", "none", "--duration", "0.2", "--json")
    for more, ticks, tolerance in ((("--step", "fixed"), 20, None), (("--every", "0.05"), 4, 0.005)):
        metrics = json.loads(call(*arguments, *more).stdout)
        assert (metrics["ticks"], metrics["step_tension_error"]) == (ticks, tolerance)


def test_a_run_goes_on_from_where_another_was_saved(tmp_path):
    """SCENE left out or the same; the motion as before; another scene is refused with what differs."""
    state, arguments = tmp_path / "tow.npz", ("run", "side_scan", "--step", "fixed", "--heave", "0.5,8")
    whole = json.loads(call(*arguments, "--duration", "0.8", "--json").stdout)
    first = call(*arguments, "--duration", "0.5", "--save", state)
    assert first.exit_code == 0 and f"state:     {state}" in first.stdout, first.stderr
    rest = ("--from", state, "--duration", "0.3", "--save", state, "--json")
    metrics = json.loads(call("run", *rest).stdout)
    assert metrics["resumed"]["motion"] == "goes on" and metrics["saved"] == str(state) and metrics["ticks"] == 30
    assert max(metrics["body_depth_max_m"], 0.0) <= whole["body_depth_max_m"] and metrics["motion"] == whole["motion"]
    again = json.loads(call(*arguments, "--from", state, "--duration", "0.1", "--json").stdout)
    assert again["resumed"]["time_s"] == pytest.approx(1.8)
    refused = call("run", "side_scan", "--from", state)
    assert (
        refused.exit_code == 2 and "tow.npz: is the state of another scene: solver.tick is 0.01 s in" in refused.stderr
    )
    other = call("run", "--from", state, "--step", "chosen")
    assert other.exit_code == 2 and "solver.tension_error is absent in the file, 0.005 here" in other.stderr


def test_a_failed_run_is_code_1_and_still_has_figures(monkeypatch):
    whole = offline.run("full_scale", duration=0.1)
    whole.problem = "the solver gave up"
    offline.judged(whole, None)
    monkeypatch.setattr(offline, "run", lambda *a, **k: whole)
    result = call("run", "full_scale", "--json")
    assert result.exit_code == 1 and json.loads(result.stdout)["problem"] == "the solver gave up"
    assert "error: the solver gave up; the figures are of the part before it" in result.stderr
    assert json.loads(result.stdout)["verdict"]["state"] == "failed"
    assert call("run", "full_scale").stdout.splitlines()[-1] == "  HALTED: the solver gave up"


def test_the_last_line_is_the_verdict_and_the_exit_code_goes_with_it(tmp_path):
    """A light body in a sea that throws the cable off its sheave; the same scene at rest."""
    ok = call("run", "side_scan", "--motion", "none", "--duration", "1")
    assert ok.exit_code == 0 and ok.stdout.splitlines()[-1] == "verdict: ok"
    arguments = ("run", "side_scan", "--heave", "3,4", "--duration", "6")
    thrown = call(*arguments)
    assert thrown.exit_code == 4 and thrown.stdout.splitlines()[-3].startswith("verdict: doubtful")
    assert "SLACK for " in thrown.stdout.splitlines()[-2] and "DETACHED for " in thrown.stdout.splitlines()[-1]
    report = call(*arguments, "--json", "--out", tmp_path / "out")
    metrics = json.loads(report.stdout)
    assert report.exit_code == 4 and metrics["verdict"]["state"] == "doubtful" and "verdict: doubtful" in report.stderr
    reason = metrics["verdict"]["reasons"][1]
    assert reason["flag"] == "DETACHED" and 0.5 < reason["seconds"] < 6.0 and "tension_max_n" in reason["figures"]
    assert json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["verdict"] == metrics["verdict"]


def test_a_cable_that_misses_its_sheave_is_refused_with_the_angle(tmp_path):
    scene = tmp_path / "miss.yaml"
    text = (Path(commands.__file__).parents[2] / "config" / "full_scale.yaml").read_text("utf-8")
    scene.write_text(text.replace("position: [-36.8, 0.0, 3.7]", "position: [-36.8, 3.0, 3.7]"), "utf-8")
    missed = call("run", scene, "--motion", "none", "--duration", "1")
    assert missed.exit_code == 1 and missed.stderr.count("error:") == 1
    assert "not in the groove of its sheave" in missed.stderr and "nothing was started" in missed.stderr
    assert "comes 20.6 deg aslant from the drum: bring winch.position and sheave.position into line" in missed.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "full_scale", "--motion", "none"),
        ("plan", "full_scale", "--motion", "none"),
        ("mesh", "side_scan", "--check"),
    ],
)
def test_a_start_that_fails_is_one_line_and_code_1(arguments, monkeypatch):
    def start(self, *given, **named):
        raise StartError("full_scale: no static equilibrium, residual 12 N", 12.0)

    monkeypatch.setattr(Simulator, "start", start)
    result = call(*arguments)
    assert result.exit_code == 1 and "Traceback" not in result.stderr
    assert result.stderr.splitlines()[-1] == "error: full_scale: no static equilibrium, residual 12 N"
    report = json.loads(call(*arguments, "--json").stdout)
    assert report["verdict"]["state"] == "failed" and report["verdict"]["reasons"][0]["flag"] == "NO_START"


def test_every_error_of_the_package_is_expected():
    """One base, so that an error that is added cannot become a traceback."""
    sources = Path(commands.__file__).parents[1].rglob("*.py")
    declared = re.findall(r"^class (\w*Error)\((\w+)", "\n".join(p.read_text("utf-8") for p in sources), re.M)
    ours, internal = (
        {"CableSimError", "RunError"},
        {"YamlError", "MatrixError"},
    )  # the latter are caught where they arise
    for _ in declared:
        ours |= {name for name, base in declared if base in ours}
    assert len(ours) > 15 and {name for name, _ in declared} - ours == internal
    assert code_of(MotionError("x")) == 2 and code_of(SolverError("x")) == 1
    assert code_of(StartError("x", 1.0)) == 1 and code_of(OSError()) == 2
    assert code_of(ValueError("x")) is None


@pytest.mark.filterwarnings("always::cable_sim_ros.io.scenes.document.SceneWarning")
def test_a_warning_is_said_once():
    result = call("run", "full_scale_westin", "--motion", "none", "--duration", "0.1", "--set", "gravity=9.81")
    said = [line.partition(": ")[2].partition(": ")[2] for line in result.stderr.splitlines()]
    assert len(said) == len(set(said)) == 3


def test_a_replay_says_when_there_is_nothing_to_compare(monkeypatch):
    real = MessageRun._ticks
    monkeypatch.setattr(MessageRun, "_ticks", lambda self, start, duration: min(100, real(self, start, duration)))
    assert "keeps no scene" in (bare := call("replay", "lmg1903")).stderr and bare.exit_code == 2
    result = call("replay", "lmg1903", "--scene", "full_scale")
    assert result.exit_code == 4 and "The bag recorded nothing of the tow" in result.stdout
    assert "NOT_COMPARED" in result.stdout


def test_out_has_bag_figures_and_picture(tmp_path):
    pytest.importorskip("matplotlib")
    result = call("run", "full_scale", "--duration", "2", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "out" / "run.png").read_bytes()[:4] == b"\x89PNG"
    assert (tmp_path / "out" / "tow" / "metadata.yaml").is_file() and (tmp_path / "out" / "summary.json").is_file()
    for word in ("picture:", "recording:", "figures:", "tension at the sheave"):
        assert word in result.stdout


def test_a_plan_leaves_the_picture_of_a_haul(tmp_path):
    pytest.importorskip("matplotlib")
    plan = tmp_path / "plan.txt"
    plan.write_text("0 hold\n0.5 rate 0.1\n")
    result = call(
        "run", "full_scale", "--heave", "0.5,8", "--duration", "1", "--winch", plan, "--out", tmp_path / "out"
    )
    assert result.exit_code == 0, result.output
    assert (tmp_path / "out" / "haul.png").read_bytes()[:4] == b"\x89PNG" and "haul.png" in result.stdout
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["winch"] == "0 hold, 0.5 rate 0.1"


@pytest.mark.parametrize("command", [("node",), ("play", "nbp1406"), ("live",)])
def test_without_ros_the_commands_that_need_it_say_so(command, monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    result = call(*command)
    assert result.exit_code == 2
    assert "Error: this command needs ROS 2, and rclpy cannot be imported" in result.stderr
    assert "nothing was started" in result.stderr and "pip install 'cable_sim_ros[ros]'" in result.stderr


def test_help_loads_neither_ros_nor_the_compiler():
    code = (
        "import sys; from cable_sim_ros.cli.commands import main\ntry: main(['--help'])\nexcept SystemExit: "
        "pass\nprint(sorted({'rclpy', 'numba', 'numpy', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
