"""A film of a recorded run for a slide: MP4 by ffmpeg (imageio-ffmpeg), GIF by Pillow. Same bag, same pictures.

One picture: the tow from the side, the sheave close up, strip charts with the present marked, drawn by matplotlib
without a display. What stands still is drawn once; a picture draws what moves over it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...files import whole
from ...io.messages import shapes
from ...io.messages.markers import SCALE, cable_points, colour_scale, colours
from ...io.messages.rotation import inverse, rotate
from ...physics.section import CableModel
from ...plots.run import sheet, styled, thinned
from ...plots.sea_surface import SeaSurface
from ...plots.side import FAINT, INK, ORANGE
from .cameras import SHEAVE, ahead
from .moment import (
    COLUMN,
    GREY,
    OF_STATE,
    BagRun,
    Moment,
    PageError,
    ViewError,
    alarms,
    force,
    need,
    parts_of,
    scale,
    smooth_shape,
    strips_of,
)
from .play_bag import check_start
from .stage import LOADS, nice

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 100
SEA, DEEP, SAND, HULL = "#5b93c9", "#e4eef7", "#c8ad7f", "#8893a0"
PORT, STARBOARD = "#c23b33", "#2a8a5e"  # as the side lights
NEEDLE = 4.0  # of the two scales of the side view, at most, before heights or lengths are enlarged
WAVE_POINTS = 400
CLOSE = 2.6  # sheave radii from the middle of the close-up to its edge

KINDS = (".mp4", ".gif")
PICTURES = 20_000  # at most
GIF_PICTURES = 1500


class FilmFrame:
    """Pictures of a part of a bag, from ``begin`` to ``end`` [s]. view: the large panel, whole tow or sheave."""

    def __init__(
        self, run: BagRun, begin: float, end: float, size: tuple[int, int], view: str, top: float | None, note: str
    ) -> None:
        self.run, self.scene = run, run.scene
        self.places = range(run.index(begin), run.index(end) + 1)
        some = [run.moment(k) for k in self.places[:: max(1, len(self.places) // 60)]]
        self.forward = ahead(some[len(some) // 2])
        self.sea = SeaSurface(run.scene)
        self.sea.settle(run.run.frames)
        most = max(float(moment.shape[:, 3].max()) for moment in some)
        self.scale = colour_scale(run.scene, top if top is not None else nice(max(most, 1e-3)))
        self.links = run.scene.cable.model is CableModel.SEGMENTS
        loads = [float(moment.contact[:, LOADS].max()) for moment in some if len(moment.contact)]
        self.load_unit = nice(max([*loads, 1e-9]))
        self.moving: list[Any] = []
        with styled(**{"font.size": 11, "axes.titlesize": 12, "axes.labelsize": 10}):
            points = 720 / 100.0 * DPI / size[1]  # a film of another size is the same picture, larger or smaller
            self.figure = sheet((size[0] / DPI * points, size[1] / DPI * points), DPI / points)
            self.canvas: Any = self.figure.canvas
            wide = (0.07, 0.44, 0.55, 0.42) if view != SHEAVE else (0.36, 0.10, 0.26, 0.19)
            near = (0.38, 0.04, 0.24, 0.285) if view != SHEAVE else (0.03, 0.37, 0.59, 0.49)
            self._side(self.figure.add_axes(wide), some, view == SHEAVE)
            self._sheave(self.figure.add_axes(near), view == SHEAVE)
            self._charts(begin, end)
            self._frame(note, view == SHEAVE)
            self.canvas.draw()
            self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    def _move(self, artist: Any) -> Any:
        artist.set_animated(True)
        self.moving.append(artist)
        return artist

    # ---- what stands still

    def _flat(self, places: np.ndarray, moment: Moment) -> np.ndarray:
        """Points of odom [n, 3] as [n, 2]: along the tow from the ship, height."""
        return np.column_stack(
            ((places - moment.frame["ship_position"]) @ (self.forward * (1.0, 1.0, 0.0)), places[:, 2])
        )

    def _side(self, axes: Axes, some: list[Moment], small: bool) -> None:
        from matplotlib.collections import LineCollection

        hull = shapes.hull(self.scene)
        seen = np.concatenate([self._flat(m.shape[:, :3], m) for m in some])
        seen = np.concatenate((seen, [(hull.length * 0.5, 0.03 * hull.length), (-0.02 * hull.length, 0.0)]))
        if self.scene.seabed.depth is not None and self.scene.seabed.depth < -2.0 * seen[:, 1].min():
            seen = np.concatenate((seen, [(seen[:, 0].mean(), -1.02 * self.scene.seabed.depth)]))
        low, high = seen.min(axis=0), seen.max(axis=0)
        box = axes.get_position()
        room = np.array([box.width * self.figure.get_figwidth(), box.height * self.figure.get_figheight()]) * 0.86
        unit = np.maximum(high - low, 1e-3) / room
        ratio = float(unit.max() / unit.min())
        unit = np.maximum(unit, unit.max() / NEEDLE) if ratio > NEEDLE else np.full(2, unit.max())
        middle, half = 0.5 * (low + high), 0.5 * room / 0.86 * unit
        axes.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
        stretched = unit.max() / unit.min()
        word = "lengths along" if unit[0] < unit[1] else "heights"
        extra = f"  ({word} enlarged × {stretched:.2g})" if stretched > 1.05 else ""
        axes.set_title("Tow from the side" + extra)
        axes.set_xlabel("along the tow, from the ship [m]", labelpad=2)
        axes.set_ylabel("" if small else "height above water [m]")
        axes.set_facecolor("white")
        self.x = np.linspace(axes.get_xlim()[0], axes.get_xlim()[1], WAVE_POINTS)
        bottom = axes.get_ylim()[0]
        if self.scene.seabed.depth is not None:
            self._move(axes.axhspan(bottom, -self.scene.seabed.depth, color=SAND, lw=0, zorder=1))
        self.water = self._move(axes.fill_between(self.x, 0.0 * self.x, bottom, color=DEEP, lw=0, zorder=0))
        self.surface = self._move(axes.plot(self.x, 0.0 * self.x, color=SEA, lw=1.5)[0])
        # the hull from the side: its outline in x and z
        points = hull.mesh.corners[:, (0, 2)]
        from scipy.spatial import ConvexHull

        self.hull_outline = points[ConvexHull(points).vertices]
        self.hull = self._move(axes.fill([0], [0], color=HULL, lw=0, zorder=3)[0])
        self.line = self._move(LineCollection([], lw=3.0, capstyle="round", zorder=4))
        axes.add_collection(self.line, autolim=False)
        self.fish = self._move(axes.plot([], [], "D", color=ORANGE, ms=7, zorder=5)[0])
        self.wheel = self._move(axes.plot([], [], "o", mfc="white", mec=INK, mew=1.5, ms=6, zorder=5)[0])
        beside = {"xytext": (7, -2) if small else (9, -3), "textcoords": "offset points", "ha": "left", "va": "top"}
        look = {"size": 10, "weight": "bold", "color": ORANGE, "zorder": 6}
        self.fish_text = self._move(axes.annotate("", (0, 0), **beside, **look))
        self.side_axes = axes

    def _sheave(self, axes: Axes, large: bool) -> None:
        from matplotlib.collections import LineCollection
        from matplotlib.patches import Circle

        r, top = self.scene.sheave.radius, self.scene.sheave.radius + self.scene.sheave.groove_depth
        box = axes.get_position()
        aspect = box.width * self.figure.get_figwidth() / (box.height * self.figure.get_figheight())
        tall = CLOSE * r
        axes.set(xlim=(-tall * aspect, tall * aspect), ylim=(-0.75 * tall, 1.25 * tall), xticks=[], yticks=[])
        axes.grid(False)
        axes.set_facecolor("#f6f8fa")
        for side in ("left", "bottom", "right", "top"):
            axes.spines[side].set_visible(True)
            axes.spines[side].set_color("#d5dbe1")
        axes.set_title("Sheave, ahead is right")
        axes.add_patch(Circle((0, 0), top, facecolor="#d9dee4", edgecolor=FAINT, lw=1.0))
        axes.add_patch(Circle((0, 0), r, facecolor="#b9c2cb", edgecolor=INK, lw=1.0))
        axes.plot(0, 0, "o", color=INK, ms=4)
        self.loads = [
            self._move(LineCollection([], color=c, lw=2.2 if large else 1.3, zorder=3)) for c in (PORT, STARBOARD)
        ]
        self.cable = self._move(LineCollection([], lw=5.0 if large else 3.2, capstyle="round", zorder=4))
        for artist in (*self.loads, self.cable):
            axes.add_collection(artist, autolim=False)
        unit = f"{self.load_unit / 1e3:g} kN/m" if self.load_unit >= 100.0 else f"{self.load_unit:g} N/m"
        x0 = -0.94 * tall * aspect
        axes.plot([x0, x0], [-0.66 * tall, -0.66 * tall + r], color=INK, lw=2.5, solid_capstyle="butt")
        axes.text(x0 + 0.08 * tall, -0.66 * tall + 0.5 * r, f"line load\n{unit}\n", size=9, va="center")
        axes.text(x0 + 0.08 * tall, -0.66 * tall + 0.12 * r, "port", size=9, color=PORT, va="center")
        gap = 0.30 if large else 0.50
        axes.text(x0 + (0.08 + gap) * tall, -0.66 * tall + 0.12 * r, "starboard", size=9, color=STARBOARD, va="center")
        self.near = tall * aspect * 1.5

    def _charts(self, begin: float, end: float) -> None:
        seconds = self.run.seconds - self.run.times[0]
        low, high = np.searchsorted(seconds, (begin, end + 1e-9))
        part, time = self.run.run.frames[low:high], seconds[low:high]
        self.strips = strips_of(self.scene, self.scale)
        heights = np.linspace(0.875, 0.03, len(self.strips) + 1)
        self.cursors, self.dots = [], []
        for k, (strip, above, below) in enumerate(zip(self.strips, heights, heights[1:])):
            axes = self.figure.add_axes((0.695, below + 0.055, 0.285, above - below - 0.085))
            value = np.asarray(strip.of(part), float)
            axes.plot(*thinned(time, value, 400), color=strip.colour, lw=1.4)
            axes.set(xlim=(begin, max(end, begin + 1e-3)), ylim=scale(value, strip.least))
            axes.set_title(strip.title, size=11)
            axes.locator_params(axis="y", nbins=4)
            axes.tick_params(labelsize=9, labelbottom=k == len(self.strips) - 1)
            if k == len(self.strips) - 1:
                axes.set_xlabel("time [s]", labelpad=1)
            self.cursors.append(self._move(axes.axvline(begin, color=INK, lw=1.0, alpha=0.7)))
            self.dots.append(self._move(axes.plot([], [], "o", color=strip.colour, ms=6, mec="white")[0]))

    def _frame(self, note: str, large: bool) -> None:
        verdict = self.run.verdict
        self.figure.text(0.02, 0.955, self.scene.name, size=17, weight="bold", va="center")
        self.figure.text(0.02, 0.915, note, size=10, color=FAINT, va="center")
        self.figure.text(0.98, 0.955, f"verdict: {verdict.state}", size=12, weight="bold", ha="right", va="center",
                         color=OF_STATE.get(verdict.state, INK))  # fmt: skip
        if verdict.reasons:
            self.figure.text(0.98, 0.918, verdict.headline.partition(": ")[2][:70], size=9, ha="right", va="center")
        self.clock = self._move(self.figure.text(0.62, 0.955, "", size=15, weight="bold", ha="right", va="center",
                                                 family="DejaVu Sans Mono"))  # fmt: skip
        self.alarm = self._move(self.figure.text(0.62, 0.915, "", size=10, ha="right", va="center", color="#b45f06"))
        left = 0.07 if not large else 0.03
        self.reading = self._move(self.figure.text(left, 0.215, "", size=11, va="top", linespacing=1.55))
        bar = self.figure.add_axes((left, 0.27, 0.26, 0.016))
        bar.imshow(SCALE[None, :, :], aspect="auto", extent=(0.0, 1.0, 0.0, 1.0), interpolation="bilinear")
        bar.set(yticks=[], xticks=np.linspace(0.0, 1.0, 5))
        bar.set_xticklabels([self.scale.text(self.scale.maximum * k / 4) for k in range(5)], size=9)
        bar.grid(False)
        bar.tick_params(length=2, pad=1)
        for side in bar.spines.values():
            side.set_visible(False)
        bar.set_title("tension in the cable", size=10, pad=3, weight="normal")

    # ---- what moves

    def picture(self, moment: Moment) -> np.ndarray:
        """The picture of a moment, [height, width, 3] of 0 to 255."""
        f = moment.frame
        points, tension = cable_points(smooth_shape(moment.shape), 1 if self.links else parts_of(moment.shape))
        shade = colours(0.5 * (tension[:-1] + tension[1:]), self.scale.maximum)
        flat = self._flat(points, moment)
        self.line.set_segments(np.stack((flat[:-1], flat[1:]), axis=1))
        self.line.set_color(shade)
        self._place_ship(moment)
        body = self._flat(np.array([f["body_position"]]), moment)[0]
        self.fish.set_data([body[0]], [body[1]])
        self.fish_text.xy = tuple(body)
        self.fish_text.set_text(f"{-float(f['body_position'][2]):.1f} m deep")
        self._place_water(moment)
        self._place_sheave(moment, points, shade)
        for strip, cursor, dot in zip(self.strips, self.cursors, self.dots):
            cursor.set_xdata([moment.seconds, moment.seconds])
            dot.set_data([moment.seconds], [float(strip.of(np.asarray(f)))])
        self.clock.set_text(f"{moment.seconds:6.1f} s")
        self.alarm.set_text(", ".join(name for name, _, colour in alarms(int(f["status"])) if colour != GREY)[:60])
        self.reading.set_text(
            f"tension  {force(float(f['tension']))}\npay-out  {float(f['payout']):.2f} m "
            f"({float(f['payout_rate']):+.2f} m/s)\nlayback  {float(f['layback']):.1f} m\n"
            f"departure  {np.degrees(float(f['departure_angle'])):.1f}° from vertical"
        )
        self.canvas.restore_region(self.still)
        for artist in sorted(self.moving, key=lambda one: one.get_zorder()):
            artist.axes.draw_artist(artist) if artist.axes is not None else self.figure.draw_artist(artist)
        return np.asarray(self.canvas.buffer_rgba())[:, :, :3]

    def _place_ship(self, moment: Moment) -> None:
        f = moment.frame
        corners = (
            np.array([rotate(f["ship_quaternion"], (x, 0.0, z)) for x, z in self.hull_outline]) + f["ship_position"]
        )
        self.hull.set_xy(self._flat(corners, moment))
        wheel = self._flat(np.array([f["sheave_position"]]), moment)[0]
        self.wheel.set_data([wheel[0]], [wheel[1]])

    def _place_water(self, moment: Moment) -> None:
        height = np.zeros(WAVE_POINTS)
        if self.sea.agrees:
            places = moment.frame["ship_position"][:2] + np.multiply.outer(self.x, self.forward[:2])
            height = self.sea(places[:, 0], places[:, 1], self.sea.at(moment.frame))
        self.surface.set_ydata(height)
        bottom = self.side_axes.get_ylim()[0]
        self.water.set_verts(
            [np.concatenate((np.column_stack((self.x, height)), [(self.x[-1], bottom), (self.x[0], bottom)]))]
        )

    def _place_sheave(self, moment: Moment, points: np.ndarray, shade: np.ndarray) -> None:
        f, r = moment.frame, self.scene.sheave.radius
        back = inverse(f["ship_quaternion"])
        away = points - f["sheave_position"]
        near = np.flatnonzero(np.abs(away).max(axis=1) < self.near)
        a, b = (max(int(near[0]) - 1, 0), int(near[-1]) + 2) if len(near) else (0, 2)
        local = np.array([rotate(back, p) for p in away[a:b]])[:, (0, 2)]
        self.cable.set_segments(np.stack((local[:-1], local[1:]), axis=1))
        self.cable.set_color(shade[a : b - 1])
        foot = moment.contact[:, (0, 2)]
        out = foot / np.maximum(np.linalg.norm(foot, axis=1, keepdims=True), 1e-9)
        first = np.zeros((len(foot), 1))
        for artist, name in zip(self.loads, ("load_port", "load_starboard")):  # one behind the other
            tall = moment.contact[:, COLUMN[name]][:, None] / self.load_unit * r
            artist.set_segments(
                np.stack((foot + first * out, foot + (first + tall) * out), axis=1)[tall[:, 0] > 1e-3 * r]
            )
            first = first + tall


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
