"""Pictures of scenes: the camera stands where the scene just fills the picture; each picture is of a scene there is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic

drawing = pytest.importorskip("scenes_synthetic.drawing", reason="pyvista, which draws the pictures, is not installed")
IMAGES = Path(__file__).parents[2] / "docs" / "images"


@pytest.mark.parametrize("seed", range(5))
def test_fitted_eye_sees_all_points_and_none_could_be_nearer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, size, angle = rng.uniform(-30, 30, size=(50, 3)), (640, 440), np.deg2rad(30.0)
    forward = rng.normal(size=3) * (1, 1, 0.5)
    forward /= np.linalg.norm(forward)
    eye = drawing._fitted_eye(points, forward, size, angle)
    right = np.cross(forward, (0, 0, 1)) / np.linalg.norm(np.cross(forward, (0, 0, 1)))
    depth = (points - eye) @ forward
    assert depth.min() > 0
    tangent = np.tan(angle / 2)
    across = (points - eye) @ right / depth / tangent / (size[0] / size[1])
    up = (points - eye) @ np.cross(right, forward) / depth / tangent
    margin = 1 - 2 * drawing._MARGIN_PIXELS / min(size)
    # One of both directions is filled from side to side, the other one at most.
    spans = sorted((across.min(), across.max(), up.min(), up.max()))
    assert max(abs(spans[0]), spans[-1]) == pytest.approx(margin)
    filled = [np.allclose([part.min(), part.max()], [-margin, margin]) for part in (across, up)]
    assert any(filled)


def test_every_scene_but_bare_rooms_and_copies_has_its_picture() -> None:
    from scenes_synthetic.pictures import VIEWS

    known = {*scenes_synthetic.names(), "campus"}
    plain = {"box", "l-room", "two-rooms", "closed-rooms", "corridor-comb"}
    copies = {"georeferenced", "millimetres-y-up", "broken-faces", "without-slabs"}
    assert {view.scene for view in VIEWS} == known - plain - copies
    page = (IMAGES.parent / "scenes.md").read_text(encoding="utf-8")
    for view in VIEWS:
        assert (IMAGES / view.file_name).is_file(), view.file_name
        assert f"images/{view.file_name}" in page, view.file_name
