"""Plots with two axes, and the curve of coverage: covered share of the achievable area against number of stations."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.plan_folder.drawing.canvas import PAPER, QUIET, Box, Canvas, Pen

SIZE_PT = 6.6
REQUIRED = Pen(0.45, (0.80, 0.16, 0.03), (2.2, 1.2))
_CURVE = Pen(0.6, (0.05, 0.30, 0.48), round=True)
_GRID = Pen(0.1, (0.78, 0.79, 0.80))
_AXIS = Pen(0.25)
#: Up to here points of the curve are drawn and named.
_MAX_POINTS = 60
_MAX_NAMES = 25


@dataclass(frozen=True)
class Axis:
    """From 0 to `most`, ticks every `step`, numbers times `factor` shown."""

    words: str
    most: float
    step: float


def round_up(width: float) -> float:
    """Return the least of 1, 2, 2.5, 5 times a power of ten that is at least `width`."""
    power = 10.0 ** math.floor(math.log10(width))
    return float(next(step * power for step in (1, 2, 2.5, 5, 10) if step * power >= width * (1 - 1e-9)))


def draw_curve(canvas: Canvas, box: Box, shares: Sequence[float], names: Sequence[str], *, required: float) -> None:
    """Draw the share covered by 1, 2, ... stations. names : of the stations, the most useful first; or none."""
    curve = 100 * np.array([0.0, *shares], dtype=np.float64)
    n = max(1, len(curve) - 1)
    title = "Coverage by number of stations" + (", most useful first" if names else "")
    named = names if len(names) <= _MAX_NAMES else []
    words = "number of stations; labels: the station added" if named else "stations"
    x_axis = Axis(words, 1.04 * n, float(math.ceil(round_up(max(n, 12) / 12))))
    plot, to_x, to_y = draw_plot(canvas, title, box, x_axis, Axis("coverage of the scannable area, %", 105, 20))
    height = to_y(100 * required)
    canvas.lines([np.array([(plot.left, height), (plot.right, height)])], REQUIRED)
    canvas.text((plot.left + 1, height + 0.9), f"required: {100 * required:g} %", SIZE_PT, colour=REQUIRED.colour)
    spots = np.array([(to_x(place), to_y(share)) for place, share in enumerate(curve.tolist())])
    canvas.lines([spots], _CURVE)
    if len(curve) <= _MAX_POINTS:
        for x, y in spots.tolist():
            canvas.disc((x, y), 0.8, _CURVE.colour, Pen(0.2, PAPER))
    for name, (x, y) in zip(named, spots[1:].tolist(), strict=False):
        canvas.text((x + 0.6, y - 3.4), name, 5.8)


def draw_plot(
    canvas: Canvas, title: str, box: Box, x_axis: Axis, y_axis: Axis
) -> tuple[Box, Callable[[float], float], Callable[[float], float]]:
    """Draw title, axes and grid; return the plot's box, and where values are on paper."""
    plot = Box(box.left + 12, box.bottom + 10, box.width - 15, box.height - 20)
    canvas.text((box.left, box.top - 4.2), title, 10.0, bold=True)

    def to_x(value: float) -> float:
        return plot.left + value / x_axis.most * plot.width

    def to_y(value: float) -> float:
        return plot.bottom + value / y_axis.most * plot.height

    for value in _ticks(x_axis):
        canvas.lines([np.array([(to_x(value), plot.bottom), (to_x(value), plot.bottom - 1.0)])], _AXIS)
        canvas.text((to_x(value), plot.bottom - 3.9), f"{value:g}", SIZE_PT, align="middle")
    for value in _ticks(y_axis):
        canvas.lines([np.array([(plot.left, to_y(value)), (plot.right, to_y(value))])], _GRID)
        canvas.text((plot.left - 1.2, to_y(value) - 0.9), f"{value:g}", SIZE_PT, align="right")
    canvas.lines([np.array([(plot.left, plot.top), (plot.left, plot.bottom), (plot.right, plot.bottom)])], _AXIS)
    canvas.text((plot.left + plot.width / 2, box.bottom + 1.6), x_axis.words, SIZE_PT, align="middle", colour=QUIET)
    canvas.text((box.left + 2.2, plot.bottom + plot.height / 2), y_axis.words, SIZE_PT, align="middle", colour=QUIET,
                turn_rad=math.pi / 2)  # fmt: skip
    return plot, to_x, to_y


def _ticks(axis: Axis) -> Sequence[float]:
    return [round(axis.step * place, 9) for place in range(math.floor(axis.most / axis.step + 1e-9) + 1)]
