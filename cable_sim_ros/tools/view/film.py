"""A film of a recorded run for a slide: MP4 by ffmpeg (imageio-ffmpeg), GIF by Pillow. Same bag, same pictures."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...files import whole
from .film_frame import FilmFrame
from .moment import BagRun, PageError, ViewError, need
from .play_bag import check_start

KINDS = (".mp4", ".gif")
PICTURES = 20_000  # at most
GIF_PICTURES = 1500


class Film(NamedTuple):
    """What was made. seconds: of the film; of_tow: of the bag; cpu: of this process for drawing and encoding."""

    path: Path
    pictures: int
    seconds: float
    of_tow: float
    cpu: float
    size: int


def check_film(path: Path) -> None:
    """ViewError where the name ends in no known kind or what draws it is missing; before anything is read."""
    if path.suffix.lower() not in KINDS:
        raise ViewError(f"--out {path}: a film ends in {' or '.join(KINDS)}; nothing was drawn; give such a name")
    need("matplotlib", "a film")
    if path.suffix.lower() == ".gif":
        need("PIL", "a GIF", "pillow")
    else:
        need("imageio_ffmpeg", "an MP4", "imageio-ffmpeg")


def make_film(
    run: BagRun,
    path: Path,
    *,
    view: str,
    start: float,
    seconds: float | None,
    speed: float,
    fps: float,
    size: tuple[int, int],
    top: float | None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> Film:
    """Draw a part of a bag, ``speed`` seconds of it in a second of film."""
    check_start(run, start)
    end = run.length if seconds is None else min(start + seconds, run.length)
    count = int(np.floor((end - start) * fps / speed + 1e-9)) + 1
    most = GIF_PICTURES if path.suffix.lower() == ".gif" else PICTURES
    if count > most:
        raise ViewError(
            f"--seconds {end - start:g} s at --speed {speed:g} and --fps {fps:g} are {count} pictures, more than the "
            f"{most} of a {path.suffix[1:]}: nothing was drawn; give fewer seconds, more speed or a lower --fps"
        )
    begun = time.process_time()
    motion = run.run.custom_data.get("motion")
    note = f"{Path(run.path).name}" + (f", motion {motion}" if motion else "") + f"; shown at {speed:g} times real time"
    frame = FilmFrame(run, start, end, size, view, top, note)

    def pictures() -> Iterator[np.ndarray]:
        before, drawn = -1, None
        for n in range(count):
            k = run.index(start + n * speed / fps)
            if k != before or drawn is None:
                drawn, before = frame.picture(run.moment(k)), k
            progress(n + 1, count)
            yield drawn

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as work:
            (_gif if path.suffix.lower() == ".gif" else _mp4)(work, pictures(), fps, size)
    except OSError as error:
        raise PageError(f"--out {path}: cannot be written ({error.strerror or error}); no film was made") from None
    except RuntimeError as error:
        raise PageError(f"--out {path}: ffmpeg made no film ({error}); give a .gif") from None
    return Film(path, count, count / fps, end - start, time.process_time() - begun, path.stat().st_size)


def _mp4(path: Path, pictures: Iterator[np.ndarray], fps: float, size: tuple[int, int]) -> None:
    ffmpeg = need("imageio_ffmpeg", "an MP4", "imageio-ffmpeg")
    writer = ffmpeg.write_frames(
        str(path), size, fps=fps, codec="libx264", quality=None, bitrate=None, macro_block_size=2,
        pix_fmt_in="rgb24", pix_fmt_out="yuv420p", ffmpeg_log_level="error",
        output_params=["-crf", "20", "-preset", "medium", "-movflags", "+faststart", "-fflags", "+bitexact",
                       "-flags:v", "+bitexact", "-map_metadata", "-1"],
    )  # fmt: skip
    writer.send(None)
    try:
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture).tobytes())
    finally:
        writer.close()


def _gif(path: Path, pictures: Iterator[np.ndarray], fps: float, size: tuple[int, int]) -> None:
    image = need("PIL.Image", "a GIF", "pillow")
    first = image.fromarray(np.ascontiguousarray(next(pictures))).quantize(128, dither=image.Dither.NONE)
    rest = (
        image.fromarray(np.ascontiguousarray(p)).quantize(palette=first, dither=image.Dither.NONE) for p in pictures
    )
    first.save(
        path, format="GIF", save_all=True, append_images=rest, duration=round(1000.0 / fps), loop=0, optimize=False
    )
