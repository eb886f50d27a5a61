"""Ground that people picked: surfaces marked as ground, or unmarked, around points that somebody clicked.

Input a `Scene` (local frame, metres), the `FloorReport` of `find_floors` and `GroundPick`s (scene frame); output the
report with their grounds. docs/method/floor-picking.md holds the rules.

References
----------
López et al. 2023, section 3.7.1: they push the whole model that a click's ray meets into the ground list. We take the
point that was met, and of the model only the level surface around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Floor, GroundPick, Int32Array, Int64Array, Scene
from planner_core.model.arrays import bounds_of, dots, lengths
from planner_core.positions.local_site import floor_named
from planner_core.scene.array_rows import first_of_equal_rows
from planner_core.scene.floors import FloorReport, floor_of_triangles
from planner_core.scene.level_surfaces import MAX_SLOPE_RAD, MIN_LEVEL_DISTANCE_M

#: A pick's point lies at most so far off the surface that it means.
REACH_M = 0.05
#: A surface is coplanar with another whose corners lie this near to its plane and whose normal is this near to its own.
COPLANAR_M = 0.01
COPLANAR_RAD = np.deg2rad(2.0)
#: Of surfaces that are as near as this to the nearest one, level ones are meant: a click where the floor meets a wall.
_AS_NEAR_M = 0.001
#: How often a region's plane is fitted to it and the region grown anew.
_MOST_FITS = 8
#: `Floor.origin` of a floor that was marked.
MARKED = "marked"


def with_ground_picks(scene: Scene, found: FloorReport, picks: Sequence[GroundPick]) -> FloorReport:
    """Mark and unmark grounds, one pick after the other.

    Marked regions become ground of the floor that is named, else of the one nearest in height within 1.8 m, else of a
    new floor; unmarked ones are ground of no floor any more, or not of the one that is named. A floor that loses all
    its ground is none any more. Floors stay in the order of their heights and keep their ids, so that what names them
    goes on meaning them; new ones get the next free number.

    Raises
    ------
    RequirementError
        A point without a surface within 5 cm, a surface too steep to stand on, a floor that is not there.
    """
    if not picks:
        return found
    mesh = _Mesh(scene)
    floors, warnings = list(found.floors), list(found.warnings)
    for number, pick in enumerate(picks, start=1):
        x, y, z = pick.point_m
        what = f"ground pick {number} at ({x:.3f}, {y:.3f}, {z:.3f})"
        point_m = np.array(pick.point_m, dtype=np.float64) - scene.offset_m
        region = mesh.region_at(point_m, what)
        if pick.is_ground:
            warnings += _mark(mesh, floors, region, pick.floor, what)
        else:
            warnings += _unmark(mesh, floors, region, pick.floor, what)
        floors.sort(key=lambda floor: floor.elevation_m)
    return replace(
        found,
        floors=tuple(floors),
        floor_of_triangle=floor_of_triangles(scene, tuple(floors)),
        warnings=tuple(warnings),
    )


def _mark(mesh: _Mesh, floors: list[Floor], region: Int32Array, name: str, what: str) -> list[str]:
    """Give `region` to one of the floors, in place; return warnings."""
    at = floor_named(tuple(floors), name, what) if name else _floor_for(mesh, floors, region)
    if at is None:
        floors.append(_new_floor(mesh, floors, region))
        return []
    chosen = floors[at]
    _take_away(mesh, floors, region, spared={chosen.id})
    warnings = []
    if chosen.ground_triangles.size == 0:
        warnings.append(
            f"{what}: floor {chosen.name!r} had its storey's elevation as ground and no surface; its ground is now "
            "the marked surface only"
        )
        chosen = replace(chosen, origin=MARKED, ground_area_m2=0.0, plane_m=chosen.plane_m[:0])
    more = np.setdiff1d(region, chosen.ground_triangles)
    if more.size:
        triangles = np.union1d(chosen.ground_triangles, more).astype(np.int32)
        grown = mesh.with_ground(chosen, triangles, chosen.ground_area_m2 + float(mesh.area_m2[more].sum()))
        floors[:] = [grown if floor.id == chosen.id else floor for floor in floors]
    return warnings


def _floor_for(mesh: _Mesh, floors: Sequence[Floor], region: Int32Array) -> int | None:
    """The floor that a region without a name is for: that of most of it, else the nearest one within reach; or None."""
    if not floors:
        return None
    own_m2 = [float(mesh.area_m2[np.intersect1d(region, floor.ground_triangles)].sum()) for floor in floors]
    if max(own_m2) > 0:
        return int(np.argmax(own_m2))
    away_m = np.abs(np.array([floor.elevation_m for floor in floors]) - mesh.height_m(region))
    near = int(np.argmin(away_m))
    return near if away_m[near] <= MIN_LEVEL_DISTANCE_M else None


def _unmark(mesh: _Mesh, floors: list[Floor], region: Int32Array, name: str, what: str) -> list[str]:
    """Take `region` from the floors, or from the one that is named, in place; return warnings."""
    only = floors[floor_named(tuple(floors), name, what)] if name else None
    before = list(floors)
    spared = {floor.id for floor in floors if only is not None and floor.id != only.id}
    if not _take_away(mesh, floors, region, spared=spared):
        of = f" of floor {only.name!r}" if only else ""
        return [f"{what}: this surface was not ground{of}, so nothing is unmarked"]
    left = {floor.id for floor in floors}
    return [
        f"{what}: floor {floor.name!r} has no ground left and is not a floor any more"
        for floor in before
        if floor.id not in left
    ]


def _take_away(mesh: _Mesh, floors: list[Floor], region: Int32Array, *, spared: set[str]) -> bool:
    """Take `region` from all floors but the spared, in place; those without ground go. Tell whether any had of it."""
    left: list[Floor] = []
    changed = False
    for floor in floors:
        triangles = np.setdiff1d(floor.ground_triangles, region).astype(np.int32)
        if floor.id in spared or triangles.size == floor.ground_triangles.size:
            left.append(floor)
            continue
        changed = True
        if triangles.size:
            share = mesh.area_m2[triangles].sum() / mesh.area_m2[floor.ground_triangles].sum()
            left.append(mesh.with_ground(floor, triangles, floor.ground_area_m2 * float(share)))
    floors[:] = left
    return changed


def _new_floor(mesh: _Mesh, floors: Sequence[Floor], region: Int32Array) -> Floor:
    number = 1 + max((int(floor.id[1:]) for floor in floors), default=-1)
    names = {floor.name for floor in floors}
    name = next(n for k in range(1, len(names) + 2) if (n := f"Marked level {k}") not in names)
    bare = Floor(f"F{number}", name, 0.0, 0.0, region, np.zeros((2, 2)), MARKED)
    return mesh.with_ground(bare, region, float(mesh.area_m2[region].sum()))


@dataclass(frozen=True)
class _Plane:
    """Through `at_m` (3,) with the unit normal `normal` (3,)."""

    at_m: FloatArray
    normal: FloatArray


class _Mesh:
    """The scene's triangles, as float64, and what picks ask of them."""

    def __init__(self, scene: Scene) -> None:
        self._vertices_m = scene.vertices_m
        self._triangles = scene.triangles
        self._corners_m = scene.vertices_m[scene.triangles]
        cross = np.cross(self._corners_m[:, 1] - self._corners_m[:, 0], self._corners_m[:, 2] - self._corners_m[:, 0])
        length = lengths(cross)
        self.area_m2: FloatArray = 0.5 * length
        self._normal = cross / np.where(length > 0, length, 1.0)[:, None]
        self._level: BoolArray = np.abs(self._normal[:, 2]) >= np.cos(MAX_SLOPE_RAD)

    def region_at(self, point_m: FloatArray, what: str) -> Int32Array:
        """Sorted triangles of the level surface around a point (3,).

        Those that are connected by edges, and are coplanar: with the triangle at the point first, then with the plane
        that fits what was found, until that no longer changes: on ground that is a little uneven, the plane of the one
        triangle that was hit leads astray.
        """
        seed = self._triangle_at(point_m, what)
        slope_deg = float(np.degrees(np.arccos(min(abs(self._normal[seed, 2]), 1.0))))
        if not self._level[seed]:
            raise RequirementError(
                f"{what}: got a surface with a slope of {slope_deg:.0f} degrees, expected ground of at most "
                f"{np.degrees(MAX_SLOPE_RAD):.0f}; pick a level surface"
            )
        region = self._grown(seed, _Plane(self._corners_m[seed].mean(axis=0), self._normal[seed]))
        for _ in range(_MOST_FITS):
            again = self._grown(seed, self._fitted(region, self._normal[seed]))
            if np.array_equal(again, region):
                break
            region = again
        return region

    def height_m(self, triangles: Int32Array) -> float:
        """Median height of triangles, weighted by their areas."""
        height_m = self._corners_m[triangles, :, 2].mean(axis=1)
        order = np.argsort(height_m, kind="stable")
        below = np.cumsum(self.area_m2[triangles][order])
        return float(height_m[order[int(np.searchsorted(below, 0.5 * below[-1]))]])

    def with_ground(self, floor: Floor, triangles: Int32Array, area_m2: float) -> Floor:
        """The floor with another ground."""
        plan_m = self._corners_m[triangles][:, :, :2].reshape(-1, 2)
        return replace(
            floor,
            elevation_m=self.height_m(triangles),
            ground_area_m2=area_m2,
            ground_triangles=triangles,
            bounds_m=np.stack([plan_m.min(axis=0), plan_m.max(axis=0)]),
        )

    def _triangle_at(self, point_m: FloatArray, what: str) -> int:
        low, high = bounds_of(self._corners_m)
        near = np.flatnonzero(
            ((low <= point_m + REACH_M) & (high >= point_m - REACH_M)).all(axis=1) & (self.area_m2 > 0)
        )
        away_m = _distance_m(self._corners_m[near], self._normal[near], point_m)
        if not (away_m <= REACH_M).any():
            raise RequirementError(
                f"{what}: got no surface within {100 * REACH_M:.0f} cm of it, expected a point on the ground; pick it "
                "again, in the scene's own coordinates"
            )
        meant = away_m <= away_m.min() + _AS_NEAR_M
        if (meant & self._level[near]).any():
            meant &= self._level[near]
        return int(near[np.argmin(np.where(meant, away_m, np.inf))])

    def _fitted(self, region: Int32Array, normal: FloatArray) -> _Plane:
        """The plane of a region: through its centre, along its mean normal, by area; windings may differ."""
        weight = self.area_m2[region]
        same = np.where(_dot(self._normal[region], normal) >= 0, 1.0, -1.0)
        mean = ((same * weight)[:, None] * self._normal[region]).sum(axis=0)
        centre = (weight[:, None] * self._corners_m[region].mean(axis=1)).sum(axis=0) / weight.sum()
        return _Plane(centre, mean / np.sqrt((mean * mean).sum()))

    def _grown(self, seed: int, plane: _Plane) -> Int32Array:
        """Sorted triangles that are connected with `seed` by edges of triangles coplanar with `plane`; seed is one."""
        off_m = np.abs(_dot(self._vertices_m - plane.at_m, plane.normal))
        coplanar = (off_m <= COPLANAR_M)[self._triangles].all(axis=1)
        coplanar &= np.abs(_dot(self._normal, plane.normal)) >= np.cos(COPLANAR_RAD)
        coplanar[seed] = True
        triangles = np.flatnonzero(coplanar)
        label = _joined_by_edges(self._corners_m[triangles])
        region: Int32Array = triangles[label == label[np.searchsorted(triangles, seed)]].astype(np.int32)
        return region


def _dot(rows: FloatArray, vector: FloatArray) -> FloatArray:
    """Products of rows (N, 3) and a vector (3,), in one order of operations: libraries have their own."""
    product: FloatArray = rows[:, 0] * vector[0] + rows[:, 1] * vector[1] + rows[:, 2] * vector[2]
    return product


def _joined_by_edges(corners_m: FloatArray) -> Int64Array:
    """(K,) labels of triangles (K, 3, 3): the same for those that edges join, of the same two points bit by bit."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n_triangles = corners_m.shape[0]
    vertex = first_of_equal_rows(np.ascontiguousarray(corners_m.reshape(-1, 3)) + 0.0).reshape(-1, 3)  # -0.0 is 0.0
    ends = np.sort(np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(n_triangles), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1)
    one, other = owner[order[:-1][same]], owner[order[1:][same]]
    graph = coo_matrix((np.ones(one.size, dtype=np.int8), (one, other)), shape=(n_triangles, n_triangles))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _distance_m(corners_m: FloatArray, normal: FloatArray, point_m: FloatArray) -> FloatArray:
    """(K,) distances of a point (3,) from triangles (K, 3, 3) with unit normals (K, 3)."""
    at = corners_m - point_m
    off = (at[:, 0] * normal).sum(axis=1)
    away = np.full(off.size, np.inf)
    inside = np.ones(off.size, dtype=np.bool_)
    for k in range(3):
        start, edge = at[:, k], at[:, (k + 1) % 3] - at[:, k]
        length2 = dots(edge, edge)
        along = np.clip(-dots(start, edge) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
        nearest = start + along[:, None] * edge
        away = np.minimum(away, lengths(nearest))
        inside &= (np.cross(edge, -start) * normal).sum(axis=1) >= 0
    return np.where(inside, np.abs(off), away)
