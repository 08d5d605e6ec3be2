"""The committed pages of the manual are those the declarations give."""

import re
from pathlib import Path

import pytest

import cable_sim_ros
from cable_sim_ros import testing
from cable_sim_ros.cli.commands import manual_text
from cable_sim_ros.io.messages.channels import EVERY
from cable_sim_ros.io.messages.fault_hypotheses import UNUSED
from cable_sim_ros.io.messages.messages import CAUSES
from cable_sim_ros.physics.parameter import declared
from cable_sim_ros.physics.tick_output import BODY_COLUMNS, CONTACT_COLUMNS, FIELDS, SHAPE_COLUMNS, STRUM_COLUMNS
from cable_sim_ros.runs import field_manual, problem_manual
from cable_sim_ros.runs.metrics import METRICS
from cable_sim_ros.runs.summary import SUMMARY
from cable_sim_ros.sim import flag_rules
from cable_sim_ros.sim.rules import latch
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.terminal import markdown_table
from cable_sim_ros.tools.logs.imports.mapping_manual import text as mapping_text
from cable_sim_ros.tools.plan.plan import NEEDS
from cable_sim_ros.tools.spans.in_frequency import files
from cable_sim_ros.tools.spans.in_time import wake_run

pytestmark = pytest.mark.check

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.parametrize(
    "page, text",
    [
        ("parameters", manual_text),
        ("fields", field_manual.text),
        ("problems", problem_manual.text),
        ("causes", problem_manual.causes_text),
        ("mapping_keys", mapping_text),
    ],
)
def test_the_manual_is_up_to_date(page, text):
    assert (DOCS / f"{page}.md").read_text("utf-8") == text(), f"run: cable-sim manual {page} --out docs/{page}.md"


def test_every_cause_is_a_refusal_with_a_remedy_or_an_event():
    assert set(problem_manual.EVENTS) == {cause for cause, text in CAUSES.items() if not text}
    rows = re.findall(r"^\| `(\w+)` \|(.*) \|", problem_manual.causes_text(), re.M)
    assert {cause for cause, _ in rows} == set(CAUSES)
    assert not [said for _, said in rows if "dropped" in said or UNUSED in said]


def plain(*rows):
    """Rows of name, unit and meaning."""
    return ("field", "unit", "meaning"), *((f"`{name}`", unit * (unit != "1"), meaning) for name, unit, meaning in rows)


SETS = ("BODY", "COMPENSATED", "SEAWAY", "TENSION", "PEAKS", "CONTACT", "ATTITUDE", "WINCH")  # the larger first


def named(metrics):
    """Figures by the names of their sets, else by their own."""
    left, names = list(dict.fromkeys(metrics)), []
    for name in SETS:
        if set(whole := getattr(flag_rules, name)) <= set(left):
            names.append(name.lower())
            left = [metric for metric in left if metric not in whole]
    return ", ".join([*names, *(f"`{name}`" for name in left)]) or "none"


def of_sets():
    yield "set", "figures"
    for name in SETS:
        yield name.lower(), ", ".join(f"`{metric}`" for metric in getattr(flag_rules, name))


def bound(rule):
    """Up to which time, in all or as a share of the run, a flag is harmless."""
    if rule.state == flag_rules.FAILED:
        return "none"
    text = "any time" if rule.state == flag_rules.OK else f"{rule.seconds:g} s"
    text += f" or {100.0 * rule.fraction:g} %" if rule.fraction else ""
    text += ", and not at the end of the run" if rule.at_end else ""
    return text + ("; any time with `setpoint.algorithm: hold`" if rule.compensating else "")


def of_vibration():
    yield "field", "unit", "meaning", "in Python"
    for name, field in files.FIELDS.items():
        yield f"`{name}`", field.unit, field.meaning, f"`.{field.attribute}{'.max()' if field.largest else ''}`"
    yield f"`{files.WARNINGS}`", "", "what is doubtful about the result, as texts", "`warnings(span, result)`"


def of_flags():
    yield "flag", "harmless up to", "why", "beyond: the run is", "figures concerned"
    for rule in flag_rules.RULES:
        yield f"`{rule.flag}`", bound(rule), rule.why, rule.state, named(rule.metrics)


def of_checks():
    yield "cause", "what is looked at", "the run is", "figures concerned"
    for name, metrics, text, state in flag_rules.CHECKS:
        yield f"`{name}`", text, state, named(metrics)


def of_rules():
    yield "rule", "key", "unit", "keeps", "compared with the limit"
    for rule in latch.RULES:
        keys = " or ".join(f"`{key}`" for key in rule.key.split(" or "))
        yield f"`{rule.name}`", keys, rule.unit * (rule.unit != "1"), rule.sense, rule.meaning


TABLES = {  # made by a declaration, on a page that is written by hand
    "summary": ("json", plain(*SUMMARY)),
    "run": ("json", plain(*METRICS)),
    "span": ("json", plain(*((name, *row) for name, row in wake_run.FIELDS.items()))),
    "viv": ("json", of_vibration()),
    "plan": ("json", (("need", "unit", "meaning"), *((f"`{name}`", unit, meaning) for name, unit, meaning in NEEDS))),
    "flags": ("flags", of_flags()),
    "checks": ("flags", of_checks()),
    "sets": ("flags", of_sets()),
    "rules": ("rules", of_rules()),
}


def made(name, table):
    """A table as it stands on a page that is written by hand."""
    return f"<!-- made: {name} -->\n\n{table}\n\n<!-- made: end -->"


@pytest.mark.parametrize("name, page, rows", [(name, *what) for name, what in TABLES.items()], ids=TABLES)
def test_tables_on_a_page_are_the_declared_ones(name, page, rows):
    assert made(name, markdown_table(rows)) in (DOCS / f"{page}.md").read_text("utf-8")


def test_the_manual_names_every_parameter_with_its_unit():
    text = manual_text()
    for item in declared(Scene):
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{item.key}` |")]
        assert f"| {item.unit} |" in row or item.unit in ("", "1"), row


def test_the_fields_have_shape_and_unit():
    rows = field_manual.text().partition("## Tables")[0].splitlines()
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
    recording = field_manual.text().partition("## Topics of a recording")[2]
    assert all(f"\n| `{channel.topic}` |" in recording for channel in EVERY)


@pytest.mark.parametrize("module", [cable_sim_ros, testing], ids=lambda module: module.__name__)
def test_every_public_name_stands_on_its_page(module):
    """Its row in the table, and the comment from which the site makes its reference."""
    page = (DOCS / "python.md").read_text("utf-8")
    names = [name for name in module.__all__ if not name.startswith("__")]
    assert names
    for name in names:
        assert re.search(rf"^\| (`\w+`, )*`{name}`[, ]", page, re.M), name
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
