"""Rooms and solids by what an element encloses in plan: the filled area of sections, by rings and by cells."""

from __future__ import annotations

import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.export.floor_outlines import solid_rings
from planner_core.export.polylines import doubled_area_m2
from planner_core.export.section import floor_section
from planner_core.model import Element, Floor, PlanSettings, Scene
from planner_core.plan_folder.section_view import camera_at, inside_solid, solid_cells, view_section
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene
from scenes_synthetic.solids import Solid, box, join
from tests.reality_files import reality

BOTTOM, TOP, SIDES = "bottom", "top", "sides"


def faces(solid: Solid, *which: str) -> Solid:
    """Some faces of a box alone: sheets."""
    z_m = solid.vertices_m[solid.triangles][:, :, 2]
    low, high = solid.bounds_m[:, 2]
    side = np.where((z_m == low).all(axis=1), BOTTOM, np.where((z_m == high).all(axis=1), TOP, SIDES))
    return Solid(solid.vertices_m, solid.triangles[np.isin(side, which)])


def scene_of(parts: dict[str, Solid], *, turn_deg: float = 0.0, metres_per_unit: float = 1.0) -> Scene:
    whole = join(list(parts.values()))
    turn = np.deg2rad(turn_deg)
    about_z = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    return scene_from_arrays(
        whole.vertices_m @ about_z / metres_per_unit,
        whole.triangles,
        element_of_triangle=np.repeat(np.arange(len(parts)), [len(part.triangles) for part in parts.values()]),
        elements=[Element(name, "Mesh", name) for name in parts],
        metres_per_unit=metres_per_unit,
    )


ROOM = box((0, 0, 0), (6, 4, 3))
SLAB = box((-1, -1, -0.2), (9, 7, 0))
CEILING = box((-1, -1, 3), (9, 7, 3.2))
WALL = box((0, 0, 0), (6, 0.3, 3))
HALL = box((-1, -1, -0.5), (9, 7, 3.2))

#: Elements, and the area in m2 that is solid in the cut at 1.2 m.
FORMS: dict[str, tuple[dict[str, Solid], float]] = {
    "walls, floor and ceiling apart": (
        {"walls": faces(ROOM, SIDES), "floor": faces(ROOM, BOTTOM), "ceiling": faces(ROOM, TOP)},
        0.0,
    ),
    "walls with their ceiling": ({"walls": faces(ROOM, SIDES, TOP), "floor": faces(ROOM, BOTTOM)}, 0.0),
    "walls with their floor": ({"walls": faces(ROOM, SIDES, BOTTOM), "ceiling": faces(ROOM, TOP)}, 0.0),
    "one shell": ({"shell": ROOM}, 0.0),
    "sheets through two storeys": (
        {"walls": faces(box((0, 0, 0), (6, 4, 6)), SIDES), "slab": SLAB, "ceiling": CEILING},
        0.0,
    ),
    "furniture on the floor of sheets": (
        {"walls": faces(ROOM, SIDES), "slab": SLAB, "ceiling": CEILING, "table": box((1, 1, 0), (3, 3, 0.7))},
        0.0,
    ),
    "a closed hull around a floor": (
        {"hull": HALL, "floor": box((-0.9, -0.9, -0.2), (8.9, 6.9, 0)), "wall": WALL},
        6 * 0.3,
    ),
    "walls of two sheets without ends": (
        {"wall": faces(WALL, SIDES), "slab": SLAB, "ceiling": CEILING},
        6 * 0.3,
    ),
    "a pillar on the ground": ({"pillar": box((1, 1, 0), (2, 2, 3)), "slab": SLAB, "ceiling": CEILING}, 1.0),
    "a pillar through the slab": ({"pillar": box((1, 1, -3), (2, 2, 3)), "slab": SLAB, "ceiling": CEILING}, 1.0),
    "a tank on the ground": ({"tank": box((1, 1, 0), (5, 5, 2)), "slab": SLAB, "ceiling": CEILING}, 16.0),
}


@pytest.mark.parametrize("turn_deg", [0.0, pytest.param(30.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("form", FORMS)
def test_rooms_are_left_blank_and_solids_filled(form: str, turn_deg: float) -> None:
    parts, solid_m2 = FORMS[form]
    check_filled(scene_of(parts, turn_deg=turn_deg), solid_m2)


@pytest.mark.slow
@pytest.mark.parametrize("metres_per_unit", [0.001, 0.3048])
def test_rooms_of_sheets_are_left_blank_in_other_units(metres_per_unit: float) -> None:
    parts, solid_m2 = FORMS["walls, floor and ceiling apart"]
    check_filled(scene_of(parts, metres_per_unit=metres_per_unit), solid_m2)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["walls_floor_ceiling_apart.obj", "interior_shell.obj", "gallery_reduced.glb"])
def test_rooms_of_real_meshes_are_left_blank(name: str) -> None:
    scene = load_scene(reality(name))
    # The gallery's walls take 3 m2 of 306; its smallest room has 50.
    assert max(filled_m2(scene)) < 0.02 * find_floors(scene).floors[0].ground_area_m2


def check_filled(scene: Scene, solid_m2: float) -> None:
    for found_m2 in filled_m2(scene):
        assert found_m2 == pytest.approx(solid_m2, rel=0.1)


def filled_m2(scene: Scene) -> tuple[float, float, float]:
    """Solid area of rings, of cells from above and of a view from aside."""
    floor = find_floors(scene).floors[0]
    cut_m = floor.elevation_m + 1.2
    window_m = floor.bounds_m + np.array([[-0.5], [0.5]])
    filled = solid_rings(scene, floor, floor_section(scene, floor), cut_m=1.2)
    rings_m2 = sum(abs(sum(doubled_area_m2(ring) for ring in rings)) / 2 for rings in filled)
    survey = make_survey(scene, PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=4.0))
    cells, cell_m = solid_cells(survey, floor=floor, cut_m=cut_m, window_m=window_m, width=500)
    return rings_m2, float(cells.sum() * cell_m**2), aside_m2(scene, floor, cut_m)


def aside_m2(scene: Scene, floor: Floor, cut_m: float) -> float:
    """Area in plan of the solid pixels of a view from a corner."""
    survey = make_survey(scene, PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=4.0))
    camera = camera_at(azimuth_rad=np.deg2rad(62.0), elevation_rad=np.deg2rad(48.0))
    corners = np.array([[x, y, cut_m] for x in floor.bounds_m[:, 0] for y in floor.bounds_m[:, 1]])
    seen = camera.project(corners)
    view = view_section(
        survey,
        open_engine(scene, survey.patches),
        camera,
        ground_m=floor.elevation_m,
        cut_m=cut_m,
        window_m=np.stack([seen.min(axis=0), seen.max(axis=0)]),
        width=500,
    )
    return float(inside_solid(survey, view, floor).sum() * view.pixel_m**2 / np.sin(np.deg2rad(48.0)))
