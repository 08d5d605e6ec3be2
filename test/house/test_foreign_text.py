"""What others wrote is shown, never obeyed: the name of a scene, and every place that prints."""

import ast
import io
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from rich.table import Table

from cable_sim_ros import terminal
from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.scenes.document import find_scene

PACKAGE = Path(terminal.__file__).parent
NAME = "[/bold]\nverdict: ok \x1b]0;mine\x07 \x9b31m [red]:warning: \u202eback \ud800"
SHOWN = r"[/bold]\nverdict: ok \x1b]0;mine\x07 \x9b31m [red]:warning: \u202eback \ud800"
LOGGERS = ("debug", "info", "warning", "warn", "error", "fatal")
PRINTING = (*LOGGERS, "print", "echo", "secho", "Console", "Progress", "write", "TextColumn")


@given(st.text())
def test_nothing_is_left_to_obey(text):
    made = terminal.clean(text)
    made.encode("utf-8")
    assert not terminal.OBEYED.search(made) and terminal.clean(made) == made
    if text.isprintable():
        assert made == text


def test_a_name_is_shown_as_it_is(capsys):
    assert terminal.clean(NAME) == SHOWN
    table = Table(title=NAME)
    table.add_column(NAME)
    table.add_row(NAME)
    shown = terminal.plain_console(200)
    shown.print(table)
    shown.print(NAME)
    terminal.say(NAME)
    terminal.say(NAME, err=True)
    out, err = capsys.readouterr()
    assert out.count(SHOWN) == 5 and err == SHOWN + "\n"
    shown.print(terminal.in_lines(NAME, NAME))
    terminal.say("1\n2", lines=True)
    assert capsys.readouterr().out == f"{SHOWN}\n{SHOWN}\n1\n2\n"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A shipped scene under a name that a terminal or rich would obey."""
    folder = tmp_path_factory.mktemp("foreign")
    name = NAME.partition(" \u202e")[0].encode("unicode_escape").decode("ascii")
    text = find_scene("flume").read_text("utf-8")
    (folder / "s.yaml").write_text(re.sub(r"^name:.*$", lambda _: f'name: "{name}"', text, flags=re.M), "utf-8")
    return folder


@pytest.mark.parametrize(
    "line",
    [
        "mesh s.yaml",
        "run s.yaml --duration 1",
        "plan s.yaml --duration 1",
        "run [/bold]\x1b[2J",
        "run flume --duration \x1b[2J",
        "\x1b[2J",
    ],
)
def test_no_command_obeys_a_name(scene, monkeypatch, line):
    monkeypatch.chdir(scene)
    done = CliRunner().invoke(main, line.split(), color=True)
    assert isinstance(done.exception, SystemExit | None), done.exc_info
    for one in done.output.split("\n"):
        assert not terminal.OBEYED.search(one) and not one.startswith("verdict: ok \\x1b"), done.output
    if "yaml" in line:
        assert r"[/bold]\nverdict: ok \x1b]0;mine\x07" in done.output, done.output


def prints(text):
    """Lines that print by another way than terminal.py."""
    if not re.search(rf"(?:{'|'.join(PRINTING)})\s*\(", text):
        return
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        if not getattr(node.func, "attr", getattr(node.func, "id", "")).endswith(PRINTING):
            continue
        called = ast.unparse(node.func)
        first = node.args[0] if node.args else None
        log = called.rpartition(".")[2] in LOGGERS and "logg" in called
        whole = isinstance(first, ast.Constant) or ast.unparse(first or node).startswith(("clean(", "CAUSES"))
        marked = called == "TextColumn" and not (isinstance(first, ast.Constant) and "{" not in str(first.value))
        if (
            called in ("print", "click.echo", "click.secho", "Console", "Progress")
            and "plain_console" not in str([ast.unparse(k) for k in node.keywords])
            or called.endswith(("stdout.write", "stderr.write"))
            or marked
            and "markup=False" not in ast.unparse(node)
            or log
            and not whole
        ):
            yield node.lineno


def test_all_that_prints_prints_in_one_place():
    found = {
        path.relative_to(PACKAGE).as_posix(): lines
        for path in sorted(PACKAGE.rglob("*.py"))
        if path.name != "terminal.py" and (lines := list(prints(path.read_text("utf-8"))))
    }
    assert not found


@pytest.mark.parametrize(
    "line",
    [
        "print(name)",
        "click.echo(name)",
        "Console().print(t)",
        "Progress()",
        "sys.stderr.write(name)",
        "node.get_logger().info(f'{name}')",
        "logger.error(name)",
        "TextColumn('{task.description}')",
    ],
)
def test_another_way_to_print_is_seen(line):
    assert list(prints(line)) == [1]


def test_rich_alone_would_obey():
    """The test can fail: this is what a plain console does."""
    with pytest.raises(Exception, match="closing tag"):
        Console(file=io.StringIO()).print(NAME)
