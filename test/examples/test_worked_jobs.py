"""The worked jobs, docs/job_*.md: every command runs as it stands and prints what the page shows, pictures are made."""

import os
import re
import shlex
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from click.testing import CliRunner
from test_scripts import NUMBER, same

from cable_sim_ros.cli import commands

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs").glob("job_*.md"))
COMMAND = re.compile(r"cable-sim (?:[^\n]*\\\n)*[^\n]*\n|(?:(?!cable-sim )[^\n]*\n)+")  # ours, or what the shell gets
LONGEST = 400  # words of a page
LARGEST = 80_000  # bytes of a picture
DOUBTFUL = 4  # exit code


def page_of(path):
    """Text of a page, its commands with the lines it shows of what they print, both in the order of the page."""
    text = path.read_text("utf-8")
    blocks = re.findall(r"```(sh|text)\n(.*?)```", text, re.S)
    assert [language for language, _ in blocks[:2]] == ["sh", "text"]
    return text, blocks


def output(command):
    """What a command prints: ours in this process, others by the shell."""
    if not command.startswith("cable-sim "):
        found = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
        ran = subprocess.run(["bash", "-euc", command], capture_output=True, text=True, env=found)
        assert ran.returncode == 0, f"{command}{ran.stdout}{ran.stderr}"
        return ran.stdout
    words = shlex.split(command.replace("\\\n", " "))[1:]
    ran = CliRunner().invoke(commands.main, words, catch_exceptions=False)
    assert ran.exit_code == DOUBTFUL * ("verdict: doubtful" in ran.output), f"{command}{ran.output}{ran.stderr}"
    return ran.output


def find(line, lines):
    """Leave in lines what follows the line that is meant."""
    for other in lines:
        if NUMBER.sub("#", line).split() == NUMBER.sub("#", other).split():
            return same(other, line)
    raise AssertionError(f"not printed, or not in this order: {line}")


def rounded(number, shown):
    """Is a number of the text one of those shown, or its rounding?"""
    digit = 10.0 ** -len(number.partition(".")[2])
    return any(abs(abs(float(number)) - abs(float(other))) <= 0.51 * digit for other in shown)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Folder to work in with what a checkout has."""
    for name in ("bags", "config", "docs", "test"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # main() replaces it
    return tmp_path


@pytest.mark.check
def test_there_are_five():
    assert len(PAGES) == 5


@pytest.mark.check
@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_a_page_has_its_parts(path):
    text, blocks = page_of(path)
    assert len(text.split()) <= LONGEST
    for part in ("**Question.**", "**Answer.**", "**What it cannot tell.**"):
        assert text.count(part) == 1, part
    (picture,) = re.findall(r"!\[[^\]]+\]\((\w+\.png)\)", text)
    assert (path.parent / picture).stat().st_size <= LARGEST
    answer = text.partition("**Answer.**")[2].partition("\n\n")[0]
    shown = NUMBER.findall(" ".join(block for _, block in blocks))
    told = [number for number in NUMBER.findall(re.sub(r"\]\([^)]*\)|`[^`]*`", "", answer)) if "." in number]
    assert told and all(rounded(number, shown) for number in told), told


@pytest.mark.nightly
@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_its_commands_print_what_it_shows(path, folder):
    if path.stem == "job_controller":
        pytest.importorskip("rclpy")
    text, blocks = page_of(path)
    lines = iter(())
    for language, block in blocks:
        if language == "sh":
            lines = iter("".join(output(command[0]) for command in COMMAND.finditer(block)).splitlines())
        else:
            for line in block.splitlines():
                find(line, lines)
    pictures = re.findall(r"`(runs/[\w/]+\.png)`", text)
    assert pictures and all((folder / name).stat().st_size > 10_000 for name in pictures)
