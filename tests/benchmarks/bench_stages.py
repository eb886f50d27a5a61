"""Where the time of a plan goes, stage by stage, from the command to the finished folder.

    python -m tests.benchmarks.bench_stages [--buildings demo,duplex] [--write PAGE]

Each plan is `tlsplan plan` in a process of its own, which counts what passes between two events of progress to the
stage of the later one: by the clock, and processor time of the process and its children. Each building is planned
twice: with nothing kept, and again with one requirement changed (`--coverage`), by what the first plan has kept. Not a
test: nothing here fails.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import scenes_synthetic
from planner_core.cache import cache_folder
from tests.benchmarks.bench_real_buildings import put

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
BUILDINGS: dict[str, Path | str] = {
    "demo house": "house",
    "duplex": DATA / "ifc" / "duplex.ifc",
    "fzk-haus": DATA / "ifc" / "fzk-haus.ifc",
    "office": DATA / "corpus" / "ifc-tested-sample-revit2021-esp.ifc",
    "school": "school",
    "storey of the school": "school",
}
#: Further options of `plan`.
OPTIONS = {"storey of the school": ["--floor", "F1"]}
#: Stages as people think of them, by the first words of events.
GROUPS = {
    "read": ("load", "survey"),
    "free space, scope, candidates": ("free space", "scope", "candidates", "engine"),
    "look around": ("first plan", "scan", "refine"),
    "links": ("links", "set up"),
    "select": ("select", "prove", "bound"),
    "route, reasons": ("walking", "route", "reasons"),
    "independent check": ("judge",),
    "write": ("export",),
    "pictures": ("pictures",),
}
#: Of the second plan, in percent: the usual one is 95.
CHANGED_COVERAGE = "92"
_PICTURE = re.compile(r"\.png$")


def cpu_s() -> float:
    """Processor time of this process and of children that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def group_of(stage: str, note: str) -> str:
    if stage == "export" and _PICTURE.search(note):
        return "pictures"
    return next((name for name, stages in GROUPS.items() if stage in stages), "other")


def one(arguments: list[str]) -> None:
    """Run the command here, and print a JSON object: seconds of each group, by the clock and of processors."""
    begun = time.monotonic(), cpu_s()
    from tlsplan.group import cli
    from tlsplan.progress import ProgressReporter

    from planner_core.progress import ProgressEvent

    spent: dict[str, list[float]] = {}
    last = list(begun)

    def count(group: str) -> None:
        now = time.monotonic(), cpu_s()
        row = spent.setdefault(group, [0.0, 0.0])
        for k in range(2):
            row[k] += now[k] - last[k]
            last[k] = now[k]

    def show(self: ProgressReporter, event: ProgressEvent) -> None:
        count(group_of(event.stage, event.note))

    count("start")
    ProgressReporter.show = show  # type: ignore[method-assign]
    with contextlib.suppress(SystemExit):
        cli.main(arguments, standalone_mode=False)
    count("other")
    print(json.dumps(spent))


def own_cache(folder: Path) -> dict[str, str]:
    """The environment with a cache that has what the user's has, but for results."""
    users = cache_folder()
    if users is not None and users.is_dir():
        shutil.copytree(users, folder, ignore=shutil.ignore_patterns("results", "numba", "links"))
    numba = {} if users is None else {"NUMBA_CACHE_DIR": os.environ.get("NUMBA_CACHE_DIR", str(users / "numba"))}
    return {**os.environ, **numba, "TLSPLAN_CACHE": str(folder)}


def measured(name: str, effort: str) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Seconds of a first plan, and of one with another requirement."""
    at = BUILDINGS[name]
    with tempfile.TemporaryDirectory() as folder:
        environment = own_cache(Path(folder) / "cache")
        if isinstance(at, str):
            scenes_synthetic.write(scenes_synthetic.build(at), Path(folder) / "scene.ifc")
            at = Path(folder) / "scene.ifc"
        spent = []
        for number, changed in enumerate([[], ["--coverage", CHANGED_COVERAGE]]):
            arguments = ["plan", str(at), "--effort", effort, "--quiet", "-o", str(Path(folder) / f"plan{number}")]
            arguments += OPTIONS.get(name, [])
            ran = subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.bench_stages", "--one", *arguments, *changed],
                cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True, env=environment,
            )  # fmt: skip
            spent.append(dict(json.loads(ran.stdout.splitlines()[-1])))
    return spent[0], spent[1]


def table(rows: dict[str, dict[str, list[float]]]) -> list[str]:
    names = ["start", *GROUPS, "other"]
    lines = ["| stage | " + " | ".join(rows) + " |", "|---" * (len(rows) + 1) + "|"]
    for name in names:
        cells = [row.get(name, [0.0, 0.0]) for row in rows.values()]
        lines.append(f"| {name} | " + " | ".join(f"{cpu:.1f} ({clock:.1f})" for clock, cpu in cells) + " |")
    sums = [[sum(each[k] for each in row.values()) for k in range(2)] for row in rows.values()]
    lines.append("| **all** | " + " | ".join(f"**{cpu:.0f} ({clock:.0f})**" for clock, cpu in sums) + " |")
    return lines


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", default=",".join(BUILDINGS))
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    rows: dict[str, dict[str, list[float]]] = {}
    for name in asked.buildings.split(","):
        rows[name], rows[f"{name}, again"] = measured(name, asked.effort)
    lines = table(rows)
    print("\n".join(lines))
    if asked.write:
        put(asked.write, asked.effort, lines)


if __name__ == "__main__":
    main()
