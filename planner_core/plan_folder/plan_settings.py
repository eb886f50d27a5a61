"""From plan.json back to what the plan was made from: `PlanSettings`, `LoadOptions`, and the scene file.

Input the document of `planner_core.plan_folder.plan_json.read_plan_json`. Whoever plans the found scene again with the
settings read here gets the same document, but for its droppable keys.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from planner_core.errors import PlanFolderError
from planner_core.model import (
    Asked,
    Doors,
    Glass,
    GroundPick,
    KeepOut,
    NetworkKind,
    Objective,
    PartRequirement,
    PlanSettings,
    Requirements,
    Role,
    ScanBy,
    Scanner,
    SettledStation,
    Site,
    UpAxis,
)
from planner_core.model.choices import one_of
from planner_core.model.options import method_of
from planner_core.scene.load import LoadOptions

_Read = TypeVar("_Read")


def settings_of(document: Mapping[str, Any]) -> PlanSettings:
    """Read the settings that a plan was made with.

    Notes
    -----
    `scan_mode` is the one that was used, `beams` or `patches`, where it was left to `auto`.

    Raises
    ------
    PlanFolderError
        A key is missing, as in plans of earlier versions, or holds what the writer never wrote; it is named.
    RequirementError
        A setting of the document makes no sense, as of one that was edited.
    """
    plan = _Part(document, "")
    settings, options = plan.part("settings"), plan.part("method_options")
    return PlanSettings(
        scanner=_scanner(plan.part("scanner")),
        requirements=_requirements(plan.part("requirements")),
        objective=one_of(Objective, settings.text("objective"), "objective"),
        max_stations=settings.whole_or_none("max_stations"),
        method=method_of(plan.text("method"), ((name, options.text(name)) for name in options)),
        seed=plan.whole("seed"),
        grid_step_m=settings.number("grid_step_m"),
        instrument_heights_m=settings.numbers("instrument_heights_m"),
        height_step_m=settings.number("height_step_m"),
        clearance_m=settings.number("clearance_m"),
        ground_ring_radius_m=settings.number("ground_ring_radius_m"),
        n_ground_ring_rays=settings.whole("n_ground_ring_rays"),
        special_places=settings.yes("special_places"),
        max_patch_area_m2=settings.number("max_patch_area_m2"),
        scan_mode=one_of(ScanBy, settings.text("scan_mode"), "scan_mode"),
        site=_site(plan.part("site")),
        refine=settings.yes("refine"),
        seconds_per_scan=settings.number_or_none("seconds_per_scan"),
        set_up_s=settings.number("set_up_s"),
        walking_m_per_s=settings.number("walking_m_per_s"),
    )


def load_options_of(document: Mapping[str, Any]) -> LoadOptions:
    """Read the options that the scene was loaded with; raises `PlanFolderError` as `settings_of` does."""
    told = _Part(document, "").part("scene").part("load_options")
    up_axis = told.text_or_none("up_axis")
    return LoadOptions(
        metres_per_unit=told.number_or_none("metres_per_unit"),
        up_axis=None if up_axis is None else one_of(UpAxis, up_axis, "up_axis"),
        skip_bad_faces=told.yes("skip_bad_faces"),
        glass=one_of(Glass, told.text("glass"), "glass"),
        doors=one_of(Doors, told.text("doors"), "doors"),
    )


def find_scene(plan_folder: Path, document: Mapping[str, Any], told: Path | None = None) -> Path:
    """Find the scene file that a plan was made from, and check that it still is that file.

    Looked for where the user says; without that where plan.json says it was, beside the plan folder, and in the working
    directory.

    Raises
    ------
    PlanFolderError
        There is none, or only one of other contents.
    """
    scene = _Part(document, "").part("scene")
    name, digest = scene.text("file"), scene.text("sha256")
    if told is not None:
        if not told.is_file():
            raise PlanFolderError(f"{told}: no such file, expected the scene {name}; check --scene")
        if _sha256(told) != digest:
            raise PlanFolderError(
                f"{told}: is another file than the one that {plan_folder} was planned on, expected {name} of SHA-256 "
                f"{digest[:12]}...; give that one with --scene, or plan again"
            )
        return told
    others = []
    for path in _places_of_scene(plan_folder, document, name):
        if path.is_file():
            if _sha256(path) == digest:
                return path
            others.append(path)
    if others:
        raise PlanFolderError(
            f"{others[0]}: has changed since {plan_folder} was planned, expected {name} of SHA-256 {digest[:12]}...; "
            "plan again, or name the file of then with --scene"
        )
    raise PlanFolderError(
        f"{plan_folder}: its scene {name} is not found where it was, beside the folder or in the working directory; "
        "name it with --scene"
    )


def _places_of_scene(plan_folder: Path, document: Mapping[str, Any], name: str) -> Iterator[Path]:
    # The way was written from where the folder really is, see `planner_core.plan_folder.plan_json`.
    folder = plan_folder.resolve()
    if document.get("source") is not None:
        yield folder / _Part(document, "").part("source").text("path")
    yield folder.parent / name
    yield Path.cwd() / name


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise PlanFolderError(
            f"{path}: can't be read ({error.strerror or error}), expected the scene; check its permissions"
        ) from error


# ----------------------------------------------------------------------------------------- parts of it
def _scanner(of: _Part) -> Scanner:
    azimuths, accuracy = of.numbers("azimuth_range_rad"), of.numbers_or_none("ranging_accuracy")
    return Scanner(
        name=of.text("name"),
        title=of.text("title"),
        source=of.text("source"),
        range_min_m=of.number("range_min_m"),
        range_max_m=of.number("range_max_m"),
        n_azimuths=of.whole("n_azimuths"),
        elevation_rad=of.numbers("elevation_rad"),
        instrument_height_min_m=of.number("instrument_height_min_m"),
        instrument_height_max_m=of.number("instrument_height_max_m"),
        azimuth_range_rad=of.two("azimuth_range_rad") if azimuths else None,
        azimuth_offset_rad=of.numbers("azimuth_offset_rad"),
        inverted=of.yes("inverted"),
        mode=of.text("mode"),
        seconds_per_scan=of.number_or_none("seconds_per_scan"),
        range_noise=tuple(each.three() for each in of.each("range_noise")),
        ranging_accuracy=None if accuracy is None else of.two("ranging_accuracy"),
        angular_accuracy_rad=of.number_or_none("angular_accuracy_rad"),
        beam_divergence_rad=of.number_or_none("beam_divergence_rad"),
        beam_diameter_m=of.number_or_none("beam_diameter_m"),
        beam_width_at=of.text("beam_width_at"),
        wavelength_m=of.number_or_none("wavelength_m"),
        dual_axis_compensator=of.yes_or_none("dual_axis_compensator"),
    )


def _requirements(of: _Part) -> Requirements:
    return Requirements(
        coverage=of.number("coverage"),
        overlap=of.number("overlap"),
        floors=of.texts("floors"),
        asked=_asked(of.part("asked")),
        seen_from=of.whole("seen_from"),
        reflectivity=of.number("reflectivity"),
        parts=tuple(_part(part) for part in of.each("parts")),
        network=one_of(NetworkKind, of.text("network"), "network"),
        min_strength=of.number("min_strength"),
    )


def _asked(of: _Part) -> Asked:
    return Asked(**{field.name: of.number_or_none(field.name) for field in fields(Asked)})


def _part(of: _Part) -> PartRequirement:
    return PartRequirement(
        name=of.text("name"),
        coverage=of.number("coverage"),
        asked=_asked(of.part("asked")),
        seen_from=of.whole("seen_from"),
        floors=of.texts("floors"),
        classes=of.texts("classes"),
        zone=tuple(corner.two() for corner in of.each("zone")),
        heights_m=None if of.numbers_or_none("heights") is None else of.two("heights"),
    )


def _site(of: _Part) -> Site:
    return Site(
        entrances_m=tuple(place.three() for place in of.each("entrances")),
        keep_out=tuple(
            KeepOut(
                outline_m=tuple(corner.two() for corner in area.each("outline")),
                floor=area.text("floor"),
                access=area.yes("access"),
                name=area.text("name"),
            )
            for area in of.each("keep_out")
        ),
        settled=tuple(_settled(station) for station in of.each("settled")),
        mover_radius_m=of.number_or_none("mover_radius_m"),
        step_m=of.number_or_none("step_m"),
        mover_height_m=of.number_or_none("mover_height_m"),
        opens_doors=of.yes("opens_doors"),
        start_m=None if of.numbers_or_none("start") is None else of.three("start"),
        end_m=None if of.numbers_or_none("end") is None else of.three("end"),
        returns=of.yes("returns"),
        ground_picks=tuple(
            GroundPick(point_m=pick.three("point"), is_ground=pick.yes("is_ground"), floor=pick.text("floor"))
            for pick in of.each("ground_picks")
        ),
    )


def _settled(of: _Part) -> SettledStation:
    radius_m = of.number_or_none("radius_m")
    return SettledStation(
        id=of.text("id"),
        position_m=of.three("position"),
        role=one_of(Role, of.text("role"), "role"),
        floor=of.text("floor"),
        instrument_height_m=of.number_or_none("instrument_height_m"),
        radius_m=SettledStation.radius_m if radius_m is None else radius_m,
    )


# ---------------------------------------------------------------------------------------------- values
class _Part:
    """A value of the document and the way to it, for messages. Methods without a key read the value itself."""

    def __init__(self, value: Any, at: str) -> None:
        self._value = value
        self._at = at

    def __iter__(self) -> Iterator[str]:
        return iter(_checked(self._value, self._at, "keys", lambda value: isinstance(value, Mapping)))

    def _get(self, key: str | None) -> tuple[Any, str]:
        if key is None:
            return self._value, self._at
        at = f"{self._at}.{key}" if self._at else key
        if key not in _checked(self._value, self._at, "keys", lambda value: isinstance(value, Mapping)):
            raise PlanFolderError(
                f"plan.json: has no {at}, expected one of this version of tlsplan, which could be planned again from; "
                "plan again"
            )
        return self._value[key], at

    def _read(self, key: str | None, what: str, is_one: Callable[[Any], bool]) -> Any:
        value, at = self._get(key)
        return _checked(value, at, what, is_one)

    def _unless_none(self, key: str, read: Callable[[str], _Read]) -> _Read | None:
        return None if self._get(key)[0] is None else read(key)

    def part(self, key: str) -> _Part:
        """A mapping."""
        return _Part(self._read(key, "keys", lambda value: isinstance(value, Mapping)), self._get(key)[1])

    def each(self, key: str | None) -> list[_Part]:
        """Entries of a list."""
        values = self._read(key, "a list", lambda value: isinstance(value, list))
        return [_Part(value, f"{self._get(key)[1]}[{number}]") for number, value in enumerate(values)]

    def text(self, key: str | None = None) -> str:
        """A text."""
        return str(self._read(key, "a text", lambda value: isinstance(value, str)))

    def text_or_none(self, key: str) -> str | None:
        """A text or null."""
        return self._unless_none(key, self.text)

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of texts."""
        return tuple(each.text() for each in self.each(key))

    def yes(self, key: str) -> bool:
        """True or false."""
        return bool(self._read(key, "true or false", lambda value: isinstance(value, bool)))

    def yes_or_none(self, key: str) -> bool | None:
        """True, false or null."""
        return self._unless_none(key, self.yes)

    def whole(self, key: str) -> int:
        """A whole number."""
        return int(self._read(key, "a whole number", lambda v: isinstance(v, int) and not isinstance(v, bool)))

    def whole_or_none(self, key: str) -> int | None:
        """A whole number or null."""
        return self._unless_none(key, self.whole)

    def number(self, key: str | None = None) -> float:
        """A finite number."""
        return float(self._read(key, "a number", _is_number))

    def number_or_none(self, key: str) -> float | None:
        """A finite number or null."""
        return self._unless_none(key, self.number)

    def numbers(self, key: str | None) -> tuple[float, ...]:
        """A list of finite numbers."""
        return tuple(each.number() for each in self.each(key))

    def numbers_or_none(self, key: str) -> tuple[float, ...] | None:
        """A list of finite numbers or null."""
        return self._unless_none(key, self.numbers)

    def two(self, key: str | None = None) -> tuple[float, float]:
        """Two finite numbers."""
        a, b = self._counted(key, 2)
        return a, b

    def three(self, key: str | None = None) -> tuple[float, float, float]:
        """Three finite numbers."""
        a, b, c = self._counted(key, 3)
        return a, b, c

    def _counted(self, key: str | None, n: int) -> tuple[float, ...]:
        values = self.numbers(key)
        return _checked(values, self._get(key)[1], f"{n} numbers", lambda value: len(value) == n)  # type: ignore[no-any-return]


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _checked(value: Any, at: str, what: str, is_one: Callable[[Any], bool]) -> Any:
    if not is_one(value):
        shown = repr(value) if len(repr(value)) <= 60 else f"{repr(value)[:57]}..."
        raise PlanFolderError(f"plan.json: {at or 'the document'} is {shown}, expected {what}; plan again")
    return value
