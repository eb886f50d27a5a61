"""Pictures of the plan: a map a floor, an overview of all floors. Plan, ScanEngine -> PNG.

Drawn over `section_view` with the marks of sheets; nothing here depends on a screen or a graphics driver.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from planner_core.coverage.percent import link_limits_words
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BoolArray, Float32Array, FloatArray, Floor, Plan, Survey
from planner_core.plan_folder import palette
from planner_core.plan_folder.drawing.canvas import Box, Pen
from planner_core.plan_folder.drawing.marks import (
    LINKS,
    MARK_WORDS,
    ROUTE,
    STRONG_TIMES,
    Labels,
    draw_links,
    draw_route,
)
from planner_core.plan_folder.drawing.png_canvas import PngCanvas, pixels, whole_pixels_mm
from planner_core.plan_folder.floor_marks import (
    Ground,
    OnPaper,
    breaks_on,
    draw_floor_stations,
    draw_floor_words,
    draw_ways,
    draw_zone_borders,
    ends_on,
    floor_links,
    rooms_on,
    stairs_on,
    targets_on,
    unreachable_hatch_m,
    unreachable_on,
    ways_on,
    zones_on,
)
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_words import (
    coverage_words,
    floor_words,
    length_words,
    not_walked_words,
    scanner_words,
    stations_words,
)
from planner_core.plan_folder.section_view import (
    SectionView,
    camera_at,
    camera_from_above,
    cut_above_m,
    cut_height_m,
    inside_solid,
    joined_views,
    marked,
    view_lines_m,
    view_section,
)
from planner_core.plan_folder.sheet import (
    FOOTER_MM,
    MARGIN_MM,
    WIDTH_MM,
    LegendLine,
    coverage_legend,
    draw_footer,
    draw_header,
    drawn_floors,
    floor_figures,
    floor_subtitle,
    new_sheet,
    picture_box,
)
from planner_core.scene.floors import ground_levels, ground_span_m, levels_of

CAPTION_MM = 8.0
PALE = (0.93, 0.93, 0.92)
"""Of floors and furniture under lines that matter more."""
OVERVIEW_CAMERA = camera_at(azimuth_rad=np.deg2rad(62.0), elevation_rad=np.deg2rad(48.0))
_HATCH = Pen(0.2, palette.INK)
_HATCH_MM = 1.3
_SECTION = Pen(0.24, palette.WALL)
_OVERHEAD = Pen(0.3, palette.WALL, dash_mm=(1.8, 1.0))


@dataclass(frozen=True, eq=False)
class ShadedView:
    """A view of a cut floor, with what of its colours does not depend on stations.

    shade : (H, W) float32, brightness. ground : (H, W) bool, pixels of the floor's ground. solid : (H, W) bool, of cut
    walls.
    """

    view: SectionView
    shade: Float32Array
    ground: BoolArray
    solid: BoolArray


@dataclass(frozen=True, eq=False)
class PlacedView:
    """A view on the sheet."""

    shaded: ShadedView
    box: Box

    @property
    def view(self) -> SectionView:
        """What its pixels show."""
        return self.shaded.view

    @property
    def mm_per_m(self) -> float:
        """How long a metre of the view's plane is."""
        return self.box.width / float(self.view.window_m[1, 0] - self.view.window_m[0, 0])

    def on_paper(self, plane_m: FloatArray) -> FloatArray:
        """(..., 2) millimetres of points (..., 2) of the view's plane, which is the plan where it looks down."""
        return np.asarray((plane_m - self.view.window_m[0]) * self.mm_per_m + (self.box.left, self.box.bottom))


def view_floor(plan: Plan, floor_index: int, *, engine: ScanEngine) -> ShadedView:
    """Look at a floor from above, cut open: what its maps are drawn on."""
    floor = plan.survey.floors[floor_index]
    margin_m = 0.01 * float(np.ptp(floor.bounds_m, axis=0).max()) + 0.5
    window_m = floor.bounds_m + np.array([[-margin_m], [margin_m]])
    levels = ground_levels(plan.survey.scene, floor)
    views = [
        view_section(
            plan.survey,
            engine,
            camera_from_above(),
            ground_m=ground_m,
            cut_m=cut_above_m(plan, ground_m),
            window_m=window_m,
            width=pixels(picture_box(*(window_m[1] - window_m[0]).tolist()).width),
        )
        for ground_m, _ in levels
    ]
    return shaded(plan.survey, floor, joined_views(views, [corners_m for _, corners_m in levels]))


def write_floor_map(plan: Plan, floor_index: int, path: Path, *, view: ShadedView, source: PlanSource) -> None:
    """Write the map of one floor: cut open, surfaces in the colours of coverage, route from station to station.

    view : of the floor, by `view_floor`.
    """
    floor, of = plan.survey.floors[floor_index], source.floors[floor_index]
    canvas, at = _map_sheet(view)
    on_paper = _on_paper(plan, at)
    ways = ways_on(source, of, _ground_of(plan))
    with canvas.clip(at.box):
        _draw_view(canvas, plan, at)
        canvas.lines([at.on_paper(border) for border in _overhead_m(plan, floor)], _OVERHEAD)
        canvas.lines([on_paper(line) for line in unreachable_hatch_m(source, of, _HATCH_MM / at.mm_per_m)], _HATCH)
        draw_ways(canvas, ways, on_paper, cut_height_m(plan, floor) + float(plan.survey.scene.offset_m[2]))
        zones = draw_zone_borders(canvas, zones_on(source, of), on_paper)
    labels = _labels(canvas, at)
    _draw_stations(labels, plan, source, floor_index, at, joined=plan.route is None)
    draw_floor_words(
        labels,
        on_paper,
        stairs=stairs_on(ways),
        ends=ends_on(source, of),
        breaks=breaks_on(source, of),
        targets=targets_on(source, of),
        unreachable=unreachable_on(source, of),
        zones=zones,
        rooms=rooms_on(source, of),
    )
    walked = () if plan.route is None else ((f"{sum(way.length_m for way in ways):.0f} m", "route"),)
    figures = (*walked, *floor_figures(source, floor.id))
    draw_header(canvas, floor.name, floor_subtitle(plan, source, floor), figures)
    draw_footer(canvas, mm_per_m=at.mm_per_m, legend=coverage_legend(plan), lines=_route_legend(plan))
    canvas.save(path)


def _on_paper(plan: Plan, at: PlacedView) -> OnPaper:
    """Lead from the scene frame to a map."""
    offset_m = plan.survey.scene.offset_m[:2]
    return lambda points_m: at.on_paper(points_m - offset_m)


def _ground_of(plan: Plan) -> Ground:
    scene = plan.survey.scene

    def ground_m(number: int) -> FloatArray:
        triangles = scene.triangles[plan.survey.floors[number].ground_triangles]
        return np.asarray(scene.vertices_m[triangles, :2] + scene.offset_m[:2])

    return ground_m


def _overhead_m(plan: Plan, floor: Floor) -> list[FloatArray]:
    """(2, 2) borders in plan of levels that lie above the cut, such as mezzanines: drawn as what is overhead is."""
    own_m = floor.elevation_m
    cut_m = cut_above_m(plan, own_m)
    borders = []
    for height_m, corners_m in levels_of(plan.survey.scene, floor)[1:]:
        if height_m <= own_m + cut_m:
            continue
        edge_mm = np.rint(1000.0 * corners_m[:, [[0, 1], [1, 2], [2, 0]], :2]).astype(np.int64).reshape(-1, 2, 2)
        turned = (edge_mm[:, 0, 0] > edge_mm[:, 1, 0]) | (
            (edge_mm[:, 0, 0] == edge_mm[:, 1, 0]) & (edge_mm[:, 0, 1] > edge_mm[:, 1, 1])
        )
        edge_mm[turned] = edge_mm[turned][:, ::-1]
        edge_mm, count = np.unique(edge_mm, axis=0, return_counts=True)
        borders += list(edge_mm[count == 1] / 1000.0)
    return borders


def write_link_map(plan: Plan, floor_index: int, path: Path, *, view: ShadedView, source: PlanSource) -> None:
    """Write the map of one floor's registration network: what scans hold together by, and how well."""
    floor = plan.survey.floors[floor_index]
    canvas, at = _map_sheet(view)
    ends, elsewhere = floor_links(source, source.floors[floor_index])
    on_paper = _on_paper(plan, at)
    with canvas.clip(at.box):
        _draw_view(canvas, plan, at, coloured=False)
        draw_links(canvas, [on_paper(of_class) for of_class in ends])
    _draw_stations(_labels(canvas, at), plan, source, floor_index, at, elsewhere=elsewhere)
    title = f"{floor.name}: registration of scans"
    draw_header(canvas, title, floor_subtitle(plan, source, floor), _link_figures(source, floor.id))
    draw_footer(canvas, mm_per_m=at.mm_per_m, legend=(), lines=_link_legend(plan))
    canvas.save(path)


def _link_legend(plan: Plan) -> tuple[LegendLine, ...]:
    figures = {"link": link_limits_words(plan.settings.requirements.link_limits), "times": STRONG_TIMES}
    pens = zip(("weak", "counts", "strong", "by targets"), LINKS, strict=True)
    if not any(link.targets_m for link in plan.links):
        pens = zip(("weak", "counts", "strong"), LINKS, strict=False)
    return tuple((MARK_WORDS[kind][0].format(**figures), pen) for kind, pen in pens)[::-1]


def _labels(canvas: PngCanvas, at: PlacedView) -> Labels:
    """Labels of a map: beside a narrow one the sheet has room for words."""
    return Labels(canvas, Box(MARGIN_MM, at.box.bottom, WIDTH_MM - 2 * MARGIN_MM, at.box.height), [])


def _map_sheet(shown: ShadedView) -> tuple[PngCanvas, PlacedView]:
    """Sheet with title and legend strips, and where on it a floor seen from above is."""
    box = picture_box(*(shown.view.window_m[1] - shown.view.window_m[0]).tolist())
    return new_sheet(box.height), PlacedView(shown, box)


def write_overview(plan: Plan, path: Path, *, engine: ScanEngine, source: PlanSource) -> None:
    """Write the picture of the floors that are drawn, cut open and seen from a corner, the lowest first."""
    floors = drawn_floors(plan)
    windows = [_overview_window_m(plan, plan.survey.floors[index]) for index in floors]
    n_columns = min(2, len(floors))
    cell_mm = (WIDTH_MM - MARGIN_MM * (n_columns + 1)) / n_columns
    mm_per_m = cell_mm / max(float(window[1, 0] - window[0, 0]) for window in windows)
    heights_mm = [float(window[1, 1] - window[0, 1]) * mm_per_m + CAPTION_MM for window in windows]
    rows_mm = [max(heights_mm[start : start + n_columns]) for start in range(0, len(floors), n_columns)]
    canvas = new_sheet(sum(rows_mm))
    for number, (index, window) in enumerate(zip(floors, windows, strict=True)):
        row, column = divmod(number, n_columns)
        width_mm, height_mm = ((window[1] - window[0]) * mm_per_m).tolist()
        top_mm = sum(rows_mm[row:]) + FOOTER_MM
        left_mm = MARGIN_MM + column * (cell_mm + MARGIN_MM)
        at_mm = (whole_pixels_mm(left_mm), whole_pixels_mm(top_mm - CAPTION_MM - height_mm))
        box = Box(*at_mm, whole_pixels_mm(width_mm), height_mm)
        _draw_overview_cell(canvas, plan, source, index, engine, window, box)
    draw_header(canvas, source.title, _plan_subtitle(source), _plan_figures(source))
    draw_footer(canvas, legend=coverage_legend(plan), lines=_route_legend(plan))
    canvas.save(path)


def _draw_overview_cell(
    canvas: PngCanvas, plan: Plan, source: PlanSource, index: int, engine: ScanEngine, window_m: FloatArray, box: Box
) -> None:
    floor = plan.survey.floors[index]
    view = view_section(
        plan.survey,
        engine,
        OVERVIEW_CAMERA,
        ground_m=ground_span_m(plan.survey.scene, floor)[0],
        cut_m=cut_height_m(plan, floor),
        window_m=window_m,
        width=max(1, pixels(box.width)),
    )
    at = PlacedView(shaded(plan.survey, floor, view), box)
    with canvas.clip(box):
        _draw_view(canvas, plan, at)
        offset_m = plan.survey.scene.offset_m
        ways = [
            at.on_paper(view.camera.project(np.column_stack([way.points_m, way.heights_m]) - offset_m))
            for way in ways_on(source, source.floors[index], _ground_of(plan))
        ]
        draw_route(canvas, ways, ways, [])
        _draw_stations(Labels(canvas, box, []), plan, source, index, at, joined=plan.route is None)
    words = floor_words(source.document, floor.id)
    canvas.text((box.left, box.top + 2.5), f"{floor.name}   {words}", 10.4, bold=True)


def _overview_window_m(plan: Plan, floor: Floor) -> FloatArray:
    (x0, y0), (x1, y1) = floor.bounds_m + np.array([[-0.6], [0.6]])
    heights = (ground_span_m(plan.survey.scene, floor)[0] - 0.3, cut_height_m(plan, floor))
    corners = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in heights])
    seen = OVERVIEW_CAMERA.project(corners)
    return np.stack([seen.min(axis=0), seen.max(axis=0)])


def _draw_view(canvas: PngCanvas, plan: Plan, at: PlacedView, *, coloured: bool = True) -> None:
    """Draw a cut floor. coloured : patches in the colours of coverage, else all pale, so that lines stand out."""
    # Bytes, as matplotlib would make them itself after half a dozen copies of the floats.
    rgb = (255 * view_rgb(plan, at.shaded, coloured=coloured)).astype(np.uint8)
    canvas.raster(rgb, at.box.left, at.box.bottom)
    canvas.lines(list(at.on_paper(view_lines_m(plan.survey, at.view))), _SECTION)


def shaded(survey: Survey, floor: Floor, view: SectionView) -> ShadedView:
    """Work out what views of `floor` have in common, whatever stations see."""
    facing = np.where(view.triangle >= 0, view.facing, np.float32(1.0))
    shade = np.asarray(0.62 + 0.38 * np.abs(facing), dtype=np.float32)
    shade[_depth_edges(view)] *= 0.72
    ground = marked(floor.ground_triangles, survey.scene.n_triangles)[view.triangle]
    return ShadedView(view, shade, ground, inside_solid(survey, view, floor))


def view_rgb(plan: Plan, shown: ShadedView, *, coloured: bool = True) -> Float32Array:
    """(H, W, 3) sRGB: patches in the colours of coverage, or all pale; cut walls dark, edges drawn, nothing white."""
    colours = palette.PATCH_COLOURS_SRGB if coloured else np.full_like(palette.PATCH_COLOURS_SRGB, PALE)
    colours = np.append(colours, [[1.0, 1.0, 1.0]], axis=0).astype(np.float32)  # the last of no patch
    index = palette.patch_colour_index(plan.times_seen, plan.achievable, plan.required)
    row = np.append(index, len(colours) - 1).astype(np.intp)[shown.view.patch]
    row[shown.ground] += len(colours)
    table = np.concatenate([1 + np.float32(0.75) * (colours - 1), colours])  # first of what is no ground
    rgb: Float32Array = table[row]
    rgb *= shown.shade[..., None]
    rgb[shown.solid] = palette.WALL
    return rgb


def _depth_edges(view: SectionView) -> np.ndarray:
    """Pixels where the depth jumps: edges of furniture and steps."""
    depth = np.where(np.isfinite(view.depth_m), view.depth_m, 0.0)
    limit_m = 0.06 + 3.0 * view.pixel_m
    edges = np.zeros(depth.shape, dtype=np.bool_)
    edges[:, 1:] |= np.abs(np.diff(depth, axis=1)) > limit_m
    edges[1:, :] |= np.abs(np.diff(depth, axis=0)) > limit_m
    return edges


def _route_legend(plan: Plan) -> tuple[LegendLine, ...]:
    return (("visiting order" if plan.route is None else MARK_WORDS["route"][1], ROUTE),)


def _link_figures(source: PlanSource, floor_id: str) -> tuple[tuple[str, str], ...]:
    """Figures of one floor's stations and the links among them that count."""
    here = {station.id for station in source.stations_of(floor_id)}
    n_links = sum(source.counts(link) and {link.a, link.b} <= here for link in source.links)
    return ((str(len(here)), "stations"), (str(n_links), "links that count"))


def _draw_stations(
    labels: Labels,
    plan: Plan,
    source: PlanSource,
    floor_index: int,
    at: PlacedView,
    *,
    joined: bool = False,
    elsewhere: Mapping[str, tuple[int, ...]] = MappingProxyType({}),
) -> None:
    """Draw the stations of a floor. joined : straight lines join them in visiting order."""
    floor = source.floors[floor_index]
    stations = source.stations_of(floor.id)
    if not stations:
        return
    # Where the height of the instrument is not known, the sensor stands for the ground below it.
    feet_m = [np.where(np.isnan(station.ground_m), station.position_m, station.ground_m) for station in stations]
    spots = at.on_paper(at.view.camera.project(np.array(feet_m) - plan.survey.scene.offset_m))
    if joined:
        labels.canvas.lines([spots], ROUTE)
    low_m, high_m = ground_span_m(plan.survey.scene, plan.survey.floors[floor_index])
    draw_floor_stations(
        labels,
        floor,
        stations,
        spots,
        scanned=source.scanned_before,
        elsewhere=elsewhere,
        unit=source.frame.unit,
        mm_per_m=at.mm_per_m,
        slopes=low_m < high_m,
    )


def _plan_subtitle(source: PlanSource) -> str:
    return f"{scanner_words(source.document)}   ·   coverage of the scannable area by floor"


def _route_figures(source: PlanSource) -> tuple[tuple[str, str], ...]:
    route = source.document["route"]
    if route is None:
        return ()
    return ((length_words(source.frame.unit, route["length_m"], 0), f"route{not_walked_words(route)}"),)


def _plan_figures(source: PlanSource) -> tuple[tuple[str, str], ...]:
    document = source.document
    number, _, stations = stations_words(len(source.stations)).partition(" ")
    percent, _, of_what = coverage_words(document).partition(" % ")
    return (*_route_figures(source), (number, stations), (f"{percent} %", of_what.partition(" from ")[0]))
