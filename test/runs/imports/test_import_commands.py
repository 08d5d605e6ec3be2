"""`inspect` and `import` by the command: what is odd is named, what is lost is counted, a mistake is one line."""

import json
from functools import reduce
from operator import xor

import numpy as np
import pytest
from click.testing import CliRunner
from made_tables import mapping, ship, told

from cable_sim_ros.cli.commands import main
from cable_sim_ros.runs import offline
from cable_sim_ros.tools.logs.imports import import_logs

T = np.arange(0.0, 40.0, 0.1)
HEAVE = 0.8 * np.sin(0.7 * T)


def command(*arguments, code=0):
    result = CliRunner().invoke(main, list(map(str, arguments)), catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result


def inspected(*arguments):
    return json.loads(command("inspect", "--json", *arguments).stdout)


def test_an_inspection_names_what_is_odd_and_writes_a_mapping_that_imports(tmp_path):
    """A counter that begins anew, a clock that is set back, half a minute of silence, angles in degrees."""
    t = T - np.where(T >= 20.0, 3.0, 0.0) + np.where(T >= 30.0, 30.0, 0.0)
    payout = 100.0 + T - np.where(T >= 10.0, 110.0, 0.0)
    log = ship(tmp_path / "a.csv", t, heave_m=HEAVE, roll_deg=6.0 * np.sin(T), pitch_deg=0.0 * T + 1.0, payout_m=payout)
    (found,) = inspected(log, "--mapping-out", tmp_path / "first.yaml")["logs"]
    by = {(one["where"], one["what"]): one["text"] for one in found["findings"]}
    assert by["table.payout_m", "reset"].startswith("reset: from 109.9 to 0 m after 9.9 s")
    assert by["table", "clock_jump"].startswith("stamps step back 1 times, first by 2.9 s")
    assert by["table", "gap"].startswith("no record for 30.1 s")
    assert "constant" in by["table.pitch_deg", "constant"]
    done = json.loads(
        command("import", log, "--mapping", tmp_path / "first.yaml", "--out", tmp_path / "bag", "--json").stdout
    )
    assert done["signals"].keys() == {"heave", "roll", "payout"}  # pitch stands still
    assert done["motion"] == "odometry"
    assert told(done["said"], "the clock was set back 1 times")


def test_what_does_not_fit_ends_in_one_line_and_writes_nothing(tmp_path):
    log = ship(tmp_path / "a.csv", T, heave=HEAVE, load=100.0 + HEAVE)
    out = tmp_path / "bag"
    for entry, words in (
        ("heave: heav m", "table has no such field; nothing was used. Did you mean heave? There are: "),
        ("tension: load m", "= m does not fit: tension is in N, m in m"),
        ("heave: heave m time: aligned", "tells no clock of its own; nothing was used. Take time: logged"),
        ("speed: load m/s", "has neither ship motion nor anything of the tow (there is speed): nothing was imported"),
    ):
        result = command("import", log, "--mapping", mapping(tmp_path, entry), "--out", out, code=2)
        (line,) = [line for line in result.stderr.splitlines() if line.startswith("error")]
        assert words in result.stderr and not out.exists() and "Traceback" not in result.stderr, line
    result = command("import", log, "--mapping", mapping(tmp_path, "heave: heave m"), "--out", log, code=2)
    assert "exists already: nothing was imported; give --force" in result.stderr


def test_only_a_bag_is_replaced_and_the_old_one_comes_back_where_the_new_one_fails(tmp_path, monkeypatch):
    log = ship(tmp_path / "a.csv", T, heave=HEAVE)
    given = ("import", log, "--mapping", mapping(tmp_path, "heave: heave m"), "--force", "--out")
    assert "--force replaces bags only; nothing was imported" in command(*given, tmp_path, code=2).stderr
    assert "--force replaces bags only; nothing was imported" in command(*given, log, code=2).stderr
    out = tmp_path / "bag"
    command(*given, out)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    with monkeypatch.context() as broken:
        broken.setattr(import_logs.BagWriter, "add", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
        assert "disk full" in command(*given, out, code=2).stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    command(*given, out)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "bag", "m.yaml"]


def test_half_of_the_signals_is_imported_and_the_rest_is_named(tmp_path):
    log = ship(tmp_path / "a.csv", T, heave=HEAVE, load=100.0 + HEAVE)
    chosen = mapping(tmp_path, "heave: heave m", "tension: load kgf")
    chosen.write_text(chosen.read_text() + "  roll: {source: mru, field: roll, unit: deg}\n")
    result = command("import", log, "--mapping", chosen, "--out", tmp_path / "bag")
    assert "not there: " in result.output and "signals.roll: there is no source mru" in result.output
    assert "heave: 400 records" in result.output and "tension: 400 records" in result.output


def test_eleven_hundred_files_are_one_log(tmp_path):
    """Each of four records, more than a process may have open; one of them is none."""
    logs = tmp_path / "logs"
    logs.mkdir()
    for k in range(1100):
        t = 0.25 * np.arange(4 * k, 4 * k + 4)
        ship(logs / f"{k:04d}.csv", t, load=100.0 + np.sin(t))
    (logs / "0500.csv").write_bytes(b"\0\1\2")
    done = json.loads(
        command(
            "import", logs, "--mapping", mapping(tmp_path, "tension: load kgf"), "--out", tmp_path / "bag", "--json"
        ).stdout
    )
    assert (done["files"], done["records"], done["signals"]) == (1099, 4396, {"tension": 4396})
    assert told(done["said"], "1 files that are no log were left out, the first: ", "0500.csv")
    assert done["seconds"] == pytest.approx(1099.75)


def pashr(k, spoiled=False):
    roll, clock = 4.0 * np.sin(0.05 * k), f"1200{k // 10 % 60:02d}.{k % 10}00"
    body = f"PASHR,{clock},218.26,T,{roll:.2f},1.00,{HEAVE[k % 400]:.2f},0.1,0.1,0.1,1,0"
    total = reduce(xor, body.encode())
    return f"${body}*{total ^ spoiled:02X}\r\n"


def test_an_imported_log_runs_and_its_verdict_says_what_was_assumed_and_lost(tmp_path):
    """Wrong checksums and a telegram cut in two by the end of a file: counted, and in the notes of the run."""
    lines = [pashr(k, spoiled=k in (50, 51, 90)) for k in range(200)]
    log = tmp_path / "mru.log"
    log.write_text("".join(lines[:-1]) + lines[-1][:25])
    (found,) = inspected(log)["logs"]
    assert found["format"] == "nmea0183" and found["records"] == 196 and sum(found["lost"].values()) == 4
    result = command("import", log, "--out", tmp_path / "bag", "--speed", "2")
    assert "196 records, 4 lost" in result.output and "3 x wrong checksum, first at " in result.output
    run = offline.run("side_scan", tmp_path / "bag", duration=1.0, every=0.1)
    about = run.metrics["imported"]
    assert (about["records"], about["lost"], about["mappings"], about["motion"]) == (196, 4, ["pashr"], "odometry")
    for words in (
        ("speed: 2 m/s", "put in"),
        ("ready mapping pashr, not told for this device",),
        ("lever arm",),
        ("lost records, 3 x wrong checksum",),
    ):
        assert told(run.verdict.notes, "imported: ", *words), (words, run.verdict.notes)
    assert run.metrics["verdict"]["notes"] == list(run.verdict.notes)
