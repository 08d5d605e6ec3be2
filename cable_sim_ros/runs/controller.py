"""A controller of the user's own in an offline run: a callable that takes a row and gives commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import RunError
from ..physics.sensor_models import Feedback, Instruments
from ..sim.inputs import FlapCommand, InputError, WinchCommand
from ..sim.tables.attitude import quaternion

if TYPE_CHECKING:
    from .summary import Run

Command = WinchCommand | FlapCommand
Controller = Callable[[np.record], Command | Sequence[Command] | None]  # row of the last tick; None: as it was
SHEAVE = ("sheave_position", "sheave_velocity", "sheave_ahead_rate", "sheave_port_rate", "sheave_up_rate")
WHOLE = 1e-6  # of a tick: a control period nearer to a whole number of ticks is one
NOTHING_DONE = "nothing was simulated"


class ControllerError(RunError):
    """A controller that cannot be asked, raised, or gave what is no command.

    run: what was simulated before, with its tick outputs, figures and recording; None where nothing was. ``__cause__``
    is what the controller raised.
    """

    run: Run | None = None


def alone(winch: object | None, controller: object | None, control_period: float | None, check: bool) -> None:
    """Raise ControllerError for what a controller cannot be given with."""
    if controller is None and control_period is not None:
        raise ControllerError(
            f"control_period = {control_period:g} s was given without a controller: {NOTHING_DONE}. Give both, "
            f"or leave it out"
        )
    if controller is not None and winch is not None:
        raise ControllerError(
            f"controller and winch = {str(winch)!r:.60} both command the winch: {NOTHING_DONE}. Give one of "
            f"them; a controller can follow a plan by the time of its row"
        )
    if controller is not None and check:
        raise ControllerError(
            f"check=True would run a second time, with a controller that remembers the first: {NOTHING_DONE}. "
            "Leave it out, and run again with a new controller and half the `every`"
        )


def shown_for(instruments: Instruments) -> dict[str, str]:
    """Fields of the tick output whose truth a controller that is fed by instruments does not see, and the readings in
    their place."""
    of = {
        "mru": {name: f"mru_{name}" for name in SHEAVE},
        "metering_sheave": {"payout": "metering_payout", "payout_rate": "metering_rate"},
        "encoder": {"payout": "encoder_payout", "payout_counter": "encoder_payout", "payout_rate": "encoder_rate"},
        "load_pin": {"tension": "load_pin_tension"},
        "usbl": {"body_position": "usbl_position"},
    }
    return {k: v for name, fields in of.items() if getattr(instruments, name).on for k, v in fields.items()}


class ControlLoop:
    """Asks a controller once in a control period, between two ticks.

    `left`: ticks until it is asked again; `calls` and `commands` count.
    """

    def __init__(
        self,
        controller: Controller,
        period: float | None,
        tick: float,
        instruments: Instruments | None = None,
        flaps: Mapping[str, int] | None = None,
    ) -> None:
        """period: s, None: every tick; tick: s; instruments: aboard, with what it is fed by; flaps: that it may
        command. Raises ControllerError for a period that is not made of ticks."""
        if not callable(controller):
            raise ControllerError(
                f"controller = {controller!r:.60} is a {type(controller).__name__}, no callable; {NOTHING_DONE}. Give "
                f"a function that takes the row of a tick and returns WinchCommand, FlapCommand, a list of both or None"
            )
        given: object = period  # whatever the user gave
        if given is not None and (isinstance(given, bool) or not isinstance(given, (int, float, np.number))):
            raise ControllerError(
                f"control_period = {period!r:.60} is a {type(period).__name__}, no number; {NOTHING_DONE}. Give seconds"
            )
        ticks = 1.0 if period is None else period / tick
        if not 1.0 - WHOLE <= ticks < 2**31 or abs(ticks - round(ticks)) > WHOLE:
            raise ControllerError(
                f"control_period = {period:g} s is no whole number of ticks of {tick:g} s; {NOTHING_DONE}. Give a "
                f"multiple of {tick:g} s, or another length of the ticks with `every`"
            )
        self.controller, self.ticks, self.tick, self.flaps = controller, round(ticks), tick, flaps or {}
        fed = instruments is not None and instruments.feed is Feedback.INSTRUMENTS
        self.seen = shown_for(instruments) if instruments is not None and fed else {}
        self.depth = instruments is not None and fed and instruments.depth.on
        self.attitude = instruments is not None and fed and instruments.fish_attitude.on
        self.left = self.calls = self.commands = 0

    @property
    def maximum(self) -> int:
        """Ticks that may be simulated before it is asked."""
        return self.left or self.ticks

    def ask(self, row: np.record, now: int, begin: int) -> list[Command]:
        """Its commands on the row of the last tick, if it is due; now, begin: ns, of the present and of the run.

        A row of another time, after a jump of the clock, is not shown: the controller is asked a tick later. Raises
        ControllerError.
        """
        if self.left:
            return []
        if int(row["time"]) != now:
            self.left = 1
            return []
        self.left = self.ticks
        self.calls += 1
        where = f"controller, after {(now - begin) * 1e-9:.3f} s of the run"
        try:
            given = self.controller(self.as_seen(row))
        except Exception as error:
            raise ControllerError(
                f"{where}: raised {type(error).__name__}: {error}. The run ended there; correct the controller. What "
                f"was simulated before is `run` of this error"
            ) from error
        several: Sequence[object] = [] if given is None else given if isinstance(given, (list, tuple)) else [given]
        return [self._check(command, now, where) for command in several]

    def _check(self, command: object, now: int, where: str) -> Command:
        if not isinstance(command, (WinchCommand, FlapCommand)):
            raise ControllerError(
                f"{where}: returned {command!r:.60}, a {type(command).__name__} and no command. "
                f"The run ended there; return WinchCommand(rate=...) in m/s or WinchCommand(payout=...) in m, positive "
                f"out, FlapCommand(angles=...) in rad, a list of both, or None to leave the commands before"
            )
        try:
            replace(command)  # one that was changed after it was made is checked again
            if isinstance(command, FlapCommand):
                command.row(self.flaps)
        except InputError as error:
            raise ControllerError(f"{where}: returned what is no command. {error}. The run ended there") from error
        until = now + round(self.ticks * self.tick * 1e9)
        if command.time_ns is not None and not now < command.time_ns <= until:
            raise ControllerError(
                f"{where}: returned {type(command).__name__}.time_ns = {command.time_ns} ns, outside ({now}, {until}] "
                f"ns, the control period that begins. The run ended there; leave time_ns out, a command then counts at "
                f"once; a dead time of the drive is winch.command_delay of the scene"
            )
        self.commands += 1
        return command

    def as_seen(self, row: np.record) -> np.record:
        """A copy of the row, in which readings stand for what an instrument aboard measures."""
        row = row.copy()
        for field, reading in self.seen.items():
            row[field] = row[reading]
        if self.depth:
            row["body_position"][2] = -row["depth_reading"]
        if self.attitude:
            row["body_quaternion"] = quaternion(
                np.array([row[f"fish_{name}"] for name in ("roll", "pitch", "heading")])
            )
        return row

    def metrics(self) -> dict[str, float | int]:
        """For the JSON of a run."""
        return {"period_s": self.ticks * self.tick, "calls": self.calls, "commands": self.commands}
