"""Fig. 4, mean distance of six kinds of point sets in a triangle: no scene -> the sets, and the mean by their size."""

from __future__ import annotations

from typing import Literal

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.reference_distance import (
    SampleKind,
    mean_distance_m,
    mean_squared_distance_m2,
    sample_triangle,
)

from .charts import COLOURS, chart, label
from .figure import Bench, Outcome, Picture

#: About as large as a wall's triangle that a scanner sees whole; no corner is special.
CORNERS_M = np.array([[0.0, 0.0, 0.0], [1.1, 0.12, 0.0], [0.35, 0.95, 0.0]])
#: What the reference of a patch of 0.04 m^2 is made of; 105 is a full lattice.
N_POINTS = 105
#: Numbers of points on a triangle that the second chart tries.
_SIZES = (1, 2, 3, 5, 8, 12, 20, 35, 60, 105, 200, 400)
#: Means this near to each other are similar, see `agreement`.
SIMILAR = 0.15
_TITLES = {
    SampleKind.GRID: "even grid",
    SampleKind.RANDOM_UV: "random u and v, no root",
    SampleKind.RANDOM: "random",
    SampleKind.HALTON: "Halton (reference)",
    SampleKind.PART: "random, a part only",
    SampleKind.THREE: "three points",
}


def run(bench: Bench) -> Outcome:
    """Measure the mean distance of each kind of set, with the vertices and without, over seeds."""
    n_seeds = bench.at(50, 500)
    bench.tell(0, 2, "sample")
    bare = {kind: _over_seeds(bench, kind, n_seeds, vertices=False) for kind in SampleKind}
    closed = {kind: _over_seeds(bench, kind, n_seeds, vertices=True) for kind in SampleKind}
    bench.tell(1, 2, "by number of points")
    ratio = {kind: _ratios(bench, kind, n_seeds) for kind in (SampleKind.HALTON, SampleKind.RANDOM, SampleKind.PART)}
    pictures = (*_draw_sets(bench, bare, closed), *_draw_ratios(bench, ratio))
    bench.tell(2, 2)
    mean = {kind: float(values.mean()) for kind, values in bare.items()}
    part, three = _ratio(bench, SampleKind.PART, N_POINTS, n_seeds), _ratio(bench, SampleKind.THREE, 3, 1)
    above = [size for size, value in zip(_SIZES, ratio[SampleKind.PART], strict=True) if value > 1]
    spread = float(bare[SampleKind.RANDOM].std() / mean[SampleKind.RANDOM])
    return Outcome(
        found=_say(mean, n_seeds=n_seeds, spread=spread, part=part, three=three, penalised_to=max(above, default=0)),
        agrees=agreement(mean, part_with_vertices=part, three_with_vertices=three),
        pictures=pictures,
        numbers={
            "n_points": N_POINTS,
            "mean_distance_m": {kind.value: value for kind, value in mean.items()},
            "mean_distance_with_vertices_m": {kind.value: float(values.mean()) for kind, values in closed.items()},
            "spread_of_random": spread,
            "sizes": list(_SIZES),
            "over_reference_by_size": {kind.value: values for kind, values in ratio.items()},
            "three_points_over_reference": three,
        },
    )


def _say(
    mean_m: dict[SampleKind, float], *, n_seeds: int, spread: float, part: float, three: float, penalised_to: int
) -> str:
    halton, grid, random = (mean_m[kind] for kind in (SampleKind.HALTON, SampleKind.GRID, SampleKind.RANDOM))
    return (
        f"in a triangle of {_area_m2():.2f} m2, {N_POINTS} Halton points are {halton:.3f} m apart on average, "
        f"{_percent(halton, grid)} than the points of an even grid ({grid:.3f} m), of which many lie on the rim. "
        f"Pseudo-random points come to {random:.3f} m, but give or take {100 * spread:.1f} % (one sigma of {n_seeds} "
        f"seeds), where Halton is always the same. Random u and v without the root, crowded in one corner, come to "
        f"{mean_m[SampleKind.RANDOM_UV]:.3f} m: the mean hardly sees such crowding. Points in a part only come to "
        f"{mean_m[SampleKind.PART]:.3f} m, {mean_m[SampleKind.PART] / halton:.2f} of Halton's: without the vertices a "
        f"scan of a corner would pass for a good one. With them and by Eq. 6, three points come to {three:.1f} times "
        f"the reference. But the vertices weigh less the more points there are: of the numbers tried, the part only is "
        f"above the reference up to {penalised_to} points, and at {N_POINTS} it comes to {part:.2f} of it"
        f"{', which F2 rewards' if part < 1 else ''}."
    )


def agreement(
    mean_m: dict[SampleKind, float], *, part_with_vertices: float, three_with_vertices: float
) -> Literal["yes", "partly", "no"]:
    """Whether means bear the paper out.

    Halton's is similar to the grid's, a part's by itself is less than half of it; and with the vertices both a part and
    three points are above the reference (ratios above 1), as a penalty has to be. The first two make it `partly`.
    """
    similar = abs(mean_m[SampleKind.HALTON] / mean_m[SampleKind.GRID] - 1.0) <= SIMILAR
    small = mean_m[SampleKind.PART] < 0.5 * mean_m[SampleKind.HALTON]
    if not (similar and small):
        return "no"
    return "yes" if part_with_vertices > 1.0 and three_with_vertices > 1.0 else "partly"


def _over_seeds(bench: Bench, kind: SampleKind, n_seeds: int, *, vertices: bool) -> FloatArray:
    """Mean Euclidean distances in metres, one a seed."""
    return np.array([mean_distance_m(_points(kind, N_POINTS, bench.seed + k, vertices)) for k in range(n_seeds)])


def _points(kind: SampleKind, n: int, seed: int, vertices: bool) -> FloatArray:
    points = sample_triangle(CORNERS_M, n, kind, seed=seed)
    return np.concatenate([points, CORNERS_M]) if vertices else points


def _ratios(bench: Bench, kind: SampleKind, n_seeds: int) -> list[float]:
    return [_ratio(bench, kind, size, n_seeds) for size in _SIZES]


def _ratio(bench: Bench, kind: SampleKind, n: int, n_seeds: int) -> float:
    """Mean of Eq. 6 over seeds for n points and the vertices, over the same of the reference."""
    reference = mean_squared_distance_m2(_points(SampleKind.HALTON, N_POINTS, 0, True))
    return float(
        np.mean([mean_squared_distance_m2(_points(kind, n, bench.seed + k, True)) for k in range(n_seeds)]) / reference
    )


def _draw_sets(
    bench: Bench, bare: dict[SampleKind, FloatArray], closed: dict[SampleKind, FloatArray]
) -> tuple[Picture, ...]:
    outline = CORNERS_M[[0, 1, 2, 0], :2]
    shows = "Six kinds of point sets in a triangle and their mean distance"
    with chart(bench, "fig04.png", shows, columns=3, rows=2, size_in=(2.9, 2.9)) as (_, axes, drawn):
        for one, kind in zip(axes, SampleKind, strict=True):
            points = sample_triangle(CORNERS_M, N_POINTS, kind, seed=bench.seed)
            one.plot(*outline.T, color="#444444", linewidth=0.9)
            one.plot(*points[:, :2].T, ".", color=COLOURS[0], markersize=9 if len(points) == 3 else 4)
            one.set_aspect("equal")
            one.set_axis_off()
            one.set_title(
                f"{_TITLES[kind]}\nmean {bare[kind].mean():.3f} m, with vertices {closed[kind].mean():.3f} m",
                fontsize=9,
                loc="left",
            )
    return tuple(drawn)


def _draw_ratios(bench: Bench, ratio: dict[SampleKind, list[float]]) -> tuple[Picture, ...]:
    shows = "Eq. 6 with the vertices, over the reference, by the number of points on the triangle"
    with chart(bench, "fig04-by-number.png", shows, size_in=(5.6, 3.4)) as (_, (one,), drawn):
        for (kind, values), colour, mark in zip(ratio.items(), COLOURS, "os^", strict=False):
            one.semilogx(_SIZES, values, mark + "-", color=colour, markersize=4, linewidth=1, label=_TITLES[kind])
        one.axhline(1.0, color="#888888", linewidth=0.6)
        one.annotate(f"reference: {N_POINTS} Halton points", (1.0, 0.9), va="top", fontsize=8, color="#555555")
        one.set_ylim(bottom=0)
        one.legend(fontsize=8, frameon=False)
        one.set_xticks([1, 10, 100], ["1", "10", "100"])
        label(
            one,
            "Eq. 6 with the vertices: a part only is penalised while points are few",
            "points on the triangle",
            "mean over reference",
        )
    return tuple(drawn)


def _area_m2() -> float:
    return float(np.linalg.norm(np.cross(CORNERS_M[1] - CORNERS_M[0], CORNERS_M[2] - CORNERS_M[0])) / 2)


def _percent(value: float, of: float) -> str:
    share = 100.0 * (value / of - 1.0)
    return f"{abs(share):.0f} % {'more' if share > 0 else 'less'}"
