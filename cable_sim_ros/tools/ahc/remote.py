"""A controller of somebody else in a process of its own: it sees what it is sent, has a time to answer, and its end is
not that of the run. It cannot reach simulator, figures or twin."""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ...errors import CableSimError
from ...files import regular
from ...physics.tick_output import TICK_OUTPUT
from ...processes import ForkServer
from ...sim.inputs import FlapCommand, WinchCommand
from ...sim.scene import Scene

ANSWER = 20.0  # s of the clock for one answer, or for making the controller: more is no answer
LOADED, MADE, ASKED = "loaded", "made", "asked"
Maker = Callable[[Any, float], Callable[[Any], Any]]


class AhcError(CableSimError, ValueError):
    """What the benchmark cannot be run, merged or checked with."""


class Heard(NamedTuple):
    """What a controller hears on the track for prediction: a reading of the MRU, at base_link, in its axes (forward, to
    port, up; roll positive port up, pitch bow down), without the ship's mean velocity. time: ns, of now."""

    time: int
    surge: float
    sway: float
    heave: float
    surge_rate: float
    sway_rate: float
    heave_rate: float
    roll: float
    pitch: float
    roll_rate: float
    pitch_rate: float

    def __getattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"{name} is not heard on this track; an MRU gives {', '.join(self._fields[1:])}")


READINGS = tuple(f"mru_{name}" for name in Heard._fields[1:])


class Rig(NamedTuple):
    """What it knows beforehand: sheave [m, from the MRU], departure angle [rad, from the downward vertical] and pay-out
    [m] at rest, tow speed [m/s]; dead time of the drive and latency of the MRU [s], period [s] and damping ratio of its
    high-pass; limits of the winch [m/s, m/s^2]. No waves, no seed, no motion."""

    name: str
    sheave: tuple[float, float, float]
    angle: float
    payout: float
    tow_speed: float
    dead_time: float
    latency: float
    heave_period: float
    heave_damping: float
    max_rate: float
    max_acceleration: float


def rig_of(scene: Scene, row: np.record) -> Rig:
    """Of a scene whose first tick output is this one."""
    mru, winch = scene.instruments.mru, scene.winch
    x, y, z = (float(a - b) for a, b in zip(scene.sheave.position, mru.position, strict=True))
    return Rig(
        scene.name,
        (x, y, z),
        float(row["departure_angle"]),
        float(row["payout"]),
        scene.ship.tow_speed,
        scene.drive.dead_time,
        mru.latency,
        mru.heave_period,
        mru.heave_damping,
        winch.max_rate,
        winch.max_acceleration,
    )


class Remote:
    """Controller of a run, ``file.py:make`` in a process of its own: called with a row it returns commands.

    Raises AhcError where the file cannot be loaded, and what the controller raises, by name and text, in a call."""

    def __init__(self, text: str) -> None:
        context = ForkServer()
        context.set_forkserver_preload([__name__])
        self.line, other = context.Pipe()
        self.text = text
        self.rig: Rig | None = None
        self.process = context.Process(target=_serve, args=(other, text), daemon=True)
        self.process.start()
        other.close()
        try:
            self.answer(LOADED)
        except Exception as error:
            self.close()
            raise _named(error, f"--controller {text}", "; nothing was run. Correct it") from None

    def begin(self, scene: Scene, period: float, heard: bool) -> Remote:
        """The controller for a run; heard: it gets the rig and the readings of the MRU alone. Raises AhcError."""
        self.scene, self.period, self.heard = scene, period, heard
        if not heard:
            self._make(scene)
        return self

    def _make(self, at: Scene | Rig) -> None:
        try:
            self.line.send((at, self.period))
            self.answer(MADE)
        except Exception as error:
            raise _named(error, f"--controller {self.text}: for {at.name}") from None

    def __call__(self, row: np.record) -> list[WinchCommand | FlapCommand]:
        """Its commands on a row of tick output."""
        if self.heard and not self.rig:
            self.rig = rig_of(self.scene, row)
            self._make(self.rig)
        readings = (int(row["time"]), *(float(row[name]) for name in READINGS))
        with suppress(OSError):  # its end is said below
            self.line.send(readings if self.heard else row.tobytes())
        return [
            WinchCommand(payout=a, rate=b, time_ns=at) if kind == "winch" else FlapCommand(angles=a, time_ns=at)
            for kind, a, b, at in self.answer(ASKED)
        ]

    def answer(self, what: str) -> Any:
        """What it says within ANSWER; raises its error, TimeoutError or ChildProcessError."""
        try:
            if not self.line.poll(ANSWER):
                raise TimeoutError(f"gave no answer within {ANSWER:g} s")
            said = json.loads(self.line.recv_bytes())
        except (EOFError, ConnectionError, ValueError):
            self.process.join(1.0)
            raise ChildProcessError(f"its process ended without an answer (code {self.process.exitcode})") from None
        if said[0] == what:
            return said[1]
        if said[0] == "AhcError":
            raise AhcError(said[1])
        raise type(str(said[0]), (Exception,), {})(said[1])

    def close(self) -> None:
        """End its process."""
        self.process.kill()
        self.process.join()
        self.line.close()


def _named(error: Exception, where: str, remedy: str = "") -> AhcError:
    return error if isinstance(error, AhcError) else AhcError(f"{where}: {error}{remedy}")


def _serve(line: Connection, text: str) -> None:
    """In the process: load, make, answer until the line is closed."""
    os.dup2(2, 1)  # standard output belongs to the figures
    try:
        maker = maker_of(text)
        _say(line, LOADED, None)
        scene, period = line.recv()
        controller = _controller(maker, text, scene, period)
        _say(line, MADE, None)
        while True:
            seen = line.recv()
            row = Heard(*seen) if isinstance(seen, tuple) else np.frombuffer(seen, TICK_OUTPUT).view(np.recarray)[0]
            _say(line, ASKED, _plain(controller(row)))
    except (EOFError, BrokenPipeError):
        pass  # the run has ended
    except BaseException as error:  # whatever the file of the user does
        with suppress(OSError):
            _say(line, type(error).__name__, str(error))


def _say(line: Connection, what: str, data: Any) -> None:
    line.send_bytes(json.dumps((what, data)).encode())


def _plain(given: Any) -> list[tuple]:
    """Commands as JSON has them: nothing of a stranger's is unpickled."""
    several = [] if given is None else given if isinstance(given, (list, tuple)) else [given]
    found: list[tuple] = []
    for one in several:
        if isinstance(one, WinchCommand):
            found.append(("winch", one.payout, one.rate, one.time_ns))
        elif isinstance(one, FlapCommand):
            found.append(("flaps", dict(one.angles), None, one.time_ns))
        else:
            raise TypeError(f"returned {one!r:.60}, a {type(one).__name__} and no command; return a WinchCommand")
    return found


def maker_of(text: str) -> Maker:
    """The function ``make(scene, period)`` of ``my_file.py:make``, beside which it may import. Raises AhcError."""
    file, colon, name = text.rpartition(":")
    remedy = "Give FILE.py:NAME of a function make(scene, period) that returns a controller(row)"
    if not colon or not file or not name.isidentifier():
        raise AhcError(f"--controller {text}: is no FILE.py:NAME; nothing was run. {remedy}")
    try:
        path = regular(file)
    except FileNotFoundError:
        raise AhcError(f"--controller {text}: there is no file {file}; nothing was run. {remedy}") from None
    spec = importlib.util.spec_from_file_location(f"ahc_controller_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise AhcError(f"--controller {text}: {file} is no Python file; nothing was run. {remedy}")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(Path(path).resolve().parent))
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever the file of the user does
        raise AhcError(
            f"--controller {text}: {file} raised {type(error).__name__}: {error}; nothing was run. Correct it"
        ) from error
    made: Any = getattr(module, name, None)
    if not callable(made):
        what = "has no" if made is None else f"has no function but a {type(made).__name__}"
        raise AhcError(f"--controller {text}: {file} {what} {name}; nothing was run. {remedy}")
    return made


def _controller(maker: Maker, text: str, scene: Scene | Rig, period: float) -> Callable[[Any], Any]:
    try:
        made = maker(scene, period)
    except Exception as error:  # whatever the function of the user does
        raise AhcError(
            f"--controller {text}: for {scene.name} it raised {type(error).__name__}: {error}. It is called with the "
            f"scene and the control period [s]"
        ) from error
    if not callable(made):
        raise AhcError(
            f"--controller {text}: for {scene.name} it returned a {type(made).__name__}, no callable. Return a "
            f"controller(row) that returns a WinchCommand or None"
        )
    return made
