"""Places that have gone through a file: the same ones, bit by bit, wherever the scene lies."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.plan_folder.plan_json import _number
from planner_core.positions.rounding import SET_UP_DIGITS, as_written_m, local_of_written_m

METRES = st.floats(-2000.0, 2000.0)
#: Offsets are whole metres, up to those of national grids.
OFFSETS = st.integers(-9_999_999, 9_999_999)


@settings(max_examples=200, deadline=None)
@given(place_m=st.tuples(METRES, METRES, METRES), offset_m=st.tuples(OFFSETS, OFFSETS, OFFSETS))
def test_a_place_is_the_same_once_plan_json_has_kept_it(place_m, offset_m):
    for digits in (6, SET_UP_DIGITS):
        local_m = as_written_m(np.array(place_m), digits)
        scene_m = local_m + np.array(offset_m, dtype=np.float64)
        kept = json.loads(json.dumps([_number(float(value)) for value in scene_m]))
        back_m = local_of_written_m(kept, np.array(offset_m, dtype=np.float64))
        assert back_m.tobytes() == local_m.tobytes()


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(value_m=METRES)
def test_rounded_places_stay_as_they_are_and_are_near(value_m):
    rounded_m = as_written_m(np.array([value_m]))
    assert as_written_m(rounded_m).tobytes() == rounded_m.tobytes()
    assert abs(rounded_m[0] - value_m) <= 0.5e-6 + 1e-12
    assert not np.signbit(as_written_m(np.array([-1e-9])))[0]
