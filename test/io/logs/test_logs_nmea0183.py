"""NMEA 0183 logs: values as the sentences have them, clocks, checksums, sentences cut in two."""

import math
import sys

import instrument_logs as logs
import numpy as np
import pytest
from instrument_logs import DAY, MIDNIGHT, SECOND, iso, sentence

from cable_sim_ros.io.logs.devices import nmea0183, sentences
from cable_sim_ros.io.logs.formats import read_log
from cable_sim_ros.io.logs.log import LogError


@pytest.fixture
def read(tmp_path):
    def of(data):
        path = tmp_path / "log"
        path.write_bytes(data)
        return nmea0183.read(path)

    return of


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
        "PFEC,GPhve": {"heave": 0.125},
        "PFEC,GPatt": {"heading": 218.2, "pitch": -0.5, "roll": 0.25},
        "PTNTHPR": {"heading": 85.9, "pitch": -0.9, "roll": 0.8},
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


def test_an_empty_file_and_one_of_something_else(tmp_path):
    path = tmp_path / "log"
    path.write_bytes(b"")
    with pytest.raises(LogError, match="is empty; nothing was read"):
        read_log(path)
    with pytest.raises(LogError, match="holds no telegram that could be read .nothing was lost.; nothing was read"):
        nmea0183.read(path)
    path.write_bytes(b"Dear captain, 12 bottles at $3,50\n")
    with pytest.raises(LogError, match="is of no format that is read here; nothing was read"):
        read_log(path)
    with pytest.raises(LogError, match="cannot be read .No such file.*Give a file that is there"):
        nmea0183.read(tmp_path / "none")


def test_a_parser_that_is_not_installed(tmp_path, monkeypatch):
    path = tmp_path / "log"
    path.write_bytes(logs.seapath(1))
    monkeypatch.setitem(sys.modules, "pynmeagps", None)
    with pytest.raises(LogError, match=r"pynmeagps, which is not installed.*pip install 'cable_sim_ros\[import\]'"):
        read_log(path)
    path.write_bytes(logs.winch(3))
    assert read_log(path).records == 3  # needs none


def test_a_leap_second_and_a_blank_position(read):
    blank = "INGGA,235960.50,,,,,0,00,,,M,,M,,"
    log = read(logs.zda(MIDNIGHT + DAY - SECOND) + sentence(blank))
    assert log.sources["INGGA"].device[0] == MIDNIGHT + DAY + SECOND // 2
    assert "lat" not in log.sources["INGGA"].columns and not math.isnan(log.sources["INGGA"].columns["quality"][0])
