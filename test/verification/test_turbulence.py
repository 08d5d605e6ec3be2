"""The turbulent flume of Westin (2018) Table 4 through the command."""

import json

from click.testing import CliRunner

from cable_sim_ros.cli import commands
from verification.experiments import turbulence


def test_validate_repeats_the_turbulent_flume(tmp_path, monkeypatch):
    monkeypatch.setattr(turbulence, "OTHERWISE", {"another seed": turbulence.OTHERWISE["another seed"]})
    monkeypatch.setattr(turbulence, "SETTLING", 4.0)
    done = CliRunner().invoke(
        commands.main, ["validate", "turbulence", "--json", "--duration", "1", "--out", str(tmp_path)]
    )
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)[0]
    rows = {row["name"]: row for row in report["rows"]}
    measured = rows["standard deviation along X_E"]
    assert measured["measured"] == 1.19 and abs(measured["allowed"] - 0.37) < 1e-9 and measured["unit"] == "cm"
    assert abs(rows["mean place x"]["ours"] + 0.708) < 0.05 and rows["ellipsoid volume"]["measured"] == 4.82
    assert (
        set(report["choices"][0]) == {"choice", "X_E in cm", "Y_E in cm", "Z_E in cm"}
        and (tmp_path / "turbulence.png").stat().st_size > 5_000
    )
