"""Functions compiled to machine code by numba, kept between runs, compiled again when any of them changes.

Numba checks only a function's own file to see whether kept code is stale, though that code contains every
compiled function that it calls.  The files of kept code are therefore named after all of their sources.

Numba turns a result that is an array or a named tuple into a Python object by calling Python functions, and
does not check whether such a call failed.  A signal that has arrived during the compiled call is handled in
the first of them: when its handler raises, as that of Ctrl-C does, an array ends in an error of the
interpreter, and a named tuple, with a null pointer in it, the process in a segmentation fault.  Handlers
therefore only record the signal during the call, and act after it.
"""

from __future__ import annotations

import hashlib
import re
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import cache, cached_property, partial
from pathlib import Path
from types import FrameType
from typing import Any, Final, ParamSpec, TypeVar, cast

import numba
from numba.core import registry, sigutils, types
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import overload, register_jitable

from ringbalance.scene.platform.both_ways import both_ways, called_both_ways, chosen
from ringbalance.scene.platform.display import announced
from ringbalance.scene.platform.kept_code import KeptCode

P = ParamSpec("P")
R = TypeVar("R")

_OPTIONS: Final[dict[str, Any]] = {"nogil": True, "fastmath": False, "error_model": "numpy"}
_FOR_COMPILED_CODE: Final[dict[str, Any]] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_PLAIN: Final = frozenset({"None", "bool", "int", "float", "complex", "tuple", "Pair"})
"""Types of results, as annotated, that numba makes without calling a Python function."""
_MARKS: Final = tuple(f"from {name} import".encode() for name in (__name__, both_ways.__module__))
"""Import lines, one of which is in each source of compiled functions."""

# A private part of numba: without it, functions are compiled as numba does and signals are not deferred.
_Dispatcher: Any = getattr(registry, "CPUDispatcher", object)
_normalized: Any = sigutils.normalize_signature
_unliteral: Any = types.unliteral
_FINAL_STEPS: Final = ("_linking_libraries", "_reload_init", "_finalize_dynamic_globals", "_finalized")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function of numbers and arrays, in strict floating point and free of the interpreter's lock.

    Compiled at the first call or taken from an earlier process; the plain function stays as `py_func`.
    Ctrl-C during a call acts when the call has ended.
    """
    return _dispatcher(function)


def in_place(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that makes no array, without counting references to its arguments.

    Such counts, each safe against other threads, take a seventh of the time of a short function.
    """
    return _dispatcher(function, _nrt=False)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `in_place` does, in each compiled function that calls it: unused results cost nothing."""
    return _dispatcher(function, _nrt=False, forceinline=True)


def _chosen_number(condition, first, second):  # type: ignore[no-untyped-def]  # noqa: ARG001
    return lambda condition, first, second: first if condition else second


overload(chosen)(_chosen_number)


@cache
def _callable_too(function: Callable[..., Any]) -> None:
    """Let compiled code call a function of `both_ways`."""
    register_jitable(error_model="numpy", _nrt=False, forceinline=True, **_FOR_COMPILED_CODE)(function)


def _dispatcher(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    for each in called_both_ways(function):
        _callable_too(each)
    dispatcher = numba.njit(function, **_OPTIONS, **options)
    if not hasattr(dispatcher, "py_func"):
        # With NUMBA_DISABLE_JIT set, this is the function itself.
        return cast(Callable[P, R], dispatcher)
    if _Dispatcher is not object:
        # The result may contain an array or a named tuple unless all words of its annotation are plain.
        result = str(function.__annotations__.get("return", "unknown"))
        kind = _Called if set(re.findall(r"\w+", result)) <= _PLAIN else _Guarded
        dispatcher = kind(py_func=function, locals=dispatcher.locals, targetoptions=dispatcher.targetoptions)
    try:
        dispatcher._cache = KeptCode(function, _digest())
    except (AttributeError, TypeError, RuntimeError, OSError):
        # A numba that keeps code in another way, or a function without a file: compile in every process.
        return cast(Callable[P, R], dispatcher)
    return cast(Callable[P, R], dispatcher)


class _Called(_Dispatcher):  # type: ignore[misc]
    """Numba's dispatcher of a function that Python calls; compiled code calls another one.

    Most functions are called only by compiled code and need neither an entry from Python nor a separate file:
    the code of the outermost function contains them.  That saves much of the compile time.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        # Called only where no code is kept.
        self._compiler.compile = partial(_compile_announced, self._compiler.compile)

    def compile(self, sig: Any) -> Any:
        """Compile a signature, or wait for another process that is compiling it now."""
        with getattr(self._cache, "in_turn", nullcontext)():
            return super().compile(sig)

    @cached_property
    def _inner(self) -> Any:
        options = self.targetoptions | _FOR_COMPILED_CODE
        return _Inner(py_func=self.py_func, locals=self.locals, targetoptions=options)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Template of the inner dispatcher, for the type of a constant argument and not for its value."""
        return self._inner.get_call_template(tuple(_unliteral(each) for each in args), kws)

    def get_overload(self, sig: Any) -> Any:
        """Overload of the inner dispatcher."""
        return self._inner.get_overload(sig)


def _compile_announced(compile_it: Callable[..., Any], *arguments: Any) -> Any:
    with announced("compiling, once on this machine ..."):
        return compile_it(*arguments)


class _Inner(_Dispatcher):  # type: ignore[misc]
    """Numba's dispatcher of a function that compiled code calls."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._compiler._customize_flags = _without_address

    def compile(self, sig: Any) -> Any:
        """Compile a signature for its callers. Returns: placeholder of its address."""
        args, result = _normalized(sig)
        if args not in self.overloads:
            with global_compiler_lock, self._compiling_counter:
                code = self._compiler.compile(args, result)._replace(entry_point=_NoAddress())
                libraries = _left_to_callers(code.library)
                self.targetctx.insert_user_function(code.entry_point, code.fndesc, libraries)
                self.overloads[args] = code
        return self.overloads[args].entry_point


def _left_to_callers(library: Any) -> list[Any]:
    """Leave linking, optimisation and machine code of a library to the outermost caller, if numba permits it.

    Returns: The library and those that it needs, which each caller then needs too: every one is linked once,
    into the outermost caller, and not into each caller in between.
    """
    if not all(hasattr(library, name) for name in _FINAL_STEPS):
        return [library]
    needed = list(dict.fromkeys(library._linking_libraries))

    def finalize() -> None:
        for each in needed:
            library._reload_init.update(each._reload_init)
        library._finalize_dynamic_globals()
        library._finalized = True

    library.finalize = finalize
    return [library, *needed]


class _NoAddress:
    """Placeholder that identifies a compiled function without an address."""


def _without_address(flags: Any) -> Any:
    flags.no_compile = True
    return flags


class _Guarded(_Called):
    """Numba's dispatcher, with signals deferred while a call from Python runs, but not while it compiles."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the compiled function."""
        with _signals_deferred():
            return super().__call__(*args, **kwargs)

    def _compile_for_args(self, *args: Any, **kwargs: Any) -> Any:
        with _signals_live():
            return super()._compile_for_args(*args, **kwargs)


@cache
def _digest() -> str:
    total = hashlib.sha256(numba.__version__.encode())
    for path in _compiled_sources():
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


_COMPILED: Final = ("controller", "reduced_model")
"""Folders whose functions are compiled, from the package's root."""


_IMPORT: Final = re.compile(rb"^from ringbalance\.([\w.]+) import (\([^)]*\)|.*)$", re.MULTILINE)
_CONSTANT: Final = re.compile(rb"\b(?:[A-Z][A-Z_0-9]*|Regime)\b")
"""Pattern of an imported constant, whose value is part of the compiled code."""


def _compiled_sources() -> tuple[Path, ...]:
    """Sources of compiled functions and of their compilation, and those that define constants of both."""
    this_file, root = Path(__file__), Path(__file__).parents[2]
    paths = [path for each in _COMPILED for path in (root / each).rglob("*.py")]
    pending = [path for path in paths if any(mark in path.read_bytes() for mark in _MARKS)]
    pending += [this_file.with_name(name) for name in ("compiled.py", "both_ways.py", "kept_code.py")]
    pending.append(root / "physics/gas.py")
    sources: set[Path] = set()
    while pending:
        path = pending.pop()
        if path in sources or not path.is_file():
            continue
        sources.add(path)
        if not path.is_relative_to(root / "scene"):
            pending += [
                root.joinpath(*module.decode().split(".")).with_suffix(".py")
                for module, names in _IMPORT.findall(path.read_bytes())
                if _CONSTANT.search(names)
            ]
    return tuple(sorted(sources))


_Handler = Callable[[int, FrameType | None], Any]

_NAMES: Final = (
    "SIGINT",
    "SIGTERM",
    "SIGHUP",
    "SIGBREAK",
    "SIGALRM",
    "SIGPROF",
    "SIGVTALRM",
    "SIGXCPU",
    "SIGUSR1",
    "SIGUSR2",
)
_SIGNALS: Final = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
"""Signals whose handlers may raise: those that end a program or limit its time."""


class _Deferred:
    """Signal handler that records a signal; the previous handler is called later."""

    def __init__(self, before: _Handler) -> None:
        self.before = before
        self.arrived = False

    def __call__(self, _number: int, _frame: FrameType | None) -> None:
        """Record that the signal has arrived."""
        self.arrived = True


@contextmanager
def _signals_deferred() -> Iterator[None]:
    """Let Python's signal handlers act at the end of the block, in the main thread; elsewhere none ever run.

    Handlers that are not Python functions, such as the system's for SIGTERM, act at once as before.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    deferred: dict[int, _Deferred] = {}
    try:
        for number in _SIGNALS:
            before = signal.getsignal(number)
            if callable(before) and not isinstance(before, _Deferred):
                deferred[number] = _Deferred(before)
                signal.signal(number, deferred[number])
        yield
    finally:
        _give_back(deferred)


def _give_back(deferred: dict[int, _Deferred]) -> None:
    """Restore every handler, even if handlers of signals that have arrived raise."""
    if not deferred:
        return
    number, handler = deferred.popitem()
    try:
        signal.signal(number, handler.before)
        if handler.arrived:
            handler.before(number, None)
    finally:
        _give_back(deferred)


@contextmanager
def _signals_live() -> Iterator[None]:
    """Let handlers act at once again within `_signals_deferred`, for Python code that takes long."""
    main = threading.current_thread() is threading.main_thread()
    handlers = {number: signal.getsignal(number) for number in _SIGNALS} if main else {}
    deferred = {number: held for number, held in handlers.items() if isinstance(held, _Deferred)}
    try:
        for number, handler in deferred.items():
            signal.signal(number, handler.before)
        for number, handler in deferred.items():
            if handler.arrived:
                handler.arrived = False
                handler.before(number, None)
        yield
    finally:
        for number, handler in deferred.items():
            signal.signal(number, handler)
