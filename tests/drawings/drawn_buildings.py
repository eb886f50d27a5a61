"""Floor plans drawn with ezdxf and shapely alone: of a mesh cut at a height, and of two rooms made by hand.

Walls are drawn by their outlines, doors as blocks of leaf and swing, windows as blocks of lines, names of rooms as
texts, on layers as offices name them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import shapely

from planner_core.drawings.drawn_building import DrawnBuilding, DrawnFile, DrawnStorey, DrawnText, DrawnWall
from planner_core.model import Scene

LAYERS = {"wall": "A-WALL", "door": "A-DOOR", "window": "A-GLAZ", "text": "A-AREA-IDEN", "stair": "A-FLOR-STRS"}


def cut_area(scene: Scene, classes: Sequence[str], z_m: float) -> Any:
    """Shapely area that elements of some classes have in common with a plane at a height, local frame."""
    areas = []
    for number, element in enumerate(scene.elements):
        if not element.kind.startswith(tuple(classes)):
            continue
        corners = scene.vertices_m[scene.triangles[scene.element_of_triangle == number]]
        lines = _crossings(corners, z_m)
        if len(lines):
            noded = shapely.union_all(shapely.linestrings(np.round(lines, 5)), grid_size=1e-5)
            rings = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
            # Even-odd: a face of the mesh's section is inside where a ray from it crosses an odd number of lines.
            inside = [ring for ring in rings if _is_inside(ring, lines)]
            areas.append(shapely.union_all(inside))
    return shapely.union_all(areas, grid_size=1e-4) if areas else shapely.Polygon()


def _crossings(corners: np.ndarray[Any, Any], z_m: float) -> np.ndarray[Any, Any]:
    """(M, 2, 2) segments in which triangles (K, 3, 3) cross a plane."""
    above = corners[:, :, 2] > z_m
    crossing = corners[above.any(axis=1) & ~above.all(axis=1)]
    found = []
    for triangle in crossing:
        ends = []
        for k in range(3):
            a, b = triangle[k], triangle[(k + 1) % 3]
            if (a[2] > z_m) != (b[2] > z_m):
                low, high = (a, b) if a[2] < b[2] else (b, a)  # both triangles of an edge get the same bits
                ends.append(low[:2] + (z_m - low[2]) / (high[2] - low[2]) * (high[:2] - low[:2]))
        found.append(ends)
    return np.array(found).reshape(-1, 2, 2)


def _is_inside(ring: Any, lines: np.ndarray[Any, Any]) -> bool:
    x, y = shapely.get_coordinates(shapely.point_on_surface(ring))[0]
    a, b = lines[:, 0], lines[:, 1]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    at = a[spans, 0] + (y - a[spans, 1]) / (b[spans, 1] - a[spans, 1]) * (b[spans, 0] - a[spans, 0])
    return bool((at > x).sum() % 2)


@dataclass(frozen=True)
class DrawnOpening:
    """A door or window in plan: middle, unit vector along, width and depth of its box."""

    middle: np.ndarray[Any, Any]
    along: np.ndarray[Any, Any]
    width_m: float
    depth_m: float


def openings_at(scene: Scene, kind: str, z_m: float) -> list[DrawnOpening]:
    """Doors (`IfcDoor`) or windows whose boxes a plane at a height cuts."""
    found = []
    for number, element in enumerate(scene.elements):
        if element.kind != kind:
            continue
        corners = scene.vertices_m[scene.triangles[scene.element_of_triangle == number]].reshape(-1, 3)
        if not len(corners) or not corners[:, 2].min() < z_m < corners[:, 2].max():
            continue
        box = shapely.get_coordinates(shapely.oriented_envelope(shapely.multipoints(corners[:, :2])))[:4]
        sides = np.stack([box[1] - box[0], box[2] - box[1]])
        length = np.hypot(sides[:, 0], sides[:, 1])
        long = int(np.argmax(length))
        if length.min() > 0.5:
            continue  # a leaf that stands open: its box does not show where the opening is
        found.append(DrawnOpening(box.mean(axis=0), sides[long] / length[long], length[long], length[1 - long]))
    return found


def draw(
    scene: Scene,
    z_m: float,
    path: Path,
    *,
    unit_m: float = 0.001,
    insunits: int = 4,
    layers: dict[str, str] | None = None,
) -> Any:
    """Draw the plan at a height as DXF and return the area of its walls, local frame."""
    names = LAYERS | (layers or {})
    document = ezdxf.new("R2010", units=insunits)
    space = document.modelspace()
    walls = cut_area(scene, ("IfcWall", "IfcColumn"), z_m)
    for polygon in shapely.get_parts(walls):
        for ring in (polygon.exterior, *polygon.interiors):
            corners = shapely.get_coordinates(ring)[:-1] / unit_m
            space.add_lwpolyline(corners.tolist(), close=True, dxfattribs={"layer": names["wall"]})
    for number, door in enumerate(openings_at(scene, "IfcDoor", z_m)):
        _insert(document, f"DR{number}", door, unit_m, names["door"], _draw_door)
    for number, window in enumerate(openings_at(scene, "IfcWindow", z_m)):
        _insert(document, f"WN{number}", window, unit_m, names["window"], _draw_window)
    for room in scene.rooms:
        low, high = room.box_m
        if low[2] < z_m < high[2]:
            text = space.add_mtext(f"{room.name}\\P{room.long_name}", dxfattribs={"layer": names["text"]})
            at = shapely.get_coordinates(_inside_of(room))[0] / unit_m
            text.set_location(tuple(at), attachment_point=5)
            text.dxf.char_height = 0.2 / unit_m
    document.saveas(path)
    return walls


def _inside_of(room: Any) -> Any:
    area = shapely.union_all(shapely.polygons(room.vertices_m[room.triangles][:, :, :2]))
    return shapely.point_on_surface(area)


def _insert(document: Any, name: str, opening: DrawnOpening, unit_m: float, layer: str, fill: Any) -> None:
    fill(document.blocks.new(name), opening.width_m / unit_m, opening.depth_m / unit_m)
    start = (opening.middle - 0.5 * opening.width_m * opening.along) / unit_m
    angle = float(np.degrees(np.arctan2(opening.along[1], opening.along[0])))
    document.modelspace().add_blockref(name, tuple(start), dxfattribs={"layer": layer, "rotation": angle})


def _draw_door(block: Any, width: float, depth: float) -> None:
    """Leaf open by 90 degrees from the left jamb, and its swing to the right one."""
    block.add_line((0, 0), (0, width))
    block.add_arc((0, 0), width, 0, 90)


def _draw_window(block: Any, width: float, depth: float) -> None:
    for y in (-0.5 * depth, 0.0, 0.5 * depth):
        block.add_line((0, y), (width, y))


#: Two rooms, metres: their walls with gaps for two doors and a window, and what lies in the gaps.
ROOM_WALLS = shapely.box(0, 0, 6.5, 4.4) - shapely.box(0.2, 0.2, 3.2, 4.2) - shapely.box(3.3, 0.2, 6.3, 4.2)
INNER_DOOR, ENTRANCE, WINDOW = (
    shapely.box(3.2, 1.0, 3.3, 1.9),
    shapely.box(1.0, 0.0, 2.0, 0.2),
    shapely.box(4.0, 4.2, 5.5, 4.4),
)
ROOM_WALLS = ROOM_WALLS - INNER_DOOR - ENTRANCE - WINDOW
ENGLISH = {"wall": "A-WALL", "door": "A-DOOR", "window": "A-GLAZ", "text": "A-ANNO-TEXT"}


def draw_two_rooms(
    path: Path,
    *,
    unit_m: float = 0.001,
    insunits: int = 4,
    layers: dict[str, str] = ENGLISH,
    window_gap: bool = True,
    symbols: bool = True,
    z_m: float = 0.0,
    document: Any = None,
) -> Any:
    """Draw two rooms; without a gap for the window, its lines lie over the wall's. Returns ezdxf's document."""
    document = document or ezdxf.new("R2010", units=insunits)
    space = document.modelspace()
    walls = ROOM_WALLS if window_gap else ROOM_WALLS | WINDOW
    elevation = z_m / unit_m

    def line(points: Any, layer: str) -> None:
        corners = (np.asarray(points) / unit_m).tolist()
        space.add_lwpolyline(corners, dxfattribs={"layer": layer, "elevation": elevation})

    for polygon in shapely.get_parts(walls):
        for ring in (polygon.exterior, *polygon.interiors):
            line(shapely.get_coordinates(ring), layers["wall"])
    if symbols:
        line([(3.25, 1.0), (4.15, 1.0)], layers["door"])
        line([(1.0, 0.1), (1.0, 1.1)], layers["door"])
        for centre, radius in (((3.25, 1.0), 0.9), ((1.0, 0.1), 1.0)):
            where = {"layer": layers["door"]}
            space.add_arc((*(np.array(centre) / unit_m), elevation), radius / unit_m, 0, 90, dxfattribs=where)
        for y in (4.2, 4.3, 4.4):
            line([(4.0, y), (5.5, y)], layers["window"])
    for text, at in (("101\\POffice", (1.5, 2.5)), ("102 Kitchen", (4.8, 2.5)), ("12,00 m2", (1.5, 3.0))):
        named = space.add_mtext(text, dxfattribs={"layer": layers["text"]})
        named.set_location((at[0] / unit_m, at[1] / unit_m, elevation), attachment_point=5)
    document.saveas(path)
    return document


def room_document() -> DrawnBuilding:
    """Return the document of one room of 4 by 3 m, its name `7 Store`, between four walls."""
    sides = ((0.0, 0.0, 4.4, 0.2), (0.0, 3.2, 4.4, 3.4), (0.0, 0.2, 0.2, 3.2), (4.2, 0.2, 4.4, 3.2))
    walls = tuple(
        DrawnWall(f"W{number}", ((x, y), (u, y), (u, v), (x, v))) for number, (x, y, u, v) in enumerate(sides, 1)
    )
    return DrawnBuilding(
        name="house",
        files=(DrawnFile("house.dxf", "0" * 64),),
        door_height_m=2.1,
        sill_height_m=0.9,
        window_head_m=2.1,
        slab_m=0.2,
        storeys=(DrawnStorey("Level 1", 0.0, 2.8, False, walls, (), (DrawnText("7 Store", (2.0, 2.0)),)),),
    )
