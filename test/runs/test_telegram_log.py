"""The telegrams of a recording as a log, by the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.bags.bag import BagWriter
from cable_sim_ros.io.messages.channels import CHANNELS, Context, Encoder
from cable_sim_ros.io.scenes.load import dump_scene, load_scene
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.tools.logs.formats import read_log

pytestmark = pytest.mark.trust

HEALTH = next(channel for channel in CHANNELS if channel.name == "sim_health")
BEGIN, STEP = 1_400_000_000_000_000_000, 20_000_000  # ns: 50 tick outputs a second


@pytest.fixture(scope="module")
def scene():
    return load_scene("full_scale")


def record(path: Path, scene, keep: bool = True) -> np.ndarray:
    """Four seconds in which the winch pays out at 0.5 m/s and the ship heaves up."""
    frames = np.zeros(200, TICK_OUTPUT)
    k = np.arange(1, 201)
    frames["time"], frames["tick"], frames["ship_quaternion"][:, 3] = BEGIN + k * STEP, k, 1.0
    frames["payout"], frames["payout_rate"], frames["tension"] = 100.0 + 0.01 * k, 0.5, 2000.0 + k
    frames["ship_position"][:, 2] = scene.ship.reference_height + 0.001 * k**2
    frames["ship_velocity"][:, 2] = 0.1 * k
    encoder = Encoder(Context(), 0.02, (HEALTH,))
    with BagWriter(path, custom_data={"scene_yaml": dump_scene(scene)} if keep else {}) as writer:
        for frame in frames:
            ((_, topic, data),) = encoder.encode(frame, None, None)
            writer.add(topic, HEALTH.msgtype, int(frame["time"]), data)
    return frames


def run(*arguments):
    return CliRunner().invoke(main, ["telegrams", *map(str, arguments)], catch_exceptions=False)


def test_a_recording_becomes_a_log_in_the_form_of_the_real_ones(tmp_path, scene):
    record(tmp_path / "tow", scene)
    out = tmp_path / "log"
    result = run(tmp_path / "tow", "--format", "lci90i", "--out", out, "--number", 2, "--name", "STBD TRAWL")
    assert result.exit_code == 0, result.output
    assert result.output == f"{out}: 80 lines at 20 Hz; tension, speed, pay-out of truth\n"
    lines = out.read_bytes().splitlines()
    assert lines[0].startswith(b"2014-05-13T16:53:20.060000Z ")
    assert lines[-1] == (
        b"2014-05-13T16:53:24.000000Z \x0102RD,2014-05-13T16:53:24.000,STBD TRAWL,00000495,000030.0,000102.0,3600"
    )
    read = read_log(out).sources["lci90i/STBD TRAWL"]
    assert (read.logged == read.device).all() and len(set(read.logged)) == 80
    assert np.allclose(read.columns["payout"], 100.0 + 0.5 * (read.logged - BEGIN) / 1e9, atol=0.051)


@pytest.mark.rest  # NMEA is read by a parser of the extra `import`
@pytest.mark.parametrize(
    "kind, lines, withheld, sign", [("psxn", 40, 0, -1), ("pashr", 40, 0, 1), ("tss1", 40, 0, 1), ("tss1", 199, 1, 1)]
)
def test_every_format_has_its_log(tmp_path, scene, kind, lines, withheld, sign):
    record(tmp_path / "tow", scene)
    out = tmp_path / "log"
    rate = ("--rate", 50.0) if lines == 199 else ()
    result = run(tmp_path / "tow", "--format", kind, "--out", out, *rate)
    assert result.exit_code == 0, result.output
    (read,) = read_log(out).sources.values()
    assert len(read) == lines
    assert ("withheld: 1; horizontal acceleration is no number" in result.output) == bool(withheld)
    assert read.columns["heave"][-1] == pytest.approx(sign * 40.0, abs=0.006)
    assert kind != "tss1" or read.columns["vertical"][-1] == pytest.approx(5.0, abs=0.001)


def test_what_cannot_be_written_is_one_line(tmp_path, scene):
    record(tmp_path / "tow", scene)
    record(tmp_path / "bare", scene, keep=False)
    out = tmp_path / "log"
    result = run(tmp_path / "tow", "--format", "lci90i", "--out", out, "--rate", 100)
    assert result.exit_code == 2 and "more than the 50 tick outputs a second" in result.output
    assert (
        "nothing was written. Give at most 50, or record more of them, as by cable-sim run --every 0.01"
        in result.output
    )
    result = run(tmp_path / "tow", "--format", "lci90i", "--out", out, "--name", "A,B")
    assert result.exit_code == 2 and "without a comma" in result.output
    result = run(tmp_path / "bare", "--format", "psxn", "--out", out)
    assert result.exit_code == 2 and "keeps no scene" in result.output and "give --scene NAME or FILE" in result.output
    assert not out.exists()
    assert run(tmp_path / "bare", "--format", "psxn", "--out", out, "--scene", "full_scale").exit_code == 0
    assert run(tmp_path / "nowhere", "--format", "psxn", "--out", out).exit_code == 2
    result = run(tmp_path / "tow", "--format", "psxn", "--out", tmp_path / "no" / "log")
    assert result.exit_code == 2 and "cannot be written (No such file or directory)" in result.output
    assert "Give a file in a folder that is there" in " ".join(result.output.split())
    for option, of in (("--tension-unit", "lci90i"), ("--heave-down", "pashr")):
        given = (option, "kgf") if option == "--tension-unit" else (option,)
        result = run(tmp_path / "tow", "--format", "psxn", "--out", out, *given)
        assert result.exit_code == 2 and f"{option} is of {of}, not of psxn; nothing was written" in result.output
