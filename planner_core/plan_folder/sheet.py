"""The sheet that pictures of the plan are drawn on: size, title strip, legend, numbered discs, and saving it as PNG.

matplotlib's software renderer draws it; the user's matplotlib settings, the time and the screen have no say.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.model import FloatArray, Floor, Plan, Station
from planner_core.plan_folder import palette

DPI = 100
WIDTH_IN = 16.0
MARGIN_IN = 0.45
HEADER_IN = 1.15
FOOTER_IN = 0.95
MAX_HEIGHT_IN = 14.0
DISC_RADIUS_PX = 15.0
PAPER = "white"

#: What a line is: label, colour, width in points, matplotlib's dashes.
LegendLine = tuple[str, tuple[float, float, float], float, Any]

LEGEND = (
    ("seen by 3 or more stations", palette.SEEN_OFTEN),
    ("by 2", palette.SEEN_TWICE),
    ("by 1", palette.SEEN_ONCE),
    ("not seen by this plan", palette.UNSEEN),
    ("out of reach of any candidate", palette.NOT_ACHIEVABLE),
)


def _matplotlib() -> Any:
    try:
        import matplotlib
    except ImportError as error:
        raise MissingPackageError(
            f"maps need the package matplotlib, which can't be imported ({error}): pip install matplotlib"
        ) from error
    return matplotlib


def new_sheet(height_in: float) -> Any:
    """Return an empty sheet, a matplotlib figure, `WIDTH_IN` wide."""
    matplotlib = _matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(matplotlib.rcParamsDefault):  # not what a user's matplotlibrc says
        figure = Figure(figsize=(WIDTH_IN, height_in), dpi=DPI, facecolor=PAPER)
        FigureCanvasAgg(figure)
    return figure


def axes_on_sheet(figure: Any, left_in: float, bottom_in: float, width_in: float, height_in: float) -> Any:
    """Return axes without frame at a place of the sheet, in inches from its lower left corner."""
    total_in = float(figure.get_size_inches()[1])
    axes = figure.add_axes((left_in / WIDTH_IN, bottom_in / total_in, width_in / WIDTH_IN, height_in / total_in))
    axes.set_axis_off()
    return axes


def save_sheet(figure: Any, path: Path) -> None:
    """Write the sheet as PNG of `DPI` pixels an inch, without date or program name."""
    matplotlib = _matplotlib()
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(matplotlib.rcParamsDefault):
        figure.savefig(path, format="png", dpi=DPI, facecolor=PAPER, metadata={"Software": None})


def size_on_sheet_in(width_m: float, height_m: float) -> tuple[float, float]:
    """Width and height of a picture on the sheet: as wide as the sheet unless that makes it too tall."""
    width_in = WIDTH_IN - 2 * MARGIN_IN
    height_in = min(max(width_in * height_m / width_m, 0.5), MAX_HEIGHT_IN)
    return min(width_in, height_in * width_m / height_m), height_in


def draw_header(figure: Any, title: str, subtitle: str, figures: tuple[tuple[str, str], ...]) -> None:
    """Draw the title strip: title and subtitle at the left, figures (value, label) at the right."""
    total_in = float(figure.get_size_inches()[1])
    left = MARGIN_IN / WIDTH_IN
    figure.text(left, 1 - 0.55 / total_in, title, fontsize=24, weight="bold", color=palette.INK)
    figure.text(left, 1 - 0.88 / total_in, subtitle, fontsize=12.5, color=(0.35, 0.4, 0.44))
    right = 1 - MARGIN_IN / WIDTH_IN
    for value, label in reversed(figures):
        figure.text(right, 1 - 0.55 / total_in, value, fontsize=22, weight="bold", ha="right", color=palette.SEEN_OFTEN)
        figure.text(right, 1 - 0.88 / total_in, label, fontsize=12, ha="right", color=(0.35, 0.4, 0.44))
        right -= (0.35 + 0.092 * max(len(label), 1.9 * len(value))) / WIDTH_IN


def floor_subtitle(plan: Plan, floor: Floor) -> str:
    """Say which floor of which model this is, and for which scanner."""
    elevation_m = floor.elevation_m + float(plan.survey.scene.offset_m[2])
    scanner = plan.settings.scanner
    return (
        f"{plan.survey.scene.source.path.name}   ·   {floor.id}   ·   ground at {elevation_m:.2f} m, "
        f"{floor.ground_area_m2:.0f} m²   ·   {scanner.title}, range {scanner.range_max_m:g} m"
    )


def floor_figures(plan: Plan, floor_index: int) -> tuple[tuple[str, str], ...]:
    """Figures of one floor for `draw_header`: stations and coverage."""
    coverage = plan.coverage_by_floor[floor_index]
    n_stations = sum(station.floor == plan.survey.floors[floor_index].id for station in plan.stations)
    return (
        (str(n_stations), "stations" if n_stations != 1 else "station"),
        (f"{100 * coverage.fraction_of_achievable:.1f} %", f"of {coverage.achievable_area_m2:.0f} m² achievable"),
    )


def draw_footer(
    figure: Any,
    *,
    pixel_m: float | None = None,
    legend: tuple[tuple[str, tuple[float, float, float]], ...] = LEGEND,
    lines: Sequence[LegendLine] = (),
) -> None:
    """Draw the legend and, where `pixel_m` says what a pixel is, scale bar and axes, in inches of the sheet.

    legend : what colours are. lines : what the lines between stations are.
    """
    from matplotlib.patches import Rectangle

    axes = axes_on_sheet(figure, 0.0, 0.0, WIDTH_IN, FOOTER_IN)
    axes.set_xlim(0, WIDTH_IN)
    axes.set_ylim(0, FOOTER_IN)
    x_in = MARGIN_IN
    for label, colour in legend:
        axes.add_patch(Rectangle((x_in, 0.36), 0.24, 0.24, facecolor=colour, edgecolor="none"))
        axes.text(x_in + 0.32, 0.48, label, fontsize=11.5, va="center", color=palette.INK)
        x_in += 0.62 + 0.083 * len(label)
    for label, colour, width, dashes in lines:
        axes.plot([x_in, x_in + 0.35], [0.48, 0.48], color=colour, linewidth=width, linestyle=dashes)
        axes.text(x_in + 0.43, 0.48, label, fontsize=11.5, va="center", color=palette.INK)
        x_in += 0.75 + 0.083 * len(label)
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


def draw_discs(axes: Any, stations: Sequence[Station], spots: FloatArray, *, radius: float) -> None:
    """Draw a numbered disc a station; where discs would overlap they move apart, and a line leads to the spot.

    spots (N, 2) and radius are in the units of the axes.
    """
    for station, spot, disc in zip(stations, spots, spread_apart(spots, 2.15 * radius), strict=True):
        if np.hypot(*(disc - spot)) > 0.5 * radius:
            axes.plot(*np.stack([spot, disc]).T, color=palette.STATION, linewidth=1.2, zorder=4)
            axes.plot(*spot, marker="o", markersize=4, color=palette.STATION, zorder=4)
        axes.plot(*disc, marker="o", markersize=2 * DISC_RADIUS_PX * 72 / DPI, markerfacecolor=palette.STATION,
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
