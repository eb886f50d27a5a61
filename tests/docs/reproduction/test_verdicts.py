"""Verdicts of the reproduction on made-up numbers: each can come out yes and no, and says so only at native columns."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paper_figures import eq9, fig12, fig14, fig16, searches
from paper_figures.figure import Figure
from paper_figures.figures import FIGURES

from planner_core.model import Visibility
from planner_core.select.problem import Constraint, cover_problem

RESULTS = Path(__file__).resolve().parents[3] / "docs" / "reproduction"
HDL = {"hdl-64e": {"used": 4500, "native": 4500}}
BOTH = {**HDL, "pandar64": {"used": 1800, "native": 1800}}
VERDICT = {figure.name: figure.verdict for figure in FIGURES if figure.verdict}


def by_search(ls: float, sa: float, ts: float) -> dict[str, float]:
    return {"ls": ls, "sa": sa, "ts": ts}


def hole(next_to: float, filled: float, f1: float, better: float) -> dict[str, Any]:
    choice = {"next_to_hole": next_to, "median_f1_of_chosen": f1, "median_f1_of_all": 50.0}
    return {
        "better_of_as_many": better,
        "next_if_filled": {"fixed": filled, "variable": filled},
        "fixed": choice,
        "variable": choice,
    }


def stations(n: float, main: float, enclosed: float, small: float) -> dict[str, float]:
    return {"stations": n, "stations_in_main": main, "covers_enclosed": enclosed, "small_rooms": small}


def repaired(little: float, short: int, joined: bool, added: list[int]) -> dict[str, Any]:
    return {"share_little_before": little, "short": [0, 0, short], "joined": [True, True, joined], "added": added}


def shared(stations: int, sets: int) -> dict[str, Any]:
    return {
        "stations": 9,
        "stations_overlapped_by_others": stations,
        "sets_by_circles": 2,
        "sets_by_true_overlap": sets,
    }


#: Numbers as the paper has it, numbers of which nothing holds, and some of which a part does.
MADE_UP: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = {
    "fig05": tuple(
        {"columns": HDL, "squared": {"rank_correlation": {"as printed": a, "without the second sum": b}}}
        for a, b in ((-0.8, 0.7), (0.1, -0.2), (-0.8, -0.2))
    ),
    "fig11": tuple(
        {"columns": HDL, "judged": {"squared": {"dense": dense, "seen": seen, "empty": empty}}}
        for dense, seen, empty in ((0.8, 0.6, 0.9), (0.5, 0.2, 0.1), (0.5, 0.6, 0.1))
    ),
    "eq9": tuple(
        {"columns": HDL, "n_candidates": 100, "stations_by_seed": n, "coverage_by_seed": covers}
        for n, covers in (([20, 21], [0.95, 0.93]), ([1, 1], [0.06, 0.06]), ([1, 20], [0.06, 0.95]))
    ),
    "fig12": tuple(
        {
            "columns": HDL,
            "most_iterations": 60,
            "squared": {
                "mean_iterations": by_search(moved, 59, 60),
                "mean_gain": by_search(1.0, sa, ts),
                "mean_f1": by_search(100, 110, f1),
                "median_triangles_near": by_search(50, 60, near),
                "kept": by_search(40, 41, 20),
            },
        }
        for moved, sa, ts, f1, near in ((3, 2.0, 9.0, 105, 200), (50, 0.5, 0.7, 150, 30), (3, 2.0, 9.0, 105, 30))
    ),
    "fig13": tuple(
        {
            "columns": HDL,
            "squared": {"ls": stations(60, 0.3, 0.9, 1), "sa": stations(62, 0.3, 0.9, sa), "ts": stations(*ts)},
        }
        for sa, ts in ((3, (40, 0.6, 0.5, 0)), (1, (70, 0.1, 0.95, 3)), (1, (40, 0.1, 0.95, 3)))
    ),
    "fig14": tuple(
        {"columns": HDL, "tests": [repaired(*row)], "true_overlap": [shared(*true)]}
        for row, true in (
            ((0.9, 0, True, [1, 2, 3]), (9, 2)),
            ((0.1, 1, False, [3, 2, 1]), (4, 8)),
            ((0.9, 0, True, [1, 2, 3]), (4, 8)),
        )
    ),
    "fig15": tuple(
        {
            "columns": HDL,
            "cube": {
                "all_plain_over_memoised": whole,
                **{name: {"plain_over_memoised": value} for name, value in by_search(1.2, sa, ts).items()},
            },
        }
        for sa, ts, whole in ((5.0, 2.0, 2.5), (1.1, 1.0, 1.1), (5.0, 1.3, 2.5))
    ),
    "fig16": tuple(
        {"device_kind": "gpu", "host_over_device": ratios} for ratios in ([4.0, 8.0], [0.9, 1.1], [1.1, 3.0])
    ),
    "fig17": tuple(
        {"columns": BOTH, "hdl-64e": good, "pandar64": other}
        for good, other in (
            (hole(1.0, 0.3, 60.0, 0.9), hole(1.0, 0.3, 60.0, 0.9)),
            (hole(0.2, 0.2, 40.0, 0.4), hole(0.2, 0.2, 40.0, 0.4)),
            (hole(1.0, 0.3, 60.0, 0.9), hole(1.0, 1.0, 60.0, 0.9)),
        )
    ),
    "f2-regime": tuple(
        {"columns": HDL, "at_native": [{"worse_than_nothing": worse, "dearer": dear}]}
        for worse, dear in ((0.0, 0.1), (0.7, 0.6), (0.0, 0.6))
    ),
    "fig02": tuple(
        {"n_beams": n, "lost": {"by turns": bad, "longest edge": good}}
        for n, bad, good in ((1_000_000, 90, 3), (1_000_000, 0, 0), (200_000, 15, 0))
    ),
}


def test_every_figure_that_is_judged_has_made_up_numbers() -> None:
    assert set(MADE_UP) == set(VERDICT)


@pytest.mark.parametrize("name", sorted(MADE_UP))
def test_a_verdict_comes_out_yes_no_and_partly(name: str) -> None:
    as_told, against, between = MADE_UP[name]
    assert [VERDICT[name](one) for one in (as_told, against, between)] == ["yes", "no", "partly"]


@pytest.mark.parametrize("name", [name for name in sorted(MADE_UP) if "columns" in MADE_UP[name][0]])
def test_a_run_of_thinned_scans_is_not_compared(name: str) -> None:
    for numbers in MADE_UP[name]:
        thinned = copy.deepcopy(numbers)
        list(thinned["columns"].values())[-1]["used"] = 450
        assert VERDICT[name](thinned) == "not comparable"
        del thinned["columns"]  # results from before columns were written down
        assert VERDICT[name](thinned) == "not comparable"


@pytest.mark.parametrize("kind", ["cpu", "none", None])
def test_figure_16_is_not_tested_without_a_gpu(kind: str | None) -> None:
    assert fig16.verdict({"device_kind": kind, "host_over_device": [9.0]}) == "not tested"


@pytest.mark.parametrize(
    ("change", "value"),
    [
        ("mean_iterations", by_search(40, 59, 60)),
        ("mean_gain", by_search(3.0, 2.0, 9.0)),
        ("mean_gain", by_search(1.0, 2.0, 1.5)),
        ("mean_f1", by_search(100, 110, 120)),
        ("median_triangles_near", by_search(50, 60, 55)),
        ("kept", by_search(40, 41, 45)),
    ],
)
def test_figure_12_agrees_only_where_every_sentence_holds(change: str, value: dict[str, float]) -> None:
    numbers = MADE_UP["fig12"][0]
    changed = {**numbers["squared"], change: value}
    assert fig12.verdict({**numbers, "squared": changed}) == "partly"
    holds = fig12.findings(changed, most_iterations=60)
    assert list(holds.values()).count(False) == 1


def test_what_the_choice_of_distance_decides_is_said() -> None:
    squared = {"that it is low": True, "that it is near": False, "that it is short": True}
    plain = {"that it is low": False, "that it is near": True, "that it is short": True}
    told = searches.decided(squared, plain, same_verdict=False)
    assert told == (
        "The choice of distance decides this verdict, and decides that it is low (squared alone); that it is near "
        "(plain alone)."
    )
    same = searches.decided(squared, squared, same_verdict=True)
    assert same == "The choice of distance does not decide this verdict, and decides none of the 3 findings."


def test_figure_14_counts_true_overlap_as_sets_of_patches_do() -> None:
    seen = np.array([[1, 1, 1, 1, 0, 0], [0, 0, 1, 1, 1, 0], [0, 0, 0, 0, 0, 1]], dtype=bool)
    area = np.array([1.0, 1.0, 1.0, 1.0, 2.0, 5.0])
    # Stations 0 and 1 share 2 of 4 m2 each; station 2 shares nothing, though its circle says 0.6 with station 1.
    circles, in_view = np.array([0.5, 0.0, 0.6]), np.array([True, True, False])
    found = fig14.compare_overlap(seen, area, circles, in_view, required=0.5)
    assert found == {
        "required": 0.5,
        "stations": 3,
        "stations_overlapped_by_others": 2,
        "links_by_circles": 2,
        "links_by_true_overlap": 1,
        "sets_by_circles": 1,
        "sets_by_true_overlap": 2,
        "circle_links_in_view": 1,
        "circle_links_in_view_true": 1,
        "circle_links_through_walls": 1,
        "circle_links_through_walls_true": 0,
    }
    assert fig14.compare_overlap(seen, area, circles, in_view, required=0.55)["links_by_true_overlap"] == 0


def test_equation_9_of_pairs_is_that_of_every_pair() -> None:
    rng = np.random.default_rng(3)
    sees = rng.random((12, 40)) < 0.2
    starts = np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64)
    visibility = Visibility(starts, np.nonzero(sees)[1].astype(np.int32), 40)
    problem = cover_problem(visibility, np.ones(40), (Constraint(np.ones(40, dtype=bool), 0.5),))
    one = problem.ticks.sum() / sees.any(axis=0).sum()
    expected = max((sees[i] | sees[j]).sum() / 2 for i in range(12) for j in range(i))
    assert eq9.best_ratio_of_pairs(problem) == pytest.approx(expected * one)


@pytest.mark.parametrize("figure", [figure for figure in FIGURES if figure.verdict], ids=lambda figure: figure.name)
def test_the_committed_verdict_is_that_of_the_committed_numbers(figure: Figure) -> None:
    path = RESULTS / f"{figure.name}.json"
    if not path.exists():
        pytest.skip("not run yet")
    numbers = json.loads(path.read_text())
    assert figure.verdict is not None
    assert numbers["agrees"] == figure.verdict(numbers)
    page = (RESULTS / f"{figure.name}.md").read_text()
    words = {"yes": "It agrees.", "partly": "agrees in part", "no": "does not agree"}
    assert words.get(numbers["agrees"], numbers["agrees"].capitalize()) in page
    assert f"| {numbers['agrees']} |" in next(
        line for line in (RESULTS / "index.md").read_text().splitlines() if f"[{figure.name}]" in line
    )
