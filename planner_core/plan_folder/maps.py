"""Pictures of the plan: a map a floor, an overview of all floors, the coverage curve. Plan, ScanEngine -> PNG.

Drawn by matplotlib's software renderer over `section_view`; nothing here depends on a screen, a graphics driver, the
user's matplotlib settings or the time of day.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, Floor, Plan
from planner_core.plan_folder import palette
from planner_core.plan_folder.link_drawing import draw_links, link_class, link_legend
from planner_core.plan_folder.section_view import (
    SectionView,
    camera_at,
    camera_from_above,
    cut_height_m,
    inside_solid,
    marked,
    section_lines,
    view_section,
)
from planner_core.plan_folder.sheet import (
    DISC_RADIUS_PX,
    DPI,
    FOOTER_IN,
    HEADER_IN,
    MARGIN_IN,
    WIDTH_IN,
    LegendLine,
    axes_on_sheet,
    draw_discs,
    draw_footer,
    draw_header,
    floor_figures,
    floor_subtitle,
    new_sheet,
    save_sheet,
    size_on_sheet_in,
)
from planner_core.plan_folder.station_marks import foot_m
from planner_core.plan_folder.walk_drawing import draw_ends, draw_sealed, draw_walk, draw_way, runs_on

CAPTION_IN = 0.45
PALE = (0.93, 0.93, 0.92)
"""Of floors and furniture under lines that matter more."""
OVERVIEW_CAMERA = camera_at(azimuth_rad=np.deg2rad(62.0), elevation_rad=np.deg2rad(48.0))


def view_floor(plan: Plan, floor_index: int, *, engine: ScanEngine) -> SectionView:
    """Look at a floor from above, cut open: what its maps are drawn on."""
    floor = plan.survey.floors[floor_index]
    margin_m = 0.01 * float(np.ptp(floor.bounds_m, axis=0).max()) + 0.5
    window_m = floor.bounds_m + np.array([[-margin_m], [margin_m]])
    width_in, _ = size_on_sheet_in(*(window_m[1] - window_m[0]).tolist())
    return view_section(
        plan.survey,
        engine,
        camera_from_above(),
        ground_m=floor.elevation_m,
        cut_m=cut_height_m(plan, floor),
        window_m=window_m,
        width=round(width_in * DPI),
    )


def write_floor_map(plan: Plan, floor_index: int, path: Path, *, view: SectionView) -> None:
    """Write the map of one floor: cut open, surfaces in the colours of coverage, route from station to station.

    view : what `view_floor` says of the floor.
    """
    floor = plan.survey.floors[floor_index]
    figure, axes = _map_sheet(view)
    _draw_view(axes, plan, floor, view)
    draw_sealed(axes, plan, floor_index)
    draw_walk(axes, plan, floor_index, pixel_m=view.pixel_m)
    draw_ends(axes, plan, floor)
    _draw_stations(axes, plan, floor, view, joined=plan.route is None)
    draw_header(figure, floor.name, floor_subtitle(plan, floor), _map_figures(plan, floor_index))
    draw_footer(figure, pixel_m=view.pixel_m, lines=_walk_legend(plan))
    save_sheet(figure, path)


def write_link_map(plan: Plan, floor_index: int, path: Path, *, view: SectionView) -> None:
    """Write the map of one floor's registration network: what scans hold together by, and how well."""
    floor = plan.survey.floors[floor_index]
    figure, axes = _map_sheet(view)
    _draw_view(axes, plan, floor, view, coloured=False)
    draw_links(axes, plan, floor.id)
    _draw_stations(axes, plan, floor, view, joined=False)
    draw_header(figure, f"{floor.name}: how scans register", floor_subtitle(plan, floor), _link_figures(plan, floor))
    draw_footer(figure, pixel_m=view.pixel_m, legend=(), lines=link_legend(plan))
    save_sheet(figure, path)


def _map_sheet(view: SectionView) -> tuple[Any, Any]:
    """Sheet with title and legend strips, and axes for a floor looked at from above."""
    width_in, height_in = size_on_sheet_in(*(view.window_m[1] - view.window_m[0]).tolist())
    figure = new_sheet(height_in + HEADER_IN + FOOTER_IN)
    return figure, axes_on_sheet(figure, (WIDTH_IN - width_in) / 2, FOOTER_IN, width_in, height_in)


def write_overview(plan: Plan, path: Path, *, engine: ScanEngine) -> None:
    """Write the picture of all floors, cut open and looked at from a corner, the lowest first."""
    floors = plan.survey.floors
    windows = [_overview_window_m(plan, floor) for floor in floors]
    n_columns = min(2, len(floors))
    cell_in = (WIDTH_IN - MARGIN_IN * (n_columns + 1)) / n_columns
    in_per_m = cell_in / max(float(window[1, 0] - window[0, 0]) for window in windows)
    heights_in = [float(window[1, 1] - window[0, 1]) * in_per_m + CAPTION_IN for window in windows]
    rows_in = [max(heights_in[start : start + n_columns]) for start in range(0, len(floors), n_columns)]
    figure = new_sheet(sum(rows_in) + HEADER_IN + FOOTER_IN)
    for index, window in enumerate(windows):
        row, column = divmod(index, n_columns)
        top_in = sum(rows_in[row:]) + FOOTER_IN
        left_in = MARGIN_IN + column * (cell_in + MARGIN_IN)
        _draw_overview_cell(figure, plan, index, engine, window, in_per_m, (left_in, top_in))
    draw_header(figure, plan.survey.scene.source.path.name, _plan_subtitle(plan), _plan_figures(plan))
    draw_footer(figure, lines=_walk_legend(plan))
    save_sheet(figure, path)


def _draw_overview_cell(
    figure: Any,
    plan: Plan,
    index: int,
    engine: ScanEngine,
    window_m: FloatArray,
    in_per_m: float,
    left_top_in: tuple[float, float],
) -> None:
    floor = plan.survey.floors[index]
    width_in, height_in = (float(value) for value in (window_m[1] - window_m[0]) * in_per_m)
    left_in, top_in = left_top_in
    axes = axes_on_sheet(figure, left_in, top_in - CAPTION_IN - height_in, width_in, height_in)
    view = view_section(
        plan.survey,
        engine,
        OVERVIEW_CAMERA,
        ground_m=floor.elevation_m,
        cut_m=cut_height_m(plan, floor),
        window_m=window_m,
        width=max(1, round(width_in * DPI)),
    )
    _draw_view(axes, plan, floor, view)
    for run in runs_on(plan, index):
        draw_way(axes, view.camera.project(run.points_m))
    _draw_stations(axes, plan, floor, view, joined=plan.route is None)
    share = 100 * plan.coverage_by_floor[index].fraction_of_achievable
    at = (left_in / WIDTH_IN, (top_in - 0.25) / float(figure.get_size_inches()[1]))
    figure.text(*at, f"{floor.name}   {share:.1f} %", fontsize=15, color=palette.INK, weight="bold")


def _overview_window_m(plan: Plan, floor: Floor) -> FloatArray:
    (x0, y0), (x1, y1) = floor.bounds_m + np.array([[-0.6], [0.6]])
    heights = (floor.elevation_m - 0.3, cut_height_m(plan, floor))
    corners = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in heights])
    seen = OVERVIEW_CAMERA.project(corners)
    return np.stack([seen.min(axis=0), seen.max(axis=0)])


def _draw_view(axes: Any, plan: Plan, floor: Floor, view: SectionView, *, coloured: bool = True) -> None:
    """Draw a cut floor. coloured : patches in the colours of coverage, else all pale, so that lines stand out."""
    from matplotlib.collections import LineCollection

    axes.imshow(
        view_rgb(plan, floor, view, coloured=coloured), extent=view.extent, interpolation="antialiased", zorder=1
    )
    lines = section_lines(plan.survey, view.cut_m)
    flat = view.camera.project(lines.reshape(-1, 3)).reshape(-1, 2, 2)
    axes.add_collection(LineCollection(list(flat), colors=[palette.WALL], linewidths=1.0, zorder=2))
    axes.set_xlim(view.extent[0], view.extent[1])
    axes.set_ylim(view.extent[2], view.extent[3])


def view_rgb(plan: Plan, floor: Floor, view: SectionView, *, coloured: bool = True) -> FloatArray:
    """(H, W, 3) sRGB: patches in the colours of coverage, or all pale; cut walls dark, edges drawn, nothing white."""
    seen = palette.patch_colour_index(plan.times_seen, plan.achievable)
    there = view.triangle >= 0
    rgb = np.ones((*view.triangle.shape, 3))
    rgb[there] = palette.PATCH_COLOURS_SRGB[seen[view.patch[there]]] if coloured else PALE
    ground = marked(floor.ground_triangles, plan.survey.scene.n_triangles)[view.triangle]
    rgb[there & ~ground] = 0.25 + 0.75 * rgb[there & ~ground]
    shade = 0.62 + 0.38 * np.abs(np.where(there, view.facing, 1.0))
    rgb *= shade[..., None]
    rgb[_depth_edges(view)] *= 0.72
    rgb[inside_solid(plan.survey, view, floor.ground_triangles)] = palette.WALL
    return np.clip(rgb, 0.0, 1.0)


def _depth_edges(view: SectionView) -> np.ndarray:
    """Pixels where the depth jumps: edges of furniture and steps."""
    depth = np.where(np.isfinite(view.depth_m), view.depth_m, 0.0)
    limit_m = 0.06 + 3.0 * view.pixel_m
    edges = np.zeros(depth.shape, dtype=np.bool_)
    edges[:, 1:] |= np.abs(np.diff(depth, axis=1)) > limit_m
    edges[1:, :] |= np.abs(np.diff(depth, axis=0)) > limit_m
    return edges


def _walk_legend(plan: Plan) -> tuple[LegendLine, ...]:
    return (("visiting order" if plan.route is None else "walk", palette.ROUTE, 1.8, "-"),)


def _map_figures(plan: Plan, floor_index: int) -> tuple[tuple[str, str], ...]:
    """Figures of one floor, and how far one walks on it."""
    figures = floor_figures(plan, floor_index)
    if plan.route is None:
        return figures
    walked_m = sum(run.length_m for run in runs_on(plan, floor_index))
    return ((f"{walked_m:.0f} m", "route"), *figures)


def _link_figures(plan: Plan, floor: Floor) -> tuple[tuple[str, str], ...]:
    """Figures of one floor's stations and the links among them that count."""
    here = {station.id for station in plan.stations if station.floor == floor.id}
    n_links = sum((link_class(link, plan) or 0) > 0 and {link.a, link.b} <= here for link in plan.links)
    return ((str(len(here)), "stations"), (str(n_links), "links that count"))


def _draw_stations(axes: Any, plan: Plan, floor: Floor, view: SectionView, *, joined: bool = True) -> None:
    """Numbered discs; where they would overlap they move apart, and a line leads to the spot.

    joined : straight lines join them in visiting order.
    """
    stations = sorted((s for s in plan.stations if s.floor == floor.id), key=lambda station: station.order)
    if not stations:
        return
    spots = view.camera.project(np.array([foot_m(station) for station in stations]))
    if joined:
        axes.plot(
            spots[:, 0], spots[:, 1], color=palette.ROUTE, linewidth=1.6, alpha=0.75, zorder=3, solid_joinstyle="round"
        )
    draw_discs(axes, stations, spots, radius=DISC_RADIUS_PX * view.pixel_m)


def _plan_subtitle(plan: Plan) -> str:
    scanner = plan.settings.scanner
    return f"{scanner.title}, range {scanner.range_max_m:g} m   ·   share of the achievable area seen, by floor"


def _plan_figures(plan: Plan) -> tuple[tuple[str, str], ...]:
    coverage = plan.coverage
    walk = ((f"{plan.route.length_m:.0f} m", "route"),) if plan.route is not None else ()
    return (
        *walk,
        (str(len(plan.stations)), "stations"),
        (f"{100 * coverage.fraction_of_achievable:.1f} %", f"of {coverage.achievable_area_m2:.0f} m² achievable"),
    )
