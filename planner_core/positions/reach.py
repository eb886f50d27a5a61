"""Reach: what of the free space can be walked to from the entrances, and which rooms cannot.

Input a `FreeSpace` and entrances (local frame, metres), output a `Reach`. Where the carrier has room to stand, linked
nodes make regions: one a building where doors are open and stairs lead up, one an unreachable room.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Candidates, FloatArray, Int32Array, Int64Array, Scene, Survey
from planner_core.model.arrays import bounds_of
from planner_core.positions.free_space import FreeSpace, components, spread
from planner_core.scene.array_rows import chunks
from planner_core.scene.columns import sample_columns
from planner_core.scene.doors import Leaf, leaves_around

#: Unreachable regions smaller than this are cupboards and shafts that nobody asks for.
MIN_REGION_M2 = 1.0
#: Without entrances, regions of this share of their floor's largest are taken to have one.
_ENTERED_SHARE = 0.5
#: Entrances are moved to where the carrier can stand, this far at most in plan.
_ENTRANCE_M = 1.0
#: Heights this near are the same ground: positions over screeds and coverings.
_SAME_GROUND_M = 0.3
#: A tripod is put down at arm's length.
ARM_M = 0.6
#: A region is inside a solid where this share of its plumb lines is.
_SOLID_SHARE = 0.5
_N_PLUMB_LINES = 25
#: A leaf stands this near to the ground of the room that it shuts, and the rooms begin so far from its middle: a body's
#: radius, and the reveal of the wall that it hangs in.
_LEAF_AWAY_M = 1.5
_BESIDE_M = (0.2, 0.4, 0.6)


@dataclass(frozen=True)
class Region:
    """Connected free space. floor : where most of it is. inside_m : (3,) float64, local, its roomiest place.

    area_m2 : of the floors' ground that the carrier's body passes over, by floor in `area_by_floor_m2`; stairs, and
    roofs they lead to, are not in it.
    """

    floor: int
    area_m2: float
    area_by_floor_m2: tuple[float, ...]
    inside_m: FloatArray
    reached: bool
    in_solid: bool
    """Inside a thick wall or a column: no room at all."""


@dataclass(frozen=True)
class Reach:
    """Regions, largest first, and which of them the entrances lead to.

    region : (N,) int32 into regions, of the nodes on which the carrier can stand; -1 for the others.
    near_region : (N,) int32, the same for all ground within the body's radius of such nodes.
    """

    space: FreeSpace
    regions: tuple[Region, ...]
    region: Int32Array
    near_region: Int32Array

    @property
    def unreachable(self) -> tuple[Region, ...]:
        """Regions of at least `MIN_REGION_M2` that no entrance leads to, largest first."""
        return tuple(r for r in self.regions if not r.reached and not r.in_solid and r.area_m2 >= MIN_REGION_M2)

    @cached_property
    def footing(self) -> Footing:
        """Where one stands to set a tripod up."""
        return Footing(self)

    @property
    def reached_node(self) -> BoolArray:
        """(N,) bool: nodes on which the carrier can stand, coming from an entrance."""
        reached = np.array([*(region.reached for region in self.regions), False])
        return np.asarray(reached[self.region])


def reachability(survey: Survey, space: FreeSpace, entrances_m: FloatArray | None = None) -> Reach:
    """Find the regions of `space` and what entrances (K, 3), places on the ground, lead to.

    Without entrances, regions are reached that have half as much of a floor as its largest region, or more: the flats
    of a house have doors of their own.

    Raises
    ------
    RequirementError
        An entrance with no place for the carrier within a metre.
    """
    region = components(space.links, space.can_stand)
    distance, source = spread(
        space.links,
        space.cells(),
        np.where(space.can_stand, np.arange(space.n_nodes), -1),
        space.cells().astype(np.float64),
        reach_cells=space.carrier.radius_m / space.grid.cell_m,
    )
    near = np.where(np.isfinite(distance), region[source], -1)
    n_regions = int(region.max(initial=-1)) + 1
    area = np.zeros((n_regions, space.n_floors))
    counted = (near >= 0) & space.on_ground
    np.add.at(area, (near[counted], space.floor[counted]), space.cell_m2)
    order = np.argsort(-area.sum(axis=1), kind="stable")
    rank = np.append(np.argsort(order), -1).astype(np.int32)  # the last entry is for -1
    region, near, area = rank[region], rank[near], area[order]
    if entrances_m is None:
        large = (area > 0) & (area >= _ENTERED_SHARE * area.max(axis=0, initial=0.0))
        lead_to = set(np.flatnonzero(large.any(axis=1)).tolist())
    else:
        lead_to = {int(region[node]) for node in _entrance_nodes(space, entrances_m, survey.scene.offset_m)}
    regions = _described(survey, space, region, area, lead_to)
    return Reach(space=space, regions=regions, region=region, near_region=near)


def reachable(reach: Reach, candidates: Candidates) -> BoolArray:
    """(N,) bool: whether a tripod can be carried to each candidate; see `Footing`."""
    ground_m = candidates.position_m.copy()
    ground_m[:, 2] -= candidates.instrument_height_m
    return np.asarray(stand_nodes(reach, ground_m) >= 0)


def stand_nodes(reach: Reach, ground_m: FloatArray) -> Int64Array:
    """(K,) the reached node from which a tripod is put down on ground (K, 3); -1 where there is none, see `Footing`."""
    return reach.footing.nodes(ground_m)


class Footing:
    """Where one stands to set a tripod up: the nearest reached node within arm's length.

    Arm's length is over ground without an obstacle between: not through a wall.
    """

    def __init__(self, reach: Reach) -> None:
        space = reach.space
        cells = space.cells()
        source = np.where(reach.reached_node, np.arange(space.n_nodes), -1)
        reach_cells = ARM_M / space.grid.cell_m
        _, self._stand = spread(space.links, cells, source, cells.astype(np.float64), reach_cells=reach_cells)
        # Heights are stretched, so that one search finds the nearest cell at the same height.
        self._scale = np.array([1.0, 1.0, 1.5 * space.grid.cell_m / _SAME_GROUND_M])
        self._near_m = 1.5 * np.sqrt(2.0) * space.grid.cell_m
        self._tree = cKDTree(space.position_m() * self._scale)

    def nodes(self, ground_m: FloatArray) -> Int64Array:
        """(K,) int64 node for each of places on the ground (K, 3); -1 where there is none."""
        distance, node = self._tree.query(ground_m * self._scale, distance_upper_bound=self._near_m)
        found = np.isfinite(distance)
        out = np.full(ground_m.shape[0], -1, dtype=np.int64)
        out[found] = self._stand[node[found]]
        return out


def leaf_that_shuts(scene: Scene, reach: Reach, region: Region) -> Leaf | None:
    """Find a door leaf of a mesh with an unreachable region on one side and ground that is reached on the other."""
    space = reach.space
    own = next(number for number, each in enumerate(reach.regions) if each is region)
    place_m = space.position_m(np.flatnonzero(reach.near_region == own))
    low_m, high_m = place_m[:, :2].min(axis=0) - _LEAF_AWAY_M, place_m[:, :2].max(axis=0) + _LEAF_AWAY_M
    for leaf in leaves_around(scene, low_m=low_m, high_m=high_m, ground_m=float(region.inside_m[2])):
        foot_m = leaf.middle_m - [0.0, 0.0, 0.5 * leaf.height_m - _SAME_GROUND_M]
        sides = [{_region_at(reach, foot_m + sign * away * leaf.across) for away in _BESIDE_M} for sign in (-1.0, 1.0)]
        for one, other in (sides, sides[::-1]):
            if own in one and any(number >= 0 and reach.regions[number].reached for number in other):
                return leaf
    return None


def _region_at(reach: Reach, place_m: FloatArray) -> int:
    node = reach.space.node_below(place_m)
    return int(reach.near_region[node]) if node >= 0 else -1


def _entrance_nodes(space: FreeSpace, entrances_m: FloatArray, offset_m: FloatArray) -> list[int]:
    """Nearest node on which the carrier can stand, by entrance."""
    stand = np.flatnonzero(space.can_stand)
    place = space.position_m(stand)
    out = []
    for entrance in np.asarray(entrances_m, dtype=np.float64).reshape(-1, 3):
        away = np.sqrt(((place[:, :2] - entrance[:2]) ** 2).sum(axis=1))
        away[np.abs(place[:, 2] - entrance[2]) > 2.0 * _SAME_GROUND_M] = np.inf
        nearest = int(np.argmin(away)) if away.size else -1
        if nearest < 0 or away[nearest] > _ENTRANCE_M:
            at = ", ".join(f"{value:.2f}" for value in entrance + offset_m)
            raise RequirementError(
                f"entrance: got ({at}), expected a ground point with room for a person within "
                f"{_ENTRANCE_M:g} m; move it onto a floor, away from walls"
            )
        out.append(int(stand[nearest]))
    return out


def _described(
    survey: Survey, space: FreeSpace, region: Int32Array, area: FloatArray, lead_to: set[int]
) -> tuple[Region, ...]:
    node = np.flatnonzero(region >= 0)
    # The roomiest node on the ground of each region's floor, the first of equals; if need be on stairs.
    elsewhere = ~space.on_ground[node] | (space.floor[node] != area.argmax(axis=1)[region[node]])
    order = node[np.lexsort((node, -space.clearance_m[node], elsewhere, region[node]))]
    number, first, count = np.unique(region[order], return_index=True, return_counts=True)
    tested = {
        index: space.position_m(order[start : start + n : max(1, n // _N_PLUMB_LINES)])
        for index, start, n in zip(number.tolist(), first.tolist(), count.tolist(), strict=True)
        if index not in lead_to and float(area[index].sum()) >= MIN_REGION_M2
    }
    in_solid = _in_solid(survey.scene, tested)
    return tuple(
        Region(
            floor=int(np.argmax(area[index])),
            area_m2=float(area[index].sum()),
            area_by_floor_m2=tuple(float(value) for value in area[index]),
            inside_m=space.position_m(order[start : start + 1])[0],
            reached=index in lead_to,
            in_solid=index in in_solid,
        )
        for index, start in zip(number.tolist(), first.tolist(), strict=True)
    )


def _in_solid(scene: Scene, ground_m: dict[int, FloatArray]) -> set[int]:
    """Regions most of whose places (K, 3) on the ground are inside an element."""
    if not ground_m:
        return set()
    region = np.repeat(list(ground_m), [place.shape[0] for place in ground_m.values()])
    places_m = np.concatenate(list(ground_m.values()))
    over = triangles_over(scene, places_m[:, :2])
    inside = [_is_inside(scene, place, under) for place, under in zip(places_m, over, strict=True)]
    n_inside = np.bincount(region, weights=inside)
    return {index for index, place in ground_m.items() if n_inside[index] > _SOLID_SHARE * place.shape[0]}


def triangles_over(scene: Scene, plan_m: FloatArray) -> list[Int32Array]:
    """Triangles whose bounds in plan hold each of places (K, 2), in their order.

    Of each triangle only places between its least and greatest x are tested: all places at all triangles would be
    the square of the site's area.
    """
    by_x = np.argsort(plan_m[:, 0], kind="stable")
    found: list[tuple[Int64Array, Int64Array]] = []
    for some in chunks(scene.n_triangles):
        low_m, high_m = bounds_of(scene.vertices_m[:, :2][scene.triangles[some]])
        first = np.searchsorted(plan_m[by_x, 0], low_m[:, 0], side="left")
        count = np.searchsorted(plan_m[by_x, 0], high_m[:, 0], side="right") - first
        triangle = np.repeat(np.arange(count.size), count)
        place = by_x[np.arange(triangle.size) + np.repeat(first - np.cumsum(count) + count, count)]
        at = plan_m[place, 1]
        holds = (low_m[triangle, 1] <= at) & (high_m[triangle, 1] >= at)
        found.append((place[holds], some.start + triangle[holds]))
    place, triangle = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.lexsort((triangle, place))
    ends = np.cumsum(np.bincount(place, minlength=plan_m.shape[0]))
    return np.split(triangle[order].astype(np.int32), ends[:-1])


def _is_inside(scene: Scene, place: FloatArray, over: Int32Array) -> bool:
    """Whether a place on the ground (3,) is inside an element: with an odd number of faces above and below.

    over : (T,) triangles that a plumb line through it may meet. An element that is itself the only ground there is
    none: a room modelled as one closed surface is a room.
    """
    corners_m = scene.vertices_m[scene.triangles[over]]
    line = sample_columns(corners_m, over, low_m=place[:2], step_m=1.0, shape=(1, 1))
    element = scene.element_of_triangle[line.triangle]
    above = line.z_m > place[2] + 0.5 * _SAME_GROUND_M
    met, of_line = np.unique(element, return_inverse=True)
    n_above = np.bincount(of_line[above], minlength=met.size)
    n_below = np.bincount(of_line[~above], minlength=met.size)
    ground = np.unique(of_line[np.abs(line.z_m - place[2]) <= 0.5 * _SAME_GROUND_M])
    if ground.size == 1:
        n_below[ground] = 0
    return bool(((n_above % 2 == 1) & (n_below % 2 == 1)).any())
