"""The turbulent flume of Westin (2018) Table 4 through the command."""

from verification.experiments import turbulence


def test_validate_repeats_the_turbulent_flume(validated, monkeypatch):
    monkeypatch.setattr(turbulence, "OTHERWISE", {"another seed": turbulence.OTHERWISE["another seed"]})
    monkeypatch.setattr(turbulence, "SETTLING", 4.0)
    report, rows = validated("turbulence", "--duration", "1")
    measured = rows["standard deviation along X_E"]
    assert measured["measured"] == 1.19 and abs(measured["allowed"] - 0.37) < 1e-9 and measured["unit"] == "cm"
    assert abs(rows["mean place x"]["ours"] + 0.708) < 0.05 and rows["ellipsoid volume"]["measured"] == 4.82
    assert set(report["choices"][0]) == {"choice", "X_E in cm", "Y_E in cm", "Z_E in cm"}
