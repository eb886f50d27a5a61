"""How much plans grow where parts of patches count; writes a table of docs/benchmarks/truth.md.

    python tests/benchmarks/bench_counting.py [--write docs/benchmarks/truth.md] [--only TEXT ...]

The scenes and settings of `bench_planning.py` but for its puzzles, each planned thrice: by beams, with whole patches;
by samples, with whole patches; by samples, with parts of patches. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from unittest import mock

from bench_planning import ready
from planning_cases import Case, cases

from planner_core.model import Proven, VisibilityMode
from planner_core.requirements.observe_candidates import CandidateObservations
from planner_core.select.large import select_by_size
from planner_core.select.proven import ProvenSelection
from tests.benchmarks.bench_real_buildings import put

HEAD = [
    "| scene | by beams, whole patches | by samples, whole patches | by samples, parts | grows by |",
    "|---|---|---|---|---|",
]


@contextmanager
def whole_patches() -> Iterator[None]:
    """Count patches whole where any sample is seen, as plans of survey scanners did."""
    with mock.patch.object(CandidateObservations, "countable_share", lambda *_: None):
        yield


def planned(case: Case) -> ProvenSelection | None:
    """Stations on the grid that are connected; None where the scene is not here."""
    on = ready(case)
    if on is None:
        return None
    problem = on.pool.problem
    method = case.settings.seeded_method
    assert isinstance(method, Proven)
    limit = replace(method, work_limit=case.work)
    return select_by_size(problem, limit, network=on.network)


def row(case: Case) -> str | None:
    sampled = replace(case, settings=replace(case.settings, scan_mode=VisibilityMode.PATCHES))
    beams = replace(case, settings=replace(case.settings, scan_mode=VisibilityMode.BEAMS))
    found = []
    for which, counted in ((beams, nullcontext()), (sampled, whole_patches()), (sampled, nullcontext())):
        with counted:
            plan = planned(which)
        if plan is None:
            return None
        found.append((len(plan.chosen), plan.lower_bound))
    told = " | ".join(f"{n}, at least {bound}" if bound < n else f"{n}, proven" for n, bound in found)
    grown = 100 * (found[2][0] / found[1][0] - 1)
    name = f"`{case.scene}`" + (f", {case.told}" if case.told else "")
    return f"| {name} | {told} | {grown:+.0f} % |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    rows = list(HEAD)
    for case in cases():
        if case.group == "puzzle" or (asked.only and not any(each in case.key for each in asked.only)):
            continue
        made = row(case)
        if made is None:
            continue
        rows.append(made)
        print(made, flush=True)
        if asked.write:
            put(asked.write, "counting", rows)


if __name__ == "__main__":
    main()
