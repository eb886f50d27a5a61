"""Floors of scenes without storeys: buildings without ground stand on the foot of their walls.

Rooms whose ceiling the model lacks, beside a room that has one: ground of the same level at any height.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner_core.model import Scene, UpAxis
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.floors import FloorReport, find_floors, ground_levels
from planner_core.scene.load import LoadOptions, load_scene
from tests.reality_files import reality
from tests.scene.floor_scenes import four_walls, scene_of

WIDTH, DEPTH = 20.0, 12.0
ROOF = ("roof", "Mesh", 0, (-1, -1, 6.0), (WIDTH + 1, DEPTH + 1, 6.2))
GROUND = ("slab", "Mesh", 0, (0, 0, -0.2), (WIDTH, DEPTH, 0.0))
DOCK = ("dock", "Mesh", 0, (4, -4, 0.0), (12, 0, 0.16))
LEDGES = [
    ("ledge s", "Mesh", 0, (0, 0, 5.0), (WIDTH, 0.9, 5.1)),
    ("ledge n", "Mesh", 0, (0, DEPTH - 0.9, 5.0), (WIDTH, DEPTH, 5.1)),
]
WALLS = four_walls(WIDTH, DEPTH, 0.0, 6.0, 0)
# ------------------------------------------------------------------------------------- walls and nothing else
#: Rooms of a robot's map, its walls raised to 2.5 m: two doorways, and a shaft that is filled.
RAISED = [
    *four_walls(9.0, 7.0, 0.0, 2.5, 0),
    ("across", "Mesh", 0, (0.2, 3.4, 0), (3.5, 3.6, 2.5)),
    ("across 2", "Mesh", 0, (4.5, 3.4, 0), (8.8, 3.6, 2.5)),
    ("along", "Mesh", 0, (5, 0.2, 0), (5.2, 2.4, 2.5)),
    ("shaft", "Mesh", 0, (7, 5, 0), (8.8, 6.8, 2.5)),
]
RAMPS = [(0, 0), (20, 0), (45, -1), (60, -1), (160, -4.2), (180, -4.2)]
#: A room of 6 x 5 m with a ceiling, and one of 5 x 5 m without, east of it; a doorway of 1 m joins them.
COVERED_M2, ROOFLESS_M2 = 30.0, 25.0
COVERED = [
    ("floor", "Mesh", 0, (0, 0, -0.2), (6, 5, 0)),
    ("ceiling", "Mesh", 0, (0, 0, 2.6), (6, 5, 2.8)),
    ("west", "Mesh", 0, (-0.2, -0.2, -0.6), (0, 5.2, 2.8)),
    ("south", "Mesh", 0, (0, -0.2, -0.6), (6, 0, 2.8)),
    ("north", "Mesh", 0, (0, 5, -0.6), (6, 5.2, 2.8)),
    ("between, south", "Mesh", 0, (6, -0.2, -2), (6.2, 2, 2.8)),
    ("between, north", "Mesh", 0, (6, 3, -2), (6.2, 5.2, 2.8)),
]


def foot_of(report: FloorReport) -> list[tuple[float, str]]:
    return [(round(floor.elevation_m, 3), floor.origin) for floor in report.floors]


def test_hall_without_ground_stands_on_the_foot_of_its_walls() -> None:
    report = find_floors(scene_of([*WALLS, ROOF, DOCK, *LEDGES]))
    assert foot_of(report) == [(0.0, "wall-foot")]
    assert report.floors[0].ground_area_m2 == pytest.approx(WIDTH * DEPTH, rel=0.1)
    assert len(report.warnings) == 1
    assert "the foot of the walls, 0.000 m, is taken as the ground" in report.warnings[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "ground",
    [
        [GROUND],
        [("half", "Mesh", 0, (0, 0, -0.2), (0.7 * WIDTH, DEPTH, 0.0))],
        [("sunk", "Mesh", 0, (0, 0, 0.5), (WIDTH, DEPTH, 0.7))],
    ],
    ids=["whole", "a part without", "above footings"],
)
def test_hall_with_ground_keeps_it(ground: list[tuple]) -> None:
    report = find_floors(scene_of([*WALLS, ROOF, *ground]))
    assert {floor.origin for floor in report.floors} == {"surface"}
    assert report.warnings == ()


def test_upper_floor_stays_over_a_ground_floor_without_slab() -> None:
    upper = ("upper slab", "Mesh", 0, (0, 0, 2.8), (WIDTH, DEPTH, 3.0))
    assert foot_of(find_floors(scene_of([*WALLS, ROOF, upper]))) == [(0.0, "wall-foot"), (3.0, "surface")]


def test_walls_and_roof_of_single_sheets_have_a_foot_too() -> None:
    hall = scene_of([*WALLS, ROOF])
    z_m = hall.vertices_m[hall.triangles][:, :, 2]
    # Without the walls' bottoms, as programs for rendering leave them out.
    kept = ~(z_m == 0.0).all(axis=1)
    sheets = replace(hall, triangles=hall.triangles[kept], element_of_triangle=hall.element_of_triangle[kept])
    assert foot_of(find_floors(sheets)) == [(0.0, "wall-foot")]


@pytest.mark.parametrize("metres_per_unit", [0.001, 0.3048])
def test_hall_without_ground_in_an_obj_of_other_units(metres_per_unit: float, tmp_path: Path) -> None:
    scene = scene_of([*WALLS, ROOF, DOCK])
    rows = ["v {:.6f} {:.6f} {:.6f}".format(*row) for row in ((scene.vertices_m + scene.offset_m) / metres_per_unit)]
    rows += ["f {} {} {}".format(*row) for row in scene.triangles + 1]
    file = tmp_path / "hall.obj"
    file.write_text("\n".join(rows))
    report = find_floors(load_scene(file, options=LoadOptions(metres_per_unit=metres_per_unit)))
    assert foot_of(report) == [(0.0, "wall-foot")]


def test_hall_without_ground_in_an_stl(tmp_path: Path) -> None:
    file = tmp_path / "hall.stl"
    stl_of(scene_of([*WALLS, ROOF, DOCK]), file, 1.0)
    assert foot_of(find_floors(load_scene(file))) == [(0.0, "wall-foot")]


def stl_of(scene: Scene, file: Path, metres_per_unit: float) -> None:
    facets = ["solid scene"]
    for corners in (scene.vertices_m + scene.offset_m)[scene.triangles] / metres_per_unit:
        rows = "".join(" vertex {:.4f} {:.4f} {:.4f}".format(*row) for row in corners)
        facets.append(f"facet normal 0 0 0 outer loop{rows} endloop endfacet")
    file.write_text("\n".join([*facets, "endsolid scene"]))


@pytest.mark.parametrize("metres_per_unit", [1.0, 0.001, 0.0254])
def test_undersides_of_walls_in_an_stl_are_no_ground(metres_per_unit: float, tmp_path: Path) -> None:
    file = tmp_path / "map.stl"
    stl_of(scene_of(RAISED), file, metres_per_unit)
    report = find_floors(load_scene(file, options=LoadOptions(metres_per_unit=metres_per_unit)))
    assert foot_of(report) == [(0.0, "wall-foot")]
    assert report.floors[0].ground_area_m2 == pytest.approx(9 * 7 - 1.8 * 1.8, rel=0.05)
    (line,) = report.warnings
    assert "the walls have neither ground nor roof; the foot of the walls, 0.000 m, is taken as the ground" in line


@pytest.mark.parametrize("thickness_m", [0.1, 0.5], ids=["partitions", "of a castle"])
def test_walls_of_any_thickness_are_no_ground(thickness_m: float) -> None:
    walls = [
        ("w", "Mesh", 0, (0, 0, 0), (thickness_m, 8, 3)), ("e", "Mesh", 0, (10 - thickness_m, 0, 0), (10, 8, 3)),
        ("s", "Mesh", 0, (0, 0, 0), (10, thickness_m, 3)), ("n", "Mesh", 0, (0, 8 - thickness_m, 0), (10, 8, 3)),
    ]  # fmt: skip
    assert foot_of(find_floors(scene_of(walls))) == [(0.0, "wall-foot")]


def test_walls_drawn_as_single_sheets_enclose_ground() -> None:
    plan = [(0, 0), (8, 0), (8, 6), (0, 6), (0, 0)]
    rows = np.array([(x, y, z) for x, y in plan for z in (0.0, 2.6)], dtype=float)
    triangles = [t for k in range(4) for t in ((2 * k, 2 * k + 2, 2 * k + 3), (2 * k, 2 * k + 3, 2 * k + 1))]
    report = find_floors(scene_from_arrays(rows, triangles))
    assert foot_of(report) == [(0.0, "wall-foot")]
    assert report.floors[0].ground_area_m2 == pytest.approx(48.0, rel=0.05)


def test_walls_that_enclose_nothing_have_one_line_and_no_floor() -> None:
    walls = [("a", "Mesh", 0, (0, 0, 0), (8, 0.3, 3)), ("b", "Mesh", 0, (0, 6, 0), (8, 6.3, 3))]
    report = find_floors(scene_of(walls))
    assert report.floors == ()
    assert any("5 m2 of level surface at 0.000 m are no floor: most of them are narrower" in w for w in report.warnings)


def test_courtyard_without_ground_leaves_the_house_its_own() -> None:
    wings = [((0, 0), (14, 3)), ((0, 11), (14, 14)), ((0, 3), (3, 11)), ((11, 3), (14, 11))]
    slabs = [(f"slab {k}", "Mesh", 0, (*a, -0.2), (*b, 0)) for k, (a, b) in enumerate(wings)]
    roofs = [(f"roof {k}", "Mesh", 0, (*a, 2.6), (*b, 2.8)) for k, (a, b) in enumerate(wings)]
    court = [
        (f"court {k}", "Mesh", 0, (*a, 0), (*b, 2.6))
        for k, (a, b) in enumerate(
            [((3, 2.8), (11, 3)), ((3, 11), (11, 11.2)), ((2.8, 3), (3, 11)), ((11, 3), (11.2, 11))]
        )
    ]
    report = find_floors(scene_of([*slabs, *roofs, *court, *four_walls(14, 14, 0, 2.6, 0)]))
    assert foot_of(report) == [(0.0, "surface")] and report.warnings == ()


@pytest.mark.slow
def test_hall_of_reality_is_one_floor_at_the_foot_of_its_walls() -> None:
    file = reality("hall_without_floor.obj")
    report = find_floors(load_scene(file))
    assert foot_of(report) == [(0.0, "wall-foot")]
    assert report.floors[0].ground_area_m2 == pytest.approx(88.0 * 60.0, rel=0.03)


# --------------------------------------------------------------------------------------------------- slopes
def strip(profile: list[tuple[float, float]], width_m: float, clear_m: float, *, roof: bool = True) -> Scene:
    """A passage along x whose ground follows heights (x, z), between walls and under a ceiling of single sheets."""
    rows = np.array([(x, y, z + up) for x, z in profile for y in (0.0, width_m) for up in (0.0, clear_m)])
    quads = [(0, 2), (0, 1), (2, 3)] + ([(1, 3)] if roof else [])
    corners = [(4 * k + a, 4 * k + b, 4 * k + b + 4, 4 * k + a + 4) for k in range(len(profile) - 1) for a, b in quads]
    triangles = [t for a, b, c, d in corners for t in ((a, b, c), (a, c, d))]
    return scene_from_arrays(rows, triangles)


@pytest.mark.slow
@pytest.mark.parametrize("roof", [True, False], ids=["roofed", "open"])
@pytest.mark.parametrize(
    "profile",
    [RAMPS, [(0, 0), (60, 6)], [(5 * k, 3 * np.sin(0.2 * k)) for k in range(25)]],
    ids=["ramps", "a slope", "a hill"],
)
def test_surface_that_is_walked_is_one_floor(profile: list[tuple[float, float]], roof: bool) -> None:
    report = find_floors(strip(profile, 2.6, 2.4, roof=roof))
    (floor,) = report.floors
    assert floor.ground_area_m2 == pytest.approx(2.6 * profile[-1][0], rel=0.03)
    assert set(report.floor_of_triangle.tolist()) == {0}


def test_storeys_that_stairs_join_stay_two() -> None:
    slabs = [("slab 0", "Mesh", 0, (0, 0, -0.2), (12, 8, 0)), ("slab 1", "Mesh", 0, (0, 0, 2.7), (12, 6.5, 2.9))]
    steps = [(f"tread {k}", "Mesh", 0, (0.3 * k, 6.6, 0), (0.3 * k + 0.3, 7.8, 0.18 * k + 0.2)) for k in range(15)]
    roof = ("roof", "Mesh", 0, (0, 0, 5.8), (12, 8, 6.0))
    report = find_floors(scene_of([*slabs, *steps, *four_walls(12, 8, 0, 5.8, 0), roof]))
    assert [floor.elevation_m for floor in report.floors] == pytest.approx([0.0, 2.9])


@pytest.mark.slow
def test_decks_of_a_car_park_over_each_other_stay_two() -> None:
    deck, up = strip([(0, 0), (40, 0)], 16.0, 6.0), strip([(0, 3.0), (10, 3.0), (40, 3.0)], 13.0, 0.1)
    ramp = strip([(10, 0.0), (37, 3.0)], 3.0, 0.05, roof=False)
    parts = [(deck, (0, 0)), (up, (0, 0)), (ramp, (0, 13.0))]
    vertices = np.concatenate([scene.vertices_m + scene.offset_m + [*at, 0.0] for scene, at in parts])
    starts = np.cumsum([0, *(len(scene.vertices_m) for scene, _ in parts)])
    triangles = np.concatenate([scene.triangles + start for (scene, _), start in zip(parts, starts, strict=False)])
    heights_m = [floor.elevation_m for floor in find_floors(scene_from_arrays(vertices, triangles)).floors]
    assert heights_m == pytest.approx([0.0, 3.1], abs=0.1)


def test_bands_of_a_slope_cover_it_once_each_at_its_height() -> None:
    scene = strip(RAMPS, 2.6, 2.4)
    floor = find_floors(scene).floors[0]
    bands = ground_levels(scene, floor)
    area_m2 = [_area_m2(corners_m[:, :, :2]) for _, corners_m in bands]
    assert len(bands) == 6 and sum(area_m2) == pytest.approx(2.6 * 180, rel=1e-6)
    assert max(np.abs(corners_m[:, :, 2] - height_m).max() for height_m, corners_m in bands) <= 0.5 * 4.2 / 6 + 1e-9


def _area_m2(plan_m: np.ndarray) -> float:
    a, b = plan_m[:, 1] - plan_m[:, 0], plan_m[:, 2] - plan_m[:, 0]
    return float(0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def test_ramps_of_reality_are_one_floor() -> None:
    file = reality("ramp_corridor.obj")
    (floor,) = find_floors(load_scene(file, options=LoadOptions(up_axis=UpAxis.Z))).floors
    assert floor.ground_area_m2 == pytest.approx(2.6 * 180, rel=0.01)


def walls_of_roofless(z: float, *, window: bool = False) -> list[tuple]:
    """Three walls of the second room; with a window of 2 m, without glass, in the eastern one."""
    y = [(-0.2, 1.0), (3.0, 5.2)] if window else [(-0.2, 5.2)]
    east = [(f"east {k}", "Mesh", 0, (11.2, low, z), (11.4, high, z + 2.7)) for k, (low, high) in enumerate(y)]
    sides = [
        ("rs", "Mesh", 0, (6.2, -0.2, z), (11.2, 0, z + 2.7)),
        ("rn", "Mesh", 0, (6.2, 5, z), (11.2, 5.2, z + 2.7)),
    ]
    return [*east, *sides]


def floor_at(z: float, *, x: tuple[float, float] = (6.2, 11.2), y: tuple[float, float] = (0, 5)) -> tuple:
    return ("open floor", "Mesh", 0, (x[0], y[0], z - 0.15), (x[1], y[1], z))


def ground_m2(scene: Scene) -> float:
    (floor,) = find_floors(scene).floors
    return floor.ground_area_m2


@pytest.mark.parametrize("z", [-1.5, -0.3, 0.0, 0.17, 0.6, 1.5])
def test_room_without_ceiling_at_another_height_is_ground_of_its_level(z: float) -> None:
    scene = scene_of([*COVERED, floor_at(z), *walls_of_roofless(z)])
    report = find_floors(scene)
    assert [floor.ground_area_m2 for floor in report.floors] == pytest.approx([COVERED_M2 + ROOFLESS_M2], rel=0.08)
    assert report.warnings == ()


def test_room_without_ceiling_and_without_window_panes_is_ground() -> None:
    scene = scene_of([*COVERED, floor_at(0.3), *walls_of_roofless(0.3, window=True)])
    assert ground_m2(scene) == pytest.approx(COVERED_M2 + ROOFLESS_M2, rel=0.08)


def test_pit_in_a_room_without_ceiling_is_ground() -> None:
    around = [
        floor_at(0.3, x=(6.2, 8.5)),
        floor_at(0.3, x=(8.5, 11.2), y=(0, 2)),
        floor_at(0.3, x=(8.5, 11.2), y=(4, 5)),
    ]
    pit = floor_at(-0.9, x=(8.5, 11.2), y=(2, 4))
    scene = scene_of([*COVERED, *around, pit, *walls_of_roofless(0.15)])
    assert ground_m2(scene) == pytest.approx(COVERED_M2 + ROOFLESS_M2, rel=0.08)


@pytest.mark.parametrize("has_floor_below", [True, False], ids=["on its floor", "fused with the floor"])
def test_bed_in_a_room_without_ceiling_is_no_ground(has_floor_below: bool) -> None:
    bed = ("bed", "Mesh", 0, (9.2, 3.4, 0.25), (11.2, 5, 0.7))
    floor = (
        [floor_at(0.2)] if has_floor_below else [floor_at(0.2, x=(6.2, 9.2)), floor_at(0.2, x=(9.2, 11.2), y=(0, 3.4))]
    )
    without = ROOFLESS_M2 - (0 if has_floor_below else 2.0 * 1.6)
    scene = scene_of([*COVERED, *floor, bed, *walls_of_roofless(0.2)])
    report = find_floors(scene)
    assert report.floors[0].ground_area_m2 == pytest.approx(COVERED_M2 + without, rel=0.03)
    heights_m = scene.vertices_m[:, 2][scene.triangles[report.floors[0].ground_triangles]]
    assert heights_m.max() == pytest.approx(0.2) and report.warnings == ()


def test_roof_terrace_beside_an_attic_is_no_ground() -> None:
    parapet = [
        ("ps", "Mesh", 0, (6.2, -0.2, -0.3), (11.4, 0, 0.7)),
        ("pn", "Mesh", 0, (6.2, 5, -0.3), (11.4, 5.2, 0.7)),
        ("pe", "Mesh", 0, (11.2, 0, -0.3), (11.4, 5, 0.7)),
    ]
    report = find_floors(scene_of([*COVERED, floor_at(-0.3), *parapet]))
    assert report.floors[0].ground_area_m2 == pytest.approx(COVERED_M2, rel=0.03)
    assert report.warnings == ()


def test_garden_behind_a_room_without_ceiling_is_no_ground() -> None:
    walls = [part for part in walls_of_roofless(0.2) if not part[0].startswith("east")]
    east = [("es", "Mesh", 0, (11.2, -0.2, 0), (11.4, 2, 2.9)), ("en", "Mesh", 0, (11.2, 3, 0), (11.4, 5.2, 2.9))]
    garden = floor_at(0.2, x=(11.2, 25), y=(-10, 15))
    report = find_floors(scene_of([*COVERED, floor_at(0.2), garden, *walls, *east]))
    assert report.floors[0].ground_area_m2 == pytest.approx(COVERED_M2 + ROOFLESS_M2, rel=0.08)
    assert report.warnings == ()


def test_ground_with_walls_on_three_sides_has_a_line_with_its_place() -> None:
    walls = [part for part in walls_of_roofless(0.3) if not part[0].startswith("east")]
    report = find_floors(scene_of([*COVERED, floor_at(0.3), *walls]))
    assert report.floors[0].ground_area_m2 == pytest.approx(COVERED_M2, rel=0.03)
    (line,) = report.warnings
    assert "beside 'Level 1'" in line and "24 m2 about (8.7, 2.5), 0.30 m above it" in line
    assert "docs/howto/pick-ground.md" in line


@pytest.mark.parametrize("metres_per_unit", [1.0, 0.001, 0.0254])
def test_two_scans_joined_in_an_obj_are_one_level(metres_per_unit: float, tmp_path: Path) -> None:
    scene = scene_of([*COVERED, floor_at(0.17), *walls_of_roofless(0.17)])
    z_m = scene.vertices_m[:, 2][scene.triangles]
    sheets = ~((z_m == -0.2).all(axis=1) | (z_m == 2.8).all(axis=1))  # as scans have them: no undersides, no roof
    scene = replace(scene, triangles=scene.triangles[sheets], element_of_triangle=scene.element_of_triangle[sheets])
    rows = ["v {:.6f} {:.6f} {:.6f}".format(*row) for row in (scene.vertices_m + scene.offset_m) / metres_per_unit]
    rows += ["f {} {} {}".format(*row) for row in scene.triangles + 1]
    file = tmp_path / "two.obj"
    file.write_text("\n".join(rows))
    loaded = load_scene(file, options=LoadOptions(metres_per_unit=metres_per_unit))
    assert ground_m2(loaded) == pytest.approx(COVERED_M2 + ROOFLESS_M2, rel=0.08)


def test_room_without_ceiling_is_ground_wherever_the_house_stands() -> None:
    scene = scene_of([*COVERED, floor_at(0.17), *walls_of_roofless(0.17)])
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(scene, vertices_m=scene.vertices_m @ turn.T)
    assert ground_m2(turned) == pytest.approx(COVERED_M2 + ROOFLESS_M2, rel=0.08)
