"""The page of results, and the ranking: what solvers found on the instances of the library.

A plan counts where it meets everything, links too. It is `best` where it has as few stations as the best one known, and
a solver `proves` where its own bound meets its own plan. Time is CPU time, as a multiple of that of method `proven` on
the same instance, run beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

Listed = dict[str, dict[str, Any]]

OURS = "proven"
ORDER = ("greedy", "greedy-links", "paper", "highs", "cp-sat", "large", OURS)
_CLASSES = ("small", "medium", "large")


def ranking(listed: Listed, results: Listed, names: Sequence[str] = ()) -> tuple[tuple[str, ...], list[list[str]]]:
    """Header and rows: a row a solver, best first; of instances whose names begin with one of `names`."""
    which = [name for name in compared(listed, results) if not names or name.startswith(tuple(names))]
    header = ("solver", "plans", "best", "proves", "stations more", "CPU time, ours 1")
    rows = [_summary(solver, which, listed, results) for solver in ORDER]
    found = [row for row in rows if row is not None]
    return header, sorted(found, key=lambda row: (-int(row[3]), -int(row[2]), -int(row[1])))


def compared(listed: Listed, results: Listed) -> list[str]:
    """Instances on which every solver that has any result in their class was run: others would tilt a ranking."""
    solvers: dict[str, set[str]] = {}
    for name, row in listed.items():
        solvers.setdefault(row["class"], set()).update(results.get(name, {}))
    return [
        name
        for name, row in listed.items()
        if "stations" in row and solvers[row["class"]] <= results.get(name, {}).keys()
    ]


def _summary(solver: str, which: Sequence[str], listed: Listed, results: Listed) -> list[str] | None:
    """None where the solver was run on none of them."""
    ran = [name for name in which if solver in results[name]]
    if not ran:
        return None
    valid = [name for name in ran if results[name][solver]["valid"]]
    more = [results[name][solver]["stations"] - listed[name]["stations"] for name in valid]
    proves = sum(results[name][solver]["bound"] >= results[name][solver]["stations"] for name in valid)
    ratios = [ratio for name in ran if (ratio := _ratio(results[name], solver)) is not None]
    return [
        solver,
        str(len(valid)),
        str(sum(m == 0 for m in more)),
        str(proves),
        f"{sum(more) / len(more):.2f}" if more else "-",
        _times(median(ratios)) if ratios else "-",
    ]


def _ratio(of_one: dict[str, Any], solver: str) -> float | None:
    if OURS not in of_one:
        return None
    ratio: float = max(of_one[solver]["cpu_s"], 0.001) / max(of_one[OURS]["cpu_s"], 0.001)
    return ratio


def _times(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"


def page(listed: Listed, results: Listed) -> str:
    """All tables as Markdown."""
    n = len(listed)
    solved = [row for row in listed.values() if "bound" in row]
    proven = sum(row["bound"] == row["stations"] for row in solved)
    near = sum(row["bound"] >= row["stations"] - 1 for row in solved)
    lines = [
        "# TLSPLIB: results",
        "Written by `tlsplan tlsplib rank --write docs/tlsplib/results.md` from `results.json` and `library.json`. "
        "What the instances are, and what was run: [TLSPLIB](index.md).",
        "",
        f"{n} instances. Certificates prove {proven} plans to be the smallest, and {near} to be within one station.",
        "",
        "Plans: of so many instances the plan meets everything. Best: it has as few stations as the best one known. "
        "Proves: the solver's own bound meets its plan. Stations more: than the best one known, in the mean over its "
        "plans. CPU time: median of the ratio to method `proven` on the same instance.",
        "",
        f"The tables by class are of the {len(compared(listed, results))} instances on which every solver was run.",
    ]
    for title, which in _groups({name: listed[name] for name in compared(listed, results)}):
        header, rows = ranking({name: listed[name] for name in which}, results)
        lines += ["", f"## {title}: {len(which)}", "", _row(header), _row("---" for _ in header), *map(_row, rows)]
    header = ("instance", "candidates", "rows", "links", "best", "bound", *ORDER, "HiGHS : ours", "CP-SAT : ours")
    lines += [
        "",
        "## Every instance",
        "Stations; `*`: proven by the solver itself, `x`: the plan misses something, `-`: none. The last two columns "
        "are ratios of CPU time. Best and bound are those of the certificate.",
        "",
        _row(header),
        _row("---" for _ in header),
    ]
    for name, row in listed.items():
        mine = results.get(name, {})
        ratios = (_ratio(mine, solver) if solver in mine else None for solver in ("highs", "cp-sat"))
        sizes = [row["candidates"], row["rows"], row["links"], row.get("stations", "-"), row.get("bound", "-")]
        cells = [_cell(mine.get(solver)) for solver in ORDER]
        lines.append(_row([name, *map(str, sizes), *cells, *("-" if r is None else _times(r) for r in ratios)]))
    return "\n".join(lines) + "\n"


def _groups(listed: Listed) -> list[tuple[str, list[str]]]:
    """Instances by class and by whether links are required, those that there are."""
    found = []
    for size in _CLASSES:
        for linked in (False, True):
            which = [name for name, row in listed.items() if row["class"] == size and bool(row["links"]) == linked]
            if which:
                found.append((f"{size.capitalize()}, {'links required' if linked else 'no links'}", which))
    return found


def _cell(found: dict[str, Any] | None) -> str:
    if found is None or not found["stations"]:
        return "-"
    mark = "x" if not found["valid"] else "*" if found["bound"] >= found["stations"] else ""
    return f"{found['stations']}{mark}"


def _row(cells: Any) -> str:
    return f"| {' | '.join(cells)} |"
