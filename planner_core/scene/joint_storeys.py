"""Storeys of several files as one list: those of about one height, a file each, are one.

The first file's name and height count. Structure is modelled to the raw slab and architecture to the finished floor,
which differ by centimetres to decimetres; half storeys are a metre apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import Storey
from planner_core.scene.file_frames import PlacedScene

_SAME_NAMED_M, _SAME_M = 0.5, 0.2
"""Storeys of two files are one within these heights, of the same name or of any."""

_ROUNDING_M = 0.02
"""Files round heights to centimetres."""


@dataclass(frozen=True)
class JointStoreys:
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


def joint_storeys(files: Sequence[PlacedScene]) -> JointStoreys:
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
    return JointStoreys(
        tuple(joint[i].storey for i in order),
        tuple(tuple(new[number] for number in own) for own in numbers),
        tuple(remarks),
    )


def check_common_shift(files: Sequence[PlacedScene]) -> None:
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
