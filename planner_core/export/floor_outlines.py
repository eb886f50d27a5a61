"""Floors as areas for maps: the outline of each one's ground with its openings, read from the plan folder's stage.

PlanSource -> polygons by floor, scene frame, metres. Where the folder holds no stage, floors are the rectangles around
their ground, as plan.json has them, with a remark. `solid_rings` are what drawings fill of a floor's section.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.export.polylines import doubled_area_m2
from planner_core.export.section import SectionLine, floor_outline
from planner_core.export.sheets.building import Building, building_of
from planner_core.model import FloatArray, Floor, Scene
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.scene.inside import ROOM_WIDTH_M, encloses_room

#: Rings around less are seams between slabs that do not quite meet.
_LEAST_AREA_M2 = 1e-3
GROUND, BOUNDS = "ground", "bounds"
#: Points along each side of an area's bounds by which its rooms are recognised.
_N_GRID = 30


@dataclass(frozen=True, eq=False)
class FloorOutline:
    """polygons : each its outer ring, counter-clockwise, then its openings, clockwise; (N, 2) float64, none closed.

    made_of : `GROUND`, or `BOUNDS` where they are the rectangle around it.
    """

    polygons: tuple[tuple[FloatArray, ...], ...]
    made_of: str

    @property
    def area_m2(self) -> float:
        """Without the openings."""
        return sum(doubled_area_m2(ring) for rings in self.polygons for ring in rings) / 2


def outlines_of(plan: PlanSource, floors: Sequence[FloorSection]) -> tuple[dict[str, FloorOutline], tuple[str, ...]]:
    """Return the outline of each floor by its id, and remarks, one line each.

    Raises
    ------
    ExportError
        The stage of the plan folder can't be read.
    """
    building = building_of(plan)
    if isinstance(building, str):
        remark = f"floors are the rectangles around their ground: {building.partition(':')[0]}"
        return {floor.id: _rectangle(floor) for floor in floors}, (remark,)
    return {floor.id: _of_ground(building, plan, floor) for floor in floors}, ()


def _rectangle(floor: FloorSection) -> FloorOutline:
    (x0, y0), (x1, y1) = floor.bounds
    return FloorOutline(((np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]),),), BOUNDS)


def _of_ground(building: Building, plan: PlanSource, floor: FloorSection) -> FloorOutline:
    local = building.local_floor(plan, floor)
    rings = [line.points_m for line in floor_outline(building.scene, local) if line.closed]
    rings = [ring for ring in rings if doubled_area_m2(ring) / 2 > _LEAST_AREA_M2]
    return FloorOutline(nested(rings), GROUND) if local.ground_triangles.size and rings else _rectangle(floor)


def nested(rings: Sequence[FloatArray]) -> tuple[tuple[FloatArray, ...], ...]:
    """Sort rings that fill by the even-odd rule into polygons with openings.

    Parameters
    ----------
    rings
        (N, 2) each, counter-clockwise, none crossing another or itself; they may touch.
    """
    import shapely

    areas = [shapely.Polygon(ring) for ring in rings]
    # Rings may share corners, but no sides: a place inside of one that touches another is on one side of it.
    places = [area.representative_point() for area in areas]
    sizes = [area.area for area in areas]
    inside = [
        [k for k, other in enumerate(areas) if sizes[k] > sizes[i] and other.contains(place)]
        for i, place in enumerate(places)
    ]
    polygons = []
    for number, around in enumerate(inside):
        if len(around) % 2:
            continue
        openings = [k for k, others in enumerate(inside) if number in others and len(others) == len(around) + 1]
        polygons.append((rings[number], *(np.concatenate([rings[k][:1], rings[k][:0:-1]]) for k in openings)))
    return tuple(polygons)


def solid_rings(
    scene: Scene, floor: Floor, lines: Iterable[SectionLine], *, cut_m: float
) -> Iterator[tuple[FloatArray, ...]]:
    """Yield the closed lines of each element that is cut, those of its rooms left out; they fill by the even-odd rule.

    lines : of `floor_section`, `cut_m` above the ground of the `floor`, in the local frame.
    """
    import shapely

    of_element: dict[int, list[FloatArray]] = {}
    for line in lines:
        if line.closed:
            of_element.setdefault(line.element, []).append(line.points_m)
    for element, rings in of_element.items():
        if not any((np.ptp(ring, axis=0) >= ROOM_WIDTH_M).all() for ring in rings):
            yield tuple(rings)
            continue
        solid: list[FloatArray] = []
        for polygon in nested(rings):
            area = shapely.Polygon(polygon[0], polygon[1:])
            width_m = 2 * float(shapely.maximum_inscribed_circle(area, tolerance=0.05).length)
            plan_m = _points_in(area) - scene.offset_m[:2]
            if not encloses_room(
                scene,
                floor,
                element=element,
                plan_m=plan_m,
                width_m=width_m,
                cut_m=floor.elevation_m + cut_m,
            ):
                solid += polygon
        if solid:
            yield tuple(solid)


def _points_in(area: Any) -> FloatArray:
    """(K, 2) points of a grid that lie inside a polygon."""
    import shapely

    x0, y0, x1, y1 = area.bounds
    x, y = (low + (high - low) * (np.arange(_N_GRID) + 0.5) / _N_GRID for low, high in ((x0, x1), (y0, y1)))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside: FloatArray = grid[shapely.contains_xy(area, grid)]
    return inside
