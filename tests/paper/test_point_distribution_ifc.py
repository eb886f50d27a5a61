"""A real building: F2 of a station against all pairs of points, patch by patch."""

from collections.abc import Callable

import numpy as np
import pytest

from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_samples import places_of
from planner_core.model import BeamTemplate, Scene
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.reference_distance import (
    SampleKind,
    mean_squared_distance_m2,
    reference_distances_of_patches_m2,
    sample_triangle,
)
from planner_core.scanner.template import directions
from planner_core.scene.patches import make_patches


@pytest.mark.slow
@pytest.mark.opencl
def test_f2_in_a_building_is_that_of_all_pairs(real_scene: Callable[[str], Scene]) -> None:
    scene = real_scene("duplex")
    patches = make_patches(scene, max_area_m2=0.04)
    engine = open_engine(scene, patches, engine="opencl")
    template = BeamTemplate(
        azimuth_rad=np.arange(600) * (2 * np.pi / 600),
        elevation_rad=np.deg2rad(np.linspace(30, -40, 64)),
        range_min_m=0.5,
        range_max_m=8.0,
    )
    low, high = scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)
    inside = np.array([[0.3, 0.4], [0.6, 0.6], [0.7, 0.3]])
    positions = np.column_stack([low[:2] + inside * (high - low)[:2], np.full(3, 1.6)])
    distribution = PointDistribution(scene, patches, engine)
    found = distribution.of(template, positions)
    station = int(found.n_patches.argmax())
    assert found.n_patches[station] > 500

    origin = positions[station].astype(np.float32).astype(np.float64)
    batch = engine.scan(template, positions[station : station + 1])
    hit = batch.patch[0] >= 0
    beams = directions(template).astype(np.float32).astype(np.float64)[hit]
    points = origin + beams * batch.range_m[0][hit][:, None].astype(np.float64)
    patch = batch.patch[0][hit]
    reached = np.unique(patch).astype(np.int32)
    places = places_of(scene, patches, reached)
    excess = 0.0
    for one, corners, normal in zip(reached, places.corners_m, places.normal, strict=True):
        mine = np.concatenate([points[patch == one], corners])
        away = mine - origin
        weights = 2 - np.abs(away @ normal) / np.linalg.norm(away, axis=1)
        squares = ((mine[:, None] - mine[None]) ** 2).sum(axis=2)
        excess += float((weights * squares.sum(axis=1)).mean() / (len(mine) - 1)) - distribution.reference_m2[one]
    all_patches = distribution.reference_total_m2
    expected = all_patches - distribution.reference_m2[reached].sum() + excess
    assert found.n_patches[station] == reached.size
    assert abs(found.f2_m2[station] - expected) < 1e-5 * abs(excess)

    some = np.linspace(0, patches.n_patches - 1, 60).astype(np.int32)
    for one, corners, area in zip(some, places_of(scene, patches, some).corners_m, patches.area_m2[some], strict=True):
        n = max(1, int(np.ceil(round(area * 2500, 6))))
        scattered = np.concatenate([corners, sample_triangle(corners, n, SampleKind.HALTON)])
        expected_one = mean_squared_distance_m2(scattered)
        assert distribution.reference_m2[one] == pytest.approx(expected_one, rel=1e-6, abs=1e-15)
    on_host = reference_distances_of_patches_m2(scene, patches, points_per_m2=2500.0)
    np.testing.assert_array_equal(on_host, distribution.reference_m2)
