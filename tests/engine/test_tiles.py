"""Tiles: every beam in one place alone, and inside the pyramid that bounds its tile."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.engine.tiles import TileGrid, make_tiles
from planner_core.errors import RequirementError
from planner_core.model import BeamTemplate
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import directions, make_template

SHAPES = [(8, 32, 8), (4, 16, 8), (4, 8, 1), (2, 64, 4), (16, 64, 8)]


@st.composite
def templates(draw: st.DrawFn) -> BeamTemplate:
    """Rows from pole to pole, full turns and sectors, with offsets and without."""
    rows, columns = draw(st.integers(1, 40)), draw(st.integers(1, 300))
    low = draw(st.floats(-90, 90))
    high = draw(st.floats(low, 90))
    elevation = np.linspace(high, low, rows)
    order = draw(st.sampled_from(["even", "uneven", "any"]))
    if order != "even":  # as tables are; rows in no order are no scanner's, but a caller's may be
        elevation = np.random.default_rng(rows).uniform(low, high, rows)
        elevation = elevation if order == "any" else np.sort(elevation)[::-1]
    turn = draw(st.one_of(st.just(360.0), st.floats(0.001, 359)))
    first = draw(st.floats(-360, 0))
    offset = None
    if draw(st.booleans()):
        offset = np.deg2rad(np.random.default_rng(columns).choice([-5.2, -3.1, 0.0, 1.0, 77.0, -180.0], rows))
    return BeamTemplate(
        azimuth_rad=np.deg2rad(first) + np.arange(columns) * np.deg2rad(turn) / columns,
        elevation_rad=np.deg2rad(elevation),
        range_min_m=0.0,
        range_max_m=1.0,
        azimuth_offset_rad=offset,
    )


def beams_by_place(grid: TileGrid, shape: tuple[int, int]) -> np.ndarray:
    """Gather the beams (rows, columns, 3) from their packets, as kernels/template.h says; each has to be there once."""
    lane = np.arange(grid.beams.shape[3])
    first, lanes = (each[:, None].astype(np.int64) for each in grid.places.reshape(-1, 2).T)
    begin, end, wrap = lanes & 255, lanes >> 8 & 255, lanes >> 16 & 255
    beams = np.moveaxis(grid.beams.reshape(-1, 3, lane.size), 1, 2)
    own = (lane >= begin) & (lane < end)
    at = (first + lane - np.where(lane < wrap, 0, shape[1]))[own]
    assert np.unique(at).size == at.size, "a beam in two places"
    found = np.full((shape[0] * shape[1], 3), np.nan, dtype=np.float32)
    found[at] = beams[own]
    return found.reshape(*shape, 3)


def distinct(beams: np.ndarray) -> np.ndarray:
    """Distinct beams of an array (..., 3), sorted; 0 and -0 are the same."""
    flat = np.ascontiguousarray(beams.reshape(-1, 3) + np.float32(0))
    return np.unique(flat.view("f4,f4,f4"))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(template=templates(), shape=st.sampled_from(SHAPES))
def test_tiles_hold_every_beam_once_and_in_its_place(template: BeamTemplate, shape: tuple[int, int, int]) -> None:
    grid = make_tiles(template, tile_rows=shape[0], tile_columns=shape[1], lanes=shape[2])
    expected = directions(template).astype(np.float32)
    np.testing.assert_array_equal(beams_by_place(grid, template.shape), expected)
    # What only fills a packet up repeats a beam of the template: kernels that mark patches take it for one.
    lanes = grid.beams.transpose(0, 1, 3, 2)
    np.testing.assert_array_equal(distinct(lanes), distinct(expected))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(template=templates(), shape=st.sampled_from(SHAPES))
def test_the_pyramid_of_a_tile_holds_its_beams(template: BeamTemplate, shape: tuple[int, int, int]) -> None:
    grid = make_tiles(template, tile_rows=shape[0], tile_columns=shape[1], lanes=shape[2])
    beams = grid.beams.astype(np.float64).transpose(0, 1, 3, 2).reshape(grid.n_tiles, -1, 3)
    planes = grid.bounds[:, :12].reshape(-1, 4, 3).astype(np.float64)
    corners = grid.bounds[:, 12:24].reshape(-1, 4, 3).astype(np.float64)
    assert np.einsum("kni,kci->knc", beams, planes).min() >= 0.0
    assert (grid.bounds[:, 24] == 0).all()
    frame = grid.bounds[:, 25:34].reshape(-1, 3, 3).astype(np.float64)
    np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frame.shape), atol=1e-6)
    x, y, ahead = np.einsum("kni,kci->ckn", beams, frame[:, [1, 2, 0]])
    assert ahead.min() > 0.5, "farther than 60 degrees from the axis nothing is bounded well"
    # The kernel's slack is for corners of at most 3.3.
    assert np.linalg.norm(corners, axis=2).max() < 3.3
    # A beam is a positive sum of the corners with weights that add up to at most 1: its rectangle holds it, and the
    # corners are that rectangle's, one metre along the axis.
    seen = np.einsum("kci,kai->kca", corners, frame[:, [1, 2, 0]])
    np.testing.assert_allclose(seen[..., 2], 1.0, atol=1e-6)
    for value, axis in ((x / ahead, 0), (y / ahead, 1)):
        assert (value >= seen[..., axis].min(axis=1)[:, None] - 1e-6).all()
        assert (value <= seen[..., axis].max(axis=1)[:, None] + 1e-6).all()
    assert (ahead <= 1 + 1e-6).all()


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(template=templates(), shape=st.sampled_from(SHAPES))
def test_the_rectangle_of_a_packet_holds_its_beams(template: BeamTemplate, shape: tuple[int, int, int]) -> None:
    grid = make_tiles(template, tile_rows=shape[0], tile_columns=shape[1], lanes=shape[2])
    frame = grid.bounds[:, 25:34].reshape(-1, 3, 3).astype(np.float64)
    ahead, x, y = np.einsum("kpil,kci->ckpl", grid.beams.astype(np.float64), frame)
    for value, low, high in ((x / ahead, 0, 1), (y / ahead, 2, 3)):
        assert (value >= grid.rectangles[:, low, :, None]).all()
        assert (value <= grid.rectangles[:, high, :, None]).all()


def test_uneven_azimuths_are_refused() -> None:
    template = BeamTemplate(np.array([0.0, 0.1, 0.2, 3.0]), np.zeros(1), 0.0, 1.0)
    with pytest.raises(RequirementError, match="even"):
        make_tiles(template, tile_rows=8, tile_columns=32, lanes=8)


def test_rows_with_offsets_make_no_wider_tiles() -> None:
    template = make_template(load_scanner("pandar64"))
    grid = make_tiles(template, tile_rows=8, tile_columns=32, lanes=8)
    corners = grid.bounds[:, 12:24].reshape(-1, 4, 3)
    width = np.rad2deg(np.arctan(np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1) / 2)) * 2
    # 32 columns are 6.2 degrees wide, and rounding to whole columns adds up to one more. Unshifted it would be 16.6.
    assert np.median(width) < 6.6


@pytest.mark.parametrize("end", [90, -90])
def test_tiles_round_a_pole_are_tight(shapes: SimpleNamespace, end: int) -> None:
    template = shapes.template_of(
        60, 720, low_deg=min(end, 60.5 * np.sign(end)), high_deg=max(end, 60.5 * np.sign(end))
    )
    grid = make_tiles(template, tile_rows=8, tile_columns=32, lanes=8)
    corners = grid.bounds[:, 12:24].reshape(-1, 4, 3)
    size = np.rad2deg([np.linalg.norm(corners[:, 0] - corners[:, side], axis=1) for side in (1, 3)])
    pole = np.abs(grid.bounds[:, 27]) > np.cos(np.deg2rad(2))
    assert pole.any()
    # Eight rows of half a degree; wedges that a rectangle across the meridian would wrap loosely.
    assert size[1, pole].max() < 3.6
    assert size[0, pole].max() < 1.1


def test_a_coarse_template_makes_small_tiles(shapes: SimpleNamespace) -> None:
    """With 9 degrees from column to column a full tile would go round: nothing would be culled."""
    grid = make_tiles(shapes.template_of(90, 40, low_deg=-90, high_deg=90), tile_rows=8, tile_columns=32, lanes=8)
    corners = grid.bounds[:, 12:24].reshape(-1, 4, 3)
    assert np.rad2deg(np.arctan(np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1) / 2)).max() * 2 < 35
