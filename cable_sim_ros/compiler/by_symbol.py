"""Calls by symbol: each heavy kernel has one compiled version, which its callers know by name.

Every compiled function is optimised anew inside each compiled function that calls it, so depth costs compile time. The
heavy kernels are therefore called through :func:`opaque`: by symbol, without being linked into the caller. A caller
needs to know what they return, not their code, so that all of them can be compiled at the same time. The symbol is that
of a cell with the address, so that what a scene has no use for is compiled for the first scene that has.
"""

from __future__ import annotations

import ctypes
import threading
from typing import Any, NamedTuple

import llvmlite.binding
import llvmlite.ir
import numba
from numba.core import cgutils, types
from numba.extending import intrinsic

from .kernel_form import Kernel, WrongCall, ask
from .kernel_reference import by_reference as _by_reference
from .kernel_reference import handed, referred

try:  # types as bytes, 300 times faster than typeof: 8 us instead of 2.3 ms for model and state
    from numba._dispatcher import compute_fingerprint as fingerprint
except ImportError:
    fingerprint = numba.typeof

RESULTS = {"float": types.float64, "int": types.int64, "bool": types.boolean, "None": types.none}  # by annotation


if tuple(int(x) for x in numba.__version__.split(".")[:2]) < (0, 65):  # an older one aborts inside LLVM
    raise ImportError(
        f"numba {numba.__version__} is too old for the kernels' calls by symbol; nothing was compiled. "
        f"Install numba >= 0.65"
    )

# No function here makes an array or hands one to Python, so views need no reference counts: atomic, 5 ns each. It must
# hold for all of them: a caller that counts would free what a callee that does not returns.
_options = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}


def _compiler(**options):
    """A decorator like numba.njit(**options) under which literal arguments do not compile versions of their own."""
    all_options = {"nopython": True, **_options, **options}

    def compiled(function):
        return function if numba.config.DISABLE_JIT else Kernel(function, {}, all_options)

    return compiled


inline = _compiler(forceinline=True)  # physics: scalars and tuples in and out
driver = _compiler(nogil=True)  # arrays and lane loops
by_reference = (lambda value: value) if numba.config.DISABLE_JIT else _by_reference


_opaque: dict = {}  # symbol: the function that it stands for
_published: dict = {}  # symbol: types of the version that was published
_linked: set = set()  # what was asked for, by function and fingerprint of its arguments
_cells: dict[str, ctypes.c_size_t] = {}  # symbol: where its callers find the address of its code


@driver
def not_linked():
    """What stands in every cell before its kernel does: one address serves calls with any arguments."""
    raise RuntimeError("a kernel was called that was linked as not needed: its linker and its caller do not agree")


def symbol_of(dispatcher) -> str:
    """Name under which a function's code is published: that of its module and its own, unique in the process."""
    function = getattr(dispatcher, "py_func", dispatcher)  # without compilation it is the function itself
    return f"{function.__module__}.{function.__qualname__}"


def _claimed(dispatcher) -> str:
    """The symbol of a function, which no other has. Raises ValueError."""
    symbol = symbol_of(dispatcher)
    if _opaque.setdefault(symbol, dispatcher) is not dispatcher:
        raise ValueError(
            f"two functions are called {symbol}: callers of one would run the code of the other, so the second was "
            f"refused. Give it a name of its own in its module"
        )
    return symbol


def _cell(symbol: str) -> ctypes.c_size_t:
    """The cell of a symbol, which JIT code finds by that name."""
    if symbol not in _cells:
        _cells[symbol] = ctypes.c_size_t(0)
        llvmlite.binding.add_symbol(symbol, ctypes.addressof(_cells[symbol]))
    return _cells[symbol]


def _address(form, types: tuple) -> int:
    """Compile a form, or load it, for these types: the address of its code."""
    form.compile(types)
    compiled = form.overloads[types]
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def returned_by(dispatcher) -> Any:
    """The numba type of what a function says it returns, None: it does not say. Raises TypeError.

    A number, or a tuple of numbers: ``-> float``, ``-> tuple[int, int, float]``.
    """
    said = dispatcher.py_func.__annotations__.get("return", "")
    if said == "":
        return None
    said = said if isinstance(said, str) else getattr(said, "__name__", str(said))
    inside = said.removeprefix("tuple[").removesuffix("]").split(", ") if said.startswith("tuple[") else [said]
    if not set(inside) <= set(RESULTS):
        raise TypeError(
            f"{symbol_of(dispatcher)} is called by symbol and says that it returns {said}, known are "
            f"{', '.join(RESULTS)} and tuples of them; no caller was compiled. Say one of these, or nothing"
        )
    kinds = [RESULTS[name] for name in inside]
    return types.Tuple(kinds) if said.startswith("tuple[") else kinds[0]


def opaque(dispatcher):
    """A function that calls ``dispatcher``'s one compiled version by symbol, for use inside compiled functions.

    Its code is neither copied into the caller nor optimised again there. ``link`` must have been called with arguments
    of the types in use before a caller runs. Where the function says what it returns, callers are compiled without it.
    Without compilation it is the function itself. Raises ValueError where another function has the name of this one in
    its module.
    """
    symbol = _claimed(dispatcher)
    if numba.config.DISABLE_JIT:
        return dispatcher
    _cell(symbol)
    said = returned_by(dispatcher)

    def build(args):
        given = tuple(numba.types.unliteral(a) for a in args)
        types = tuple(referred(a) for a in given)
        result = said
        if result is None:
            form = _published_form(dispatcher)
            form.compile(types)
            result = form.overloads[types].signature.return_type
        ask(symbol, types, result)
        if _published.get(symbol, types) != types:
            raise WrongCall(
                f"{symbol} is published for {_published[symbol]} and called with {types}: by symbol there is one "
                f"version, so the caller was refused. Coerce the arguments where they are made"
            )

        def code(context, builder, signature, values):
            kind = context.call_conv.get_function_type(signature.return_type, types)
            cell = builder.module.globals.get(symbol)
            if cell is None:
                cell = llvmlite.ir.GlobalVariable(builder.module, kind.as_pointer(), symbol)
            function = builder.load(cell)
            values = [handed(context, builder, a, value) for a, value in zip(given, values, strict=True)]
            status, value = context.call_conv.call_function(builder, function, signature.return_type, types, values)
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return value

        return result(*given), code

    names = ", ".join(dispatcher.py_func.__code__.co_varnames[: dispatcher.py_func.__code__.co_argcount])
    namespace = {"build": build}  # an intrinsic needs its parameters by name
    exec(f"def call(typing_context, {names}):\n    return build(({names},))", namespace)
    call = intrinsic(namespace["call"])
    call.called_by_symbol = symbol, said, dispatcher
    return call


def _published_form(dispatcher):
    return getattr(dispatcher, "published", dispatcher)


class Task(NamedTuple):
    """What link was asked for: to compile the form for these types, and to publish it."""

    dispatcher: Any
    form: Any
    types: tuple
    key: tuple


_planning = threading.local()  # tasks: what link was asked for in this thread, while it plans


def planned(linker, *parts) -> list[Task]:
    """What ``linker(*parts)`` will publish and has not yet, in its order: to be compiled anywhere, then published."""
    tasks: list[Task] = []
    outer = getattr(_planning, "tasks", None)  # a linker may be what compiles first, see ahead()
    _planning.tasks = tasks
    try:
        linker(*parts)
    finally:
        _planning.tasks = outer
    return tasks


def link(dispatcher, *args, needed: bool = True) -> None:
    """Compile ``dispatcher`` for these arguments (or load it from the cache) and publish its address for opaque().

    Where it is not needed, callers find one that raises, until it is.
    Raises ValueError where it has no name of its own, TypeError where it was published for other types, is called with
    others or returns something else than it says: callers by symbol would run that version.
    """
    if numba.config.DISABLE_JIT:
        return
    if not needed:
        if not (cell := _cell(_claimed(dispatcher))).value:
            cell.value = _address(_published_form(not_linked), ())
        return
    key = dispatcher, fingerprint(args)
    if key in _linked:  # not: compiled, a direct call compiles without publishing
        return
    task = Task(dispatcher, _published_form(dispatcher), tuple(referred(numba.typeof(a)) for a in args), key)
    tasks = getattr(_planning, "tasks", None)
    if tasks is None:
        publish(task)
    else:
        tasks.append(task)


def publish(task: Task) -> None:
    """Do what link was asked for."""
    dispatcher, form, types, key = task
    symbol = _claimed(dispatcher)
    if _published.setdefault(symbol, types) != types:
        raise TypeError(
            f"{symbol} is published for {_published[symbol]} and was linked for {types}: what calls it by symbol knows "
            f"one version, so the second was refused. Coerce the arguments where they are made"
        )
    address = _address(form, types)
    result = form.overloads[types].signature.return_type
    if returned_by(dispatcher) not in (None, result):
        raise TypeError(
            f"{symbol} returns {result} and says {returned_by(dispatcher)}: what calls it by symbol would misread it, "
            f"so it was not published. Correct what stands behind -> in its first line"
        )
    ask(symbol, types, result)
    _cell(symbol).value = address
    _linked.add(key)
