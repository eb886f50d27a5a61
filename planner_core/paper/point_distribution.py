"""F2, the evenness of a scan (m^2, less is better), beside F1, the patches it reaches: Eq. 1 and 2 of the paper.

Input a scene, its patches and an open engine; then template and positions (local frame, metres) -> `Distribution`, a
row a position. Positions stream: a batch's moments are dropped when they are summed up.

CONTROL FLOW: `ScanEngine.patch_returns` gives moments by patch. `kernels/metrics_distribution.cl` adds each patch's
vertices to them, and sums mean distances, reference distances and areas over runs of a position's patches; the host
adds up the runs. Where the engine has no OpenCL device, or one without float64, NumPy does the same (`_HostSums`).

With `distance` "euclidean" all of it is in metres, not square metres, and summed up by `euclidean_distance.py`: names
that end in `_m2` are then metres.

References
----------
López et al. 2023, Eq. 2 and Fig. 5. docs/method/f2.md gives our deviations and their reasons.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from planner_core.device import Device, in_batches
from planner_core.device.runtime import has_float64
from planner_core.engine.open_engine import device_of
from planner_core.engine.patch_samples import places_of
from planner_core.engine.scan_engine import ScanEngine, check_positions
from planner_core.errors import RequirementError
from planner_core.model import (
    BeamTemplate,
    FloatArray,
    Int32Array,
    Int64Array,
    Patches,
    PatchReturns,
    ReturnMoments,
    Scene,
)
from planner_core.model.methods import DISTANCES
from planner_core.paper.reference_distance import (
    REFERENCE_POINTS_PER_M2,
    reference_distances_of_patches_m2,
    table_of_triangles,
)
from planner_core.progress import Progress, ProgressEvent, silent

if TYPE_CHECKING:
    from planner_core.paper.euclidean_distance import EuclideanSums

#: Bytes of moments that a batch may hold, and what one patch of one position takes on host and device together.
_BATCH_BYTES = 256 * 2**20
_ENTRY_BYTES = 200
#: What a beam of a scan takes.
_BEAM_BYTES = 16
#: Positions a batch at most, so that progress is heard of.
_MAX_BATCH = 64
#: Patches of a run. Part of the result's last bits, so the same on every device.
_RUN = 64
#: Patches a work-item of `measure_references`; results do not depend on it.
_CHUNKS = {"cpu": 4096}
_DEFAULT_CHUNK = 64


class Distribution(NamedTuple):
    """F1 and F2 of N positions, each by itself.

    n_patches : (N,) int64, patches reached (F1). area_m2 : (N,) float64, their area. f2_m2 : (N,) float64.
    """

    n_patches: Int64Array
    area_m2: FloatArray
    f2_m2: FloatArray


@dataclass(frozen=True)
class DistributionSums:
    """What F2 of N positions is made of, sums over the patches that each reaches; all (N,).

    n_patches : int64. area_m2 : float64. mean_distance_m2 : float64, weighted mean squared distances of the points.
    reference_m2 : float64, reference distances. reference_total_m2 : the same over all patches of the scene.
    """

    n_patches: Int64Array
    area_m2: FloatArray
    mean_distance_m2: FloatArray
    reference_m2: FloatArray
    reference_total_m2: float

    def f2_m2(self, *, keep_reached: bool = False) -> FloatArray:
        """(N,) F2 as printed; `keep_reached`: without its second sum, so that reached patches keep their reference.

        Notes
        -----
        Eq. 2 is (all references - references of reached) + sum over reached of (mean distance - reference). Without the
        second sum, Fig. 5's second image, only what patches have in excess of their reference distinguishes positions.
        """
        times = 1.0 if keep_reached else 2.0
        return self.reference_total_m2 + self.mean_distance_m2 - times * self.reference_m2


class PointDistribution:
    """F1 and F2 of positions in one scene: reference distances are made once.

    Parameters
    ----------
    scene, patches
        What `engine` was opened with.
    engine
        An OpenCL engine's device does the sums too; with any other engine NumPy does.
    points_per_m2
        Density of the reference's points.
    distance
        `squared`, as Eq. 2 and 6 are printed, or `euclidean`, as the text has it; see `euclidean_distance.py`.

    Attributes
    ----------
    reference_m2 : (P,) float64, reference distance of every patch. reference_total_m2 : their sum.
    device : where the sums are done, for the record. warnings : one line each, for the user.

    Raises
    ------
    RequirementError
        `points_per_m2` is not positive and finite, or a distance of another name.
    DeviceError
        The device fails.
    """

    def __init__(
        self,
        scene: Scene,
        patches: Patches,
        engine: ScanEngine,
        *,
        points_per_m2: float = REFERENCE_POINTS_PER_M2,
        distance: str = "squared",
    ) -> None:
        if distance not in DISTANCES:
            raise RequirementError(f"f2.distance: got {distance!r}, expected one of {', '.join(DISTANCES)}")
        self._engine, self._n_patches = engine, patches.n_patches
        self.warnings: tuple[str, ...] = ()
        self._euclidean: EuclideanSums | None = None
        if distance == "euclidean":
            from planner_core.paper.euclidean_distance import EuclideanSums  # brings numba

            self.device = "host"
            self._euclidean = EuclideanSums(scene, patches, points_per_m2=points_per_m2)
            self._take(self._euclidean.reference_m)
            return
        device = device_of(engine)
        if device is not None and not has_float64(device):
            self.warnings = (f"{device.label} has no float64, F2 is summed up on the host (slower, same results)",)
            device = None
        self.device = "host" if device is None else device.label
        self._sums: _Sums
        if device is None:
            reference_m2 = reference_distances_of_patches_m2(scene, patches, points_per_m2=points_per_m2)
            self._sums = _HostSums(scene, patches, reference_m2)
        else:
            self._sums = _DeviceSums(scene, patches, device, points_per_m2=points_per_m2)
        self._take(self._sums.reference_m2)

    def _take(self, reference: FloatArray) -> None:
        self.reference_m2: FloatArray = reference
        self.reference_total_m2 = float(reference.sum())

    def of(self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent) -> Distribution:
        """F1, by count and by area, and F2 as printed of each of positions (N, 3).

        Raises
        ------
        RequirementError
            Positions of another shape or not finite.
        DeviceError
            The device fails, or its memory does not hold one position.
        """
        sums = self.sums(template, positions_m, progress=progress)
        return Distribution(sums.n_patches, sums.area_m2, sums.f2_m2())

    def of_set(self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent) -> float:
        """F2 of positions (K, 3) as one set: Eq. 2's outer sum, F2 of one after the other. 0 of none."""
        return f2_of_set_m2(self.of(template, positions_m, progress=progress).f2_m2)

    def sums(self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent) -> DistributionSums:
        """What F2 of each of positions (N, 3) is made of; raises as `of` does."""
        positions = check_positions(positions_m)
        if self._euclidean is not None:
            return self._euclidean_sums(self._euclidean, template, positions, progress)
        n_beams = int(np.prod(template.shape))
        row_bytes = max(1, min(n_beams, self._n_patches)) * _ENTRY_BYTES
        n_batch = max(1, min(_MAX_BATCH, _BATCH_BYTES // row_bytes))
        n_patches = np.zeros(len(positions), dtype=np.int64)
        found = np.zeros((len(positions), 3), dtype=np.float64)

        def work(first: int, end: int) -> None:
            returns = self._engine.patch_returns(template, positions[first:end], moments=True)
            n_patches[first:end] = np.diff(returns.starts)
            found[first:end] = self._sums.by_position(returns, positions[first:end])
            progress(ProgressEvent("f2", end, len(positions)))

        in_batches(len(positions), n_batch, work, on_smaller=self._warn)
        return DistributionSums(n_patches, found[:, 2], found[:, 0], found[:, 1], self.reference_total_m2)

    def _euclidean_sums(
        self, euclidean: EuclideanSums, template: BeamTemplate, positions: FloatArray, progress: Progress
    ) -> DistributionSums:
        n_batch = max(1, min(_MAX_BATCH, _BATCH_BYTES // (int(np.prod(template.shape)) * _BEAM_BYTES)))
        found = np.zeros((len(positions), 4), dtype=np.float64)

        def work(first: int, end: int) -> None:
            batch = self._engine.scan(template, positions[first:end])
            found[first:end] = euclidean.by_position(template, batch, positions[first:end])
            progress(ProgressEvent("f2", end, len(positions)))

        in_batches(len(positions), n_batch, work, on_smaller=self._warn)
        n_patches = found[:, 3].astype(np.int64)
        return DistributionSums(n_patches, found[:, 2], found[:, 0], found[:, 1], self.reference_total_m2)

    def _warn(self, line: str) -> None:
        self.warnings = (*self.warnings, line)


def f2_of_set_m2(f2_m2: FloatArray) -> float:
    """F2 of a set of positions from theirs, (K,): their sum, as Eq. 2 has it.

    It grows with every position whose own F2 is positive, so it compares sets of one size only.
    """
    return float(np.sum(f2_m2))


class _Sums(Protocol):
    """Sums over the patches of every position."""

    reference_m2: FloatArray

    def by_position(self, returns: PatchReturns, positions_m: FloatArray) -> FloatArray:
        """(S, 3) float64: mean distances, reference distances, areas, each summed over a position's patches, m^2."""
        ...


class _HostSums:
    """In NumPy: the form that is easiest to believe."""

    def __init__(self, scene: Scene, patches: Patches, reference_m2: FloatArray) -> None:
        self._scene, self._patches, self.reference_m2 = scene, patches, reference_m2
        self._area_m2 = patches.area_m2

    def by_position(self, returns: PatchReturns, positions_m: FloatArray) -> FloatArray:
        """See `_Sums`. Position by position, for memory's sake."""
        sums = np.zeros((len(positions_m), 3))
        for index, position in enumerate(_as_held(positions_m)):
            row = returns.row(index)
            patch = returns.patch[row]
            places = places_of(self._scene, self._patches, patch)
            mean = mean_distances_m2(
                returns.n_returns[row], _moments(returns), row, places.corners_m, places.normal, position
            )
            sums[index] = mean.sum(), self.reference_m2[patch].sum(), self._area_m2[patch].sum()
        return sums


def mean_distances_m2(
    n_returns: Int32Array,
    moments: ReturnMoments,
    rows: slice,
    corners_m: FloatArray,
    normal: FloatArray,
    position_m: FloatArray,
) -> FloatArray:
    """(M,) weighted mean squared distances of the points on patches seen from one position, the vertices included.

    Parameters
    ----------
    n_returns : (M,). moments, rows
        The rows (M,) of `moments` that belong to them.
    corners_m : (M, 3, 3), of the patches. normal : (M, 3), unit. position_m : (3,), all local frame.

    Notes
    -----
    sum_i w_i sum_j |p_i - p_j|^2 = n W2 - 2 W1 . M1 + M2 W, over n (n - 1). docs/method/returns.md.
    """
    p = corners_m - corners_m[:, :1]
    away = corners_m - position_m
    length = np.sqrt((away * away).sum(axis=2))
    across = np.abs((away * normal[:, None]).sum(axis=2))
    w = 2.0 - np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    square = (p * p).sum(axis=2)
    n = n_returns + 3.0
    m1 = moments.point_sum_m[rows] + p.sum(axis=1)
    w1 = moments.weighted_point_sum_m[rows] + (w[..., None] * p).sum(axis=1)
    m2 = moments.square_sum_m2[rows] + square.sum(axis=1)
    w2 = moments.weighted_square_sum_m2[rows] + (w * square).sum(axis=1)
    pairs = n * w2 - 2.0 * (w1 * m1).sum(axis=1) + m2 * (moments.weight_sum[rows] + w.sum(axis=1))
    mean: FloatArray = pairs / (n * (n - 1.0))
    return mean


class _DeviceSums:
    """`kernels/metrics_distribution.cl`; the mesh and the reference distances stay on the device."""

    def __init__(self, scene: Scene, patches: Patches, device: Device, *, points_per_m2: float) -> None:
        self._on, self._n_triangles = device, np.int32(scene.n_triangles)
        n_points, table = table_of_triangles(patches, points_per_m2=points_per_m2)
        self._mesh = device.upload(
            "F2: mesh",
            {
                "vertices": scene.vertices_m.astype(np.float32),
                "triangles": scene.triangles,
                "first_patch": patches.first_patch,
                "depth": patches.depth,
            },
        )
        self._program = device.program("metrics_distribution.cl", {})
        self.reference_m2 = self._measure(patches.n_patches, n_points, table)
        self._by_patch = device.upload(
            "F2: patches", {"area": patches.triangle_area_m2, "reference": self.reference_m2}
        )

    def _measure(self, n_patches: int, n_points: Int32Array, table: FloatArray) -> FloatArray:
        reference_m2 = np.empty(n_patches, dtype=np.float64)
        chunk = _CHUNKS.get(self._on.kind, _DEFAULT_CHUNK)
        given = self._on.upload("F2: numbers of points", {"n_points": n_points, "table": table})
        with self._on.outputs("F2: reference distances", {"reference": reference_m2}) as out:
            self._program.run(
                "measure_references",
                (-(-n_patches // chunk),),
                *self._mesh.values(),
                self._n_triangles,
                np.int32(n_patches),
                np.int32(chunk),
                given["n_points"],
                given["table"],
                out["reference"],
            )
        return reference_m2

    def by_position(self, returns: PatchReturns, positions_m: FloatArray) -> FloatArray:
        """See `_Sums`."""
        runs, of_run = _runs(returns.starts)
        out = np.empty((len(runs), 3), dtype=np.float64)
        moments = _moments(returns)
        given = self._on.upload(
            "F2: moments",
            {
                "positions": _as_held(positions_m),
                "runs": runs,
                "of_run": of_run,
                "patch": returns.patch,
                "n_returns": returns.n_returns,
                "point_sum": moments.point_sum_m,
                "square_sum": moments.square_sum_m2,
                "weight_sum": moments.weight_sum,
                "weighted_point_sum": moments.weighted_point_sum_m,
                "weighted_square_sum": moments.weighted_square_sum_m2,
            },
        )
        with self._on.outputs("F2: sums", {"out": out}) as written:
            self._program.run(
                "sum_distribution",
                (len(runs),),
                *self._mesh.values(),
                self._n_triangles,
                *self._by_patch.values(),
                *given.values(),
                written["out"],
            )
        return np.stack([np.bincount(of_run, column, minlength=len(positions_m)) for column in out.T], axis=1)


def _runs(starts: Int64Array) -> tuple[Int32Array, Int32Array]:
    """(R, 2) first and last + 1 of runs of at most `_RUN` entries that cross no row, and (R,) their rows; int32."""
    size = np.diff(starts)
    count = -(-size // _RUN)
    row = np.repeat(np.arange(size.size), count)
    within = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    first = starts[row] + within * _RUN
    runs = np.stack([first, np.minimum(first + _RUN, starts[row + 1])], axis=1)
    return np.ascontiguousarray(runs, dtype=np.int32), row.astype(np.int32)


def _as_held(positions_m: FloatArray) -> FloatArray:
    """Positions as the engines hold them: rounded to float32."""
    return positions_m.astype(np.float32).astype(np.float64)


def _moments(returns: PatchReturns) -> ReturnMoments:
    if returns.moments is None:
        raise ValueError("F2: got returns without moments, expected them; ask the engine for `moments=True`")
    return returns.moments
