"""Drawings stage: plane segments joined to polylines, and areas that triangles cover. Any frame, metres.

Ends within 0.1 mm are one; sides that share a part only are cut where they do; a polyline keeps its corners and loses
the points between them. The same segments in any order make the same polylines.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Int64Array
from planner_core.model.arrays import dots

SAME_POINT_M = 1e-4
"""Ends nearer than this are one point: 0.1 mm, the last digit of coordinates that we hand over."""

#: A corner this little off a straight line is none. Well below the last digit handed over.
_STRAIGHT_M = 2e-5

_Ends = list[tuple[int, int]]
_Pairs = list[tuple[tuple[int, int], tuple[int, int]]]


def nodes(points_m: FloatArray) -> tuple[Int64Array, FloatArray]:
    """Number points (N, 2) by place: (N,) numbers, and the places (M, 2). Points within `SAME_POINT_M` are one."""
    if not len(points_m):
        return np.zeros(0, dtype=np.int64), points_m
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    distinct_m, number = np.unique(points_m, axis=0, return_inverse=True)
    near = KDTree(distinct_m).query_pairs(SAME_POINT_M, output_type="ndarray")
    n = len(distinct_m)
    joined = coo_array((np.ones(len(near), dtype=np.int8), (near[:, 0], near[:, 1])), shape=(n, n))
    _, label = connected_components(joined, directed=False)
    # The first of a cluster, by x then y, stands for it: sums would depend on how many triangles meet there.
    _, first, of = np.unique(label, return_index=True, return_inverse=True)
    return of[number.reshape(-1)].astype(np.int64), distinct_m[first]


def distinct_edges(edges: Int64Array) -> Int64Array:
    """Distinct edges (K, 2) with the smaller number first, without those from a node to itself."""
    edges = edges[edges[:, 0] != edges[:, 1]]
    distinct: Int64Array = np.unique(np.sort(edges, axis=1), axis=0)
    return distinct


def loose_nodes(edges: Int64Array) -> Int64Array:
    """Nodes where an odd number of edges meets: ends, and corners that lie within another edge."""
    node, count = np.unique(edges, return_counts=True)
    odd: Int64Array = node[count % 2 == 1]
    return odd


def split_at(edges: Int64Array, cuts: Int64Array, places_m: FloatArray) -> tuple[Int64Array, Int64Array]:
    """Split edges (K, 2) at those of the nodes `cuts` that lie on them.

    Returns
    -------
    pieces : (L, 2) int64, in the direction of the edges that they are of. of : (L,) int64, into `edges`.
    """
    whole = np.arange(len(edges), dtype=np.int64)
    if not cuts.size or not len(edges):
        return edges, whole
    from scipy.spatial import KDTree

    a_m, b_m = places_m[edges[:, 0]], places_m[edges[:, 1]]
    half_m = np.hypot(*(b_m - a_m).T) / 2
    near = KDTree(places_m[cuts]).query_ball_point((a_m + b_m) / 2, half_m + SAME_POINT_M, return_sorted=True)
    # Pairs of an edge and a node near it, then those of them where the node lies on the edge.
    edge = np.repeat(whole, [len(found) for found in near])
    node = cuts[np.concatenate([np.array(found, dtype=np.int64) for found in near])]
    along = (b_m - a_m)[edge] / (2 * half_m[edge, None])
    offset_m = places_m[node] - a_m[edge]
    at_m = dots(offset_m, along)
    on = (node != edges[edge, 0]) & (node != edges[edge, 1])
    on &= (np.abs(cross(along, offset_m)) <= SAME_POINT_M) & (at_m > 0) & (at_m < 2 * half_m[edge])
    # Stops of every edge from its beginning to its end; two that follow each other make a piece.
    stop = np.concatenate([edges[:, 0], node[on], edges[:, 1]])
    of = np.concatenate([whole, edge[on], whole])
    order = np.lexsort((np.concatenate([np.full(len(edges), -np.inf), at_m[on], np.full(len(edges), np.inf)]), of))
    stop, of = stop[order], of[order]
    same = np.flatnonzero(of[:-1] == of[1:])
    return np.column_stack([stop[same], stop[same + 1]]), of[same]


def chains(edges: Int64Array, places_m: FloatArray) -> Iterator[tuple[list[int], bool]]:
    """Walk edges (K, 2) as few chains of nodes as they make; True: the chain is closed, its first node not repeated.

    Each edge is walked once, and a closed chain passes each of its nodes once. What goes on behind a node is settled
    before: see `_onward`.
    """
    onward = _onward(edges, places_m)
    walked = np.zeros(len(edges), dtype=np.bool_)
    loose = [(e, end) for e in range(len(edges)) for end in (0, 1) if (e, end) not in onward]
    for start, closed in [(each, False) for each in loose] + [((e, 0), True) for e in range(len(edges))]:
        edge, end = start
        if walked[edge]:
            continue
        chain = [int(edges[edge, end])]
        while True:
            walked[edge] = True
            chain.append(int(edges[edge, 1 - end]))
            following = onward.get((edge, 1 - end))
            if following is None or walked[following[0]]:
                break
            edge, end = following
        if closed:
            yield from ((loop, True) for loop in _simple_loops(chain[:-1]))
        else:
            yield chain, False


def _simple_loops(chain: list[int]) -> Iterator[list[int]]:
    """Part a closed chain that comes by a node again into loops that pass each of their nodes once."""
    open_part: list[int] = []
    for node in chain:
        if node in open_part:
            start = open_part.index(node)
            yield open_part[start:]
            del open_part[start:]
        open_part.append(node)
    yield open_part


def _onward(edges: Int64Array, places_m: FloatArray) -> dict[tuple[int, int], tuple[int, int]]:
    """Which end of an edge goes on in which end of another; an end is (edge, 0 or 1).

    Where two ends meet they go on in each other, where more do, the straightest pair up: of an odd number one is left.
    """
    at_node: dict[int, list[tuple[int, int]]] = {}
    for number, (a, b) in enumerate(edges.tolist()):
        at_node.setdefault(a, []).append((number, 0))
        at_node.setdefault(b, []).append((number, 1))
    onward = {}
    for node, ends in at_node.items():
        if len(ends) == 2:
            pairs = [(ends[0], ends[1])]
        else:
            away_m = np.array([places_m[edges[e, 1 - end]] - places_m[node] for e, end in ends])
            turn = np.arctan2(away_m[:, 1], away_m[:, 0])
            pairs = _straightest(ends, turn)
        for one, other in pairs:
            onward[one], onward[other] = other, one
    return onward


def _straightest(ends: _Ends, turn: FloatArray) -> _Pairs:
    """Pair the two ends that make the straightest line, then the next two; of an odd number one is left over."""
    left, pairs = list(range(len(ends))), []
    while len(left) > 1:
        i, j = min(
            ((i, j) for k, i in enumerate(left) for j in left[k + 1 :]),
            key=lambda pair: -np.cos(turn[pair[0]] - turn[pair[1]] - np.pi),
        )
        pairs.append((ends[i], ends[j]))
        left = [k for k in left if k not in (i, j)]
    return pairs


def corners(points_m: FloatArray) -> FloatArray:
    """Leave out points (N, 2) of a line that lie on the straight way between those kept."""
    kept = [0]
    for number in range(2, len(points_m)):
        start, chord = points_m[kept[-1]], points_m[number] - points_m[kept[-1]]
        between_m = points_m[kept[-1] + 1 : number] - start
        length_m = float(np.hypot(*chord))
        off_m = np.abs(cross(chord, between_m)) / max(length_m, _STRAIGHT_M)
        along_m = between_m @ chord / max(length_m, _STRAIGHT_M)
        back = length_m < _STRAIGHT_M and (np.hypot(*between_m.T) > _STRAIGHT_M).any()  # where it came from: no chord
        if back or (off_m > _STRAIGHT_M).any() or (along_m < 0).any() or (along_m > length_m).any():
            kept.append(number - 1)
    kept.append(len(points_m) - 1)
    of_line: FloatArray = points_m[kept]
    return of_line


def doubled_area_m2(points_m: FloatArray) -> float:
    """Twice the area inside a closed line (N, 2), positive where it runs counter-clockwise."""
    # About the first corner: far from the origin, products of coordinates have no digits left for the area.
    x, y = (points_m - points_m[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """(...) twice the area that plane vectors a, b (..., 2) span, positive where b is to the left of a."""
    turned: FloatArray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return turned


# ------------------------------------------------------------------------------------------------------ areas
def covered_polygons(corners_m: FloatArray, without_m: FloatArray | None = None) -> list[list[FloatArray]]:
    """Find the area that triangles (K, 3, 2) of any winding cover, as polygons.

    Parameters
    ----------
    without_m
        (L, 3, 2) triangles whose area is taken away; None: nothing is.

    Returns
    -------
    Of each polygon its outer ring, then its openings: (N, 2) float64 each, the first corner not repeated. Corners are
    rounded to `SAME_POINT_M`, which closes narrower slits; polygons touch each other in single places at most.
    """
    import shapely

    # About the first corner: rounding is to whole steps from the origin.
    origin_m = corners_m[0, 0] if len(corners_m) else np.zeros(2)
    area = _union(corners_m - origin_m)
    if without_m is not None:
        area = shapely.difference(area, _union(without_m - origin_m), grid_size=SAME_POINT_M)
    polygons = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and not part.is_empty]
    return [
        [shapely.get_coordinates(ring)[:-1] + origin_m for ring in (polygon.exterior, *polygon.interiors)]
        for polygon in polygons
    ]


def distances_m(points_m: FloatArray, corners_m: FloatArray) -> FloatArray:
    """(N,) distances of points (N, 2) from the area that triangles (K, 3, 2) cover; 0 on it."""
    import shapely

    found: FloatArray = shapely.distance(shapely.points(points_m), _union(corners_m))
    return found


def _union(corners_m: FloatArray) -> Any:
    import shapely

    return shapely.union_all(shapely.polygons(corners_m), grid_size=SAME_POINT_M)
