"""Observations of candidates by other processes: the job, and what positions see as bytes that travel.

An answer holds compressed rows, and of figures per patch those alone that are set.
"""

from __future__ import annotations

import pickle
import zlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.engine.scan_engine import ScanEngine, open_engine
from planner_core.model import Float32Array, FloatArray, Survey, Visibility
from planner_core.progress import Progress, silent
from planner_core.requirements.goals import Goals
from planner_core.requirements.observe_candidates import (
    CandidateObservations,
    SeenPatches,
    SeenShares,
    in_a_row,
    observe_candidates_here,
)
from planner_core.spread import Executor, Kept, Task, parts_of_row

#: Positions of a task: enough that it outweighs its overhead, few enough that the last ones are soon done.
TASK_POSITIONS, FIRST_POSITIONS = 16, 4
#: Of zlib: about as quick as a network of 1 Gbit/s.
_LEVEL = 1


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
