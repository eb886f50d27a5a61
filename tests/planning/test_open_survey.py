"""Exterior doors to a loggia are open, as it is surveyed with the rooms; front doors are not, nor those asked shut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner_core.model import Doors, Element, PlanSettings, PreAlignment, Proven, Requirements, Scene, Scope, Storey
from planner_core.planning.open_survey import open_survey
from planner_core.planning.plan import make_plan
from planner_core.requirements.scope import with_scope
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.doors import without_door_leaves
from tests.coverage.conftest import BOX_FACES, box_corners

#: A room of 6 x 4 x 2.6 m; to the south a loggia, 3 m deep, behind a door of 1 x 2.1 m; to the north the front door,
#: before a slab of 6 x 2 m under a canopy.
DOORS = [((2.5, -0.17, 0.0), (3.5, -0.13, 2.1)), ((2.5, 4.13, 0.0), (3.5, 4.17, 2.1))]
WALLS = [
    *(((x, -3.3, 0.0), (x + 0.3, 4.3, 2.6)) for x in (-0.3, 6.0)),
    *(((x0, y, 0.0), (x1, y + 0.3, 2.6)) for y in (-0.3, 4.0) for x0, x1 in ((0.0, 2.5), (3.5, 6.0))),
    *(((2.5, y, 2.1), (3.5, y + 0.3, 2.6)) for y in (-0.3, 4.0)),
    ((0.0, -3.3, 0.0), (6.0, -3.2, 1.0)),
]
SLABS = [((-0.3, -3.3, z), (6.3, 6.3, z + 0.2)) for z in (-0.2, 2.6)]


def house(doors: Doors = Doors.OPEN, *, shut: tuple[str, ...] = ()) -> Scene:
    parts = [
        (kind, box) for kind, boxes in (("IfcSlab", SLABS), ("IfcWall", WALLS), ("IfcDoor", DOORS)) for box in boxes
    ]
    scene = scene_from_arrays(
        np.concatenate([box_corners(*box) for _, box in parts]),
        np.concatenate([BOX_FACES + 8 * number for number in range(len(parts))]),
        element_of_triangle=np.repeat(np.arange(len(parts)), 12),
        elements=[
            Element(f"{kind} {number}", kind, f"id-{number}", 0, True if kind == "IfcDoor" else None)
            for number, (kind, _) in enumerate(parts)
        ],
        storeys=[Storey("Ground floor", "0", 0.0)],
    )
    opened = without_door_leaves(scene, doors, shut=shut) if doors != Doors.SHUT else scene
    return replace(opened, source=replace(opened.source, doors=doors, doors_shut=shut))


def settings(scope: Scope = Scope.AUTO) -> PlanSettings:
    return PlanSettings(
        scanner=load_scanner("rtc360"),
        requirements=Requirements(scope=scope, coverage=0.9, pre_alignment=PreAlignment.TRACKED),
        method=Proven(work_limit=0.5, prove=False),
        grid_step_m=1.0,
        max_patch_area_m2=0.25,
        refine=False,
    )


FRONT, LOGGIA = (f"id-{len(SLABS) + len(WALLS) + number}" for number in (1, 0))


@pytest.mark.slow
def test_the_door_to_a_loggia_is_open_and_the_front_door_is_not() -> None:
    survey, engine = open_survey(house(), settings())
    assert [survey.scene.elements[door.element].source_id for door in survey.scene.open_doors] == [LOGGIA]
    assert survey.scene.source.doors_open == (LOGGIA,)
    (line,) = (line for line in survey.warnings if line.startswith("doors: "))
    assert "1 exterior door is open, as both sides are planned" in line
    assert LOGGIA in line
    through = engine.cast_rays(
        np.array([[3.0, 2.0, 1.2]] * 2), np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]), range_max_m=9.0
    )
    assert not through.range_m[0] < 4.0
    assert through.range_m[1] == pytest.approx(2.13)


@pytest.mark.parametrize(
    ("scene", "scope"),
    [(house(shut=(LOGGIA,)), Scope.AUTO), (house(Doors.SHUT), Scope.AUTO), (house(), Scope.ALL)],
    ids=["asked shut", "all shut", "all in scope"],
)
def test_it_stays_shut_where_that_is_asked_or_no_inside_is(scene: Scene, scope: Scope) -> None:
    survey, _ = open_survey(scene, settings(scope))
    assert survey.scene.open_doors == ()
    assert [line for line in survey.warnings if line.startswith("doors: ")] == []


@pytest.mark.slow
def test_room_and_loggia_are_one_network() -> None:
    n_groups = {
        doors: len(make_plan(house(doors), settings()).registration.networks)
        for doors in (Doors.OPEN, Doors.ALL, Doors.SHUT)
    }
    assert n_groups[Doors.OPEN] == n_groups[Doors.ALL] == 1
    assert n_groups[Doors.SHUT] == 2


def test_the_same_is_required_whichever_doors_are_open() -> None:
    in_scope_m2 = []
    for doors in (Doors.OPEN, Doors.ALL, Doors.SHUT):
        survey, engine = open_survey(house(doors), settings())
        scoped = with_scope(survey, settings().requirements, engine)
        in_scope_m2.append(float(scoped.patches.area_m2[scoped.scope.in_scope].sum()))
    leaf_m2 = 2.0 * 1.0 * 2.1
    assert in_scope_m2[2] - in_scope_m2[0] == pytest.approx(leaf_m2, abs=1.0)
    assert in_scope_m2[0] - in_scope_m2[1] == pytest.approx(0.5 * leaf_m2, abs=1.0)
