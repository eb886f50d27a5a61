"""What an engine refuses before anything reaches a device."""

import numpy as np
import pytest

from planner_core.engine.scan_engine import check_positions
from planner_core.errors import RequirementError


@pytest.mark.parametrize("far_m", [1.1e5, 1e20, 1e30, -1e30])
def test_a_position_out_of_reach_is_refused_because_the_kernels_would_overflow(far_m: float) -> None:
    with pytest.raises(RequirementError, match=r"row 1 .* 100 km"):
        check_positions(np.array([[0.0, 0.0, 0.0], [0.0, far_m, 0.0]]))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_position_that_is_not_finite_is_refused_with_its_row(bad: float) -> None:
    with pytest.raises(RequirementError, match="row 0"):
        check_positions(np.array([[bad, 0.0, 0.0]]))
