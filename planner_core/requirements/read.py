"""Requirements as users state them: a YAML or JSON file, or the same entries from elsewhere, to `Requirements`.

Entries and units: `planner_core.requirements.entries`; rules: docs/formats/requirements.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from planner_core.documents import key_of, read_as
from planner_core.errors import RequirementError
from planner_core.model import PartRequirement, PointLimits, Requirements, Scope, Site
from planner_core.requirements.deliverables import NO_DELIVERABLE, Deliverable, deliverable_named
from planner_core.requirements.entries import ClassEntries, FloorEntries, PartEntries, RequirementsFile, ZoneEntries
from planner_core.requirements.yaml_or_json import read_document

_Made = TypeVar("_Made")
_MOST_PARTS = 200


def read_requirements(
    path: Path | str,
    *,
    instead: Mapping[str, object] | None = None,
    deliverable: str = NO_DELIVERABLE,
    scope: Scope = Scope.ALL,
    no_cover: Sequence[str] = (),
) -> tuple[Requirements, Site]:
    """Read a file of requirements, with the site in it.

    Parameters
    ----------
    path
        YAML, or JSON where the name ends in `.json`.
    instead
        Entries that take the place of the file's own, as from the command line: `{"spacing": "6 mm"}`. Parts that do
        not say otherwise follow them.
    deliverable
        Name of the one whose limits hold if neither names another, see `planner_core.requirements.deliverables`.
    scope
        What counts if neither has one.
    no_cover
        Classes of which nothing is required, where the file has none.

    Raises
    ------
    RequirementError
        The file can't be read, or has an entry that is not understood; one line, with the entry.
    """
    at, own = Path(path), {key_of(key): value for key, value in (instead or {}).items()}
    requirements_from(own, where="options")  # what they get wrong is not the file's fault
    entries = read_document(at)
    return requirements_from(
        {**{key: value for key, value in entries.items() if key_of(key) not in own}, **own},
        where=str(at),
        deliverable=deliverable,
        scope=scope,
        no_cover=no_cover,
    )


def requirements_from(
    entries: Mapping[str, object],
    *,
    where: str = "requirements",
    deliverable: str = NO_DELIVERABLE,
    scope: Scope = Scope.ALL,
    no_cover: Sequence[str] = (),
) -> tuple[Requirements, Site]:
    """Read the entries of a file of requirements; raises as `read_requirements` does."""
    file = read_as(RequirementsFile, entries, f"{where}: ", remedy="see docs/formats/requirements.md")
    preset = deliverable_named(file.deliverable or deliverable)
    follow = PartRequirement(name="all", coverage=Requirements().coverage, limits=_limits_of(preset))
    of_all = _limits_and_coverage(file, follow, where)
    follow = PartRequirement(name="all", **of_all)
    options: dict[str, Any] = {"overlap": preset.overlap if file.overlap is None else file.overlap}
    options |= {"reflectivity": file.reflectivity, "network": file.network}
    options |= {"overlap_measure": file.overlap_measure, "overlap_of": file.overlap_of}
    options |= {"min_strength": file.link_strength, "floors": file.planned_floors}
    options |= {"min_probability": file.link_probability, "pre_alignment": file.pre_alignment}
    options |= {"doors_change": file.doors_change, "targets": file.targets}
    parts = tuple(_parts(file, where, follow))
    requirements = _in_file(
        where,
        Requirements,
        **of_all,
        scope=file.scope or scope,
        deliverable=None if preset.name == NO_DELIVERABLE else preset.name,
        **{name: value for name, value in options.items() if value is not None},
        parts=(*parts, *_obstacles(parts, no_cover)),
    )
    return requirements, Site() if file.site is None else file.site.site()


def _limits_of(preset: Deliverable) -> PointLimits:
    incidence_rad = None if preset.incidence_deg is None else math.radians(preset.incidence_deg)
    return PointLimits(preset.spacing_m, preset.range_m, incidence_rad, preset.noise_m)


def _parts(file: RequirementsFile, where: str, follow: PartRequirement) -> Iterator[PartRequirement]:
    """Requirements of floors, then classes, then zones; each follows what is required of all where it has no entry."""
    n_parts = len(file.floors or ()) + len(file.classes or ()) + len(file.zones or ())
    if n_parts > _MOST_PARTS:
        raise RequirementError(
            f"{where}: got {n_parts} parts, expected at most {_MOST_PARTS}; use one for several floors or classes"
        )
    for name, floor in (file.floors or {}).items():
        yield _part(floor, f"{where}: floors.{name}", follow, name, floors=(name,))
    for name, of_class in (file.classes or {}).items():
        yield _part(of_class, f"{where}: classes.{name}", follow, name, classes=(name,))
    for number, zone in enumerate(file.zones or ()):
        at = f"{where}: zones[{number}]"
        if not (zone.outline or zone.heights or zone.floors or zone.classes):
            raise RequirementError(
                f"{at}: got a zone of no extent, expected outline or heights; give its corners as [[x, y], ...]"
            )
        extent = {"zone": zone.outline or (), "heights_m": zone.heights}
        yield _part(zone, at, follow, f"zone {number + 1}", **extent)


def _obstacles(parts: tuple[PartRequirement, ...], no_cover: Sequence[str]) -> Iterator[PartRequirement]:
    """Parts of which nothing is required, but of classes that other parts name."""
    named = {pattern.casefold() for part in parts for pattern in (part.name, *part.classes)}
    for pattern in dict.fromkeys(no_cover):
        if pattern.casefold() not in named:
            yield PartRequirement(pattern, 0.0, classes=(pattern,))


def _part(
    own: FloorEntries | ClassEntries | ZoneEntries, where: str, follow: PartRequirement, name: str, **extent: Any
) -> PartRequirement:
    for key in {"floors", "classes"} - extent.keys():
        extent[key] = getattr(own, key, None) or ()
    return _in_file(where, PartRequirement, name=own.name or name, **extent, **_limits_and_coverage(own, follow, where))


def _limits_and_coverage(own: PartEntries, follow: PartRequirement, where: str) -> dict[str, Any]:
    """Coverage, limits and `seen_from`: those given, others as in `follow`."""

    def limit(given: float | None, default: float | None) -> float | None:
        return default if given is None else None if given == math.inf else given

    given = (own.spacing, own.range, own.incidence, own.noise)
    limits = (
        limit(each, getattr(follow.limits, field.name)) for each, field in zip(given, fields(PointLimits), strict=True)
    )
    return {
        "coverage": follow.coverage if own.coverage is None else own.coverage,
        "limits": _in_file(where, PointLimits, *limits),
        "seen_from": own.seen_from or follow.seen_from,
    }


def _in_file(where: str, make: Callable[..., _Made], *values: Any, **named: Any) -> _Made:
    """Make a dataclass of the model, whose own refusals do not know the file."""
    try:
        return make(*values, **named)
    except RequirementError as error:
        raise RequirementError(f"{where}: {error}") from error
