"""The tow under FMI 2, run by the binary of pythonfmu inside an FMU; cable_sim_ros is that of the interpreter."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from cable_sim_ros.errors import CableSimError
from cable_sim_ros.tools.fmu.slave import described, guid_of, limits_of, rows, variables
from cable_sim_ros.tools.fmu.tow import Tow
from cable_sim_ros.tools.fmu.variables import UNITS

KINDS = {"Real": Real, "Integer": Integer, "Boolean": Boolean, "String": String}


class CableSimTow(Fmi2Slave):
    """One instance of the FMU."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.tow = Tow(self.resources)
        about = self.tow.about
        self.modelName, self.version, self.guid = about["name"], about["version"], guid_of(about, 2)
        self.description, self.license, self.author = described(self.tow), "MIT", "cable_sim_ros"
        self.default_experiment = DefaultExperiment(start_time=0.0, step_size=self.tow.scene.solver.tick)
        for variable in variables(self.tow, KINDS, Fmi2Causality, Fmi2Initial, Fmi2Variability):
            self.register_variable(variable, nested=False)

    def to_xml(self, model_options=None) -> Element:
        """The description, with what pythonfmu leaves out: units, limits, unknowns of the initialization."""
        root = super().to_xml(model_options or {})
        units = Element("UnitDefinitions")
        for name, exponents in UNITS.items():
            SubElement(SubElement(units, "Unit", name=name), "BaseUnit", {k: str(v) for k, v in exponents.items()})
        root.insert(list(root).index(root.find("CoSimulation")) + 1, units)
        by_name = {row.name: row for row in rows(self.tow.about)}
        unknowns = SubElement(root.find("ModelStructure"), "InitialUnknowns")
        for place, variable in enumerate(root.find("ModelVariables"), 1):
            row, real = by_name[variable.get("name")], variable.find("Real")
            if real is not None:
                real.attrib.update(limits_of(self.tow, row.name) | ({"unit": row.unit} if row.unit else {}))
            if row.role == "output":
                SubElement(unknowns, "Unknown", index=str(place))
        return root

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        """The clock begins."""
        self.tow.begin_at(start_time)

    def exit_initialization_mode(self):
        """Static equilibrium; an error ends the initialization with its text."""
        self.tow.start()
        self._tell()

    def do_step(self, current_time, step_size):
        """One communication step; fmi2Discard with the text in the log where it is refused."""
        try:
            self.tow.step(current_time, step_size)
        except CableSimError as error:
            self.log(str(error), Fmi2Status.error)
            return False
        self._tell()
        return True

    def _tell(self):
        for text in self.tow.said:
            self.log(text, Fmi2Status.warning)
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
