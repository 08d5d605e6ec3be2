"""`cable-sim calibrate` on a log made from a run of the product with other numbers; what it refuses; what it writes."""

import json
import re
import shutil
import warnings
from functools import partial

import numpy as np
import pytest
from calling import cable_sim

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.sources import motion_of
from cable_sim_ros.runs.step_choice import stepped
from cable_sim_ros.sim.layout import Layout, layout_of
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.tools.calibrate import least_squares
from cable_sim_ros.tools.calibrate.calibrate import Options, calibrate
from cable_sim_ros.tools.calibrate.free import free_of, keys_of, value_of
from cable_sim_ros.tools.calibrate.result import text_with
from cable_sim_ros.tools.calibrate.tow_model import TowModel
from cable_sim_ros.tools.logs.own_signals import Signal, signals_of_frames

call = partial(cable_sim, "calibrate")
DRAG = "cable.sections.armoured.drag_amplification"
TRUE = 2.0
PLAN = "0 hold, 22 rate -0.1, 32 hold"
ENTRIES = {
    "tension": "  tension: {source: table, field: tension, unit: N}",
    "depth": "  body_depth: {source: table, field: depth, unit: m}",
    "payout": "  payout: {source: table, field: payout, unit: m}",
    "speed": "  speed: {source: table, field: speed, unit: m/s}",
}


@pytest.fixture(autouse=True)
def quiet(monkeypatch):
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # main() replaces it
    monkeypatch.setattr(warnings, "filters", [("ignore", None, Warning, None, 0)])


def write(folder, time, **columns):
    rows = np.column_stack([time, *columns.values()])
    lines = [",".join(["t_s", *columns]), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    (folder / "log.csv").write_text("\n".join(lines) + "\n")
    (folder / "map.yaml").write_text("\n".join(["mapping: made", "signals:", *(ENTRIES[name] for name in columns), ""]))
    return folder / "log.csv", "--mapping", folder / "map.yaml", "--scene", "side_scan"


@pytest.fixture(scope="module")
def shown():
    """Signals of a static tow with another drag."""
    sim = Simulator(override(load_scene("side_scan"), {DRAG: TRUE}))
    sim.start()
    found = signals_of_frames(np.array([sim.frame]).view(np.recarray), "")
    return {one.quantity: float(one.value[0]) for one in found}


@pytest.fixture
def steady(tmp_path, shown):
    """Ten minutes of its tension and depth."""
    rng, t = np.random.default_rng(5), np.arange(0.0, 600.0, 0.5)
    tension = shown["tension"] + 8.0 * rng.standard_normal(len(t))
    depth = shown["body_depth"] + 0.5 * rng.standard_normal(len(t))
    return write(tmp_path, t, tension=tension, depth=depth)


@pytest.mark.nightly
def test_a_run_with_another_drag_is_found_with_noise_and_latency(tmp_path):
    """Latency 0.3 s, noise 5 N: the interval holds the drag that made the log, and the lag."""
    pytest.importorskip("iminuit")
    made = offline.run(override(load_scene("side_scan"), {DRAG: TRUE}), heave=(1.0, 8.0), duration=60.0, step="chosen")
    one = next(one for one in signals_of_frames(made.frames, "") if one.quantity == "tension")
    t = one.time[::2] * 1e-9
    value = one.value[::2] + 5.0 * np.random.default_rng(2).standard_normal(len(t))
    given = write(tmp_path, t + 0.3, tension=value)
    result = call(*given, "--heave", "1,8", "--free", f"{DRAG}=1.5:2.5", "--lag", "tension", "--json")
    figures = json.loads(result.stdout)
    assert result.exit_code in (0, 4), result.output
    drag, lag = figures["parameters"]
    assert drag["interval"][0] <= TRUE <= drag["interval"][1] and lag["interval"][0] <= 0.3 <= lag["interval"][1]
    assert drag["interval"][1] - drag["interval"][0] < 0.05 and figures["converged"]
    assert all(abs(rise - 1.0) < 0.2 for rise in drag["rise"])
    left = figures["signals"][0]
    assert left["calibrated"]["held_out"]["rms"] < 0.5 * left["as_given"]["held_out"]["rms"]
    assert figures["runs"] < 25


@pytest.fixture(scope="module")
def under_way(tmp_path_factory):
    """A run with another drag under a heave, its winch hauling in 1 m: folder, frames."""
    folder = tmp_path_factory.mktemp("under_way") / "run"
    scene = override(load_scene("side_scan"), {DRAG: TRUE})
    made = offline.run(scene, heave=(1.0, 8.0), duration=34.0, winch=PLAN, step="chosen", every=0.1, out=folder)
    return folder, made.frames


@pytest.fixture
def gained(under_way, tmp_path):
    """Its log, of a load cell that shows 0.9 of the tension."""
    frames = under_way[1]
    t, rng = frames["time"] * 1e-9, np.random.default_rng(3)
    return write(
        tmp_path,
        t,
        tension=0.9 * frames["tension"] + 5.0 * rng.standard_normal(len(t)),
        depth=-frames["body_position"][:, 2] + 0.1 * rng.standard_normal(len(t)),
        payout=frames["payout"],
    )


FIT = (  # a stated noise takes fewer runs
    *("--free", f"{DRAG}=1.8:2.2", "--gain", "tension", "--signal", "tension~5", "--signal", "body_depth~0.1"),
    *("--intervals", "linear", "--hold-out", "0", "--every", "0.1", "--json"),
)


@pytest.mark.nightly
def test_a_log_beside_the_bag_of_its_motion_gives_drag_and_gain(under_way, gained):
    result = call(*gained, "--motion", under_way[0], *FIT)
    told = json.loads(result.stdout)
    assert not {reason["flag"] for reason in told["verdict"]["reasons"]} - {"FEW_SAMPLES"}, told["verdict"]
    (unjudged,) = told["verdict"]["notes"]
    assert unjudged == "nothing was held out (--hold-out 0): no part of the record has judged the fit"
    taken = {(one["quantity"], one["kind"]) for one in told["parameters"][0]["conditional_on"]}
    assert {("tension", "bias"), ("body_depth", "bias"), ("body_depth", "gain")} <= taken
    assert ("tension", "gain") not in taken, "it is free"
    for one, true in zip(told["parameters"], (TRUE, 0.9), strict=True):
        assert one["interval"][0] <= true <= one["interval"][1], one
        assert one["interval"][1] - one["interval"][0] < 0.1


@pytest.mark.nightly
def test_a_winch_plan_stands_in_for_the_commands(gained):
    told = json.loads(call(*gained, "--heave", "1,8", "--duration", "34", "--winch", PLAN, *FIT).stdout)
    assert not {reason["flag"] for reason in told["verdict"]["reasons"]} - {"FEW_SAMPLES"}, told["verdict"]
    assert told["parameters"][0]["value"] == pytest.approx(TRUE, abs=0.03)


@pytest.mark.nightly
def test_a_damaged_bag_of_the_motion_is_told_though_the_log_is_whole(under_way, gained, tmp_path):
    shutil.copytree(under_way[0], tmp_path / "cut")
    (mcap,) = (tmp_path / "cut").rglob("*.mcap")
    mcap.write_bytes(mcap.read_bytes()[: int(0.9 * mcap.stat().st_size)])
    result = call(*gained, "--motion", tmp_path / "cut", *FIT)
    assert result.exit_code == 3, result.output
    damage = [reason for reason in json.loads(result.stdout)["verdict"]["reasons"] if reason["flag"] == "DAMAGE"]
    assert len(damage) == 1 and "cut" in damage[0]["text"]


def test_damage_is_told_beside_the_refusal_that_it_causes(under_way, gained, tmp_path):
    shutil.copytree(under_way[0], tmp_path / "cut")
    (mcap,) = (tmp_path / "cut").rglob("*.mcap")
    mcap.write_bytes(mcap.read_bytes()[: int(0.5 * mcap.stat().st_size)])
    result = call(*gained, "--motion", tmp_path / "cut", *FIT)
    assert result.exit_code == 2 and "Too short: " in result.stderr and "damaged: " in result.stderr, result.output


def test_the_mesh_of_a_fit_stays_with_it():
    """Layouts are shared by equal scenes: a run of one afterwards has a mesh of its own."""
    base = load_scene("side_scan")
    model = TowModel(base, free_of([f"{DRAG}=1.5:2.5"], base), None, None, steady=True)
    scene = model.scene_at((2.5,))
    model((2.5,))
    own, of_fit = layout_of(scene).mesh, model.mesh
    assert own.fractions[0].tolist() == Layout(scene).mesh.fractions[0].tolist() != of_fit.fractions[0].tolist()


@pytest.mark.parametrize("kind, off", [("bias", (10.0, 1.0)), ("gain", (0.0, 1.01))])
@pytest.mark.nightly
def test_the_effect_of_an_error_that_is_not_freed_is_that_of_another_fit(tmp_path, shown, kind, off):
    rng, t = np.random.default_rng(5), np.arange(0.0, 600.0, 0.5)
    noise = 8.0 * rng.standard_normal(len(t))
    values = []
    for bias, gain in ((0.0, 1.0), off):
        given = write(tmp_path, t, tension=gain * shown["tension"] + bias + noise, depth=np.full(len(t), 20.0))
        fit = ("--steady", "--free", f"{DRAG}=1.5:2.5", "--signal", "tension", "--intervals", "linear", "--json")
        told = json.loads(call(*given, *fit).stdout)
        values.append(told["parameters"][0]["value"])
        given = {one["kind"]: one["moves"] for one in told["parameters"][0]["conditional_on"]}
        assert given.keys() == {"bias", "gain"}, "a mean has no lag"
    per = given[kind]
    times = {"bias": off[0], "gain": 100.0 * (off[1] - 1.0)}[kind]
    assert values[1] - values[0] == pytest.approx(per * times, rel=0.15)


@pytest.mark.nightly
def test_the_interval_stands_beside_what_it_takes_as_exact(steady, tmp_path):
    out = tmp_path / "mine.yaml"
    fit = ("--steady", "--free", f"{DRAG}=1.5:2.5", "--intervals", "linear", "--gain", "tension~0.02", "--out", out)
    told = re.sub(r"\s+", " ", call(*steady, *fit).output)
    assert re.search(r"tension: bias \(1 N: [+-][\d.e-]+\)", told)
    assert re.search(r"body_depth: bias \(1 m: [+-][\d.e-]+\), gain", told) and "tension: gain" not in told
    assert "taken as exact, tension: bias (1 N: " in out.read_text("utf-8")


def test_a_fit_that_stops_short_is_failed_and_writes_no_scene(steady, tmp_path, monkeypatch):
    monkeypatch.setattr(least_squares, "MAX_TRIALS", 1)
    out = tmp_path / "mine.yaml"
    result = call(*steady, "--steady", "--free", f"{DRAG}=1.5:2.5", "--intervals", "linear", "--out", out)
    assert result.exit_code == 1 and "verdict: failed: the fit has not converged" in result.output
    assert "UNCONVERGED: the fit has not converged (" in result.output
    assert not out.exists() and f"{out} was not written" in result.stderr


@pytest.mark.nightly
def test_an_interval_over_which_the_tow_bends_is_told_to_be_rough(steady):
    """Depth known to 30 m alone: over the interval of the drag it is no parabola."""
    pytest.importorskip("iminuit")
    given = ("--steady", "--free", f"{DRAG}=0.5:9", "--signal", "body_depth~30", "--json")
    told = json.loads(call(*steady, *given).stdout)
    reason = next(reason for reason in told["verdict"]["reasons"] if reason["flag"] == "INTERVAL")
    assert f"{DRAG}: at an end of its interval the likelihood rises" in reason["text"]
    assert any(rise is not None and abs(rise - 1.0) > 0.2 for rise in told["parameters"][0]["rise"])


@pytest.mark.nightly
def test_the_truth_is_in_the_intervals_of_twenty_logs():
    """Tension with 5 N of noise, 20 N of bias and 0.3 s of latency, depth with 0.2 m; each fit simulates the tow
    itself. Fewer than 17 of 20 has a probability of 2 % at 95 %. 7 minutes."""
    pytest.importorskip("iminuit")
    scene = stepped(load_scene("side_scan"), "chosen", None)
    tow = motion_of(scene, None, (1.0, 8.0), 80.0, False)
    made = offline.run(override(scene, {DRAG: TRUE}), heave=(1.0, 8.0), duration=80.0)
    curves = {one.quantity: one for one in signals_of_frames(made.frames, "")}
    options = Options(
        signals={"tension": None, "body_depth": None}, bias={"tension": None}, lag={"tension": None}, profile=True
    )
    inside = np.zeros(3, int)
    for seed in range(20):
        rng, signals = np.random.default_rng(seed), []
        for name, every, noise, bias, late in (("tension", 0.2, 5.0, 20.0, 0.3), ("body_depth", 1.0, 0.2, 0.0, 0.0)):
            one, stride = curves[name], max(round(every / scene.solver.tick), 1)
            time, value = one.time[::stride], one.value[::stride]
            value = value + bias + noise * rng.standard_normal(len(value))
            signals.append(Signal(name, time + round(late * 1e9), value))
        found = calibrate(scene, signals, "made", [f"{DRAG}=1.5:2.5"], tow, duration=80.0, options=options)
        inside += [p.interval[0] <= true <= p.interval[1] for p, true in zip(found.parameters, (TRUE, 20.0, 0.3))]
    assert (inside >= 17).all(), inside


def test_a_steady_tow_and_the_scene_that_is_written(steady, tmp_path, monkeypatch):
    out, kept = tmp_path / "mine.yaml", []

    def once(*given, **more):
        if not kept:
            kept.append(calibrate(*given, **more))
        return kept[0]

    monkeypatch.setattr("cable_sim_ros.tools.calibrate.calibrate.calibrate", once)
    result = call(*steady, "--steady", "--free", f"{DRAG}=1.5:2.5", "--intervals", "linear", "--out", out)
    assert result.exit_code in (0, 4), result.output
    assert "verdict: " in result.output and "rms, judged" in result.output
    ends = [float(text) for text in re.search(r"\[([\d.]+), ([\d.]+)\]", result.output).groups()]
    told = call(*steady, "--steady", "--free", f"{DRAG}=1.5:2.5", "--intervals", "linear", "--json").stdout
    low, high = json.loads(told)["parameters"][0]["interval"]
    assert ends[0] < ends[1] and ends[1] - ends[0] == pytest.approx(high - low, rel=0.15), "digits of the interval"
    written, text = load_scene(out), out.read_text()
    assert value_of(written, DRAG) == pytest.approx(TRUE, abs=0.03)
    assert "# 4 kn = 2.058 m/s" in text and text.startswith("# Calibrated by cable-sim calibrate on log.csv")
    assert written == override(load_scene("side_scan"), {DRAG: value_of(written, DRAG)})


DOUBTS = (
    ({"late": 200.0}, (), {"HOLD_OUT"}),
    ({"payout": 5.0}, (), {"PAYOUT"}),
    ({"speed": 0.3}, (), {"SPEED"}),
    ({}, ("--signal", "tension~0.1"), {"NOISE"}),
    ({"tension": 500.0}, ("--signal", "tension"), {"AT_BOUND", "MISFIT"}),
    ({"sign": -1.0}, (), {"MISFIT"}),
    ({"spike": 1e5}, (), {"OUTLIERS"}),
    ({"spike": 1e5, "spikes": 10}, (), {"OUTLIERS"}),
    ({"rounded": 40.0}, ("--signal", "tension"), {"ROUNDED"}),
    ({}, ("--set", "cable.breaking_load=500"), {"OVERLOAD"}),
)


@pytest.mark.parametrize(
    "off, more, flags", [({}, (), set()), *(pytest.param(*doubt, marks=pytest.mark.nightly) for doubt in DOUBTS)]
)
def test_a_doubt_is_told_and_leaves_with_its_code(tmp_path, shown, off, more, flags):
    """Each with its own reason; the intervals of short records have one of theirs."""
    rng, t = np.random.default_rng(5), np.arange(0.0, 1800.0, 0.5)
    tension = off.get("sign", 1.0) * shown["tension"] + off.get("tension", 0.0) + 8.0 * rng.standard_normal(len(t))
    if "rounded" in off:
        tension = off["rounded"] * np.round(tension / off["rounded"])
    tension[1000 : 1000 + 60 * off.get("spikes", 1) : 60] += off.get("spike", 0.0)  # 10: a quarter of the windows
    tension[t > 1200.0] += off.get("late", 0.0)
    given = write(
        tmp_path,
        t,
        tension=tension,
        depth=shown["body_depth"] + 0.5 * rng.standard_normal(len(t)),
        payout=np.full(len(t), shown["payout"] + off.get("payout", 0.0)) + 1e-3 * rng.standard_normal(len(t)),
        speed=np.full(len(t), load_scene("side_scan").ship.tow_speed + off.get("speed", 0.0)),
    )
    result = call(*given, "--steady", "--free", f"{DRAG}=1.5:2.5", "--intervals", "linear", "--json", *more)
    told = json.loads(result.stdout)["verdict"]
    found = {reason["flag"] for reason in told["reasons"]} - {"FEW_SAMPLES"}
    assert found >= flags and (flags or not found), told
    assert result.exit_code == (4 if told["reasons"] else 0)


@pytest.mark.nightly
def test_a_number_that_begins_at_the_end_of_its_range_moves(steady):
    """The scene has 1.8: its own value is the commonest bound, and a trust region there has no size."""
    told = json.loads(call(*steady, "--steady", "--free", f"{DRAG}=1.8:3", "--intervals", "linear", "--json").stdout)
    assert told["parameters"][0]["value"] == pytest.approx(TRUE, abs=0.03)
    assert "AT_BOUND" not in {reason["flag"] for reason in told["verdict"]["reasons"]}


@pytest.mark.nightly
def test_what_was_assumed_of_the_log_is_said_and_a_prior_or_mesh_that_contradicts(steady, tmp_path, monkeypatch):
    (tmp_path / "map.yaml").write_text((tmp_path / "map.yaml").read_text().replace("depth, unit: m}", "depth}"))
    own = TowModel.on_own_mesh

    def another(self, values):
        curves = own(self, values)
        mean = float(curves["tension"].value(np.zeros(1))[0])
        return {**curves, "tension": curves["tension"]._replace(value=lambda at: np.full(len(at), mean + 20.0))}

    monkeypatch.setattr(TowModel, "on_own_mesh", another)
    given = "--steady", "--free", f"{DRAG}=1:3~1.6:0.01", "--intervals", "linear", "--json"
    told = json.loads(call(*steady, *given).stdout)["verdict"]
    assert any(note.startswith("body_depth: ") and "taken" in note for note in told["notes"]), told["notes"]
    texts = {reason["flag"]: reason["text"] for reason in told["reasons"]}
    assert "deviations beside its prior: data and prior contradict each other" in texts["PRIOR"]
    assert "on that of the found numbers the scene shows other signals" in texts["MESH"]


def test_a_number_of_which_the_data_say_nothing_is_not_written(steady, tmp_path):
    out = tmp_path / "mine.yaml"
    result = call(*steady, "--steady", "--free", f"{DRAG}=1.5:2.5", "--signal", "body_depth~1000", "--out", out)
    assert (
        result.exit_code == 4 and f"the data say nothing of {DRAG}: its interval is all of its range" in result.output
    )
    assert value_of(load_scene(out), DRAG) == 1.8 and "is not known from it: 1.8 as it was" in out.read_text()


def test_the_json_has_no_number_that_json_has_not():
    from cable_sim_ros.files import finite

    assert finite({"a": [(1.0, float("nan")), float("inf"), "x", None, True]}) == {
        "a": [[1.0, None], None, "x", None, True]
    }


@pytest.mark.nightly
def test_a_gap_of_the_record_is_told(tmp_path, shown):
    rng, t = np.random.default_rng(5), np.arange(0.0, 1800.0, 0.5)
    t = t[(t < 600.0) | (t > 900.0)]
    given = write(tmp_path, t, depth=shown["body_depth"] + 0.5 * rng.standard_normal(len(t)))
    result = call(*given, "--steady", "--free", f"{DRAG}=1.5:2.5", "--intervals", "linear", "--json")
    assert "body_depth: 330 s of the 1.2e+03 s that are fitted have no values" in result.stdout, result.stdout


def test_a_clock_that_is_an_hour_off_is_refused(tmp_path):
    t = np.arange(3600.0, 3640.0, 0.5)
    result = call(*write(tmp_path, t, tension=600.0 + np.sin(t)), "--heave", "1,8", "--duration", "30", "--free", DRAG)
    assert result.exit_code == 2 and "s, of which none is simulated (from the start of the tow" in result.stderr


@pytest.mark.parametrize(
    "free, text",
    [
        (("cable.sections.armoured.drag_amplificaton",), f"Did you mean {DRAG}?"),
        ((f"{DRAG}=2:3",), f"the scene has {DRAG} = 1.8, outside its range [2, 3]; nothing was simulated"),
        ((f"{DRAG}=3:1",), "3 is not below 1; nothing was simulated"),
        ((f"{DRAG}=0.01:3",), "the range leaves [0.1, 10]"),
        ((f"{DRAG}=x:3",), "'x' is no lower bound"),
        ((f"{DRAG}~0",), "the prior's standard deviation is 0"),
        ((DRAG, "cable.sections.*.drag_amplification"), "is free twice"),
        (("setpoint.algorithm",), "= 'hold' is no number"),
        (("towbody.drag_area",), "Free a component: towbody.drag_area[0]"),
        (("towbody.drag_area[7]",), "has 3 components"),
        (("cable.sections.armoured.drag_coefficient",), "has no value in the scene"),
        (("towbody.lift_area",), "the scene has 0, and no range follows from it"),
        (("towbody.net_weight",), "--free towbody.net_weight=LOW:HIGH"),
        (("drive.max_power",), "drive.max_power"),
        (("cable.sections.armoured.length=300:400",), "moves the line on its mesh, which a fit holds"),
        (("sheave.position[0]=-20:-10",), "Give it by --set sheave.position[0]=VALUE"),
    ],
)
def test_what_is_not_free_is_said_in_a_line(steady, free, text):
    result = call(*steady, "--steady", *(part for one in free for part in ("--free", one)))
    assert result.exit_code == 2 and text in result.stderr and "Traceback" not in result.stderr, result.output


@pytest.mark.parametrize(
    "more, text",
    [
        (("--signal", "layback"), "--signal layback: "),
        (("--signal", "wind"), "wind is no signal of a calibration"),
        (("--bias", "layback"), "--bias layback: is no signal that is fitted"),
        (("--lag", "tension"), "a steady tow has no lag"),
        (("--heave", "1,8"), "--steady has no motion"),
        (("--duration", "60"), "--steady has no motion"),
        (("--signal", "tension", "--signal", "tension~5"), "tension was given before; nothing was simulated"),
        (("--out", "/no/such/folder/x.yaml"), "there is no folder /no/such/folder"),
        (("--signal", "tension~-3"), "is not above 0"),
        (("--set", "solver.tick=0.01"), "solver.tick is set by step = chosen"),
        (("--picture", "x.foo"), "x.foo: is none of .png, .pdf, .svg, .jpg, .jpeg; nothing was simulated"),
        (("--hold-out", "0.9"), "Too short"),
    ],
)
def test_what_cannot_be_fitted_is_said_in_a_line(steady, more, text):
    result = call(*steady, "--steady", "--free", DRAG, *more)
    assert result.exit_code == 2 and text in result.stderr and "Traceback" not in result.stderr, result.output


def test_a_number_without_effect_and_a_log_without_a_signal(steady, tmp_path):
    result = call(*steady, "--steady", "--free", "towbody.mass=45:60")
    assert result.exit_code == 2 and "--free towbody.mass: has no effect on tension, body_depth" in result.stderr
    (tmp_path / "map.yaml").write_text("mapping: made\nsignals:\n  roll: {source: table, field: tension, unit: rad}\n")
    result = call(*steady, "--steady", "--free", DRAG)
    assert result.exit_code == 2 and "has no measured signal of the tow" in result.stderr


def test_a_scene_keeps_its_comments_order_and_new_keys():
    source = "# top\nname: a  # tow\ncable:\n  area: [1.0, 2.0]   # m^2\n  # below\n  mass: 3.0\n"
    text = text_with(source, {"cable.area": [1.0, 2.5], "cable.mass": 4.0, "water.density": 1000.0}, ["new"])
    assert text == (
        "# new\n# top\nname: a  # tow\ncable:\n  area: [1.0, 2.5]   # m^2\n  # below\n  mass: 4.0\n"
        "water:\n  density: 1000.0\n"
    )


def test_a_star_stands_for_every_section():
    scene = load_scene("full_scale")
    keys = keys_of(scene, "cable.sections.*.drag_amplification")
    assert keys == [f"cable.sections.{name}.drag_amplification" for name in ("bare", "faired")]
    assert value_of(scene, "cable.sections.*.drag_amplification") == 2.37
