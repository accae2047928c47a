"""Compiled kernels on disk: one file with a checksum per kernel, in a folder named by the versions of the compilers.

An edited source, another version or another processor leads to another name, so a stored kernel is never out of date.
A kernel whose file has a wrong checksum is compiled again, and the file is replaced. Finished files are moved into
place, so processes that compile at the same time do not disturb each other.

Kernels are stored in the first of these folders that can be written, and read from any of them: NUMBA_CACHE_DIR, the
installed package, the user's cache folder.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import hashlib
import importlib
import logging
import os
import pickle
import shutil
import subprocess
import sys
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from threading import RLock, Timer
from typing import Any

import numba
import numba.core.caching
import numba.core.compiler
import numba.core.serialize

from femflex.kernels.digest import PACKAGE, kernel_digest, versions_digest
from femflex.warning import CacheWarning

log = logging.getLogger(__name__)

CHECKSUM_BYTES = 32
REPORTED_AFTER = 2.0  # seconds of compiling
REQUESTS = ("_compile_for_args", "get_call_template", "get_compile_result")  # Numba's requests for code
KEPT = 8  # most recently used folders (one per set of versions), and files of one kernel (one per state of its sources)

_njit: Any = numba.njit
_config: Any = numba.config
_Cache: Any = numba.core.caching._Cache  # numba's own annotations do not cover these
_CompileResult: Any = numba.core.compiler.CompileResult
_serialize: Any = numba.core.serialize


def cached_kernel(signature: Any, **options: Any) -> Callable[[Any], Any]:
    """Decorator like `numba.njit` of one signature, with the machine code read from disk or written there.

    Nothing is compiled before the function is called, or passed to another kernel, for the first time. With the
    compiler off the plain function is returned.
    """

    def lazy(function: Any) -> Any:
        dispatcher = _njit(**options)(function)
        if dispatcher is not function:
            dispatcher._cache = KernelCache(function)
            _compile_at_first_use(dispatcher, signature)
        return dispatcher

    return lazy


def _compile_at_first_use(dispatcher: Any, signature: Any) -> None:
    """Make the three methods by which Numba requests machine code compile the declared signature first.

    They serve a call from Python, a call from compiled code, and the address of a first-class function. Replacements
    are attributes of this dispatcher until it is compiled; then the methods of its class are used again.
    """
    lock = RLock()
    dispatcher.declared = signature

    def compile_declared() -> None:
        with lock:
            if dispatcher.overloads:
                return
            with _reported(dispatcher), _without_collection():
                _wait_for(dispatcher)
                dispatcher.compile(signature)
            dispatcher.disable_compile()
            for method in REQUESTS:
                delattr(dispatcher, method)
            _remember_code(dispatcher)

    def compile_for_call(*_: Any, **__: Any) -> Any:
        compile_declared()
        return dispatcher  # Numba calls this with the arguments

    def call_template(arguments: Any, keywords: Any) -> Any:
        compile_declared()
        return dispatcher.get_call_template(arguments, keywords)

    def compile_result(requested: Any) -> Any:
        compile_declared()
        return dispatcher.get_compile_result(requested)

    for method, replacement in zip(REQUESTS, (compile_for_call, call_template, compile_result), strict=True):
        setattr(dispatcher, method, replacement)


_compiling = {"seconds": 0.0, "depth": 0.0}  # spent so far by this process, and kernels that wait for each other


@contextlib.contextmanager
def _reported(kernel: Any) -> Iterator[None]:
    """Context of compiling a kernel: logged, once, as soon as all of them took longer than REPORTED_AFTER together."""
    if _compiling["depth"] or _compiling["seconds"] > REPORTED_AFTER or kernel._cache.is_stored(kernel):
        yield
        return
    began = time.perf_counter()
    timer = Timer(REPORTED_AFTER - _compiling["seconds"], log.info, ["compiling equations, once per installation ..."])
    timer.daemon = True
    timer.start()
    _compiling["depth"] = 1.0
    try:
        yield
    finally:
        timer.cancel()
        _compiling.update(depth=0.0, seconds=_compiling["seconds"] + time.perf_counter() - began)


_ahead: dict[str, subprocess.Popen[bytes]] = {}  # name of a kernel -> the process that compiles it


def compile_ahead(kernels: Iterable[Any]) -> None:
    """Compile the kernels that are not on disk in a second process, while this one goes on.

    The first call of one of them waits until it is on disk.
    """
    missing = [kernel for kernel in kernels if is_pending(kernel) and not kernel._cache.is_stored(kernel)]
    names = [name for kernel in missing if (name := _kernel_name(kernel)) not in _ahead]
    if names and (os.cpu_count() or 1) > 1 and _can_store():
        command = [
            sys.executable,
            "-c",
            "import sys; from femflex.kernels.cache import compile_named as c; c(sys.argv[1:])",
        ]
        devnull = subprocess.DEVNULL
        with contextlib.suppress(OSError):
            process = subprocess.Popen([*command, *names], stdin=devnull, stdout=devnull, stderr=devnull)
            atexit.register(process.kill)
            _ahead.update(dict.fromkeys(names, process))


def _wait_for(kernel: Any) -> None:
    """Wait until the process that compiles this kernel, if there is one, has left it on disk or has ended."""
    process = _ahead.pop(_kernel_name(kernel), None)
    while process is not None and process.poll() is None and not kernel._cache.is_stored(kernel):
        time.sleep(0.02)


def compile_named(names: Iterable[str]) -> None:
    """Compile kernels, "module:function" each, and leave them on disk."""
    for name in names:
        module, _, function = name.partition(":")
        kernel = getattr(importlib.import_module(module), function)
        kernel.get_compile_result(kernel.declared)


def is_pending(kernel: Any) -> bool:
    """Whether this is a cached kernel that has been neither compiled nor read in this process."""
    return hasattr(kernel, "declared") and not kernel.overloads


def _kernel_name(kernel: Any) -> str:
    return f"{kernel.py_func.__module__}:{kernel.py_func.__qualname__}"


def _can_store() -> bool:
    """Whether some folder for kernels is writable."""
    for folder in cache_folders():
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return True
    return False


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """Context without garbage collection, which takes a fifth of the time of the compiler's millions of objects."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _remember_code(dispatcher: Any) -> None:
    """Keep the machine code of a compiled kernel at hand, so that Numba need not look it up.

    Where kernels are arguments of others, Numba looks their code up twice for each of them at every call: 0.1 ms, which
    sampled controllers would pay at every sample.
    """
    (result,) = dispatcher.overloads.values()
    look_up = dispatcher.get_compile_result

    def get_compile_result(signature: Any) -> Any:
        return result if signature.args == result.signature.args else look_up(signature)

    dispatcher.get_compile_result = get_compile_result
    result.library.get_pointer_to_function = cache(result.library.get_pointer_to_function)


def cache_folders() -> list[Path]:
    """Folders where kernels may be stored, the preferred one first; they need not exist."""
    folders = [Path(_config.CACHE_DIR) / "femflex"] if _config.CACHE_DIR else []
    folders.append(PACKAGE / "__pycache__" / "kernels")
    with contextlib.suppress(RuntimeError):  # no home
        folders.append(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "femflex" / "kernels")
    return [folder.absolute() / versions_digest() for folder in folders]


class KernelCache(_Cache):  # type: ignore[misc]
    """Cache object that Numba asks for the machine code of one function, and gives new machine code to."""

    def __init__(self, function: Any) -> None:
        if function.__closure__:
            raise ValueError(
                f"kernel {function.__qualname__} has a closure, so it cannot be stored; define it in a module"
            )
        self._function = function

    @property
    def cache_path(self) -> str:
        """The preferred folder."""
        return str(cache_folders()[0])

    def is_stored(self, kernel: Any) -> bool:
        """Whether there is a file for the kernel; it may be damaged."""
        name = self._name(kernel.declared, kernel.targetctx.codegen())
        return any((folder / name).is_file() for folder in cache_folders())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The stored machine code for a signature, None where there is none or it is damaged."""
        target_context.refresh()
        name = self._name(sig, target_context.codegen())
        for folder in cache_folders():
            with contextlib.suppress(OSError):
                content = (folder / name).read_bytes()
                if _checksum(content[CHECKSUM_BYTES:]) == content[:CHECKSUM_BYTES]:
                    compiled = _CompileResult._rebuild(target_context, *pickle.loads(content[CHECKSUM_BYTES:]))
                    _mark_used(folder, folder / name)
                    return compiled
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the machine code for a signature where that is possible; otherwise warn, once."""
        if data.library.has_dynamic_globals:
            raise ValueError(
                f"kernel {self._function.__qualname__} holds addresses of this process; it cannot be stored"
            )
        payload = _serialize.dumps(data._reduce())
        content, name, folders = _checksum(payload) + payload, self._name(sig, data.codegen), cache_folders()
        if not any(_write_whole(folder / name, content) for folder in folders):
            _warn_not_stored(folders)

    def enable(self) -> None:
        """Do nothing: the cache is always enabled."""

    def disable(self) -> None:
        """Do nothing: the cache is never disabled."""

    def flush(self) -> None:
        """Do nothing: files are replaced when the code is compiled again."""

    def _name(self, sig: Any, codegen: Any) -> str:
        digest = kernel_digest(self._function, sig, codegen.magic_tuple())
        return f"{self._function.__module__}.{self._function.__qualname__}-{digest}.kernel"


def _checksum(payload: bytes) -> bytes:
    return hashlib.sha256(payload).digest()


def _write_whole(path: Path, content: bytes) -> bool:
    """Write a file and move it into place; return whether that succeeded."""
    draft = path.with_name(f"{path.name}.{uuid.uuid4().hex}")
    try:
        if not path.parent.is_dir():
            path.parent.mkdir(parents=True, exist_ok=True)
            _prune(path.parent.parent.iterdir())
        draft.write_bytes(content)
        os.replace(draft, path)
        _prune(path.parent.glob(f"{path.name.rpartition('-')[0]}-*.kernel"))
    except OSError:
        with contextlib.suppress(OSError):
            draft.unlink(missing_ok=True)
        return False
    return True


def _prune(paths: Iterable[Path]) -> None:
    """Delete folders or files of kernels except the most recently used ones."""
    with contextlib.suppress(OSError):
        for path in sorted(paths, key=lambda path: path.stat().st_mtime)[:-KEPT]:
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def _mark_used(*paths: Path) -> None:
    for path in paths:
        with contextlib.suppress(OSError):
            os.utime(path)


_warned: list[str] = []


def _warn_not_stored(folders: list[Path]) -> None:
    if _warned:
        return
    locations = ", ".join(str(folder.parent) for folder in folders)
    _warned.append(
        f"compiled kernels cannot be stored: {locations} cannot be written; each start compiles them again, which "
        f"takes about half a minute; set NUMBA_CACHE_DIR to a folder that you can write"
    )
    warnings.warn(_warned[0], CacheWarning, stacklevel=2)
