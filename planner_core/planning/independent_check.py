"""Independent check: a plan's figures by random points, each tested by itself with Open3D's own rays.

Input a `Plan`, output an `IndependentCheck`. Nothing is shared with the counting of patches but the surfaces, the
scanner's field of view, how many beams it has for a surface, and the wording of the limits: a point is seen where
nothing lies between it and the scanner, within range and field of view, and counts where range, incidence, spacing and
noise at that very point meet the requirements. docs/method/independent-check.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.coverage.observations import GroundSides, Observations, observations_meeting, with_noise
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.patch_mode import LEAST_RETURNS, spacing_at
from planner_core.engine.patch_samples import View, expected_returns, in_view, view_of
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.kept import hash_of_survey, kept
from planner_core.model import (
    BoolArray,
    CheckedFigure,
    CheckedLink,
    Float32Array,
    FloatArray,
    IndependentCheck,
    Int32Array,
    Int64Array,
    Link,
    Optics,
    OverlapMeasure,
    OverlapOf,
    Paper,
    Plan,
    PlanSettings,
    PointLimits,
    Requirements,
    Survey,
)
from planner_core.model.arrays import dots, lengths
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import find_positions
from planner_core.positions.local_site import local_site
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.goals import Goals, goals_of
from planner_core.scene.patches import patch_triangles

#: A surface this much before a point, and this share of the range, does not hide it: Open3D's rays are float32.
_BEFORE_M, _BEFORE_SHARE = 5e-4, 1e-5
_BATCH_POINTS = 100_000
#: Points that plans are checked by: seconds of work, and a share to about 0.2 points.
QUICK_POINTS = 20_000
#: A plan's figure and that of the check differ by more standard errors than this: a warning.
_DISAGREEING = 3.0


@dataclass(frozen=True)
class _Points:
    """at_m, normal : (N, 3). triangle : (N,). corners_m, patch_m2 : (N, 3, 3), (N,), of the patch a point lies in.
    returns, overall : (N,) bool, on surface that gives a return, that the plan is about.
    """

    at_m: FloatArray
    normal: FloatArray
    triangle: Int32Array
    corners_m: FloatArray
    patch_m2: FloatArray
    returns: BoolArray
    overall: BoolArray
    area_m2: float


def usual_points(settings: PlanSettings) -> int:
    """Points that a plan of these settings is checked by where none are given: none for the method paper's, which count
    whole patches on purpose.
    """
    return 0 if isinstance(settings.method, Paper) else QUICK_POINTS


def with_independent_check(
    plan: Plan, engine: ScanEngine, *, n_points: int | None = None, progress: Progress = silent
) -> Plan:
    """Check a plan by random points: the figures, and a warning where one of the plan's is off by more than three
    standard errors.

    n_points : None: `usual_points`. Without any, and for scanners of one row or column, which it can't check, the plan
    as it is.
    """
    if n_points is None:
        n_points = usual_points(plan.settings)
    if n_points == 0 or min(plan.survey.template.shape) < 2 or not plan.stations:
        return plan
    found = check_independently(plan, engine, n_points=n_points, seed=plan.settings.seed, progress=progress)
    return replace(plan, independent_check=found, warnings=(*plan.warnings, *_disagreements(found)))


def _disagreements(found: IndependentCheck) -> tuple[str, ...]:
    """A line on figures that are off by more than chance explains."""
    areas = (("covered", found.covered_m2), ("scannable", found.achievable_m2))
    differences = [
        f"{name} {figure.judged:.0f} ± {figure.error:.0f} m2, the plan has {figure.planned:.0f}"
        for name, figure in areas
        if _is_off(figure)
    ]
    if _is_off(found.share):
        share = found.share
        differences.append(
            f"{100 * share.judged:.1f} ± {100 * share.error:.1f} % of it covered, the plan has "
            f"{100 * share.planned:.1f}"
        )
    if not differences:
        return ()
    return (
        f"judge: {found.n_points} random points have {'; '.join(differences)}; smaller patches (--patch-area), or "
        "--scan-mode patches where beams are counted, come nearer",
    )


def _is_off(figure: CheckedFigure) -> bool:
    return abs(figure.planned - figure.judged) > _DISAGREEING * figure.error


def check_independently(
    plan: Plan, engine: ScanEngine, *, n_points: int = 200_000, seed: int = 0, progress: Progress = silent
) -> IndependentCheck:
    """Look at random points from the plan's stations and from all candidates of the grid.

    Parameters
    ----------
    engine
        Of the plan; it finds the candidates again where the plan does not keep them. The check's rays are Open3D's.
    n_points
        Spread evenly over the area of which something may be required.

    Raises
    ------
    RequirementError
        Fewer than 100 points, or a scanner of one row or column.
    """
    if n_points < 100:
        raise RequirementError(f"verify: got {n_points} points, expected at least 100; 200000 say it to 0.1 %")
    survey, settings = plan.survey, plan.settings
    points = _points(survey, goals_of(survey, settings.requirements), n_points, np.random.default_rng(seed))
    look = _PointVisibility(survey, settings.requirements, points)
    linking, met = look.from_all(np.stack([station.position_m for station in plan.stations]), progress)
    seen_from = settings.requirements.seen_from
    covered = met >= seen_from
    candidates_m = _candidates_of(plan, engine) if plan.candidates_m is None else plan.candidates_m
    # As `evaluate` counts: what candidates and stations meet together.
    achievable = met + look.count(candidates_m, seen_from, progress) >= seen_from
    n_achievable = max(int((achievable & points.overall).sum()), 1)
    share = float((covered & points.overall).sum()) / n_achievable
    share_error = float(np.sqrt(share * (1.0 - share) / n_achievable))
    return IndependentCheck(
        n_points=n_points,
        engine=look.engine.device,
        covered_m2=_area(plan.coverage.covered_area_m2, covered & points.overall, points.area_m2),
        achievable_m2=_area(plan.coverage.achievable_area_m2, achievable & points.overall, points.area_m2),
        share=CheckedFigure(plan.coverage.fraction_of_achievable, share, share_error),
        links=tuple(_link(link, plan, linking) for link in plan.links),
    )


def _candidates_of(plan: Plan, engine: ScanEngine) -> FloatArray:
    """(N, 3) candidates of the grid, found again."""
    tripods, site = Tripods(plan.survey, plan.settings, engine), local_site(plan.survey, plan.settings.site)
    return find_positions(tripods, site).candidates.position_m


def _area(plan_m2: float, which: BoolArray, area_m2: float) -> CheckedFigure:
    share = float(which.mean())
    return CheckedFigure(plan_m2, area_m2 * share, area_m2 * float(np.sqrt(share * (1.0 - share) / which.size)))


def _link(link: Link, plan: Plan, linking: BoolArray) -> CheckedLink:
    ids = [station.id for station in plan.stations]
    a, b = linking[ids.index(link.a)], linking[ids.index(link.b)]
    jaccard = plan.settings.requirements.overlap_measure == OverlapMeasure.JACCARD
    whole = max(int((a | b).sum()) if jaccard else max(int(a.sum()), int(b.sum())), 1)
    overlap = float((a & b).sum()) / whole
    error = float(np.sqrt(overlap * (1.0 - overlap) / whole))
    return CheckedLink(link.a, link.b, CheckedFigure(link.overlap, overlap, error))


def _points(survey: Survey, goals: Goals, n_points: int, rng: np.random.Generator) -> _Points:
    """Points at even steps of area through all patches that somebody looks at, at random places in each."""
    wanted = np.flatnonzero(goals.patches if survey.scope is None else survey.scope.observed)
    patch_m2 = replace(survey.patches, countable_share=None).area_m2
    sum_m2 = np.cumsum(patch_m2[wanted])
    step = (np.arange(n_points) + rng.random(n_points)) * (sum_m2[-1] / n_points)
    patch = wanted[np.minimum(np.searchsorted(sum_m2, step, side="right"), wanted.size - 1)]
    corners_m = patch_triangles(survey.scene, survey.patches)[patch]
    u, v = rng.random(n_points), rng.random(n_points)
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    edges = corners_m[:, 1:] - corners_m[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    length = lengths(normal)
    return _Points(
        at_m=corners_m[:, 0] + u[:, None] * edges[:, 0] + v[:, None] * edges[:, 1],
        normal=normal / np.maximum(length, 1e-300)[:, None],
        triangle=survey.patches.triangle_of_patch[patch],
        corners_m=corners_m,
        patch_m2=patch_m2[patch],
        returns=_returns(survey, patch),
        overall=goals.overall.patches[patch],
        area_m2=float(sum_m2[-1]),
    )


def _spread_order(n: int) -> list[int]:
    """0 to n - 1 by their bits read backwards: each next number is far from those before it."""
    n_bits = max(n - 1, 1).bit_length()
    turned = (int(f"{number:0{n_bits}b}"[::-1], 2) for number in range(2**n_bits))
    return [number for number in turned if number < n]


def _returns(survey: Survey, patch: Int64Array) -> BoolArray:
    """(N,) bool: patches whose surface gives a return: neither glass that beams pass, nor a mirror."""
    optics = survey.scene.optics_of_triangle
    if optics is None:
        return np.ones(patch.size, dtype=np.bool_)
    found: BoolArray = optics[survey.patches.triangle_of_patch[patch]] == Optics.RETURNS
    return found


class _PointVisibility:
    """Looks at points from positions, with limits as the overall requirement has them."""

    def __init__(self, survey: Survey, requirements: Requirements, points: _Points) -> None:
        self.engine = Open3DEngine(survey.scene, survey.patches)
        self._view: View = view_of(survey.template)
        self._survey, self._requirements, self._points = survey, requirements, points
        self._sides = GroundSides(survey)

    def from_all(self, positions_m: FloatArray, progress: Progress) -> tuple[BoolArray, Int64Array]:
        """(S, N) bool, points that overlap counts for each position; (N,) positions that meet the limits."""
        n_points = self._points.at_m.shape[0]
        linking = np.zeros((positions_m.shape[0], n_points), dtype=np.bool_)
        all_seen = self._requirements.overlap_of == OverlapOf.ALL_SEEN
        met = np.zeros(n_points, dtype=np.int64)
        for row, position_m in enumerate(positions_m):
            rows = self._seen(position_m, np.arange(n_points))
            meeting = rows[self._meets(position_m, rows)]
            linking[row, rows if all_seen else meeting] = True
            met[meeting] += 1
            progress(ProgressEvent("judge", row + 1, positions_m.shape[0], "stations"))
        return linking, met

    def count(self, positions_m: FloatArray, enough: int, progress: Progress) -> Int64Array:
        """(N,) number of positions that meet the limits, up to `enough`, where a point is left out of later ones."""
        inputs = [hash_of_survey(self._survey), self._requirements.limits, self._points, positions_m, enough]
        done = ProgressEvent("judge", positions_m.shape[0], positions_m.shape[0], "scannable")
        return kept(
            "scannable", inputs, lambda: self._counted(positions_m, enough, progress), progress=progress, done=done
        )

    def _counted(self, positions_m: FloatArray, enough: int, progress: Progress) -> Int64Array:
        """See `count`. The order changes no number: first come few positions far apart, and after these hardly any
        points are left but those that nobody meets.
        """
        met = np.zeros(self._points.at_m.shape[0], dtype=np.int64)
        for number, row in enumerate(_spread_order(positions_m.shape[0])):
            left = np.flatnonzero(met < enough)
            # What can't meet the limits need not be cast.
            left = left[self._meets(positions_m[row], left)]
            met[self._seen(positions_m[row], left)] += 1
            progress(ProgressEvent("judge", number + 1, positions_m.shape[0], "scannable"))
        return met

    def _seen(self, position_m: FloatArray, rows: Int64Array) -> Int64Array:
        """Those of rows (K,) that a position sees."""
        found = []
        for first in range(0, rows.size, _BATCH_POINTS):
            some = rows[first : first + _BATCH_POINTS]
            away_m = self._points.at_m[some] - position_m
            inside = in_view(self._view, away_m[:, None], self._points.normal[some])[:, 0]
            inside &= self._points.returns[some]
            inside &= self._sides.are_above(position_m[None], np.array([0, some.size]), self._points.triangle[some])
            some, away_m = some[inside], away_m[inside]
            dense = self._has_beams(position_m, some)
            some, away_m = some[dense], away_m[dense]
            range_m = lengths(away_m)
            before = 1.0 - np.minimum(_BEFORE_M / range_m + _BEFORE_SHARE, 1.0)
            hidden = self.engine.are_hidden(position_m, away_m * before[:, None])
            found.append(some[~hidden])
        return np.concatenate([np.empty(0, dtype=np.int64), *found])

    def _has_beams(self, position_m: FloatArray, rows: Int64Array) -> BoolArray:
        """(K,) bool: whether a beam is to be expected on the patches of points of rows (K,): surface seen edge-on, or
        by a scanner of few rows, has none.
        """
        points = self._points
        away_m = points.corners_m[rows] - position_m
        expected = expected_returns(self._view, away_m, points.normal[rows], points.patch_m2[rows])
        found: BoolArray = expected >= LEAST_RETURNS
        return found

    def _spacing_m(self, rows: Int64Array, away_m: FloatArray, range_m: FloatArray) -> Float32Array:
        """(K,) wider spacing of neighbouring points about points of rows (K,)."""
        along, normal = away_m / range_m[:, None], self._points.normal[rows]
        cosine = np.abs(dots(along, normal))
        spacing_m: Float32Array = spacing_at(self._view, along, normal, range_m, cosine).max(axis=1, initial=0.0)
        return spacing_m

    def _meets(self, position_m: FloatArray, rows: Int64Array) -> BoolArray:
        """(K,) bool: whether figures at points of rows (K,) meet the limits."""
        limits: PointLimits = self._requirements.limits
        away_m = self._points.at_m[rows] - position_m
        range_m = np.maximum(lengths(away_m), 1e-9)
        cosine = np.abs((away_m * self._points.normal[rows]).sum(axis=1)) / range_m
        observed = Observations(
            starts=np.array([0, rows.size]),
            patch=rows.astype(np.int32),
            n_patches=self._points.at_m.shape[0],
            spacing_m=self._spacing_m(rows, away_m, range_m),
            range_m=range_m.astype(np.float32),
            incidence_rad=np.arccos(np.clip(cosine, 0.0, 1.0)).astype(np.float32),
        )
        if limits.noise_m is not None:
            observed = with_noise(observed, self._survey.scanner, reflectivity=self._survey.reflectivity)
        return observations_meeting(observed, limits)
