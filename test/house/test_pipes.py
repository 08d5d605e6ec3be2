"""No command waits for a named pipe, or opens what is no regular file: each place where a file is named gets one."""

import ast
import os
import stat
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from cable_sim_ros import files
from cable_sim_ros.cli.commands import main
from cable_sim_ros.cli.number import Number

PACKAGE = Path(files.__file__).parent
READS = {  # options that name a file or bag that is read; a new option is put here or into OTHERS
    *("bag", "board", "controller", "faults", "file", "from", "limits", "mapping", "mapping-b", "merge", "motion"),
    *("page", "rao", "scene", "winch"),
}
OTHERS = {  # options of words, numbers and what is written
    *("align", "antenna", "astern", "band", "began", "bias", "camera", "case", "cluster", "command", "convention"),
    *("counter-offset", "data", "every", "factor", "fidelity", "fields", "fmi", "format", "fps", "free", "gain"),
    *("heading", "heave", "height", "hold-out", "host", "intervals", "junit", "key", "lag", "mapping-out", "max-lag"),
    *("name", "namespace", "only", "origin", "out", "outside", "parameter", "picture", "range", "report", "save"),
    *("scope", "search", "set", "setpoint", "signal", "size", "slope", "speed", "step", "tables", "tension"),
    *("tension-unit", "topic", "track", "vary", "duration", "copies", "repeats", "against", "rounds", "processes"),
    *("seed", "twins", "wait", "workers", "to", "start", "seconds", "rate", "port", "number", "markers"),
}
BAGS = {"calibrate", "compare", "ensemble", "film", "layback", "replay", "telegrams", "view"}  # they begin with one
WORDS = {"node", "ahc", "bench", "stress", "soak", "validate", "manual", "live"}  # of no files; live starts a node
BESIDES = {  # what a command wants beside its first argument
    "ahc": "--board=board.csv",
    "calibrate": "--scene=full_scale --free=cable.normal_drag",
    "export": "--out=x.csv",
    "film": "--out=x.mp4",
    "fmu": "--out=x.fmu",
    "import": "--out=x",
    "layback": "--scene=full_scale",
    "report": "--out=x.html",
    "table": "--scope=1:2:2",
    "telegrams": "--out=x --format=tss1",
}


def commands():
    context = click.Context(main)
    return {name: main.get_command(context, name) for name in main.list_commands(context)}


def lines(pipe):
    """Command lines, each with a pipe at one place where a file is named."""
    for name, command in commands().items():
        given = [one for one in command.params if isinstance(one, click.Argument)]
        besides = BESIDES.get(name, "").split()
        if given and name not in WORDS:
            yield [name, *[pipe] * len(given), *besides]
        for one in command.params:
            option = one.opts[0].removeprefix("--")
            if isinstance(one, click.Option) and option in READS and not isinstance(one.type, Number):
                first = ["nbp1406" if name in BAGS else "flume"] * (0 if name in WORDS else len(given))
                yield [name, *first, *besides, f"--{option}={'law=' * (option == 'controller')}{pipe}"]


def test_every_option_is_known_to_name_a_file_or_not():
    named = {
        one.opts[0].removeprefix("--")
        for command in commands().values()
        for one in command.params
        if isinstance(one, click.Option) and not one.is_flag
    }
    assert not named - READS - OTHERS


watched: list[str] = []
opened: list[str] = []


def _opens(event, arguments):
    if watched and event in ("open", "sqlite3.connect") and isinstance(arguments[0], str):
        path = arguments[0].removeprefix("file:").partition("?")[0]
        if path.startswith(watched[0]) and os.path.exists(path) and stat.S_ISFIFO(os.stat(path).st_mode):
            opened.append(path)
            raise InterruptedError(f"{path} would be waited for")


@pytest.fixture(scope="module")
def pipes(tmp_path_factory):
    """A pipe under names of every kind, and folders that look like bags; whether one is opened is seen."""
    folder = tmp_path_factory.mktemp("pipes")
    for bag in ("bag", "other"):
        (folder / bag).mkdir()
    for name in ("pipe", "a.csv", "bag/metadata.yaml", "bag/a.mcap", "other/a.db3"):
        os.mkfifo(folder / name)
    watched[:] = [str(folder)]
    sys.addaudithook(_opens)
    yield folder
    watched.clear()


@pytest.mark.parametrize("name", ["pipe", "a.csv", "bag", "other"])
def test_no_command_waits_for_a_pipe(pipes, monkeypatch, name):
    monkeypatch.chdir(pipes)
    for line in lines(str(pipes / name)):
        opened.clear()
        done = CliRunner().invoke(main, line)
        assert not opened, line
        assert done.exit_code in (1, 2), (line, done.output, done.exception)
        assert isinstance(done.exception, SystemExit), (line, done.exception)


@pytest.mark.parametrize("path, kind", [("pipe", "a named pipe"), ("/dev/zero", "a device"), ("/", "a folder")])
def test_what_is_no_regular_file_is_said(pipes, path, kind):
    for read in (files.open_file, files.read_text, files.read_bytes, files.regular):
        with pytest.raises(OSError, match=kind):
            read(pipes / path)


OWN = {  # module: calls that open what the program made or brought itself, or what came through files.py
    "files.py": 1,
    "fmu/tow.py": 3,
    "io/bags/bag.py": 2,
    "io/logs/containers/bag_files.py": 1,
    "io/logs/containers/bounded.py": 2,
    "io/logs/containers/netcdf.py": 2,
    "io/logs/containers/parquet.py": 1,
    "physics/jit.py": 1,
    "physics/kernel_cache.py": 1,
    "physics/kernel_key.py": 1,
    "plots/foxglove_view.py": 1,
    "plots/saved.py": 1,
    "ros/child.py": 1,
    "ros/node.py": 1,
    "ros/play/live.py": 1,
    "sim/saved/npz_bytes.py": 1,
    "start.py": 1,
    "sweeps/cases.py": 1,
    "sweeps/store.py": 1,
    "testing/domain.py": 1,
    "testing/tow_sim.py": 1,
}
LIBRARIES = ("ParquetFile", "read_table", "open_dataset", "sqlite3.connect", "fromfile", "loadtxt", "genfromtxt")


def readers(text):
    """Lines of calls that open a file to read by another way than files.py; /proc and /sys hold no user's file."""
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        what = ast.unparse(node)
        called = ast.unparse(node.func)
        mode = "".join(a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str))
        method = called.rpartition(".")[2] if "." in called else ""
        if "/proc" in what or "/sys" in what or called == "os.open":
            continue
        if (
            method in ("read_text", "read_bytes")
            or (called == "open" or method == "open")
            and not set(mode) & set("wxa")
        ):
            yield node.lineno
        elif called.endswith(LIBRARIES) and called != "read_table":
            yield node.lineno


def test_files_are_opened_in_one_place():
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if not name.startswith("verification/") and (at := list(readers(path.read_text("utf-8")))):
            found[name] = at
    assert {name: len(at) for name, at in found.items()} == OWN, found


@pytest.mark.parametrize(
    "line", ["open(p)", "p.open('rb')", "Path(p).read_text()", "sqlite3.connect(p)", "pq.read_table(p)"]
)
def test_another_way_is_seen(line):
    assert list(readers(line)) == [1] and not list(readers("open_file(p); open(p, 'w'); read_text(p)"))
