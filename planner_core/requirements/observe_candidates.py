"""Observations of candidates: which patches each sees, which it meets the limits on, and how much of each.

A `Survey`, `Goals`, an open engine, positions (N, 3) in the local frame, metres -> `CandidateObservations`, and from
these `SeenPatches` once it is known how much of each patch counts, see `planner_core.coverage.visibility_threshold`.

Other processes observe, too: an `ObservationJob` answers with compressed rows, and of figures per patch those alone
that are set.
"""

from __future__ import annotations

import pickle
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.coverage.coverage import stacked_rows, take_rows, taken_along
from planner_core.coverage.observations import Observations, observations_in_batches, observations_meeting
from planner_core.coverage.survey import visible_from
from planner_core.coverage.visibility_threshold import (
    WHOLE,
    most_countable,
    sees_enough,
    shares_of,
    shares_of_cut_patches,
)
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_samples import UInt32Array
from planner_core.engine.scan_engine import ScanEngine
from planner_core.executor import Executor, Kept, Task, current_executor, parts_of_row
from planner_core.model import (
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    PointLimits,
    Survey,
    UInt8Array,
    Visibility,
)
from planner_core.model.stored_rows import PatchColumn, visibility_budget
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.goals import Goals

#: Fewer positions are observed from here: sending them away takes longer.
_WORTH_SPREADING = 32
#: Positions that are observed from together where rows may have to go to disk.
_AT_A_TIME = 256
#: Positions of a task: enough that it outweighs its overhead, few enough that the last ones are soon done.
TASK_POSITIONS, FIRST_POSITIONS = 16, 4
#: Of zlib: about as quick as a network of 1 Gbit/s.
_LEVEL = 1


@dataclass(frozen=True)
class SeenPatches:
    """What positions see. seen : patches seen at all, for overlap. met : patches by quality, stacked, for coverage."""

    seen: Visibility
    met: Visibility

    def take(self, rows: list[int] | Int64Array) -> SeenPatches:
        """Rows of some positions, in the order given."""
        seen = take_rows(self.seen, rows)
        return SeenPatches(seen, seen if self.met is self.seen else take_rows(self.met, rows))


def stacked(first: SeenPatches, second: SeenPatches) -> SeenPatches:
    """What the positions of both see, those of the second behind those of the first."""
    seen = stacked_rows(first.seen, second.seen)
    return SeenPatches(seen, seen if first.met is first.seen else stacked_rows(first.met, second.met))


@dataclass(frozen=True)
class SeenShares:
    """How much of patches is seen. seen, met : uint8 along the rows' patches. any_seen, any_met : (P,) uint32, samples
    that some position sees, and sees as a goal asks.
    """

    seen: UInt8Array
    met: UInt8Array
    any_seen: UInt32Array
    any_met: UInt32Array


@dataclass(frozen=True)
class CandidateObservations:
    """What positions see. parts : None where patches are seen or not, and nothing between: by beams, and where it is
    known what counts.

    needed : as in `planner_core.requirements.demand.Demand`.
    """

    rows: SeenPatches
    parts: SeenShares | None
    needed: tuple[dict[str, Float32Array], ...]

    def countable_share(self, survey: Survey, engine: ScanEngine, positions_m: FloatArray) -> UInt8Array | None:
        """(P,) uint8, how much of each patch these positions (N, 3) meet together, or else see; of what none sees, all.

        Of patches that are cut the samples say which positions see most, and points of their own how much that is; at
        most so much that one position sees enough of it.
        """
        if self.parts is None:
            return None
        is_met = self.parts.any_met > 0
        share = shares_of(np.where(is_met, self.parts.any_met, self.parts.any_seen))
        countable_share = np.where(share > 0, share, WHOLE).astype(np.uint8)
        is_cut = countable_share < WHOLE
        for which, rows, parts in (
            (is_met, self.rows.met, self.parts.met),
            (~is_met, self.rows.seen, self.parts.seen),
        ):
            cut = np.flatnonzero(is_cut & which).astype(np.int32)
            together = shares_of_cut_patches(survey, engine, positions_m, rows, parts, cut)
            countable_share[cut] = np.minimum(together, most_countable(_best(rows, parts, countable_share.size)[cut]))
        return countable_share

    def rows_of(self, countable_share: UInt8Array | None) -> SeenPatches:
        """Rows of patches of which enough is seen, with (P,) uint8 of them counting."""
        if self.parts is None or countable_share is None:
            return self.rows
        seen = _enough(self.rows.seen, self.parts.seen, countable_share)
        return SeenPatches(
            seen, seen if self.rows.met is self.rows.seen else _enough(self.rows.met, self.parts.met, countable_share)
        )


def observe_candidates(
    survey: Survey,
    engine: ScanEngine,
    positions_m: FloatArray,
    goals: Goals,
    *,
    notes_needed: bool = True,
    progress: Progress = silent,
) -> CandidateObservations:
    """Look from each of positions (N, 3), here or, within `spread_over`, elsewhere: the same to the bit."""
    executor = current_executor()
    if executor is None or positions_m.shape[0] < _WORTH_SPREADING:
        return observe_candidates_here(survey, engine, positions_m, goals, notes_needed=notes_needed, progress=progress)
    return observe_elsewhere(executor, survey, engine, positions_m, goals, notes_needed=notes_needed, progress=progress)


def observe_candidates_here(
    survey: Survey,
    engine: ScanEngine,
    positions_m: FloatArray,
    goals: Goals,
    *,
    notes_needed: bool,
    progress: Progress,
) -> CandidateObservations:
    """Look from each of positions (N, 3). Where the survey knows what counts, only enough of a patch is seen at all."""
    n_patches = survey.patches.n_patches
    needed = tuple(
        {name: np.full(n_patches, np.nan, dtype=np.float32) for name in limits_of(each) if notes_needed}
        for each in goals.qualities
    )
    if goals.plain and not survey.counts_parts:
        seen = _plainly_seen(survey, engine, positions_m, progress)
        return CandidateObservations(SeenPatches(seen, seen), None, needed)
    found = _SeenSoFar(
        goals, n_patches, needed, keeps_parts=survey.counts_parts and survey.patches.countable_share is None
    )
    noise = goals.requirements.limits_noise
    for observations in observations_in_batches(survey, engine, positions_m, noise=noise, progress=progress):
        found.add(observations)
    return found.observations()


def limits_of(quality_limits: PointLimits) -> tuple[str, ...]:
    """Names of the limits that are set."""
    return tuple(field.name for field in fields(quality_limits) if getattr(quality_limits, field.name) is not None)


def merged(first: CandidateObservations, second: CandidateObservations, order: Int64Array) -> CandidateObservations:
    """Looks of the same survey and settings, one behind the other, in `order`."""
    for least, before in zip(second.needed, first.needed, strict=True):
        for limit, figures in least.items():
            np.fmin(figures, before[limit], out=figures)
    one = first.rows.met is first.rows.seen and second.rows.met is second.rows.seen
    seen = stacked_rows(first.rows.seen, second.rows.seen)
    met = seen if one else stacked_rows(first.rows.met, second.rows.met)
    parts = None
    if first.parts is not None and second.parts is not None:
        _, share = taken_along(seen.starts, np.concatenate([first.parts.seen, second.parts.seen]), order)
        met_share = share
        if not one:
            _, met_share = taken_along(met.starts, np.concatenate([first.parts.met, second.parts.met]), order)
        parts = SeenShares(
            seen=share,
            met=met_share,
            any_seen=first.parts.any_seen | second.parts.any_seen,
            any_met=first.parts.any_met | second.parts.any_met,
        )
    rows = SeenPatches(seen, met).take(order)
    return CandidateObservations(rows, parts, second.needed)


def in_a_row(looks: Sequence[CandidateObservations]) -> CandidateObservations:
    """Observations of the same survey and settings, one or more, one behind the other: as if all were made at once."""
    first = looks[0]
    n_patches, n_stacked = first.rows.seen.n_patches, first.rows.met.n_patches
    plain, by_parts = first.rows.met is first.rows.seen, first.parts is not None
    needed: tuple[dict[str, Float32Array], ...] = tuple(dict(each) for each in first.needed)
    any_seen, any_met = (np.zeros(n_patches, dtype=np.uint32) for _ in range(2))
    pieces = _Pieces(), _Pieces()
    no_share = np.empty(0, dtype=np.uint8)
    for look in looks:
        parts = look.parts
        for piece, rows, share in (
            (pieces[0], look.rows.seen, no_share if parts is None else parts.seen),
            (pieces[1], look.rows.met, no_share if parts is None else parts.met),
        ):
            piece.add(np.diff(rows.starts), rows.entries(0, rows.n_entries), share)
        if parts is not None:
            any_seen |= parts.any_seen
            any_met |= parts.any_met
        for least, before in zip(needed, look.needed, strict=True):
            for limit in least:
                least[limit] = np.fmin(least[limit], before[limit])
    seen, seen_share = pieces[0].joined(n_patches)
    met, met_share = (seen, seen_share) if plain else pieces[1].joined(n_stacked)
    together = SeenShares(seen_share, met_share, any_seen, any_seen if plain else any_met) if by_parts else None
    return CandidateObservations(SeenPatches(seen, met), together, needed)


class _SeenSoFar:
    """What was seen until now."""

    def __init__(
        self, goals: Goals, n_patches: int, needed: tuple[dict[str, Float32Array], ...], *, keeps_parts: bool
    ) -> None:
        self._goals, self._needed, self._n_patches = goals, needed, n_patches
        self._seen, self._met = _Pieces(), _Pieces()
        self._any = [np.zeros(n_patches, dtype=np.uint32) for _ in range(2)] if keeps_parts else []

    def add(self, observations: Observations) -> None:
        """Take the next positions'."""
        part = observations.part if self._any else None
        share = np.empty(0, dtype=np.uint8) if part is None else shares_of(part)
        self._seen.add(np.diff(observations.starts), observations.patch, share)
        if part is not None:
            np.bitwise_or.at(self._any[0], observations.patch, part)
        if self._goals.plain:
            return
        kept, quality = self._stacked(observations)
        row_of_sight = np.repeat(np.arange(observations.starts.size - 1), np.diff(observations.starts))
        sizes = np.bincount(row_of_sight[kept], minlength=observations.starts.size - 1).astype(np.int64)
        patch = observations.patch[kept] + (quality * self._n_patches).astype(np.int32)
        self._met.add(sizes, patch, share if part is None else share[kept])
        if part is not None:
            np.bitwise_or.at(self._any[1], observations.patch[kept], part[kept])
        for quality_limits, least in zip(self._goals.qualities, self._needed, strict=True):
            _note_needed(observations, quality_limits, least)

    def observations(self) -> CandidateObservations:
        """All of it; the pieces are gone then."""
        seen, share = self._seen.joined(self._n_patches)
        if self._goals.plain:
            met, met_share = seen, share
        else:
            met, met_share = self._met.joined(self._n_patches * len(self._goals.qualities))
        parts = None
        if self._any:
            parts = SeenShares(share, met_share, self._any[0], self._any[0] if self._goals.plain else self._any[1])
        return CandidateObservations(SeenPatches(seen, met), parts, self._needed)

    def _stacked(self, observations: Observations) -> tuple[Int64Array, Int64Array]:
        """Numbers of observations that meet a quality, row by row, and of the quality."""
        numbers, qualities = [], []
        for quality, (quality_limits, wanted) in enumerate(zip(self._goals.qualities, self._goals.wanted, strict=True)):
            kept = observations_meeting(observations, quality_limits)
            if wanted is not None:
                kept &= wanted[observations.patch]
            numbers.append(np.flatnonzero(kept))
            qualities.append(np.full(numbers[-1].size, quality, dtype=np.int64))
        number, quality_of = np.concatenate(numbers), np.concatenate(qualities)
        row = np.searchsorted(observations.starts, number, side="right")
        # Stable: qualities stay in their order within a row, and so do the patches of each.
        order = np.argsort(row, kind="stable")
        return number[order], quality_of[order]


class _Pieces:
    """Rows that come in pieces."""

    def __init__(self) -> None:
        self._sizes: list[Int64Array] = []
        self._patch = PatchColumn(visibility_budget())
        self._share: list[UInt8Array] = []

    def add(self, sizes: Int64Array, patch: Int32Array, share: UInt8Array) -> None:
        """Take the next rows."""
        self._sizes.append(sizes)
        self._patch.add(patch)
        self._share.append(share)

    def joined(self, n_patches: int) -> tuple[Visibility, UInt8Array]:
        """All rows, and the shares along them. The pieces go on the way, so that nothing is held twice."""
        starts = np.cumsum(np.concatenate([np.zeros(1, dtype=np.int64), *self._sizes]), dtype=np.int64)
        share = np.concatenate([np.empty(0, dtype=np.uint8), *self._share])
        self._share.clear()
        return self._patch.rows(starts, n_patches), share


@dataclass(frozen=True)
class ObservationJob:
    """What positions see, for some goals. engine : its kind. scene_key : of scene and patches, for engines kept."""

    survey: Survey
    goals: Goals
    notes_needed: bool
    engine: str
    scene_key: str

    def answer(self, positions_m: FloatArray, kept: Kept, progress: Progress = silent) -> bytes:
        """Look from positions (N, 3), local frame; raises `DeviceError` where there is no engine of the kind."""
        survey = self.survey

        def opened() -> ScanEngine:
            return open_engine(survey.scene, replace(survey.patches, countable_share=None), engine=self.engine)

        observed = observe_candidates_here(
            survey, kept(self.scene_key, opened), np.asarray(positions_m), self.goals, notes_needed=self.notes_needed,
            progress=progress,
        )  # fmt: skip
        return pack_observations(observed)


def observe_elsewhere(
    executor: Executor,
    survey: Survey,
    engine: ScanEngine,
    positions_m: FloatArray,
    goals: Goals,
    *,
    notes_needed: bool,
    progress: Progress,
) -> CandidateObservations:
    """Observe from each of positions (N, 3), as `observe_candidates_here`."""
    scene_key = executor.key_of((survey.scene, replace(survey.patches, countable_share=None)))
    job = ObservationJob(survey, goals, notes_needed, engine.name, scene_key)
    parts = parts_of_row(positions_m.shape[0], first=FIRST_POSITIONS, each=TASK_POSITIONS)
    answers = executor.answers(
        job,
        [Task(positions_m[begin:end], end - begin) for begin, end in parts],
        here=lambda some_m: job.answer(some_m, lambda key, make: engine),
        stage="scan",
        progress=progress,
    )
    n_patches = survey.patches.n_patches
    n_stacked = n_patches if goals.plain else n_patches * len(goals.qualities)
    return in_a_row([unpack_observations(each, n_patches, n_stacked) for each in answers])


def pack_observations(observed: CandidateObservations) -> bytes:
    """Return what positions see, in short: the same bytes for the same look."""
    plain = observed.rows.met is observed.rows.seen
    packed: list[Any] = [plain, _rows(observed.rows.seen), None if plain else _rows(observed.rows.met)]
    parts = observed.parts
    if parts is not None:
        once = parts.any_met is parts.any_seen
        packed.append([parts.seen, None if plain else parts.met, _set(parts.any_seen, parts.any_seen != 0),
                     None if once else _set(parts.any_met, parts.any_met != 0)])  # fmt: skip
    else:
        packed.append(None)
    packed.append(
        [{name: _set(values, ~np.isnan(values)) for name, values in each.items()} for each in observed.needed]
    )
    return zlib.compress(pickle.dumps(packed, protocol=5), _LEVEL)


def unpack_observations(content: bytes, n_patches: int, n_stacked: int) -> CandidateObservations:
    """Return the observations of `pack_observations`. n_stacked : patches by quality."""
    plain, seen_rows, met_rows, parts_packed, needed_packed = pickle.loads(zlib.decompress(content))
    seen = _visibility(seen_rows, n_patches)
    met = seen if plain else _visibility(met_rows, n_stacked)
    parts = None
    if parts_packed is not None:
        share, met_share, any_seen, any_met = parts_packed
        seen_samples = _filled(any_seen, np.zeros(n_patches, dtype=np.uint32))
        met_samples = seen_samples if any_met is None else _filled(any_met, np.zeros(n_patches, dtype=np.uint32))
        parts = SeenShares(share, share if plain else met_share, seen_samples, met_samples)
    needed: tuple[dict[str, Float32Array], ...] = tuple(
        {name: _filled(values, np.full(n_patches, np.nan, dtype=np.float32)) for name, values in each.items()}
        for each in needed_packed
    )
    return CandidateObservations(SeenPatches(seen, met), parts, needed)


def _plainly_seen(survey: Survey, engine: ScanEngine, positions_m: FloatArray, progress: Progress) -> Visibility:
    """What is seen from positions (N, 3): of a few at a time where not all of it may be in memory, to the same bits."""
    n = positions_m.shape[0]
    if visibility_budget() is None or n <= _AT_A_TIME:
        return visible_from(survey, engine, positions_m, progress=progress)
    pieces = _Pieces()
    for first in range(0, n, _AT_A_TIME):

        def whole_progress(event: ProgressEvent, first: int = first) -> None:
            progress(replace(event, done=first + event.done, total=n) if event.stage == "scan" else event)

        seen = visible_from(survey, engine, positions_m[first : first + _AT_A_TIME], progress=whole_progress)
        pieces.add(np.diff(seen.starts), seen.patch, np.empty(0, dtype=np.uint8))
    return pieces.joined(survey.patches.n_patches)[0]


def _note_needed(observations: Observations, quality_limits: PointLimits, least: dict[str, Float32Array]) -> None:
    """Lower `least`, (P,) by limit, to the figures of observations that meet all other limits."""
    for limit, figures in least.items():
        rest = observations_meeting(observations, replace(quality_limits, **{limit: None}))
        found = getattr(observations, limit)[rest]
        np.fmin.at(figures, observations.patch[rest], np.where(np.isnan(found), np.float32(np.inf), found))


def _best(rows: Visibility, share: UInt8Array, n_patches: int) -> Int32Array:
    """(P,) the largest share of each patch that one position sees; patches may be stacked."""
    best = np.zeros(n_patches, dtype=np.int32)
    for at, patch in rows.pieces():
        np.maximum.at(best, patch % n_patches, share[at : at + patch.size])
    return best


def _enough(rows: Visibility, share: UInt8Array, countable_share: UInt8Array) -> Visibility:
    """Rows without patches of which too little is seen; patches may be stacked."""
    column, size = PatchColumn(visibility_budget()), np.zeros(rows.n_positions, dtype=np.int64)
    for at, patch in rows.pieces():
        kept = sees_enough(share[at : at + patch.size], countable_share[patch % countable_share.size])
        column.add(patch[kept])
        size += np.bincount(rows.positions_of(at, patch.size)[kept], minlength=size.size)
    return column.rows(np.concatenate([[0], np.cumsum(size)]).astype(np.int64), rows.n_patches)


def _rows(rows: Visibility) -> tuple[NDArray[Any], NDArray[Any]]:
    """Sizes, and steps from patch to patch, which compress better than patches."""
    return np.diff(rows.starts).astype(np.int32), np.diff(rows.patch, prepend=np.int32(0)).astype(np.int32)


def _visibility(packed: tuple[NDArray[Any], NDArray[Any]], n_patches: int) -> Visibility:
    sizes, steps = packed
    starts = np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)]).astype(np.int64)
    return Visibility(starts, np.cumsum(steps, dtype=np.int32), n_patches)


def _set(values: NDArray[Any], is_set: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    at = np.flatnonzero(is_set).astype(np.int32)
    return np.diff(at, prepend=np.int32(0)).astype(np.int32), values[at]


def _filled(packed: tuple[NDArray[Any], NDArray[Any]], values: NDArray[Any]) -> NDArray[Any]:
    steps, found = packed
    values[np.cumsum(steps, dtype=np.int32)] = found
    return values
