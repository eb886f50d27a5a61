"""Pictures of the plan: a map a floor, an overview of all floors, the coverage curve. Plan, ScanEngine -> PNG.

Drawn by matplotlib's software renderer over `section_view`; nothing here depends on a screen, a graphics driver, the
user's matplotlib settings or the time of day.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.export import palette
from planner_core.export.section_view import (
    SectionView,
    camera_at,
    camera_from_above,
    cut_height_m,
    inside_solid,
    section_lines,
    view_section,
)
from planner_core.export.station_marks import foot_m
from planner_core.model import FloatArray, Floor, Plan
from planner_core.scan.engine import ScanEngine

DPI = 100
WIDTH_IN = 16.0
MARGIN_IN = 0.45
HEADER_IN = 1.15
FOOTER_IN = 0.95
MAX_MAP_HEIGHT_IN = 14.0
MARKER_RADIUS_PX = 15.0
CAPTION_IN = 0.45
PAPER = "white"
OVERVIEW_CAMERA = camera_at(azimuth_rad=np.deg2rad(62.0), elevation_rad=np.deg2rad(48.0))

LEGEND = (
    ("seen by 3 or more stations", palette.SEEN_OFTEN),
    ("by 2", palette.SEEN_TWICE),
    ("by 1", palette.SEEN_ONCE),
    ("not seen by this plan", palette.UNSEEN),
    ("out of reach of any candidate", palette.NOT_ACHIEVABLE),
)


def write_floor_map(plan: Plan, floor_index: int, path: Path, *, engine: ScanEngine) -> None:
    """Write the map of one floor: cut open, surfaces in the colours of coverage, stations in visiting order."""
    floor = plan.survey.floors[floor_index]
    margin_m = 0.01 * float(np.ptp(floor.bounds_m, axis=0).max()) + 0.5
    window_m = floor.bounds_m + np.array([[-margin_m], [margin_m]])
    size_m = window_m[1] - window_m[0]
    width_in, height_in = _map_size_in(float(size_m[0]), float(size_m[1]))
    view = view_section(
        plan.survey,
        engine,
        camera_from_above(),
        ground_m=floor.elevation_m,
        cut_m=cut_height_m(plan, floor),
        window_m=window_m,
        width=round(width_in * DPI),
    )
    figure = _figure(height_in + HEADER_IN + FOOTER_IN)
    left_in = (WIDTH_IN - width_in) / 2
    axes = _axes(figure, left_in, FOOTER_IN, width_in, height_in)
    _draw_view(axes, plan, floor, view)
    _draw_stations(axes, plan, floor, view)
    _draw_header(figure, floor.name, _floor_subtitle(plan, floor), _floor_figures(plan, floor_index))
    _draw_footer(figure, view.pixel_m)
    _save(figure, path)


def write_overview(plan: Plan, path: Path, *, engine: ScanEngine) -> None:
    """Write the picture of all floors, cut open and looked at from a corner, the lowest first."""
    floors = plan.survey.floors
    windows = [_overview_window_m(plan, floor) for floor in floors]
    n_columns = min(2, len(floors))
    cell_in = (WIDTH_IN - MARGIN_IN * (n_columns + 1)) / n_columns
    in_per_m = cell_in / max(float(window[1, 0] - window[0, 0]) for window in windows)
    heights_in = [float(window[1, 1] - window[0, 1]) * in_per_m + CAPTION_IN for window in windows]
    rows_in = [max(heights_in[start : start + n_columns]) for start in range(0, len(floors), n_columns)]
    figure = _figure(sum(rows_in) + HEADER_IN + FOOTER_IN)
    for index, window in enumerate(windows):
        row, column = divmod(index, n_columns)
        top_in = sum(rows_in[row:]) + FOOTER_IN
        left_in = MARGIN_IN + column * (cell_in + MARGIN_IN)
        _draw_overview_cell(figure, plan, index, engine, window, in_per_m, (left_in, top_in))
    _draw_header(figure, plan.survey.scene.source.path.name, _plan_subtitle(plan), _plan_figures(plan))
    _draw_footer(figure, None)
    _save(figure, path)


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
    axes = _axes(figure, left_in, top_in - CAPTION_IN - height_in, width_in, height_in)
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
    _draw_stations(axes, plan, floor, view)
    share = 100 * plan.coverage_by_floor[index].fraction_of_achievable
    at = (left_in / WIDTH_IN, (top_in - 0.25) / float(figure.get_size_inches()[1]))
    figure.text(*at, f"{floor.name}   {share:.1f} %", fontsize=15, color=palette.INK, weight="bold")


def write_coverage_curve(plan: Plan, path: Path) -> None:
    """Write the covered share of the achievable area against the number of stations, in the order of choice."""
    figure = _figure(7.0)
    axes = figure.add_axes((0.07, 0.12, 0.89, 0.72))
    curve = np.concatenate([[0.0], 100 * np.asarray(plan.coverage_curve, dtype=np.float64)])
    asked = 100 * plan.settings.requirements.coverage
    axes.axhline(asked, color=palette.UNSEEN, linewidth=1.5, linestyle=(0, (6, 4)))
    axes.text(0.0, asked + 1.2, f" asked for: {asked:g} %", color=palette.UNSEEN, fontsize=13, va="bottom")
    marker = "o" if len(curve) <= 60 else ""
    axes.plot(np.arange(len(curve)), curve, color=palette.SEEN_OFTEN, linewidth=2.5, marker=marker, markersize=6)
    axes.set_xlim(0, max(1, len(curve) - 1) * 1.02)
    axes.set_ylim(0, 105)
    axes.set_xlabel("stations", fontsize=13, color=palette.INK)
    axes.set_ylabel("covered share of the achievable area, %", fontsize=13, color=palette.INK)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.tick_params(labelsize=12, colors=palette.INK)
    axes.grid(color=(0.9, 0.9, 0.9))
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.text(0.028, 0.91, "What each further station adds", fontsize=20, weight="bold", color=palette.INK)
    _save(figure, path)


def _matplotlib() -> Any:
    try:
        import matplotlib
    except ImportError as error:
        raise MissingPackageError(
            f"maps need the package matplotlib, which can't be imported ({error}): pip install matplotlib"
        ) from error
    return matplotlib


def _figure(height_in: float) -> Any:
    matplotlib = _matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(matplotlib.rcParamsDefault):  # not what a user's matplotlibrc says
        figure = Figure(figsize=(WIDTH_IN, height_in), dpi=DPI, facecolor=PAPER)
        FigureCanvasAgg(figure)
    return figure


def _axes(figure: Any, left_in: float, bottom_in: float, width_in: float, height_in: float) -> Any:
    total_in = float(figure.get_size_inches()[1])
    axes = figure.add_axes((left_in / WIDTH_IN, bottom_in / total_in, width_in / WIDTH_IN, height_in / total_in))
    axes.set_axis_off()
    return axes


def _save(figure: Any, path: Path) -> None:
    matplotlib = _matplotlib()
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(matplotlib.rcParamsDefault):
        figure.savefig(path, format="png", dpi=DPI, facecolor=PAPER, metadata={"Software": None})


def _map_size_in(width_m: float, height_m: float) -> tuple[float, float]:
    """Width and height of the map on the sheet: as wide as the sheet unless that makes it too tall."""
    width_in = WIDTH_IN - 2 * MARGIN_IN
    height_in = min(max(width_in * height_m / width_m, 0.5), MAX_MAP_HEIGHT_IN)
    return min(width_in, height_in * width_m / height_m), height_in


def _overview_window_m(plan: Plan, floor: Floor) -> FloatArray:
    (x0, y0), (x1, y1) = floor.bounds_m + np.array([[-0.6], [0.6]])
    heights = (floor.elevation_m - 0.3, cut_height_m(plan, floor))
    corners = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in heights])
    seen = OVERVIEW_CAMERA.project(corners)
    return np.stack([seen.min(axis=0), seen.max(axis=0)])


def _draw_view(axes: Any, plan: Plan, floor: Floor, view: SectionView) -> None:
    from matplotlib.collections import LineCollection

    axes.imshow(view_rgb(plan, floor, view), extent=view.extent, interpolation="antialiased", zorder=1)
    lines = section_lines(plan.survey, view.cut_m)
    flat = view.camera.project(lines.reshape(-1, 3)).reshape(-1, 2, 2)
    axes.add_collection(LineCollection(list(flat), colors=[palette.WALL], linewidths=1.0, zorder=2))
    axes.set_xlim(view.extent[0], view.extent[1])
    axes.set_ylim(view.extent[2], view.extent[3])


def view_rgb(plan: Plan, floor: Floor, view: SectionView) -> FloatArray:
    """(H, W, 3) sRGB: patches in the colours of coverage, cut walls dark, edges of furniture drawn, nothing white."""
    seen = palette.patch_colour_index(plan.times_seen, plan.achievable)
    there = view.triangle >= 0
    rgb = np.ones((*view.triangle.shape, 3))
    rgb[there] = palette.PATCH_COLOURS_SRGB[seen[view.patch[there]]]
    ground = np.isin(view.triangle, floor.ground_triangles)
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


def _draw_stations(axes: Any, plan: Plan, floor: Floor, view: SectionView) -> None:
    """Numbered discs; where they would overlap they move apart, and a line leads to the spot."""
    stations = sorted((s for s in plan.stations if s.floor == floor.id), key=lambda station: station.order)
    if not stations:
        return
    spots = view.camera.project(np.array([foot_m(station) for station in stations]))
    radius = MARKER_RADIUS_PX * view.pixel_m
    discs = spread_apart(spots, 2.15 * radius)
    axes.plot(
        spots[:, 0], spots[:, 1], color=palette.ROUTE, linewidth=1.6, alpha=0.75, zorder=3, solid_joinstyle="round"
    )
    for station, spot, disc in zip(stations, spots, discs, strict=True):
        if np.hypot(*(disc - spot)) > 0.5 * radius:
            axes.plot(*np.stack([spot, disc]).T, color=palette.STATION, linewidth=1.2, zorder=4)
            axes.plot(*spot, marker="o", markersize=4, color=palette.STATION, zorder=4)
        axes.plot(*disc, marker="o", markersize=2 * MARKER_RADIUS_PX * 72 / DPI, markerfacecolor=palette.STATION,
                  markeredgecolor="white", markeredgewidth=1.8, zorder=5)  # fmt: skip
        axes.text(*disc, str(station.order), color="white", fontsize=12 if station.order < 100 else 9, weight="bold",
                  ha="center", va="center_baseline", zorder=6)  # fmt: skip


def spread_apart(spots: FloatArray, distance: float) -> FloatArray:
    """Move points (N, 2) as little as a few rounds of pushing need until no two are nearer than `distance`.

    Two points at one spot are pushed apart along x, the first of them to the left.
    """
    placed = spots.astype(np.float64).copy()
    for _ in range(200):
        gaps = np.linalg.norm(placed[:, None] - placed[None], axis=2)
        close = np.argwhere(np.triu(gaps < distance * 0.999, k=1))
        if not close.size:
            break
        for i, j in close:
            gap = placed[j] - placed[i]  # as it is by now: an earlier pair may have moved one of the two
            length = float(np.hypot(*gap))
            way = gap / length if length > 1e-9 * distance else np.array([1.0, 0.0])
            push = 0.5 * max(distance - length, 0.0) * way
            placed[i] -= push
            placed[j] += push
    return placed


def _draw_header(figure: Any, title: str, subtitle: str, figures: tuple[tuple[str, str], ...]) -> None:
    total_in = float(figure.get_size_inches()[1])
    left = MARGIN_IN / WIDTH_IN
    figure.text(left, 1 - 0.55 / total_in, title, fontsize=24, weight="bold", color=palette.INK)
    figure.text(left, 1 - 0.88 / total_in, subtitle, fontsize=12.5, color=(0.35, 0.4, 0.44))
    right = 1 - MARGIN_IN / WIDTH_IN
    for value, label in reversed(figures):
        figure.text(right, 1 - 0.55 / total_in, value, fontsize=22, weight="bold", ha="right", color=palette.SEEN_OFTEN)
        figure.text(right, 1 - 0.88 / total_in, label, fontsize=12, ha="right", color=(0.35, 0.4, 0.44))
        right -= (0.35 + 0.092 * max(len(label), 1.9 * len(value))) / WIDTH_IN


def _floor_subtitle(plan: Plan, floor: Floor) -> str:
    elevation_m = floor.elevation_m + float(plan.survey.scene.offset_m[2])
    scanner = plan.settings.scanner
    return (
        f"{plan.survey.scene.source.path.name}   ·   {floor.id}   ·   ground at {elevation_m:.2f} m, "
        f"{floor.ground_area_m2:.0f} m²   ·   {scanner.title}, range {scanner.range_max_m:g} m"
    )


def _plan_subtitle(plan: Plan) -> str:
    scanner = plan.settings.scanner
    return f"{scanner.title}, range {scanner.range_max_m:g} m   ·   share of the achievable area seen, by floor"


def _floor_figures(plan: Plan, floor_index: int) -> tuple[tuple[str, str], ...]:
    coverage = plan.coverage_by_floor[floor_index]
    n_stations = sum(station.floor == plan.survey.floors[floor_index].id for station in plan.stations)
    return (
        (str(n_stations), "stations" if n_stations != 1 else "station"),
        (f"{100 * coverage.fraction_of_achievable:.1f} %", f"of {coverage.achievable_area_m2:.0f} m² achievable"),
    )


def _plan_figures(plan: Plan) -> tuple[tuple[str, str], ...]:
    coverage = plan.coverage
    return (
        (str(len(plan.stations)), "stations"),
        (f"{100 * coverage.fraction_of_achievable:.1f} %", f"of {coverage.achievable_area_m2:.0f} m² achievable"),
    )


def _draw_footer(figure: Any, pixel_m: float | None) -> None:
    """Legend, scale bar and axes, in inches of the sheet."""
    from matplotlib.patches import Rectangle

    axes = _axes(figure, 0.0, 0.0, WIDTH_IN, FOOTER_IN)
    axes.set_xlim(0, WIDTH_IN)
    axes.set_ylim(0, FOOTER_IN)
    x_in = MARGIN_IN
    for label, colour in LEGEND:
        axes.add_patch(Rectangle((x_in, 0.36), 0.24, 0.24, facecolor=colour, edgecolor="none"))
        axes.text(x_in + 0.32, 0.48, label, fontsize=11.5, va="center", color=palette.INK)
        x_in += 0.62 + 0.083 * len(label)
    axes.plot([x_in, x_in + 0.35], [0.48, 0.48], color=palette.ROUTE, linewidth=1.8)
    axes.text(x_in + 0.43, 0.48, "visiting order", fontsize=11.5, va="center", color=palette.INK)
    if pixel_m is None:
        return
    length_m = nice_length_m(2.2 * DPI * pixel_m)
    length_in = length_m / pixel_m / DPI
    right_in = WIDTH_IN - MARGIN_IN - 0.85
    axes.plot([right_in - length_in, right_in], [0.36, 0.36], color=palette.INK, linewidth=3, solid_capstyle="butt")
    axes.text(right_in - length_in / 2, 0.46, f"{length_m:g} m", fontsize=11.5, ha="center", color=palette.INK)
    _draw_axes_hint(axes, WIDTH_IN - MARGIN_IN - 0.5)


def _draw_axes_hint(axes: Any, x_in: float) -> None:
    """Arrows of the scene's x and y: models seldom say where north is, so none is claimed."""
    for dx, dy, label in ((0.38, 0.0, "x"), (0.0, 0.38, "y")):
        axes.annotate(
            "", (x_in + dx, 0.3 + dy), (x_in, 0.3), arrowprops={"arrowstyle": "-|>", "color": palette.INK, "lw": 1.4}
        )
        axes.text(x_in + dx * 1.3, 0.3 + dy * 1.3, label, fontsize=11.5, ha="center", va="center", color=palette.INK)


def nice_length_m(longest_m: float) -> float:
    """Longest of 1, 2, 5 times a power of ten that is at most `longest_m`."""
    power = 10.0 ** np.floor(np.log10(longest_m))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= longest_m * (1 + 1e-9)))
