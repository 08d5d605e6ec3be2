"""Save and restore of a session's tow, as files of sim/saved/savefile.py, whatever the time mode.

In real time a restored tow is taken to the present, the cable as it hangs, like one whose clock has jumped: the motion
and the commands of then are over. In lockstep the clock goes back to the saved time with everything that simulation,
intake and steps remember, so that the same inputs give the same bits as without the interruption.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io.motion.arrival_order import Intake
from ..io.motion.clock import DataClock
from ..io.recordings.journal import Start
from ..physics.inputs import make_inputs
from ..physics.state import NOW
from ..sim.live_parameters import put_live, value_of, ways
from ..sim.rebase import heading_problem, place
from ..sim.saved import savefile
from ..sim.saved.savefile import SaveError, differences
from ..sim.simulator import Simulator
from .loop import Loop

NODE = "node"  # key of the notes in the file
UNDER_WAY = ("waiting", "running", "halted", "failed")
SECOND = 1_000_000_000


class Saving:
    """Base of a session."""

    state: str
    problem: str
    clock: DataClock
    intake: Intake
    log: Callable[[str, str], None]
    _cause: str
    _begin_again: Callable[[str], tuple[bool, str]]
    _newest_sample: Callable[[], np.ndarray]

    if TYPE_CHECKING:  # of the session

        @property
        def built_sim(self) -> Simulator: ...

        @property
        def built_loop(self) -> Loop: ...

    def save(self, path: Path) -> tuple[bool, str]:
        """Write the tow as it is between two ticks to a file: (done, text)."""
        if self.state != "running":
            return False, f"the node is {self.state}: there is no tow under way; nothing was saved"
        sim = self.built_sim
        with self.between_ticks():
            self._take_frame()
            snapshot, notes, now = sim.snapshot(), self.notes(), int(sim.state.memory[NOW].time.now)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            savefile.write(path, sim.scene, snapshot, {NODE: notes})
        except SaveError as error:
            return False, str(error)
        except OSError as error:
            return False, f"{path.parent}: cannot be made ({error.strerror}); nothing was saved"
        return True, f"saved at {now / SECOND:.3f} s to {path}"

    def restore(self, path: Path) -> tuple[bool, str]:
        """Go on with the tow of a file: (done, text). What cannot be restored leaves everything as it was."""
        if self.state not in UNDER_WAY:
            return False, f"the node is {self.state}: activate it first; nothing was restored"
        sim = self.built_sim
        live = set(ways(sim.scene))
        try:
            saved = savefile.read(path)
            savefile.same_scene(path, saved.scene, sim.scene, but=live)
            arrays = sim.taken(path, saved)
        except SaveError as error:
            return False, str(error)
        text = f"restored the tow of {int(arrays['memory'].time.now) / SECOND:.3f} s from {path}"
        kept = "; ".join(words for key, words in differences(saved.scene, sim.scene) if key in live)
        if kept:
            text += f"; live parameters stay as they are here: {kept}"
        back = self.go_back(path, arrays, saved.notes.get(NODE))
        if back is not None:
            if back[0]:
                self.log("info", text)
            return back[0], back[1] or f"{text}; the clock goes back to it"
        turned = heading_problem(arrays["memory"], self.heading())
        if turned:
            return False, f"{path}: {turned}; nothing was restored. Turn the ship, or use ~/reset"
        self.built_loop.stop()
        rings = sim.inputs if self.motion_known else make_inputs()
        self.put(arrays | {f"inputs_{name}": array.copy() for name, array in rings._asdict().items()})
        self.intake.forget_commands()
        self._cause = "restore"
        self.log("info", text)
        return self._begin_again(f"{text}; it goes on at the present, and the winch holds until it is commanded")

    def notes(self) -> dict[str, Any]:
        """What a file says beside the state of the simulation, as JSON."""
        return {"lockstep": False}

    def go_back(self, path: Path, arrays: dict[str, np.ndarray], notes: Any) -> tuple[bool, str] | None:
        """Take everything back to the time of a file: (done, problem); None where that cannot be done: real time."""
        return None

    def put(self, arrays: dict[str, np.ndarray]) -> None:
        """The state of a file into the simulator, under the live parameters of this node; no tick runs."""
        sim = self.built_sim
        sim.restore(arrays)
        for name in ways(sim.scene):
            if name.startswith("setpoint."):  # these stand in the state, the others in the model
                put_live(sim, name, value_of(sim.scene, name))

    @property
    def motion_known(self) -> bool:
        """Has motion come, on the clock as it is?"""
        return self.clock.offset is not None

    def heading(self) -> float | None:
        """Yaw of the newest motion, rad; None before the first."""
        return float(self._newest_sample()[5]) if self.motion_known else None

    def between_ticks(self) -> AbstractContextManager[None]:
        """No tick runs meanwhile."""
        return self.built_loop.paused() if self.state == "running" else nullcontext()

    def here(self, cause: str) -> Start:
        """The tow as it is, of a loop that stands."""
        now = self.built_sim.state.memory[NOW]
        return Start(int(now.time.now), place(now), float(now.ship.motion.coord[5]), cause)

    def not_restored(self, heading: float) -> str:
        """ "" or why the tow that was put into the simulator cannot take up motion of this heading [rad]."""
        turned = heading_problem(self.built_sim.state.memory[NOW], heading) if self._cause == "restore" else ""
        return turned and f"not restored: {turned}; nothing is simulated until ~/reset"

    def _take_frame(self) -> None:
        """The newest tick output into the simulator's own output, where a file has it from: the loop writes to a
        ring."""
        sim, loop = self.built_sim, self.built_loop
        slot = (loop.count - 1) % loop.rows
        if loop.count and int(loop.output.frame[slot]["time"]) == int(sim.state.memory[NOW].time.now):
            for name, array in sim.output._asdict().items():
                array[0] = getattr(loop.output, name)[slot]
