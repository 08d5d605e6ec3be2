"""The forms of one compiled function: as numba's dispatchers, each with what its caller needs and no more.

Of every kernel numba would make machine code and a wrapper for Python; hardly any is called from Python. What another
kernel calls (CALLED) is kept as LLVM's code alone, ready to be linked into the caller; what is called by symbol
(PUBLISHED) has machine code; only what Python calls (ENTRY) has the wrapper too. The code of the function is one and
the same in all three. Names in the code come from its content, not from the order in which a process compiled: any
number of processes make the same code.
"""

from __future__ import annotations

import hashlib
import pickle
import warnings
from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar

import llvmlite.binding
from numba.core import compiler, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import NumbaWarning
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys
from numba.core.serialize import dumps
from numba.core.typing.templates import Signature

from . import kernel_key, shortcuts
from .kernel_cache import KernelFiles, files
from .kernel_key import UnknownContent, changed, content_of, type_text
from .packaged import COMPILED, DISK, PACKAGE, Packaged, origins, packaged

ENTRY, PUBLISHED, CALLED = "entry", "published", "called"
_in_use: dict[str, Form] = {}  # name of a code: whose it is in this process
_versions: list[str] = []
_unknown: set[str] = set()  # those of which nothing is kept, and that was said
asked: dict[str, tuple] = {}  # symbol: types and result with which callers call it


class WrongCall(TypeError):
    """A call by symbol with other types than those of the code behind it."""


class KeptCode:
    """The compiled versions of one form on disk, by content; what numba's dispatchers take as their cache."""

    cache_path = property(lambda self: str(self.files.folders[0]))

    def __init__(self, form: Form, where: KernelFiles = files, shipped: Packaged = packaged):
        self.form, self.files, self.shipped = form, where, shipped
        self.names: dict[tuple, str | None] = {}
        self.lacked: set[str] = set()  # keys that were not on disk when they were looked for

    def key(self, args: tuple, returns: Any = None) -> str | None:
        """Hash of the content, types, program versions and processor; None: content that cannot be told."""
        return self._keys(args, returns)[0]

    def _keys(self, args: tuple, returns: Any = None) -> tuple[str | None, str | None]:
        """The key, and that of the same kernel in the package; None for the second: it has none for this process."""
        if not _versions:
            _versions.append(repr(kernel_key.versions()))
        try:
            content, _ = content_of(self.form)
        except UnknownContent as unknown:
            if self.form.title not in _unknown:
                _unknown.add(self.form.title)
                text = f"{self.form.title} is not kept on disk but compiled in each process: no content is known of"
                warnings.warn(f"{text} {unknown}", NumbaWarning, 3)
            return None, None
        parts = [_versions[0], self.form.kind, content, *(type_text(kind) for kind in args), repr(returns), ""]
        made = hashlib.sha256("\0".join(parts).encode())
        of_package = made.copy()
        made.update(repr(self.form.targetctx.codegen().magic_tuple()).encode())
        if self.form.kind == CALLED or not self.shipped.any():
            return made.hexdigest()[:40], None
        of_package.update(self.shipped.target.encode())
        return made.hexdigest()[:40], of_package.hexdigest()[:40]

    def _file(self, key: str) -> str:
        return f"{self.form.title[:150]}-{key}.{self.form.kind}"

    def lacks(self, args: tuple) -> bool:
        """Is the version for these types one to be kept, and not on disk?"""
        key, shipped = self._keys(args)
        if key is None or self.files.find(self._file(key)) is not None:
            return False
        if shipped is not None and self.shipped.read(self._file(shipped)) is not None:
            return False
        self.lacked.add(key)
        return True

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled version for these types, None: it must be compiled."""
        rtsys.initialize(target_context)  # all that what is on disk needs; what compiles loads the rest of numba
        args, returns = _parts(sig)
        key, shipped = self._keys(args, returns)
        if key is not None and _in_use.setdefault(key, self.form) is not self.form:
            key = None  # another dispatcher of the same content: the names in its code are taken
        self.names[args] = key
        if self.form.apart:
            return None  # written by another process a moment ago; loaded, it would look for what it calls by symbol
        content = self.files.read(self._file(key)) if key is not None else None
        if content is not None:
            calls, payload = pickle.loads(content)
            found, origin = self.form.rebuilt(target_context, payload), COMPILED if key in self.lacked else DISK
        elif key is not None and shipped is not None and (loaded := self._shipped(target_context, shipped)):
            (calls, found), origin = loaded, PACKAGE
        else:
            calls, found, origin = {}, None, COMPILED
        for symbol, types_and_result in calls.items():
            ask(symbol, *types_and_result)
        if self.form.kind != CALLED and key is not None:
            origins[self._file(key)] = origin
        return found

    def _shipped(self, target_context: Any, key: str) -> tuple[dict, Any] | None:
        """Calls by symbol and the compiled version of the package, None: it has none that can be loaded."""
        name = self._file(key)
        content = self.shipped.read(name)
        if content is None:
            return None
        try:
            calls, payload = pickle.loads(content)
            return calls, self.form.rebuilt(target_context, payload)
        except Exception:  # of whatever kind: it is compiled here
            self.shipped.damaged.add(name)
            return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Keep a version that was compiled from what the function refers to now."""
        args, returns = _parts(sig)
        key = self.names.get(args)
        if key is None or key != self.key(args, returns) or changed(self.form) or cres.library.has_dynamic_globals:
            return
        declared = {f.name for f in cres.library._final_module.functions if f.is_declaration}
        calls = {symbol: asked[symbol] for symbol in sorted(declared & set(asked))}
        self.files.write(self._file(key), dumps((calls, self.form.payload_of(args, cres))))

    def flush(self) -> None:
        """Nothing goes stale, so there is nothing to forget."""

    enable = disable = flush


def _parts(sig: Any) -> tuple[tuple, Any]:
    if isinstance(sig, Signature):
        return tuple(sig.args), sig.return_type
    return tuple(sig), None


def ask(symbol: str, args: tuple, result: Any) -> None:
    """A kernel calls this symbol with these types. Raises WrongCall where another calls it with others."""
    if asked.setdefault(symbol, (args, result)) != (args, result):
        raise WrongCall(
            f"{symbol} is called with {args} for {result} and elsewhere with {asked[symbol][0]} for "
            f"{asked[symbol][1]}: by symbol there is one version, so the second caller was refused. "
            f"Coerce the arguments where they are made"
        )


def _in_package(function: Any) -> str:
    """The file of a function from its package on: where it lies is no part of the code, which errors name it in."""
    return "/".join(Path(function.__code__.co_filename).parts[-1 - function.__module__.count(".") :])


class _LinkedCode(JITCodeLibrary):
    """Code to be linked into that of callers; no machine code is made of it."""

    def _optimize_final_module(self) -> None:
        """Nothing: it is optimised with each caller, and so once less."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def serialize_using_object_code(self) -> tuple:
        self._ensure_finalized()
        return self.name, CALLED, self._get_module_for_linking().as_bitcode()


class _ApartCode(_LinkedCode):
    """Machine code apart from the process: what it calls by symbol need not be there yet."""

    _optimize_final_module = JITCodeLibrary._optimize_final_module

    def serialize_using_object_code(self) -> tuple:
        name, _, code = super().serialize_using_object_code()
        module = llvmlite.binding.parse_bitcode(self._final_module.as_bitcode())  # as read: no trace of how it was made
        return name, "object", (self._codegen._tm.emit_object(module), code)


class _Named(compiler.Compiler):
    """numba's compiler, with the names in the code from its content."""

    def __init__(self, form: Form, *args: Any, **options: Any):
        super().__init__(*args, **options)
        self.form = form

    def _compile_bytecode(self) -> Any:
        state = self.state
        key = self.form._cache.names.get(tuple(state.args))
        if key is not None:
            state.func_id.unique_id = key[:20]
            state.func_id.unique_name = f"{state.func_id.func_qualname}${key[:20]}"
            state.func_id.filename = _in_package(self.form.py_func)
        state.flags.no_compile = True
        code = _LinkedCode if self.form.kind == CALLED else _ApartCode
        state.library = code(state.targetctx.codegen(), state.func_id.func_qualname)
        return super()._compile_bytecode()


class Form(CPUDispatcher):
    """A function compiled for one kind of caller."""

    kind = ENTRY
    apart = False

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None, pipeline_class: Any = None):
        super().__init__(py_func, locals or {}, targetoptions or {}, pipeline_class=partial(_Named, self))
        self.title = f"{py_func.__module__}.{py_func.__qualname__}".replace("<", "").replace(">", "")
        self._cache = KeptCode(self)
        self.payloads: dict[tuple, tuple] = {}

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """A literal argument compiles no version of its own."""
        return super().get_call_template([types.unliteral(a) for a in args], kws)

    def compile(self, sig: Any) -> Any:
        """Compile for these types or load it from disk; returns what Python calls."""
        with global_compiler_lock, shortcuts.shortened():
            super().compile(sig)
        return self.overloads[_parts(sig)[0]].entry_point

    def keep(self, args: tuple) -> None:
        """Compile for these types onto the disk only: nothing that it calls need be there."""
        with global_compiler_lock, shortcuts.shortened():
            if args not in self.overloads and self._cache.lacks(args):
                self.apart = True
                try:
                    super().compile(args)
                finally:
                    self.apart = False

    def add_overload(self, cres: Any) -> None:
        """A version is there. What was compiled now goes the way of what is loaded from disk, to the same code."""
        args = tuple(cres.signature.args)
        if cres.entry_point is None:
            if self.apart:
                return
            self.payloads[args] = cres._replace(type_annotation="")._reduce()
            cres = self.rebuilt(cres.target_context, self.payloads[args])
            cres.target_context.insert_user_function(cres.entry_point, cres.fndesc, [cres.library])
        self.insert(args, cres)

    def insert(self, args: tuple, cres: Any) -> None:
        """Make the version known to callers."""
        super().add_overload(cres)

    def payload_of(self, args: tuple, cres: Any) -> tuple:
        """What is kept of a version that was compiled now."""
        return self.payloads.pop(args, None) or cres._replace(type_annotation="")._reduce()

    def rebuilt(self, target_context: Any, payload: tuple) -> Any:
        """The version that was kept."""
        return compiler.CompileResult._rebuild(target_context, *payload)


class Published(Form):
    """What is called by symbol."""

    kind = PUBLISHED


class Called(Form):
    """What other kernels call; its code becomes part of theirs. It has no address, numba knows it by a token."""

    kind = CALLED

    def insert(self, args: tuple, cres: Any) -> None:
        """Make the version known to callers."""
        self.overloads[args] = cres

    def rebuilt(self, target_context: Any, payload: tuple) -> Any:
        """The version that was kept."""
        (name, _, code), fndesc, env, signature, objectmode, lifted, note, reload_init, referenced = payload
        for function in reload_init:
            function()
        library = _LinkedCode(target_context.codegen(), name)
        library._shared_module = llvmlite.binding.parse_bitcode(code)
        library._final_module = library._shared_module
        library._finalized = True
        return compiler.CompileResult(
            typing_context=target_context.typing_context,
            target_context=target_context,
            entry_point=object(),
            typing_error=None,
            type_annotation=note,
            signature=signature,
            objectmode=objectmode,
            lifted=lifted,
            fndesc=fndesc,
            library=library,
            call_helper=None,
            environment=env,
            metadata=None,
            reload_init=reload_init,
            referenced_envs=referenced,
        )


class Kernel(Form):
    """A function for Python to call, and its other forms for kernels."""

    before_first: ClassVar[Callable[[], None] | None] = None  # called once, before what is not on disk is compiled

    def compile(self, sig: Any) -> Any:
        """Compile for these types or load it from disk; returns what Python calls."""
        begin = Kernel.before_first
        if begin is not None and self._cache.lacks(_parts(sig)[0]):
            Kernel.before_first = None
            begin()
        return super().compile(sig)

    @cached_property
    def called(self) -> Called:
        """The form for kernels that call it."""
        return Called(self.py_func, {}, self._bare)

    @cached_property
    def published(self) -> Published:
        """The form for kernels that call it by symbol."""
        return Published(self.py_func, {}, self._bare)

    @property
    def _bare(self) -> dict:
        return {**self.targetoptions, "no_cpython_wrapper": True}

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """A kernel calls the form that is for kernels."""
        return self.called.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """A kernel calls the form that is for kernels."""
        return self.called.get_overload(sig)
