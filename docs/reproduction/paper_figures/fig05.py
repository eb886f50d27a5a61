"""Fig. 5, F1 and F2 over a uniform sample of a level: F2 as printed, and without its second sum; with d^2 and d."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Int64Array
from planner_core.paper.point_distribution import PointDistribution

from .charts import chart, draw_nothing, draw_walls, label
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level

#: A rank correlation is strong from here on.
STRONG = 0.5
#: Names of both forms of F2.
PRINTED, KEPT = "as printed", "without the second sum"
_UNITS = {"squared": "m2", "euclidean": "m"}


@dataclass(frozen=True)
class Forms:
    """Both forms of F2 of N positions with one distance, and what they are of a station that sees nothing."""

    f1: Int64Array
    f2: dict[str, FloatArray]
    nothing: float
    share_with_half: float
    """Share of the patches, those with the largest references, that hold half of the sum of all references."""

    def numbers(self) -> dict[str, Any]:
        """Rank correlations with F1, and shares of positions that score worse than a station that sees nothing."""
        return {
            "rank_correlation": {name: rank_correlation(self.f1.astype(float), f2) for name, f2 in self.f2.items()},
            "worse_than_nothing": {name: float((f2 > self.nothing).mean()) for name, f2 in self.f2.items()},
            "sees_nothing": self.nothing,
            "share_with_half": self.share_with_half,
        }


def run(bench: Bench) -> Outcome:
    """Measure both forms of F2 at every admissible position of one height, and compare them with F1."""
    level = open_level(bench, "basement", grid_step_m=bench.at(0.75, 0.25), heights_m=(1.3,))
    position_m = level.candidates().position_m
    found: dict[str, Forms] = {}
    for done, distance in enumerate(_UNITS):
        bench.tell(done, 3, f"{distance}, {len(position_m)} positions")
        found[distance] = _measure(bench, level, position_m, distance)
    bench.tell(2, 3, "draw")
    pictures = _draw(bench, level, position_m, found)
    bench.tell(3, 3)
    numbers = {
        "n_positions": len(position_m),
        "columns": level.columns,
        **{distance: forms.numbers() for distance, forms in found.items()},
    }
    return Outcome(found=_say(numbers), agrees=verdict(numbers), pictures=pictures, numbers=numbers)


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether F2 as printed falls with F1, and without its second sum rises, both strongly; of squared distances."""
    return at_native_columns(numbers, lambda: _of(numbers["squared"]["rank_correlation"]))


def _of(rank: Mapping[str, float]) -> Verdict:
    return by_share((rank[PRINTED] <= -STRONG, rank[KEPT] >= STRONG))


def _measure(bench: Bench, level: Level, position_m: FloatArray, distance: str) -> Forms:
    judge = PointDistribution(level.survey.scene, level.survey.patches, level.engine, distance=distance)
    sums = judge.sums(level.survey.template, position_m, progress=bench.progress)
    largest_first = np.cumsum(np.sort(judge.reference_m2)[::-1])
    half = float((np.searchsorted(largest_first, largest_first[-1] / 2) + 1) / largest_first.size)
    forms = {PRINTED: sums.f2_m2(), KEPT: sums.f2_m2(keep_reached=True)}
    return Forms(sums.n_patches, forms, judge.reference_total_m2, half)


def _say(numbers: Mapping[str, Any]) -> str:
    squared, plain = numbers["squared"], numbers["euclidean"]

    def each(of: Mapping[str, Any]) -> str:
        rank, worse = of["rank_correlation"], of["worse_than_nothing"]
        return (
            f"{rank[PRINTED]:.2f} for F2 as printed and {rank[KEPT]:.2f} without its second sum, and "
            f"{100 * worse[PRINTED]:.0f} % and {100 * worse[KEPT]:.0f} % of the positions score worse than a station "
            "that sees nothing"
        )

    decides = "decides" if _of(squared["rank_correlation"]) != _of(plain["rank_correlation"]) else "does not decide"
    return (
        f"at {numbers['n_positions']} admissible positions 1.3 m above the basement's ground, with squared distances "
        f"as Eq. 2 prints them, the rank correlation with F1 is {each(squared)}. With plain distances, as the text "
        f"has it, it is {each(plain)}: the choice of distance {decides} this verdict. Long thin patches rule both, "
        f"and the squares far more: the patches with the largest references that hold half of the sum of all are "
        f"{100 * squared['share_with_half']:.2f} % with d2 and {100 * plain['share_with_half']:.1f} % with d."
    )


def _draw(bench: Bench, level: Level, position_m: FloatArray, found: dict[str, Forms]) -> tuple[Picture, ...]:
    squared = found["squared"]
    maps = {"F1": squared.f1.astype(float)} | {f"F2 {name}": f2 for name, f2 in squared.f2.items()}
    shows = "F1 and both forms of F2 over the level; both forms against F1, with squared and with plain distances"
    with chart(bench, "fig05.png", shows, columns=3, rows=3) as (sheet, axes, drawn):
        walls = level.walls_m()
        for one, (name, values) in zip(axes[:3], maps.items(), strict=True):
            draw_walls(one, walls)
            x, y, _ = position_m.T
            dots = one.scatter(x, y, c=values, s=12, cmap="viridis" if name == "F1" else "viridis_r", linewidths=0)
            sheet.colorbar(dots, ax=one, shrink=0.7).ax.tick_params(labelsize=7)
            one.set_title(name, fontsize=9, loc="left")
        for row, (distance, forms) in enumerate(found.items(), start=1):
            axes[3 * row].set_axis_off()
            for one, (name, f2) in zip(axes[3 * row + 1 : 3 * row + 3], forms.f2.items(), strict=True):
                one.plot(forms.f1, f2, ".", markersize=2.5, color="#0072b2")
                draw_nothing(one, forms.nothing, unit=_UNITS[distance])
                rank = rank_correlation(forms.f1.astype(float), f2)
                label(one, f"{distance}: rank correlation {rank:.2f}", "F1, patches", f"F2 {name}, {_UNITS[distance]}")
    return tuple(drawn)


def rank_correlation(a: FloatArray, b: FloatArray) -> float:
    """Spearman's, of two samples (N,)."""
    from scipy.stats import spearmanr

    return float(spearmanr(a, b).statistic)
