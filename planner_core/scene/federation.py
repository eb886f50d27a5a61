"""Federation: the files of one building -> one `Scene`. Architecture, structure and services are mostly files apart.

Input: a `Scene` a file, each in its own frame; output: one in the frame that they share. Steps of `federated`:

1. files with a map conversion are moved so that they agree on the map; all others keep their coordinates, as files of
   one project have the same origin (`planner_core.scene.file_frames`);
2. a file that touches no other gets a warning; one that is a kilometre away is refused;
3. storeys of about one height become one (`planner_core.scene.joint_storeys`);
4. an element, or a room, that an earlier file has as well is left out;
5. all triangles are welded and repaired together, so that neighbours of different files share edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner_core.errors import grouped
from planner_core.model import BoolArray, Element, FloatArray, Int64Array, LoadReport, Optics, Room, Scene, UInt8Array
from planner_core.scene.build import far_origin, scene_from_arrays
from planner_core.scene.extent import LONGEST_M, check_extent, extent_m
from planner_core.scene.file_frames import PlacedScene, placed_files, placement_doubts
from planner_core.scene.joint_storeys import JointStoreys, check_common_shift, joint_storeys

_SAME_SHAPE_M = 0.001
"""Corners of an element's box, its centre and the root of its area may differ by so much between two exports."""


def federated(scenes: Sequence[Scene]) -> Scene:
    """Put the scenes of several files together.

    Parameters
    ----------
    scenes
        A file each, as `planner_core.scene.load` reads it, doors and glass as modelled; two or more.

    Raises
    ------
    SceneError
        A file is of impossible size, lies a kilometre and more from the others, or has all its storeys higher or lower
        than an earlier file by one amount.
    """
    for scene in scenes:
        if extent_m(scene).max() > LONGEST_M:  # before it makes the others look far away
            check_extent(scene)
    files, georeference, moves = placed_files(scenes)
    check_common_shift(files)
    doubts = placement_doubts(files)
    storeys = joint_storeys(files)
    copies = _copies([_shapes(file) for file in files])
    keeps = [~copy[file.scene.element_of_triangle] for file, copy in zip(files, copies, strict=True)]
    elements, owners = _elements(files, copies, keeps, storeys)
    first_vertex = np.cumsum([0, *(len(file.vertices_m) for file in files)])
    triangles = [
        file.scene.triangles[keep].astype(np.int64) + at
        for file, keep, at in zip(files, keeps, first_vertex[:-1].tolist(), strict=True)
    ]
    remarks = (*doubts, *moves, *storeys.remarks, *_copy_remarks(files, copies))
    scene = scene_from_arrays(
        np.concatenate([file.vertices_m for file in files]),
        np.concatenate(triangles),
        element_of_triangle=np.concatenate(owners),
        elements=elements,
        storeys=storeys.storeys,
        source=files[0].scene.source,
        face_of_triangle=np.concatenate([np.flatnonzero(keep) for keep in keeps]),
        optics_of_triangle=np.concatenate([_optics(file.scene)[keep] for file, keep in zip(files, keeps, strict=True)]),
        prior=_reports(files, keeps, remarks),
    )
    return replace(
        scene,
        rooms=_rooms(files, storeys, scene.offset_m),
        georeference=georeference,
        further_sources=tuple(file.scene.source for file in files[1:]),
    )


def _elements(
    files: Sequence[PlacedScene], copies: Sequence[BoolArray], keeps: Sequence[BoolArray], storeys: JointStoreys
) -> tuple[list[Element], list[Int64Array]]:
    """Elements of all files but the copies, and the owner of each triangle that stays, a file each."""
    elements: list[Element] = []
    owners = []
    for number, (file, copy, keep) in enumerate(zip(files, copies, keeps, strict=True)):
        place = len(elements) + np.cumsum(~copy) - 1
        owners.append(place[file.scene.element_of_triangle[keep]].astype(np.int64))
        elements += [
            replace(element, storey=storeys.place(number, element.storey), file=number)
            for element, is_copy in zip(file.scene.elements, copy.tolist(), strict=True)
            if not is_copy
        ]
    return elements, owners


def _optics(scene: Scene) -> UInt8Array:
    if scene.optics_of_triangle is None:
        return np.full(scene.n_triangles, np.uint8(Optics.RETURNS))
    return scene.optics_of_triangle


# ------------------------------------------------------------------------------------------------ copies
def _copies(shapes: Sequence[FloatArray]) -> list[BoolArray]:
    """(E,) bool a file: elements of the same shape, at the same place, as one of an earlier file.

    Ids prove nothing: parts of one wall, a file a trade, may have the wall's GlobalId.
    """
    from scipy.spatial import cKDTree

    copies = []
    earlier = np.empty((0, shapes[0].shape[1]))
    for mine in shapes:
        shaped = np.flatnonzero(np.isfinite(mine).all(axis=1))
        copy = np.zeros(len(mine), dtype=bool)
        if earlier.size and shaped.size:
            away_m, _ = cKDTree(earlier).query(mine[shaped], p=np.inf, distance_upper_bound=_SAME_SHAPE_M)
            copy[shaped] = np.isfinite(away_m)
        copies.append(copy)
        earlier = np.concatenate([earlier, mine[shaped]])
    return copies


def _shapes(file: PlacedScene) -> FloatArray:
    """(E, 10) box, centre of area and root of area of each element, scene frame; not finite where it has no surface."""
    scene = file.scene
    owner, n = scene.element_of_triangle, len(scene.elements)
    corners_m = file.vertices_m[scene.triangles]
    low, high = np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    np.minimum.at(low, owner, corners_m.min(axis=1))
    np.maximum.at(high, owner, corners_m.max(axis=1))
    cross = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    area_m2 = 0.5 * np.sqrt((cross * cross).sum(axis=1))
    whole_m2 = np.bincount(owner, weights=area_m2, minlength=n)
    middle_m = corners_m.mean(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = [np.bincount(owner, weights=area_m2 * middle_m[:, k], minlength=n) / whole_m2 for k in range(3)]
    return np.column_stack([low, high, *centre, np.sqrt(whole_m2)])


def _copy_remarks(files: Sequence[PlacedScene], copies: Sequence[BoolArray]) -> list[str]:
    """A line each file with elements that count once, and each with ids that stand for other shapes elsewhere."""
    remarks = []
    seen: dict[str, int] = {}
    for number, (file, copy) in enumerate(zip(files, copies, strict=True)):
        name, elements = file.name, file.scene.elements
        if copy.all():
            remarks.append(f"{name}: all of its elements are in the files before it: they count once; leave it out.")
        elif copy.any():
            first = elements[int(np.argmax(copy))].name
            several = (
                "elements that earlier files have, too, count"
                if copy.sum() > 1
                else "element that an earlier file has, too, counts"
            )
            remarks.append(f"{name}: {grouped(int(copy.sum()))} {several} once ({first}).")
        if file.scene.source.format != "ifc":
            continue
        own = [e for e, is_copy in zip(elements, copy.tolist(), strict=True) if not is_copy]
        clashes = [e for e in own if seen.get(e.source_id, number) != number]
        if clashes:
            other = files[seen[clashes[0].source_id]].name
            remarks.append(
                f"{name}: the GlobalId {clashes[0].source_id} of {clashes[0].name} stands for another shape in {other}"
                f"{f', and {grouped(len(clashes) - 1)} more do' if len(clashes) > 1 else ''}: both count; check that "
                "the files are of one date."
            )
        seen |= {e.source_id: number for e in own if e.source_id not in seen}
    return remarks


# ----------------------------------------------------------------------------------------- rooms, report
def _rooms(files: Sequence[PlacedScene], storeys: JointStoreys, offset_m: FloatArray) -> tuple[Room, ...]:
    """Rooms of all files, local frame; one that an earlier file has as well, by id or by box, once."""
    rooms: list[Room] = []
    boxes_m: list[FloatArray] = []
    ids: set[str] = set()
    for number, file in enumerate(files):
        own = [
            replace(
                room,
                storey=storeys.place(number, room.storey),
                vertices_m=file.to_scene(room.vertices_m) - offset_m,
            )
            for room in file.scene.rooms
        ]
        earlier_m = np.array(boxes_m).reshape(-1, 2, 3)
        fresh = [
            room
            for room in own
            if room.source_id not in ids
            and not (np.abs(earlier_m - room.box_m) <= _SAME_SHAPE_M).all(axis=(1, 2)).any()
        ]
        rooms += fresh
        boxes_m += [room.box_m for room in fresh]
        ids |= {room.source_id for room in fresh}
    return tuple(rooms)


def _reports(files: Sequence[PlacedScene], keeps: Sequence[BoolArray], remarks: Sequence[str]) -> LoadReport:
    """What loading found in all files; faces of copies count as repeated."""
    reports = [file.scene.report for file in files]
    n_copies = sum(int((~keep).sum()) for keep in keeps)
    n_kept = sum(int(keep.sum()) for keep in keeps)
    of_files = [
        warning
        for file in files
        for warning in file.scene.report.warnings
        if warning not in far_origin(file.name, file.scene.offset_m)  # given once, of all
    ]
    return LoadReport(
        n_faces_read=sum(report.n_faces_read for report in reports) - n_kept,  # which are read again
        n_non_finite=sum(report.n_non_finite for report in reports),
        n_degenerate=sum(report.n_degenerate for report in reports),
        n_duplicate=sum(report.n_duplicate for report in reports) + n_copies,
        n_bad_index=sum(report.n_bad_index for report in reports),
        n_stray=sum(report.n_stray for report in reports),
        dropped=tuple(f"{file.name}: {line}" for file in files for line in file.scene.report.dropped),
        warnings=(*of_files, *remarks),
    )
