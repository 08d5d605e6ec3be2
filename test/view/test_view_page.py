"""The page in a real browser: what is on the picture, each camera, pause and scrub, a stale node, the saved file.

One start of Chromium for all of it. Without a browser it is skipped; with CABLE_SIM_BROWSER=required, as in .ci/run,
it fails.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, found
from test_drawing import call

from cable_sim_ros.io.messages.markers import SCALE
from cable_sim_ros.tools.view.moment import BagRun

pytest.importorskip("viser")
REQUIRED = os.environ.get("CABLE_SIM_BROWSER") == "required"
WHY = "no Chromium on this machine; the page was not looked at"
pytestmark = pytest.mark.skipif(found() is None and not REQUIRED, reason=WHY)
PLAYER = "[...document.querySelectorAll('button.mantine-ActionIcon-root')][0].click()"  # of a saved page: play, hold
PANEL = 390  # px of the window that the panel takes
PORT, STARBOARD, FISH = (205, 50, 45), (20, 150, 90), (240, 130, 30)


def pixels(picture: np.ndarray, colour, within: int) -> np.ndarray:
    """Where a colour is in the scene, [n, 2] as row and column."""
    scene = picture[:, :-PANEL].astype(int)
    return np.argwhere(np.abs(scene - np.array(colour)).max(axis=-1) <= within)


def cable_pixels(picture: np.ndarray) -> np.ndarray:
    """Where a colour of the tension scale is, away from greys and the blue of the water."""
    scene = picture[:, :-PANEL].astype(int)
    best = np.min([np.abs(scene - 255.0 * row).max(axis=-1) for row in fine_scale()], axis=0)
    vivid = scene.max(axis=-1) - scene.min(axis=-1) > 60
    return np.argwhere((best < 45) & vivid)


def fine_scale() -> np.ndarray:
    """Colours of the scale, closer."""
    at = np.linspace(0, len(SCALE) - 1, 33)
    return np.stack([np.interp(at, np.arange(len(SCALE)), SCALE[:, k]) for k in range(3)], axis=1)


def serving(process: subprocess.Popen) -> str:
    """Address that a `cable-sim view` says."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("page: "):
            return line.split()[1]
    raise AssertionError(f"view ended with {process.wait()}")


def test_the_page_shows_the_tow(bag, run, tmp_path):
    assert found() is not None, WHY
    command = [sys.executable, "-W", "ignore", "-m", "cable_sim_ros.cli", "view"]
    view = subprocess.Popen([*command, str(bag), "--port", "0"], stdout=subprocess.PIPE, text=True)
    saved = tmp_path / "tow.html"
    try:
        with Browser((960, 540)) as browser:
            made = call("view", bag, "--save", saved, "--seconds", "3")  # while the other one starts
            assert made.exit_code == 0 and f"page: {saved} (3 s in 31 pictures" in made.output, made.output
            browser.open(serving(view))
            browser.until(lambda: "side_scan" in browser.text())
            _looks_like_the_tow(browser, run, tmp_path)
            _scrubs(browser, run, _cameras(browser, tmp_path))
            view.send_signal(signal.SIGINT)
            assert view.wait(600.0) == 0
            browser.until(lambda: not browser.text().startswith("cable-sim view: side_scan"))  # the page says it
            _saved(browser, saved, tmp_path)
    finally:
        if view.poll() is None:
            view.kill()


def _looks_like_the_tow(browser: Browser, run: BagRun, folder: Path) -> None:
    """The cable goes from the sheave at the right down to the towbody at the left, in the colours of its tension."""

    def there():  # whole, its end within the picture: the camera is placed anew once the panel has been laid out
        found_ = cable_pixels(_settled(browser, folder / "whole.png"))
        wide = len(found_) > 600 and np.ptp(found_[:, 1]) > 300 and np.ptp(found_[:, 0]) > 60
        return found_ if wide and found_[:, 1].min() > 20 else None

    # its buttons come after its title; a slow machine comes to the end of the recording first
    browser.until(lambda: browser.press("Pause") or "(end)" in browser.text())
    _goes_to(browser, run, 3.0)
    places = browser.until(there)
    rows, columns = places[:, 0], places[:, 1]
    left, right = columns < columns.min() + 60, columns > columns.max() - 60
    assert rows[left].mean() > rows[right].mean() + 30  # the towbody is deeper, and aft: at the left
    said = browser.until(lambda: text if "PAUSED" in (text := browser.text()) and "alarms now" in text else None)
    assert "verdict:" in said
    for words in ("effective tension", "line load on the groove", "the waves of the scene", "depth of the towbody [m]"):
        assert words in said, words
    browser.until(lambda: browser.script("document.querySelectorAll('.uplot canvas').length") == 4)


def _goes_to(browser: Browser, run: BagRun, second: float) -> None:
    """To a second by the slider's number, until the figures are those of then."""
    entry = "document.querySelector('input.mantine-NumberInput-input')"
    browser.script(
        f"(() => {{ const i = {entry}; const kind = HTMLInputElement.prototype;"
        f" Object.getOwnPropertyDescriptor(kind, 'value').set.call(i, '{second}');"
        " i.dispatchEvent(new Event('input', {bubbles: true})); i.blur(); })()"
    )
    moment = run.moment(run.index(second))
    height = f"{float(moment.frame['sheave_position'][2]):+.2f} m"
    browser.until(lambda: height in browser.text() and f"{second} of" in browser.text())


def _cameras(browser: Browser, folder: Path) -> np.ndarray:
    """Each looks at something else; the picture of the last one, the sheave."""
    pictures: dict[str, np.ndarray] = {}
    before = ""
    for name in ("Whole", "Fish", "Drum", "Sheave"):
        new = _unlike(pictures[before], 0.03, 30) if before else None
        browser.click(name)
        pictures[name], before = _settled(browser, folder / f"{name}.png", new), name
    names = list(pictures)
    for k, one in enumerate(names):
        for other in names[k + 1 :]:
            assert _unlike(pictures[one], 0.03, 30)(pictures[other]), f"{one} and {other} look alike"
    port, starboard = pixels(pictures["Sheave"], PORT, 30), pixels(pictures["Sheave"], STARBOARD, 30)
    assert len(port) > 150 and len(starboard) > 150  # line loads of both halves
    assert len(pixels(pictures["Whole"], PORT, 30)) < 60
    body = pixels(pictures["Fish"], FISH, 70)
    assert len(body) > 900
    height, width = pictures["Fish"].shape[0], pictures["Fish"].shape[1] - PANEL
    assert abs(body[:, 0].mean() - height / 2) < 90 and abs(body[:, 1].mean() - width / 2) < 90  # it is followed
    return pictures["Sheave"]


def _unlike(one: np.ndarray, share: float, step: int) -> Callable[[np.ndarray], bool]:
    """Whether more than this share of the scene of another picture is of another colour, by more than a step."""
    rows = slice(None, -60)  # below stand the player's own controls

    def unlike(other: np.ndarray) -> bool:
        change = np.abs(one[rows, :-PANEL].astype(int) - other[rows, :-PANEL]).max(axis=-1) > step
        return bool(change.mean() > share)

    return unlike


def _settled(browser: Browser, path: Path | None = None, new: Callable[[np.ndarray], bool] | None = None) -> np.ndarray:
    """The picture as soon as two in a row are the same, and new: the page draws after it says, on a busy machine."""
    last = [browser.picture()]

    def same():
        last.append(browser.picture(path))
        still = np.array_equal(last[-2][:, :-PANEL], last[-1][:, :-PANEL])
        return still and (new is None or new(last[-1]))

    browser.until(same)
    return last[-1]


def _scrubs(browser: Browser, run: BagRun, before: np.ndarray) -> None:
    """Figures and picture of the 6th second."""
    _goes_to(browser, run, 6.0)
    _settled(browser, new=_unlike(before, 0.002, 20))  # other loads, another place of the ship in the waves
    browser.click("Play")
    browser.until(lambda: any(word in browser.text() for word in ("PLAYING", "(end)")))


def _saved(browser: Browser, saved: Path, folder: Path) -> None:
    """The file opens from the disk, without a server, and plays."""
    text = saved.read_text("utf-8")
    assert "<title>cable-sim view: side_scan</title>" in text and 'src="http' not in text and 'href="http' not in text
    browser.open(saved.as_uri())
    browser.until(lambda: "side_scan" in browser.text())
    browser.until(lambda: _played(browser) > 0.3)  # by script: taking pictures holds the player up
    browser.script(PLAYER)
    first = _settled(browser, folder / "saved.png", lambda one: len(cable_pixels(one)) > 200)
    said = browser.text()
    assert "verdict:" in said and "effective tension in the cable" in said
    at = _played(browser)
    browser.script(PLAYER)
    browser.until(lambda: abs(_played(browser) - at) > 0.7)
    browser.script(PLAYER)
    _settled(browser, new=_unlike(first, 0.001, 20))


def _played(browser: Browser) -> float:
    """Seconds that the player of the saved page stands at."""
    return float(browser.script("(document.querySelector('input') || {value: '0'}).value") or 0.0)
