"""Kernels that come with the package are used by those for whom they were made, and are compiled by everybody else."""

import hashlib
import json
import shutil

import numba
import pytest
from numba.core.registry import cpu_target
from small_package import AS_IT_IS, Small

from cable_sim_ros.compiler import packaged
from cable_sim_ros.compiler.packaged import INDEX, Packaged

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="needs compilation")
LEVEL = "x86-64"  # which every processor has that has any
CALLED = ["_heavier", "_heavy", "run"]  # what the package brings of the small one
PACK = """
import atexit
from pathlib import Path
from numba.core.registry import cpu_target
from small.compiler.kernel_cache import files
from small.compiler.packaged import origins, pack
target = cpu_target.target_context.codegen().magic_tuple()
atexit.register(lambda: pack(files.folders[0], origins, Path("kernels"), target))
"""
TOLD = """
import atexit
from small.compiler.packaged import packaged
atexit.register(lambda: open("told", "w").write(packaged.told()))
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The small package with its kernels compiled and packed; no cache."""
    small = Small(tmp_path_factory.mktemp("built"))
    small.run(PACK, NUMBA_CPU_NAME=LEVEL, NUMBA_CPU_FEATURES="")
    assert len(list((small.folder / "kernels").iterdir())) == len(CALLED) + 1  # and the index
    return small.folder / "kernels"


@pytest.fixture
def installed(built, tmp_path):
    """(the package in another place, the folder of its kernels)."""
    small = Small(tmp_path)
    return small, shutil.copytree(built, tmp_path / "small" / "compiler" / "kernels")


def change(folder, **entries):
    """Other entries of the index."""
    index = json.loads((folder / INDEX).read_text())
    (folder / INDEX).write_text(json.dumps(index | entries))
    return index


def ran(small, **environment):
    """What was compiled, and what was said of it."""
    value, names = small.run(TOLD, **environment)
    assert value == AS_IT_IS
    return names, (small.folder / "told").read_text()


def test_they_are_used_in_another_place_and_nothing_is_written(installed):
    small, folder = installed
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert ran(small) == ([], f"3 from the package ({LEVEL})")
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before and not small.files()
    assert not any(str(folder.parents[1]).encode() in content for content in before.values())


def test_no_place_of_the_build_is_in_them(built):
    assert all(str(built.parent).encode() not in path.read_bytes() for path in built.iterdir())


def test_what_is_damaged_or_cannot_be_loaded_is_compiled_and_counted(installed):
    small, folder = installed
    (heavy,) = folder.glob("small.physics.heavy._heavy-*")
    heavy.write_bytes(heavy.read_bytes()[:-1] + b"?")
    (heavier,) = folder.glob("small.physics.heavy._heavier-*")
    heavier.write_bytes(b"of somebody else")
    files = change(folder)["files"] | {heavier.name: hashlib.sha256(b"of somebody else").hexdigest()}
    change(folder, files=files)
    names, told = ran(small)
    assert {"_heavy", "_heavier"} <= set(names) and "run" not in names
    assert told == f"1 from the package ({LEVEL}), 2 compiled now, 2 of the package damaged and not used"
    assert ran(small)[0] == [], "from the disk then, and the package's as before"


def test_another_processor_compiles_its_own(installed):
    small, folder = installed
    change(folder, needs=["of-the-future"])
    names, told = ran(small)
    assert set(CALLED) < set(names)
    assert told.startswith(f"3 compiled now, those of the package not used: they are for {LEVEL}, here is ")
    assert told.endswith(" without of-the-future")


@pytest.mark.parametrize("program", ["numba", "llvmlite", "numpy", "Python", "sources of the compiler"])
def test_another_version_compiles_its_own(installed, program):
    _, folder = installed
    made = change(folder)["versions"]
    change(folder, versions=made | {program: "0"})
    other = Packaged(folder)
    assert not other.any() and other.refused == f"they are for {program} 0, here is {made[program]}"


def test_a_target_or_a_way_of_compiling_that_was_asked_for_is_kept_to(installed, monkeypatch):
    _, folder = installed
    assert Packaged(folder).any()
    monkeypatch.setenv("CABLE_SIM_KERNELS", "host")
    assert Packaged(folder).refused == "CABLE_SIM_KERNELS = host"
    monkeypatch.delenv("CABLE_SIM_KERNELS")
    change(folder, needs=["avx2"])
    monkeypatch.setattr(numba.config, "CPU_NAME", "nehalem")
    monkeypatch.setattr(numba.config, "CPU_FEATURES", "")
    monkeypatch.setattr(cpu_target.target_context.codegen(), "_tm_features", "")
    assert Packaged(folder).refused == f"they are for {LEVEL}, here is nehalem without avx2"


@pytest.mark.parametrize("text", ["", "[]", '{"files": {}}', "\x00"])
def test_a_damaged_index_is_none(installed, text):
    _, folder = installed
    (folder / INDEX).write_text(text)
    other = Packaged(folder)
    assert not other.any() and other.refused == "their index is damaged" and other.damaged == {INDEX}


def test_without_any_nothing_is_said(tmp_path):
    none = Packaged(tmp_path)
    assert not none.any() and not none.refused and "package" not in none.ahead() + none.told()


def test_a_checkout_has_none():
    assert not packaged.packaged.folder.exists()
