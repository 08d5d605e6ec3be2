"""Motion of one's own: what a table means, what is refused and in which words, and the sinusoidal heave."""

import warnings
from math import cos, pi, radians, sin

import numpy as np
import pytest

from cable_sim_ros.io.messages.messages import decode_odometry
from cable_sim_ros.io.sources.csv_table import head_of, numbers_of
from cable_sim_ros.io.sources.motion_table import COLUMNS, MotionError, MotionWarning, read_table, sine_heave
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.sim.tables.attitude import angle_rates, to_world

pytestmark = pytest.mark.check

SHIP = Ship(tow_speed=2.0, heading_deg=30.0, reference_height=0.5)
SECOND = 10**9


@pytest.fixture
def table(tmp_path):
    """Write a table from columns by name, or as text; returns its path."""

    def write(text="", **columns):
        path = tmp_path / "motion.csv"
        if columns:
            rows = zip(*(np.broadcast_to(values, len(columns["time_s"])) for values in columns.values()))
            text = "\n".join([",".join(columns), *(",".join(repr(float(x)) for x in row) for row in rows)])
        path.write_text(text + "\n", "utf-8")
        return path

    return write


def decoded(tow):
    return [decode_odometry(event.data) for event in tow.events]


def rows_of(tow):
    """Stamps [s], coordinates [n, 6] and rates [n, 6] in the world as the ingest takes them."""
    messages = decoded(tow)
    value = np.array([[*m.position, *m.angles] for m in messages])
    rate = [[*to_world(m.angles, m.velocity), *angle_rates(*m.angles[:2], m.rate)] for m in messages]
    return np.array([m.stamp for m in messages]) / SECOND, value, np.array(rate)


def test_heave_alone_rides_on_the_mean_track_of_the_scene(table):
    t = np.arange(0.0, 20.5, 0.5)
    tow = read_table(table(time_s=t, heave_m=np.sin(t)), SHIP)
    stamps, value, rate = rows_of(tow)
    assert np.allclose(np.diff(stamps), 0.02) and stamps[0] == 1.0 and stamps[-1] == 21.0
    at, inside = stamps - 1.0, slice(100, -100)
    yaw = radians(30.0)
    assert value[:, :2] == pytest.approx(np.outer(2.0 * at, (cos(yaw), sin(yaw))), abs=1e-9)
    assert value[inside, 2] == pytest.approx(0.5 + np.sin(at[inside]), abs=1e-3)  # the spline between half seconds
    assert value[::25, 2] == pytest.approx(0.5 + np.sin(t), abs=1e-12)
    assert value[:, 3:] == pytest.approx(np.tile((0.0, 0.0, yaw), (len(at), 1)), abs=1e-12)
    assert rate[:, :2] == pytest.approx(np.tile((2.0 * cos(yaw), 2.0 * sin(yaw)), (len(at), 1)), abs=1e-9)
    assert rate[inside, 2] == pytest.approx(np.cos(at[inside]), abs=5e-3)
    assert rate[:, 3:] == pytest.approx(0.0, abs=1e-12)
    assert {(e.kind, e.time - e.arrival) for e in tow.events} == {("odometry", 0)}


def test_every_coordinate_and_rate_in_its_unit(table):
    t = 100.0 + 0.01 * np.arange(400)
    wave = np.sin(t)
    turn = np.degrees(3.0 + 0.2 * t) % 360.0  # over the end of the circle
    columns = dict(time_s=t, x_m=t, y_m=-t, z_m=0.3 * wave, roll_deg=5.0 * wave, pitch_rad=0.1 * wave, yaw_deg=turn)
    stamps, value, rate = rows_of(read_table(table(**columns), SHIP))
    assert stamps == pytest.approx(t, abs=1e-9), "its own rows, at its own times"
    assert value[:, :3] == pytest.approx(np.column_stack((t, -t, 0.3 * wave)), abs=1e-9)
    assert value[:, 3:5] == pytest.approx(np.column_stack((radians(5.0) * wave, 0.1 * wave)), abs=1e-9)
    assert np.cos(value[:, 5] - (3.0 + 0.2 * t)) == pytest.approx(1.0, abs=1e-9)
    slope = np.column_stack((np.ones(400), -np.ones(400), 0.3 * np.cos(t), radians(5.0) * np.cos(t), 0.1 * np.cos(t)))
    assert rate[:, :5] == pytest.approx(slope, abs=1e-4) and rate[:, 5] == pytest.approx(0.2, abs=1e-6)


def test_rates_that_are_given_are_used(table):
    t = np.arange(0.0, 5.0)
    given = dict(time_s=t, heave_m=0.0, heave_mps=0.4, roll_deg=0.0, roll_degps=2.0, yaw_rad=0.5, yaw_radps=-0.1)
    _, value, rate = rows_of(read_table(table(**given), SHIP))
    assert rate[::50, 2] == pytest.approx(0.4) and rate[::50, 3] == pytest.approx(radians(2.0))
    assert rate[::50, 5] == pytest.approx(-0.1) and value[::50, 3] == pytest.approx(0.0, abs=1e-12)
    assert value[5, 2] > 0.5  # rises at first


@pytest.mark.parametrize(("begin", "stamp"), [(0.0, 1.0), (-0.5, 0.5), (-3.0, 1.0), (1.5, 1.5), (1.7e9, 1.7e9)])
def test_stamps_are_those_of_the_table_and_never_zero(table, begin, stamp):
    tow = read_table(table(time_s=begin + np.arange(5.0), heave_m=0.0), SHIP)
    assert tow.start == round(stamp * SECOND) and tow.end - tow.start == 4 * SECOND


def test_comments_blank_lines_and_a_byte_order_mark_are_no_harm(tmp_path):
    path = tmp_path / "motion.csv"
    rows = "".join(f"{k}, {0.1 * k}\n" for k in range(5))
    path.write_text("\ufeff# of a buoy\n\ntime_s, heave_m\n" + rows, "utf-8")
    assert read_table(path, SHIP).end == 5 * SECOND


def test_gaps_are_reported_and_left(table):
    t = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 2.0, 2.1, 2.2, 2.3, 2.6, 2.7, 2.8, 2.9])
    with pytest.warns(
        MotionWarning, match=r"2 gaps, the longest of 1.6 s after 0.4 s \(line 6\): gaps above ship.max_g"
    ):
        tow = read_table(table(time_s=t, heave_m=0.1 * t), SHIP)
    stamps = np.array([event.time for event in tow.events]) / SECOND - 1.0
    assert not ((stamps > 0.401) & (stamps < 1.999)).any() and not ((stamps > 2.301) & (stamps < 2.599)).any()
    with warnings.catch_warnings(action="error"):
        read_table(table(time_s=t[:5], heave_m=0.0), SHIP)


HEAD = "time_s,heave_m\n"
ROWS = "0,0\n1,0\n2,0\n3,0\n4,0\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"motion.csv: is empty; nothing was simulated. The first line names the columns, such as time_s,heave_m"),
        (HEAD + "0,1,2", r"motion.csv:2: 3 cells under 2 columns; .* Commas separate cells, points decimals"),
        (HEAD + "0,", r"motion.csv:2: heave_m = nothing is no finite number; .* Leave the whole row out, or fill it"),
        (HEAD + "0,nan", r"motion.csv:2: heave_m = nan is no finite number"),
        (HEAD + "0,1\n1,high", r"motion.csv:3: heave_m = high is no finite number"),
        ("time_s,roll\n" + ROWS, r"no column 'roll'; nothing was simulated. Did you mean roll_rad or roll_deg\?"),
        ("time_s,heave_cm\n" + ROWS, r"there is no column 'heave_cm'; .* Did you mean heave_m"),
        ("time_s;heave_m\n" + ROWS, r"csv:2: 1 cells under 2 columns; .* Commas separate cells, points"),
        ("time_s,wind\n" + ROWS, r"there is no column 'wind'; .* Known: time_s, x_m, .*yaw_degps"),
        ("time_s,z_m,heave_m\n0,0,0", r"z_m and heave_m both give z; nothing was simulated. Keep one of them"),
        ("time_s,roll_deg,roll_deg\n0,0,0", r"roll_deg and roll_deg both give roll; "),
        ("heave_m,roll_deg\n0,0", r"time_s must be there once; .* Name the column of the time time_s"),
        ("time_s,heave_mps\n0,0", r"heave_mps has no heave_m beside it; .* Add it, or leave heave_mps out"),
        ("time_s,heave_m,z_mps\n0,0,0", r"z_mps has no z_m beside it"),
        ("time_s,x_m\n0,0", r"x_m has no y_m beside it; .* follows ship.tow_speed and ship.heading_deg"),
        ("time_s\n0", r"has no column of motion beside time_s; .* Known: x_m, "),
        (HEAD + "0,0\n1,0\n2,0", r"has 3 rows, at least 4 are needed; .* Give more of them"),
        (HEAD + "0,0\n1,0\n1,0\n2,0", r"csv:4: time_s = 1 s does not advance past 1 s; .* order of time, each"),
        (HEAD + "0,0\n1,0\n2.5,0\n3.5,0\n4.5,0", r"csv:4: a step of 1.5 s is no .* of periods of 1 s within 5 %; "),
        (HEAD + "0,0\n1e5,0\n2e5,0\n3e5,0", r"300000 s are more than 86400 s; .* Is time_s in seconds\?"),
        (HEAD + ROWS + "9,0\n10,0\n", r"csv:7: 2 rows between two gaps, at least 4 are needed; .* Fill the gaps"),
        (HEAD + "0,0\n1,20.5\n2,0\n3,0", r"csv:3: heave_m = 20.5 m is outside \[-20, 20\] m; .* ship.reference_height"),
        ("time_s,z_m\n0,0\n1,21\n2,0\n3,0", r"csv:3: z_m = 21 m is outside \[-19.5, 20.5\] m"),
        ("time_s,pitch_deg\n0,0\n1,-81\n2,0\n3,0", r"csv:3: pitch_deg = -81 deg is outside \[-80, 80\] deg; .* unit"),
        ("time_s,x_m,y_m\n0,0,0\n1,99,0\n2,0,0\n3,0,0", r"the speed is [\d.]+ m/s along .* ship, above 50 m/s"),
        ("time_s,roll_rad\n0,0\n1,9\n2,0\n3,0", r"angular rate is [\d.]+ rad/s .* above 5 rad/s; .* rows that jump"),
    ],
)
def test_what_cannot_be_motion_is_refused(table, text, message):
    with pytest.raises(MotionError, match=message):
        read_table(table(text), SHIP)


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(MotionError, match="none.csv: no such file; nothing was simulated. Give the path of a CSV file"):
        read_table(tmp_path / "none.csv", SHIP)
    (tmp_path / "odd.csv").write_bytes(b"time_s,heave_m\n\xff")
    with pytest.raises(MotionError, match="odd.csv: cannot be read as UTF-8 text .* Save it as CSV"):
        read_table(tmp_path / "odd.csv", SHIP)


def test_degrees_stand_only_where_the_name_says_so():
    assert {name for name, column in COLUMNS.items() if column.scale != 1.0} == {n for n in COLUMNS if "_deg" in n}


def test_sinusoidal_heave():
    tow = sine_heave(1.2, 8.0, 20.0, SHIP)
    stamps, value, rate = rows_of(tow)
    t, w = stamps - 1.0, 2.0 * pi / 8.0
    assert t[0] == 0.0 and t[-1] == pytest.approx(20.98) and tow.path == "heave 1.2 m, 8 s"
    assert value[:, 2] == pytest.approx(0.5 + 1.2 * np.sin(w * t)) and rate[:, 2] == pytest.approx(
        1.2 * w * np.cos(w * t)
    )
    assert np.hypot(*rate[:, :2].T) == pytest.approx(2.0) and value[:, 5] == pytest.approx(radians(30.0))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0.0, 8.0, 9.0), r"heave of 0 m in 8 s: the amplitude is outside \(0, 20\] m; .* --heave AMPLITUDE,PERIOD"),
        ((float("nan"), 8.0, 9.0), r"heave of nan m in 8 s: the amplitude is outside"),
        ((1.0, 0.5, 9.0), r"heave of 1 m in 0.5 s: the period is outside \[1, 600\] s; nothing was simulated"),
        ((1.0, 8.0, 1e5), r"a duration of 100000 s is outside \(0, 86400\] s; .* Give a shorter --duration"),
        ((20.0, 1.0, 9.0), r"heave of 20 m in 1 s: 0 s after the beginning the speed is 125.7 m/s along an axis"),
    ],
)
def test_a_heave_that_no_ship_makes_is_refused(values, message):
    with pytest.raises(MotionError, match=message):
        sine_heave(*values, SHIP)


def test_a_ship_that_would_point_away_from_where_it_goes_is_refused(table):
    t = np.arange(5.0)
    off = dict(time_s=t, yaw_deg=390.0 + 12.0 + t)
    with pytest.raises(MotionError, match=r"yaw_deg has the mean 44 deg and no x_m and y_m beside it: the ship"):
        read_table(table(**off), SHIP)
    with pytest.raises(MotionError, match=r"14 deg away from it, more than 10 deg; .* Set ship.heading_deg to 44"):
        read_table(table(**off), SHIP)
    read_table(table(**off, x_m=t, y_m=t), SHIP)
    read_table(table(time_s=t, yaw_deg=32.0), SHIP)


def written(rows, delimiter, comma, style):
    def number(value):
        text = {"plain": f"{value:.4f}", "fortran": f"{value:.6E}".replace("E", "D"), "grouped": f"{value:,.1f}"}[style]
        if comma:
            text = text.translate({ord(","): ".", ord("."): ","})
        return f'"{text}"' if delimiter in text else text

    return "\r\n".join(delimiter.join(map(number, row)) for row in rows)


@pytest.mark.parametrize("style", ["plain", "fortran"])
@pytest.mark.parametrize("delimiter, comma", [(",", False), (";", True), (";", False), ("\t", True)])
@pytest.mark.parametrize("head", ["time_s,heave_m,roll_deg", '"time [s]","heave, m","roll (deg)"'])
def test_tables_of_other_countries_are_the_same(tmp_path, delimiter, comma, style, head):
    t = np.arange(0.0, 20.0, 0.1)
    rows = np.column_stack([t, np.round(0.8 * np.sin(0.7 * t), 4), np.round(3.0 * np.sin(0.5 * t), 4)])
    names = delimiter.join(head.replace('"heave, m"', '"heave; m"').split(",")).replace('"heave; m"', '"heave, m"')
    (tmp_path / "a.csv").write_bytes(
        "\ufeff".encode() + f"{names}\r\n{written(rows, delimiter, comma, style)}".encode()
    )
    (tmp_path / "b.csv").write_text("time_s,heave_m,roll_deg\n" + written(rows, ",", False, "plain").replace("\r", ""))
    found, known = (read_table(tmp_path / name, Ship()) for name in ("a.csv", "b.csv"))
    assert [event.data for event in found.events] == [event.data for event in known.events]


@pytest.mark.parametrize("delimiter, comma", [(",", False), (";", True)])
def test_thousands_apart_are_read_where_a_number_shows_it_and_refused_where_none_does(tmp_path, delimiter, comma):
    rows = np.column_stack([np.arange(6.0), 998.0 + np.arange(6.0)])
    text = written(rows, delimiter, comma, "grouped")
    (tmp_path / "a.csv").write_text(f"time_s{delimiter}payout_m\n{text}\n")
    names, below = head_of(tmp_path / "a.csv", "")
    np.testing.assert_allclose(numbers_of(tmp_path / "a.csv", names, below)[1], rows)
    (tmp_path / "b.csv").write_text('time_s,payout_m\n0,"1,234"\n1,"1,236"\n')
    with pytest.raises(MotionError, match=r"b.csv:2: payout_m = 1,234 may be thousands or decimals"):
        numbers_of(tmp_path / "b.csv", *head_of(tmp_path / "b.csv", ""))
