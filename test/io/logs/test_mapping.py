"""Mappings: fields become quantities with their sign, unit, axes, clock and place; each mistake is one clear line."""

import random
from math import pi

import numpy as np
import pytest

from cable_sim_ros.errors import CableSimError
from cable_sim_ros.io.logs.log import LogError
from cable_sim_ros.io.logs.mapping.mapping_file import MappingError, load_mapping, mapping_of
from cable_sim_ros.io.logs.read_signals import read, read_signals
from cable_sim_ros.io.scenes.resources import shipped_mappings

T = np.arange(0.0, 60.0, 0.1)
HEAVE, ROLL, PITCH = 0.8 * np.sin(0.7 * T), np.radians(4.0) * np.sin(0.5 * T), np.radians(2.0) * np.cos(0.6 * T)


def table(path, **columns):
    rows = np.column_stack([T, *columns.values()])
    lines = ["t_s," + ",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def mapped(path, *entries):
    text = "mapping: test\nsignals:\n" + "".join(f"  {entry}\n" for entry in entries)
    (path.parent / "m.yaml").write_text(text)
    reading = read(path, path.parent / "m.yaml")
    return {one.quantity: one for one in reading.signals}, reading


@pytest.fixture
def log(tmp_path):
    return table(
        tmp_path / "a.csv",
        down_ft=-HEAVE / 0.3048,
        roll_deg=np.degrees(ROLL),
        bow_up_deg=-np.degrees(PITCH),
        hdg=np.full(len(T), 350.0) + 20.0 * T / T[-1],
        load_kgf=(3000.0 + 200.0 * np.sin(T)) / 9.80665,
    )


def test_signs_units_and_directions(log):
    found, _ = mapped(
        log,
        "heave_down: {source: table, field: down_ft, unit: ft}",
        "roll: {source: table, field: roll_deg, unit: deg}",
        "pitch_bow_up: {source: table, field: bow_up_deg, unit: deg}",
        "heading: {source: table, field: hdg, unit: deg}",
        "tension: {source: table, field: load_kgf, unit: kgf, factor: 2.0, offset: 1.0}",
    )
    for name, known in (("heave", HEAVE), ("roll", ROLL), ("pitch", PITCH)):
        np.testing.assert_allclose(found[name].value, known, atol=1e-8)
    yaw = found["yaw"].value  # from east to north, without a step at north
    np.testing.assert_allclose(yaw - yaw[0], -np.radians(20.0) * T / T[-1], atol=1e-8)
    assert np.isclose((yaw[0] - np.radians(100.0)) % (2 * pi), 0.0, atol=1e-8)
    np.testing.assert_allclose(found["tension"].value, 2.0 * (3000.0 + 200.0 * np.sin(T)) + 9.80665, rtol=1e-8)
    np.testing.assert_allclose(np.diff(found["heave"].time), 1e8, atol=1)


def test_a_lever_arm_is_taken_out_where_the_angles_are_there_and_said_where_not(log):
    """A sensor 10 m ahead and 3 m to port: its heave is that of the origin less what roll and pitch put on it."""
    arm = "lever_arm: [10, 3, 0]"
    angles = (
        "roll: {source: table, field: roll_deg, unit: deg}",
        "pitch_bow_up: {source: table, field: bow_up_deg, unit: deg}",
    )
    found, _ = mapped(log, f"heave_down: {{source: table, field: down_ft, unit: ft, {arm}}}", *angles)
    put_on = -10.0 * np.sin(PITCH) + 3.0 * np.cos(PITCH) * np.sin(ROLL)  # third row of Rz Ry Rx
    np.testing.assert_allclose(found["heave"].value, HEAVE - put_on, atol=1e-8)
    alone, reading = mapped(log, f"heave_down: {{source: table, field: down_ft, unit: ft, {arm}}}")
    np.testing.assert_allclose(alone["heave"].value, HEAVE, atol=1e-8)
    assert any("the lever arm is not taken out, there is no roll" in line for line in reading.missing)
    bare, _ = mapped(log, "heave_down: {source: table, field: down_ft, unit: ft}", *angles)
    assert any("lever arm" in line for line in bare["heave"].assumed)


def test_records_outside_range_times_and_repeats_are_left_out(log):
    load = "source: table, field: load_kgf, unit: kgf"
    whole, _ = mapped(log, f"tension: {{{load}}}")
    ranged, reading = mapped(log, f"tension: {{{load}, range: [300, 1000]}}")
    assert 0 < len(ranged["tension"].time) < len(whole["tension"].time) and any("range" in one for one in reading.said)
    assert ranged["tension"].value.min() >= 300 * 9.80665
    late, _ = mapped(log, f"tension: {{{load}, after: 10, until: 20}}")
    assert 99 <= len(late["tension"].time) <= 101
    thin, _ = mapped(log, f"tension: {{{load}, every: 1.0}}")
    assert 59 <= len(thin["tension"].time) <= 61
    moved, _ = mapped(log, f"tension: {{{load}, clock_offset: -2.5}}")
    assert np.all(moved["tension"].time - whole["tension"].time == -2_500_000_000)


@pytest.mark.parametrize(
    "entry, words",
    [
        ("heave: {source: table, field: down_feet}", "has no such field; nothing was used. Did you mean down_ft?"),
        ("heave: {source: tabel, field: down_ft}", "there is no source tabel. Did you mean table?"),
        ("heave: {source: table, field: down_ft, unit: kgf}", "does not fit: heave is in m, kgf in N"),
        ("heave: {source: table, field: down_ft, unit: parsec}", "is no unit that is known"),
        ("tension: {source: table, field: down_ft, unit: ton}", "1000 kg or 907.2 kg: give tonne, or short_ton"),
        ("heav: {source: table, field: down_ft}", "Did you mean heave?"),
        ("heave: {source: table, field: down_ft, lever_arm: [500, 0, 0]}", "lever_arm"),
        ("heave: {source: table, field: down_ft, lever_arm: [1, 0]}", "lever_arm"),
        ("heave: {source: table, field: down_ft, sign: 0}", "= 0 would make every value the same"),
        ("heave: {source: table, field: [down_ft, hdg]}", "names 2 columns, heave has 1"),
        ("heave: {source: table, field: down_ft, frame: ned}", "frame"),
        ("heave: {source: table, field: down_ft, range: [3, 1]}", "leaves no value"),
        ("heave: {source: table, field: down_ft, after: 30, until: 10}", "is not after `after`"),
        ("heave: {source: table, field: down_ft, time: logged}", "the logger left no stamps"),
        ("heave: {source: table, field: down_ft, time: aligned}", "the logger left no stamps to align with"),
        ("heave: {source: table, field: down_ft, stamped_by: GGA}", "stamped_by = GGA: there is no such source"),
        ("heave: {source: table, field: down_ft, quality_field: q}", "stands without its other half"),
        ("heave: {source: table, field: down_ft, after: 1.0e+9}", "no record"),
        ("heave: {source: table, field: down_ft, colour: red}", "colour"),
    ],
)
def test_a_mistake_is_one_clear_line(log, entry, words):
    with pytest.raises((LogError, MappingError)) as caught:
        mapped(log, entry)
    text = str(caught.value)
    assert words in text and "\n" not in text.strip() and text.count("Traceback") == 0


def test_half_of_the_entries_is_used_and_the_rest_is_named(log):
    found, reading = mapped(
        log, "roll: {source: table, field: roll_deg, unit: deg}", "tension: {source: winch, field: load}"
    )
    assert list(found) == ["roll"] and any(
        "signals.tension: there is no source winch" in one for one in reading.missing
    )


def test_a_log_without_a_ready_mapping_says_how_to_make_one(tmp_path):
    path = table(tmp_path / "odd.csv", spam=T, eggs=T**2)
    with pytest.raises(LogError, match="no ready mapping fits its sources .* --mapping-out FILE"):
        read_signals(path)


@pytest.mark.parametrize("name", shipped_mappings())
def test_ready_mappings_load_and_tell_what_they_are_for(name):
    one = load_mapping(name)
    assert one.about and one.signals


def test_mappings_cut_and_flipped_are_read_or_refused():
    whole = (
        "mapping: winch\ndensity: 1026\nsignals:\n"
        "  heave_down: {source: table, field: d, unit: ft, lever_arm: [1, 2, 3]}\n"
        "  tension: {source: [A, 'B*'], field: load, unit: kgf, range: [0, 20000], "
        "quality_field: q, quality_accepted: [1]}\n"
        "  rates: {source: imu, field: [x, y, z], frame: frd, time: aligned, every: 0.5}\n"
    )
    draw = random.Random(5)
    texts = [whole[: len(whole) * k // 64] for k in range(64)]
    for _ in range(1000):
        at = draw.randrange(len(whole))
        texts.append(whole[:at] + chr(ord(whole[at]) ^ (1 << draw.randrange(7))) + whole[at + 1 :])
    read_whole = 0
    for text in texts:
        try:
            read_whole += bool(mapping_of(text, "m.yaml").signals)
        except CableSimError as error:
            assert len(str(error)) < 4000
    assert 0 < read_whole < len(texts)
