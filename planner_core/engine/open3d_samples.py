"""Patch mode through Open3D's tests of occlusion: kernels/sample_patches.cl for machines without OpenCL.

Input an `Open3DEngine`, a `View` and positions (local frame, metres); output marks as `PatchMode` has them. The samples
and the limits of the view are the kernel's. Most patches are hidden, and most of those by one triangle, which mostly
hides their neighbours, too. So one patch of `_GROUP` is probed; the triangle that hides its centre is tried on the
others, then each that is left is probed itself. Only samples that no triangle found so hides go through Open3D.

A triangle hides a patch where the patch's corners lie within its cone from the position and behind it, by margins a
hundred times the rounding of Open3D's float32: Open3D would say the same of every sample, so that nothing depends on
which triangles were tried. CONTROL FLOW: `Open3DSamples._look`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.compiled import compiled, share_out
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.patch_samples import (
    ALL_RIM,
    N_FINE,
    N_RIM,
    SLACK,
    SLACK_MOST,
    UInt32Array,
    View,
    expected_returns,
    places_of,
    rounding_of,
    sample_pattern,
    share_of,
)
from planner_core.model import BoolArray, Float32Array, FloatArray, Int32Array, Optics, Patches, Scene

#: Patches that follow each other and share one probe. Measured on the house: 8 to 32 hardly differ.
_GROUP = 16
#: Least angle of what a triangle hides from the planes through its edges, rad; how much farther away it has to be, as a
#: share of the triangle's distance; and the same as a share of its own, for triangles seen edge-on.
_EDGE_MARGIN, _DEPTH_MARGIN, _GRAZING_MARGIN = 1e-5, 1e-5, 1e-6
#: Share of its reach that a triangle's plane has to be off the position for the triangle to be relied on.
_LEAST_DISTANCE = 1e-5


class Open3DSamples:
    """Casts the samples of patches, of all or `only` some (P,) bool, see `planner_core.engine.patch_mode`."""

    def __init__(self, engine: Open3DEngine, scene: Scene, patches: Patches, *, only: BoolArray | None = None) -> None:
        self._engine = engine
        places = places_of(scene, patches, np.arange(patches.n_patches, dtype=np.int32))
        self._corners, self._normal, self._area_m2 = places.corners_m, places.normal, places.area_m2
        self._places = (places.corners_m, places.normal, np.array([SLACK, rounding_of(scene), SLACK_MOST]))
        self._centre = places.corners_m.mean(axis=1)
        self._weights = np.ascontiguousarray(sample_pattern()[:, :2])
        optics = scene.optics_of_triangle
        returning = np.ones(scene.n_triangles, dtype=np.bool_) if optics is None else optics == Optics.RETURNS
        required = returning[patches.triangle_of_patch]
        self._returning = np.flatnonzero(required if only is None else required & only).astype(np.int32)

    def marks(self, view: View, positions_m: Float32Array, least_returns: float) -> UInt32Array:
        """(S, P) uint32: bit s, sample s of the patch is seen; the second pattern's only where not all of the first."""
        out = np.zeros((len(positions_m), self._corners.shape[0]), dtype=np.uint32)
        limits = np.array(view.limits())
        for row, position in zip(out, positions_m.astype(np.float64), strict=True):
            self._look(limits, position, row)
            seen = np.flatnonzero(row)
            returns = expected_returns(view, self._corners[seen] - position, self._normal[seen], self._area_m2[seen])
            row[seen[share_of(row[seen]) * returns < least_returns]] = 0
        return out

    def _look(self, limits: FloatArray, position_m: FloatArray, marks: UInt32Array) -> None:
        """Mark the samples that are seen of each patch."""
        # 1. What hides one patch of a group is tried on all of them.
        group = self._blockers(position_m, self._returning[::_GROUP])
        left = self._left_by(position_m, self._returning, np.repeat(group, _GROUP)[: self._returning.size])
        patch = self._returning[left]
        # 2. What hides each patch that is left is tried on it.
        blocker = self._blockers(position_m, patch)
        left = self._left_by(position_m, patch, blocker)
        patch, blocker = patch[left], blocker[left]
        # 3. The first pattern, and the second one where not all of the first is seen.
        self._cast(limits, position_m, patch, blocker, (0, N_RIM), marks)
        again = marks[patch] != ALL_RIM
        self._cast(limits, position_m, patch[again], blocker[again], (N_RIM, N_RIM + N_FINE), marks)

    def _blockers(self, position_m: FloatArray, patch: Int32Array) -> Int32Array:
        """(n,) triangle in front of the centre of each patch (n,); -1: there is none."""
        return self._engine.first_blockers(position_m, self._centre[patch] - position_m)

    def _left_by(self, position_m: FloatArray, patch: Int32Array, blocker: Int32Array) -> BoolArray:
        """(n,) whether a triangle (n,), or -1, does not hide all of a patch (n,)."""
        left = np.empty(patch.size, dtype=np.bool_)

        def leave(first: int, end: int) -> None:
            _leave(first, end, position_m, patch, blocker, self._engine.corners_m, *self._places, left)

        share_out(leave, patch.size)
        return left

    def _cast(
        self,
        limits: FloatArray,
        position_m: FloatArray,
        patch: Int32Array,
        blocker: Int32Array,
        samples: tuple[int, int],
        marks: UInt32Array,
    ) -> None:
        """Add the bits of the samples that are seen to the marks of patches (n,); blocker : (n,), see `_left_by`."""
        weights = self._weights[slice(*samples)]
        targets = np.empty((patch.size, len(weights), 3), dtype=np.float32)
        is_open = np.empty((patch.size, len(weights)), dtype=np.bool_)

        def place(first: int, end: int) -> None:
            _place(
                *(first, end, position_m, patch, blocker, self._engine.corners_m, *self._places),
                *(weights, limits, targets, is_open),
            )

        share_out(place, patch.size)
        is_open[is_open] = ~self._engine.are_hidden(position_m, targets[is_open])
        marks[patch] |= is_open @ (np.uint32(1) << np.arange(*samples, dtype=np.uint32))


@compiled
def _far_of(corners: Any, normal: Any, slack: Any, patch: int, position_m: Any) -> Any:
    """1 + slack, see docs/method/patch-mode.md: what hides a patch lies in front of it by that factor.

    slack : (3,) as a share, the rounding of coordinates in metres, and at most.
    """
    from_plane = 0.0
    for axis in range(3):
        from_plane += (corners[patch, 0, axis] - position_m[axis]) * normal[patch, axis]
    if from_plane == 0.0:
        return 1.0 + slack[2]
    return 1.0 + min(slack[0] + slack[1] / abs(from_plane), slack[2])


@compiled
def _shadow_of(triangle: int, corners_m: Any, position_m: Any, planes: Any) -> Any:
    """Planes (4, 3) of a triangle's shadow, inward unit normals: through its edges and the position, and its own.

    Returns the distance of its own plane; 0 where the triangle is seen so nearly edge-on that it is not relied on.
    """
    if triangle < 0:
        return 0.0
    v = np.empty((3, 3))
    reach = 0.0
    for k in range(3):
        for axis in range(3):
            v[k, axis] = np.float64(corners_m[triangle, k, axis]) - position_m[axis]
            reach = max(reach, abs(v[k, axis]))
    for k in range(4):
        if k < 3:
            a0, a1, a2 = v[k]
            b0, b1, b2 = v[(k + 1) % 3]
        else:
            a0, a1, a2 = v[1] - v[0]
            b0, b1, b2 = v[2] - v[0]
        n0, n1, n2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        length = (n0 * n0 + n1 * n1 + n2 * n2) ** 0.5
        if length == 0.0:
            return 0.0
        planes[k, 0], planes[k, 1], planes[k, 2] = n0 / length, n1 / length, n2 / length
    distance = planes[3, 0] * v[0, 0] + planes[3, 1] * v[0, 1] + planes[3, 2] * v[0, 2]
    if distance < 0.0:
        planes[:] = -planes
        distance = -distance
    return distance if distance > _LEAST_DISTANCE * reach else 0.0


@compiled
def _is_hidden(x: float, y: float, z: float, far: float, planes: Any, distance: float) -> Any:
    """Whether a point, relative to the position, surely lies in a triangle's shadow, and behind it by a factor."""
    reach = abs(x) + abs(y) + abs(z)
    for k in range(3):
        if not x * planes[k, 0] + y * planes[k, 1] + z * planes[k, 2] >= _EDGE_MARGIN * reach:
            return False
    behind = x * planes[3, 0] + y * planes[3, 1] + z * planes[3, 2]
    return behind >= distance * far * (1.0 + _DEPTH_MARGIN) + _GRAZING_MARGIN * reach


@compiled
def _leave(
    first: int, end: int, position_m: Any, patch: Any, blocker: Any, corners_m: Any,
    corners: Any, normal: Any, slack: Any, left: Any,
) -> None:  # fmt: skip
    planes = np.empty((4, 3))
    distance, of = 0.0, -1
    for i in range(first, end):
        if blocker[i] != of:
            of = blocker[i]
            distance = _shadow_of(of, corners_m, position_m, planes)
        left[i] = True
        if distance == 0.0:
            continue
        far = _far_of(corners, normal, slack, patch[i], position_m)
        hidden = True
        for k in range(3):
            x = corners[patch[i], k, 0] - position_m[0]
            y = corners[patch[i], k, 1] - position_m[1]
            z = corners[patch[i], k, 2] - position_m[2]
            if not _is_hidden(x, y, z, far, planes, distance):
                hidden = False
                break
        left[i] = not hidden


@compiled
def _is_in_view(x: float, y: float, z: float, n: Any, limits: Any) -> Any:
    """`look` of kernels/patch_pack.h: signed squares in place of angles; n is the unit normal."""
    across2 = x * x + y * y
    range2 = across2 + z * z
    height = z * abs(z)
    along = limits[4] * x + limits[5] * y
    facing = x * n[0] + y * n[1] + z * n[2]
    return (
        limits[0] <= range2 <= limits[1]
        and limits[2] * range2 <= height <= limits[3] * range2
        and along * abs(along) >= limits[6] * across2
        and facing * facing >= limits[7] * range2
    )


@compiled
def _place(
    first: int, end: int, position_m: Any, patch: Any, blocker: Any, corners_m: Any,
    corners: Any, normal: Any, slack: Any, weights: Any, limits: Any, targets: Any, is_open: Any,
) -> None:  # fmt: skip
    """Samples of patches that a beam can meet and the patch's blocker does not hide, and their targets."""
    planes = np.empty((4, 3))
    distance, of = 0.0, -1
    v = np.empty((3, 3))
    for i in range(first, end):
        if blocker[i] != of:
            of = blocker[i]
            distance = _shadow_of(of, corners_m, position_m, planes)
        far = _far_of(corners, normal, slack, patch[i], position_m)
        for k in range(3):
            for axis in range(3):
                v[k, axis] = corners[patch[i], k, axis] - position_m[axis]
        for k in range(2):
            for axis in range(3):
                v[k + 1, axis] -= v[0, axis]
        for s in range(weights.shape[0]):
            x = v[0, 0] + (weights[s, 0] * v[1, 0] + weights[s, 1] * v[2, 0])
            y = v[0, 1] + (weights[s, 0] * v[1, 1] + weights[s, 1] * v[2, 1])
            z = v[0, 2] + (weights[s, 0] * v[1, 2] + weights[s, 1] * v[2, 2])
            is_open[i, s] = _is_in_view(x, y, z, normal[patch[i]], limits) and not (
                distance > 0.0 and _is_hidden(x, y, z, far, planes, distance)
            )
            targets[i, s, 0], targets[i, s, 1], targets[i, s, 2] = x / far, y / far, z / far
