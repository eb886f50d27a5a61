"""Figures 4, 6, 7, 11 and 17 of the reproduction: their measures against oracles, their verdicts, and their bits."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_figures import fig04, fig06, fig07, fig11, fig17
from paper_figures.figure import Bench, Outcome
from paper_figures.levels import Level, open_level
from scipy.spatial.distance import pdist

import scenes_synthetic
from planner_core.model import Visibility
from planner_core.paper.reference_distance import SampleKind, sample_triangle
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import make_patches
from scenes_synthetic.hole_walls import HOLES_M

pytestmark = pytest.mark.slow
SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def check_files(outcome: Outcome, folder: Path) -> None:
    assert outcome.pictures
    for picture in outcome.pictures:
        assert (folder / picture.file).read_bytes().startswith(b"\x89PNG"), picture
    assert {path.name for path in folder.iterdir()} == {picture.file for picture in outcome.pictures}


def shrunk(grid_step_m: float) -> Callable[..., Level]:
    """Return `open_level` for scans of few columns from few positions, on large patches."""

    def opened(bench: Bench, scene: Any, **options: Any) -> Level:
        few = {"n_azimuths": 90, "grid_step_m": grid_step_m, "max_patch_area_m2": 0.25}
        return open_level(bench, scene, **{**options, **few})

    return opened


def shrunken(module: Any, grid_step_m: float, folder: Path) -> Outcome:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "open_level", shrunk(grid_step_m))
        outcome: Outcome = module.run(Bench(folder))
    check_files(outcome, folder)
    json.dumps(outcome.numbers, allow_nan=False)
    return outcome


# ---------------------------------------------------------------------------------------------- Fig. 4
def means(halton: float = 0.40, grid: float = 0.44, part: float = 0.15) -> dict[SampleKind, float]:
    return {SampleKind.HALTON: halton, SampleKind.GRID: grid, SampleKind.PART: part}


@pytest.mark.parametrize(
    ("mean_m", "part", "three", "verdict"),
    [
        (means(), 1.2, 2.0, "yes"),
        (means(), 0.9, 2.0, "partly"),
        (means(), 1.2, 0.9, "partly"),
        (means(halton=0.30), 1.2, 2.0, "no"),
        (means(part=0.21), 1.2, 2.0, "no"),
    ],
)
def test_figure_4_agrees_by_its_numbers(
    mean_m: dict[SampleKind, float], part: float, three: float, verdict: str
) -> None:
    assert fig04.agreement(mean_m, part_with_vertices=part, three_with_vertices=three) == verdict


def test_figure_4_gives_mean_distances_and_says_them(tmp_path: Path) -> None:
    outcome = fig04.run(Bench(tmp_path))
    check_files(outcome, tmp_path)
    mean_m = outcome.numbers["mean_distance_m"]
    for kind in (SampleKind.GRID, SampleKind.HALTON, SampleKind.THREE):
        points = sample_triangle(fig04.CORNERS_M, fig04.N_POINTS, kind)
        assert mean_m[kind.value] == pytest.approx(pdist(points).mean(), rel=1e-12), kind
        closed = pdist(np.concatenate([points, fig04.CORNERS_M])).mean()
        assert outcome.numbers["mean_distance_with_vertices_m"][kind.value] == pytest.approx(closed, rel=1e-12), kind
    sizes, ratio = outcome.numbers["sizes"], outcome.numbers["over_reference_by_size"]
    assert ratio["halton"][sizes.index(fig04.N_POINTS)] == pytest.approx(1.0, rel=1e-12)
    assert f"{mean_m['halton']:.3f} m" in outcome.found
    last_above = max(size for size, value in zip(sizes, ratio["part"], strict=True) if value > 1)
    assert f"up to {last_above} points" in outcome.found


def test_figure_4_is_drawn_and_numbered_alike_twice(tmp_path: Path) -> None:
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        folder.mkdir()
    first, second = (fig04.run(Bench(folder, seed=3)) for folder in folders)
    assert first == second
    for picture in first.pictures:
        assert (folders[0] / picture.file).read_bytes() == (folders[1] / picture.file).read_bytes()


# ---------------------------------------------------------------------------------------------- Fig. 6
def test_figure_6_agrees_by_its_numbers() -> None:
    assert fig06.agreement([0.1, 0.04], [[0.5, 0.2], [0.4, 0.1]]) == "yes"
    assert fig06.agreement([0.1, 0.06], [[0.5, 0.2], [0.4, 0.1]]) == "partly"
    assert fig06.agreement([0.1, 0.04], [[0.5, 0.2], [0.4, 0.3]]) == "partly"
    assert fig06.agreement([0.1, 0.1], [[0.5, 0.2], [0.4, 0.3]]) == "no"


def test_figure_6_measures_errors_against_the_known_share_of_two_circles() -> None:
    # Two equal circles through each other's middle: 2/3 - sqrt(3) / 2 pi of either is the other's too.
    known = 2 / 3 - np.sqrt(3) / (2 * np.pi)
    towards = fig06.RADIUS_M * np.array([np.cos(0.5), np.sin(0.5)])
    at = (np.arange(256) + 0.5) / 128 - 1
    x, y = np.meshgrid(at, at)
    inside = x * x + y * y <= 1
    filled = (inside & ((x - towards[0] / fig06.RADIUS_M) ** 2 + (y - towards[1] / fig06.RADIUS_M) ** 2 <= 1)).sum()
    expected = filled / inside.sum() - known
    assert fig06.errors(np.array([fig06.RADIUS_M]), 256)[0] == pytest.approx(expected, abs=1e-9)
    assert abs(expected) < 1e-3


def test_figure_6_shows_that_a_fine_grid_needs_more_points(tmp_path: Path) -> None:
    outcome = fig06.run(Bench(tmp_path))
    check_files(outcome, tmp_path)
    coarse, fine = outcome.numbers["mean_error_by_cells_and_points"].values()
    assert fine[fig06.POINTS[0]] > coarse[fig06.POINTS[0]]
    assert fine[fig06.POINTS[-1]] < coarse[fig06.POINTS[-1]]
    by_cells = list(outcome.numbers["mean_error_by_cells"].values())
    assert by_cells == sorted(by_cells, reverse=True)
    assert outcome.agrees == fig06.agreement(by_cells, [list(row.values()) for row in (coarse, fine)])


# ---------------------------------------------------------------------------------------------- Fig. 7
def evenness(neighbour: float, dispersion: float) -> fig07.Evenness:
    return fig07.Evenness(neighbour, 0.5, dispersion)


@pytest.mark.parametrize(
    ("halton", "verdict"), [((1.4, 0.2), "yes"), ((1.05, 0.2), "partly"), ((1.4, 0.95), "partly"), ((1.05, 0.95), "no")]
)
def test_figure_7_agrees_by_its_numbers(halton: tuple[float, float], verdict: str) -> None:
    random = [evenness(1.0, 1.0), evenness(1.1, 0.9)]
    good = (evenness(1.4, 0.2), random)
    assert fig07.agreement({"chair": good, "wall": (evenness(*halton), random)}) == verdict


def test_figure_7_finds_a_lattice_perfectly_even() -> None:
    side = 20
    i, j = (np.array([(i, j) for i in range(side) for j in range(side - i)]) + 1 / 3).T / side
    points = np.column_stack([i, j, np.zeros(i.size)])
    found = fig07.evenness(points, points[:, :2], area_m2=0.5)
    assert found.variation == pytest.approx(0.0, abs=1e-6)
    assert found.neighbour == pytest.approx((1 / side) / (0.5 * np.sqrt(0.5 / i.size)), rel=1e-9)
    assert found.dispersion < 0.5


@settings(deadline=None, max_examples=40)
@given(n=st.integers(30, 400), seed=st.integers(0, 10_000))
def test_figure_7_counts_every_point_in_one_cell(n: int, seed: int) -> None:
    points = sample_triangle(SQUARE, n, SampleKind.RANDOM, seed=seed)[:, :2]
    points[: n // 2, 0] = 1.0 - points[: n // 2, 1]  # on the rim
    points[:3] = [[1 / 3, 2 / 3], [1.0, 0.0], [0.0, 1.0]]
    counts = fig07.counts_by_cell(points)
    side = int(np.sqrt(n / 8))
    assert counts.size == side * side, (n, seed)
    assert counts.sum() == n, (n, seed)


def test_figure_7_draws_both_and_finds_halton_more_even(tmp_path: Path) -> None:
    outcome = fig07.run(Bench(tmp_path))
    check_files(outcome, tmp_path)
    for name in ("chair", "wall"):
        numbers = outcome.numbers[name]
        assert len({one["neighbour"] for one in numbers["random"]}) == outcome.numbers["n_seeds"]
        assert f"on the {name}'s triangles" in outcome.found
        # Clark and Evans: 1 on average for random points, a little more with edges.
        assert 0.95 < np.mean([one["neighbour"] for one in numbers["random"]]) < 1.15
    assert outcome.agrees == "yes"


# --------------------------------------------------------------------------------------------- Fig. 11
def test_figure_11_agrees_by_its_numbers() -> None:
    assert fig11.agreement(dense=0.8, seen=0.6, empty=0.9) == "yes"
    assert fig11.agreement(dense=0.5, seen=0.6, empty=0.9) == "partly"
    assert fig11.agreement(dense=0.5, seen=0.2, empty=0.9) == "partly"
    assert fig11.agreement(dense=0.5, seen=0.2, empty=0.1) == "no"


def test_figure_11_knows_slender_triangles() -> None:
    wide = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.11, 0.0]]
    thin = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.5, 0.09, 1.0]]
    scene = scene_from_arrays(np.array(wide + thin), np.arange(6).reshape(2, 3))
    assert fig11.is_slender(scene, make_patches(scene, max_area_m2=1.0)).tolist() == [False, True]


def test_figure_11_counts_triangles_near_as_one_by_one(tmp_path: Path) -> None:
    scene = scenes_synthetic.build("two-rooms").scene
    middle_m = scene.vertices_m[scene.triangles].mean(axis=1)
    position_m = np.random.default_rng(5).uniform(0, 4, (20, 3))
    expected = [(np.linalg.norm(middle_m - one, axis=1) <= fig11.DENSE_WITHIN_M).sum() for one in position_m]
    assert fig11.triangles_near(scene, position_m).tolist() == expected
    assert len(set(expected)) > 3


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10_000))
def test_figure_11_adds_up_what_positions_see(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, n_patches = 40, 60
    seen = rng.random((n, n_patches)) < 0.2
    area_m2 = rng.random(n_patches)
    starts = np.concatenate([[0], np.cumsum(seen.sum(axis=1))]).astype(np.int64)
    see = fig11.Sight(Visibility(starts, np.nonzero(seen)[1].astype(np.int32), n_patches), area_m2)
    chosen = rng.choice(n, 5, replace=False)
    whole = area_m2[seen.any(axis=0)].sum()
    assert see.share(chosen.tolist()) == pytest.approx(area_m2[seen[chosen].any(axis=0)].sum() / whole), seed
    np.testing.assert_allclose(see.by_position(area_m2), seen @ area_m2, atol=1e-12, err_msg=str(seed))
    assert see.times(chosen).tolist() == seen[chosen].sum(axis=0).tolist(), seed
    left, greedy = area_m2.copy(), see.cover_greedily()
    for one in greedy[:5]:
        assert (seen @ left)[one] == pytest.approx((seen @ left).max()), seed
        left[seen[one]] = 0.0


def test_figure_11_places_all_chosen_positions_in_rooms(tmp_path: Path) -> None:
    outcome = shrunken(fig11, 2.0, tmp_path)
    numbers = outcome.numbers
    assert sum(numbers["chosen_by_room"].values()) == fig11.N_BEST
    assert sum(numbers["positions_by_room"].values()) == numbers["n_positions"]
    assert numbers["seen_by_greedy_cover"] > max(numbers["seen_by_f2"])
    at = numbers["least_distance_m"].index(fig11.APART_M)
    empty = [name for name in fig11.ENCLOSED if numbers["positions_by_room"][name]]
    share = np.mean([numbers["chosen_by_room"][name] == 0 for name in empty])
    judged = {"dense": numbers["dense_by_f2"][at], "seen": numbers["seen_by_f2"][at], "empty": float(share)}
    assert numbers["judged"]["squared"] == judged
    assert outcome.agrees == "not comparable"


# --------------------------------------------------------------------------------------------- Fig. 17
def test_figure_17_takes_the_holes_from_the_scene() -> None:
    holes = fig17.holes_of_scene()
    assert sorted(round(hole.z_m, 9) for hole in holes) == sorted(HOLES_M.values())
    for hole in holes:
        assert (hole.inner_m, hole.outer_m) == (1.0, 1.6)
        assert hole.high_m == pytest.approx(0.15)
    outwards = {round(hole.z_m, 9): tuple(hole.out) for hole in holes}
    assert outwards[HOLES_M["east"]] == (1.0, 0.0)
    assert outwards[HOLES_M["south"]] == (0.0, -1.0)


def test_figure_17_measures_how_far_from_a_hole_a_position_is() -> None:
    position_m = np.array([[2.6, 0.0, 1.5], [0.0, -3.6, 0.4], [-0.7, 0.4, 2.1]])
    distance_m, above_m = fig17.next_to_hole(position_m)
    np.testing.assert_allclose(distance_m, [1.0, 2.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(above_m, [0.4, -0.2, 0.0], atol=1e-12)


def test_figure_17_sees_through_holes_as_the_scene_knows(tmp_path: Path) -> None:
    model = scenes_synthetic.build("hole-walls")
    beyond = {view.station_m: any("Outer" in part for part in view.visible_area_m2) for view in model.truth.views}
    # From the middle, nothing is seen through a hole that is more than 0.325 m higher or lower.
    beyond |= {(0.0, 0.0, 0.2): False, (0.0, 0.0, 2.5): False}
    places_m = np.array(list(beyond))
    options = {"grid_step_m": 1.0, "heights_m": (1.5,), "n_azimuths": 900}
    level = open_level(Bench(tmp_path), "hole-walls", **options)
    assert fig17.sees_through(level, places_m).tolist() == list(beyond.values())
    filled = open_level(Bench(tmp_path), fig17.without_holes(), **options)
    assert not fig17.sees_through(filled, places_m).any()
    assert filled.survey.scene.n_triangles < level.survey.scene.n_triangles


def test_figure_17_keeps_chosen_positions_apart_and_at_their_height(tmp_path: Path) -> None:
    outcome = shrunken(fig17, 0.75, tmp_path)
    for scanner in ("hdl-64e", "pandar64"):
        numbers = outcome.numbers[scanner]
        for name in ("fixed", "variable"):
            chosen_m = np.array(numbers[name]["chosen_m"])
            assert len(chosen_m) == fig17.N_BEST
            assert pdist(chosen_m).min() >= fig17.APART_M - 1e-5
            assert set(np.round(chosen_m[:, 2], 6)) <= (
                {fig17.FIXED_M} if name == "fixed" else set(np.arange(10, 21) / 10)
            )
        assert numbers["variable"]["best_f2_m2"] <= numbers["fixed"]["best_f2_m2"]
        assert numbers["variable"]["best_f1"] >= numbers["fixed"]["best_f1"]
