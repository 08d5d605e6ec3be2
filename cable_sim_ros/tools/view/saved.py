"""The page of a bag as one file: viser's own page with the recorded scene in it, and figures laid over it.

viser writes the picture without its panel, so what the panel says stands in a box of plain HTML: scene, verdict in
words, colours, scales and the strip charts as one SVG. Nothing is fetched: the file opens from a disk, offline.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import told_as
from ...files import write_text
from ...plots.run import thinned
from ...version import __version__
from . import moment
from .cameras import FIELD, camera
from .moment import CHART_POINTS, BagRun, PageError, Strip, scale, strips_of
from .page import Page, serve
from .play_bag import check_start, stage_of

LENGTH = 60.0  # s, where none is asked for
MOST = 6000  # pictures: some 100 MB of page in the browser
BESIDE, BACK = 0.13, 1.15  # way of the camera aside and back, of its distance
WIDE, HIGH = 340, 92  # of a chart


class Saved(NamedTuple):
    """What was written."""

    seconds: float
    pictures: int
    size: int


def save_page(
    run: BagRun, path: Path, rate: float, top: float | None, start: float, seconds: float | None, name: str
) -> Saved:
    """Write a part of a bag as a page; PageError where it would be too long or cannot be written."""
    check_start(run, start)
    last = min(start + (LENGTH if seconds is None else seconds), run.length)
    wanted = np.arange(start, last + 1e-9, 1.0 / rate)
    places = list(dict.fromkeys(run.index(float(t)) for t in wanted)) if len(wanted) <= MOST else []
    if not places:
        raise PageError(
            f"--seconds {last - start:g} s at --rate {rate:g} Hz are {len(wanted)} pictures, more than {MOST}: a page "
            "that no browser holds; nothing was written. Give fewer seconds or a lower rate"
        )
    server = serve("127.0.0.1", 0, "cable-sim")
    try:
        stage = stage_of(server, run, top)
        stage.follow = name
        first = run.moment(places[0])
        stage.show(first)
        view = camera(name, run.scene, first, stage.body, stage.hull.length)
        eye = server.initial_camera
        aside = BESIDE * np.cross(view.at - view.eye, (0.0, 0.0, 1.0))  # to the left of the box
        view = view._replace(eye=view.at + BACK * (view.eye - view.at) + aside, at=view.at + aside)
        eye.position, eye.look_at, eye.fov, eye.near, eye.far = view.eye, view.at, FIELD, view.near, view.far
        recording = server.get_scene_serializer()
        for k, after in zip(places, [*places[1:], places[-1]]):
            stage.show(run.moment(k))
            server.flush()
            recording.insert_sleep(max(float(run.times[after] - run.times[k]), 0.0) or 1.0 / rate)
        page = recording.as_html()
        begin, end = (float(run.times[k] - run.times[0]) for k in (places[0], places[-1]))
        text = _box(run, strips_of(run.scene, stage.scale), Page.legend_of(stage), begin, end)
    finally:
        server.stop()
    title = f"<title>cable-sim view: {escape(run.scene.name)}</title>"
    page = page.replace("<title>Viser</title>", title, 1).replace("</body>", text + "</body>", 1)
    with told_as(PageError, f"--save {path}: cannot be written", "; no page was made"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, page)
    return Saved(float(run.times[places[-1]] - run.times[places[0]]), len(places), path.stat().st_size)


def _box(run: BagRun, strips: tuple[Strip, ...], legend: str, begin: float, end: float) -> str:
    """What the panel would say, with the charts of the part that is shown."""
    source = run.run.custom_data.get("motion")
    about = f"{begin:.1f} to {end:.1f} s of {escape(Path(run.path).name)}" + (
        f", motion {escape(source)}" if source else ""
    )
    inner = (
        f'<div style="font-size:16px;font-weight:700">{escape(run.scene.name)}</div>'
        f'<div style="opacity:.75">{about}; cable-sim {escape(__version__)}</div>'
        f"{moment.verdict_html(run.verdict, 'verdict:')}{_charts(run, strips, begin, end)}{legend}"
    )
    return (
        '<details open style="position:fixed;right:12px;top:12px;z-index:1000;width:364px;'
        "max-height:94vh;overflow:auto;"
        "background:rgba(255,255,255,.92);border:1px solid #d5dbe1;border-radius:6px;padding:8px 12px;"
        'font:13px/1.5 system-ui,sans-serif;color:#1b2733"><summary style="cursor:pointer">figures</summary>'
        f"{inner}</details>"
    )


def _charts(run: BagRun, strips: tuple[Strip, ...], begin: float, end: float) -> str:
    seconds = run.seconds - run.times[0]
    low, high = np.searchsorted(seconds, (begin, end + 1e-9))
    if high - low < 2:
        return ""
    parts = []
    for k, strip in enumerate(strips):
        time, value = thinned(seconds[low:high], np.asarray(strip.of(run.run.frames[low:high]), float), CHART_POINTS)
        bottom, top = scale(value, strip.least)
        x = 46 + (WIDE - 52) * (time - begin) / max(end - begin, 1e-9)
        y = (k + 1) * HIGH - 8 - (HIGH - 30) * (value - bottom) / (top - bottom)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
        marks = "".join(
            f'<text x="42" y="{(k + 1) * HIGH - 4 - (HIGH - 30) * share:.0f}" text-anchor="end" font-size="10">'
            f"{bottom + share * (top - bottom):.4g}</text>"
            for share in (0.1, 0.9)
        )
        parts.append(
            f'<text x="46" y="{k * HIGH + 14}" font-size="11" font-weight="700">{escape(strip.title)}</text>{marks}'
            f'<polyline points="{points}" fill="none" stroke="{strip.colour}" stroke-width="1.3"/>'
        )
    foot = len(strips) * HIGH + 10
    ends = "".join(
        f'<text x="{at}" y="{foot}" text-anchor="{side}" font-size="10">{value:.0f} s</text>'
        for at, side, value in ((46, "start", begin), (WIDE - 6, "end", end))
    )
    return f'<svg viewBox="0 0 {WIDE} {foot + 4}" width="{WIDE}" role="img">{"".join(parts)}{ends}</svg>'
