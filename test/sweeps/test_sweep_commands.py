"""`sweep`, `envelope`, `sensitivity`, `table` as typed: what they print, what they leave, how they end."""

import json
import re
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import count
from pathlib import Path

import pytest
from calling import cable_sim

from cable_sim_ros.tools.sweeps import clusters, engine
from cable_sim_ros.tools.sweeps import sweep as sweeps
from cable_sim_ros.tools.sweeps.table import TableError, speeds_of

command = partial(cable_sim, code=0)
PAGE = (Path(__file__).resolve().parents[2] / "docs" / "json.md").read_text("utf-8")
SWEEP = """
sweep: a flume
scene: flume
duration: 0.3
settings: {water.turbulence.deviation: [0.01, 0.01, 0.01]}
seeds: 2
grid: {winch.scope: [0.9, 1.0]}
"""
RANGES = """
sweep: what decides
scene: flume
duration: 0.3
samples:
  method: sobol
  count: 16
  ranges:
    towbody.mass: {low: 0.001, high: 0.0012}
    water.density: {low: 990.0, high: 1030.0}
figures: [tension_mean_n, body_depth_m]
"""


def undocumented(section, keys):
    """Keys of a JSON that neither its section of the page has nor those that it refers to."""
    names = {"sweep": ["sweep"], "envelope": ["envelope", "sweep"], "sensitivity": ["sensitivity", "envelope", "sweep"]}
    parts = [PAGE.partition(f'<a id="{name}"></a>')[2].partition("<a id=")[0] for name in names.get(section, [section])]
    return {key for key in keys if not any(f"`{key}`" in part for part in parts)}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("commands")
    (folder / "a.yaml").write_text(SWEEP)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clusters, "processes", ThreadPoolExecutor)
        told = json.loads(command("sweep", folder / "a.yaml", "--out", folder, "--workers", 1, "--json", code=4).stdout)
    return folder, told


def test_a_sweep_says_what_it_did(swept):
    folder, told = swept
    assert told["cases"] == told["computed"] == 4
    assert told["verdicts"] == {"doubtful": 4} and told["exit_code"] == 4, "too short to say anything"
    assert json.loads((folder / "sweep.json").read_text()) == told and not undocumented("sweep", told)
    assert len((folder / "sweep.csv").read_text().splitlines()) >= 5
    assert command("sweep", folder / "a.yaml", "--out", folder, "--dry-run").stdout == "4 cases, 0 of them new\n"


def test_an_envelope_of_rows_that_are_there_simulates_nothing(swept):
    folder, _ = swept
    report = folder / "a.html"
    given = "envelope", folder / "a.yaml", "--out", folder, "--workers", 1
    told = json.loads(command(*given, "--report", report, "--json", code=4).stdout)
    assert told["verdicts"] == {"doubtful": 4} and sum(told["reasons"].values()) == 4
    shown = command(*given, code=4)
    assert "2 doubtful" in shown.stdout and f"doubtful 4 x: {next(iter(told['reasons']))}" in shown.stderr
    assert told["computed"] == 0 and [cell["varied"] for cell in told["cells"]] == [
        {"winch.scope": 0.9},
        {"winch.scope": 1.0},
    ]
    for cell in told["cells"]:
        tension = cell["extremes"]["tension_max_n"]
        assert cell["runs"] == 2 and tension["low"] <= tension["mean"] <= tension["worst"] + 1e-12
    assert (folder / "envelope.png").stat().st_size > 5000
    text = report.read_text("utf-8")
    assert "envelope; 4 runs" in text and "What was found" in text and "largest tension, mean [N]" in text
    assert "http://" not in text.replace("http://www.w3.org", "")


def test_a_picture_of_many_values_says_which_are_left_out(tmp_path, monkeypatch):
    from cable_sim_ros.tools.sweeps import envelope

    texts = texts_of_pictures(monkeypatch)
    depth = {"body_depth_min_m": envelope.Extreme(9.0, 9.0, 9.0, 9.0, 9.0)}
    values = [(s, h, v) for s in (50, 100) for h in (1.0, 2.0) for v in range(1, 9)]
    cells = [
        envelope.Cell({"winch.scope": s, "water.waves.height": h, "ship.tow_speed": v}, 1, 0, 0, depth, {})
        for s, h, v in values
    ]
    envelope.draw("tow", cells, tmp_path / "a.png")
    assert "tow, the first 6 of 8 values of ship.tow_speed" in [" ".join(text.split()) for text in texts]
    texts.clear()
    envelope.draw("tow", cells[:8], tmp_path / "b.png")
    assert "tow" in texts and not any("the first" in text for text in texts)


@pytest.fixture
def here(monkeypatch):
    """Cases are run in this process."""
    for module in (clusters, sweeps):
        monkeypatch.setattr(module, "processes", ThreadPoolExecutor)


@pytest.fixture
def row(monkeypatch, here):
    """Rows that no simulation makes: change the dict, or give a key a function of the case; no picture is drawn."""
    made = {"tension_max_n": 1.0, "tension_min_n": 0.5, "verdict": "ok", "reasons": "", "error": "", "warnings": ""}
    made |= {"cpu_s": 0.0, "simulated_s": 1.0, "flags": {}, "rule_units": {}}

    def simulated(case):
        return {name: one(case) if callable(one) else one for name, one in made.items()} | {"key": case.key}

    monkeypatch.setattr(engine, "simulate", simulated)
    monkeypatch.setattr(sweeps, "compiled", lambda: None)
    texts_of_pictures(monkeypatch)
    return made


def test_indices_have_their_report_and_doubtful_ones_are_said(tmp_path, row):
    row["tension_mean_n"] = lambda case: 1e3 * case.settings["towbody.mass"] + 1e-4 * case.settings["water.density"]
    row["body_depth_m"] = lambda case: 1e9 if case.number == 3 else float(case.number % 2)
    (tmp_path / "s.yaml").write_text(RANGES.replace("count: 16", "count: 64"))
    given = "sensitivity", tmp_path / "s.yaml", "--out", tmp_path, "--workers", 1
    told = json.loads(command(*given, "--report", tmp_path / "s.html", "--json", code=4).stdout)
    assert told["runs"] == told["computed"] == 256 and json.loads((tmp_path / "sensitivity.json").read_text()) == told
    assert not undocumented("sensitivity", {*told, *told["indices"][0], *told["spread"]["body_depth_m"]})
    assert {one["figure"] for one in told["indices"]} == {"tension_mean_n", "body_depth_m"}
    assert told["doubts"] and all("index of body_depth_m" in text for text in told["doubts"])
    shown = command(*given, code=4)
    assert "256 runs, 0 computed now" in shown.stdout and f"figures:   {tmp_path / 'sensitivity.json'}" in shown.stdout
    assert f"doubtful: {told['doubts'][0]}" in shown.stderr
    page = (tmp_path / "s.html").read_text("utf-8")
    assert "Share of the variance" in page and "Report of a sensitivity" in page
    assert "Why what was found is doubtful" in page and "some of what was found cannot be taken as it is" in page


SEA = """
sweep: what is allowed
scene: side_scan
settings: {water.waves.kind: jonswap, water.waves.period: 7.0}
duration: 1
seeds: SEEDS
grid: {water.waves.height: [1, 2], winch.scope: [50, 99999]}
"""


@pytest.mark.parametrize("seeds, rules", [(4, False), (5, True)])
def test_an_envelope_says_what_it_knows_and_no_more(tmp_path, row, seeds, rules, monkeypatch):
    """Runs of scope 99999 fail; with 2 m waves seed 1 breaks one rule and seed 2 the other."""
    titles = texts_of_pictures(monkeypatch)
    row["tension_max_n"] = lambda case: 100.0 * case.seed
    row["body_depth_min_m"] = row["body_depth_max_m"] = 9.0
    row["warnings"] = lambda case: "waves stand still" if case.seed == 1 else ""
    row["verdict"] = lambda case: "failed" if case.settings["winch.scope"] > 1000 else "ok"
    row["error"] = lambda case: "too long" if case.settings["winch.scope"] > 1000 else ""
    for name, seed in (("slack", 1), ("working_load", 2)) if rules else ():
        row[f"rule.{name}"] = 0.0
        row[f"rule.{name}.broken"] = lambda case, seed=seed: float(
            case.seed == seed and case.settings["water.waves.height"] == 2
        )
    (tmp_path / "e.yaml").write_text(SEA.replace("SEEDS", str(seeds)))
    given = "envelope", tmp_path / "e.yaml", "--out", tmp_path, "--workers", 1
    told = json.loads(command(*given, "--report", tmp_path / "e.html", "--json", code=4).stdout)
    good, none, bad, _ = told["cells"]
    assert not undocumented("envelope", {*told, *good, *good["extremes"]["tension_max_n"]})
    assert good["extremes"]["tension_max_n"]["worst"] == 100.0 * seeds and none["extremes"] == {}
    assert (good["extremes"]["tension_max_n"]["rare"] is None) == (seeds < 5)
    assert none["allowed"] is None and none["rules"] is None
    shown = command(*given, code=4)
    page = " ".join((tmp_path / "e.html").read_text("utf-8").replace("<wbr>", "").split())
    assert "Report of an envelope" in page and "What runs warn of" in page and "waves stand still" in page
    assert "Why runs failed" in page and f"{seeds} failed" in shown.stdout
    assert "largest tension [N]\nmean of the seeds" in titles and "no run came to its end" in titles
    if rules:
        assert (good["allowed"], good["within"], bad["allowed"], bad["within"]) == (True, 5, False, 3)
        assert "slack 1/5" in shown.stdout and "runs within the rules" in titles and "60 %" in titles
        assert "no rules on watch" not in page + shown.stdout and told["notes"] == []
    else:
        assert good["allowed"] is bad["allowed"] is good["within"] is good["rules"] is None
        assert "rules broken" not in page + shown.stdout and "runs within the rules" not in titles
        assert "note: The scene has no rules on watch" in shown.stdout and "The scene has no rules on watch" in page
        assert "What one run in 20 passes is not given from fewer than 5 runs" in shown.stdout


def test_an_envelope_counts_no_run_as_within_a_rule_without_a_reading_and_no_seed_twice(tmp_path, row, monkeypatch):
    """Scope 1.0: the rule was never read; both cells: the seeds do nothing. The name is no formula."""
    titles = texts_of_pictures(monkeypatch)
    row["rule.slack.broken"] = lambda case: float("nan" if case.settings.get("winch.scope") == 1 else 0)
    (tmp_path / "e.yaml").write_text(SWEEP.replace("a flume", '"cost $x_{ and $ done"'))
    given = "envelope", tmp_path / "e.yaml", "--out", tmp_path, "--workers", 1
    shown = command(*given, code=4)
    assert "doubtful: the seeds of 2 of 2 cells gave the same run 2 times (first: winch.scope = 0.9)" in shown.stderr
    assert "Rule slack has no reading in runs of 1 of 2 cells" in shown.stdout and "slack not read" in shown.stdout
    told = json.loads((tmp_path / "envelope.json").read_text())
    read, unread = told["cells"]
    assert (read["allowed"], read["within"], read["rules"]["slack"]["runs"]) == (True, 2, 1)
    assert (unread["allowed"], unread["within"], unread["unread"], unread["rules"]) == (None, None, ["slack"], None)
    assert all(cell["alike"] and cell["extremes"]["tension_max_n"]["low"] is None for cell in told["cells"])
    assert any("x_{ and" in text for text in titles)
    lists = SWEEP.replace("{winch.scope: [0.9, 1.0]}", "{water.turbulence.deviation: [[0.01, 0, 0], [0.02, 0, 0]]}")
    (tmp_path / "e.yaml").write_text(re.sub("settings.*\n", "", lists))
    command(*given, code=4)
    assert "[0.02, 0, 0]" in titles


def test_a_cell_with_a_failed_run_is_not_allowed_though_a_rule_was_not_read():
    from cable_sim_ros.tools.sweeps.envelope import Cell

    cell = Cell({}, 3, 0, 0, {}, {}, 1, ("slack",))
    assert cell.allowed is None and cell._replace(failed=1).allowed is False
    assert cell._replace(unread=(), within=3).allowed is True


@pytest.mark.parametrize(
    "add, why",
    [
        ("samples: {count: 2, ranges: {water.density: {low: 990, high: 1000}}}", "each sample would be a cell of its"),
        ("figures: [tension_mean_n]", "figures keeps no extreme, so every cell would be empty"),
    ],
)
def test_a_sweep_that_makes_no_cells_is_refused(tmp_path, add, why):
    (tmp_path / "e.yaml").write_text(f"{SWEEP}{add}\n")
    assert why in command("envelope", tmp_path / "e.yaml", "--out", tmp_path / "out", code=2).stderr
    assert not (tmp_path / "out").exists()


def test_figures_without_a_number_are_said_and_a_table_has_what_was_set(tmp_path, row):
    row["tension_mean_n"] = lambda case: case.settings["towbody.mass"]
    row["body_depth_m"] = lambda case: float("nan") if case.number == 3 else 1.0 * case.number
    (tmp_path / "s.yaml").write_text(RANGES)
    given = "sensitivity", tmp_path / "s.yaml", "--out", tmp_path, "--workers", 1
    told = json.loads(command(*given, "--json", code=4).stdout)
    assert told["doubts"][0] == "body_depth_m has no number in 1 of 64 runs, so no index. Leave it out"
    (tmp_path / "s.yaml").write_text(RANGES.replace("count: 16", "count: 262144"))
    assert "makes 1048576 runs, more than 1000000" in command(*given, code=2).stderr

    static_tow(row)
    row["tension_mean_n"] = 0.00891
    given = "table", "flume", "--workers", 1, "--scope", "1.0", "--out", tmp_path
    shown = command(*given, "--set", "ship.tow_speed=0.3", "--set", "towbody.mass=0.002")
    assert "flume, towbody.mass = 0.002: tension at the sheave [N]" in shown.stdout and "0.00891" in shown.stdout
    told = json.loads((tmp_path / "table.json").read_text())
    assert told["settings"] == {"towbody.mass": 0.002} and told["rows"][0]["ship.tow_speed"] == 0.3
    assert "replace" in command(*given).stderr, "another tow"
    assert "0.9:1.0:1" in command("table", "flume", "--scope", "0.9:1.0:1", code=2).stderr


def texts_of_pictures(monkeypatch):
    """List that gets every text of the pictures, which are not drawn: those of real runs are."""
    from matplotlib.text import Text

    found = []

    def saved(figure, path):
        found.extend(one.get_text() for one in figure.findobj(Text))

    monkeypatch.setattr("cable_sim_ros.plots.run.save", saved)
    return found


@pytest.mark.parametrize("name", ["envelope", "sensitivity"])
def test_a_figure_that_is_text_is_refused_at_the_start(tmp_path, name):
    text = (SWEEP if name == "envelope" else RANGES.replace("figures: [", "figures: [verdict, ")) + "\n"
    (tmp_path / "x.yaml").write_text(text + ("figures: [verdict]\n" if name == "envelope" else ""))
    result = command(name, tmp_path / "x.yaml", "--out", tmp_path / "out", code=2)
    assert "figures names 'verdict', which is no number" in result.stderr and not (tmp_path / "out").exists()


def test_every_figure_that_is_no_number_is_known(swept):
    """Of a real run: what is asked for and kept in no row would be lost without a word."""
    from cable_sim_ros.runs.offline import run
    from cable_sim_ros.tools.sweeps.figures import FIGURES, NO_NUMBERS

    metrics = run("flume", duration=0.1).metrics
    texts = {n for n in FIGURES if n in metrics and not isinstance(metrics[n], int | float | None)}
    assert texts | {"imu_only"} == {n for n in NO_NUMBERS if n in metrics}


def test_a_dry_run_writes_nothing(tmp_path, row):
    (tmp_path / "a.yaml").write_text(SWEEP)
    given = "sweep", tmp_path / "a.yaml", "--out", tmp_path / "out", "--dry-run"
    assert json.loads(command(*given, "--json").stdout) == {"sweep": "a flume", "cases": 4, "new": 4}
    assert command(*given).stdout == "4 cases, 4 of them new\n" and not (tmp_path / "out").exists()
    rows = tmp_path / "out" / "rows"
    rows.mkdir(parents=True)
    (rows / "part-000000.parquet").write_bytes(b"no such file")
    assert command(*given).stdout == "4 cases, 4 of them new\n"
    assert [path.name for path in rows.iterdir()] == ["part-000000.parquet"]


def test_another_sweep_in_the_folder_is_said_on_the_terminal_and_the_page(tmp_path, row):
    for name in ("one", "other"):
        (tmp_path / f"{name}.yaml").write_text(SWEEP.replace("a flume", name))
    given = "--out", tmp_path / "out", "--workers", 1, "--report", tmp_path / "a.html"
    assert "another sweep" not in command("sweep", tmp_path / "one.yaml", *given).output
    assert "another sweep" not in command("sweep", tmp_path / "one.yaml", *given).output
    said = command("sweep", tmp_path / "other.yaml", *given)
    assert "had the tables of another sweep, 'one': those of 'other' replace them" in said.stderr
    assert "had the tables of another sweep" in (tmp_path / "a.html").read_text("utf-8")
    assert json.loads((tmp_path / "out" / "sweep.json").read_text())["replaced"] == "one"


def test_tables_that_cannot_be_written_say_what_to_do(tmp_path, row, monkeypatch):
    import xarray

    def locked(*_, **__):
        raise BlockingIOError("[Errno 11] Unable to synchronously open file (unable to lock file)")

    monkeypatch.setattr(xarray.Dataset, "to_netcdf", locked)
    (tmp_path / "a.yaml").write_text(SWEEP)
    told = command("sweep", tmp_path / "a.yaml", "--out", tmp_path / "out", "--workers", 1, code=2).stderr
    assert "Another sweep may be writing there" in told and "synchronously" not in told
    assert command("sweep", tmp_path / "a.yaml", "--out", tmp_path / "out", "--dry-run").stdout.startswith("4 cases, 0")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["rows"]


@pytest.mark.parametrize("name", ["sweep", "envelope", "table"])
def test_ctrl_c_says_what_is_kept(tmp_path, row, name):
    numbers = count()

    def interrupted(case):
        if next(numbers) == 1:
            raise KeyboardInterrupt
        return "ok"

    row["verdict"] = interrupted
    (tmp_path / "a.yaml").write_text(SWEEP)
    given = [tmp_path / "a.yaml", "--out", tmp_path / "out"]
    given = ["flume", "--scope", "0.9,1.0"] if name == "table" else given
    told = command(name, *given, "--workers", 1, code=1).stderr
    if name == "table":
        assert "nothing is kept without --out DIR" in told
    else:
        assert re.search(f"stopped by Ctrl-C: [0-3] rows? kept in {tmp_path / 'out' / 'rows'}", told)
        assert "The same command goes on" in told


def test_a_table_has_a_row_for_each_scope_and_speed(tmp_path):
    """Cases in a process of their own, as a user's."""
    result = command("table", "flume", "--scope", "0.9,1.0", "--speed", "0.2,0.4", "--out", tmp_path, "--workers", 1)
    rows = [line for line in (tmp_path / "table.csv").read_text().splitlines() if not line.startswith("#")]
    assert len(rows) == 5 and (tmp_path / "table.png").stat().st_size > 5000
    assert "0.9" in result.output


def static_tow(row):
    """Rows of tows that fail at scope 0.8 and are doubtful at 0.9."""
    scope = "winch.scope"
    row["verdict"] = lambda case: {0.8: "failed", 0.9: "doubtful"}.get(case.settings[scope], "ok")
    row["error"] = lambda case: "too short" if case.settings[scope] == 0.8 else ""
    row["reasons"] = lambda case: "OVERLOAD for 5 s (100 % of the run): a" if case.settings[scope] == 0.9 else ""
    for name in ("body_depth_m", "tension_mean_n", "departure_angle_deg"):
        row[name] = lambda case: None if case.settings[scope] == 0.8 else 10.0 * case.settings[scope]


def test_a_picture_of_a_table_has_every_combination_and_says_what_is_not_there(tmp_path, row, monkeypatch):
    titles = texts_of_pictures(monkeypatch)
    static_tow(row)
    given = (
        "table",
        "flume",
        "--workers",
        1,
        "--speed",
        "0.2,0.4",
        "--vary",
        "water.density=990,1000,1010",
        "--out",
        tmp_path,
    )
    shown = command(*given, "--scope", "0.8,0.9,1.0", code=1)
    assert {"depth [m]", "tension [N]", "departure angle [°]", "layback [m]", "scope [m]"} <= set(titles)
    assert "speed 0.2 m/s (0.389 kn)" in titles
    assert {f"water.density = {value} kg/m³" for value in (990, 1000, 1010)} <= set(titles)
    said = " ".join(" ".join(titles).split())
    assert "no static tow at scope 0.8 m; open marks are doubtful" in said and "combinations" not in said
    assert "water.density = 1010 kg/m³: departure angle at the sheave, from the downward vertical [deg]" in shown.stdout
    assert "failed 6 x: too short" in shown.stderr and "doubtful 6 x: OVERLOAD: a" in shown.stderr
    assert " for 5 s" not in (tmp_path / "table.csv").read_text("utf-8")
    titles.clear()
    command(*given, "--scope", "0.95,1.0", "--vary", "winch.max_rate=1,2")
    said = " ".join(" ".join(titles).split())
    assert "the first 4 of 6 combinations of water.density and winch.max_rate (table.csv has all)" in said
    assert "water.density = 1000 kg/m³\nwinch.max_rate = 2 m/s" in titles and "open" not in said


def test_a_table_of_one_scope_is_drawn_over_speed(tmp_path, row, monkeypatch):
    titles = texts_of_pictures(monkeypatch)
    static_tow(row)
    given = "table", "flume", "--workers", 1, "--scope", "1.0", "--speed", "0.2:0.4:3", "--out", tmp_path
    told = json.loads(command(*given, "--json").stdout)
    assert len(told["rows"]) == 3 and not undocumented("table", {*told, *told["rows"][0]})
    assert titles.count("speed [m/s]") == 4 and "Table of flume, scope 1 m" in titles
    assert not any(text.startswith("scope [") for text in titles)
    assert told["replaced"] is None and told == json.loads((tmp_path / "table.json").read_text("utf-8"))
    other = command("table", "full_scale", "--workers", 1, "--scope", "100", "--out", tmp_path)
    assert "had the tables of another sweep, 'table of flume': those of 'table of full_scale' replace" in other.stderr


def test_speeds_of_a_table_may_be_in_knots():
    assert speeds_of("2, 4 kn") == pytest.approx([2 * 1852 / 3600, 4 * 1852 / 3600])
    assert speeds_of("1:2:3") == [1.0, 1.5, 2.0] and speeds_of("1e1m/min") == pytest.approx([1 / 6])
    for text, told in (("2,3 kg", "'kg' is no unit of a speed"), ("kn", "neither numbers")):
        with pytest.raises(TableError, match=f"--speed .*{told}.*nothing was simulated"):
            speeds_of(text)


@pytest.mark.parametrize("name", ["sweep", "envelope", "sensitivity"])
def test_a_file_that_cannot_be_used_is_one_line(tmp_path, name):
    (tmp_path / "x.yaml").write_text(SWEEP.replace("scene: flume", "scene: flum"))
    result = command(name, tmp_path / "x.yaml", code=2)
    assert "flum" in result.stderr and "Traceback" not in result.stderr
    assert "nothing was" in result.stderr
