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
__all__ = [*_FACE, "__version__"]

if TYPE_CHECKING:  # each by its own name: the face of a typed package
    from .api import Simulator as Simulator
    from .errors import CableSimError as CableSimError
    from .io.bags.bag import BagReader as BagReader
    from .io.recordings.recorded_run import load_run as load_run
    from .io.scenes.load import SceneWarning as SceneWarning
    from .io.scenes.load import load_scene as load_scene
    from .io.scenes.load import override as override
    from .io.scenes.load import scene_from_dict as scene_from_dict
    from .io.scenes.ship_plan import ShipPlan as ShipPlan
    from .io.scenes.winch_plan import WinchPlan as WinchPlan
    from .runs.controller import ControllerError as ControllerError
    from .runs.offline import replay as replay
    from .runs.offline import run as run
    from .runs.sources import motion_of_bag as motion_of_bag
    from .sim.inputs import FlapCommand as FlapCommand
    from .sim.inputs import ShipMotion as ShipMotion
    from .sim.inputs import VehicleMotion as VehicleMotion
    from .sim.inputs import WinchCommand as WinchCommand
    from .sim.rig.rig import Rig as Rig
    from .tools.spans.in_time.wake_run import run_span as run_span


def __getattr__(name: str) -> object:
    """Import a name of the public face."""
    if name not in _FACE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(_FACE)}")
    import_module(f"{__name__}.start").check()
    value = globals()[name] = getattr(import_module(f"{__name__}.{_FACE[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_FACE})
