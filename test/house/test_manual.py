"""The committed parameter manual is the one the declarations give."""

from pathlib import Path

from cable_sim_ros.cli.commands import manual_text
from cable_sim_ros.physics.parameter import declared
from cable_sim_ros.sim.scene import Scene

MANUAL = Path(__file__).resolve().parents[2] / "docs" / "parameters.md"


def test_the_manual_is_up_to_date():
    assert MANUAL.read_text("utf-8") == manual_text(), "run: cable-sim manual --out docs/parameters.md"


def test_the_manual_names_every_parameter_with_its_unit():
    text = manual_text()
    for item in declared(Scene):
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{item.key}` |")]
        assert f"| {item.unit} |" in row or item.unit in ("", "1"), row
