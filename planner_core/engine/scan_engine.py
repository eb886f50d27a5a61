"""What a scan engine is; `open_engine.py` chooses one.

Every engine keeps these rules, in the local frame and metres:

- Triangles are hit from both sides. The first surface along a beam ends it. In scans, glass lets beams pass and
  mirrors end them without a return (`planner_core.model.Optics`); free rays meet every surface.
- Vertices, origins and directions are float64 values rounded to float32 once; nothing is rounded twice.
- `range_min_m <= range <= range_max_m` is a return, both ends included. A surface nearer than `range_min_m` blocks the
  beam and gives no return.
- A miss is range NaN, triangle -1, patch -1, cosine NaN.
- The OpenCL engine is watertight: triangles are larger by the bound of rounding. A beam that hits nothing but such a
  margin, about 1 in 100 000 indoors, gets range and triangle but no patch, so that no hidden face counts as seen;
  docs/method/watertight.md has the exceptions. A position on a surface is blocked all round.
- The patch is that of `docs/method/patches.md` at the hit. Two triangles hit at one and the same float32 range: the
  lower number wins in the OpenCL engine; Open3D makes no promise.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import (
    BeamTemplate,
    FloatArray,
    Int64Array,
    PatchReturns,
    RayHits,
    ScanBatch,
    Visibility,
)
from planner_core.progress import Progress, silent

#: Farthest from the local origin that anything may lie. float32 has 24 bits: beyond 100 km a vertex is off by
#: millimetres and squares lose the edges; far beyond, the kernels' box tests overflow.
REACH_M = 1e5


class ScanEngine(Protocol):
    """Casts beams into one scene, which it holds in its own form."""

    name: str
    """`opencl` or `open3d`."""
    device: str
    """Where it runs, for the record."""
    warnings: tuple[str, ...]
    """One line each, for the user: a fallback, for example."""

    def cast_rays(
        self, origins_m: FloatArray, directions: FloatArray, *, range_max_m: float, through_glass: bool = False
    ) -> RayHits:
        """First hits of N free rays: origins (N, 3), directions (N, 3) of any length but zero; ranges are metres.

        Glass and mirrors are hit as all surfaces are; `through_glass`, glass that beams pass is not.

        Raises RequirementError where an origin or direction is not finite, a direction is zero, shapes disagree or the
        range is not positive.
        """
        ...

    def scan(self, template: BeamTemplate, positions_m: FloatArray) -> ScanBatch:
        """Scan from every one of positions (S, 3), the sensor's origin."""
        ...

    def visible_patches(
        self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent
    ) -> Visibility:
        """Patches that the returns of a scan from each of positions (N, 3) lie on: the distinct values of `scan`.

        Positions stream through bounded memory, and the result does not depend on how. `progress` hears of it at least
        every 64 positions; whatever it raises ends the work, and the engine can be used again.
        """
        ...

    def patch_returns(
        self, template: BeamTemplate, positions_m: FloatArray, *, moments: bool = False, progress: Progress = silent
    ) -> PatchReturns:
        """Numbers of returns by patch of a scan from each of positions (N, 3), and moments on request.

        Streams as `visible_patches` does. The OpenCL engine gives the same bits whatever the batch, the tile and the
        number of cores; the two engines differ by rounding, docs/method/returns.md.
        """
        ...


def check_positions(positions_m: FloatArray) -> FloatArray:
    """Positions as (N, 3) float64, or RequirementError where they have another shape or are not finite."""
    positions = np.ascontiguousarray(positions_m, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise RequirementError(f"positions_m: got shape {positions.shape}, expected (N, 3); pass one row per position")
    if positions.size and not np.abs(positions).max() <= REACH_M:  # NaN compares false
        _refuse_position(positions)
    return positions


def _refuse_position(positions: FloatArray) -> None:
    """Say which row is not finite, or else which lies out of reach."""
    finite = np.isfinite(positions).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise RequirementError(f"positions_m: row {row} is {positions[row]}, expected finite metres; leave it out")
    row = int(np.argmax((np.abs(positions) > REACH_M).any(axis=1)))
    raise RequirementError(
        f"positions_m: row {row} is {positions[row]}, expected less than 100 km from the local origin; "
        "check its unit and its order of coordinates"
    )


def check_rays(origins_m: FloatArray, directions: FloatArray, range_max_m: float) -> tuple[FloatArray, FloatArray]:
    """Origins and UNIT directions as (N, 3) float64, or RequirementError, see `ScanEngine.cast_rays`."""
    if not range_max_m > 0:
        raise RequirementError(f"range_max_m: got {range_max_m}, expected a positive range in metres or infinity")
    origins = check_positions(origins_m)
    rays = np.asarray(directions, dtype=np.float64)
    if rays.shape != origins.shape:
        raise RequirementError(f"directions: got shape {rays.shape}, expected {origins.shape}; pass one row per ray")
    if len(rays) and rays.strides[0] == 0:  # one for all, as of maps: millions of the same
        return origins, np.broadcast_to(_unit(rays[:1]), rays.shape)
    return origins, _unit(rays)


def _unit(directions: FloatArray) -> FloatArray:
    """UNIT directions (N, 3) of others of any length but 0."""
    rays = np.ascontiguousarray(directions)
    squared = np.einsum("ij,ij->i", rays, rays)
    odd = ~((squared > 1e-200) & (squared < 1e200))
    if odd.any():
        # Squares of huge or tiny components overflow or vanish: those rows are scaled by their largest first.
        rays = _scaled(rays, np.flatnonzero(odd))
        squared = np.einsum("ij,ij->i", rays, rays)
    unit: FloatArray = rays / np.sqrt(squared)[:, None]
    return unit


def _scaled(rays: FloatArray, rows: Int64Array) -> FloatArray:
    """Divide some directions by their largest component, or refuse them."""
    largest = np.abs(rays[rows]).max(axis=1)
    bad = rows[~(np.isfinite(largest) & (largest > 0))]
    if bad.size:
        row = int(bad[0])
        raise RequirementError(f"directions: row {row} is {rays[row]}, expected finite and not zero; leave it out")
    scaled = rays.copy()
    scaled[rows] /= largest[:, None]
    return scaled
