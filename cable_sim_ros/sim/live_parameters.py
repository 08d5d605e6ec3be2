"""Parameters that may change between two ticks: the one list of them, and how each reaches the compiled model.

A parameter is declared live by configure=False; a test holds the declarations and this list together.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from functools import partial, reduce
from math import radians
from operator import attrgetter, getitem
from typing import Any

from ..physics.contact_surface import SHEAVE_ROW, rub_sheave
from ..physics.flaps import put_flap
from ..physics.heave_compensation import SetpointLaw
from ..physics.sensor_models import TARGETS
from ..physics.state import NOW
from ..physics.winch_drive import MODES, WinchMode
from .checks.attitude_checks import attitude_problems
from .checks.drive_checks import feed_forward_problems, mode_problems
from .checks.instrument_checks import fault_problems, feed_problems
from .scene import Scene
from .simulator import Simulator, StartError
from .tables.material import bodies_of
from .tables.rigid_tables import wings_of
from .tables.sensor_tables import put_fault

Way = Callable[[Simulator, Any], None]


def _state(block: str, field: str) -> Way:
    """A number in the present memory of the state."""
    return lambda sim, value: setattr(attrgetter(block)(sim.state.memory[NOW]), field, value)


def _rows(table: str, *way: str | slice) -> Way:
    """A column of a table of the model, which is locked while kernels run."""

    def put(sim: Simulator, value: Any) -> None:
        array = attrgetter(table)(sim.model)
        array.setflags(write=True)
        try:
            reduce(getitem, way, array)[...] = value
        finally:
            array.setflags(write=False)

    return put


def _drive_mode(sim: Simulator, value: Any) -> None:
    _rows("settings", "drive", "mode")(sim, MODES.index(WinchMode(value)))


def _sheave(sim: Simulator, _: float) -> None:
    rub_sheave(sim.state.surfaces[SHEAVE_ROW], sim.scene.sheave)


def _flap(sim: Simulator, value: float, row: int, body: int) -> None:
    begins = radians(value)
    _rows("line.rigid.wings", "begins", slice(row, row + 1))(sim, begins)
    put_flap(sim.state, body, row - int(sim.model.line.rigid.bodies[body]["wings"][0]), begins)


def _fault(sim: Simulator, _: Any, target: str) -> None:
    put_fault(sim.state, sim.scene, target)


def ways(scene: Scene) -> dict[str, Way]:
    """Live parameters of a scene by dotted name, and what each does to a simulator whose tick is not running."""
    table: dict[str, Way] = {
        "drive.mode": _drive_mode,
        "drive.set_pull": _rows("settings", "drive", "set_pull"),
        "setpoint.algorithm": lambda sim, value: sim.set_algorithm(value),
        "setpoint.feed_forward": _state("setpoint.feed_forward", "on"),
        "setpoint.prediction": _state("setpoint.prediction", "on"),
        "setpoint.tension": _state("setpoint.tension", "wanted"),
        "setpoint.washout_period": _state("setpoint", "washout"),
        "sheave.bearing_friction": _sheave,
        "sheave.friction": _sheave,
        "viv.multiplier": _rows("line.strum.rules", "multiplier"),
        "winch.command_timeout": _rows("settings", "drum", "timeout"),
    }
    for target in TARGETS:
        table[f"faults.{target}.kind"] = table[f"faults.{target}.size"] = partial(_fault, target=target)
    for place, name in enumerate(bodies_of(scene)):
        table[f"{name}.flow_time_constant"] = _rows("line.bodies", "flow_time", slice(place, place + 1))
    for row, one in enumerate(wings_of(scene)):
        table[f"{one.key}.wings.{one.name}.flap"] = partial(_flap, row=row, body=one.body)
    return table


def set_live(sim: Simulator, name: str, value: Any) -> None:
    """Give a live parameter another value, in the scene of the simulator too, so that a start keeps it.

    Call it between two ticks. Raises KeyError with the reason for a parameter that is not live, ValueError for one out
    of its range or that drive or instruments cannot serve.
    """
    if name not in (live := ways(sim.scene)):
        raise KeyError(_not_live(sim.scene, name, live))
    if refusal := unfit(changed(sim.scene, name, value)):
        raise ValueError(refusal)
    put_live(sim, name, value)


def _not_live(scene: Scene, name: str, live: Iterable[str]) -> str:
    """Why a key cannot be changed while the tow runs, and what can."""
    block: Any = scene.model_dump(mode="json")
    for part in name.split("."):
        block = block.get(part, block) if isinstance(block, dict) and part in block else None
    if block is None:
        near = difflib.get_close_matches(name, live, 3, 0.6)
        return f"{name}: is no key of {scene.name}; nothing was changed. Live keys are {', '.join(near or live)}"
    return (
        f"{name} = {block}: is fixed, for mesh, static start or compiled model are made from it; nothing was changed. "
        "Give it in the scene and start anew (`override` of cable_sim_ros.io.scenes.load, `--set` of a command). Live "
        f"keys are {', '.join(live)}"
    )


def put_live(sim: Simulator, name: str, value: Any) -> None:
    """As set_live, for one of several values that were checked together."""
    way = ways(sim.scene)[name]
    sim.scene = changed(sim.scene, name, value)
    way(sim, value)


def unfit(scene: Scene) -> str:
    """ "" or why live values of a scene do not serve together."""
    block = scene.setpoint
    written = block.tension_gain is not None or block.tension_return_time is not None
    if written and block.algorithm is SetpointLaw.CONSTANT_TENSION:
        try:
            Simulator(scene).start()
        except StartError as error:
            return str(error).replace("nothing was started", "nothing was changed")
    problems = *mode_problems(scene), *feed_problems(scene), *fault_problems(scene), *feed_forward_problems(scene)
    problems += (*attitude_problems(scene),)
    for problem in problems:
        return f"{problem.key} {problem.text}; nothing was changed. {problem.remedy}"
    return ""


def value_of(block: Any, name: str) -> Any:
    """What a block has under a dotted name."""
    for part in name.split("."):
        block = block[part] if isinstance(block, dict) else getattr(block, part)
    return block


def changed(block: Any, name: str, value: Any) -> Any:
    """A block with another value under a dotted name, checked against its declaration."""
    head, _, rest = name.partition(".")
    if not rest:
        return type(block).model_validate(block.model_dump() | {head: value})
    inner = block[head] if isinstance(block, dict) else getattr(block, head)
    new = changed(inner, rest, value)
    return block | {head: new} if isinstance(block, dict) else block.model_copy(update={head: new})
