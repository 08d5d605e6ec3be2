"""The tow under FMI 3, run by the binary of pythonfmu3 inside an FMU; cable_sim_ros is that of the interpreter."""

from __future__ import annotations

from pythonfmu3 import (
    Boolean,
    DefaultExperiment,
    Float64,
    Fmi3Causality,
    Fmi3Initial,
    Fmi3Slave,
    Fmi3Status,
    Fmi3StepResult,
    Fmi3Variability,
    Int32,
    String,
    Unit,
)

from cable_sim_ros.errors import CableSimError
from cable_sim_ros.tools.fmu.slave import described, guid_of, limits_of, variables
from cable_sim_ros.tools.fmu.tow import Tow
from cable_sim_ros.tools.fmu.variables import UNITS

KINDS = {"Real": Float64, "Integer": Int32, "Boolean": Boolean, "String": String}


class CableSimTow(Fmi3Slave):
    """One instance of the FMU."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.tow = Tow(self.resources)
        about = self.tow.about
        self.modelName, self.version, self.guid = about["name"], about["version"], guid_of(about, 3)
        self.description, self.license, self.author = described(self.tow), "MIT", "cable_sim_ros"
        self.default_experiment = DefaultExperiment(start_time=0.0, step_size=self.tow.scene.solver.tick)
        self.register_units([Unit(name=name, **exponents) for name, exponents in UNITS.items()])
        self.register_variable(
            Float64(
                "time",
                causality=Fmi3Causality.independent,
                variability=Fmi3Variability.continuous,
                unit="s",
                getter=self.tow.seconds,
                setter=lambda value: None,
            ),
            nested=False,
        )
        for variable in variables(self.tow, KINDS, Fmi3Causality, Fmi3Initial, Fmi3Variability, units=True):
            self.register_variable(variable, nested=False)

    def to_xml(self, model_options=None):
        """The description, with the limits that pythonfmu3 leaves out."""
        root = super().to_xml(model_options or {})
        for variable in root.find("ModelVariables"):
            for key, value in limits_of(self.tow, variable.get("name")).items():
                variable.set(key, value)
        return root

    def setup_experiment(self, start_time):
        """The clock begins."""
        self.tow.begin_at(start_time)

    def exit_initialization_mode(self):
        """Static equilibrium; an error ends the initialization with its text."""
        self.tow.start()
        self._tell()

    def do_step(self, current_time, step_size):
        """One communication step; fmi3Discard with the text in the log where it is refused."""
        try:
            self.tow.step(current_time, step_size)
        except CableSimError as error:
            self.log(str(error), Fmi3Status.error)
            return Fmi3StepResult(status=Fmi3Status.discard, terminateSimulation=bool(self.tow.problem))
        self._tell()
        return Fmi3StepResult(status=Fmi3Status.ok)

    def _tell(self):
        for text in self.tow.said:
            self.log(text, Fmi3Status.warning)
        self.tow.said.clear()

    def _get_fmu_state(self):
        return self.tow.state()

    def _set_fmu_state(self, state):
        self.tow.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state):
        return Tow.to_bytes(state)

    @staticmethod
    def _fmu_state_from_bytes(state):
        return Tow.from_bytes(state)
