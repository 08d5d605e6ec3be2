"""What the scripts of both versions of FMI share: the slave, rows of the description, its texts and its token."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any
from uuid import UUID, uuid5

from ...errors import CableSimError
from ...physics.parameter import declaration
from ...sim.scene import Scene
from .tow import Tow
from .variables import INPUTS, OUTPUTS, PARAMETERS, REAL, VEHICLE_INPUTS, VEHICLE_OUTPUTS, Variable

NAMESPACE = UUID("5b6f2f0e-7c58-4a7b-8f0c-0d6f1c8f6a11")


def rows(about: dict[str, Any]) -> list[Variable]:
    """Every variable of an FMU, those of its scene last."""
    found = [*INPUTS, *OUTPUTS, *PARAMETERS]
    if about.get("vehicle"):
        found += [*VEHICLE_INPUTS, *VEHICLE_OUTPUTS]
    for key in about["parameters"]:
        item = declaration(Scene, key)
        meaning = item.doc if item else "number of the scene"
        unit = f" [{item.unit}]" if item and item.unit else ""
        found.append(Variable(key, REAL, "parameter", "", f"{meaning}{unit}"))
    return found


def variables(
    tow: Tow, kinds: Mapping[str, Any], causality: Any, initial: Any, variability: Any, units: bool = False
) -> Iterator[Any]:
    """Every variable as a library of FMI has it: its classes by kind, its enums; units: a Real tells its own."""
    begins = {"output": initial.calculated, "parameter": initial.exact}
    for row in rows(tow.about):
        varies = variability.continuous if row.kind == REAL else variability.discrete
        read = (lambda name=row.name: tow.output(name)) if row.role == "output" else None
        yield kinds[row.kind](
            row.name,
            causality=getattr(causality, row.role),
            initial=begins.get(row.role),
            variability=variability.fixed if row.role == "parameter" else varies,
            description=row.meaning,
            getter=read or (lambda name=row.name: tow.values[name]),
            setter=None if read else (lambda value, name=row.name: tow.set(name, value)),
            **({"unit": row.unit} if units and row.kind == REAL and row.unit else {}),
        )


def limits_of(tow: Tow, name: str) -> dict[str, str]:
    """Attributes min and max of a number of the scene."""
    if name not in tow.about["parameters"]:
        return {}
    item = declaration(Scene, name)
    pairs = (("min", getattr(item, "low", None)), ("max", getattr(item, "high", None)))
    return {key: f"{value:.16g}" for key, value in pairs if value is not None}


def described(tow: Tow) -> str:
    """One sentence for the importing tool."""
    return (
        f"Cable tow of the scene {tow.base.name}: ship motion and winch command in, pull of the cable on the ship and "
        f"towbody out; tick {tow.base.solver.tick:g} s; needs a Python with cable_sim_ros {tow.about['version']}"
    )


class TowSlave:
    """A tow behind the calls of pythonfmu or pythonfmu3, whose slave comes second among the bases."""

    FMI: int
    STATUS: Any  # its enum of states
    DefaultExperiment: Any
    resources: str
    log: Any

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.tow = Tow(self.resources)
        about = self.tow.about
        self.modelName, self.version = about["name"], about["version"]
        # the same for the same scene, version and parameters
        self.guid = uuid5(NAMESPACE, json.dumps([about, self.FMI], sort_keys=True))
        self.description, self.license, self.author = described(self.tow), "MIT", "cable_sim_ros"
        self.default_experiment = self.DefaultExperiment(start_time=0.0, step_size=self.tow.scene.solver.tick)

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        """The clock begins."""
        self.tow.begin_at(start_time)

    def exit_initialization_mode(self):
        """Static equilibrium; an error ends the initialization with its text."""
        self.tow.start()
        self._tell()

    def stepped(self, current_time: float, step_size: float) -> bool:
        """One communication step; False, and the text in the log, where it is refused."""
        try:
            self.tow.step(current_time, step_size)
        except CableSimError as error:
            self.log(str(error), self.STATUS.error)
            return False
        self._tell()
        return True

    def _tell(self):
        for text in self.tow.said:
            self.log(text, self.STATUS.warning)
        self.tow.said.clear()

    def _get_fmu_state(self):
        return self.tow.state()

    def _set_fmu_state(self, state):
        self.tow.restore(state)

    _fmu_state_to_bytes = staticmethod(Tow.to_bytes)
    _fmu_state_from_bytes = staticmethod(Tow.from_bytes)
