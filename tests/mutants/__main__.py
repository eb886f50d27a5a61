"""How many random faults in product code the quick Python tests notice.

    python -m tests.mutants record FOLDER    runs all quick tests once: which of them run which broken lines
    python -m tests.mutants count FOLDER     breaks one line after the other, and runs those tests, cheapest first

Both work on a copy of the sources below FOLDER; `count` goes on where it was interrupted. A line of a function that is
compiled can't be watched: the tests of its folder stand in for those that run it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from shutil import rmtree

from tests.mutants.breaks import ROOT, Break, random_breaks

#: Installed under these names; the copy has them as links.
_PACKAGES = {
    "tlsplan": "cli",
    "paper_figures": "docs/reproduction/paper_figures",
    "tlsplib": "docs/tlsplib/tlsplib",
    "planner_core/kernels": "kernels",
    ".venv": ".venv",
    "viewer_web/dist": "viewer_web/dist",
}
_LIMIT_S = 1500


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step", choices=["record", "count"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--breaks", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    breaks = random_breaks(asked.breaks, asked.seed)
    folder = asked.folder.resolve()
    {"record": record, "count": count}[asked.step](breaks, folder)


def record(breaks: list[Break], folder: Path) -> None:
    """Run the quick tests with every line watched that will be broken."""
    rows = folder / "rows"
    rows.mkdir(parents=True)
    tree = _copy(folder / "watched")
    for path in {each.path for each in breaks}:
        lines = (tree / path).read_text(encoding="utf-8").splitlines(keepends=True)
        here = [(each, number) for number, each in enumerate(breaks) if each.path == path and not each.is_compiled]
        for each, number in sorted(here, key=lambda pair: -pair[0].statement_line):
            at = _start_of_chain(lines, each.statement_line - 1)
            indent = lines[at][: len(lines[at]) - len(lines[at].lstrip())]
            lines.insert(at, f"{indent}__import__('tests.mutants.plugin').mutants.plugin.hit({number})\n")
        (tree / path).write_text("".join(lines), encoding="utf-8")
    ended = _pytest(
        tree, ["-n", "2", "--dist", "loadgroup", "-m", "not slow", "tests"], rows, "-p", "tests.mutants.plugin"
    )
    print(f"pytest ended with {ended}; {len(list(rows.iterdir()))} files of rows in {rows}")


def _start_of_chain(lines: list[str], at: int) -> int:
    """Where a statement may stand before the one of this line: `elif` belongs to the `if` above."""
    indent = len(lines[at]) - len(lines[at].lstrip())
    while lines[at].lstrip().startswith("elif "):
        at -= 1
        while len(lines[at]) - len(lines[at].lstrip()) != indent or not lines[at].lstrip().startswith(("if ", "elif ")):
            at -= 1
    return at


def count(breaks: list[Break], folder: Path) -> None:
    """Break line after line; print each outcome, and at the end how many were noticed."""
    tests_of = _tests_of(breaks, folder / "rows")
    outcomes = folder / "outcomes.json"
    found: dict[str, str] = json.loads(outcomes.read_text()) if outcomes.is_file() else {}
    tree = _copy(folder / "broken")
    for number, each in enumerate(breaks):
        source = (ROOT / each.path).read_bytes()
        name = f"{number} {each.described(source)}"
        if name not in found:
            (tree / each.path).write_bytes(each.applied(source))
            found[name] = _outcome(tree, tests_of[number])
            (tree / each.path).write_bytes(source)
            outcomes.write_text(json.dumps(found, indent=1) + "\n")
        print(f"{found[name]:12} {' '.join(name.split())}", flush=True)
    noticed = sum(outcome == "noticed" for outcome in found.values())
    print(f"{noticed} of {len(breaks)} noticed")


def _outcome(tree: Path, tests: list[str]) -> str:
    if not tests:
        return "never run"
    (tree / "tests.txt").write_text("\n".join(tests) + "\n")
    ended = _pytest(tree, ["-x", "-p", "no:cacheprovider", "@tests.txt"], None)
    assert b"ERROR: not found:" not in (tree / "pytest.log").read_bytes(), "a recorded test is gone: record again"
    # 1: a test failed; 3 and 4: the product could not even be imported.
    return {0: "unnoticed", 1: "noticed", 2: "noticed", 3: "noticed", 4: "noticed", None: "noticed"}[ended]


def _tests_of(breaks: list[Break], rows: Path) -> list[list[str]]:
    """For each break the tests that run its line, cheapest first."""
    direct, by_fixture = defaultdict(set), defaultdict(set)
    cost_s: dict[str, float] = {}
    users: dict[str, set[str]] = defaultdict(set)
    for file in sorted(rows.iterdir()):
        for row in map(json.loads, file.read_text(encoding="utf-8").splitlines()):
            test = _named(row["test"])
            if "break" not in row:
                cost_s[test] = row["processor_s"]
                for fixture in row["fixtures"]:
                    users[fixture].add(test)
            elif row["fixture"]:
                by_fixture[row["break"]].add(row["fixture"])
            else:
                direct[row["break"]].add(test)
    found = []
    for number, each in enumerate(breaks):
        tests = direct[number].union(*(users[fixture] for fixture in by_fixture[number]))
        if each.is_compiled:
            mirrored = f"tests/{Path(each.path).parent.relative_to('planner_core').as_posix()}/"
            tests = {test for test in cost_s if test.startswith(mirrored)}
        found.append(sorted(tests & cost_s.keys(), key=lambda test: (cost_s[test], test)))
    return found


def _named(test: str) -> str:
    """The id by which pytest finds a test: without xdist's group, and all parameters where one holds a `::`."""
    name, bracket, rest = test.partition("[")
    if not bracket:
        return name.partition("@")[0]
    parameters = rest[: rest.rindex("]")]
    return name if "::" in parameters else f"{name}[{parameters}]"


def _copy(tree: Path) -> Path:
    """Copy what git has of this checkout, with the packages under the names that they are installed by."""
    rmtree(tree, ignore_errors=True)
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, files.split("\0")):
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / name).write_bytes((ROOT / name).read_bytes())
    for name, target in _PACKAGES.items():
        (tree / name).symlink_to((ROOT if target in (".venv", "viewer_web/dist") else tree) / target)
    shared = ROOT.parent / "shared"
    if shared.is_dir() and not (tree.parent / "shared").exists():
        (tree.parent / "shared").symlink_to(shared)
    return tree


def _pytest(tree: Path, arguments: list[str], rows: Path | None, *options: str) -> int | None:
    """Run pytest in the copy; its exit status, None where it did not end."""
    env = {**os.environ, "PYTHONPATH": str(tree)} | ({} if rows is None else {"TLSPLAN_MUTANTS": str(rows)})
    command = [sys.executable, "-m", "pytest", "-q", *options, *arguments]
    with (tree / "pytest.log").open("wb") as log:
        try:
            return subprocess.run(
                command, cwd=tree, env=env, stdout=log, stderr=log, timeout=_LIMIT_S, check=False
            ).returncode
        except subprocess.TimeoutExpired:
            return None


if __name__ == "__main__":
    main()
