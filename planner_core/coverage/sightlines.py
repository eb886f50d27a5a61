"""Lines of sight: which limit keeps a surface from being seen well enough, where candidates have it in plain view.

Input sample surfaces, candidates and limits required (local frame, metres); output a reason for each sample that some
viewpoint sees when range, field of view and density do not matter, and nothing for the others. docs/method/unseen.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.coverage.levels import Observations, with_noise
from planner_core.coverage.surfaces import Surfaces
from planner_core.engine.patch_mode import LEAST_RETURNS
from planner_core.engine.patch_samples import View, expected_returns, in_view, view_of
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    FloatArray,
    Int64Array,
    Optics,
    PointLimits,
    Survey,
)
from planner_core.model.unseen import COVERED, IN_SOLIDS, OUT_OF_RANGE, OUT_OF_VIEW, TOO_NOISY, TOO_OBLIQUE, TOO_SPARSE

#: A sample is tested from this many viewpoints near by, and as many spread over all: across halls and atria.
N_NEAR, N_SPREAD = 48, 16
#: Viewpoints are candidates, one of each cube of this side; of larger ones where that would be more than
#: `MAX_VIEWPOINTS`.
_VIEWPOINT_M = 0.75
MAX_VIEWPOINTS = 2048
#: Beyond this incidence a surface without returns is too oblique, and not the scan too sparse, whatever is required.
GRAZING_RAD = float(np.deg2rad(80.0))
#: A ray that ends this near the sample, and a share of its length, ends on it: float32 coordinates.
_ON_SURFACE_M, _ON_SURFACE_SHARE = 1e-3, 2e-5
#: Panes that a line of sight is followed through.
_MAX_PANES = 8
_BATCH_RAYS = 200_000

#: In the order in which they are named where the best view fails by several.
_LIMITS = np.array([OUT_OF_RANGE, OUT_OF_VIEW, TOO_OBLIQUE, TOO_SPARSE, TOO_NOISY], dtype=np.uint8)


def viewpoints(positions_m: FloatArray) -> FloatArray:
    """(V, 3) of positions (N, 3): the first of each cube, at most `MAX_VIEWPOINTS`."""
    side_m = _VIEWPOINT_M
    while True:
        cube = np.floor(positions_m / side_m).astype(np.int64)
        _, first = np.unique(cube, axis=0, return_index=True)
        if first.size <= MAX_VIEWPOINTS:
            return positions_m[np.sort(first)]
        side_m *= 1.25


def sight_reasons(
    survey: Survey,
    required: PointLimits,
    engine: ScanEngine,
    samples: Surfaces,
    views_m: FloatArray,
) -> Int64Array:
    """(N,) why each sample is not seen well enough though in plain view; `COVERED` where no viewpoint (V, 3) has it so.

    `IN_SOLIDS`: another surface lies in the same place, and no beam can distinguish which of both it meets.
    """
    out = np.full(samples.patch.size, COVERED, dtype=np.int64)
    if not views_m.size:
        return out
    for rows, views in _pairs(samples, views_m):
        sample = np.repeat(rows, views.shape[1])
        at_m = views_m[views.ravel()]
        own, other = _plain_view(survey, engine, samples, sample, at_m)
        out[np.setdiff1d(sample[other], sample[own])] = IN_SOLIDS
        sample, at_m = sample[own], at_m[own]
        fails, range_m = _failures(survey, required, samples.take(sample), at_m)
        # The view that fails by the fewest limits, of those the nearest.
        order = np.lexsort((range_m, fails.sum(axis=1), sample))
        seen, best = np.unique(sample[order], return_index=True)
        fails = fails[order[best]]
        out[seen] = np.where(fails.any(axis=1), _LIMITS[fails.argmax(axis=1)], TOO_SPARSE)
    return out


def _pairs(samples: Surfaces, views_m: FloatArray) -> Iterator[tuple[Int64Array, Int64Array]]:
    """Samples (B,) and the viewpoints (B, W) that each is tested from, some samples at a time."""
    from scipy.spatial import cKDTree

    n_views = views_m.shape[0]
    spread = np.arange(0, n_views, max(1, n_views // N_SPREAD))[:N_SPREAD] if n_views > N_NEAR else np.zeros(0, int)
    tree = cKDTree(views_m)
    step = max(1, _BATCH_RAYS // (N_NEAR + N_SPREAD))
    for first in range(0, samples.patch.size, step):
        rows = np.arange(first, min(first + step, samples.patch.size))
        _, near = tree.query(samples.centroid_m[rows], k=range(1, min(N_NEAR, n_views) + 1))
        far = np.broadcast_to(spread, (rows.size, spread.size))
        yield rows, np.concatenate([near.reshape(rows.size, -1), far], axis=1).astype(np.int64)


def _plain_view(
    survey: Survey, engine: ScanEngine, samples: Surfaces, sample: Int64Array, at_m: FloatArray
) -> tuple[BoolArray, BoolArray]:
    """(M,) bool: the line from `at_m` to each sample ends on its own triangle, or on another in its place."""
    to = samples.centroid_m[sample] - at_m
    to[(to == 0).all(axis=1)] = (0.0, 0.0, 1e-6)  # a viewpoint on the surface itself is blocked all round
    range_m = np.sqrt((to * to).sum(axis=1))
    hit_m, triangle = first_surfaces(survey, engine, at_m, to / range_m[:, None])
    there = np.abs(hit_m - range_m) <= _ON_SURFACE_M + _ON_SURFACE_SHARE * range_m
    own = triangle == samples.triangle[sample]
    return there & own, there & ~own


def first_surfaces(
    survey: Survey, engine: ScanEngine, origins_m: FloatArray, directions: FloatArray
) -> tuple[FloatArray, Int64Array]:
    """Range (M,), NaN on a miss, and triangle (M,), -1, of what unit rays meet first; panes let them through."""
    hits = engine.cast_rays(origins_m, directions, range_max_m=np.inf)
    range_m, triangle = hits.range_m.astype(np.float64), hits.triangle.astype(np.int64)
    optics = survey.scene.optics_of_triangle
    if optics is None:
        return range_m, triangle
    for _ in range(_MAX_PANES):
        behind = np.flatnonzero((triangle >= 0) & (optics[triangle] == Optics.PASSES))
        if not behind.size:
            break
        gone_m = range_m[behind] + _ON_SURFACE_M
        hits = engine.cast_rays(
            origins_m[behind] + gone_m[:, None] * directions[behind], directions[behind], range_max_m=np.inf
        )
        range_m[behind], triangle[behind] = gone_m + hits.range_m, hits.triangle
    return range_m, triangle


@dataclass(frozen=True)
class _SightLines:
    """One line of sight a row. to_m : (M, 3) from the viewpoint to the sample."""

    to_m: FloatArray
    range_m: FloatArray
    cosine: FloatArray


def _failures(
    survey: Survey, required: PointLimits, samples: Surfaces, at_m: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """(M, 5) bool: limits, as `_LIMITS`, that lines of sight fail; and their ranges (M,)."""
    to_m = samples.centroid_m - at_m
    range_m = np.sqrt((to_m * to_m).sum(axis=1))
    cosine = np.clip(np.abs((to_m * samples.normal).sum(axis=1)) / range_m, 0.0, 1.0)
    look = _SightLines(to_m, range_m, cosine)
    incidence = np.arccos(cosine)
    template = survey.template
    limit_m = template.range_max_m if required.range_m is None else min(template.range_max_m, required.range_m)
    far = (range_m > limit_m) | (range_m < template.range_min_m)
    outside, sparse = _by_template(template, required, samples, look)
    steep = incidence > GRAZING_RAD
    oblique = sparse & steep
    if required.incidence_rad is not None:
        oblique |= incidence > required.incidence_rad
    noisy = np.zeros(range_m.size, dtype=np.bool_)
    if required.noise_m is not None:
        observations = Observations(np.array([0]), np.zeros(0, np.int32), 0, range_m, range_m, incidence)
        noise_m = with_noise(observations, survey.scanner, reflectivity=survey.reflectivity).noise_m
        noisy = np.ones_like(noisy) if noise_m is None else ~(noise_m <= required.noise_m)
    return np.column_stack([far, outside, oblique, sparse & ~steep, noisy]), range_m


def _by_template(
    template: BeamTemplate, required: PointLimits, samples: Surfaces, look: _SightLines
) -> tuple[BoolArray, BoolArray]:
    """(M,) bool each: outside the field of view; fewer points than required, or none to be expected."""
    none = np.zeros(look.range_m.size, dtype=np.bool_)
    if min(template.shape) < 2:  # one row or column has no field of view, and nobody knows its steps
        return none, none
    view = view_of(template)
    anywhere = View(**{**vars(view), "range_min_m": 0.0, "range_max_m": np.inf})
    outside = ~in_view(anywhere, look.to_m[:, None], samples.normal)[:, 0]
    relative_m = samples.corners_m - (samples.centroid_m - look.to_m)[:, None]
    sparse = expected_returns(view, relative_m, samples.normal, samples.area_m2) < LEAST_RETURNS
    if required.spacing_m is not None:
        sparse |= _spacing_m(view, samples.normal, look) > required.spacing_m
    return outside, sparse & ~outside


def _spacing_m(view: View, normal: FloatArray, look: _SightLines) -> FloatArray:
    """(M,) the larger of the distances between points of neighbouring columns and rows, docs/method/levels.md."""
    along = look.to_m / look.range_m[:, None]
    level = np.hypot(along[:, 0], along[:, 1])
    across = np.where(level > 0, level, 1.0)
    sideways = np.stack([-along[:, 1] / across, along[:, 0] / across, np.zeros_like(level)], axis=1)
    sideways[level == 0] = (0.0, 1.0, 0.0)
    upwards = np.cross(along, sideways)
    with np.errstate(divide="ignore", invalid="ignore"):
        columns, rows = (np.hypot(1.0, (normal * t).sum(axis=1) / look.cosine) for t in (sideways, upwards))
    return np.asarray(look.range_m * np.fmax(view.azimuth_step_rad * level * columns, view.elevation_step_rad * rows))
