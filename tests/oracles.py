"""Figures of whole plans in the plainest way: what tests compare with."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from stages import surveyed_as

from planner_core.coverage.observations import Observations, observations_in_batches, observations_meeting
from planner_core.engine.patch_samples import sample_pattern
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    FloatArray,
    Int32Array,
    Int64Array,
    PlanSettings,
    PointLimits,
    Survey,
    UInt8Array,
)
from planner_core.plan_folder.viewer_layers import range_step_m
from planner_core.progress import Progress, silent
from planner_core.select.problem import Constraint

#: Part of what counts of a patch that is enough of it to be seen: docs/method/coverage.md.
_ENOUGH = Fraction(11, 20)


def best_figures(observations: Observations, name: str) -> FloatArray:
    """(P,) the least `range_m`, `incidence_rad`, ... of each patch from any position; inf where nobody sees it."""
    best = np.full(observations.n_patches, np.inf)
    np.fmin.at(best, observations.patch, getattr(observations, name))
    return best


def joint_spacing_m(observations: Observations) -> FloatArray:
    """(P,) float64, spacing of the points of all positions together, inf where unseen: densities 1 / spacing^2 add."""
    with np.errstate(divide="ignore"):
        densities = observations.spacing_m.astype(np.float64) ** -2.0
        density = np.bincount(observations.patch, weights=densities, minlength=observations.n_patches)
        return np.asarray(density**-0.5, dtype=np.float64)


def times_meeting(observations: Observations, asked: PointLimits) -> Int32Array:
    """(P,) int32, number of positions each of which meets all limits on the patch by itself."""
    meets = observations_meeting(observations, asked)
    return np.bincount(observations.patch[meets], minlength=observations.n_patches).astype(np.int32)


def observations_from(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray, *, progress: Progress = silent
) -> Observations:
    """How each of positions (N, 3), local frame, sees each patch: all at once."""
    batches = list(
        observations_in_batches(
            surveyed_as(survey, settings),
            engine,
            positions_m,
            noise=settings.requirements.limits_noise,
            progress=progress,
        )
    )
    sizes = np.concatenate([np.zeros(1, dtype=np.int64), *(np.diff(batch.starts) for batch in batches)])
    none = np.zeros(0, dtype=np.float32)
    noise = [batch.noise_m for batch in batches if batch.noise_m is not None]
    parts = [batch.part for batch in batches if batch.part is not None]
    return Observations(
        starts=np.cumsum(sizes, dtype=np.int64),
        patch=np.concatenate([none.astype(np.int32), *(batch.patch for batch in batches)]),
        n_patches=survey.patches.n_patches,
        spacing_m=np.concatenate([none, *(batch.spacing_m for batch in batches)]),
        range_m=np.concatenate([none, *(batch.range_m for batch in batches)]),
        incidence_rad=np.concatenate([none, *(batch.incidence_rad for batch in batches)]),
        noise_m=np.concatenate([none, *noise]) if settings.requirements.limits_noise else None,
        part=np.concatenate(parts) if parts else None,
    )


@dataclass(frozen=True)
class Enough:
    """What counts of patches, by plain loops. by_samples : (P,) int, 255ths, what samples say of it. seen : (M,) bool,
    observations of 55 % of what counts. met : the same for each quality."""

    by_samples: Int64Array
    seen: BoolArray
    met: list[BoolArray]


def enough_of(
    observations: Observations,
    countable_share: UInt8Array | None,
    qualities: tuple[PointLimits, ...],
    wanted: list[BoolArray] | None = None,
) -> Enough:
    """Observations of enough of `countable_share` (P,). By samples, as much counts as positions together meet any
    quality on, or else see, and at most so much that one of them sees 55 % of it."""
    weight = sample_pattern()[:, 2]
    meets = [observations_meeting(observations, asked) for asked in qualities]
    if wanted is not None:
        meets = [found & part[observations.patch] for found, part in zip(meets, wanted, strict=True)]
    if observations.part is None or countable_share is None:
        return Enough(np.full(observations.n_patches, 255), np.ones(observations.patch.size, dtype=bool), meets)

    def in_255ths(samples: set[int]) -> int:
        return max(1, round(255 * sum(weight[sample] for sample in samples))) if samples else 0

    own = [{sample for sample in range(weight.size) if int(part) >> sample & 1} for part in observations.part]
    by_samples = np.full(observations.n_patches, 255)
    for patch in range(observations.n_patches):
        here = np.flatnonzero(observations.patch == patch)
        looks = [own[entry] for entry in here if any(found[entry] for found in meets)] or [own[entry] for entry in here]
        if looks:
            by_samples[patch] = min(
                in_255ths(set().union(*looks)), math.floor(max(in_255ths(look) for look in looks) / _ENOUGH)
            )
    enough = np.array(
        [
            in_255ths(samples) >= _ENOUGH * int(countable_share[patch])
            for samples, patch in zip(own, observations.patch, strict=True)
        ],
        dtype=bool,
    )
    return Enough(by_samples, enough, [found & enough for found in meets])


def read_cloud(content: bytes, template: BeamTemplate) -> tuple[FloatArray, UInt8Array]:
    """Range (R, C) float64 in metres, NaN where there is no return, and intensity (R, C) uint8: of viewer/clouds."""
    n_rows, n_columns = template.shape
    unpacked = zlib.decompress(content)
    steps = np.frombuffer(unpacked, dtype="<u2", count=n_rows * n_columns).reshape(template.shape)
    intensity = np.frombuffer(unpacked, dtype=np.uint8, offset=2 * n_rows * n_columns).reshape(template.shape)
    steps, intensity = (np.cumsum(each, axis=1, dtype=each.dtype) for each in (steps, intensity))
    return np.where(steps > 0, steps * range_step_m(template), np.nan), intensity


def floor_constraints(
    floor_of_patch: Int32Array, floors: tuple[int, ...], scope: BoolArray, fraction: float, seen_from: int = 1
) -> tuple[Constraint, ...]:
    """One target a planned floor, and one for everything in `scope` together.

    floor_of_patch : (P,) int32. floors : indices of those planned. scope : (P,) bool, see `scope_of`.
    """
    parts = (*(floor_of_patch == index for index in floors), scope)
    return tuple(Constraint(part, fraction, seen_from) for part in parts)
