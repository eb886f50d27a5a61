"""The page docs/benchmarks/planning.md, from the record that `bench_planning.py` keeps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from planning_cases import LARGE_WORK

Row = dict[str, Any]

#: What is asked for of large buildings.
LARGE_GAP, LARGE_CPU_S, LARGE_MEMORY_GIB = 0.1, 900.0, 4.0

_MISSED = " \N{DAGGER}"

HEAD = """\
# Planning, every scene
Written by `make bench-planning` (`tests/benchmarks/bench_planning.py`); the figures as they came are in
`planning.json` beside this page. {machine}, {engine}.

In each row all methods choose from the same candidates, have the same areas to cover and are judged by the same links;
`tlsplan plan` plans so. But for the puzzles: HDL-64E, which reaches 5 m; 95 % of the scannable area of each floor and
in all; links of 30 % overlap and the default strength; candidates every 0.5 m at heights from 0.5 to 1.7 m, with
doorways, middles of rooms and landings, unless told otherwise; glass stops beams, doors are open.

- *greedy*: `select_greedy`, which covers and asks for no network.
- *greedy + links*: greedy on the candidates that joined chooses from, joined by the real links
  (`select.network.connect`), then `drop_redundant`: repair afterwards.
- *greedy + circles*: greedy, then the method paper's overlap repair by circles.
- *paper*: `--method paper` without its spatial search, which would look for other candidates: genetic selection, then
  repair by circles.
- *paper + search*: the same after annealing (`--search sa`) from every candidate; it chooses from these and what
  annealing found, so that no bound here holds for it. Empty where it was not run: it takes some sixty scans a
  candidate.
- *cover*: ours without a network. *joined*: ours with the network inside the search: what `tlsplan plan --no-refine`
  does. *refined*: joined, then places off the grid: what `tlsplan plan` does.

Candidates that no plan needs and that would be a network of their own are left aside, by joined, refined and greedy +
links: `planner_core.planning.pool` says which. The other methods, which ask for no network, choose from all.

A number in brackets: registration networks that the set leaves, where that is more than these candidates allow.
\N{DAGGER}: the set misses a coverage target. Every set is looked at by `select.check`, which no method uses to search.
CPU times are of the process, of all its threads, on a machine that others used, too.
"""


def page(known: dict[str, Any], left: Sequence[str], *, state: str) -> str:
    """Return the page. known : the record. left : names of rows that it lacks. state : what the planner is now."""
    rows: dict[str, Row] = known["rows"]
    puzzles = [row for row in rows.values() if row["group"] == "puzzle"]
    others = [row for row in rows.values() if row["group"] != "puzzle"]
    constraints = [row for row in others if row["group"] == "target"]
    engines = sorted({row["engine"] for row in rows.values()})
    parts = [
        HEAD.format(machine=known["machine"], engine="; ".join(engines)),
        *_summary(others),
        *_older(rows, state),
        *_broken(rows),
        "## Stations",
        *_stations(others),
        "## Marks of ten minutes",
        *_marks(constraints),
        "## Marks of large buildings",
        *_large_marks([row for row in others if row["scene"] in LARGE_WORK]),
        "## Puzzles",
        *_puzzles(puzzles),
        "## Time",
        *_times([*others, *puzzles]),
        *_left(left),
    ]
    return "\n".join(parts).rstrip("\n") + "\n"


# ------------------------------------------------------------------------------------------------ parts of the page
def _summary(rows: Sequence[Row]) -> list[str]:
    lines = ["## In short"]
    for name, rival in (("greedy + links", "greedy_links"), ("greedy + circles", "greedy_circles"), ("paper", "paper")):
        same = [row for row in rows if _method(row, rival)["met"] and _method(row, rival)["joined"]]
        if not same:
            lines.append(f"- Against {name}: in none of {len(rows)} rows does its set meet the same.")
            continue
        theirs = sum(_n(row, rival) for row in same)
        on_grid, off_grid = (sum(_n(row, ours) for row in same) for ours in ("joined", "refined"))
        never = "never more" if all(_n(row, "joined") <= _n(row, rival) for row in same) else "NOT never more"
        fewer = sum(_n(row, "joined") < _n(row, rival) for row in same)
        lines.append(
            f"- Against {name}, in the {len(same)} of {len(rows)} rows in which its set meets the targets and is as "
            f"joined as can be: {theirs} stations, ours {on_grid} joined ({_percent(1 - on_grid / theirs)} "
            f"fewer) and {off_grid} refined; {never}, fewer in {fewer} of them."
        )
    proven = sum(_gap(_method(row, "joined")) <= 0 for row in rows)
    near = sum(_is_near(_method(row, "joined")) for row in rows)
    lines.append(
        f"- Joined is proven fewest on its candidates in {proven} of {len(rows)} rows; in {near} the gap is at most "
        "2 % or one station."
    )
    higher = [row for row in rows if _method(row, "cover")["bound"] > _method(row, "joined")["bound"]]
    closer = sum(_n(row, "joined") - _method(row, "cover")["bound"] <= 1 for row in higher)
    if higher:
        lines.append(
            f"- In {len(higher)} rows the bound of cover is above that of joined, after no more work; it holds for "
            f"joined, too, and with it the gap is at most one station in {closer} of them."
        )
    return [*lines, ""]


def _older(rows: dict[str, Row], state: str) -> list[str]:
    """Which rows an earlier planner made."""
    old = [key for key, row in rows.items() if row.get("state") != state]
    if not old:
        return []
    new = [key for key in rows if key not in old]
    made = ", ".join(old) if len(old) < len(new) else f"all but {', '.join(new)}" if new else "all of them"
    return [
        "## State of the rows",
        f"The planner is now of this state: {state}. {len(old)} of {len(rows)} rows are of an earlier one ({made}): "
        "their bounds are those of branching on single candidates of the whole alone.",
        "",
    ]


def _broken(rows: dict[str, Row]) -> list[str]:
    said = [f"- {key}: {each}" for key, row in rows.items() for each in row["broken"]]
    return ["## Where it falls short", *said, ""] if said else []


def _stations(rows: Sequence[Row]) -> list[str]:
    names = ("greedy", "greedy_links", "greedy_circles", "paper", "paper_search", "cover", "joined", "refined")
    saved = (("greedy_links", "links"), ("paper", "paper"))
    return [
        "Bounds hold for any set on these candidates: that of cover for sets that only cover, that of joined for those",
        "that are connected. Saved: refined against greedy + links, and against paper where its set meets the same;",
        "stopped: why joined ended, after at most so much work as the last column says, about CPU seconds.",
        "",
        *_table(
            ("scene", "candidates", "greedy", "greedy + links", "greedy + circles", "paper", "paper + search", "cover",
             "its bound", "joined", "its bound", "gap", "stopped", "refined", *(f"saved to {to}" for _, to in saved),
             "work"),
            (
                (
                    _name(row), _count(row["candidates"]), *(_set(row, name) for name in names[:6]),
                    _method(row, "cover")["bound"], _set(row, "joined"), _method(row, "joined")["bound"],
                    _percent(_gap(_method(row, "joined"))), _method(row, "joined")["why_stopped"],
                    _set(row, "refined"), *(_saved(row, rival) for rival, _ in saved), f"{row['work_limit']:g}",
                )
                for row in rows
            ),
        ),
    ]  # fmt: skip


def _marks(rows: Sequence[Row]) -> list[str]:
    def line(row: Row) -> tuple[object, ...]:
        ours = _method(row, "joined")
        whole_s = row["pool_wall_s"] + _method(row, "refined")["wall_s"]
        cpu_s = row["pool_cpu_s"] + _method(row, "refined")["cpu_s"]
        spare = ours["stations"] - ours["bound"]
        good = _is_near(ours) and cpu_s <= 600
        verdict = "met" if good else f"missed: gap {spare} stations, {cpu_s / 60:.1f} min of CPU"
        state = "proven" if spare <= 0 else f"{_percent(_gap(ours))}, {spare} of {ours['stations']} stations"
        return (
            _name(row), ours["stations"], ours["bound"], state, f"{ours['work']:.0f}", f"{ours['cpu_s'] / 60:.1f} min",
            f"{cpu_s / 60:.1f} min", f"{whole_s / 60:.1f} min", verdict,
        )  # fmt: skip

    return [
        "Proven fewest, or a gap of at most 2 % or one station, within 10 minutes on 2 cores: all of planning, as one",
        "network. Judged by the CPU time of all threads together, which a free machine needs by the clock at most; the",
        "clock beside it ran while others used the machine.",
        "",
        *_table(
            ("scene", "joined", "bound", "gap", "work", "CPU of the search", "CPU of all", "all, by the clock", "mark"),
            map(line, rows),
        ),
    ]  # fmt: skip


def _large_marks(rows: Sequence[Row]) -> list[str]:
    def line(row: Row) -> tuple[object, ...]:
        ours, rival = _method(row, "joined"), _method(row, "greedy_links")
        cpu_s, of_plan = row["pool_cpu_s"] + ours["cpu_s"], "plan_memory_gib" in row
        memory_gib = row["plan_memory_gib" if of_plan else "memory_gib"]
        missed = [f"gap {_percent(_gap(ours))}"] if _gap(ours) > LARGE_GAP else []
        missed += [f"{cpu_s / 60:.1f} min of CPU"] if cpu_s > LARGE_CPU_S else []
        missed += [f"{memory_gib:.1f} GiB"] if memory_gib > LARGE_MEMORY_GIB else []
        missed += ["more stations than greedy + links"] if ours["stations"] > rival["stations"] else []
        missed += ["more networks than greedy + links"] if ours["networks"] > rival["networks"] else []
        return (
            _name(row), f"{rival['stations']} in {rival['networks']}", f"{ours['stations']} in {ours['networks']}",
            ours["bound"], _percent(_gap(ours)), f"{ours['work']:.0f}", f"{row['pool_cpu_s'] / 60:.1f} min",
            f"{ours['cpu_s'] / 60:.1f} min", f"{memory_gib:.1f} GiB{'' if of_plan else ', rivals too'}",
            f"missed: {', '.join(missed)}" if missed else "met",
        )  # fmt: skip

    return [
        f"A gap of at most {_percent(LARGE_GAP)} within {LARGE_CPU_S // 60:.0f} minutes of CPU time and "
        f"{LARGE_MEMORY_GIB:g} GiB, with no more stations and in no more",
        "networks than greedy + links. Memory is the most that the process took up to *refined*, or with rivals, which",
        "is no less, where the row says so.",
        "[Tuning of selection](tuning-selection.md) says where the gaps come from, and what was tried.",
        "",
        *_table(
            ("scene", "greedy + links", "joined", "bound", "gap", "work", "CPU of the scans", "CPU of the search",
             "memory", "mark"),
            map(line, rows),
        ),
    ]  # fmt: skip


def _puzzles(rows: Sequence[Row]) -> list[str]:
    return [
        "An ideal scanner that looks everywhere, at 1.5 m, as far as told or farther than the room is long;",
        "99.9 % of the scannable area: what is left are slivers where walls meet. Best: what the scene's own proof",
        "says, which asks for no network: *cover* has to be equal to it. *Joined* and *refined* are connected besides.",
        "",
        *_table(
            ("puzzle", "candidates", "best", "cover", "its bound", "equal", "joined", "its bound", "refined", "greedy",
             "greedy + links", "paper"),
            (
                (
                    _name(row), row["candidates"], row["known_best"], _set(row, "cover"),
                    _method(row, "cover")["bound"], "yes" if _n(row, "cover") == row["known_best"] else "NO",
                    _set(row, "joined"), _method(row, "joined")["bound"],
                    *(_set(row, name) for name in ("refined", "greedy", "greedy_links", "paper")),
                )
                for row in rows
            ),
        ),
    ]  # fmt: skip


def _times(rows: Sequence[Row]) -> list[str]:
    def times(row: Row, name: str) -> str:
        if name not in row["methods"]:
            return ""
        ratio = _method(row, name)["cpu_s"] / max(_method(row, "greedy")["cpu_s"], 1e-9)
        return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"

    names = ("greedy_links", "greedy_circles", "paper", "paper_search", "cover", "joined", "refined")
    return [
        "CPU time of greedy, and how many times that the others take; refined counts from the start. Pool: loading,",
        "finding places and looking around from all of them, which every method needs.",
        "",
        *_table(
            ("scene", "pool", "greedy", "greedy + links", "greedy + circles", "paper", "paper + search", "cover",
             "joined", "refined"),
            (
                (
                    f"{'puzzle ' if row['group'] == 'puzzle' else ''}{_name(row)}", f"{row['pool_cpu_s']:.1f} s",
                    f"{1000 * _method(row, 'greedy')['cpu_s']:.1f} ms", *(times(row, name) for name in names),
                )
                for row in rows
            ),
        ),
    ]  # fmt: skip


def _left(left: Sequence[str]) -> list[str]:
    why = "Rows that the record lacks, for want of time; the one run of the basement ended in a fault of memory:"
    return ["## Not run", why, *(f"- {key}" for key in left)] if left else []


# ------------------------------------------------------------------------------------------------ cells
def _table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> list[str]:
    cells = tuple(head)
    return [_line(cells), _line("---" for _ in cells).replace(" ", ""), *map(_line, rows), ""]


def _line(cells: Iterable[object]) -> str:
    return f"| {' | '.join(str(cell) for cell in cells)} |"


def _method(row: Row, name: str) -> dict[str, Any]:
    found: dict[str, Any] = row["methods"][name]
    return found


def _n(row: Row, name: str) -> int:
    return int(_method(row, name)["stations"])


def _name(row: Row) -> str:
    return f"`{row['scene']}`{', ' + row['told'] if row['told'] else ''}"


def _set(row: Row, name: str) -> str:
    if name not in row["methods"]:
        return ""
    found = _method(row, name)
    apart = "" if found["joined"] else f" ({found['networks']})"
    return f"{found['stations']}{apart}{'' if found['met'] else _MISSED}"


def _saved(row: Row, rival: str) -> str:
    theirs = _method(row, rival)
    if not (theirs["met"] and theirs["joined"]):
        return ""
    spared = theirs["stations"] - _n(row, "refined")
    return f"{spared} ({_percent(spared / theirs['stations'])})"


def _gap(found: dict[str, Any]) -> float:
    return float(1 - found["bound"] / found["stations"])


def _is_near(found: dict[str, Any]) -> bool:
    return _gap(found) <= 0.02 or found["stations"] - found["bound"] <= 1


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _count(number: int) -> str:
    return f"{number:,}".replace(",", " ")
