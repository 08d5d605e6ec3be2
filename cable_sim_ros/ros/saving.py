"""Save and restore of a session's tow, as files of sim/savefile.py, whatever the time mode.

In real time a restored tow is taken to the present, the cable as it hangs, like one whose clock has jumped: the motion
and the commands of then are over. In lockstep the clock goes back to the saved time with everything that the
simulation and its intake remember, so that the same inputs give the same bits as without the interruption.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..io.memento import taken
from ..physics.inputs import make_inputs
from ..physics.state import NOW
from ..sim import savefile
from ..sim.carry import heading_problem
from ..sim.live import set_live, ways
from ..sim.savefile import SaveError, differences

if TYPE_CHECKING:
    from .session import Session

NODE = "node"  # key of the notes in the file
UNDER_WAY = ("waiting", "running", "halted", "failed")
SECOND = 1_000_000_000


def save(session: Session, path: Path) -> tuple[bool, str]:
    """Write the tow as it is between two ticks: (done, text)."""
    if session.state != "running":
        return False, f"the node is {session.state}: there is no tow under way; nothing was saved"
    sim = session.built_sim
    with session.between_ticks():
        _take_frame(session)
        snapshot = sim.snapshot()
        notes: dict[str, Any] = {"intake": taken(session.intake)}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        savefile.write(path, sim.scene, snapshot, {NODE: notes})
    except (SaveError, OSError) as error:
        return False, str(error)
    return True, f"saved at {int(snapshot['memory'].time.now) / SECOND:.3f} s to {path}"


def restore(session: Session, path: Path) -> tuple[bool, str]:
    """Go on with the tow of a file: (done, text). What cannot be restored leaves the node as it was."""
    if session.state not in UNDER_WAY:
        return False, f"the node is {session.state}: activate it first; nothing was restored"
    sim = session.built_sim
    live = set(ways(sim.scene))
    try:
        saved = savefile.read(path)
        savefile.same_scene(path, saved.scene, sim.scene, but=live)
        arrays = savefile.fitting(path, saved.arrays, sim.snapshot())
    except SaveError as error:
        return False, str(error)
    turned = heading_problem(arrays["memory"], session.heading())
    if turned:
        return False, f"{path}: {turned}; nothing was restored. Turn the ship, or use ~/reset"
    text = f"restored the tow of {int(arrays['memory'].time.now) / SECOND:.3f} s from {path}"
    kept = "; ".join(words for key, words in differences(saved.scene, sim.scene) if key in live)
    if kept:
        text += f"; live parameters stay as they are here: {kept}"
    session.built_loop.stop()
    rings = sim.inputs if session.motion_known else make_inputs()
    _put(session, arrays | {f"inputs_{name}": array.copy() for name, array in rings._asdict().items()})
    session.intake.forget_commands()
    return session.begin_restored(text)


def _put(session: Session, arrays: dict) -> None:
    """The state of a file, under the live parameters of this node."""
    sim = session.built_sim
    sim.restore(arrays)
    scene = sim.scene
    for name in ways(scene):
        if name.startswith("setpoint."):  # these stand in the state, the others in the model
            set_live(sim, name, _value(scene, name))


def _value(scene: Any, name: str) -> Any:
    for part in name.split("."):
        scene = scene[part] if isinstance(scene, dict) else getattr(scene, part)
    return scene


def _take_frame(session: Session) -> None:
    """The newest Frame into the simulator's own output, where a file has it from: the loop writes to a ring."""
    sim, loop = session.built_sim, session.built_loop
    slot = (loop.count - 1) % loop.rows
    if loop.count and int(loop.output.frame[slot]["time"]) == int(sim.state.memory[NOW].time.now):
        for name, array in sim.output._asdict().items():
            array[0] = getattr(loop.output, name)[slot]
