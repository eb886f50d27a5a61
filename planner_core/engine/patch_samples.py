"""Sample points of patches and the scanner's view of them: what patch mode casts, whichever engine casts it.

Input `Patches` (addresses), local frame, metres; output weights, points and limits. docs/method/patch-mode.md gives
the reasons.

            c           The first pattern: near the corners, near the middles of the edges, the centroid. What hides a
           / \\          part of a patch mostly has straight edges, so that the part that is seen mostly holds a corner.
          / 2 \\
         /5   4\\        The second pattern: more of the rim, and a lattice inside. It is cast where not all of the
        /   6   \\       first is seen, to find parts that hold none of it and to tell how large they are.
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
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    Patches,
    Scene,
    UInt8Array,
)
from planner_core.model.arrays import bounds_of, dots, lengths
from planner_core.scanner.template import azimuth_step_rad, is_full_turn
from planner_core.scene.patches import patch_triangles, squared_edges

UInt32Array = NDArray[np.uint32]

#: Distance of the rim's samples from the patch's edges, as a weight: strictly inside, so that neither the own edges nor
#: what meets them decides; near enough that a seen strip of a hundredth of the patch's height is found.
_RIM = 0.01
#: Share of a patch that a sample of the rim stands for, against one inside.
_RIM_SHARE = 0.3
#: A group has at most 16 patches, see `make_groups`.
GROUP_BITS = 4
#: A surface does not hide what lies within this share of its range behind it: two surfaces in one place are both seen.
SLACK = 2e-5
#: ... and never what lies farther behind it than this share, however grazing the beam.
SLACK_MOST = 1e-3
#: Rows and columns that a patch must span for a beam to be expected on it: then one meets it half of the time.
LEAST_SPAN = 0.5
#: Places that are kept at most: one takes 104 bytes.
MOST_KEPT = 2_000_000
N_RIM, N_FINE = 7, 22
#: Mark of a patch whose first pattern is seen whole; bit s of a mark is sample s.
ALL_RIM = np.uint32((1 << N_RIM) - 1)
#: All samples of a patch.
ALL_SAMPLES = np.uint32((1 << (N_RIM + N_FINE)) - 1)


def sample_pattern() -> FloatArray:
    """(29, 3): weights of a patch's second and third vertex at each sample, and the share that the sample stands for.

    The first 7 are the first pattern, the others the second. The shares add up to 1.
    """
    far, half, third = 1.0 - 2 * _RIM, (1.0 - _RIM) / 2, 1.0 / 3.0
    corners, middles = [(_RIM, _RIM), (far, _RIM), (_RIM, far)], [(half, _RIM), (half, half), (_RIM, half)]
    along = [_RIM + at * (1.0 - 3 * _RIM) for at in (1 / 6, 1 / 3, 2 / 3, 5 / 6)]
    rim = [place for at in along for place in ((at, _RIM), (_RIM, at), (at, 1.0 - _RIM - at))]
    inside = [((i + 0.8) / 5.4, (j + 0.8) / 5.4) for j in range(4) for i in range(4 - j)]
    places = np.array([*corners, *middles, (third, third), *rim, *inside])
    share = np.array([_RIM_SHARE] * 6 + [1.0] + [_RIM_SHARE] * len(rim) + [1.0] * len(inside))
    return np.column_stack([places, share / share.sum()])


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

    def limits(self) -> tuple[float, ...]:
        """Range, elevation, azimuth and incidence as squares: the first 8 of VIEW_ in kernels/patch_pack.h."""
        full = self.half_width_rad >= math.pi
        return (
            self.range_min_m**2,
            self.range_max_m**2,
            _signed_square(math.sin(self.low_rad)) if self.low_rad > -math.pi / 2 + 1e-6 else -2.0,
            _signed_square(math.sin(self.high_rad)) if self.high_rad < math.pi / 2 - 1e-6 else 2.0,
            math.cos(self.middle_rad),
            math.sin(self.middle_rad),
            -2.0 if full else _signed_square(math.cos(self.half_width_rad)),
            self.least_cos_incidence**2,
        )

    def packed(self, *, least_returns: float, rounding_m: float) -> Float32Array:
        """(13,) float32 as `kernels/sample_patches.cl` reads it (VIEW_)."""
        steps = (self.azimuth_step_rad, self.elevation_step_rad)
        return np.array([*self.limits(), *steps, least_returns, SLACK, rounding_m], dtype=np.float32)


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


def expected_returns(view: View, corners_m: FloatArray, normal: FloatArray, area_m2: FloatArray) -> FloatArray:
    """Beams (n,) to be expected on patches with corners (n, 3, 3), relative to the sensor, that nothing hides.

    Notes
    -----
    Area cos(incidence) / range^2 over the solid angle of a beam, azimuth step x elevation step x cos(elevation), at the
    centre. None where the patch spans less than `LEAST_SPAN` of a row or a column, as a table top at eye level does:
    there the number is right in the mean over many positions, but mostly none lands.
    """
    centre = corners_m.mean(axis=1)
    across2 = (centre[:, :2] ** 2).sum(axis=1)
    range2 = across2 + centre[:, 2] ** 2
    facing = np.abs(dots(centre, normal)) * area_m2
    x, y, z = (centre[:, k, None] for k in range(3))
    level = x * corners_m[..., 0] + y * corners_m[..., 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        columns = np.ptp(x * corners_m[..., 1] - y * corners_m[..., 0], axis=1) / (across2 * view.azimuth_step_rad)
        up = across2[:, None] * corners_m[..., 2] - z * level
        rows = np.ptp(up, axis=1) / (np.sqrt(across2) * range2 * view.elevation_step_rad)
        returns: FloatArray = facing / (range2 * np.sqrt(across2) * view.azimuth_step_rad * view.elevation_step_rad)
    returns[~((columns >= LEAST_SPAN) & (rows >= LEAST_SPAN))] = 0.0
    returns[(across2 <= 1e-8 * range2) & (facing > 0)] = np.inf  # straight up or down all columns meet
    return returns


def in_view(view: View, at_m: FloatArray, normal: FloatArray) -> BoolArray:
    """(n, s) whether points (n, s, 3), relative to the sensor, of surfaces with normals (n, 3) can give a return."""
    across = np.hypot(at_m[..., 0], at_m[..., 1])
    range_m = np.hypot(across, at_m[..., 2])
    elevation = np.arctan2(at_m[..., 2], across)
    turned = np.arctan2(at_m[..., 1], at_m[..., 0]) - view.middle_rad
    azimuth = np.abs((turned + np.pi) % (2 * np.pi) - np.pi)
    facing = np.abs(np.einsum("nsi,ni->ns", at_m, normal))
    inside: BoolArray = (
        (range_m >= view.range_min_m)
        & (range_m <= view.range_max_m)
        & (elevation >= view.low_rad)
        & (elevation <= view.high_rad)
        & (azimuth <= view.half_width_rad)
        & (facing >= view.least_cos_incidence * range_m)
    )
    return inside


def _bits(mask: UInt32Array) -> UInt8Array:
    """(M, 28) uint8, bits of marks (M,)."""
    return (mask[:, None] >> np.arange(N_RIM + N_FINE, dtype=np.uint32) & np.uint32(1)).astype(np.uint8)


def share_of(mask: UInt32Array) -> FloatArray:
    """(M,) part of the patch that the samples of marks (M,) stand for."""
    share = np.ones(mask.size)
    rest = np.flatnonzero((mask != ALL_RIM) & (mask != ALL_SAMPLES))  # few: most patches are seen whole
    share[rest] = _bits(mask[rest]) @ sample_pattern()[:, 2]
    return share


def middle_of(mask: UInt32Array) -> FloatArray:
    """(M, 2) weights of a patch's second and third vertex at the middle of the samples of marks (M,)."""
    bits = _bits(mask).astype(np.float64)
    middle: FloatArray = bits @ sample_pattern()[:, :2] / np.maximum(bits.sum(axis=1), 1.0)[:, None]
    return middle


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
    length = lengths(cross)
    normal = np.divide(cross, length[:, None], out=np.zeros_like(cross), where=length[:, None] > 0)
    return PatchPlaces(at, normal, 0.5 * length / np.exp2(patches.depth[triangle].astype(np.float64)))


class KeptPlaces:
    """Places of the patches of one scene, worked out once each; memory is taken when they are first used.

    Positions that are scanned one after another mostly see the same patches: where more than `most_kept` were seen, it
    begins anew. The places are those of `places_of` to the last bit.
    """

    def __init__(self, scene: Scene, patches: Patches, *, most_kept: int = MOST_KEPT) -> None:
        self._scene, self._patches, self._most_kept = scene, patches, min(most_kept, patches.n_patches)
        self._kept: PatchPlaces | None = None
        self._row, self._n_kept = np.zeros(0, dtype=np.int32), 0

    def of(self, patch: Int32Array) -> PatchPlaces:
        """Places of patches (N,), in their order; one may occur several times."""
        if self._kept is None:
            n = self._most_kept
            self._kept = PatchPlaces(np.empty((n, 3, 3)), np.empty((n, 3)), np.empty(n))
            # Of each patch its row among the kept ones, which are far fewer than a large scene has.
            self._row = np.full(self._patches.n_patches, -1, dtype=np.int32)
        new = np.unique(patch[self._row[patch] < 0]).astype(np.int32)
        if self._n_kept + new.size > self._most_kept:
            self._row[:], self._n_kept = -1, 0
            new = np.unique(patch).astype(np.int32)
        if new.size > self._most_kept:
            return _taken(places_of(self._scene, self._patches, new), np.searchsorted(new, patch))
        if new.size:
            found, rows = places_of(self._scene, self._patches, new), slice(self._n_kept, self._n_kept + new.size)
            self._kept.corners_m[rows], self._kept.normal[rows] = found.corners_m, found.normal
            self._kept.area_m2[rows] = found.area_m2
            self._row[new] = np.arange(rows.start, rows.stop, dtype=np.int32)
            self._n_kept = rows.stop
        return _taken(self._kept, self._row[patch])


def _taken(places: PatchPlaces, rows: Int32Array | Int64Array) -> PatchPlaces:
    return PatchPlaces(places.corners_m[rows], places.normal[rows], places.area_m2[rows])


@dataclass(frozen=True)
class PatchGroups:
    """Patches that lie together, up to 16 each; layout in kernels/sample_patches.cl.

    order : (T,) int32 triangles. groups : (G, 3) int32, rank in order, first code, patches. box : (G, 6) float32, m.
    """

    order: Int32Array
    groups: Int32Array
    box: Float32Array


def make_groups(scene: Scene, patches: Patches, order: Int32Array, *, only: BoolArray | None = None) -> PatchGroups:
    """Group all patches: 16 of a large triangle, or small triangles that follow each other in `order` (T,).

    Of `only` some (P,) bool, groups and small triangles that have none of them are left out.
    """
    n_required = np.concatenate([[0], np.cumsum(np.ones(patches.n_patches, dtype=np.bool_) if only is None else only)])
    order = order[n_required[patches.first_patch[order + 1]] > n_required[patches.first_patch[order]]]
    coarse_depth = np.maximum(patches.depth.astype(np.int32) - GROUP_BITS, 0).astype(np.uint8)
    rounded = replace(scene, vertices_m=scene.vertices_m.astype(np.float32).astype(np.float64))
    parts = patch_triangles(rounded, replace(patches, depth=coarse_depth)).astype(np.float32)
    box = np.concatenate(bounds_of(parts), axis=1)
    first_part = np.concatenate([[0], np.cumsum(np.int64(1) << coarse_depth.astype(np.int64))])
    large = patches.depth[order] >= GROUP_BITS
    small_first = np.concatenate([order[~large], order[large]])
    n_small = int((~large).sum())
    few, few_box = _group_small(patches.depth[small_first[:n_small]], box[first_part[small_first[:n_small]]])
    big = small_first[n_small:]
    count = np.int64(1) << coarse_depth[big].astype(np.int64)
    rank = np.repeat(np.arange(n_small, order.size), count)
    part = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    full = np.stack([rank, part << GROUP_BITS, np.full(rank.size, 1 << GROUP_BITS)], axis=1)
    full_box = box[np.repeat(first_part[big], count) + part]
    first = patches.first_patch[small_first[rank]] + full[:, 1]
    has_required = n_required[first + full[:, 2]] > n_required[first]
    return PatchGroups(
        order=np.ascontiguousarray(small_first, dtype=np.int32),
        groups=np.ascontiguousarray(np.concatenate([few, full[has_required]]), dtype=np.int32),
        box=np.ascontiguousarray(np.concatenate([few_box, full_box[has_required]])),
    )


def _group_small(depth: UInt8Array, box: Float32Array) -> tuple[Int64Array, Float32Array]:
    """Groups (G, 3) and boxes (G, 6) of triangles of at most 8 patches, in their order, none of them split.

    By the sixteen that a triangle's first patch falls in; one that its last triangle makes too full is cut in two.
    """
    if depth.size == 0:
        return np.empty((0, 3), dtype=np.int64), np.empty((0, 6), dtype=np.float32)
    size = np.int64(1) << depth.astype(np.int64)
    start = np.cumsum(size) - size
    sixteen = start >> GROUP_BITS
    total = np.bincount(sixteen, weights=size)
    half = (total[sixteen] > 1 << GROUP_BITS) & (start & 8 != 0)
    key = 2 * sixteen + half
    rank = np.flatnonzero(np.diff(key, prepend=-1))
    count = np.add.reduceat(size, rank)
    low, high = np.minimum.reduceat(box[:, :3], rank), np.maximum.reduceat(box[:, 3:], rank)
    return np.stack([rank, np.zeros_like(rank), count], axis=1), np.concatenate([low, high], axis=1)


def _signed_square(value: float) -> float:
    return value * abs(value)
