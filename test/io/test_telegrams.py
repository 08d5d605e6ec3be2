"""Telegrams byte for byte as real instruments write them, there and back, and never a wrong number."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.tools.telegrams import lci90i, pashr, psxn, sources, tss1
from cable_sim_ros.tools.telegrams.fields import Motion, TelegramError, Withheld
from cable_sim_ros.tools.telegrams.lci90i import Winch

pytestmark = pytest.mark.check

LOGS = Path(__file__).resolve().parents[3] / "shared" / "data" / "foreign" / "nbp1406_winch"
PAGE = Path(__file__).parents[2] / "docs" / "telegrams.md"
TRAWL = b"\x0102RD,2014-08-01T00:29:19.251,STBD TRAWL,-0000003,000000.0,-00034.0,3588\r\n"  # NBP1406
CTD = b"\x0101RD,2014-08-01T20:32:40.955,UPPER WF,-134.,00000012,000003.3,3312\r\n"  # the same, another winch
NAMELESS = b"\x0103RD,2022-05-14T16:17:36.502,-0000168,00000000,-00004.8,2839\r\n"  # a public log of another ship
SEAPATH = b"$PSXN,23,0.35,-1.74,218.26,0.58*13\r\n"  # NBP1406
POS_MV = b"$PASHR,145719.272,252.41,T,1.22,0.48,0.01,0.090,0.090,0.116,2,1*11\r\n"  # a public parser
SPAN = b"$PASHR,163029.000,158.09,T,-0.30,+0.31,+0.01,0.029,0.029,0.059,1,1*3B\r\n"  # documentation of NovAtel
TSS = b":00FFCA -0003F-0325  0319\r\n"  # documentation of NovAtel
LB, DEG, S = 4.4482216152605, math.pi / 180, 1_000_000_000
number = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-400.0, 400.0) | st.floats(-1e8, 1e8)
angle = st.floats(-1.6, 1.6) | st.floats(-7.0, 7.0) | number
times = st.integers(0, 2**62)


@pytest.mark.parametrize("line", [TRAWL, CTD, NAMELESS])
def test_lines_of_winch_displays_come_back_byte_for_byte(line):
    assert lci90i.encode(*lci90i.decode(line)) == line


def test_a_line_of_a_winch_display_is_read_in_units_and_signs():
    values, form = lci90i.decode(TRAWL)
    assert values == (1406852959251000000, -3 * LB, 0.0, -34.0)
    assert form == (2, "STBD TRAWL", False, 1, lci90i.TensionUnit.LB)
    values, form = lci90i.decode(CTD)
    assert values[1:] == (-134 * LB, 0.2, 3.3) and form[:4] == (1, "UPPER WF", True, 0)
    assert lci90i.decode(NAMELESS)[1].name == ""


def test_lines_of_motion_sensors_come_back_byte_for_byte():
    assert psxn.encode(psxn.decode(SEAPATH)) == SEAPATH
    assert pashr.encode(*pashr.decode(POS_MV)) == POS_MV
    assert tss1.encode(*tss1.decode(TSS)) == TSS
    values, form = pashr.decode(SPAN)  # with plus signs, which POS MV leaves out
    assert (form.aiding, form.imu) == (1, 1) and values.heave == 0.01 and values.time == 59429 * S


def test_the_telegrams_on_the_page_are_such():
    shown = re.findall(r"^(?:<SOH>\d|\d\dRD|\$P|:\d).*$", PAGE.read_text("utf-8"), re.M)
    lines = [line.replace("<SOH>", "\x01").replace("<CR><LF>", "\r\n").encode() for line in shown]
    assert len(lines) == 5 and all(map(lci90i.decode, lines[:2])) and tss1.decode(lines[4])
    assert psxn.decode(lines[2]) and pashr.decode(lines[3])


def test_motion_has_the_signs_of_the_sources():
    """REP 103: roll port up, pitch bow down, yaw from east to north, heave up."""
    seapath = psxn.decode(SEAPATH)
    expected = (0.35 * DEG, 1.74 * DEG, (90 - 218.26) * DEG, -0.58)
    assert seapath[1:5] == pytest.approx(expected)  # its heave is positive down, its pitch bow up
    pos_mv, _ = pashr.decode(POS_MV)
    assert pos_mv[1:5] == pytest.approx((1.22 * DEG, -0.48 * DEG, (90 - 252.41) * DEG, 0.01))
    assert pashr.decode(POS_MV, heave_up=False)[0].heave == -0.01
    assert b",0.48,-0.01," in pashr.encode(pos_mv, pashr.Form(heave_up=False))
    tss, _ = tss1.decode(TSS)
    assert tss[1:5] == pytest.approx((-3.255074 * DEG, -3.19 * DEG, 0.0, -0.03), rel=1e-5)
    assert tss[5:] == (0.0, -54 * 0.000625)


@pytest.mark.skipif(not LOGS.is_dir(), reason="the real logs are not beside this checkout")
@pytest.mark.parametrize("name", ["twnc", "cwnc", "s330"])
def test_every_line_of_the_real_logs_comes_back_byte_for_byte(name):
    lines = (LOGS / f"NBP1406_{name}-2014-08-01").read_bytes().splitlines()
    found = [line.partition(b" ")[2] for line in lines]
    if name == "s330":
        found = [line for line in found if line.startswith(b"$PSXN,23")]
        again = [psxn.encode(psxn.decode(line)) for line in found]
    else:
        again = [lci90i.encode(*lci90i.decode(line)) for line in found]
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
    read, again = lci90i.decode(line, unit)
    assert again == form and read.time == time // 1_000_000 * 1_000_000
    size = lci90i.NEWTON[unit]
    assert abs(read.tension - tension) <= 0.5 * size * (1 + 1e-6)
    assert abs(read.speed - speed) <= 0.5 / 60 * 10.0**-decimals * (1 + 1e-6)
    assert abs(read.payout - payout) <= 0.05 * (1 + 1e-6)
    assert lci90i.encode(read, form) == line
    parts = line.split(b",")
    assert [len(part) for part in parts[-3:-1]] == [8, 8] and (plain or len(parts[3]) == 8)


@given(times, angle, angle, angle, number, number, st.floats(-25.0, 25.0) | number)
@example(0, 0.0, 0.0, math.pi / 2, 0.0, 0.0, 0.0)
@example(0, 0.0, 0.0, math.pi / 2 + 1e-9, 99.994, 9.76, -20.48)
@example(0, math.pi / 2, -math.pi / 2, 0.0, -99.0, 0.0, 20.479)
def test_a_motion_telegram_is_right_or_withheld(time, roll, pitch, yaw, heave, across, along):
    motion = Motion(time, roll, pitch, yaw, heave, across, along)
    usual = abs(roll) < 1.5 and abs(pitch) < 1.5 and abs(yaw) < 6.3 and abs(heave) < 99.0
    half = 0.00501
    for encode, decode in ((psxn.encode, psxn.decode), (pashr.encode, lambda line: pashr.decode(line)[0])):
        try:
            line = encode(motion)
        except Withheld:
            assert not usual
            continue
        read = decode(line)
        assert abs(read.roll - roll) <= half * DEG and abs(read.pitch - pitch) <= half * DEG
        assert abs(math.remainder(read.yaw - yaw, math.tau)) <= half * DEG and abs(read.heave - heave) <= half
        assert b",360.00," not in line and encode(read._replace(time=time)) == line and len(line) <= 82
    try:
        line = tss1.encode(motion)
    except Withheld:
        assert not (usual and 0.0 <= across < 9.7 and abs(along) < 20.0)
        return
    read = tss1.decode(line)[0]
    assert len(line) == 27 and abs(read.heave - heave) <= half and abs(read.pitch - pitch) <= half * DEG
    assert abs(math.sin(read.roll) * math.cos(read.pitch) - math.sin(roll) * math.cos(pitch)) <= 4 * half * DEG
    assert abs(read.horizontal - across) <= 0.02 and abs(read.vertical - along) <= 0.00032


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


@pytest.mark.parametrize(
    "line, decode", [(TRAWL, lci90i.decode), (CTD, lci90i.decode), (SEAPATH, psxn.decode), (POS_MV, pashr.decode)]
)
def test_no_changed_byte_passes_the_checksum(line, decode):
    first = 1 if line[0] in b"\x01$" else 0
    for place in range(first, len(line) - 2):
        for change in (1, 4, 16):
            broken = bytearray(line)
            broken[place] ^= change
            if place >= len(line) - 4 and line[0:1] == b"$" and broken.upper() == line:
                continue  # the case of a hexadecimal digit
            with pytest.raises(TelegramError):
                decode(bytes(broken))


@pytest.mark.parametrize("decode", [lci90i.decode, psxn.decode, pashr.decode, tss1.decode])
@pytest.mark.parametrize("line", [b"", b"\r\n", b"$PSXN,20,1,0,0,0*3A\r\n", TSS[:-4] + b"\r\n", b"\xff" * 30])
def test_what_is_no_such_telegram_is_refused(decode, line):
    with pytest.raises(TelegramError):
        decode(line)


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
