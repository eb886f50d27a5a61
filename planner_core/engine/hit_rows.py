"""Rows of patches from what Open3D's rays hit: addresses, marks, counts and moments, in compiled passes over the beams.

Input hits as Open3D leaves them, one position and one band of a template at a time; output `ReturnRows`. Local frame,
metres. The rule of addresses is docs/method/patches.md, in float32 and in its order of operations, as
`planner_core.scene.patches.patch_code` has it in NumPy, to the last bit. Sums are in float64 and in the order of beams:
threads share out beams where each is written by itself, patches where they are summed up, so that nothing depends on
how many there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.compiled import compiled, share_out
from planner_core.engine.patch_returns import Content, ReturnRows, empty_moments
from planner_core.engine.traced_surfaces import Traced, round_surfaces
from planner_core.model import Float32Array, FloatArray, Int32Array, Patches, Scene, UInt8Array
from planner_core.scene.patches import barycentric_slopes, squared_edges, used_corners

_ONE, _TWO, _FOUR = np.float32(1), np.float32(2), np.float32(4)


@dataclass(frozen=True)
class Hits:
    """First hits of N rays, as Open3D leaves them: a miss has an infinite range and no triangle.

    range_m : (N,) float32. triangle : (N,) uint32. uv : (N, 2) float32, weights of the vertices 1 and 2.
    """

    range_m: Float32Array
    triangle: NDArray[np.uint32]
    uv: Float32Array


class HitRows:
    """Patches of hits on the traced surfaces of one scene.

    corners_m : (T, 3, 3) float32, of the traced triangles.
    """

    def __init__(self, traced: Traced, n_patches: int) -> None:
        scene = traced.scene
        surfaces = round_surfaces(scene)
        self._n_patches = n_patches
        self.corners_m, self._normal = surfaces.corners_m, surfaces.normal
        self._address = (
            np.ascontiguousarray(traced.first_patch, dtype=np.int32),
            traced.patches.depth,
            squared_edges(scene.vertices_m[scene.triangles]),
        )

    def no_marks(self) -> UInt8Array:
        """(P,) of a position that has seen nothing yet."""
        return np.zeros(self._n_patches, dtype=np.uint8)

    def patches(self, hits: Hits, range_min_m: float, range_max_m: float, marks: UInt8Array) -> Int32Array:
        """(N,) patch of every return, -1 for a beam that gives none; `marks` of those patches are set to 1."""
        patch = np.empty(hits.range_m.size, dtype=np.int32)
        # Compared as float32, as the kernels do.
        within = (np.float32(range_min_m), np.float32(range_max_m))

        def find(first: int, end: int) -> None:
            _find(first, end, hits.range_m, hits.triangle, hits.uv, *within, *self._address, patch, marks)

        share_out(find, patch.size)
        return patch

    def cos_incidence(self, patch: Int32Array, hits: Hits, beams: Float32Array) -> Float32Array:
        """(N,) of beams (N, 3) whose returns lie on `patch`; NaN for no return."""
        cosine = np.empty(patch.size, dtype=np.float32)
        share_out(
            lambda first, end: _cosines(first, end, patch, hits.triangle, beams, self._normal, cosine), patch.size
        )
        return cosine

    def row(
        self,
        patch: Int32Array,
        marks: UInt8Array,
        hits: Hits,
        beams: Float32Array,
        position_m: FloatArray,
        content: Content,
    ) -> ReturnRows:
        """Row of one position, of patches as `patches` returns and marks them."""
        seen = np.flatnonzero(marks).astype(np.int32)
        length = np.array([seen.size], dtype=np.int64)
        if content is Content.PATCHES:
            return ReturnRows(length=length, arrays={"patch": seen})
        slot = np.empty(self._n_patches, dtype=np.int32)
        slot[seen] = np.arange(seen.size, dtype=np.int32)
        n_returns, triangle = np.zeros(seen.size, dtype=np.int32), np.zeros(seen.size, dtype=np.int64)
        _count(patch, hits.triangle, slot, n_returns, triangle)
        arrays: dict[str, NDArray[Any]] = {"patch": seen, "n_returns": n_returns}
        if content is Content.MOMENTS:
            first_vertex_m = np.empty((seen.size, 3))
            _first_vertices(seen, triangle, *self._address, self.corners_m, first_vertex_m)
            arrays |= self._moments(patch, slot, first_vertex_m, hits, beams, position_m)
        return ReturnRows(length=length, arrays=arrays)

    def _moments(
        self,
        patch: Int32Array,
        slot: Int32Array,
        first_vertex_m: FloatArray,
        hits: Hits,
        beams: Float32Array,
        position_m: FloatArray,
    ) -> dict[str, NDArray[Any]]:
        sums = {name: np.zeros_like(column) for name, column in empty_moments(len(first_vertex_m)).items()}
        sums["least_range_m"][:] = np.inf
        origin = position_m.astype(np.float32).astype(np.float64)

        def add(first: int, end: int) -> None:
            _add(
                *(first, end, patch, slot, hits.range_m, hits.triangle, beams, origin, first_vertex_m, self._normal),
                *(sums[name] for name in _SUMS),
            )

        share_out(add, len(first_vertex_m))
        return sums


def patch_of_pixels(scene: Scene, patches: Patches, *, points_m: FloatArray, triangle: Int32Array) -> Int32Array:
    """`planner_core.scene.patches.patch_of_points`, to the last bit, in a tenth of its time."""
    corners_m, of = used_corners(scene, triangle[triangle >= 0])
    address = patches.first_patch, patches.depth, squared_edges(corners_m)
    patch = np.empty(triangle.shape, dtype=np.int32)
    first_vertex_m = np.ascontiguousarray(corners_m[:, 0])
    _find_pixels(points_m, triangle, of, first_vertex_m, *barycentric_slopes(corners_m), *address, patch)
    return patch


@compiled
def _find_pixels(
    points_m: Any, triangle: Any, of: Any, first_vertex_m: Any, slope1: Any, slope2: Any,
    first_patch: Any, depth: Any, edges: Any, patch: Any,
) -> None:  # fmt: skip
    for pixel in range(triangle.size):
        on = triangle[pixel]
        patch[pixel] = -1
        if on < 0:
            continue
        row = of[on]
        l1, l2 = 0.0, 0.0
        for axis in range(3):
            at = points_m[pixel, axis] - first_vertex_m[row, axis]
            l1 += at * slope1[row, axis]
            l2 += at * slope2[row, axis]
        w0, w1, w2 = np.float32(1.0 - l1 - l2), np.float32(l1), np.float32(l2)
        patch[pixel] = first_patch[on] + _code(w0, w1, w2, edges[row, 0], edges[row, 1], edges[row, 2], depth[on])


@compiled
def _code(l0: Any, l1: Any, l2: Any, q01: Any, q12: Any, q20: Any, depth: int) -> Any:
    """`planner_core.scene.patches.patch_code` of one point; all but the depth are float32."""
    code = 0
    for _ in range(depth):
        # 1, 2: name the longest edge ab; a tie goes to 01, then 12, then 20
        if q01 >= q12 and q01 >= q20:
            la, lb, lc, qab, qbc, qca = l0, l1, l2, q01, q12, q20
        elif q12 >= q20:
            la, lb, lc, qab, qbc, qca = l1, l2, l0, q12, q20, q01
        else:
            la, lb, lc, qab, qbc, qca = l2, l0, l1, q20, q01, q12
        # 3, 4: m is the middle of ab; child 0 = (a, m, c), child 1 = (m, b, c)
        qcm = (_TWO * qca + _TWO * qbc - qab) / _FOUR
        q01 = qab / _FOUR
        l2 = lc
        if la >= lb:
            l0, l1, q12, q20 = la - lb, _TWO * lb, qcm, qca
            code = 2 * code
        else:
            l0, l1, q12, q20 = _TWO * la, lb - la, qbc, qcm
            code = 2 * code + 1
    return code


@compiled
def _find(
    first: int, end: int, range_m: Any, triangle: Any, uv: Any, range_min_m: Any, range_max_m: Any,
    first_patch: Any, depth: Any, edges: Any, patch: Any, marks: Any,
) -> None:  # fmt: skip
    for beam in range(first, end):
        patch[beam] = -1
        if not (range_min_m <= range_m[beam] <= range_max_m and range_m[beam] < np.inf):
            continue
        on = triangle[beam]
        if first_patch[on] < 0:
            continue
        u, v = uv[beam, 0], uv[beam, 1]
        patch[beam] = first_patch[on] + _code(_ONE - u - v, u, v, edges[on, 0], edges[on, 1], edges[on, 2], depth[on])
        marks[patch[beam]] = 1


@compiled
def _cosine(beams: Any, beam: int, normal: Any, on: int) -> Any:
    along = beams[beam, 0] * normal[on, 0] + beams[beam, 1] * normal[on, 1] + beams[beam, 2] * normal[on, 2]
    return min(abs(along), _ONE)


@compiled
def _cosines(first: int, end: int, patch: Any, triangle: Any, beams: Any, normal: Any, cosine: Any) -> None:
    for beam in range(first, end):
        cosine[beam] = np.nan if patch[beam] < 0 else _cosine(beams, beam, normal, triangle[beam])


@compiled
def _count(patch: Any, triangle: Any, slot: Any, n_returns: Any, triangle_of_slot: Any) -> None:
    for beam in range(patch.size):
        if patch[beam] >= 0:
            n_returns[slot[patch[beam]]] += 1
            triangle_of_slot[slot[patch[beam]]] = triangle[beam]


@compiled
def _first_vertices(
    patch: Any, triangle: Any, first_patch: Any, depth: Any, edges: Any, corners_m: Any, first_vertex_m: Any
) -> None:
    """First vertex (n, 3) of patches (n,) on the triangles (n,), as `planner_core.scene.patches.patch_triangles`."""
    v = np.empty((3, 3))
    for i in range(patch.size):
        on = triangle[i]
        for k in range(3):
            for axis in range(3):
                v[k, axis] = corners_m[on, k, axis]
        a, b, c = 0, 1, 2
        q01, q12, q20 = edges[on, 0], edges[on, 1], edges[on, 2]
        code = patch[i] - first_patch[on]
        for level in range(int(depth[on])):
            if q01 >= q12 and q01 >= q20:
                qab, qbc, qca = q01, q12, q20
            elif q12 >= q20:
                a, b, c = b, c, a
                qab, qbc, qca = q12, q20, q01
            else:
                a, b, c = c, a, b
                qab, qbc, qca = q20, q01, q12
            qcm = (_TWO * qca + _TWO * qbc - qab) / _FOUR
            q01 = qab / _FOUR
            if (code >> (int(depth[on]) - 1 - level)) & 1 == 0:  # b becomes the middle
                q12, q20 = qcm, qca
                for axis in range(3):
                    v[b, axis] = 0.5 * (v[a, axis] + v[b, axis])
            else:
                q12, q20 = qbc, qcm
                for axis in range(3):
                    v[a, axis] = 0.5 * (v[a, axis] + v[b, axis])
        first_vertex_m[i] = v[a]


#: Columns in the order in which `_add` takes them.
_SUMS = (
    "point_sum_m",
    "square_sum_m2",
    "weight_sum",
    "weighted_point_sum_m",
    "weighted_square_sum_m2",
    "range_sum_m",
    "least_range_m",
    "greatest_cos_incidence",
)


@compiled
def _add(
    first: int, end: int, patch: Any, slot: Any, range_m: Any, triangle: Any, beams: Any, origin: Any,
    first_vertex_m: Any, normal: Any, point_sum: Any, square_sum: Any, weight_sum: Any, weighted_point_sum: Any,
    weighted_square_sum: Any, range_sum: Any, least_range: Any, greatest_cosine: Any,
) -> None:  # fmt: skip
    """Moments of the patches in slots first .. end - 1, of all beams in their order."""
    for beam in range(patch.size):
        if patch[beam] < 0:
            continue
        at = slot[patch[beam]]
        if not first <= at < end:
            continue
        cosine = _cosine(beams, beam, normal, triangle[beam])
        far = np.float64(range_m[beam])
        weight = 2.0 - np.float64(cosine)
        square = 0.0
        for axis in range(3):
            p = (origin[axis] + np.float64(beams[beam, axis]) * far) - first_vertex_m[at, axis]
            point_sum[at, axis] += p
            weighted_point_sum[at, axis] += weight * p
            square += p * p
        square_sum[at] += square
        weight_sum[at] += weight
        weighted_square_sum[at] += weight * square
        range_sum[at] += far
        least_range[at] = min(least_range[at], range_m[beam])
        greatest_cosine[at] = max(greatest_cosine[at], cosine)
