"""Floors against scenes whose levels are known by construction, and against two real buildings."""

from dataclasses import replace

import numpy as np
import pytest

from planner_core.model import Scene
from planner_core.scene.columns import sample_columns
from planner_core.scene.floors import find_floors
from scenes_synthetic import house, rooms
from tests.scene.floor_scenes import four_walls, scene_of


def keep_elements(scene: Scene, keep) -> Scene:
    kept = np.array([bool(keep(e)) for e in scene.elements])[scene.element_of_triangle]
    return replace(scene, triangles=scene.triangles[kept], element_of_triangle=scene.element_of_triangle[kept])


def ground_names(scene, floor):
    return {scene.elements[i].name for i in scene.element_of_triangle[floor.ground_triangles]}


@pytest.mark.slow
def test_floors_of_the_house_are_its_two_storeys():
    scene = house.build().scene
    report = find_floors(scene)
    assert [(f.id, f.name, f.origin) for f in report.floors] == [
        ("F0", "Ground floor", "slab"),
        ("F1", "Upper floor", "slab"),
    ]
    assert [f.elevation_m for f in report.floors] == pytest.approx([0.0, 2.8], abs=1e-6)
    assert [ground_names(scene, f) for f in report.floors] == [{"Ground slab"}, {"Upper slab"}]
    # Upper slab: 10 x 8 m less the stair opening of 1 x 3.12 m.
    assert report.floors[0].ground_area_m2 == pytest.approx(80.0, rel=0.02)
    assert report.floors[1].ground_area_m2 == pytest.approx(80.0 - 3.12, rel=0.02)


@pytest.mark.slow
def test_floors_of_the_house_without_storeys_come_from_its_surfaces():
    scene = replace(house.build().scene, storeys=())
    report = find_floors(scene)
    assert [f.origin for f in report.floors] == ["surface", "surface"]
    assert [f.elevation_m for f in report.floors] == pytest.approx([0.0, 2.8], abs=0.05)
    for floor, slab in zip(report.floors, ("Ground slab", "Upper slab"), strict=True):
        names = ground_names(scene, floor)
        assert slab in names
        assert not {"Roof", "Living room table"} & names


@pytest.mark.slow
def test_floors_do_not_depend_on_windings():
    scene = house.build().scene
    turned = scene.triangles.copy()
    turned[::2] = turned[::2, ::-1]
    one, other = find_floors(scene), find_floors(replace(scene, triangles=turned))
    for a, b in zip(one.floors, other.floors, strict=True):
        assert a.elevation_m == pytest.approx(b.elevation_m)
        assert a.ground_triangles.tolist() == b.ground_triangles.tolist()


@pytest.mark.slow
def test_floors_move_and_turn_with_the_building():
    scene = house.build().scene
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = replace(scene, vertices_m=scene.vertices_m @ turn.T + np.array([17.3, -4.1, 0.0]))
    for a, b in zip(find_floors(scene).floors, find_floors(moved).floors, strict=True):
        assert a.ground_triangles.tolist() == b.ground_triangles.tolist()
        assert a.ground_area_m2 == pytest.approx(b.ground_area_m2, rel=0.01)


@pytest.mark.slow
def test_storey_without_slab_gets_its_elevation_and_a_warning():
    scene = keep_elements(house.build().scene, lambda e: "slab" not in e.name)
    report = find_floors(scene)
    assert [(f.name, f.origin) for f in report.floors] == [
        ("Ground floor", "storey-elevation"),
        ("Upper floor", "storey-elevation"),
    ]
    assert report.floors[1].elevation_m == 2.8
    assert report.floors[0].ground_triangles.size == 0
    np.testing.assert_allclose(report.floors[0].bounds_m, [[0, 0], [10, 8]])
    named = [w for w in report.warnings if "no floor slab" in w]
    assert len(named) == 2 and "'Upper floor'" in named[1] and "2.800 m" in named[1]


def test_foundation_and_roof_top_are_left_out_with_a_reason():
    parts = [
        ("footing", "IfcFooting", 0, (0, 0, -1.2), (6, 5, -0.9)),
        *four_walls(6, 5, -0.9, -0.2, 0),
        ("ground slab", "IfcSlab", 1, (0, 0, -0.2), (6, 5, 0)),
        *four_walls(6, 5, 0, 2.6, 1),
        ("roof slab", "IfcSlab", 2, (0, 0, 2.6), (6, 5, 2.8)),
    ]
    report = find_floors(scene_of(parts, [("Foundation", -1.2), ("Ground", 0.0), ("Roof", 2.8)]))
    assert [f.name for f in report.floors] == ["Ground"]
    assert any("'Foundation' is left out" in w for w in report.warnings)
    assert any("'Roof' is left out" in w and "in the open" in w for w in report.warnings)


def test_walled_floor_without_a_roof_is_a_floor():
    parts = [("slab", "IfcSlab", 0, (0, 0, -0.2), (6, 5, 0)), *four_walls(6, 5, 0, 2.6, 0)]
    assert [f.name for f in find_floors(scene_of(parts, [("Ground", 0.0)])).floors] == ["Ground"]
    assert [f.name for f in find_floors(scene_of(parts)).floors] == ["Level 1"]


def test_ground_under_a_covering_counts_once():
    parts = [
        ("slab", "IfcSlab", 0, (0, 0, -0.2), (6, 5, 0)),
        ("tiles", "IfcCovering", 0, (0.2, 0.2, 0), (3.2, 4.8, 0.015)),
        ("flush", "IfcCovering", 0, (3.2, 0.2, -0.01), (5.8, 4.8, 0.0)),
        *four_walls(6, 5, 0, 2.6, 0),
        ("roof", "IfcSlab", 0, (0, 0, 2.6), (6, 5, 2.8)),
    ]
    (floor,) = find_floors(scene_of(parts, [("Ground", 0.0)])).floors
    assert floor.ground_area_m2 == pytest.approx(30.0, rel=0.03)


def test_split_level_is_one_floor_and_ceiling_is_none():
    parts = [
        ("low", "IfcSlab", 0, (0, 0, -0.2), (4, 5, 0)),
        ("high", "IfcSlab", 0, (4, 0, 0.4), (8, 5, 0.6)),
        *four_walls(8, 5, -0.2, 4.0, 0),
        ("ceiling", "IfcCovering", 0, (0.2, 0.2, 2.6), (7.8, 4.8, 2.62)),
        ("roof", "IfcSlab", 0, (0, 0, 4.4), (8, 5, 4.6)),
    ]
    scene = scene_of(parts, [("Ground", 0.0)])
    (floor,) = find_floors(scene).floors
    assert ground_names(scene, floor) == {"low", "high"}


def test_desks_are_no_floor_where_storeys_are_unknown():
    desks = [(f"desk {i}", "Mesh", -1, (1 + 2 * i, 1, 0.7), (2.2 + 2 * i, 4, 0.75)) for i in range(4)]
    parts = [
        ("slab", "Mesh", -1, (0, 0, -0.2), (9, 6, 0)),
        *four_walls(9, 6, 0, 3.0, -1),
        *desks,
        ("ceiling", "Mesh", -1, (0, 0, 3.0), (9, 6, 3.2)),
    ]
    scene = scene_of(parts)
    (floor,) = find_floors(scene).floors
    assert "slab" in ground_names(scene, floor)
    assert not any(name.startswith("desk") for name in ground_names(scene, floor))


@pytest.mark.slow
def test_every_triangle_counts_for_the_level_it_belongs_to():
    scene = house.build().scene
    report = find_floors(scene)
    of = report.floor_of_triangle
    centre = scene.vertices_m[scene.triangles].mean(axis=1)
    names = np.array([e.name for e in scene.elements])[scene.element_of_triangle]
    assert of.dtype == np.int32 and of.shape == (scene.n_triangles,)
    ceiling = (names == "Upper slab") & np.isclose(centre[:, 2], 2.55)
    assert ceiling.any() and (of[ceiling] == 0).all()
    assert (of[report.floors[1].ground_triangles] == 1).all()
    assert (of[(names == "Ground slab") & (centre[:, 2] < -0.2)] == -1).all()
    assert (of[names == "Roof"] == 1).all()


def test_scene_with_nothing_to_stand_on_has_no_floors():
    report = find_floors(scene_of([("pole", "Mesh", -1, (0, 0, 0), (0.2, 0.2, 4))]))
    assert report.floors == ()
    assert (report.floor_of_triangle == -1).all()
    assert any("no floor found" in w for w in report.warnings)


def test_columns_meet_triangles_where_barycentric_coordinates_say():
    rng = np.random.default_rng(5)
    corners = rng.uniform(0, 3, (40, 3, 3))
    low, step, shape = np.array([0.05, 0.02]), 0.25, (12, 11)
    got = sample_columns(corners, np.arange(40, dtype=np.int32), low_m=low, step_m=step, shape=shape)
    expected = []
    for iy in range(shape[1]):
        for ix in range(shape[0]):
            point = low + step * np.array([ix, iy])
            for number, (a, b, c) in enumerate(corners):
                weights = np.linalg.solve(np.vstack([np.array([a, b, c])[:, :2].T, np.ones(3)]), [*point, 1.0])
                if (weights >= 0).all():
                    expected.append((iy * shape[0] + ix, number, weights @ np.array([a, b, c])[:, 2]))
    found = sorted(zip(got.column.tolist(), got.triangle.tolist(), got.z_m.tolist(), strict=True))
    expected.sort()
    assert [f[:2] for f in found] == [e[:2] for e in expected]
    np.testing.assert_allclose([f[2] for f in found], [e[2] for e in expected], atol=1e-9)


def test_box_room_without_storeys_has_one_level():
    (floor,) = find_floors(replace(rooms.box().scene, storeys=())).floors
    assert floor.elevation_m == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "names", "elevations_m", "n_left_out"),
    [
        ("duplex", ["Level 1", "Level 2"], [0.0, 3.1], 2),
        ("fzk-haus", ["Erdgeschoss", "Dachgeschoss"], [0.0, 2.7], 0),
    ],
)
def test_floors_of_real_buildings_are_the_storeys_people_live_on(name, names, elevations_m, n_left_out, real_scene):
    scene = real_scene(name)
    report = find_floors(scene)
    assert [f.name for f in report.floors] == names
    assert [f.elevation_m + scene.offset_m[2] for f in report.floors] == pytest.approx(elevations_m, abs=0.01)
    assert sum("is left out" in w for w in report.warnings) == n_left_out
