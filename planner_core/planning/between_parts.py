"""Candidates between parts of the network that a way on foot joins and no link does.

Input a `Pool` in several parts and the `AllowedPositions` of its candidates; output the pool with more of them, which
join parts. A grid steps over narrow passages, the edge of a survey cuts off what one walks over, and of a large site
few of the grid are candidates. So, where one walks from the candidates of one part to those of another, the ground in
between is tried more finely, and out of scope, too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BoolArray, Candidates, FloatArray, Int64Array, Scene
from planner_core.planning.first_plan import far_apart
from planner_core.planning.pool import Pool, extended, narrowed, without_dispensable
from planner_core.positions.admissibility import RefusalTally
from planner_core.positions.allowed_positions import AllowedPositions
from planner_core.positions.candidates import at_heights, candidates_of, is_near
from planner_core.positions.free_space import half_links, spread
from planner_core.positions.reach import stand_nodes
from planner_core.progress import Progress, silent
from planner_core.requirements.demand import rows_from
from planner_core.requirements.observe_candidates import SeenPatches
from planner_core.scene.doors import placed_doors

#: Longer ways without any candidate are not tried: scans from their ends have little in common with one between.
_LONGEST_M = 12.0
#: Ways that are tried at most, the shortest first; those of the same two parts lie so far apart.
_MOST_WAYS, _APART_M = 12, 3.0
#: Around the middle of a way, so much farther than its ends, about so finely and at so many places at most.
_BEYOND_M, _STEP_M, _MOST_PLACES = 0.5, 0.3, 40
#: Steps of stairs from the middle of a way to its ends.
_RISE_M = 1.5
#: Ways whose middle is nearer than this to that of a shut door lead through it.
_DOOR_M = 1.0
#: Nearer to a candidate there is nothing new; links to candidates farther from the middle of a way do not matter.
_NEAR_M, _AROUND_M = 0.15, 8.0


def with_joining_candidates(
    pool: Pool, places: AllowedPositions, engine: ScanEngine, *, progress: Progress = silent
) -> Pool:
    """Add candidates between parts of the pool that join some; where none does, it is the same pool."""
    if pool.links is None or np.unique(pool.links.part[~pool.excluded]).size < 2:
        return pool
    ways = list(_ways(pool, places))
    more = _tried(pool, places, ways)
    if not more.floor.size:
        return pool
    observed = rows_from(pool.survey, engine, more.position_m, pool.demand, progress=progress)
    joining = np.flatnonzero(_joining(pool, ways, more, observed, engine))
    if not joining.size:
        return pool
    joined = extended(pool, more.take(joining), observed.take(joining.tolist()), engine, joins=True, progress=progress)
    return without_dispensable(joined)


def _joining(
    pool: Pool, ways: list[tuple[FloatArray, float]], more: Candidates, observed: SeenPatches, engine: ScanEngine
) -> BoolArray:
    """(M,) bool: which of `more`, and what each sees, are linked to candidates of different parts around the ways.

    By themselves: a chain of several would be more stations than the join is worth.
    """
    assert pool.links is not None
    middle_m = np.stack([middle_m for middle_m, _ in ways])
    around = is_near(_ground_m(pool.candidates), middle_m, _AROUND_M) & ~pool.excluded
    row = np.union1d(np.flatnonzero(around), np.array(pool.given, dtype=np.int64))
    links = extended(narrowed(pool, row), more, observed, engine, joins=True).links
    assert links is not None
    owner = np.repeat(np.arange(links.n_candidates), np.diff(links.starts))
    out = (owner >= row.size) & (links.neighbour < row.size)
    pairs = np.column_stack([owner[out] - row.size, pool.links.part[row[links.neighbour[out]]]])
    number, n_parts = np.unique(np.unique(pairs, axis=0)[:, 0], return_counts=True)
    return np.isin(np.arange(more.floor.size), number[n_parts > 1])


def _ways(pool: Pool, places: AllowedPositions) -> Iterator[tuple[FloatArray, float]]:
    """Middles (3,) on the ground, local, and lengths of ways between candidates of two parts, the shortest first."""
    assert pool.links is not None
    reach, space = places.reach, places.reach.space
    row = np.flatnonzero(~pool.excluded)
    node = stand_nodes(reach, _ground_m(pool.take(row)))
    row, node = row[node >= 0], node[node >= 0]
    walked, cells = reach.reached_node, space.cells()
    links = np.where(walked[:, None] & walked[space.links] & (space.links >= 0), space.links, -1)
    source = np.full(space.n_nodes, -1, dtype=np.int64)
    source[node] = np.arange(node.size)
    away, nearest = spread(
        links, cells, source, cells[node].astype(np.float64), reach_cells=0.5 * _LONGEST_M / space.grid.cell_m
    )
    part = np.append(pool.links.part[row], -1)[nearest].astype(np.int64)
    one, other = half_links(links, walked & (nearest >= 0), between=part)
    length_m = (away[one] + away[other]) * space.grid.cell_m
    shut = _in_shut_doors(pool.survey.scene, space.position_m(one))
    one, other, length_m = one[~shut], other[~shut], length_m[~shut]
    taken: list[tuple[int, int, FloatArray]] = []
    for way in np.lexsort((other, one, np.round(length_m, 6))).tolist():
        middle_m = space.position_m(one[way : way + 1])[0]
        low, high = sorted((int(part[one[way]]), int(part[other[way]])))
        if all((low, high) != known[:2] or np.linalg.norm(middle_m - known[2]) > _APART_M for known in taken):
            taken.append((low, high, middle_m))
            yield middle_m, float(length_m[way])
        if len(taken) == _MOST_WAYS:
            return


def _in_shut_doors(scene: Scene, ground_m: FloatArray) -> BoolArray:
    """(K,) bool: whether a place (K, 3) is in a shut door, which people open and scans do not pass."""
    is_open = {door.element for door in scene.open_doors}
    shut = [door for door in placed_doors(scene) if door.element not in is_open]
    middle_m = np.array([[*door.box_m[:, :2].mean(axis=0), door.box_m[0, 2]] for door in shut]).reshape(-1, 3)
    return is_near(ground_m, middle_m, _DOOR_M)


def _tried(pool: Pool, places: AllowedPositions, ways: list[tuple[FloatArray, float]]) -> Candidates:
    """Places around the middles of ways where a tripod can stand, by floor."""
    space, tripods = places.reach.space, places.tripods
    place_m, walked = space.position_m(), places.reach.reached_node
    chosen: list[Int64Array] = [np.empty(0, dtype=np.int64)]
    for middle_m, length_m in ways:
        off_m = np.abs(place_m - middle_m)
        near = walked & (np.hypot(off_m[:, 0], off_m[:, 1]) <= 0.5 * length_m + _BEYOND_M) & (off_m[:, 2] <= _RISE_M)
        chosen.append(np.flatnonzero(near))
    node = np.unique(np.concatenate(chosen))
    node = node[np.isin(space.floor[node], tripods.survey.planned)]
    on_floor, tally = [], RefusalTally()
    for index in np.unique(space.floor[node]).tolist():
        here = node[space.floor[node] == index]
        ground_m = tripods.climbed_ground_m(place_m[here])
        height_m = tripods.heights.to_try_m
        position, ground, height = at_heights(height_m, place_m[here, :2], ground_m)
        kept, _ = tripods.reject(index, position, ground, np.repeat(space.on_ground[here], len(height_m)))
        on_floor.append((index, position[kept], height[kept]))
    found = candidates_of(on_floor, tally)
    found = found.take(
        places.allows(found, out_of_scope=True) & ~is_near(found.position_m, pool.candidates.position_m, _NEAR_M)
    )
    return found.take(far_apart(found, _STEP_M, most=_MOST_PLACES * len(ways))) if found.floor.size else found


def _ground_m(at: Candidates) -> FloatArray:
    ground_m = at.position_m.copy()
    ground_m[:, 2] -= at.instrument_height_m
    return ground_m
