"""`cable-sim compare` as a CI uses it: a change fails, none passes; what an import assumed and lost is said."""

import json
import re
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.runs import offline
from cable_sim_ros.tools.compare.recordings import read_recording

DOCS = Path(__file__).resolve().parents[3] / "docs"
DRAG = 1.05  # of every section
SECONDS = 55.0  # a coherence needs four segments of 20 s that overlap by half
HEAVE = 0.5, 8.0  # m, s


def cable_sim(*words, code=0):
    result = CliRunner().invoke(commands.main, [str(word) for word in words])
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Runs `kept`, `now`, its bytes again, and `drag`, of one that differs; the limits of the page."""
    place = tmp_path_factory.mktemp("ci")
    limits = re.search(
        r"```yaml\n(limits: full_scale regression\n.*?)```", (DOCS / "compare.md").read_text("utf-8"), re.S
    )
    (place / "limits.yaml").write_text(limits[1], "utf-8")
    scene = load_scene("full_scale")
    more = {f"cable.sections.{name}.drag_amplification": DRAG * 2.37 for name in ("bare", "faired")}
    for name, tow in (("kept", scene), ("drag", override(scene, more))):
        offline.run(tow, heave=HEAVE, duration=SECONDS, every=0.05, out=place / name)
    copytree(place / "kept", place / "now")
    return place


def compared(folder, other, code):
    """JSON, JUnit and standard error of a comparison with `kept`."""
    junitparser = pytest.importorskip("junitparser")
    junit = folder / f"{other}.xml"
    words = ["compare", folder / "kept", folder / other, "--limits", folder / "limits.yaml", "--junit", junit, "--json"]
    result = cable_sim(*words, code=code)
    return json.loads(result.stdout), junitparser.JUnitXml.fromfile(str(junit)), result.stderr


def test_a_run_that_did_not_change_passes(folder):
    report, junit, said = compared(folder, "now", 0)
    assert report["exact"]["same"] and report["exact"]["common"] == 1100 and said == ""
    assert report["verdict"]["state"] == "ok" and all(one["passed"] for one in report["judged"])
    assert (junit.tests, junit.failures) == (len(report["judged"]), 0) and junit.tests == 7


def test_five_per_cent_more_drag_fails(folder):
    report, junit, said = compared(folder, "drag", 1)
    missed = {f"{one['quantity']}.{one['limit']}": one["value"] for one in report["judged"] if not one["passed"]}
    assert missed["tension.bias"] > 50.0 and missed["body_depth.bias"] < -3.0, (
        "a body that is dragged more is shallower"
    )
    assert junit.failures == len(missed) and junit.tests == 7
    failed = {case.name: case.result[0].message for suite in junit for case in suite if case.result}
    assert failed.keys() == missed.keys() and "allowed: at most 10 N" in failed["tension.bias"]
    assert "verdict: failed: limits are violated" in said and said.count("\n") == 1 + len(missed)


def test_in_words_it_says_which_and_by_how_much(folder):
    text = cable_sim("compare", folder / "kept", folder / "drag", "--limits", folder / "limits.yaml", code=1).output
    assert "fields differ, first at 0 s" in text and "pass: tension.coherence" in text
    assert re.search(r"LIMIT: body_depth\.bias = -[\d.]+ m.*; allowed: at most 0\.1 m", text)


def test_files_that_are_not_there_or_no_limits_end_with_2(folder):
    for words, told in (
        ((folder / "none", folder / "now"), "none"),
        ((folder / "kept", folder / "now", "--limits", folder / "none.yaml"), "No such file"),
        ((folder / "kept", folder / "now", "--from", "500"), "nothing could be scored"),
        ((folder / "kept", folder / "limits.yaml"), "limits.yaml"),
    ):
        output = cable_sim("compare", *words, code=2).output
        assert told in output and "Traceback" not in output and output.count("\n") == 1, output


MAPPING = """\
mapping: winch of the test
signals:
  tension: {source: table, field: load, unit: kgf}
"""


@pytest.fixture(scope="module")
def imported(folder):
    """The load of `kept` as a CSV in kgf, with two lines that are no numbers, made a bag."""
    (tension,) = [one for one in read_recording(folder / "kept").signals if one.quantity == "tension"]
    rows = [
        f"{stamp * 1e-9:.9f},{load / 9.80665:.6f}"
        for stamp, load in zip(tension.time[::2], tension.value[::2], strict=True)
    ]
    rows[100], rows[200] = "xx,yy", "1,2,3,4"
    (folder / "winch.csv").write_text("\n".join(["time,load", *rows]) + "\n", "utf-8")
    (folder / "winch.yaml").write_text(MAPPING, "utf-8")
    cable_sim("import", folder / "winch.csv", "--mapping", folder / "winch.yaml", "--out", folder / "winch")
    return folder / "winch"


def test_what_an_import_assumed_and_lost_is_said(folder, imported):
    for a, more in ((imported, ()), (folder / "winch.csv", ("--mapping", folder / "winch.yaml"))):
        result = cable_sim("compare", a, folder / "kept", "--json", "--junit", folder / "notes.xml", *more)
        report = json.loads(result.stdout)
        assert (report["recordings"]["a"]["records"], report["recordings"]["a"]["lost"]) == (548, 2)
        assert report["recordings"]["b"] == {"records": None, "lost": None, "damage": "", "notes": []}
        assert report["verdict"]["state"] == "ok" and report["scores"][0]["figures"]["gain"] == pytest.approx(1.0, 1e-3)
        notes = "\n".join(report["verdict"]["notes"])
        assert "row without a time, first at" in notes and "line 102" in notes and "line 202" in notes
        if a == imported:
            assert notes.startswith("A: imported: ship motion: not in the log")
        assert notes in (folder / "notes.xml").read_text("utf-8")
        assert cable_sim("compare", a, folder / "kept", *more).output.count("  note: A") == len(notes.split("\n"))


def test_a_log_that_lost_much_is_damaged(folder):
    rows = (folder / "winch.csv").read_text("utf-8").split("\n")
    bad = [f"{row},9" if 10 <= k < 30 else row for k, row in enumerate(rows)]
    (folder / "bad.csv").write_text("\n".join(bad), "utf-8")
    mapping = ("--mapping", folder / "winch.yaml")
    cable_sim("import", folder / "bad.csv", *mapping, "--out", folder / "bad")
    for a, more in ((folder / "bad", ()), (folder / "bad.csv", mapping)):
        result = cable_sim("compare", a, folder / "kept", "--json", *more, code=3)
        assert "DAMAGE: A: " in result.stderr and "22 records could not be read beside 528" in result.stderr


def test_a_run_under_an_imported_motion_says_what_that_assumed(folder):
    time = np.arange(0.0, 12.0, 0.1)
    rows = [f"{t:.1f},{0.3 * np.sin(t):.6f}" for t in time]
    (folder / "mru.csv").write_text("\n".join(["time,heave", *rows]) + "\n", "utf-8")
    (folder / "mru.yaml").write_text(
        "mapping: mru of the test\nsignals:\n  heave: {source: table, field: heave, unit: m}\n", "utf-8"
    )
    cable_sim("import", folder / "mru.csv", "--mapping", folder / "mru.yaml", "--out", folder / "mru")
    first = offline.run("flume", folder / "mru", duration=5.0, out=folder / "flume")
    again = offline.replay(first.bag)
    assert first.verdict.notes and again.metrics["imported"] == first.metrics["imported"]
    assert again.run_verdict.notes == first.verdict.notes
    result = cable_sim("compare", folder / "flume", folder / "flume", "--json")
    report = json.loads(result.stdout)
    assert report["recordings"]["a"]["notes"] == list(first.verdict.notes)
    assert report["recordings"]["a"]["records"] == len(time) and report["recordings"]["a"]["lost"] == 0
