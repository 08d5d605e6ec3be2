"""A recorded tow is followed: the band, copy 0 on the tow, the look-ahead against what came, coverage, the command."""

import csv
import itertools
import json
import re
import shutil
from functools import partial

import numpy as np
import pytest
from calling import cable_sim
from towed import SECONDS, TICK, WINCH

from cable_sim_ros.io.scenes.load import override
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.tools.ensemble import coverage, recording
from cable_sim_ros.tools.ensemble.copies import FIGURES, EnsembleEnded, figures_of
from cable_sim_ros.tools.ensemble.follow import Follower, Heard
from cable_sim_ros.tools.ensemble.plan import EnsemblePlan
from cable_sim_ros.tools.ensemble.recording import doubts_of, figures, follow_recording, heard_of, scene_kept

call = partial(cable_sim, "ensemble")
PLAN = EnsemblePlan(copies=5)
NAMES = list(FIGURES)
BANDS = round(SECONDS)


def column(values, name):
    return values[..., NAMES.index(name)]


@pytest.fixture(scope="module")
def scene(bag):
    return scene_kept(bag, None)


@pytest.fixture(scope="module")
def commanded(bag, tmp_path_factory):
    """The command over the bag: what it said, its folder, and what it followed."""
    folder, kept = tmp_path_factory.mktemp("commanded"), []

    def follow(*given, **more):
        kept.append(follow_recording(*given, **more))
        return kept[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "follow_recording", follow)
        return call(bag, "--copies", 5, "--out", folder, "--json"), folder, kept[0]


@pytest.fixture(scope="module")
def followed(commanded):
    return commanded[2]


def test_copy_0_is_the_tow_and_the_band_is_about_it(followed):
    assert followed.members == 5 and len(followed.time) == BANDS and not followed.notes and not followed.lost
    apart = np.abs(followed.nominal - followed.tow)
    assert column(apart, "body_depth").max() < 1e-3 and column(apart, "body_x").max() < 1e-3
    least = column(apart, "tension").max() / column(followed.tow, "tension").max()
    assert least < 1e-2, "the copies know the motion each tick of 50 ms only, the run between them too"
    assert (followed.low <= followed.median).all() and (followed.median <= followed.high).all()
    wide = followed.high - followed.low
    assert column(wide, "body_depth").mean() > 1.0 and column(wide, "tension").mean() > 10.0


def test_the_parts_in_which_messages_come_do_not_count(bag, scene, followed):
    follower, bands = Follower(scene, PLAN), []
    items = list(heard_of(bag))[:620]
    chance = np.random.default_rng(1)
    while items:
        count = int(chance.integers(1, 60))
        follower.hear(items[:count])
        del items[:count]
        while (band := follower.advance()) is not None:
            bands.append(band)
    values = np.concatenate([band.values for band in bands], axis=1)
    assert 20 <= len(bands) <= 31 and np.array_equal(values, followed.values[:, : len(bands)])


def test_the_look_ahead_is_what_came_where_the_plan_was_kept(bag, scene, followed):
    """20 s in, 14 s ahead: the heave goes on as it was, the winch as planned; the tow itself is the truth."""
    told = {"seconds": 14.0, "winch": WINCH}
    follower = Follower(scene, EnsemblePlan.model_validate({"copies": 5, "ahead": told}))
    follower.hear(itertools.takewhile(lambda item: len(follower.frames) < 20.5 / TICK, heard_of(bag)))
    while follower.advance() is not None:
        pass
    before = follower.ensemble.nominal.frame.copy()
    *_, band = follower.ahead()
    assert follower.ensemble.nominal.frame == before, "the copies stay where they are"
    seconds = (band.time - follower.began) * 1e-9
    truth = followed.tow[np.searchsorted(followed.time, seconds - 0.5)]
    assert seconds[-1] - (int(before["time"]) - follower.began) * 1e-9 == pytest.approx(14.0)
    for name, near in (("body_depth", 1.0), ("layback", 1.0), ("body_x", 2.0)):
        apart = np.abs(column(band.nominal, name) - column(truth, name))
        assert apart.max() < near, (name, apart.max())
    assert column(band.nominal, "layback")[-1] > column(band.nominal, "layback")[0] + 2.5, "4.7 m were paid out"
    follower.order("")
    *_, held = follower.ahead()
    assert abs(column(held.nominal, "layback")[-1] - column(held.nominal, "layback")[0]) < 1.0, "no plan: it holds"
    with pytest.raises(ValueError, match="haul"):
        follower.order("0 haul 3")


@pytest.mark.nightly
def test_twins_of_the_same_ranges_are_inside_and_a_drag_half_as_large_again_is_seen(bag, scene, monkeypatch):
    monkeypatch.setattr(coverage, "ENSEMBLES", 2)
    plan = EnsemblePlan(copies=5, every=5.0)
    told = coverage.covered(bag, scene, plan, 2, {"drag": 1.5})
    assert told["expected"] == pytest.approx(4 / 6) and told["ensembles"] == 2
    for name in ("tension", "body_depth", "layback"):
        row = told["set_outside"][name]
        assert row["share"] < 0.5, "5 copies of drag within 20 % do not reach 50 %"
        assert 0.0 <= told["drawn"][name]["low"] <= told["drawn"][name]["share"] <= told["drawn"][name]["high"] <= 1.0
        assert told["drawn"][name]["share"] >= row["share"]


def test_a_clock_that_jumps_and_messages_that_are_none_begin_again_or_are_left_out(bag, scene):
    items = [item for item in heard_of(bag) if item.kind == "health"]
    follower = Follower(scene, PLAN)
    follower.hear(items[:140])
    assert follower.advance() is not None
    follower.hear([Heard(items[140].arrival, "health", b"\x00\x01\x00\x00none")])
    follower.hear([Heard(items[140].arrival, "health", b"")])
    assert any("cannot be read" in note for note in follower.notes) and follower.running
    follower.hear(items[180:300])  # two seconds were not heard
    while follower.running and follower.advance() is not None:
        pass
    assert any("was not heard: the copies begin again" in note for note in follower.notes)
    follower.hear(items[:140])
    assert follower.notes[-1] == "the tow began again, or its clock jumped: so did the copies"


def test_figures_are_of_the_bands_where_the_copies_had_settled(followed):
    late = followed._replace(settled=np.arange(BANDS) >= 40)
    told, inside = figures(late, PLAN), (followed.tow >= followed.low) & (followed.tow <= followed.high)
    assert told["bands"] == BANDS and told["bands_settled"] == 20
    for k, row in enumerate(told["figures"].values()):
        assert row["recorded_inside"] == inside[40:, k].mean()
        assert row["width_max"] == (followed.high - followed.low)[40:, k].max()
    never = figures(followed._replace(settled=np.zeros(BANDS, bool)), PLAN)
    assert never["bands_settled"] == 0 and never["figures"] == figures(followed, PLAN)["figures"]


@pytest.mark.nightly
def test_a_recording_that_begins_under_way_is_doubtful_until_the_copies_settle(bag, tmp_path, monkeypatch):
    """20 to 40 s of it, without the tick outputs from 30 to 33 s: the copies begin twice, and never settle."""
    kept = [item for item in heard_of(bag) if item.kind == "health"]
    kept = kept[round(20.0 / TICK) : round(30.0 / TICK)] + kept[round(33.0 / TICK) : round(40.0 / TICK)]
    monkeypatch.setattr(recording, "heard_of", lambda path, damage: iter(kept))
    monkeypatch.setattr(recording, "PIECE", 20)  # of what was heard with the gap nothing is kept
    found = call(bag, "--copies", 5, "--out", tmp_path, "--json")
    told = json.loads(found.stdout)
    assert found.exit_code == told["exit_code"] == 4 and told["bands_settled"] == 0 and told["bands"] > 14
    assert sum(note.startswith("joined under way: the copies settle for") for note in told["notes"]) == 2
    with open(tmp_path / "ensemble.csv", newline="") as file:
        _, *rows = csv.reader(file)
    seconds = [float(row[0]) for row in rows]
    assert 0.0 < seconds[0] <= 1.0 and seconds == sorted(seconds) and seconds[-1] == pytest.approx(20.0)
    assert told["duration_s"] == seconds[-1]


def test_a_damaged_recording_is_followed_as_far_as_it_goes_and_said(bag, tmp_path):
    (whole,) = bag.glob("*.mcap")
    shutil.copytree(bag, tmp_path / "cut")
    data = whole.read_bytes()
    (tmp_path / "cut" / whole.name).write_bytes(data[: len(data) // 3])
    found = call(tmp_path / "cut", "--copies", 5, "--out", tmp_path, "--json")
    told = json.loads(found.stdout)
    assert found.exit_code == told["exit_code"] == 3 and 10 < told["bands"] < 40
    assert str(tmp_path / "cut") in told["notes"][-1]


def test_copies_that_leave_what_the_model_can_do_are_told_and_code_4(bag, tmp_path, monkeypatch):
    """A towbody lighter than water in most of them: it would rise to the surface, within 15 s."""
    monkeypatch.setattr(recording, "heard_of", lambda path, damage: itertools.islice(heard_of(path), 310))
    (tmp_path / "light.yaml").write_text("ensemble: light\nranges: {towbody.net_weight: {low: -3000, high: 300}}\n")
    result = call(bag, "--file", tmp_path / "light.yaml", "--copies", "5", "--out", tmp_path, "--json")
    told = json.loads(result.stdout)
    assert result.exit_code == told["exit_code"] == 4, result.output
    assert any("x in the copies, first: " in note and "rises to the surface" in note for note in told["notes"]), told


def test_the_command_writes_table_picture_and_figures(commanded):
    found, folder, _ = commanded
    told = json.loads(found.stdout)
    (flag,) = told["notes"]
    assert found.exit_code == told["exit_code"] == 4, "ticks of 50 ms damp some of this tow"
    assert re.match(r"RINGING_DAMPED in \d of 5 copies and in copy 0, for up to 0\.\d+ s \(0\.\d+ %\): the time", flag)
    assert (
        told["copies"] == 5
        and told["level"] == pytest.approx(4 / 6)
        and told == json.loads((folder / "ensemble.json").read_text())
    )
    with open(folder / "ensemble.csv", newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:3] == ["time_s", "tension_low_N", "tension_median_N"] and len(rows) == BANDS
    assert (folder / "ensemble.png").stat().st_size > 10_000
    assert any(line.startswith("assumed: share of the drag") for line in told["assumed"])
    assert told["cpu_per_copy_and_second"] > 0.0


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("BAG", "--copies", "4"), "4 is outside [5, 1000]"),
        (("BAG", "--copies", "many"), "'many' is not a whole number"),
        (("BAG", "--seed", "-1"), "-1 is outside [0,"),
        (("BAG", "--outside", "drag=1.5"), "--outside is of twins; nothing was simulated"),
        (("BAG", "--twins", "2", "--outside", "mass=3"), "--outside mass=3: is none of drag, speed"),
        (("BAG", "--twins", "2", "--outside", "drag=nan"), "--outside drag=nan: is none of"),
        (("BAG", "--twins", "2", "--outside", "drag=100"), "a factor from 0.1 to 10"),
        (("BAG", "--open"), "--namespace and --open are of a node"),
        (("BAG", "--file", "no.yaml"), "no.yaml"),
        (("BAG", "--out", "/dev/null/x"), "--out /dev/null/x: cannot be made or written"),
        (("BAG", "--scene", "no_such"), "no_such: no such scene file"),
        (("no_such_bag",), "no_such_bag: no such bag file"),
        (("nbp1406",), "keeps no scene, so what was towed is not known: nothing was simulated; give --scene"),
        (("nbp1406", "--scene", "side_scan"), "is no recording of a tow: nothing was simulated. Simulate one first"),
        (("--twins", "2"), "--twins is of a bag; nothing was started"),
        (("--json",), "--json is of a bag"),
        (("--file", "no.yaml"), "no.yaml"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(bag, arguments, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = call(*[bag if word == "BAG" else word for word in arguments])
    said = found.output + getattr(found, "stderr", "")
    assert found.exit_code == 2 and text in " ".join(said.split()), said
    assert not [path for path in tmp_path.rglob("*") if path.is_file()], "nothing is left of what was refused"


def test_a_recording_shorter_than_a_band_is_said(bag, scene, monkeypatch):
    monkeypatch.setattr(recording, "heard_of", lambda path, damage: iter(list(heard_of(path))[:15]))
    with pytest.raises(EnsembleEnded, match="shorter than one band, 1 s; nothing is told"):
        follow_recording(bag, scene, PLAN)
    assert figures_of(np.zeros(0, TICK_OUTPUT)).shape == (0, len(FIGURES))


def test_copies_that_do_not_follow_and_seconds_in_no_band_are_doubts(followed):
    told = figures(followed, PLAN)
    assert doubts_of(followed, told, PLAN) == [] and told["heard_s"] == pytest.approx(SECONDS, abs=0.2)
    told["figures"]["body_y"] |= {"width_mean": 0.0, "copy_0_apart_rms": 1e-9}
    assert doubts_of(followed, told, PLAN) == [], "round-off beside a band of no width"
    told["figures"]["body_depth"]["copy_0_apart_rms"] = 8.0
    one, two = doubts_of(followed._replace(heard=SECONDS + 20.0), told, PLAN)
    assert one == "20 s of the 80 s of the tow that were heard are in no band"
    assert two.startswith("copy 0 is 8 m rms from the recorded body_depth, more than 0.25 of the width of the band")


def test_what_the_copies_cannot_follow_is_a_doubt(bag, scene):
    """Joined under way in waves, a length while the length varies; another tick is no band; a command before all."""
    items = list(heard_of(bag))
    ticks = [item for item in items if item.kind == "health"]
    sea = override(scene, {"water.waves.height": 1.0, "water.waves.kind": "airy"})
    follower = Follower(sea, EnsemblePlan.model_validate({"copies": 5, "half_widths": {"payout": 3.0}}))
    follower.hear(ticks[200:320])
    assert follower.advance() is not None
    assert "the copies count waves of the water from there" in follower.doubts[0] and len(follower.doubts) == 1
    follower._give(WinchCommand(payout=100.0, time_ns=int(follower.ensemble.now) + 1))
    follower._give(WinchCommand(payout=100.0, time_ns=int(follower.ensemble.now) + 2))
    assert "every copy goes to that length" in follower.doubts[1] and len(follower.doubts) == 2
    other = Follower(override(scene, {"solver.tick": 0.02}), PLAN)
    other.hear(ticks[:140])
    with pytest.raises(EnsembleEnded, match=r"the tow ticks each 0.05 s, solver.tick of side_scan is 0.02 s"):
        other.advance()

    follower = Follower(scene, PLAN)
    (command,) = [item for item in items if item.kind != "health"][:1]
    follower.hear([command._replace(arrival=ticks[0].arrival - 1000)])
    assert not follower.pending and len(follower.early) == 1
    follower.hear(ticks[:1])
    assert len(follower.pending) == 1 and not follower.early
    follower.hear([command._replace(kind="flaps")])
    assert len(follower.pending) == 1 and "flaps were commanded" in follower.doubts[-1]


def test_a_clock_that_stood_still_dates_commands_anew(bag, scene):
    ticks = [item for item in heard_of(bag) if item.kind == "health"][:60]
    follower, pause = Follower(scene, PLAN), 12_000_000_000
    follower.hear(ticks[:30])
    before = follower.offset
    follower.hear([item._replace(arrival=item.arrival + pause) for item in ticks[30:]])
    assert abs(follower.offset - before - pause) < 50_000_000


def test_after_a_gap_the_copies_begin_with_what_was_heard(bag, scene):
    ticks = [item for item in heard_of(bag) if item.kind == "health"]
    follower = Follower(scene, PLAN)
    follower.hear([*ticks[:100], *ticks[140:400]])
    bands = 0
    while follower.ready() or not follower.running:
        bands += follower.advance() is not None
        if follower.notes and not follower.frames:
            break
    assert bands >= 15 and sum("joined under way" in note for note in follower.notes) == 1
