"""Kernels on disk: an edit compiles what it is part of and nothing else, nothing stale is ever run, any process works.

On a small package with a copy of what compiles; each run is a process of its own.
"""

from __future__ import annotations

import os
import re
import select
import subprocess
import sys

import llvmlite.binding
import numba
import pytest
from small_package import AS_IT_IS, FILES, Small

from cable_sim_ros.compiler import compiling
from cable_sim_ros.io.scenes.document import shipped_scenes

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="needs compilation")
ALL = ["_heavier", "_heavy", "by_law", "paired", "run", "scaled", "tabled"]
TWO_WORKERS = "compiling.SMALL, compiling.cores = -1, lambda: 3"
ONE_CORE = "compiling.SMALL, compiling.cores = -1, lambda: 1"


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """The package as it is, compiled once."""
    small = Small(tmp_path_factory.mktemp("compiled"))
    assert small.run() == (AS_IT_IS, ALL)
    return small


@pytest.fixture
def small(compiled, tmp_path):
    """A package of its own, its kernels on disk."""
    copy = Small(tmp_path)
    copy.cache = tmp_path / "own"
    folder = copy.cache / "cable_sim_ros" / "kernels"
    folder.mkdir(parents=True)
    for name, content in compiled.files().items():
        (folder / name).write_bytes(content)
    return copy


EDITS = {
    "a comment": ("physics/inlined.py", "  # of it", "\n    # of another\n", AS_IT_IS, []),
    "a docstring": ("physics/inlined.py", "A multiple.", "So many times it.", AS_IT_IS, []),
    "lines above": ("physics/heavy.py", "@driver\ndef _heavy(", "\n\n\n@driver\ndef _heavy(", AS_IT_IS, []),
    "a table": ("physics/numbers.py", "[1.0, 10.0]", "[1.0, 20.0]", AS_IT_IS + 10.0, ["run", "tabled"]),
    "an enum": ("physics/numbers.py", "SQUARE = 2", "SQUARE = 3", AS_IT_IS - 6.0, ["by_law", "run"]),
    "an inline function": (
        "physics/inlined.py",
        "return FACTOR * x",
        "return FACTOR * x + 1.0",
        AS_IT_IS + 1.0,
        ["_heavy", "scaled"],
    ),
    "the body of what is called by symbol": (
        "physics/heavy.py",
        "scaled(paired(rows[0].a).first)",
        "rows[0].b",
        AS_IT_IS,
        ["_heavy"],
    ),
    "what a call by symbol returns": (
        "physics/heavy.py",
        '_heavy(rows) -> float:\n    """The first of a row."""\n    return scaled(paired(rows[0].a).first)',
        "_heavy(rows) -> int:\n    return int(7)",
        AS_IT_IS - 200.0 + 7.0,
        ["_heavier", "_heavy"],
    ),
    "fields of a record": (
        "physics/numbers.py",
        '[("a", "f8"), ("b", "f8")]',
        '[("b", "f8"), ("a", "f8")]',
        AS_IT_IS,
        ["_heavier", "_heavy", "run"],
    ),
    "the type of a field": (
        "physics/numbers.py",
        '("a", "f8")',
        '("a", "i8")',
        AS_IT_IS,
        ["_heavier", "_heavy", "paired", "run", "scaled"],
    ),
    "fields of a named tuple": (
        "physics/numbers.py",
        "first: float\n    second: float",
        "second: float\n    first: float",
        AS_IT_IS - 200.0,
        ["_heavy", "paired"],
    ),
}


VARIANTS = ("a docstring", "lines above", "a table", "an enum", "the type of a field", "fields of a named tuple")


@pytest.mark.parametrize(
    "file, old, new, value, names",
    [pytest.param(*EDITS[k], id=k, marks=[pytest.mark.nightly] if k in VARIANTS else []) for k in EDITS],
)
def test_an_edit_compiles_what_it_is_part_of(small, file, old, new, value, names):
    small.edit(file, old, new)
    assert small.run() == (value, names)


def test_what_was_compiled_after_an_edit_is_kept_and_what_was_edited_back_is_still_there(small):
    small.edit("physics/numbers.py", "FACTOR = 2.0", "FACTOR = 3.0")  # a number in another file
    assert small.run() == (AS_IT_IS + 100.0, ["_heavy", "scaled"]) and not small.run().compiled
    small.edit("physics/numbers.py", "FACTOR = 3.0", "FACTOR = 2.0")
    assert small.run() == (AS_IT_IS, [])


def test_a_change_of_what_compiles_compiles_everything(small):
    small.edit("compiler/kernel_form.py", "ENTRY, PUBLISHED, CALLED =", "SPARE = 0\nENTRY, PUBLISHED, CALLED =")
    assert small.run() == (AS_IT_IS, ALL)


def test_another_processor_has_kernels_of_its_own(small):
    assert small.run(NUMBA_CPU_NAME="x86-64", NUMBA_CPU_FEATURES="") == (AS_IT_IS, ALL)


def test_a_wrong_word_on_what_it_returns_is_refused(small):
    small.edit("physics/heavy.py", "def _heavy(rows) -> float:", "def _heavy(rows) -> int:")
    out, err = small.start().communicate(timeout=600)
    assert not out
    assert re.search(r"small\.physics\.heavy\._heavy returns float64 and says int64: .* not published", err)


def test_a_damaged_file_is_compiled_again(small):
    folder = small.cache / "cable_sim_ros" / "kernels"
    for path in folder.iterdir():
        path.write_bytes(path.read_bytes()[:-100] + bytes(100))
    assert small.run() == (AS_IT_IS, ALL)
    assert small.run() == (AS_IT_IS, [])


def machine_code(small: Small) -> dict[str, list[bytes]]:
    """Of every file that has some: the sections of its object that are code."""
    objects = {
        name: content[content.index(b"\x7fELF") :] for name, content in small.files().items() if b"\x7fELF" in content
    }
    found = {name: llvmlite.binding.ObjectFileRef.from_data(data).sections() for name, data in objects.items()}
    return {
        name: [bytes(section.data()) for section in sections if section.is_text()] for name, sections in found.items()
    }


AHEAD = """
import glob, time
from small.physics.inlined import scaled
from small.sim import top

link, entered = top.link_heavy, []

def linking(rows):  # the process compiles first while it plans: the worker begins then, from a plan of its own
    entered.append(rows)
    scaled(1.0)
    link(rows)
    kept = os.environ["NUMBA_CACHE_DIR"] + "/cable_sim_ros/kernels/*."
    until = time.monotonic() + 600.0
    while rows is entered[0] and len(glob.glob(kept + "published") + glob.glob(kept + "entry")) < 4:
        assert time.monotonic() < until
        time.sleep(0.05)

top.link_heavy = linking
compiling.ahead(top.needs)
"""


def test_a_worker_begins_ahead_and_makes_the_same_code(compiled, tmp_path):
    by_worker = Small(tmp_path)
    assert by_worker.run(f"{TWO_WORKERS}\n{AHEAD}") == (AS_IT_IS, ["scaled"])
    code, others = machine_code(compiled), machine_code(by_worker)
    assert len(code) == 3 and all(b"".join(sections) for sections in code.values())
    assert {name: others[name] for name in code} == code and len(others) == 4


@pytest.mark.nightly
@pytest.mark.parametrize("scene", shipped_scenes())
def test_each_shipped_scene_ticks_with_nothing_on_disk(scene, tmp_path):
    line = f"from cable_sim_ros import Simulator; s = Simulator({scene!r}); s.start(); print(s.tick().tension)"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    ran = subprocess.run([sys.executable, "-c", line], env=environment, capture_output=True, text=True, timeout=600)
    assert ran.returncode == 0 and float(ran.stdout) > 0.0, ran.stderr


@pytest.mark.parametrize(
    "script",
    [
        pytest.param("exit 1", id="does not start", marks=pytest.mark.nightly),
        pytest.param("echo ready; read line; exit 9", id="leaves a kernel undone", marks=pytest.mark.nightly),
        pytest.param("echo ready; read line; kill -9 $$", id="is killed"),
        pytest.param("exec 0<&-; exec 1>&-", id="says nothing", marks=pytest.mark.nightly),
    ],
)
def test_without_a_worker_the_process_compiles_itself(tmp_path, script):
    program = tmp_path / "python-dies"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    assert Small(tmp_path).run(f"{TWO_WORKERS}\nsys.executable = {str(program)!r}") == (AS_IT_IS, ALL)


def test_where_no_thread_can_be_started_the_process_compiles_itself(tmp_path):
    setup = 'def start(self): raise RuntimeError("can\'t start new thread")\ncompiling.threading.Thread.start = start'
    assert Small(tmp_path).run(f"{TWO_WORKERS}\n{setup}") == (AS_IT_IS, ALL)


def test_what_was_begun_ahead_and_is_not_asked_for_waits_no_more():
    pool, forms = compiling._Pool(), [object(), object()]
    for k, form in enumerate(forms):
        pool.waiting.put((k, k, (form, ())))
    pool.keep_only([(forms[1], ())])
    assert pool.waiting.get_nowait()[2][0] is forms[1] and pool.waiting.empty()


WORKER = [sys.executable, "-P", "-W", "ignore", "-m", "cable_sim_ros.compiler.compiling"]
CALLER = f"import os, subprocess, sys; worker = subprocess.Popen({WORKER}, stdout=subprocess.PIPE)"
CALLER += "; print(worker.stdout.readline()); sys.stdout.flush(); os._exit(0)"


def test_a_worker_ends_when_told_and_with_the_process_that_started_it():
    """Also where its input stays open, as another process has it too: here this one."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(WORKER, **pipes) as told, subprocess.Popen([sys.executable, "-c", CALLER], **pipes) as caller:
        assert told.stdout.readline() == b"ready\n" and caller.stdout.readline() == b"b'ready\\n'\n"
        told.stdin.write(b"\n")
        told.stdin.flush()
        assert told.wait(600) == 0
        assert select.select([caller.stderr], [], [], 600)[0], "the worker's end closes it"
        assert caller.stderr.read() == b""


def test_where_a_program_keeps_what_numba_compiles_for_it_is_left_alone(small):
    chosen = "import numba; numba.config.CACHE_DIR = 'mine'\nimport small.compiler.jit\n"
    process = small.start(f"{chosen}assert numba.config.CACHE_DIR == 'mine'")
    out, err = process.communicate(timeout=600)
    assert f'"value": {AS_IT_IS}' in out, err


def test_an_error_in_the_process_ends_the_workers(tmp_path):
    broken = "def keep(*a): raise MemoryError('here')\ncompiling.Form.keep = keep"
    out, err = Small(tmp_path).start(f"{TWO_WORKERS}\n{broken}").communicate(timeout=600)
    assert not out and "MemoryError: here" in err


@pytest.mark.nightly
def test_a_worker_that_hangs_is_given_up(tmp_path):
    program = tmp_path / "python-hangs"
    program.write_text("#!/bin/sh\necho ready; exec sleep 600\n")
    program.chmod(0o755)
    setup = f"{TWO_WORKERS}\ncompiling.HANGS = compiling.TIMES = 0.1\nsys.executable = {str(program)!r}"
    assert Small(tmp_path).run(setup) == (AS_IT_IS, ALL)


@pytest.mark.nightly
@pytest.mark.parametrize("how", ["-c", "-"])
@pytest.mark.parametrize(
    "setup",
    [TWO_WORKERS, f"{TWO_WORKERS}\nsys.frozen = True", f"{TWO_WORKERS}\nsys.executable = ''"],
    ids=["workers", "frozen", "embedded"],
)
def test_any_kind_of_process_works(tmp_path, how, setup):
    assert Small(tmp_path).run(setup, how).value == AS_IT_IS


@pytest.mark.nightly
def test_a_frozen_or_embedded_program_starts_no_worker(tmp_path):
    no_worker = "compiling.subprocess.Popen = None"
    for own in ("sys.frozen = True", "sys.executable = ''", "sys.executable = '/usr/bin/simulator'"):
        assert Small(tmp_path / str(len(own))).run(f"{TWO_WORKERS}\n{no_worker}\n{own}") == (AS_IT_IS, ALL)


def test_without_compilation(tmp_path):
    small = Small(tmp_path)
    assert small.run(NUMBA_DISABLE_JIT="1") == (AS_IT_IS, [])
    assert not small.files()


@pytest.mark.parametrize("setup", ["", pytest.param(TWO_WORKERS, marks=pytest.mark.nightly)])
def test_a_home_that_cannot_be_written(tmp_path, setup):
    small = Small(tmp_path)
    (tmp_path / "temporary").mkdir()
    own = {"NUMBA_CACHE_DIR": "/dev/null/cache", "TMPDIR": str(tmp_path / "temporary")}
    assert small.run(setup, **own).value == AS_IT_IS
    assert small.run(**own) == (AS_IT_IS, [])
    assert list((tmp_path / "temporary").glob(f"cable_sim_ros-{os.getuid()}/kernels/*.entry"))


@pytest.mark.nightly
def test_nowhere_to_write(tmp_path):
    nowhere = "from pathlib import Path\ncompiling.files.folders = [Path('/dev/null/kernels')]"
    small = Small(tmp_path)
    assert small.run(f"{TWO_WORKERS}\n{nowhere}") == (AS_IT_IS, ALL)
    assert not small.files()


@pytest.mark.nightly
def test_two_processes_at_the_same_time(tmp_path):
    small = Small(tmp_path)
    both = [small.start(TWO_WORKERS), small.start(ONE_CORE)]
    assert [small.end(process).value for process in both] == [AS_IT_IS, AS_IT_IS]
    assert small.run() == (AS_IT_IS, [])


def test_what_another_process_kept_a_moment_ago_is_not_loaded_before_what_it_calls(small):
    """Machine code whose calls by symbol are not published yet would end the process."""
    kept = "import small.compiler.kernel_form as f\nf.KeptCode.lacks = lambda *a: True"
    no_worker = f"{TWO_WORKERS}\ncompiling._Pool._serve = lambda *a: None"
    assert small.run(f"{no_worker}\n{kept}") == (AS_IT_IS, ["_heavier", "_heavy", "run"])


def test_what_was_compiled_before_a_number_was_replaced_is_not_kept(small):
    """A function compiled with the old number stands in memory; a caller's name on disk would say the new one."""
    small.edit("physics/numbers.py", "FACTOR = 2.0", "FACTOR = 4.0")
    replace = "import small.physics.inlined as i, numba\ni.scaled.called.compile((numba.float64,))\ni.FACTOR = 5.0"
    ran = small.run(replace)
    assert "_heavy" in ran.compiled
    small.edit("physics/numbers.py", "FACTOR = 4.0", "FACTOR = 5.0")
    assert small.run() == (AS_IT_IS + 300.0, ["_heavy", "scaled"])


def test_the_package_is_what_the_edits_say():
    assert {file for file, *_ in EDITS.values()} <= set(FILES) and sys.version_info >= (3, 11)
