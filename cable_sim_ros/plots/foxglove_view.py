"""Picture of what Foxglove draws from a recording: the markers of one moment and the plots of the shipped layout.

For machines without a display: `python -m cable_sim_ros.plots.foxglove_view BAG PICTURE`. It takes nothing but the
messages in the bag and config/foxglove/tow.json, so it shows what is in them; the bag needs cable/markers (--markers).
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import ConvexHull

from ..io.bags.bag import BagError, read_bag
from ..io.bags.typestore import STORE
from ..io.messages.markers import TOPIC
from ..io.messages.rotation import rotate
from ..io.scenes.document import share_folder
from ..terminal import say
from .run import canvas

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE = (20.0, 11.25)  # inches
GROUND, INK, FAINT = "#18202a", "#dfe6ec", "#3a4654"
LINE_STRIP, LINE_LIST, CYLINDER, TEXT = 4, 5, 3, 9
PATH = re.compile(r"(.+?)\.([a-z_.]+)(?:\[(\d+)\])?")  # topic, field, index


def place(marker: Any, points: np.ndarray) -> np.ndarray:
    """Points [n, 3] of a marker in the frame of its header."""
    p, q = marker.pose.position, marker.pose.orientation
    return np.array([rotate((q.x, q.y, q.z, q.w), x) for x in points]).reshape(-1, 3) + (p.x, p.y, p.z)


def outline(scale: Any) -> np.ndarray:
    """Both ends of a CYLINDER as circles, and lines between them [n, 3]."""
    angle = np.linspace(0.0, 2.0 * np.pi, 37)
    circle = np.column_stack((0.5 * scale.x * np.cos(angle), 0.5 * scale.y * np.sin(angle), 0.0 * angle))
    up = np.array([0.0, 0.0, 0.5 * scale.z])
    return np.concatenate((circle - up, circle + up))


class Camera:
    """Looks level at a point, from the side of the tow turned by ``turn`` and from above by ``tilt`` [rad]."""

    def __init__(self, at: np.ndarray, forward: np.ndarray, turn: float, tilt: float) -> None:
        c, s = np.cos(turn), np.sin(turn)
        right = np.array([c * forward[0] - s * forward[1], s * forward[0] + c * forward[1], 0.0])
        into = np.cross((0.0, 0.0, 1.0), right)  # level, away from the eye
        self.at, self.right = at, right
        self.up = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) + np.sin(tilt) * into

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return np.stack(((points - self.at) @ self.right, (points - self.at) @ self.up), axis=-1)


def draw_view(axes: Axes, markers: list, camera: Camera, half: tuple[float, float], hidden: tuple[str, ...]) -> None:
    """One 3D panel, orthographic: half its width and height [m]; hidden: namespaces that are off."""
    from matplotlib.collections import LineCollection, PolyCollection

    axes.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), xticks=[], yticks=[], facecolor=GROUND)
    dots = (
        axes.figure.dpi * SIZE[0] * axes.get_position().width / (2.0 * half[0]) * 72.0 / axes.figure.dpi
    )  # points a m
    for marker in (m for m in markers if m.action == 0 and m.ns not in hidden):
        own = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
        if marker.type == CYLINDER:
            seen = camera(place(marker, outline(marker.scale)))
            axes.add_collection(PolyCollection([seen[ConvexHull(seen).vertices]], facecolor=own, lw=0))
        elif marker.type == TEXT:
            at = camera(place(marker, np.zeros((1, 3))))[0]
            size = max(9.0, min(15.0, marker.scale.z * dots))
            axes.text(*at, marker.text, color=own, size=size, ha="center", va="center", clip_on=True)
        elif marker.type in (LINE_STRIP, LINE_LIST):
            seen = camera(place(marker, np.array([(p.x, p.y, p.z) for p in marker.points])))
            step = 1 if marker.type == LINE_STRIP else 2
            lines = np.stack((seen[:-1:step], seen[1::step]), axis=1)
            colours: Any = own
            if marker.colors:
                rgba = np.array([(c.r, c.g, c.b, c.a) for c in marker.colors])
                colours = (0.5 * (rgba[:-1] + rgba[1:]))[::step]
            width = max(2.2 if marker.colors else 1.2, marker.scale.x * dots)
            axes.add_collection(
                LineCollection(lines, colors=colours, lw=width, capstyle="round" if marker.ns == "cable" else "butt")
            )


def series(messages: dict[str, list], path: str) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [s] and values of a path of the layout."""
    found = PATH.fullmatch(path)
    if found is None or found[1] not in messages:
        raise BagError(f"the path '{path}' of the layout is not in the bag: nothing was drawn; give a bag of a tow")
    times, values = [], []
    for message in messages[found[1]]:
        value = message
        for name in found[2].split("."):
            value = getattr(value, name)
        times.append(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)
        values.append(float(value if found[3] is None else value[int(found[3])]))
    return np.array(times), np.array(values)


def draw_bag(bag: str | Path, picture: str | Path) -> Path:
    """Draw the last markers of a bag and the plots. BagError where it has none."""
    layout = json.loads((share_folder() / "config" / "foxglove" / "tow.json").read_text("utf-8"))["configById"]
    plots = [panel for name, panel in layout.items() if name.startswith("Plot!")]
    topics = {PATH.fullmatch(p["value"])[1] for panel in plots for p in panel["paths"]}  # type: ignore[index]
    messages: dict[str, list] = {topic: [] for topic in topics}
    last = None
    for message in read_bag(bag):
        if message.topic in topics:
            messages[message.topic].append(STORE.deserialize_cdr(message.data, message.msgtype))
        elif message.topic.endswith(f"/{TOPIC}"):
            last = message
    if last is None:
        raise BagError(
            f"bag '{bag}' has no {TOPIC}: nothing was drawn; make them with cable-sim replay BAG --markers 10"
        )
    array: Any = STORE.deserialize_cdr(last.data, last.msgtype)
    named = {(m.ns, m.id): m for m in array.markers}
    at, body = (np.array([p.x, p.y, p.z]) for p in (named[k, 0].pose.position for k in ("sheave", "towbody")))
    forward = (at - body) * (1.0, 1.0, 0.0)
    forward /= max(np.linalg.norm(forward), 1e-9)
    with canvas(Path(picture), SIZE, grow=1.0) as figure:
        figure.set_layout_engine("none")
        figure.set_facecolor("#0f151c")
        _panels(figure, plots, messages, array.markers, (at, body, forward), named["sheave", 0].scale.x)
    return Path(picture)


def _panels(
    figure: Figure, plots: list[dict], messages: dict[str, list], markers: list, tow: tuple, diameter: float
) -> None:
    at, body, forward = tow
    box, away = (0.01, 0.43, 0.58, 0.53), float(np.linalg.norm(at - body))
    tall = 0.52 * float(abs(at - body)[2] + 0.26 * away)  # with the texts above and below
    wide = max(0.68 * away, tall * box[2] * SIZE[0] / (box[3] * SIZE[1]))
    views = (
        (
            "Tow",
            box,
            Camera(
                0.5 * (at + body) + 0.05 * (at - body) * (1.0, 1.0, 0.0) + (0.0, 0.0, 0.093 * away), forward, 0.0, 0.1
            ),
            wide,
            (),
        ),
        (
            "Sheave",
            (0.01, 0.02, 0.58, 0.36),
            Camera(at + (0.0, 0.0, 0.15 * diameter), forward, -0.35, 0.3),
            2.6 * diameter,
            ("ship", "text", "water"),
        ),
    )
    for title, box, camera, half, hidden in views:
        axes = figure.add_axes(box)
        draw_view(axes, markers, camera, (half, half * box[3] * SIZE[1] / (box[2] * SIZE[0])), hidden)
        axes.set_title(title, color=INK)
        for spine in axes.spines.values():
            spine.set_visible(False)
    heights = np.linspace(0.96, 0.02, len(plots) + 1)
    for panel, top, bottom in zip(plots, heights, heights[1:]):
        axes = figure.add_axes((0.645, bottom + 0.045, 0.34, top - bottom - 0.075))
        axes.set_facecolor(GROUND)
        axes.set_title(panel["title"], color=INK)
        axes.tick_params(colors=INK)
        axes.grid(color=FAINT)
        for path in panel["paths"]:
            times, values = series(messages, path["value"])
            axes.plot(times - times[0], values, color=path["color"], label=path["label"], lw=1.5)
        axes.legend(loc="upper right", labelcolor=INK, ncols=3)
        axes.set_xlabel("time [s]", color=INK)
        axes.margins(x=0.0, y=0.25)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python -m cable_sim_ros.plots.foxglove_view BAG PICTURE; nothing was drawn")
    say(draw_bag(sys.argv[1], sys.argv[2]))
