"""Named tuples of arrays by reference: one pointer in place of the hundreds of words that their arrays are made of.

Handed over by value, model and state are written out word by word at each call by symbol, needed or not. Here the words
are laid down once, by the compiled entry, and each kernel loads those that it uses. They do not change while a kernel
that was handed them runs, so that LLVM may load them once and keep them.
"""

from __future__ import annotations

import hashlib
from typing import Any

import llvmlite.ir as ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, register_model

WORD = ir.IntType(64)


class Reference(types.Type):
    """The type of a named tuple that lies in memory, each of its words in 8 bytes; its fields are as those of it."""

    def __init__(self, tuple_type: types.BaseNamedTuple):
        self.tuple_type = tuple_type
        super().__init__(f"reference({tuple_type})")

    key = property(lambda self: self.tuple_type)

    @property
    def mangling_args(self) -> tuple:
        """A short name in the code: that of a tuple of records is thousands of characters long."""
        return f"reference{hashlib.sha256(self.name.encode()).hexdigest()[:16]}", ()


def referred(kind: types.Type) -> types.Type:
    """The type by which a value of this type is handed over: a named tuple with an array somewhere by reference."""
    return Reference(kind) if isinstance(kind, types.BaseNamedTuple) and _has_array(kind) else kind


def _has_array(kind: types.Type) -> bool:
    if isinstance(kind, types.BaseTuple):
        return any(_has_array(part) for part in kind.types)
    return isinstance(kind, types.Array)


@register_model(Reference)
class _ReferenceModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Reference):
        super().__init__(dmm, fe_type, WORD.as_pointer())


@infer_getattr
class _Fields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference: Reference, name: str) -> types.Type | None:
        kind = reference.tuple_type
        return referred(kind.types[kind.fields.index(name)]) if name in kind.fields else None


@lower_getattr_generic(Reference)
def _field(context: Any, builder: Any, kind: Reference, base: Any, name: str) -> Any:
    index, parts = kind.tuple_type.fields.index(name), kind.tuple_type.types
    first = sum(_words(context.get_value_type(part)) for part in parts[:index])
    if referred(parts[index]) is not parts[index]:
        return _at(builder, base, first)
    return _loaded(builder, base, first, context.get_value_type(parts[index]))


def _parts(kind: ir.Type) -> list[ir.Type]:
    """What a value of an LLVM type is made of; nothing: it is one word."""
    if isinstance(kind, ir.ArrayType):
        return [kind.element] * kind.count
    return list(kind.elements) if isinstance(kind, ir.BaseStructType) else []


def _words(kind: ir.Type) -> int:
    if isinstance(kind, ir.ArrayType | ir.BaseStructType):
        return sum(map(_words, _parts(kind)))
    return 1


def _at(builder: Any, base: Any, word: int) -> Any:
    return builder.gep(base, [ir.Constant(WORD, word)])


def _loaded(builder: Any, base: Any, word: int, kind: ir.Type) -> Any:
    if not isinstance(kind, ir.ArrayType | ir.BaseStructType):
        value = builder.load(builder.bitcast(_at(builder, base, word), kind.as_pointer()))
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value
    whole = ir.Constant(kind, ir.Undefined)
    for i, part in enumerate(_parts(kind)):
        whole = builder.insert_value(whole, _loaded(builder, base, word, part), i)
        word += _words(part)
    return whole


def _laid(builder: Any, base: Any, word: int, value: Any) -> None:
    kind = value.type
    if not isinstance(kind, ir.ArrayType | ir.BaseStructType):
        builder.store(value, builder.bitcast(_at(builder, base, word), kind.as_pointer()))
        return
    for i, part in enumerate(_parts(kind)):
        _laid(builder, base, word, builder.extract_value(value, i))
        word += _words(part)


def handed(context: Any, builder: Any, kind: types.Type, value: Any) -> Any:
    """The value as it is handed over (see referred), laid down in the frame of the function where it is a tuple."""
    if referred(kind) is kind:
        return value
    room = cgutils.alloca_once(builder, ir.ArrayType(WORD, _words(value.type)))
    base = builder.bitcast(room, WORD.as_pointer())
    _laid(builder, base, 0, value)
    # a kernel that is inlined here loads words that never change: not from before they were laid down
    kept = ir.FunctionType(base.type, [base.type])
    return builder.asm(kept, "", "=r,0,~{memory}", [base], True)


@intrinsic
def by_reference(typing_context: Any, value: types.Type) -> Any:
    """A named tuple of arrays by reference, in place of the tuple in the function that calls this; else as it is."""
    return referred(value)(value), lambda context, builder, signature, args: handed(
        context, builder, signature.args[0], args[0]
    )
