"""What the plan is worth for every triangle: seen share, number of stations, shortest range. Plan -> FaceResults."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import Float32Array, Int32Array, Plan, ScanBatch


@dataclass(frozen=True)
class FaceResults:
    """Results a triangle of the scene, all (T,).

    coverage : float32, seen share of the face's achievable area in [0, 1]; -1 where nothing of it is achievable.
    times_seen : int32, most stations that see one patch of the face.
    best_range_m : float32, shortest range at which a station sees the face; -1 where none does.
    """

    coverage: Float32Array
    times_seen: Int32Array
    best_range_m: Float32Array


def face_results(plan: Plan, best_range_m: Float32Array) -> FaceResults:
    """Sum the plan's patches up into faces.

    Parameters
    ----------
    plan
        Uses `times_seen`, `achievable` and the survey's patches. All patches of a face have the same area, so shares
        of area are shares of patches.
    best_range_m
        (T,) float32, shortest range over all stations, inf where no station has a return: see `lower_best_range`.
    """
    first = plan.survey.patches.first_patch[:-1]
    n_achievable = np.add.reduceat(plan.achievable.astype(np.int64), first)
    n_seen = np.add.reduceat((plan.achievable & (plan.times_seen > 0)).astype(np.int64), first)
    coverage = np.where(n_achievable > 0, n_seen / np.maximum(n_achievable, 1), -1.0)
    return FaceResults(
        coverage=coverage.astype(np.float32),
        times_seen=np.maximum.reduceat(plan.times_seen, first).astype(np.int32),
        best_range_m=np.where(np.isfinite(best_range_m), best_range_m, -1.0).astype(np.float32),
    )


def unseen_range(n_triangles: int) -> Float32Array:
    """(T,) float32 of inf: the best range before any scan was looked at."""
    return np.full(n_triangles, np.inf, dtype=np.float32)


def lower_best_range(best_range_m: Float32Array, scans: ScanBatch) -> None:
    """Lower `best_range_m` (T,) in place where a return of `scans` is nearer."""
    hit = scans.triangle >= 0
    np.minimum.at(best_range_m, scans.triangle[hit], scans.range_m[hit])
