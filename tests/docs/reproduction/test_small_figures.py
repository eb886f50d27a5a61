"""Figures 2, 5, 12, 14 and 16 of the reproduction and the sign of F2, run small: files, sums that fit, and verdicts."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paper_figures import fig02, fig05, fig12, fig14, fig16, regime
from paper_figures import searches as of_searches
from paper_figures.figure import Bench, Outcome
from paper_figures.levels import Level, open_level

from planner_core.device import Device
from planner_core.model import Visibility
from planner_core.paper.search import SearchResult, SearchSettings, search
from planner_core.select.problem import Constraint, cover_problem

pytestmark = pytest.mark.slow


def shrunk(grid_step_m: float) -> Callable[..., Level]:
    """Return `open_level` for scans of few columns from few positions, on large patches."""

    def opened(bench: Bench, scene: Any, **options: Any) -> Level:
        few = {"n_azimuths": 90, "grid_step_m": grid_step_m, "max_patch_area_m2": 0.25}
        return open_level(bench, scene, **{**options, **few})

    return opened


def ran(module: Any, folder: Path, **changes: Any) -> Outcome:
    with pytest.MonkeyPatch.context() as patch:
        for name, value in changes.items():
            patch.setattr(module, name, value)
        outcome = module.run(Bench(folder))
    assert {path.name for path in folder.iterdir()} == {picture.file for picture in outcome.pictures}
    for picture in outcome.pictures:
        assert (folder / picture.file).read_bytes().startswith(b"\x89PNG"), picture
    return outcome


def test_figure_2_cuts_one_wall_in_three_ways(tmp_path: Path) -> None:
    whole = fig02.wall_triangles()
    for kind in fig02.KINDS:
        parts = fig02.cut(whole, 0.05, kind, 1).astype(np.float64)
        area = np.linalg.norm(np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0]), axis=1) / 2
        assert area.sum() == pytest.approx(10.0, rel=1e-3), kind
        assert area.max() <= 0.05 * 1.001, kind
    slender = {kind: np.median(fig02.slenderness(fig02.cut(whole, 0.05, kind, 1))) for kind in fig02.KINDS}
    assert slender["longest edge"] < min(slender["by turns"], slender["at random"])
    outcome = ran(fig02, tmp_path, AREA_M2=0.1, _beams=lambda n, rng, beams=fig02._beams: beams(2000, rng))
    assert outcome.numbers["lost_by_our_engine"] == dict.fromkeys(fig02.KINDS, 0)
    assert max(outcome.numbers["lost"].values()) < 0.01 * 1e6
    assert outcome.agrees == fig02.verdict(outcome.numbers)


def test_figure_2_misses_what_no_triangle_covers() -> None:
    wall = fig02.wall_triangles()
    origin, beams = fig02._beams(500, np.random.default_rng(2))
    assert fig02.hits(wall, origin, beams).all()
    of_one = fig02.hits(wall[:1], origin, beams)
    assert 0.3 < of_one.mean() < 0.7
    assert np.array_equal(of_one, ~fig02.hits(wall[1:], origin, beams))


def test_figure_5_measures_both_distances_and_gives_no_verdict_on_thinned_scans(tmp_path: Path) -> None:
    outcome = ran(fig05, tmp_path, open_level=shrunk(2.0))
    for distance in ("squared", "euclidean"):
        facts = outcome.numbers[distance]
        assert facts["sees_nothing"] > 0
        assert all(-1 <= rank <= 1 for rank in facts["rank_correlation"].values())
        kept, printed = (facts["worse_than_nothing"][name] for name in (fig05.KEPT, fig05.PRINTED))
        assert kept >= printed  # the second sum takes references off
    shares = [outcome.numbers[name]["share_with_half"] for name in ("squared", "euclidean")]
    assert shares[0] < shares[1]
    assert outcome.agrees == "not comparable"


def test_figure_12_tells_where_searches_end(tmp_path: Path) -> None:
    def short(name: str, starts_m: Any, fitness: Any, wanted: SearchSettings, **options: Any) -> SearchResult:
        return search(name, starts_m, fitness, replace(wanted, max_iterations=3), **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(of_searches, "search", short)
        outcome = ran(fig12, tmp_path, open_level=shrunk(5.0))
    numbers = outcome.numbers
    for distance in of_searches.UNITS:
        facts = numbers[distance]
        assert set(facts["median_triangles_near"]) == set(of_searches.SEARCHES)
        assert min(facts["mean_gain"].values()) >= 0
        assert max(facts["kept"].values()) <= numbers["n_starts"]
    squared, plain = (numbers[distance]["sees_nothing"] for distance in of_searches.UNITS)
    assert plain > 0 < squared != plain  # in metres, and in square metres
    assert "The choice of distance" in outcome.found
    assert f"from {numbers['n_starts']} starts" in outcome.found
    assert outcome.agrees == "not comparable"


def test_figure_14_counts_links_by_circles_and_by_surface(tmp_path: Path) -> None:
    outcome = ran(fig14, tmp_path, open_level=shrunk(1.0))
    for row, after in zip(outcome.numbers["true_overlap"], outcome.numbers["tests"][0]["stations_after"], strict=True):
        assert row["stations"] == after
        parts = row["circle_links_in_view"] + row["circle_links_through_walls"]
        assert parts == row["links_by_circles"]
        assert row["sets_by_circles"] >= row["stations"] - row["links_by_circles"]
        assert row["circle_links_in_view_true"] <= row["circle_links_in_view"]
    assert outcome.agrees == "not comparable"


def test_figure_16_names_the_device_it_ran_on(tmp_path: Path, device: Device) -> None:
    rng = np.random.default_rng(1)
    sees = rng.random((20, 50)) < 0.2
    starts = np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64)
    visibility = Visibility(starts, np.nonzero(sees)[1].astype(np.int32), 50)
    problem = cover_problem(visibility, np.full(50, 0.04), (Constraint(np.ones(50, dtype=bool), 0.9),))
    outcome = ran(fig16, tmp_path, _problem=lambda bench: problem, _REPEATS=1)
    assert outcome.numbers["device_kind"] == device.kind
    assert outcome.numbers["same_trajectory"] is True
    assert (outcome.agrees == "not tested") == (device.kind != "gpu")
    assert ("says nothing about GPUs" in outcome.found) == (device.kind != "gpu")


def test_the_sign_of_f2_is_that_of_sums_over_patches(tmp_path: Path) -> None:
    def opened(bench: Bench, scene: Any, *, n_azimuths: int = 90, **options: Any) -> Level:
        few = {"n_azimuths": n_azimuths, "grid_step_m": 2.0, "max_patch_area_m2": 0.25}
        return open_level(bench, scene, **{**options, **few})

    changes = {"open_level": opened, "_COLUMNS": (45, 180), "_AREAS_M2": (0.1, 0.4), "_SCENES": ("hole-walls",)}
    outcome = ran(regime, tmp_path, **changes)
    rows = outcome.numbers["rows"]
    assert len(rows) == 4
    for distance in ("squared", "euclidean"):
        few, many = (row["dearer"] for row in rows if row["distance"] == distance)
        assert 0 <= many < few <= 1, distance
    for row in outcome.numbers["slivers"]:
        assert row["of_area"] <= row["of_patches"] <= 1
        assert row["of_squared"] > row["of_euclidean"]
    assert outcome.agrees == "not comparable"
