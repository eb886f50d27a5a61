"""The results of `bench_gpu.py` as Markdown: docs/benchmarks/gpu.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

GOAL_CANDIDATES, GOAL_S = 10_000, 60.0
Rows = list[dict[str, Any]]


def page(found: dict[str, Any]) -> str:
    """The whole page; sections of steps that gave no rows are left out."""
    rows: dict[str, Rows] = {step: each["rows"] for step, each in found["steps"].items()}
    lines = [
        "# Kernels on a GPU",
        "Written by `make bench-gpu` (tests/benchmarks/bench_gpu.py, which has what is measured and how). "
        f"Measured on {found['date']}; times by the clock, transfers included.",
        "",
    ]
    for each in rows.get("check", [])[:1]:
        lines += [
            f"{each['device']} ({each['platform']}, {each['version']}), {each['units']} compute units, "
            f"{each['memory_gib']:.0f} GiB; host {each['processor']}, {each['n_cores']} cores, "
            f"Python {each['python']}, NumPy {each['numpy']}.",
            "",
        ]
    outcomes = [(step, f"{each['seconds']:.0f}", each["ended"] or "done") for step, each in found["steps"].items()]
    lines += [*table(("step", "seconds", "outcome"), outcomes), ""]
    for each in rows.get("check", []):
        lines.append(f"- {each['device']}: {each['problem'] or 'its kernels compute rightly'}, {each['seconds']:.0f} s")
    for each in rows.get("kernels", []):
        bits = "to the bit what a processor computes" if each["same_bits"] else f"not to the bit: {each['others']}"
        lines.append(f"- all {each['n_kernels']} kernels on small scenes: {bits}")
    for each in rows.get("tests", []):
        lines += [f"- tests of kernels: {each['counts']}", *(f"  - `{line}`" for line in each["failed"])]
    for write, step in ((_scale, "scale"), (_shapes, "tune"), (_scans, "scans"), (_genetic, "genetic")):
        if rows.get(step):
            lines += ["", *write(rows[step])]
    return "\n".join([*lines, ""])


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Lines of a table."""
    cells = ("| " + " | ".join(map(str, row)) + " |" for row in rows)
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *cells]


def _scale(rows: Rows) -> list[str]:
    cells = []
    for each in rows:
        together_s = each["tree_s"] + each["visibility_s"]
        met = "" if each["n_candidates"] < GOAL_CANDIDATES else "met" if together_s <= GOAL_S else "missed"
        range_m = "no limit" if each["range_m"] == 1e9 else f"{each['range_m']:g} m"
        times = (f"{each['tree_s']:.2f} s", f"{each['visibility_s']:.1f} s", f"{together_s:.1f} s")
        cells.append((each["n_triangles"], range_m, each["n_candidates"], *times, met))
    head = ("triangles", "range", "candidates", "tree", "visibility", "together", "goal")
    return ["## 10 000 candidates of an HDL-64E", "Goal: 60 s, tree included.", "", *table(head, cells)]


def _shapes(rows: Rows) -> list[str]:
    shapes = [
        (each["shape"], f"{each['milliseconds']:.3f}", "shipped" if each["is_shipped"] else "")
        for each in rows
        if "shape" in each
    ]
    grouped = [
        (each["groups_of_patches"], f"{each['milliseconds']:.1f}") for each in rows if "groups_of_patches" in each
    ]
    return [
        "## Shapes of tiles",
        "Rows x columns of beams x beams a packet; visibility of an HDL-64E, ms a position.",
        "",
        *table(("shape", "ms", ""), shapes),
        "",
        "Patch mode, RTC360 6 mm, by groups of patches a work-item:",
        "",
        *table(("groups", "ms a position"), grouped),
    ]


def _scans(rows: Rows) -> list[str]:
    scans, others = [], []
    for each in rows:
        what = (each["scene"], each["what"])
        if "n_beams" in each:
            times = (f"{each['scan_ms']:.2f}", f"{each['of_eight_ms']:.2f}", f"{each['visibility_ms']:.3f}")
            scans.append((*what, *times, f"{each['n_beams'] / each['visibility_ms'] / 1e3:.0f}"))
        elif "ms" in each:
            others.append((*what, f"{each['ms']:.2f} ms"))
        else:
            others.append((*what, f"{each['share']:.1e}; ranges within {each['range_apart_mm']:.3f} mm"))
    return [
        "## Scans",
        "Milliseconds a position: all results of one position, of eight together, and visibility of many.",
        "",
        *table(("scene", "beams", "one", "of eight", "visibility", "million beams a second"), scans),
        "",
        *table(("scene", "what", ""), others),
    ]


def _genetic(rows: Rows) -> list[str]:
    cells = []
    for each in rows:
        device, host = (f"{each['n_evaluations'] / each[time_s]:,.0f}" for time_s in ("device_s", "host_s"))
        same = "yes" if each["same_set"] else "no"
        cells.append(
            (each["problem"], each["population"], device, host, f"{each['host_s'] / each['device_s']:.1f}", same)
        )
    return [
        "## Genetic selection",
        "The method paper's figure 16: the whole loop on the GPU against the host's cores.",
        "",
        *table(("problem", "population", "evaluations a second", "host", "ratio", "same set"), cells),
    ]
