"""Shortcuts in numba's compiler: the same code to the byte, in less time.

Typing the kernels asks for the type of an operation on scalars or arrays some 30 000 times, 900 of them different, and
each time numba tries all that it knows; flags are compared through a property an option, the variables of a statement
listed by a call for each of its parts; the type of a record is made anew for each array of them, and its
text from all its fields; which variables live is found after each pass, though only their deletion asks; each call
of LLVM is told to the timers of all functions being compiled. These answer at once what is known, and only while a
kernel of ours is compiled: what a user's program compiles in the same process, numba compiles as it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from llvmlite.binding import ffi
from numba.core import base, ir, transforms, types
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction
from numba.np import linalg, numpy_support

LEAVES = (str, int, float, bool, type(None), ir.Loc)
_defaults: dict[type, dict] = {}  # of the options of each kind of flags
KNOWN = (types.Number, types.Boolean, types.Array, types.BaseTuple, types.SliceType)
_type_of_call = BaseFunction.get_call_type
_process = PostProcessor.run
_implementation = base.BaseContext.get_function
_type_of_record = numpy_support.from_struct_dtype
_records: dict[tuple, Any] = {}
_calls: dict[tuple, Any] = {}


def type_of_call(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Signature of a function for these types, found once where it is one of numba's own, on scalars and arrays.

    What numba compiles for its arguments is asked for again: it may depend on flags.
    """
    if kws or not all(isinstance(kind, KNOWN) for kind in args):
        return _type_of_call(self, context, args, kws)
    key = self, context, tuple(args)
    if key not in _calls:
        signature = _type_of_call(self, context, args, kws)
        if signature is None or self._impl_keys.get(signature.args) is not self.typing_key:
            return signature
        _calls[key] = signature
    return _calls[key]


def values_of_flags(self: Any) -> dict:
    """All options by name, in their order."""
    if type(self) not in _defaults:
        _defaults[type(self)] = {name: option.default for name, option in self.options.items()}
    return {**_defaults[type(self)], **self._values}


def variables(self: Any, value: Any) -> list:
    """Variables in a value, in its order."""
    if isinstance(value, ir.Var):
        return [value]
    if isinstance(value, ir.Inst):
        return value.list_vars()
    found: list = []
    if isinstance(value, (dict, list, tuple)):
        for part in value.values() if isinstance(value, dict) else value:
            if type(part) is ir.Var:
                found.append(part)
            elif type(part) not in LEAVES:
                found.extend(variables(self, part))
    return found


def type_of_record(dtype: Any) -> Any:
    """numba's type of a structured dtype; two that are equal may differ in what was asked of their alignment."""
    key = dtype, dtype.isalignedstruct
    if key not in _records:
        _records[key] = _type_of_record(dtype)
    return _records[key]


def process(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Bring the blocks of a function in order; what is alive where is found when it is asked for."""
    function = self.func_ir
    if function.is_generator:
        _process(self, emit_dels, extend_lifetimes)
        return
    function.blocks = transforms.canonicalize_cfg(function.blocks)
    function.variable_lifetime = VariableLifetime(function.blocks)
    function.generator_info = None
    function.block_entry_vars = {}
    if emit_dels:
        self._insert_var_dels(extend_lifetimes=extend_lifetimes)


def implementation(self: Any, function: Any, signature: Any, _firstcall: bool = True) -> Any:
    """What makes the code of a call; that plain arrays have no `__array__` of their own is asked at each of them."""
    if function == "__array__" and not self._defns[function].versions:
        raise NotImplementedError(function)
    return _implementation(self, function, signature, _firstcall)


def _nothing() -> None:
    """In place of a look for BLAS as numba.np is loaded: a fifth of a second for scipy.linalg."""


PLACES: tuple[tuple[Any, str, Any], ...] = (
    (BaseFunction, "get_call_type", type_of_call),
    (TargetConfig, "values", values_of_flags),
    (ir.Inst, "_rec_list_vars", variables),
    (numpy_support, "from_struct_dtype", type_of_record),
    (types.Record, "__repr__", lambda self: self.name),
    (PostProcessor, "run", process),
    (base.BaseContext, "get_function", implementation),
    (base, "_has_loc", cache(base._has_loc)),
    (linalg, "ensure_blas", _nothing),
)
_within = False


@contextmanager
def shortened() -> Iterator[None]:
    """numba with the shortcuts, by whoever holds its compiler lock; one within the other is one."""
    global _within
    if _within:
        yield
        return
    before, timers = [getattr(where, name) for where, name, _ in PLACES], list(ffi.lib._lock._cblist)
    _within = True
    try:
        for where, name, ours in PLACES:
            setattr(where, name, ours)
        ffi.lib._lock._cblist.clear()
        yield
    finally:
        _within = False
        for (where, name, _), theirs in zip(PLACES, before, strict=True):
            setattr(where, name, theirs)
        ffi.lib._lock._cblist[:] = timers
