"""The paper's three buildings: sizes, areas, closed parts, what sees what; the product reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene
from scenes_synthetic import basement, school
from scenes_synthetic.model import SyntheticScene

pytestmark = pytest.mark.slow

#: From the paper's Fig. 10: triangles, and width, depth and height in metres.
PAPER = {
    "basement": (130_000, (20.0, 21.0, 4.0)),
    "school": (500_000, (44.0, 32.0, 24.0)),
    "office": (2_700_000, (16.0, 49.0, 8.0)),
}


@pytest.fixture(scope="module", params=PAPER)
def building(request: pytest.FixtureRequest, built: dict[str, SyntheticScene]) -> SyntheticScene:
    return built[request.param]


def hit_ranges_m(synthetic: SyntheticScene, origins_m: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Distance to the first surface, infinite where there is none, by Open3D."""
    import open3d as o3d

    caster = o3d.t.geometry.RaycastingScene()
    scene = synthetic.scene
    caster.add_triangles(scene.vertices_m.astype(np.float32), scene.triangles.astype(np.uint32))
    rays = np.hstack([origins_m, directions]).astype(np.float32)
    return np.asarray(caster.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy(), dtype=np.float64)


def sees(synthetic: SyntheticScene, start_m: np.ndarray, end_m: np.ndarray) -> np.ndarray:
    """Whether nothing stands between pairs of points (N, 3)."""
    way = end_m - start_m
    distance = np.linalg.norm(way, axis=1)
    return hit_ranges_m(synthetic, start_m, way / distance[:, None]) > distance - 1e-3


def test_triangle_count_is_the_papers_within_three_per_cent(building: SyntheticScene) -> None:
    wanted, _ = PAPER[building.name]
    assert building.scene.n_triangles == pytest.approx(wanted, rel=0.03)


def test_extents_are_the_papers(building: SyntheticScene) -> None:
    vertices = building.scene.vertices_m
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    np.testing.assert_allclose(high - low, PAPER[building.name][1], atol=1e-6)
    np.testing.assert_allclose([low, high], building.truth.extents_m, atol=1e-6)


def test_every_part_is_closed_and_encloses_a_volume(building: SyntheticScene) -> None:
    """Each edge is used once in either direction: closed and consistently turned. The whole mesh at once, for time."""
    scene = building.scene
    edges = scene.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    n = len(scene.vertices_m)
    forward, backward = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
    forward.sort()
    backward.sort()
    assert (np.diff(forward) > 0).all()
    np.testing.assert_array_equal(forward, backward)
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    # About the part's own corner: the sum of signed volumes is exact for closed parts only there.
    origin = np.array([part.solid.vertices_m[0] for part in building.parts])[scene.element_of_triangle]
    volume = np.einsum("ij,ij->i", a - origin, np.cross(b - origin, c - origin)) / 6
    per_part = np.bincount(scene.element_of_triangle, weights=volume)
    assert per_part.min() > 0.0


def test_no_triangle_is_degenerate(building: SyntheticScene) -> None:
    a, b, c = (building.scene.vertices_m[building.scene.triangles[:, i]] for i in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() / 2 > 1e-7


@pytest.mark.parametrize("name", PAPER)
def test_same_seed_same_bytes_and_another_seed_another_building_as_large(
    name: str, built: dict[str, SyntheticScene]
) -> None:
    again = scenes_synthetic.build(name).scene
    assert again.source.sha256 == built[name].scene.source.sha256
    other = scenes_synthetic.build(name, seed=1)
    assert other.scene.source.sha256 != again.source.sha256
    assert other.scene.n_triangles == pytest.approx(PAPER[name][0], rel=0.03)
    assert other.truth.floor_area_m2 == built[name].truth.floor_area_m2


def test_furniture_stays_in_its_room_for_any_seed() -> None:
    for name in PAPER:
        synthetic = scenes_synthetic.build(name, seed=3)
        rooms = {room.name: room for room in synthetic.rooms}
        furniture = [part for part in synthetic.parts if part.room]
        assert len(furniture) > 80
        for part in furniture:
            room, (low, high) = rooms[part.room], part.solid.bounds_m
            outline = np.asarray(room.outline_m)
            assert (low[:2] >= outline.min(axis=0) - 1e-6).all(), part.name
            assert (high[:2] <= outline.max(axis=0) + 1e-6).all(), part.name
            assert low[2] >= room.floor_m - 1e-6, part.name
            assert high[2] <= room.floor_m + room.height_m + 1e-6, part.name


def floor_area_of_slabs_m2(synthetic: SyntheticScene, storey: int) -> float:
    """Area of a storey's floor by its mesh: upward faces of its slab less what walls stand on."""
    level = synthetic.truth.storeys[storey][1]
    slab = next(
        p for p in synthetic.parts if p.kind == "IfcSlab" and p.solid.bounds_m[1, 2] == pytest.approx(level, abs=1e-9)
    )
    return top_area_m2(slab.solid.vertices_m, slab.solid.triangles, level) - sum(
        abs(top_area_m2(p.solid.vertices_m, p.solid.triangles, level, up=False))
        for p in synthetic.parts
        if p.kind == "IfcWall" and p.storey == storey and p.solid.bounds_m[0, 2] == pytest.approx(level, abs=1e-9)
    )


def top_area_m2(vertices_m: np.ndarray, triangles: np.ndarray, z_m: float, *, up: bool = True) -> float:
    """Signed area, seen from above, of the triangles in the plane z."""
    corners = vertices_m[triangles[(np.abs(vertices_m[triangles][:, :, 2] - z_m) < 1e-9).all(axis=1)]]
    normal_z = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    return float(normal_z[(normal_z > 0) == up].sum())


def test_floor_areas_are_those_of_the_mesh_less_door_sills(building: SyntheticScene) -> None:
    for storey in range(len(building.truth.storeys)):
        rooms = [room for room in building.rooms if room.storey == storey]
        sills = sum(
            float((hole.high_m[0] - hole.low_m[0]) * (hole.high_m[1] - hole.low_m[1]))
            for part in building.parts
            if part.kind == "IfcWall" and part.storey == storey and part.pierced_box
            for hole in part.pierced_box.holes
            if hole.low_m[2] == part.pierced_box.low_m[2]
        )
        truth = sum(building.truth.floor_area_m2[room.name] for room in rooms)
        assert truth == pytest.approx(floor_area_of_slabs_m2(building, storey) - sills, rel=1e-9)


def test_wall_area_of_a_class_room_is_that_of_its_plan(built: dict[str, SyntheticScene]) -> None:
    truth = built["school"].truth
    assert truth.wall_area_m2["Class 2S2"] == pytest.approx(2 * (10.65 + 8.0) * 4.0 - 3 * 2.4 * 2.2 - 2.1)
    assert truth.floor_area_m2["Gallery 0"] == pytest.approx(27.6 * 14.8)
    assert truth.floor_area_m2["Gallery 3"] == pytest.approx(27.6 * 14.8 - 18.0 * 7.6 - 1.8 * 5.0)
    assert len(truth.storeys) == 5
    assert len(built["office"].truth.storeys) == 2


def test_one_level_of_the_school_sees_the_next_through_the_void(built: dict[str, SyntheticScene]) -> None:
    synthetic = built["school"]
    (x0, y0), (x1, y1) = school.VOID_M
    middle = np.array([(x0 + x1) / 2 + 0.3, (y0 + y1) / 2])
    top = synthetic.truth.extents_m[1, 2]
    down = hit_ranges_m(synthetic, np.array([[*middle, top - 0.35]]), np.array([[0.0, 0.0, -1.0]]))
    assert down[0] == pytest.approx(top - 0.35, abs=1e-3)  # from under the lantern to the ground floor
    for storey in range(4):
        eye = np.array([[x, y0 - 1.0, 4.4 * storey + 1.7] for x in np.linspace(x0 + 2, x1 - 2, 30)])
        across = np.array([[x, y1 + 1.2, 4.4 * (storey + 1) + 2.6] for x in np.linspace(x0 + 2, x1 - 2, 30)])
        assert sees(synthetic, eye, across).mean() > 0.5


def test_enclosed_rooms_of_the_basement_are_seen_from_no_other_room(built: dict[str, SyntheticScene]) -> None:
    synthetic = built["basement"]
    rng = np.random.default_rng(5)
    spots, owner = [], []
    for i, room in enumerate(synthetic.rooms):
        outline = np.asarray(room.outline_m)
        flat = rng.uniform(outline.min(axis=0) + 0.1, outline.max(axis=0) - 0.1, size=(60, 2))
        spots.append(np.column_stack([flat, rng.uniform(0.1, 3.3, size=60)]))
        owner += [i] * 60
    points, owners = np.concatenate(spots), np.array(owner)
    pairs = rng.integers(len(points), size=(40_000, 2))
    pairs = pairs[owners[pairs[:, 0]] != owners[pairs[:, 1]]]
    seen = sees(synthetic, points[pairs[:, 0]], points[pairs[:, 1]])
    closed = np.array([room.name in basement.ENCLOSED for room in synthetic.rooms])
    touches_closed = closed[owners[pairs]].any(axis=1)
    # Doors have gaps of a centimetre beside their leaf; one pair of points in some ten thousand looks through.
    assert (seen & touches_closed).sum() < 1e-3 * touches_closed.sum()
    shaft = [room.name for room in synthetic.rooms].index("Shaft")
    assert not (seen & (owners[pairs] == shaft).any(axis=1)).any()  # it has no door
    assert (seen & ~touches_closed).sum() > 20  # hall and corridor through their doorway


@pytest.mark.parametrize("name", ["basement", "school"])  # the office's 2.7 million triangles take seconds
def test_floors_are_found_at_every_storey(name: str, built: dict[str, SyntheticScene]) -> None:
    found = find_floors(built[name].scene)
    assert [floor.elevation_m for floor in found.floors] == pytest.approx(
        [elevation for _, elevation in built[name].truth.storeys], abs=0.02
    )
    assert found.warnings == ()


@pytest.mark.parametrize(("name", "suffix"), [("basement", ".obj"), ("basement", ".glb"), ("school", ".ply")])
def test_product_loads_what_was_written(
    name: str, suffix: str, built: dict[str, SyntheticScene], tmp_path: Path
) -> None:
    scene = load_scene(scenes_synthetic.write(built[name], tmp_path / f"{name}{suffix}"))
    assert scene.n_triangles == built[name].scene.n_triangles
    assert scene.report.warnings == ()
    assert scene.report.n_degenerate == scene.report.n_duplicate == 0
    extents = [scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)]
    np.testing.assert_allclose(extents, built[name].truth.extents_m, atol=1e-5)


@pytest.mark.parametrize("name", PAPER)
def test_hand_rails_stand_on_treads_of_their_flight(name: str, built: dict[str, SyntheticScene]) -> None:
    synthetic = built[name]
    rails = [part for part in synthetic.parts if part.name.startswith("Stair rail")]
    assert len(rails) == {"basement": 1, "school": 8, "office": 1}[name]
    for rail in rails:
        flight = next(p for p in synthetic.parts if p.kind == "IfcStair" and p.storey == rail.storey)
        (low, high), (low_s, high_s) = rail.solid.bounds_m, flight.solid.bounds_m
        assert low_s[0] < low[0] < high[0] < high_s[0]
        corners = flight.solid.vertices_m[flight.solid.triangles]
        treads = corners[(np.ptp(corners[:, :, 2], axis=1) < 1e-9)]
        feet = rail.solid.vertices_m[np.isin(np.round(rail.solid.vertices_m[:, 2], 5), np.round(treads[:, 0, 2], 5))]
        assert len(feet) >= 3 * 6  # on three or more treads
        for x, y, z in feet:
            under = treads[np.abs(treads[:, 0, 2] - z) < 1e-5]
            assert under[:, :, 1].min() < y < under[:, :, 1].max(), f"{rail.name} at {x:.2f}, {y:.2f}, {z:.2f}"


def test_pipes_run_into_boilers_and_ducts_end_on_air_handlers(built: dict[str, SyntheticScene]) -> None:
    parts = built["basement"].parts
    boilers = [p.solid.bounds_m for p in parts if p.kind == "IfcBoiler"]
    pipes = [p.solid.vertices_m for p in parts if p.name.startswith("Heating pipe")]
    mouths = np.array([pipe[pipe[:, 0] > pipe[:, 0].max() - 1e-6].mean(axis=0) for pipe in pipes])
    assert len(boilers) == 2
    for low, high in boilers:
        assert ((low < mouths) & (mouths < high)).all(axis=1).sum() == 2
    handlers = [p.solid.bounds_m for p in parts if "air handler" in p.name]
    ducts = [p.solid.vertices_m for p in parts if p.name in ("Duct 1", "Duct 2")]
    for (low, high), duct in zip(handlers, ducts, strict=True):
        end = duct[duct[:, 2] < duct[:, 2].min() + 1e-6]
        assert (low[:2] < end[:, :2]).all() and (end[:, :2] < high[:2]).all()
        assert end[0, 2] == pytest.approx(high[2], abs=1e-6)
