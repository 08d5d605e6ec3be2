"""The page: picture, cameras, figures, strip charts, alarms, and on a bag pause, speed and a slider in seconds."""

from __future__ import annotations

import contextlib
import io
import ipaddress
import math
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from html import escape
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit
from weakref import WeakKeyDictionary

import numpy as np

from ...errors import told_as
from ...io.messages.markers import SCALE
from ...plots.run import thinned
from ...sim.scene import Scene
from .cameras import CAMERAS, FIELD, WHOLE, camera
from .moment import CHART_POINTS, Moment, PageError, alarms_html, figures_html, need, pill, scale, strips_of
from .stage import Stage

LOOPBACK = ("127.0.0.1", "localhost", "::1")
ALL = ("0.0.0.0", "::", "")  # hosts that are every address of the machine
REFUSED = "This is not the address of this page, or another site asks for it.\n"


# A browser opens a websocket of any site to any address. Its Origin says of which site it is, its Host by which name it
# came here: a foreign site has another Origin, and one that turned its own name to this address (DNS rebinding) a Host
# that is no name of this machine.
def own(headers: Any, host: str) -> bool:
    """Is a request of the page that is served at host, by its headers (websockets.Headers)?

    Host: once, and a name of it with any port, as ssh -L has another. Origin: the same place; a websocket has one.
    """
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or not _named(hosts[0], host):
        return False
    if not origins and "Upgrade" not in headers:
        return True  # a page that is typed in
    return len(origins) == 1 and origins[0].lower() in (f"http://{hosts[0]}".lower(), f"https://{hosts[0]}".lower())


def _named(asked: str, host: str) -> bool:
    """Is what Host says a name of the page?"""
    try:
        parts = urlsplit(f"//{asked}")
        name, _ = (parts.hostname or "").rstrip("."), parts.port
    except ValueError:  # a port that is none, an address that is not closed
        return False
    if parts.netloc != asked or "@" in asked:
        return False
    if name in (*LOOPBACK, host.lower()):
        return True
    if host in LOOPBACK:
        return False
    if host in ALL and _address(name):
        return True  # no name, so nobody can have turned it here
    return name in _machine()


@lru_cache(maxsize=1)
def _machine() -> set[str]:
    """Names of this machine; the longest may have to be asked for in the network."""
    short = socket.gethostname().lower()
    return {short, f"{short}.local", socket.getfqdn().lower()}


def _address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


@contextmanager
def guarded(host: str) -> Iterator[Callable[[], bool]]:
    """Servers of websockets that are started meanwhile answer 403 to what is not `own`; gives: was one started?"""
    import websockets.asyncio.server as server

    serve, started = server.serve, []

    def with_guard(*args: Any, process_request: Any = None, **options: Any) -> Any:
        started.append(True)

        def first(connection: Any, request: Any) -> Any:
            if not own(request.headers, host):
                return connection.respond(HTTPStatus.FORBIDDEN, REFUSED)
            return process_request(connection, request) if process_request is not None else None

        return serve(*args, process_request=first, **options)

    server.serve = with_guard  # type: ignore[misc,assignment]
    try:
        yield lambda: bool(started)
    finally:
        server.serve = serve  # type: ignore[misc]


SLIM, WIDE = 0.5, 2.5  # width over height of a window's picture, as far as the camera follows it
RESHAPED = 0.02  # of the aspect of a window, from which on its camera is placed anew
WINDOW = 60.0  # s, of the strip charts
CHARTS = 2.0  # Hz, of strip charts and figures
NAMES = {name: name.capitalize() for name in CAMERAS}


def check_port(host: str, port: int) -> None:
    """PageError where nothing can be served there: viser would take another port without a word."""
    before = f"--host {host} --port {port}: the page cannot be served there"
    after = "; nothing was started. Give another --port, 0 for any that is free, or end what uses it"
    with told_as(PageError, before, after):
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(family, socket.SOCK_STREAM) as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            one.bind((host, port))


def free_port(host: str) -> int:
    """A port that nothing uses."""
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM) as one:
        one.bind((host, 0))
        return int(one.getsockname()[1])


def serve(host: str, port: int, label: str) -> Any:
    """A viser server that speaks to this host alone, or to --host, and there to its own page alone; its tunnel to the
    internet is taken out."""
    viser = need("viser", "the page")
    if port == 0:
        port = free_port(host)
    check_port(host, port)
    with contextlib.redirect_stdout(io.StringIO()), guarded(host) as begun:
        server = viser.ViserServer(host=host, port=port, label=label, verbose=False)
    stop = server.stop

    def quietly() -> None:
        with contextlib.redirect_stdout(io.StringIO()):
            stop()

    server.stop = quietly
    server.request_share_url = lambda *_, **__: None
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    if not begun():
        server.stop()
        raise PageError(
            f"viser {viser.__version__} serves its page in a way that is not known here, and any site could use it; "
            "nothing was started. pip install 'cable_sim_ros[view]'"
        )
    if server.get_port() != port:
        server.stop()
        raise PageError(f"--port {port}: taken while the page was started; nothing was started. Give another --port")
    return server


class Page:
    """Picture and panel of one scene. bag: length [s] of what can be scrubbed, None beside a node."""

    def __init__(self, server: Any, stage: Stage, scene: Scene, source: str, bag: float | None = None) -> None:
        self.server, self.stage, self.scene, self.source, self.bag = server, stage, scene, source, bag
        self.playing, self.speed, self.pressed = True, 1.0, False  # pressed: Play, by a viewer
        self.sought: float | None = None
        self.lock = threading.Lock()
        self._texts: dict[str, str] = {}
        self._charts: list[Any] = []
        self.camera = WHOLE
        self._build()

    # ---- the panel

    def _build(self) -> None:
        gui = self.server.gui
        gui.main_panel.dock_right()
        self.state = gui.add_html("")
        self.cameras = gui.add_button_group("camera", tuple(NAMES.values()))
        self.cameras.on_click(lambda event: self.look(event.target.value.lower(), event.client))
        if self.bag is not None:
            self.slider = gui.add_slider("time [s]", 0.0, max(round(self.bag, 1), 0.1), 0.1, 0.0)
            self.slider.on_update(lambda event: self._seek(event))
            self.speeds = gui.add_button_group("speed", ("0.25x", "1x", "4x", "16x"))
            self.speeds.on_click(lambda event: self._set_speed(event.target.value))
        self.button = gui.add_button("Pause")
        self.button.on_click(lambda _: self._press())
        self.figures = gui.add_html("")
        self.alarms = gui.add_html("")
        self.strips = strips_of(self.scene, self.stage.scale)
        for strip in self.strips:
            blank = np.array([0.0, 1.0])
            self._charts.append(
                gui.add_uplot(
                    (blank, blank),
                    (
                        {"label": "s"},
                        {"label": strip.title, "stroke": strip.colour, "width": 1.5, "points": {"show": False}},
                    ),
                    title=strip.title,
                    height=140,
                    scales={"x": {"time": False, "auto": True}, "y": {"auto": True}},
                    axes=({"size": 28, "space": 60}, {"size": 52}),
                    legend={"show": False},
                    padding=(0, 12, 0, 0),
                )
            )
        self.span = gui.add_html(
            f'<div style="padding:0 12px;font-size:12px;opacity:.75">charts: the last {WINDOW:g} s over time [s]</div>'
        )
        self.legend = gui.add_html("")
        self.put_legend()
        self.looked: WeakKeyDictionary[Any, tuple[float, np.ndarray]] = WeakKeyDictionary()  # aspect, eye of a window
        self.server.on_client_connect(self._opened)

    @staticmethod
    def legend_of(stage: Stage) -> str:
        """Colours of the tension with their range, scale of the line loads, and what is a symbol."""
        stops = ", ".join(f"rgb({','.join(str(round(255 * c)) for c in row)})" for row in SCALE)
        top = stage.scale.maximum
        marks = "".join(f"<span>{escape(stage.scale.text(top * k / 4))}</span>" for k in range(5))
        water = "level" if stage.sea is None or not stage.sea.agrees else "the waves of the scene"
        if stage.sea is not None and len(stage.sea.table) and not stage.sea.agrees:
            water = "level: the waves of this sea are not known here"
        return (
            '<div style="font-size:12px;line-height:1.45"><b>effective tension in the cable</b>'
            f'<div style="height:12px;border-radius:3px;background:linear-gradient(90deg,{stops})"></div>'
            f'<div style="display:flex;justify-content:space-between">{marks}</div>'
            '<div>slack: <span style="color:#ff33cc">&#9632;</span> &nbsp; '
            'line load: <span style="color:#cd322d">&#9632;</span> port half, '
            '<span style="color:#14965a">&#9632;</span> starboard half</div>'
            f"<div>{escape(stage.legend_text())}, at most three</div>"
            f"<div>water surface: {water}. The hull is a symbol; sheave, drum and the cable near them are to scale."
            "</div></div>"
        )

    def put_legend(self) -> None:
        """Write the legend, anew where the waves have become known."""
        self._put(self.legend, "legend", self.legend_of(self.stage))

    def _put(self, handle: Any, name: str, content: str) -> None:
        """New content of a piece of the panel, sent where it differs."""
        if self._texts.get(name) != content:
            self._texts[name] = content
            handle.content = f'<div style="padding:0 12px">{content}</div>'

    def say(self, state: str, colour: str, more: str = "", verdict: str = "") -> None:
        """First lines of the panel: what this is a picture of."""
        self._put(
            self.state,
            "state",
            f'<div style="font-size:13px;line-height:1.5"><b style="font-size:15px">{escape(self.scene.name)}</b> '
            f"{pill(state, colour)} {escape(more)}<div style='opacity:.75'>{escape(self.source)}</div>"
            f"{verdict}</div>",
        )

    # ---- what a viewer does

    def _opened(self, client: Any) -> None:
        client.camera.on_update(lambda _: self._shaped(client))
        self.look(self.camera, client)

    def _shaped(self, client: Any) -> None:
        """Look anew where a window is of another shape, as when its panel has been laid out, and nobody has moved."""
        aspect, eye = self.looked.get(client, (math.nan, np.zeros(3)))
        moved = np.linalg.norm(client.camera.position - eye) > 1e-3 * np.linalg.norm(eye)
        if abs(client.camera.aspect / aspect - 1.0) > RESHAPED and not moved:
            self.look(self.camera, client)

    def look(self, name: str, client: Any = None) -> None:
        """Take the camera to what it is named after; without a client every window's."""
        moment = self.stage.moment
        self.camera = name
        if moment is None:
            return
        if self.stage.follow != name:
            self.stage.follow = name
            self.stage.show(moment)
            client = None  # what is followed is the same for all, so all cameras go along
        view = camera(name, self.scene, moment, self.stage.body, self.stage.hull.length)
        self.stage.put_notice_at(view.at)
        first = self.server.initial_camera
        first.position, first.look_at, first.fov, first.near, first.far = view.eye, view.at, FIELD, view.near, view.far
        for one in [client] if client is not None else list(self.server.get_clients().values()):
            aspect = min(max(float(one.camera.aspect), SLIM), WIDE)
            view = camera(name, self.scene, moment, self.stage.body, self.stage.hull.length, aspect)
            self.looked[one] = float(one.camera.aspect), view.eye
            with one.atomic():
                one.camera.position, one.camera.look_at, one.camera.fov = view.eye, view.at, FIELD
                one.camera.near, one.camera.far = view.near, view.far

    def play(self, on: bool) -> None:
        """Go on, or hold the picture."""
        self.playing = on
        self.button.label = "Pause" if on else "Play"

    def _press(self) -> None:
        self.pressed = not self.playing
        self.play(not self.playing)

    def _seek(self, event: Any) -> None:
        if event.client is not None:  # not by the page itself
            with self.lock:
                self.sought = float(event.target.value)

    def _set_speed(self, text: str) -> None:
        self.speed = float(text.rstrip("x"))

    @property
    def watched(self) -> bool:
        """Does anyone look? Where nobody does, nothing needs to be drawn."""
        return bool(self.server.get_clients())

    def put_time(self, seconds: float) -> None:
        """Set the slider, in every window: one that a viewer moved may have missed what was set meanwhile."""
        value = min(round(seconds, 1), self.slider.max)
        self.slider.value = value + 1e-6  # the same value is not sent again
        self.slider.value = value

    def take_sought(self) -> float | None:
        """Where a viewer moved the slider to since the last call [s]."""
        with self.lock:
            found, self.sought = self.sought, None
        return found

    # ---- what is shown

    def show(self, moment: Moment) -> None:
        """Draw a moment; the first one places the camera."""
        first = self.stage.moment is None
        self.stage.show(moment)
        if first:
            self.look(self.camera)

    def read(self, moment: Moment, more: str = "") -> None:
        """Figures and alarms of a moment; more: HTML behind the alarms."""
        self._put(self.figures, "figures", figures_html(moment.frame))
        self._put(
            self.alarms,
            "alarms",
            f'<div style="font-size:12px;line-height:1.4">{alarms_html(int(moment.frame["status"]))}{more}</div>',
        )

    def chart(self, seconds: np.ndarray, frames: np.ndarray, now: float) -> None:
        """Strip charts of the last minute before ``now``; seconds: of each tick output."""
        low = int(np.searchsorted(seconds, now - WINDOW))
        high = int(np.searchsorted(seconds, now, side="right"))
        if high - low < 2:
            return
        time_s, part = seconds[low:high], frames[low:high]
        with self.server.atomic():
            for strip, chart in zip(self.strips, self._charts):
                value = np.asarray(strip.of(part), float)
                bottom, top = scale(value, strip.least)
                chart.data = thinned(time_s, value, CHART_POINTS)
                chart.scales = {
                    "x": {"time": False, "range": (max(now - WINDOW, 0.0), max(now, WINDOW))},
                    "y": {"range": (bottom, top)},
                }


class Pace:
    """Says when it is time again, ``rate`` times a second."""

    def __init__(self, rate: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.period, self.clock, self.next = 1.0 / rate, clock, 0.0

    def due(self) -> bool:
        """Is it time? Then the next time is counted from here."""
        now = self.clock()
        if now < self.next:
            return False
        self.next = self.next + self.period if self.next + self.period > now else now + self.period
        return True


def addresses(host: str, port: int) -> Mapping[str, str]:
    """What the terminal says: where the page is, and a warning where others can reach it."""
    shown = f"[{host}]" if ":" in host else "127.0.0.1" if host == "0.0.0.0" else host
    said = {"page": f"http://{shown}:{port}/"}
    if host not in LOOPBACK:
        said["warning"] = (
            f"--host {host}: everyone who reaches this host may watch, pause and scrub; the page has no password and "
            "no encryption. 127.0.0.1, the default, is this host only; from elsewhere: ssh -L"
        )
    return said
