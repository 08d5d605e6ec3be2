"""The scripts of docs/examples.md: every command prints what the page says, and the code is that of the file."""

import importlib.util
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "examples"
PAGE = (ROOT / "docs" / "examples.md").read_text("utf-8")
NAMES = sorted(path.stem for path in FOLDER.glob("*.py"))
SECTIONS = {name: part for name, part in re.findall(r'<a id="(\w+)"></a>\n(.*?)(?=\n<a id=|\Z)', PAGE, re.S)}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
WITHIN = 0.02  # of a number, and a unit of its last digit: other processors round otherwise


def script(name):
    """The module of a script."""
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def block(name, language):
    """The blocks of a language in the section of a script."""
    return re.findall(rf"```{language}\n(.*?)```", SECTIONS[name], re.S)


def printed(name, words, capsys):
    """What a script prints."""
    script(name).main(words)
    return capsys.readouterr().out


def same(ours, theirs):
    """The same words, and numbers that differ by rounding."""
    assert NUMBER.sub("#", ours).split() == NUMBER.sub("#", theirs).split()
    for mine, other in zip(NUMBER.findall(ours), NUMBER.findall(theirs)):
        digit = 10.0 ** -len(other.partition(".")[2])
        assert float(mine) == pytest.approx(float(other), rel=WITHIN, abs=1.01 * digit), f"\n{ours}\n{theirs}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the commands of the page run, one after the other."""
    return tmp_path_factory.mktemp("examples")


def test_every_script_has_its_section_and_its_row():
    assert sorted(SECTIONS) == NAMES and len(NAMES) == 4
    assert re.findall(r"^\| \[(\w+)\.py\]\(#\1\) \|", PAGE, re.M) == list(SECTIONS)


@pytest.mark.parametrize("name", NAMES)
def test_the_code_of_the_page_is_that_of_the_file(name):
    shown = block(name, "python")
    assert shown and f"`docs/examples/{name}.py`" in SECTIONS[name]
    for code in shown:
        assert code in (FOLDER / f"{name}.py").read_text("utf-8")


@pytest.mark.parametrize("name", list(SECTIONS))  # in the order of the page: the last reads what another recorded
def test_the_command_prints_what_the_page_says(name, folder, monkeypatch, capsys):
    (command,), (output,) = block(name, "sh"), block(name, "text")
    python, path, *words = shlex.split(command)
    assert (python, path) == ("python3", f"docs/examples/{name}.py")
    monkeypatch.chdir(folder)
    same(printed(name, words, capsys), output)


def test_numbers_and_words_of_another_output_are_told_apart():
    same("depth 1.00 m", "depth 1.01 m")
    for other in ("depth 1.05 m", "depth 1.00 km", "depth 1.00 m 2"):
        with pytest.raises(AssertionError):
            same("depth 1.00 m", other)


def test_a_table_of_ones_own_is_run(tmp_path, capsys):
    module = script("own_motion")
    columns = module.arrays(4.0)
    module.write(tmp_path / "mine.csv", columns | {"heave_m": 0.5 * columns["heave_m"]})
    theirs = printed("own_motion", [str(tmp_path / "mine.csv"), "--duration", "3"], capsys)
    heave = 0.5 * columns["heave_m"]
    minimum, largest = (float(text) for text in re.findall(r"heave (\S+) to (\S+) m", theirs)[0])
    assert (minimum, largest) == pytest.approx((heave.min(), heave.max()), abs=0.006)


def test_a_recording_becomes_a_table_and_a_picture(folder, capsys):
    if not (folder / "runs" / "control").exists():
        script("own_controller").main(["--duration", "1", "--skip", "0", "--out", str(folder / "runs" / "control")])
    words = [str(folder / "runs" / "control" / "tow"), "--csv", str(folder / "a.csv")]
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        printed("read_recording", words, capsys)
    else:
        printed("read_recording", [*words, "--plot", str(folder / "a.png")], capsys)
        assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")
    table = np.genfromtxt(folder / "a.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "depth_m", "tension_N", "payout_m", "scope_m", "layback_m")
    assert np.isfinite(table["tension_N"]).all() and len(table) >= 20
