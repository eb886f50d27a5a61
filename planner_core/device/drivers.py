"""The OpenCL drivers that are there, and their devices as pyopencl has them.

The loader finds drivers that the system names (`/etc/OpenCL/vendors`) and the PoCL beside pyopencl. Intel's runtime for
processors, `pip install tlsplan[intel]`, is found by neither: its package names a place that does not exist. So where
it is installed, and the user has not set the loader's own variables, the loader is shown a folder that names it
and all that the system names. The loader reads it once, at its first call, and it is gone after that.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from planner_core.device import pocl
from planner_core.device.faults import driver_errors
from planner_core.errors import DeviceError
from planner_core.operating_system import n_usable_cores

#: The loader is there and no driver is (PLATFORM_NOT_FOUND_KHR); a driver is there and its device is not.
_NOTHING_THERE = frozenset({-1001, -1})
#: What the loader of pyopencl's wheels, ocl-icd, reads: a folder in place of the system's.
_VENDORS_VARIABLE = "OCL_ICD_VENDORS"
#: By which users tell a loader where drivers are; Khronos' loader reads the last one.
_USERS_VARIABLES = (_VENDORS_VARIABLE, "OPENCL_VENDOR_PATH", "OCL_ICD_FILENAMES")
_SYSTEM_VENDORS = Path("/etc/OpenCL/vendors")
_INTEL_PACKAGE = "intel-opencl-rt"
_INTEL_LIBRARY = "libintelocl.so"
_THREADS = "libtbb.so.12"
#: Of the file that names it: last by name, so that the system's drivers come first, as without it.
_OURS = "zz-tlsplan-intel.icd"
#: Binds each of PoCL's workers to a core of its own. Otherwise Linux, after the calling thread has been busy, wakes two
#: of them on ONE core, where the second waits until the first is done: docs/method/scan-engine.md.
_BIND_WORKERS = "POCL_AFFINITY"
#: How many workers there are, where the user sets it.
_N_WORKERS = "POCL_MAX_PTHREAD_COUNT"
_loading = threading.Lock()
_loader_was_called = False


def all_devices() -> list[Any]:
    """Every device of every driver, in the loader's order; empty where there is none.

    Raises
    ------
    DeviceError
        pyopencl itself can't be loaded, or the loader fails.
    """
    try:
        import pyopencl
    except (ImportError, OSError) as error:
        raise DeviceError(
            f"pyopencl can't be loaded ({str(error).splitlines()[0]}), expected a working one; see `tlsplan doctor`"
        ) from error
    # Worker 0 goes to core 0, and so on: right where this process may use every core and there is a worker for each.
    # Fewer workers of several processes would crowd the first cores; and a core that is not ours is refused or taken.
    if n_usable_cores() == os.cpu_count() and _N_WORKERS not in os.environ:
        os.environ.setdefault(_BIND_WORKERS, "1")  # read when workers start, at the first call; a user's own stays
    with driver_errors("listing OpenCL devices", "the OpenCL loader"), _loading, _drivers_shown():
        try:
            platforms = pyopencl.get_platforms()
        except pyopencl.Error as error:
            if error.code in _NOTHING_THERE:
                return []
            raise
    devices = []
    for platform in platforms:
        try:
            found = platform.get_devices()
        except pyopencl.Error:
            # No device of this driver, or a broken driver beside one that works: others may serve.
            continue
        if platform.name.strip() == pocl.POCL:
            for device in found:
                pocl.name_processor(device)
        devices.extend(found)
    return devices


def intel_library() -> Path | None:
    """Return Intel's runtime for processors where its package is installed, else None."""
    try:
        files = importlib.metadata.files(_INTEL_PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    found = (Path(str(file.locate())).resolve() for file in files if file.name == _INTEL_LIBRARY)
    return next((path for path in found if path.is_file()), None)


def load_shared_threads() -> None:
    """Load the thread library that Intel's runtime and Open3D share, if the runtime is installed: call before Open3D.

    Both load `libtbb.so.12`, and a process has one of that name. Open3D's own is older, and Intel's runtime does not
    load beside it; the newer one serves both.
    """
    library = intel_library()
    if library is not None:
        with suppress(OSError):  # the loader of OpenCL will tell that Intel's runtime does not load
            ctypes.CDLL(str(library.with_name(_THREADS)))


@contextmanager
def _drivers_shown() -> Iterator[None]:
    """Let the loader find Intel's runtime too, should this be its first call."""
    global _loader_was_called
    is_first, _loader_was_called = not _loader_was_called, True
    library = intel_library() if is_first and not any(os.environ.get(name) for name in _USERS_VARIABLES) else None
    named = {file.name: file.read_bytes() for file in sorted(_SYSTEM_VENDORS.glob("*.icd"))}
    if library is None or any(_INTEL_LIBRARY.encode() in text for text in named.values()):
        yield
        return
    with ExitStack() as done_with:
        # Without room for two small files there is one driver less, which is no reason to end here.
        with suppress(OSError):
            folder = done_with.enter_context(tempfile.TemporaryDirectory(prefix="tlsplan-drivers-"))
            for name, text in {**named, _OURS: f"{library}\n".encode()}.items():
                Path(folder, name).write_bytes(text)
            os.environ[_VENDORS_VARIABLE] = folder
            done_with.callback(os.environ.pop, _VENDORS_VARIABLE, None)
        yield
