"""Mappings: fields become quantities with their sign, unit, axes, clock and place; each mistake is one clear line."""

import random
from math import pi

import numpy as np
import pytest

from cable_sim_ros.errors import CableSimError
from cable_sim_ros.io.scenes.document import shipped_mappings
from cable_sim_ros.sim.tables.attitude import rotation
from cable_sim_ros.tools.logs.log import LogError
from cable_sim_ros.tools.logs.mapping.mapping_file import MAPPINGS, MappingError, load_mapping
from cable_sim_ros.tools.logs.read_signals import read

T = np.arange(0.0, 60.0, 0.1)
HEAVE, ROLL, PITCH = 0.8 * np.sin(0.7 * T), np.radians(4.0) * np.sin(0.5 * T), np.radians(2.0) * np.cos(0.6 * T)


def table(path, **columns):
    rows = np.column_stack([T, *columns.values()])
    lines = ["t_s," + ",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def of(quantity, field, unit):
    return f"{quantity}: {{source: table, field: {field}, unit: {unit}}}"


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
    angles = of("roll", "roll_deg", "deg"), of("pitch_bow_up", "bow_up_deg", "deg"), of("heading", "hdg", "deg")
    tension = "tension: {source: table, field: load_kgf, unit: kgf, factor: 2.0, offset: 1.0}"
    found, _ = mapped(log, of("heave_down", "down_ft", "ft"), *angles, tension)
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
    angles = of("roll", "roll_deg", "deg"), of("pitch_bow_up", "bow_up_deg", "deg")
    found, _ = mapped(log, f"heave_down: {{source: table, field: down_ft, unit: ft, {arm}}}", *angles)
    put_on = -10.0 * np.sin(PITCH) + 3.0 * np.cos(PITCH) * np.sin(ROLL)  # third row of Rz Ry Rx
    np.testing.assert_allclose(found["heave"].value, HEAVE - put_on, atol=1e-8)
    alone, reading = mapped(log, f"heave_down: {{source: table, field: down_ft, unit: ft, {arm}}}")
    np.testing.assert_allclose(alone["heave"].value, HEAVE, atol=1e-8)
    assert any("the lever arm is not taken out, there is no roll" in line for line in reading.missing)
    bare, _ = mapped(log, of("heave_down", "down_ft", "ft"), *angles)
    assert any("lever arm" in line for line in bare["heave"].assumed)


def test_each_word_of_motion_moves_by_its_lever_arm(tmp_path):
    """Rigid body: place and velocity of a sensor computed here by differences of R a, not by omega x a."""

    def angles_at(t):
        roll, pitch = np.radians(4.0) * np.sin(0.5 * t), np.radians(2.0) * np.cos(0.6 * t)
        return np.column_stack([roll, pitch, np.radians(7.0) * np.sin(0.35 * t) + 0.4])

    arm, yaw = np.array([12.0, -3.0, 5.0]), angles_at(T)[:, 2]
    fine = 1e-4  # s, for the differences
    turn, later, sooner = (rotation(angles_at(T + d)) for d in (0.0, fine, -fine))
    rate = (later - sooner) @ arm / (2.0 * fine)
    steady = rotation(np.column_stack([ROLL, PITCH, yaw - yaw.mean()])) @ arm - arm
    speed = np.column_stack([2.0 + 0.1 * np.sin(0.6 * T), 0.5 + 0.0 * T, 0.3 * np.cos(0.7 * T)])  # of base_link
    world, ship = speed + rate, np.einsum("nji,nj->ni", turn, speed + rate)
    surge = np.column_stack([0.4 * np.sin(0.5 * T), 0.2 * np.cos(0.6 * T), HEAVE])
    columns = {"roll": ROLL, "pitch": PITCH, "yaw": yaw}
    columns |= {f"s{k}": row for k, row in enumerate((surge + steady).T)}
    columns |= {f"w{k}": row for k, row in enumerate(world.T)} | {f"b{k}": row for k, row in enumerate(ship.T)}
    path = table(tmp_path / "a.csv", **columns)
    angles = [of(name, name, "rad") for name in ("roll", "pitch", "yaw")]
    at = "lever_arm: [12, -3, 5]"

    def vector(word, letter, frame, unit, arm=at):
        fields = ", ".join(f"{letter}{k}" for k in range(3))
        return f"{word}: {{source: table, field: [{fields}], unit: {unit}, frame: {frame}, {arm}}}"

    found, _ = mapped(path, *angles, vector("displacement", "s", "flu", "m"))
    for k, name in enumerate(("surge", "sway", "heave")):
        np.testing.assert_allclose(found[name].value, surge[:, k], atol=1e-6)
    found, _ = mapped(path, *angles, vector("velocity", "w", "enu", "m/s"))
    inside = slice(5, -5)  # the ends of a cubic spline
    np.testing.assert_allclose(found["speed"].value[inside], np.hypot(*speed[:, :2].T)[inside], atol=2e-4)
    np.testing.assert_allclose(found["course"].value[inside], np.arctan2(speed[:, 1], speed[:, 0])[inside], atol=2e-4)
    np.testing.assert_allclose(found["heave_rate"].value[inside], speed[inside, 2], atol=2e-4)
    own, _ = mapped(path, *angles, vector("velocity", "b", "flu", "m/s"))
    along = np.einsum("nji,nj->ni", turn, speed)
    np.testing.assert_allclose(own["heave_rate"].value[inside], along[inside, 2], atol=2e-4)
    np.testing.assert_allclose(own["speed"].value[inside], np.hypot(*along[:, :2].T)[inside], atol=2e-4)
    alone, _ = mapped(path, *angles, f"heave_rate: {{source: table, field: w2, unit: m/s, {at}}}")
    np.testing.assert_allclose(alone["heave_rate"].value[inside], speed[inside, 2], atol=2e-4)


@pytest.mark.parametrize(
    "entry, key",
    [
        ("tension: {source: table, field: x, unit: N, lever_arm: [1, 0, 0]}", "lever_arm"),
        ("speed: {source: table, field: x, unit: m/s, lever_arm: [1, 0, 0]}", "lever_arm"),
        ("roll: {source: table, field: x, unit: rad, lever_arm: [1, 0, 0]}", "lever_arm"),
        ("acceleration: {source: table, field: [x, y, z], unit: g, frame: flu, lever_arm: [1, 0, 0]}", "imu_position"),
        ("pull: {source: table, field: [x, y, z], unit: N, sign: -1}", "sign"),
        ("quaternion: {source: table, field: [x, y, z, w], frame: flu, sign: -1}", "sign"),
        ("heave: {source: table, field: x, unit: m, quality_source: q}", "quality_source"),
        ("heave: {source: table, field: x, unit: m, stamped_by: q, time: aligned}", "stamped_by"),
        ("heave: {source: table, field: x, unit: m}\ndensity: 1010", "density"),
    ],
)
def test_a_key_that_would_do_nothing_is_refused(entry, key):
    with pytest.raises(MappingError, match=key):
        MAPPINGS.read(f"mapping: m\nsignals:\n  {entry}\n", "m.yaml")


PLACES = of("latitude", "lat", "deg"), of("longitude", "lon", "deg"), of("speed", "v", "m/s")
MOVING = {"roll": ROLL, "pitch": PITCH, "heave": HEAVE}


@pytest.mark.parametrize("name, value", [("heave", 0.0), ("heave", 9.999), ("roll", 0.0), ("pitch", 9.999)])
@pytest.mark.parametrize("part", [slice(None), slice(200, 290)])
def test_a_placeholder_stands_still_while_the_ship_moves(tmp_path, name, value, part):
    columns = {key: one.copy() for key, one in MOVING.items()}
    columns[name][part] = value
    units = {"roll": "rad", "pitch": "rad", "heave": "m"}
    entries = [of(key, key, units[key]) for key in columns]
    found, reading = mapped(table(tmp_path / "a.csv", **columns), *entries)
    count = len(T[part])
    assert (len(found[name].time) if name in found else 0) == len(T) - count
    assert any(f"{name}: {value:g}" in line and f"in {count} of" in line for line in reading.missing), reading.missing
    assert all(len(found[key].time) == len(T) for key in MOVING if key != name)


def test_what_may_stand_still_is_kept(tmp_path):
    """A ship nearly at rest, a rounded roll in a calm, a course due east, a winch that is held."""
    calm = np.where((T > 20) & (T < 40), 0.1, 1.0)
    motion = of("roll", "roll", "deg"), of("pitch", "pitch", "deg"), of("heave", "heave", "m")
    entries = *motion, *PLACES, of("payout", "out", "m")
    columns = {"roll": np.round(calm * 3.0 * np.sin(0.5 * T)), "pitch": np.round(calm * np.sin(0.6 * T))}
    columns |= {"heave": np.round(calm * HEAVE, 2), "lat": 0 * T + 60.0, "lon": 5.0 + 1e-5 * T, "v": 0 * T + 2.0}
    found, reading = mapped(table(tmp_path / "a.csv", **columns, out=0 * T + 300.0), *entries)
    assert {len(one.time) for one in found.values()} == {len(T)} and not reading.missing


def test_an_identity_attitude_while_the_gyro_turns_is_none(tmp_path):
    identity = {"qx": 0 * T, "qy": 0 * T, "qz": 0 * T, "qw": 0 * T + 1.0}
    rates = {"p": np.gradient(ROLL, T), "q": np.gradient(PITCH, T), "r": 0.01 * np.sin(T)}
    entries = (
        "quaternion: {source: table, field: [qx, qy, qz, qw], frame: flu}",
        "rates: {source: table, field: [p, q, r], unit: rad/s, frame: flu}",
    )
    found, reading = mapped(table(tmp_path / "a.csv", **identity, **rates), *entries)
    assert not {"roll", "pitch", "yaw"} & found.keys() and "roll_rate" in found
    still, _ = mapped(table(tmp_path / "b.csv", **identity, p=0 * T, q=0 * T, r=0 * T), *entries)
    assert {"roll", "pitch", "yaw"} <= still.keys()  # a ship that lies still


def test_places_that_stand_still_under_way_are_none(tmp_path):
    entries = of("roll", "roll", "rad"), *PLACES
    found, _ = mapped(table(tmp_path / "a.csv", roll=ROLL, lat=0 * T, lon=0 * T, v=0 * T + 2.0), *entries)
    assert not {"latitude", "longitude"} & found.keys()
    moored, _ = mapped(table(tmp_path / "b.csv", roll=ROLL, lat=0 * T, lon=0 * T, v=0 * T), *entries)
    assert {"latitude", "longitude"} <= moored.keys()


def test_a_pay_out_counted_negative_is_said(tmp_path):
    found, _ = mapped(table(tmp_path / "a.csv", out=-300.0 - T), of("payout", "out", "m"))
    assert any("negative throughout, -359.9 to -300 m" in line for line in found["payout"].assumed)


def test_one_stamp_ahead_moves_no_other(tmp_path):
    ahead = T.copy()
    ahead[300] += 1e6
    rows = "\n".join(f"{t:.3f},{value:.6f}" for t, value in zip(ahead, HEAVE))
    (tmp_path / "a.csv").write_text("t_s,h\n" + rows + "\n")
    found, reading = mapped(tmp_path / "a.csv", of("heave", "h", "m"))
    np.testing.assert_allclose(found["heave"].time, np.delete(T, 300) * 1e9, atol=1e3)
    assert any("1 records with a stamp" in line for line in reading.said)


def test_rows_without_a_number_are_counted(tmp_path):
    rows = "\n".join(f"{t:.3f},{'nan' if k % 10 == 0 else value}" for k, (t, value) in enumerate(zip(T, HEAVE)))
    (tmp_path / "a.csv").write_text("t_s,h\n" + rows + "\n")
    _, reading = mapped(tmp_path / "a.csv", of("heave", "h", "m"))
    assert reading.empty == 60 and any("60 of 600 records of table have no number" in line for line in reading.said)


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
    found, reading = mapped(log, of("roll", "roll_deg", "deg"), "tension: {source: winch, field: load}")
    assert list(found) == ["roll"]
    assert any("signals.tension: there is no source winch" in one for one in reading.missing)


def test_a_log_without_a_ready_mapping_says_how_to_make_one(tmp_path):
    path = table(tmp_path / "odd.csv", spam=T, eggs=T**2)
    with pytest.raises(LogError, match="no ready mapping fits its sources .* --mapping-out FILE"):
        read(path)


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
        "  pressure: {source: SBE, field: p}\n"
    )
    draw = random.Random(5)
    texts = [whole[: len(whole) * k // 64] for k in range(64)]
    for _ in range(300):
        at = draw.randrange(len(whole))
        texts.append(whole[:at] + chr(ord(whole[at]) ^ (1 << draw.randrange(7))) + whole[at + 1 :])
    read_whole = 0
    for text in texts:
        try:
            read_whole += bool(MAPPINGS.read(text, "m.yaml").signals)
        except CableSimError as error:
            assert len(str(error)) < 4000
    assert 0 < read_whole < len(texts)
