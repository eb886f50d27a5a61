"""Bounds, normals, products and lengths of many are NumPy's without rounding, which plans' bytes hang on."""

import numpy as np
import pytest

from planner_core.model.arrays import area_normals, bounds_of, dots, lengths


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("n", [0, 1, 1000])
def test_they_are_those_of_numpy(n: int, dtype: type) -> None:
    corners = (1e6 + np.random.default_rng(7).normal(size=(n, 3, 3))).astype(dtype)
    for some in (corners, corners[:, :, 2], corners[:, :2, :2]):
        low, high = bounds_of(some)
        np.testing.assert_array_equal([low, high], [some.min(axis=1), some.max(axis=1)])
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    for k in (2, 3):
        np.testing.assert_array_equal(dots(a[:, :k], b[:, :k]), (a[:, :k] * b[:, :k]).sum(axis=1))
        np.testing.assert_array_equal(lengths(a[:, :k]), np.linalg.norm(a[:, :k], axis=1))
    np.testing.assert_array_equal(area_normals(corners), np.cross(a, b))
