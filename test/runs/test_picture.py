"""Picture: it is drawn for every kind of run, says its units, and stays inside its frame."""

import builtins
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))
from synthetic import make_contact, make_frames, make_shape

from cable_sim_ros.io.bags.bag import BagError
from cable_sim_ros.io.recordings.recorded_run import RecordedRun
from cable_sim_ros.io.scenes.load import scene_from_text
from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS
from cable_sim_ros.plots import haul
from cable_sim_ros.plots.heading import DONE_WIDTH, force_unit, what_was_done
from cable_sim_ros.plots.run import STYLE, WATER, caption, compose, contact_bands, draw_run
from cable_sim_ros.plots.sea_surface import SeaSurface
from cable_sim_ros.plots.side import cable_curves
from cable_sim_ros.runs.summary import SKIP

matplotlib = pytest.importorskip("matplotlib")
COLUMNS = [name for name, _ in CONTACT_COLUMNS]


def run(seconds=60.0, tick_s=0.1, **custom):
    frames = make_frames(round(seconds / tick_s), tick_s)
    frames["ship_velocity"] = [2.165, 1.25, 0.0]
    return RecordedRun(
        frames,
        [(int(f["time"]), make_shape(f)) for f in frames[::5]],
        [(int(f["time"]), make_contact(f)) for f in frames[::2]],
        custom,
    )


def still(recording):
    """The same tow without any motion, as a static run is."""
    frames = recording.frames.copy()
    frames[:] = frames[0]
    frames["time"] += np.arange(len(frames)) * 100_000_000
    return recording._replace(frames=frames)


def reeled(recording):
    """The same tow with 300 m hauled in of 450 m."""
    frames = recording.frames.copy()
    frames["scope"] = np.linspace(442.0, 142.0, len(frames))
    frames["payout"], frames["cable_on_drum"] = frames["scope"] + 8.0, 500.0 - frames["scope"]
    frames["layback"], frames["payout_rate"] = 0.7 * frames["scope"], -5.0
    return recording._replace(frames=frames)


def scaled(recording, along, down):
    """The same tow with the cable and the towbody behind the sheave so many times further aft and deeper."""
    frames = recording.frames.copy()
    sheave = frames["sheave_position"]
    frames["body_position"][:, :2] = sheave[:, :2] + along * (frames["body_position"] - sheave)[:, :2]
    frames["body_position"][:, 2] *= down
    shapes = []
    for (time, table), frame in zip(recording.shapes, recording.frames[::5]):
        table = table.copy()
        table[:, :2] = frame["sheave_position"][:2] + along * (table[:, :2] - frame["sheave_position"][:2])
        table[:, 2] *= np.where(table[:, 2] < 0.0, down, 1.0)
        shapes.append((time, table))
    return recording._replace(frames=frames, shapes=shapes)


def straight(recording):
    """The same tow with a cable that rises from the towbody at once."""
    return recording._replace(shapes=[(time, np.linspace(table[0], table[-1], 40)) for time, table in recording.shapes])


def recovered(waves=""):
    """The towbody hauled up to 10 m behind a sheave of 0.4 m, with the drum 10 m ahead of it; waves: of the scene."""
    recording = scaled(run(), 0.002, 0.25)
    frames, text = recording.frames.copy(), (Path(__file__).parents[2] / "config" / "recovery_3t.yaml").read_text()
    start, _, end = text.partition("  waves: {")
    scene = start + waves + end.partition("\n")[2]
    if waves:
        sea = SeaSurface(scene_from_text(scene, "scene"))
        sea.start_ns = int(frames["time"][0]) - round(1e9 * sea.tick * int(frames["tick"][0]))
        frames["surface_elevation"] = [sea(*f["sheave_position"][:2], sea.at(f)) for f in frames]
    shapes = []
    for (time, table), frame in zip(recording.shapes, frames[::5], strict=True):
        ahead = frame["ship_velocity"] / np.linalg.norm(frame["ship_velocity"])
        wheel = [0.4 * np.array([np.sin(a), np.cos(a)]) for a in np.linspace(0.0, -1.5, 9)]
        places = [frame["sheave_position"] + x * ahead + (0.0, 0.0, z) for x, z in [(10.0, -3.0), *wheel]]
        first = np.column_stack((places, np.tile(table[0, 3:], (len(places), 1))))
        shapes.append((time, np.concatenate((first, table[len(table) // 4 :]))))
    return reeled(recording._replace(frames=frames, shapes=shapes, custom_data={"scene_yaml": scene}))


def turning(recording):
    """The same tow under a ship that turns by 180 degrees and goes 20 m to one side of its way."""
    frames = recording.frames.copy()
    half = np.linspace(0.0, 0.5 * np.pi, len(frames))
    frames["ship_quaternion"] = np.column_stack([0.0 * half, 0.0 * half, np.sin(half), np.cos(half)])
    for place in (frames["sheave_position"], frames["body_position"]):
        place[:, 0] += 600.0 * np.sin(half)
        place[:, 1] = 10.0 * np.sin(2.0 * half)
    return recording._replace(frames=frames)


NO_POINT = [(int(run().frames["time"][-1]), np.zeros((0, 9)))]  # in contact: no panel beside that of the load sees it
CASES = {
    "whole": run,
    "recovered": recovered,
    "straight, no contact": lambda: straight(run())._replace(contacts=[]),
    "deep": lambda: scaled(run(), 0.1, 8.0),
    "shallow": lambda: scaled(run(), 1.0, 0.02),
    "a flume": lambda: scaled(run(), 0.02, 0.02),
    "a turn": lambda: turning(run()),
    "still": lambda: still(run()),
    "one tick": lambda: run(0.1),
    "no shapes, detached": lambda: run()._replace(shapes=[], contacts=NO_POINT),
}


HAULS = "whole", "recovered", "deep", "one tick", "no shapes, detached"  # the others, and those with a plan: nightly


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("kind", "case"),
    [
        *(("run", case) for case in CASES),
        *(("haul", case) for case in HAULS),
        *(pytest.param("haul", case, marks=pytest.mark.nightly) for case in CASES if case not in HAULS),
        *(pytest.param("haul with a plan", case, marks=pytest.mark.nightly) for case in CASES),
    ],
)
def test_every_text_is_inside_and_every_axis_has_a_unit(kind, case):
    recording, count = CASES[case](), 4 if kind == "run" else 5
    with matplotlib.rc_context(STYLE):
        if kind == "run":
            figure = compose(recording, "full_scale, simplified_sheave", 20.0)
        else:
            plan = {"winch_plan": ", ".join(f"{k} rate -0.1" for k in range(40))} if "plan" in kind else {}
            figure = haul.compose(reeled(recording)._replace(custom_data=plan), "full_scale")
        figure.draw_without_rendering()
        assert figure.canvas.get_width_height() == (1600, 1000)
        for axes in figure.axes:
            for label in (axes.get_xlabel(), axes.get_ylabel()):
                assert label == "" or label.endswith("]"), label
            panel, across, up = (part.get_window_extent() for part in (axes, axes.xaxis.label, axes.yaxis.label))
            assert across.width <= panel.width and up.height <= panel.height, axes.get_title(loc="left")
        titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_title(loc="left")]
        assert len(titles) == count
        both = [axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)]
        ticks = {label for axis in both for label in axis.get_ticklabels()}
        boxes = {}
        for text in figure.findobj(matplotlib.text.Text):
            if text.get_text() and text.get_visible() and text not in ticks:
                box = matplotlib.text.Text.get_window_extent(text)  # of an annotation: without its arrow
                assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= 1600 and box.y1 <= 1000, text
                for other, taken in boxes.items():
                    assert not box.overlaps(taken), (text, other)
                boxes[text] = box
        lines = [line for line in figure.axes[0].lines if len(line.get_xdata()) > 2]
        for line in lines if kind == "run" else ():
            at = line.get_transform().transform(line.get_xydata())
            dense = np.concatenate([np.linspace(a, b, 50) for a, b in zip(at[:-1], at[1:])])
            for text, box in boxes.items():
                inside = (dense > [box.x0, box.y0]) & (dense < [box.x1, box.y1])
                assert not inside.all(axis=1).any(), f"the cable runs through {text}"


def test_a_deep_tow_fills_its_panel_and_says_that_it_is_not_to_scale():
    for case, note in (("whole", ""), ("deep", "across enlarged × "), ("shallow", "heights enlarged × ")):
        recording = CASES[case]()
        with matplotlib.rc_context(STYLE):
            axes = compose(recording, "a", 20.0).axes[0]
        (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
        box = axes.get_window_extent()
        ratio = (y1 - y0) / box.height / ((x1 - x0) / box.width)  # of a metre across to a metre up
        assert axes.get_title(loc="right").startswith(note) and bool(note) == bool(axes.get_title(loc="right"))
        assert ratio == pytest.approx(1.0) if case == "whole" else not 0.2 < ratio < 5.0
        curve = max(axes.lines, key=lambda line: len(line.get_xdata())).get_xydata()
        sheave = recording.frames["sheave_position"][-1, 2]
        assert x0 < curve[:, 0].min() and x1 > 0.0 and y0 < curve[:, 1].min() and y1 > sheave
        if note:
            assert np.ptp(curve[:, 0]) > 0.4 * (x1 - x0) and np.ptp(curve[:, 1]) > 0.4 * (y1 - y0)
        else:
            assert (np.ptp(curve, axis=0) > 0.5 * np.array([x1 - x0, y1 - y0])).any()


def test_a_turn_is_seen_from_above_and_says_which_way_is_not_to_scale():
    with matplotlib.rc_context(STYLE):
        above = compose(turning(run()), "a", 20.0).axes[3]
    assert above.get_title(loc="left") == "From above" and above.get_title(loc="right").startswith("north enlarged × ")


def test_the_attitude_of_a_fish_is_drawn_and_said():
    recording = run()
    half = np.radians(np.linspace(-1.0, 1.0, len(recording.frames)))  # nose up is a negative turn about y
    recording.frames["body_quaternion"] = np.column_stack([0.0 * half, np.sin(half), 0.0 * half, np.cos(half)])
    with matplotlib.rc_context(STYLE):
        axes = next(axes for axes in compose(recording, "a", 20.0).axes if "Attitude" in axes.get_title(loc="left"))
    pitch, roll = (line.get_ydata() for line in axes.get_lines())
    assert pitch[0] == pytest.approx(2.0) and pitch[-1] == pytest.approx(-2.0) and not np.any(roll)
    assert "Pitch -0.7° mean" in caption(recording, 20.0).replace("\u00a0", " ")


def test_the_ship_carries_its_drum_and_the_cable_lies_on_the_sheave():
    recording = recovered("  waves: {kind: airy, height: 1.0, period: 3.0, towards_deg: 180.0}\n")
    with matplotlib.rc_context(STYLE):
        for figure in (compose(recording, "a", 20.0), haul.compose(recording, "a")):
            axes = figure.axes[0]
            assert axes.get_title(loc="right").startswith("across enlarged")
            hull, wheel = axes.patches
            curve = cable_curves(recording)[-1]
            drum, leaves = axes.transData.transform((curve[0], curve[9]))
            assert hull.get_window_extent().x0 < drum[0] < hull.get_window_extent().x1 < axes.get_window_extent().x1
            edge = wheel.get_transform().inverted().transform(leaves)  # of the sheave: a circle of radius 1
            assert np.hypot(*edge) == pytest.approx(1.0, abs=0.05)
            (water,) = [line for line in axes.lines if matplotlib.colors.same_color(line.get_color(), WATER)]
            assert np.ptp(water.get_ydata()) == pytest.approx(1.0, rel=0.1)


def test_the_heading_says_what_was_done():
    assert what_was_done(run()) == "60 s" and what_was_done(run(0.1)) == "0 s"
    law = "setpoint:\n  algorithm: {}\n"
    done = what_was_done(run(motion="heave 1.2 m, 8 s", winch_plan="0 hold", scene_yaml=law.format("hold")))
    assert done == "heave 1.2 m, 8 s; 60 s; winch: 0 hold; no compensation"
    done = what_was_done(run(motion="nbp1406", scene_yaml=law.format("rigorous_sheave")))
    assert done == "ship motion nbp1406; 60 s; compensation rigorous_sheave"
    assert what_was_done(run(motion="none", scene_yaml="a: [")) == "no ship motion; 60 s"
    plan = ", ".join(f"{k} rate -0.1" for k in range(40))
    done = what_was_done(run(motion="nbp1406", winch_plan=plan, scene_yaml=law.format("hold")))
    assert len(done) <= DONE_WIDTH and done.startswith("ship motion nbp1406; 60 s; winch: 0 rate -0.1, 1 rate")
    assert done.endswith(" rate -0.1, ...; no compensation")


def test_small_forces_are_told_in_small_units():
    assert force_unit(np.array([-9e3])) == (1e-3, "kN") and force_unit(np.array([640.0, -20.0])) == (1.0, "N")
    assert force_unit(np.array([9e-3])) == (1e3, "mN") and force_unit(np.zeros(0)) == (1e-3, "kN")
    recording = run()
    for name in ("tension", "tension_tick_min", "tension_tick_max", "contact_resultant"):
        recording.frames[name] *= 1e-6
    text = caption(recording, 20.0).replace("\u00a0", " ")
    assert "9.00 mN mean, 1.061 mN std, 7.50 to 10.50 mN" in text and "resultant 10.80 mN mean" in text
    with matplotlib.rc_context(STYLE):
        labels = {axes.get_ylabel() for axes in compose(recording, "a", 20.0).axes}
    assert "tension [mN]" in labels


def test_the_contact_panel_shows_what_is_loaded():
    recording = run()
    for _, table in recording.contacts:
        table[:, COLUMNS.index("load_port")][12:] = table[:, COLUMNS.index("load_starboard")][12:] = 0.0
    with matplotlib.rc_context(STYLE):
        (axes,) = [a for a in compose(recording, "a", 20.0).axes if "angle" in a.get_xlabel()]
    loaded = np.degrees(recording.contacts[-1][1][:12, COLUMNS.index("wrap_angle")])
    low, high = axes.get_xlim()
    assert low < loaded[0] and loaded[-1] < high and high - low < 2.0 * np.ptp(loaded)


def test_a_haul_has_no_deviation_about_its_mean():
    for recording, expected in ((run(), "mean\n± std"), (reeled(run()), "mean")):
        with matplotlib.rc_context(STYLE):
            (axes,) = [
                a for a in compose(recording, "a", 20.0).axes if a.get_title(loc="left") == "Tension at the sheave"
            ]
        assert [text.get_text() for text in axes.texts] == [expected]


def test_file_is_written_and_the_same_each_time(tmp_path, monkeypatch):
    monkeypatch.setattr("cable_sim_ros.plots.run.DPI", 40)
    recording = run(scene="a scene")
    for draw in (draw_run, haul.draw_haul):
        first = draw(recording, tmp_path / "a.png").read_bytes()
        with matplotlib.rc_context({"savefig.dpi": 300, "savefig.bbox": "tight"}):  # as a user may have them
            assert first == draw(recording, tmp_path / "b.png").read_bytes() and first[:8] == b"\x89PNG\r\n\x1a\n"


def test_title_is_that_of_the_scene(monkeypatch, tmp_path):
    titles = []
    monkeypatch.setattr(
        "cable_sim_ros.plots.run.compose",
        lambda recording, title, skip_s, stamp: titles.append((title, skip_s)) or matplotlib.figure.Figure(),
    )
    draw_run(run(scene="a scene"), tmp_path / "a.png")
    draw_run(run(scene="a scene"), tmp_path / "a.png", title="mine")
    draw_run(run(), tmp_path / "a.png", skip_s=30.0)
    assert titles == [("a scene", SKIP), ("mine", SKIP), ("Cable tow", 30.0)]


def test_caption_has_the_figures_of_the_summary():
    text = caption(run(), 20.0).replace("\u00a0", " ")
    for part in (
        "60 s simulated, the first 20 s (grey) left out",
        "9.00 kN mean, 1.061 kN std, 7.50 to 10.50 kN",
        "180.0 m deep, std 0.42 m, 320.0 m astern",
        "heave std 1.06 m",
        "10.80 kN mean",
    ):
        assert part in text


def test_caption_of_a_haul_has_its_extremes():
    recording = reeled(run())
    text = haul.caption(recording)
    assert max(map(len, text.splitlines())) <= 165
    text = text.replace("\n", " ")
    for part in (
        "scope 142.0 to 442.0 m, towbody 179.4 to 180.6 m deep, layback 99.4 to 309.4 m",
        "tension at the sheave 7.50 to 10.50 kN, cable on the drum 58.0 to 358.0 m.",
    ):
        assert part in text
    recording.frames["scope"] = np.nan
    assert "scope not recorded" in haul.caption(recording)


def test_nodes_are_drawn_by_their_length_past_the_sheave():
    recording = reeled(run())
    with matplotlib.rc_context(STYLE):
        axes = haul.compose(recording, "a").axes[1]
        (lines,) = axes.collections
        first = np.array([segment[0] for segment in lines.get_segments()])
    assert axes.get_title(loc="left") == "Nodes along the cable" and len(first) == len(recording.shapes[0][1])
    assert first[-1] == pytest.approx((0.0, 442.0)) and first[0] == pytest.approx((0.0, 442.0 - 450.0))


def test_contact_bands_leave_out_the_start_and_end_at_the_stations():
    recording = run(10.0)
    first, last = recording.contacts[0], recording.contacts[-1]
    first[1][:, COLUMNS.index("load_port")] = 1e9  # in the start-up
    last[1][:, COLUMNS.index("wrap_angle")] += 0.5
    grid, loads = contact_bands(recording, 5.0)
    assert loads.max() < 1e8
    assert grid[0] == pytest.approx(-0.1) and grid[-1] == pytest.approx(1.4)
    inside = np.interp(grid, last[1][:, 3], last[1][:, COLUMNS.index("load_port")], left=0, right=0)
    assert loads[-1, 0] == pytest.approx(inside)
    assert (loads[-1][:, grid < 0.39] == 0).all() and (loads[:, 0] >= loads[:, 1]).all()


def test_picture_of_no_run(tmp_path):
    with pytest.raises(BagError, match="does not exist"):
        draw_run(tmp_path / "none", tmp_path / "a.png")
    assert not (tmp_path / "a.png").exists()


def test_without_matplotlib_the_remedy_is_named(monkeypatch, tmp_path):
    real = builtins.__import__

    def none(name, *rest, **more):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", none)
    with pytest.raises(RuntimeError, match=r"not installed: no picture was drawn; install cable_sim_ros\[viz\]"):
        draw_run(run(), tmp_path / "a.png")


@pytest.mark.parametrize("draw", [draw_run, haul.draw_haul])
def test_a_stamp_says_what_the_figures_are_worth(draw, monkeypatch, tmp_path):
    texts = []

    def seen(figure, path):
        texts[:] = [text.get_text() for text in figure.texts]

    monkeypatch.setattr("cable_sim_ros.plots.run.save", seen)
    draw(run(), tmp_path / "a.png", stamp="DOUBTFUL: DETACHED 5 s")
    assert "DOUBTFUL: DETACHED 5 s" in texts
    draw(run(), tmp_path / "a.png")
    assert not any("DOUBTFUL" in text for text in texts)
    draw(run(), tmp_path / "a.png", stamp="DOUBTFUL: " + ", ".join(["COARSE_AT_SURFACE 12.5 s"] * 12))
    stamp = next(text for text in texts if text.startswith("DOUBTFUL"))
    assert stamp.endswith(" ...") and len(stamp.splitlines()) == 2
