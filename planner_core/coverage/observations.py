"""How positions see patches: point spacing (LOD), range, incidence, range noise (LOA), covered area (LOC).

A `Survey`, an open engine, positions (N, 3) in the local frame, metres -> `Observations`, by samples (`PatchViews`) or
by beams (`PatchReturns`), in batches that memory holds; then what is required, `PointLimits` -> the patches that meet
it. Overlap (LOO) is `planner_core.network.links`; the method is in docs/method/levels.md.

Ground is seen from above only (`GroundSides`): of a slab that is a single plane, the room below sees the same surface
as its ceiling.

References
----------
López et al. 2023, section 2.2 and 3.3.1 (LOD, LOA, LOC, LOO). They fold LOD and LOA into F2; clients give limits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from planner_core.coverage.visibility_threshold import sees_enough, shares_of
from planner_core.engine.open_engine import engine_facts
from planner_core.engine.patch_mode import PatchMode, PatchViews
from planner_core.engine.patch_samples import UInt32Array
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.kept import Shelf, hash_of, hash_of_scene
from planner_core.model import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    PatchReturns,
    PointLimits,
    Scanner,
    Survey,
    UInt8Array,
    VisibilityMode,
)
from planner_core.model.arrays import area_normals
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scanner.range_noise import range_noise_m

#: Observations a batch should have: some 500 bytes each while a batch is worked on.
_BATCH_OBSERVATIONS = 2**20
_Look = Callable[[FloatArray, Progress], "Observations"]
#: Positions of the first batch, when nobody knows yet how many patches one sees, and of any.
_FIRST_BATCH, _MOST_BATCH = 8, 64


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

    def row(self, position: int) -> Observations:
        """Those of one position, without noise."""
        its = slice(int(self.starts[position]), int(self.starts[position + 1]))
        return Observations(
            starts=np.array([0, its.stop - its.start], dtype=np.int64),
            patch=self.patch[its],
            n_patches=self.n_patches,
            spacing_m=self.spacing_m[its],
            range_m=self.range_m[its],
            incidence_rad=self.incidence_rad[its],
            part=None if self.part is None else self.part[its],
        )

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


def observations_in_batches(
    survey: Survey, engine: ScanEngine, positions_m: FloatArray, *, noise: bool = False, progress: Progress = silent
) -> Iterator[Observations]:
    """How each of positions sees each patch, piece by piece: of the first few positions, the next few, and so on.

    How positions are split depends on how much they see, and no figure depends on it. The rows are those of
    `planner_core.coverage.survey.visible_from`; once the survey knows how much of each patch counts, those of which
    enough is seen, see `coverage.visibility_threshold`. 20 bytes per observation, 24 with noise.

    Raises
    ------
    RequirementError, DeviceError
        See `ScanEngine.patch_returns`, `PatchMode.see`, `with_noise`.
    """
    look = observing(survey, engine, noise=noise, keeps=True)
    positions = np.asarray(positions_m, dtype=np.float64)
    first, size = 0, _FIRST_BATCH
    while first < len(positions):
        end = min(first + size, len(positions))
        observations = look(positions[first:end], _counted_from(progress, first, len(positions)))
        yield observations
        size = min(max(_BATCH_OBSERVATIONS * (end - first) // max(observations.patch.size, 1), 1), _MOST_BATCH)
        first = end


def observing(survey: Survey, engine: ScanEngine, *, noise: bool = False, keeps: bool = False) -> _Look:
    """Turn positions into observations; patch mode sends its groups to the device here.

    keeps : what positions see is kept between commands, see `planner_core.kept`, and groups are sent once they are
    needed.
    """
    sides = GroundSides(survey)
    of_mode = _by_beams if survey.scan_mode == VisibilityMode.BEAMS else _by_samples
    by_mode = (
        _KeptLooks(lambda: of_mode(survey, engine), engine, _shelf(survey, engine))
        if keeps
        else of_mode(survey, engine)
    )

    def look(at: FloatArray, progress: Progress) -> Observations:
        found = by_mode(at, progress)
        counts = sides.counts(at, found.starts, found.patch)
        found = observed_enough(found if counts.all() else found.take(counts), survey.patches.countable_share)
        return with_noise(found, survey.scanner, reflectivity=survey.reflectivity) if noise else found

    return look


def observed_enough(observations: Observations, countable_share: UInt8Array | None) -> Observations:
    """Observations of enough of what counts, (P,) uint8; by beams, and where nobody knows what counts, all."""
    if countable_share is None or observations.part is None:
        return observations
    return observations.take(sees_enough(shares_of(observations.part), countable_share[observations.patch]))


class GroundSides:
    """Which side of a survey's ground positions are on."""

    def __init__(self, survey: Survey) -> None:
        scene = survey.scene
        floors = () if survey.as_in_paper else survey.floors
        ground = np.unique(np.concatenate([np.zeros(0, np.int32), *(floor.ground_triangles for floor in floors)]))
        corners_m = scene.vertices_m[scene.triangles[ground]]
        upward = area_normals(corners_m)
        # Windings are not trusted: up is up.
        upward *= np.where(upward[:, 2:] < 0.0, -1.0, 1.0)
        self._upward, self._level_m3 = upward, np.einsum("ti,ti->t", upward, corners_m[:, 0])
        self._number = np.full(scene.n_triangles, -1, dtype=np.int32)
        self._number[ground] = np.arange(ground.size, dtype=np.int32)
        self._triangle_of_patch = survey.patches.triangle_of_patch

    def counts(self, positions_m: FloatArray, starts: Int64Array, patch: Int32Array) -> BoolArray:
        """(M,) bool: entries of rows, `starts` (N + 1,) into `patch` (M,), but for those that see ground from below."""
        return self.are_above(positions_m, starts, self._triangle_of_patch[patch])

    def are_above(self, positions_m: FloatArray, starts: Int64Array, triangle: Int32Array) -> BoolArray:
        """(M,) bool: whether the rows' positions are above triangles (M,); of what is no ground all are."""
        found = np.ones(triangle.size, dtype=np.bool_)
        number = self._number[triangle]
        entry = np.flatnonzero(number >= 0)
        number = number[entry]
        at_m = positions_m[np.searchsorted(starts, entry, side="right") - 1]
        found[entry] = np.einsum("mi,mi->m", self._upward[number], at_m) > self._level_m3[number]
        return found


def _by_beams(survey: Survey, engine: ScanEngine) -> _Look:
    template, area_m2, only = survey.template, survey.patches.area_m2, survey.patches_observed
    return lambda at, progress: observations_of_returns(
        engine.patch_returns(template, at, moments=True, progress=progress), area_m2, only=only
    )


def _by_samples(survey: Survey, engine: ScanEngine) -> _Look:
    # What is seen of a patch does not depend on how much of it counts.
    patches = replace(survey.patches, countable_share=None)
    mode = PatchMode(engine, survey.scene, patches, only=survey.patches_observed)
    return lambda at, progress: observations_of_views(mode.see(survey.template, at, progress=progress))


def _shelf(survey: Survey, engine: ScanEngine) -> Shelf:
    """Where what single positions see is kept, by all that `_by_beams` or `_by_samples` depends on."""
    is_by_beams = survey.scan_mode == VisibilityMode.BEAMS
    patches = hash_of(survey.patches, without=() if is_by_beams else ("countable_share",))
    inputs = [hash_of_scene(survey.scene), patches, survey.patches_observed, survey.template, engine_facts(engine)]
    return Shelf("beams" if is_by_beams else "samples", inputs, classes=(Observations,))


class _KeptLooks:
    """Observes from positions of which nothing is kept, and reads what the others see: each position by itself, so that
    a few new ones among many cost no more than they take.
    """

    def __init__(self, open_look: Callable[[], _Look], engine: ScanEngine, shelf: Shelf) -> None:
        self._open, self._engine, self._shelf = open_look, engine, shelf
        self._look: _Look | None = None

    def __call__(self, at: FloatArray, progress: Progress) -> Observations:
        if not self._shelf.is_open:
            return self._now(at, progress)
        rows: list[Observations | None] = [self._shelf.find(each.tobytes()) for each in at]
        new = [number for number, row in enumerate(rows) if row is None]
        if new:
            so_far = self._engine.warnings
            found = self._now(at[new], _counted_from(progress, len(at) - len(new), len(at)))
            for row, number in enumerate(new):
                rows[number] = each = found.row(row)
                if self._engine.warnings == so_far:  # which whoever reads it would not get
                    self._shelf.put(each, at[number].tobytes())
        else:
            progress(ProgressEvent("scan", len(at), len(at)))
        return _one_behind_the_other([row for row in rows if row is not None])

    def _now(self, at: FloatArray, progress: Progress) -> Observations:
        if self._look is None:
            self._look = self._open()
        return self._look(at, progress)


def _one_behind_the_other(rows: list[Observations]) -> Observations:
    """Rows, one or more, of the same mode, without noise."""
    parts = [each.part for each in rows if each.part is not None]
    return Observations(
        starts=np.concatenate([[0], np.cumsum([each.patch.size for each in rows])]).astype(np.int64),
        patch=np.concatenate([each.patch for each in rows]),
        n_patches=rows[0].n_patches,
        spacing_m=np.concatenate([each.spacing_m for each in rows]),
        range_m=np.concatenate([each.range_m for each in rows]),
        incidence_rad=np.concatenate([each.incidence_rad for each in rows]),
        part=np.concatenate(parts) if parts else None,
    )


def _counted_from(progress: Progress, first: int, total: int) -> Progress:
    """Progress of a batch that starts at position `first`, as progress of all."""
    return lambda event: progress(ProgressEvent(event.stage, first + event.done, total, event.note))
