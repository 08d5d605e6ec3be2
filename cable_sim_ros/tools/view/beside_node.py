"""A running node on the page. What is not the present says so: paused by the viewer, or no data for so many seconds."""

from __future__ import annotations

import time
from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ...physics.tick_output import TICK_OUTPUT
from ...plots.sea_surface import SeaSurface
from ...sim.scene import Scene
from ...sim.verdict import judge_counts, overload
from .moment import AMBER, GREEN, NO_CONTACT, RED, Moment, lines_html, verdict_html
from .page import CHARTS, WINDOW, Pace, Page
from .stage import Stage

if TYPE_CHECKING:
    from ...ros.watcher import Watcher

STALE = 1.0  # s without a tick output: then the picture is not the present
IDLE = 0.01  # s
SETTLE = 20.0  # tick outputs that are looked at for the waves


class Memory:
    """Tick outputs of the last minute, and how often each status word came since the view began."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.frames: np.ndarray = np.zeros(0, TICK_OUTPUT)
        self.seconds = np.zeros(0)
        self.counts: dict[int, int] = {}
        self.most, self.first, self.again = 0.0, 0, False

    def add(self, frames: np.ndarray) -> None:
        """Take new tick outputs; where the clock went back (~/reset, ~/restore) it begins anew."""
        if not len(frames):
            return
        last = int(self.frames["time"][-1]) if len(self.frames) else None
        back = np.flatnonzero(np.diff(frames["time"]) <= 0)
        if len(back):
            frames = frames[int(back[-1]) + 1 :]
        self.again = bool(len(back)) or (last is not None and int(frames["time"][0]) <= last)
        if self.again or last is None:
            self.frames, self.counts, self.most = np.zeros(0, TICK_OUTPUT), {}, 0.0
            self.first = int(frames["time"][0])
        for status, count in zip(*np.unique(frames["status"], return_counts=True)):
            self.counts[int(status)] = self.counts.get(int(status), 0) + int(count)
        self.most = max(self.most, float(frames["tension_most"].max()))
        kept = np.concatenate((self.frames, np.asarray(frames)))
        low = int(np.searchsorted(kept["time"], int(kept["time"][-1]) - round((WINDOW + 5.0) * 1e9)))
        self.frames = kept[low:]
        self.seconds = 1e-9 * (self.frames["time"] - self.first)

    def verdict_html(self) -> str:
        """Verdict on what was seen."""
        last = int(self.frames["status"][-1])
        found = judge_counts(
            self.counts, self.scene.solver.tick, last, scene=self.scene, others=overload(self.scene, self.most)
        )
        return verdict_html(found, "verdict of its flags since this view began:")


def follow(
    server: Any, watcher: Watcher, scene: Scene, rate: float, top: float | None, alive: Callable[[], bool], camera: str
) -> None:
    """Serve the page until ``alive()`` says no. rate: pictures a second, at most."""
    sea = SeaSurface(scene)
    sea.agrees = False  # until the tick outputs say where its waves are
    page = Page(server, Stage(server, scene, top, sea), scene, f"node on {watcher.namespace or '/'}")
    page.camera = camera
    memory, pictures, slow, asked = Memory(scene), Pace(rate), Pace(CHARTS), False
    moment: Moment | None = None
    while alive():
        time.sleep(IDLE)
        due = pictures.due()
        if due:
            frames, tick = watcher.take()
            memory.add(frames)
            if len(sea.table) and (memory.again or not asked) and len(memory.frames) > SETTLE:
                asked = True
                sea.settle(memory.frames)
                page.put_legend()
            if tick is not None and page.playing and (page.watched or moment is None):
                seconds = 1e-9 * (int(tick.frame["time"]) - memory.first)
                moment = Moment(seconds, tick.frame, tick.shape, NO_CONTACT if tick.contact is None else tick.contact)
                page.show(moment)
        if not slow.due():
            continue
        _state(page, watcher, memory, moment)
        if moment is not None and page.playing and page.watched:
            page.read(moment, _sentences(watcher))
            page.chart(memory.seconds, memory.frames, float(memory.seconds[-1]))


def _state(page: Page, watcher: Watcher, memory: Memory, moment: Moment | None) -> None:
    """Say what the picture is: the present, held, or old."""
    age = watcher.heard
    verdict = memory.verdict_html() if len(memory.frames) else ""
    if watcher.problem:
        verdict += f'<div style="color:{RED}">{escape(watcher.problem)}</div>'
    if moment is None:
        page.stage.set_stale("no cable/shape yet")
        page.say("WAITING", AMBER, "for cable/shape", verdict)
    elif age is None or age > STALE:
        gone = "" if watcher.publishers() else ", and no node publishes there"
        text = f"NO DATA for {age or 0.0:.0f} s"
        page.stage.set_stale("NO DATA")
        page.say(text, RED, f"the picture is old{gone}", verdict)
    elif not page.playing:
        page.stage.set_stale("")
        page.say("PAUSED", AMBER, f"picture held at {moment.seconds:.1f} s", verdict)
    else:
        page.stage.set_stale("")
        page.say("LIVE", GREEN, f"{moment.seconds:.1f} s since this view began", verdict)


def _sentences(watcher: Watcher) -> str:
    """What /diagnostics warns of."""
    told = sorted(watcher.sentences.items())
    rows = [(task, text, RED if level > 1 else AMBER) for task, (level, text) in told if level]
    return lines_html("diagnostics", rows)
