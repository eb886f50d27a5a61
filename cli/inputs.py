"""From option values to what the library takes: scene, settings, survey, engine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import METRES_PER_UNIT, FileOptions, MethodOptions, PriorStations, RequirementOptions
from .output import repairs

if TYPE_CHECKING:
    from planner_core.cluster.executor import Cluster
    from planner_core.engine.scan_engine import ScanEngine
    from planner_core.model import (
        Doors,
        LengthUnit,
        PlanSettings,
        PriorStation,
        Requirements,
        Scene,
        Scope,
        Site,
        Survey,
    )
    from planner_core.progress import Progress, ProgressEvent

    from .progress import ProgressReporter

#: What `--effort` sets of method proven, before `--set`.
_EFFORTS = {
    "quick": [("work_limit", "3"), ("prove", "false")],
    "normal": [],
    "proof": [("work_limit", "3000")],
}
#: A crew that scans a planned station stands at most so far from where it was planned.
_SAME_STATION_M = 2.0


@contextmanager
def opened_cluster(scheduler: str | None, reporter: ProgressReporter) -> Iterator[Cluster | None]:
    """Open the workers of a scheduler, where one is named."""
    if scheduler is None:
        yield None
        return
    from planner_core.cluster.executor import open_cluster

    with open_cluster(scheduler, tell=lambda line: reporter.warn([line])) as cluster:
        try:
            yield cluster
        finally:
            reporter.warn_last(cluster.last_words())


def _doors(reading: FileOptions) -> Doors:
    from planner_core.model import Doors

    if reading.join == "outside":
        if reading.doors == "closed":
            raise click.UsageError("--join outside leads through open doors: leave out --doors closed.")
        return Doors.OUTSIDE
    return Doors.SHUT if reading.doors == "closed" else Doors(reading.doors)


def load(scenes: Sequence[Path], reading: FileOptions, *, progress: Progress) -> Scene:
    """Load the scene files with the options of the command line."""
    from planner_core.model import Glass, UpAxis
    from planner_core.scene.load import LoadOptions, load_scene

    units = of_each(scenes, reading.units, "--units")
    ups = of_each(scenes, reading.up, "--up")
    options = [
        LoadOptions(
            metres_per_unit=METRES_PER_UNIT[unit] if unit else None,
            up_axis=UpAxis(up.upper()) if up else None,
            skip_bad_faces=reading.skip_bad_faces,
            glass=Glass(reading.glass),
            doors=_doors(reading),
            doors_open=tuple(reading.doors_open),
            doors_shut=tuple(reading.doors_closed),
            leave_out=tuple(reading.leave_out),
        )
        for unit, up in zip(units, ups, strict=True)
    ]
    return load_scene(scenes, options=options, progress=progress)


def _importing(progress: Progress, needed_later: Sequence[str]) -> Progress:
    """Progress that imports what is needed later, a module at each step of a child process that reads a file: this one
    would wait meanwhile. `module:function` calls the function.
    """
    from planner_core.errors import MissingPackageError

    left = iter(needed_later)

    def show(event: ProgressEvent) -> None:
        progress(event)
        name = next(left, "") if event.total else ""
        if name:
            module, _, function = name.partition(":")
            with suppress(ImportError, MissingPackageError, OSError):  # where it is needed, its lack is reported
                found = import_module(module)
                if function:
                    getattr(found, function)()

    return show


def of_each(scenes: Sequence[Path], given: Sequence[tuple[str, str]], option: str) -> list[str]:
    """Return the value for each file: that for it by name, else that for all, else empty.

    Raises
    ------
    RequirementError
        Of a file that is none of the scene's, or two things of one.
    """
    from planner_core.errors import RequirementError

    by_file: dict[str, str] = {}
    for file, value in given:
        if file and not any(file in (str(path), path.name) for path in scenes):
            names = ", ".join(path.name for path in scenes)
            raise RequirementError(
                f"{option}: got {file}={value}, expected one of the scene's files ({names}); correct it"
            )
        if by_file.setdefault(file, value) != value:
            of = f" of {file}" if file else ""
            raise RequirementError(
                f"{option}: got {by_file[file]} and {value}{of}, expected one; name the file of each, such as "
                f"{option} {scenes[0].name}={value}"
            )
    return [by_file.get(str(path)) or by_file.get(path.name) or by_file.get("", "") for path in scenes]


def settings(
    *,
    scanner: str | None,
    preset: str | None,
    asking: RequirementOptions,
    heights_m: Sequence[float],
    scan_mode: str,
    **plain: Any,
) -> PlanSettings:
    """Return the settings of a plan from the values of `options.problem_options`.

    plain : of options that are named after the field of `PlanSettings` that they set.
    """
    from planner_core.engine.patch_mode import mode_that_counts_parts
    from planner_core.model import PlanSettings, Scope, VisibilityMode
    from planner_core.requirements.deliverables import DEFAULT_DELIVERABLE, NO_DELIVERABLE
    from planner_core.requirements.goals import NO_COVER
    from planner_core.scanner import DEFAULT_SCANNER, PAPER_SCANNER
    from planner_core.scanner.load_scanner import load_scanner

    is_paper = preset == "paper"
    requirements, site = requirements_and_site(
        asking,
        deliverable=NO_DELIVERABLE if is_paper else DEFAULT_DELIVERABLE,
        scope=Scope.ALL if is_paper else Scope.AUTO,
        no_cover=() if is_paper else NO_COVER,
    )
    used = load_scanner(scanner or (PAPER_SCANNER if is_paper else DEFAULT_SCANNER))
    mode = VisibilityMode(scan_mode)
    return PlanSettings(
        scanner=used,
        requirements=requirements,
        instrument_heights_m=tuple(heights_m),
        scan_mode=mode if is_paper else mode_that_counts_parts(mode, used),
        site=site,
        **plain,
    )


def points_to_verify(points: int | None, *, preset: str | None = None, **_: object) -> int | None:
    """Random points to check a plan by: as many as given, none with the paper's preset, else the default (None)."""
    return 0 if points is None and preset == "paper" else points


def requirements_and_site(
    asking: RequirementOptions, *, deliverable: str, scope: Scope, no_cover: Sequence[str] = ()
) -> tuple[Requirements, Site]:
    """Return requirements and site: from the file where there is one, and the options in place of its entries.

    deliverable, scope, no_cover : where neither names one.

    Raises
    ------
    RequirementError
        A file or an option that is not understood.
    """
    from planner_core.requirements.read import read_requirements, requirements_from

    entries: dict[str, object] = {
        "deliverable": asking.deliverable,
        "scope": asking.scope,
        "coverage": None if asking.coverage is None else f"{asking.coverage!r} %",
        "overlap": None if asking.overlap is None else f"{asking.overlap!r} %",
        "link_probability": None if asking.link_probability is None else f"{asking.link_probability!r} %",
        "pre_alignment": asking.pre_alignment,
        "doors_change": asking.doors_change,
        "targets": asking.targets,
        "overlap_measure": asking.overlap_measure,
        "overlap_of": asking.overlap_of,
        "network": asking.network,
        "spacing": asking.spacing,
        "range": asking.range_,
        "incidence": asking.incidence,
        "noise": asking.noise,
        "seen_from": asking.seen_from,
        "planned_floors": list(asking.floors) or None,
    }
    spared = [name for name in asking.no_cover if name.casefold() != "none"] if asking.no_cover else no_cover
    defaults: dict[str, Any] = {"deliverable": deliverable, "scope": scope, "no_cover": spared}
    given = {name: value for name, value in entries.items() if value is not None}
    if asking.file is None:
        requirements, site = requirements_from(given, where="options", **defaults)
    else:
        requirements, site = read_requirements(asking.file, instead=given, **defaults)
    if asking.entrances:
        entrances = (numbers(text, "--entrance", "X,Y,Z", (3,)) for text in asking.entrances)
        site = replace(site, entrances_m=tuple((x, y, z) for x, y, z in entrances))
    return requirements, site


def numbers(
    text: str, option: str, form: str, sizes: tuple[int, ...], *, unit: LengthUnit | None = None
) -> list[float]:
    """Return the numbers of `1.5,2,0` or `4ft 11in,2,0`, metres; as many as one of `sizes`.

    unit : of numbers without one; None: metres.

    Raises
    ------
    RequirementError
        Others.
    """
    from planner_core.errors import RequirementError
    from planner_core.model import METRE
    from planner_core.requirements.quantities import coordinate_m

    of = unit or METRE
    try:
        values = [coordinate_m(part, unit=of) for part in text.split(",")]
    except RequirementError:
        values = []
    if len(values) not in sizes:
        raise RequirementError(f"{option}: got {text!r}, expected {form} in {of.many}, such as {_example(form)}")
    return values


def _example(form: str) -> str:
    """Return what a user may type for a form: as many numbers as that has, of the size that they have."""
    parts = form.partition(" or ")[0].split(",")
    like = {"E": "458870.25", "N": "5438260.5", "H": "110.3", "X": "1.5", "Y": "2"}
    return ",".join(like.get(part, "0") for part in parts)


def with_prior(problem: PlanSettings, prior_stations: PriorStations) -> PlanSettings:
    """Return the settings with the stations and positions given before planning, besides those of the site.

    Raises
    ------
    RequirementError, StationListError
        Lists that can't be read, places that are none, one id twice.
    """
    from planner_core.model import Role
    from planner_core.plan_folder.stations_csv import read_station_list
    from planner_core.requirements.site import check_ids, prior_from

    prior = list(problem.site.prior)
    for path, role in (
        (prior_stations.scanned, Role.SCANNED),
        (prior_stations.locked, Role.LOCKED),
        (prior_stations.kept, Role.KEPT),
    ):
        if path is not None:
            rows = read_station_list(path)
            prior += prior_from(
                ((row.id, tuple(row.position_m), row.floor, row.instrument_height_m) for row in rows), role
            )
    for text in prior_stations.forbidden:
        x, y, z, *radius = numbers(text, "--forbid", "X,Y,Z or X,Y,Z,RADIUS", (3, 4))
        place = ("", (x, y, z), None, None)
        prior += prior_from((place,), Role.FORBIDDEN, radius_m=radius[0] if radius else 0.5)
    prior = _kept_once(prior)
    check_ids(prior)
    return replace(problem, site=replace(problem.site, prior=tuple(prior)))


def _kept_once(prior: Sequence[PriorStation]) -> list[PriorStation]:
    """Drop kept stations that are scanned, locked or forbidden besides: of the same id, and about the same place.

    Raises
    ------
    RequirementError
        Of the same id, and far from each other: two lists that number different stations alike.
    """
    from planner_core.errors import RequirementError

    firm = {station.id: station for station in prior if station.role != "kept"}
    for station in prior:
        other = firm.get(station.id) if station.role == "kept" else None
        if other is None or other.role == "forbidden":
            continue
        away_m = math.dist(station.position_m, other.position_m)
        if away_m > _SAME_STATION_M:
            raise RequirementError(
                f"station {station.id}: got one that is {other.role} and one to be kept, {away_m:.1f} m away, expected "
                "different ids of different stations; rename one"
            )
    return [station for station in prior if station.role != "kept" or station.id not in firm]


def with_method(problem: PlanSettings, choosing: MethodOptions) -> PlanSettings:
    """Return the settings with a method, its options and the objective, from the values of `options.method_choice`.

    Raises
    ------
    RequirementError
        Text that is no NAME=VALUE, a search for a method that has none, or options that the method refuses.
    """
    from planner_core.errors import RequirementError
    from planner_core.model import Objective
    from planner_core.model.options import method_of

    method, search, time_limit_s = choosing.method, choosing.search, choosing.time_limit_s
    if search is not None and method != "paper":
        raise RequirementError(f"--search: got it with --method {method}, which has none; add --method paper")
    if time_limit_s is not None and method != "proven":
        raise RequirementError(f"--time-limit: got it with --method {method}, which has none; use --method proven")
    if choosing.max_stations is not None and choosing.objective != "coverage":
        raise RequirementError(
            f"--max-stations: got it with --objective {choosing.objective}, which has no such limit; add --objective "
            "coverage"
        )
    if choosing.max_stations is None and choosing.objective == "coverage":
        raise RequirementError(
            "--objective coverage: got no number of stations, expected a maximum number of them; add e.g. "
            "--max-stations 10"
        )
    if choosing.effort != "normal" and method != "proven":
        raise RequirementError(f"--effort: got it with --method {method}, which ends by itself; use --method proven")
    options = [("search", search)] if search is not None else []
    options += [("time_limit_s", repr(time_limit_s))] if time_limit_s is not None else []
    for text in choosing.assignments:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise RequirementError(f"--set: got {text!r}, expected NAME=VALUE, such as work_limit=120")
        options.append((name.strip(), value.strip()))
    names = {name for name, _ in options}
    options += [(name, value) for name, value in _EFFORTS[choosing.effort] if name not in names]
    if options and method == "greedy":
        raise RequirementError("--set: got it with --method greedy, which has no options; use method proven or paper")
    return replace(
        problem,
        method=method_of(method, options),
        objective=Objective(choosing.objective),
        max_stations=choosing.max_stations,
        refine=choosing.refine and choosing.effort != "quick",
    )


def open_survey(
    scenes: Sequence[Path],
    problem: PlanSettings,
    reading: FileOptions,
    reporter: ProgressReporter,
    *,
    engine: str,
    device: str | None,
    listed_in: str,
    needed_later: Sequence[str] = (),
) -> tuple[Survey, ScanEngine, tuple[str, ...]]:
    """Load the scene, find its floors and open the engine; tell each warning at once, and return them all.

    listed_in : where the user finds the faces that loading dropped. needed_later : see `_importing`.
    """
    from planner_core.planning import open_survey

    loaded = load(scenes, reading, progress=_importing(reporter.show, needed_later))
    of_scene = (*repairs(loaded.report, listed_in=listed_in), *loaded.report.warnings)
    reporter.warn(of_scene)
    survey, scan_engine = open_survey.open_survey(loaded, problem, engine=engine, device=device, progress=reporter.show)
    reporter.warn(survey.warnings)
    reporter.warn(scan_engine.warnings)
    return survey, scan_engine, (*of_scene, *survey.warnings, *scan_engine.warnings)
