"""Winch displays, TSS1, wave buoy, profiler, IMU, flux package, NMEA 2000: exact values, damage, clocks."""

from functools import partial

import instrument_logs as logs
import numpy as np
import pytest
from instrument_logs import MIDNIGHT, SECOND

from cable_sim_ros.tools.logs.log import LogError


def test_a_winch_keeps_both_clocks_and_its_name(read):
    later = MIDNIGHT + 20 * SECOND
    log = read(logs.winch(50, "TR METAL") + logs.winch(30, "UPPER WF", later) + logs.winch(2, "", later))
    assert log.format == "lci90i" and log.records == 82 and not log.losses
    assert list(log.sources) == ["lci90i/TR METAL", "lci90i/UPPER WF", "lci90i/02"]
    winch = log.sources["lci90i/TR METAL"]
    k = np.arange(50)
    assert winch.logged.tolist() == (MIDNIGHT + k * 50_000_000).tolist()
    assert set((winch.device - winch.logged).tolist()) == {1718 * SECOND}
    assert winch.columns["tension"].tolist() == k.tolist() and "tension" not in winch.units
    assert winch.columns["payout"].tolist() == [round(-34 + 0.1 * i, 1) for i in range(50)]
    assert winch.columns["speed"].tolist() == [6.0] * 50 and winch.units["speed"] == "m/min"
    assert any("does not tell the unit of its tension" in notice for notice in log.notices)


def test_wrong_sums_and_other_damage_of_a_winch(read):
    lines = logs.winch(20).splitlines(keepends=True)
    lines[3] = lines[3].replace(b"006.0", b"007.0")
    lines[5] = lines[5].replace(b"RAWL,", b"RAWL;")
    lines[7] = lines[7].replace(b"T00:28:38", b"T99:28:38")
    lines[9] = lines[9][:60] + b"\r\n" + lines[9][60:]
    log = read(b"".join(lines))
    assert log.records == 16 and log.losses.counts["wrong checksum"] == 2  # the time is below the sum too
    assert log.losses.counts["telegram of an LCI-90i that does not fit"] == 2


def test_tss1(read):
    log = read(logs.tss(30).replace(b" 0000F", b" 0000u", 1) + b":0000\r\n:00FFCA -0003F-0325 -9999\r\n")
    source = log.sources["tss1"]
    assert log.records == len(source.columns["roll"]) == 30 and source.logged is None and source.device is None
    assert np.isnan([source.columns[name][0] for name in ("heave", "roll", "pitch")]).all()  # u: settling
    assert source.columns["heave"][1:].tolist() == [round(0.01 * k, 2) for k in range(1, 30)]
    assert source.columns["roll"][1:].tolist() == pytest.approx([0.1 * k for k in range(1, 30)], abs=0.006)
    assert source.columns["settled"].tolist() == [0.0] + [1.0] * 29
    assert set(source.columns["horizontal"]) == {10 * 0.0383} and set(source.columns["vertical"]) == {-800 * 0.000625}
    assert any("TSS1 has no checksum" in notice for notice in log.notices)
    assert log.losses.counts == {"telegram of TSS1 with an angle beyond 90 deg": 1}


def test_the_series_of_a_wave_buoy(read):
    log = read(logs.buoy(3))
    assert log.records == 6 and not log.losses
    series, statistics = log.sources["TSPHA"], log.sources["TSPWA"]
    k = np.tile(np.arange(40), 3)
    start = MIDNIGHT + 59 * SECOND + np.repeat(np.arange(3), 40) * 3600 * SECOND
    assert series.device.tolist() == (start + 60_164_000_000 + k * 781_000_000).tolist() and series.logged is None
    assert series.columns["heave"].tolist() == [round(0.01 * i, 2) for i in k]
    assert series.columns["north"].tolist() == [round(0.02 * i, 2) for i in k]
    assert series.columns["east"].tolist() == [round(-0.01 * i, 2) for i in k]
    assert statistics.columns["significant_height"].tolist() == [1.58] * 3
    assert statistics.columns["significant_height_spectral"].tolist() == [1.72] * 3
    assert statistics.device.tolist() == [MIDNIGHT + 59 * SECOND + h * 3600 * SECOND for h in range(3)]
    assert any("3 sentences TSPNA" in notice for notice in log.notices)


@pytest.mark.parametrize(
    "old, new, cause",
    [
        (b",40,60.164,", b",999999999,60.164,", "series with another count of displacements than it says"),
        (b",60.164,0.781,", b",60.164,0.0,", "series whose times cannot be"),
        (b",60.164,0.781,0,", b",60.164,0.781,1,", "series for which the buoy found no solution"),
        (b"20140801", b"20149901", "date that is none"),
        (b",0.05,", b",0.0x5,", "field that is no number"),
    ],
)
def test_a_series_that_cannot_be(read, old, new, cause):
    lines = logs.buoy(2).splitlines(keepends=True)
    stamp, _, body = lines[3].strip().rpartition(b"$")
    lines[3] = stamp + logs.checked(body.rpartition(b"*")[0].replace(old, new, 1))
    log = read(b"".join(lines))
    assert log.records == 3 and log.losses.counts == {cause: 1}


def test_the_winch_of_a_profiler(read):
    log = read(logs.profiler(30) + b"1397773530.0\t0.1\tn\n1397773530.0\t0.1\tn\t-14x\t0F\t9.5\n1397773531.0\t0.1")
    winch = log.sources["WM"]
    assert log.format == "profiler-winch" and log.records == 30
    assert winch.device.tolist() == [1_397_773_523 * SECOND + k * SECOND // 16 // 100_000 * 100_000 for k in range(30)]
    assert winch.columns["Rope On Drum"][1:].tolist() == [round(9.55 + k, 2) for k in range(1, 30)]
    assert np.isnan(winch.columns["Rope On Drum"][0])  # its time is suspect
    assert winch.columns["Encoder Counts"][3] == -1_494_306 and winch.columns["Status"][0] == 0xF000
    assert winch.columns["Suspect Timestamp"].tolist() == [1.0] + [0.0] * 29
    assert winch.units == {"Depth": "dbar", "Rope On Drum": "m"}
    causes = ("row with another count of columns than the heading", "field that is no number", "row cut off")
    assert log.losses.counts == dict.fromkeys(causes, 1)


def test_a_heading_whose_columns_have_one_name(read):
    with pytest.raises(LogError, match="line 4: heading with 6 columns.*Correct the heading, or save the table as CSV"):
        read(logs.profiler(3).replace(b"Encoder Counts", b"Depth"))


def test_an_imu(read):
    log = read(logs.gx3(50))
    imu = log.sources["3dm-gx3"]
    assert log.records == 50 and not log.losses and imu.logged is None
    assert imu.device.tolist() == [(100_000 + 6250 * k) * 16_000 for k in range(50)]  # 0.1 s apart
    assert imu.columns["acceleration_x"].tolist() == [k / 8 for k in range(50)] and imu.units["rate_x"] == "rad/s"


def test_an_imu_is_found_again_behind_damage(read):
    data = bytearray(logs.gx3(50))
    data[43 * 10 + 7] ^= 1
    log = read(bytes(data[: 43 * 20]) + b"\xcb" * 77 + bytes(data[43 * 20 :]) + b"\xcb\x00")
    kept = [k for k in range(50) if k != 10]
    assert log.sources["3dm-gx3"].columns["acceleration_x"].tolist() == [k / 8 for k in kept]
    assert log.losses.counts == {"damaged bytes before a record": 2, "record cut off at the end": 1}
    assert log.losses.first["damaged bytes before a record"] == "byte 430"


@pytest.mark.parametrize("block", [43, 100, 997, 5000])
def test_blocks_of_a_file_make_no_difference(read, monkeypatch, block):
    from cable_sim_ros.tools.logs.devices import lines

    data = logs.gx3(60)
    data = data[:500] + b"\x00" * 30 + data[500:]
    whole = read(data)
    monkeypatch.setattr(lines, "RECORDS", block)
    log = read(data)
    assert log.losses == whole.losses and log.records == whole.records == 59
    assert log.sources["3dm-gx3"].device.tolist() == whole.sources["3dm-gx3"].device.tolist()


def test_a_timer_that_runs_over_and_one_that_is_reset(read):
    over = read(logs.gx3(20, 2**32 - 10 * 6250))
    assert set(np.diff(over.sources["3dm-gx3"].device).tolist()) == {SECOND // 10}
    assert not any("started again" in notice for notice in over.notices)
    reset = read(logs.gx3(20, 5_000_000) + logs.gx3(20, 1000))
    steps = np.diff(reset.sources["3dm-gx3"].device)
    assert np.flatnonzero(steps < 0).tolist() == [19]
    assert any("goes back 1 times" in notice and "at record 21" in notice for notice in reset.notices)


def test_a_flux_package_over_midnight(read):
    log = read(logs.fdchp(30))
    source = log.sources["fdchp"]
    assert log.records == 30 and not log.losses
    assert set(np.diff(source.device).tolist()) == {SECOND // 10}
    assert source.device[10] == 1_417_392_000 * SECOND  # 2014-12-01T00:00:00Z
    assert source.columns["roll"].tolist() == [k / 64 for k in range(30)]
    assert source.columns["wind_x"][0] == -125.0 and np.isnan(source.columns["wind_z"]).all()
    assert source.units["wind_x"] == "cm/s" and source.units["roll"] == "rad"


def test_a_flux_package_with_a_piece_missing(read):
    data = logs.fdchp(30)
    log = read(data[:400] + data[417:] + data[:30])
    assert log.records == 29
    assert log.losses.counts == {"damaged bytes before a record": 1, "record cut off at the end": 1}


def test_nmea_2000(read):
    log = read(logs.n2k(20))
    assert log.records == 60 and not log.losses
    assert list(log.sources) == ["127257/src 27", "127257/src 52", "127252/src 27"]
    roll, heave = log.sources["127257/src 27"], log.sources["127252/src 27"]
    assert roll.columns["roll"].tolist() == pytest.approx([0.001 * k for k in range(20)], abs=1e-12)
    assert roll.columns["pitch"].tolist() == pytest.approx([0.0145] * 20) and "yaw" not in roll.columns
    assert roll.units == {"pitch": "rad", "roll": "rad"} and roll.device is None
    assert heave.columns["heave"].tolist() == pytest.approx([0.01 * k for k in range(20)], abs=1e-12)
    assert heave.logged.tolist() == [MIDNIGHT + k * SECOND // 10 for k in range(20)]


GNSS = bytes.fromhex("019c3f00e1f505 00e40b5402000000 00c817a804000000 40420f0000000000 23fc0c46008200a086010000")


def fast(payload: bytes, sequence: int) -> list[bytes]:
    """Frames of a fast packet."""
    parts = [payload[:6], *(payload[k : k + 7] for k in range(6, len(payload), 7))]
    heads = [bytes([sequence << 5, len(payload)]), *(bytes([sequence << 5 | k]) for k in range(1, len(parts)))]
    return [(head + part).ljust(8, b"\xff") for head, part in zip(heads, parts)]


def plain(pgn: int, data: bytes, source: int = 3) -> bytes:
    """A line of canboat's raw form."""
    return f"2014-08-01-00:00:00.5,3,{pgn},{source},255,{len(data)},{data.hex(',')}\n".encode()


def test_fast_packets_are_the_same_joined_or_not(read):
    joined = read(plain(129029, GNSS))
    parts = read(b"".join(map(partial(plain, 129029), fast(GNSS, 2))))
    mixed = read(b"".join(plain(129029, a) + plain(129029, b, 4) for a, b in zip(fast(GNSS, 2), fast(GNSS, 2))))
    first = joined.sources["129029/src 3"].columns
    assert first["latitude"][0] == pytest.approx(1e-6) and first["longitude"][0] == pytest.approx(2e-6)
    for log, names in ((parts, ["129029/src 3"]), (mixed, ["129029/src 3", "129029/src 4"])):
        assert not log.losses and sorted(log.sources) == names
        for name in names:
            assert {c: v[0] for c, v in log.sources[name].columns.items()} == {c: v[0] for c, v in first.items()}
    assert any("tell no zone" in notice for notice in joined.notices)


def test_fast_packets_that_are_not_whole(read):
    frames = [plain(129029, frame) for frame in fast(GNSS, 1)]
    whole = logs.n2k(1)
    assert read(whole + b"".join(frames[:3])).losses.counts == {"fast packet not complete": 1}
    lost = "frame of a fast packet whose start is lost"
    assert read(whole + b"".join(frames[1:])).losses.counts == {lost: len(frames) - 1}
    holed = read(whole + b"".join(frames[:2] + frames[3:]))
    assert holed.losses.counts == {"fast packet not complete": 1, lost: len(frames) - 4}


def test_candump_and_lines_that_are_no_frames(read):
    attitude = "00FF7F91000A00FF"
    lines = [f"(1406851200.{k:06d}) can0 09F1191B#{attitude}\n" for k in range(3)]
    log = read("".join([*lines, "(1406851200.9) can0 09F1191B#12345\n", "(1406851200.95) can0 09F119"]).encode())
    assert log.sources["127257/src 27"].columns["roll"].tolist() == pytest.approx([0.001] * 3)
    assert log.sources["127257/src 27"].logged.tolist() == [MIDNIGHT + k * 1000 for k in range(3)]
    assert log.losses.counts == {"line that is no frame": 1, "frame cut off": 1}


def test_a_pgn_that_nobody_knows(read):
    log = read(logs.n2k(1) + plain(131000, bytes(8)))
    assert log.records == 3 and any("PGN 131000" in notice for notice in log.notices)
