"""What a run plans with: the plan's own settings, with what the request asks and what the review decided."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner_core.documents import key_of
from planner_core.model import Objective, PlanSettings, PriorStation, Proven, Requirements, Role
from planner_core.model.choices import one_of
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_settings import load_options_of, settings_of
from planner_core.requirements.read import requirements_from
from planner_core.review.replan import load_options_with_review, settings_with_review
from planner_core.review.store import ReviewStore
from planner_core.scene.load import LoadOptions
from viewer_web.server.jobs.documents import RunRequest

_WHERE = "requirements"
#: Entries that stay as in the plan where they are not given: a plan always has them.
_STAYING = {
    "coverage": "coverage",
    "overlap": "overlap",
    "overlap_measure": "overlap_measure",
    "overlap_of": "overlap_of",
    "network": "network",
    "reflectivity": "reflectivity",
    "link_strength": "min_strength",
    "link_probability": "min_probability",
    "doors_change": "doors_change",
    "targets": "targets",
    "scope": "scope",
}
_PARTS = frozenset({"floors", "classes", "zones"})


def run_settings(basis: Path, request: RunRequest, *, begun_m: Sequence[Sequence[float]] = ()) -> PlanSettings:
    """Return the settings of a run.

    Parameters
    ----------
    basis
        Folder with the plan.json and the review.usda that it is requested on.
    begun_m
        Stations that the search begins with: (x, y, z), scene frame.

    Raises
    ------
    PlanFolderError
        The plan or its review can't be read, or are of an earlier version.
    RequirementError, ReviewError
        The request makes no sense.
    """
    planned = settings_of(read_plan_json(basis))
    requirements, site = requirements_from(request.requirements, where=_WHERE)
    settings = replace(
        planned,
        requirements=_following(requirements, request.requirements, planned.requirements),
        site=site if "site" in _named(request.requirements) else planned.site,
        objective=Objective.FEWEST,
        max_stations=None,
        method=_method(planned, request.time_limit_s),
    )
    if request.from_review:
        store = ReviewStore(basis)
        settings = settings_with_review(settings, store.current(), store.plan())
    objective = one_of(Objective, request.objective, "objective")
    if objective != Objective.FEWEST:  # which keep nothing
        settings = _with_prior(settings, lambda station: station.role != Role.KEPT)
    settings = _with_prior(settings, lambda station: station.role != Role.BEGUN, *_begun(begun_m))
    return replace(settings, objective=objective, max_stations=request.max_stations)


def run_load_options(basis: Path, request: RunRequest) -> tuple[LoadOptions, ...]:
    """Return how a run reads each file of the scene; raises `PlanFolderError` as `run_settings` does."""
    options = load_options_of(read_plan_json(basis))
    if not request.from_review:
        return options
    review = ReviewStore(basis).current()
    return tuple(load_options_with_review(each, review) for each in options)


def _following(requested: Requirements, entries: Mapping[str, Any], planned: Requirements) -> Requirements:
    """The requirements of the request, others as in the plan."""
    named_entries = _named(entries)
    staying = {field: getattr(planned, field) for entry, field in _STAYING.items() if entry not in named_entries}
    if not named_entries & _PARTS:
        return replace(requested, **staying, parts=planned.parts)
    # Obstacles stay what they are unless the request names them: its form is about what is to be covered.
    named = {part.name for part in requested.parts}
    obstacles = (part for part in planned.parts if part.coverage == 0 and part.name not in named)
    return replace(requested, **staying, parts=(*requested.parts, *obstacles))


def _named(entries: Mapping[str, Any]) -> set[str]:
    """Entries that say something, by the names that `requirements_from` takes them for."""
    return {key_of(name) for name, value in entries.items() if value is not None}


def _method(planned: PlanSettings, time_limit_s: float | None) -> Proven:
    """Method proven as in the plan, with the limit of time of the request."""
    kept = planned.method if isinstance(planned.method, Proven) else Proven()
    return replace(kept, time_limit_s=time_limit_s)


def _begun(places_m: Sequence[Sequence[float]]) -> list[PriorStation]:
    return [
        PriorStation(f"begun-{number}", (float(x), float(y), float(z)), Role.BEGUN)
        for number, (x, y, z) in enumerate(places_m, start=1)
    ]


def _with_prior(settings: PlanSettings, stays: Callable[[PriorStation], bool], *more: PriorStation) -> PlanSettings:
    prior = (*filter(stays, settings.site.prior), *more)
    return replace(settings, site=replace(settings.site, prior=prior))
