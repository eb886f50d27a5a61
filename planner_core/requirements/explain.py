"""Why a requirement can't be met in part: which surfaces, how much of them, and the limit to blame.

A `Survey` and a `Demand` -> lines for the user. What no position sees at all is not about requirements and not here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.coverage.coverage import MIN_UNSEEN_M2, times_seen
from planner_core.model import BoolArray, Int64Array, Survey
from planner_core.requirements.demand import Demand, blamed
from planner_core.requirements.goals import Goal
from planner_core.requirements.wording import area_in_words, figure_in_words, limits_in_words, name_of

#: Elements listed of each requirement and cause.
_MOST_LISTED = 5


@dataclass(frozen=True)
class Shortfall:
    """Surface of one element that positions see, but not as required.

    floor : index, -1 none. limit : the field of `PointLimits` without which the most of it would meet the rest,
    `seen_from` where it is met but from too few positions, empty where several limits are in the way at once. least,
    greatest : of the figures that the limit would have to be, area for area; NaN where there is none or none is known.
    """

    goal: str
    element: int
    floor: int
    area_m2: float
    limit: str
    least: float
    greatest: float


def explain(survey: Survey, demand: Demand) -> tuple[str, ...]:
    """Lines on each requirement that is impossible in part: a summary, then its elements by area, largest first."""
    lines: list[str] = []
    found = shortfalls(survey, demand)
    for goal in demand.goals.each:
        own = sorted((each for each in found if each.goal == goal.name), key=lambda each: -each.area_m2)
        if own:
            area_m2 = sum(each.area_m2 for each in own)
            lines.append(
                f"requirement {goal.name!r}: {area_in_words(area_m2)} that candidates see can't be scanned with "
                f"{limits_in_words(goal.limits, goal.seen_from)}, and do not count"
            )
            lines.extend(f"  {_in_words(survey, demand, goal, each)}" for each in own[:_MOST_LISTED])
            if len(own) > _MOST_LISTED:
                rest = sum(each.area_m2 for each in own[_MOST_LISTED:])
                lines.append(f"  {len(own) - _MOST_LISTED} more elements, {area_in_words(rest)}")
    return tuple(lines)


def shortfalls(survey: Survey, demand: Demand) -> tuple[Shortfall, ...]:
    """What positions see but can't see as required, by requirement, element and floor; slivers are left out.

    Of requirements with the same limits on surfaces of another one, the largest is reported.
    """
    seen = times_seen(demand.rows.seen) > 0
    # One number an element and floor; floor -1 is number 0.
    of_triangle = survey.scene.element_of_triangle.astype(np.int64) * (len(survey.floors) + 1)
    of_patch = np.repeat(of_triangle + survey.floor_of_triangle + 1, np.diff(survey.patches.first_patch))
    found: list[Shortfall] = []
    for goal in _widest(demand.goals.each):
        met = demand.times_met[demand.goals.quality_of(goal)] > 0
        missed = goal.patches & seen & ~demand.achievable(goal)
        found.extend(_of_goal(survey, demand, goal, missed & met, of_patch, few=True))
        found.extend(_of_goal(survey, demand, goal, missed & ~met, of_patch, few=False))
    return tuple(found)


def _widest(goals: tuple[Goal, ...]) -> tuple[Goal, ...]:
    """Goals without those that a goal of the same limits holds whole."""

    def holds(one: Goal, other: Goal) -> bool:
        same = one.limits == other.limits and one.seen_from == other.seen_from
        return same and not (other.patches & ~one.patches).any()

    return tuple(
        goal
        for i, goal in enumerate(goals)
        # Of two that hold each other, the first stays.
        if not any(holds(other, goal) and not (i < k and holds(goal, other)) for k, other in enumerate(goals) if k != i)
    )


def _of_goal(
    survey: Survey, demand: Demand, goal: Goal, missed: BoolArray, of_patch: Int64Array, *, few: bool
) -> list[Shortfall]:
    """Shortfalls of the patches `missed`, (P,) bool, a line an element and floor; `few`: met, but from too few."""
    area_m2 = demand.area_m2[: demand.n_patches]
    areas = np.bincount(of_patch[missed], weights=area_m2[missed])
    found = []
    for number in np.flatnonzero(areas >= MIN_UNSEEN_M2):
        patches = missed & (of_patch == number)
        limit = "seen_from" if few else blamed(demand, goal, patches) or ""
        least, greatest = np.nan, np.nan
        if limit and not few:
            figures = demand.needed[demand.goals.quality_of(goal)][limit][patches]
            figures = figures[np.isfinite(figures)]
            least, greatest = (figures.min(), figures.max()) if figures.size else (np.nan, np.nan)
        element, floor = divmod(int(number), len(survey.floors) + 1)
        found.append(
            Shortfall(goal.name, element, floor - 1, float(areas[number]), limit, float(least), float(greatest))
        )
    return found


def _in_words(survey: Survey, demand: Demand, goal: Goal, one: Shortfall) -> str:
    element = survey.scene.elements[one.element]
    floor = f", {survey.floors[one.floor].name}" if one.floor >= 0 else ""
    file = f", {name}" if (name := survey.scene.file_of(one.element)) else ""
    return f"{element.name} ({element.kind}{floor}{file}): {area_in_words(one.area_m2)}, {_cause(demand, goal, one)}"


def _cause(demand: Demand, goal: Goal, one: Shortfall) -> str:
    if one.limit == "seen_from":
        return f"met from fewer than {goal.seen_from} of {demand.rows.seen.n_positions} candidates"
    if not one.limit:
        return "several limits combined prevent it"
    limit = getattr(goal.limits, one.limit)
    name, required = name_of(one.limit), figure_in_words(one.limit, limit)
    if np.isnan(one.least):
        return f"{name} is not known there, {required} required"
    low, high = figure_in_words(one.limit, one.least), figure_in_words(one.limit, one.greatest)
    best = low if low == high else f"{low} to {high}"
    return f"{name} is at best {best}, {required} required"
