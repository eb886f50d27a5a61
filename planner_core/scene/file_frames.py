"""Frames of several files: where each file's scene lies in that of all, and whether it lies there plausibly.

Files of one project mostly have one origin: their coordinates are taken as they are. What a file states of its site's
placement is in its coordinates already. Where two files have a map conversion, easting, northing and height decide:
a file is moved and turned so that the map agrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import BoolArray, FloatArray, Georeference, Scene
from planner_core.scene.extent import LONGEST_M

_SAME_PLACE_M = 0.001
"""A move by less is none: coordinates stay as the file has them, bit by bit."""

_SAME_NORTH_DEG = 0.1


@dataclass(frozen=True, eq=False)
class PlacedScene:
    """A file's scene, placed. vertices_m : (V, 3) float64, the frame of all. matrix : (4, 4), from its own; rigid."""

    scene: Scene
    vertices_m: FloatArray
    matrix: FloatArray | None
    """None: they are one."""

    @property
    def name(self) -> str:
        """Of the file."""
        return self.scene.source.path.name

    @property
    def box_m(self) -> FloatArray:
        """(2, 3) lowest and highest corner."""
        return np.stack([self.vertices_m.min(axis=0), self.vertices_m.max(axis=0)])

    def to_scene(self, local_m: FloatArray) -> FloatArray:
        """(N, 3) of the file's local frame -> the frame of all."""
        return _moved(local_m + self.scene.offset_m, self.matrix)

    def height_m(self, local_z_m: float) -> float:
        """A height of the file's local frame in that of all."""
        middle = 0.5 * (self.scene.vertices_m.min(axis=0) + self.scene.vertices_m.max(axis=0))
        return float(self.to_scene(np.array([[middle[0], middle[1], local_z_m]]))[0, 2])


def placed_files(scenes: Sequence[Scene]) -> tuple[tuple[PlacedScene, ...], Georeference | None, list[str]]:
    """Place the files' scenes; the georeference of the whole; and a line on each file that is moved.

    The first file with a map conversion stays where it is, and those without any.
    """
    on_map = [number for number, scene in enumerate(scenes) if _map_of(scene) is not None]
    others = (number for number, scene in enumerate(scenes) if scene.georeference is not None)
    leading = on_map[0] if on_map else next(others, None)
    georeference = None if leading is None else scenes[leading].georeference
    files = []
    lines = _unlike(scenes, leading)
    for number, scene in enumerate(scenes):
        matrix = None
        if on_map and number in on_map[1:]:
            matrix = _between(scene, scenes[on_map[0]])
        file = PlacedScene(scene, _moved(scene.vertices_m + scene.offset_m, matrix), matrix)
        files.append(file)
        if matrix is not None:
            lines.append(_move_in_words(file, scenes[on_map[0]].source.path.name))
    if on_map and len(on_map) < len(scenes):
        without = [scene.source.path.name for number, scene in enumerate(scenes) if number not in on_map]
        lines.append(
            f"{', '.join(without)}: without a map conversion, the origin is taken to be that of "
            f"{scenes[on_map[0]].source.path.name}."
        )
    return tuple(files), georeference, lines


def _moved(points_m: FloatArray, matrix: FloatArray | None) -> FloatArray:
    if matrix is None:
        return points_m
    return np.asarray(points_m @ matrix[:3, :3].T + matrix[:3, 3])


def _map_of(scene: Scene) -> FloatArray | None:
    georeference = scene.georeference
    to_map = None if georeference is None else georeference.to_map
    return None if to_map is None else np.array(to_map, dtype=np.float64)


def _between(scene: Scene, reference: Scene) -> FloatArray | None:
    """(4, 4) from a file's scene frame to the reference's, rigid: exact at the file's middle. None: they are one."""
    mine, its = _map_of(scene), _map_of(reference)
    assert mine is not None and its is not None
    # Shifts first: northings of millions would eat the digits of a product.
    back = np.linalg.inv(its[:3, :3])
    turn, shift = back @ mine[:3, :3], back @ (mine[:3, 3] - its[:3, 3])
    low, high = (bound(axis=0) + scene.offset_m for bound in (scene.vertices_m.min, scene.vertices_m.max))
    middle = 0.5 * (low + high)
    u, _, v = np.linalg.svd(turn)  # scales of the grid are no shape of the building
    rigid = u @ v
    matrix = np.eye(4)
    matrix[:3, :3] = rigid
    matrix[:3, 3] = turn @ middle + shift - rigid @ middle
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return None if np.abs(_moved(corners, matrix) - corners).max() <= _SAME_PLACE_M else matrix


def _move_in_words(file: PlacedScene, reference: str) -> str:
    assert file.matrix is not None
    middle = (file.scene.vertices_m.min(axis=0) + file.scene.vertices_m.max(axis=0)) / 2 + file.scene.offset_m
    x, y, z = (_moved(middle[None], file.matrix)[0] - middle).tolist()
    turn = np.degrees(np.arctan2(file.matrix[1, 0], file.matrix[0, 0]))
    turned = f" and turned by {turn:.2f} degrees" if abs(turn) >= 0.005 else ""
    return f"{file.name}: is moved by x {x:.3f}, y {y:.3f}, z {z:.3f} m{turned}, to agree with {reference} on the map."


def _unlike(scenes: Sequence[Scene], leading: int | None) -> list[str]:
    """Lines on files that name another coordinate system, or another true north, than the one that counts."""
    if leading is None:
        return []
    reference = scenes[leading].georeference
    assert reference is not None
    name = scenes[leading].source.path.name
    lines = []
    for scene in scenes:
        own = scene.georeference
        if own is None or own is reference:
            continue
        mine, its = own.crs_name, reference.crs_name
        if mine and its and mine.replace(" ", "").casefold() != its.replace(" ", "").casefold():
            lines.append(
                f"{scene.source.path.name}: its map is {mine}, that of {name} is {its}: both are taken to be one; if "
                "they are not, export them in the same."
            )
        if own.to_map is None and own.true_north and reference.to_map is None and reference.true_north:
            turn = _angle_deg(own.true_north) - _angle_deg(reference.true_north)
            turn = (turn + 180.0) % 360.0 - 180.0
            if abs(turn) > _SAME_NORTH_DEG:
                lines.append(
                    f"{scene.source.path.name}: its true north is {abs(turn):.1f} degrees off that of {name}: the axes "
                    "are taken to be the same; if they are not, export the files with shared coordinates."
                )
    return lines


def _angle_deg(direction: tuple[float, float]) -> float:
    return float(np.degrees(np.arctan2(direction[1], direction[0])))


# ---------------------------------------------------------------------------------------------- far away
def placement_doubts(files: Sequence[PlacedScene]) -> list[str]:
    """A line on each file whose box touches none of the others.

    Raises
    ------
    SceneError
        One is a kilometre or more away: nobody scans both in one survey, and float32 does not hold both.
    """
    boxes_m = np.stack([file.box_m for file in files])
    apart_m = boxes_m[:, None, 0] - boxes_m[None, :, 1]
    gaps_m = np.linalg.norm(np.maximum(apart_m, 0.0), axis=2)
    gaps_m = np.maximum(gaps_m, gaps_m.T)
    main = _main_group(gaps_m <= 0.0, [file.scene.n_triangles for file in files])
    lines = []
    for number, file in enumerate(files):
        if number in main:
            continue
        gap_m = float(gaps_m[number, sorted(main)].min())
        whole = boxes_m[sorted(main)]
        away = boxes_m[number].mean(axis=0) - 0.5 * (whole[:, 0].min(axis=0) + whole[:, 1].max(axis=0))
        x, y, z = (f"{value:.1f}" for value in away.tolist())
        others = files[min(main)].name if len(main) == 1 else "the other files"
        line = f"{file.name}: lies {gap_m:.1f} m away from {others} (middle to middle x {x}, y {y}, z {z} m), "
        remedy = "expected parts of one building; export all files with the same origin (shared coordinates)"
        if gap_m > LONGEST_M:
            raise SceneError(f"{line}{remedy}, or plan it apart.")
        lines.append(f"{line}{remedy} if it is not a building of its own.")
    return lines


def _main_group(touches: BoolArray, sizes: Sequence[int]) -> set[int]:
    """Most files that touch each other, in a chain; of equally many those with most triangles."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, group = connected_components(coo_array(touches), directed=False)
    groups = [set(np.flatnonzero(group == number).tolist()) for number in np.unique(group)]
    return max(groups, key=lambda members: (len(members), sum(sizes[member] for member in members), -min(members)))
