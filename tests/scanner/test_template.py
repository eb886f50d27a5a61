"""Previews of beam templates: few beams, evenly left out, all of them beams of the scanner."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.model import BeamTemplate
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import (
    PREVIEW_BEAMS,
    azimuth_step_rad,
    directions,
    make_template,
    preview_template,
    window_template,
)


@pytest.mark.parametrize("name", ["rtc360:6mm", "rtc360:3mm", "hdl-64e", "blk360-g2", "pandar64"])
def test_previews_are_small_even_and_about_square(name):
    template = make_template(load_scanner(name))
    preview = preview_template(template)
    n_rows, n_columns = preview.shape
    assert n_rows * n_columns <= PREVIEW_BEAMS < 3 * n_rows * n_columns
    assert np.ptp(np.diff(preview.azimuth_rad)) < 1e-9
    assert np.isin(preview.azimuth_rad, template.azimuth_rad).all()
    assert np.isin(preview.elevation_rad, template.elevation_rad).all()
    if n_rows < template.shape[0]:  # both directions are thinned: their steps are near each other
        steps = azimuth_step_rad(preview), -float(np.diff(preview.elevation_rad).mean())
        assert max(steps) < 1.5 * min(steps)


def test_template_of_few_beams_is_its_own_preview():
    template = make_template(load_scanner("hdl-64e"))
    assert preview_template(template, max_beams=template.shape[0] * template.shape[1]) is template


@given(
    n_rows=st.integers(1, 80),
    n_columns=st.integers(1, 200),
    max_beams=st.integers(1, 3000),
    offset=st.booleans(),
)
def test_preview_beams_are_beams_of_the_template(n_rows, n_columns, max_beams, offset):
    rng = np.random.default_rng(n_rows)
    template = BeamTemplate(
        azimuth_rad=np.arange(n_columns) * 0.01,
        elevation_rad=np.linspace(0.5, -0.5, n_rows) if n_rows > 1 else np.zeros(1),
        range_min_m=0.5,
        range_max_m=50.0,
        azimuth_offset_rad=rng.normal(0, 0.01, n_rows) if offset else None,
    )
    preview = preview_template(template, max_beams=max_beams)
    assert preview.shape[0] * preview.shape[1] <= max_beams
    every = {tuple(beam) for beam in directions(template).reshape(-1, 3).round(12)}
    assert {tuple(beam) for beam in directions(preview).reshape(-1, 3).round(12)} <= every


@given(
    begin_rad=st.floats(-2 * np.pi, 2 * np.pi),
    width_rad=st.floats(1e-3, 2 * np.pi),
    low_rad=st.floats(-1.5, 1.5),
    height_rad=st.floats(0, 3),
    turn=st.booleans(),
)
def test_a_window_has_all_beams_within_it_and_even_steps(begin_rad, width_rad, low_rad, height_rad, turn):
    template = BeamTemplate(
        azimuth_rad=np.arange(90) * (2 * np.pi / 90) if turn else np.linspace(-1.0, 1.0, 41),
        elevation_rad=np.linspace(0.9, -1.1, 21),
        range_min_m=0.3,
        range_max_m=20.0,
    )
    window = window_template(template, begin_rad, width_rad, (low_rad, low_rad + height_rad))
    wanted_rows = [e for e in template.elevation_rad if low_rad <= e <= low_rad + height_rad]
    beyond_rad = (template.azimuth_rad - begin_rad) % (2 * np.pi)
    clear = np.abs(beyond_rad - width_rad) > 1e-9  # at its very end rounding decides
    n_columns = int((beyond_rad[clear] <= width_rad).sum())
    if window is None:
        assert not wanted_rows or n_columns == 0
        return
    assert window.elevation_rad.tolist() == wanted_rows
    assert window.azimuth_rad.size >= n_columns
    assert np.ptp(np.diff(window.azimuth_rad)) < 1e-9 if window.azimuth_rad.size > 1 else True
    # Every column is one of the template's, turns apart.
    turns = (window.azimuth_rad[:, None] - template.azimuth_rad[None]) / (2 * np.pi)
    assert (np.abs(turns - np.rint(turns)).min(axis=1) < 1e-9).all()
