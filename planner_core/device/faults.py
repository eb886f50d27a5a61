"""What an error of the driver means to a user: which of our errors it becomes, with the remedy.

A driver reports by number. Three kinds matter to callers: memory that ran out (`DeviceMemoryError`: less work at a time
may do), a device that is gone (nothing will do on it) and all the rest.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from planner_core.errors import DeviceError, DeviceMemoryError

#: MEM_OBJECT_ALLOCATION_FAILURE, OUT_OF_RESOURCES, OUT_OF_HOST_MEMORY. NVIDIA's driver gives OUT_OF_RESOURCES for a
#: kernel that it stopped, too; the calls after that one then say that the device is gone.
_MEMORY_CODES = frozenset({-4, -5, -6})
#: DEVICE_NOT_AVAILABLE; INVALID_CONTEXT and INVALID_COMMAND_QUEUE, which drivers return for ours, valid ones, after a
#: fault has made them give the device up.
_LOST_CODES = frozenset({-2, -34, -36})
#: COMPILER_NOT_AVAILABLE.
_NO_COMPILER_CODE = -3
_ELSE = "or scan without OpenCL (`--engine open3d`)"


def device_error(what: str, device: str, code: int, words: str) -> DeviceError:
    """Return the error for a driver's status `code`, with the words `words`, while doing `what` on `device`."""
    got = f"({' '.join(words.split())[:200]})"
    if code in _MEMORY_CODES:
        return DeviceMemoryError(
            f"{what}: {device} ran out of memory {got}, expected enough; close other programs that use it, "
            f"take a larger device or a smaller scene, {_ELSE}"
        )
    if code in _LOST_CODES:
        return DeviceError(
            f"{what}: {device} was lost {got}, expected it to work to the end; nothing of this run is kept; "
            f"see whether `tlsplan doctor` still finds it and run again, {_ELSE}"
        )
    if code == _NO_COMPILER_CODE:
        return DeviceError(
            f"{what}: {device} has no compiler {got}, expected a driver with one; install the maker's full driver, "
            f"take another device (`--device`), {_ELSE}"
        )
    return DeviceError(
        f"{what}: {device} failed {got}, expected it to work; see `tlsplan doctor`, take another device (`--device`), "
        f"{_ELSE}"
    )


@contextmanager
def driver_errors(what: str, device: str) -> Iterator[None]:
    """Turn an error of the driver into a `DeviceError` that names what was being done."""
    import pyopencl

    try:
        yield
    except pyopencl.Error as error:
        raise device_error(what, device, int(error.code), str(error)) from error


def in_batches(
    n_items: int, n_batch: int, work: Callable[[int, int], None], *, on_smaller: Callable[[str], None]
) -> None:
    """Call `work(first, end)` over all items in order, `n_batch` at a time; halve the batch where memory runs out.

    A batch that failed is done anew from its first item, so `work` must not keep anything of a call that raised.

    Parameters
    ----------
    n_items, n_batch
        How many there are, and how many a batch has at first; at least 1.
    on_smaller
        Gets one line for the user, once, when the batch is halved for the first time.

    Raises
    ------
    DeviceMemoryError
        One item alone does not fit.
    """
    first, is_reported = 0, False
    while first < n_items:
        end = min(first + n_batch, n_items)
        try:
            work(first, end)
        except DeviceMemoryError as error:
            if end - first <= 1:
                raise
            n_batch = (end - first) // 2
            gc.collect()  # frames of the error may hold buffers in cycles: what they take is wanted now
            if not is_reported:
                on_smaller(
                    f"the device ran out of memory with {end - first} positions at a time; went on with {n_batch} and, "
                    f"where needed, fewer (slower, same results): {str(error).partition(', expected')[0]}"
                )
                is_reported = True
            continue
        first = end
