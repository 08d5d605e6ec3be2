"""Stand-in for `launch` and `launch_ros`, where they are not installed: actions keep what they are given, nothing runs.

`modules()` by name; arguments are read from the context, a dictionary. What the files of launch/ use, and no more.
"""

from __future__ import annotations

from types import ModuleType, SimpleNamespace


class Kept:
    """An action: its keyword arguments, and the positional ones as `given`."""

    def __init__(self, *given, **named) -> None:
        self.given, self.named = given, named


class LaunchDescription:
    def __init__(self, entities) -> None:
        self.entities = list(entities)


ACTIONS = ("DeclareLaunchArgument", "OpaqueFunction", "LogInfo", "ExecuteProcess", "RegisterEventHandler")
KINDS = {name: type(name, (Kept,), {}) for name in (*ACTIONS, "OnProcessExit", "Node")}
LogInfo, RegisterEventHandler, Node = KINDS["LogInfo"], KINDS["RegisterEventHandler"], KINDS["Node"]


class ParameterValue:
    def __init__(self, value, *, value_type) -> None:
        self.value, self.value_type = value, value_type


class LaunchConfiguration:
    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context) -> str:
        return context[self.name]


def modules() -> dict[str, ModuleType]:
    """Name -> module, for sys.modules."""
    has = {
        "launch": (LaunchDescription,),
        "launch.actions": [KINDS[name] for name in ACTIONS],
        "launch.substitutions": (LaunchConfiguration,),
        "launch.event_handlers": (KINDS["OnProcessExit"],),
        "launch_ros": (),
        "launch_ros.actions": (Node,),
        "launch_ros.parameter_descriptions": (ParameterValue,),
    }
    made = {}
    for name, kinds in has.items():
        made[name] = ModuleType(name)
        for kind in kinds:
            setattr(made[name], kind.__name__, kind)
    return made


def exited(code: int) -> SimpleNamespace:
    """The event of a process that has ended."""
    return SimpleNamespace(returncode=code)
