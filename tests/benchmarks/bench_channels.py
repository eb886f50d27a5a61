"""What the HDL-64E's channels change: evenly spaced as in the method paper, and the nominal ones of `hdl-64e:channels`.

    python tests/benchmarks/bench_channels.py [--write docs/method/paper.md] [--only TEXT ...]

Scenes and settings of `bench_planning.py`, some small ones: greedy selection and F1, F2 of all candidates, with either
table of channels. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from bench_planning import Ready, ready
from planning_cases import Case, cases

from planner_core.model import FloatArray
from planner_core.paper.point_distribution import PointDistribution
from planner_core.scanner.load_scanner import load_scanner
from planner_core.select.greedy import select_greedy
from tests.benchmarks.bench_real_buildings import put

EVEN, NOMINAL = "hdl-64e", "hdl-64e:channels"
SCENES = ("scene: corridor-comb", "scene: hole-walls", "target: basement, grid 0.5 m")
HEAD = [
    "| scene | candidates | stations, greedy | scannable area, m2 | the plan for even ones covers of it | F1, median | "
    "F2 below none, median, m2 | rank correlation of F2 |",
    "|---|---|---|---|---|---|---|---|",
]


@dataclass(frozen=True)
class Judged:
    """A scene by one table of channels.

    chosen : greedy's stations. scannable_m2 : what all candidates see together. f1 : (N,) patches reached by each. less
    : (N,) how much lower their F2 is than that of a station that sees nothing, m2.
    """

    on: Ready
    chosen: tuple[int, ...]
    scannable_m2: float
    f1: FloatArray
    less: FloatArray

    def covers(self, chosen: tuple[int, ...]) -> float:
        """Share of the scannable area that some candidates see."""
        met, area_m2 = self.on.pool.rows.met, self.on.pool.demand.area_m2
        seen = np.zeros(area_m2.size, dtype=bool)
        for candidate in chosen:
            seen[met.row(candidate)] = True
        return float(area_m2[seen].sum() / self.scannable_m2)


def judged(case: Case, scanner: str) -> Judged:
    """Look around from all candidates, select, and judge them by F1 and F2."""
    on = ready(replace(case, settings=replace(case.settings, scanner=load_scanner(scanner), scan_mode="beams")))
    assert on is not None, "these scenes are made here"
    distribution = PointDistribution(on.survey.scene, on.survey.patches, on.engine)
    worth = distribution.of(on.survey.template, on.pool.candidates.position_m)
    area_m2 = on.pool.demand.area_m2
    seen = np.zeros(area_m2.size, dtype=bool)
    seen[on.pool.rows.met.patch] = True
    return Judged(
        on=on,
        chosen=tuple(int(candidate) for candidate in select_greedy(on.whole).chosen),
        scannable_m2=float(area_m2[seen].sum()),
        f1=worth.n_patches.astype(np.float64),
        less=distribution.reference_total_m2 - worth.f2_m2,
    )


def row(case: Case) -> str:
    """The table's line of a scene: even channels first, nominal ones second."""
    from scipy.stats import spearmanr

    even, nominal = judged(case, EVEN), judged(case, NOMINAL)
    same = np.array_equal(even.on.pool.candidates.position_m, nominal.on.pool.candidates.position_m)
    assert same, "where a station can stand does not depend on channels"
    cells = (
        f"`{case.scene}`",
        even.f1.size,
        f"{len(even.chosen)}, {len(nominal.chosen)}",
        f"{even.scannable_m2:.0f}, {nominal.scannable_m2:.0f}",
        f"{100 * even.covers(even.chosen):.2f} %, {100 * nominal.covers(even.chosen):.2f} %",
        f"{np.median(even.f1):.0f}, {np.median(nominal.f1):.0f}",
        f"{np.median(even.less):.1f}, {np.median(nominal.less):.1f}",
        f"{spearmanr(even.less, nominal.less).statistic:.3f}",
    )
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    rows = list(HEAD)
    for case in cases():
        if case.key not in SCENES or (asked.only and not any(each in case.key for each in asked.only)):
            continue
        rows.append(row(case))
        print(rows[-1], flush=True)
        if asked.write:
            put(asked.write, "channels", rows)


if __name__ == "__main__":
    main()
