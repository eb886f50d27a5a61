"""Where the time of a plan goes, stage by stage, from the command to the finished folder.

    python -m tests.benchmarks.bench_stages [--buildings demo,duplex] [--crew [--beside CHECKOUT]] [--write PAGE]

Each plan is `tlsplan plan` in a process of its own, which counts what passes between two events of progress to the
stage of the later one: by the clock, and processor time of the process and its children. Each building is planned
twice: with nothing kept, and again with one requirement changed (`--coverage`), by what the first plan has kept.
`--crew` instead: how long somebody waits for what, on duplex, beside what is aimed at; with `--beside` another checkout
runs each command right before, with its own `.venv`. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import json
import os
import re
import resource
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
    "furnished storey": "office",
    "school": "school",
    "storey of the school": "school",
}
#: Further options of `plan`.
OPTIONS = {"furnished storey": ["--floor", "F0"], "storey of the school": ["--floor", "F1"]}
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
    """Run the command here, and print a `Run` as JSON."""
    begun = time.monotonic(), cpu_s()
    from tlsplan.group import cli
    from tlsplan.progress import ProgressReporter

    from planner_core.progress import ProgressEvent

    run = Run()
    last = list(begun)

    def count(group: str) -> None:
        now = time.monotonic(), cpu_s()
        row = run.spent.setdefault(group, [0.0, 0.0])
        for k in range(2):
            row[k] += now[k] - last[k]
            last[k] = now[k]

    def show(self: ProgressReporter, event: ProgressEvent) -> None:
        count(group_of(event.stage, event.note))
        if event.best is not None and (not run.curve or run.curve[-1][2] != event.best.n_stations):
            run.curve.append([last[0] - begun[0], last[1] - begun[1], event.best.n_stations])

    count("start")
    ProgressReporter.show = show  # type: ignore[method-assign]
    with contextlib.suppress(SystemExit):
        cli.main(arguments, standalone_mode=False)
    count("other")
    run.peak_bytes = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps(dataclasses.asdict(run)))


@dataclasses.dataclass
class Run:
    """One command. spent : seconds of each group, by the clock and of processors. peak_bytes : without children.

    curve : seconds from the command on, by the clock and of processors, and the stations of the best plan from then on.
    """

    spent: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    curve: list[list[float]] = dataclasses.field(default_factory=list)
    peak_bytes: int = 0

    @property
    def all_s(self) -> list[float]:
        """Seconds of the whole command, by the clock and of processors."""
        return [sum(each[k] for each in self.spent.values()) for k in range(2)]

    def within_one_s(self, n_stations: int) -> list[float]:
        """From when on the best plan had at most a station more than `n_stations`."""
        return next(point[:2] for point in self.curve if point[2] <= n_stations + 1)


def own_cache(folder: Path) -> dict[str, str]:
    """The environment with a cache that has what the user's has, but for results."""
    users = cache_folder()
    if users is not None and users.is_dir():
        shutil.copytree(users, folder, ignore=shutil.ignore_patterns("results", "numba", "links"))
    numba = {} if users is None else {"NUMBA_CACHE_DIR": os.environ.get("NUMBA_CACHE_DIR", str(users / "numba"))}
    return {**os.environ, **numba, "TLSPLAN_CACHE": str(folder)}


def run_plan(arguments: list[str], environment: dict[str, str], checkout: Path = ROOT) -> Run:
    """Run `tlsplan plan` in a process of its own."""
    python = sys.executable if checkout == ROOT else str(checkout / ".venv" / "bin" / "python")
    ran = subprocess.run(
        [python, "-m", "tests.benchmarks.bench_stages", "--one", "plan", *arguments, "--quiet"],
        cwd=checkout, stdout=subprocess.PIPE, text=True, check=True, env=environment,
    )  # fmt: skip
    return Run(**json.loads(ran.stdout.splitlines()[-1]))


def measured(name: str, effort: str) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Seconds of a first plan, and of one with another requirement."""
    at = BUILDINGS[name]
    with tempfile.TemporaryDirectory() as folder:
        environment = own_cache(Path(folder) / "cache")
        if isinstance(at, str):
            scenes_synthetic.write(scenes_synthetic.build(at), Path(folder) / "scene.ifc")
            at = Path(folder) / "scene.ifc"
        common = ["--effort", effort, *OPTIONS.get(name, [])]
        first, again = (
            run_plan([str(at), *common, "-o", f"{folder}/plan{number}", *changed], environment)
            for number, changed in enumerate([[], ["--coverage", CHANGED_COVERAGE]])
        )
    return first.spent, again.spent


@dataclasses.dataclass
class Waits:
    """What a crew waits for on duplex. runs : quick, again with another requirement, by default."""

    runs: tuple[Run, Run, Run]
    n_quick: int
    usual: dict[str, int]
    n_bytes: int

    @property
    def rows(self) -> list[tuple[str, list[float], float]]:
        """What, seconds by the clock and of processors, and seconds aimed at."""
        quick, again, usual = self.runs
        n_stations = self.usual["stations"]
        return [
            (f"quick plan of {self.n_quick} stations, from the command to the folder", quick.all_s, 10.0),
            ("first plan on the screen", quick.curve[0][:2], 3.0),
            ("again with `--coverage 92`, quick", again.all_s, 3.0),
            (f"default effort: a plan within one of its {n_stations} stations", usual.within_one_s(n_stations), 60.0),
            (f"default effort, to the end, with the bound {self.usual['lower_bound']}", usual.all_s, 60.0),
        ]


def waits(checkouts: list[Path]) -> list[Waits]:
    """Run each command by all checkouts in turn."""
    scene, changed = str(BUILDINGS["duplex"]), ["--coverage", CHANGED_COVERAGE]
    asked = (["--effort", "quick"], ["--effort", "quick", *changed], [])
    runs: list[list[Run]] = [[] for _ in checkouts]
    with tempfile.TemporaryDirectory() as name:
        folders = [Path(name) / str(number) for number in range(len(checkouts))]
        environments = [own_cache(folder / "cache") for folder in folders]
        for number, options in enumerate(asked):
            for checkout, folder, environment, done in zip(checkouts, folders, environments, runs, strict=True):
                if not options:  # by default nothing is kept either
                    shutil.rmtree(folder / "cache" / "results")
                done.append(run_plan([scene, *options, "-o", f"{folder}/{number}"], environment, checkout))
        found = []
        for folder, (quick, again, usual) in zip(folders, runs, strict=True):
            files = [file for file in (folder / "0").rglob("*") if file.is_file()]
            found.append(
                Waits(
                    (quick, again, usual),
                    len(json.loads((folder / "0" / "plan.json").read_text())["stations"]),
                    json.loads((folder / "2" / "plan.json").read_text())["optimality"],
                    sum(file.stat().st_size for file in files),
                )
            )
    return found


def crew(beside: Path | None) -> list[str]:
    """How long somebody waits for what, on duplex, how far that is from what is aimed at, and what it was before."""
    *before, now = waits([ROOT] if beside is None else [beside.resolve(), ROOT])
    old = "| before " if before else ""
    lines = [
        f"| duplex, 300 m² | processor time {old}| by the clock {old}| aim | processor time missed by |",
        "|---|---|---|---|---|" + ("---|---|" if before else ""),
    ]
    for number, (what, (clock, cpu), aim) in enumerate(now.rows):
        (old_clock, old_cpu), *_ = [each.rows[number][1] for each in before] or [(0.0, 0.0)]
        missed = f"{cpu - aim:.0f} s" if cpu > aim else "met"
        lines.append(
            f"| {what} | {cpu:.0f} s {f'| {old_cpu:.0f} s ' if before else ''}| {clock:.0f} s "
            f"{f'| {old_clock:.0f} s ' if before else ''}| {aim:.0f} s | {missed} |"
        )
    gap = "| | " if before else "| "
    mb, old_mb = now.n_bytes / 1e6, "".join(f"| {each.n_bytes / 1e6:.1f} MB " for each in before)
    lines.append(
        f"| folder of {now.n_quick} stations | {mb:.1f} MB {old_mb}{gap}| 15 MB | "
        f"{f'{mb - 15:.0f} MB' if mb > 15 else 'met'} |"
    )
    gb, old_gb = now.runs[0].peak_bytes / 1e9, "".join(f"| {each.runs[0].peak_bytes / 1e9:.1f} GB " for each in before)
    lines.append(f"| memory of the quick plan, at most | {gb:.1f} GB {old_gb}{gap}| | |")
    return lines


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
    parser.add_argument("--crew", action="store_true")
    parser.add_argument("--beside", type=Path, help="another checkout, with what `make setup` makes")
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    if asked.crew:
        lines = crew(asked.beside)
        print("\n".join(lines))
        if asked.write:
            put(asked.write, "crew", lines)
        return
    rows: dict[str, dict[str, list[float]]] = {}
    for name in asked.buildings.split(","):
        rows[name], rows[f"{name}, again"] = measured(name, asked.effort)
    lines = table(rows)
    print("\n".join(lines))
    if asked.write:
        put(asked.write, asked.effort, lines)


if __name__ == "__main__":
    main()
