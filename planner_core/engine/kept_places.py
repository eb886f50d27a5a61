"""Places of patches, worked out once each: positions that are scanned one after another mostly see the same ones.

Input a `Scene` and its `Patches`, then patches by number; output `PatchPlaces`, those of `places_of` to the last bit.
"""

from __future__ import annotations

import numpy as np

from planner_core.engine.patch_samples import PatchPlaces, places_of
from planner_core.model import Int32Array, Int64Array, Patches, Scene

#: Scenes of more patches keep none: a place takes 105 bytes.
MOST_KEPT = 2_000_000


class KeptPlaces:
    """Places of the patches of one scene; memory is taken when they are first used."""

    def __init__(self, scene: Scene, patches: Patches, *, most_kept: int = MOST_KEPT) -> None:
        self._scene, self._patches, self._most_kept = scene, patches, most_kept
        self._kept: PatchPlaces | None = None
        self._is_known = np.zeros(0, dtype=np.bool_)

    def of(self, patch: Int32Array) -> PatchPlaces:
        """Places of patches (N,), in their order; one may occur several times."""
        n = self._patches.n_patches
        if n > self._most_kept:
            distinct, which = np.unique(patch, return_inverse=True)
            return _taken(places_of(self._scene, self._patches, distinct.astype(np.int32)), which)
        if self._kept is None:
            self._kept = PatchPlaces(np.empty((n, 3, 3)), np.empty((n, 3)), np.empty(n))
            self._is_known = np.zeros(n, dtype=np.bool_)
        new = patch[~self._is_known[patch]]
        if new.size:
            new = np.unique(new).astype(np.int32)
            found = places_of(self._scene, self._patches, new)
            self._kept.corners_m[new], self._kept.normal[new] = found.corners_m, found.normal
            self._kept.area_m2[new] = found.area_m2
            self._is_known[new] = True
        return _taken(self._kept, patch)


def _taken(places: PatchPlaces, rows: Int32Array | Int64Array) -> PatchPlaces:
    return PatchPlaces(places.corners_m[rows], places.normal[rows], places.area_m2[rows])
