"""What the code of a kernel is made of, as one hash: its own bytecode and all that it refers to, in whatever file.

A kernel is what numba makes of a function, of every function that it calls, and of every number, array, record and enum
that these refer to by name. All of it is spelled out and hashed: comments, docstrings and line numbers are no part of
it, a constant in another file is. A function that is called by symbol is its symbol and what it returns, not its body.
What cannot be spelled has no hash: such a kernel is compiled in each process and never kept.
"""

from __future__ import annotations

import dis
import enum
import hashlib
import platform
import sys
import types as python
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import llvmlite.ir
import numba
import numpy as np
from numba.core import types
from numba.core.dispatcher import Dispatcher

from .kernel_reference import Reference, by_reference

# what stands in these is of their versions, which are in every key
LIBRARIES = {"builtins", "math", "cmath", "operator", "numpy", "numba", "llvmlite", "functools", "itertools"}
HERE = Path(__file__).parent
COMPILERS = ("by_symbol.py", *(f"kernel_{name}.py" for name in ("form", "key", "cache", "reference")))  # in every key
CONFIG = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "ENABLE_AVX", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "DEBUG_NRT")
DOCSTRING = 0x4000000  # flag of a code object in Python 3.13: it has one
PYTHON = "python"  # in place of options: called while compiling, not compiled
INTRINSIC = "intrinsic"
_PLAIN = {bool, int, str, bytes, complex, type(None), type(Ellipsis)}


class UnknownContent(Exception):
    """The value has no spelling that is sure to change with it."""


class _Called(NamedTuple):
    """A function whose content is part of that of another, and how it is compiled."""

    function: Callable
    options: str


class _Own(NamedTuple):
    """A function by itself: its text, the functions that it refers to, and the values that the text was made from."""

    text: str
    called: list[_Called]
    seen: list[tuple[dict, str, Any]]
    code: python.CodeType
    size: int


_kept: dict[tuple[int, str], tuple[Callable, _Own]] = {}
_changed: set[int] = set()
_texts: dict[types.Type, str] = {}


def versions() -> dict[str, str]:
    """All that every key depends on beside the function: programs, their options, and the sources that compile.

    Of Python the minor version and its build's kind, which bytecode and wrappers depend on; of numpy the minor one,
    which numba asks for.
    """
    digest = hashlib.sha256()
    for name in COMPILERS:
        digest.update((HERE / name).read_bytes())
    return {
        "numba": numba.__version__,
        "llvmlite": llvmlite.__version__,
        "numpy": ".".join(np.__version__.split(".")[:2]),
        "Python": f"{sys.implementation.cache_tag}{sys.abiflags}",
        "machine": platform.machine(),
        **{name: str(getattr(numba.config, name, None)) for name in CONFIG},
        "sources of the compiler": digest.hexdigest(),
    }


def type_text(kind: types.Type) -> str:
    """A numba type in full: the fields of its named tuples too, which its own name leaves out."""
    if kind not in _texts:
        if isinstance(kind, types.BaseNamedTuple):
            cls = kind.instance_class
            fields = zip(kind.fields, kind.types, strict=True)
            inside = ", ".join(f"{name}: {type_text(part)}" for name, part in fields)
            _texts[kind] = f"{cls.__module__}.{cls.__qualname__}({inside})"
        elif isinstance(kind, Reference):
            _texts[kind] = f"reference {type_text(kind.tuple_type)}"
        elif isinstance(kind, types.BaseTuple):
            _texts[kind] = f"{kind}[{', '.join(type_text(part) for part in kind.types)}]"
        else:
            _texts[kind] = f"{type(kind).__name__} {kind}"
    return _texts[kind]


def content_of(dispatcher: Any) -> tuple[str, int]:
    """Hash of all that the code of ``dispatcher`` is made of, and the bytes of bytecode in it.

    Raises UnknownContent with the name of what cannot be spelled.
    """
    first = _called(dispatcher)
    order, queue = {(id(first.function), first.options): 0}, [first]
    digest, size = hashlib.sha256(), 0
    for called in queue:  # grows
        own = _own(called)
        size += own.size
        digest.update(own.text.encode())
        for other in own.called:
            key = id(other.function), other.options
            if key not in order:
                order[key] = len(queue)
                queue.append(other)
            digest.update(b"#%d" % order[key])
    return digest.hexdigest(), size


def functions_of(dispatcher: Any) -> list[Callable]:
    """The Python functions whose content is part of that of ``dispatcher``, itself the first."""
    queue = [_called(dispatcher)]
    for called in queue:  # grows
        queue += [other for other in dict.fromkeys(_own(called).called) if other not in queue]
    return [called.function for called in queue]


def changed(dispatcher: Any) -> bool:
    """Did what one of its functions refers to change in this process? Other kernels may hold code from before."""
    return bool(_changed) and any(id(function) in _changed for function in functions_of(dispatcher))


def _called(dispatcher: Any) -> _Called:
    left_out = "no_cpython_wrapper"  # of the form, not of the content
    options = {
        name: value for name, value in dispatcher.targetoptions.items() if value is not None and name != left_out
    }
    return _Called(dispatcher.py_func, repr(sorted(options.items())))


def _own(called: _Called) -> _Own:
    """The function by itself, kept as long as it and what it names are the same objects."""
    key = id(called.function), called.options
    if key in _kept:
        function, own = _kept[key]
        if function is called.function and own.code is function.__code__:
            if all(space.get(name, _own) is value for space, name, value in own.seen):
                return own
    own = _spelled(called)
    if key in _kept and _kept[key][1].text != own.text:
        _changed.add(key[0])
    _kept[key] = called.function, own
    return own


def _spelled(called: _Called) -> _Own:
    function, compiled = called.function, not called.options.startswith((PYTHON, INTRINSIC))
    calls: list[_Called] = []
    seen: list[tuple[dict, str, Any]] = []
    builtins = vars(__import__("builtins"))
    words = [function.__module__ or "", function.__qualname__, called.options]

    def names(code: python.CodeType) -> int:
        size = len(code.co_code)
        words.append(code.co_code.hex())
        words.append(repr((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars, code.co_argcount)))
        words.append(repr((code.co_flags & ~DOCSTRING, code.co_kwonlyargcount, code.co_posonlyargcount)))
        words.append(getattr(code, "co_exceptiontable", b"").hex())
        for i, value in enumerate(code.co_consts):
            if isinstance(value, python.CodeType):
                size += names(value)
            elif not (i == 0 and isinstance(value, str) and not _loads_first(code)):  # a docstring
                words.append(spell(value, calls))
        for name in code.co_names:  # of attributes too: more than it takes does no harm
            space = function.__globals__ if name in function.__globals__ else builtins
            value = space.get(name, _own)
            if value is _own:
                continue
            try:
                words.append(f"{name}={spell(value, calls)}")
                if (
                    compiled and isinstance(value, python.FunctionType) and _Called(value, PYTHON) in calls
                ):  # what stands for it is registered
                    raise UnknownContent("a function that is not compiled")
            except UnknownContent as unknown:
                if name in {s.argval for s in dis.get_instructions(code) if s.opname in ("LOAD_GLOBAL", "LOAD_NAME")}:
                    raise UnknownContent(f"{function.__module__}.{function.__qualname__}: {name} = {unknown}") from None
            if not isinstance(value, np.ndarray):
                seen.append((space, name, value))
            else:  # may be written in place: never the same
                seen.append((space, name, seen))
        return size

    size = names(function.__code__)
    for values in (function.__defaults__ or (), tuple((function.__kwdefaults__ or {}).items())):
        words.append(spell(values, calls))
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            words.append(f"{name}={spell(cell.cell_contents, calls)}")
        except UnknownContent as unknown:
            raise UnknownContent(f"{function.__module__}.{function.__qualname__}: {name} = {unknown}") from None
        seen.append(({"cell": cell.cell_contents}, "cell", cell.cell_contents))
    return _Own("\0".join(words), calls, seen, function.__code__, size)


def _loads_first(code: python.CodeType) -> bool:
    """Does the code use the first of its constants? Its instructions are pairs; larger arguments have one before."""
    kinds, arguments = code.co_code[::2], code.co_code[1::2]
    pairs = zip(bytes(1) + kinds, kinds, arguments)
    return any(kind in dis.hasconst and not arg and before != dis.EXTENDED_ARG for before, kind, arg in pairs)


def _root(value: Any) -> str:
    return str(getattr(value, "__module__", None) or "").partition(".")[0]


def _class(cls: type) -> str:
    name = f"{cls.__module__}.{cls.__qualname__}"
    if _root(cls) in LIBRARIES or issubclass(cls, BaseException):
        return name
    if issubclass(cls, enum.Enum):
        return f"{name}{[(m.name, spell(m.value, [])) for m in cls.__members__.values()]}"
    if issubclass(cls, tuple) and hasattr(cls, "_fields"):
        return f"{name}{cls._fields}{spell(cls._field_defaults, [])}"
    raise UnknownContent(f"the class {name}")


def spell(value: Any, calls: list[_Called]) -> str:
    """The value as text that differs for values that differ; functions in it are added to ``calls``.

    Raises UnknownContent.
    """
    kind = type(value)
    if kind in _PLAIN:
        return f"{kind.__name__} {value!r}"
    if kind is float:
        return f"float {value.hex()}"
    if isinstance(value, enum.Enum):
        return f"{_class(kind)}.{value.name}"
    if isinstance(value, np.dtype):
        return _dtype(value)
    if isinstance(value, np.ndarray | np.generic):
        if value.dtype.hasobject:
            raise UnknownContent("an array of objects")
        table = np.asarray(value)
        data = hashlib.sha256(table.tobytes()).hexdigest()
        return f"{kind.__name__} {_dtype(table.dtype)} {table.shape} {table.strides} {data}"
    if isinstance(value, tuple | list):
        name = kind.__name__ if kind in (tuple, list) else _class(kind)
        return f"{name}[{', '.join(spell(item, calls) for item in value)}]"
    if kind is dict:
        return f"dict[{', '.join(f'{spell(k, calls)}: {spell(v, calls)}' for k, v in value.items())}]"
    if kind in (set, frozenset):
        return f"set{sorted(spell(item, calls) for item in value)}"
    if isinstance(value, types.ExternalFunction):
        return f"external {value.symbol} {value.sig}"
    if isinstance(value, types.Type):
        return f"type {type_text(value)}"
    if isinstance(value, llvmlite.ir.Type | llvmlite.ir.Constant):
        return f"llvm {value}"
    return _callable(value, calls)


def _callable(value: Any, calls: list[_Called]) -> str:
    if value is by_reference:  # COMPILERS
        return "by reference"
    by_symbol = getattr(value, "called_by_symbol", None)
    if by_symbol is not None:
        symbol, returns, dispatcher = by_symbol
        if returns is not None:
            return f"symbol {symbol} {type_text(returns)}"
        calls.append(_called(dispatcher))
        return f"symbol {symbol}"
    if isinstance(value, Dispatcher):
        calls.append(_called(value))
        return "kernel"
    if isinstance(value, numba.extending._Intrinsic):
        options = value._prefer_literal, sorted(value._ctor_kwargs.items())
        calls.append(_Called(value._defn, f"{INTRINSIC} {options}"))
        return "intrinsic"
    if isinstance(value, python.ModuleType) and value.__name__.partition(".")[0] in LIBRARIES:
        return f"module {value.__name__}"
    if isinstance(value, np.ufunc):
        return f"ufunc {value.__name__}"
    if isinstance(value, type):
        return f"class {_class(value)}"
    if callable(value) and _root(value) in LIBRARIES and hasattr(value, "__qualname__"):
        return f"{value.__module__}.{value.__qualname__}"
    if isinstance(value, python.FunctionType):
        calls.append(_Called(value, PYTHON))
        return "function"
    raise UnknownContent(f"{value!r:.80} of type {type(value).__name__}")


def _dtype(kind: np.dtype) -> str:
    if kind.subdtype is not None:
        return f"{_dtype(kind.subdtype[0])}{kind.subdtype[1]}"
    if kind.fields is None:
        return f"{kind.str}"
    fields = [(name, _dtype(kind.fields[name][0]), kind.fields[name][1]) for name in kind.names or ()]
    return f"record{fields} {kind.itemsize} {kind.isalignedstruct}"
