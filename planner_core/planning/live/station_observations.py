"""Observations of stations: what a position sees of every patch and how, kept by the exact position.

A `Survey`, an open engine and a position in the local frame, metres -> `StationObservations`, made by
`planner_core.coverage.observations`; which of them meet what is required is decided here, once a position.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from planner_core.coverage.observations import Observations, observations_meeting, observing
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Int32Array, PointLimits, Survey, Visibility
from planner_core.progress import silent
from planner_core.requirements.observe_candidates import SeenPatches

#: Observations are kept up to this size, those used last; a dragged station makes some twenty a second.
KEPT_BYTES = 256 * 2**20


@dataclass(frozen=True)
class StationObservations:
    """What one position sees. patch : (M,) int32, sorted, all that is seen. observations : one row, how.

    met : for each quality required, the patches, sorted, on which the position meets it by itself.
    """

    position_m: tuple[float, float, float]
    patch: Int32Array
    met: tuple[Int32Array, ...]
    observations: Observations

    @property
    def n_bytes(self) -> int:
        """Memory that it takes, to a few bytes."""
        figures = (
            self.observations.range_m,
            self.observations.incidence_rad,
            self.observations.spacing_m,
            self.observations.noise_m,
        )
        arrays = (self.patch, *(met for met in self.met if met is not self.patch), *figures)
        return sum(0 if array is None else array.nbytes for array in arrays)


class StationObserver:
    """Observes from positions, one at a time, and keeps what they see."""

    def __init__(
        self,
        survey: Survey,
        engine: ScanEngine,
        qualities: tuple[PointLimits, ...],
        *,
        kept_bytes: int = KEPT_BYTES,
    ) -> None:
        self._qualities = qualities
        self._observations_at = observing(survey, engine, noise=bool(survey.scanner.range_noise))
        self._kept: OrderedDict[tuple[float, float, float], StationObservations] = OrderedDict()
        self._kept_bytes, self._n_bytes = kept_bytes, 0
        self.n_scans = 0
        """Positions that were scanned; those that were remembered do not count."""

    def observe(self, position_m: tuple[float, float, float]) -> StationObservations:
        """Return what a position, local frame, sees."""
        known = self._kept.get(position_m)
        if known is not None:
            self._kept.move_to_end(position_m)
            return known
        found = self._scan(position_m)
        self._kept[position_m] = found
        self._n_bytes += found.n_bytes
        while self._n_bytes > self._kept_bytes and len(self._kept) > 1:
            _, oldest = self._kept.popitem(last=False)
            self._n_bytes -= oldest.n_bytes
        return found

    def _scan(self, position_m: tuple[float, float, float]) -> StationObservations:
        self.n_scans += 1
        observations = self._observations_at(np.array([position_m], dtype=np.float64), silent)
        met = tuple(
            observations.patch
            if limits == PointLimits()
            else observations.patch[observations_meeting(observations, limits)]
            for limits in self._qualities
        )
        return StationObservations(position_m, observations.patch, met, observations)


def rows_of(looks: tuple[StationObservations, ...], n_patches: int, n_qualities: int) -> SeenPatches:
    """Return looks as rows that the figures of a plan are computed from."""
    seen = _visibility([look.patch for look in looks], n_patches)
    if n_qualities == 1 and all(look.met[0] is look.patch for look in looks):
        return SeenPatches(seen, seen)
    stacked = [
        np.concatenate([met + np.int32(quality * n_patches) for quality, met in enumerate(look.met)]) for look in looks
    ]
    return SeenPatches(seen, _visibility(stacked, n_patches * n_qualities))


def _visibility(rows: list[Int32Array], n_patches: int) -> Visibility:
    sizes = np.array([0, *(row.size for row in rows)], dtype=np.int64)
    patch = np.concatenate([np.zeros(0, dtype=np.int32), *rows])
    return Visibility(np.cumsum(sizes, dtype=np.int64), patch, n_patches)
