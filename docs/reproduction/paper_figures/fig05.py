"""Fig. 5, F1 and F2 over a uniform sample of a level: F2 as printed, and without its second sum."""

from __future__ import annotations

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.point_distribution import PointDistribution

from .charts import chart, draw_walls, label
from .figure import Bench, Outcome
from .levels import open_level


def run(bench: Bench) -> Outcome:
    """Measure both forms of F2 at every admissible position of one height, and compare them with F1."""
    level = open_level(
        bench, "basement", n_azimuths=bench.at(900, None), grid_step_m=bench.at(0.5, 0.25), heights_m=(1.3,)
    )
    candidates = level.candidates()
    bench.tell(0, 2, f"{len(candidates.position_m)} positions")
    judge = PointDistribution(level.survey.scene, level.survey.patches, level.engine)
    sums = judge.sums(level.survey.template, candidates.position_m, progress=bench.progress)
    forms = {"as printed": sums.f2_m2(), "without the second sum": sums.f2_m2(keep_reached=True)}
    rank = {name: rank_correlation(sums.n_patches.astype(float), f2) for name, f2 in forms.items()}
    bench.tell(1, 2, "draw")
    with chart(bench, "fig05.png", "F1 and both forms of F2 over the level", columns=3, rows=2) as (sheet, axes, drawn):
        maps = {"F1": sums.n_patches.astype(float)} | {f"F2 {name}": f2 for name, f2 in forms.items()}
        walls = level.walls_m()
        for one, (name, values) in zip(axes[:3], maps.items(), strict=True):
            draw_walls(one, walls)
            x, y, _ = candidates.position_m.T
            dots = one.scatter(x, y, c=values, s=7, cmap="viridis" if name == "F1" else "viridis_r", linewidths=0)
            sheet.colorbar(dots, ax=one, shrink=0.7).ax.tick_params(labelsize=7)
            one.set_title(name, fontsize=9, loc="left")
        for one, (name, f2) in zip(axes[4:], forms.items(), strict=True):
            one.plot(sums.n_patches, f2, ".", markersize=2.5, color="#0072b2")
            label(one, f"rank correlation {rank[name]:.2f}", "F1, patches reached", f"F2 {name}, m2")
        axes[3].set_axis_off()
    bench.tell(2, 2)
    largest_first = np.cumsum(np.sort(judge.reference_m2)[::-1])
    share = float((np.searchsorted(largest_first, largest_first[-1] / 2) + 1) / largest_first.size)
    printed, kept = rank["as printed"], rank["without the second sum"]
    return Outcome(
        found=(
            f"at {len(candidates.position_m)} admissible positions 1.3 m above the basement's ground, the rank "
            f"correlation of F1 and F2 is {printed:.2f} for F2 as printed and {kept:.2f} without its second sum: "
            "taking the references of reached patches off turns a figure that punishes reach into one that rewards it. "
            f"But F2 sums squared distances, so it is ruled by long thin patches: the {100 * share:.2f} % of patches "
            f"with the largest references hold half of the {judge.reference_total_m2:.0f} m2 of all."
        ),
        agrees="yes" if printed < -0.8 and kept > printed + 0.5 else "partly" if printed < kept else "no",
        pictures=tuple(drawn),
        numbers={"n_positions": len(candidates.position_m), "rank_correlation": rank, "share_with_half": share},
    )


def rank_correlation(a: FloatArray, b: FloatArray) -> float:
    """Spearman's, of two samples (N,)."""
    from scipy.stats import spearmanr

    return float(spearmanr(a, b).statistic)
