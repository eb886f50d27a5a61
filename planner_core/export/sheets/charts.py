"""The histograms of sheets: how surface is seen. PlanSource, Building -> drawings.

Histograms are weighted by area: a bar is the share of the seen surface that is seen from that far, that obliquely, or
with points that far apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner_core.export.sheets.building import Building, read_figures
from planner_core.model import FOOT, FloatArray
from planner_core.plan_folder.drawing import plot
from planner_core.plan_folder.drawing.canvas import PAPER, QUIET, Box, Canvas, Colour, Pen
from planner_core.plan_folder.drawing.fonts import width_mm
from planner_core.plan_folder.drawing.marks import corners
from planner_core.plan_folder.plan_source import PlanSource

_BAR: Colour = (0.55, 0.70, 0.80)
_BAR_EDGE = Pen(0.18, (0.10, 0.28, 0.40))
_N_BINS = 24
_LAYERS = ("range", "incidence", "spacing")


@dataclass(frozen=True, eq=False)
class Histogram:
    """edges : (B + 1,) in shown units, the last bar holds what is more too. shares : (B,) of the seen area, in [0, 1].

    limit : in shown units; None: there is none. more : whether something is beyond the last edge.
    """

    title: str
    words: str
    edges: FloatArray
    shares: FloatArray
    limit: float | None
    median: float
    at_95: float
    within: float | None
    """Share of the seen area that keeps the limit."""
    more: bool

    @property
    def unit(self) -> str:
        """Written behind figures: what `words` end with."""
        unit = self.words.partition(", ")[2]
        return "°" if unit == "degrees" else f" {unit}".rstrip()


def histograms_of(plan: PlanSource, building: Building) -> list[Histogram]:
    """Histograms of range, incidence and point spacing, as far as the plan folder has the figures."""
    layers = read_figures(plan.folder, _LAYERS)
    required = plan.document["requirements"]["asked"]
    incidence = required["incidence_rad"]
    feet = plan.frame.unit.is_feet
    length, short = (("ft", 1 / FOOT.metres), ("in", 12 / FOOT.metres)) if feet else (("m", 1.0), ("mm", 1000.0))
    limits = {
        "range": None if required["range_m"] is None else length[1] * required["range_m"],
        "incidence": None if incidence is None else math.degrees(incidence),
        "spacing": None if required["spacing_m"] is None else short[1] * required["spacing_m"],
    }
    shown = {
        "range": ("Range", f"range to the nearest station, {length[0]}", length[1]),
        "incidence": ("Incidence", "angle of incidence at the best station, degrees", 1.0),
        "spacing": ("Point spacing", f"point spacing of all stations together, {short[0]}", short[1]),
    }
    area_m2 = building.patches.area_m2
    return [
        made
        for name in _LAYERS
        if name in layers and layers[name].size == area_m2.size
        for made in [histogram(layers[name], area_m2, *shown[name], limits[name])]
        if made is not None
    ]


def histogram(
    figures: FloatArray, area_m2: FloatArray, title: str, words: str, factor: float, limit: float | None
) -> Histogram | None:
    """Return the histogram of figures (P,) by area (P,); None where nothing is seen."""
    seen = np.isfinite(figures) & (area_m2 > 0)
    values, weights = figures[seen] * factor, area_m2[seen]
    if not values.size:
        return None
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weights[order]) / weights.sum()
    ordered = values[order]
    quantile = [float(ordered[min(int(np.searchsorted(reached, q)), ordered.size - 1)]) for q in (0.5, 0.95, 0.99)]
    most = max(quantile[2], 1e-6) if limit is None else max(quantile[2], 1.1 * limit)
    width = plot.round_up(most / _N_BINS)
    n_bins = max(1, math.ceil(most / width - 1e-9))
    edges: FloatArray = width * np.arange(n_bins + 1, dtype=np.float64)
    place = np.minimum((values / width).astype(np.int64), n_bins - 1)
    shares: FloatArray = np.bincount(place, weights=weights, minlength=n_bins).astype(np.float64) / weights.sum()
    within = None if limit is None else float(weights[values <= limit * (1 + 1e-9)].sum() / weights.sum())
    more = bool((values > edges[-1]).any())
    return Histogram(title, words, edges, shares, limit, quantile[0], quantile[1], within, more)


def share_axis(highest: float) -> plot.Axis:
    """Return the axis for bars of at most that share: round numbers, five ticks or fewer, little room above."""
    most = 108 * highest
    step = plot.round_up(most / 5)
    return plot.Axis("share of the seen surface, %", step * math.ceil(most / step - 1e-9), step)


def draw_histogram(canvas: Canvas, made: Histogram, box: Box) -> None:
    """Draw one in a box, with the required limit as a dashed line."""
    x_axis = plot.Axis(made.words, float(made.edges[-1]), plot.round_up(float(made.edges[-1]) / 7))
    y_axis = share_axis(float(made.shares.max()))
    room, to_x, to_y = plot.draw_plot(canvas, made.title, box, x_axis, y_axis)
    for low, high, share in zip(made.edges[:-1], made.edges[1:], made.shares, strict=True):
        if share > 0:
            bar = corners(Box(to_x(low), room.bottom, to_x(high) - to_x(low), to_y(100 * share) - room.bottom))
            canvas.area([bar], _BAR)
            canvas.lines([bar], _BAR_EDGE, closed=True)
    lines = [f"median {made.median:.3g}{made.unit}, 95 % at most {made.at_95:.3g}{made.unit}"]
    if made.more:
        lines.append("the last bar includes all larger values")
    if made.limit is not None and made.within is not None:
        x = to_x(made.limit)
        canvas.lines([np.array([(x, room.bottom), (x, room.top)])], plot.REQUIRED)
        _boxed(canvas, (x, room.top - 2.0), f"required: {made.limit:.4g}{made.unit}", room)
        lines.append(f"{100 * made.within:.1f} % within the limit")
    canvas.text((room.right, box.top - 7.6), "; ".join(lines), plot.SIZE_PT, align="right", colour=QUIET)


def _boxed(canvas: Canvas, at: tuple[float, float], words: str, room: Box) -> None:
    """Write beside a line at x, on the side that has room."""
    width = width_mm(words, plot.SIZE_PT) + 1.6
    left = at[0] - width - 0.6 if at[0] + width > room.right else at[0] + 0.6
    box = Box(left, at[1] - 1.0, width, 3.2)
    canvas.area([corners(box)], PAPER)
    canvas.text((left + 0.8, at[1]), words, plot.SIZE_PT, colour=plot.REQUIRED.colour)
