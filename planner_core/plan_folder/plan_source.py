"""A plan folder as every format reads it: stations in walking order, floors and links, in both coordinates."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from planner_core.coordinates.frame import site_frame
from planner_core.coordinates.request import FrameRequest
from planner_core.coverage.percent import probability_percent, reached_percent
from planner_core.documents import read_as
from planner_core.errors import ExportError, PlanFolderError, one_line
from planner_core.model import FloatArray, Link, LinkLimits, Plan, Scene, SiteFrame, Survey
from planner_core.model.scene import scene_title
from planner_core.plan_folder.plan_json import plan_document, read_plan
from planner_core.plan_folder.plan_model.document import PlanDocument
from planner_core.plan_folder.plan_model.results import FloorSection, StationSection
from planner_core.plan_folder.plan_settings import ScenePaths, find_scene, load_options_of, settings_of
from planner_core.progress import Progress, silent

Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class FieldStation:
    """A station. Positions are (3,) float64, metres: `site_...` in the site's `frame`, the others in the scene's.

    The sensor is `instrument_height_m` above the ground point, straight up. NaN where the height is not known, as of
    given stations; the ground point's height is then NaN, too.
    """

    id: str
    number: int
    """Its own, whatever the order of visits: see `station_numbers`."""
    floor_id: str
    floor_name: str
    order: int
    """Place in the walk, from 1."""
    position_m: FloatArray
    """Of the sensor."""
    instrument_height_m: float
    frame: SiteFrame
    fixed: bool
    """It was scanned before, or given."""
    own_area_m2: float
    covered_area_m2: float
    note: str = ""

    @property
    def ground_m(self) -> FloatArray:
        """Below the sensor."""
        return np.asarray(self.position_m - np.array([0.0, 0.0, self.instrument_height_m]))

    @property
    def site_m(self) -> FloatArray:
        """Of the sensor."""
        return self.frame.to_site(self.position_m)

    @property
    def site_ground_m(self) -> FloatArray:
        """Below the sensor."""
        return self.frame.to_site(self.ground_m)


@dataclass(frozen=True, eq=False)
class RoomName:
    """A room that has a name, and its roomiest place on the ground. at_m : (2,) in plan, scene frame."""

    name: str
    floor_id: str
    at_m: FloatArray


@dataclass(frozen=True, eq=False)
class PlanSource:
    """What formats are written from.

    stations : in visiting order. floors : lowest first, as in plan.json. document : of plan.json. given_scene : scene
    files given by the user.
    """

    folder: Path
    document: Mapping[str, Any]
    frame: SiteFrame
    stations: tuple[FieldStation, ...]
    floors: tuple[FloorSection, ...]
    links: tuple[Link, ...]
    title: str
    given_scene: ScenePaths = None
    rooms: tuple[RoomName, ...] = ()
    planned: PlanSource | None = None
    """What this is a reviewed state of: formats that hold the review themselves are written from it."""
    _made: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False)

    def stations_of(self, floor_id: str) -> tuple[FieldStation, ...]:
        """Stations of one floor, in visiting order."""
        return tuple(station for station in self.stations if station.floor_id == floor_id)

    @property
    def min_overlap(self) -> float:
        """Overlap required of a link that counts."""
        return self.limits.overlap

    @property
    def limits(self) -> LinkLimits:
        """What a link needs in order to count."""
        return limits_of(self.document["registration"])

    def counts(self, link: Link) -> bool:
        """Whether a link is good enough, by what is required, to register the scans to each other."""
        return link.counts(self.limits)

    @property
    def link_noun(self) -> str:
        """Name of the figure of `link_percent`."""
        return "probability" if self.limits.probability > 0.0 else "overlap"

    def link_percent(self, link: Link) -> str:
        """Return, in percent, the figure that decides whether a link counts: its probability where one is required."""
        limits = self.limits
        if limits.probability > 0.0 and not math.isnan(link.probability):
            return probability_percent(link.probability, limits.probability)
        return reached_percent(link.overlap, limits.overlap)

    @property
    def scanned_before(self) -> frozenset[str]:
        """Ids of stations whose scans exist. `FieldStation.fixed` is wider: all stations of a given list are fixed."""
        prior = self.document.get("site", {}).get("settled", ())
        return frozenset(str(row["id"]) for row in prior if row["role"] == "scanned")

    def has_scene(self) -> bool:
        """Whether all scene files are found."""
        try:
            self.scene_paths()
        except ExportError:
            return False
        return True

    def scene_paths(self) -> tuple[Path, ...]:
        """Where the scene files are, in the order in which they were planned on.

        Raises
        ------
        ExportError
            One is not found, or is not the one that was planned on.
        """
        try:
            return find_scene(self.folder, self.document, self.given_scene)
        except PlanFolderError as error:
            raise ExportError(str(error)) from error

    def scene(self, *, progress: Progress = silent) -> Scene:
        """Load the scene as it was planned on; once, however often it is used.

        Raises
        ------
        ExportError
            The file is not found; the message names it and --scene.
        SceneError
            It can't be read.
        """
        from planner_core.scene.load import load_scene

        options = load_options_of(self.document)
        return self.once("scene", lambda: load_scene(self.scene_paths(), options=options, progress=progress))

    def once(self, what: Hashable, make: Callable[[], Made]) -> Made:
        """Return what `make` returns, called the first time alone: several formats need the same `what` of a plan."""
        if what not in self._made:
            self._made[what] = make()
        return self._made[what]  # type: ignore[no-any-return]

    def survey(self, *, progress: Progress = silent) -> Survey:
        """Make floors, patches and beams of the scene as they were planned with; once. Raises as `scene`."""
        from planner_core.coverage.survey import make_survey

        def made() -> Survey:
            return make_survey(self.scene(progress=progress), settings_of(self.document), progress=progress)

        return self.once("survey", made)


def open_plan(folder: Path, *, scene: ScenePaths = None, frame: FrameRequest | None = None) -> PlanSource:
    """Read a plan folder for formats to be written from it; the scene is left until somebody asks for it.

    Parameters
    ----------
    scene
        The scene file or files, where they are not beside the plan. None: searched for.
    frame
        The user's options for the site's coordinates.

    Raises
    ------
    PlanFolderError
        There is no plan, or a value of it is not as it is written.
    CoordinatesError
        The coordinates given can't be used.
    """
    there = folder if folder.is_dir() else folder.parent
    return _source(read_plan(folder), there, frame or FrameRequest(), scene, _rooms_in(there))


def source_of(plan: Plan) -> PlanSource:
    """Return a plan in memory as its folder will be read; what is wrong with its coordinates is a warning."""
    found = () if plan.rooms is None else plan.rooms.rooms
    rooms = [(room.name, room.floor, room.label_m) for room in found]
    return _source(PlanDocument.model_validate(plan_document(plan)), Path(), None, None, rooms)


def _rooms_in(folder: Path) -> list[tuple[str, str, FloatArray]]:
    """Name, floor and place, in the local frame, of the rooms in a plan folder; none of an older plan."""
    path = folder / "viewer" / "layers.json"
    if not path.is_file():
        return []
    try:
        found = json.loads(path.read_text(encoding="utf-8"))["rooms"] or {"list": []}
        return [(str(row["name"]), str(row["floor"]), np.array(row["label"], dtype=float)) for row in found["list"]]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise PlanFolderError(f"{path}: got no list of rooms, expected that of the plan; plan again") from error


def _source(
    plan: PlanDocument,
    folder: Path,
    request: FrameRequest | None,
    given_scene: ScenePaths,
    rooms: Iterable[tuple[str, str, FloatArray]],
) -> PlanSource:
    document = plan.model_dump(mode="json", by_alias=True)
    frame = site_frame(document, request)
    floors = tuple(floor.model_copy(update={"name": one_line(floor.name)}) for floor in plan.floors)
    names = {floor.id: floor.name for floor in floors}
    in_order = sorted(plan.stations, key=lambda station: station.order)
    numbers = station_numbers([station.id for station in in_order])
    stations = tuple(
        _station(station, names, frame, number, order)
        for order, (station, number) in enumerate(zip(in_order, numbers, strict=True), start=1)
    )
    # Without its folder; plans of Windows may name that, with backslashes.
    name = plan.scene.file.replace("\\", "/").rpartition("/")[2] or folder.name
    title = scene_title(one_line(name), len(plan.scene.other_files))
    offset_m = np.array(plan.scene.offset[:2])
    named = tuple(RoomName(one_line(name), floor, at_m[:2] + offset_m) for name, floor, at_m in rooms if name)
    return PlanSource(folder, document, frame, stations, floors, plan.registration.links, title, given_scene, named)


def links_of(registration: Mapping[str, Any]) -> tuple[Link, ...]:
    """Return the links of `registration` of plan.json."""
    return tuple(link_of(row) for row in registration["links"])


def link_of(row: Mapping[str, Any]) -> Link:
    """Return a link of plan.json."""
    return read_as(Link, row, "plan.json: registration.", remedy="plan again", error=PlanFolderError)


def limits_of(registration: Mapping[str, Any]) -> LinkLimits:
    """Return what links of `registration` of plan.json need in order to count."""
    return LinkLimits(
        float(registration["threshold"]),
        float(registration.get("min_strength", 0.0)),
        float(registration.get("min_probability", 0.0)),
        bool(registration.get("doors_change", False)),
    )


def station_numbers(ids: Sequence[str]) -> tuple[int, ...]:
    """Numbers of stations on marks and in tables: 4 for `S004`; their places where ids are no such numbers."""
    found = [re.fullmatch("S0*([0-9]{1,4})", name) for name in ids]
    numbers = tuple(int(match[1]) for match in found if match)
    return numbers if len(set(numbers)) == len(ids) else tuple(range(1, len(ids) + 1))


def _station(
    station: StationSection, floor_names: Mapping[str, str], frame: SiteFrame, number: int, order: int
) -> FieldStation:
    return FieldStation(
        id=station.id,
        number=number,
        floor_id=station.floor,
        floor_name=floor_names.get(station.floor, station.floor),
        order=order,
        position_m=np.array(station.position, dtype=np.float64),
        instrument_height_m=math.nan if station.instrument_height_m is None else station.instrument_height_m,
        frame=frame,
        fixed=station.fixed,
        own_area_m2=station.own_area_m2,
        covered_area_m2=station.covered_area_m2,
    )
