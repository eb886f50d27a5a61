"""Places of patches that are kept: those of `places_of`, whatever was asked for before."""

import numpy as np
import pytest

import scenes_synthetic
from planner_core.engine import kept_places
from planner_core.engine.kept_places import KeptPlaces
from planner_core.engine.patch_samples import places_of
from planner_core.model import Int32Array
from planner_core.scene.patches import make_patches

SCENE = scenes_synthetic.build("l-room").scene
PATCHES = make_patches(SCENE, max_area_m2=0.3)


@pytest.mark.parametrize("most_kept", [0, kept_places.MOST_KEPT])
def test_places_are_those_that_are_worked_out_anew_in_any_order_and_more_than_once(most_kept: int) -> None:
    kept = KeptPlaces(SCENE, PATCHES, most_kept=most_kept)
    random = np.random.default_rng(3)
    for size in (5, 40, 200):
        patch = random.integers(0, PATCHES.n_patches, size).astype(np.int32)
        found, right = kept.of(patch), places_of(SCENE, PATCHES, patch)
        for name in ("corners_m", "normal", "area_m2"):
            assert getattr(found, name).tobytes() == getattr(right, name).tobytes(), (size, name)


def test_no_place_is_worked_out_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Int32Array] = []

    def counting(scene: object, patches: object, patch: Int32Array) -> object:
        asked.append(patch)
        return places_of(SCENE, PATCHES, patch)

    monkeypatch.setattr(kept_places, "places_of", counting)
    kept = KeptPlaces(SCENE, PATCHES)
    for first in (0, 10, 10, 30):
        kept.of(np.arange(first, first + 40, dtype=np.int32))
    assert np.array_equal(np.concatenate(asked), np.arange(70))
