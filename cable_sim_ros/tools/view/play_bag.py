"""A bag on the page: plays, pauses, scrubs. What is drawn at any time was recorded at that time, nothing between."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from ...plots.sea_surface import SeaSurface
from .cameras import WHOLE
from .moment import AMBER, GREEN, BagRun, ViewError, verdict_html
from .page import CHARTS, Pace, Page
from .stage import Stage, nice

IDLE = 0.02  # s
QUIET = 0.8  # s after a viewer moved the slider in which it is left alone


def stage_of(server: Any, bag: BagRun, top: float | None) -> Stage:
    """A stage for the scene of a bag; top: of the colours [N], None: the largest recorded tension, rounded up."""
    sea = SeaSurface(bag.scene)
    sea.settle(bag.run.frames)
    most = max(float(table[:, 3].max()) for _, table in bag.run.shapes)
    return Stage(server, bag.scene, top if top is not None else nice(max(most, 1e-3)), sea)


def check_start(bag: BagRun, start: float) -> None:
    """ViewError where a bag ends before a time [s]."""
    if start > 0.0 and start >= bag.length:
        raise ViewError(
            f"--start {start:g} s: the bag '{bag.path}' has {bag.length:.4g} s of cable/shape; nothing was drawn; "
            "give less"
        )


def play(
    server: Any,
    bag: BagRun,
    rate: float,
    top: float | None,
    alive: Callable[[], bool],
    start: float = 0.0,
    camera: str = WHOLE,
) -> None:
    """Serve the page until ``alive()`` says no. rate: pictures a second, at most; start: seconds skipped."""
    check_start(bag, start)
    page = Page(server, stage_of(server, bag, top), bag.scene, f"recording {bag.path}", bag.length)
    page.camera = camera
    verdict = verdict_html(bag.verdict, "verdict:")
    pictures, slow = Pace(rate), Pace(CHARTS)
    now, before, drawn, said, moved = start, time.monotonic(), -1, None, -1.0
    seconds = bag.seconds - bag.times[0]
    while alive():
        wall = time.monotonic()
        passed, before = wall - before, wall
        sought = page.take_sought()
        if sought is not None:
            now, moved = sought, wall
        elif page.playing:
            if page.pressed and now >= bag.length:  # Play at the end begins again
                now = start
            page.pressed = False
            now += page.speed * passed
            if now >= bag.length:
                now = bag.length
                page.play(False)
        k = bag.index(now)
        if k != drawn and (page.watched or drawn < 0) and (pictures.due() or sought is not None):
            page.show(bag.moment(k))
            drawn = k
        state = (page.playing, page.speed, k)
        if drawn == k and state != said and (slow.due() or sought is not None):
            said = state
            moment = bag.moment(k)
            page.read(moment)
            page.chart(seconds, bag.run.frames, moment.seconds)
            ended = " (end)" if now >= bag.length else ""
            word, colour = ("PLAYING", GREEN) if page.playing else ("PAUSED", AMBER)
            page.say(word, colour, f"{moment.seconds:.1f} of {bag.length:.1f} s{ended}, {page.speed:g}x", verdict)
            if moved < 0.0:
                page.put_time(moment.seconds)
        if moved >= 0.0 and wall > moved + QUIET:
            page.put_time(now)
            moved = -1.0
        time.sleep(IDLE)
