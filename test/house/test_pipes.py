"""No command waits for a named pipe, or opens what is no regular file: each place where a file is named gets one."""

import ast
import os
import re
import stat
import sys
from itertools import islice
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from cable_sim_ros import files
from cable_sim_ros.cli.commands import main
from cable_sim_ros.cli.options import Number
from cable_sim_ros.io.bags.bag import BagReader, BagWriter
from cable_sim_ros.io.scenes.document import find_bag

PACKAGE = Path(files.__file__).parent
# options that name a file or bag that is read; a new option is put here or into OTHERS
READS = """
bag board controller faults file from limits map mapping mapping-b merge motion page profile rao reveal scene
ship table vehicle winch
""".split()
# options of words, numbers and what is written
OTHERS = """
acceleration against age align antenna astern band began bias body camera case cluster command convention copies
corridor counter-offset data design duration every factor fidelity fields fmi folds format fps free gain group
heading heave height hold-out hole host interval intervals junit key lag least-scope mapping-out margin markers
max-lag max-speed name namespace number only origin out outside parameter picture port processes range rate repeats
report rounds save scope search seconds seed set setpoint signal size slope smallest sonar speed speeds start step
tables tension tension-unit to topic track twins vary wait workers
""".split()
BAGS = {"calibrate", "compare", "ensemble", "film", "layback", "replay", "telegrams", "view"}  # they begin with one
WORDS = {"node", "ahc", "bench", "stress", "soak", "validate", "manual", "live"}  # of no files; live starts a node
BESIDES = {  # what a command, or an option of it, wants beside its first argument
    "ahc --board": "--check",
    "ahc --merge": "--board=board.csv",
    "ahc --page": f"--table --board={PACKAGE.parent / 'docs' / 'ahc-1.csv'}",
    "clear": "--profile=x.csv",
    "calibrate": "--scene=full_scale --free=cable.normal_drag",
    "ensemble --file": "--scene=full_scale",
    "export": "--out=x.csv",
    "film": "--out=x.mp4",
    "fmu": "--out=x.fmu",
    "import": "--out=x",
    "layback": "--scene=full_scale",
    "report": "--out=x.html",
    "table": "--scope=1:2:2",
    "telegrams": "--out=x --format=tss1",
    "tows": "--scene=bongo --map=nes_lter",
}
UNREACHED = {  # no run; no files; no vehicle
    *("film --scene", "layback --scene", "telegrams --scene", "view --scene", "play", "plan --vehicle", "run --vehicle")
}


def commands():
    context = click.Context(main)
    return {name: main.get_command(context, name) for name in main.list_commands(context)}


def lines(pipe, bag):
    """What of a command is meant, and a command line with a pipe there; bag: stands where another bag is named."""
    for name, command in commands().items():
        given = [one for one in command.params if isinstance(one, click.Argument)]
        besides = BESIDES.get(name, "").split()
        if given and name not in WORDS:
            yield name, [name, *[pipe] * len(given), *besides]
        for one in command.params:
            option = one.opts[0].removeprefix("--")
            if isinstance(one, click.Option) and option in READS and not (one.is_flag or isinstance(one.type, Number)):
                first = [bag if name in BAGS else "flume"] * (0 if name in WORDS else len(given))
                what = f"{name} --{option}"
                more = [*besides, *BESIDES.get(what, "").split()]
                given_to = f"{pipe}:make" if option == "controller" else pipe
                yield what, [name, *first, *more, f"--{option}={given_to}"]


def test_every_option_is_known_to_name_a_file_or_not():
    named = {
        one.opts[0].removeprefix("--")
        for command in commands().values()
        for one in command.params
        if isinstance(one, click.Option) and not one.is_flag
    }
    assert not named - {*READS, *OTHERS}


watched: list[str] = []
opened: list[str] = []


def _opens(event, arguments):
    if watched and event in ("open", "sqlite3.connect") and isinstance(arguments[0], str):
        path = arguments[0].removeprefix("file:").partition("?")[0]
        if path.startswith(watched[0]) and os.path.exists(path) and stat.S_ISFIFO(os.stat(path).st_mode):
            opened.append(path)
            raise InterruptedError(f"{path} would be waited for")


@pytest.fixture(scope="module")
def short_bag(tmp_path_factory):
    """The first messages of a shipped bag."""
    path = tmp_path_factory.mktemp("short") / "short"
    with BagWriter(path) as writer:
        for message in islice(BagReader(find_bag("nbp1406")), 2000):
            writer.add(message.topic, message.msgtype, message.time, message.data)
    return str(path)


@pytest.fixture(scope="module")
def pipes(tmp_path_factory):
    """A pipe under names of every kind, and folders that look like bags; whether one is opened is seen."""
    folder = tmp_path_factory.mktemp("pipes")
    for bag in ("bag", "other"):
        (folder / bag).mkdir()
    for name in ("pipe", "a.csv", "a.html", "bag/metadata.yaml", "bag/a.mcap", "other/a.db3"):
        os.mkfifo(folder / name)
    watched[:] = [str(folder)]
    sys.addaudithook(_opens)
    yield folder
    watched.clear()


@pytest.mark.parametrize("name", ["pipe", "a.csv", "bag", "other"])
def test_no_command_waits_for_a_pipe(pipes, short_bag, monkeypatch, name):
    monkeypatch.chdir(pipes)
    for what, line in lines(str(pipes / name), short_bag):
        opened.clear()
        done = CliRunner().invoke(main, line)
        assert not opened, line
        assert done.exit_code in (1, 2), (line, done.output, done.exception)
        assert isinstance(done.exception, SystemExit), (line, done.exception)
        if name == "pipe" and what not in UNREACHED:
            assert "named pipe" in " ".join(done.output.split()), (line, done.output)


@pytest.mark.parametrize("line", ["manual --out=pipe", "run flume --report=a.html"])
def test_nothing_is_written_into_a_pipe(pipes, monkeypatch, line):
    monkeypatch.chdir(pipes)
    done = CliRunner().invoke(main, line.split())
    assert done.exit_code == 2 and not opened


@pytest.mark.parametrize("path, kind", [("pipe", "a named pipe"), ("/dev/zero", "a device"), ("/", "a folder")])
def test_what_is_no_regular_file_is_said(pipes, path, kind):
    for read in (files.open_file, files.read_text, files.read_bytes, files.regular):
        with pytest.raises(OSError, match=kind):
            read(pipes / path)
    for write in (files.write_text, files.write_bytes, lambda path, _: files.open_file(path, "a")):
        with pytest.raises(OSError, match=f"{kind}.*(written|wanted)"):
            write(pipes / path, "")


OWN = {  # module: calls that open what the program made or brought itself, or what came or goes through files.py
    "tools/ahc/simulate.py": 1,
    "files.py": 1,
    "tools/fmu/build.py": 2,
    "tools/fmu/tow.py": 4,
    "io/bags/bag.py": 2,
    "io/bags/bag_writer.py": 2,
    "io/scenes/added_mass_file.py": 1,
    "tools/logs/containers/bag_files.py": 1,
    "tools/logs/containers/bounded.py": 4,
    "tools/logs/containers/netcdf.py": 2,
    "tools/logs/containers/parquet.py": 1,
    "tools/logs/containers/ros_bags.py": 1,
    "compiler/jit.py": 1,
    "compiler/kernel_cache.py": 2,
    "compiler/kernel_key.py": 1,
    "compiler/packaged.py": 5,
    "plots/foxglove_view.py": 1,
    "ros/child.py": 2,
    "ros/node.py": 1,
    "ros/play/live.py": 1,
    "ros/overload.py": 1,
    "runs/problem_manual.py": 1,
    "sim/saved/npz_bytes.py": 2,
    "start.py": 1,
    "tools/sweeps/cases.py": 1,
    "tools/sweeps/store.py": 1,
    "testing/domain.py": 1,
    "testing/tow_sim.py": 1,
}
LIBRARIES = ("ParquetFile", "read_table", "open_dataset", "sqlite3.connect", "fromfile", "loadtxt", "genfromtxt")

METHODS = ("read_text", "read_bytes", "write_text", "write_bytes")
OPENING = ("open", *METHODS, *LIBRARIES)
ENDINGS = tuple(name.rpartition(".")[2] for name in OPENING)  # to unparse every call takes seconds


def readers(text):
    """Lines of calls that open a file by another way than files.py; /proc and /sys hold no user's file."""
    if not re.search(rf"(?:{'|'.join(ENDINGS)})\s*\(", text):
        return
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        if not getattr(node.func, "attr", getattr(node.func, "id", "")).endswith(ENDINGS):
            continue
        called = ast.unparse(node.func)
        if not called.endswith(OPENING):
            continue
        what = ast.unparse(node)
        method = called.rpartition(".")[2] if "." in called else ""
        if "/proc" in what or "/sys" in what or called == "os.open":
            continue
        if method in METHODS or "open" in (called, method):
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
    "line",
    [
        "open(p)",
        "open(p, 'w')",
        "p.write_text(t)",
        "p.open('rb')",
        "Path(p).read_text()",
        "sqlite3.connect(p)",
        "pq.read_table(p)",
    ],
)
def test_another_way_is_seen(line):
    assert list(readers(line)) == [1] and not list(readers("open_file(p, 'w'); write_text(p, t); read_text(p)"))
