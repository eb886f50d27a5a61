"""Links between all candidates, before any is chosen: the graph that selection keeps its stations joined in.

Input the candidates' `Visibility`, patch areas (m^2) and the patches' geometry (local frame); output `CandidateLinks`,
and from them the `Network` that selection sees. Overlap and strength: `planner_core.network.links`.
"""

from __future__ import annotations

import pickle
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from planner_core.errors import RequirementError
from planner_core.executor import Kept, Task, current_executor, parts_of_row
from planner_core.kept import kept
from planner_core.model import (
    BoolArray,
    FloatArray,
    Int32Array,
    Int64Array,
    LinkLimits,
    OverlapMeasure,
    PreAlignment,
    Visibility,
)
from planner_core.network.links import MIN_LISTED_OVERLAP, probabilities
from planner_core.network.pair_overlap import (
    ROWS_A_BLOCK,
    PairOverlaps,
    Pairs,
    PairSums,
    SharedSurface,
    joined_pairs,
)
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.network import Network

#: Fewer candidates' links are found here: sending what they see takes longer.
_WORTH_SPREADING = 1024
#: Rows of the first task that each worker is given.
_ROWS_OF_FIRST_TASK = 8
#: Doors open or shut during one scan, and during the other.
_N_STATES = 4


@dataclass(frozen=True)
class CandidateLinks:
    """Links between N candidates.

    starts, neighbour : (N + 1,) int64, (L,) int32, CSR rows, sorted and symmetric. overlap, strength : (L,) float64,
    0 of pairs that targets join. part : (N,) int32, which candidates links join; parts are numbered by their first one.
    """

    starts: Int64Array
    neighbour: Int32Array
    overlap: FloatArray
    strength: FloatArray
    part: Int32Array

    @property
    def n_candidates(self) -> int:
        """Number of candidates."""
        return int(self.starts.size - 1)

    @property
    def n_links(self) -> int:
        """Number of pairs that are linked."""
        return int(self.neighbour.size // 2)

    @property
    def by_surface(self) -> BoolArray:
        """(L,) links that surface makes, not targets."""
        return np.asarray(self.overlap > 0.0)

    @property
    def n_parts(self) -> int:
        """Number of parts that no link joins."""
        return int(self.part.max(initial=-1)) + 1

    def row(self, candidate: int) -> slice:
        """Where the links of `candidate` lie in the arrays."""
        return slice(int(self.starts[candidate]), int(self.starts[candidate + 1]))


@dataclass(frozen=True)
class LinkJob:
    """Which pairs are links, as `candidate_links`; a task is a part of the rows, whose later partners are found."""

    visibility: Visibility
    patch_area_m2: FloatArray
    surface: SharedSurface
    position_m: FloatArray
    limits: LinkLimits
    pre_alignment: PreAlignment
    measure: OverlapMeasure
    scanned: BoolArray

    def __getstate__(self) -> dict[str, Any]:
        """What travels: what was worked out from it stays here."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def _overlaps(self) -> PairOverlaps:
        least = (self.limits.as_set_up() if self.scanned.any() else self.limits).overlap or MIN_LISTED_OVERLAP
        return PairOverlaps(self.visibility, self.patch_area_m2, min_overlap=least, measure=self.measure)

    @cached_property
    def _sums(self) -> PairSums:
        return PairSums(self.visibility, self.patch_area_m2, self.surface, self.position_m, seen=self._overlaps.seen)

    def links_of_rows(self, begin: int, end: int) -> tuple[Pairs, FloatArray]:
        """Pairs that are links, first rows begin .. end - 1, and their strengths."""
        pairs = self._overlaps.of_rows(begin, end)
        on_mark, as_set_up = self.limits, self.limits.as_set_up()
        both = self.scanned[pairs.first] & self.scanned[pairs.second]
        likely = pairs.overlap >= np.where(both, as_set_up.overlap, on_mark.overlap)
        pairs, both = pairs.take(likely), both[likely]
        held = self._sums.held(pairs.first, pairs.second)
        holds = held.strength >= np.where(both, as_set_up.strength, on_mark.strength)
        if on_mark.probability > 0.0:
            probability = probabilities(pairs.share, held, self.pre_alignment)
            holds &= probability >= np.where(both, as_set_up.probability, on_mark.probability)
        return pairs.take(holds), held.strength[holds]

    def answer(self, rows: tuple[int, int], kept: Kept | None = None, progress: Progress = silent) -> bytes:
        """Give the links of some rows as bytes."""
        pairs, strength = self.links_of_rows(*rows)
        return zlib.compress(pickle.dumps((*vars(pairs).values(), strength), protocol=5), 1)


def held_in_both_states(links: CandidateLinks) -> CandidateLinks:
    """Links of N candidates that hold whichever doors are open, from links between 2 N rows.

    Rows N and more are those of the candidates with doors shut. All four pairs of two candidates' rows have to be
    links; overlap and strength are the least of them.
    """
    n = links.n_candidates // 2
    owner = np.repeat(np.arange(2 * n, dtype=np.int64), np.diff(links.starts)) % n
    neighbour = links.neighbour % n
    key = owner * n + neighbour
    pairs, where, count = np.unique(key, return_inverse=True, return_counts=True)
    overlap, strength = np.full((2, pairs.size), np.inf)
    np.minimum.at(overlap, where, links.overlap)
    np.minimum.at(strength, where, links.strength)
    keep = (count == _N_STATES) & (pairs // n != pairs % n)
    first, second = pairs[keep] // n, (pairs[keep] % n).astype(np.int32)
    starts = np.concatenate([[0], np.cumsum(np.bincount(first, minlength=n))]).astype(np.int64)
    return CandidateLinks(starts, second, overlap[keep], strength[keep], parts_of(starts, second))


def with_targets(links: CandidateLinks, pairs: Int64Array) -> CandidateLinks:
    """Links of candidates and pairs (K, 2) of them that targets join, which no link does."""
    n = links.n_candidates
    owner = np.repeat(np.arange(n, dtype=np.int64), np.diff(links.starts))
    owner = np.concatenate([owner, pairs[:, 0], pairs[:, 1]])
    neighbour = np.concatenate([links.neighbour, pairs[:, 1], pairs[:, 0]]).astype(np.int32)
    order = np.lexsort((neighbour, owner))
    starts = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=n))]).astype(np.int64)
    none = np.zeros(2 * pairs.shape[0])
    return CandidateLinks(
        starts,
        neighbour[order],
        np.concatenate([links.overlap, none])[order],
        np.concatenate([links.strength, none])[order],
        parts_of(starts, neighbour[order]),
    )


def _unpacked(answer: bytes) -> tuple[Pairs, FloatArray]:
    *pairs, strength = pickle.loads(zlib.decompress(answer))
    return Pairs(*pairs), strength


def candidate_links(
    visibility: Visibility,
    patch_area_m2: FloatArray,
    surface: SharedSurface,
    position_m: FloatArray,
    *,
    limits: LinkLimits,
    pre_alignment: PreAlignment = PreAlignment.MANUAL,
    measure: OverlapMeasure = OverlapMeasure.SMALLER_SHARE,
    scanned: Sequence[int] = (),
    rows_a_block: int = ROWS_A_BLOCK,
    progress: Progress = silent,
) -> CandidateLinks:
    """Find all pairs of rows of `visibility` that can be registered with each other.

    Parameters
    ----------
    patch_area_m2
        (P,).
    surface
        Of the patches that any row sees, see `surface_of_patches`.
    position_m
        (N, 3) where the rows look from, local.
    limits
        What a link needs. Where no overlap is required, pairs of less than `MIN_LISTED_OVERLAP` are left out.
    pre_alignment
        Where registration starts.
    scanned
        Rows of stations that stand where they were scanned: pairs of them count as set up, see `LinkLimits.as_set_up`.
    rows_a_block
        Positions whose pairs are held at a time. The result does not depend on it.

    Raises
    ------
    RequirementError
        An overlap or strength that makes no sense.
    """
    for name, limit in vars(limits).items():
        if not 0.0 <= limit <= 1.0:
            raise RequirementError(f"{name} of links: got {limit:g}, expected 0 to 1; give e.g. 0.3")
    n = visibility.n_positions
    is_scanned = np.zeros(n, dtype=bool)
    is_scanned[list(scanned)] = True
    job = LinkJob(visibility, patch_area_m2, surface, position_m, limits, pre_alignment, measure, is_scanned)
    if type(visibility) is not Visibility:  # rows on disk, beyond a budget of memory
        return _found(job, n, rows_a_block, progress)
    return kept(
        "links",
        [job],
        lambda: _found(job, n, rows_a_block, progress),
        classes=(CandidateLinks,),
        progress=progress,
        done=ProgressEvent("links", n, n),
    )


def _found(job: LinkJob, n: int, rows_a_block: int, progress: Progress) -> CandidateLinks:
    """Links of the job's N positions, see `candidate_links`."""
    executor = current_executor()
    if executor is None or n < _WORTH_SPREADING:
        linked = []
        for begin in range(0, n, rows_a_block):
            end = min(begin + rows_a_block, n)
            linked.append(job.links_of_rows(begin, end))
            progress(ProgressEvent("links", end, n))
    else:
        parts = parts_of_row(n, first=_ROWS_OF_FIRST_TASK, each=rows_a_block)
        answers = executor.answers(
            job, [Task(part, part[1] - part[0]) for part in parts], here=job.answer, stage="links",
            progress=progress,
        )  # fmt: skip
        linked = [_unpacked(each) for each in answers]
    pairs = joined_pairs([one for one, _ in linked])
    strength = np.concatenate([np.empty(0), *(values for _, values in linked)])
    starts, neighbour, order = _symmetric(pairs, n)
    return CandidateLinks(
        starts=starts,
        neighbour=neighbour,
        overlap=np.concatenate([pairs.overlap, pairs.overlap])[order],
        strength=np.concatenate([strength, strength])[order],
        part=parts_of(starts, neighbour),
    )


def network_of(links: CandidateLinks, *, loops: bool = False) -> Network:
    """Give the graph that selection has to keep its stations joined in."""
    return Network(starts=links.starts, neighbour=links.neighbour, part=links.part, loops=loops)


def parts_of(starts: Int64Array, neighbour: Int32Array) -> Int32Array:
    """(N,) int32, which candidates links, symmetric CSR rows, join; parts are numbered by their first candidate."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    n = starts.size - 1
    if n == 0:
        return np.empty(0, dtype=np.int32)
    graph = csr_array((np.ones(neighbour.size, dtype=np.int8), neighbour, starts), shape=(n, n))
    label = connected_components(graph, directed=False)[1]
    _, first, number = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[number].astype(np.int32)


def _symmetric(pairs: Pairs, n: int) -> tuple[Int64Array, Int32Array, Int64Array]:
    """CSR rows of pairs in both directions, and where each entry is in the pairs, forwards and then backwards."""
    owner = np.concatenate([pairs.first, pairs.second])
    neighbour = np.concatenate([pairs.second, pairs.first])
    order = np.lexsort((neighbour, owner))
    starts = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=n))]).astype(np.int64)
    return starts, neighbour[order], order
