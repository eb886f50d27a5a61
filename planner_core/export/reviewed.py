"""Exports of a plan as its review leaves it: stations where reviewers put them, without those taken out.

Plan folder with review.usda -> a file. A format with figures of a plan whose stations were edited is made of a plan
that is evaluated anew; one with places alone is made of the plan's own, with a line on what no longer holds.
"""

from __future__ import annotations

import contextlib
import math
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from planner_core.child_process import progress_of_child
from planner_core.coordinates.request import FrameRequest
from planner_core.documents import to_document
from planner_core.errors import ExportError
from planner_core.export.chosen import named
from planner_core.export.formats import formats_named
from planner_core.export.options import Options
from planner_core.export.write import export_plan
from planner_core.model import Plan
from planner_core.model.review import PlanUnderReview, Review, ReviewedStation, StationEdit
from planner_core.plan_folder.plan_settings import ScenePaths, settings_of
from planner_core.plan_folder.plan_source import FieldStation, PlanSource, open_plan, station_numbers
from planner_core.progress import Progress, silent
from planner_core.review.replan import site_with_areas
from planner_core.review.stations import reviewed_stations
from planner_core.review.store import REVIEW_FILE, ReviewStore

OFFERED: Mapping[str, Options] = MappingProxyType(
    {
        "csv": Options(columns="generic"),
        "pdf": Options(),
        "html": Options(),
        "ifc": Options(),
        "ifc-model": Options(),
        "bcf": Options(),
    }
)
"""Formats that `export_reviewed` writes, and how."""
WITH_FIGURES = frozenset({"pdf", "html", "robot"})
"""Formats that are of coverage, registration or ways: they need the scene, once stations are edited."""
WITH_ROUTE = frozenset({"dxf", "geojson", "kml", "landxml"})
"""Those that draw the route between stations: without the scene they have the stations alone, once some are edited."""


def edited_stations(planned: PlanUnderReview, review: Review) -> tuple[str, ...]:
    """Ids of stations that stand elsewhere than planned, were added or taken out: what they are worth has changed."""
    return tuple(name for name, edit in review.stations.items() if _is_elsewhere(planned, name, edit))


def export_reviewed(
    name: str, folder: Path, target: Path, *, scene: ScenePaths = None, progress: Progress = silent
) -> tuple[str, ...]:
    """Write one of `OFFERED` of a plan as reviewed; return remarks for the user, one line each.

    folder : the plan folder; nothing is written into it. target : the file to write, which is not there. scene : where
    the scene files are, see `open_plan`. Raises as `opened_as_reviewed` and `export_plan`.
    """
    with opened_as_reviewed(folder, (name,), scene=scene, progress=progress) as (plan, remarks):
        return (*export_plan(name, plan, target, OFFERED[name], progress=progress).remarks, *remarks)


@contextlib.contextmanager
def opened_as_reviewed(
    folder: Path,
    names: Sequence[str],
    *,
    check: Callable[[PlanSource], None] | None = None,
    scene: ScenePaths = None,
    frame: FrameRequest | None = None,
    progress: Progress = silent,
) -> Iterator[tuple[PlanSource, tuple[str, ...]]]:
    """Open a plan folder as its review leaves it, for these formats, with remarks for the user, one line each.

    check : refuses the plan as it was made, before it is evaluated anew.

    Where stations were edited, and the scene is there, formats with a route or figures have a plan evaluated anew, in
    a folder that is gone at the end; its route visits the stations in the order of the review.

    Raises
    ------
    ExportError
        Figures of edited stations need the scene, which is not found; or all stations were taken out.
    PlanFolderError, CoordinatesError
        As `open_plan`; or the review can't be read.
    """
    plan = open_plan(folder, scene=scene, frame=frame)
    if check is not None:
        check(plan)
    names = [each.name for each in formats_named(names) if not each.holds_review or each.name == "bcf"]
    if not names or not (plan.folder / REVIEW_FILE).is_file():
        yield plan, ()
        return
    store = ReviewStore(plan.folder)
    planned, review = store.plan(), store.current()
    figures = [name for name in names if name in WITH_FIGURES]
    if figures:
        plan = _with_areas(plan, planned, review)
    edited = edited_stations(planned, review)
    if not (edited or (figures and review.entrances)):
        yield plan, ()
        return
    stations = reviewed_stations(planned, review)
    if not stations:
        raise ExportError(f"{', '.join(names)}: the review took all stations out, expected at least one; restore some")
    if figures or (plan.has_scene() and WITH_ROUTE & set(names)):
        _require_scene(plan, figures)
        with tempfile.TemporaryDirectory(prefix="tlsplan-reviewed-") as made:
            evaluated = _evaluated(plan, stations, review, Path(made), frame, progress)
            yield replace(evaluated, planned=plan), ()
        return
    source = replace(reviewed_source(plan, stations, edited), planned=plan)
    yield source, (_what_no_longer_holds(names, edited),)


def export_in_child(name: str, folder: str, target: str, scene: Sequence[str] | None) -> tuple[str, ...]:
    """Do what `export_reviewed` does, as a function for `planner_core.child_process.run_isolated`."""
    paths = None if scene is None else tuple(Path(path) for path in scene)
    return export_reviewed(name, Path(folder), Path(target), scene=paths, progress=progress_of_child)


def reviewed_source(plan: PlanSource, stations: Sequence[ReviewedStation], edited: Sequence[str]) -> PlanSource:
    """Return a plan with these stations in place of its own; areas of all, and links of edited ones, are not known.

    Parameters
    ----------
    stations
        As reviewed, in visiting order.
    edited
        Ids of those that are not what and where they were.
    """
    before = {station.id: station for station in plan.stations}
    names = {floor.id: floor.name for floor in plan.floors}
    numbers = station_numbers([station.id for station in stations])
    placed = tuple(
        _placed(plan, station, names.get(station.floor, station.floor), number, order, before.get(station.id))
        for order, (station, number) in enumerate(zip(stations, numbers, strict=True), start=1)
    )
    links = tuple(link for link in plan.links if not {link.a, link.b} & set(edited))
    # Its legs lead to stations that stand elsewhere now.
    document = {**plan.document, "route": None}
    return replace(plan, document=document, stations=placed, links=links)


def _placed(
    plan: PlanSource, station: ReviewedStation, floor_name: str, number: int, order: int, before: FieldStation | None
) -> FieldStation:
    covered_m2 = math.nan if before is None or station.moved else before.covered_area_m2
    return FieldStation(
        id=station.id,
        number=number,
        floor_id=station.floor,
        floor_name=floor_name,
        order=order,
        position_m=np.array(station.position_m, dtype=np.float64),
        instrument_height_m=math.nan if station.instrument_height_m is None else station.instrument_height_m,
        frame=plan.frame,
        fixed=station.fixed,
        own_area_m2=math.nan,
        covered_area_m2=covered_m2,
    )


def _what_no_longer_holds(names: Sequence[str], edited: Sequence[str]) -> str:
    text = f"stations as reviewed ({named(sorted(edited))} edited)"
    if tuple(names) == ("bcf",):
        return f"{text}; unseen surface is that of the plan as it was made"
    return f"{text}: numbered as planned, added ones last; what depends on what edited ones see is left out"


def _with_areas(plan: PlanSource, planned: PlanUnderReview, review: Review) -> PlanSource:
    """The plan with the keep-outs and forbidden places of its reviewers, for drawings and routes."""
    if not (review.forbidden or any(zone.kind == "keep_out" for zone in review.zones.values())):
        return plan
    site = site_with_areas(settings_of(plan.document).site, review, planned)
    return replace(plan, document={**plan.document, "site": to_document(site)})


def _require_scene(plan: PlanSource, names: Sequence[str]) -> None:
    try:
        plan.scene_paths()
    except ExportError as error:
        raise ExportError(
            f"{', '.join(names)}: figures of edited stations, and routes from other entrances, are computed from the "
            f"scene, which is not there: {error}"
        ) from error


def _evaluated(
    plan: PlanSource,
    stations: Sequence[ReviewedStation],
    review: Review,
    made: Path,
    frame: FrameRequest | None,
    progress: Progress,
) -> PlanSource:
    """The stations as a plan folder of their own below `made`; entered elsewhere, in an order of its own."""
    from planner_core.engine.open_engine import open_engine
    from planner_core.plan_folder.folder import write_plan_folder
    from planner_core.plan_folder.stations_csv import GivenStation
    from planner_core.planning.evaluate import evaluate_survey

    survey = plan.survey(progress=progress)
    engine = open_engine(survey.scene, survey.patches)
    given = [
        GivenStation(each.id, np.array(each.position_m), each.instrument_height_m, each.floor) for each in stations
    ]
    settings = settings_of(plan.document)
    settings = replace(settings, site=settings.site.entered_at(review.entrances_m))
    evaluated = evaluate_survey(survey, settings, given, engine, keeps_order=not review.entrances, progress=progress)
    folder = made / (plan.folder.name or "plan")
    write_plan_folder(_in_visiting_order(evaluated, stations), folder, engine=engine, progress=progress)
    return open_plan(folder, scene=plan.scene_paths(), frame=frame)


def _in_visiting_order(plan: Plan, stations: Sequence[ReviewedStation]) -> Plan:
    """Number stations as they are walked to; scanned are those alone whose scans exist."""
    fixed = {station.id: station.fixed for station in stations}
    visits = range(len(plan.stations)) if plan.route is None else plan.route.order.tolist()
    place = {index: order for order, index in enumerate(visits, start=1)}
    return replace(
        plan,
        stations=tuple(
            replace(station, order=place[index], fixed=fixed[station.id]) for index, station in enumerate(plan.stations)
        ),
    )


def _is_elsewhere(planned: PlanUnderReview, name: str, edit: StationEdit) -> bool:
    return edit.added or edit.removed or (edit.position_m is not None and planned.station(name) is not None)
