"""The tow under FMI 3, run by the binary of pythonfmu3 inside an FMU; cable_sim_ros is that of the interpreter."""

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

from cable_sim_ros.tools.fmu.slave import TowSlave, limits_of, variables
from cable_sim_ros.tools.fmu.variables import UNITS

KINDS = {"Real": Float64, "Integer": Int32, "Boolean": Boolean, "String": String}


class CableSimTow(TowSlave, Fmi3Slave):
    """One instance of the FMU."""

    FMI, STATUS, DefaultExperiment = 3, Fmi3Status, DefaultExperiment

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
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

    def do_step(self, current_time, step_size):
        """One communication step; fmi3Discard where it is refused."""
        if self.stepped(current_time, step_size):
            return Fmi3StepResult(status=Fmi3Status.ok)
        return Fmi3StepResult(status=Fmi3Status.discard, terminateSimulation=bool(self.tow.problem))
