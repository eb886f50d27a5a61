"""Tallies: how often, and how well, a set of looks sees every patch; and what one look more or less makes of it.

Input `StationObservations` and the parts of the building that figures are reported for; output counts and best figures
by patch, areas in m^2. A change is worked out on the patches that the old and the new look see, and on no others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from planner_core.coverage.coverage import floor_of_patch
from planner_core.model import BoolArray, Coverage, FloatArray, Int32Array, Survey
from planner_core.planning.live.station_observations import StationObservations
from planner_core.requirements.demand import Demand

#: What figures of a layer are worked out from: float32 as in `Observations`, or float64 where they are sums.
_Figures: TypeAlias = NDArray[np.floating[Any]]

#: Figures of the layers: the name of each in `Observations`.
FIGURES = {"range": "range_m", "incidence": "incidence_rad", "noise": "noise_m"}
SPACING = "spacing"
#: Points per m^2, fewer than any layer can tell from none.
_LEAST_DENSITY = 1e-200


@dataclass(frozen=True)
class CoverageArea:
    """What a figure of coverage is of. patches : (P,) bool. counted : (P,) bool, the achievable ones of them.

    quality : row of `Tally.times_met`. seen_from : stations that must meet it for a patch to be covered.
    """

    patches: BoolArray
    counted: BoolArray
    quality: int
    seen_from: int
    total_m2: float
    achievable_m2: float


@dataclass(frozen=True)
class CoverageAreas:
    """Areas that coverage is given for: all that is planned, each floor, each goal of the requirements."""

    overall: CoverageArea
    floors: tuple[CoverageArea, ...]
    goals: tuple[CoverageArea, ...]

    @property
    def all(self) -> tuple[CoverageArea, ...]:
        """Overall, floors, goals."""
        return (self.overall, *self.floors, *self.goals)


def coverage_areas(survey: Survey, demand: Demand) -> CoverageAreas:
    """Cut the building up as the figures of a plan are: the sums are those of `planner_core.planning.results`."""
    goals, area_m2 = demand.goals, demand.area_m2[: demand.n_patches]
    requirements, scope = goals.requirements, goals.overall.patches
    floor = np.where(goals.patches, floor_of_patch(survey.patches, survey.floor_of_triangle), -1)
    achievable = demand.times_met[0] >= requirements.seen_from

    def part(patches: BoolArray, counted: BoolArray, quality: int, seen_from: int) -> CoverageArea:
        return CoverageArea(
            patches, counted, quality, seen_from, float(area_m2[patches].sum()), float(area_m2[counted].sum())
        )

    return CoverageAreas(
        overall=part(scope, scope & achievable, 0, requirements.seen_from),
        floors=tuple(
            part(floor == index, (floor == index) & achievable, 0, requirements.seen_from)
            for index in range(len(survey.floors))
        ),
        goals=tuple(
            part(goal.patches, demand.achievable(goal), goals.quality_of(goal), goal.seen_from) for goal in goals.each
        ),
    )


class Tally:
    """Counts of some looks, and, made when first needed, the best figures of each patch."""

    def __init__(self, looks: Sequence[StationObservations], *, n_patches: int, n_qualities: int) -> None:
        self.looks, self._n_patches = tuple(looks), n_patches
        self.times_met = np.zeros((n_qualities, n_patches), dtype=np.int32)
        """(Q, P), looks that meet each quality on each patch by themselves."""
        for look in looks:
            for quality, met in enumerate(look.met):
                self.times_met[quality, met] += 1  # patches are unique in a look
        self._best: dict[str, _Figures] = {}

    def best(self, layer: str) -> _Figures:
        """(P,): what `figure_of` makes a layer's values from; the looks' best, or their sum for spacing."""
        if layer not in self._best:
            sums = layer == SPACING
            dtype = np.float64 if sums else np.float32
            best: _Figures = np.full(self._n_patches, 0.0 if sums else np.inf, dtype=dtype)
            for look in self.looks:
                best[look.patch] = joined(layer, best[look.patch], look)
            self._best[layer] = best
        return self._best[layer]


def joined(layer: str, best: _Figures, look: StationObservations) -> _Figures:
    """(M,) what `Tally.best` of the look's patches (M,) becomes with the look."""
    if layer == SPACING:
        with np.errstate(divide="ignore"):
            densities = look.observations.spacing_m.astype(np.float64) ** -2.0
        # They add. A patch that is seen along its surface has points, if far apart: it is not one without any.
        more: _Figures = best + np.maximum(densities, _LEAST_DENSITY)
        return more
    figures = getattr(look.observations, FIGURES[layer])
    if figures is None:
        return best
    least: _Figures = np.fmin(best, figures)
    return least


def figure_of(layer: str, best: _Figures) -> FloatArray:
    """(M,) float64, figures in the layer's unit, inf where there is none: metres; degrees of incidence."""
    if layer == SPACING:
        with np.errstate(divide="ignore"):
            return np.asarray(best**-0.5, dtype=np.float64)
    figures = best.astype(np.float64)
    return np.degrees(figures) if layer == "incidence" else figures


@dataclass(frozen=True)
class Change:
    """One look more, and maybe one less. patch : (K,) int32, sorted, all that either sees; n_met : (Q, K) counts with
    the new look. covered_m2 : for each of `CoverageAreas.all`. own_m2 : what coverage counts and
    would lose without the new look.
    """

    patch: Int32Array
    n_met: Int32Array
    covered_m2: tuple[float, ...]
    own_m2: float
    new: StationObservations
    _before: Tally

    def best(self, layer: str) -> _Figures:
        """(K,) `Tally.best` with the new look."""
        best = self._before.best(layer)[self.patch]
        at = np.searchsorted(self.patch, self.new.patch)
        best[at] = joined(layer, best[at], self.new)
        return best


def covered_area_m2(part: CoverageArea, times_met: Int32Array, area_m2: FloatArray) -> float:
    """Area of the part's counted patches that enough looks of a tally meet its quality on."""
    return float(area_m2[part.counted & (times_met[part.quality] >= part.seen_from)].sum())


def changed(
    base: Tally,
    covered_m2: Sequence[float],
    without: Tally,
    old: StationObservations | None,
    new: StationObservations,
    parts: CoverageAreas,
    area_m2: FloatArray,
) -> Change:
    """Take `old` from `base`, which leaves `without`, and put `new` in its place.

    covered_m2 : of `base`, for each of `parts.all`. area_m2 : (P,).
    """
    patch = new.patch if old is None else _either(old.patch, new.patch, area_m2.size)
    n_met = without.times_met[:, patch]
    for quality, met in enumerate(new.met):
        n_met[quality, np.searchsorted(patch, met)] += 1
    before, area = base.times_met[:, patch], area_m2[patch]
    after_m2 = []
    for part, was_m2 in zip(parts.all, covered_m2, strict=True):
        counted = part.counted[patch]
        lost = counted & (before[part.quality] >= part.seen_from) & (n_met[part.quality] < part.seen_from)
        won = counted & (before[part.quality] < part.seen_from) & (n_met[part.quality] >= part.seen_from)
        after_m2.append(was_m2 - float(area[lost].sum()) + float(area[won].sum()))
    overall = parts.overall
    met = new.met[overall.quality]
    needed = met[overall.counted[met] & (without.times_met[overall.quality, met] == overall.seen_from - 1)]
    return Change(patch, n_met, tuple(after_m2), float(area_m2[needed].sum()), new, without)


def _either(first: Int32Array, second: Int32Array, n_patches: int) -> Int32Array:
    """(K,), sorted, patches of either of two lists: quicker than to sort them."""
    is_in = np.zeros(n_patches, dtype=np.bool_)
    is_in[first] = True
    is_in[second] = True
    return np.flatnonzero(is_in).astype(np.int32)


def coverage(part: CoverageArea, covered_m2: float) -> Coverage:
    """Coverage of a part of which so much is covered; rounding can't make it less than nothing or more than all."""
    return Coverage(part.achievable_m2, part.total_m2, min(max(covered_m2, 0.0), part.achievable_m2))
