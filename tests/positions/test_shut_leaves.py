"""Rooms of meshes behind shut door leaves: named with the leaf, its place and what to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.model import Element, PlanSettings, Scene
from planner_core.positions.free_space import free_space
from planner_core.positions.reach import reachability
from planner_core.route.unreachable import reach_warnings
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.load import LoadOptions, load_scene
from scenes_synthetic.solids import Solid, box, join
from tests.reality_files import reality

#: A hall and a small room, a wall between them with an opening of 0.9 x 2.1 m.
BUILDING = [
    box((0, 0, -0.2), (9, 5, 0)),
    box((0, 0, 2.6), (9, 5, 2.8)),
    box((0, 0, 0), (9, 0.2, 2.6)),
    box((0, 4.8, 0), (9, 5, 2.6)),
    box((0, 0.2, 0), (0.2, 4.8, 2.6)),
    box((8.8, 0.2, 0), (9, 4.8, 2.6)),
    box((6, 0.2, 0), (6.1, 2, 2.6)),
    box((6, 2.9, 0), (6.1, 4.8, 2.6)),
    box((6, 2, 2.1), (6.1, 2.9, 2.6)),
]
LEAF = box((6.03, 2, 0.005), (6.07, 2.9, 2.1))
SHEET = Solid(
    np.array([[6.05, 2, 0], [6.05, 2.9, 0], [6.05, 2.9, 2.09], [6.05, 2, 2.09]]), np.array([[0, 1, 2], [0, 2, 3]])
)


def scene_of(*closing: Solid, apart: bool = False, turn_deg: float = 0.0) -> Scene:
    """The building as one mesh, or with what closes its opening as a group of its own."""
    whole = join([*BUILDING, *closing])
    turn = np.deg2rad(turn_deg)
    about_z = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    n_walls = 12 * len(BUILDING)
    number = np.arange(len(whole.triangles)) >= n_walls
    return scene_from_arrays(
        whole.vertices_m @ about_z,
        whole.triangles,
        element_of_triangle=number.astype(int) * int(apart),
        elements=[Element("house", "Mesh", "0"), Element("Door_01", "Mesh", "1")][: 1 + apart],
    )


def sealed_lines(scene: Scene) -> tuple[str, ...]:
    survey = make_survey(scene, PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=4.0))
    return reach_warnings(survey, reachability(survey, free_space(survey)), ())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("closing", "size"), [(LEAF, "0.90 x 2.10 m"), (SHEET, "0.90 x 2.09 m")], ids=["plate", "sheet"]
)
@pytest.mark.parametrize("turn_deg", [0.0, 30.0])
def test_leaf_in_a_mesh_is_named_with_its_size_and_place(closing: Solid, size: str, turn_deg: float) -> None:
    (line,) = sealed_lines(scene_of(closing, turn_deg=turn_deg))
    turn = np.deg2rad(turn_deg)
    x, y = 6.05 * np.cos(turn) - 2.45 * np.sin(turn), 6.05 * np.sin(turn) + 2.45 * np.cos(turn)
    assert (
        f"a door leaf of {size} at ({x:.2f}, {y:.2f}), in 'house', shuts it: export the model with open doors" in line
    )
    assert "--entrance" in line and "--leave-out" not in line


def test_leaf_that_is_a_group_of_its_own_can_be_left_out() -> None:
    (line,) = sealed_lines(scene_of(LEAF, apart=True))
    assert "in 'Door_01', shuts it: export the model with open doors, leave it out (--leave-out 'name=Door_01')" in line
    assert sealed_lines(scene_of()) == ()


def test_room_that_a_wall_shuts_has_no_leaf() -> None:
    (line,) = sealed_lines(scene_of(box((6, 2, 0), (6.1, 2.9, 2.6))))
    assert line.endswith("give an entrance into it if there is one")


def test_leaves_of_a_model_in_millimetres_are_found(tmp_path: Path) -> None:
    scene = scene_of(LEAF)
    rows = ["v {:.1f} {:.1f} {:.1f}".format(*row) for row in 1000.0 * (scene.vertices_m + scene.offset_m)]
    rows += ["f {} {} {}".format(*row) for row in scene.triangles + 1]
    file = tmp_path / "house.obj"
    file.write_text("\n".join(rows))
    (line,) = sealed_lines(load_scene(file, options=LoadOptions(metres_per_unit=0.001)))
    assert "a door leaf of 0.90 x 2.10 m at (6.05, 2.45)" in line


def test_both_bedrooms_of_reality_are_named_with_their_leaves() -> None:
    file = reality("big_room_two_bedrooms_shut.obj")
    lines = sealed_lines(load_scene(file))
    assert [line.count("a door leaf of 0.90 x 2.10 m") for line in lines] == [1, 1]
    assert ["(10.05, 6.45)" in lines[0], "(10.05, 2.45)" in lines[1]] == [True, True]
