"""One open device: memory totalled before it is taken, programs built once a process, driver errors as DeviceError.

CONTROL FLOW: one queue, in order. Launching returns at once. Results leave the device through `Device.read` and
`Device.outputs` only, and both look first at the fate of EVERY kernel launched so far: a driver reports a kernel that
it aborted in the kernel's own event, and nowhere else for certain.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.device.faults import device_error, driver_errors
from planner_core.device.pocl import HIGHEST_LEVEL, name_given
from planner_core.device.sources import kernel_source, kernels_hash
from planner_core.environment_variables import memory_from_env
from planner_core.errors import DeviceError, DeviceMemoryError

#: Device memory that we may use at most, such as `8GB` or `500MB`; unset: what the device has.
MEMORY_VARIABLE = "TLSPLAN_MEMORY"
#: Share of the device's memory that we take at most: drivers and other programs need some too.
_USABLE_SHARE = 0.9
#: BUILD_PROGRAM_FAILURE, COMPILE_PROGRAM_FAILURE, LINK_PROGRAM_FAILURE, INVALID_BUILD_OPTIONS: there is a log to read.
_BUILD_FAILURES = frozenset({-11, -15, -17, -43})
#: LLVM's message where a signal, such as a Ctrl-C that others hear too, came while it wrote: it removes the file then.
_LOST_FILE = "unable to rename temporary"
NARROW_LANES = 8
"""Floats side by side that kernels may be built for on every device."""
_WIDE_LANES = 16
#: NumPy asks for large pages from here on.
_LARGE_BYTES = 4 * 2**20
#: Bytes; the largest vector type of OpenCL.
_ALIGNMENT = 128
#: Launches whose fate has not been checked yet; their events hold memory of the driver.
_MAX_LAUNCHED = 1024
#: GPUs divide to 2.5 units in the last place unless the build asks for the nearest float, as processors always do.
_EXACT_QUOTIENTS = "-cl-fp32-correctly-rounded-divide-sqrt"


class Buffer:
    """Device memory. `n_bytes` counts against the device until `release` or the end of its life."""

    def __init__(self, device: Device, handle: Any, n_bytes: int, memory: NDArray[np.uint8] | None = None) -> None:
        self._device, self.handle, self.n_bytes = device, handle, n_bytes
        self._memory = memory  # where it is of ours: kernels in the queue may use it after `release`

    def release(self) -> None:
        """Give the memory back; a second call does nothing."""
        if self.handle is None:
            return
        handle, self.handle = self.handle, None
        self._device.held_bytes -= self.n_bytes
        if self._memory is not None:
            self._device.outlived.append(self._memory)
            self._memory = None
        # A lost device refuses even this; its memory is gone with it, and the error that reported it is on its way.
        with suppress(self._device.driver_error):
            handle.release()

    def __del__(self) -> None:
        self.release()


class Program:
    """Built kernels of one source file."""

    def __init__(self, device: Device, built: Any, title: str) -> None:
        self._device, self._built, self._title = device, built, title
        self._kernels: dict[tuple[str, tuple[np.dtype[Any] | None, ...]], Any] = {}

    def run(self, kernel: str, global_size: tuple[int, ...], *arguments: object) -> None:
        """Queue a kernel over `global_size` work-items. Arguments: `Buffer`s and NumPy scalars or vectors.

        On a CPU a group is one work-item, since each is much work: groups then spread evenly over the cores. Elsewhere
        the driver chooses.

        Kernels run in the order they were queued in. Nothing is queued for an empty NDRange.

        Raises
        ------
        DeviceError
            The launch is refused. What goes wrong later is raised by `Device.read`, `Device.outputs`, `Device.finish`.
        """
        if 0 in global_size:
            return
        import pyopencl

        device = self._device
        what = f"kernel {kernel} of {self._title}"
        local_size = (1,) * len(global_size) if device.kind == "cpu" else None
        # Given the types beforehand, pyopencl need not find out, number by number, what each is not: that took more
        # than half of a launch.
        key = (kernel, tuple(map(_type_of_argument, arguments)))
        with driver_errors(what, device.label):
            launch = self._kernels.get(key)
            if launch is None:
                launch = self._kernels[key] = pyopencl.Kernel(self._built, kernel)
                launch.set_arg_types(key[1])
            launch.set_args(*(item.handle if isinstance(item, Buffer) else item for item in arguments))
            device.note_launch(what, pyopencl.enqueue_nd_range_kernel(device.queue, launch, global_size, local_size))


class _Context:
    """A driver's context of one device, with what was built in it."""

    def __init__(self, device: Any) -> None:
        import pyopencl

        self.handle = pyopencl.Context([device])
        self.built: dict[tuple[str, tuple[str, ...]], Any] = {}


#: By device: whoever opens it again in this process need not build our kernels again. Even where the driver has them on
#: disk, that is much of the time of a small plan. A context in which a kernel failed is not used again: some drivers
#: fail ever after.
_contexts: dict[Any, _Context] = {}


class Device:
    """An open device with one queue in order. See `planner_core.device.open_device`."""

    def __init__(self, device: Any, *, label: str, kind: str) -> None:
        import pyopencl

        self.label, self.kind = label, kind
        with driver_errors("opening the device", label):
            self._shared = _contexts.get(device) or _contexts.setdefault(device, _Context(device))
            self.context = self._shared.handle
            self.queue = pyopencl.CommandQueue(self.context, device)
            self.name = str(device.name).strip()
            self.driver = f"{device.platform.version} {device.driver_version}".strip()
            self.n_compute_units = int(device.max_compute_units)
            self.memory_bytes = min(int(device.global_mem_size), memory_allowed())
            self.max_buffer_bytes = int(device.max_mem_alloc_size)
            n_native = int(device.native_vector_width_float)
            rounds_rightly = device.single_fp_config & pyopencl.device_fp_config.CORRECTLY_ROUNDED_DIVIDE_SQRT
        #: The processor that the driver was set to compile for, because it does not know this one; else None.
        self.compiled_for = name_given(device)
        #: Floats side by side that the processor has and the driver makes use of.
        is_wide = kind == "cpu" and n_native >= _WIDE_LANES and self.compiled_for in (None, HIGHEST_LEVEL)
        self.native_lanes = _WIDE_LANES if is_wide else NARROW_LANES
        #: Those that kernels may be built for: `planner_core.device.check` lowers it where wider kernels fail.
        self.max_lanes = self.native_lanes
        #: What the driver raises, kept for when the interpreter ends: nothing can be imported any more by then.
        self.driver_error: type[Exception] = pyopencl.Error
        self.held_bytes = 0
        self._options = (_EXACT_QUOTIENTS,) if kind != "cpu" and rounds_rightly else ()
        #: Memory of ours whose buffer was released: it goes when nothing runs any more.
        self.outlived: list[NDArray[np.uint8]] = []
        self._launched: list[tuple[str, Any]] = []
        self._programs: dict[tuple[str, tuple[str, ...]], Program] = {}

    def identity(self) -> dict[str, str]:
        """What anything found out about this device holds for: another driver or kernels may behave otherwise.

        The number of cores counts: work is shared out among them.
        """
        return {
            "device": f"{self.name}, {self.n_compute_units} compute units",
            "driver": f"{self.driver}, for {self.compiled_for}" if self.compiled_for else self.driver,
            "kernels": kernels_hash(),
        }

    @property
    def free_bytes(self) -> int:
        """What may still be taken: nine tenths of the device's memory, less what this object holds."""
        return int(self.memory_bytes * _USABLE_SHARE) - self.held_bytes

    def program(self, file: str, defines: Mapping[str, int]) -> Program:
        """Build `kernels/<file>` with -D defines, or take it from the cache; drivers keep theirs on disk.

        Raises
        ------
        DeviceError
            It does not build: the log's first error, and the file with the full log.
        """
        return self.program_from_source(kernel_source(file), title=file, defines=defines)

    def program_from_source(self, source: str, *, title: str, defines: Mapping[str, int]) -> Program:
        """Build OpenCL C text, whose `#include "x.h"` of our own headers are already expanded."""
        options = (*self._options, *(f"-D{name}={value}" for name, value in sorted(defines.items())))
        if self.compiled_for:
            # Caches of compiled kernels go by the name that the driver found, which many processors share.
            options = (*options, f"-DCOMPILED_FOR_{self.compiled_for.upper().replace('-', '_')}")
        key = (source, options)
        if key not in self._programs:
            if key not in self._shared.built:
                self._shared.built[key] = self._build(source, options, title)
            self._programs[key] = Program(self, self._shared.built[key], title)
        return self._programs[key]

    def _build(self, source: str, options: tuple[str, ...], title: str, *, is_second: bool = False) -> Any:
        import pyopencl

        try:
            with warnings.catch_warnings():
                # The compiler's remarks about a program that builds are of no use to a user.
                warnings.simplefilter("ignore", pyopencl.CompilerWarning)
                return pyopencl.Program(self.context, source).build(options=list(options))
        except pyopencl.Error as error:
            if _LOST_FILE in str(error) and not is_second:
                return self._build(source, options, title, is_second=True)
            if error.code not in _BUILD_FAILURES:
                raise device_error(f"building {title}", self.label, int(error.code), str(error)) from error
            log = str(error)
            with tempfile.NamedTemporaryFile(
                "w", prefix=f"tlsplan-{title}-", suffix=".log", delete=False, encoding="utf-8"
            ) as file:
                file.write(log)
            lines = [line.strip() for line in log.splitlines() if "error" in line.lower()] or log.splitlines()
            raise DeviceError(
                f"{title} does not build on {self.label}: {(lines or ['no log'])[0][:200]}; the full log is "
                f"{file.name}; take another device (`--device`), or scan without OpenCL (`--engine open3d`)"
            ) from error

    def reserve(self, what: str, sizes_bytes: Mapping[str, int]) -> None:
        """Check that buffers of these sizes fit, all together and each, BEFORE any is made.

        Raises
        ------
        DeviceMemoryError
            They don't: requested and available.
        """
        total = sum(sizes_bytes.values())
        if total > self.free_bytes:
            raise DeviceMemoryError(
                f"{what}: {_mib(total)} requested on {self.label}, {_mib(self.free_bytes)} available; "
                "use a larger device, a smaller scene or fewer positions per call"
            )
        for name, size in sizes_bytes.items():
            if size > self.max_buffer_bytes:
                raise DeviceMemoryError(
                    f"{what}: {_mib(size)} requested for {name} on {self.label}, one buffer can have "
                    f"{_mib(self.max_buffer_bytes)}; use a larger device or a smaller scene"
                )

    def upload(self, what: str, arrays: Mapping[str, NDArray[Any]]) -> dict[str, Buffer]:
        """Copy arrays to the device, by name; their total is checked first."""
        import pyopencl

        self.reserve(what, {name: array.nbytes for name, array in arrays.items()})
        flags = pyopencl.mem_flags.READ_WRITE | pyopencl.mem_flags.COPY_HOST_PTR
        buffers = {}
        for name, array in arrays.items():
            with driver_errors(f"{what}: {name}", self.label):
                # A buffer of nothing is an error in OpenCL; one byte stands for it.
                source = np.ascontiguousarray(array) if array.size else np.zeros(1, dtype=np.uint8)
                buffers[name] = self._keep(pyopencl.Buffer(self.context, flags, hostbuf=source), array.nbytes)
        return buffers

    @contextmanager
    def inputs(self, what: str, arrays: Mapping[str, NDArray[Any]]) -> Iterator[dict[str, Buffer]]:
        """Buffers that kernels only read and that ARE the arrays (on a CPU) or copies of them (elsewhere).

        A copy to fresh memory takes as much as a fifth of the time that casting its rays does. Kernels must be done
        before this is left, as they are after `outputs` or `finish`; nothing may write to the arrays meanwhile.
        """
        import pyopencl

        buffers: dict[str, Buffer] = {}
        try:
            if self.kind == "cpu" and all(array.size for array in arrays.values()):
                self.reserve(what, {name: array.nbytes for name, array in arrays.items()})
                flags = pyopencl.mem_flags.READ_ONLY | pyopencl.mem_flags.USE_HOST_PTR
                for name, array in arrays.items():
                    with driver_errors(f"{what}: {name}", self.label):
                        source = np.ascontiguousarray(array)
                        buffers[name] = self._keep(pyopencl.Buffer(self.context, flags, hostbuf=source), array.nbytes)
            else:
                buffers = self.upload(what, arrays)
            yield buffers
        except BaseException:
            self._drain()  # kernels may still be reading the arrays, which the caller is about to drop
            raise
        finally:
            for buffer in buffers.values():
                buffer.release()

    def allocate(self, what: str, n_bytes: int, *, is_filled: bool = False) -> Buffer:
        """Take uninitialised memory. `is_filled`: kernels write all of it, so that large pages do a CPU good."""
        import pyopencl

        self.reserve(what, {what: n_bytes})
        flags, memory = pyopencl.mem_flags.READ_WRITE, None
        if is_filled and self.kind == "cpu" and n_bytes >= _LARGE_BYTES:
            with suppress(MemoryError):  # the driver reports it, below
                memory = _large_pages(n_bytes)
        with driver_errors(what, self.label):
            if memory is None:
                handle = pyopencl.Buffer(self.context, flags, size=max(n_bytes, 1))
            else:
                handle = pyopencl.Buffer(self.context, flags | pyopencl.mem_flags.USE_HOST_PTR, hostbuf=memory)
        return self._keep(handle, n_bytes, memory)

    def shrink(self, buffer: Buffer, n_bytes: int) -> Buffer:
        """Queue moving the first bytes of a buffer to one of just their size; the old one is given back."""
        import pyopencl

        head = self.allocate("head of a buffer", n_bytes)
        with driver_errors("moving a buffer", self.label):
            if n_bytes:
                event = pyopencl.enqueue_copy(self.queue, head.handle, buffer.handle, byte_count=n_bytes)
                self.note_launch("moving a buffer", event)
        buffer.release()
        return head

    def zero(self, buffer: Buffer, n_bytes: int) -> None:
        """Queue filling the first bytes of a buffer with zero."""
        import pyopencl

        with driver_errors("clearing a buffer", self.label):
            pyopencl.enqueue_fill_buffer(self.queue, buffer.handle, np.uint8(0), 0, n_bytes)

    def read(self, buffer: Buffer, into: NDArray[Any]) -> None:
        """Wait for everything queued and copy a buffer's head to `into`, which must be contiguous.

        Raises
        ------
        DeviceError
            The copy failed, or any kernel launched before it did: then `into` holds nothing of use.
        """
        import pyopencl

        self.finish("reading results")
        if into.size:
            with driver_errors("reading results", self.label):
                pyopencl.enqueue_copy(self.queue, into, buffer.handle)

    def finish(self, what: str) -> None:
        """Wait for everything queued.

        Raises
        ------
        DeviceError
            Waiting failed, or a kernel launched since the last call did not complete.
        """
        launched, self._launched = self._launched, []
        try:
            with driver_errors(what, self.label):
                self.queue.finish()
        except DeviceError:
            self._abandon_context()
            # A kernel's own failure is more specific than that of the queue, which it may have brought down.
            self._look_at(launched)
            raise
        self.outlived.clear()
        self._look_at(launched)

    def _abandon_context(self) -> None:
        for device, shared in list(_contexts.items()):
            if shared is self._shared:
                del _contexts[device]

    def _look_at(self, launched: list[tuple[str, Any]]) -> None:
        for kernel, event in launched:
            with driver_errors(kernel, self.label):
                status = int(event.command_execution_status)
            if status < 0:
                self._abandon_context()
                raise device_error(kernel, self.label, status, f"the driver aborted it with status {status}")

    def note_launch(self, what: str, event: Any) -> None:
        """Remember a command whose fate `finish` has to look at; `what` names it in errors."""
        if len(self._launched) >= _MAX_LAUNCHED:
            self.finish(what)
        self._launched.append((what, event))

    @contextmanager
    def outputs(self, what: str, arrays: Mapping[str, NDArray[Any]]) -> Iterator[dict[str, Buffer]]:
        """Buffers that kernels write and that ARE the arrays (on a CPU) or get copied to them (elsewhere) on leaving.

        A CPU device writes straight to the arrays' memory: a copy would cost as much as a fifth of a scan. There a
        buffer is aligned as NumPy aligns, to 16 bytes: kernels store whole vectors with vstore.

        Raises
        ------
        DeviceError
            Any kernel launched so far did not complete, or the copy failed: the arrays then hold nothing of use.
        """
        self.reserve(what, {name: array.nbytes for name, array in arrays.items()})
        buffers: dict[str, Buffer] = {}
        try:
            for name, array in arrays.items():
                with driver_errors(f"{what}: {name}", self.label):
                    buffers[name] = self._output_buffer(array)
            yield buffers
            for name, array in arrays.items():
                if array.size:
                    self._bring_back(f"{what}: {name}", buffers[name], array)
            # Once for kernels and copies: each wait costs as much as fifteen thousand beams.
            self.finish(what)
        except BaseException:
            self._drain()  # kernels may still be writing to the arrays, which the caller is about to drop
            raise
        finally:
            for buffer in buffers.values():
                buffer.release()

    def _output_buffer(self, array: NDArray[Any]) -> Buffer:
        import pyopencl

        flags = pyopencl.mem_flags.READ_WRITE  # kernels add to what they have written
        if self.kind == "cpu" and array.size:
            return self._keep(
                pyopencl.Buffer(self.context, flags | pyopencl.mem_flags.USE_HOST_PTR, hostbuf=array), array.nbytes
            )
        return self._keep(pyopencl.Buffer(self.context, flags, size=max(array.nbytes, 1)), array.nbytes)

    def _bring_back(self, what: str, buffer: Buffer, into: NDArray[Any]) -> None:
        """Queue what lets the host see a buffer; done when `finish` is."""
        import pyopencl

        with driver_errors(what, self.label):
            if self.kind != "cpu":
                self.note_launch(what, pyopencl.enqueue_copy(self.queue, into, buffer.handle, is_blocking=False))
                return
            # Mapping hands the memory over to the host; on a CPU nothing moves.
            mapped, event = pyopencl.enqueue_map_buffer(
                self.queue, buffer.handle, pyopencl.map_flags.READ, 0, into.shape, into.dtype, is_blocking=False
            )
            self.note_launch(what, event)
            mapped.base.release(self.queue)

    def _drain(self) -> None:
        """Wait until nothing runs any more, whatever became of it: an error is on its way already."""
        self._launched.clear()
        with suppress(self.driver_error):
            self.queue.finish()
            self.outlived.clear()

    def _keep(self, handle: Any, n_bytes: int, memory: NDArray[np.uint8] | None = None) -> Buffer:
        self.held_bytes += n_bytes
        return Buffer(self, handle, n_bytes, memory)

    def __del__(self) -> None:
        if self.__dict__.get("outlived"):
            self._drain()


def memory_allowed() -> int:
    """What `MEMORY_VARIABLE` allows, in bytes; a wrong one is a RequirementError, which no fallback swallows."""
    limit_bytes = memory_from_env(MEMORY_VARIABLE)
    return sys.maxsize if limit_bytes is None else limit_bytes


def has_float64(device: Device) -> bool:
    """Whether kernels may use double on `device`."""
    return "cl_khr_fp64" in device.queue.device.extensions.split()


def _type_of_argument(item: Any) -> np.dtype[Any] | None:
    if isinstance(item, Buffer):
        return None
    return item.dtype if isinstance(item, np.generic) else np.dtype((np.void, item.nbytes))


def _large_pages(n_bytes: int) -> NDArray[np.uint8]:
    """Memory aligned as a driver's own. NumPy asks for large pages, which take the operating system a fraction of the
    time where they are new: a fifth of building a tree of millions of triangles went into small ones.
    """
    memory = np.empty(n_bytes + _ALIGNMENT, dtype=np.uint8)
    start = -memory.ctypes.data % _ALIGNMENT
    return memory[start : start + n_bytes]


def _mib(n_bytes: int) -> str:
    return f"{n_bytes / 2**20:.1f} MiB"
