"""Patch mode: which patches positions see, from where and how densely, by casting samples of patches instead of beams.

Input an open engine, the `Scene` and `Patches` it holds, a template, positions (local frame, metres); output a
`Visibility` or `PatchViews`. The cost does not depend on the scanner's resolution. docs/method/patch-mode.md holds the
rules and how well they agree with the beams themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from planner_core.device import in_batches
from planner_core.engine.patch_samples import (
    ALL_RIM,
    ALL_SAMPLES,
    N_FINE,
    N_RIM,
    KeptPlaces,
    UInt32Array,
    View,
    make_groups,
    middle_of,
    rounding_of,
    sample_pattern,
    share_of,
    view_of,
)
from planner_core.engine.scan_engine import ScanEngine, check_positions
from planner_core.errors import RequirementError
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    Patches,
    Scanner,
    Scene,
    UInt8Array,
    Visibility,
    VisibilityMode,
)
from planner_core.model.arrays import dots
from planner_core.progress import Progress, ProgressEvent, silent

if TYPE_CHECKING:
    from planner_core.engine.opencl import OpenCLEngine

#: Beams of a scan from which on `auto` takes patches: docs/benchmarks/patch-mode.md.
AUTO_PATCHES_BEAMS = 4_000_000

#: Marks (four bytes a patch and position) that a batch may hold; results do not depend on it.
_MARK_BYTES = 256 * 2**20
#: Positions a batch at most, so that progress is heard of.
_MAX_BATCH = 64
#: Groups of patches a work-item: enough that most start with a blocker, few enough to spread over the cores. Elsewhere
#: fewer, since there are more cores to spread over: docs/benchmarks/gpu.md.
_GROUPS_A_RUN = {"cpu": 64}
_DEFAULT_GROUPS_A_RUN = 4
#: A patch counts as seen where at least this many beams are to be expected on what is seen of it.
LEAST_RETURNS = 1.0


def scan_mode_of(mode: VisibilityMode, template: BeamTemplate) -> VisibilityMode:
    """`BEAMS` or `PATCHES`: `mode`, or for `AUTO` what suits the number of beams a scan has."""
    if mode != VisibilityMode.AUTO:
        return mode
    rows, columns = template.shape
    return (
        VisibilityMode.PATCHES
        if min(rows, columns) > 1 and rows * columns >= AUTO_PATCHES_BEAMS
        else VisibilityMode.BEAMS
    )


def mode_that_counts_parts(mode: VisibilityMode, scanner: Scanner) -> VisibilityMode:
    """Return `mode`; for `AUTO` patches, of which parts are counted, for all but a single row or column."""
    single = min(len(scanner.elevation_rad), scanner.n_azimuths) < 2
    return VisibilityMode.PATCHES if mode == VisibilityMode.AUTO and not single else mode


@dataclass(frozen=True)
class PatchViews:
    """Patches that each of N positions sees, as compressed sparse rows, and how it sees them.

    starts : (N + 1,) int64. patch : (M,) int32, sorted and unique inside each row. part : (M,) uint32, a bit for each
    sample that is seen; of a patch whose first pattern is seen whole, all bits. n_visible, n_samples : (M,) uint8,
    samples of the patch that are seen, of those cast. share : (M,) float32, the part of the patch that they stand for,
    0 to 1. range_m, cos_incidence : (M,) float32, at the middle of the samples that are seen. spacing_m : (M, 2)
    float32, distance on the surface between the points of neighbouring columns, and of neighbouring rows.
    """

    starts: Int64Array
    patch: Int32Array
    n_patches: int
    part: UInt32Array
    n_visible: UInt8Array
    n_samples: UInt8Array
    share: Float32Array
    range_m: Float32Array
    cos_incidence: Float32Array
    spacing_m: Float32Array

    @property
    def visibility(self) -> Visibility:
        """The rows alone."""
        return Visibility(starts=self.starts, patch=self.patch, n_patches=self.n_patches)


class _PatchEngine(Protocol):
    """Casts the samples of all patches."""

    def marks(self, view: View, positions_m: Float32Array, least_returns: float) -> UInt32Array:
        """(S, P) uint32: bit s, sample s of the patch is seen; the second pattern's only where not all of the first."""
        ...


class PatchMode:
    """Patch mode of one engine: the patches are grouped and sent to the device once.

    only : (P,) bool, patches that visibility is computed of; the others only occlude. None: all.
    """

    def __init__(
        self,
        engine: ScanEngine,
        scene: Scene,
        patches: Patches,
        *,
        only: BoolArray | None = None,
        mark_bytes: int = _MARK_BYTES,
    ) -> None:
        self._patches, self._only, self._places = patches, only, KeptPlaces(scene, patches)
        self._mark_bytes = mark_bytes
        self._engine, self._patch_engine = engine, _patch_engine_of(engine, scene, patches, only)

    def visible_patches(
        self,
        template: BeamTemplate,
        positions_m: FloatArray,
        *,
        max_incidence_rad: float | None = None,
        least_returns: float = LEAST_RETURNS,
        progress: Progress = silent,
    ) -> Visibility:
        """Patches that each of positions (N, 3) sees.

        Parameters
        ----------
        max_incidence_rad
            Surfaces met at a greater angle give no return; None: all do.
        least_returns
            A patch counts where at least as many beams are to be expected on it; 0: wherever a sample is seen.

        Raises
        ------
        RequirementError
            Positions of another shape or not finite; a template of one row or column; limits that make no sense.
        DeviceError
            The device fails, or its memory does not hold one position.
        """
        view = view_of(template, max_incidence_rad=max_incidence_rad)
        rows: list[Int32Array] = []

        def keep(marks: UInt32Array) -> None:
            rows.extend(self._required_of(row) for row in marks)

        self._cast(view, check_positions(positions_m), least_returns, progress, keep)
        return Visibility(starts=_starts(rows), patch=_joined(rows), n_patches=self._patches.n_patches)

    def see(
        self,
        template: BeamTemplate,
        positions_m: FloatArray,
        *,
        max_incidence_rad: float | None = None,
        least_returns: float = LEAST_RETURNS,
        progress: Progress = silent,
    ) -> PatchViews:
        """Return what `visible_patches` does, with range, incidence and spacing at the middle of what is seen."""
        view = view_of(template, max_incidence_rad=max_incidence_rad)
        positions = check_positions(positions_m)
        rows: list[Int32Array] = []
        masks: list[UInt32Array] = []

        def keep(marks: UInt32Array) -> None:
            for row in marks:
                rows.append(self._required_of(row))
                masks.append(row[rows[-1]])

        self._cast(view, positions, least_returns, progress, keep)
        starts, patch, mask = _starts(rows), _joined(rows), _joined_masks(masks)
        seen_from = np.repeat(positions.astype(np.float32).astype(np.float64), np.diff(starts), axis=0)
        range_m, cosine, spacing = self._describe(view, seen_from, patch, mask)
        return PatchViews(
            starts=starts,
            patch=patch,
            n_patches=self._patches.n_patches,
            part=np.where(mask == ALL_RIM, ALL_SAMPLES, mask),
            n_visible=np.bitwise_count(mask).astype(np.uint8, copy=False),
            n_samples=np.where(mask == ALL_RIM, N_RIM, N_RIM + N_FINE).astype(np.uint8),
            share=share_of(mask).astype(np.float32),
            range_m=range_m,
            cos_incidence=cosine,
            spacing_m=spacing,
        )

    def _cast(
        self,
        view: View,
        positions_m: FloatArray,
        least_returns: float,
        progress: Progress,
        keep: Callable[[UInt32Array], None],
    ) -> None:
        """Hand marks (S, P) of batches of positions to `keep`, in their order."""
        if not least_returns >= 0:
            raise RequirementError(f"least_returns: got {least_returns}, expected 0 or more; leave it out for 1")
        positions = positions_m.astype(np.float32)
        n_batch = max(1, min(_MAX_BATCH, self._mark_bytes // (4 * max(self._patches.n_patches, 1))))

        def work(first: int, end: int) -> None:
            keep(self._patch_engine.marks(view, positions[first:end], least_returns))
            progress(ProgressEvent("scan", end, len(positions)))

        in_batches(len(positions), n_batch, work, on_smaller=self._warn)

    def _required_of(self, marks: UInt32Array) -> Int32Array:
        """Patches with marks (P,) that are required: groups hold some that are not."""
        found = np.flatnonzero(marks).astype(np.int32)
        return found if self._only is None else found[self._only[found]]

    def _warn(self, line: str) -> None:
        self._engine.warnings = (*self._engine.warnings, line)

    def _describe(
        self, view: View, seen_from_m: FloatArray, patch: Int32Array, mask: UInt32Array
    ) -> tuple[Float32Array, Float32Array, Float32Array]:
        """Range, cosine and spacing (M, 2) of patches (M,) with marks (M,), each from its own position (M, 3)."""
        places = self._places.of(patch)
        corners, normal = places.corners_m, places.normal
        weights = np.broadcast_to(middle_of(np.array([ALL_RIM])), (mask.size, 2)).copy()
        rest = np.flatnonzero(mask != ALL_RIM)
        weights[rest] = middle_of(mask[rest])
        at = corners[:, 0] - seen_from_m
        for k in (0, 1):
            at += weights[:, k, None] * (corners[:, k + 1] - corners[:, 0])
        range_m = np.sqrt(dots(at, at))
        along = at / range_m[:, None]
        cosine = np.abs(dots(along, normal))
        return (
            range_m.astype(np.float32),
            np.minimum(cosine, 1.0).astype(np.float32),
            spacing_at(view, along, normal, range_m, cosine),
        )


def spacing_at(
    view: View, along: FloatArray, normal: FloatArray, range_m: FloatArray, cosine: FloatArray
) -> Float32Array:
    """(M, 2) metres between the points of neighbouring columns, and of neighbouring rows, on surfaces (M,).

    along : (M, 3) unit directions of the beams. normal : (M, 3). cosine : of the incidence.

    Notes
    -----
    With d the direction, n the normal, r the range: a step of angle a along t, a unit vector across d, moves the point
    on the surface by r a sqrt(1 + (n . t / n . d)^2). For t along the slope that is r a / cos(incidence). t is level
    for columns, where a is the azimuth step times cos(elevation), and upright for rows.
    """
    level = np.hypot(along[:, 0], along[:, 1])
    # Straight up or down, where no direction is level, any will do.
    across = np.where(level > 0, level, 1.0)
    azimuthal = np.stack([-along[:, 1] / across, along[:, 0] / across, np.zeros_like(level)], axis=1)
    azimuthal[level == 0] = (0.0, 1.0, 0.0)
    upright = np.cross(along, azimuthal)
    steps = (view.azimuth_step_rad * level, np.full_like(level, view.elevation_step_rad))
    with np.errstate(divide="ignore", invalid="ignore"):
        spacing = [
            range_m * step * np.hypot(1.0, dots(normal, t) / cosine)
            for step, t in zip(steps, (azimuthal, upright), strict=True)
        ]
    return np.stack(spacing, axis=1).astype(np.float32).reshape(-1, 2)


class _DevicePatchEngine:
    """`kernels/sample_patches.cl` on the device of an `OpenCLEngine`."""

    def __init__(self, engine: OpenCLEngine, scene: Scene, patches: Patches, only: BoolArray | None) -> None:
        self._on, self._tree, stack = engine.on_device
        order = engine.tree.triangle[engine.tree.triangle >= 0]
        order = order[engine.traced.returns[order]]
        self._n_patches = patches.n_patches
        self._rounding_m = rounding_of(scene)
        traced = engine.traced
        required = None if only is None else traced.of_traced(only, patches)
        grouped = make_groups(traced.scene, traced.patches, order, only=required)
        self._n_groups = grouped.groups.shape[0]
        self._groups = self._on.upload(
            "groups of patches",
            {
                "order": grouped.order,
                "groups": grouped.groups,
                "box": grouped.box,
                "pattern": sample_pattern().astype(np.float32),
            },
        )
        lanes = 8 if self._on.kind == "cpu" else 1
        self._program = self._on.program("sample_patches.cl", {"LANES": lanes, "STACK": stack})

    def marks(self, view: View, positions_m: Float32Array, least_returns: float) -> UInt32Array:
        """See `_PatchEngine`."""
        out = np.zeros((len(positions_m), self._n_patches), dtype=np.uint32)
        if self._n_groups == 0:  # nothing returns a beam
            return out
        packed = view.packed(least_returns=least_returns, rounding_m=self._rounding_m)
        n_groups_a_run = _GROUPS_A_RUN.get(self._on.kind, _DEFAULT_GROUPS_A_RUN)
        at = self._on.upload("patch mode", {"positions": positions_m, "view": packed})
        # Few patches of a large scene are seen: what a processor's kernels write need not be copied there and back.
        with self._on.outputs("marks of patches", {"marks": out}) as written:
            if self._on.kind != "cpu":
                self._on.zero(written["marks"], out.nbytes)
            self._program.run(
                "sample_patches",
                (-(-self._n_groups // n_groups_a_run), len(positions_m)),
                *(
                    self._tree[name]
                    for name in ("boxes", "children", "geometry", "triangle", "slot", "edges", "address")
                ),
                *(self._groups[name] for name in ("order", "groups", "box")),
                np.int32(self._n_groups),
                np.int32(n_groups_a_run),
                self._groups["pattern"],
                at["view"],
                at["positions"],
                written["marks"],
                np.int32(self._n_patches),
            )
        return out


def _patch_engine_of(engine: ScanEngine, scene: Scene, patches: Patches, only: BoolArray | None) -> _PatchEngine:
    from planner_core.engine.in_parts import PartedEngine
    from planner_core.engine.opencl import OpenCLEngine

    if isinstance(engine, OpenCLEngine):
        return _DevicePatchEngine(engine, scene, patches, only)
    # A scene in parts is on no device as a whole: its samples are tested on the host.
    if engine.name == "open3d" or isinstance(engine, PartedEngine):
        from planner_core.engine.open3d import Open3DEngine
        from planner_core.engine.open3d_samples import Open3DSamples

        host = Open3DEngine(scene, patches) if isinstance(engine, PartedEngine) else engine
        if isinstance(host, Open3DEngine):
            return Open3DSamples(host, scene, patches, only=only)
    raise RequirementError(f"scan mode patches: got engine {engine.name!r}, expected opencl or open3d; use mode beams")


def _starts(rows: list[Int32Array]) -> Int64Array:
    starts = np.zeros(len(rows) + 1, dtype=np.int64)
    starts[1:] = np.cumsum([row.size for row in rows], dtype=np.int64)
    return starts


def _joined(rows: list[Int32Array]) -> Int32Array:
    return np.concatenate(rows) if rows else np.empty(0, dtype=np.int32)


def _joined_masks(rows: list[UInt32Array]) -> UInt32Array:
    return np.concatenate(rows) if rows else np.empty(0, dtype=np.uint32)
