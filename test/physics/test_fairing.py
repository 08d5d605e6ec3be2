"""Fairing presets: which law and coefficients they give, what they weigh, and which keys stand above them."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros.physics.ancf import (
    ADDED_MASS,
    BUOYANCY,
    CD_FIXED,
    COMPRESSION,
    DISPLACED,
    FN,
    FT,
    HALF_RHO_D,
    MASS_PER_LENGTH,
    RE_FACTOR,
    ROWS,
    WEIGHT_PER_LENGTH,
)
from cable_sim_ros.physics.cable_assembly import Cable, Section
from cable_sim_ros.physics.drag_laws import DragLaw
from cable_sim_ros.physics.fairing import PRESETS, Fairing, dressed, fairing_weight
from cable_sim_ros.physics.section import Material
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.tables.material import material_rows

pytestmark = pytest.mark.check

WATER, GRAVITY, D = Water(), 9.81, 0.02
STRIPPED = {"fairing_mass": 0.0, "fairing_net_weight": 0.0}


def rows(**keys) -> np.ndarray:
    section = Section(length=1.0, elements=1, **keys)
    cable = Cable(diameter=D, mass_per_length=0.9, axial_stiffness=1e6, sections={"all": section})
    return material_rows(cable, section, WATER, GRAVITY)


def test_without_keys_a_section_is_bare():
    assert dressed(Section(length=1.0)).drag_law is DragLaw.DRISCOLL_NAHON
    assert (rows() == rows(fairing="none", drag_law="driscoll_nahon", tangential_coefficient=0.0)).all()


def test_ribbon_without_its_weight_is_the_law_ribbon():
    assert (rows(fairing="ribbon", **STRIPPED) == rows(drag_law="ribbon")).all()


@pytest.mark.parametrize("fairing", Fairing)
def test_weight(fairing):
    """Dry mass by volume and density, net weight less the water it displaces; on top of the bare cable's."""
    preset, bare, own = PRESETS[fairing], rows(), rows(fairing=fairing)
    area = 0.25 * np.pi * D**2 * preset.volume
    assert own[MASS_PER_LENGTH] - bare[MASS_PER_LENGTH] == pytest.approx(area * preset.density, abs=1e-12)
    assert own[BUOYANCY] - bare[BUOYANCY] == pytest.approx(area * WATER.density * GRAVITY, rel=1e-9, abs=1e-12)
    assert own[WEIGHT_PER_LENGTH] == pytest.approx(own[MASS_PER_LENGTH] * GRAVITY, rel=1e-15)


def test_airfoil_at_right_angles():
    """rho/2 t C_D with the thickness of 1.25 diameters."""
    own = rows(fairing="airfoil")
    normal = own[FN : FN + 5] @ (1.0, 0.0, 1.0, -1.0, 0.0)
    assert own[HALF_RHO_D] * own[CD_FIXED] * normal == pytest.approx(0.5 * WATER.density * 1.25 * D * 0.2, rel=1e-12)
    assert own[RE_FACTOR] == pytest.approx(1.25 * rows()[RE_FACTOR], rel=1e-12)
    assert own[ADDED_MASS] == pytest.approx(WATER.density * 0.25 * np.pi * (1.25 * D) ** 2, rel=1e-12)


def test_airfoil_along_the_stream_has_the_friction_of_its_wetted_surface():
    """C_t = 2.1 c/t C_f on the thickness: the perimeter of 2.1 chords times the friction of a plate."""
    own = rows(fairing="airfoil")
    along = own[FT : FT + 6].sum()  # every cosine is 1 there, every sine 0
    force = own[HALF_RHO_D] * own[CD_FIXED] * along
    assert force == pytest.approx(0.5 * WATER.density * 2.1 * 4.0 * 1.25 * D * 0.0055, rel=1e-12)


def test_hair_drags_more_than_a_still_bare_cable_and_ribbon_along_it():
    own = rows(fairing="hair")
    assert own[CD_FIXED] == 1.6 and (own[FN:COMPRESSION] == rows(drag_law="ribbon")[FN:COMPRESSION]).all()
    assert own[BUOYANCY] == pytest.approx(GRAVITY * own[DISPLACED]), "Archimedes, with the volume of the hair"
    assert own[DISPLACED] > WATER.density * 0.25 * np.pi * D**2


@pytest.mark.parametrize(
    "key, value", [("drag_law", "pode"), ("drag_coefficient", 0.3), ("tangential_coefficient", 0.01)]
)
def test_a_key_stands_above_the_preset(key, value):
    own = dressed(Section(length=1.0, fairing="airfoil", **{key: value}))
    preset = dressed(Section(length=1.0, fairing="airfoil"))
    for name in ("drag_law", "drag_coefficient", "tangential_coefficient"):
        assert getattr(own, name) == (value if name == key else getattr(preset, name))


def test_weight_keys_stand_above_the_preset():
    assert fairing_weight(Section(length=1.0, fairing="hair", fairing_mass=2.0), D, 1000.0, 10.0) == pytest.approx(
        (2.0, 20.0 * (1.0 - 1000.0 / 1380.0))
    )
    both = Section(length=1.0, fairing="hair", fairing_mass=2.0, fairing_net_weight=-3.0)
    assert fairing_weight(both, D, 1000.0, 10.0) == (2.0, -3.0)


def test_a_section_may_be_of_another_cable():
    """Each material key of the section in place of the cable's, to the bit that of a cable of its own."""
    other = {
        "diameter": 0.03,
        "mass_per_length": 2.0,
        "axial_stiffness": 3e6,
        "compression_share": 0.5,
        "bending_stiffness": 4.0,
        "axial_damping": 5.0,
        "bending_damping": 0.6,
        "added_mass_coefficient": 1.5,
    }
    assert {*other, "breaking_load"} == set(Material.model_fields), "the load is for the verdict alone"
    section = Section(length=1.0, elements=1, **other)
    mixed = Cable(diameter=D, mass_per_length=0.9, axial_stiffness=1e6, sections={"all": section})
    whole = Cable(**other, sections={"all": Section(length=1.0, elements=1)})
    found = material_rows(mixed, section, WATER, GRAVITY)
    assert (found == material_rows(whole, whole.sections["all"], WATER, GRAVITY)).all() and len(found) == ROWS


def test_a_number_of_a_section_has_the_declaration_of_the_cable():
    for name, field in Material.model_fields.items():
        assert Section.model_fields[name].json_schema_extra == field.json_schema_extra
        assert Section.model_fields[name].description == f"{field.description}; none: that of the cable"


def test_a_section_without_a_mesh_says_so():
    with pytest.raises(ValueError, match="a section has no number of elements, and nobody makes a mesh here; nothing"):
        Section(length=1.0).meshed  # noqa: B018
