"""What travels: payloads are what they were made of, arrays once, and pieces of a look are the look."""

from dataclasses import replace

import numpy as np
import pytest

from planner_core.cluster import payloads
from planner_core.cluster.payloads import Packer, squeezed, unpacked, unsqueezed
from planner_core.model import VisibilityMode
from planner_core.requirements.observe_candidates import in_a_row, pack_observations, unpack_observations

from .conftest import SETTINGS, Look, assert_same_bits, made_look


@pytest.mark.parametrize("scan_mode", [VisibilityMode.PATCHES, VisibilityMode.BEAMS])
def test_plain_looks_travel_unchanged_and_pieces_are_the_whole(scan_mode: VisibilityMode) -> None:
    check(made_look(replace(SETTINGS, scan_mode=scan_mode)))


@pytest.mark.slow
def test_looks_with_limits_travel_unchanged_and_pieces_are_the_whole(look: Look) -> None:
    check(look)


def check(look: Look) -> None:
    whole, n_patches = look.here(), look.survey.patches.n_patches
    assert whole.rows.seen.patch.size > 1000, "nothing to compare"
    n_stacked = whole.rows.met.n_patches
    assert_same_bits(unpack_observations(pack_observations(whole), n_patches, n_stacked), whole)
    pieces = [look.here(look.positions_m[first : first + 20]) for first in range(0, len(look.positions_m), 20)]
    packed = [pack_observations(each) for each in pieces]
    assert packed[0] == pack_observations(look.here(look.positions_m[:20])), "the same look, the same bytes"
    assert_same_bits(in_a_row([unpack_observations(each, n_patches, n_stacked) for each in packed]), whole)


def test_a_parcel_leaves_large_arrays_to_be_sent_once(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(payloads, "_LEAST_BYTES", 64)  # the scene is small
    packer = Packer()
    one = packer.payload((look.survey, look.settings))
    other = packer.payload((look.survey, look.goals))
    assert set(one.arrays) & set(other.arrays), "arrays of the survey are the same"
    assert not any(array.tobytes() in one.body for array in one.arrays.values())
    sent = {name: unsqueezed(squeezed(array)) for name, array in one.arrays.items()}
    survey, settings = unpacked(one.body, sent)
    np.testing.assert_array_equal(survey.scene.vertices_m, look.survey.scene.vertices_m)
    np.testing.assert_array_equal(survey.patches.first_patch, look.survey.patches.first_patch)
    assert settings == look.settings
    again = Packer().payload((look.survey, look.settings))
    assert (again.digest, list(again.arrays)) == (one.digest, list(one.arrays))
    with pytest.raises(KeyError):
        unpacked(one.body, {})
