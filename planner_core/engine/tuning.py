"""The shape of tiles and packets that suits a device: measured there and kept, or shipped; results never depend on it.

A shape is (rows, columns, lanes): beams of a tile down and across, and beams a packet, see kernels/trace_tile.h.

What `tlsplan tune` measured is kept in the user's cache folder, a file for each device, driver and state of the
kernels: another driver or other kernels find no file, and a file that can't be read counts as none. Then the shipped
shape is used; that is never an error.

`measure_shapes` has milliseconds a position by shape, of an engine on the device, beams and positions (local frame,
metres): what `tlsplan tune` chooses by.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from planner_core.cache import CACHE_VARIABLE, keep, kept_file, no_folder, read_kept
from planner_core.device import Device
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import DeviceError, RequirementError
from planner_core.model import BeamTemplate, FloatArray
from planner_core.progress import Progress, ProgressEvent, silent

Shape = tuple[int, int, int]
_SCHEMA = "tlsplan/tile-shape/1"
#: Rows and columns of beams a tile and beams a packet, of processors by `Device.max_lanes`: measured on PoCL 3.0 with
#: AVX2 and with AVX-512, docs/howto/device.md. On others a scalar packet lets a GPU's own lanes be the
#: packet: docs/benchmarks/gpu.md.
_CPU_SHAPE: dict[int, Shape] = {8: (8, 64, 8), 16: (16, 32, 16)}
_DEFAULT_SHAPE: Shape = (4, 8, 1)
#: Packet widths that kernels can be built for; a device takes those up to its `max_lanes`.
_LANES = (1, 2, 4, 8, 16)
#: Beams a tile at most: each holds eight bytes of a work-item's private memory.
_MAX_BEAMS = 2048
_given: ContextVar[Shape | None] = ContextVar("tile shape", default=None)
_n_kept = 0
#: Another shape has to be faster by this to take the place of the first one: less is noise, and a plain answer is
#: worth more than a percent.
_WORTH_A_CHANGE = 0.97


@dataclass(frozen=True)
class ShapeInUse:
    """A shape and where it is from: `given`, `measured` or `shipped`; `detail` is for a user."""

    shape: Shape
    origin: str
    detail: str


def shape_state() -> tuple[Shape | None, int]:
    """Another one than before where a shape was given or kept since: cheap to ask before every scan."""
    return _given.get(), _n_kept


def tile_shape(device: Device) -> Shape:
    """Rows and columns of beams a tile, and beams a packet, to be used on the device."""
    return shape_in_use(device).shape


def shape_in_use(device: Device) -> ShapeInUse:
    """As `tile_shape`, and where it is from."""
    given = _given.get()
    if given is not None:
        return ShapeInUse(given, "given", "by the caller")
    file = shape_file(device)
    kept, why_not = (None, "there is no cache folder") if file is None else _read(file)
    if kept is not None and kept[2] <= device.max_lanes:
        return ShapeInUse(kept, "measured", f"kept in {file}")
    if kept is not None:
        why_not = f"packets of {kept[2]}, which {file} keeps, do not run (`tlsplan tune` measures anew)"
    if device.kind == "cpu":
        return ShapeInUse(_shipped(device), "shipped", f"measured with PoCL 3.0; here {why_not}")
    return ShapeInUse(_shipped(device), "shipped", f"no shape was measured for a {device.kind} yet; here {why_not}")


@contextmanager
def use_shape(shape: Shape) -> Iterator[None]:
    """Let every device take this shape meanwhile: for measuring, and for showing that results don't depend on it.

    Raises
    ------
    RequirementError
        No kernel can be built for it, see `is_possible`.
    """
    if not is_possible(shape):
        raise RequirementError(
            f"tile shape: got {shape}, expected (rows, columns, lanes) with lanes one of {_LANES}, columns a multiple "
            f"of lanes and rows * columns a multiple of 8 * lanes, at most {_MAX_BEAMS}; use e.g. (8, 32, 8)"
        )
    token = _given.set(shape)
    try:
        yield
    finally:
        _given.reset(token)


def is_possible(shape: Shape) -> bool:
    """Whether kernels can be built for it: rectangles of packets are compared eight at a time."""
    rows, columns, lanes = shape
    if lanes not in _LANES or rows < 1 or columns < lanes or rows * columns > _MAX_BEAMS:
        return False
    return columns % lanes == 0 and (rows * columns) % (8 * lanes) == 0


def shapes_to_try(device: Device) -> tuple[Shape, ...]:
    """Shapes worth measuring on a device, the shipped one first."""
    lanes_to_try = tuple(n for n in (16, 8, 4) if n <= device.max_lanes) if device.kind == "cpu" else (1, 2, 4)
    # By what has been fast somewhere, so that the first few are worth a quick look.
    tiles = (
        (8, 64),
        (16, 32),
        (8, 32),
        (16, 64),
        (4, 64),
        (8, 128),
        (8, 16),
        (4, 32),
        (16, 16),
        (8, 8),
        (4, 16),
        (4, 8),
    )
    shipped = _shipped(device)
    others = ((rows, columns, lanes) for lanes in lanes_to_try for rows, columns in tiles)
    return (shipped, *(shape for shape in others if is_possible(shape) and shape != shipped))


def shape_file(device: Device) -> Path | None:
    """Where the shape measured on a device is kept, whether the file is there or not."""
    return kept_file("tile-shape", device.identity())


def keep_shape(device: Device, shape: Shape, milliseconds: dict[str, float]) -> Path:
    """Keep the shape measured on a device, for this user; `milliseconds` documents the measurement.

    Raises
    ------
    RequirementError
        No kernel can be built for the shape, or its file can't be written.
    """
    if not is_possible(shape):
        raise RequirementError(f"tile shape: got {shape}, expected one that kernels can be built for; measure again")
    file = shape_file(device)
    if file is None:
        raise no_folder()
    rows, columns, lanes = shape
    document = {
        "schema": _SCHEMA,
        **device.identity(),
        "tile_rows": rows,
        "tile_columns": columns,
        "lanes": lanes,
        "milliseconds": {name: round(milliseconds[name], 4) for name in sorted(milliseconds)},
    }
    try:
        keep(file, document)
    except OSError as error:
        raise RequirementError(
            f"{file}: can't be written ({error.strerror}), expected a writable folder for the measured shape; "
            f"set {CACHE_VARIABLE} to one"
        ) from error
    global _n_kept
    _n_kept += 1
    _read.cache_clear()
    return file


@dataclass(frozen=True)
class ShapeTimes:
    """Milliseconds a position of `visible_patches`, the least of all rounds; shapes that did not build, with why."""

    milliseconds: dict[Shape, float]
    refused: dict[Shape, str]

    def best(self) -> Shape:
        """Return the fastest shape; the first one measured where no other is clearly faster."""
        first = next(iter(self.milliseconds))
        fastest = min(self.milliseconds, key=lambda shape: self.milliseconds[shape])
        clearly = self.milliseconds[fastest] < _WORTH_A_CHANGE * self.milliseconds[first]
        return fastest if clearly else first


def measure_shapes(
    engine: ScanEngine,
    template: BeamTemplate,
    positions_m: FloatArray,
    shapes: Sequence[Shape],
    *,
    n_rounds: int = 5,
    clock: Callable[[], float] = time.perf_counter,
    progress: Progress = silent,
) -> ShapeTimes:
    """Time `visible_patches`, which is what planning spends its scans on, in every shape.

    Shapes take turns, so that whatever else the machine does meanwhile hits all of them; the least time of a shape is
    the one that was disturbed least. Programs are built and tiles made before the clock starts.

    Parameters
    ----------
    positions_m
        (S, 3), scanned together.
    clock
        Seconds that only go forward; wall time, or processor time on a busy machine.

    Raises
    ------
    DeviceError
        No shape builds.
    """
    least: dict[Shape, float] = {}
    refused: dict[Shape, str] = {}
    for round_ in range(n_rounds):
        for index, shape in enumerate(shapes):
            if shape in refused:
                continue
            with use_shape(shape):
                try:
                    engine.visible_patches(template, positions_m[:1])
                    started_s = clock()
                    engine.visible_patches(template, positions_m)
                    elapsed_s = clock() - started_s
                except DeviceError as error:
                    refused[shape] = str(error)
                    continue
            least[shape] = min(least.get(shape, np.inf), 1e3 * elapsed_s / positions_m.shape[0])
            progress(ProgressEvent("tune", round_ * len(shapes) + index + 1, n_rounds * len(shapes), str(shape)))
    if not least:
        raise DeviceError(
            f"tuning: none of {len(shapes)} tile shapes runs on {engine.device}, expected at least one: "
            f"{next(iter(refused.values()), 'none was given')}"
        )
    return ShapeTimes({shape: ms for shape, ms in least.items() if shape not in refused}, refused)


def _shipped(device: Device) -> Shape:
    return _CPU_SHAPE[device.max_lanes] if device.kind == "cpu" else _DEFAULT_SHAPE


@lru_cache(maxsize=64)
def _read(file: Path) -> tuple[Shape | None, str]:
    """Return the shape that a file keeps; or None, and why in words that follow "here"."""
    try:
        document = read_kept(file, _SCHEMA)
    except FileNotFoundError:
        return None, "not measured with this driver and these kernels (run `tlsplan tune`)"
    except OSError as error:
        return None, f"{file} can't be read ({' '.join(str(error).split())})"
    except ValueError:
        document = {}
    found = tuple(document.get(name) for name in ("tile_rows", "tile_columns", "lanes"))
    if all(type(value) is int for value in found) and is_possible(found):  # type: ignore[arg-type]
        rows, columns, lanes = found
        return (rows, columns, lanes), ""  # type: ignore[return-value]
    return None, f"{file} holds no tile shape that kernels can be built for (`tlsplan tune` writes a new one)"
