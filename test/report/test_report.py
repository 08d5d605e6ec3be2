"""The report of a run: what it says is what the run says, it is whole by itself, and it is the same every time."""

import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.scenes.load import load_scene, scene_from_dict
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.plots.run import thinned
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.metrics import METRICS
from cable_sim_ros.runs.summary import SUMMARY, Run, format_value
from cable_sim_ros.sim.verdict import check, verdict_of
from cable_sim_ros.tools.plan.plan import plan_of
from cable_sim_ros.tools.report.simulated import keys
from cable_sim_ros.tools.report.subject import number, shortened, typed
from cable_sim_ros.tools.report.verdict import LONG, cut
from cable_sim_ros.tools.report.write import ReportError, check_place, write_report

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")
EVIL = '<script>alert("x")</script> & $x'
WALL_CLOCK = {"realtime_factor", "missed_ticks", "latency_p50_ms", "latency_p99_ms", "jitter_p99_ms"}


class Page(HTMLParser):
    """Text of an element with a data-name, text of all, and tags that were left open."""

    ALONE = {"meta", "wbr", "br"}

    def __init__(self, text):
        super().__init__()
        self.named, self.text, self.open, self.sections, self._name = {}, "", [], [], None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        if tag not in self.ALONE:
            self.open.append(tag)
        if tag == "section":
            self.sections.append(found["id"])
        if "data-name" in found:
            self._name = found["data-name"]
            self.named.setdefault(self._name, []).append([])
        if tag in ("th", "td", "strong") and self._name:
            self.named[self._name][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes nothing"
        if tag in ("tr", "li"):
            self._name = None

    def handle_data(self, data):
        self.text += data
        if self._name and self.named[self._name][-1]:
            self.named[self._name][-1][-1] += data


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("report")


@pytest.fixture(scope="module")
def run(folder):
    """Instruments, rules and waves on; a name that no page may take for markup."""
    scene = load_scene("flume").model_dump(mode="json")
    scene["name"] = EVIL
    scene["instruments"]["encoder"].update(on=True, resolution=1e-3)
    scene["rules"].update(set="unols_20hz", factor_of_safety=5.0, slack_tension=1.0)
    scene["cable"]["breaking_load"] = 50.0
    return offline.run(
        scene_from_dict(scene, "test"), heave=(0.02, 2.0), duration=44.0, step="chosen", every=0.05, out=folder / "run"
    )


@pytest.fixture(scope="module")
def report(run, folder):
    return written(run, folder / "a.html", folder)


def written(run, path, folder):
    plan = plan_of(run.frames, run.scene, run.metrics)
    scores = [{"quantity": "tension <i>", "unit": "N", "bias": 1.25, "passed": True, "lag": {"s": 0.5, "low": None}}]
    words = ["run", str(folder / "my_scene.yaml"), "--out", str(folder), "--report=x.html", "--winch", "0 hold"]
    return write_report(run, path, command=words, plan=plan, scores=scores).read_text("utf-8")


@pytest.fixture(scope="module")
def page(report):
    found = Page(report)
    assert not found.open
    return found


def test_the_verdict_stands_first_in_one_sentence(run, page):
    state = run.verdict.state
    first = page.text[page.text.index(f"{state}: The simulation") :].split("\n")[0]
    assert first.startswith(f"{state}: The simulation came to its end") and first.endswith(".")
    assert page.text.index(first) < page.text.index("What was simulated")
    for reason in run.verdict.reasons:
        assert reason.flag in page.text and reason.text in page.text
    assert "rules on watch were broken" in page.text or "rules on watch was broken" in page.text


def test_every_figure_is_that_of_the_json(run, page):
    shown = {name: cells for name, rows in page.named.items() for cells in rows if len(cells) == 4 and cells[3] == name}
    wanted = {name for name, *_ in (*SUMMARY, *METRICS[:2]) if run.metrics.get(name) is not None}
    assert set(shown) == wanted - WALL_CLOCK and len(shown) > 40
    for name, cells in shown.items():
        assert cells[1] == format_value(run.metrics[name]), name
    cards = {name: rows[0][0] for name, rows in page.named.items() if len(rows[0]) == 1}
    assert len(cards) == 8
    needs = {row["need"]: row["needed"] for row in plan_of(run.frames, run.scene, run.metrics)["plan"]}
    for name, text in cards.items():
        assert text.split()[0] == number(needs[name] if name in needs else run.metrics[name], 4), name


def test_the_sections_are_there(run, page):
    wanted = "verdict simulated inputs scores series spectra contact instruments rules plan health energy figures"
    assert page.sections == [*wanted.split(), "glossary"]
    for row in run.metrics["rules"]["rules"]:
        assert row["rule"] in page.text
    for row in plan_of(run.frames, run.scene, run.metrics)["plan"]:
        assert page.named[row["need"]][-1][1] == number(row["needed"])
    assert page.named["lag.s"][0] == ["lag.s", "0.5"] and page.named["lag.low"][0] == ["lag.low", "-"]
    assert f"{len(run.frames)}, one each 0.05 s" in page.text and "instruments.seed 1" in page.text


def test_nothing_of_a_user_is_markup_and_nothing_comes_from_outside(report, page, folder):
    assert EVIL in page.text and "tension <i>" in page.text
    assert "<script" not in report and "<i>" not in report
    assert not re.search(r"https?:|//|@import|<link|<iframe|<img", re.sub(r"data:image/png;base64,[^\"]*", "", report))
    assert str(folder) not in report and 'cable-sim run my_scene.yaml --winch "0 hold"' in page.text


def test_the_drawings_are_xml_with_ids_of_their_own(report):
    drawings = re.findall(r"<svg.*?</svg>", report, re.DOTALL)
    assert len(drawings) == 6
    ids = []
    for text in drawings:
        root = ElementTree.fromstring(text)
        own = [one.get("id") for one in root.iter() if one.get("id")]
        ids += own
        used = re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', text)
        assert {a or b for a, b in used} == set(own)
        assert any("time" in (one.text or "") or "[" in (one.text or "") for one in root.iter("text"))
    assert len(ids) == len(set(ids))


def test_the_same_run_gives_the_same_bytes(run, report, folder):
    assert written(run, folder / "b.html", folder) == report and len(report) < 1_000_000


def test_a_recording_and_the_command_give_a_report(run, folder):
    made = folder / "of_bag.html"
    result = CliRunner().invoke(commands.main, ["report", str(run.bag), "--out", str(made)])
    assert result.exit_code == run.verdict.code, result.output
    found = Page(made.read_text("utf-8"))
    assert found.named["tension_max_n"][-1][1] == format_value(run.metrics["tension_max_n"])
    assert "cable-sim report tow" in found.text


def test_a_replay_has_its_residuals(run, folder):
    made = folder / "replay.html"
    result = CliRunner().invoke(commands.main, ["replay", str(run.bag), "--report", str(made), "--json"])
    metrics = json.loads(result.stdout)
    assert result.exit_code == 0 and metrics["residuals"]
    found = Page(made.read_text("utf-8"))
    assert "The replay is the recorded run" in found.text and "The run itself, simulated again:" in found.text
    for row in metrics["residuals"]:
        assert row["quantity"] in found.text and str(row["count"]) in found.text


def test_a_failed_run_has_its_report_with_the_reason(run, folder):
    """Ended in the middle, and without any tick."""
    why = "the solver gave up after 1.20 s: <b>the tick could not be solved"
    for name, frames, metrics in (("half", run.frames, run.metrics), ("none", np.recarray(0, TICK_OUTPUT), {})):
        failed = Run(frames, dict(metrics), why, scene=run.scene, verdict=verdict_of([check("HALTED", why)]))
        found = Page(write_report(failed, folder / f"{name}.html").read_text("utf-8"))
        assert "failed: The simulation did not come to its end" in found.text and found.text.count(why) == 2
        assert ("end" in found.sections) == (name == "half")


def test_a_start_that_fails_has_its_report(tmp_path):
    made = tmp_path / "failed.html"
    asked = ["run", "flume", "--motion", "none", "--set", "towbody.net_weight=-1e3", "--report", str(made)]
    result = CliRunner().invoke(commands.main, asked)
    assert result.exit_code == 1, result.output
    found = Page(made.read_text("utf-8"))
    assert "failed: The simulation did not come to its end" in found.text and "flume" in found.text


@pytest.mark.parametrize(
    "place, why", [("x.txt", "no HTML file"), ("folder.html", "Is a directory"), ("f/x.html", "File exists")]
)
def test_a_place_that_is_none_is_refused_before_anything_runs(tmp_path, place, why):
    (tmp_path / "folder.html").mkdir()
    (tmp_path / "f").write_text("")
    with pytest.raises(ReportError, match=why):
        check_place(tmp_path / place)
    result = CliRunner().invoke(commands.main, ["run", "full_scale", "--report", str(tmp_path / place)])
    assert result.exit_code == 2 and result.output.count("\n") == 1 and "nothing was run" in result.output


def test_a_missing_extra_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    result = CliRunner().invoke(commands.main, ["run", "full_scale", "--report", str(tmp_path / "a.html")])
    assert result.exit_code == 2 and result.output.count("\n") == 1
    assert "jinja2 is not installed" in result.output and "pip install 'cable_sim_ros[report]'" in result.output


def test_long_series_keep_their_peaks():
    time = np.arange(360_000) * 0.01
    values = np.sin(time)
    values[123_456], values[200_001], values[7] = 9.0, -9.0, np.nan
    at, kept = thinned(time, values)
    assert len(at) <= 2002 and kept.max() == 9.0 and kept.min() == -9.0 and np.isfinite(kept).all()
    assert at[int(kept.argmax())] == time[123_456] and (np.diff(at) > 0).all() and at[-1] == time[-1]
    assert thinned(time[:4000], values[:4000])[1] is not None and len(thinned(time[:4000], values[:4000])[0]) == 4000


def test_what_differs_from_the_defaults_is_told():
    scene = load_scene("flume")
    rows = {row[0]: row for row in keys(scene).rows}
    assert rows["accuracy.position"][1] == "0.001" and "cable.sections.line.drag_amplification" in rows
    assert rows["towbody.mass"][3] == "required" and "solver.tick" not in rows and "name" not in rows


def test_words_of_a_command_line_are_without_folders(tmp_path):
    assert typed(["run", "--out", "a", "--motion=/data/x/bag", "--set", "water.density=1000"]) == (
        "run --motion=bag --set water.density=1000"
    )
    assert shortened("simple:length=60,beam=12") == "simple:length=60,beam=12"
    text = "a" * LONG + ": more"
    assert cut(text) == "a" * LONG and cut("short: and more. Then") == "short: and more"
