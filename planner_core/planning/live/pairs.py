"""Links of the draft's stations, a station at a time: what changes when one is moved, and nothing else.

Input `StationObservations`, patch areas (m^2) and the patches' geometry (local frame); output `Link`s with figures of
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
    Int64Array,
    Link,
    OverlapMeasure,
    OverlapOf,
    PreAlignment,
    Survey,
    WeakMotion,
)
from planner_core.network.links import probabilities, surface_of_patches
from planner_core.network.pair_overlap import (
    N_SUMS,
    area_ticks,
    common_sums,
    held_by,
    matrices_of,
    overlap_by,
    patch_sums,
)
from planner_core.network.weak_motion import weak_motion
from planner_core.planning.live.station_observations import StationObservations

#: Pairs that are remembered; a few hundred bytes each.
_KEPT_PAIRS = 20_000


@dataclass(frozen=True)
class Held:
    """What two looks have in common; all as in `Link`."""

    overlap: float
    strength: float
    weak_motion: WeakMotion | None
    probability: float


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
        pre_alignment: PreAlignment = PreAlignment.MANUAL,
    ) -> None:
        self._survey, self._area_m2, self._min_overlap = survey, area_m2, min_overlap
        self._measure, self._of, self._pre_alignment = measure, of, pre_alignment
        self._ticks = area_ticks(area_m2)
        self._triangle = survey.patches.triangle_of_patch
        self._is_known = np.zeros(area_m2.size, dtype=np.bool_)
        self._sums = np.zeros((area_m2.size, N_SUMS))  # memory is taken where it is written to
        self._learn(np.flatnonzero(likely))
        self._mark = np.zeros(area_m2.size, dtype=np.bool_)
        self._kept: OrderedDict[frozenset[tuple[float, float, float]], Held | None] = OrderedDict()

    def links_of(
        self, name: str, look: StationObservations, others: Sequence[tuple[str, StationObservations]]
    ) -> tuple[Link, ...]:
        """Links from one station to the others, in their order."""
        keys = [frozenset((look.position_m, other.position_m)) for _, other in others]
        new = [index for index, key in enumerate(keys) if key not in self._kept]
        for index, held in zip(new, self._find(look, [others[index][1] for index in new]), strict=True):
            self._kept[keys[index]] = held
        found = [(other, self._kept[key]) for (other, _), key in zip(others, keys, strict=True)]
        while len(self._kept) > _KEPT_PAIRS:
            self._kept.popitem(last=False)
        return tuple(
            Link(name, other, held.overlap, held.strength, held.weak_motion, probability=held.probability)
            for other, held in found
            if held is not None
        )

    def links(self, stations: Sequence[tuple[str, StationObservations]]) -> tuple[Link, ...]:
        """All links, by first and second station in the order given."""
        return tuple(
            chain.from_iterable(
                self.links_of(name, look, stations[number + 1 :]) for number, (name, look) in enumerate(stations)
            )
        )

    def _find(self, look: StationObservations, others: list[StationObservations]) -> list[Held | None]:
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
        self._learn(mine)
        theirs_m = np.array([others[index].position_m for index in listed])
        mine_m = np.tile(np.array(look.position_m), (listed.size, 1))
        sums = common_sums([common[index] for index in listed], self._sums, mine_m, theirs_m)
        matrix = matrices_of(sums)
        of = held_by(sums, matrix)
        share = overlap
        if self._measure != OverlapMeasure.SMALLER_SHARE:
            share = overlap_by(OverlapMeasure.SMALLER_SHARE, ticks, self._ticks[mine].sum(), whole)
        registers = probabilities(share[listed], of, self._pre_alignment)
        found = zip(
            listed.tolist(),
            overlap[listed].tolist(),
            of.strength.tolist(),
            map(weak_motion, matrix),
            registers.tolist(),
            strict=True,
        )
        for index, *figures in found:
            held[index] = Held(*figures)
        return held

    def _counted(self, look: StationObservations) -> Int32Array:
        """Return the patches that overlap is counted on, sorted."""
        return look.patch if self._of == OverlapOf.ALL_SEEN else look.met[0]

    def _learn(self, patch: Int32Array | Int64Array) -> None:
        """Have the sums of patches: those that no candidate and no station of the plan sees come now and then."""
        new = patch[~self._is_known[patch]]
        if not new.size:
            return
        # All patches of a triangle at once: of a floor's, the next look is sure to see others.
        is_needed = np.zeros(self._survey.scene.n_triangles, dtype=np.bool_)
        is_needed[self._triangle[new]] = True
        needed = is_needed[self._triangle]
        surface = surface_of_patches(self._survey.scene, self._survey.patches, needed)
        self._sums[needed] = patch_sums(self._area_m2[needed], surface.centroid_m[needed], surface.normal[needed])
        self._is_known |= needed
