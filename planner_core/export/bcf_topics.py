"""Topics of a plan for coordinators: comments of its review, and what stays unseen, room by room.

PlanSource -> Topics, places in the local frame, metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from planner_core.environment_variables import date_from_env
from planner_core.export.bcf_views import NO_ELEMENT, ViewTarget
from planner_core.export.chosen import chosen_floors
from planner_core.export.options import Options
from planner_core.export.sheets.building import Building
from planner_core.model import METRE, FloatArray
from planner_core.model.review import Comment, PlanUnderReview, Review
from planner_core.model.unseen import NOT_WORTH, REASONS, reason_in_words
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_words import area_words
from planner_core.review.stations import reviewed_station

COMMENT, UNSEEN = "Comment", "Unseen surface"
OPEN, RESOLVED = "Open", "Resolved"
AUTHOR = "tlsplan"
LEAST_AREA_M2 = 0.5
"""What is unseen in a place with less is no work for anybody: all such places share one topic."""

#: Around a pin or a sensor.
_AROUND_M = 1.0
#: Of the topmost floor, whose height plan.json does not say.
_STOREY_M = 3.0
_LONGEST_TITLE = 100
#: Elements or places that a description names; the others are counted.
_MOST_NAMED = 8
#: Areas in plan.json are rounded: less than this is no difference.
_SAME_AREA_M2 = 1e-3
_NOT_COVERED = "not covered by the planned scan"


@dataclass(frozen=True, eq=False)
class Topic:
    """One topic. key : names it among those of its plan, and stays as long as it is about the same.

    source_ids : of the elements it is about, IFC GlobalIds where the scene is IFC. is_comment : its description is
    what `author` wrote at `time`. assignee, due : who deals with it, and the day by which; empty: not known.
    photo : its SHA-256; empty: none.
    places : where to look, best first.
    """

    key: str
    title: str
    kind: str
    status: str
    author: str
    time: str
    description: str
    labels: tuple[str, ...]
    places: tuple[ViewTarget, ...]
    source_ids: tuple[str, ...] = ()
    is_comment: bool = False
    assignee: str = ""
    due: str = ""
    photo: str = ""


@dataclass(eq=False)
class UnseenPlace:
    """A room of one floor, or an element that is in no known room, and what the plan leaves unseen there.

    left_out : surfaces that valid positions see, as `unseen_surfaces` of plan.json. not_as_required : area of what none
    sees as required, by reason.
    """

    key: str
    name: str
    floor: str
    labels: tuple[str, ...]
    left_out: list[Mapping[str, Any]] = field(default_factory=list)
    not_as_required: dict[str, float] = field(default_factory=dict)

    @property
    def area_m2(self) -> float:
        """Of what is left out."""
        return float(sum(surface["area_m2"] for surface in self.left_out))

    @property
    def title(self) -> str:
        """`WC (Ground floor)`."""
        return f"{self.name} ({self.floor})" if self.floor else self.name


class Topics:
    """Finds topics of a plan. building : None where the plan folder holds none."""

    def __init__(self, plan: PlanSource, building: Building | None, options: Options) -> None:
        self._plan, self._building = plan, building
        self._offset_m = np.array(plan.document["scene"]["offset"], dtype=np.float64)
        self._floors = {floor.id: floor.name for floor in plan.floors}
        self._wanted = {floor.id for floor in chosen_floors(plan, options)} if options.floors else None
        why = plan.document.get("why") or {}
        self._surfaces: Sequence[Mapping[str, Any]] = why.get("unseen_surfaces", ())

    # -------------------------------------------------------------------------------------------- comments
    def of_comments(self, planned: PlanUnderReview, review: Review) -> Iterator[Topic]:
        """Topics of the review's comments, by id; with floors chosen, without those on stations of others."""
        for name in sorted(review.comments):
            comment = review.comments[name]
            station = None
            if isinstance(comment.target, str):
                of_plan, edit = planned.station(comment.target), review.stations.get(comment.target)
                if of_plan is not None or (edit is not None and edit.position_m is not None):
                    station = reviewed_station(comment.target, of_plan, edit)
            if self._wanted is not None and station is not None and station.floor not in self._wanted:
                continue
            floor = "" if station is None else self._floors.get(station.floor, "")
            place_m = comment.position_m
            if place_m is None and station is not None:
                place_m = station.position_m
            yield self._of_comment(comment, floor, place_m)

    def _of_comment(self, comment: Comment, floor: str, place_m: tuple[float, float, float] | None) -> Topic:
        element = comment.target if isinstance(comment.target, int) else NO_ELEMENT
        if place_m is not None:
            place = ViewTarget(np.array(place_m) - self._offset_m, _AROUND_M, element, pinned=True)
        else:
            place = self._around_element(element) or self._whole()
        about = f"{comment.target}: " if isinstance(comment.target, str) else ""
        return Topic(
            key=f"comment/{comment.id}/{comment.author}/{comment.time}",
            title=_cut(about + comment.text.strip().splitlines()[0]),
            kind=COMMENT,
            status=RESOLVED if comment.resolved else OPEN,
            author=comment.author,
            time=comment.time,
            description=comment.text,
            labels=(floor,) if floor else (),
            places=(place,),
            source_ids=tuple(filter(None, (self._source_id(element),))),
            is_comment=True,
            assignee=comment.assignee,
            due=comment.due,
            photo=comment.photo,
        )

    def _source_id(self, element: int) -> str:
        """What finds an element in its source, as far as the plan folder knows it."""
        if self._building is not None:
            for at in np.flatnonzero(self._building.element_numbers == element):
                return self._building.scene.elements[at].source_id
        listed = (*self._plan.document["unseen"], *self._surfaces)
        return next((str(row["source_id"]) for row in listed if row["element"] == element), "")

    # ---------------------------------------------------------------------------------------------- unseen
    def unseen_places(self) -> list[UnseenPlace]:
        """Rooms, and elements in no known room, of the chosen floors where something is left out; most first."""
        places: dict[str, UnseenPlace] = {}
        unlisted_m2 = {
            (row["element"], row["floor"]): row["unseen_area_m2"]
            for row in self._plan.document["unseen"]
            if self._is_chosen(row)
        }
        for surface in filter(self._is_chosen, self._surfaces):
            place = self._place_of(surface, places)
            if surface["reason"] == REASONS[NOT_WORTH]:
                place.left_out.append(surface)
                at = surface["element"], surface["floor"]
                unlisted_m2[at] = unlisted_m2.get(at, 0.0) - surface["area_m2"]
            else:
                reason = reason_in_words(surface["reason"])
                place.not_as_required[reason] = place.not_as_required.get(reason, 0.0) + surface["area_m2"]
        for row in filter(self._is_chosen, self._plan.document["unseen"]):
            # Slivers have no surface of their own in plan.json, and plans of older versions have none at all.
            rest_m2 = unlisted_m2.pop((row["element"], row["floor"]), 0.0)
            if rest_m2 > _SAME_AREA_M2:
                rest = {**row, "room": None, "area_m2": rest_m2, "pieces": (), "best_spot": None}
                self._place_of(rest, places).left_out.append(rest)
        return sorted((each for each in places.values() if each.left_out), key=lambda each: (-each.area_m2, each.key))

    def _is_chosen(self, row: Mapping[str, Any]) -> bool:
        return self._wanted is None or row["floor"] in self._wanted

    def _place_of(self, surface: Mapping[str, Any], places: dict[str, UnseenPlace]) -> UnseenPlace:
        floor, room = self._floors.get(surface["floor"], surface["floor"]), surface["room"]
        if room:
            key = f"room/{room['source_id'] or room['name']}/{surface['floor']}"
        else:
            key = f"unseen/{surface['source_id']}/{surface['element']}/{surface['floor']}"
        name, kind = (room["name"], room["name"]) if room else (surface["name"], surface["kind"])
        labels = tuple(label for label in (floor, str(kind)) if label)
        return places.setdefault(key, UnseenPlace(key, name, floor, labels))

    def of_place(self, place: UnseenPlace) -> Topic:
        """Topic of one of `unseen_places`."""
        elements = tuple(dict.fromkeys(each["element"] for each in place.left_out))
        pieces = [(piece, each) for each in place.left_out if each["best_spot"] is not None for piece in each["pieces"]]
        pieces.sort(key=lambda row: -row[0]["area_m2"])
        targets = [self._of_piece(piece, surface, elements) for piece, surface in pieces]
        largest = max(place.left_out, key=lambda each: float(each["area_m2"]))
        if (around := self._around_element(largest["element"])) is not None:
            targets.append(replace(around, also=elements))
        description = "\n".join(_of_place(place, largest["best_spot"]))
        return self._of_unseen(place.key, place.title, place.labels, [place], description, targets)

    def of_others(self, places: Sequence[UnseenPlace]) -> Topic:
        """One topic of all these together."""
        area_m2 = sum(place.area_m2 for place in places)
        named = _listed((place.title, place.area_m2) for place in places)
        description = f"Small areas, {area_words(METRE, area_m2, 1)} in all: {named}.\n{_WHAT_TO_DO}"
        return self._of_unseen("unseen/others", f"{len(places)} smaller places", (), places, description, [])

    def _of_unseen(
        self,
        key: str,
        title: str,
        labels: tuple[str, ...],
        places: Sequence[UnseenPlace],
        description: str,
        targets: Sequence[ViewTarget],
    ) -> Topic:
        surfaces = sorted((each for place in places for each in place.left_out), key=lambda each: -each["area_m2"])
        area = area_words(METRE, sum(place.area_m2 for place in places), 1)
        return Topic(
            key=key,
            title=_cut(title, f": {area} {_NOT_COVERED}"),
            kind=UNSEEN,
            status=OPEN,
            author=AUTHOR,
            time=time_of(self._plan),
            description=description,
            labels=labels,
            places=tuple(targets) or (self._whole(),),
            source_ids=tuple(dict.fromkeys(str(each["source_id"]) for each in surfaces if each["source_id"])),
        )

    def _of_piece(self, piece: Mapping[str, Any], surface: Mapping[str, Any], elements: tuple[int, ...]) -> ViewTarget:
        """A piece of a surface, seen from the best position of all of it."""
        low_m, high_m = (np.array(corner, dtype=np.float64) for corner in piece["box"])
        return ViewTarget(
            target_m=np.array(piece["centroid"], dtype=np.float64) - self._offset_m,
            radius_m=0.5 * float(np.linalg.norm(high_m - low_m)),
            element=surface["element"],
            eye_m=np.array(surface["best_spot"]["position"], dtype=np.float64) - self._offset_m,
            also=elements,
        )

    def _around_element(self, element: int) -> ViewTarget | None:
        if self._building is None:
            return None
        scene = self._building.scene
        of_triangle = self._building.element_numbers[scene.element_of_triangle]
        corners_m = scene.vertices_m[scene.triangles[of_triangle == element]].reshape(-1, 3)
        return _in_box(np.stack([corners_m.min(axis=0), corners_m.max(axis=0)]), element) if len(corners_m) else None

    def _whole(self) -> ViewTarget:
        """All floors, from outside."""
        floors = self._plan.floors
        plan_m = np.concatenate([np.zeros((0, 2)), *(floor.bounds for floor in floors)])
        if not floors:
            plan_m = self._offset_m[None, :2]
        heights_m = [floor.elevation_m for floor in floors] or [float(self._offset_m[2])]
        low_m = np.array([*plan_m.min(axis=0), min(heights_m)])
        high_m = np.array([*plan_m.max(axis=0), max(heights_m) + _STOREY_M])
        box_m: FloatArray = np.stack([low_m, high_m]) - self._offset_m
        return _in_box(box_m, NO_ELEMENT, outside=True)


def _in_box(box_m: FloatArray, element: int, *, outside: bool = False) -> ViewTarget:
    radius_m = 0.5 * float(np.linalg.norm(box_m[1] - box_m[0]))
    return ViewTarget(box_m.mean(axis=0), radius_m, element, outside=outside)


_WHAT_TO_DO = (
    "Close the topic if that is acceptable; otherwise the scan needs more stations or a higher required coverage."
)


def _of_place(place: UnseenPlace, spot: Mapping[str, Any] | None) -> Iterator[str]:
    """Lines on what is unseen in a place, and why. spot : the best position for another station, where it is known."""
    areas_m2: dict[str, float] = {}
    for each in place.left_out:
        areas_m2[each["name"]] = areas_m2.get(each["name"], 0.0) + each["area_m2"]
    which = "" if list(areas_m2) == [place.name] else f": {_listed(areas_m2.items())}"
    area = area_words(METRE, place.area_m2, 2)
    yield f"No planned station captures {area} of surface here that a scanner could{which}."
    if spot is not None:
        at = ", ".join(f"{value:.2f}" for value in spot["position"])
        yield (
            f"One more station with its sensor at {at} (m, model coordinates) would add "
            f"{area_words(METRE, spot['adds_m2'], 2)} to the scan, in this place and around it."
        )
    if place.not_as_required:
        yield f"Besides, no valid position captures as required: {_listed(place.not_as_required.items())}."
    yield _WHAT_TO_DO


def _listed(areas_m2: Iterable[tuple[str, float]]) -> str:
    """`Wall 3.15 m², Ground slab 0.52 m² and 2 more 0.12 m²`, largest first."""
    rows = sorted(areas_m2, key=lambda row: (-row[1], row[0]))
    named, others = rows[:_MOST_NAMED], rows[_MOST_NAMED:]
    words = ", ".join(f"{name} {area_words(METRE, area_m2, 2)}" for name, area_m2 in named)
    rest_m2 = sum(area_m2 for _, area_m2 in others)
    return f"{words} and {len(others)} more {area_words(METRE, rest_m2, 2)}" if others else words


def time_of(plan: PlanSource) -> str:
    """When the plan was made, as BCF has times: when plan.json was written, or what `date_from_env` finds.

    plan.json itself has no time, as the same input gives the same bytes.

    Raises
    ------
    EnvironmentVariableError
        The variable is no number of seconds.
    """
    given = date_from_env()
    time = given or datetime.fromtimestamp((plan.folder / "plan.json").stat().st_mtime, UTC)
    return time.strftime("%Y-%m-%dT%H:%M:%SZ")


def _cut(title: str, after: str = "") -> str:
    longest = _LONGEST_TITLE - len(after)
    return (title if len(title) <= longest else f"{title[: longest - 3].rstrip()}...") + after
