"""The charts of sheets: what each further station adds, and how surface is seen. PlanSource, Building -> drawings.

Histograms are weighted by area: a bar is the share of the seen surface that is seen from that far, that obliquely, or
with points that far apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.export.sheets.building import Building, read_figures
from planner_core.export.sheets.fonts import width_mm
from planner_core.export.sheets.ink import PAPER, QUIET, Box, Colour, Ink, Pen
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_source import PlanSource

_BAR: Colour = (0.55, 0.70, 0.80)
_BAR_EDGE = Pen(0.18, (0.10, 0.28, 0.40))
_CURVE = Pen(0.6, (0.05, 0.30, 0.48), round=True)
_ASKED = Pen(0.45, (0.80, 0.16, 0.03), (2.2, 1.2))
_GRID = Pen(0.1, (0.78, 0.79, 0.80))
_AXIS = Pen(0.25)
_SIZE_PT = 6.6
_N_BINS = 24
#: Up to here points of the curve are drawn and named.
_MAX_POINTS = 60
_MAX_NAMES = 25
_LAYERS = ("range", "incidence", "spacing")


@dataclass(frozen=True)
class Axis:
    """From 0 to `most`, ticks every `step`, numbers times `factor` shown."""

    words: str
    most: float
    step: float


@dataclass(frozen=True, eq=False)
class Histogram:
    """edges : (B + 1,) in shown units, the last bar holds what is more too. shares : (B,) of the seen area, in [0, 1].

    asked : the limit in shown units; None: none was asked. more : whether something is beyond the last edge.
    """

    title: str
    words: str
    edges: FloatArray
    shares: FloatArray
    asked: float | None
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
    asked = plan.document["requirements"]["asked"]
    incidence = asked["incidence_rad"]
    limits = {
        "range": asked["range_m"],
        "incidence": None if incidence is None else math.degrees(incidence),
        "spacing": None if asked["spacing_m"] is None else 1000 * asked["spacing_m"],
    }
    shown = {
        "range": ("Range", "range to the nearest station, m", 1.0),
        "incidence": ("Incidence", "angle of incidence at the best station, degrees", 1.0),
        "spacing": ("Point spacing", "point spacing of all stations together, mm", 1000.0),
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
    figures: FloatArray, area_m2: FloatArray, title: str, words: str, factor: float, asked: float | None
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
    most = max(quantile[2], 1e-6) if asked is None else max(quantile[2], 1.1 * asked)
    width = _round_up(most / _N_BINS)
    n_bins = max(1, math.ceil(most / width - 1e-9))
    edges: FloatArray = width * np.arange(n_bins + 1, dtype=np.float64)
    place = np.minimum((values / width).astype(np.int64), n_bins - 1)
    shares: FloatArray = np.bincount(place, weights=weights, minlength=n_bins).astype(np.float64) / weights.sum()
    within = None if asked is None else float(weights[values <= asked * (1 + 1e-9)].sum() / weights.sum())
    more = bool((values > edges[-1]).any())
    return Histogram(title, words, edges, shares, asked, quantile[0], quantile[1], within, more)


def _round_up(width: float) -> float:
    """The least of 1, 2, 2.5, 5 times a power of ten that is at least `width`."""
    power = 10.0 ** math.floor(math.log10(width))
    return float(next(step * power for step in (1, 2, 2.5, 5, 10) if step * power >= width * (1 - 1e-9)))


def share_axis(highest: float) -> Axis:
    """Return the axis for bars of at most that share: round numbers, five ticks or fewer, little room above."""
    most = 108 * highest
    step = _round_up(most / 5)
    return Axis("share of the seen surface, %", step * math.ceil(most / step - 1e-9), step)


def draw_histogram(ink: Ink, made: Histogram, box: Box) -> None:
    """Draw one in a box, with the asked limit as a dashed line."""
    x_axis = Axis(made.words, float(made.edges[-1]), _round_up(float(made.edges[-1]) / 7))
    plot, to_x, to_y = _draw_axes(ink, made.title, box, x_axis, share_axis(float(made.shares.max())))
    for low, high, share in zip(made.edges[:-1], made.edges[1:], made.shares, strict=True):
        if share > 0:
            bar = _bar(to_x(low), to_x(high), plot.bottom, to_y(100 * share))
            ink.area([bar], _BAR)
            ink.lines([bar], _BAR_EDGE, closed=True)
    lines = [f"half of it at most {made.median:.3g}{made.unit}, 95 % at most {made.at_95:.3g}{made.unit}"]
    if made.more:
        lines.append("the last bar is of all beyond, too")
    if made.asked is not None and made.within is not None:
        x = to_x(made.asked)
        ink.lines([np.array([(x, plot.bottom), (x, plot.top)])], _ASKED)
        _boxed(ink, (x, plot.top - 2.0), f"required: {made.asked:.4g}{made.unit}", plot)
        lines.append(f"{100 * made.within:.1f} % keep the limit")
    ink.text((plot.right, box.top - 7.6), "; ".join(lines), _SIZE_PT, align="right", colour=QUIET)


def _boxed(ink: Ink, at: tuple[float, float], words: str, plot: Box) -> None:
    """Write beside a line at x, on the side that has room."""
    width = width_mm(words, _SIZE_PT) + 1.6
    left = at[0] - width - 0.6 if at[0] + width > plot.right else at[0] + 0.6
    box = Box(left, at[1] - 1.0, width, 3.2)
    ink.area([_bar(box.left, box.right, box.bottom, box.top)], PAPER)
    ink.text((left + 0.8, at[1]), words, _SIZE_PT, colour=_ASKED.colour)


def draw_curve(ink: Ink, plan: PlanSource, box: Box) -> None:
    """Draw covered share against number of stations, the most useful first where the plan says which that is."""
    why = plan.document.get("why")
    steps = [] if why is None else why["curve"]
    shares = [step["fraction_of_achievable"] for step in steps] or list(plan.document.get("coverage_curve", ()))
    curve = 100 * np.array([0.0, *shares], dtype=np.float64)
    n = max(1, len(curve) - 1)
    title = "What each further station adds" + (", the most useful first" if steps else "")
    named = steps if len(steps) <= _MAX_NAMES else []
    words = "stations; at each point the number of the one that is added" if named else "stations"
    x_axis = Axis(words, 1.04 * n, float(math.ceil(_round_up(max(n, 12) / 12))))
    plot, to_x, to_y = _draw_axes(ink, title, box, x_axis, Axis("seen share of the achievable surface, %", 105, 20))
    asked = 100 * float(plan.document["requirements"]["coverage"])
    ink.lines([np.array([(plot.left, to_y(asked)), (plot.right, to_y(asked))])], _ASKED)
    ink.text((plot.left + 1, to_y(asked) + 0.9), f"required: {asked:g} %", _SIZE_PT, colour=_ASKED.colour)
    spots = np.array([(to_x(place), to_y(share)) for place, share in enumerate(curve.tolist())])
    ink.lines([spots], _CURVE)
    if len(curve) <= _MAX_POINTS:
        for x, y in spots.tolist():
            ink.disc((x, y), 0.8, _CURVE.colour, Pen(0.2, PAPER))
    number = {station.id: station.number for station in plan.stations}
    for step, (x, y) in zip(named, spots[1:].tolist(), strict=False):
        ink.text((x + 0.6, y - 3.4), str(number.get(step["station"], step["station"])), 5.8)


def _draw_axes(
    ink: Ink, title: str, box: Box, x_axis: Axis, y_axis: Axis
) -> tuple[Box, Callable[[float], float], Callable[[float], float]]:
    """Draw title, axes and grid; return the plot's box, and where values are on paper."""
    plot = Box(box.left + 12, box.bottom + 10, box.width - 15, box.height - 20)
    ink.text((box.left, box.top - 4.2), title, 10.0, bold=True)

    def to_x(value: float) -> float:
        return plot.left + value / x_axis.most * plot.width

    def to_y(value: float) -> float:
        return plot.bottom + value / y_axis.most * plot.height

    for value in _ticks(x_axis):
        ink.lines([np.array([(to_x(value), plot.bottom), (to_x(value), plot.bottom - 1.0)])], _AXIS)
        ink.text((to_x(value), plot.bottom - 3.9), f"{value:g}", _SIZE_PT, align="middle")
    for value in _ticks(y_axis):
        ink.lines([np.array([(plot.left, to_y(value)), (plot.right, to_y(value))])], _GRID)
        ink.text((plot.left - 1.2, to_y(value) - 0.9), f"{value:g}", _SIZE_PT, align="right")
    ink.lines([np.array([(plot.left, plot.top), (plot.left, plot.bottom), (plot.right, plot.bottom)])], _AXIS)
    ink.text((plot.left + plot.width / 2, box.bottom + 1.6), x_axis.words, _SIZE_PT, align="middle", colour=QUIET)
    ink.text((box.left + 2.2, plot.bottom + plot.height / 2), y_axis.words, _SIZE_PT, align="middle", colour=QUIET,
             turn_rad=math.pi / 2)  # fmt: skip
    return plot, to_x, to_y


def _ticks(axis: Axis) -> Sequence[float]:
    return [round(axis.step * place, 9) for place in range(math.floor(axis.most / axis.step + 1e-9) + 1)]


def _bar(left: float, right: float, bottom: float, top: float) -> FloatArray:
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top)])
