"""Goals: which patches a part is, by hand and against an angle count; what is refused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from stages import goals_of

from planner_core.errors import RequirementError
from planner_core.model import PartRequirement, PointLimits, Requirements
from planner_core.requirements.goals import OVERALL, obstacles_of
from planner_core.scene.patches import patch_triangles


def part_of(box: SimpleNamespace, settings_of, **named: object) -> np.ndarray:
    goals = goals_of(box.survey, settings_of(parts=(PartRequirement("part", **named),))).each
    return next(goal for goal in goals if goal.name == "part").patches


@pytest.mark.parametrize(
    ("classes", "elements"),
    [
        (("IfcWall",), [0, 1, 3]),
        (("ifcwall*",), [0, 1, 2, 3]),
        (("*standard*",), [2]),
        (("?est wall",), [3]),
        (("IfcSlab", "Ceiling"), [4, 5]),
        (("*",), [0, 1, 2, 3, 4, 5]),
        (("**a***l*",), [0, 1, 2, 3]),
    ],
)
def test_classes_are_patterns_of_kinds_and_names(
    box: SimpleNamespace, settings_of, classes: tuple[str, ...], elements: list[int]
) -> None:
    found = part_of(box, settings_of, classes=classes)
    np.testing.assert_array_equal(found, np.isin(box.element_of_patch, elements))


def test_brackets_and_dots_in_a_pattern_are_what_they_are(box: SimpleNamespace, settings_of) -> None:
    for pattern in ("Ifc.all", "Ifc[W]all", "IfcWall|IfcSlab", "(IfcWall)"):
        with pytest.raises(RequirementError, match="of which the building has nothing"):
            part_of(box, settings_of, classes=(pattern,))


def test_a_zone_is_given_in_the_coordinates_of_the_source(box: SimpleNamespace, settings_of) -> None:
    centre = patch_triangles(box.scene, box.survey.patches).mean(axis=1)
    zone = ((1002.0, 2001.0), (1006.0, 2001.0), (1006.0, 2003.0), (1002.0, 2003.0))
    inside = (centre[:, 0] > 2) & (centre[:, 0] < 6) & (centre[:, 1] > 1) & (centre[:, 1] < 3)
    np.testing.assert_array_equal(part_of(box, settings_of, zone=zone), inside)
    np.testing.assert_array_equal(
        part_of(box, settings_of, zone=zone, classes=("IfcSlab",)), inside & (box.element_of_patch == 4)
    )
    between = (centre[:, 2] >= 0.5) & (centre[:, 2] <= 1.5)
    np.testing.assert_array_equal(part_of(box, settings_of, heights_m=(0.5, 1.5)), between)
    # The slab lies at 0: ends are included.
    assert part_of(box, settings_of, heights_m=(0.0, 0.0))[box.element_of_patch == 4].all()


def test_a_part_without_floors_keeps_to_what_is_planned(box: SimpleNamespace, settings_of) -> None:
    wanted = settings_of(floors=("West",), parts=(PartRequirement("walls", classes=("IfcWall*",)),))
    goals = {goal.name: goal for goal in goals_of(box.survey, wanted).each}
    assert list(goals) == ["West", OVERALL, "walls"]
    np.testing.assert_array_equal(goals["walls"].patches, box.element_of_patch == 3)
    np.testing.assert_array_equal(goals[OVERALL].patches, np.isin(box.element_of_patch, [3, 4]))


def test_a_part_that_is_one_floor_takes_its_place(box: SimpleNamespace, settings_of) -> None:
    parts = (
        PartRequirement("upstairs", 0.5, limits=PointLimits(range_m=3.0), floors=("f1",)),
        PartRequirement("both", 0.6, floors=("F0", "F1")),
        PartRequirement("its walls", 0.7, floors=("West",), classes=("IfcWall",)),
    )
    goals = goals_of(box.survey, settings_of(coverage=0.9, parts=parts)).each
    assert [(goal.name, goal.coverage, goal.stated) for goal in goals] == [
        ("West", 0.9, False),
        ("upstairs", 0.5, True),
        (OVERALL, 0.9, False),
        ("both", 0.6, True),
        ("its walls", 0.7, True),
    ]
    np.testing.assert_array_equal(goals[1].patches, np.isin(box.element_of_patch, [0, 1, 2]))
    np.testing.assert_array_equal(goals[3].patches, np.isin(box.element_of_patch, [0, 1, 2, 3, 4]))
    np.testing.assert_array_equal(goals[4].patches, box.element_of_patch == 3)


def test_floors_of_one_name_are_told_apart(box: SimpleNamespace, settings_of) -> None:
    twins = replace(box.survey, floors=tuple(replace(floor, name="Level") for floor in box.survey.floors))
    assert [goal.name for goal in goals_of(twins, settings_of()).each] == ["Level (F0)", "Level (F1)", OVERALL]


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ([{"floors": ("Attic",)}], r"'part 0': floor: got 'Attic', expected one of F0 \(West\)"),
        ([{"floors": ("East",)}], "'part 0': got floor 'East', which is not planned"),
        ([{"classes": ("IfcWal",)}], "got class 'IfcWal', .* expected IfcWall;"),
        ([{"classes": ("Zebra",)}], "expected one of IfcCovering, IfcSlab, IfcWall, IfcWallStandardCase; "),
        ([{"zone": ((0, 0), (9, 0), (9, 9))}], "x 1000.00 to 1008.00 m, y 2000.00 to 2004.00 m"),
        ([{"heights_m": (7.0, 8.0)}], "got no surface"),
        ([{"floors": ("West",)}, {"floors": ("f0",)}], "'part 1': got floor 'West' a second time"),
        ([{"name": "overall", "classes": ("IfcSlab",)}], "'overall': got the name of another requirement"),
    ],
)
def test_parts_that_are_not_there_are_refused_by_name(
    box: SimpleNamespace, settings_of, parts: list[dict], message: str
) -> None:
    made = tuple(PartRequirement(**{"name": f"part {number}", **part}) for number, part in enumerate(parts))
    with pytest.raises(RequirementError, match=message) as caught:
        goals_of(box.survey, settings_of(floors=("West",), parts=made))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PartRequirement(" "), "without a name"),
        (lambda: PartRequirement("p", coverage=-0.1), "'p': coverage: got -0.1"),
        (lambda: PartRequirement("p", coverage=float("nan")), "'p': coverage"),
        (lambda: PartRequirement("p", seen_from=0), "'p': seen from: got 0"),
        (lambda: PartRequirement("p", zone=((0, 0), (1, 1))), "'p': zone: got 2 corners"),
        (lambda: PartRequirement("p", zone=((0, 0), (1, 1), (float("nan"), 0))), "'p': zone"),
        (lambda: PartRequirement("p", heights_m=(2.0, 1.0)), "'p': heights: got 2.0 to 1.0"),
        (lambda: PartRequirement("p", heights_m=(float("nan"), 1.0)), "'p': heights"),
        (lambda: Requirements(seen_from=0), "seen from: got 0"),
        (lambda: Requirements(network="star"), "network: got 'star', expected one of connected, redundant, none"),
        (lambda: Requirements(reflectivity=0.0), "reflectivity: got 0.0"),
        (lambda: Requirements(parts=(PartRequirement("p"), PartRequirement("p"))), "'p': got it twice"),
    ],
)
def test_requirements_without_sense_are_refused_when_made(make, message: str) -> None:
    with pytest.raises(RequirementError, match=message):
        make()


def test_of_parts_with_coverage_none_nothing_is_required(box, settings_of) -> None:
    parts = (
        PartRequirement("no standard walls", 0.0, classes=("IfcWallStandardCase",)),
        PartRequirement("not there", 0.0, classes=("IfcFurnishingElement",)),
        PartRequirement("walls", 0.9, classes=("IfcWall*",)),
    )
    settings = settings_of(parts=parts)
    goals = {goal.name: goal.patches for goal in goals_of(box.survey, settings).each}
    assert set(goals) == {"West", "East", "overall", "walls"}
    area_m2 = box.survey.patches.area_m2
    east = box.element_of_patch == 2
    assert area_m2[east].sum() == pytest.approx(4.0 * 2.5)
    for patches in goals.values():
        assert not (patches & east).any()
    assert area_m2[goals["overall"]].sum() == pytest.approx(2 * (8 * 4 + 8 * 2.5 + 4 * 2.5) - 4.0 * 2.5)
    obstacles = obstacles_of(box.survey, settings.requirements)
    assert list(obstacles) == ["no standard walls", "not there"]
    assert (obstacles["no standard walls"] == east).all()
    assert not obstacles["not there"].any()


def test_a_misspelt_class_that_need_not_be_covered_is_told(box, settings_of) -> None:
    parts = tuple(PartRequirement(name, 0.0, classes=(name,)) for name in ("IfcWal", "IfcFurnishingElement", "IfcSlab"))
    (line,) = goals_of(box.survey, settings_of(parts=parts)).remarks
    assert line == (
        "requirement 'IfcWal': the building has nothing of 'IfcWal', which need not be covered, expected IfcWall"
    )


def test_nothing_left_to_require_is_refused(box, settings_of) -> None:
    with pytest.raises(RequirementError, match="got no surface of which anything is required"):
        goals_of(box.survey, settings_of(parts=(PartRequirement("all", 0.0, classes=("*",)),)))
