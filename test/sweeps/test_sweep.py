"""Sweeps: what a file asks for, the same rows from any number of workers, going on, dead workers, errors."""

import json
import signal
import subprocess
import sys
import time
import warnings
from concurrent.futures import BrokenExecutor, Executor, Future
from math import isnan, log
from pathlib import Path

import pytest
from killer import KILLS, Named, killer

from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import dump_scene, load_scene, override
from cable_sim_ros.tools.sweeps import engine, worker
from cable_sim_ros.tools.sweeps.cases import cases_of
from cable_sim_ros.tools.sweeps.dataset import names_of
from cable_sim_ros.tools.sweeps.engine import FAULT, processes, rows_of, workers_of
from cable_sim_ros.tools.sweeps.figures import FIGURES, numbers_of, unwatched
from cable_sim_ros.tools.sweeps.sensitivity import points
from cable_sim_ros.tools.sweeps.store import Store
from cable_sim_ros.tools.sweeps.sweep import sweep
from cable_sim_ros.tools.sweeps.sweep_file import SweepError, checked, count_of, load_sweep
from cable_sim_ros.tools.sweeps.worker import simulate

SHORT = {"sweep": "short", "scene": "flume", "duration": 0.5, "grid": {"winch.scope": [0.9, 1.0, 99999.0]}}
COSTS = ("cpu_s",)
BAG = str(find_bag("nbp1406"))


def plain(rows):
    return [json.dumps({key: value for key, value in row.items() if key not in COSTS}, sort_keys=True) for row in rows]


class Here(Executor):
    """Runs what is submitted at once; `after` cases it dies, as a pool whose worker was killed; refuses: and takes no
    more, as one that has noticed."""

    def __init__(self, after=None, refuses=False):
        self.left, self.refuses = after, refuses

    def submit(self, function, /, *args):
        future = Future()
        if self.left == 0:
            if self.refuses:
                raise BrokenExecutor("a worker was killed")
            future.set_exception(BrokenExecutor("killed"))
            return future
        self.left = None if self.left is None else self.left - 1
        try:
            future.set_result(function(*args))
        except Exception as error:
            future.set_exception(error)
        return future


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    return sweep(checked(SHORT, "here"), tmp_path_factory.mktemp("short"), make=Here, workers=2)


def test_a_run_that_fails_is_a_row_with_its_reason(swept):
    assert [row["verdict"] for row in swept.rows][2] == "failed"
    assert "winch.scope = 99999.0 m is outside" in swept.rows[2]["error"]
    assert swept.rows[0]["tension_mean_n"] != swept.rows[1]["tension_mean_n"]
    assert not swept.faults


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_own_processes_give_the_same_rows(swept, tmp_path, workers):
    again = sweep(swept.plan, tmp_path, workers=workers)
    assert plain(again.rows) == plain(swept.rows) and again.computed == 3


def test_a_stopped_sweep_goes_on_and_an_extended_one_computes_what_is_new(tmp_path):
    def interrupted(done, total):
        if done == 2:
            raise KeyboardInterrupt

    plan = checked(SHORT, "here")
    with pytest.raises(KeyboardInterrupt):
        sweep(plan, tmp_path, make=Here, progress=interrupted)
    assert len(Store(tmp_path).rows) == 2
    more = checked({**SHORT, "grid": {"winch.scope": [0.9, 1.0, 99999.0, 0.95]}}, "here")
    swept = sweep(more, tmp_path, make=Here)
    assert swept.computed == 2 and len(swept.rows) == 4
    assert sweep(more, tmp_path, make=Here).computed == 0


def cut(data):
    return data[:-20]


def flipped(data):
    """One bit of the first value of a row."""
    at = data.index(b"verdict")
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


@pytest.mark.parametrize("harm", [cut, flipped])
def test_a_part_that_was_harmed_is_set_aside_and_computed_again(swept, tmp_path, harm):
    store = Store(tmp_path)
    for row in swept.rows:
        store.add(row)
    store.flush()
    (part,) = (tmp_path / "rows").glob("part-*.parquet")
    part.write_bytes(harm(part.read_bytes()))
    looked = Store(tmp_path, look=True)
    assert looked.damaged == [part.name] and not looked.rows and part.exists(), "a look changes nothing"
    again = sweep(swept.plan, tmp_path, make=Here)
    assert again.damaged == [part.name] and again.computed == 3
    assert plain(again.rows) == plain(swept.rows)


def test_no_flipped_bit_gives_another_row(tmp_path):
    store, rows = Store(tmp_path), [{"key": f"{k:032x}", "tension_max_n": 1.5 * k} for k in range(20)]
    for row in rows:
        store.add(row)
    store.flush()
    (part,) = (tmp_path / "rows").glob("part-*.parquet")
    whole, found = part.read_bytes(), []
    for at in range(0, len(whole), 7):
        part.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << at % 8]) + whole[at + 1 :])
        read = Store(tmp_path, look=True)
        found.append(bool(read.damaged))
        assert list(read.rows.values()) == ([] if read.damaged else rows), at
    assert sum(found) > 0.3 * len(found)


def test_two_sweeps_in_one_folder_keep_the_rows_of_both(tmp_path):
    one, other = Store(tmp_path), Store(tmp_path)
    for store, key in ((one, "a"), (other, "b")):
        store.add({"key": key})
    one.flush()
    other.flush()
    assert set(Store(tmp_path, look=True).rows) == {"a", "b"}


@pytest.mark.parametrize("refuses", [False, True])
def test_what_is_lost_with_a_worker_is_run_again_and_nothing_twice(refuses):
    made = iter([Here(after=2, refuses=refuses), Here(), Here()])
    cases = list(cases_of(checked({**SHORT, "grid": {"winch.scope": [0.8, 0.9, 0.95, 1.0]}}, "here")))
    rows = list(rows_of(cases, lambda: next(made), 2))
    assert sorted(case.number for case, _ in rows) == [0, 1, 2, 3]
    assert all(row["verdict"] != "failed" for _, row in rows)


def test_a_case_that_kills_its_worker_is_a_row_and_the_others_are_whole(monkeypatch):
    monkeypatch.setattr(engine, "simulate", killer)
    cases = [Named(str(k)) for k in (0, KILLS, 2, 3)]
    rows = {case.key: row for case, row in rows_of(cases, lambda: processes(2), 2)}
    assert len(rows) == 4
    assert "worker that ran it ended" in rows[str(KILLS)]["error"] and rows[str(KILLS)]["again"]
    assert [rows[key]["verdict"] for key in "023"] == ["ok"] * 3


def test_a_fault_of_the_program_is_a_row_that_says_so(monkeypatch):
    def broken(case):
        raise RuntimeError("a mistake of ours")

    monkeypatch.setattr(engine, "simulate", broken)
    ((_, row),) = rows_of(list(cases_of(checked(SHORT, "here")))[:1], Here, 1)
    assert row["error"] == f"{FAULT}RuntimeError: a mistake of ours"


def test_cases_are_the_product_in_a_fixed_order_with_samples_that_repeat():
    plan = checked(
        {
            "sweep": "all",
            "scene": "flume",
            "grid": {"winch.scope": {"first": 0.8, "last": 1.0, "count": 3}},
            "samples": {
                "method": "latin_hypercube",
                "count": 4,
                "ranges": {"cable.axial_stiffness": {"low": 100.0, "high": 400.0, "spread": "log"}},
            },
            "motions": [{}, {"heave": [0.01, 2.0]}],
            "plans": [None, "0 rate -0.01"],
        },
        "here",
    )
    cases, again = list(cases_of(plan)), list(cases_of(plan))
    assert len(cases) == count_of(plan) == 3 * 4 * 2 * 2
    assert [case.key for case in cases] == [case.key for case in again]
    assert len({case.key for case in cases}) == len(cases)
    drawn = [case.varied["cable.axial_stiffness"] for case in cases[:4]]
    assert sorted(int(4.0 * log(value / 100.0) / log(4.0)) for value in drawn) == [0, 1, 2, 3]  # one in each quarter
    assert cases[0].varied["motion"] == "none" and cases[-1].varied["motion"] == "heave 0.01 m, 2 s"


@pytest.mark.parametrize(
    "change, text",
    [
        ({"grid": {"winch.scop": [1.0]}}, "there is no such key"),
        ({"grid": {"winch.scope": []}}, "has 0 values"),
        ({"grid": {"winch.scope": [1.0, 1.0]}}, "has a value twice"),
        ({"settings": {"winch.scope": 1.0}}, "stands twice"),
        ({"samples": {"count": 2, "ranges": {}}}, "is empty: all samples would be the same"),
        ({"samples": {"count": 2, "ranges": {"water.density": {"low": 2.0, "high": 1.0}}}}, "is no range"),
        (
            {"samples": {"count": 2, "ranges": {"water.density": {"low": 0.0, "high": 1.0, "spread": "log"}}}},
            "logarithm",
        ),
        ({"motions": [{"bag": "nbp1406", "heave": [1.0, 8.0]}]}, "names more than one motion"),
        ({"plans": ["0 haul 3"]}, "is no plan"),
        ({"figures": ["tension_mean"]}, "names 'tension_mean', which no run gives; .* Did you mean tension_mean_n"),
        ({"figures": ["tension_mean_n", "tension_mean_n"]}, "figures has a value twice"),
        ({"figures": ["body_position_m"]}, "names 'body_position_m', which is no single number"),
        ({"grid": {"winch.scope": [1, 1.0]}}, r"grid.winch.scope has a value twice \(1 and 1.0\)"),
        ({"grid": {"water.turbulence.deviation": [[0, 0, 1], [0.0, 0, 1]]}}, "has a value twice"),
        ({"grid": {"winch.scope": {"first": 1, "last": 1, "count": 3}}}, "= 1 to 1 has the same value 3 times"),
        ({"grid": {"winch.scope": {"first": 1, "last": 2}}}, "count is missing: write a list such as"),
        ({"grid": {"winch.scope": {"first": 1, "last": 2, "n": 3}}}, "n is none of first, last, count: write"),
        ({"grid": {"winch.scope": {"first": "a", "last": 2, "count": 1}}}, "first = 'a' cannot be, count = 1 cannot"),
        ({"grid": {"winch.scope": 1.0}}, "= 1.0 is no list of values: write a list"),
        ({"grid": ["winch.scope"]}, r"expected a block of keys .* `grid: \{winch.scope: \[100, 200\]\}`"),
        ({"samples": {"count": 2, "ranges": {"water.density": 5}}}, "example `water.density: {low: 1.0, high: 2.0}`"),
        ({"motions": [{}, {}]}, r"motions has a value twice \(none\)"),
        ({"motions": [{"rao": "simple"}, {"rao": "simple"}]}, r"motions has a value twice \(rao simple\)"),
        ({"motions": [{"bag": "nbp1406"}, {"bag": BAG}]}, "motions has a value twice"),
        ({"motions": [{"heave": [1, 8]}, {"heave": [1.0, 8.0]}]}, "motions has a value twice"),
        ({"motions": [{"heave": [1, 0]}]}, r"motions.0.heave = \[1, 0\]: the period is outside \[1, 600\] s"),
        ({"motions": [{"heave": [0, 8]}]}, r"the amplitude is outside \(0, 20\] m; .* for example heave: \[1, 8\]"),
        ({"motions": [{"heave": "1,8"}]}, r"motions\[0\].heave = '1,8' is text.* period\); .* `heave: \[1, 8\]`"),
        ({"motions": [{"heave": {"first": 1}}]}, r"Write for example `heave: \[1, 8\]`"),
        ({"motions": ["nbp1406"]}, r"Write for example `motions: \[\{heave: \[1, 8\]\}\]`"),
        ({"motions": {"rao": "simple"}}, r"expected a list of blocks .* `motions: \[\{heave: \[1, 8\]\}\]`"),
        ({"motions": [{"bagg": "x"}]}, r"Did you mean motions\[0\].bag"),
        ({"motions": [{}, {"bag": "nope"}]}, "here: motions.1.bag = nope: .*no such bag file"),
        ({"motions": [{}, {"bag": "nope.csv"}]}, "here: motions.1.bag = nope.csv: .*no such file"),
        ({"motions": [{"rao": "nope.csv"}]}, "motions.0.rao = nope.csv: .*no such file"),
        ({"motions": [{"rao": "simple:length=x"}]}, "'length=x' is no number; .* rao: simple:length=60"),
        ({"motions": [{"rao": "simple:length=60"}]}, "motions.0.rao = simple:length=60: .*wave"),
        ({"plans": ["0 hold", "0  hold"]}, r"plans has a value twice \(0 hold and 0  hold\)"),
        ({"plans": ["plan.txt"]}, "plans.0 = 'plan.txt': .*cannot be read"),
        ({"plans": [None, "0 rate 50"]}, "plans.1 = '0 rate 50': .*beyond winch.max_rate = 5 m/s"),
        ({"plans": ["0 hold, " * 40 + "9 hold"]}, "is not after that of the item before"),
        ({"plans": "0 hold"}, "expected a list .* `plans: "),
        ({"setpoints": ["hold", "hold"]}, r"setpoints has a value twice \(hold\)"),
        ({"setpoints": [None, "hold"]}, r"setpoints has a value twice \(null and hold, which the scene has\)"),
        ({"setpoints": ["hold", "foo"]}, r"setpoints\[1\] = 'foo' is none of its values .* Known: hold, simp"),
        ({"seeds": 3}, "nothing of flume is random"),
        ({"step": "sometimes"}, "neither chosen nor fixed"),
        ({"grid": {"solver.tick": [0.01, 0.02]}}, "here: solver.tick is set by step = chosen: .* Give step = fixed"),
        ({"settings": {"solver.tick": 0.01}}, "solver.tick is set by step = chosen"),
        ({"step": "fixed", "grid": {"solver.tension_error": [1e-3, 1e-2]}}, "is a bound of chosen steps"),
        ({"setpoints": ["hold"], "grid": {"setpoint.algorithm": ["hold"]}}, "setpoint.algorithm is set by setpoints"),
        ({"seeds": 2, "settings": {"water.turbulence.seed": 9}}, "water.turbulence.seed is set by seeds"),
        ({"grid": {"water.density": [1000.0], "water": [{}]}}, "water.density is a part of water, which is given"),
        ({"grid": {"winch.scope": [1.0, float("nan")]}}, "grid.winch.scope has nan, which is no finite number"),
        ({"settings": {"winch.scop": 1.0}}, "here: settings: .*there is no such key"),
        ({"duration": -1.0}, "duration"),
        ({"grid": {"heave.imu_position": [1.0]}}, "is not varied here"),
        (
            {
                "grid": {"winch.scope": {"first": 0.5, "last": 1.0, "count": 100000}},
                "plans": [None] + [f"{k} hold" for k in range(11)],
            },
            "more than 1000000",
        ),
    ],
)
def test_a_sweep_that_cannot_be_made_is_refused(change, text):
    with pytest.raises(SweepError, match=text):
        checked({**SHORT, **change}, "here")


def test_files_are_looked_for_beside_the_sweep_and_decide_its_rows(tmp_path):
    (tmp_path / "up.txt").write_text("0 rate -0.01\n")
    (tmp_path / "tow.csv").write_text("time_s,heave_m\n" + "".join(f"{k / 10},{k % 7 / 100}\n" for k in range(9)))
    (tmp_path / "2up.txt").write_text("0 rate -0.03\n")
    told = "sweep: one\nscene: flume\nduration: 0.5\nplans: [./2up.txt, 2up.txt]\n"
    (tmp_path / "s.yaml").write_text(told)
    with pytest.raises(SweepError, match=r"s.yaml: plans has a value twice \(2up.txt\)"):
        load_sweep(tmp_path / "s.yaml")
    (tmp_path / "s.yaml").write_text(told.replace(", 2up.txt", ""))
    assert [case.winch for case in cases_of(load_sweep(tmp_path / "s.yaml"))] == ["0 rate -0.03"]
    told = "sweep: one\nscene: flume\nduration: 0.5\nplans: [up.txt]\nmotions: [{bag: tow.csv}]\n"
    (tmp_path / "s.yaml").write_text(told)
    (case,) = cases_of(load_sweep(tmp_path / "s.yaml"))
    assert case.winch == "0 rate -0.01" and case.motion.bag == str(tmp_path / "tow.csv"), "a plan is read once"
    (tmp_path / "up.txt").write_text("0 rate -0.02\n")
    (other,) = cases_of(load_sweep(tmp_path / "s.yaml"))
    assert other.key != case.key, "another plan is another row"
    (tmp_path / "tow.csv").write_text("time_s,heave\n0,1\n")
    with pytest.raises(SweepError, match=r"s.yaml: motions.0.bag = .*tow.csv: there is no column 'heave'"):
        load_sweep(tmp_path / "s.yaml")


def test_a_plan_that_only_some_cases_can_carry_out_is_no_reason_to_refuse_all():
    plan = {"plans": ["0 rate 0.5"], "grid": {"winch.max_rate": [0.1, 1.0]}}
    assert count_of(checked({**SHORT, **plan}, "here")) == 2


@pytest.mark.parametrize("name, count", [("envelope", 512), ("sensitivity", 1408)])
def test_the_sweeps_of_the_pages_load(name, count):
    plan = load_sweep(Path(__file__).resolve().parents[2] / "docs" / f"{name}.yaml")
    assert len(points(plan)) == count if name == "sensitivity" else count_of(plan) == count


def test_workers_are_bounded_by_memory(monkeypatch):
    monkeypatch.setattr(engine, "free_memory", lambda: 1.5 * engine.MEMORY)
    assert workers_of(64) == 1
    monkeypatch.setattr(engine, "free_memory", lambda: 1e12)
    assert workers_of(3) == 3


def test_the_data_set_has_units_and_what_was_varied(swept, tmp_path):
    import xarray

    from cable_sim_ros.tools.sweeps.dataset import write

    netcdf, csv = write(swept, tmp_path)
    with xarray.open_dataset(netcdf, engine="h5netcdf") as read:
        assert read["winch.scope"].values.tolist() == [0.9, 1.0, 99999.0]
        assert read["tension_mean_n"].attrs["units"] == "N"
        assert read["winch.scope"].attrs["units"] == "m" and read["winch.scope"].attrs["long_name"]
        assert read["verdict"].values.tolist()[2] == "failed"
        assert json.loads(read.attrs["sweep"])["scene"] == "flume"
    assert csv.read_text("utf-8").startswith("case,")


def test_units_of_what_was_varied_are_those_of_its_declaration():
    from cable_sim_ros.tools.sweeps.dataset import _about

    given = "water.waves.height", "cable.sections.main.length", "cable.sections.main.drag_coefficient", "seed"
    assert [_about(key)["units"] for key in given] == ["m", "m", "1", "1"]
    assert _about("motion") == {} and "units" not in _about("setpoint.algorithm")


def test_a_motion_that_is_shorter_than_duration_is_said(tmp_path):
    (tmp_path / "tow.csv").write_text("time_s,heave_m\n" + "".join(f"{k / 10},{k % 7 / 1000}\n" for k in range(9)))
    plan = {"sweep": "s", "scene": "flume", "duration": 2.0, "motions": [{"bag": str(tmp_path / "tow.csv")}]}
    (case,) = cases_of(checked(plan, "here"))
    told = simulate(case)["warnings"]
    assert "duration = 2 s is longer than the motion: 0." in told and "were simulated" in told
    (case,) = cases_of(checked({**plan, "duration": 0.5}, "here"))
    assert "longer than the motion" not in simulate(case)["warnings"]


@pytest.mark.parametrize("motion, told", [({"rao": "simple"}, False), ({"heave": [0.1, 6.0]}, True)])
def test_a_row_says_when_the_waves_do_not_move_the_ship(motion, told):
    sea = {"water.waves.kind": "jonswap", "water.waves.period": 7.0, "water.waves.height": 1.0}
    plan = {"sweep": "sea", "scene": "side_scan", "duration": 0.5, "motions": [motion], "settings": sea, "seeds": 1}
    with warnings.catch_warnings(record=True, action="always") as of_the_file:
        (case,) = cases_of(checked(plan, "here"))
    row = simulate(case)
    of_the_file = " ".join(str(one.message) for one in of_the_file)
    assert ["independent" in text for text in (of_the_file, row["warnings"])] == [told, told]
    assert row["verdict"] != "failed"


CALLER = """
import os, time
if __name__ == "__main__":
    from cable_sim_ros.tools.sweeps.engine import processes
    executor = processes(1)
    print(executor.submit(os.getpid).result(), flush=True)
    executor.submit(time.sleep, 60.0)
    time.sleep(60.0)
"""


@pytest.mark.parametrize("number", [pytest.param(signal.SIGTERM, marks=pytest.mark.nightly), signal.SIGKILL])
def test_workers_end_with_a_caller_that_was_ended_by_a_signal(tmp_path, number):
    """Else each waits for work for ever, with its memory."""
    (tmp_path / "caller.py").write_text(CALLER)
    with subprocess.Popen([sys.executable, tmp_path / "caller.py"], stdout=subprocess.PIPE, text=True) as caller:
        worker = int(caller.stdout.readline())
        caller.send_signal(number)
    deadline = time.monotonic() + 60.0
    while alive(worker) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(worker)


def alive(pid):
    """Is a process there that has not ended?"""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_file_that_changes_while_the_sweep_runs_gives_no_row_that_stays(tmp_path):
    """Its row would be that of the new file under the key of the old one, for ever."""
    place = tmp_path / "my.yaml"
    place.write_text(dump_scene(load_scene("flume")))
    plan = {**SHORT, "scene": str(place), "grid": {"winch.scope": [0.9, 1.0]}}
    cases = list(cases_of(checked(plan, "here")))
    place.write_text(dump_scene(override(load_scene("flume"), {"water.density": 1025.0})))
    row = simulate(cases[0])
    assert row["verdict"] == "failed" and row["again"] and "FileChanged" in row["error"]
    others = list(cases_of(checked(plan, "here")))
    assert others[0].key != cases[0].key, "in the same process too"
    place.unlink()
    assert simulate(others[0])["again"]


def test_a_run_that_fails_as_its_file_is_gone_meanwhile_is_not_kept(tmp_path, monkeypatch):
    place = tmp_path / "my.yaml"
    place.write_text(dump_scene(load_scene("flume")))
    (case,) = cases_of(checked({**SHORT, "scene": str(place), "grid": {"winch.scope": [0.9]}}, "here"))

    def gone(case):
        place.unlink()
        raise SweepError([f"{place}: no such file"])

    monkeypatch.setattr(worker, "_run", gone)
    row = simulate(case)
    assert row["again"] and row["error"].startswith("FileChanged: ")


def test_what_failed_by_the_machine_is_run_again_by_the_next_start(tmp_path, monkeypatch):
    plan = checked({**SHORT, "grid": {"winch.scope": [0.9, 1.0]}}, "here")
    dead = {1.0: lambda case: engine.failed(case, "the worker that ran it ended")}
    monkeypatch.setattr(engine, "simulate", lambda case: dead.get(case.settings["winch.scope"], simulate)(case))
    lost = sweep(plan, tmp_path, make=Here)
    assert lost.rows[0]["verdict"] != "failed" and lost.rows[1]["again"]
    monkeypatch.setattr(engine, "simulate", simulate)
    again = sweep(plan, tmp_path, make=Here)
    assert again.computed == 1 and again.rows[1]["verdict"] != "failed" and "again" not in again.rows[1]
    assert sweep(plan, tmp_path, make=Here).computed == 0
    (tmp_path / "rows" / "part-abc.parquet").touch()
    assert Store(tmp_path).damaged == ["part-abc.parquet"]


def test_a_case_whose_value_would_not_be_that_of_its_run_fails():
    """The first value lets the tick alone, for instruments read at it; another does not."""
    (case,) = cases_of(checked({**SHORT, "grid": {"winch.scope": [0.9]}}, "here"))
    row = simulate(case._replace(settings={**case.settings, "solver.tick": 0.02}))
    assert row["verdict"] == "failed" and "SceneError: solver.tick is set by step = chosen" in row["error"]


def test_a_folder_with_the_name_of_the_scene_is_not_the_scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plan = checked({**SHORT, "grid": {"winch.scope": [0.9]}}, "here")
    (case,) = cases_of(plan)
    (tmp_path / "flume").mkdir()
    (tmp_path / "flume" / "sweep.csv").touch()
    (again,) = cases_of(plan)
    assert again.key == case.key
    (tmp_path / "s.yaml").write_text("sweep: one\nscene: flume\nduration: 0.5\n")
    assert load_sweep(tmp_path / "s.yaml").scene == "flume"


def test_columns_stand_in_one_order_however_the_rows_came(swept):
    other = swept._replace(rows=[dict(sorted(row.items())) for row in swept.rows])
    assert names_of(swept) == names_of(other) and names_of(swept)[0] in FIGURES


def test_a_rule_without_a_reading_is_neither_kept_nor_broken():
    rows = [{"rule": "working_load", "worst": 5.0, "broken": True}, {"rule": "slack", "worst": None, "broken": False}]
    metrics = {"rules": {"rules": rows, "not_watched": [{"rule": "slack", "why": "no reading"}]}}
    found = numbers_of(metrics)
    assert found["rule.working_load.broken"] == 1.0 and isnan(found["rule.slack.broken"])
    assert unwatched(metrics) == ["rule slack was not watched (no reading)"] and unwatched({}) == []
