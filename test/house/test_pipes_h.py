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
NEEDS_A_FIRST = {"calibrate": "nbp1406", "compare": "nbp1406", "replay": "nbp1406", "layback": "nbp1406"}
WORDS = {"node", "ahc", "bench", "stress", "soak", "validate", "manual"}  # their arguments are no files


def commands():
    context = click.Context(main)
    return {name: main.get_command(context, name) for name in main.list_commands(context)}


def lines(pipe):
    """Command lines, each with a pipe at one place where a file is named."""
    for name, command in commands().items():
        given = [one for one in command.params if isinstance(one, click.Argument)]
        if given and name not in WORDS:
            yield [name, *[pipe] * sum(one.required or one.nargs == 1 for one in given)]
        for one in command.params:
            option = one.opts[0].removeprefix("--")
            if isinstance(one, click.Option) and option in READS:
                first = [NEEDS_A_FIRST.get(name, "flume")] * sum(arg.required for arg in given)
                yield [name, *first, f"--{option}", f"law={pipe}" if option == "controller" else pipe]


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
    for name in ("pipe", "a.mcap", "a.csv", "a.npz", "bag/metadata.yaml", "bag/a.mcap", "other/a.db3"):
        os.mkfifo(folder / name)
    watched[:] = [str(folder)]
    sys.addaudithook(_opens)
    yield folder
    watched.clear()


@pytest.mark.parametrize("name", ["pipe", "a.mcap", "a.csv", "a.npz", "bag", "other"])
def test_no_command_waits_for_a_pipe(pipes, monkeypatch, name):
    monkeypatch.chdir(pipes)
    for line in lines(str(pipes / name)):
        opened.clear()
        done = CliRunner().invoke(main, line)
        (opened or done.exit_code not in (1,2) or not isinstance(done.exception,SystemExit)) and print("BAD", line, opened, done.exit_code, done.exception); print(line[0], line[-2:], (done.output.strip().splitlines() or [""])[-1][:260]); continue
        assert done.exit_code in (1, 2), (line, done.output, done.exception)
        assert isinstance(done.exception, SystemExit), (line, done.exception)


@pytest.mark.parametrize("path, kind", [("pipe", "a named pipe"), ("/dev/zero", "a device"), ("/", "a folder")])
def test_what_is_no_regular_file_is_said(pipes, path, kind):
    for read in (files.open_file, files.read_text, files.read_bytes, files.regular):
        with pytest.raises(OSError, match=kind):
            read(pipes / path)


OWN = {  # files of the program itself or of the machine, and what is written; module: how often
    "files.py": 1,
}


def readers(tree):
    """Lines of calls that open a file to read, other than by files.py."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        mode = "".join(a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str))
        if name in ("read_text", "read_bytes") and isinstance(node.func, ast.Attribute):
            yield node.lineno
        elif name == "open" and not set(mode) & set("wxa"):
            yield node.lineno
        elif name in ("ParquetFile", "read_table", "open_dataset", "connect", "fromfile", "loadtxt", "genfromtxt"):
            yield node.lineno


def test_files_are_opened_in_one_place():
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if count := list(readers(ast.parse(path.read_text("utf-8")))):
            found[name] = count
    assert {name: len(at) for name, at in found.items()} == OWN, found
