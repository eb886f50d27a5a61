"""Beam templates: directions by the book, sectors, inverted mounting, bands; and scans of them as the oracle's."""

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import BeamTemplate, ScanBatch, Scanner
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import azimuth_step_rad, bands, directions, is_full_turn, make_template


@st.composite
def scanners(draw: st.DrawFn) -> Scanner:
    """Full turns and sectors, with offsets and without, upright and inverted."""
    n_channels, n_azimuths = draw(st.integers(1, 12)), draw(st.integers(2, 20))
    low, high = sorted((draw(st.floats(-90, 90)), draw(st.floats(-90, 90))))
    offsets = st.lists(st.floats(-180, 180), min_size=n_channels, max_size=n_channels)
    first = draw(st.floats(-180, 180))
    return Scanner(
        name="any",
        title="Any",
        source="made up",
        range_min_m=0.0,
        range_max_m=10.0,
        n_azimuths=n_azimuths,
        elevation_rad=tuple(np.deg2rad(np.linspace(high, low, n_channels))),
        instrument_height_min_m=1.0,
        instrument_height_max_m=2.0,
        azimuth_range_rad=draw(
            st.one_of(st.none(), st.just((math.radians(first), math.radians(first + draw(st.floats(1, 350))))))
        ),
        azimuth_offset_rad=tuple(np.deg2rad(draw(offsets))) if draw(st.booleans()) else (),
        inverted=draw(st.booleans()),
    )


def beams_by_the_book(scanner: Scanner) -> list[list[tuple[float, float, float]]]:
    """Channel by channel, from the angles in the instrument's frame, turned by half a turn about x where it hangs."""
    channels = []
    for k, elevation in enumerate(scanner.elevation_rad):
        offset = scanner.azimuth_offset_rad[k] if scanner.azimuth_offset_rad else 0.0
        beams = []
        for j in range(scanner.n_azimuths):
            if scanner.azimuth_range_rad is None:
                azimuth = 2 * math.pi * j / scanner.n_azimuths
            else:
                first, last = scanner.azimuth_range_rad
                azimuth = first + (last - first) * j / (scanner.n_azimuths - 1)
            x, y = math.cos(elevation) * math.cos(azimuth + offset), math.cos(elevation) * math.sin(azimuth + offset)
            z = math.sin(elevation)
            beams.append((x, -y, -z) if scanner.inverted else (x, y, z))
        channels.append(beams)
    return channels


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(scanner=scanners())
def test_directions_are_the_scanners_beams_in_the_scene(scanner: Scanner) -> None:
    template = make_template(scanner)
    found, expected = directions(template), np.array(beams_by_the_book(scanner))
    if scanner.inverted:
        # Channels from the highest in the scene, columns counter-clockwise as the scene sees them.
        expected = expected[::-1]
        expected = np.roll(expected[:, ::-1], 1, axis=1) if scanner.azimuth_range_rad is None else expected[:, ::-1]
    np.testing.assert_allclose(found, expected, atol=2e-15)
    assert (np.diff(template.elevation_rad) <= 0).all()
    assert (np.diff(template.azimuth_rad) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(found, axis=2), 1.0, atol=1e-15)


@settings(max_examples=50, deadline=None)
@given(scanner=scanners())
def test_step_and_full_turn_are_those_of_the_scanner(scanner: Scanner) -> None:
    template = make_template(scanner)
    assert is_full_turn(template) == (scanner.azimuth_range_rad is None)
    span = 2 * math.pi if scanner.azimuth_range_rad is None else np.subtract(*scanner.azimuth_range_rad[::-1])
    steps = scanner.n_azimuths if scanner.azimuth_range_rad is None else scanner.n_azimuths - 1
    assert azimuth_step_rad(template) == pytest.approx(span / steps)


def test_a_single_column_has_no_step_and_is_no_turn() -> None:
    template = BeamTemplate(np.zeros(1), np.zeros(1), 0.0, 1.0)
    assert azimuth_step_rad(template) == 0.0
    assert not is_full_turn(template)


@settings(max_examples=50, deadline=None)
@given(scanner=scanners(), max_beams=st.integers(1, 300))
def test_bands_are_the_template_cut_by_rows(scanner: Scanner, max_beams: int) -> None:
    template = make_template(scanner)
    whole = directions(template)
    parts = list(bands(template, max_beams=max_beams))
    first_row = 0
    for band in parts:
        assert band.first_row == first_row
        rows, columns = band.template.shape
        assert rows == 1 or rows * columns <= max_beams
        np.testing.assert_array_equal(directions(band.template), whole[first_row : first_row + rows])
        assert (band.template.range_min_m, band.template.range_max_m) == (0.0, 10.0)
        first_row += rows
    assert first_row == template.shape[0]
    if whole.shape[0] * whole.shape[1] <= max_beams:
        assert parts[0].template is template, "engines know the template they keep tiles of by its identity"


def test_bands_of_no_beams_are_refused() -> None:
    with pytest.raises(RequirementError, match="max_beams"):
        list(bands(BeamTemplate(np.zeros(1), np.zeros(1), 0.0, 1.0), max_beams=0))


def with_range(name: str, **changes: object) -> BeamTemplate:
    return replace(make_template(replace(load_scanner(name), **changes)), range_max_m=np.inf)  # type: ignore[arg-type]


TEMPLATES: dict[str, Callable[[], BeamTemplate]] = {
    "pandar64": lambda: make_template(load_scanner("pandar64")),
    "pandar64 in a sector": lambda: with_range("pandar64", n_azimuths=403, azimuth_range_rad=(-0.9, 0.5)),
    "pandar64 upside down": lambda: with_range("pandar64", inverted=True),
    "hdl-64e, half a turn, upside down": lambda: with_range(
        "hdl-64e", n_azimuths=901, azimuth_range_rad=(0.0, math.pi), inverted=True
    ),
    "dome": lambda: with_range("hdl-64e", n_azimuths=400, elevation_rad=tuple(np.deg2rad(np.linspace(90, -60, 167)))),
    "coarse sphere": lambda: with_range(
        "hdl-64e", n_azimuths=10, elevation_rad=tuple(np.deg2rad(np.linspace(90, -90, 20)))
    ),
    "one column, all round": lambda: with_range(
        "hdl-64e",
        n_azimuths=1,
        elevation_rad=tuple(np.deg2rad(np.linspace(80, -80, 200))),
        azimuth_offset_rad=tuple(np.linspace(-3, 3, 200)),
    ),
}


def unexplained(template: BeamTemplate, at_m: np.ndarray, ours: ScanBatch, oracle: ScanEngine) -> list[object]:
    """Beams of another range than the oracle's, unless it gives ours 2e-5 rad beside: those graze an edge."""
    range_a, range_b = (np.nan_to_num(x.range_m[0], nan=np.inf) for x in (ours, oracle.scan(template, at_m[None])))
    with np.errstate(invalid="ignore"):
        apart = ~((range_a == range_b) | (np.abs(range_a - range_b) <= 1e-4 * range_b))
    assert apart.mean() < 2e-4 or apart.sum() <= 1, f"{apart.sum()} of {apart.size} beams"
    beams, rng, wrong = directions(template), np.random.default_rng(2), []
    for row, column in np.argwhere(apart):
        around = beams[row, column] + 2e-5 * rng.normal(size=(64, 3))
        near = oracle.cast_rays(np.repeat(at_m[None], 64, axis=0), around, range_max_m=template.range_max_m)
        found = np.nan_to_num(near.range_m, nan=np.inf)
        mine = range_a[row, column]
        if not np.any((found == mine) | (np.abs(found - mine) <= 0.01)):
            wrong.append((row, column, mine, range_b[row, column]))
    return wrong


@pytest.mark.parametrize("name", TEMPLATES)
def test_scans_of_a_cluttered_room_are_the_oracles(open_both: Callable, shapes: SimpleNamespace, name: str) -> None:
    ours, oracle, _ = open_both(shapes.scene_of(*shapes.clutter_of(150, seed=21)))
    template, at_m = TEMPLATES[name](), np.array([0.031, -0.047, 1.373])
    batch = ours.scan(template, at_m[None])
    assert unexplained(template, at_m, batch, oracle) == []
    assert np.isfinite(batch.range_m).mean() > 0.5
    np.testing.assert_array_equal(
        ours.visible_patches(template, at_m[None]).patch, np.unique(batch.patch[batch.patch >= 0])
    )


def test_an_inverted_scan_is_the_upright_one_of_the_scene_turned_over(
    open_both: Callable, shapes: SimpleNamespace
) -> None:
    """A turn by 180 degrees about x changes signs alone: float32 arithmetic does the same either way, nearly."""
    vertices, triangles = shapes.clutter_of(60, seed=22)
    upright, inverted = (
        replace(
            make_template(
                replace(load_scanner("pandar64"), n_azimuths=181, azimuth_range_rad=(-0.7, 1.1), inverted=flag)
            ),
            range_max_m=np.inf,
        )
        for flag in (False, True)
    )
    turn = np.array([1.0, -1.0, -1.0])
    at_m = np.array([[0.05, 0.1, 1.4]])
    a = open_both(shapes.scene_of(vertices, triangles))[0].scan(inverted, at_m)
    b = open_both(shapes.scene_of(vertices * turn, triangles))[0].scan(upright, at_m * turn)
    differs = ~np.isclose(a.range_m[0], b.range_m[0, ::-1, ::-1], rtol=1e-4, equal_nan=True)
    assert differs.sum() <= 3
