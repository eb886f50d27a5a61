"""Strays: single faces far from a building change neither its floors nor where its local frame is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner_core.model import Element, Scene
from planner_core.scene.build import FAR_ORIGIN_M, scene_from_arrays
from planner_core.scene.extent import weighted_quantile
from planner_core.scene.floors import find_floors
from scenes_synthetic import house, rooms

GRID_M = np.array([500_000.0, 5_400_000.0, 0.0])
LEVEL = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
UPRIGHT = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])


def moved(points_m, *by_m: float) -> np.ndarray:
    return np.asarray(points_m) + np.array(by_m)


@pytest.fixture(scope="module")
def plain() -> Scene:
    return house.build().scene


def with_stray(scene: Scene, stray_m, *, at_m=(0.0, 0.0, 0.0), storeys: bool = True, repeat: int = 1) -> Scene:
    """The scene at `at_m` and one element more, the triangle `stray_m` (3, 3), `repeat` times a metre apart."""
    steps = np.arange(repeat)[:, None, None] * np.array([0.0, 2.0, 0.0])
    soup = (np.asarray(stray_m)[None] + steps).reshape(-1, 3)
    n = len(scene.vertices_m)
    return scene_from_arrays(
        np.concatenate([scene.vertices_m + np.asarray(at_m), soup]),
        np.concatenate([scene.triangles, n + np.arange(len(soup)).reshape(-1, 3)]),
        element_of_triangle=np.concatenate([scene.element_of_triangle, np.full(repeat, len(scene.elements))]),
        elements=[
            *(scene.elements if storeys else [replace(e, storey=-1) for e in scene.elements]),
            Element("Origin {marker}", "Mesh", "stray", -1),
        ],
        storeys=[replace(s, elevation_m=s.elevation_m + at_m[2]) for s in scene.storeys] if storeys else (),
    )


def without_storeys(scene: Scene) -> Scene:
    return scene_from_arrays(
        scene.vertices_m,
        scene.triangles,
        element_of_triangle=scene.element_of_triangle,
        elements=[replace(e, storey=-1) for e in scene.elements],
    )


def assert_same_floors(scene: Scene, expected: Scene) -> None:
    mine, other = find_floors(scene).floors, find_floors(expected).floors
    assert [(f.name, f.origin) for f in mine] == [(f.name, f.origin) for f in other]
    for a, b in zip(mine, other, strict=True):
        assert a.elevation_m == pytest.approx(b.elevation_m, abs=1e-6)
        assert a.ground_triangles.tolist() == b.ground_triangles.tolist()
        assert a.ground_area_m2 == pytest.approx(b.ground_area_m2, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("stray_m", [LEVEL, UPRIGHT, moved(LEVEL, 0, 0, 5e8), LEVEL - GRID_M / 2, LEVEL * [1e6, 1, 1]])
def test_stray_far_from_a_house_on_a_national_grid_is_dropped_and_named(plain, stray_m):
    scene = with_stray(plain, stray_m, at_m=GRID_M)
    clean = with_stray(plain, LEVEL * 0, at_m=GRID_M)  # a point, dropped as such
    assert scene.offset_m.tolist() == clean.offset_m.tolist() == [500_005.0, 5_400_004.0, 0.0]
    assert scene.n_triangles == plain.n_triangles
    assert scene.vertices_m.tobytes() == clean.vertices_m.tobytes()
    assert (scene.report.n_stray, scene.report.n_non_finite) == (1, 0)
    assert [d for d in scene.report.dropped if "Origin {marker}, face" in d and "km away from the rest" in d]
    (warning,) = (w for w in scene.report.warnings if "away from the rest" in w)
    assert warning.endswith("1 face lies more than 20 km away from the rest and is left out: 'Origin {marker}'.")
    assert_same_floors(scene, plain)


def test_many_strays_are_dropped_in_one_warning(plain):
    scene = with_stray(plain, LEVEL, at_m=GRID_M, repeat=40)
    assert scene.report.n_stray == 40
    assert sum("40 faces lie more than 20 km away" in w for w in scene.report.warnings) == 1
    assert scene.n_triangles == plain.n_triangles


def test_part_as_large_as_the_rest_is_never_dropped(plain):
    twice = scene_from_arrays(
        np.concatenate([plain.vertices_m, moved(plain.vertices_m, 60_000.0, 0, 0)]),
        np.concatenate([plain.triangles, plain.triangles + len(plain.vertices_m)]),
    )
    assert twice.n_triangles == 2 * plain.n_triangles
    assert twice.report.n_stray == 0


def test_house_that_is_read_in_a_wrong_unit_keeps_all_its_faces(plain):
    scene = scene_from_arrays(plain.vertices_m * 1000, plain.triangles, metres_per_unit=1000.0)
    assert scene.n_triangles == plain.n_triangles
    assert scene.report.n_stray == 0


@pytest.mark.slow
@pytest.mark.parametrize("storeys", [True, False])
@pytest.mark.parametrize(
    "stray_m",
    [
        moved(LEVEL, 2000, 0, 0),
        moved(LEVEL, 2000, 1500, 2.8),
        moved(UPRIGHT, 0, -2000, 3),
        moved(LEVEL, 0, 0, 9000),
        UPRIGHT * [2000, 1, 1],
    ],
    ids=["level", "at the upper floor's height", "upright", "above", "long"],
)
def test_stray_within_reach_stays_and_spoils_no_floor(plain, stray_m, storeys):
    scene = with_stray(plain, stray_m, storeys=storeys)
    assert scene.n_triangles == plain.n_triangles + 1
    assert not scene.offset_m.any()
    assert_same_floors(scene, plain if storeys else without_storeys(plain))


def test_stray_where_no_floor_is_looked_for_is_named(plain):
    report = find_floors(with_stray(plain, moved(LEVEL, 2000, 0, 0)))
    (warning,) = report.warnings
    assert warning.endswith("faces that lie far from the rest are not searched for floors: 1 of 'Origin {marker}'")


def test_house_a_few_kilometres_from_a_stray_is_worked_on_near_the_house(plain):
    scene = with_stray(plain, LEVEL, at_m=(9000.0, 3000.0, 0.0))
    assert scene.n_triangles == plain.n_triangles + 1
    assert np.abs(scene.offset_m - [9000, 3000, 0]).max() < 20
    assert (scene.offset_m == np.round(scene.offset_m)).all()
    house_m = scene.vertices_m[scene.triangles[scene.element_of_triangle < len(plain.elements)]]
    assert np.abs(house_m).max() < FAR_ORIGIN_M


@pytest.mark.slow
def test_heights_far_apart_need_no_memory_between_them(plain):
    """Scenes made in memory may hold what loading drops."""
    stray = moved(plain.vertices_m.max(axis=0), 0, 0, 5e8)
    scene = replace(
        plain,
        storeys=(),
        vertices_m=np.concatenate([plain.vertices_m, LEVEL + stray]),
        triangles=np.concatenate([plain.triangles, [[len(plain.vertices_m) + i for i in range(3)]]]).astype(np.int32),
        element_of_triangle=np.append(plain.element_of_triangle, 0).astype(np.int32),
    )
    assert_same_floors(scene, replace(plain, storeys=()))


@pytest.mark.slow
def test_ground_area_is_the_same_by_storeys_and_by_surfaces(plain):
    by_storeys, by_surfaces = find_floors(plain).floors, find_floors(without_storeys(plain)).floors
    assert [f.origin for f in by_storeys + by_surfaces] == ["slab", "slab", "surface", "surface"]
    for a, b in zip(by_storeys, by_surfaces, strict=True):
        assert b.ground_area_m2 == pytest.approx(a.ground_area_m2, rel=0.005)
    assert [f.ground_area_m2 for f in by_surfaces] == pytest.approx([80.0, 80.0 - 3.12], rel=0.005)


def test_ground_area_holds_what_lies_under_furniture():
    """A room of 6 x 5 m, half of it under a table."""
    scene = without_storeys(rooms.box().scene)
    bare = find_floors(scene).floors[0]
    low, high = bare.bounds_m
    middle = 0.5 * (low[0] + high[0])
    board = np.array([[low[0], low[1]], [middle, low[1]], [middle, high[1]], [low[0], high[1]]])
    points = np.column_stack([board, np.full(4, 0.7)])
    n = len(scene.vertices_m)
    furnished = scene_from_arrays(
        np.concatenate([scene.vertices_m, points]),
        np.concatenate([scene.triangles, [[n, n + 1, n + 2], [n, n + 2, n + 3]]]),
    )
    assert find_floors(furnished).floors[0].ground_area_m2 == pytest.approx(bare.ground_area_m2, rel=0.005)


def test_weighted_quantile_agrees_with_repeated_values():
    rng = np.random.default_rng(3)
    values, weight = rng.normal(size=50), rng.integers(0, 5, 50)
    repeated = np.sort(np.repeat(values, weight))
    for share in (0.01, 0.25, 0.5, 0.95, 1.0):
        expected = repeated[max(int(np.ceil(share * len(repeated))) - 1, 0)]
        assert weighted_quantile(values, weight.astype(float), share) == expected
