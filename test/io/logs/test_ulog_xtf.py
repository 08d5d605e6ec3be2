"""ULog and XTF files made here, whole and damaged."""

import ctypes
import struct
import sys

import instrument_logs as logs
import pytest
from hostile_logs import survive

from cable_sim_ros.tools.logs.containers import ulog, xtf
from cable_sim_ros.tools.logs.log import LogError

pytest.importorskip("pyulog")
pyxtf = pytest.importorskip("pyxtf")
FORMATS = (
    "att:uint64_t timestamp;float roll;float[2] rate;char[4] word;vec at;uint8_t[3] _padding0;",
    "vec:double x;double y;",
    "gps:uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;",
)
UTC = 1_406_851_200_000_000  # us


def message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def attitude(number, k):
    return message("D", struct.pack("<HQfff4sdd", number, 1000 * k, 0.5 * k, 1.0, 2.0, b"text", 3.0, 4.0))


def ulog_bytes(n=20, gps=True, formats=FORMATS, subscribe=("att", "att", "gps")):
    """Two instances of att, and one message of gps each second."""
    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    data += b"".join(message("F", text.encode()) for text in formats)
    for number, name in enumerate(subscribe):
        data += message("A", struct.pack("<BH", number % 2, number) + name.encode())
    for k in range(n):
        data += attitude(0, k) + attitude(1, 2 * k)
        if gps and not k % 10:
            data += message("D", struct.pack("<HQQi", 2, 1000 * k, UTC + 1000 * k + k, 7))
    return data + message("O", struct.pack("<H", 250)) + message("S", b"\x2f\x73\x13\x20\x25\x0c\xbb\x12")


def test_each_instance_of_a_ulog_message_is_a_source(read):
    log = read(ulog_bytes())
    assert (log.format, log.records, bool(log.losses)) == ("ulog", 42, False)
    assert list(log.sources) == ["att/0", "att/1", "gps/0"]
    first = log.sources["att/0"]
    assert list(first.columns) == ["roll", "rate[0]", "rate[1]", "at.x", "at.y"]
    assert first.columns["roll"].tolist() == [0.5 * k for k in range(20)]
    assert log.sources["att/1"].device.tolist() == [2_000_000 * k for k in range(20)]
    assert (first.logged - first.device).tolist() == [UTC * 1000 + 5_000] * 20  # middle of 0 and 10 us
    assert "lost data 1 times, 0.25 s" in log.notices[0] and "differ by up to 5e-06 s" in log.notices[1]


def test_a_ulog_without_utc_has_no_logger_s_clock_and_says_so(read):
    log = read(ulog_bytes(gps=False))
    assert all(source.logged is None for source in log.sources.values())
    assert "no satellite receiver told UTC" in log.notices[-1]


def test_a_damaged_ulog_gives_what_is_sound(read, tmp_path):
    cuts, flips = survive(ulog.read, ulog_bytes(), tmp_path / "a.ulg")
    assert sum(log is not None and log.records > 0 for log in cuts) > 40
    assert sum(log is not None and log.records >= 38 for log in flips) > 120
    whole = ulog_bytes()
    at = whole.index(attitude(0, 5))
    log = read(whole[:at] + b"\xff" * 50 + whole[at:])
    assert log.records == 42 and log.losses.first["bytes that are no message"] == f"byte {at}"


@pytest.mark.parametrize(
    "formats",
    [
        ("att:uint64_t timestamp;float[65535] a;float[65535] b;",),
        ("att:uint64_t timestamp;att inner;",),
        ("att:uint64_t timestamp;b[999] x;", "b:c[999] x;", "c:float[999] x;"),
        ("att:uint64_t timestamp;float[99999999999] a;",),
        ("att:uint64_t timestamp;float a;float a;",),
        ("att:uint64_t timestamp;nothing a;",),
    ],
)
def test_a_ulog_definition_that_would_take_all_memory_is_refused(read, formats):
    log = read(ulog_bytes(3, formats=formats, subscribe=("att",)))
    assert log.records == 0
    assert {"subscription that cannot be used", "definition that cannot be read"} & set(log.losses.counts)


def test_many_wide_subscriptions_have_an_end(read):
    formats = ("att:uint64_t timestamp;" + "".join(f"float[1000] a{k};" for k in range(4)),)
    log = read(ulog_bytes(1, formats=formats, subscribe=("att",) * 2000))
    assert log.losses.counts["subscription that cannot be used"] > 1900


def test_garbage_in_a_ulog_does_not_take_for_ever(read):
    assert read(ulog_bytes() + bytes(range(1, 256)) * 8000).records == 42


def packet(kind, **values):
    made = kind()
    for name, value in values.items():
        setattr(made, name, value)
    made.NumBytesThisRecord = -(-ctypes.sizeof(made) // 64) * 64
    return bytes(made).ljust(made.NumBytesThisRecord, b"\0")


DATE = dict(Year=2015, Month=7, Day=8, Hour=23, Minute=59, Second=59)


def xtf_bytes(n=20, sensors=(1,)):
    header = pyxtf.XTFFileHeader()
    header.FileFormat, header.NavUnits = 123, 3
    data = bytes(header).ljust(1024, b"\0")
    for k in range(n):
        for sensor in sensors:
            data += packet(
                pyxtf.XTFAttitudeData, HeaderType=3, SubChannelNumber=sensor, Roll=float(k), Heave=0.5,
                Millisecond=40 * k, TimeTag=1000 + 40 * k, **DATE,
            )  # fmt: skip
        if not k % 5:
            data += packet(
                pyxtf.XTFPosRawNavigation, HeaderType=107, RawYcoordinate=37.5, Microsecond=400 * k, **DATE
            ) + packet(pyxtf.XTFPingHeader, HeaderType=0, CableOut=120, Layback=95.5, HSeconds=4 * k, **DATE)
    return data + packet(pyxtf.XTFNotesHeader, HeaderType=1)


def test_attitude_positions_and_pings_of_an_xtf_are_sources(read):
    log = read(xtf_bytes())
    assert (log.format, log.records, bool(log.losses)) == ("xtf", 28, False)
    attitude, position, ping = (log.sources[name] for name in ("attitude", "position", "sonar_ping"))
    assert attitude.columns["Roll"].tolist() == list(range(20)) and attitude.units["Heave"] == "m"
    assert attitude.device.tolist() == [(1000 + 40 * k) * 1_000_000 for k in range(20)]
    start = 1_436_399_999_000_000_000
    assert attitude.logged.tolist() == [start + 40_000_000 * k for k in range(20)]
    assert position.logged.tolist() == ping.logged.tolist() == attitude.logged[::5].tolist()  # three kinds of parts
    assert position.units["RawYcoordinate"] == "deg" and position.device is None
    assert ping.columns["CableOut"].tolist() == [120.0] * 4 and ping.columns["Layback"][0] == 95.5
    assert log.notices == ["1 packets of kind 1 (notes) hold no motion and are left out"]


def test_two_sensors_of_an_xtf_are_two_sources(read):
    assert {"attitude", "attitude/2"} < set(read(xtf_bytes(sensors=(1, 2))).sources)


def test_a_damaged_xtf_gives_what_is_sound_and_runs_no_index_file(read, tmp_path):
    (tmp_path / "a.pyxtf_idx").write_bytes(b"cos\nabort\n(tR.")  # pyxtf's own reader would run it
    cuts, flips = survive(xtf.read, xtf_bytes(), tmp_path / "a.xtf")
    assert sum(log is not None and log.records > 0 for log in cuts) > 30
    assert sum(log is not None and log.records >= 27 for log in flips) > 150
    whole = xtf_bytes()
    log = read(whole[:1024] + b"\xce\xfa" * 40 + whole[1024:-70], "a.xtf")
    assert log.records == 28 and log.losses.counts == {"bytes that are no packet": 1, "packet cut off": 1}


PARSED = {"pyulog": ulog_bytes(), "pyxtf": xtf_bytes(), "pynmeagps": logs.seapath(1), "nmea2000": logs.n2k(1)}


@pytest.mark.parametrize("name", PARSED)
def test_a_parser_that_is_missing_is_named_with_the_command(read, name, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    why = rf"read with {name}, which is not installed; nothing was read. pip install 'cable_sim_ros\[import\]'"
    with pytest.raises(LogError, match=why):
        read(PARSED[name])
