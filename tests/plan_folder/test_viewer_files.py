"""The browser's binary files: quantised ranges within half a step, patches byte by byte."""

import dataclasses
import zlib

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from oracles import read_cloud

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BeamTemplate, Plan
from planner_core.plan_folder.viewer_layers import packed_cloud, patches_bytes, range_step_m

TEMPLATE = BeamTemplate(np.arange(5) * 0.4, np.array([0.3, 0.0, -0.3]), 0.0, 50.0)


@given(values=st.lists(st.one_of(st.none(), st.floats(0, 50, width=32)), min_size=15, max_size=15))
def test_cloud_ranges_read_back_within_half_a_step(values: list[float | None]) -> None:
    range_m = np.array([np.nan if v is None else v for v in values], dtype=np.float32).reshape(TEMPLATE.shape)
    cosine = np.where(np.isnan(range_m), np.nan, 0.5).astype(np.float32)
    back, intensity = read_cloud(packed_cloud(range_m, cosine, TEMPLATE), TEMPLATE)
    np.testing.assert_array_equal(np.isnan(back), np.isnan(range_m))
    hit = ~np.isnan(range_m)
    # A return nearer than half a step would round to 0, which means no return: it gets one step.
    slack = np.where(range_m[hit] < range_step_m(TEMPLATE) / 2, 1.0, 0.5) * range_step_m(TEMPLATE) * (1 + 1e-6)
    assert (np.abs(back[hit] - range_m[hit]) <= slack).all()
    np.testing.assert_array_equal(intensity, np.where(hit, 128, 0))


def test_cloud_layout_is_deflated_differences_of_ranges_then_of_intensities() -> None:
    range_m = np.full(TEMPLATE.shape, np.nan, dtype=np.float32)
    range_m[0, 1] = 50.0
    range_m[2, 4] = 25.0
    content = packed_cloud(range_m, np.where(np.isnan(range_m), np.nan, 1).astype(np.float32), TEMPLATE)
    unpacked = zlib.decompress(content)
    assert len(unpacked) == 3 * 15
    # Row 0: 0, then the largest step, then down again; row 2 ends with half of it.
    assert unpacked[2:6] == b"\xff\xff\x01\x00"
    assert int.from_bytes(unpacked[28:30], "little") in (32767, 32768)
    assert (unpacked[30 + 1], unpacked[30 + 2], unpacked[30 + 14]) == (255, 1, 255)


def test_cloud_of_a_real_scan_keeps_every_return(plan: Plan, engine: ScanEngine) -> None:
    template = plan.survey.template
    scan = engine.scan(template, plan.stations[0].position_m[None])
    back, _ = read_cloud(packed_cloud(scan.range_m[0], scan.cos_incidence[0], template), template)
    np.testing.assert_array_equal(np.isnan(back), scan.triangle[0] < 0)
    np.testing.assert_allclose(back, scan.range_m[0], atol=0.51 * range_step_m(template))


def test_patches_are_counts_with_255_for_what_nobody_can_see(plan: Plan) -> None:
    times = np.array([0, 1, 254, 255, 3000, 0], dtype=np.int32)
    achievable = np.array([1, 1, 1, 1, 1, 0], dtype=np.bool_)
    assert list(patches_bytes(times, achievable)) == [0, 1, 254, 254, 254, 255]
    assert len(patches_bytes(plan.times_seen, plan.achievable)) == plan.survey.patches.n_patches


def test_range_step_is_the_range_over_65535() -> None:
    assert range_step_m(dataclasses.replace(TEMPLATE, range_max_m=65.535)) == 0.001
