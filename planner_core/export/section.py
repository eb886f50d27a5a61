"""Drawings stage: the lines that a floor plan is drawn of, cut out of the mesh as exact polylines.

Scene and Floor -> `SectionLine`s in plan, scene frame, metres: what a horizontal plane cuts (`floor_section`), the edge
of the ground (`floor_outline`), and what lies below the cut as seen from above (`lines_below`).

      z = ground + cut_m  - - -+----+- - - - - -+----+- - -     a triangle crosses the plane in one segment; segments of
                               |wall|           |wall|          one element that share an end become one polyline
      ground ==================+====+===========+====+====

Both triangles of an edge get the same bits from `plane_crossings`, so segments join without any tolerance wherever the
mesh does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.export.polylines import (
    chains,
    corners,
    covered_polygons,
    distances_m,
    distinct_edges,
    doubled_area_m2,
    loose_nodes,
    nodes,
    split_at,
)
from planner_core.model import BoolArray, Element, FloatArray, Floor, Int64Array, Optics, Scene
from planner_core.model.arrays import area_normals, bounds_of
from planner_core.plan_folder.section_view import BELOW_GROUND_M, CUT_HEIGHT_M, plane_crossings
from planner_core.scene.floors import ground_levels

#: What lies nearer to the ground is its covering, and no thing on it.
_LEAST_RISE_M = 0.02
#: Surfaces steeper than this are sides: their upper edges are those of what they carry.
_MOST_SLOPE_RAD = np.deg2rad(60.0)

#: What a line is of, in the order in which drawings put them: structure first.
KINDS = ("wall", "column", "slab", "door", "window", "glass", "stair", "railing", "furniture", "other")

#: Beginnings of IFC classes, longer ones before those that they begin with.
_KIND_OF_CLASS = (
    ("IfcWall", "wall"),
    ("IfcCurtainWall", "window"),
    ("IfcColumn", "column"),
    ("IfcPile", "column"),
    ("IfcDoor", "door"),
    ("IfcWindow", "window"),
    ("IfcPlate", "window"),
    ("IfcStair", "stair"),
    ("IfcRamp", "stair"),
    ("IfcRailing", "railing"),
    ("IfcSlab", "slab"),
    ("IfcRoof", "slab"),
    ("IfcCovering", "slab"),
    ("IfcFooting", "wall"),
    ("IfcFurni", "furniture"),
    ("IfcSystemFurniture", "furniture"),
    ("IfcFlowTerminal", "furniture"),
    ("IfcSanitaryTerminal", "furniture"),
)
#: Words in names of elements that have no class (OBJ groups, glTF nodes, USD prims), in the order of the search.
_KIND_OF_WORD = (
    ("door", "door"),
    ("glass", "glass"),
    ("window", "window"),
    ("stair", "stair"),
    ("railing", "railing"),
    ("column", "column"),
    ("pillar", "column"),
    ("wall", "wall"),
    ("slab", "slab"),
    ("roof", "slab"),
    ("ceiling", "slab"),
    ("floor", "slab"),
    ("furniture", "furniture"),
    ("table", "furniture"),
    ("chair", "furniture"),
    ("desk", "furniture"),
    ("shelf", "furniture"),
    ("sofa", "furniture"),
    ("bed", "furniture"),
)


@dataclass(frozen=True)
class SectionLine:
    """One polyline of a floor plan.

    points_m : (N, 2) float64, plan coordinates in the SCENE frame, N >= 2; of a closed line N >= 3, the first point is
    not repeated, the start is its lowest x (then y), and it runs counter-clockwise. All closed lines of one element
    bound its cut surface by the even-odd rule.
    element : index into `Scene.elements`; -1: of no element (the ground's outline). kind : one of `KINDS`; `ground` of
    the outline.
    """

    points_m: FloatArray
    closed: bool
    element: int
    kind: str

    @property
    def length_m(self) -> float:
        """Along the line, back to the start where it is closed."""
        ends_m = np.roll(self.points_m, -1, axis=0) if self.closed else self.points_m[1:]
        steps_m = ends_m - self.points_m[: len(ends_m)]
        return float(np.hypot(steps_m[:, 0], steps_m[:, 1]).sum())


def kind_of(element: Element) -> str:
    """Say what lines of an element are of: one of `KINDS`, by its class, or by its name where it has no IFC class."""
    if element.kind.startswith("Ifc"):
        return next((kind for beginning, kind in _KIND_OF_CLASS if element.kind.startswith(beginning)), "other")
    name = element.name.lower()
    return next((kind for word, kind in _KIND_OF_WORD if word in name), "other")


def floor_section(scene: Scene, floor: Floor, cut_m: float = CUT_HEIGHT_M) -> tuple[SectionLine, ...]:
    """Cut the scene horizontally, `cut_m` above a floor's ground.

    Returns
    -------
    tuple of SectionLine
        Sorted by element, then by place. Lines of panes that let beams through are `glass`, whatever element they are
        of. Surfaces that lie in the cutting plane count as below it.
    """
    found = []
    for ground_m, _ in (levels := ground_levels(scene, floor)):
        segments_m, triangle = plane_crossings(scene, ground_m + cut_m)
        glass = np.zeros(len(triangle), dtype=np.bool_)
        if scene.optics_of_triangle is not None:
            glass = scene.optics_of_triangle[triangle] == Optics.PASSES
        found.append(_lines(scene, segments_m, scene.element_of_triangle[triangle].astype(np.int64), glass))
    return _of_their_levels(scene, levels, found)


def floor_outline(scene: Scene, floor: Floor) -> tuple[SectionLine, ...]:
    """Outline a floor's ground: closed lines, holes among them, that fill by the even-odd rule.

    Where the floor has no ground of its own (`storey-elevation`) it is the rectangle of its bounds.
    """
    if not floor.ground_triangles.size:
        (x0, y0), (x1, y1) = floor.bounds_m + scene.offset_m[:2]
        return (SectionLine(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), True, -1, "ground"),)
    corners_m = scene.vertices_m[scene.triangles[floor.ground_triangles]][:, :, :2]
    rings = [
        _line(ring, True, scene.offset_m[:2], -1, "ground")
        for polygon in covered_polygons(corners_m)
        for ring in polygon
    ]
    return tuple(sorted(rings, key=lambda ring: tuple(ring.points_m[0])))


def lines_below(scene: Scene, floor: Floor, cut_m: float = CUT_HEIGHT_M) -> tuple[SectionLine, ...]:
    """Outline what lies between a floor's ground and the cut, seen from above: furniture, steps, sills.

    These are the borders of level faces: of a box its top, of a flight of stairs its treads. What lies hidden under
    other things is drawn too.
    """
    levels = ground_levels(scene, floor)
    return _of_their_levels(scene, levels, [_lines_above(scene, floor, ground_m, cut_m) for ground_m, _ in levels])


def _lines_above(scene: Scene, floor: Floor, ground_m: float, cut_m: float) -> tuple[SectionLine, ...]:
    """`lines_below` of the level whose ground is at a height."""
    corners_m, triangle = _level_faces(scene, floor, ground_m, cut_m)
    if not triangle.size:
        return ()
    # A corner is known by its bits in space: treads one above the other must not join in plan.
    _, corner = np.unique(corners_m.reshape(-1, 3), axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    ends = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]])
    sides_m = np.concatenate([corners_m[:, [0, 1]], corners_m[:, [1, 2]], corners_m[:, [2, 0]]])[:, :, :2]
    element = np.tile(scene.element_of_triangle[triangle].astype(np.int64), 3)
    keys = np.column_stack([element, np.sort(ends, axis=1)])
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    border = np.sort(first[count == 1])
    return _lines(scene, sides_m[border], element[border], np.zeros(len(border), dtype=np.bool_))


def _of_their_levels(
    scene: Scene, levels: list[tuple[float, FloatArray]], found: list[tuple[SectionLine, ...]]
) -> tuple[SectionLine, ...]:
    """Of what each level shows, the lines whose nearest ground is that level's; most floors have one level."""
    if len(levels) == 1:
        return found[0]
    corners_m = [ground_m[:, :, :2] + scene.offset_m[:2] for _, ground_m in levels]
    kept: list[SectionLine] = []
    for number, lines in enumerate(found):
        points_m = np.concatenate([np.zeros((0, 2)), *(line.points_m for line in lines)])
        ends = np.cumsum([0, *(len(line.points_m) for line in lines)])
        away_m = np.array([distances_m(points_m, ground_m) for ground_m in corners_m])
        kept += [
            line
            for line, first, end in zip(lines, ends[:-1], ends[1:], strict=True)
            if away_m[:, first:end].mean(axis=1).argmin() == number
        ]
    return tuple(sorted(kept, key=lambda line: line.element))


# ------------------------------------------------------------------------------------------- from the mesh
def _level_faces(scene: Scene, floor: Floor, ground_m: float, cut_m: float) -> tuple[FloatArray, Int64Array]:
    """Corners (K, 3, 3), local, of level faces of things between ground at a height and the cut, and their triangles.

    Undersides are among them: windings are not trusted (see `planner_core.scene.floors`), and in plan the underside of
    a box has the border of its top.
    """
    z_m = scene.vertices_m[:, 2][scene.triangles]
    lowest_m, highest_m = bounds_of(z_m)
    below_cut = highest_m <= ground_m + cut_m
    inside = below_cut & (lowest_m >= ground_m) & (z_m.mean(axis=1) > ground_m + _LEAST_RISE_M)
    # Through the hole in the slab one sees the flight that leads down; the slab hides all else.
    stairs = np.array([kind_of(element) == "stair" for element in scene.elements], dtype=np.bool_)
    leads_down = stairs[scene.element_of_triangle] & (lowest_m >= ground_m - BELOW_GROUND_M)
    inside |= below_cut & leads_down
    inside[floor.ground_triangles] = False
    triangle = np.flatnonzero(inside)
    corners_m = scene.vertices_m[scene.triangles[triangle]]
    normal = area_normals(corners_m)
    level = np.abs(normal[:, 2]) > np.cos(_MOST_SLOPE_RAD) * np.linalg.norm(normal, axis=1)
    return corners_m[level], triangle[level]


# ------------------------------------------------------------------------------------ from segments to lines
def _lines(scene: Scene, segments_m: FloatArray, element: Int64Array, glass: BoolArray) -> tuple[SectionLine, ...]:
    """Join segments (K, 2, 2) of one element, and of one sort of surface, to lines."""
    if not len(segments_m):
        return ()
    node, places_m = nodes(segments_m.reshape(-1, 2))
    edges = node.reshape(-1, 2)
    key = 2 * element + glass
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    lines = []
    for part in np.split(order, starts[1:]):
        of = int(element[part[0]])
        kind = "glass" if glass[part[0]] else kind_of(scene.elements[of])
        joined = distinct_edges(edges[part])
        joined = distinct_edges(split_at(joined, loose_nodes(joined), places_m)[0])
        found = [
            _line(places_m[np.array(chain)], closed, scene.offset_m[:2], of, kind)
            for chain, closed in chains(joined, places_m)
        ]
        lines += sorted(found, key=lambda line: (tuple(line.points_m[0]), tuple(line.points_m[1]), len(line.points_m)))
    return tuple(lines)


def _line(points_m: FloatArray, closed: bool, offset_m: FloatArray, element: int, kind: str) -> SectionLine:
    """Make a line of points (N, 2), local: without corners on straight parts, in its canonical order."""
    if closed:
        first = int(np.lexsort((points_m[:, 1], points_m[:, 0]))[0])
        points_m = np.roll(points_m, -first, axis=0)
        if doubled_area_m2(points_m) < 0:
            points_m = np.concatenate([points_m[:1], points_m[:0:-1]])
        # The start is a corner of the convex hull, so no straight part runs through it.
        points_m = corners(np.concatenate([points_m, points_m[:1]]))[:-1]
        closed = len(points_m) > 2
    else:
        if tuple(points_m[-1]) < tuple(points_m[0]):
            points_m = points_m[::-1]
        points_m = corners(points_m)
    return SectionLine(np.ascontiguousarray(points_m + offset_m), closed, element, kind)
