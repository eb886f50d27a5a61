"""Sample points of patches and the scanner's view of them: what patch mode casts, whichever engine casts it.

Input `Patches` (addresses), local frame, metres; output weights, points and limits. docs/method/patch-mode.md says why.

            c           The first pattern: near the corners, near the middles of the edges, the centroid. What hides a
           / \\          part of a patch mostly has straight edges, so that the part that is seen mostly holds a corner.
          / 2 \\
         /5   4\\        The second pattern fills the patch evenly; it is cast where samples of the first disagree.
        /   6   \\
       /0   3   1\\
      a-----------b
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner_core.errors import RequirementError
from planner_core.model import (
    BeamTemplate,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    Patches,
    Scene,
    UInt8Array,
)
from planner_core.scan.template import azimuth_step_rad, is_full_turn
from planner_core.scene.patches import patch_triangles, squared_edges

UInt32Array = NDArray[np.uint32]

#: Distance of the first pattern's samples from the patch's edges, as a weight: strictly inside, so that neither the own
#: edges nor what meets them decides; near enough that a seen corner of 1/25 of the patch's height is found.
_RIM = 0.02
#: Codes of a family of patches differ in their last bits only: 16 neighbours, see `family_of_patch`.
FAMILY_BITS = 4
#: A surface does not hide what lies within this share of its range behind it: two surfaces in one place are both seen.
SLACK = 2e-5
#: ... and never what lies farther behind it than this share, however grazing the beam.
SLACK_MOST = 1e-3
#: Mark of a patch for which both patterns were cast; bit s of a mark is sample s.
REFINED = np.uint32(1 << 31)
N_RIM, N_FINE = 7, 21
_ALL_RIM = np.uint32((1 << N_RIM) - 1)


def sample_weights() -> FloatArray:
    """Weights (28, 2) of a patch's second and third vertex at the samples: 7 of the first pattern, 21 of the second."""
    far, middle = 1.0 - 2 * _RIM, (1.0 - _RIM) / 2
    rim = [(_RIM, _RIM), (far, _RIM), (_RIM, far), (middle, _RIM), (middle, middle), (_RIM, middle), (1 / 3, 1 / 3)]
    # Rows of 6, 5, ... 1 points, a third of their distance from the edges: each stands for about the same area.
    lattice = [((i + 1 / 3) / 6, (j + 1 / 3) / 6) for j in range(6) for i in range(6 - j)]
    return np.array(rim + lattice)


@dataclass(frozen=True)
class View:
    """What a scanner can return, and how densely: limits of range, elevation, azimuth and incidence; angular steps.

    Elevations lie in [low_rad, high_rad], azimuths within half_width_rad of middle_rad (pi: a full turn). Both ends of
    every limit are within. A table of uneven steps counts with its mean step.
    """

    range_min_m: float
    range_max_m: float
    low_rad: float
    high_rad: float
    middle_rad: float
    half_width_rad: float
    azimuth_step_rad: float
    elevation_step_rad: float
    least_cos_incidence: float

    def packed(self, *, least_returns: float, rounding_m: float) -> Float32Array:
        """(12,) float32 as `kernels/sample_patches.cl` reads it (VIEW_)."""
        full = self.half_width_rad >= math.pi
        values = (
            self.range_min_m**2,
            self.range_max_m**2,
            _signed_square(math.sin(self.low_rad)) if self.low_rad > -math.pi / 2 + 1e-6 else -2.0,
            _signed_square(math.sin(self.high_rad)) if self.high_rad < math.pi / 2 - 1e-6 else 2.0,
            math.cos(self.middle_rad),
            math.sin(self.middle_rad),
            -2.0 if full else _signed_square(math.cos(self.half_width_rad)),
            self.least_cos_incidence**2,
            self.azimuth_step_rad * self.elevation_step_rad,
            least_returns,
            SLACK,
            rounding_m,
        )
        return np.array(values, dtype=np.float32)


def view_of(template: BeamTemplate, *, max_incidence_rad: float | None = None) -> View:
    """Field of view and steps of `template`; surfaces met at more than `max_incidence_rad` give no return.

    Raises
    ------
    RequirementError
        The template is one row or column, whose steps nobody knows; or the incidence is not in (0, pi / 2].
    """
    if min(template.shape) < 2:
        raise RequirementError(
            f"scan mode patches: got a scanner of {template.shape[0]} rows x {template.shape[1]} columns, expected at "
            "least 2 x 2; use scan mode beams"
        )
    if max_incidence_rad is not None and not 0 < max_incidence_rad <= math.pi / 2:
        raise RequirementError(f"max_incidence_rad: got {max_incidence_rad}, expected more than 0 and at most pi / 2")
    low, high = float(template.elevation_rad.min()), float(template.elevation_rad.max())
    offset = template.azimuth_offset_rad
    first = float(template.azimuth_rad[0]) + (0.0 if offset is None else float(offset.min()))
    last = float(template.azimuth_rad[-1]) + (0.0 if offset is None else float(offset.max()))
    half = math.pi if is_full_turn(template) else min((last - first) / 2, math.pi)
    return View(
        range_min_m=template.range_min_m,
        range_max_m=template.range_max_m,
        low_rad=low,
        high_rad=high,
        middle_rad=(first + last) / 2,
        half_width_rad=half,
        azimuth_step_rad=azimuth_step_rad(template),
        elevation_step_rad=(high - low) / (template.shape[0] - 1),
        least_cos_incidence=0.0 if max_incidence_rad is None else math.cos(max_incidence_rad),
    )


def rounding_of(scene: Scene) -> float:
    """Rounding of the scene's float32 coordinates and of sums of them, metres: planes may be off by as much."""
    return float(4 * np.spacing(np.float32(np.abs(scene.vertices_m).max())))


def patch_corner_weights(edges: Float32Array, depth: UInt8Array, code: Int32Array) -> FloatArray:
    """Weights of a triangle's vertices 1 and 2 at the corners of patches: (N, 3, 2), exact.

    edges : (N, 3) squared edges of each patch's triangle, see `planner_core.scene.patches.squared_edges`. depth : (N,)
    of each patch's triangle. code : (N,) of each patch.

    Notes
    -----
    The rule of docs/method/patches.md from code to place instead of from place to code. Halves of halves are exact.
    """
    corner = np.broadcast_to(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), (code.size, 3, 2)).copy()
    q = np.array(edges, dtype=np.float32)
    steps, path = depth.astype(np.int64), code.astype(np.int64)
    for level in range(int(steps.max(initial=0))):
        live = np.flatnonzero(steps > level)
        second = (path[live] >> (steps[live] - 1 - level)) & 1 == 1
        longest = _longest_edge(q[live])
        turn = (longest[:, None] + np.arange(3)) % 3
        named = np.take_along_axis(corner[live], turn[..., None], axis=1)
        qab, qbc, qca = np.take_along_axis(q[live], turn, axis=1).T
        qcm = (np.float32(2) * qca + np.float32(2) * qbc - qab) / np.float32(4)
        middle = 0.5 * (named[:, 0] + named[:, 1])
        pick = second[:, None]
        corner[live] = np.stack(
            [np.where(pick, middle, named[:, 0]), np.where(pick, named[:, 1], middle), named[:, 2]], axis=1
        )
        q[live] = np.stack([qab / np.float32(4), np.where(second, qbc, qcm), np.where(second, qcm, qca)], axis=1)
    return corner


def _longest_edge(q: Float32Array) -> Int64Array:
    """0, 1, 2 for edge 01, 12, 20 of squared edges (N, 3); a tie goes to the first: `argmax` does just that."""
    return np.asarray(q.argmax(axis=1), dtype=np.int64)


@dataclass(frozen=True)
class PatchPlaces:
    """Where patches are, a row each. corners_m (N, 3, 3) float64, local frame; normal (N, 3) unit; area_m2 (N,)."""

    corners_m: FloatArray
    normal: FloatArray
    area_m2: FloatArray


def places_of(scene: Scene, patches: Patches, patch: Int32Array) -> PatchPlaces:
    """Find patches (N,) by their numbers, on triangles rounded to float32 as the engines hold them."""
    triangle = np.searchsorted(patches.first_patch, patch, side="right") - 1
    corners = scene.vertices_m[scene.triangles[triangle]]
    weights = patch_corner_weights(
        squared_edges(corners), patches.depth[triangle], (patch - patches.first_patch[triangle]).astype(np.int32)
    )
    v = corners.astype(np.float32).astype(np.float64)
    e, f = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    at = v[:, :1] + weights[..., :1] * e[:, None] + weights[..., 1:] * f[:, None]
    cross = np.cross(e, f)
    length = np.sqrt((cross * cross).sum(axis=1))
    normal = np.divide(cross, length[:, None], out=np.zeros_like(cross), where=length[:, None] > 0)
    return PatchPlaces(at, normal, 0.5 * length / np.exp2(patches.depth[triangle].astype(np.float64)))


def family_of_patch(patches: Patches) -> Int64Array:
    """(P,) number of each patch's family: patches of a triangle that share all but the last 4 bits of their codes."""
    size = np.diff(patches.first_patch)
    first_family = np.concatenate([[0], np.cumsum(np.maximum(size >> FAMILY_BITS, 1), dtype=np.int64)])
    code = np.arange(patches.n_patches, dtype=np.int64) - np.repeat(patches.first_patch[:-1], size)
    family: Int64Array = np.repeat(first_family[:-1], size) + (code >> FAMILY_BITS)
    return family


@dataclass(frozen=True)
class PatchGroups:
    """Patches that lie together, up to 16 each; layout in kernels/sample_patches.cl.

    order : (T,) int32 triangles. groups : (G, 3) int32, rank in order, first code, patches. box : (G, 6) float32, m.
    """

    order: Int32Array
    groups: Int32Array
    box: Float32Array


def make_groups(scene: Scene, patches: Patches, order: Int32Array) -> PatchGroups:
    """Group all patches: families of large triangles, and small triangles that follow each other in `order` (T,)."""
    family = 1 << FAMILY_BITS
    coarse_depth = np.maximum(patches.depth.astype(np.int32) - FAMILY_BITS, 0).astype(np.uint8)
    rounded = replace(scene, vertices_m=scene.vertices_m.astype(np.float32).astype(np.float64))
    parts = patch_triangles(rounded, replace(patches, depth=coarse_depth)).astype(np.float32)
    box = np.concatenate([parts.min(axis=1), parts.max(axis=1)], axis=1)
    first_part = np.concatenate([[0], np.cumsum(np.int64(1) << coarse_depth.astype(np.int64))])
    large = patches.depth[order] >= FAMILY_BITS
    small_first = np.concatenate([order[~large], order[large]])
    n_small = int((~large).sum())
    few, few_box = _group_small(patches.depth[small_first[:n_small]], box[first_part[small_first[:n_small]]])
    big = small_first[n_small:]
    count = np.int64(1) << coarse_depth[big].astype(np.int64)
    rank = np.repeat(np.arange(n_small, order.size), count)
    part = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    families = np.stack([rank, part << FAMILY_BITS, np.full(rank.size, family)], axis=1)
    return PatchGroups(
        order=np.ascontiguousarray(small_first, dtype=np.int32),
        groups=np.ascontiguousarray(np.concatenate([few, families]), dtype=np.int32),
        box=np.ascontiguousarray(np.concatenate([few_box, box[np.repeat(first_part[big], count) + part]])),
    )


def _group_small(depth: UInt8Array, box: Float32Array) -> tuple[Int64Array, Float32Array]:
    """Groups (G, 3) and boxes (G, 6) of triangles of at most 8 patches, in their order, none of them split.

    By the sixteen that a triangle's first patch falls in; one that its last triangle makes too full is cut in two.
    """
    if depth.size == 0:
        return np.empty((0, 3), dtype=np.int64), np.empty((0, 6), dtype=np.float32)
    size = np.int64(1) << depth.astype(np.int64)
    start = np.cumsum(size) - size
    sixteen = start >> FAMILY_BITS
    total = np.bincount(sixteen, weights=size)
    half = (total[sixteen] > 1 << FAMILY_BITS) & (start & 8 != 0)
    key = 2 * sixteen + half
    rank = np.flatnonzero(np.diff(key, prepend=-1))
    count = np.add.reduceat(size, rank)
    low, high = np.minimum.reduceat(box[:, :3], rank), np.maximum.reduceat(box[:, 3:], rank)
    return np.stack([rank, np.zeros_like(rank), count], axis=1), np.concatenate([low, high], axis=1)


def _signed_square(value: float) -> float:
    return value * abs(value)
