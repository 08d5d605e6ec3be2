"""A Chromium without a display, driven over its DevTools socket: opens a page, takes pictures, runs a script."""

from __future__ import annotations

import base64
import io
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path

import numpy as np

NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage "
    "--remote-debugging-port=0 --hide-scrollbars"
).split()
START = 600.0  # s that only something that hangs takes


def found() -> str | None:
    """The browser of this machine, None where there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One window with one page; leave it with `close` or as a context."""

    def __init__(self, size: tuple[int, int] = (1400, 800)) -> None:
        from websockets.sync.client import connect

        self.folder = Path(tempfile.mkdtemp(prefix="cable_sim_browser_"))
        self.process = subprocess.Popen(
            [
                str(found()),
                *OPTIONS,
                f"--user-data-dir={self.folder}",
                f"--window-size={size[0]},{size[1]}",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            port = self._port()
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=START) as answer:
                page = next(one for one in json.load(answer) if one["type"] == "page")
            self.socket = connect(page["webSocketDebuggerUrl"], max_size=None, open_timeout=START)
            self.number = 0
            width, height = size
            self.call(
                "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
            )
        except BaseException:
            self.close()
            raise

    def _port(self) -> int:
        file, deadline = self.folder / "DevToolsActivePort", time.monotonic() + START
        while time.monotonic() < deadline and self.process.poll() is None:
            if file.exists() and (text := file.read_text()).count("\n"):
                return int(text.split()[0])
            time.sleep(0.05)
        raise RuntimeError(f"no DevTools port of Chromium within {START:g} s (code {self.process.poll()})")

    def call(self, method: str, **parameters) -> dict:
        """Answer of a DevTools method."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self.socket.recv(timeout=START))
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def open(self, address: str) -> None:
        """Go to a page."""
        self.call("Page.navigate", url=address)

    def script(self, line: str):
        """Value of a line of script on the page."""
        return self.call("Runtime.evaluate", expression=line, returnByValue=True)["result"].get("value")

    def text(self) -> str:
        """What the page says."""
        return self.script("document.body ? document.body.innerText : ''") or ""

    def picture(self, path: Path | None = None) -> np.ndarray:
        """The page as [height, width, 3]; path: where it is kept as PNG."""
        from PIL import Image

        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            path.write_bytes(data)
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    def until(self, true, within: float = START, every: float = 0.2):
        """The first truth that ``true()`` gives; AssertionError with what the page says where none comes in time."""
        deadline = time.monotonic() + within
        while time.monotonic() < deadline:
            value = true()
            if value is not None and value is not False:
                return value
            time.sleep(every)
        raise AssertionError(f"not within {within:g} s; the page says: {self.text()[:600]!r}")

    def press(self, label: str) -> bool:
        """Press the button with this text; False where there is none."""
        return self.script(
            "(() => { const b = [...document.querySelectorAll('button, label')].find(b => b.innerText.trim() === "
            f"{json.dumps(label)}); if (!b) return false; b.click(); return true; }})()"
        )

    def click(self, label: str) -> None:
        """Press the button with this text once it is there."""
        self.until(lambda: self.press(label))

    def close(self) -> None:
        """End the browser and forget its folder."""
        if self.process.poll() is None:  # nothing of it is kept, so it need not tidy up
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait(10.0)
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_) -> None:
        self.close()
