"""A plan's figures beside its independent check, on rooms, synthetic and real buildings; writes
docs/benchmarks/truth.md.

    python tests/benchmarks/bench_truth.py [--write docs/benchmarks/truth.md] [--points N] [SCENE ...]

Real models lie in ../shared/data. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import (
    CheckedFigure,
    IndependentCheck,
    PartRequirement,
    PlanSettings,
    PointLimits,
    Proven,
    Requirements,
    Scene,
    VisibilityMode,
)
from planner_core.planning.independent_check import check_independently
from planner_core.planning.plan import plan_survey
from planner_core.requirements.deliverables import DEFAULT_DELIVERABLE, deliverable_named
from planner_core.requirements.goals import NO_COVER
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from tests.benchmarks.bench_real_buildings import put

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
SCENES = {
    **dict.fromkeys(("box", "two-rooms", "corridor-comb", "l-room", "doors-open", "column-hall", "house")),
    "duplex": DATA / "ifc" / "duplex.ifc",
    "fzk-haus": DATA / "ifc" / "fzk-haus.ifc",
    "sample house": DATA / "corpus" / "ifc-samplehouse-revit2015-ifc4.ifc",
    "renga house": DATA / "corpus" / "ifc-house-renga.ifc",
    "openhouse": DATA / "corpus" / "ifc-openhouse-ifc4.ifc",
}


_SURVEY = deliverable_named(DEFAULT_DELIVERABLE)
#: Scanners, and what is asked of points: a robot's lidar has none of the spacing that a survey asks for.
ASKED = {
    "rtc360": PointLimits(
        spacing_m=_SURVEY.spacing_m,
        range_m=_SURVEY.range_m,
        incidence_rad=np.deg2rad(_SURVEY.incidence_deg or 90.0),
    ),
    "hdl-64e": PointLimits(),
}
#: Scanners and areas of patches, m2, that all scenes are planned with.
CASES = (("rtc360", 0.04), ("hdl-64e", 0.04), ("hdl-64e", 0.01))


def scene_of(name: str) -> Scene:
    path = SCENES[name]
    return scenes_synthetic.build(name).scene if path is None else load_scene(path)


def plan_and_check(
    name: str, n_points: int, scanner: str = "rtc360", patch_area_m2: float = 0.04
) -> tuple[int, IndependentCheck]:
    """Stations of a quick plan of the usual settings, and its independent check."""
    settings = PlanSettings(
        scanner=load_scanner(scanner),
        requirements=Requirements(
            limits=ASKED[scanner], parts=tuple(PartRequirement(each, 0.0, classes=(each,)) for each in NO_COVER)
        ),
        scan_mode=VisibilityMode.PATCHES,
        method=Proven(work_limit=0.2),
        refine=False,
        max_patch_area_m2=patch_area_m2,
    )
    survey = make_survey(scene_of(name), settings)
    engine = open_engine(survey.scene, survey.patches)
    plan = plan_survey(survey, settings, engine)
    return len(plan.stations), check_independently(plan, engine, n_points=n_points)


def row(name: str, scanner: str, patch_area_m2: float, n_stations: int, found: IndependentCheck) -> str:
    def areas(figure: CheckedFigure) -> str:
        off = 100 * (figure.planned / figure.judged - 1)
        return f"{figure.planned:.1f} | {figure.judged:.1f} ± {figure.error:.1f} | {off:+.2f}"

    ours, judged = 100 * found.share.planned, 100 * found.share.judged
    gaps = [100 * abs(link.overlap.planned - link.overlap.judged) for link in found.links] or [0.0]
    return (
        f"| {name} | {scanner} | {patch_area_m2:g} | {n_stations} | "
        f"{areas(found.covered_m2)} | {areas(found.achievable_m2)} | "
        f"{ours:.2f} | {judged:.2f} ± {100 * found.share.error:.2f} | {ours - judged:+.2f} | "
        f"{np.median(gaps):.1f}, {max(gaps):.1f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--points", type=int, default=200_000)
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    rows = [
        "| scene | scanner | patches m² | stations | covered m² | judge | % | scannable m² | judge | % | share % | "
        "judge | points | overlap off by, points: median, most |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for scanner, patch_area_m2 in CASES:
        for name in asked.scenes:
            found = plan_and_check(name, asked.points, scanner, patch_area_m2)
            rows.append(row(name, scanner, patch_area_m2, *found))
            print(rows[-1], flush=True)
    if asked.write:
        put(asked.write, "truth", rows)


if __name__ == "__main__":
    main()
