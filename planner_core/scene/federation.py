"""Federation: the files of one building -> one `Scene`. Architecture, structure and services are mostly files apart.

Input: a `Scene` a file, each in its own frame; output: one in the frame that they share. Steps of `federated`:

1. files with a map conversion are moved so that they agree on the map; all others keep their coordinates, as files of
   one project have the same origin (`planner_core.scene.file_frames`);
2. a file that touches no other gets a warning; one that is a kilometre away is refused;
3. storeys of about one height become one; the first file's name and height count. Structure is modelled to the raw slab
   and architecture to the finished floor, which differ by centimetres to decimetres; half storeys are a metre apart;
4. an element, or a room, that an earlier file has as well is left out;
5. all triangles are welded and repaired together, so that neighbours of different files share edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import SceneError, grouped
from planner_core.model import (
    BoolArray,
    Element,
    FloatArray,
    Int64Array,
    LoadReport,
    Optics,
    Room,
    Scene,
    Storey,
    UInt8Array,
)
from planner_core.model.arrays import area_normals, bounds_of, lengths
from planner_core.scene.build import far_origin, scene_from_arrays
from planner_core.scene.extent import LONGEST_M, check_extent, extent_m
from planner_core.scene.file_frames import PlacedScene, placed_files, placement_doubts

_SAME_SHAPE_M = 0.001
"""Corners of an element's box, its centre and the root of its area may differ by so much between two exports."""
_SAME_NAMED_M, _SAME_M = 0.5, 0.2
"""Storeys of two files are one within these heights, of the same name or of any."""
_ROUNDING_M = 0.02
"""Files round heights to centimetres."""


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
    _check_common_shift(files)
    doubts = placement_doubts(files)
    storeys = _joint_storeys(files)
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
    files: Sequence[PlacedScene], copies: Sequence[BoolArray], keeps: Sequence[BoolArray], storeys: _JointStoreys
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
    lowest_m, highest_m = bounds_of(corners_m)
    np.minimum.at(low, owner, lowest_m)
    np.maximum.at(high, owner, highest_m)
    cross = area_normals(corners_m)
    area_m2 = 0.5 * lengths(cross)
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
def _rooms(files: Sequence[PlacedScene], storeys: _JointStoreys, offset_m: FloatArray) -> tuple[Room, ...]:
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


# ----------------------------------------------------------------------------------------------- storeys
@dataclass(frozen=True)
class _JointStoreys:
    """storeys : scene frame, lowest first. places : a file each, its storeys' indices into them; -1: not used."""

    storeys: tuple[Storey, ...]
    places: tuple[tuple[int, ...], ...]
    remarks: tuple[str, ...]
    """One line each, for the user: what differs between files."""

    def place(self, file: int, storey: int) -> int:
        """Index of a file's storey in the list of all; -1 for none."""
        return self.places[file][storey] if storey >= 0 else -1


@dataclass
class _Joint:
    storey: Storey
    first: str
    """The file that its name and height are from."""


def _joint_storeys(files: Sequence[PlacedScene]) -> _JointStoreys:
    """Match the storeys of files by height and name."""
    joint: list[_Joint] = []
    numbers: list[list[int]] = []
    remarks: list[str] = []
    leans = [_at_one_height(file) for file in files]
    some_tell = not all(leans[i] or not file.scene.storeys for i, file in enumerate(files))
    for file, at_one_height in zip(files, leans, strict=True):
        heights_m = [file.height_m(storey.elevation_m) for storey in file.scene.storeys]
        if at_one_height and some_tell:
            remarks.append(
                f"{file.name}: all its {len(heights_m)} storeys are at {heights_m[0]:.2f} m: its elements go to the "
                "storeys of the other files by their height."
            )
            numbers.append([-1] * len(heights_m))
            continue
        own: list[int] = []
        off: list[str] = []
        for storey, height_m in zip(file.scene.storeys, heights_m, strict=True):
            found = _match(joint, own, storey.name, height_m)
            if found is None:
                off += _same_name_elsewhere(joint, own, storey.name, height_m)
                found = len(joint)
                joint.append(_Joint(Storey(storey.name, storey.source_id, height_m), file.name))
            else:
                of = joint[found]
                if abs(height_m - of.storey.elevation_m) > _ROUNDING_M:
                    off.append(_line(storey.name, height_m, of, "taken as one"))
            own.append(found)
        numbers.append(own)
        if off:
            more = f", and {len(off) - 1} more storeys differ" if len(off) > 1 else ""
            remarks.append(f"{file.name}: {off[0]}{more}.")
    order = sorted(range(len(joint)), key=lambda i: (joint[i].storey.elevation_m, i))
    new = {old: place for place, old in enumerate(order)} | {-1: -1}
    return _JointStoreys(
        tuple(joint[i].storey for i in order),
        tuple(tuple(new[number] for number in own) for own in numbers),
        tuple(remarks),
    )


def _check_common_shift(files: Sequence[PlacedScene]) -> None:
    """Refuse a file whose storeys all lie higher or lower than those of an earlier file by one amount.

    Two references of height do that, such as the site's elevation in one export and sea level in the other: walls then
    stand in the slabs of the other file. One storey in common proves nothing, nor do buildings side by side.

    Raises
    ------
    SceneError
        Names the amount, with its sign, and the storeys.
    """
    for number, file in enumerate(files):
        for other in files[:number]:
            mine, its = _heights_by_name(file), _heights_by_name(other)
            common = [name for name in mine if name in its]
            shifts_m = np.array([mine[name][1] - its[name][1] for name in common])
            is_one = len(common) > 1 and np.ptp(shifts_m) < _ROUNDING_M and abs(shifts_m[0]) > _SAME_NAMED_M
            if not is_one or _at_one_height(file) or _at_one_height(other) or not _over_each_other(file, other):
                continue
            shift_m = float(np.median(shifts_m))
            named = ", ".join(mine[name][0] for name in common[:3]) + (", ..." if len(common) > 3 else "")
            raise SceneError(
                f"{file.name}: its {len(common)} storeys {named} all lie {abs(shift_m):.3f} m "
                f"{'above' if shift_m > 0 else 'below'} those of the same names in {other.name}, expected the same "
                f"heights; move it by {-shift_m:+.3f} m, or export both with one reference of height (in IFC the "
                "placements and RefElevation of IfcSite and IfcBuilding)."
            )


def _heights_by_name(file: PlacedScene) -> dict[str, tuple[str, float]]:
    """Name as written and height of a file's storeys, by plain name, but for names that it has twice."""
    names = [_plain(storey.name) for storey in file.scene.storeys]
    return {
        name: (storey.name, file.height_m(storey.elevation_m))
        for name, storey in zip(names, file.scene.storeys, strict=True)
        if names.count(name) == 1
    }


def _over_each_other(file: PlacedScene, other: PlacedScene) -> bool:
    """Tell whether the smaller of two files' boxes lies over the larger one by half of it, in plan."""
    (low, high), (its_low, its_high) = file.box_m[:, :2], other.box_m[:, :2]
    shared = np.maximum(np.minimum(high, its_high) - np.maximum(low, its_low), 0.0)
    return bool(shared.prod() >= 0.5 * min((high - low).prod(), (its_high - its_low).prod()))


def _at_one_height(file: PlacedScene) -> bool:
    """Several storeys in one place are none: programs of structure and services write them so."""
    heights_m = [storey.elevation_m for storey in file.scene.storeys]
    return len(heights_m) > 1 and float(np.ptp(heights_m)) < _ROUNDING_M


def _match(joint: Sequence[_Joint], taken: Sequence[int], name: str, height_m: float) -> int | None:
    """The storey of earlier files that this one is: of its name, else the nearest; no two of a file are one."""
    found = []
    for number, other in enumerate(joint):
        off_m = abs(other.storey.elevation_m - height_m)
        named = _plain(other.storey.name) == _plain(name)
        if number not in taken and off_m <= (_SAME_NAMED_M if named else _SAME_M):
            found.append((not named, off_m, number))
    return min(found)[2] if found else None


def _same_name_elsewhere(joint: Sequence[_Joint], taken: Sequence[int], name: str, height_m: float) -> list[str]:
    return [
        _line(name, height_m, other, "kept as two; check the files")
        for number, other in enumerate(joint)
        if number not in taken and _plain(other.storey.name) == _plain(name)
    ][:1]


def _line(name: str, height_m: float, other: _Joint, done: str) -> str:
    its = other.storey
    called = "" if _plain(its.name) == _plain(name) else f"{its.name} "
    return f"storey {name} is at {height_m:.3f} m and {called}in {other.first} at {its.elevation_m:.3f} m: {done}"


def _plain(name: str) -> str:
    return " ".join(name.casefold().split())
