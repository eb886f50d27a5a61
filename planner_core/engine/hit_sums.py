"""Rows of patches from whole scans, on the host, to the bit that kernels/patch_returns.cl and patch_rows.cl give.

Where a scene is scanned in parts, it is known only at the end which hits are first. Local frame, metres;
docs/method/returns.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.engine.patch_returns import Content, ReturnRows
from planner_core.engine.patch_rows import in_metres
from planner_core.model import BeamTemplate, BoolArray, Float32Array, Int32Array, Int64Array, ScanBatch, Scene
from planner_core.scanner.template import directions
from planner_core.scene.patches import squared_edges

_F = np.float32
#: As in kernels/patch_returns.cl.
_UNIT, _FARTHEST, _GREATEST_SQUARE = _F(2**20), _F(1.25), _F(1.99)


class HitSums:
    """Rows of one scene's scans. address (T, 2) int32: first patch and depth of each triangle."""

    def __init__(self, scene: Scene, address: Int32Array) -> None:
        self._scene, self._address = scene, address

    def row(
        self, template: BeamTemplate, scans: ScanBatch, index: int, position_m: Float32Array, content: Content
    ) -> ReturnRows:
        """Row of scan number `index`, whose triangles are those of this object's scene."""
        of_beam = scans.patch[index].ravel()
        seen = np.flatnonzero(of_beam >= 0)
        patch, place, count = np.unique(of_beam[seen], return_inverse=True, return_counts=True)
        length = np.array([patch.size], dtype=np.int64)
        arrays: dict[str, NDArray[Any]] = {"patch": patch.astype(np.int32)}
        if content is not Content.PATCHES:
            arrays["n_returns"] = count.astype(np.int32)
        if content is Content.MOMENTS:
            some = np.zeros(patch.size, dtype=np.int32)
            some[place] = scans.triangle[index].ravel()[seen]
            beams = directions(template).astype(_F).reshape(-1, 3)[seen]
            hits = (scans.range_m[index].ravel()[seen], scans.cos_incidence[index].ravel()[seen])
            arrays |= self._moments(arrays["patch"], some, place, beams, *hits, position_m)
            arrays = in_metres(arrays)
        return ReturnRows(length=length, arrays=arrays)

    def _moments(
        self,
        patch: Int32Array,
        triangle: Int32Array,
        place: Int64Array,
        beams: Float32Array,
        range_m: Float32Array,
        cosine: Float32Array,
        position_m: Float32Array,
    ) -> dict[str, NDArray[Any]]:
        """`add_hits` of the kernel: every contribution rounded to a whole number by itself."""
        centre, power = self._frames(patch, triangle, position_m)
        scale = np.ldexp(_F(1), -power)[place]
        x, y, z = (np.clip((beams[:, k] * range_m + centre[place, k]) * scale, -_FARTHEST, _FARTHEST) for k in range(3))
        square = np.minimum(x * x + y * y + z * z, _GREATEST_SQUARE)
        w = _F(2) - cosine
        metres = np.rint(range_m)
        parts = (x, y, z, square, w, w * x, w * y, w * z, w * square)
        sums = np.empty((patch.size, 10), dtype=np.int64)
        for k, part in enumerate(parts):
            sums[:, k] = _sum(np.rint(part * _UNIT), place, patch.size)
        rest = np.rint((range_m - metres) * _UNIT)
        sums[:, 9] = (_sum(metres, place, patch.size) << 20) + _sum(rest, place, patch.size)
        extremes = np.stack([np.full(patch.size, np.inf, dtype=_F), np.zeros(patch.size, dtype=_F)], axis=1)
        np.minimum.at(extremes[:, 0], place, range_m)
        np.maximum.at(extremes[:, 1], place, cosine)
        return {"power": power, "sums": sums, "extremes": extremes}

    def _frames(
        self, patch: Int32Array, triangle: Int32Array, position_m: Float32Array
    ) -> tuple[Float32Array, Int32Array]:
        """Origin minus first vertex (P, 3), and the power of two above the longest edge (P,): `frame_of`."""
        corners_m = self._scene.vertices_m[self._scene.triangles[triangle]]
        corners, edges = corners_m.astype(_F), squared_edges(corners_m)
        first, depth = self._address[triangle].T
        code = patch - first
        # weights of vertices 1 and 2 in the corners of the part
        weights = np.zeros((3, 2, patch.size), dtype=_F)
        weights[1, 0], weights[2, 1] = 1, 1
        q = np.array(edges.T, dtype=_F)
        for level in range(int(depth.max(initial=0)) - 1, -1, -1):
            on = depth > level
            weights[:, :, on], q[:, on] = _descend(weights[:, :, on], q[:, on], ((code[on] >> level) & 1) == 1)
        a1, a2 = weights[0]
        at = [corners[:, v, :] for v in range(3)]
        centre = (position_m - at[0]) - (a1[:, None] * (at[1] - at[0]) + a2[:, None] * (at[2] - at[0]))
        above = ((q.max(axis=0).view(np.int32) >> 23) & 255) - 126
        return centre, np.maximum((above + 1) >> 1, -60).astype(np.int32)


def _descend(weights: Float32Array, q: Float32Array, second: BoolArray) -> tuple[Float32Array, Float32Array]:
    """One halving: corners' weights (3, 2, N) and squared edges 01, 12, 20 (3, N) of the child."""
    is01 = (q[0] >= q[1]) & (q[0] >= q[2])
    turn = np.where(is01, 0, np.where(q[1] >= q[2], 1, 2))
    rows = np.arange(turn.size)
    qab, qbc, qca = (q[(turn + k) % 3, rows] for k in range(3))
    p, r, s = (weights[(turn + k) % 3, :, rows].T for k in range(3))
    middle = _F(0.5) * (p + r)
    qcm = (_F(2) * qca + _F(2) * qbc - qab) / _F(4)
    child = np.stack([np.where(second, middle, p), np.where(second, r, middle), s])
    return child, np.stack([qab / _F(4), np.where(second, qbc, qcm), np.where(second, qcm, qca)])


def _sum(values: Float32Array, place: Int64Array, n: int) -> Int64Array:
    """Sums of whole numbers below 2^22: exact in float64."""
    return np.bincount(place, weights=values, minlength=n).astype(np.int64)
