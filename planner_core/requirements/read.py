"""Requirements as users state them: a YAML or JSON file, or the same entries from elsewhere, to `Requirements`.

Entries, units and rules: docs/formats/requirements.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import Asked, NetworkKind, PartRequirement, Requirements
from planner_core.positions.outlines import LEAST_AREA_M2, area_of_outline_m2, crossing_sides
from planner_core.requirements.document import read_document
from planner_core.requirements.quantities import (
    angle_rad,
    coordinate_m,
    count,
    length_m,
    plain_number,
    refusal,
    share,
    shown,
)

_LIMITS = ("spacing", "range", "incidence", "noise")
_OF_ANY = ("coverage", *_LIMITS, "seen_from")
_OVERALL = (*_OF_ANY, "reflectivity", "overlap", "network", "link_strength", "planned_floors")
_TOP = (*_OVERALL, "floors", "classes", "zones", "site")
_FLOOR = (*_OF_ANY, "name", "classes")
_CLASS = (*_OF_ANY, "name", "floors")
_ZONE = (*_OF_ANY, "name", "outline", "heights", "floors", "classes")
#: What a part says to ask no limit where one is asked of all.
_ANY = "any"
_Made = TypeVar("_Made")

_MOST_PARTS, _MOST_CORNERS, _MOST_NAMES, _MOST_LETTERS = 200, 10_000, 1000, 200


def read_requirements(
    path: Path | str, *, instead: Mapping[str, object] | None = None
) -> tuple[Requirements, dict[str, Any]]:
    """Read a file of requirements, and its entry `site` as it is, for `planner_core.positions.site_reading`.

    Parameters
    ----------
    path
        YAML, or JSON where the name ends in `.json`.
    instead
        Entries that take the place of the file's own, as from the command line: `{"spacing": "6 mm"}`. Parts that do
        not say otherwise follow them.

    Raises
    ------
    RequirementError
        The file can't be read, or says something that is not understood; one line, with the entry.
    """
    at = Path(path)
    own = _with_names(instead or {}, _TOP, "options")
    requirements_from(own, where="options")  # what they get wrong is not the file's fault
    return requirements_from({**_with_names(read_document(at), _TOP, str(at)), **own}, where=str(at))


def requirements_from(
    entries: Mapping[str, object], *, where: str = "requirements"
) -> tuple[Requirements, dict[str, Any]]:
    """Read the entries of a file of requirements, and return its site as it is; raises as `read_requirements` does."""
    said = _with_names(entries, _TOP, where)
    defaults = Requirements()
    asked = _asked(said, where, Asked())
    coverage = _coverage(said, where, defaults.coverage)
    seen_from = _seen_from(said, where, defaults.seen_from)
    follow = PartRequirement(name="all", coverage=coverage, asked=asked, seen_from=seen_from)
    site = said.get("site")
    if site is not None and not isinstance(site, dict):
        raise refusal(f"{where}: site", site, "entries such as entrances", "see docs/formats/requirements.md")
    strength, reflectivity, overlap = (said.get(name) for name in ("link_strength", "reflectivity", "overlap"))
    requirements = _in_file(
        where,
        Requirements,
        coverage=coverage,
        asked=asked,
        seen_from=seen_from,
        floors=_names(said.get("planned_floors"), f"{where}: planned_floors"),
        overlap=defaults.overlap if overlap is None else share(overlap, f"{where}: overlap", zero=True, example="30 %"),
        reflectivity=defaults.reflectivity
        if reflectivity is None
        else share(reflectivity, f"{where}: reflectivity", example="80 %"),
        network=_network(said.get("network"), where, defaults.network),
        min_strength=defaults.min_strength
        if strength is None
        else plain_number(strength, f"{where}: link_strength", least=0.0, most=1.0),
        parts=_parts(said, where, follow),
    )
    return requirements, site or {}


def _parts(said: dict[str, Any], where: str, follow: PartRequirement) -> tuple[PartRequirement, ...]:
    """Requirements of floors, then classes, then zones; each follows what is asked of all where it says nothing."""
    parts: list[PartRequirement] = []
    for section, keys in (("floors", _FLOOR), ("classes", _CLASS)):
        for name, entry in _section(said.get(section), f"{where}: {section}").items():
            at = f"{where}: {section} / {name}"
            # `Level 1: 98 %` is short for its coverage.
            own = _with_names(entry if isinstance(entry, dict) else {"coverage": entry}, keys, at)
            parts.append(_part(own, at, follow, name=name, own_floors=section == "floors"))
    zones = said.get("zones") or []
    if not isinstance(zones, list):
        raise refusal(f"{where}: zones", zones, "a list of zones, each with name and outline", "begin each with a dash")
    for number, entry in enumerate(zones, 1):
        at = f"{where}: zones / {number}"
        own = _with_names(entry, _ZONE, at)
        if not any(own.get(key) for key in ("outline", "heights", "floors", "classes")):
            raise RequirementError(
                f"{at}: got a zone of no extent, expected outline or heights; give its corners as [[x, y], ...]"
            )
        parts.append(_part(own, at, follow, name=_name(own.get("name", f"zone {number}"), f"{at} / name")))
    if len(parts) > _MOST_PARTS:
        raise refusal(
            where, f"{len(parts)} parts", f"at most {_MOST_PARTS}", "ask the same of several floors or classes"
        )
    return tuple(parts)


def _part(
    own: dict[str, Any], where: str, follow: PartRequirement, *, name: str, own_floors: bool | None = None
) -> PartRequirement:
    """One part. `name` is its floor's or class's where `own_floors` says which of both, else only a name."""
    floors = (name,) if own_floors else _names(own.get("floors"), f"{where} / floors")
    classes = (name,) if own_floors is False else _names(own.get("classes"), f"{where} / classes")
    return _in_file(
        where,
        PartRequirement,
        name=name if own_floors is None else _name(own.get("name", name), f"{where} / name"),
        coverage=_coverage(own, where, follow.coverage, sign=" / "),
        asked=_asked(own, where, follow.asked, sign=" / "),
        seen_from=_seen_from(own, where, follow.seen_from, sign=" / "),
        floors=floors,
        classes=classes,
        zone=_outline(own.get("outline"), f"{where} / outline"),
        heights_m=_heights(own.get("heights"), f"{where} / heights"),
    )


def _in_file(where: str, make: Callable[..., _Made], **values: Any) -> _Made:
    """Make a dataclass of the model, whose own refusals do not know the file."""
    try:
        return make(**values)
    except RequirementError as error:
        raise RequirementError(f"{where}: {error}") from error


def _asked(said: dict[str, Any], where: str, follow: Asked, *, sign: str = ": ") -> Asked:
    """Limits that are said, others as in `follow`; `any` is none."""

    def limit(key: str, default: float | None) -> float | None:
        value = said.get(key)
        if value is None:
            return default
        if isinstance(value, str) and value.strip().casefold() == _ANY:
            return None
        what = f"{where}{sign}{key}"
        if key == "incidence":
            return angle_rad(value, what)
        if key == "range":
            return length_m(value, what, bare=(1.0, 10_000.0), most=10_000.0, example="20 m")
        # Nobody asks for 0.1 mm between points or of noise, so that numbers below 0.1 are metres.
        return length_m(value, what, bare=(0.0, 0.1), most=1.0, example="6 mm" if key == "spacing" else "2 mm")

    return Asked(
        spacing_m=limit("spacing", follow.spacing_m),
        range_m=limit("range", follow.range_m),
        incidence_rad=limit("incidence", follow.incidence_rad),
        noise_m=limit("noise", follow.noise_m),
    )


def _coverage(said: dict[str, Any], where: str, default: float, *, sign: str = ": ") -> float:
    value = said.get("coverage")
    return default if value is None else share(value, f"{where}{sign}coverage")


def _seen_from(said: dict[str, Any], where: str, default: int, *, sign: str = ": ") -> int:
    value = said.get("seen_from")
    return default if value is None else count(value, f"{where}{sign}seen_from")


def _network(value: object, where: str, default: NetworkKind) -> NetworkKind:
    if value is None:
        return default
    try:
        return NetworkKind(value.strip().casefold() if isinstance(value, str) else "")
    except ValueError:
        known = ", ".join(NetworkKind)
        raise refusal(f"{where}: network", value, f"one of {known}", f"leave it out for {default}") from None


def _section(value: object, what: str) -> dict[str, Any]:
    """Entries by name; empty where there are none."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise refusal(what, value, "names, each with what is asked of it", "e.g. Level 1: {coverage: 98 %}")
    return {_name(name, what): entry for name, entry in value.items()}


def _name(value: object, what: str) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        value = str(value)
    if not isinstance(value, str) or not value.strip() or len(value) > _MOST_LETTERS or not value.isprintable():
        raise refusal(what, value, f"a name of at most {_MOST_LETTERS} letters", "put it in quotes")
    return value.strip()


def _names(value: object, what: str) -> tuple[str, ...]:
    """A name, or a list of names."""
    if value is None:
        return ()
    names = value if isinstance(value, list) else [value]
    if not names or len(names) > _MOST_NAMES:
        raise refusal(what, value, f"1 to {_MOST_NAMES} names", "leave it out for all")
    return tuple(_name(name, what) for name in names)


def _heights(value: object, what: str) -> tuple[float, float] | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 2:
        raise refusal(what, value, "the lowest and the highest, such as [0.5, 2.0]", "in metres, as the building has z")
    return coordinate_m(value[0], what), coordinate_m(value[1], what)


def _outline(value: object, what: str) -> tuple[tuple[float, float], ...]:
    """Corners of a polygon that does not cross itself and encloses something."""
    if value is None:
        return ()
    if not isinstance(value, list) or not 3 <= len(value) <= _MOST_CORNERS:
        raise refusal(what, value, f"3 to {_MOST_CORNERS} corners", "give them as [[x, y], ...]")
    if wrong := [each for each in value if not isinstance(each, list) or len(each) != 2]:
        raise refusal(what, wrong[0], "corners of two numbers", "give them as [[x, y], ...], without z")
    corners = tuple((coordinate_m(x, what), coordinate_m(y, what)) for x, y in value)
    if corners[0] == corners[-1]:  # closed, as GIS programs write them
        corners = corners[:-1]
    if len(set(corners)) < 3 or len(set(corners)) < len(corners):
        raise refusal(what, value, "corners that all differ, three or more", "take out those that are there twice")
    outline_m = np.array(corners)
    if crossing := crossing_sides(outline_m):
        which = f"sides {crossing[0] + 1} and {crossing[1] + 1} do"
        raise refusal(what, value, "an outline that does not cross itself", f"{which}; give its corners in order")
    if area_of_outline_m2(outline_m) < LEAST_AREA_M2:
        raise refusal(what, value, "an outline around some area", "give its corners in order, in metres")
    return corners


def _with_names(value: object, known: tuple[str, ...], where: str) -> dict[str, Any]:
    """Entries by their known names; capitals, spaces and hyphens do not matter."""
    if not isinstance(value, Mapping):
        raise refusal(where, value, f"entries such as {known[0]}", "see docs/formats/requirements.md")
    found: dict[str, Any] = {}
    for key, entry in value.items():
        name = "_".join(str(key).casefold().replace("-", " ").replace("_", " ").split())
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.6)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
            raise RequirementError(f"{where}: got the unknown entry {shown(key)}, expected a known one; {hint}")
        if name in found:
            raise RequirementError(f"{where}: got {name} twice, expected it once; leave one out")
        found[name] = entry
    return found
