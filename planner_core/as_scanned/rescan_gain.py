"""What each further station is for: area that the scans don't see, floor by floor, and networks that it joins.

Input an open `LivePlan` and drafts (local frame, metres); output `RescanGain`s, areas in m2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from planner_core.model import Plan, Registration
from planner_core.planning.live.draft import Draft, DraftStation
from planner_core.planning.live.live_plan import LivePlan


@dataclass(frozen=True)
class RescanGain:
    """Of one further station.

    for_lost : it is one of those that do, together, for what was lost; the others are for what the plan did not meet
    either. gains_m2 : by floor, what this station alone adds to the scans, where it does. joins : ids of networks,
    largest first, that all the other stations together leave apart, and it joins; never one.
    """

    station: str
    for_lost: bool
    gains_m2: tuple[tuple[str, float], ...]
    joins: tuple[tuple[str, ...], ...]


def purposes_of(
    live: LivePlan, scanned: Draft, further: Sequence[DraftStation], is_back: Callable[[Plan], bool]
) -> tuple[RescanGain, ...]:
    """Return what further stations are for, in their order; is_back : whether a plan has again what was lost."""
    before = live.figures(scanned).plan
    gains_m2 = {each.id: _gains_m2(before, live.figures(scanned.having(each)).plan) for each in further}
    everything = replace(scanned, stations=(*scanned.stations, *further))
    after = live.figures(everything).plan
    order = sorted(further, key=lambda each: sum(area_m2 for _, area_m2 in gains_m2[each.id]))
    needed = everything
    if is_back(after):
        for each in order:  # those that add least go first
            fewer = needed.without(each.id)
            needed = fewer if is_back(live.figures(fewer).plan) else needed
    return tuple(
        RescanGain(
            each.id,
            each.id in needed.ids,
            gains_m2[each.id],
            _joined_by(each.id, after.registration, live.figures(everything.without(each.id)).plan.registration),
        )
        for each in further
    )


def _gains_m2(before: Plan, after: Plan) -> tuple[tuple[str, float], ...]:
    floors = zip(before.survey.floors, before.coverage_by_floor, after.coverage_by_floor, strict=True)
    gains = ((floor.id, now.covered_area_m2 - was.covered_area_m2) for floor, was, now in floors)
    return tuple((floor, gain_m2) for floor, gain_m2 in gains if gain_m2 > 0.0)


def _joined_by(
    station: str, registration: Registration | None, without: Registration | None
) -> tuple[tuple[str, ...], ...]:
    if registration is None or without is None:
        return ()
    network = next(set(each.stations) for each in registration.networks if station in each.stations)
    parts = tuple(each.stations for each in without.networks if network & set(each.stations))
    return parts if len(parts) > 1 else ()
