"""A recorded run in four formats: every value reads back to the bit, with unit, meaning and provenance."""

import errno
import json
import re
import runpy
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from calling import cable_sim

from cable_sim_ros import run
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS, FIELDS, SHAPE_COLUMNS, TICK_OUTPUT, Flag
from cable_sim_ros.tools.export import content, formats
from cable_sim_ros.tools.export import formats as export
from cable_sim_ros.tools.export.content import ExportError, Table
from cable_sim_ros.version import __version__

call = partial(cable_sim, "export")
UNIT = {name: unit for name, _, _, unit, _ in FIELDS}
AXES = {(): [""], (3,): [".x", ".y", ".z"], (4,): [".x", ".y", ".z", ".w"]}
EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples" / "plot"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "a"
    run("side_scan", heave=(0.5, 8.0), duration=2.0, step="chosen", out=out)
    return out


@pytest.fixture(scope="module")
def recorded(folder):
    return load_run(folder / "tow")


def columns(recorded):
    """Column name -> values, as the recording has them."""
    for name, shape, *_ in FIELDS:
        values = recorded.frames[name].reshape(len(recorded.frames), -1)
        yield from ((name + axis, values[:, k]) for k, axis in enumerate(AXES[shape]))


def same(ours, theirs):
    """The same bits in the same type."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    assert ours.dtype == theirs.dtype and ours.shape == theirs.shape
    assert np.ascontiguousarray(ours).tobytes() == np.ascontiguousarray(theirs).tobytes()


@pytest.mark.filterwarnings("ignore:The .float_precision. argument")  # pandas 3.1: it is the default
def test_csv_reads_back_to_the_bit_in_pandas(folder, recorded, tmp_path):
    pandas = pytest.importorskip("pandas")
    export.export(folder, tmp_path / "a.csv", tables=["shape", "contact"])
    table = pandas.read_csv(tmp_path / "a.csv", comment="#", float_precision="round_trip")
    for name, values in columns(recorded):
        same(table[f"{name} [{UNIT[name.partition('.')[0]]}]"].to_numpy(), values)
    assert table["elapsed [s]"].iloc[-1] == pytest.approx(1.9)
    rows = pandas.read_csv(tmp_path / "a.contact.csv", comment="#", float_precision="round_trip")
    for k, (name, unit) in enumerate(CONTACT_COLUMNS):
        same(rows[f"{name} [{unit}]"].to_numpy(), np.concatenate([part[:, k] for _, part in recorded.contacts]))
    notes = [line for line in (tmp_path / "a.csv").read_text("utf-8").splitlines() if line.startswith("#")]
    assert "# verdict: ok" in notes and "# scene_yaml: name: side_scan" in notes
    assert "# column tension [N]: effective tension where the cable leaves the sheave outboard" in notes


def test_parquet_reads_back_to_the_bit_with_units(folder, recorded, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    export.export(folder, tmp_path / "a.parquet", tables=["shape"])
    table = parquet.read_table(tmp_path / "a.parquet")
    for name, values in columns(recorded):
        same(table[name].to_numpy(), values)
        assert table.schema.field(name).metadata[b"unit"].decode() == UNIT[name.partition(".")[0]]
    assert table.schema.metadata[b"scene_yaml"].startswith(b"name: side_scan")
    rows = parquet.read_table(tmp_path / "a.shape.parquet")
    for k, (name, _) in enumerate(SHAPE_COLUMNS):
        same(rows[name].to_numpy(), np.concatenate([part[:, k] for _, part in recorded.shapes]))
    same(np.unique(rows["time"].to_numpy()), np.array([time for time, _ in recorded.shapes]))


def test_netcdf_reads_back_to_the_bit_after_cf(folder, recorded, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    export.export(folder, tmp_path / "a.nc", tables=["contact"])
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf", decode_times=False) as raw:
        for name, *_ in FIELDS:
            same(raw[name].values, recorded.frames[name])
        assert raw["time"].attrs["units"] == "nanoseconds since 1970-01-01T00:00:00Z"
        assert raw.attrs["Conventions"] == "CF-1.11" and raw.attrs["verdict"] == "ok"
        assert raw["ship_velocity"].attrs["units"] == "m s-1" and raw["ship_velocity"].dims == ("time", "xyz")
        assert raw["mru_roll"].attrs["standard_name"] == "platform_roll_starboard_down"
        assert len(raw["status"].attrs["flag_meanings"].split()) == len(raw["status"].attrs["flag_masks"]) == len(Flag)
        for k, (time, part) in enumerate(recorded.contacts):
            assert raw["contact_time"].values[k] == time and raw["contact_points"].values[k] == len(part)
            for i, (name, _) in enumerate(CONTACT_COLUMNS):
                same(raw[f"contact_{name}"].values[k, : len(part)], part[:, i])
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as decoded:
        same(decoded["time"].values.astype("datetime64[ns]").astype(np.int64), recorded.frames["time"])
        assert list(decoded["xyz"].values) == ["x", "y", "z"]


def test_every_unit_is_one_of_udunits():
    units = {formats.UDUNITS.get(unit, unit) for unit in UNIT.values()}
    base = {"1", "m", "s", "ns", "rad", "N", "W", "J", "Hz", "kg"}
    assert {part for unit in units for part in re.sub(r"-\d", "", unit).split()} <= base
    assert set(formats.STANDARD_NAME) <= set(UNIT)


def test_matlab_reads_back_to_the_bit(folder, recorded, tmp_path):
    from scipy.io import loadmat

    export.export(folder, tmp_path / "a.mat", tables=["shape"])
    had = loadmat(tmp_path / "a.mat", squeeze_me=True, struct_as_record=False)
    for name, *_ in FIELDS:
        same(getattr(had["ticks"], name), recorded.frames[name])
        assert getattr(had["units"], name) == UNIT[name]
    assert had["provenance"].scene_yaml.startswith("name: side_scan")
    for k, (name, _) in enumerate(SHAPE_COLUMNS):
        same(getattr(had["shape"], name), np.stack([part[:, k] for _, part in recorded.shapes]))
    assert max(map(len, TICK_OUTPUT.names)) <= 31 and all(name.isidentifier() for name in TICK_OUTPUT.names)


def test_ragged_tables_are_padded_behind_their_rows():
    rows = np.arange(5.0)[:, None]
    table = Table("contact", (("x", "m"),), np.array([10, 20, 30]), np.array([0, 2, 2, 5]), rows)
    padded = table.padded()[:, :, 0]
    np.testing.assert_array_equal(padded, [[0, 1, np.nan], [np.nan] * 3, [2, 3, 4]])
    times, points = table.long()
    assert times.tolist() == [10, 10, 30, 30, 30] and points.tolist() == [0, 1, 0, 1, 2]


def test_fields_are_chosen_and_ticks_are_thinned(folder, recorded):
    had = content.gather(folder, ["tension", "body_position"], 0.5, ["shape"])
    assert [field.name for field in had.fields] == ["time", "elapsed", "tension", "body_position"]
    same(had.fields[0].values, recorded.frames["time"][::5])
    same(had.fields[2].values, recorded.frames["tension"][::5])
    same(had.tables[0].times, recorded.frames["time"][::5])
    assert had.provenance["thinned"] == "one tick output each 0.5 s was kept, without a filter"


def test_provenance_says_what_the_run_was(folder, recorded, tmp_path):
    said = content.gather(folder).provenance
    assert said["exported_by"] == f"cable_sim_ros {__version__}" and said["motion"] == "heave 0.5 m, 8 s"
    assert (said["verdict"], said["verdict_text"]) == ("ok", "of the run's summary")
    (tmp_path / "tow").symlink_to(folder / "tow")  # without the summary beside it
    assert content.gather(tmp_path / "tow").provenance["verdict_text"] == "of the tick outputs alone"
    (tmp_path / "summary.json").write_text(json.dumps({"ticks": 7, "verdict": {"state": "failed"}}))
    assert content.gather(tmp_path / "tow").provenance["verdict"] == "ok"  # a summary of another run


def test_the_command_writes_and_says_so(folder, tmp_path):
    done = call(folder, "--out", tmp_path / "a.csv", "--fields", "tension,payout", "--tables", "shape", "--json")
    said = json.loads(done.stdout)
    assert (said["ticks"], said["columns"], said["verdict"]) == (20, 4, "ok") and len(said["files"]) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.shape.csv"]
    assert (tmp_path / "a.csv").stat().st_mode & 0o444
    again = call(folder, "--out", tmp_path / "b.csv", "--tables", "shape")
    assert again.exit_code == 0 and "20 tick outputs of 172 columns; verdict of the run: ok" in again.stdout


@pytest.mark.parametrize(
    "words, text",
    [
        (("--out", "a.xlsx"), "a.xlsx: its ending says no format; nothing was written. Give a file that ends in .csv"),
        (("--out", "a.csv", "--fields", "tensoin"), "--fields tensoin: there is no such field of a tick; nothing was"),
        (("--out", "a.csv", "--tables", "waves"), "--tables waves: there is no such table; nothing was written."),
        (("--out", "a.csv", "--tables", "strum"), "has none (viv was off); nothing was written. Leave it out"),
        (("--out", "a.csv", "--every", "0.25"), "--every 0.25 s is no whole multiple of the 0.1 s between"),
        (("--out", "a.csv", "--every", "0.01"), "Give for example 0.1"),
        (("--out", "no/such/a.csv"), "a.csv: cannot be written (No such file or directory); what was there before"),
        (("--out", "."), "its ending says no format"),
        (("--out", "there.csv"), "there.csv: is there already; nothing was written. Give another name, or --force"),
        (("--out", "folder.csv"), "folder.csv: is a folder; nothing was written."),
    ],
)
def test_a_mistake_is_told_in_one_line(folder, tmp_path, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.csv").write_text("mine")
    (tmp_path / "folder.csv").mkdir()
    had = sorted(tmp_path.rglob("*"))
    done = call(folder, *words)
    assert done.exit_code == 2 and text in done.stderr and done.stderr.count("\n") == 1 and not done.stdout
    assert sorted(tmp_path.rglob("*")) == had and (tmp_path / "there.csv").read_text() == "mine"


def test_what_is_there_is_replaced_when_asked_and_whole(folder, tmp_path, monkeypatch):
    target = tmp_path / "a.csv"
    target.write_text("mine")

    def full(content, path):
        path.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setitem(formats.WRITERS, "csv", full)
    done = call(folder, "--out", target, "--force")
    assert done.exit_code == 2 and "cannot be written (No space left on device)" in done.stderr
    assert target.read_text() == "mine" and list(tmp_path.iterdir()) == [target]
    monkeypatch.undo()
    assert call(folder, "--out", target, "--force").exit_code == 0
    assert target.read_text().startswith("# scene: side_scan")


@pytest.mark.parametrize("form, module", [("nc", "h5netcdf"), ("nc", "xarray"), ("parquet", "pyarrow")])
def test_a_missing_extra_is_one_line(folder, tmp_path, monkeypatch, form, module):
    monkeypatch.setitem(sys.modules, module, None)
    done = call(folder, "--out", tmp_path / f"a.{form}")
    assert done.exit_code == 2 and "pip install 'cable_sim_ros[export]'" in done.stderr
    if form == "parquet" or module == "xarray" or "xarray" in sys.modules:
        assert f"--format {form} needs {module}, which cannot be imported" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_mat_file_has_its_limit(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(formats, "MATLAB_BYTES", 1000)
    with pytest.raises(ExportError, match="the struct ticks takes .* and a MAT file holds at most"):
        export.export(folder, tmp_path / "a.mat")
    assert not list(tmp_path.iterdir())


def test_a_bag_without_a_run_is_refused(tmp_path):
    done = call("nbp1406", "--out", tmp_path / "a.csv")
    assert done.exit_code == 2 and "has no topic" in done.stderr and not list(tmp_path.iterdir())


PLOTS = {"csv": "from_csv", "nc": "from_netcdf", "parquet": "from_parquet", "mat": "from_matlab"}


@pytest.mark.parametrize("form, script", PLOTS.items())
def test_the_examples_plot_from_each(folder, recorded, tmp_path, monkeypatch, capsys, form, script):
    for module in ("matplotlib", "pandas", "xarray", "h5netcdf", "pyarrow"):
        pytest.importorskip(module)
    export.export(folder, tmp_path / f"tow.{form}", tables=["shape"])
    path = EXAMPLES / f"{script}.py"
    monkeypatch.setattr(sys, "argv", [str(path), str(tmp_path / f"tow.{form}"), str(tmp_path / "tow.png")])
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out == f"20 ticks, tension {recorded.frames.tension.mean():.2f} N\n"
    assert (tmp_path / "tow.png").read_bytes().startswith(b"\x89PNG")
    assert 15 <= len(path.read_text("utf-8").splitlines()) <= 25


def test_every_example_is_run():
    assert sorted(PLOTS.values()) == sorted(path.stem for path in EXAMPLES.glob("*.py"))
