"""Rooms whose ceiling the model lacks, beside a room that has one: ground of the same level at any height."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner_core.model import Scene
from planner_core.scene.floors import find_floors
from planner_core.scene.load import LoadOptions, load_scene
from tests.scene.floor_scenes import scene_of

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
