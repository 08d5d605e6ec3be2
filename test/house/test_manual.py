"""The committed pages of the manual are those the declarations give."""

import re
from pathlib import Path

import pytest

import cable_sim_ros
from cable_sim_ros import testing
from cable_sim_ros.cli.commands import fields_text, manual_text
from cable_sim_ros.io.messages.channels import EVERY
from cable_sim_ros.physics.parameter import declared
from cable_sim_ros.physics.tick_output import BODY_COLUMNS, CONTACT_COLUMNS, FIELDS, SHAPE_COLUMNS, STRUM_COLUMNS
from cable_sim_ros.runs import field_manual
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.tools.logs.imports.mapping_manual import text as mapping_text

pytestmark = pytest.mark.check

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.parametrize(
    "page, text", [("parameters", manual_text), ("fields", fields_text), ("mapping_keys", mapping_text)]
)
def test_the_manual_is_up_to_date(page, text):
    assert (DOCS / f"{page}.md").read_text("utf-8") == text(), f"run: cable-sim manual {page} --out docs/{page}.md"


def test_the_manual_names_every_parameter_with_its_unit():
    text = manual_text()
    for item in declared(Scene):
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{item.key}` |")]
        assert f"| {item.unit} |" in row or item.unit in ("", "1"), row


def test_the_fields_have_shape_and_unit():
    rows = fields_text().partition("## Tables")[0].splitlines()
    for name, shape, kind, unit, meaning in FIELDS:
        (row,) = [line for line in rows if line.startswith(f"| `{name}` |")]
        cells = row.strip("| ").split(" | ")
        assert cells[1] == {"i8": "int64", "f8": "float64"}[kind] + (f" [{shape[0]}]" if shape else "")
        assert cells[2] == unit.replace("1", "-") and cells[3] == meaning


def test_the_columns_of_the_tables_have_a_meaning_and_no_meaning_is_left_over():
    columns = {name for table in (SHAPE_COLUMNS, CONTACT_COLUMNS, STRUM_COLUMNS, BODY_COLUMNS) for name, _ in table}
    assert columns <= set(field_manual.MEANING)
    assert {name for name in field_manual.MEANING if not name.startswith("slope_")} == columns


def test_the_topics_that_have_a_field_are_found_by_reading_them_back():
    also = field_manual.beside()
    assert also["payout"] == ["`winch/state`"] and also["body_position"] == ["`towbody/pose`", "`towbody/odom`"]
    assert also["penetration"] == []
    recording = fields_text().partition("## Topics of a recording")[2]
    assert all(f"\n| `{channel.topic}` |" in recording for channel in EVERY)


@pytest.mark.parametrize("module", [cable_sim_ros, testing], ids=lambda module: module.__name__)
def test_every_public_name_stands_on_its_page(module):
    """Its row in the table, and the comment from which the site makes its reference."""
    page = (DOCS / "python.md").read_text("utf-8")
    names = [name for name in module.__all__ if not name.startswith("__")]
    assert names
    for name in names:
        assert f"\n| `{name}` |" in page, name
        assert f" {module.__name__}.{name}" in page.partition("## In full")[2], name


def errors(kind):
    """A class and all below it, by name."""
    found = {kind.__name__: kind}
    for below in kind.__subclasses__():
        found |= errors(below)
    return found


def test_errors_have_the_exit_codes_of_the_page():
    assert cable_sim_ros.Simulator and cable_sim_ros.run  # with these all of them are loaded
    known = errors(cable_sim_ros.CableSimError)
    rows = re.findall(r"^\| (\d) \| (.+) \|$", (DOCS / "python.md").read_text("utf-8"), re.M)
    assert {code for code, _ in rows} == {"1", "2"}
    for code, text in rows:
        for name in re.findall(r"`(\w+)`", text):
            assert known[name].exit_code == int(code), name
