"""Compilation: decorators, lane count, and a cache folder that changes with the physics sources.

Numba's own on-disk cache goes stale when a kernel in *another* file changes; its folder is therefore named by a
hash of every source of this floor. ``NUMBA_CACHE_DIR`` moves the folder, as usual.

Every compiled function is optimised anew inside each compiled function that calls it, so depth costs compile time. The
heavy kernels are therefore called through :func:`opaque`: by symbol, without being linked into the caller.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

import llvmlite.binding
import numba
import numpy as np
from numba.core import cgutils
from numba.extending import intrinsic

try:  # types as bytes, 300 times faster than typeof: 8 us instead of 2.3 ms for model and state
    from numba._dispatcher import compute_fingerprint as _fingerprint
except ImportError:
    _fingerprint = numba.typeof

YES, NO = np.bool_(True), np.bool_(False)  # not literals: a literal argument compiles a second version
LANES = 16  # elements per lane loop; 8 is unrolled before the vectoriser sees it


def cache_folder() -> Path:
    """Folder of the compiled kernels: user cache (or temporary folder) / hash of the physics sources."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.glob("**/*.py")):
        digest.update(source.read_bytes())
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    root = Path(base) if base else Path.home() / ".cache"
    try:
        folder = root / "cable_sim_ros" / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:  # read-only or missing home
        folder = Path(tempfile.gettempdir()) / f"cable_sim_ros-{os.getuid()}" / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
    return folder


if tuple(int(x) for x in numba.__version__.split(".")[:2]) < (0, 65):  # an older one aborts inside LLVM
    raise ImportError(
        f"numba {numba.__version__} is too old for the kernels' calls by symbol; nothing was compiled. "
        f"Install numba >= 0.65"
    )

numba.config.CACHE_DIR = str(cache_folder())

# No function here makes an array or hands one to Python, so views need no reference counts: atomic, 5 ns each. It must
# hold for all of them: a caller that counts would free what a callee that does not returns.
_options = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}


def _compiler(**options):
    """A decorator like numba.njit(**options) under which literal arguments do not compile versions of their own."""
    decorate = numba.njit(**_options, **options)

    def compiled(function):
        dispatcher = decorate(function)
        if not numba.config.DISABLE_JIT:
            typed = dispatcher.get_call_template
            dispatcher.get_call_template = lambda args, kws: typed([numba.types.unliteral(a) for a in args], kws)
        return dispatcher

    return compiled


inline = _compiler(forceinline=True)  # physics: scalars and tuples in and out
driver = _compiler(nogil=True, cache=True)  # arrays and lane loops


_opaque: dict = {}  # symbol: the function that it stands for
_published: dict = {}  # symbol: types of the version that was published
_linked: set = set()  # what was asked for, by function and fingerprint of its arguments


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


def opaque(dispatcher):
    """A function that calls ``dispatcher``'s one compiled version by symbol, for use inside compiled functions.

    Its code is neither copied into the caller nor optimised again there. ``link`` must have been called with arguments
    of the types in use before a caller runs. Without compilation it is the function itself. Raises ValueError where
    another function has the name of this one in its module.
    """
    symbol = _claimed(dispatcher)
    if numba.config.DISABLE_JIT:
        return dispatcher

    def build(args):
        types = tuple(numba.types.unliteral(a) for a in args)
        dispatcher.compile(types)
        result = dispatcher.overloads[types].signature.return_type

        def code(context, builder, signature, values):
            kind = context.call_conv.get_function_type(signature.return_type, signature.args)
            function = cgutils.get_or_insert_function(builder.module, kind, symbol)
            status, value = context.call_conv.call_function(
                builder, function, signature.return_type, signature.args, values
            )
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return value

        return result(*types), code

    names = ", ".join(dispatcher.py_func.__code__.co_varnames[: dispatcher.py_func.__code__.co_argcount])
    namespace = {"build": build}  # an intrinsic needs its parameters by name
    exec(f"def call(typing_context, {names}):\n    return build(({names},))", namespace)
    return intrinsic(namespace["call"])


def link(dispatcher, *args) -> None:
    """Compile ``dispatcher`` for these arguments (or load it from the cache) and publish its address for opaque().

    Raises ValueError where it has no name of its own, TypeError where it was published for other types: callers by
    symbol would run that version.
    """
    if numba.config.DISABLE_JIT:
        return
    key = dispatcher, _fingerprint(args)
    if key in _linked:  # not: compiled, a direct call compiles without publishing
        return
    symbol, types = _claimed(dispatcher), tuple(numba.typeof(a) for a in args)
    if _published.setdefault(symbol, types) != types:
        raise TypeError(
            f"{symbol} is published for {_published[symbol]} and was linked for {types}: what calls it by symbol knows "
            f"one version, so the second was refused. Coerce the arguments where they are made"
        )
    dispatcher.compile(types)
    compiled = dispatcher.overloads[types]
    address = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    llvmlite.binding.add_symbol(symbol, address)
    _linked.add(key)
