"""Calls by symbol: a symbol is one function and one version; what is compiled belongs to one processor."""

import inspect
from typing import NamedTuple

import numba
import numpy as np
import pytest

from cable_sim_ros.compiler.by_symbol import by_reference, driver, link, opaque, returned_by, symbol_of
from cable_sim_ros.compiler.kernel_form import asked
from cable_sim_ros.physics import contact

pytestmark = pytest.mark.check

compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="needs compilation")


def settle_of(factor: float, module: str, name: str = "_settle"):
    """A kernel as a file of its own would have it: ``factor`` times a number."""
    namespace = {"__name__": module}
    exec(f"def {name}(x):\n    return {factor} * x[0]", namespace)
    return numba.njit(error_model="numpy", nogil=True, _nrt=False)(namespace[name])


@compiled
def test_two_modules_may_give_their_functions_the_same_name():
    """Both were published as cable_sim_settle, and callers of the first ran the code of the second."""
    first, second = settle_of(2.0, "one"), settle_of(3.0, "two")
    by_first, by_second = opaque(first), opaque(second)

    @numba.njit
    def both(x):
        return by_first(x), by_second(x)

    x = np.ones(1)
    link(first, x)
    link(second, x)
    assert both(x) == (2.0, 3.0)
    assert {symbol_of(first), symbol_of(second)} == {"one._settle", "two._settle"}


def test_a_second_function_of_the_same_name_is_refused():
    first, second = settle_of(2.0, "three"), settle_of(3.0, "three")
    opaque(first)
    opaque(first)  # itself again
    with pytest.raises(ValueError, match=r"two functions are called three\._settle: callers of one .* Give it a name"):
        opaque(second)


@compiled
def test_a_second_version_of_a_function_is_refused():
    kernel = settle_of(2.0, "four")
    link(kernel, np.ones(1))
    link(kernel, np.zeros(2))  # of the same types
    with pytest.raises(TypeError, match=r"four\._settle is published for .* one version.*Coerce the arguments"):
        link(kernel, np.ones(1, np.float32))


@compiled
def test_what_is_not_needed_is_compiled_where_it_is():
    """A caller that was compiled before runs the kernel as soon as it is linked; until then it says what is wrong."""
    kernel = settle_of(2.0, "later")
    by_symbol = opaque(kernel)

    @numba.njit
    def caller(x):
        return by_symbol(x)

    x = np.ones(1)
    link(kernel, x, needed=False)
    with pytest.raises(RuntimeError, match="linked as not needed"):
        caller(x)
    link(kernel, x)
    assert caller(x) == 2.0
    link(kernel, x, needed=False)
    assert caller(x) == 2.0, "what one scene needs stays where the next does not"


def test_every_symbol_of_the_product_is_its_module_and_name():
    from cable_sim_ros.physics import integrate, substeps, tick

    for module, name in ((integrate, "_settle"), (integrate, "_newton"), (substeps, "_finish"), (tick, "_tick")):
        assert symbol_of(getattr(module, name)) == f"{module.__name__}.{name}"


@compiled
def test_what_is_kept_on_disk_is_of_this_processor(monkeypatch):
    """Two machines may share a home: the name of kept code has name and features of the processor for LLVM."""
    from numba.core.registry import cpu_target

    codegen = cpu_target.target_context.codegen()
    assert codegen.magic_tuple()[1:] == (codegen._get_host_cpu_name(), codegen._tm_features)
    keys = []
    for processor in (codegen.magic_tuple(), ("x86_64", "nehalem", ""), ("x86_64", "haswell", "")):
        monkeypatch.setattr(type(codegen), "magic_tuple", lambda self, processor=processor: processor)
        keys.append(contact.contact_lanes._cache.key((numba.float64,)))
    assert None not in keys and len(set(keys)) == 3


@compiled
def test_a_caller_with_other_types_than_those_published_is_refused():
    kernel = settle_of(2.0, "five")
    by_symbol = opaque(kernel)
    link(kernel, np.ones(1))

    @numba.njit
    def caller(x):
        return by_symbol(x)

    assert caller(np.ones(1)) == 2.0
    with pytest.raises(TypeError, match=r"five\._settle is called with .*float32.* by symbol there is one version"):
        caller(np.ones(1, np.float32))


@pytest.mark.parametrize("said, kind", [("float", "float64"), ("int", "int64"), ("bool", "bool"), ("None", "none")])
@compiled
def test_what_a_function_says_it_returns_is_what_its_callers_take(said, kind):
    namespace = {"__name__": "six"}
    exec(f"def _f(x) -> {said}:\n    return x", namespace)
    kernel = driver(namespace["_f"])
    assert str(returned_by(kernel)) == kind


@compiled
def test_what_no_caller_can_take_is_refused():
    namespace = {"__name__": "seven"}
    exec("def _f(x) -> list:\n    return x", namespace)
    with pytest.raises(TypeError, match=r"seven\._f .* says that it returns list, known are float, int, bool, None"):
        opaque(driver(namespace["_f"]))


class Inner(NamedTuple):
    row: np.ndarray
    factor: float


class Outer(NamedTuple):
    count: int
    table: np.ndarray
    inner: Inner


@compiled
def test_a_named_tuple_of_arrays_is_handed_over_as_one_word():
    namespace = {"__name__": "eight"}
    source = "def {}(x, i) -> float:\n    x.inner.row[i] += 1.0\n    return x.count * x.table[1, i] + {}"
    exec(source.format("_inside", "x.inner.factor * x.inner.row[i]"), namespace)
    exec(source.format("_outside", "x.table.shape[0] + inside(x, i)"), namespace)
    kernels = [numba.njit(_nrt=False)(namespace[name]) for name in ("_inside", "_outside")]
    namespace["inside"], outside = map(opaque, kernels)

    @numba.njit(_nrt=False)
    def entry(x, i):
        y = by_reference(x)
        return outside(x, i) + outside(y, i) + y.inner.row[i]

    given = Outer(3, np.arange(8.0).reshape(2, 4), Inner(np.array([5.0, 7.0]), 0.5))
    for kernel in kernels:
        link(kernel, given, 0)
        assert [str(kind).partition("(")[0] for kind in asked[symbol_of(kernel)][0]] == ["reference", "int64"]
    first, second = (15.0 + 2.0 + 15.0 + 0.5 * row for row in (9.0, 11.0))
    assert entry(given, 1) == first + second + 11.0 and list(given.inner.row) == [5.0, 11.0]


def test_kernels_are_compiled_without_leave_to_reorder():
    """Sums and products as they stand: what LLVM may contract or reorder depends on the processor."""
    assert "fastmath" not in inspect.getsource(inspect.getmodule(driver))
