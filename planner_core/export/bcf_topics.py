"""What a plan has to tell coordinators, topic by topic: comments of its review, and elements that stay unseen.

PlanSource -> Topics, places in the local frame, metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.export.bcf_views import NO_ELEMENT, ViewTarget
from planner_core.export.chosen import chosen_floors
from planner_core.export.options import Options
from planner_core.export.sheets.building import Building
from planner_core.model import FloatArray
from planner_core.model.review import Comment, PlanUnderReview, Review
from planner_core.model.unseen import reason_in_words
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.review.stations import reviewed_station

COMMENT, UNSEEN = "Comment", "Unseen surface"
OPEN, RESOLVED = "Open", "Resolved"
AUTHOR = "tlsplan"
#: No clock in what is written: the same plan gives the same bytes.
TIME = "1970-01-01T00:00:00Z"

#: Around a pin or a sensor.
_AROUND_M = 1.0
#: Of the topmost floor, whose height plan.json does not say.
_STOREY_M = 3.0
_LONGEST_TITLE = 100


@dataclass(frozen=True, eq=False)
class Topic:
    """One topic. key : names it among those of its plan, and stays as long as it is about the same.

    source_id : of the element it is about, IFC GlobalId where the scene is IFC; empty: of none. is_comment : its
    description is what `author` wrote at `time`.
    """

    key: str
    title: str
    kind: str
    status: str
    author: str
    time: str
    description: str
    labels: tuple[str, ...]
    place: ViewTarget
    source_id: str = ""
    is_comment: bool = False


class Topics:
    """Finds topics of a plan. building : None where the plan folder holds none."""

    def __init__(self, plan: PlanSource, building: Building | None, options: Options) -> None:
        self._plan, self._building = plan, building
        self._offset_m = np.array(plan.document["scene"]["offset"], dtype=np.float64)
        self._floors = {floor.id: floor.name for floor in plan.floors}
        self._wanted = {floor.id for floor in chosen_floors(plan, options)} if options.floors else None
        why = plan.document.get("why") or {}
        self._surfaces: dict[tuple[int, str], list[Mapping[str, Any]]] = {}
        for row in why.get("unseen_surfaces", ()):
            self._surfaces.setdefault((row["element"], row["floor"]), []).append(row)

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
            place=place,
            source_id=self._source_id(element),
            is_comment=True,
        )

    def _source_id(self, element: int) -> str:
        """What finds an element in its source, as far as the plan folder knows it."""
        if self._building is not None:
            for at in np.flatnonzero(self._building.element_numbers == element):
                return self._building.scene.elements[at].source_id
        rows = (row for rows in self._surfaces.values() for row in rows)
        listed = (*self._plan.document["unseen"], *rows)
        return next((str(row["source_id"]) for row in listed if row["element"] == element), "")

    # ---------------------------------------------------------------------------------------------- unseen
    def unseen_rows(self) -> list[Mapping[str, Any]]:
        """Rows of plan.json's `unseen` on the chosen floors, each element and floor once, largest areas first."""
        rows = {(row["element"], row["floor"]): row for row in self._plan.document["unseen"]}
        chosen = [row for row in rows.values() if self._wanted is None or row["floor"] in self._wanted]
        return sorted(chosen, key=lambda row: (-row["unseen_area_m2"], row["element"], row["floor"]))

    def of_unseen(self, row: Mapping[str, Any]) -> Topic:
        """Topic of one row of `unseen_rows`."""
        element, floor_id = row["element"], row["floor"]
        floor = self._floors.get(floor_id, floor_id)
        surfaces = self._surfaces.get((element, floor_id), [])
        # Only what some position sees is unseen in the sense of `unseen`, and only that has a best position.
        spots = [surface for surface in surfaces if surface["best_spot"] is not None and surface["pieces"]]
        best = max(spots, key=lambda surface: float(surface["area_m2"]), default=None)
        where = f" ({floor})" if floor else ""
        return Topic(
            key=f"unseen/{row['source_id']}/{element}/{floor_id}",
            title=_cut(f"Unseen: {row['name']}{where}"),
            kind=UNSEEN,
            status=OPEN,
            author=AUTHOR,
            time=TIME,
            description="\n".join(_description(row, surfaces, best)),
            labels=tuple(label for label in (floor, str(row["kind"])) if label),
            place=self._of_piece(element, best) or self._around_element(element) or self._whole(),
            source_id=str(row["source_id"]),
        )

    def _of_piece(self, element: int, surface: Mapping[str, Any] | None) -> ViewTarget | None:
        """The largest piece of a surface, seen from its best position."""
        if surface is None:
            return None
        piece = surface["pieces"][0]
        low_m, high_m = (np.array(corner, dtype=np.float64) for corner in piece["box"])
        return ViewTarget(
            target_m=np.array(piece["centroid"], dtype=np.float64) - self._offset_m,
            radius_m=0.5 * float(np.linalg.norm(high_m - low_m)),
            element=element,
            eye_m=np.array(surface["best_spot"]["position"], dtype=np.float64) - self._offset_m,
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


def _description(
    row: Mapping[str, Any], surfaces: list[Mapping[str, Any]], best: Mapping[str, Any] | None
) -> Iterator[str]:
    """Lines on what is unseen of an element, and why."""
    yield (
        f"{row['unseen_area_m2']:.2f} m2 of {row['achievable_area_m2']:.2f} m2 of scannable surface are not seen by "
        "the plan's stations."
    )
    by_reason: dict[str, float] = {}
    for surface in surfaces:
        reason = reason_in_words(surface["reason"])
        by_reason[reason] = by_reason.get(reason, 0.0) + surface["area_m2"]
    if by_reason:
        largest_first = sorted(by_reason.items(), key=lambda item: (-item[1], item[0]))
        listed = "; ".join(f"{reason} {area_m2:.2f} m2" for reason, area_m2 in largest_first)
        yield f"All of its unseen surface by reason: {listed}."
    rooms = dict.fromkeys(surface["room"]["name"] for surface in surfaces if surface["room"])
    if rooms:
        yield f"Rooms: {', '.join(rooms)}."
    if best is not None:
        spot = best["best_spot"]
        at = ", ".join(f"{value:.2f}" for value in spot["position"])
        yield f"A scanner at {at} (m, model coordinates) would see {spot['sees_m2']:.2f} m2 of it."


def _cut(title: str) -> str:
    return title if len(title) <= _LONGEST_TITLE else f"{title[: _LONGEST_TITLE - 3].rstrip()}..."
