"""Scope against areas known from the drawing, and against Open3D's own rays."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import open3d as o3d
import pytest

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import Element, Greedy, PartRequirement, PlanSettings, Requirements, Scope
from planner_core.model.unseen import OUT_OF_SCOPE
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.plan_settings import settings_of
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.plan import make_plan
from planner_core.requirements.goals import required_of
from planner_core.requirements.scope import with_scope
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import patch_triangles
from tests.coverage.conftest import BOX_FACES, box_corners

#: A room of 6 x 4 x 2.7 m with walls of 0.3 m on a plot of 20 x 20 m.
ROOM_M2 = 2 * 6 * 4 + 2 * (6 + 4) * 2.7
FLOOR, PLOT = ((-0.3, -0.3, -0.2), (6.3, 4.3, 0.0)), ((-7, -8, -1.0), (13, 12, -0.2))
ROOF = ((-0.3, -0.3, 2.7), (6.3, 4.3, 3.0))
NORTH, EAST, WEST = (
    ((0.0, 4.0, 0.0), (6.0, 4.3, 2.7)), ((6.0, -0.3, 0.0), (6.3, 4.3, 2.7)), ((-0.3, -0.3, 0.0), (0.0, 4.3, 2.7)),
)  # fmt: skip
SOUTH = (((0.0, -0.3, 0.0), (6.0, 0.0, 2.7)),)
#: With a doorway of 1 x 2.1 m.
SOUTH_WITH_GAP = (
    ((0.0, -0.3, 0.0), (2.5, 0.0, 2.7)), ((3.5, -0.3, 0.0), (6.0, 0.0, 2.7)), ((2.5, -0.3, 2.1), (3.5, 0.0, 2.7)),
)  # fmt: skip
WALLS = (NORTH, EAST, WEST, *SOUTH)
HOUSE = (PLOT, FLOOR, ROOF, *WALLS)


def scene_of(boxes):
    corners = np.concatenate([box_corners(low, high) for low, high in boxes])
    faces = np.concatenate([BOX_FACES + 8 * number for number in range(len(boxes))])
    elements = tuple(Element(f"box {number}", "Mesh", str(number)) for number in range(len(boxes)))
    return scene_from_arrays(
        corners, faces, element_of_triangle=np.repeat(np.arange(len(boxes)), 12), elements=elements
    )


def settings(scope: str = "auto", **more: object) -> PlanSettings:
    return PlanSettings(
        scanner=replace(load_scanner("hdl-64e"), n_azimuths=180),
        requirements=Requirements(scope=Scope(scope), network="none"),
        instrument_heights_m=(1.6,),
        method=Greedy(),
        **{"grid_step_m": 1.0, **more},
    )


#: Of whole plans: other tests examine the scope patch by patch.
COARSE = {"max_patch_area_m2": 0.4, "grid_step_m": 2.0, "refine": False}


def scoped(boxes, scope: str = "auto", *, open3d: bool = False, **more: object):
    asked = settings(scope, **more)
    survey = make_survey(scene_of(boxes), asked)
    engine = Open3DEngine(survey.scene, survey.patches) if open3d else open_engine(survey.scene, survey.patches)
    return with_scope(survey, asked.requirements, engine)


def area_m2(survey, patches) -> float:
    return float(survey.patches.area_m2[patches].sum())


def normals_and_middles(survey):
    corners = patch_triangles(survey.scene, survey.patches)
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners.mean(axis=1)


@pytest.mark.slow
def test_the_interior_of_a_closed_house_is_the_room() -> None:
    survey = scoped(HOUSE)
    assert survey.scope.kind == Scope.INTERIOR
    _, middle = normals_and_middles(survey)
    # Patches that reach behind a wall's end are seen in part, and count whole: a patch's width more at the most.
    assert ROOM_M2 <= area_m2(survey, survey.scope.in_scope) <= 1.04 * ROOM_M2
    on_room = ((middle >= -0.15) & (middle <= np.array([6.0, 4.0, 2.7]) + 0.15)).all(axis=1)
    assert on_room[survey.scope.in_scope].all()


@pytest.mark.slow
def test_the_exterior_is_facades_roof_and_plot() -> None:
    survey = scoped(HOUSE, "exterior")
    facades = 2 * (6.6 + 4.6) * 3.2
    expected = facades + 6.6 * 4.6 + 20 * 20 - 6.6 * 4.6
    found = survey.scope.in_scope
    normal, middle = normals_and_middles(survey)
    sides_of_plot = (middle[:, 2] < -0.2 - 1e-6) & found
    # What looks sideways into the void beside the plot may count or not: no station sees it.
    assert area_m2(survey, found & ~sides_of_plot) == pytest.approx(expected, rel=0.02)
    assert not found[(middle[:, 2] < -0.9) & (normal[:, 2] < 0)].any()


@pytest.mark.slow
@pytest.mark.parametrize("scope", ["interior", pytest.param("exterior", marks=pytest.mark.slow)])
def test_engines_agree_but_for_ties(scope: str) -> None:
    boxes = (PLOT, FLOOR, ROOF, NORTH, EAST, WEST, *SOUTH_WITH_GAP)
    ours, theirs = (scoped(boxes, scope, open3d=other).scope.in_scope for other in (False, True))
    assert np.count_nonzero(ours != theirs) <= 0.002 * ours.size


@pytest.mark.slow
def test_what_open3d_sees_from_the_room_is_in_scope_and_what_it_sees_from_the_sky_is_not() -> None:
    survey = scoped(HOUSE, "interior")
    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(survey.scene.vertices_m.astype(np.float32), survey.scene.triangles.astype(np.uint32))
    _, middle = normals_and_middles(survey)

    def in_view(eye):
        rays = np.hstack([np.tile(eye, (len(middle), 1)), middle - eye]).astype(np.float32)
        return caster.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy() > 0.999

    assert survey.scope.in_scope[in_view(np.array([3.1, 2.2, 1.3]))].all()
    for eye in ([3.0, 2.0, 20.0], [-6.0, 2.0, 1.5], [12.0, 11.0, 1.5], [3.0, -7.0, 1.5]):
        seen = in_view(np.array(eye))
        assert seen.sum() > 50
        assert not survey.scope.in_scope[seen].any()


@pytest.mark.slow
def test_a_missing_door_lets_no_garden_in() -> None:
    survey = scoped((PLOT, FLOOR, ROOF, NORTH, EAST, WEST, *SOUTH_WITH_GAP))
    assert survey.scope.kind == Scope.INTERIOR
    _, middle = normals_and_middles(survey)
    inner = survey.scope.in_scope
    reveals = 0.3 * (2.1 + 2.1 + 1.0 + 1.0)
    assert ROOM_M2 - 2.1 - 1.0 < area_m2(survey, inner) < 1.03 * (ROOM_M2 - 2.1 + reveals)
    assert not inner[middle[:, 1] < -0.31].any()


def test_without_a_roof_all_is_planned_and_one_line_says_so() -> None:
    boxes = tuple(box for box in HOUSE if box != ROOF)
    survey = scoped(boxes)
    assert survey.scope.kind == Scope.ALL
    assert survey.scope.in_scope.all()
    assert [line for line in survey.warnings if line.startswith("scope: ")] == [
        "scope: all surfaces are planned, as no room is enclosed by walls, roof and shut doors and windows; "
        "--scope interior or exterior chooses"
    ]
    with pytest.raises(RequirementError, match="scope interior: got a building without any"):
        scoped(boxes, "interior")


def test_a_storey_that_lost_its_roof_is_told_from_a_yard() -> None:
    upper = [tuple(tuple(np.add(corner, (0, 0, 3.0))) for corner in box) for box in WALLS]
    survey = scoped((*HOUSE, *upper))
    assert survey.scope.kind == Scope.ALL
    assert any("and no roof" in line for line in survey.warnings)


def test_a_yard_is_outdoors_and_told_as_it_may_be_a_room() -> None:
    yard = [
        ((7.0, -3.0, 0.0), (7.3, 4.3, 2.7)), ((0.0, -3.0, 0.0), (7.0, -2.7, 2.7)),
        ((-0.3, -3.0, 0.0), (0.0, -0.3, 2.7)), ((6.3, 4.0, 0.0), (7.0, 4.3, 2.7)),
    ]  # fmt: skip
    plinth = ((-0.3, -3.0, -0.2), (7.3, 4.3, 0.0))
    survey = scoped((plinth, ROOF, *WALLS, *yard))
    assert survey.scope.kind == Scope.INTERIOR
    assert ROOM_M2 <= area_m2(survey, survey.scope.in_scope) <= 1.04 * ROOM_M2
    (line,) = [line for line in survey.warnings if line.startswith("scope: ")]
    assert "m2 of ground and no roof, a yard and out of scope; if it is a room, use --scope all" in line


@pytest.mark.slow
def test_sheets_are_indoors_on_one_side_and_outdoors_on_the_other() -> None:
    sheet = ((0.0, 0.0, 0.0), (6.0, 4.0, 2.7))
    boxes = (sheet,)
    inner, outer = (scoped(boxes, scope).scope.in_scope for scope in ("interior", "exterior"))
    survey = scoped(boxes)
    assert area_m2(survey, inner) == pytest.approx(ROOM_M2, rel=0.01)
    assert area_m2(survey, inner & outer) == pytest.approx(ROOM_M2 - 24, rel=0.02)


@pytest.mark.slow
def test_stations_of_the_interior_stand_indoors_and_those_of_the_exterior_outdoors() -> None:
    plinth = ((-4.0, -4.0, -0.2), (10.0, 8.0, 0.0))
    boxes = (plinth, ROOF, NORTH, EAST, WEST, *SOUTH_WITH_GAP)
    stands = {}
    for scope in ("all", "interior", "exterior"):
        plan = make_plan(scene_of(boxes), settings(scope, **COARSE))
        at = np.array([station.position_m for station in plan.stations])
        # The doorway, as deep as the wall, is still indoors.
        stands[scope] = ((at[:, :2] > [0, -0.3]) & (at[:, :2] < [6, 4])).all(axis=1)
        assert plan.coverage.fraction_of_achievable >= 0.95
        assert plan.coverage.total_area_m2 == pytest.approx(area_m2(plan.survey, plan.survey.scope.in_scope))
    assert stands["interior"].all()
    assert not stands["exterior"].any()
    assert 0 < stands["all"].sum() < stands["all"].size


@pytest.mark.slow
def test_positions_far_from_ground_are_on_neither_side() -> None:
    scope = scoped(HOUSE, "interior").scope
    assert scope.admits(np.array([[3.0, 2.0, 0.0], [3.0, -3.0, -0.2], [3.0, 2.0, 40.0]])).tolist() == [
        True, False, False,
    ]  # fmt: skip


@pytest.mark.slow
def test_plan_json_says_the_scope_and_planning_or_evaluating_again_agrees() -> None:
    boxes = (PLOT, FLOOR, ROOF, NORTH, EAST, WEST, *SOUTH_WITH_GAP, ((1.0, 1.0, 0.0), (1.8, 1.8, 0.7)))
    scene = scene_of(boxes)
    asked = settings("auto", **COARSE)
    table = PartRequirement("table", 0.0, classes=(f"name=box {len(boxes) - 1}",))
    asked = replace(asked, requirements=replace(asked.requirements, parts=(table,)))
    plan = make_plan(scene, asked, engine="open3d")
    document = json.loads(plan_text(plan))
    told, area = document["scope"], plan.survey.patches.area_m2
    assert told["kind"] == "interior"
    assert document["requirements"]["scope"] == "auto"
    (obstacle,) = told["obstacles"]
    assert obstacle["area_m2"] == pytest.approx(2 * 0.64 + 4 * 0.8 * 0.7)
    assert told["in_scope_area_m2"] + told["out_of_scope_area_m2"] + obstacle["area_m2"] == pytest.approx(area.sum())
    assert document["coverage"]["total_area_m2"] == pytest.approx(told["in_scope_area_m2"])
    assert (plan.times_seen[~required_of(plan.survey, asked.requirements)] == 0).all()
    assert (plan.why.reason_of_patch == OUT_OF_SCOPE).sum() == (~required_of(plan.survey, asked.requirements)).sum()
    np.testing.assert_array_equal(plan.required, plan.why.reason_of_patch != OUT_OF_SCOPE)
    document["scene"]["file"] = "house.ifc"  # a scene from memory has no name
    again = settings_of(document)
    assert again.requirements == plan.settings.requirements
    stations = [GivenStation(each.id, each.position_m + scene.offset_m, None, None) for each in plan.stations]
    evaluated = evaluate_stations(scene, again, stations, engine="open3d")
    assert (evaluated.survey.scope.in_scope == plan.survey.scope.in_scope).all()
    assert evaluated.coverage.total_area_m2 == plan.coverage.total_area_m2
    outside = GivenStation("out", np.array([3.0, -4.0, 1.4]) + scene.offset_m, None, None)
    told = evaluate_stations(scene, again, [*stations, outside], engine="open3d").warnings
    assert "1 station stands out of scope interior: out; --scope all counts all" in told
    assert not any("out of scope interior" in line for line in evaluated.warnings)
    assert evaluated.coverage.covered_area_m2 == pytest.approx(plan.coverage.covered_area_m2)


@pytest.mark.parametrize("scope", ["interior", "exterior"])
def test_a_building_of_obstacles_alone_is_refused_in_words(scope: str) -> None:
    everything = PartRequirement("all", 0.0, classes=("Mesh",))
    asked = settings(scope)
    asked = replace(asked, requirements=replace(asked.requirements, parts=(everything,)))
    survey = make_survey(scene_of(HOUSE), asked)
    with pytest.raises(RequirementError, match=f"scope {scope}: got no surface of it, expected some"):
        with_scope(survey, asked.requirements, open_engine(survey.scene, survey.patches))


@pytest.mark.slow
def test_patches_that_stand_for_their_block_lose_next_to_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = settings("interior")
    survey = make_survey(scenes_synthetic.build("house").scene, asked)
    engine = open_engine(survey.scene, survey.patches)
    by_blocks = with_scope(survey, asked.requirements, engine).scope
    # Of blocks of one patch each, all are asked.
    monkeypatch.setattr("planner_core.requirements.scope._blocks", lambda surfaces: np.arange(surfaces.patch.size))
    one_by_one = with_scope(survey, asked.requirements, engine).scope
    assert by_blocks is not None
    assert one_by_one is not None
    assert not (by_blocks.in_scope & ~one_by_one.in_scope).any()
    lost_m2 = area_m2(survey, one_by_one.in_scope & ~by_blocks.in_scope)
    assert 0 < lost_m2 < 0.005 * area_m2(survey, one_by_one.in_scope)


# ------------------------------------------------------------------------------------------------ open sides
SLABS = (((0, 0, -0.3), (24, 16, 0.0)), ((0, 0, 3.0), (24, 16, 3.3)))
CORE = (
    ((9, 6, 0), (15, 6.2, 3)), ((9, 9.8, 0), (15, 10, 3)), ((9, 6.2, 0), (9.2, 9.8, 3)), ((14.8, 7.2, 0), (15, 9.8, 3)),
)  # fmt: skip
COLUMNS = tuple(
    ((x - 0.2, y - 0.2, 0), (x + 0.2, y + 0.2, 3)) for x in (0.5, 8, 16, 23.5) for y in (0.5, 15.5)
)  # fmt: skip
LONG_SIDES = (((0, 0, 0), (24, 0.3, 3)), ((0, 15.7, 0), (24, 16, 3)))
SHORT_SIDES = (((0, 0.3, 0), (0.3, 15.7, 3)), ((23.7, 0.3, 0), (24, 15.7, 3)))
PARAPETS = (
    ((0, 0, 0), (24, 0.2, 1)), ((0, 15.8, 0), (24, 16, 1)), ((0, 0.2, 0), (0.2, 15.8, 1)),
    ((23.8, 0.2, 0), (24, 15.8, 1)),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sides", "least_m2", "most_m2"),
    [
        pytest.param((), 60, 240, id="no facade", marks=pytest.mark.slow),
        pytest.param(PARAPETS, 30, 240, id="parapets"),
        pytest.param(LONG_SIDES, 20, 120, id="both ends open", marks=pytest.mark.slow),
        pytest.param((LONG_SIDES[0], *SHORT_SIDES), 10, 120, id="a front open", marks=pytest.mark.slow),
    ],
)
def test_open_sides_are_named_with_the_ground_that_they_lose(sides: tuple, least_m2: float, most_m2: float) -> None:
    survey = scoped((*SLABS, *CORE, *COLUMNS, *sides), max_patch_area_m2=0.5)
    assert survey.scope.kind == Scope.INTERIOR
    (line,) = (line for line in survey.warnings if "open sides" in line)
    lost_m2 = float(line.split("open sides: ")[1].split(" m2")[0])
    assert least_m2 < lost_m2 < most_m2, line
    assert line.endswith("to plan it up to the slab's edge, use --scope all")


@pytest.mark.slow
@pytest.mark.parametrize(
    "building",
    [
        HOUSE,
        (PLOT, FLOOR, ROOF, NORTH, EAST, WEST, *SOUTH_WITH_GAP),
        # A porch of 6 x 3 m under the same roof, before the wall and a doorway without a door.
        (PLOT, ((-0.3, -3.3, -0.2), (6.3, 4.3, 0.0)), ((-0.3, -3.3, 2.7), (6.3, 4.3, 3.0)), *WALLS),
        (*SLABS, *CORE, *COLUMNS, *LONG_SIDES, *SHORT_SIDES),
    ],
    ids=["closed", "a missing door", "a porch", "an office with its facade"],
)
def test_closed_buildings_have_no_open_sides(building: tuple) -> None:
    assert [line for line in scoped(building).warnings if "open sides" in line] == []
