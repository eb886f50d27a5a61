"""A plan against where the scanner really stood: what moved, missing and additional stations cost, and what to do.

Input an open `LivePlan` and matched stations (scene frame, metres); output figures of the plan and of what was scanned,
by the same reckoning, and the fewest further stations that meet the requirements again.

The gain of each further station (`RescanGain`) is the area that the scans don't see, floor by floor, and the components
that it joins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.as_scanned.matching import WITHIN_M, Match
from planner_core.errors import StationListError
from planner_core.model import (
    FloatArray,
    Link,
    NetworkKind,
    Objective,
    PartResult,
    Plan,
    PlanSettings,
    PriorStation,
    Proven,
    Registration,
    Requirements,
    Role,
    Station,
)
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import place_stations
from planner_core.planning.live.draft import Draft, DraftStation, Place
from planner_core.planning.live.figures import LeftSurface, left_surfaces
from planner_core.planning.live.live_plan import DraftFigures, LivePlan
from planner_core.planning.plan import plan_survey
from planner_core.planning.set_up import SET_UP_LOSS
from planner_core.positions.candidates import as_written_m
from planner_core.progress import Progress, ProgressEvent, silent

#: Stations this near to their planned place stand on it: list and plan may differ by the rounding of coordinates.
SAME_PLACE_M = 0.001
#: A crew sets up a tripod over a mark to about this: nearer stations are as planned. Their figures are still those of
#: where they stood, for a link that stands at its limit falls with ten centimetres.
AS_PLANNED_M = 0.1
STAGE = "comparing"
#: What became of a station, in the order in which people read about it.
AS_PLANNED, MOVED, MISSING, SCANNED_BEFORE, ADDITIONAL, NOT_COMPARED = FATES = (
    "as planned", "moved", "missing", "scanned before", "additional", "not compared",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class StationStatus:
    """What became of one station. id : the plan's; of an additional one its own. listed_as : empty: it is not listed.

    moved_m : (3,) float64; zeros where it is not known or makes no sense. position_m : (3,) float64, scene frame, where
    it stood or, missing, should have. lost_m2 : covered area that this change alone costs, less than nothing where it
    is a gain.
    """

    id: str
    listed_as: str
    fate: str
    matched_by: str
    floor: str
    position_m: FloatArray
    moved_m: FloatArray
    lost_m2: float


@dataclass(frozen=True, eq=False)
class AsScanned:
    """planned, actual : figures of the plan's stations and of those that were scanned. draft : the latter.

    lost : surfaces that the plan's stations see and these don't, largest first. lost_links, new_links : links that
    count, of one only. warnings : one line each.
    """

    stations: tuple[StationStatus, ...]
    draft: Draft
    planned: DraftFigures
    actual: DraftFigures
    lost: tuple[LeftSurface, ...]
    lost_links: tuple[Link, ...]
    new_links: tuple[Link, ...]
    warnings: tuple[str, ...]

    @property
    def met(self) -> bool:
        """Whether the requirements are still met, as far as the plan met it."""
        return is_met(self.planned.plan, self.actual.plan)

    def of_fate(self, fate: str) -> tuple[StationStatus, ...]:
        """Stations of one fate, in their order."""
        return tuple(station for station in self.stations if station.fate == fate)


@dataclass(frozen=True, eq=False)
class Rescan:
    """plan : scanned stations, which are fixed, and the further ones. further : these alone, in walking order.

    figures : of all of them, by the reckoning of the earlier plan. met : they meet the requirements again, as far as
    the plan met it. purposes : of the further ones, in their order.
    """

    plan: Plan
    further: tuple[Station, ...]
    figures: DraftFigures
    met: bool
    purposes: tuple[RescanGain, ...] = ()


def is_met(planned: Plan, found: Plan) -> bool:
    """Whether requirements and network are met; where the plan itself missed one, as good as in the plan."""
    parts = zip(planned.requirements, found.requirements, strict=True)
    return all(is_part_met(was, now) for was, now in parts) and is_network_met(planned, found)


def is_part_met(was: PartResult, now: PartResult) -> bool:
    """Whether one requirement is met, or missed by no more than the plan does, but for what setting up may cost."""
    return now.fraction_of_achievable >= min(now.required, was.fraction_of_achievable) - SET_UP_LOSS - 1e-9


def is_network_met(planned: Plan, found: Plan) -> bool:
    """Whether the stations are connected as required, or as well as the plan's."""
    was, now = registration_of(planned), registration_of(found)
    if planned.settings.requirements.network == NetworkKind.NONE or now.met:
        return True
    return not was.met and len(now.networks) <= len(was.networks) and (now.connected or not was.connected)


def is_network_met_as_required(plan: Plan) -> bool:
    """Whether the stations are connected as required, whatever another plan had."""
    return plan.settings.requirements.network == NetworkKind.NONE or registration_of(plan).met


def registration_of(plan: Plan) -> Registration:
    """Return how the stations of a draft's plan are connected, which it always has."""
    assert plan.registration is not None
    return plan.registration


# ------------------------------------------------------------------------------------------------ comparison
def compare_as_scanned(
    live: LivePlan, matches: Sequence[Match], *, floors: Collection[str] = (), progress: Progress = silent
) -> AsScanned:
    """Compare what was scanned to the plan.

    Parameters
    ----------
    live
        Of the plan.
    matches
        From `matched`: each planned station once, then additional ones.
    floors
        Ids of those that are compared; empty: all. Stations of the others are taken to stand where planned, whatever
        the list has there.

    Raises
    ------
    StationListError
        A station of unknown height: listed with its ground point, and without instrument height.
    DeviceError
        The device fails.
    """
    everywhere, warnings = _placed(live, matches, floors)
    pairs = [pair for pair in zip(matches, everywhere, strict=True) if not _is_stray(*pair, floors)]
    stations = [each for _, each in pairs if each is not None]
    draft = Draft(tuple(stations), scanned=frozenset(each.id for each in stations if each.fixed))
    planned, actual = live.figures(live.draft), live.figures(draft)
    fates = []
    for number, (match, there) in enumerate(pairs):
        progress(ProgressEvent(STAGE, number, len(pairs)))
        fates.append(_fate(live, match, there, planned.plan, floors))
    progress(ProgressEvent(STAGE, len(pairs), len(pairs)))
    seen_from = live.settings.requirements.seen_from
    gone = (planned.plan.times_seen >= seen_from) & (actual.plan.times_seen < seen_from) & planned.plan.achievable
    return AsScanned(
        stations=tuple(fates),
        draft=draft,
        planned=planned,
        actual=actual,
        lost=left_surfaces(live.survey, gone),
        lost_links=_links_without(planned.plan, actual.plan),
        new_links=_links_without(actual.plan, planned.plan),
        warnings=warnings,
    )


def _links_without(of: Plan, other: Plan) -> tuple[Link, ...]:
    there = {frozenset((link.a, link.b)) for link in counted_links(other)}
    return tuple(link for link in counted_links(of) if frozenset((link.a, link.b)) not in there)


def counted_links(plan: Plan) -> tuple[Link, ...]:
    """Links that are good enough."""
    return tuple(link for link in plan.links if registration_of(plan).counts(link))


def _is_elsewhere(match: Match, floors: Collection[str]) -> bool:
    """Whether it is of a planned station on a floor that is not compared."""
    return bool(floors) and match.planned is not None and match.planned.floor_id not in floors


def _is_stray(match: Match, there: DraftStation | None, floors: Collection[str]) -> bool:
    """Whether it is of an additional station on a floor that is not compared."""
    return bool(floors) and match.planned is None and there is not None and there.floor not in floors


def _placed(
    live: LivePlan, matches: Sequence[Match], floors: Collection[str]
) -> tuple[list[DraftStation | None], tuple[str, ...]]:
    """Return where each match's station stands, None where nobody scanned there; and what is odd about places."""
    known = {station.id: station for station in live.draft.stations}
    taken = set(known)
    placed: list[DraftStation | None] = []
    remarks: list[str] = []
    for match in matches:
        if _is_elsewhere(match, floors):
            assert match.planned is not None
            placed.append(known[match.planned.id])
        elif match.actual is None:
            assert match.planned is not None
            before = known[match.planned.id]
            placed.append(before if before.fixed else None)
        elif match.planned is not None and float(np.linalg.norm(match.moved_m)) <= SAME_PLACE_M:
            placed.append(replace(known[match.planned.id], fixed=True))
        else:
            name = match.planned.id if match.planned is not None else _free_name(match.actual.id, taken)
            taken.add(name)
            station, lines = _elsewhere(live, match, name)
            placed.append(station)
            remarks += () if _is_stray(match, station, floors) else lines
    return placed, tuple(remarks)


def _free_name(name: str, taken: set[str]) -> str:
    """Return the name of an additional station; matched by place it may bear one of the plan's."""
    while name in taken:
        name = f"{name} as listed"
    return name


def _elsewhere(live: LivePlan, match: Match, name: str) -> tuple[DraftStation, tuple[str, ...]]:
    actual = match.actual
    assert actual is not None
    position_m, height_m = _sensor(match)
    floor = actual.floor
    if floor is None and match.planned is not None and float(np.linalg.norm(match.moved_m)) <= WITHIN_M:
        floor = match.planned.floor_id
    given = GivenStation(name, position_m, height_m, floor)
    (station,), remarks = place_stations(live.tripods, [given], live.reach.space)
    x, y, z = station.position_m.tolist()
    height = station.instrument_height_m
    return DraftStation(name, station.floor, (x, y, z), None if math.isnan(height) else height, fixed=True), remarks


def _sensor(match: Match) -> tuple[FloatArray, float | None]:
    """Sensor (3,), scene frame, and instrument height: the list's, else, of a ground point, the planned one."""
    actual = match.actual
    assert actual is not None
    if not actual.is_ground:
        return actual.position_m, actual.instrument_height_m
    height_m = math.nan if match.planned is None else match.planned.instrument_height_m
    if math.isnan(height_m):
        raise StationListError(
            f"station {actual.id}: is listed by its ground point without instrument height, and the plan has none for "
            "it; add a column instrument_height"
        )
    return actual.position_m + np.array([0.0, 0.0, height_m]), height_m


def _fate(
    live: LivePlan, match: Match, there: DraftStation | None, planned: Plan, floors: Collection[str]
) -> StationStatus:
    known = {station.id: station for station in live.draft.stations}
    offset_m = live.survey.scene.offset_m
    zeros = np.zeros(3)
    if match.planned is None:
        assert there is not None and match.actual is not None
        lost_m2 = _lost_m2(live, live.draft.having(there), planned)
        at_m = there.at_m + offset_m
        return StationStatus(there.id, match.actual.id, ADDITIONAL, "", there.floor, at_m, zeros, lost_m2)
    before = known[match.planned.id]
    if _is_elsewhere(match, floors):
        return StationStatus(before.id, "", NOT_COMPARED, "", before.floor, before.at_m + offset_m, zeros, 0.0)
    if match.actual is None:
        fate = SCANNED_BEFORE if there is not None else MISSING
        lost_m2 = 0.0 if there is not None else _lost_m2(live, live.draft.without(before.id), planned)
        at_m = before.at_m + offset_m
        return StationStatus(before.id, "", fate, "", before.floor, at_m, zeros, lost_m2)
    assert there is not None
    moved = there.position_m != before.position_m
    moved_m = there.at_m - before.at_m
    lost_m2 = _lost_m2(live, live.draft.having(there), planned) if moved else 0.0
    # Lists round: a station that stands at the very limit is within it.
    is_off = float(np.linalg.norm(moved_m)) > AS_PLANNED_M + SAME_PLACE_M
    fate, at_m = MOVED if is_off else AS_PLANNED, there.at_m + offset_m
    return StationStatus(before.id, match.actual.id, fate, match.by, there.floor, at_m, moved_m, lost_m2)


def _lost_m2(live: LivePlan, draft: Draft, planned: Plan) -> float:
    """Area that a plan with this one change covers less."""
    return planned.coverage.covered_area_m2 - live.figures(draft).plan.coverage.covered_area_m2


# ------------------------------------------------------------------------------------------------ scanning again
def plan_rescan(live: LivePlan, found: AsScanned, *, progress: Progress = silent) -> Rescan:
    """Plan the fewest further stations: those scanned are fixed, missing ones are taken first where as few do.

    The requirements are the plan's; where the plan itself covered less, as much as it did.

    Raises
    ------
    RequirementError
        Nothing meets it, as where a keep-out zone leaves no position.
    DeviceError
        The device fails.
    """
    settings = rescan_settings(live, found)
    plan = plan_survey(live.survey, settings, live.engine, progress=progress)
    scanned = {station.id for station in found.draft.stations}
    further = tuple(station for station in plan.stations if station.id not in scanned)
    drafted = tuple(_as_draft(station) for station in further)
    figures = live.figures(replace(found.draft, stations=(*found.draft.stations, *drafted)))
    purposes = purposes_of(live, found.draft, drafted, lambda each: is_met(found.planned.plan, each))
    return Rescan(plan, further, figures, is_met(found.planned.plan, figures.plan), purposes)


def rescan_settings(live: LivePlan, found: AsScanned) -> PlanSettings:
    """Return the settings that further stations are planned with."""
    before, offset_m = live.settings, live.survey.scene.offset_m
    prior = [station for station in before.site.prior if station.role == Role.FORBIDDEN]
    # Of floors that are not compared nobody knows whether they are scanned: they stay in the plan.
    to_come = {station.id for station in found.of_fate(NOT_COMPARED)}
    prior += [
        _prior(station, Role.LOCKED if station.id in to_come and not station.fixed else Role.SCANNED, offset_m)
        for station in found.draft.stations
    ]
    missing = {station.id for station in found.of_fate(MISSING)}
    prior += [_prior(station, Role.KEPT, offset_m) for station in live.draft.stations if station.id in missing]
    return replace(
        before,
        method=before.method if isinstance(before.method, Proven) else Proven(),
        objective=Objective.FEWEST,
        max_stations=None,
        requirements=_as_good_as(before.requirements, found.planned.plan),
        site=replace(before.site, prior=tuple(prior)),
    )


def _prior(station: DraftStation, role: Role, offset_m: FloatArray) -> PriorStation:
    x, y, z = as_written_m(station.at_m + offset_m).tolist()
    return PriorStation(station.id, (x, y, z), role, station.floor, station.instrument_height_m)


def _as_good_as(required: Requirements, planned: Plan) -> Requirements:
    """Require no more coverage than the plan had: with a limit of stations that is less than was required."""
    reached = {result.name: max(result.fraction_of_achievable, 1e-6) for result in planned.requirements}
    names = {part.name for part in required.parts}
    others = [fraction for name, fraction in reached.items() if name not in names]
    parts = tuple(
        replace(part, coverage=min(part.coverage, reached.get(part.name, 0.0))) for part in required.parts
    )  # parts of which nothing is required have no result
    return replace(required, coverage=min([required.coverage, *others]), parts=parts)


def _as_draft(station: Station) -> DraftStation:
    x, y, z = station.position_m.tolist()
    place: Place = (x, y, z)
    height = station.instrument_height_m
    return DraftStation(station.id, station.floor, place, None if math.isnan(height) else height)


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
