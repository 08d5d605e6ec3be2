"""The tow under FMI 2, run by the binary of pythonfmu inside an FMU; cable_sim_ros is that of the interpreter."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from cable_sim_ros.tools.fmu.slave import TowSlave, limits_of, rows, variables
from cable_sim_ros.tools.fmu.variables import UNITS

KINDS = {"Real": Real, "Integer": Integer, "Boolean": Boolean, "String": String}


class CableSimTow(TowSlave, Fmi2Slave):
    """One instance of the FMU."""

    FMI, STATUS, DefaultExperiment = 2, Fmi2Status, DefaultExperiment

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
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

    def do_step(self, current_time, step_size):
        """One communication step; fmi2Discard where it is refused."""
        return self.stepped(current_time, step_size)
