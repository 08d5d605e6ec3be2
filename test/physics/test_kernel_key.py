"""The hash of what a kernel is made of: it changes with all that the code depends on, and with nothing else."""

import dis
import enum
import os
import pkgutil
import textwrap
import time
import types
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest
from llvmlite.binding import ffi
from numba.core.compiler import run_frontend
from numba.core.compiler_lock import global_compiler_lock
from numba.core.postproc import PostProcessor
from numba.core.registry import cpu_target
from numba.core.serialize import dumps
from numba.extending import intrinsic

import cable_sim_ros.physics
from cable_sim_ros.compiler import by_symbol, kernel_cache, kernel_key, shortcuts
from cable_sim_ros.compiler.kernel_cache import KernelFiles, sweep
from cable_sim_ros.compiler.kernel_form import Kernel
from cable_sim_ros.compiler.kernel_key import UnknownContent, changed, content_of, functions_of, spell, type_text

pytestmark = pytest.mark.check

compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="needs compilation")


class Law(enum.IntEnum):
    ONE = 1


class Other(enum.IntEnum):
    ONE = 2


class Pair(NamedTuple):
    first: float
    second: float


class Turned(NamedTuple):
    second: float
    first: float


def test_values_that_differ_are_spelled_differently():
    values = [0, 0.0, -0.0, False, None, "0", b"0", 1, 1.0, True, np.float64(1.0), np.float32(1.0), np.int64(1), 1j]
    values += [(1, 2), [1, 2], {1: 2}, {1, 2}, Pair(1, 2), Turned(1, 2), Law.ONE, Other.ONE, Law, Other, Pair, Turned]
    values += [np.array([1.0, 2.0]), np.array([[1.0, 2.0]]), np.array([1.0, 3.0]), np.array([1, 2]), np.ones((2, 2)).T]
    values += [np.dtype([("a", "f8"), ("b", "f8")]), np.dtype([("b", "f8"), ("a", "f8")]), np.dtype("f8"), float("nan")]
    values += [np.dtype([("a", "i1"), ("b", "f8")]), np.dtype([("a", "i1"), ("b", "f8")], align=True), np.dtype("f4")]
    values += [
        np.dtype([("a", "f8", 2)]),
        np.dtype([("a", "f8", (2, 1))]),
        numba.float64,
        numba.int64,
        abs,
        min,
        np.sqrt,
    ]
    values += [0.1, 0.1 + 2.0**-56, ValueError, TypeError, np, range(2).__class__]
    texts = [spell(value, []) for value in values]
    assert len(set(texts)) == len(texts)
    assert texts == [spell(value, []) for value in values]


class Unknown:
    pass


UNTOLD = {
    "instance": Unknown(),
    "class": Unknown,
    "object": object(),
    "module": os,
    "file": open(os.devnull),
    "array of objects": np.array([None]),
}


@pytest.mark.parametrize("value", UNTOLD.values(), ids=UNTOLD)
def test_what_cannot_be_told_is_refused(value):
    with pytest.raises(UnknownContent):
        spell(value, [])


def kernel(source: str, **names) -> Kernel:
    """A kernel of this source, in a module of its own with these names."""
    space = {"__name__": "kernels_of_a_test", **names}
    exec(textwrap.dedent(source), space)
    return Kernel(space["f"], {}, {"nopython": True})


PLAIN = """
def f(x):
    '''What it does.'''
    return N * x
"""


def content(*args, **names) -> str:
    return content_of(kernel(*args, **names))[0]


@compiled
def test_the_content_of_a_function():
    same = [PLAIN, PLAIN.replace("What", "All that"), PLAIN.replace("x):", "x):  # of x\n    # twice\n"), "\n" + PLAIN]
    assert len({content(source, N=2.0) for source in same}) == 1
    other = [PLAIN.replace("N * x", "x * N"), PLAIN.replace("(x)", "(x, y=1)"), PLAIN.replace("(x)", "(x, y=2)")]
    other += [PLAIN.replace("N *", "2.0 *"), PLAIN.replace("N * x", "N * (lambda y: y + 1)(x)")]
    other += [PLAIN.replace("N * x", "N * (lambda y: y + 2)(x)"), PLAIN.replace("N * x", "'What it does.'")]
    found = {content(source, N=2.0) for source in [PLAIN, *other]} | {content(PLAIN, N=3.0), content(PLAIN, N=2)}
    assert len(found) == len(other) + 3


@compiled
def test_a_docstring_that_the_code_returns_counts():
    source = "def f(x):\n    'one'\n    return 'one'\n"
    assert content(source) != content(source.replace("one", "two"))


@compiled
def test_what_a_function_calls_counts_as_deep_as_it_goes():
    def nest(n, way):
        inner = kernel("def f(x):\n    return N * x\n", N=n)
        middle = kernel("def f(x):\n    return g(x)\n", g=inner)
        return kernel("def f(x):\n    return h(x)\n", h=middle if way == "kernel" else numba.njit(middle.py_func))

    for way in ("kernel", "numba"):
        assert content_of(nest(1.0, way)) == content_of(nest(1.0, way)) != content_of(nest(2.0, way))
    assert len(functions_of(nest(1.0, "kernel"))) == 3


@compiled
def test_a_function_that_calls_itself_has_a_content():
    def circle(n):
        one = kernel("def f(x):\n    return g(x) if x > N else x\n", N=n)
        other = kernel("def f(x):\n    return g(x - 1)\n", g=one)
        one.py_func.__globals__["g"] = other
        return one

    assert content_of(circle(1)) == content_of(circle(1)) != content_of(circle(2))


@compiled
def test_what_an_intrinsic_is_made_of_counts():
    def of_width(width):
        @intrinsic
        def wide(typing_context, x):
            return x(x), lambda context, builder, signature, args: width

        return kernel("def f(x):\n    return wide(x)\n", wide=wide)

    assert content_of(of_width(1)) == content_of(of_width(1)) != content_of(of_width(2))


@compiled
def test_a_kernel_of_unknown_content_runs_and_is_not_kept(tmp_path, monkeypatch):
    one = kernel("def f(x):\n    return x + 1 if N is None else x\n", N=Unknown)
    for form in (one, one.called):
        monkeypatch.setattr(form._cache, "files", KernelFiles([tmp_path / "kernels"]))
    with pytest.warns(
        numba.core.errors.NumbaWarning, match=r"kernels_of_a_test\.f is not kept on disk .*N = the class"
    ):
        assert one._cache.key((numba.int64,)) is None
    assert not one._cache.lacks((numba.int64,)), "it would be compiled ahead for nothing"
    known = kernel("def f(x):\n    return x + 1\n")
    monkeypatch.setattr(known._cache, "files", KernelFiles([tmp_path / "kernels"]))
    assert known(1) == 2 and len(list(tmp_path.rglob("*.entry"))) == 1


@compiled
def test_a_function_for_which_another_is_registered_has_no_known_content():
    """numba.extending.overload: what is compiled in its place stands nowhere in the caller."""

    def plain(x):
        return x

    with pytest.raises(UnknownContent, match=r"kernels_of_a_test\.f: g = a function that is not compiled"):
        content("def f(x):\n    return g(x)\n", g=plain)
    assert content("def f(x):\n    return x.g\n", g=plain)  # of an attribute that has its name


@compiled
def test_a_number_replaced_in_the_process_is_seen():
    one = kernel(PLAIN, N=2.0)
    before = content_of(one)
    assert not changed(one)
    one.py_func.__globals__["N"] = 3.0
    assert content_of(one) != before and changed(one)


@compiled
def test_an_array_written_in_place_is_seen():
    table = np.ones(2)
    one = kernel("def f(i):\n    return T[i]\n", T=table)
    before = content_of(one)
    table[1] = 2.0
    assert content_of(one) != before


def test_types_are_told_apart_by_their_fields():
    kinds = [numba.typeof(Pair(1.0, 2.0)), numba.typeof(Turned(1.0, 2.0)), numba.typeof((1.0, 2.0))]
    kinds += [numba.typeof(Pair(1.0, 2)), numba.typeof((Pair(1.0, 2.0), 1)), numba.typeof((Turned(1.0, 2.0), 1))]
    for fields in ([("a", "f8"), ("b", "f8")], [("b", "f8"), ("a", "f8")], [("a", "f8"), ("c", "f8")]):
        kinds.append(numba.typeof(np.zeros(1, fields)))
    kinds += [numba.typeof(np.zeros(1)), numba.typeof(np.zeros((1, 1))), numba.typeof(np.zeros((2, 2))[:, 0])]
    locked = np.zeros(1)
    locked.flags.writeable = False
    texts = [type_text(kind) for kind in [*kinds, numba.typeof(locked)]]
    assert len(set(texts)) == len(texts)


@compiled
def test_every_kernel_of_the_product_has_a_known_content():
    from cable_sim_ros.sim import loop
    from cable_sim_ros.sim.rig import rig_entries

    modules = [
        import_module(f"cable_sim_ros.physics.{m.name}") for m in pkgutil.iter_modules(cable_sim_ros.physics.__path__)
    ]
    kernels = {id(v): v for m in (*modules, loop, rig_entries) for v in vars(m).values() if isinstance(v, Kernel)}
    contents = {content_of(kernel)[0] for kernel in kernels.values()}
    assert len(contents) == len(kernels) > 300


def test_every_source_that_compiles_is_part_of_every_key():
    names = {p.name for p in kernel_key.HERE.glob("kernel_*.py")} | {"by_symbol.py"}
    assert names == set(kernel_key.COMPILERS)


def test_files_unused_for_a_month_are_removed(tmp_path):
    files = KernelFiles([tmp_path / "kernels"])
    for name in ("new", "old"):
        assert files.write(name, name.encode())
    (tmp_path / "kernels" / ".part").write_text("of a writer that died")
    (tmp_path / "0123456789abcdef" / "a").mkdir(parents=True)  # of numba's
    (tmp_path / "not ours").mkdir()
    now = time.time()
    os.utime(tmp_path / "kernels" / "old", (now - 31 * 86400,) * 2)
    sweep(tmp_path / "kernels", now)
    assert files.read("new") == b"new" and files.read("old") is None and (tmp_path / "0123456789abcdef").exists()
    sweep(tmp_path / "kernels", now + 2 * 86400)
    assert sorted(p.name for p in (tmp_path / "kernels").iterdir()) == ["new"]
    sweep(tmp_path / "kernels", now + 31 * 86400)
    assert not list((tmp_path / "kernels").iterdir())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["kernels", "not ours"]


def test_the_oldest_files_are_removed_beyond_the_limit(tmp_path, monkeypatch):
    files, now = KernelFiles([tmp_path]), time.time()
    for age in range(5):
        files.write(str(age), bytes(1000))
        os.utime(tmp_path / str(age), (now - 60 * age,) * 2)
    monkeypatch.setattr(kernel_cache, "MAX_BYTES", 3500)
    sweep(tmp_path, now)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["0", "1", "2"]


def test_a_file_that_is_used_is_marked_so_once_a_day(tmp_path):
    files, now = KernelFiles([tmp_path]), time.time()
    files.write("a", b"a")
    os.utime(tmp_path / "a", (now - 2 * 86400,) * 2)
    files.read("a")
    assert now - (tmp_path / "a").stat().st_mtime < 3600


def test_a_folder_of_somebody_else_is_not_read(tmp_path, monkeypatch):
    files = KernelFiles([tmp_path])
    assert files.write("a", b"a") and files.read("a") == b"a"
    monkeypatch.setattr(kernel_cache, "_own", lambda folder: False)
    assert files.read("a") is None and not files.write("b", b"b") and not files.writable()


def codes(code):
    """A code and all within it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from codes(constant)


@pytest.mark.parametrize("module", [kernel_key, kernel_cache, textwrap, dis], ids=lambda module: module.__name__)
def test_a_docstring_is_told_from_a_text_that_is_used(module):
    text = Path(module.__file__).read_text("utf-8")
    seen = []
    for code in codes(compile(text, "a", "exec")):
        used = any(s.arg == 0 for s in dis.get_instructions(code) if s.opcode in dis.hasconst)
        assert kernel_key._loads_first(code) == used, code
        seen.append(used)
    assert set(seen) == {True, False}


@compiled
def test_equal_records_of_another_alignment_have_a_type_of_their_own():
    fields = {"names": ["a", "b"], "formats": ["f8", "f8"], "offsets": [0, 8], "itemsize": 16}
    packed, aligned = np.dtype(fields), np.dtype(fields, align=True)
    assert packed == aligned
    with global_compiler_lock, shortcuts.shortened():
        made = [numba.from_dtype(kind) for kind in (packed, aligned, packed)]
    assert [kind.aligned for kind in made] == [False, True, False] and made[0] is made[2]
    assert made[:2] == [shortcuts._type_of_record(kind) for kind in (packed, aligned)]


def _branches(n):
    total = 0
    for i in range(n):
        total = total + i if i % 2 else total - i
    return total


@pytest.mark.parametrize("emit_dels", [False, True])
def test_variables_are_deleted_where_numba_says(emit_dels):
    texts = []
    for run in (shortcuts._process, shortcuts.process):
        function = run_frontend(_branches)
        run(PostProcessor(function), emit_dels=emit_dels)
        texts.append(function.dump_to_string())
    assert texts[0] == texts[1] and ("del " in texts[0]) == emit_dels


@compiled
def test_what_users_compile_numba_compiles_as_it_is():
    """They declared their functions before ours were compiled, and pickle types that ours have used."""

    @numba.njit("float64(float64[:])")
    def total(x):
        return x.sum()

    timers = list(ffi.lib._lock._cblist)
    kind = cpu_target.typing_context.resolve_value_type(np.sin)

    @by_symbol.driver
    def ours(x):
        return np.sin(x[0]) + x[0]

    with global_compiler_lock, shortcuts.shortened():
        with shortcuts.shortened():
            pass
        seen = [getattr(where, name) is ours for where, name, ours in shortcuts.PLACES]
        assert all(seen) and not ffi.lib._lock._cblist
    assert ours(np.zeros(1)) == 0.0 and total(np.ones(3)) == 3.0 and total.nopython_signatures
    assert not any(getattr(where, name) is ours for where, name, ours in shortcuts.PLACES)
    assert ffi.lib._lock._cblist == timers and dumps(kind)


@compiled
def test_a_plain_array_has_no_array_of_its_own():
    kind = numba.typeof(np.zeros((1, 1)))
    signature = numba.core.typing.signature(kind, kind)
    for find in (shortcuts._implementation, shortcuts.implementation):
        with pytest.raises(NotImplementedError):
            find(cpu_target.target_context, "__array__", signature)
