"""Figures 13 and 15 of the reproduction: searches with selection after them, and what memory spares the searches."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_figures import fig13, fig15
from paper_figures import searches as of_searches
from paper_figures.figure import Bench, Outcome
from paper_figures.levels import Level, open_level

import scenes_synthetic
from planner_core.model import Visibility
from planner_core.paper.genetic import GeneticSettings
from planner_core.paper.search import SearchHistory, SearchResult, SearchSettings, search
from scenes_synthetic.model import Room

pytestmark = pytest.mark.slow


def shrunk(grid_step_m: float, max_patch_area_m2: float = 0.25) -> Callable[..., Level]:
    """Return `open_level` for scans of few columns from few positions, on large patches."""

    def opened(bench: Bench, scene: Any, **options: Any) -> Level:
        few = {"n_azimuths": 90, "grid_step_m": grid_step_m, "max_patch_area_m2": max_patch_area_m2}
        return open_level(bench, scene, **{**options, **few})

    return opened


def short(n_iterations: int) -> Callable[..., SearchResult]:
    """Return `search` for so many iterations."""

    def searched(name: str, starts_m: Any, fitness: Any, wanted: SearchSettings, **options: Any) -> SearchResult:
        return search(name, starts_m, fitness, replace(wanted, max_iterations=n_iterations), **options)

    return searched


def check_pictures(outcome: Outcome, folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == {picture.file for picture in outcome.pictures}
    for picture in outcome.pictures:
        assert (folder / picture.file).read_bytes().startswith(b"\x89PNG"), picture


# --------------------------------------------------------------------------------------------- Fig. 13
AS_IN_THE_PAPER = {
    "ls": {"stations": 60.0, "stations_in_main": 0.3, "covers_enclosed": 0.9, "small_rooms": 1.0},
    "sa": {"stations": 62.0, "stations_in_main": 0.3, "covers_enclosed": 0.9, "small_rooms": 3.0},
    "ts": {"stations": 40.0, "stations_in_main": 0.6, "covers_enclosed": 0.5, "small_rooms": 0.0},
}


@pytest.mark.parametrize(
    ("name", "fact", "value"),
    [
        ("ts", "stations", 60.0),
        ("ts", "stations_in_main", 0.3),
        ("ts", "covers_enclosed", 0.9),
        ("sa", "small_rooms", 1.0),
    ],
)
def test_figure_13_agrees_only_where_all_four_findings_hold(name: str, fact: str, value: float) -> None:
    assert all(fig13.findings(AS_IN_THE_PAPER).values())
    changed = {**AS_IN_THE_PAPER, name: {**AS_IN_THE_PAPER[name], fact: value}}
    assert list(fig13.findings(changed).values()).count(False) == 1


def test_figure_13_disagrees_where_all_searches_come_out_alike() -> None:
    assert not any(fig13.findings(dict.fromkeys(AS_IN_THE_PAPER, AS_IN_THE_PAPER["ls"])).values())


ROOM = Room("A", 1, ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)), 4.4, 4.0)


def test_figure_13_counts_faces_of_a_room_and_no_other_storey() -> None:
    points = [[2, 1, 4.4], [0, 1, 6], [4, 3, 8.4], [2, 1, 4.0], [4.2, 1, 6], [2, 1, 8.6]]
    assert fig13.in_rooms([ROOM], np.array(points)).tolist() == [True, True, True, False, False, False]


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10_000), first=st.integers(0, 5), n=st.integers(0, 6))
def test_figure_13_takes_pools_apart_as_a_matrix_would(seed: int, first: int, n: int) -> None:
    seen = np.random.default_rng(seed).random((11, 23)) < 0.3
    starts = np.concatenate([[0], np.cumsum(seen.sum(axis=1))]).astype(np.int64)
    whole = Visibility(starts, np.nonzero(seen)[1].astype(np.int32), 23)
    part = fig13.rows(whole, first, first + n)
    assert part.n_positions == n
    for k in range(n):
        assert part.row(k).tolist() == np.flatnonzero(seen[first + k]).tolist(), (seed, k)
    expected = seen[first : first + n].any(axis=0) if n else np.zeros(23, dtype=bool)
    np.testing.assert_array_equal(fig13.seen_by(part, range(n)), expected, err_msg=str(seed))


@pytest.fixture(scope="module")
def of_figure_13(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    folder = tmp_path_factory.mktemp("fig13")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fig13, "open_level", shrunk(6.0, max_patch_area_m2=1.0))
        patch.setattr(fig13, "GeneticSettings", partial(GeneticSettings, max_iterations=60))
        patch.setattr(of_searches, "search", short(3))
        outcome = fig13.run(Bench(folder))
    check_pictures(outcome, folder)
    return outcome


def facts_of(outcome: Outcome) -> list[dict[str, Any]]:
    """Of every search by either distance."""
    return [outcome.numbers[distance][name] for distance in of_searches.UNITS for name in of_searches.SEARCHES]


def test_figure_13_selects_what_covers_most_of_what_its_pool_sees(of_figure_13: Outcome) -> None:
    for facts in facts_of(of_figure_13):
        assert 0.95 * facts["pool_share"] <= facts["covers"] <= facts["pool_share"] <= 1.0
        assert facts["covers_enclosed"] <= facts["pool_share_of_enclosed"] <= 1.0
        assert facts["stations_greedy"] <= facts["stations"] <= facts["pool"]
        assert len(facts["stations_by_seed"]) == 5
    assert of_figure_13.agrees == "not comparable"


def test_figure_13_finds_all_positions_of_its_pools_in_rooms_of_the_level(of_figure_13: Outcome) -> None:
    rooms = [room.name for room in scenes_synthetic.build("school").rooms if room.storey == fig13.FLOOR]
    assert {fig13.MAIN, *fig13.SMALL} < set(rooms)
    for facts in facts_of(of_figure_13):
        assert list(facts["pool_by_room"]) == rooms
        # Doorways belong to no room.
        assert 0.8 * facts["pool"] < sum(facts["pool_by_room"].values()) <= facts["pool"]
        assert facts["small_rooms"] <= facts["pool_small_rooms"] <= len(fig13.SMALL)
        assert facts["enclosed_rooms"] <= facts["rooms"] <= facts["enclosed_rooms"] + 2


def test_figure_13_ends_with_few_stations_by_equation_9(of_figure_13: Outcome) -> None:
    for facts in facts_of(of_figure_13):
        assert max(facts["stations_eq9_by_seed"]) < min(facts["stations_by_seed"])
        assert facts["eq9_covers"] < facts["covers"]


# --------------------------------------------------------------------------------------------- Fig. 15
@pytest.mark.parametrize(
    ("ratio", "in_all", "verdict"),
    [
        ((1.2, 5.0, 2.0), 2.5, "yes"),
        ((1.2, 5.0, 1.3), 2.5, "partly"),
        ((2.1, 5.0, 2.0), 2.5, "partly"),
        ((1.2, 5.0, 2.0), 1.4, "partly"),
        ((1.2, 1.1, 1.0), 1.1, "no"),
    ],
)
def test_figure_15_agrees_by_its_ratios(ratio: tuple[float, float, float], in_all: float, verdict: str) -> None:
    assert fig15.agreement(dict(zip(of_searches.SEARCHES, ratio, strict=True)), in_all) == verdict


def result(position_m: Any, f2: Any) -> SearchResult:
    way = np.asarray(position_m, dtype=np.float64)
    worth = np.asarray(f2, dtype=np.float64)
    history = SearchHistory(
        position_m=way,
        f1=np.ones(way.shape[:2], dtype=np.int64),
        f2=worth,
        restarted=np.zeros(way.shape[:2], dtype=bool),
        n_iterations=np.full(way.shape[1], len(way) - 1),
    )
    return SearchResult(way[-1], history.f1[-1], worth[-1], history, 10, 0)


def test_figure_15_compares_times_run_by_run_and_ways_step_by_step() -> None:
    way = np.arange(12.0).reshape(2, 2, 3)
    f2 = [[5.0, np.inf], [3.0, np.inf]]
    plain_s, memoised_s = np.array([4.0, 9.0, 2.0]), np.array([2.0, 3.0, 2.0])
    pair = fig15.Pair(result(way, f2), result(way, f2), plain_s, memoised_s, plain_s, memoised_s)
    assert (pair.ratio, pair.same, pair.worse_m2) == (2.0, True, 0.0)
    moved = way.copy()
    moved[0, 1, 2] += 1e-9
    other = replace(pair, memoised=result(moved, [[5.0, np.inf], [4.5, np.inf]]))
    assert (other.same, other.worse_m2) == (False, 1.5)
    assert not replace(pair, memoised=result(moved, f2)).same


def test_figure_15_takes_a_dense_piece_of_the_grid() -> None:
    x, y = np.meshgrid(np.arange(9.0), np.arange(9.0))
    grid = np.column_stack([x.ravel(), y.ravel(), np.full(81, 1.3)])
    block = fig15._block(grid, 9)
    assert sorted(map(tuple, block[:, :2].tolist())) == [(i, j) for i in (3.0, 4.0, 5.0) for j in (3.0, 4.0, 5.0)]
    assert fig15._block(grid, None) is grid


def test_figure_15_goes_the_same_ways_on_the_lattice_with_fewer_scans(tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fig15, "open_level", shrunk(0.5))
        patch.setattr(fig15, "search", short(6))
        patch.setattr(fig15, "_REPEATS", 2)
        outcome = fig15.run(Bench(tmp_path))
    check_pictures(outcome, tmp_path)
    square = outcome.numbers["cube"]
    for name in of_searches.SEARCHES:
        facts = square[name]
        assert facts["same_way"] is True, name
        assert facts["memoised_ends_higher_by_m2"] == 0.0, name
        assert facts["evaluations_memoised"] + facts["hits"] == facts["evaluations_plain"], name
        assert (facts["evaluations_memoised"] < facts["evaluations_plain"]) == (facts["hits"] > 0), name
    assert sum(square[name]["hits"] for name in of_searches.SEARCHES) > 0
    assert "bit for bit: yes" in outcome.found
    assert outcome.agrees == "not comparable"
