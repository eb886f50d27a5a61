"""Writing a review into its layer: Review, PlanUnderReview, text of `review.usda` -> its text with this review in it.

Only entries of a review are written, and only those that it no longer has are taken out: opinions of others stay.
Comments that begin with # are lost, as in every program that saves a layer.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from planner_core.errors import PlanFolderError
from planner_core.model.review import (
    Comment,
    Entrance,
    ForbiddenPlace,
    LastChange,
    PlanUnderReview,
    Review,
    SignOff,
    StationEdit,
    StationProgress,
    Verdict,
    Zone,
)
from planner_core.model.site import GroundPick, Point
from planner_core.plan_folder.palette import STATION
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    Sdf,
    Tf,
    define,
    int_array,
    over,
    put,
    put_colours,
    put_extent,
    put_transform,
    vec3f_array,
)
from planner_core.plan_folder.usd_names import prim_names_of_ids
from planner_core.plan_folder.usd_stage import empty_review
from planner_core.plan_folder.usd_stations import MARKER_RADIUS_M
from planner_core.review import usd

OUTLINE_WIDTH_M = 0.04
OUTLINE_RISE_M = 0.02
"""Above the floor, so that it is not hidden in it."""

ENTRANCE_RADIUS_M = 0.3

_Kept = TypeVar("_Kept")

_COLOURS = {
    "keep_out": (0.80, 0.15, 0.15),
    "priority": (0.10, 0.45, 0.80),
    "forbidden": (0.80, 0.15, 0.15),
    "entrance": (0.96, 0.77, 0.09),
}


def review_text(review: Review, plan: PlanUnderReview, onto: str = "", *, name: str = "review.usda") -> str:
    """Return the layer's text with `review` in it.

    Parameters
    ----------
    onto
        The layer as it is; empty: as it was written with the plan.
    name
        What messages call the file.

    Raises
    ------
    PlanFolderError
        `onto` is no USD, or holds what can't be written beside.
    """
    layer = usd.layer_of(onto or empty_review(), name)
    try:
        with Sdf.ChangeBlock():
            _Writer(layer, plan).write(review)
        return str(layer.ExportToString())
    except Tf.ErrorException as error:  # say, a relationship of the name of an attribute
        problem = str(error).strip().splitlines()[-1].strip()
        raise PlanFolderError(
            f"{name}: what is in it is in the way of the review ({problem[:300]}), expected the layer of a plan, and "
            "nothing is written over it; repair it, or rename it to begin a new review"
        ) from error


@dataclass(frozen=True)
class _Writer:
    """Writes into one layer."""

    layer: Layer
    plan: PlanUnderReview

    def write(self, review: Review) -> None:
        """Write everything; entries that the review no longer has go first."""
        self._write_stations(review)
        root = define(self.layer, usd.REVIEW, "Scope")
        put(root, f"{usd.PREFIX}schema", TYPES.String, usd.SCHEMA)
        put(root, f"{usd.PREFIX}revision", TYPES.Int64, review.revision)
        self._write_touched(root, review.touched)
        self._write_all(usd.COMMENTS, review.comments, self._comment)
        self._write_all(usd.ZONES, review.zones, self._zone)
        self._write_all(usd.FORBIDDEN, review.forbidden, self._place)
        self._write_all(usd.PICKS, review.ground_picks, self._pick)
        self._write_all(usd.ENTRANCES, review.entrances, self._entrance)
        self._write_all(usd.DOORS, _by_prim_name(review.doors), self._door)
        self._write_all(usd.VERDICTS, _by_prim_name(review.verdicts), self._verdict)
        self._write_all(usd.PROGRESS, _by_prim_name(review.progress), self._progress)
        self._remove(usd.SIGN_OFF)
        if review.sign_off is not None:
            self._sign_off(define(self.layer, usd.SIGN_OFF, "Scope"), review.sign_off)

    def _write_touched(self, root: Any, touched: Mapping[str, LastChange]) -> None:
        """One row an object, in four lists: a prim each would say nothing more, and removed objects have none."""
        rows = sorted(touched.items())
        name = f"{usd.PREFIX}touched"
        put(root, name, TYPES.StringArray, [key for key, _ in rows])
        put(root, f"{name}Revisions", TYPES.Int64Array, [touch.revision for _, touch in rows])
        put(root, f"{name}By", TYPES.StringArray, [touch.by for _, touch in rows])
        put(root, f"{name}At", TYPES.StringArray, [touch.at for _, touch in rows])

    def _write_all(self, path: str, kept: Mapping[str, Any], write_one: Any) -> None:
        parent = self.layer.GetPrimAtPath(path)
        for prim in () if parent is None else list(parent.nameChildren):
            if prim.name not in kept and any(attribute.name.startswith(usd.PREFIX) for attribute in prim.attributes):
                self._remove(str(prim.path))
        if kept:
            define(self.layer, path, "Scope")
        elif parent is not None and not parent.nameChildren and not parent.properties:
            self._remove(path)
        for name in sorted(kept, key=lambda name: (len(name), name)):
            write_one(f"{path}/{name}", kept[name])

    def _remove(self, path: str) -> None:
        prim = self.layer.GetPrimAtPath(path)
        if prim is not None:
            del prim.nameParent.nameChildren[prim.name]

    # -------------------------------------------------------------------------------------------- stations
    def _write_stations(self, review: Review) -> None:
        self._clear_stale()
        planned = [station.id for station in self.plan.stations]
        name_of = dict(zip(planned, prim_names_of_ids(planned), strict=True))
        for station_id, name in name_of.items():
            self._write_edit(f"{usd.STATIONS}/{name}", review.stations.get(station_id, StationEdit()))
        added = {name: edit for name, edit in review.stations.items() if edit.added}
        parent = self.layer.GetPrimAtPath(usd.STATIONS)
        for prim in () if parent is None else list(parent.nameChildren):
            if usd.value_of(prim, usd.ADDED) and prim.name not in added:
                self._remove(str(prim.path))
        if parent is not None:
            self._remove_inert(parent)
        for name in sorted(added):
            self._write_added(f"{usd.STATIONS}/{name}", name, added[name])
        changed = {name for name, edit in review.stations.items() if edit.added or edit.removed or edit.position_m}
        self._hide_stale(changed, review, name_of)

    def _write_edit(self, path: str, edit: StationEdit) -> None:
        prim = self.layer.GetPrimAtPath(path)
        if prim is not None:
            self._clear_edit(prim)
        if edit == StationEdit():
            if prim is not None:
                self._remove_inert(prim)
            return
        prim = over(self.layer, path)
        if edit.removed:
            prim.active = False
        if edit.position_m is not None:
            self._put_pose(prim, edit)
            for figure in usd.FIGURES:  # of the place that it was planned at
                put(prim, figure, TYPES.Double, Sdf.ValueBlock())
        self._put_lock(prim, edit)

    def _clear_edit(self, prim: Any) -> None:
        ours = [attribute.name for attribute in prim.attributes if attribute.name.startswith(usd.PREFIX)]
        if usd.TRANSFORM in prim.attributes:  # else an order of somebody else's operations
            ours += [usd.TRANSFORM, usd.ORDER]
        for name in (*ours, usd.HEIGHT, usd.FLOOR, *usd.FIGURES):
            if name in prim.attributes:
                prim.RemoveProperty(prim.attributes[name])
        prim.ClearInfo("active")

    def _write_added(self, path: str, name: str, edit: StationEdit) -> None:
        prim = define(self.layer, path, "Xform", kind="component")
        put(prim, "tlsplan:stationId", TYPES.String, name)
        put(prim, usd.ADDED, TYPES.Bool, True)
        self._put_pose(prim, edit)
        self._put_lock(prim, edit)
        marker = define(self.layer, f"{path}/Marker", "Sphere")
        put(marker, "radius", TYPES.Double, MARKER_RADIUS_M)
        put_transform(marker)
        put_extent(marker, np.zeros((1, 3)), margin_m=MARKER_RADIUS_M)
        put_colours(marker, np.array([STATION]), "constant")

    def _put_pose(self, prim: Any, edit: StationEdit) -> None:
        self._put_place(prim, edit.position_m)
        height_m = math.nan if edit.instrument_height_m is None else edit.instrument_height_m
        put(prim, usd.HEIGHT, TYPES.Double, height_m)
        put(prim, usd.FLOOR, TYPES.String, edit.floor or "")

    def _put_lock(self, prim: Any, edit: StationEdit) -> None:
        if edit.locked is not None:
            put(prim, usd.LOCKED, TYPES.Bool, edit.locked)
        elif usd.LOCKED in prim.attributes:
            prim.RemoveProperty(prim.attributes[usd.LOCKED])

    def _clear_stale(self) -> None:
        marked: list[Any] = []

        def look(path: Any) -> None:
            attribute = self.layer.GetAttributeAtPath(path) if path.IsPropertyPath() else None
            if attribute is not None and attribute.name == usd.STALE:
                marked.append(attribute.owner)

        self.layer.Traverse(Sdf.Path.absoluteRootPath, look)
        for prim in marked:
            prim.ClearInfo("active")
            prim.RemoveProperty(prim.attributes[usd.STALE])
            self._remove_inert(prim)

    def _remove_inert(self, prim: Any) -> None:
        """Take out an `over` without opinions, and those above that only led to it; /Plan stays."""
        has_opinions = set(prim.ListInfoKeys()) - {"specifier"}
        if prim.specifier != Sdf.SpecifierOver or has_opinions or prim.properties or prim.nameChildren:
            return
        parent = prim.nameParent
        self._remove(str(prim.path))
        if str(parent.path) not in ("/", "/Plan"):
            self._remove_inert(parent)

    def _hide_stale(self, changed: set[str], review: Review, name_of: Mapping[str, str]) -> None:
        """Hide what the plan's layers show of stations that are elsewhere now: clouds, links, routes of floors."""
        moved = {name for name in changed if (edit := review.stations[name]).position_m and not edit.added}
        for station_id in sorted(moved):
            self._hide(f"{usd.STATIONS}/{name_of[station_id]}/Cloud")
        for index, ends in enumerate(self.plan.links):
            if not changed.isdisjoint(ends):
                self._hide(f"/Plan/Links/Link_{index}")
        was_on = {station.id: station.floor for station in self.plan.stations}
        floors = {floor for name in changed for floor in (was_on.get(name), review.stations[name].floor) if floor}
        for floor in sorted(floors & set(self.plan.floor_elevations_m)):
            self._hide(f"/Plan/Routes/{floor}")

    def _hide(self, path: str) -> None:
        prim = over(self.layer, path)
        if prim.HasInfo("active"):
            return  # somebody else's word on it
        prim.active = False
        put(prim, usd.STALE, TYPES.Bool, True)

    # -------------------------------------------------------------------------------------------- all else
    def _comment(self, path: str, comment: Comment) -> None:
        prim = define(self.layer, path, "Xform")
        self._put_texts(prim, text=comment.text, author=comment.author, time=comment.time)
        put(prim, f"{usd.PREFIX}resolved", TYPES.Bool, comment.resolved)
        for name, text in (("assignee", comment.assignee), ("due", comment.due), ("photo", comment.photo)):
            if text:
                self._put_texts(prim, **{name: text})
        if isinstance(comment.target, str):
            put(prim, f"{usd.PREFIX}station", TYPES.String, comment.target)
        elif comment.target is not None:
            put(prim, f"{usd.PREFIX}element", TYPES.Int, comment.target)
        if comment.position_m is not None:
            self._put_place(prim, comment.position_m)

    def _zone(self, path: str, zone: Zone) -> None:
        prim = define(self.layer, path, "BasisCurves")
        self._put_texts(prim, kind=zone.kind, floor=zone.floor, name=zone.name)
        corners_m = np.array(zone.outline_m) - self.plan.offset_m[:2]
        outline = [(round(x, 6), round(y, 6)) for x, y in corners_m.tolist()]
        put(prim, f"{usd.PREFIX}outline", TYPES.Double2Array, outline)
        if zone.coverage is not None:
            put(prim, f"{usd.PREFIX}coverage", TYPES.Double, zone.coverage)
        elif f"{usd.PREFIX}coverage" in prim.attributes:
            prim.RemoveProperty(prim.attributes[f"{usd.PREFIX}coverage"])
        elevations = self.plan.floor_elevations_m
        lowest = min(elevations.values(), default=0.0)
        z = elevations.get(zone.floor, lowest) - self.plan.offset_m[2] + OUTLINE_RISE_M
        points_m = np.column_stack([corners_m, np.full(len(corners_m), z)])
        put(prim, "purpose", TYPES.Token, "guide", uniform=True)
        put(prim, "type", TYPES.Token, "linear", uniform=True)
        put(prim, "wrap", TYPES.Token, "periodic", uniform=True)
        put(prim, "curveVertexCounts", TYPES.IntArray, int_array(np.array([len(points_m)])))
        put(prim, "points", TYPES.Point3fArray, vec3f_array(points_m))
        widths = put(prim, "widths", TYPES.FloatArray, [OUTLINE_WIDTH_M])
        widths.SetInfo("interpolation", "constant")
        put_extent(prim, points_m, margin_m=OUTLINE_WIDTH_M / 2)
        put_colours(prim, np.array([_COLOURS[zone.kind]]), "constant")

    def _place(self, path: str, place: ForbiddenPlace) -> None:
        self._ball(path, "forbidden", place.position_m, place.floor, place.radius_m)

    def _entrance(self, path: str, entrance: Entrance) -> None:
        self._ball(path, "entrance", entrance.position_m, entrance.floor, ENTRANCE_RADIUS_M)

    def _ball(self, path: str, kind: str, position_m: Point, floor: str, radius_m: float) -> None:
        prim = define(self.layer, path, "Sphere")
        self._put_texts(prim, floor=floor)
        put(prim, "radius", TYPES.Double, radius_m)
        put(prim, "purpose", TYPES.Token, "guide", uniform=True)
        self._put_place(prim, position_m)
        put_extent(prim, np.zeros((1, 3)), margin_m=radius_m)
        put_colours(prim, np.array([_COLOURS[kind]]), "constant")

    def _door(self, path: str, of_door: tuple[str, str]) -> None:
        door, state = of_door
        self._put_texts(define(self.layer, path, "Scope"), element=door, state=state)

    def _pick(self, path: str, pick: GroundPick) -> None:
        prim = define(self.layer, path, "Xform")
        self._put_texts(prim, floor=pick.floor)
        put(prim, f"{usd.PREFIX}isGround", TYPES.Bool, pick.is_ground)
        self._put_place(prim, pick.point_m)

    def _verdict(self, path: str, of_station: tuple[str, Verdict]) -> None:
        station, verdict = of_station
        prim = define(self.layer, path, "Scope")
        self._put_texts(
            prim, station=station, verdict=verdict.verdict, by=verdict.by, time=verdict.time, note=verdict.note
        )

    def _progress(self, path: str, of_station: tuple[str, StationProgress]) -> None:
        station, progress = of_station
        prim = define(self.layer, path, "Scope")
        self._put_texts(prim, station=station, state=progress.state, by=progress.by, time=progress.time)

    def _sign_off(self, prim: Any, signed: SignOff) -> None:
        self._put_texts(prim, name=signed.name, time=signed.time, planSha256=signed.plan_sha256, note=signed.note)
        put(prim, f"{usd.PREFIX}revision", TYPES.Int64, signed.revision)

    def _put_texts(self, prim: Any, **texts: str) -> None:
        for name, text in texts.items():
            put(prim, f"{usd.PREFIX}{name}", TYPES.String, text)

    def _put_place(self, prim: Any, position_m: Point | None) -> None:
        assert position_m is not None
        local_m: Iterable[float] = np.subtract(position_m, self.plan.offset_m).tolist()
        put_transform(prim, np.array([round(value, 6) for value in local_m]))


def _by_prim_name(kept: Mapping[str, _Kept]) -> dict[str, tuple[str, _Kept]]:
    """Entries whose ids are others' and may be no names of prims, with their ids, by such names."""
    entries = sorted(kept.items())
    return dict(zip(prim_names_of_ids([name for name, _ in entries]), entries, strict=True))
