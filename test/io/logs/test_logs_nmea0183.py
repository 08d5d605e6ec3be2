"""NMEA 0183 logs: values as the sentences have them, clocks, checksums, sentences cut in two."""

import math
import sys

import instrument_logs as logs
import numpy as np
import pytest
from instrument_logs import DAY, MIDNIGHT, SECOND, exclusive_or, iso, sentence

from cable_sim_ros.tools.logs.devices import sentences
from cable_sim_ros.tools.logs.devices.telegrams import NMEA0183
from cable_sim_ros.tools.logs.inspection.inspect_log import first_mapping
from cable_sim_ros.tools.logs.log import LogError
from cable_sim_ros.tools.logs.read_signals import read as read_signals
from cable_sim_ros.tools.telegrams import psxn


def test_a_seapath_log_gives_what_was_written(read):
    log = read(logs.seapath(20))
    assert log.records == 160 and not log.losses and log.format == "nmea0183"
    motion = log.sources["PSXN,23"]
    k = np.arange(20)
    assert motion.columns["roll"].tolist() == [round(0.1 * i, 2) for i in range(20)]
    assert motion.columns["heave"].tolist() == [-round(0.01 * i, 2) for i in range(20)]  # down, as the sentence has it
    assert set(motion.columns["pitch"]) == {-1.0} and set(motion.columns["heading"]) == {218.26}
    assert motion.units == {"roll": "deg", "pitch": "deg", "heading": "deg", "heave": "m"}
    assert motion.logged.tolist() == (MIDNIGHT + k * SECOND + 300_000_000).tolist() and motion.device is None
    place = log.sources["INGGA"]
    assert place.columns["lat"][0] == -(22 + 0.110899 / 60) and place.columns["lon"][0] == -(17 + 56.359432 / 60)
    assert place.columns["alt"][0] == -2.76 and place.units["alt"] == "m"
    assert place.device.tolist() == (MIDNIGHT + k * SECOND).tolist()
    assert log.sources["INVTG"].columns["sogn"][0] == 9.1 and log.sources["INVTG"].units["sogn"] == "kn"
    assert log.sources["INRMC"].columns["status"][0] == 1.0 and log.sources["INRMC"].columns["mv"][0] == -24.7
    assert log.sources["PSXN,20"].columns["horizontal_quality"][0] == 1.0
    assert log.sources["PSXN,22"].columns["gyro_offset"][0] == -0.8


STANDARD = (
    "INGGA,235959.16,2200.110899,N,01756.359432,E,1,12,0.7,-2.76,M,4.67,M,,",
    "GPRMC,000000.16,V,2200.110899,S,01756.359432,W,9.1,215.11,010814,24.7,E,A",
    "GPGLL,2200.110899,S,01756.359432,W,000000.16,A,D",
    "INVTG,215.11,T,239.79,M,9.1,N,16.9,K,N",
    "HEHDT,218.26,T",
    "HCHDG,98.3,0.5,W,12.6,E",
    "TIROT,-12.5,A",
    "SDDPT,2.3,0.5,100.0",
    "SDDBT,7.8,f,2.4,M,1.3,F",
    "VWVHW,245.1,T,245.1,M,0.02,N,0.04,K",
    "GPGST,172814.0,0.006,0.023,0.020,273.6,0.023,0.020,0.031",
)


@pytest.mark.parametrize("body", STANDARD)
def test_standard_sentences_are_read_as_the_library_reads_them(body):
    from pynmeagps import NMEAReader

    theirs = NMEAReader.parse(sentence(body))
    identity, *fields = body.split(",")
    ours = sentences.decode(identity, fields)
    assert ours.source == identity
    numbers = {n: v for n, v in vars(theirs).items() if not n.startswith("_") and isinstance(v, (int, float))}
    signed = {n: -v if getattr(theirs, n + "EW", "") == "W" else v for n, v in numbers.items()}
    assert {n: v for n, v in ours.values.items() if n in signed} == pytest.approx(signed, abs=1e-10)
    status = {n: v for n, v in ours.values.items() if n not in signed}
    assert all(v == (getattr(theirs, n) not in ("V", "N")) for n, v in status.items())


def test_sentences_of_other_makers(read):
    bodies = (
        "PSXN,24,0.5,-0.25,1.5,0.125",
        "PRDID,-1.31,7.81,47.31",
        "PFEC,GPhve,0.125,A",
        "PFEC,GPatt,218.2,-0.5,0.25",
        "PTNTHPR,85.9,N,-0.9,N,0.8,N",
        "PXYZ,4.5,abc,7",
        "YXXDR,A,1.5,D,PTCH,A,-2.5,D,ROLL,D,0.25,M,HEAVE",
    )
    log = read(b"".join(sentence(body) for body in bodies))
    assert {n: {c: v[0] for c, v in s.columns.items()} for n, s in log.sources.items()} == {
        "PSXN,24": {"roll_rate": 0.5, "pitch_rate": -0.25, "yaw_rate": 1.5, "vertical_velocity": 0.125},
        "PRDID": {"pitch": -1.31, "roll": 7.81, "heading": 47.31},
        "PFEC,GPhve": {"heave": 0.125, "valid": 1.0},
        "PFEC,GPatt": {"heading": 218.2, "pitch": -0.5, "roll": 0.25},
        "PTNTHPR": {
            **{"heading": 85.9, "heading_valid": 1.0, "pitch": -0.9, "pitch_valid": 1.0},
            **{"roll": 0.8, "roll_valid": 1.0},
        },
        "PXYZ": {"field_01": 4.5, "field_03": 7.0},
        "YXXDR": {"PTCH": 1.5, "ROLL": -2.5, "HEAVE": 0.25},
    }
    assert log.sources["YXXDR"].units == {"PTCH": "deg", "ROLL": "deg", "HEAVE": "m"}


def test_midnight_by_the_date_of_another_sentence(read):
    start = MIDNIGHT + DAY - 3 * SECOND
    log = read(logs.seapath(6, start, stamped=False))
    expected = [start + k * SECOND for k in range(6)]
    for name in ("INGGA", "INZDA", "INRMC"):
        assert log.sources[name].device.tolist() == expected
    assert log.sources["PSXN,23"].device.tolist() == expected  # of the RMC before it
    assert any("time of the sentence before" in notice and "PSXN,23 (6)" in notice for notice in log.notices)


def test_midnight_by_the_stamps_of_the_logger(read):
    times = [MIDNIGHT + DAY + k * SECOND // 2 for k in range(-4, 4)]
    log = read(b"".join(iso(at + 900_000_000) + logs.pashr.encode(logs.motion(1, at)) for at in times))
    assert log.sources["PASHR"].device.tolist() == times
    assert log.sources["PASHR"].columns["heave"].tolist() == [0.01] * 8


def test_midnight_without_any_date(read):
    times = [MIDNIGHT + DAY + k * SECOND // 2 for k in range(-4, 4)]
    log = read(logs.applanix(times))
    assert log.sources["PASHR"].device.tolist() == [at - MIDNIGHT for at in times]
    assert any("no sentence tells a date" in notice for notice in log.notices)


def test_wrong_checksums_are_counted_and_refused(read):
    lines = logs.seapath(10).splitlines(keepends=True)
    wrong = [b"0" if line[-3:-2] != b"0" else b"1" for line in lines]
    log = read(
        b"".join(line[:-3] + w + line[-2:] if k in (7, 15) else line for k, (line, w) in enumerate(zip(lines, wrong)))
    )
    assert log.losses.counts == {"wrong checksum": 2} and log.losses.first == {"wrong checksum": "line 8"}
    assert log.records == 78 and len(log.sources["PSXN,23"]) == 8


@pytest.mark.parametrize("place", range(29, 62))
def test_a_sentence_cut_in_two_by_a_line_end_is_joined(read, place):
    line = iso(MIDNIGHT) + sentence("PSXN,23,0.35,-1.74,218.26,0.58")
    log = read(logs.seapath(2) + line[:place] + b"\r\n" + iso(MIDNIGHT + SECOND) + line[place:] + logs.seapath(2))
    heave = log.sources["PSXN,23"].columns["heave"].tolist()
    assert heave == [0.0, -0.01, 0.58, 0.0, -0.01] and not log.losses
    assert any("1 sentences were cut in two" in notice for notice in log.notices)


def test_a_sentence_whose_other_half_is_lost_is_counted(read):
    line = sentence("PSXN,23,0.35,-1.74,218.26,0.58")
    head, tail = line[:20] + b"\r\n", line[20:]
    log = read(head + logs.seapath(2, stamped=False) + tail + logs.seapath(1, stamped=False))
    assert log.records == 24
    assert log.losses.counts == {"sentence with too few fields": 1, "end of a sentence whose start is lost": 1}


def test_two_sentences_in_a_line_and_half_of_one(read):
    motion = sentence("PSXN,23,0.35,-1.74,218.26,0.58").strip()
    log = read(motion + motion + b"\n" + motion[:17] + motion + b"\r" + motion + b"\r\n")
    assert log.records == 4 and log.losses.counts == {"sentence with too few fields": 1}


def test_other_ends_nul_bytes_and_encodings(read):
    data = logs.seapath(5)
    whole = read(data)
    others = (
        data.replace(b"\r\n", b"\n"),
        data.replace(b"\r\n", b"\r"),
        data.replace(b"\r\n", b"\r\n\r\n"),
        data.replace(b"\r\n", b"\r\n" + bytes(5000), 3),
        data.decode().encode("utf-16"),
        data.decode().encode("utf-8-sig"),
        b"# gyro, Schn\xfcrboden\r\n" + data,
    )
    for other in others:
        log = read(other)
        assert log.records == whole.records and not log.losses
        for name, source in whole.sources.items():
            for column, values in source.columns.items():
                assert log.sources[name].columns[column].tolist() == values.tolist()


def test_a_line_without_end_costs_itself(read):
    log = read(logs.seapath(2) + b"$" + b"A,1" * 1_000_000 + b"\r\n" + logs.seapath(2))
    assert log.records == 32 and log.losses.counts == {"line longer than 65536 bytes": 1}


def test_sentences_without_checksum_count_where_none_has_one(read):
    lines = [b"$HEHDT,%.1f,T\r\n" % (200 + k) for k in range(5)]
    log = read(b"".join([*lines, b"$HEHDT\r\n", b"$HEHDT,20"]))
    assert log.sources["HEHDT"].columns["headingT"].tolist() == [200.0, 201.0, 202.0, 203.0, 204.0]
    assert log.losses.total == 2 and log.losses.counts["sentence cut off"] == 1
    assert any("no checksums" in notice and "HEHDT (5)" in notice for notice in log.notices)


def test_a_log_of_several_devices(read):
    log = read(
        logs.seapath(3) + logs.winch(5) + b"".join(iso(MIDNIGHT) + line for line in logs.tss(4).splitlines(True))
    )
    assert log.records == 24 + 5 + 4 and not log.losses
    assert {"PSXN,23", "lci90i/STBD TRAWL", "tss1"} <= log.sources.keys()


def test_a_line_without_the_stamp_of_the_others_is_lost(read):
    log = read(logs.seapath(5) + sentence("PSXN,23,0.35,-1.74,218.26,0.58"))
    assert len(log.sources["PSXN,23"].logged) == 5
    assert log.losses.counts == {"record without the logger's stamp that its others have": 1}


@pytest.mark.parametrize(
    "body, cause",
    [
        ("INGGA,000000.16,2260.110899,S,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,", "position that is none"),
        ("INGGA,000000.16,9200.110899,S,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,", "position that is none"),
        ("INGGA,000000.16,2200.110899,,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,", "position without its hemisphere"),
        ("INGGA,000000.16,2200.110899,X,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,", "hemisphere that is none"),
        ("INGGA,250000.16,2200.110899,S,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,", "time that is none"),
        ("INZDA,000000.17,31,02,2014,,", "date that is none"),
        ("INZDA,000000.17,01,08,9999,,", "date that is none"),
        ("INHDT,nan,T", "field that is no number"),
        ("INHDT,1_0,T", "field that is no number"),
        ("PSXN,23,0.35,-1.74,218.26", "sentence with too few fields"),
        ("psxn,23,0.35,-1.74,218.26,1", "sentence of no known form"),
    ],
)
def test_what_cannot_be_is_refused_by_cause(read, body, cause):
    log = read(logs.seapath(1) + iso(MIDNIGHT) + sentence(body))
    assert log.records == 8 and log.losses.counts == {cause: 1} and log.losses.first == {cause: "line 9"}


def test_names_of_transducers_do_not_multiply(read):
    log = read(b"".join(sentence(f"YXXDR,A,1.5,D,N{k}") for k in range(100)))
    assert len(log.sources["YXXDR"].columns) == 64 and log.losses.total == 36


def test_an_empty_file_one_of_something_else_and_one_that_is_not_there(read, tmp_path):
    (tmp_path / "empty").write_bytes(b"")
    with pytest.raises(LogError, match="holds no telegram that could be read .nothing was lost.; nothing was read"):
        NMEA0183.read(tmp_path / "empty")
    with pytest.raises(LogError, match="is of no format that is read here; nothing was read"):
        read(b"Dear captain, 12 bottles at $3,50\n")
    with pytest.raises(LogError, match="cannot be read .No such file.*Give a file that is there"):
        NMEA0183.read(tmp_path / "none")


def test_a_winch_needs_no_parser_of_sentences(read, monkeypatch):
    monkeypatch.setitem(sys.modules, "pynmeagps", None)
    assert read(logs.winch(3)).records == 3


def test_a_leap_second_and_a_blank_position(read):
    blank = "INGGA,235960.50,,,,,0,00,,,M,,M,,"
    log = read(logs.zda(MIDNIGHT + DAY - SECOND) + sentence(blank))
    assert log.sources["INGGA"].device[0] == MIDNIGHT + DAY + SECOND // 2
    assert "lat" not in log.sources["INGGA"].columns and not math.isnan(log.sources["INGGA"].columns["quality"][0])


@pytest.mark.parametrize("form", ["s330 {stamp}{line}", "{stamp}s330 {line}", "s330,{stamp}{line}"])
def test_devices_that_the_logger_names_are_apart(read, form):
    def named(name, data):
        head = form.replace("s330", name)
        lines = (line.partition(b" ") for line in data.splitlines(keepends=True))
        return b"".join(head.format(stamp=a.decode() + b.decode(), line=c.decode()).encode() for a, b, c in lines)

    one, other = named("s330", logs.seapath(3)), named("seap-2", logs.seapath(2))
    log = read(one + other + named("twnc", logs.winch(4)) + logs.seapath(1))
    assert not log.losses and log.records == 24 + 16 + 4 + 8
    assert [len(log.sources[name]) for name in ("s330/PSXN,23", "seap-2/PSXN,23", "PSXN,23")] == [3, 2, 1]
    assert len(log.sources["twnc/lci90i/STBD TRAWL"]) == 4
    assert log.sources["s330/INGGA"].logged[0] == MIDNIGHT + 300_000_000


def test_a_receiver_with_a_wrong_date_does_not_move_the_others(read):
    wrong = [sentence(f"GPZDA,{logs.hhmmss(MIDNIGHT + k * SECOND)},17,12,1994,,") for k in range(4)]
    right = [logs.zda(MIDNIGHT + k * SECOND) for k in range(4)]
    fixes = [logs.gga(MIDNIGHT + k * SECOND) for k in range(4)]
    log = read(b"".join(a + b + c for a, b, c in zip(right, wrong, fixes)))
    assert log.sources["INGGA"].device.tolist() == [MIDNIGHT + k * SECOND for k in range(4)]


def test_several_telegrams_without_line_ends_between(read):
    log = read(logs.winch(5).replace(b"\r\n", b"") + b"\r\n" + logs.tss(5).replace(b"\r\n", b"") + b"\r\n")
    assert {name: len(source) for name, source in log.sources.items()} == {"lci90i/STBD TRAWL": 5, "tss1": 5}


def test_stamps_of_another_day_than_the_sentences_tell(read):
    lines = [b"01/08/2014,00:00:%02d.3," % k + logs.zda(MIDNIGHT + k * SECOND) for k in range(5)]
    notices = read(b"".join(lines)).notices  # month first, as SCS: 8 January
    assert "the logger's dates are taken as month/day/year" in notices
    assert "the logger's stamps are 205.0 days behind the dates that INZDA tells" in notices
    assert not any("days" in notice for notice in read(logs.seapath(5)).notices)


FLAGGED = (  # sentence whose flag stands at @, letters or digits that say "not valid", one that says so not, columns
    ("INGGA,000001.00,2200.110899,S,01756.359432,W,@,12,0.7,-2.76,M,4.67,M,,", "0", "2", ("lat", "lon", "alt")),
    ("INRMC,000001.00,@,2200.110899,S,01756.359432,W,9.1,215.11,010814,24.7,W,A", "V", "A", ("lat", "lon", "spd")),
    ("INRMC,000001.00,A,2200.110899,S,01756.359432,W,9.1,215.11,010814,24.7,W,@", "N", "D", ("lat", "lon", "cog")),
    ("INGLL,2200.110899,S,01756.359432,W,000001.00,@,A", "V", "A", ("lat", "lon")),
    ("INVTG,215.11,T,239.79,M,9.1,N,16.9,K,@", "N", "E", ("cogt", "sogn", "sogk")),
    ("HETHS,218.26,@", "V", "A", ("headt",)),
    ("TIROT,-12.5,@", "V", "A", ("rot",)),
    ("VMVBW,4.1,0.2,@,4.2,0.1,A", "V", "A", ("longwaterspd", "transwaterspd")),
    ("PFEC,GPhve,0.125,@", "V", "A", ("heave",)),
    ("PTNTHPR,85.9,N,-0.9,@,0.8,N", "LP", "NMO", ("pitch",)),
    ("PASHR,000001.00,252.41,T,1.22,0.48,0.01,0.090,0.090,0.116,2,@", "0", "1", ("roll", "pitch", "heading", "heave")),
    ("PASHR,ATT,36000.00,90.00,0.58,0.10,0.0011,0.0037,@", "1", "0", ("roll", "pitch", "heading")),
    (
        "PHOCT,01,000001.000,T,00,080.378,T,-000.106,@,-03.105,T,+00.220,T,+00.08,-0.02,+0.01,+0.2,+0.02,+0.07,-8.03",
        "EI",
        "T",
        ("roll",),
    ),
)


@pytest.mark.parametrize("body, bad, good, columns", FLAGGED)
def test_what_a_device_calls_not_valid_is_no_value(read, body, bad, good, columns):
    """A part of the log; what stands beside it stays, and the part is counted."""
    flags = [*good * 3, *bad, *good]
    lines = [iso(MIDNIGHT + k * SECOND) + sentence(body.replace("@", flag)) for k, flag in enumerate(flags)]
    log = read(b"".join(lines))
    (source,) = log.sources.values()
    wanted = [flag in bad for flag in flags]
    for name in columns:
        assert np.isnan(source.columns[name]).tolist() == wanted, name
    others = [c for name, c in source.columns.items() if name not in columns and source.units.get(name) in ("", None)]
    assert all(np.isfinite(one).all() for one in others)
    assert any(f"{len(bad)} of {len(flags)} records are not valid by the device" in line for line in log.notices)


def test_the_quality_of_a_seapath_holds_for_its_motion_whatever_the_mapping(read):
    lines = logs.seapath(20).replace(b"\r\n", b"\n").split(b"\n")
    at = [k for k, line in enumerate(lines) if b"$PSXN,20," in line][10]
    lines[at] = lines[at].partition(b"$")[0] + sentence("PSXN,20,1,2,0,2").strip()
    motion = read(b"\r\n".join(lines)).sources["PSXN,23"].columns
    assert np.isnan(motion["heave"]).tolist() == np.isnan(motion["roll"]).tolist() == [k == 10 for k in range(20)]
    assert np.isfinite(motion["heading"]).all()


def test_a_flag_that_makers_disagree_about_says_nothing_where_it_never_changes(read):
    body = "PASHR,0000{:02d}.00,252.41,T,1.22,0.48,0.01,0.090,0.090,0.116,1,0"
    log = read(b"".join(sentence(body.format(k)) for k in range(40)))
    assert np.isfinite(log.sources["PASHR"].columns["roll"]).all()
    assert "imu = 0 in all 40 records" in log.sources["PASHR"].doubts[0]


def test_signs_that_are_letters(read):
    log = read(b"".join(sentence(f"PHTRO,{p},{a},{r},{b}") for p, a, r, b in (
        ("10.37", "P", "177.62", "T"), ("0.58", "M", "3.00", "B"), ("0.58", "X", "3.00", "B"), ("0.58", "", "3.00", "B")
    )))  # fmt: skip
    motion = log.sources["PHTRO"].columns
    assert motion["pitch"].tolist() == [-10.37, 0.58] and motion["roll"].tolist() == [177.62, -3.0]  # bow, port side up
    assert log.losses.counts == {"number without the letter of its sign": 2}


def test_letters_of_a_sentence_that_is_not_known_are_named(read):
    log = read(b"".join(sentence(f"PXYZ,{k},{'MP'[k % 2]},7,T") for k in range(6)))
    assert any("PXYZ field_02 has the letters M (3), P (3)" in line for line in log.notices)
    assert not any("field_04" in line for line in log.notices)


def test_a_time_without_its_point_is_read(read):
    log = read(b"".join(sentence(f"PASHR,100000{k}00,90.00,T,1,2,3,0,0,0,1,1") for k in range(5)))
    steps = log.sources["PASHR"].device - log.sources["PASHR"].device[0]
    assert steps.tolist() == [k * SECOND // 10 for k in range(5)]


def test_a_winch_that_speaks_behind_an_at_sign(tmp_path):
    """Small letters in the sum; numbers by their place, tension in tons."""
    body = b"RCWD,2,3,103.60,0.42,-30.00,0,102.90,0.295000"
    lines = []
    for k in range(40):
        text = body.replace(b"102.90", b"%.2f" % (102.9 + 0.5 * k))
        lines.append(iso(MIDNIGHT + k * SECOND) + b"@%s*%02x\r\n" % (text, exclusive_or(text)))
    lines[3] = lines[3].replace(b"30.00", b"31.00")
    (tmp_path / "log").write_bytes(b"".join(lines))
    found = {one.quantity: one for one in read_signals(tmp_path / "log").signals}
    assert found["payout"].value[0] == 102.9 and len(found["payout"].value) == 39
    np.testing.assert_allclose(found["tension"].value, 295.0 * 9.80665)


@pytest.mark.parametrize("stamped", [True, False])
def test_one_date_outvotes_no_hundreds(read, stamped):
    """A date that is wrong once, as of a receiver that starts: the others stand, and it is counted."""
    lines = [logs.zda(MIDNIGHT + k * SECOND) + logs.gga(MIDNIGHT + k * SECOND) for k in range(60)]
    lines[20] = lines[20].replace(logs.zda(MIDNIGHT + 20 * SECOND), sentence("INZDA,000020.00,06,01,1980,,"))
    if stamped:
        lines = [
            b"".join(iso(MIDNIGHT + k * SECOND) + one for one in line.splitlines(True)) for k, line in enumerate(lines)
        ]
    log = read(b"".join(lines))
    assert log.sources["INGGA"].device.tolist() == [MIDNIGHT + k * SECOND for k in range(60)]
    assert any("1 of 60 dates of IN contradict" in line for line in log.notices)


def test_a_lone_date_is_not_believed_against_the_stamps(read):
    lines = [iso(MIDNIGHT + k * SECOND) + logs.gga(MIDNIGHT + k * SECOND) for k in range(60)]
    lines.insert(30, iso(MIDNIGHT + 30 * SECOND) + sentence("INZDA,000030.00,06,01,1980,,"))
    log = read(b"".join(lines))
    assert log.sources["INGGA"].device.tolist() == [MIDNIGHT + k * SECOND for k in range(60)]


def test_units_and_checksums_are_those_of_most_records(read):
    bodies = ["YXXDR,A,1.5,D,PTCH,D,0.25,M,HEAVE"] * 40
    bodies[0] = bodies[0].replace("0.25,M", "0.25,F")
    log = read(b"".join(map(sentence, bodies)))
    source = log.sources["YXXDR"]
    assert source.units["HEAVE"] == "m" and np.isfinite(source.columns["HEAVE"]).sum() in (39, 40)
    bare = [sentence(body).partition(b"*")[0] + b"\r\n" for body in ["HEHDT,218.26,T"] * 40]
    log = read(b"".join(bare) + sentence("HEHDT,218.26,T"))
    assert len(log.sources["HEHDT"]) == 41


def test_a_seapath_without_its_companions_is_read_and_so_is_the_mapping_that_inspect_writes(read, tmp_path):
    """Neither GGA nor PSXN,20: as the telegrams of this product are."""
    lines = [iso(MIDNIGHT + k * SECOND) + psxn.encode(logs.motion(k % 7)) for k in range(60)]
    log = read(b"".join(lines))
    found = {one.quantity: one for one in read_signals(tmp_path / "log").signals}
    assert len(found["heave"].value) == 60 and found["heave"].time[0] == MIDNIGHT
    assert any("stamps of the logger" in line for line in found["heave"].assumed)
    (tmp_path / "m.yaml").write_text(first_mapping(log, []))
    again = {one.quantity: one for one in read_signals(tmp_path / "log", tmp_path / "m.yaml").signals}
    assert np.array_equal(again["heave"].value, found["heave"].value)
