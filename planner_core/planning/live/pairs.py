"""Links of the draft's stations, a station at a time: what changes when one is moved, and nothing else.

Input `Look`s, patch areas (m^2) and the patches' geometry (local frame); output `Link`s with the figures of
`planner_core.network.links.overlap_links`, bit by bit: a pair's figures do not depend on the other stations.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from planner_core.model import (
    BoolArray,
    FloatArray,
    Int32Array,
    Link,
    OverlapMeasure,
    OverlapOf,
    Survey,
    Visibility,
    WeakMotion,
)
from planner_core.network.links import surface_of_patches
from planner_core.network.pair_overlap import PairMatrices, SharedSurface, area_ticks, overlap_by, strengths_of
from planner_core.network.weak_axis import weak_motion
from planner_core.planning.live.looks import Look

#: Pairs that are remembered; a few hundred bytes each.
_KEPT_PAIRS = 20_000


@dataclass(frozen=True)
class Held:
    """What two looks have in common. overlap, strength, weak_motion : as in `Link`."""

    overlap: float
    strength: float
    weak_motion: WeakMotion | None


class PairFinder:
    """Finds and remembers what pairs of looks have in common, where that is at least `min_overlap`."""

    def __init__(
        self,
        survey: Survey,
        area_m2: FloatArray,
        likely: BoolArray,
        *,
        min_overlap: float,
        measure: OverlapMeasure = OverlapMeasure.SMALLER_SHARE,
        of: OverlapOf = OverlapOf.ALL_SEEN,
    ) -> None:
        self._survey, self._area_m2, self._min_overlap = survey, area_m2, min_overlap
        self._measure, self._of = measure, of
        self._ticks = area_ticks(area_m2)
        self._known, self._surface = likely.copy(), surface_of_patches(survey.scene, survey.patches, likely)
        self._mark = np.zeros(area_m2.size, dtype=np.bool_)
        self._kept: OrderedDict[frozenset[tuple[float, float, float]], Held | None] = OrderedDict()

    def links_of(self, name: str, look: Look, others: Sequence[tuple[str, Look]]) -> tuple[Link, ...]:
        """Links from one station to the others, in their order."""
        keys = [frozenset((look.position_m, other.position_m)) for _, other in others]
        new = [index for index, key in enumerate(keys) if key not in self._kept]
        for index, held in zip(new, self._find(look, [others[index][1] for index in new]), strict=True):
            self._kept[keys[index]] = held
        found = [(other, self._kept[key]) for (other, _), key in zip(others, keys, strict=True)]
        while len(self._kept) > _KEPT_PAIRS:
            self._kept.popitem(last=False)
        return tuple(
            Link(name, other, held.overlap, held.strength, held.weak_motion)
            for other, held in found
            if held is not None
        )

    def links(self, stations: Sequence[tuple[str, Look]]) -> tuple[Link, ...]:
        """All links, by first and second station in the order given."""
        return tuple(
            chain.from_iterable(
                self.links_of(name, look, stations[number + 1 :]) for number, (name, look) in enumerate(stations)
            )
        )

    def _find(self, look: Look, others: list[Look]) -> list[Held | None]:
        held: list[Held | None] = [None] * len(others)
        mine, theirs = self._counted(look), [self._counted(other) for other in others]
        if not others or not mine.size:
            return held
        self._mark[mine] = True
        common = [patch[self._mark[patch]] for patch in theirs]
        self._mark[mine] = False
        overlap = np.zeros(len(others))
        ticks = np.array([self._ticks[both].sum() for both in common])
        meet = ticks > 0
        whole = np.array([self._ticks[patch].sum() for patch in theirs])
        overlap[meet] = overlap_by(self._measure, ticks[meet], self._ticks[mine].sum(), whole[meet])
        listed = np.flatnonzero((overlap >= self._min_overlap) & (overlap > 0))
        if not listed.size:
            return held
        matrix = self._matrices(mine, [common[index] for index in listed])
        for index, strength, one in zip(listed.tolist(), strengths_of(matrix), matrix, strict=True):
            held[index] = Held(float(overlap[index]), float(strength), weak_motion(one))
        return held

    def _counted(self, look: Look) -> Int32Array:
        """Return the patches that overlap is counted on, sorted."""
        return look.patch if self._of == OverlapOf.ALL_SEEN else look.met[0]

    def _matrices(self, base: Int32Array, common: list[Int32Array]) -> FloatArray:
        """(K, 6, 6) normal matrices of what each of `common`, all parts of `base`, holds."""
        self._learn(base)
        # In the base's own numbers: nothing is as long as the building has patches.
        places = [
            np.arange(base.size, dtype=np.int32),
            *(np.searchsorted(base, one).astype(np.int32) for one in common),
        ]
        starts = np.cumsum([0, *(place.size for place in places)], dtype=np.int64)
        rows = Visibility(starts, np.concatenate(places), int(base.size))
        part = SharedSurface(self._surface.centroid_m[base], self._surface.normal[base])
        second = np.arange(1, len(places), dtype=np.int32)
        return PairMatrices(rows, self._area_m2[base], part).of(np.zeros_like(second), second)

    def _learn(self, patch: Int32Array) -> None:
        """Have the geometry of patches: those that no candidate and no station of the plan sees come now and then."""
        new = patch[~self._known[patch]]
        if not new.size:
            return
        asked = np.zeros_like(self._known)
        asked[new] = True
        more = surface_of_patches(self._survey.scene, self._survey.patches, asked)
        self._surface.centroid_m[new], self._surface.normal[new] = more.centroid_m[new], more.normal[new]
        self._known[new] = True
