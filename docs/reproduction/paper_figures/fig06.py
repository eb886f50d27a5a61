"""Fig. 6, occupancy grids of overlapping circles: no scene -> two grids, and their error against the closed form."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.circle_overlap import Cell, filled_share, occupancy_grid, shared_fraction

from .charts import COLOURS, chart, label
from .figure import Bench, Outcome, Picture

#: The scanner's range in Table 2; shares do not depend on it.
RADIUS_M = 5.0
#: Cells along a diameter that errors are measured for.
CELLS = (8, 16, 32, 64, 128, 256)
#: Points strewn over each other circle that errors are measured for.
POINTS = (50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000)
#: Grids of the chart by points.
_STREWN_CELLS = (16, 64)
_MIDDLE_M = np.zeros(2)
#: Both configurations drawn: title, cells across, points, middles of the other circles in radii.
_DRAWN = (
    ("(a) 48 cells across, two other circles", 48, 6000, ((0.9, 0.5), (-0.6, 1.1))),
    ("(b) 16 cells across, one other circle", 16, 500, ((0.9, 0.5),)),
)
_COLOUR_OF_CELL = {Cell.OUTSIDE: "#ffffff", Cell.FREE: "#d9d9d9", Cell.FILLED: COLOURS[5]}


def run(bench: Bench) -> Outcome:
    """Measure errors of pairs at many distances: by cells, and by points as the paper fills them; draw two grids."""
    distances_m = np.linspace(0.0, 2.0 * RADIUS_M, bench.at(41, 401))[1:-1]
    bench.tell(0, 2, "errors")
    by_cells = {cells: errors(distances_m, cells) for cells in CELLS}
    by_points = {cells: {n: errors(distances_m, cells, n_points=n) for n in POINTS} for cells in _STREWN_CELLS}
    mean_by_cells = {cells: float(np.abs(one).mean()) for cells, one in by_cells.items()}
    mean_by_points = {
        cells: {n: float(np.abs(one).mean()) for n, one in rows.items()} for cells, rows in by_points.items()
    }
    signed = float(by_points[_STREWN_CELLS[0]][POINTS[-1]].mean())
    bench.tell(1, 2, "draw")
    pictures = (*_draw_grids(bench), *_draw_errors(bench, by_cells, mean_by_points))
    bench.tell(2, 2)
    return Outcome(
        found=_say(by_cells, mean_by_points, signed=signed),
        agrees=agreement(list(mean_by_cells.values()), [list(rows.values()) for rows in mean_by_points.values()]),
        pictures=pictures,
        numbers={
            "n_distances": len(distances_m),
            "mean_error_by_cells": mean_by_cells,
            "greatest_error_by_cells": {cells: float(np.abs(one).max()) for cells, one in by_cells.items()},
            "mean_error_by_cells_and_points": mean_by_points,
            "signed_error_of_the_coarse_grid": signed,
        },
    )


def agreement(by_cells: list[float], by_points: list[list[float]]) -> Literal["yes", "partly", "no"]:
    """Whether accuracy depends on the grid and on the number of points, as in the paper.

    by_cells : mean errors, coarsest grid first; by_points : for each grid, mean errors, fewest points first. Either
    counts where the last error is less than half of the first.
    """
    holds = (by_cells[-1] < 0.5 * by_cells[0], all(row[-1] < 0.5 * row[0] for row in by_points))
    return "yes" if all(holds) else "partly" if any(holds) else "no"


def errors(distances_m: FloatArray, cells: int, *, n_points: int | None = None) -> FloatArray:
    """(N,) share of a circle that a grid finds filled by another at each distance, less the closed form's (Eq. 3)."""
    # Not along an axis, where whole rows of cells would be filled at once.
    towards = np.array([np.cos(0.5), np.sin(0.5)])
    shares = [
        filled_share(occupancy_grid(_MIDDLE_M, d * towards, radius_m=RADIUS_M, cells_across=cells, n_points=n_points))
        for d in distances_m
    ]
    return np.array(shares) - shared_fraction(distances_m, RADIUS_M, RADIUS_M)


def _say(by_cells: dict[int, FloatArray], by_points: dict[int, dict[int, float]], *, signed: float) -> str:
    by_size = ", ".join(
        f"{100 * np.abs(one).mean():.2f} % (at most {100 * np.abs(one).max():.2f} %) with {cells}"
        for cells, one in by_cells.items()
        if cells in (CELLS[0], CELLS[2], CELLS[-1])
    )
    strewn = "; ".join(
        f"with {cells} cells, {100 * rows[POINTS[0]]:.1f} % for {POINTS[0]} points and "
        f"{100 * rows[POINTS[-1]]:.1f} % for {POINTS[-1]}"
        for cells, rows in by_points.items()
    )
    coarse, fine = (by_points[cells] for cells in _STREWN_CELLS)
    worse_to = max((n for n in POINTS if fine[n] >= coarse[n]), default=0)
    best = min(POINTS, key=lambda n: coarse[n])
    return (
        "over distances from 0 to two radii, the share of a circle that a grid finds filled by another one differs "
        f"from the closed form of Eq. 3 on average by {by_size} cells across, if a cell counts by its middle. Filled "
        f"by points strewn over the other circle, as in the paper: {strewn}. A finer grid needs more points: with up "
        f"to {worse_to}, {_STREWN_CELLS[1]} cells across are worse than {_STREWN_CELLS[0]}. And a coarse grid can have "
        f"too many: {_STREWN_CELLS[0]} cells are best with {best} ({100 * coarse[best]:.1f} %) and find "
        f"{100 * signed:.1f} % too much with {POINTS[-1]}, since one point fills a whole cell on the rim."
    )


def _draw_grids(bench: Bench) -> tuple[Picture, ...]:
    from matplotlib.patches import Circle, Patch

    shows = "Occupancy grids of one circle, filled by points of the others: a fine and a coarse one"
    with chart(bench, "fig06.png", shows, columns=2, size_in=(4.2, 4.0)) as (sheet, axes, drawn):
        for one, (title, cells, n_points, middles) in zip(axes, _DRAWN, strict=True):
            others_m = RADIUS_M * np.array(middles)
            grid = occupancy_grid(_MIDDLE_M, others_m, radius_m=RADIUS_M, cells_across=cells, n_points=n_points)
            _draw_cells(one, grid)
            for place_m, colour in zip((_MIDDLE_M, *others_m), (COLOURS[6], COLOURS[1], COLOURS[2]), strict=False):
                one.add_patch(Circle(tuple(place_m), RADIUS_M, fill=False, color=colour, linewidth=1.6))
                one.plot(*place_m, "+", color=colour, markersize=7)
            one.set_xlim(-8.5, 10.0)
            one.set_ylim(-5.6, 10.9)
            one.set_aspect("equal")
            one.set_axis_off()
            one.set_title(
                f"{title}\n{n_points} points each: {100 * filled_share(grid):.1f} % filled", fontsize=9, loc="left"
            )
        handles = [
            Patch(facecolor=_COLOUR_OF_CELL[Cell.FILLED], label="filled by another circle"),
            Patch(facecolor=_COLOUR_OF_CELL[Cell.FREE], label="free"),
        ]
        sheet.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return tuple(drawn)


def _draw_cells(axes: Any, grid: Any) -> None:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    colours = ListedColormap([_COLOUR_OF_CELL[cell] for cell in Cell])
    edges = np.linspace(-RADIUS_M, RADIUS_M, len(grid) + 1)
    # Cells outside have no edges, so that only the circle's own grid is seen.
    inside = np.ma.masked_equal(grid, Cell.OUTSIDE)
    axes.pcolormesh(
        edges,
        edges,
        inside,
        cmap=colours,
        norm=BoundaryNorm([-1.5, -0.5, 0.5, 1.5], 3),
        edgecolors="white",
        linewidth=0.4,
    )


def _draw_errors(
    bench: Bench, by_cells: dict[int, FloatArray], by_points: dict[int, dict[int, float]]
) -> tuple[Picture, ...]:
    shows = "Error of the grid's overlap against the closed form, by cells (left) and by points (right)"
    with chart(bench, "fig06-errors.png", shows, columns=2, size_in=(4.2, 3.2)) as (_, axes, drawn):
        mean = [np.abs(one).mean() for one in by_cells.values()]
        most = [np.abs(one).max() for one in by_cells.values()]
        axes[0].loglog(list(by_cells), most, "s--", color=COLOURS[1], markersize=4, linewidth=1, label="greatest")
        axes[0].loglog(list(by_cells), mean, "o-", color=COLOURS[0], markersize=4, linewidth=1, label="mean")
        axes[0].set_xticks(list(by_cells), [str(cells) for cells in by_cells])
        axes[0].minorticks_off()
        label(axes[0], "Cells filled by their middle", "cells across", "error of the share")
        for (cells, rows), colour, mark in zip(by_points.items(), (COLOURS[2], COLOURS[3]), "^v", strict=True):
            title = f"{cells} cells across"
            axes[1].loglog(
                list(rows), list(rows.values()), mark + "-", color=colour, markersize=4, linewidth=1, label=title
            )
        label(axes[1], "Cells filled by points", "points in the other circle", "mean error of the share")
        for one in axes:
            one.legend(fontsize=8, frameon=False)
    return tuple(drawn)
