"""Normal matrices of very many pairs against residuals that are differentiated by hand, and errors they bound."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner_core.network.compiled_pairs import BLOCK
from planner_core.network.pair_overlap import (
    PairSums,
    SharedSurface,
    common_sums,
    held_by,
    matrices_of,
    overlapping_pairs,
    patch_sums,
    strengths_of,
)

STEP = 1e-5


def differentiated(area_m2, points, normals):
    """Normal matrix of point-to-plane residuals under small rigid motions, by central differences: no formula."""
    weight = area_m2 / area_m2.sum()
    middle = weight @ points
    length = np.sqrt(weight @ ((points - middle) ** 2).sum(axis=1))

    def residuals(motion):
        turned = Rotation.from_rotvec(motion[3:] / length).apply(points - middle)
        return ((turned + middle + motion[:3] - points) * normals).sum(axis=1)

    jacobian = np.stack([(residuals(STEP * e) - residuals(-STEP * e)) / (2 * STEP) for e in np.eye(6)], axis=1)
    return jacobian.T @ (weight[:, None] * jacobian)


def all_pairs(view, **options):
    blocks = list(overlapping_pairs(view.visibility, view.area_m2, **options))
    return tuple(np.concatenate([getattr(one, name) for one in blocks]) for name in ("first", "second", "overlap"))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_overlaps_of_pairs_are_those_of_sets_of_patches_in_order(make_view, seed):
    view = make_view(seed)
    whole = np.triu(view.overlaps(), 1)
    for least in (0.0, 0.05, 0.3):
        first, second, overlap = all_pairs(view, min_overlap=least, rows_a_block=7)
        expected = np.argwhere((whole >= least) & (whole > 0))
        np.testing.assert_array_equal(np.stack([first, second], axis=1), expected)
        np.testing.assert_array_equal(overlap, whole[first, second])
    assert first.size > 10, "nothing was looked at"


def test_pair_that_shares_exactly_the_threshold_is_listed_however_its_areas_are_cut(make_view):
    view = make_view(0)
    area_m2 = np.full(view.area_m2.size, 0.1)  # no sum of which is exact in binary
    rows = view.with_rows([np.arange(0, 10), np.arange(7, 17)]).visibility
    (pairs,) = overlapping_pairs(rows, area_m2, min_overlap=0.3)
    assert pairs.overlap.tolist() == [0.3]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_normal_matrices_are_those_of_differentiated_residuals(make_view, seed):
    view = make_view(seed)
    first, second, _ = all_pairs(view, min_overlap=0.05)
    matrices = matrices_of(PairSums(view.visibility, view.area_m2, view.surface, view.position_m).of(first, second))
    assert first.size > 20
    for i, j, matrix in zip(first, second, matrices, strict=True):
        both = view.common(i, j)
        expected = differentiated(view.area_m2[both], view.surface.centroid_m[both], view.surface.normal[both])
        np.testing.assert_allclose(matrix, expected, atol=1e-8, err_msg=f"{seed}: {i}, {j}")


@pytest.mark.parametrize("seed", range(3))
def test_strengths_of_pairs_are_those_of_single_links(make_view, seed):
    view = make_view(seed)
    first, second, _ = all_pairs(view, min_overlap=0.0)
    strength = strengths_of(
        matrices_of(PairSums(view.visibility, view.area_m2, view.surface, view.position_m).of(first, second))
    )
    expected = [view.strength(i, j) for i, j in zip(first, second, strict=True)]
    np.testing.assert_allclose(strength, expected, atol=1e-9)
    assert strength.max() > 0.05


def test_strengths_hold_far_from_the_origin(make_view):
    view = make_view(4)
    first, second, _ = all_pairs(view, min_overlap=0.3)
    surface = SharedSurface(view.surface.centroid_m + np.array([700.0, -400.0, 30.0]), view.surface.normal)
    far = strengths_of(matrices_of(PairSums(view.visibility, view.area_m2, surface, view.position_m).of(first, second)))
    near = strengths_of(
        matrices_of(PairSums(view.visibility, view.area_m2, view.surface, view.position_m).of(first, second))
    )
    np.testing.assert_allclose(far, near, atol=1e-7)


def test_sums_do_not_depend_on_which_pairs_are_asked_for(make_view):
    view = make_view(1)
    first, second, _ = all_pairs(view, min_overlap=0.05)
    sums = PairSums(view.visibility, view.area_m2, view.surface, view.position_m)
    whole = sums.of(first, second)
    order = np.random.default_rng(0).permutation(first.size)
    np.testing.assert_array_equal(sums.of(first[order], second[order]), whole[order])
    np.testing.assert_array_equal(sums.of(second, first), whole)
    for k in (0, 5, first.size - 1):
        np.testing.assert_array_equal(sums.of(first[k : k + 1], second[k : k + 1]), whole[k : k + 1])


@pytest.mark.parametrize("seed", range(2))
def test_what_pairs_hold_is_that_of_their_common_patches_one_by_one(make_view, seed):
    view = make_view(seed)
    # Larger, so that some of it is far.
    centroid_m, position_m = 4.0 * view.surface.centroid_m, 4.0 * view.position_m
    far_m = np.array([700.0, -400.0, 30.0])
    surface, at_m = SharedSurface(centroid_m + far_m, view.surface.normal), position_m + far_m
    first, second, _ = all_pairs(view, min_overlap=0.05)
    sums = PairSums(view.visibility, view.area_m2, surface, at_m)
    held = sums.held(first, second)
    found = sums.of(first, second)
    again = held_by(found, matrices_of(found))
    for name, figures in vars(held).items():
        assert figures.tobytes() == getattr(again, name).tobytes(), name
    n_far = 0
    for i, j, hold_m2 in zip(first, second, held.hold_m2, strict=True):
        both, nn = view.common(i, j), np.zeros((3, 3))
        for block in np.unique(both // BLOCK):  # each weighs by how near it is as a whole
            patch = both[both // BLOCK == block]
            area_m2, normal = view.area_m2[patch], view.surface.normal[patch]
            apart_m = [np.linalg.norm(centroid_m[patch] - position_m[k], axis=1) for k in (i, j)]
            weight = [min(1.0, 7.5**2 / np.average(each**2, weights=area_m2)) for each in apart_m]
            nn += weight[0] * weight[1] * (normal * area_m2[:, None]).T @ normal
            n_far += min(weight) < 0.9
        assert hold_m2 == pytest.approx(np.linalg.eigvalsh(nn)[0], rel=1e-5, abs=1e-8)
    assert n_far > 20, "all is near"


def test_sums_of_nothing_in_common_are_zero(make_view):
    view = make_view(0)
    rows = view.with_rows([np.arange(0, 5), np.arange(5, 9), np.array([8]), np.array([8])]).visibility
    one, other = np.array([0, 2], dtype=np.int32), np.array([1, 3], dtype=np.int32)
    found = PairSums(rows, view.area_m2, view.surface, view.position_m).of(one, other)
    np.testing.assert_array_equal(found[0], 0.0)
    np.testing.assert_array_equal(matrices_of(found), 0.0)
    assert strengths_of(matrices_of(found)).tolist() == [0.0, 0.0]
    assert strengths_of(np.empty((0, 6, 6))).shape == (0,)


# ------------------------------------------------------------------------- what the strength says about errors
@pytest.mark.parametrize("seed", range(4))
def test_surface_errors_are_enlarged_by_at_most_the_root_of_three_over_the_strength(make_view, seed):
    view = make_view(seed)
    rng = np.random.default_rng(seed)
    first, second, _ = all_pairs(view, min_overlap=0.2)
    matrices = matrices_of(PairSums(view.visibility, view.area_m2, view.surface, view.position_m).of(first, second))
    closest = 0.0
    for i, j, matrix in zip(first, second, matrices, strict=True):
        value, vector = np.linalg.eigh(matrix)
        if value[0] < 1e-6:
            continue
        both = view.common(i, j)
        weight = view.area_m2[both] / view.area_m2[both].sum()
        arm = view.surface.centroid_m[both] - weight @ view.surface.centroid_m[both]
        rows = np.concatenate(
            [view.surface.normal[both], np.cross(arm, view.surface.normal[both]) / np.sqrt(weight @ (arm**2).sum(1))],
            axis=1,
        )
        bound = 1.0 / np.sqrt(value[0])  # the root of 3 / strength
        worst = np.sign(rows @ vector[:, 0])  # every surface is off by 1, in the direction that hurts
        for error in (worst, rng.choice([-1.0, 1.0], both.size), rng.uniform(-1.0, 1.0, both.size)):
            moved = np.linalg.solve(matrix, rows.T @ (weight * error))
            assert np.linalg.norm(moved) <= bound * (1 + 1e-9), (seed, i, j)
            closest = max(closest, np.linalg.norm(moved) / bound)
    assert closest > 0.5, "a bound that nothing comes near says little"


def test_matrices_of_common_patches_are_those_of_pairs_bit_by_bit(make_view):
    view = make_view(1)
    first, second, _ = all_pairs(view, min_overlap=0.05)
    rows = [view.visibility.patch[a:b] for a, b in pairwise(view.visibility.starts.tolist())]
    common = [np.intersect1d(rows[a], rows[b]) for a, b in zip(first, second, strict=True)]
    sums = patch_sums(view.area_m2, view.surface.centroid_m, view.surface.normal)
    expected = PairSums(view.visibility, view.area_m2, view.surface, view.position_m).of(first, second)
    at_m = view.position_m
    assert first.size > 10 and common_sums(common, sums, at_m[first], at_m[second]).tobytes() == expected.tobytes()
    assert common_sums([], sums, at_m[:0], at_m[:0]).shape == (0, 30)


def test_pairs_that_see_whole_blocks_have_the_matrix_of_their_common_patches(make_view):
    view = make_view(1)
    n = view.area_m2.size
    rows = [np.arange(n), np.arange(n // 2), np.arange(n // 4, n), np.array([0, n - 1])]
    first, second = (np.array(each, dtype=np.int32) for each in zip(*combinations(range(len(rows)), 2), strict=True))
    common = [np.intersect1d(rows[a], rows[b]) for a, b in zip(first, second, strict=True)]
    at_m = view.position_m
    found = PairSums(view.with_rows(rows).visibility, view.area_m2, view.surface, at_m).of(first, second)
    sums = patch_sums(view.area_m2, view.surface.centroid_m, view.surface.normal)
    assert n > 3 * BLOCK and found.tobytes() == common_sums(common, sums, at_m[first], at_m[second]).tobytes()
    for matrix, both in zip(matrices_of(found), common, strict=True):
        if both.size > 2:
            expected = differentiated(view.area_m2[both], view.surface.centroid_m[both], view.surface.normal[both])
            np.testing.assert_allclose(matrix, expected, atol=1e-8)
