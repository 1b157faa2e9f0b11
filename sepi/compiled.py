"""How the package's kernels are compiled by numba, kept, and loaded: ``njit`` of every module of compiled functions.

Numba knows thousands of functions that a kernel may call. Before it loads a kernel that it compiled in an earlier
process, it makes all of them known to its compiler: 0.1 to 0.2 s, a fifth of a short job, of which what is loaded uses
nothing. Here that is left until something has to be compiled.
"""

from __future__ import annotations

import functools
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar, cast

from sepi.absent import absent
from sepi.interrupts import no_interrupt_lost

# of which numba asks the one whether it is running, the other for its version, and uses the third to read a file of the
# user's: four tenths of importing numba
with absent("coverage", "scipy", *(() if os.path.exists(".numba_config.yaml") else ("yaml",))):
    import numba

import llvmlite.binding
from llvmlite import ir
from numba import prange, types
from numba.core import cgutils, codegen
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.registry import cpu_target
from numba.core.runtime import nrtdynmod
from numba.core.runtime.nrt import rtsys
from numba.extending import intrinsic

__all__ = ["fma", "njit", "prange", "prepare_loading"]

_cgutils: Any = cgutils

_compile_runtime: Any = nrtdynmod.compile_nrt_functions

_Function = TypeVar("_Function", bound=Callable[..., Any])


class _KernelFiles(IndexDataCacheFile):  # type: ignore[misc, unused-ignore]
    """A file of compiled code for each signature, named by it, and the index of a function's.

    Numba numbers them, and writes the index before the code: two processes that compile a function at once, for two
    types, both write number 1, and the index of the one names the code of the other, which crashes or computes anything
    until the cache is cleared. Here the worst that the one can do to the other is to have its code compiled once more.
    """

    def save(self, key: Any, data: Any) -> None:
        """Keep compiled code for a signature, then say where it is."""
        digest = hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        name = f"{self._index_name.removesuffix('nbi')}{digest}.nbc"
        self._save_data(name, data)  # type: ignore[no-untyped-call, unused-ignore]
        self._save_index(self._load_index() | {key: name})  # type: ignore[no-untyped-call, unused-ignore]


class _KernelCache(FunctionCache):  # type: ignore[misc, unused-ignore]
    """Compiled code on disk, as numba keeps it. What is missing is compiled, and the compiler makes itself ready."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call, unused-ignore]
        place = self._impl.locator
        stamp = place.get_source_stamp(), *_stamps_of_others(function)
        where = place.get_cache_path(), self._impl.filename_base, stamp
        self._cache_file = _KernelFiles(*where)  # type: ignore[no-untyped-call, unused-ignore]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled for a signature; None where there is nothing."""
        _initialize(target_context)
        engine = target_context.codegen()._engine
        # LLVM calls Python, and forgets what is raised there
        with (
            no_interrupt_lost(),
            self._guard_against_spurious_io_errors(),
            _names_unlisted(engine),
            _bitcode_unparsed(),
        ):
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call, unused-ignore]
        return None


@functools.cache
def _digest(file: str) -> str:
    with open(file, "rb") as source:
        return hashlib.sha256(source.read()).hexdigest()


def _stamps_of_others(function: Callable[..., Any]) -> tuple[tuple[str, str], ...]:
    """What tells a change of the other files whose compiled functions those of this file may call.

    Numba looks at the file of a function alone, and would go on with code that has old ones of other files in it.
    """
    files = {function.__code__.co_filename}
    others = [function.__globals__]
    while others:
        for found in list(others.pop().values()):
            called: Any = getattr(found, "py_func", None) or getattr(found, "_defn", None)
            code = getattr(called, "__code__", None)
            if code is not None and code.co_filename not in files:
                files.add(code.co_filename)
                others.append(called.__globals__)
    others_files = sorted(files - {function.__code__.co_filename})
    return tuple((os.path.basename(file), _digest(file)) for file in others_files)


class _Runtime(type(rtsys)):  # type: ignore[misc, unused-ignore]
    """Numba's functions of reference counts, which are compiled when a kernel is to be linked with them.

    Compiled code has its own copy of those that it calls: a process that compiles nothing leaves out 30 ms and as many
    megabytes.
    """

    _context: Any
    _library: Any

    @property
    def library(self) -> Any:
        """The library of these functions."""
        self._init_guard()  # type: ignore[no-untyped-call, unused-ignore]
        if self._library is None:
            self._library = _compile_runtime(self._context)
        return self._library


def _initialize(context: Any) -> None:
    """Make the functions of reference counts known to the compiler."""
    runtime: Any = rtsys
    if runtime._init:
        return
    runtime.__class__, runtime._context = _Runtime, context
    compiler: Any = nrtdynmod
    compiler.compile_nrt_functions = lambda _context: None
    try:
        runtime.initialize(context)
    finally:
        compiler.compile_nrt_functions = _compile_runtime


_FROM_PYTHON = "_ZN7cpython"
"""Names begin with it of the functions that Python calls."""


class _Names(set[str]):
    """Names that compiled code defines: those that numba lists, and those of modules that are looked at when asked."""

    def __init__(self, listed: Iterable[str]) -> None:
        super().__init__(listed)
        self.modules: list[Any] = []

    def __contains__(self, name: object) -> bool:
        """Whether one of them is that."""
        return super().__contains__(name) or any(_defines(module, str(name)) for module in reversed(self.modules))


def _defines(module: Any, name: str) -> bool:
    if isinstance(module, _Bitcode) and name.startswith(_FROM_PYTHON):
        # nothing but the code that it is part of names such a function
        return module.mentions(name)
    try:
        return not module.get_function(name).is_declaration
    except NameError:
        return False


@contextmanager
def _names_unlisted(engine: Any) -> Iterator[None]:
    """Have the engine list no names of code that is loaded: half of the time that it takes, for some that are asked."""
    if not isinstance(engine._defined_symbols, _Names):
        engine._defined_symbols = _Names(engine._defined_symbols)
    engine._load_defined_symbols = engine._defined_symbols.modules.append
    try:
        yield
    finally:
        del engine._load_defined_symbols


class _Bitcode:
    """A module of compiled code as it is kept beside it: parsed when it is asked for anything.

    Whoever compiles something that calls the code asks; a process that only loads and runs it does not.
    """

    def __init__(self, packed: bytes) -> None:
        self._packed = packed

    def mentions(self, name: str) -> bool:
        """Whether it defines something of that name, or calls it: names are kept as they are."""
        return name.encode() in self._packed

    def __getattr__(self, name: str) -> Any:
        """What the parsed module has."""
        if "_module" not in self.__dict__:
            self._module: Any = llvmlite.binding.parse_bitcode(self._packed)  # type: ignore[no-untyped-call, unused-ignore]
        return getattr(self._module, name)


class _Binding:
    """LLVM as numba knows it, but for the parsing of bitcode."""

    parse_bitcode = _Bitcode

    def __getattr__(self, name: str) -> Any:
        """What LLVM has."""
        return getattr(llvmlite.binding, name)


@contextmanager
def _bitcode_unparsed() -> Iterator[None]:
    """Have code be loaded without parsing what it was made of: a quarter of the time of all loading."""
    codegen.__dict__["ll"] = _Binding()
    try:
        yield
    finally:
        codegen.__dict__["ll"] = llvmlite.binding


def njit(*, cache: bool = False, borrows: bool = False, **options: Any) -> Callable[[_Function], _Function]:
    """``numba.njit`` with these options.

    Parameters
    ----------
    cache : bool
        Keep the compiled code for processes to come. Of other files such a function may use compiled functions, and
        nothing else that may change: of a constant numba would not see it.
    borrows : bool
        The function makes no arrays, and only works on its caller's. Nobody then has to count how many hold each:
        what numba does whenever a function gives an array, or a part of one, a name, and what all threads wait for.
    **options
        Of ``numba.njit``.
    """
    # other threads may do something meanwhile: import what comes next, or decode pictures
    options.setdefault("nogil", True)
    if borrows:
        options["_nrt"] = False

    def compiled(function: _Function) -> _Function:
        kernel = numba.njit(**options)(function)
        # not with NUMBA_DISABLE_JIT
        if cache and kernel is not function:
            kernel._cache = _KernelCache(function)  # type: ignore[no-untyped-call, unused-ignore]
            # extensions of numba add types, of which kernels take none: to look for them takes 25 ms of a process
            kernel._compilation_chain_init_hook = lambda: None
        return cast("_Function", kernel)

    return compiled


def _multiply_add(_context: Any, a: Any, _b: Any, _c: Any) -> Any:
    """LLVM code of :func:`fma`."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = arguments[0].type
        name = f"llvm.fma.v{kind.count}f32" if isinstance(kind, ir.VectorType) else "llvm.fma.f32"
        function = ir.FunctionType(kind, [kind, kind, kind])
        return builder.call(_cgutils.get_or_insert_function(builder.module, function, name), arguments)

    kind = types.float32 if isinstance(a, types.Number) else a
    return kind(kind, kind, kind), code


fma: Any = intrinsic(_multiply_add)
"""``a * b + c`` of float32, rounded once: the processor's own instruction, whatever the optimiser does.

Of vectors (:mod:`sepi.vectors`) for each element.
"""


def prepare_loading() -> None:
    """Do what loading the first compiled kernel would begin with, for processes that are forks of this one."""
    _initialize(cpu_target.target_context)
    # all that it knows, since compiled code refers to some of it
    cpu_target.target_context.refresh()
