"""Planning again with what reviewers decided: PlanSettings, Review -> PlanSettings.

=====================  ===============================================================================================
in the review          in the plan that is made again
=====================  ===============================================================================================
locked station         is in it
other station          *kept*: stays where that can be, wherever it was moved to
rejected station       is not kept, and no station comes within half a metre of it
station taken out      is not kept; its place may be chosen again, `forbid` it where it must not be
forbidden place        no station within its radius
keep-out zone          nobody goes there
priority zone          a requirement of its own: those of all, with the zone's coverage
ground pick            surfaces that are ground, or are not
entrance               before those of the plan; the route begins at the first
door                   open or shut, whatever it was
progress               nothing: scanned stations are in the settings
=====================  ===============================================================================================

Scanned stations stay as they are. What was locked or kept in the earlier plan is so as far as the review leaves it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from planner_core.errors import ReviewError
from planner_core.model.choices import Role
from planner_core.model.planning import PlanSettings
from planner_core.model.requirements import PartRequirement, Requirements
from planner_core.model.review import ForbiddenPlace, PlanUnderReview, Review, ReviewedStation, Zone
from planner_core.model.site import KeepOut, PriorStation, Site
from planner_core.review.stations import reviewed_stations
from planner_core.scene.load import LoadOptions

REJECTED_RADIUS_M = 0.5
"""About the grid's step: the next spot over is another station."""


def settings_with_review(settings: PlanSettings, review: Review, plan: PlanUnderReview) -> PlanSettings:
    """Return the settings to plan again with.

    Parameters
    ----------
    settings
        Of the plan, or with other requirements.
    review, plan
        What was decided, and on which plan.

    Raises
    ------
    ReviewError
        A station is both locked and rejected.
    """
    return dataclasses.replace(
        settings,
        site=_site(settings.site, review, plan),
        requirements=_requirements(settings.requirements, review),
    )


def load_options_with_review(options: LoadOptions, review: Review) -> LoadOptions:
    """Return the options to load the scene with again: doors as reviewers set them, others as they were."""
    if not review.doors:
        return options

    def those(state: str, before: tuple[str, ...]) -> tuple[str, ...]:
        chosen = {door for door, now in review.doors.items() if now == state}
        return tuple(sorted(chosen | (set(before) - review.doors.keys())))

    return dataclasses.replace(
        options, doors_open=those("open", options.doors_open), doors_shut=those("shut", options.doors_shut)
    )


def _site(site: Site, review: Review, plan: PlanUnderReview) -> Site:
    before = tuple(station for station in site.prior if station.role in (Role.SCANNED, Role.FORBIDDEN))
    stations = (*before, *_prior(review, plan))
    site = site_with_areas(dataclasses.replace(site, prior=stations), review, plan)
    return dataclasses.replace(
        site.entered_at(review.entrances_m),
        ground_picks=(
            *site.ground_picks,
            *(pick for _, pick in sorted(review.ground_picks.items(), key=lambda item: (len(item[0]), item[0]))),
        ),
    )


def site_with_areas(site: Site, review: Review, plan: PlanUnderReview) -> Site:
    """Return a site with the keep-outs and forbidden places of reviewers as well."""
    keep_outs = (_keep_out(zone) for zone in _in_order(review) if zone.kind == "keep_out")
    return dataclasses.replace(
        site, prior=(*site.prior, *_forbidden(review, plan)), keep_out=(*site.keep_out, *keep_outs)
    )


def _prior(review: Review, plan: PlanUnderReview) -> Iterator[PriorStation]:
    for station in reviewed_stations(plan, review):
        if station.fixed:
            continue  # it is in the settings, as scanned
        verdict = review.verdicts.get(station.id)
        if verdict is None or verdict.verdict != "rejected":
            yield _station(station, Role.LOCKED if station.locked else Role.KEPT)
        elif station.locked:
            raise ReviewError(
                f"station {station.id}: is locked, and {verdict.by} rejected it; unlock it or clear the verdict"
            )
        else:
            place = ForbiddenPlace("rejected", station.position_m, REJECTED_RADIUS_M, station.floor)
            yield _forbidden_place(place, f"rejected {station.id}", station.floor)


def _station(station: ReviewedStation, role: Role) -> PriorStation:
    return PriorStation(
        id=station.id,
        position_m=station.position_m,
        role=role,
        floor=station.floor,
        instrument_height_m=station.instrument_height_m,
    )


def _forbidden(review: Review, plan: PlanUnderReview) -> Iterator[PriorStation]:
    """A place without a floor is one on each: forbidden positions are on one floor."""
    for name, place in sorted(review.forbidden.items()):
        if place.floor:
            yield _forbidden_place(place, name, place.floor)
        else:
            for floor in plan.floor_elevations_m:
                yield _forbidden_place(place, f"{name} {floor}", floor)


def _forbidden_place(place: ForbiddenPlace, name: str, floor: str) -> PriorStation:
    return PriorStation(name, place.position_m, Role.FORBIDDEN, floor, radius_m=place.radius_m)


def _keep_out(zone: Zone) -> KeepOut:
    return KeepOut(zone.outline_m, floor=zone.floor, name=zone.name or zone.id)


def _requirements(requirements: Requirements, review: Review) -> Requirements:
    parts = list(requirements.parts)
    for zone in _in_order(review):
        if zone.kind == "priority":
            taken = {part.name for part in parts}
            name = zone.name or zone.id
            parts.append(
                PartRequirement(
                    name=f"{name} ({zone.id})" if name in taken else name,
                    coverage=zone.coverage or requirements.coverage,
                    limits=requirements.limits,
                    seen_from=requirements.seen_from,
                    floors=(zone.floor,) if zone.floor else (),
                    zone=zone.outline_m,
                )
            )
    return dataclasses.replace(requirements, parts=tuple(parts))


def _in_order(review: Review) -> list[Zone]:
    return [zone for _, zone in sorted(review.zones.items())]
