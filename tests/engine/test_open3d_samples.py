"""Samples of patch mode through Open3D: what triangles are found to hide against a test of every sample."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner_core import compiled
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open3d_samples import Open3DSamples
from planner_core.engine.patch_samples import (
    ALL_RIM,
    N_FINE,
    N_RIM,
    SLACK,
    SLACK_MOST,
    View,
    in_view,
    places_of,
    rounding_of,
    sample_pattern,
    view_of,
)
from planner_core.model import Patches, Scene
from planner_core.scene.patches import make_patches

FINE = [pytest.param(area_m2, marks=pytest.mark.slow) for area_m2 in (0.05, 0.01, 0.001)]


def marks_of_every_sample(
    engine: Open3DEngine, scene: Scene, patches: Patches, view: View, position: np.ndarray
) -> np.ndarray:
    places = places_of(scene, patches, np.arange(patches.n_patches, dtype=np.int32))
    corners, weights = places.corners_m - position, sample_pattern()[:, :2]
    at = corners[:, :1] + np.einsum("sk,nki->nsi", weights, corners[:, 1:] - corners[:, :1])
    open_ = in_view(view, at, places.normal)
    from_plane = np.abs((corners[:, 0] * places.normal).sum(axis=1))
    with np.errstate(divide="ignore"):
        slack = np.minimum(SLACK + rounding_of(scene) / from_plane, SLACK_MOST)
    targets = (at / (1 + slack)[:, None, None])[open_]
    open_[open_] = ~engine.are_hidden(position, targets)
    mask = open_ @ (np.uint32(1) << np.arange(N_RIM + N_FINE, dtype=np.uint32))
    return np.where(mask & ALL_RIM == ALL_RIM, ALL_RIM, mask)


@pytest.mark.parametrize("area_m2", [0.5, *FINE])
@pytest.mark.parametrize(
    "angles", [(-60.0, 60.0, 360.0, 90.0), pytest.param((-20.0, 35.0, 100.0, 70.0), marks=pytest.mark.campaign)]
)
def test_triangles_that_hide_whole_patches_change_no_mark(
    shapes: SimpleNamespace, area_m2: float, angles: tuple[float, ...]
) -> None:
    low, high, turn, incidence = angles
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=5))
    patches = make_patches(scene, max_area_m2=area_m2)
    engine = Open3DEngine(scene, patches)
    template = shapes.template_of(50, 400, low_deg=low, high_deg=high, range_max_m=5.0)
    columns = template.azimuth_rad * (turn / 360)
    template = type(template)(columns, template.elevation_rad, template.range_min_m, template.range_max_m)
    view = view_of(template, max_incidence_rad=float(np.deg2rad(incidence)))
    rng = np.random.default_rng(3)
    # In the room, on its floor, in a wall's plane outside of it, and at a corner.
    positions = np.concatenate(
        [rng.uniform((-3.9, -2.9, 0.1), (3.9, 2.9, 2.9), (5, 3)), [(0, 0, 0), (4, 9, 1), (4, 3, 3)]]
    )
    marks = Open3DSamples(engine, scene, patches).marks(view, positions.astype(np.float32), 0.0)
    for row, position in zip(marks, positions.astype(np.float32).astype(np.float64), strict=True):
        np.testing.assert_array_equal(row, marks_of_every_sample(engine, scene, patches, view, position))


@pytest.mark.slow
def test_marks_do_not_depend_on_the_number_of_threads(shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(30, seed=6))
    patches = make_patches(scene, max_area_m2=0.02)
    samples = Open3DSamples(Open3DEngine(scene, patches), scene, patches)
    view = view_of(shapes.template_of(50, 400))
    positions = np.array([[0.3, 0.2, 1.0], [-1.0, 0.5, 1.5]], dtype=np.float32)
    expected = samples.marks(view, positions, 1.0)
    for n_threads in (1, 5):
        monkeypatch.setattr(compiled, "n_usable_cores", lambda n=n_threads: n)
        np.testing.assert_array_equal(samples.marks(view, positions, 1.0), expected)
