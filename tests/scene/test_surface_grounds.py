"""Floors of scenes without storeys: buildings without ground stand on the foot of their walls."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from planner_core.scene.floors import FloorReport, find_floors
from planner_core.scene.load import LoadOptions, load_scene
from tests.scene.floor_scenes import four_walls, scene_of

REALITY = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "reality"
WIDTH, DEPTH = 20.0, 12.0
ROOF = ("roof", "Mesh", 0, (-1, -1, 6.0), (WIDTH + 1, DEPTH + 1, 6.2))
GROUND = ("slab", "Mesh", 0, (0, 0, -0.2), (WIDTH, DEPTH, 0.0))
DOCK = ("dock", "Mesh", 0, (4, -4, 0.0), (12, 0, 0.16))
LEDGES = [
    ("ledge s", "Mesh", 0, (0, 0, 5.0), (WIDTH, 0.9, 5.1)),
    ("ledge n", "Mesh", 0, (0, DEPTH - 0.9, 5.0), (WIDTH, DEPTH, 5.1)),
]
WALLS = four_walls(WIDTH, DEPTH, 0.0, 6.0, 0)


def foot_of(report: FloorReport) -> list[tuple[float, str]]:
    return [(round(floor.elevation_m, 3), floor.origin) for floor in report.floors]


def test_hall_without_ground_stands_on_the_foot_of_its_walls() -> None:
    report = find_floors(scene_of([*WALLS, ROOF, DOCK, *LEDGES]))
    assert foot_of(report) == [(0.0, "wall-foot")]
    assert report.floors[0].ground_area_m2 == pytest.approx(WIDTH * DEPTH, rel=0.1)
    assert len(report.warnings) == 1
    assert "the foot of the walls, 0.000 m, is taken as the ground" in report.warnings[0]


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
    scene = scene_of([*WALLS, ROOF, DOCK])
    facets = ["solid hall"]
    for corners in (scene.vertices_m + scene.offset_m)[scene.triangles]:
        rows = "".join(" vertex {:g} {:g} {:g}".format(*row) for row in corners)
        facets.append(f"facet normal 0 0 0 outer loop{rows} endloop endfacet")
    file = tmp_path / "hall.stl"
    file.write_text("\n".join([*facets, "endsolid hall"]))
    assert foot_of(find_floors(load_scene(file))) == [(0.0, "wall-foot")]


def test_hall_of_reality_is_one_floor_at_the_foot_of_its_walls() -> None:
    file = REALITY / "hall_without_floor.obj"
    if not file.exists():
        pytest.skip("hall_without_floor.obj is not beside the repository (../shared/data/reality)")
    report = find_floors(load_scene(file))
    assert foot_of(report) == [(0.0, "wall-foot")]
    assert report.floors[0].ground_area_m2 == pytest.approx(88.0 * 60.0, rel=0.03)
