"""Levels as clients state them, by patch: point spacing (LOD), range, incidence, range noise (LOA), covered area (LOC).

Input rows of what positions see, by samples (`PatchViews`) or by beams (`PatchReturns`) -> `Observations`; then what is
required, `PointLimits` -> the patches that meet it. Overlap (LOO) is `planner_core.network.links`; the method is in
docs/method/levels.md.

References
----------
López et al. 2023, section 2.2 and 3.3.1 (LOD, LOA, LOC, LOO). They fold LOD and LOA into F2; clients give limits.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from planner_core.engine.patch_mode import PatchViews
from planner_core.engine.patch_samples import UInt32Array
from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    PatchReturns,
    PointLimits,
    Scanner,
)
from planner_core.scanner.range_noise import range_noise_m


@dataclass(frozen=True)
class Observations:
    """How each of N positions sees the patches that it sees, as compressed sparse rows like those of `Visibility`.

    starts : (N + 1,) int64. patch : (M,) int32. spacing_m, range_m, incidence_rad : (M,) float32. noise_m : (M,)
    float32, one sigma, NaN where the scanner's figures do not say; None where nobody worked it out, see `with_noise`.
    part : (M,) uint32, samples of the patch that are seen, see `PatchViews`; None: by beams, which say only whether.
    """

    starts: Int64Array
    patch: Int32Array
    n_patches: int
    spacing_m: Float32Array
    range_m: Float32Array
    incidence_rad: Float32Array
    noise_m: Float32Array | None = None
    part: UInt32Array | None = None

    def take(self, kept: BoolArray) -> Observations:
        """Those of a mask (M,)."""
        return Observations(
            starts=np.concatenate([[0], np.cumsum(kept)])[self.starts],
            patch=self.patch[kept],
            n_patches=self.n_patches,
            spacing_m=self.spacing_m[kept],
            range_m=self.range_m[kept],
            incidence_rad=self.incidence_rad[kept],
            noise_m=None if self.noise_m is None else self.noise_m[kept],
            part=None if self.part is None else self.part[kept],
        )


def observations_of_views(views: PatchViews) -> Observations:
    """Observations by samples: the larger of the spacings of neighbouring columns and of neighbouring rows."""
    return Observations(
        starts=views.starts,
        patch=views.patch,
        n_patches=views.n_patches,
        spacing_m=views.spacing_m.max(axis=1, initial=0.0),
        range_m=views.range_m,
        incidence_rad=np.arccos(np.clip(views.cos_incidence.astype(np.float64), 0.0, 1.0)).astype(np.float32),
        part=views.part,
    )


def observations_of_returns(
    returns: PatchReturns, patch_area_m2: FloatArray, *, only: BoolArray | None = None
) -> Observations:
    """Observations by beams: sqrt(area / returns) for spacing, means of range and of the cosine of incidence.

    Parameters
    ----------
    returns
        With moments. patch_area_m2 : (P,). only : (P,) bool, patches to be observed; None: all.

    Notes
    -----
    The area of the whole patch: where part of it is hidden, the points on the rest lie closer than this.
    """
    if returns.moments is None:
        raise ValueError("levels: got returns without moments, expected them; ask the engine for `moments=True`")
    n = returns.n_returns.astype(np.float64)
    mean_cosine = 2.0 - returns.moments.weight_sum / n
    observations = Observations(
        starts=returns.starts,
        patch=returns.patch,
        n_patches=returns.n_patches,
        spacing_m=np.sqrt(patch_area_m2[returns.patch] / n).astype(np.float32),
        range_m=returns.mean_range_m.astype(np.float32),
        incidence_rad=np.arccos(np.clip(mean_cosine, 0.0, 1.0)).astype(np.float32),
    )
    return observations if only is None else observations.take(only[returns.patch])


def with_noise(observations: Observations, scanner: Scanner, *, reflectivity: float) -> Observations:
    """Observations with `noise_m` by the scanner's table of range noise.

    Parameters
    ----------
    reflectivity
        Of the surfaces met head on, 0 to 1; e.g. 0.8 for white walls.

    Notes
    -----
    A matt surface sends back reflectivity x cos(incidence) (Lambert), and the table is read at that. Where it does
    not reach that far down, as at grazing incidence, the noise is NaN: not known, and so not met.

    Raises
    ------
    RequirementError
        The reflectivity is none.
    """
    if not 0 < reflectivity <= 1:
        raise RequirementError(
            f"reflectivity: got {reflectivity}, expected above 0 and at most 1; a white wall has 0.8"
        )
    sent_back = reflectivity * np.cos(observations.incidence_rad.astype(np.float64))
    noise = range_noise_m(scanner, observations.range_m, reflectivity=sent_back)
    return replace(observations, noise_m=noise.astype(np.float32))


def observations_meeting(observations: Observations, limits: PointLimits) -> BoolArray:
    """(M,) bool, observations that meet all limits. Limits are rounded to float32 where the figures are.

    Raises
    ------
    RequirementError
        Noise is required and the observations have none.
    """
    if limits.noise_m is not None and observations.noise_m is None:
        raise RequirementError(
            f"noise_m: got a limit of {limits.noise_m} m and observations without noise, expected them to have it; "
            "take a scanner with a table of range noise and call `with_noise`"
        )
    meets = np.ones(observations.patch.size, dtype=np.bool_)
    for field in fields(limits):
        limit = getattr(limits, field.name)
        if limit is not None:
            # What is not known is NaN, which compares false: not met.
            meets &= getattr(observations, field.name) <= float(limit)
    return meets
