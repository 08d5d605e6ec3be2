"""Ratios of run time to an earlier commit: pairs, table, checkout and errors.

The two versions are those of a small repository, so that nothing is compiled: each prints what ``cable-sim`` of a real
commit prints, one of them under the older names and without the younger options.
"""

import json
import shutil
import subprocess

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from verification import commands as laboratory
from verification.benchmarks import against, bench, checkout
from verification.benchmarks.against import Found
from verification.benchmarks.turns import in_turn

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="no git")
VERSION = """
import json, sys
COST, ERROR, KEY, STEP, BENCHMARKS = {cost}, {error}, "{key}", {step}, {benchmarks}


def row(code, setting, elements):
    figures = dict(scene=sys.argv[2], code=code, setting=setting, elements=elements, dt_s=0.01, error_tension=ERROR)
    figures.update(error_position=0.001, cpu_s_per_sim_s=COST, iterations_per_step=1.5, note="")
    return figures | {{KEY: {{"realtime_factor": 1.0 / COST, "ripple_n": 0.25}}}}


def main():
    command, name = sys.argv[1:3]
    if command == "bench":
        if name not in BENCHMARKS:
            sys.exit(f"Error: Invalid value for '[P1 ... P9]': '{{name}}' is not one of {{BENCHMARKS}}.")
        print(json.dumps([row("cable_sim_ros", "6, 10 ms", 6), row("lumped chain", "100 segments", 100)]))
    elif "--step" in sys.argv and not STEP:
        sys.exit("Error: No such option: --step")
    elif name not in BENCHMARKS:
        sys.exit(f"error: {{name}}: no such scene file; nothing was started.")
    else:
        told = dict(tension_mean_n=1000.0 + 10.0 * ERROR, tension_std_n=20.0, body_depth_m=50.0)
        told.update(body_position_m=[-100.0, 0.0, -50.0], ticks=4000, steps=4000, iterations=4400, duration_s=39.99)
        print(json.dumps(told | {{"realtime_factor": 1.0 / COST}}))


if __name__ == "__main__":
    main()
"""
OLD = {"cost": 4.0, "error": 0.02, "key": "figures", "step": False, "benchmarks": ["P2", "P5", "full_scale"]}
NEW = OLD | {"cost": 2.0, "key": "metrics", "step": True, "benchmarks": ["P2", "P5", "P8", "full_scale", "side_scan"]}


def git(folder, *arguments):
    who = ("-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "commit.gpgsign=false")
    command = ["git", "-C", str(folder), *who, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def commit(folder, text):
    package = folder / "cable_sim_ros"
    package.mkdir(exist_ok=True)
    (package / "__init__.py").write_text("")
    (package / "cli.py").write_text(text)
    git(folder, "add", "-A")
    git(folder, "commit", "-q", "-m", "a version")
    return git(folder, "rev-parse", "--short=7", "HEAD").strip()


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """Root, and the short names of its two commits: the older version, and one that cannot be imported; the newer
    version is in the work tree."""
    root = tmp_path / "project"
    root.mkdir()
    git(root, "init", "-q")
    old = commit(root, VERSION.format(**OLD))
    broken = commit(root, "import no_such_package_anywhere\n")
    (root / "cable_sim_ros" / "cli.py").write_text(VERSION.format(**NEW))
    monkeypatch.setattr(against, "ROOT", root)
    fine = {"tension_mean_n": 1000.0, "tension_std_n": 20.0, "body_position_m": [-100.0, 0.0, -50.0]}
    monkeypatch.setattr(against, "reference", lambda name: fine)
    return root, old, broken


def call(*arguments):
    return CliRunner().invoke(commands.main, ["bench", *arguments])


@needs_git
def test_two_versions_in_turn_give_table_and_json(repository, tmp_path):
    root, old, _ = repository
    out = tmp_path / "out"
    done = call("P2", "P8", "full_scale", "side_scan", "--against", old, "--rounds", "2", "--out", str(out))
    assert done.exit_code == 0, done.output
    found = json.loads((out / "against.json").read_text())
    assert found["against"] == old and found["commit"].endswith("-dirty") and found["rounds"] == 2
    assert [row["benchmark"] for row in found["rows"]] == ["P2", "full_scale"]
    for row in found["rows"]:
        assert (row["ratio"], row["ratio_min"], row["ratio_max"]) == (0.5, 0.5, 0.5) and row["same_bits"]
    ticks = found["rows"][1]
    assert ticks["step_s"] == 0.01 and ticks["error_tension"] == pytest.approx(2e-4) and ticks["error_position"] == 0.0
    assert found["means"] == {"P2": pytest.approx(0.5), "full_scale": pytest.approx(0.5)}
    assert len(found["absent"]) == 2
    assert "does not run P8: Error: Invalid value for '[P1 ... P9]': 'P8' is not one of" in found["absent"][0]
    assert "does not run side_scan: error: side_scan: no such scene file" in found["absent"][1]
    assert done.stdout.startswith((out / "against.md").read_text())
    # nothing of the checkout stays
    assert sorted(path.name for path in out.iterdir()) == ["against.json", "against.md"]
    assert len(git(root, "worktree", "list").splitlines()) == 1


@needs_git
@pytest.mark.parametrize(
    "name, text",
    [
        ("no_such_commit", "no commit of {root} has this name; nothing was compared. `git log"),
        ("--output=x", "--against --output=x: no commit of {root} has this name"),
        ("HEAD", "the package of that commit cannot be imported with"),
        ("HEAD", "No module named 'no_such_package_anywhere'); nothing was compared. Give a later commit, or an"),
    ],
)
def test_a_commit_that_is_none_is_told_in_one_line(repository, name, text):
    root, *_ = repository
    done = call("P2", f"--against={name}")
    assert done.exit_code == 2 and text.format(root=root) in done.stderr and len(done.stderr.splitlines()) == 1
    assert len(git(root, "worktree", "list").splitlines()) == 1


@needs_git
def test_what_a_commit_does_not_have_is_no_comparison(repository):
    _, old, _ = repository
    done = call("P8", "--against", old, "--rounds", "1")
    assert done.exit_code == 2 and f"--against {old}: nothing was compared: {old} does not run P8" in done.stderr
    assert "Give a later commit" in done.stderr


@needs_git
def test_a_benchmark_that_fails_here_is_an_error(repository):
    root, old, _ = repository
    (root / "cable_sim_ros" / "cli.py").write_text("def main():\n    pass\nif __name__ == '__main__':\n    1 / 0\n")
    done = call("P2", "--against", old, "--rounds", "1")
    assert done.exit_code == 2 and "P2 of this tree failed (ZeroDivisionError: division by zero)" in done.stderr


def test_without_a_repository_or_git_there_is_nothing_to_compare_with(tmp_path, monkeypatch):
    monkeypatch.setattr(against, "ROOT", tmp_path)
    if shutil.which("git"):
        done = call("P2", "--against", "HEAD")
        assert done.exit_code == 2 and f"{tmp_path}, from which this version runs, is no git" in done.stderr
        assert "nothing was compared. Run the command in a clone of the project" in done.stderr
    monkeypatch.setenv("PATH", str(tmp_path))
    done = call("P2", "--against", "HEAD")
    assert done.exit_code == 2 and "error: git cannot be run (No such file or directory)" in done.stderr
    assert "nothing was compared. Install git" in done.stderr


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("--against", "HEAD", "--rounds", "0"), "0 is outside [1, 100]; nothing was done. Give one inside"),
        (("--against", "HEAD", "--rounds", "two"), "'two' is not a whole number; nothing was done. Give one in"),
        (("P2", "--rounds", "2"), "--rounds are those of --against; nothing was run. Give --against COMMIT"),
        (("full_scale",), "full_scale: ticks have a time only beside another version; nothing was run. Give --against"),
        (("--against", "HEAD", "--ticks"), "--rounds, --out and --json alone; nothing was run"),
        (("P2", "--against", "HEAD", "--repeats", "2"), "beside it stand names of benchmarks"),
    ],
)
def test_options_that_do_not_go_together(arguments, text):
    done = call(*arguments)
    assert done.exit_code == 2 and text in done.stderr.replace("\n", " ") and not done.stdout


def test_every_clock_of_a_version_is_that_of_its_cpu(tmp_path):
    (tmp_path / "cable_sim_ros").mkdir()
    (tmp_path / "cable_sim_ros" / "__init__.py").write_text("")
    (tmp_path / "cable_sim_ros" / "cli.py").write_text(
        "import json, os, sys, time\n"
        "begin = time.perf_counter()\ntime.sleep(0.3)\n"
        "print(json.dumps([time.perf_counter() - begin, os.environ['OMP_NUM_THREADS'], sys.argv[1:]]))\n"
    )
    (seconds, threads, arguments), words = checkout.Tree("x", tmp_path, tmp_path / "k").command("bench", "P2")
    assert seconds < 0.1 and threads == "1" and arguments == ["bench", "P2", "--json"] and not words


def found(setting="6, 10 ms", cpu=1.0, error=0.02, **results):
    return Found(setting, 6, 0.01, error, 0.001, cpu, results or {"error_tension": error})


def test_the_ratio_is_of_medians_and_its_range_of_the_rounds():
    mine = [[found(cpu=c)] for c in (1.0, 3.0, 2.0)]
    theirs = [[found(cpu=c)] for c in (4.0, 4.0, 5.0)]
    (row,), words = against.ratios("P2", mine, theirs, "abc1234")
    assert (row.ratio, row.ratio_min, row.ratio_max) == (0.5, 0.25, 0.75) and row.same_bits and not words
    (row,), _ = against.ratios("P2", mine, [[found(cpu=4.0)]] * 2 + [[found(error=0.021)]], "abc1234")
    assert not row.same_bits


def test_what_has_no_partner_is_said():
    _, words = against.ratios("P2", [[found(), found("20 links, 5 ms")]], [[found(), found("20, 5 ms")]], "abc1234")
    assert words == ["P2: abc1234 has no setting 20 links, 5 ms", "P2: only abc1234 has 20, 5 ms"]


@pytest.mark.parametrize(
    "mine, theirs, partner",
    [
        ("hold, feed 4-2-13, 10 ms", ["hold, 22-2-80, 20 ms", "hold, 22-2-80, 10 ms"], 1),
        ("hold, feed 4-2-13, 10 ms", ["hold, contact 22-2-80, 10 ms", "hold, feed 5-2-13, 10 ms"], 1),
        ("hold, feed 4-2-13, chosen, 0.005", ["hold, feed 4-2-13, 10 ms"], None),
        ("simplified_sheave, feed 4-2, 10 ms", ["hold, feed 4-2, 10 ms"], None),
        ("hold, feed refined, 5 ms", ["hold, feed 4-2, 5 ms", "hold, feed refined, 5 ms"], 1),
        ("hold, feed refined, 5 ms", ["hold, feed 4-2, 5 ms"], None),
        ("40, 10 ms", ["40 links, 10 ms"], None),
    ],
)
def test_a_whole_tow_is_compared_on_the_mesh_it_had(mine, theirs, partner):
    assert against.partner_of(found(mine), [found(setting) for setting in theirs]) == partner


def test_the_table_of_given_rows():
    here = Found("hold, feed 31, 10 ms", 31, 0.01, 0.0026, 0.0014, 0.004, {})
    there = Found("hold, 128, 10 ms", 128, 0.01, None, 0.003, 0.01, {})
    row = against.Ratio("P7", here, there, 0.4, 0.38, 0.45, False)
    text = against.markdown(against.Comparison("aaa", "bbb", 3, [row], {"P7": 0.4}, ["bbb does not run P8: x"]))
    line = "| P7 | hold, feed 31, 10 ms for hold, 128, 10 ms | 31, 128 | 10 | 0.004 | 0.01 | 0.400 (0.380 to 0.450) | "
    assert line + "0.26 %, - | 0.14 cm, 0.3 cm | no |" in text.splitlines()
    assert "Geometric mean of the ratios: P7 0.400." in text and text.endswith("* bbb does not run P8: x")
    plain = against.markdown(against.Comparison("aaa", "bbb", 3, [row._replace(benchmark="P2")], {"P2": 0.4}, []))
    assert "| 0.14 %, 0.3 % |" in plain


def test_jobs_take_turns_and_every_other_round_goes_backwards():
    seen = []

    def job(name):
        seen.append(name)
        return len(seen), name

    costs, last = in_turn([lambda: job("a"), lambda: job("b")], 2)
    assert "".join(seen) == "abbaab" and costs == [[4, 5], [3, 6]] and last == ["a", "b"]


def test_names_on_the_command_line_are_those_that_exist():
    assert tuple(laboratory.BENCH_IDS) == bench.SCENES and tuple(laboratory.TICK_IDS) == against.TICKS
    assert set(against.BENCHMARKS) <= {*bench.SCENES, *against.TICKS}
