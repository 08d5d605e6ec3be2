"""What the figures leave out at the beginning: motion taken up, a sea that grows; the same in JSON and picture."""

import json
from pathlib import Path

import pytest

from cable_sim_ros.cli import report
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.plots import run as picture
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.offline import growth, start_up, still_growing

pytestmark = pytest.mark.trust
WAVES = {"water.waves.kind": "airy", "water.waves.height": 1.0, "water.waves.period": 4.0}
GUSTY = {"water.turbulence.deviation": [0.03, 0.0, 0.0]}


def scene(**changes):
    return override(load_scene("full_scale"), {key.replace("__", "."): value for key, value in changes.items()})


@pytest.mark.parametrize(
    "changes, what, still, moved",
    [
        ({"water.ramp": 100.0}, "", 0.0, 20.0),  # nothing grows
        (WAVES, "waves", 20.0, 20.0),
        (WAVES | {"water.ramp": 5.0}, "waves", 5.0, 20.0),
        (GUSTY | {"water.ramp": 100.0}, "turbulence", 100.0, 100.0),
        (WAVES | GUSTY | {"water.ramp": 30.0}, "waves and turbulence", 30.0, 30.0),
    ],
)
def test_what_is_left_out(changes, what, still, moved):
    tow = scene(**changes)
    assert growth(tow)[1] == what and (start_up(tow, False), start_up(tow, True)) == (still, moved)


def test_a_sea_that_still_grows_makes_the_figures_doubtful():
    slow = scene(**WAVES, water__ramp=100.0)
    (reason,) = still_growing(slow, {"skip_s": 50.0, "duration_s": 99.99})
    assert reason.flag == "SEA_GROWING" and "tension_std_n" in reason.metrics
    assert reason.text == (
        "waves grow from the static start over water.ramp = 100 s, but of a run of 100 s the figures leave out no "
        "more than half, 50 s, after which the growth is at 50 %: they are not those of the grown sea. Simulate 200 s "
        "or more, or make water.ramp shorter; the static tow is that of the scene without waves"
    )
    assert not still_growing(slow, {"skip_s": 99.995, "duration_s": 199.99})
    assert not still_growing(scene(water__ramp=100.0), {"skip_s": 0.0, "duration_s": 4.99})
    assert not still_growing(slow, {})  # a run without tick outputs


def test_json_and_picture_leave_out_the_same(tmp_path, monkeypatch):
    result = offline.run(scene(**WAVES, water__ramp=2.0), duration=5.0, out=tmp_path)
    assert result.metrics["skip_s"] == 2.0 and result.verdict.state == "ok"
    assert report.pictures_of(result, tmp_path)
    kept = result.frames[result.frames.time - result.frames.time[0] >= 2e9]
    assert result.metrics["tension_std_n"] == pytest.approx(kept.tension.std())
    run, given = load_run(result.bag), []
    caption = picture.caption(run, result.metrics["skip_s"]).replace("\u00a0", " ")
    assert "the first 2 s (grey) left out" in caption
    assert f"{result.metrics['tension_std_n'] / 1e3:.3f} kN std" in caption
    assert "left out" not in picture.caption(run, 0.0)
    monkeypatch.setattr(picture, "draw_run", lambda run, out, **more: given.append(more["skip_s"]))
    report.pictures_of(result, tmp_path)
    assert given == [2.0]


def test_a_short_run_in_waves_is_doubtful_and_without_them_static(tmp_path):
    """docs/waves.md: the static tow is that of the scene without waves."""
    waves, still = offline.run(scene(**WAVES), out=tmp_path), offline.run(scene())
    assert [reason.flag for reason in waves.verdict.reasons] == ["SEA_GROWING"] and waves.verdict.code == 4
    assert json.loads((tmp_path / "summary.json").read_text("utf-8"))["verdict"]["state"] == "doubtful"
    assert waves.metrics["tension_std_n"] > 100.0 * still.metrics["tension_std_n"]
    assert still.verdict.state == "ok" and still.metrics["skip_s"] == 0.0


def test_the_pages_say_what_a_run_without_motion_is_in_waves():
    root = Path(__file__).resolve().parents[2]
    page = " ".join((root / "docs" / "waves.md").read_text("utf-8").split())
    assert "With waves or turbulence on `--motion none` is the tow in the sea alone, no static tow" in page
    assert "[`SEA_GROWING`](flags.md#verdict)" in page and "the edge of a cube of its displaced volume" in page
    commands = (root / "docs" / "commands.md").read_text("utf-8")
    (row,) = [line for line in commands.splitlines() if "--motion none --json" in line]
    assert "the sea alone" in row and "`--duration`" in row and "](waves.md#figures-of-a-run)" in row
    manual = " ".join((root / "docs" / "parameters.md").read_text("utf-8").split())
    assert "leaves the key out or gives `null`" in manual


def test_waves_lift_the_tow_with_the_square_of_their_height():
    """The slow rise of docs/waves.md: mean drag of the oscillating flow."""
    sea = WAVES | {"solver.tick": 0.05, "water.waves.period": 8.0, "water.waves.towards_deg": 180.0}
    rises = []
    for height in (1.0, 2.0):
        depth = -offline.run(scene(**sea | {"water.waves.height": height}), duration=100.0).frames.body_position[:, 2]
        rises.append(depth[0] - depth[-160:].mean())  # 8 s: one period
    assert rises[1] == pytest.approx(0.22, abs=0.03) and rises[1] / rises[0] == pytest.approx(4.0, abs=0.6)
