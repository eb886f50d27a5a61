"""Eq. 2 and 6 with the plain Euclidean distance, in metres, where `point_distribution` has its square.

The paper prints d^2 and writes "Euclidean distance". Squares come from moments of the returns; distances do not: all
pairs of points are used. So that a patch next to the sensor does not take a second, at most `MOST_POINTS` of its
returns are, every so many-th in the order of beams, and stand for the others. Local frame, metres; host alone, whatever
engine casts the beams.

References
----------
López et al. 2023, Eq. 2 and 6. docs/method/f2.md gives what the choice changes.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from planner_core.compiled import compiled, share_out
from planner_core.model import BeamTemplate, FloatArray, Int32Array, Int64Array, Patches, ScanBatch, Scene
from planner_core.paper.reference_distance import halton_weights, table_of_triangles
from planner_core.scanner.template import directions
from planner_core.scene.patches import patch_triangles

#: Returns of a patch that are used. Without loss up to here; of 10 000 returns the mean is off by less than 1 %.
MOST_POINTS = 256


class EuclideanSums:
    """Sums over the patches of every position, as `planner_core.paper.point_distribution` adds them up, in metres.

    Attributes
    ----------
    reference_m : (P,) float64, mean distance of the reference's points and the vertices of every patch.
    """

    def __init__(self, scene: Scene, patches: Patches, *, points_per_m2: float) -> None:
        held = replace(scene, vertices_m=scene.vertices_m.astype(np.float32).astype(np.float64))
        self._corners_m: FloatArray = np.ascontiguousarray(patch_triangles(held, patches))
        self._area_m2 = patches.area_m2
        self.reference_m: FloatArray = self._references(patches, points_per_m2)

    def by_position(self, template: BeamTemplate, batch: ScanBatch, positions_m: FloatArray) -> FloatArray:
        """(S, 4) float64: mean distances m, references m, areas m^2, numbers of patches; of scans of (S, 3) positions.

        Patches are added in the order of their numbers, so that the result depends on no number of cores.
        """
        sums = np.zeros((len(positions_m), 4))
        for index, position in enumerate(positions_m):
            patch, means = self.of_patches(template, batch, index, position)
            sums[index] = means.sum(), self.reference_m[patch].sum(), self._area_m2[patch].sum(), patch.size
        return sums

    def of_patches(
        self, template: BeamTemplate, batch: ScanBatch, index: int, position_m: FloatArray
    ) -> tuple[Int32Array, FloatArray]:
        """Patches (M,) that scan `index` of a batch reaches, ascending, and their weighted mean distances (M,), m."""
        position = position_m.astype(np.float32).astype(np.float64)
        beams = directions(template).astype(np.float32).astype(np.float64).reshape(-1, 3)
        hit = np.flatnonzero(batch.patch[index].ravel() >= 0)
        at = hit[np.argsort(batch.patch[index].ravel()[hit], kind="stable")]
        patch, starts = np.unique(batch.patch[index].ravel()[at], return_index=True)
        point_m = position + beams[at] * batch.range_m[index].ravel()[at, None].astype(np.float64)
        ends = np.append(starts, at.size).astype(np.int64)
        return patch, mean_distances_m(point_m, ends, self._corners_m[patch], position)

    def _references(self, patches: Patches, points_per_m2: float) -> FloatArray:
        per_triangle, _ = table_of_triangles(patches, points_per_m2=points_per_m2)
        n_points = np.minimum(np.repeat(per_triangle, np.diff(patches.first_patch)), MOST_POINTS).astype(np.int64)
        found = np.empty(patches.n_patches)
        weights = np.ascontiguousarray(halton_weights(int(n_points.max(initial=1))))
        share_out(partial(_reference_run, self._corners_m, weights, n_points, found), patches.n_patches)
        return found


def mean_distances_m(
    point_m: FloatArray, starts: Int64Array, corners_m: FloatArray, position_m: FloatArray
) -> FloatArray:
    """(M,) weighted mean distances of the points on patches seen from one position, the vertices included.

    point_m : (N, 3), returns in the order of their patches; patch k has those from starts[k] to starts[k + 1] - 1.
    corners_m : (M, 3, 3). position_m : (3,).
    """
    found = np.empty(len(corners_m))
    run = partial(_mean_run, point_m, starts, np.ascontiguousarray(corners_m), position_m, MOST_POINTS, found)
    share_out(run, len(found))
    return found


@compiled
def _reference_run(
    corners_m: FloatArray, weights: FloatArray, n_points: Int64Array, found: FloatArray, first: int, end: int
) -> None:
    """Write entries `first` to `end` - 1 of `found`: mean distance of Halton points (weights of f, g) and vertices."""
    p = np.empty((weights.shape[0] + 3, 3))
    for k in range(first, end):
        n = n_points[k] + 3
        for c in range(3):
            a, b, d = corners_m[k, 0, c], corners_m[k, 1, c], corners_m[k, 2, c]
            p[0, c], p[1, c], p[2, c] = a, b, d
            for i in range(n - 3):
                p[i + 3, c] = a + weights[i, 0] * (b - a) + weights[i, 1] * (d - a)
        total = 0.0
        for i in range(n):
            for j in range(i):
                x, y, z = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
                total += np.sqrt(x * x + y * y + z * z)
        found[k] = 2.0 * total / (n * (n - 1))


@compiled
def _mean_run(
    point_m: FloatArray,
    starts: Int64Array,
    corners_m: FloatArray,
    position_m: FloatArray,
    most: int,
    found: FloatArray,
    first: int,
    end: int,
) -> None:
    """Write entries `first` to `end` - 1 of `found`: Eq. 2's inner sums of each patch."""
    p, w = np.empty((most + 3, 3)), np.empty(most + 3)
    for k in range(first, end):
        have = starts[k + 1] - starts[k]
        kept = min(have, most)
        for i in range(kept):
            p[i + 3] = point_m[starts[k] + (i * have) // kept]
        p[0], p[1], p[2] = corners_m[k, 0], corners_m[k, 1], corners_m[k, 2]
        e, f = p[1] - p[0], p[2] - p[0]
        nx, ny, nz = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
        size = np.sqrt(nx * nx + ny * ny + nz * nz)
        for i in range(kept + 3):
            x, y, z = p[i, 0] - position_m[0], p[i, 1] - position_m[1], p[i, 2] - position_m[2]
            away = size * np.sqrt(x * x + y * y + z * z)
            w[i] = 2.0 - abs(nx * x + ny * y + nz * z) / away if away > 0 else 2.0
        # A return that is used stands for have / kept of them, a pair for as many pairs as there are of all.
        one = have / kept
        two = have * (have - 1.0) / (kept * (kept - 1.0)) if kept > 1 else 1.0
        among, beside, fixed = 0.0, 0.0, 0.0
        for i in range(kept + 3):
            for j in range(i):
                x, y, z = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
                d = (w[i] + w[j]) * np.sqrt(x * x + y * y + z * z)
                if j >= 3:
                    among += d
                elif i >= 3:
                    beside += d
                else:
                    fixed += d
        n = have + 3.0
        found[k] = (two * among + one * beside + fixed) / (n * (n - 1.0))
