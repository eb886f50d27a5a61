"""Floors as areas for maps: the outline of each one's ground with its openings, read from the plan folder's stage.

PlanSource -> polygons by floor, scene frame, metres. Where the folder holds no stage, floors are the rectangles around
their ground, as plan.json has them, and a remark says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.export.polylines import doubled_area_m2
from planner_core.export.section import floor_outline
from planner_core.export.sheets.building import Building, read_building
from planner_core.model import FloatArray, Floor
from planner_core.plan_folder.plan_source import FieldFloor, PlanSource

#: Rings around less are seams between slabs that do not quite meet.
_LEAST_AREA_M2 = 1e-3
GROUND, BOUNDS = "ground", "bounds"


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


def outlines_of(plan: PlanSource, floors: Sequence[FieldFloor]) -> tuple[dict[str, FloorOutline], tuple[str, ...]]:
    """Return the outline of each floor by its id, and remarks, one line each.

    Raises
    ------
    ExportError
        The stage of the plan folder can't be read.
    """
    building = read_building(plan.folder)
    if isinstance(building, str):
        remark = f"floors are the rectangles around their ground: {building.partition(':')[0]}"
        return {floor.id: _rectangle(floor) for floor in floors}, (remark,)
    numbers = {floor.id: number for number, floor in enumerate(plan.floors)}
    return {floor.id: _of_ground(building, floor, numbers[floor.id]) for floor in floors}, ()


def _rectangle(floor: FieldFloor) -> FloorOutline:
    (x0, y0), (x1, y1) = floor.bounds.tolist()
    return FloorOutline(((np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]),),), BOUNDS)


def _of_ground(building: Building, floor: FieldFloor, number: int) -> FloorOutline:
    offset_m = building.scene.offset_m
    ground = np.flatnonzero(building.ground_of_triangle == number).astype(np.int32)
    local = Floor(
        id=floor.id,
        name=floor.name,
        elevation_m=floor.elevation_m - float(offset_m[2]),
        ground_area_m2=0.0,
        ground_triangles=ground,
        bounds_m=floor.bounds - offset_m[:2],
        origin="slab",
    )
    rings = [line.points_m for line in floor_outline(building.scene, local) if line.closed]
    rings = [ring for ring in rings if doubled_area_m2(ring) / 2 > _LEAST_AREA_M2]
    return FloorOutline(nested(rings), GROUND) if ground.size and rings else _rectangle(floor)


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
