"""Rows of a table as machine vectors: what the loop vectoriser does not find in blocks of six.

It looks for long loops over separate arrays; the elimination of a 6x16 block is short ones over rows of the same array.
"""

from __future__ import annotations

import numba

from .jit import PLAIN, inline

if not PLAIN:
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic
    from numba.np.arrayobj import make_array


def row_update(width: int):
    """A function less(x, i, a, s, y, j, b): x[i, a:a+width] -= sum over k of s[k] * y[j+k, b:b+width], s a tuple.

    x and y are C-contiguous tables of float64; neither bounds nor overlap are checked.
    """
    if PLAIN or numba.config.DISABLE_JIT:
        return _looped(width)
    vector, index = ir.VectorType(ir.DoubleType(), width), ir.IntType(32)
    blank, first = ir.Constant(vector, ir.Undefined), ir.Constant(ir.VectorType(index, width), [0] * width)

    def code(context, builder, signature, args):
        def place(arg, row, column):
            table = make_array(signature.args[arg])(context, builder, args[arg])
            at = builder.add(builder.mul(row, builder.extract_value(table.shape, 1)), column)
            return builder.bitcast(builder.gep(table.data, [at]), vector.as_pointer())

        target = place(0, args[1], args[2])
        total = builder.load(target, align=8)
        for k in range(signature.args[3].count):
            factor = builder.insert_element(blank, builder.extract_value(args[3], k), index(0))
            source = place(4, builder.add(args[5], ir.Constant(args[5].type, k)), args[6])
            total = builder.fsub(
                total, builder.fmul(builder.shuffle_vector(factor, blank, first), builder.load(source, align=8))
            )
        builder.store(total, target, align=8)
        return context.get_dummy_value()

    @intrinsic
    def less(typing_context, x, i, a, s, y, j, b):
        return types.void(x, types.intp, types.intp, s, y, types.intp, types.intp), code

    return less


def _looped(width: int):
    """The same as a loop, in the same order of operations, for numba.njit alone."""

    def less(x, i, a, s, y, j, b):
        for c in range(width):
            total = x[i, a + c]
            for k in range(len(s)):
                total -= s[k] * y[j + k, b + c]
            x[i, a + c] = total

    return inline(less)
