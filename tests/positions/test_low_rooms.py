"""Rooms too low for the usual instrument height: the tripod is lowered where it must be, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import PlanSettings, Scene, Site
from planner_core.planning.plan import make_plan
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import AllowedPositions, find_positions
from planner_core.positions.local_site import local_site
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.load import load_scene
from scenes_synthetic.solids import Solid, box, join
from tests.reality_files import reality

SCANNER = load_scanner("rtc360")  # 1.4 to 1.8 m, usually 1.7


def scene_of(*parts: Solid) -> Scene:
    whole = join(list(parts))
    return scene_from_arrays(whole.vertices_m, whole.triangles)


def hall(height_m: float, *inside: Solid) -> Scene:
    """A hall of 9 x 4 m and a height, with things in it."""
    walls = [
        box((0, 0, 0), (9, 0.2, height_m)),
        box((0, 3.8, 0), (9, 4, height_m)),
        box((0, 0.2, 0), (0.2, 3.8, height_m)),
        box((8.8, 0.2, 0), (9, 3.8, height_m)),
    ]
    return scene_of(box((0, 0, -0.2), (9, 4, 0)), box((0, 0, height_m), (9, 4, height_m + 0.2)), *walls, *inside)


#: A wall across the hall with a doorway of 0.9 x 1.9 m, and a low ceiling east of it.
DOOR_WALL = [box((4, 0.2, 0), (4.1, 1.5, 2.6)), box((4, 2.4, 0), (4.1, 3.8, 2.6)), box((4, 1.5, 1.9), (4.1, 2.4, 2.6))]
LOW_CEILING = box((4.1, 0.2, 1.9), (8.8, 3.8, 2.0))


def found_in(scene: Scene, **settings: object) -> AllowedPositions:
    asked = PlanSettings(scanner=SCANNER, max_patch_area_m2=4.0, **settings)
    survey = make_survey(scene, asked)
    tripods = Tripods(survey, asked, open_engine(scene, survey.patches))
    return find_positions(tripods, local_site(survey, Site()))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("height_m", "tripod_m"), [(2.5, {1.7}), (1.91, {1.7}), (1.89, {1.4, 1.5, 1.6}), (1.81, {1.4, 1.5, 1.6})]
)
def test_tripod_is_as_high_as_the_room_allows(height_m: float, tripod_m: set[float]) -> None:
    places = found_in(hall(height_m))
    assert places.candidates.floor.size > 50
    assert set(places.candidates.instrument_height_m.tolist()) == tripod_m
    lowered = "for the usual instrument height of 1.70 m, so the tripod is lowered there to 1.40 to 1.60 m"
    assert [lowered in line for line in places.warnings] == ([True] if 1.7 not in tripod_m else [])


@pytest.mark.slow
@pytest.mark.parametrize("wall", [DOOR_WALL, [box((4, 0.2, 0), (4.1, 3.8, 2.6))]], ids=["doorway", "wall"])
def test_low_room_beside_a_high_one_is_planned_with_a_lowered_tripod(wall: list[Solid]) -> None:
    candidates = found_in(hall(2.6, *wall, LOW_CEILING)).candidates
    east = candidates.position_m[:, 0] > 4.1
    assert set(candidates.instrument_height_m[east].tolist()) == {1.4, 1.5, 1.6}
    assert set(candidates.instrument_height_m[~east].tolist()) == {1.7}
    assert east.sum() > 5


def test_tripod_is_not_lowered_below_a_beam_or_a_gallery_edge() -> None:
    places = found_in(hall(2.6, box((3.5, 0.2, 1.85), (5.5, 3.8, 2.6))))
    assert set(places.candidates.instrument_height_m.tolist()) == {1.7}
    assert places.warnings == ()


def test_height_that_is_given_is_an_order() -> None:
    assert found_in(hall(1.9), instrument_heights_m=(1.7,)).candidates.floor.size == 0
    assert set(found_in(hall(1.9), instrument_heights_m=(1.5,)).candidates.instrument_height_m.tolist()) == {1.5}


def test_order_that_is_too_high_for_the_building_is_refused_with_the_remedy() -> None:
    asked = PlanSettings(scanner=SCANNER, max_patch_area_m2=4.0, instrument_heights_m=(1.7,))
    with pytest.raises(RequirementError, match=r"give a lower instrument height \(--height\)"):
        make_plan(hall(1.9), asked)


@pytest.mark.parametrize("height_m", [5.0, 30.0])
def test_order_above_the_ceiling_is_refused_with_the_heights_of_a_tripod(height_m: float) -> None:
    asked = PlanSettings(scanner=SCANNER, max_patch_area_m2=4.0, instrument_heights_m=(height_m,))
    remedy = rf"give a lower instrument height \(--height\): {height_m:g} m may be above the ceiling, and tripods of"
    with pytest.raises(RequirementError, match=remedy) as refused:
        make_plan(hall(2.6), asked)
    assert "finer grid" not in str(refused.value)


@pytest.mark.slow
def test_low_cellar_of_reality_has_lowered_positions_and_its_room_is_named() -> None:
    file = reality("low_cellar.ifc")
    places = found_in(load_scene(file))
    heights_m = [
        set(places.candidates.instrument_height_m[places.candidates.floor == number].tolist()) for number in range(3)
    ]
    assert heights_m == [{1.4, 1.5, 1.6}, {1.7}, {1.7}]
    (line,) = places.warnings
    assert line.startswith("floor 'Keller': too little headroom in 'cellar'")
    cellar = places.candidates.floor == 0
    ground_m = (places.candidates.position_m[:, 2] - places.candidates.instrument_height_m)[cellar]
    assert np.isclose(ground_m, -2.1).all()
