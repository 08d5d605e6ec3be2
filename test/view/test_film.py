"""A film of a recorded run: its length, what is on its pictures, the same bytes each time, what is refused."""

import json

import numpy as np
import pytest
from test_drawing import call, refused

from cable_sim_ros.errors import CODE_FAILED, CODE_INPUT
from cable_sim_ros.io.messages.markers import colours

ffmpeg = pytest.importorskip("imageio_ffmpeg")  # extra `view`
pytest.importorskip("matplotlib")


def pictures_of(path) -> np.ndarray:
    """An MP4 as [pictures, height, width, 3]."""
    frames = ffmpeg.read_frames(str(path))
    width, height = next(frames)["size"]
    return np.stack([np.frombuffer(one, np.uint8).reshape(height, width, 3) for one in frames])


def near(picture, colour, within=30):
    """Which pixels have a colour of 0 to 255."""
    return np.abs(picture.astype(int) - np.array(colour)).max(axis=-1) <= within


def test_an_mp4_has_the_pictures_and_seconds_asked_for(bag, tmp_path):
    out = tmp_path / "new" / "tow.mp4"
    options = "--seconds 3 --speed 3 --fps 10 --size 320x180".split()
    result = call("film", bag, "--out", out, *options, "--json")
    assert result.exit_code == 0, result.output
    made = json.loads(result.output)
    assert made["pictures"] == 11 and made["of_tow"] == 3.0 and made["size"] == out.stat().st_size
    film = pictures_of(out)
    assert film.shape == (11, 180, 320, 3)
    assert np.abs(film[0].astype(int) - film[-1]).max() > 100  # it moves
    assert [p.name for p in out.parent.iterdir()] == ["tow.mp4"]
    again = tmp_path / "again.mp4"
    call("film", bag, "--out", again, *options)
    assert again.read_bytes() == out.read_bytes()


def test_a_gif_too(bag, tmp_path):
    out = tmp_path / "tow.gif"
    options = "--start 1 --seconds 2 --fps 5 --camera sheave --size 320x180".split()
    result = call("film", bag, "--out", out, *options)
    assert result.exit_code == 0 and "6 pictures of 2.0 s of tow" in result.output, result.output
    from PIL import Image

    with Image.open(out) as film:
        assert film.n_frames == 6 and film.size == (320, 180)


def test_cable_and_loads_are_where_the_recording_has_them(run):
    from cable_sim_ros.tools.view.film_frame import FilmFrame

    frame = FilmFrame(run, 0.0, run.length, (1280, 720), "whole", 1000.0, "")
    moment = run.moment(len(run) // 2)
    picture = frame.picture(moment).copy()
    flat = frame._flat(moment.shape[:, :3], moment)
    places = frame.side_axes.transData.transform(flat)
    shade = 255.0 * colours(moment.shape[:, 3], 1000.0)[:, :3]
    seen = 0
    for (x, y), colour in list(zip(places, shade))[5:-5]:
        at = picture[719 - round(y) - 2 : 719 - round(y) + 3, round(x) - 2 : round(x) + 3]
        seen += near(at, colour).any()
    assert seen >= 0.8 * (len(places) - 10)
    before = near(picture, (0xC2, 0x3B, 0x33)).sum()
    assert before > 40  # line load of the port half
    nothing = frame.picture(moment._replace(contact=moment.contact[:0]))
    assert near(nothing, (0xC2, 0x3B, 0x33)).sum() < 0.7 * before


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("--out", "a.avi"), "a film ends in .mp4 or .gif"),
        (("--out", "a.mp4", "--size", "big"), "is no size"),
        (("--out", "a.mp4", "--size", "641x360"), "even numbers"),
        (("--out", "a.mp4", "--size", "99999x99999"), "outside 320x180"),
        (("--out", "a.gif", "--fps", "60", "--speed", "0.01"), "give fewer seconds"),
        (("--out", "a.mp4", "--start", "100"), "give less"),
    ],
)
def test_what_cannot_be_made_is_refused(bag, arguments, text):
    refused(call("film", bag, *arguments), CODE_INPUT, text, "nothing was drawn")


def test_a_place_that_cannot_be_written_is_said(bag, tmp_path):
    (tmp_path / "file").write_text("")
    out = tmp_path / "file" / "a.gif"
    refused(call("film", bag, "--out", out, "--seconds", "1"), CODE_FAILED, "cannot be written", "no film was made")
