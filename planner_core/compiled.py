"""Functions that numba compiles for the processor at hand, among them twins of kernels for machines without OpenCL.

`compiled` is the only way to numba in this project. Importing this module imports it, which takes a third of a second:
modules that compile functions are imported where they are used, not at the head of others.

Compiled code is kept below our cache folder (`planner_core.cache`), as a driver keeps kernels; where
that can't be written, functions are compiled anew in every process. numba compiles anew when a function's file changes,
and looks at no other file: functions call, and take constants from, their own file alone.

Floating point is as NumPy's: numba neither contracts a * b + c nor reorders sums unless an option allows it, and none
does.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from planner_core.cache import cache_folder
from planner_core.errors import MissingPackageError
from planner_core.operating_system import n_usable_cores

#: numba's own name of the folder: whoever has set it knows better.
_FOLDER_VARIABLE = "NUMBA_CACHE_DIR"
#: Fewer items than these are not worth a thread of their own.
_LEAST_A_PART = 32
_Function = TypeVar("_Function", bound=Callable[..., Any])


def _can_keep() -> bool:
    """Lead numba to the cache folder, and return whether it can be written: numba gives up where it can't be."""
    given = os.environ.get(_FOLDER_VARIABLE)
    ours = cache_folder()
    folder = given or (str(ours / "numba") if ours is not None else None)
    if folder is None:
        return False
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    os.environ[_FOLDER_VARIABLE] = folder
    return os.access(folder, os.W_OK | os.X_OK)


_KEEP = _can_keep()

try:
    import numba  # reads where to keep things as it is imported
except (ImportError, OSError) as error:
    raise MissingPackageError(
        f"numba can't be loaded ({str(error).splitlines()[0]}), expected a working numba package; see `tlsplan doctor`"
    ) from error


def compiled(function: _Function) -> _Function:
    """Compile a function when it is first called, for arguments of those types; it lets other threads run."""
    made: _Function = numba.njit(nogil=True, cache=_KEEP)(function)
    return made


def in_threads(work: Callable[[int], None], n: int) -> None:
    """Call `work` with 0 .. n - 1, in any order and several at once, and wait for all; the first error is raised."""
    if n <= 1 or n_usable_cores() == 1:
        for index in range(n):
            work(index)
        return
    with ThreadPoolExecutor(min(n, n_usable_cores()), thread_name_prefix="compiled") as threads:
        list(threads.map(work, range(n)))


def share_out(work: Callable[[int, int], None], n: int) -> None:
    """Call `work(first, end)` for parts of 0 .. n - 1, one a thread; few are one part, in this thread."""
    parts = max(1, min(n_usable_cores(), n // _LEAST_A_PART))
    in_threads(lambda part: work(part * n // parts, (part + 1) * n // parts), parts)
