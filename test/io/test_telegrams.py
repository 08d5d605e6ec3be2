"""Telegrams byte for byte as real instruments write them, and never a wrong number."""

import math
import re
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.tools.telegrams import lci90i, pashr, psxn, sources, tss1
from cable_sim_ros.tools.telegrams.fields import Motion, Withheld, exclusive_or
from cable_sim_ros.tools.telegrams.lci90i import Winch

pytestmark = pytest.mark.check

LOGS = Path(__file__).resolve().parents[3] / "shared" / "data" / "foreign" / "nbp1406_winch"
PAGE = Path(__file__).parents[2] / "docs" / "telegrams.md"
TRAWL = b"\x0102RD,2014-08-01T00:29:19.251,STBD TRAWL,-0000003,000000.0,-00034.0,3588\r\n"  # NBP1406
CTD = b"\x0101RD,2014-08-01T20:32:40.955,UPPER WF,-134.,00000012,000003.3,3312\r\n"  # the same, another winch
NAMELESS = b"\x0103RD,2022-05-14T16:17:36.502,-0000168,00000000,-00004.8,2839\r\n"  # a public log of another ship
SEAPATH = b"$PSXN,23,0.35,-1.74,218.26,0.58*13\r\n"  # NBP1406
POS_MV = b"$PASHR,145719.272,252.41,T,1.22,0.48,0.01,"  # a public parser; then what is no motion
TSS = b":00FFCA -0003F-0325  0319\r\n"  # documentation of NovAtel
LB, DEG, S = 4.4482216152605, math.pi / 180, 1_000_000_000
number = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-400.0, 400.0) | st.floats(-1e8, 1e8)
angle = st.floats(-1.6, 1.6) | st.floats(-7.0, 7.0) | number
times = st.integers(0, 2**62)


def winch(line):
    """Tension, speed, pay-out of a telegram, in the units of the display."""
    body, *_, pull, speed, payout, check = lci90i.LINE.fullmatch(line).groups()
    assert sum(body) % 10_000 == int(check)
    return float(pull), float(speed), float(payout)


def fields(line):
    """Those of a sentence with a right checksum."""
    body, check = line.removeprefix(b"$").rstrip(b"\r\n").split(b"*")
    assert exclusive_or(body) == int(check, 16)
    return body.decode().split(",")


@pytest.mark.parametrize(
    "line, values, form",
    [
        (TRAWL, (1406852959251000000, -3 * LB, 0.0, -34.0), (2, "STBD TRAWL")),
        (CTD, (1406925160955000000, -134 * LB, 0.2, 3.3), (1, "UPPER WF", True, 0)),
        (NAMELESS, (1652545056502000000, -168 * LB, 0.0, -4.8), (3, "", False, 0)),
    ],
)
def test_a_winch_display_writes_the_lines_of_real_ones(line, values, form):
    assert lci90i.encode(Winch(*values), lci90i.Form(*form)) == line and winch(line)[2] == values[3]


def test_the_telegrams_on_the_page_are_such():
    shown = re.findall(r"^(?:<SOH>\d|\d\dRD|\$P|:\d).*$", PAGE.read_text("utf-8"), re.M)
    lines = [line.replace("<SOH>", "\x01").replace("<CR><LF>", "\r\n").encode() for line in shown]
    assert len(lines) == 5 and all(map(winch, lines[:2])) and tss1.LINE.fullmatch(lines[4])
    assert [fields(line)[0] for line in lines[2:4]] == ["PSXN", "PASHR"]


def test_motion_has_the_signs_of_the_sources():
    """REP 103: roll port up, pitch bow down, yaw from east to north, heave up."""
    motion = Motion(0, 0.35 * DEG, 1.74 * DEG, (90 - 218.26) * DEG, -0.58)
    assert psxn.encode(motion) == SEAPATH  # its heave is positive down, its pitch bow up
    motion = Motion(53839272 * 10**6, 1.22 * DEG, -0.48 * DEG, (90 - 252.41) * DEG, 0.01)
    assert pashr.encode(motion).startswith(POS_MV)
    assert b",0.48,-0.01," in pashr.encode(motion, heave_up=False)
    assert tss1.encode(Motion(0, -3.255074 * DEG, -3.19 * DEG, 0.0, -0.03, 0.0, -54 * 0.000625)) == TSS


def again_of(line):
    number, clock, name, pull, speed, _, _ = line.lstrip(b"\x01").decode().split(",")
    time = round(datetime.fromisoformat(clock + "Z").timestamp() * 1000) * 1_000_000
    tension, rate, payout = winch(line)
    form = lci90i.Form(int(number[:2]), name, pull.endswith("."), len(speed.partition(".")[2]))
    return lci90i.encode(Winch(time, tension * LB, rate / 60, payout), form)


@pytest.mark.skipif(not LOGS.is_dir(), reason="the real logs are not beside this checkout")
@pytest.mark.parametrize("name", ["twnc", "cwnc", "s330"])
def test_every_line_of_the_real_logs_comes_back_byte_for_byte(name):
    lines = (LOGS / f"NBP1406_{name}-2014-08-01").read_bytes().splitlines()
    found = [line.partition(b" ")[2] for line in lines]
    if name == "s330":
        found = [line for line in found if line.startswith(b"$PSXN,23")]
        rows = ([float(part) for part in fields(line)[2:]] for line in found)
        again = [psxn.encode(Motion(0, a * DEG, -b * DEG, (90 - c) * DEG, -d)) for a, b, c, d in rows]
    else:
        again = [again_of(line) for line in found]
    assert len(found) == {"twnc": 5000, "cwnc": 5000, "s330": 625}[name]
    assert again == [line + b"\r\n" for line in found]


def test_parsers_of_others_read_ours():
    pynmea2 = pytest.importorskip("pynmea2")
    motion = Motion(1406852959251000000, 0.03, 0.05, -1.0, 1.234)
    read = pynmea2.parse(psxn.encode(motion).decode(), check=True)
    assert (read.roll, read.pitch, read.head, read.heave) == (1.72, -2.86, 147.3, -1.23)
    read = pynmea2.parse(pashr.encode(motion).decode(), check=True)
    assert (read.roll, read.pitch, read.true_heading, read.heave) == (1.72, -2.86, 147.3, 1.23)
    assert (read.is_true_heading, int(read.aiding_status), int(read.imu_status)) == ("T", 2, 1)
    assert read.timestamp.isoformat()[:8] == "00:29:19" and read.roll_accuracy == 0.0


@given(times, number, number, number, st.booleans(), st.integers(0, 3), st.sampled_from(lci90i.TensionUnit))
@example(0, 99_999_999 * LB, 0.0, 999_999.94, False, 1, lci90i.TensionUnit.LB)
@example(0, -9_999_999.4 * LB, -99_999.9 / 60, -99_999.9, False, 1, lci90i.TensionUnit.LB)
@example(0, 99_999_999.6 * LB, 0.0, 0.0, False, 1, lci90i.TensionUnit.LB)
def test_a_winch_telegram_is_right_or_withheld(time, tension, speed, payout, plain, decimals, unit):
    form = lci90i.Form(7, "A-FRAME 2", plain, decimals, unit)
    try:
        line = lci90i.encode(Winch(time, tension, speed, payout), form)
    except Withheld as error:
        assert "holds" in str(error)
        values = (tension / 4.0, 60 * speed, payout)
        assert not all(abs(value) < 900.0 for value in values), "a usual value was withheld"
        return
    pull, rate, out = winch(line)
    size, parts = lci90i.NEWTON[unit], line.split(b",")
    assert datetime.fromisoformat(parts[1].decode() + "Z").timestamp() == pytest.approx(
        time // 1_000_000 / 1e3, abs=1e-4
    )
    assert abs(size * pull - tension) <= 0.5 * size * (1 + 1e-6)
    assert abs(rate / 60 - speed) <= 0.5 / 60 * 10.0**-decimals * (1 + 1e-6)
    assert abs(out - payout) <= 0.05 * (1 + 1e-6) and parts[0] == b"\x0107RD" and parts[2] == b"A-FRAME 2"
    assert [len(part) for part in parts[-3:-1]] == [8, 8] and (plain or len(parts[3]) == 8)


@given(times, angle, angle, angle, number, number, st.floats(-25.0, 25.0) | number)
@example(0, 0.0, 0.0, math.pi / 2, 0.0, 0.0, 0.0)
@example(0, 0.0, 0.0, math.pi / 2 + 1e-9, 99.994, 9.76, -20.48)
@example(0, math.pi / 2, -math.pi / 2, 0.0, -99.0, 0.0, 20.479)
def test_a_motion_telegram_is_right_or_withheld(time, roll, pitch, yaw, heave, across, along):
    motion = Motion(time, roll, pitch, yaw, heave, across, along)
    usual = abs(roll) < 1.5 and abs(pitch) < 1.5 and abs(yaw) < 6.3 and abs(heave) < 99.0
    half = 0.00501
    for encode, places, down in ((psxn.encode, (2, 3, 4, 5), -1), (pashr.encode, (4, 5, 2, 6), 1)):
        try:
            line = encode(motion)
        except Withheld:
            assert not usual
            continue
        told = [float(fields(line)[k]) for k in places]
        assert abs(told[0] - roll / DEG) <= half and abs(told[1] + pitch / DEG) <= half
        assert abs(math.remainder(90.0 - told[2] - yaw / DEG, 360.0)) <= half and abs(down * told[3] - heave) <= half
        assert b",360.00," not in line and len(line) <= 82
    try:
        line = tss1.encode(motion)
    except Withheld:
        assert not (usual and 0.0 <= across < 9.7 and abs(along) < 20.0)
        return
    found = tss1.LINE.fullmatch(line)
    up, over, bow = (float(found[k].replace(b" ", b"")) / 100 for k in (3, 5, 6))
    assert len(line) == 27 and abs(up - heave) <= half and abs(bow + pitch / DEG) <= half
    assert abs(math.sin(over * DEG) - math.sin(roll) * math.cos(pitch)) <= 2 * half * DEG
    assert abs(int(found[1], 16) * tss1.HORIZONTAL - across) <= 0.02
    assert abs(math.remainder(int(found[2], 16) - along / tss1.VERTICAL, 65536)) <= 0.51


@pytest.mark.parametrize(
    "encode, values, said",
    [
        (lci90i.encode, Winch(0, 5e8, 0.0, 0.0), "tension is 1.12404e+08 lb, its field holds"),
        (lci90i.encode, Winch(0, math.nan, 0.0, 0.0), "tension is no number, its field holds"),
        (lci90i.encode, Winch(0, 0.0, math.inf, 0.0), "speed is no number, its field holds"),
        (lci90i.encode, Winch(0, 0.0, 0.0, -1e5), "pay-out is -100000 m, its field holds -99999.9"),
        (psxn.encode, Motion(0, 0.0, 0.0, 0.0, 1e5), "heave is -100000 m, its field holds -9999.99 to 9999.99 m"),
        (psxn.encode, Motion(0, 0.0, 2.0, 0.0, 0.0), "pitch is -114.592 deg, its field holds -90 to 90 deg"),
        (psxn.encode, Motion(0, 0.0, 0.0, math.nan, 0.0), "yaw is no number"),
        (pashr.encode, Motion(0, 0.0, 0.0, 0.0, 99.01), "heave is 99.01 m, its field holds -99 to 99 m"),
        (pashr.encode, Motion(0, 1.6, 0.0, 0.0, 0.0), "roll is 91.6732 deg, its field holds -90 to 90 deg"),
        (tss1.encode, Motion(0, 0.0, 0.0, 0.0, 0.0), "horizontal acceleration is no number"),
        (tss1.encode, Motion(0, 0.0, 0.0, 0.0, 0.0, 9.8, 0.0), "horizontal acceleration is 9.8 m/s^2, its field holds"),
        (tss1.encode, Motion(0, 0.0, 0.0, 0.0, 0.0, 0.0, 21.0), "vertical acceleration is 21 m/s^2, its field holds"),
        (tss1.encode, Motion(0, 0.0, 0.0, 0.0, 100.0, 0.0, 0.0), "heave is 100 m, its field holds -99.99 to 99.99 m"),
    ],
)
def test_what_does_not_fit_is_withheld_and_said(encode, values, said):
    with pytest.raises(Withheld) as error:
        encode(values)
    assert said in str(error.value)


@pytest.mark.parametrize("name", ["A" * 17, "a,b", "ä", "a\n"])
def test_a_name_that_would_break_the_telegram_is_refused(name):
    assert lci90i.name_problem(name) and not lci90i.name_problem("STBD TRAWL") and not lci90i.name_problem("")


# ---- where the values come from


def row_of(dtype=TICK_OUTPUT, **values):
    rows = np.zeros(1, dtype)
    rows["ship_quaternion"][0, 3] = 1.0
    for name, value in values.items():
        rows[name] = value
    return rows[0]


@pytest.fixture(scope="module")
def scene():
    return override(load_scene("full_scale"), {"ship.reference_height": 1.25})


def test_the_truth_is_told_where_the_scene_has_no_instrument(scene):
    reader = sources.Reader("lci90i", scene)
    row = row_of(time=5 * S, tension=1000.0, payout=40.0, payout_rate=-0.5, tension_drum=900.0)
    assert reader.read(row) == (5 * S, 1000.0, -0.5, 40.0)
    assert reader.said == "tension, speed, pay-out of truth"
    up = row_of(ship_position=(7.0, 8.0, 2.75), ship_quaternion=(0.0, math.sin(-0.05), 0.0, math.cos(0.05)))
    motion = sources.Reader("psxn", scene).read(up)
    assert motion[1:5] == pytest.approx((0.0, -0.1, 0.0, 1.5))
    assert psxn.encode(motion).startswith(b"$PSXN,23,0.00,5.73,90.00,-1.50*")  # bow up, heading east, down is positive


def test_accelerations_are_those_between_two_rows(scene):
    reader = sources.Reader("tss1", scene)
    first = row_of(time=0, ship_velocity=(2.0, 0.0, 0.1))
    second = row_of(time=10_000_000, ship_velocity=(2.03, 0.04, 0.08))
    motion = reader.read(second, first)
    assert motion[5:] == pytest.approx((5.0, -2.0))
    for before in (None, second, row_of(time=-2 * S)):
        assert math.isnan(reader.read(second, before).vertical)


def test_readings_go_before_the_truth_where_the_instrument_is_on(scene):
    row = row_of(payout=1.0, encoder_payout=2.0, metering_payout=3.0, tension=4.0, load_pin_tension=5.0)
    row["mru_roll"], row["mru_heave"] = 0.25, 0.75

    def reader(name, *aboard):
        return sources.Reader(name, override(scene, {f"instruments.{part}.on": True for part in aboard}))

    found = reader("lci90i", "encoder", "load_pin")
    values = found.read(row)
    assert (values.payout, values.tension) == (2.0, 5.0)
    assert found.said == "tension of load_pin; speed, pay-out of encoder"
    found = reader("lci90i", "encoder", "metering_sheave")
    values = found.read(row)
    assert (values.payout, values.tension) == (3.0, 4.0)
    assert found.said == "tension of truth; speed, pay-out of metering_sheave"
    assert reader("lci90i").read(row).payout == 1.0
    found = reader("pashr", "mru")
    motion = found.read(row)
    assert (motion.roll, motion.heave) == (0.25, 0.75) and found.said == "roll, pitch, heave of mru"


def test_a_telegram_of_a_silent_instrument_is_withheld(scene):
    what = override(scene, {"instruments.mru.on": True, "instruments.mru.rate": 20.0})
    reader = sources.Reader("pashr", what)
    row = row_of(readings_new=1)
    reader.notice(row)
    for ticks, silent in ((5, False), (7, False), (8, True), (300, True)):
        row["time"], row["readings_new"] = int(row_of()["time"]) + ticks * 10_000_000, 2
        reader.notice(row)
        if silent:
            with pytest.raises(Withheld, match=f"no reading of mru for {0.01 * ticks:.2f} s"):
                reader.read(row)
        else:
            reader.read(row)
    row["readings_new"] = 1
    reader.notice(row)
    assert reader.read(row).heave == 0.0


@given(st.integers(1, 1000), st.integers(1, 10**18))
def test_as_many_are_due_as_the_rate_says(rate, start):
    tick, period = 10_000_000, round(S / min(rate, 100))
    ends = [start + tick * k for k in range(201)]
    due = [sources.due(end, end - tick, period) for end in ends[1:]]
    assert set(due) <= {0, 1} and abs(sum(due) - 2 * min(rate, 100)) <= 1
