"""A shipboard tow simulated in real time: ANCF cable, drum and sheave contact, moving water, ROS 2.

The names a user needs are here, each imported when it is first used: the package alone loads neither the compiler
nor ROS.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .version import __version__ as __version__

_FACE = {  # name -> module
    "BagReader": "io.bags.bag",
    "CableSimError": "errors",
    "ControllerError": "runs.controller",
    "FlapCommand": "sim.inputs",
    "Rig": "sim.rig.rig",
    "SceneWarning": "io.scenes.load",
    "ShipMotion": "sim.inputs",
    "VehicleMotion": "sim.inputs",
    "ShipPlan": "io.scenes.ship_plan",
    "Simulator": "api",
    "WinchCommand": "sim.inputs",
    "WinchPlan": "io.scenes.winch_plan",
    "load_run": "io.recordings.recorded_run",
    "load_scene": "io.scenes.load",
    "motion_of_bag": "runs.sources",
    "override": "io.scenes.load",
    "replay": "runs.offline",
    "run": "runs.offline",
    "run_span": "tools.spans.in_time.wake_run",
    "scene_from_dict": "io.scenes.load",
}
__all__ = [
    "BagReader",
    "CableSimError",
    "ControllerError",
    "FlapCommand",
    "Rig",
    "SceneWarning",
    "ShipMotion",
    "VehicleMotion",
    "ShipPlan",
    "Simulator",
    "WinchCommand",
    "WinchPlan",
    "__version__",
    "load_run",
    "load_scene",
    "motion_of_bag",
    "override",
    "replay",
    "run",
    "run_span",
    "scene_from_dict",
]

if TYPE_CHECKING:
    from .api import Simulator
    from .errors import CableSimError
    from .io.bags.bag import BagReader
    from .io.recordings.recorded_run import load_run
    from .io.scenes.load import SceneWarning, load_scene, override, scene_from_dict
    from .io.scenes.ship_plan import ShipPlan
    from .io.scenes.winch_plan import WinchPlan
    from .runs.controller import ControllerError
    from .runs.offline import replay, run
    from .runs.sources import motion_of_bag
    from .sim.inputs import FlapCommand, ShipMotion, VehicleMotion, WinchCommand
    from .sim.rig.rig import Rig
    from .tools.spans.in_time.wake_run import run_span


def __getattr__(name: str) -> object:
    """Import a name of the public face."""
    if name not in _FACE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(_FACE)}")
    import_module(f"{__name__}.start").check()
    value = globals()[name] = getattr(import_module(f"{__name__}.{_FACE[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_FACE})
