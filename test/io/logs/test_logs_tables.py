"""Tables: CSV as loggers write it, Parquet, NetCDF; damaged ones; what is no number or no time is said."""

import sys

import numpy as np
import pytest
from hostile_logs import assert_sound, damaged, survive

from cable_sim_ros.tools.logs.containers import csv_log, netcdf, parquet
from cable_sim_ros.tools.logs.containers.bounded import read_all
from cable_sim_ros.tools.logs.containers.table_times import instant, month_first, number, of_day
from cable_sim_ros.tools.logs.formats import read_log
from cable_sim_ros.tools.logs.log import Log, LogError

SECOND = 1_000_000_000
MONTH = 30 * 86400 * SECOND
HERE = "cable_sim_ros.tools.logs.containers"
NOON = 1_406_894_400 * SECOND  # 2014-08-01 12:00 UTC


def table(folder, text, encoding="utf-8"):
    path = folder / "table.csv"
    path.write_bytes(text.encode(encoding))
    log = read_log(path)
    assert_sound(log)
    assert log.format == "csv"
    return log, log.sources["table"]


CLOCKS = {
    "iso with a zone": ("time,x\n2014-08-01T12:00:00.000000001Z,1\n2014-08-01T14:00:01+02:00,2\n", [1, SECOND], None),
    "iso without": ("timestamp;x\n2014-08-01 12:00:00;1\n2014-08-01 12:00:01,5;2\n", [0, 3 * SECOND // 2], None),
    "epoch": ("unix_time,x\n1406894400.123456789,1\n1406894401,2\n", [123_456_789, SECOND], None),
    "epoch in ms": ("time_ms\tx\n1406894400000\t1\n1406894401000\t2\n", [0, SECOND], None),
    "epoch in ns": ("stamp,x\n1406894400000000007,1\n1406894401000000000,2\n", [7, SECOND], None),
    "date and time": ("Date,Time,x\n8/1/2014,12:00:00 PM,1\n8/31/2014,12:00:01 PM,2\n", [0, MONTH + SECOND], None),
    "day first": ("Datum;Uhrzeit;x\n01.08.2014;12:00:00;1\n31.08.2014;12:00:00;2\n", [0, MONTH], None),
    "from a start": ("time_s,x\n0.5,1\n-1e-3,2\n", None, [SECOND // 2, -1_000_000]),
    "in minutes": ("elapsed [min],x\n0,1\n1.5,2\n", None, [0, 90 * SECOND]),
    "over midnight": ("time,x\n23:59:59.5,1\n00:00:00.5,2\n", None, [86_399_500_000_000, 86_400_500_000_000]),
    "both": ("time_s,utc,x\n0,2014-08-01T12:00:00Z,1\n1,2014-08-01T12:00:01Z,2\n", [0, SECOND], [0, SECOND]),
}  # fmt: skip


@pytest.mark.parametrize("name", CLOCKS)
def test_the_clock_of_a_table(name, tmp_path):
    text, since_noon, device = CLOCKS[name]
    _, source = table(tmp_path, text)
    assert (None if source.logged is None else (source.logged - NOON).tolist()) == since_noon
    assert (None if source.device is None else source.device.tolist()) == device
    assert source.columns["x"].tolist() == [1.0, 2.0]


def test_delimiters_decimal_commas_comments_units_and_lines_above(tmp_path):
    log, source = table(
        tmp_path,
        "Logger 7\n\n# calibrated\nZeit;Heave [m];Seilzug (kN);tension_lb;Name\n"
        "01.08.2014 12:00:00;1,25;-3,5e1;7;a\n# a comment\n01.08.2014 12:00:01;;4;8;b\n",
    )
    assert source.columns["Heave"].tolist()[0] == 1.25 and np.isnan(source.columns["Heave"][1])
    assert source.columns["Seilzug"].tolist() == [-35.0, 4.0]
    assert source.units == {"Heave": "m", "Seilzug": "kN", "tension_lb": "lb"}
    assert "columns without numbers are left out: Name" in log.notices
    assert any("taken as day, month, year" in note for note in log.notices)
    assert any("taken as UTC" in note for note in log.notices)


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("time,heading [°]\n0,1\n1,2\n", "utf-8-sig"),
        ("time,heading [°]\r\n0,1\r\n1,2\r\n", "cp1252"),
        ("time\theading [°]\n0\t1\n1\t2\n", "utf-16"),
        ("# made by a logger\n# time,heading [°]\n0,1\n1,2\n", "utf-8"),
        ('"time","heading [°]"\n"0","1"\n1,2\n', "utf-8"),
        ("time,heading\ns,°\n0,1\n1,2\n", "utf-8"),
        ("time,heading [°],\n0,1,\n1,2,\n", "utf-8"),
    ],
)
def test_forms_of_the_same_table(text, encoding, tmp_path):
    _, source = table(tmp_path, text, encoding)
    assert source.device.tolist() == [0, SECOND] and source.columns["heading"].tolist() == [1.0, 2.0]
    assert source.units == {"heading": "°"}


def test_our_own_table_of_motion_reads(tmp_path):
    _, source = table(tmp_path, "# of a tank\ntime_s,heave_m,heave_mps,pitch_deg\n0,0.1,0,1\n0.5,0.2,1,2\n")
    assert list(source.columns) == ["heave_m", "heave_mps", "pitch_deg"]
    assert source.units == {"heave_m": "m", "heave_mps": "mps", "pitch_deg": "deg"}


def test_rows_that_are_lost_are_counted_with_the_line_of_the_first(tmp_path):
    rows = [f"{k},{k}" for k in range(50)]
    rows[10], rows[20], rows[30] = "10", "soon,20", "30,broken"
    log, source = table(tmp_path, "time,x\n" + "\n".join(rows) + "\n")
    assert log.records == len(source) == 48
    assert log.losses.first == {"row with another number of cells": "line 12", "row without a time": "line 22"}
    assert log.notices == ["x: 1 cells are no numbers and count as missing, first at line 32: broken"]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a,b\n1,2\n3,4\n", "has no column of time among a, b"),
        ("just text\nand more, of it\n", "is of no format"),
        ("time,x\n", "is of no format"),
        ("", "is empty"),
    ],
)
def test_what_is_no_table_with_a_time_is_refused(read, text, why):
    with pytest.raises(LogError, match=why):
        read(text.encode(), "a.txt")


def test_sentences_are_no_table(tmp_path):
    assert not csv_log.recognise(b"$HEHDT,1.5,T*2B\n$HEHDT,1.6,T*28\n", tmp_path / "a.txt")


def test_a_damaged_table_gives_its_rows(tmp_path):
    rows = "".join(f"{0.1 * k:.1f},{np.sin(k):.4f},{k}\n" for k in range(60))
    cuts, flips = survive(csv_log.read, f"time,heave [m],n\n{rows}".encode(), tmp_path / "a.csv")
    assert sum(log is not None and log.records > 0 for log in cuts) > 50
    assert sum(log is not None and log.records >= 58 for log in flips) > 180


@pytest.mark.parametrize(
    "cell", ["1e999999999", "9" * 400, "1" * 5000, "nan", "inf", "1_0", "２", "9999-99-99", "2014-08-01T99:00:00Z"]
)
def test_numbers_that_no_clock_shows_cost_their_row(cell, tmp_path):
    rows = "".join(f"{k},1\n" for k in range(20))
    log, source = table(tmp_path, f"time,x\n{rows}{cell},1\n")
    assert len(source) == 20 and log.losses.counts == {"row without a time": 1}


def test_texts_of_times():
    assert instant("2014-08-01") == NOON - 12 * 3600 * SECOND
    assert instant("2014/8/1 12:00") == instant("8/1/2014 12:00 pm", True) == instant("01.08.2014 12:00:00") == NOON
    assert instant("2014-08-01T12:00:00.1234567891+05:30") == NOON + 123_456_789 - 19_800 * SECOND
    assert instant("2014-08-02T02:00+14:00") == NOON and instant("2014-08-01T12:00+25:00") is None
    assert instant("2014-02-30") is None and instant("1066-10-14") is None and instant("12:00") is None
    assert of_day("12:30 AM") == 1800 * SECOND and of_day("24:00:00") is None
    assert number("1.5", SECOND) == 1_500_000_000 and number("1e99", SECOND) is None
    assert month_first(["13/01/2014"]) is False and month_first(["01/13/2014"]) is True
    assert month_first(["01/02/2014"]) is None


# ---- tables of libraries in C


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    pa, xr = pytest.importorskip("pyarrow"), pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    import pyarrow.parquet as pq

    folder = tmp_path_factory.mktemp("tables")
    n = np.arange(100)
    stamps = pa.array(NOON + n * SECOND // 10, pa.timestamp("ns", "UTC"))
    columns = {"time": stamps, "tension_lb": n + 0.5, "ok": n > 5, "who": ["a"] * 100, "in": [{"x": 1.5}] * 100}
    pq.write_table(pa.table(columns), folder / "a.parquet", row_group_size=30)
    pq.write_table(pa.table({"t_s": n * 0.1, "heave [m]": n * 1.0}), folder / "b.parquet")
    pq.write_table(pa.table({"x": n}), folder / "none.parquet")
    time = ("time", n * 0.1, {"units": "seconds since 2014-08-01 12:00:00"})
    heave = ("time", (10 * n).astype(np.int16), {"units": "m", "scale_factor": 0.1})
    wide = {"acc": (("time", "axis"), np.ones((100, 3))), "px": (("time", "pixel"), np.zeros((100, 65)))}
    data = xr.Dataset({"heave": heave, **wide, "depth": ("z", np.arange(4.0))}, coords={"time": time})
    data.to_netcdf(folder / "a.nc", engine="h5netcdf")
    small = xr.Dataset({"heave": ("time", n * 1.0)}, coords={"time": ("time", n * 0.1, {"units": "s"})})
    small.to_netcdf(folder / "b.nc", engine="scipy", format="NETCDF3_CLASSIC")
    small.to_netcdf(folder / "small.nc", engine="h5netcdf")
    return folder


def test_parquet_tables(made):
    first, second, none = read_all(
        f"{HERE}.parquet", [made / name for name in ("a.parquet", "b.parquet", "none.parquet")]
    )
    assert isinstance(none, LogError) and f"{made / 'none.parquet'}: has no column of time among x" in str(none)
    source = first.sources["table"]
    assert first.records == 100 and source.logged.tolist() == [NOON + k * SECOND // 10 for k in range(100)]
    assert (
        source.columns["tension_lb"][3] == 3.5 and source.columns["in.x"][0] == 1.5 and source.columns["ok"].sum() == 94
    )
    assert source.units == {"tension_lb": "lb"} and first.notices == ["columns without numbers are left out: who"]
    source = second.sources["table"]
    assert source.device.tolist() == [round(1e8 * k) for k in range(100)] and source.units == {"heave": "m"}
    assert parquet.recognise((made / "b.parquet").read_bytes(), made)


SHORT = """
import os
import resource

from cable_sim_ros.tools.logs.containers import parquet
from cable_sim_ros.tools.logs.containers.bounded import MEMORY


def prepare():  # as a session under `ulimit -v`
    parquet.prepare()
    with open("/proc/self/statm") as file:
        limit = int(file.read().split()[0]) * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def read_here(path):
    log = parquet.read_here(path)
    if path.name == "b.parquet":
        bytearray(2 * MEMORY)
    log.notices.append(str(resource.getrlimit(resource.RLIMIT_AS)[1] != resource.RLIM_INFINITY))
    return log
"""


def test_a_limit_of_memory_of_the_session_is_kept_and_named_where_it_is_too_little(made, tmp_path, monkeypatch):
    (tmp_path / "short_session.py").write_text(SHORT)
    monkeypatch.syspath_prepend(tmp_path)
    room, short = read_all("short_session", [made / "a.parquet", made / "b.parquet"])
    assert room.records == 100 and room.notices[-1] == "True", "read, and the limit not raised"
    assert isinstance(short, LogError) and "where a limit of this session (ulimit -v) leaves " in str(short)


def test_netcdf_files(made):
    new, old = read_all(f"{HERE}.netcdf", [made / "a.nc", made / "b.nc"])
    source = new.sources["time"]
    assert source.logged.tolist() == [NOON + k * SECOND // 10 for k in range(100)]
    assert source.columns["heave"][7] == pytest.approx(7.0) and source.units["heave"] == "m"
    assert list(source.columns) == ["heave", "acc[0]", "acc[1]", "acc[2]"]
    assert "px" in new.notices[0] and "depth" in new.notices[1]
    assert old.sources["time"].device.tolist() == [round(1e8 * k) for k in range(100)]
    assert all(netcdf.recognise((made / name).read_bytes(), made) for name in ("a.nc", "b.nc"))


@pytest.mark.parametrize(("cuts", "flips"), [(16, 50), pytest.param(64, 200, marks=pytest.mark.nightly)])
@pytest.mark.parametrize(("names", "module"), [(["b.parquet"], "parquet"), (["small.nc", "b.nc"], "netcdf")])
def test_damaged_files_of_libraries_in_c(names, module, cuts, flips, made, tmp_path):
    """Each in a process with bounds."""
    paths = []
    for name in names:
        for k, (_, copy) in enumerate(damaged((made / name).read_bytes(), cuts, flips)):
            paths.append(tmp_path / f"{k}_{name}")
            paths[-1].write_bytes(copy)
    results = read_all(f"{HERE}.{module}", paths)
    for path, result in zip(paths, results):
        if isinstance(result, Log):
            assert_sound(result)
            assert result.records <= 100 or module == "netcdf"
        else:
            assert str(path) in str(result) and "\n" not in str(result) and len(str(result)) < 1000
    for first in range(0, len(paths), cuts + flips):
        of_one = results[first : first + cuts + flips]
        assert sum(isinstance(result, Log) for result in of_one[cuts:]) > 0.3 * flips
        assert not any(isinstance(result, Log) and result.records for result in of_one[: 1 + 4 * cuts // 64])


def test_a_reader_that_takes_too_much_or_crashes_is_ended(tmp_path, monkeypatch):
    (tmp_path / "greedy.py").write_text(
        "import ctypes\n"
        "def prepare(): pass\n"
        "def read_here(path):\n"
        "    if 'much' in path.name: return bytearray(4_000_000_000)\n"
        "    if 'crash' in path.name: ctypes.string_at(0)\n"
        "    raise ValueError('text of it')\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    paths = [tmp_path / name for name in ("much", "crash", "other")]
    for path in paths:
        path.write_bytes(b"x")
    there = tmp_path / "data"  # whose files are no modules of the reader
    there.mkdir()
    (there / "json.py").write_text("raise SystemExit('of the data')\n")
    monkeypatch.chdir(there)
    monkeypatch.setattr("sys.path", [*sys.path, there])  # import passes over what is no text
    much, crash, other = read_all("greedy", paths)
    assert "takes more than" in str(much)
    assert "ends its reader with signal 11" in str(crash)
    assert "ValueError: text of it" in str(other)
    assert all(str(path) in str(error) for path, error in zip(paths, (much, crash, other)))


def test_a_library_that_is_missing_is_named_with_the_command(made, tmp_path, monkeypatch):
    (tmp_path / "pyarrow.py").write_text("raise ImportError\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(LogError, match=r"read with pyarrow, which is not installed.*cable_sim_ros\[import\]"):
        read_log(made / "b.parquet")


def test_comments_over_the_names_are_no_names(tmp_path):
    """Prose with as many commas as the table has, and a comment longer than what is looked at for names."""
    rows = "".join(f"{0.1 * k:.1f},{k % 7},{k % 5}\n" for k in range(50))
    prose = "# of the winch, stamped, in N\n" + "# more\n" * 1000
    for head in (prose + "t_s,tension_n,payout_m\n", "# t_s,tension_n,payout_m\n"):
        _, source = table(tmp_path, head + rows)
        assert len(source) == 50 and {"tension_n", "payout_m"} <= set(source.columns)
