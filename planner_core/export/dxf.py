"""A plan as a DXF drawing: the floors' walls cut open, stations as blocks with attributes, links, walk, unseen ground.

PlanSource -> one DXF file in site coordinates. Every floor lies at its own height and has layers of its own,
named by its id (`F0-WALL`); links and ways between floors are on `ALL-` layers. A sheet a floor, to scale, is in
`planner_core.export.dxf_document`. The building is the one of the plan folder's stage, float32 in the local frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.coverage.percent import reached_share
from planner_core.export.chosen import chosen_floors, chosen_stations, ways_of
from planner_core.export.dxf_document import (
    STYLE,
    DxfLayer,
    add_layer,
    add_sheet,
    layer_part,
    new_document,
    place_on_earth,
    say,
    write_document,
)
from planner_core.export.floor_outlines import solid_rings
from planner_core.export.options import Options
from planner_core.export.polylines import covered_polygons
from planner_core.export.section import floor_outline, floor_section, lines_below
from planner_core.export.sheets.building import Building, building_of
from planner_core.export.sheets.paper import check_sheet
from planner_core.export.sheets.unseen import unseen_surface
from planner_core.model import FloatArray
from planner_core.plan_folder import palette
from planner_core.plan_folder.drawing.marks import STRONG_TIMES
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress, ProgressEvent

BLOCK = "TLSPLAN-STATION"
BETWEEN = "ALL"
"""Layers of what belongs to no floor alone begin with this instead of the floor's id."""

#: Marks and letters are for drawings at 1:100: 2 mm and 2.5 mm on paper.
_MARK_M = 0.2
_TEXT_M = 0.25
#: Lines of hatching are this far apart.
_HATCH_M = {"UNSEEN": 0.15, "OUT-OF-REACH": 0.4}
#: Coordinates are rounded to 0.1 mm.
_DECIMALS = 4
#: Strips of missed wall are searched from the ground up to here.
_WALL_TOP_M = 2.5
#: Walls stand this far outside of the ground at most.
_AROUND_M = 1.0
_STRIP_WIDTH_M = 0.06

_GREY = (0.55, 0.57, 0.59)
#: Layers of every floor, in the order in which CAD lists them: what, description, colour, colour number, width.
_LAYERS = (
    ("WALL-FILL", "cut walls, filled", (0.75, 0.76, 0.78), 9, 9),
    ("WALL", "walls, columns and slabs, cut", palette.WALL, 7, 35),
    ("DOOR", "doors, cut", (0.55, 0.27, 0.07), 30, 18),
    ("WINDOW", "windows and glass, cut", (0.0, 0.45, 0.7), 5, 18),
    ("STAIR", "stairs, ramps and railings", _GREY, 8, 13),
    ("FURNITURE", "furniture and other things", _GREY, 8, 9),
    ("OUTLINE", "border of the ground", _GREY, 8, 13),
    ("UNSEEN", "surface that a station could see and none of the plan does", palette.UNSEEN, 30, 13),
    ("OUT-OF-REACH", "floor that no valid position sees", palette.NOT_ACHIEVABLE, 9, 9),
    ("LINK-WEAK", "overlaps too small or too weak to count", _GREY, 8, 13),
    ("LINK", "links between scans that count", palette.LINK, 6, 25),
    ("ROUTE", "route from station to station", palette.ROUTE, 200, 30),
    ("STATION", "stations", palette.STATION, 7, 30),
)
_DASHED = frozenset({"LINK-WEAK"})
#: Switched off at first: they hide what counts.
_OFF = frozenset({"LINK-WEAK"})
_SHARED = ("LINK-WEAK", "LINK", "ROUTE")

_LAYER_OF_KIND = {
    "wall": "WALL",
    "column": "WALL",
    "slab": "WALL",
    "door": "DOOR",
    "window": "WINDOW",
    "glass": "WINDOW",
    "stair": "STAIR",
    "railing": "STAIR",
    "furniture": "FURNITURE",
    "other": "FURNITURE",
    "ground": "OUTLINE",
}
_FILLED = frozenset({"wall", "column", "slab"})


def write_dxf(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the drawing; of the chosen floors, where some are. Returns remarks.

    Raises
    ------
    RequirementError
        A floor or a paper size that is not there, a cut below the ground.
    ExportError
        The plan folder's stage can't be read.
    """
    check_sheet(options.paper, options.cut_m)
    floors, stations = chosen_floors(plan, options), chosen_stations(plan, options)
    drawing = _Drawing(plan, new_document(plan.frame.unit))
    drawing.add_layers(floors)
    _define_block(drawing)
    building = building_of(plan)
    remarks = [building] if isinstance(building, str) else []
    for number, floor in enumerate(floors):
        progress(ProgressEvent("dxf", number, len(floors), floor.name))
        if isinstance(building, Building):
            _draw_building(drawing, building, floor, options)
    _draw_links(drawing, stations)
    _draw_route(drawing, floors)
    for station in stations:
        _draw_station(drawing, station)
    remarks += place_on_earth(drawing.document, plan.frame, drawing.middle())
    for floor in floors:
        add_sheet(drawing.document, plan, floor, paper=options.paper.upper(), hidden=drawing.layers_of_others(floor))
    drawing.document.header.custom_vars.append("Plan", plan.title)
    drawing.show_all()
    write_document(drawing.document, path, name=plan.title)
    progress(ProgressEvent("dxf", len(floors), len(floors)))
    return tuple(remarks)


@dataclass(eq=False)
class _Drawing:
    """A document being drawn, in the unit of the plan's site coordinates, and what leads from the scene frame to it."""

    plan: PlanSource
    document: Any

    def __post_init__(self) -> None:
        self.space = self.document.modelspace()
        self.unit = self.plan.frame.unit
        self._low = np.full(3, np.inf)
        self._high = np.full(3, -np.inf)
        self._parts: dict[str, str] = {}

    def add_layers(self, floors: tuple[FloorSection, ...]) -> None:
        for what, description, colour, number, width in _LAYERS:
            for part, of in self._beginnings(floors):
                if part != BETWEEN or what in _SHARED:
                    layer = DxfLayer(f"{part}-{what}", f"{of}: {description}", colour, number, width)
                    add_layer(self.document, _with_habits(layer, what))

    def _beginnings(self, floors: tuple[FloorSection, ...]) -> list[tuple[str, str]]:
        """Beginnings of layers' names, each once whatever the floors' ids, and the floors' names."""
        taken = {BETWEEN}
        for number, floor in enumerate(floors):
            part = layer_part(floor.id)
            self._parts[floor.id] = part if part not in taken else f"{part}-{number}"
            taken.add(self._parts[floor.id])
        return [*((self._parts[floor.id], floor.name) for floor in floors), (BETWEEN, "between floors")]

    def layer(self, floor_id: str, what: str) -> str:
        """Name of a floor's layer; of the shared one where the floor has none."""
        return f"{self._parts.get(floor_id, BETWEEN)}-{what}"

    def layers_of_others(self, floor: FloorSection) -> list[str]:
        """Layers of all other floors."""
        others = {f"{part}-" for floor_id, part in self._parts.items() if floor_id != floor.id}
        names = (layer.dxf.name for layer in self.document.layers)
        return [name for name in names if any(name == f"{part}{what[0]}" for part in others for what in _LAYERS)]

    def at(self, points_m: FloatArray, z_m: float | None = None) -> FloatArray:
        """(N, 3) of the drawing: of points (N, 3), or (N, 2) at the height `z_m`, of the scene frame."""
        if z_m is not None:
            points_m = np.column_stack([points_m, np.full(len(points_m), z_m)])
        frame = self.plan.frame
        site = np.round(frame.in_unit(frame.to_site(points_m)), _DECIMALS)
        self._low = np.minimum(self._low, site.min(axis=0, initial=np.inf))
        self._high = np.maximum(self._high, site.max(axis=0, initial=-np.inf))
        return site

    def middle(self) -> FloatArray:
        """(2,) E, N of the middle of what is drawn."""
        middle = np.round((self._low + self._high)[:2] / 2)
        return np.where(np.isfinite(middle), middle, 0.0)

    def show_all(self) -> None:
        """Open the drawing on all that is drawn."""
        if not np.isfinite(self._low).all():
            return
        size = self._high - self._low
        self.space.reset_extents(tuple(self._low.tolist()), tuple(self._high.tolist()))
        tall = 1.2 * float(max(size[1], size[0] / 2, self.unit.of(1.0)))
        self.document.set_modelspace_vport(tall, tuple(self.middle()))

    def line(self, points_m: FloatArray, z_m: float, layer: str, *, closed: bool = False) -> Any:
        """Add a line through points (N, 2), level at the height `z_m`, both of the scene frame."""
        site = self.at(points_m, z_m)
        where = {"layer": layer, "elevation": round(float(site[:, 2].mean()), _DECIMALS)}
        return self.space.add_lwpolyline(site[:, :2].tolist(), close=closed, dxfattribs=where)


def _with_habits(layer: DxfLayer, what: str) -> DxfLayer:
    return DxfLayer(
        layer.name, layer.description, layer.colour, layer.number, layer.width, what in _DASHED, what not in _OFF
    )


# -------------------------------------------------------------------------------------------- the building
def _draw_building(drawing: _Drawing, building: Building, floor: FloorSection, options: Options) -> None:
    scene = building.scene
    number = next(i for i, each in enumerate(drawing.plan.floors) if each.id == floor.id)
    local = building.local_floor(drawing.plan, floor)
    z_m = floor.elevation_m
    top_m = min([local.elevation_m + _WALL_TOP_M, *_above(drawing.plan, floor, scene.offset_m)])
    unseen = unseen_surface(
        building,
        number,
        height_m=np.array([local.elevation_m, top_m]),
        window_m=local.bounds_m + np.array([[-_AROUND_M], [_AROUND_M]]),
    ).moved(scene.offset_m[:2])
    _hatch(drawing, unseen.missed, unseen.seen, floor, "UNSEEN")
    _hatch(drawing, unseen.out_of_reach, np.concatenate([unseen.seen, unseen.missed]), floor, "OUT-OF-REACH")
    section = floor_section(scene, local, options.cut_m)
    filled = (line for line in section if line.kind in _FILLED)
    for rings in solid_rings(scene, local, filled, cut_m=options.cut_m):
        _add_hatch(drawing, list(rings), floor, "WALL-FILL")
    for line in (*floor_outline(scene, local), *lines_below(scene, local, options.cut_m), *section):
        drawn = drawing.line(line.points_m, z_m, drawing.layer(floor.id, _LAYER_OF_KIND[line.kind]), closed=line.closed)
        if line.element >= 0:
            of = scene.elements[line.element]
            say(drawn, name=of.name, kind=of.kind, id=of.source_id)
    for strip_m in unseen.walls:
        drawn = drawing.line(strip_m, z_m, drawing.layer(floor.id, "UNSEEN"))
        drawn.dxf.const_width = drawing.unit.of(_STRIP_WIDTH_M)


def _above(plan: PlanSource, floor: FloorSection, offset_m: FloatArray) -> tuple[float, ...]:
    """Heights, local, of the grounds above a floor."""
    return tuple(each.elevation_m - float(offset_m[2]) for each in plan.floors if each.elevation_m > floor.elevation_m)


def _hatch(drawing: _Drawing, triangles_m: FloatArray, over_m: FloatArray, floor: FloorSection, what: str) -> None:
    """Hatch the area that triangles (N, 3, 2) cover and those over them (M, 3, 2) leave free."""
    if not len(triangles_m):
        return
    rings = [ring for polygon in covered_polygons(triangles_m, over_m) for ring in polygon]
    if rings:
        _add_hatch(drawing, rings, floor, what)


def _add_hatch(drawing: _Drawing, rings: list[FloatArray], floor: FloorSection, what: str) -> None:
    site = [drawing.at(ring, floor.elevation_m) for ring in rings]
    height = round(float(site[0][:, 2].mean()), _DECIMALS)
    hatch = drawing.space.add_hatch(
        color=256,
        dxfattribs={"layer": drawing.layer(floor.id, what), "elevation": (0.0, 0.0, height), "hatch_style": 0},
    )
    if what in _HATCH_M:
        # The pattern starts at the first corner: counted from the origin, lines at 6 000 km would lose their digits.
        east, north = site[0][0, :2].tolist()
        step = drawing.unit.of(_HATCH_M[what]) / math.sqrt(2)
        angle = 45.0 if what == "UNSEEN" else 135.0
        away = (-step, step) if what == "UNSEEN" else (-step, -step)
        definition = [[angle, (east, north), away, []]]
        hatch.set_pattern_fill(f"TLSPLAN-{what}", color=256, definition=definition, pattern_type=0)
    for ring in site:
        hatch.paths.add_polyline_path(ring[:, :2].tolist(), is_closed=True)


# -------------------------------------------------------------------------------- stations, links, the walk
def _define_block(drawing: _Drawing) -> None:
    """Define the mark of a station: a circle with a cross, its number beside it, all else as hidden attributes."""
    block = drawing.document.blocks.new(BLOCK)
    mark, text = drawing.unit.of(_MARK_M), drawing.unit.of(_TEXT_M)
    block.add_circle((0, 0), mark)
    for end in ((mark, 0.0), (0.0, mark)):
        block.add_line(tuple(-value for value in end), end)
    beside = 1.2 * mark
    look = {"style": STYLE, "layer": "0"}
    block.add_attdef("NUMBER", (beside, 0.3 * mark), height=text, dxfattribs=look)
    block.add_attdef("ID", (beside, -1.2 * mark), height=0.6 * text, dxfattribs=look)
    for row, tag in enumerate(_HIDDEN):
        attdef = block.add_attdef(tag, (beside, -(2.4 + row) * mark), height=0.6 * text, dxfattribs=look)
        attdef.is_invisible = True


_HIDDEN = ("FLOOR", "E", "N", "H_GROUND", "H_INSTR", "H_SENSOR", "STATE")


def _draw_station(drawing: _Drawing, station: FieldStation) -> None:
    """Insert the mark at the ground point, and a line up to the sensor."""
    layer = drawing.layer(station.floor_id, "STATION")
    known = math.isfinite(station.instrument_height_m)
    ground = drawing.at((station.ground_m if known else station.position_m)[None])[0]
    sensor = drawing.at(station.position_m[None])[0]
    east, north, height = drawing.plan.frame.in_unit(station.site_m).tolist()
    mark = drawing.space.add_blockref(BLOCK, ground.tolist(), dxfattribs={"layer": layer})
    mark.add_auto_attribs(
        {
            "NUMBER": str(station.number),
            "ID": station.id,
            "FLOOR": station.floor_name,
            "E": f"{east:.4f}",
            "N": f"{north:.4f}",
            "H_GROUND": f"{drawing.unit.of(station.site_ground_m[2]):.4f}" if known else "not known",
            "H_INSTR": f"{drawing.unit.of(station.instrument_height_m):.4f}" if known else "not known",
            "H_SENSOR": f"{height:.4f}",
            "STATE": "scanned before" if station.id in drawing.plan.scanned_before else "planned",
        }
    )
    for attrib in mark.attribs:
        attrib.dxf.layer = layer
    if known:
        drawing.space.add_line(ground.tolist(), sensor.tolist(), dxfattribs={"layer": layer})


def _draw_links(drawing: _Drawing, stations: tuple[FieldStation, ...]) -> None:
    """Draw links from sensor to sensor: the stronger, the wider; those that do not count on layers of their own."""
    at = {station.id: station for station in stations}
    least = drawing.plan.limits.strength
    for link in drawing.plan.links:
        if link.a not in at or link.b not in at:
            continue
        a, b = at[link.a], at[link.b]
        floor_id = a.floor_id if a.floor_id == b.floor_id else ""
        ends = drawing.at(np.stack([a.position_m, b.position_m]))
        counts = drawing.plan.counts(link)
        drawn = drawing.space.add_line(
            *ends.tolist(),
            dxfattribs={"layer": drawing.layer(floor_id, "LINK" if counts else "LINK-WEAK")},
        )
        if counts and link.strength >= STRONG_TIMES * least:
            drawn.dxf.lineweight = 60
        strength = f"{link.strength:.4f}" if math.isfinite(link.strength) else ""
        overlap = reached_share(link.overlap, drawing.plan.min_overlap, 4)
        known = math.isfinite(link.probability)
        registers = str(reached_share(link.probability, drawing.plan.limits.probability, 4)) if known else ""
        say(drawn, a=link.a, b=link.b, overlap=str(overlap), strength=strength, probability=registers)


def _draw_route(drawing: _Drawing, floors: tuple[FloorSection, ...]) -> None:
    """Draw the legs of the walk in space; those over several floors on the shared layer."""
    wanted = {floor.id for floor in floors}
    for way in ways_of(drawing.plan):
        if not way.walkable or not wanted & set(way.floors):
            continue
        layer = drawing.layer(way.floors[0] if len(set(way.floors)) == 1 else "", "ROUTE")
        drawn = drawing.space.add_polyline3d(drawing.at(way.points_m).tolist(), dxfattribs={"layer": layer})
        say(drawn, **{"from": way.from_id, "to": way.to_id, "length_m": f"{way.length_m:.2f}"})
