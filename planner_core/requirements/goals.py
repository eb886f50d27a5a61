"""Goals: each requirement, with the patches that it applies to. Overall, by floor, by part.

A `Survey` and `Requirements` -> `Goals`; frames: zones and heights are of the scene frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner_core.coverage.coverage import floor_of_patch, planned_floors, scope_of
from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Floor,
    PartRequirement,
    PointLimits,
    Requirements,
    Scope,
    Survey,
)
from planner_core.positions.outlines import over_polygon
from planner_core.scene.element_patterns import elements_named, known_classes
from planner_core.scene.patches import patch_triangles

#: Name of the requirement of everything that is planned.
OVERALL = "overall"

#: Classes of which nothing is required unless required otherwise: furniture hides, and is moved.
NO_COVER = ("IfcFurnishingElement",)
#: Numbers of stacked patches are int32.
_MOST_STACKED = 2**31 - 1
#: A target has a byte for each.
_MOST_TARGET_BYTES = 2**32


@dataclass(frozen=True)
class Goal:
    """`coverage`, a fraction, of the achievable area of `patches`, (P,) bool; a part's own goal is `stated`."""

    name: str
    coverage: float
    limits: PointLimits
    seen_from: int
    patches: BoolArray
    stated: bool = False


@dataclass(frozen=True)
class Goals:
    """All that is required of a survey.

    each : one goal a planned floor, one for all that is planned, then the parts in their order. patches : (P,) bool,
    those that something may be required of. remarks : a line for each class that need not be covered and of which the
    building has nothing, as where it is misspelt.
    """

    requirements: Requirements
    each: tuple[Goal, ...]
    patches: BoolArray
    remarks: tuple[str, ...] = ()

    @property
    def overall(self) -> Goal:
        """The goal of all that is planned."""
        return next(goal for goal in self.each if goal.name == OVERALL and not goal.stated)

    @cached_property
    def qualities(self) -> tuple[PointLimits, ...]:
        """Distinct limits of the goals: those required of all first, the others as they come."""
        return tuple(dict.fromkeys((self.overall.limits, *(goal.limits for goal in self.each))))

    def quality_of(self, goal: Goal) -> int:
        """Number of the goal's limits among the `qualities`."""
        return self.qualities.index(goal.limits)

    @cached_property
    def wanted(self) -> tuple[BoolArray | None, ...]:
        """Of each quality the patches, (P,) bool, that a goal requires it of; None: all, for that required of all."""
        others = [
            np.any([goal.patches for goal in self.each if goal.limits == limits], axis=0)
            for limits in self.qualities[1:]
        ]
        return (None, *others)

    @property
    def plain(self) -> bool:
        """Whether seeing a patch is all that is required."""
        return self.qualities == (PointLimits(),)


def required_of(survey: Survey, requirements: Requirements) -> BoolArray:
    """(P,) bool: patches that something may be required of: those in scope that are more than obstacles."""
    return wanted_of(survey, requirements) if survey.scope is None else survey.scope.in_scope


def wanted_of(survey: Survey, requirements: Requirements) -> BoolArray:
    """(P,) bool: patches that are more than obstacles, in scope or not."""
    wanted = np.ones(survey.patches.n_patches, dtype=np.bool_)
    for patches in obstacles_of(survey, requirements).values():
        wanted &= ~patches
    return wanted


def obstacles_of(survey: Survey, requirements: Requirements) -> dict[str, BoolArray]:
    """Patches (P,) bool of each part of which nothing is required, by its name; none where the building lacks them.

    Raises
    ------
    RequirementError
        Floors that are not there; zones beside the building.
    """
    spared = [part for part in requirements.parts if part.coverage == 0]
    if not spared:
        return {}
    of_patch = floor_of_patch(survey.patches, survey.floor_of_triangle)
    out = {}
    for part in spared:
        floors = _floors_of(survey, part)
        patches = _of_classes(survey, part, needed=False) & _in_zone(survey, part)
        out[part.name] = patches & np.isin(of_patch, np.array(floors, dtype=np.int32)) if floors else patches
    return out


def goals_of(survey: Survey, requirements: Requirements) -> Goals:
    """Goals of a plan.

    A part that is one whole floor stands in that floor's place. Patches out of scope, and those of parts of which
    nothing is required, are in none.

    Raises
    ------
    RequirementError
        Floors that are not there or not planned; classes, zones or heights of which the building has nothing; more of
        them than memory holds.
    """
    required = required_of(survey, requirements)
    of_patch = np.where(required, floor_of_patch(survey.patches, survey.floor_of_triangle), -1).astype(np.int32)
    scope = scope_of(of_patch, survey.planned, len(survey.floors)) & required
    if not scope.any():
        raise RequirementError(
            "requirements: got no surface of which anything is required, expected some; see scope, floors, and classes "
            "with coverage none"
        )
    by_floor: dict[int, Goal] = {}
    others: list[Goal] = []
    for part in (each for each in requirements.parts if each.coverage > 0):
        floors = _floors_of(survey, part)
        patches = scope if not floors else np.isin(of_patch, np.array(floors, dtype=np.int32))
        patches = patches & _of_classes(survey, part) & _in_zone(survey, part)
        if not patches.any():
            raise RequirementError(
                f"requirement {part.name!r}: got no surface{_where(survey)}, expected some; its floors, classes, zone "
                "and heights have nothing in common"
            )
        goal = Goal(part.name, part.coverage, part.limits, part.seen_from, patches, stated=True)
        if len(floors) == 1 and not (part.classes or part.zone or part.heights_m):
            if floors[0] in by_floor:
                raise RequirementError(
                    f"requirement {part.name!r}: got floor {survey.floors[floors[0]].name!r} a second time, expected "
                    f"it once; {by_floor[floors[0]].name!r} is about it too"
                )
            by_floor[floors[0]] = goal
        else:
            others.append(goal)
    all_of = requirements.coverage, requirements.limits, requirements.seen_from
    for index in survey.planned:
        by_floor.setdefault(index, Goal(_floor_name(survey.floors, index), *all_of, of_patch == index))
    goals = (*(by_floor[index] for index in survey.planned), Goal(OVERALL, *all_of, scope), *others)
    names = [goal.name for goal in goals]
    if twice := [name for name in names if names.count(name) > 1]:
        raise RequirementError(
            f"requirement {twice[0]!r}: got the name of another requirement, expected a unique one; rename it"
        )
    found = Goals(requirements, goals, required, _nothing_to_spare(survey, requirements))
    _check_size(found)
    return found


def _nothing_to_spare(survey: Survey, requirements: Requirements) -> tuple[str, ...]:
    elements = survey.scene.elements
    return tuple(
        f"requirement {part.name!r}: the building has nothing of {pattern!r}, which need not be covered, expected "
        f"{known_classes(elements, pattern)}"
        for part in requirements.parts
        if part.coverage == 0
        for pattern in part.classes
        if pattern not in NO_COVER and not elements_named(elements, pattern).any()
    )


def _check_size(goals: Goals) -> None:
    """Refuse more stacked patches than have a number, or targets over them that memory would not hold."""
    n_goals, n_qualities, n_patches = len(goals.each), len(goals.qualities), goals.patches.size
    n_stacked = n_qualities * n_patches
    if n_stacked > _MOST_STACKED or n_goals * n_stacked > _MOST_TARGET_BYTES:
        raise RequirementError(
            f"requirements: got {n_goals} with {n_qualities} different sets of limits on {n_patches} patches, expected "
            "fewer, which memory holds; use the same limits for several requirements, or take larger patches"
        )


def _where(survey: Survey) -> str:
    return "" if survey.scope is None or survey.scope.kind == Scope.ALL else f" in scope {survey.scope.kind}"


def _floor_name(floors: tuple[Floor, ...], index: int) -> str:
    """Name of a floor, with its id where another one has it too."""
    name = floors[index].name
    return name if [floor.name for floor in floors].count(name) == 1 else f"{name} ({floors[index].id})"


def _floors_of(survey: Survey, part: PartRequirement) -> tuple[int, ...]:
    """Indices of the floors that a part names; none where it names none."""
    if not part.floors:
        return ()
    try:
        floors = planned_floors(survey.floors, part.floors)
    except RequirementError as error:
        raise RequirementError(f"requirement {part.name!r}: {error}") from error
    if left_out := [survey.floors[index].name for index in floors if index not in survey.planned]:
        raise RequirementError(
            f"requirement {part.name!r}: got floor {left_out[0]!r}, which is not planned, expected a planned one; "
            "plan it too or leave this requirement out"
        )
    return floors


def _of_classes(survey: Survey, part: PartRequirement, *, needed: bool = True) -> BoolArray:
    """(P,) bool, patches of elements whose class or name fits one of the part's patterns; all where it has none.

    needed : refuse patterns that nothing fits.
    """
    scene, patches = survey.scene, survey.patches
    if not part.classes:
        return np.ones(patches.n_patches, dtype=np.bool_)
    wanted = np.zeros(len(scene.elements), dtype=np.bool_)
    for pattern in part.classes:
        fitting = elements_named(scene.elements, pattern)
        if needed and not fitting.any():
            raise RequirementError(
                f"requirement {part.name!r}: got class {pattern!r}, of which the building has nothing, expected "
                f"{known_classes(scene.elements, pattern)}; * stands for any letters"
            )
        wanted |= fitting
    on_element: BoolArray = np.repeat(wanted[scene.element_of_triangle], np.diff(patches.first_patch))
    return on_element


def _in_zone(survey: Survey, part: PartRequirement) -> BoolArray | np.bool_:
    """(P,) bool, patches with their centroid over the part's zone and between its heights, ends included."""
    inside: BoolArray | np.bool_ = np.True_
    if not (part.zone or part.heights_m):
        return inside
    centroids_m = patch_triangles(survey.scene, survey.patches).mean(axis=1) + survey.scene.offset_m
    if part.zone:
        inside = over_polygon(centroids_m[:, :2], np.array(part.zone, dtype=np.float64))
        if not inside.any():
            vertices_m = survey.scene.vertices_m + survey.scene.offset_m
            low, high = vertices_m.min(axis=0), vertices_m.max(axis=0)
            raise RequirementError(
                f"requirement {part.name!r}: got a zone with nothing in it, expected one over the building, "
                f"x {low[0]:.2f} to {high[0]:.2f} m, y {low[1]:.2f} to {high[1]:.2f} m; give the building's own "
                "coordinates"
            )
    if part.heights_m is not None:
        inside = inside & (centroids_m[:, 2] >= part.heights_m[0]) & (centroids_m[:, 2] <= part.heights_m[1])
    return inside
