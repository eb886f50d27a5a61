"""Plans without any valid tripod position: the refusal counts the causes, and names the option that helps."""

import re
from dataclasses import replace

import pytest

from planner_core.errors import RequirementError
from planner_core.model import KeepOut, PlanSettings, PriorStation, Role, Scene, Site
from planner_core.planning.plan import make_plan
from planner_core.positions.admissibility import NO_GROUND, refusals_in_words
from tests.scene.floor_scenes import four_walls, scene_of


def room(*parts) -> Scene:
    """A room with a roof."""
    return scene_of(
        [
            *four_walls(4, 3, 0.0, 2.6, 0),
            ("roof", "IfcRoof", 0, (0, 0, 2.6), (4, 3, 2.8)),
            ("slab", "IfcSlab", 0, (0, 0, -0.2), (4, 3, 0)),
            *parts,
        ],
        [("Ground", 0.0)],
    )


CUPBOARDS = [("cupboards", "IfcFurniture", 0, (0.2, 0.2, 0.4), (3.8, 2.8, 0.8))]


@pytest.mark.parametrize(
    ("scene", "changed", "site", "cause", "remedy"),
    [
        (room(), {"instrument_heights_m": (2.5,)}, Site(), "too little headroom", "(--height)"),
        (room(), {"clearance_m": 1.6}, Site(), "too close to something", "(--clearance)"),
        (room(*CUPBOARDS), {}, Site(), "something between sensor and ground", "(--leave-out)"),
        (room(), {"ground_ring_radius_m": 3.0}, Site(), "uneven or no ground around", "mark a larger surface"),
        (room(), {}, Site(keep_out=(KeepOut(((-1, -1), (5, -1), (5, 4), (-1, 4))),)), "in a keep-out", "keep-outs"),
        (
            room(),
            {},
            Site(prior=(PriorStation("X", (2, 1.5, 1.5), Role.FORBIDDEN, radius_m=9.0),)),
            "at a forbidden position",
            "(--forbid)",
        ),
    ],
    ids=["headroom", "clearance", "furniture", "narrow", "keep-out", "forbidden"],
)
def test_refusal_without_positions_names_the_deciding_cause_and_its_option(
    small: PlanSettings, scene: Scene, changed: dict, site: Site, cause: str, remedy: str
) -> None:
    with pytest.raises(RequirementError, match="positions tried is valid for a tripod") as caught:
        make_plan(scene, replace(small, site=site, grid_step_m=0.5, **changed))
    line = str(caught.value)
    decides = line.rpartition("); ")[2] if "); " in line else line
    assert re.search(rf"\(.*{cause}: [1-9]\d*", line), line
    assert cause in decides and remedy in decides, line


def test_walls_that_enclose_nothing_are_refused_with_the_walls_that_the_file_lacks(small: PlanSettings) -> None:
    walls = [("wall", "IfcWall", 0, (0, y, 0), (6, y + 0.2, 2.6)) for y in (0.0, 3.8)]
    roof = ("roof", "IfcRoof", 0, (-2, -3, 2.6), (8, 7, 2.8))
    with pytest.raises(RequirementError, match="outside the building: walls enclose nothing there: load the file"):
        make_plan(scene_of([*walls, roof], [("Ground", 0.0)]), replace(small, grid_step_m=0.5))


def test_floor_without_positions_has_its_own_causes(small: PlanSettings) -> None:
    """The upper floor is seen through a hole in its slab, and too low for any tripod."""
    low = [
        *four_walls(4, 3, 2.8, 4.4, 1),
        ("slab", "IfcSlab", 1, (0, 0, 2.6), (4, 2, 2.8)),
        ("roof", "IfcRoof", 1, (0, 0, 4.4), (4, 3, 4.6)),
    ]
    ground = [("slab", "IfcSlab", 0, (0, 0, -0.2), (4, 3, 0)), *four_walls(4, 3, 0.0, 2.6, 0)]
    plan = make_plan(scene_of([*ground, *low], [("Ground", 0.0), ("Upper", 2.8)]), replace(small, grid_step_m=0.5))
    (line,) = (line for line in plan.warnings if "no valid tripod position" in line)
    assert "floor 'Upper'" in line and "too little headroom: give a lower instrument height (--height" in line
    assert "too close" not in line


def test_cause_of_the_site_decides_where_a_tripod_could_stand() -> None:
    words = refusals_in_words({"outside the building": 900, "not reachable on foot": 40, "out of scope": 7}, [])
    assert words == (
        "(outside the building: 900, not reachable on foot: 40, out of scope: 7); of 47 where a tripod could stand, 40 "
        "are not reachable on foot: give an entrance on the ground there (--entrance)"
    )
    assert "(--scope all)" in refusals_in_words({"out of scope": 7, NO_GROUND: 80}, [])
    assert "(--scope exterior)" in refusals_in_words({"outside the building": 7, NO_GROUND: 80}, [])


def test_points_beside_the_floor_decide_where_nothing_else_does() -> None:
    assert refusals_in_words({NO_GROUND: 9}, []).endswith("use a finer grid (--grid)")
    assert "less clearance" in refusals_in_words({NO_GROUND: 9, "too close to something": 1}, [])
