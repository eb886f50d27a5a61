"""Range noise between the figures of a scanner's table, against hand calculation and a plain loop."""

import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import Scanner
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.range_noise import range_noise_m

#: Metres, reflectivity, sigma in metres: dark is known from 10 to 50 m, bright from 10 to 100 m.
TABLE = ((10.0, 0.1, 0.001), (50.0, 0.1, 0.005), (10.0, 0.9, 0.0005), (50.0, 0.9, 0.0013), (100.0, 0.9, 0.004))


def scanner_with(*rows: tuple[float, float, float]) -> Scanner:
    return replace(load_scanner("hdl-64e"), range_noise=tuple(rows))


@pytest.mark.parametrize(
    ("range_m", "reflectivity", "sigma_m"),
    [
        (10.0, 0.1, 0.001),
        (30.0, 0.1, 0.003),  # halfway from 1 to 5 mm
        (30.0, 0.9, 0.0009),  # halfway from 0.5 to 1.3 mm
        (75.0, 0.9, 0.00265),  # halfway from 1.3 to 4 mm
        (30.0, 0.5, 0.00195),  # halfway from 3 to 0.9 mm
        (20.0, 0.3, 0.001675),  # 2 mm and 0.7 mm, a quarter of the way
        (100.0, 0.9, 0.004),
    ],
)
def test_noise_is_linear_between_the_figures(range_m: float, reflectivity: float, sigma_m: float) -> None:
    assert range_noise_m(scanner_with(*TABLE), range_m, reflectivity=reflectivity) == pytest.approx(sigma_m, rel=1e-12)


@pytest.mark.parametrize(
    ("range_m", "reflectivity"),
    [
        (9.99, 0.1),
        (50.01, 0.1),
        (100.01, 0.9),
        (30.0, 0.0999),
        (30.0, 0.9001),
        (75.0, 0.5),  # the dark surface has no figure there
        (math.nan, 0.5),
        (30.0, math.nan),
        (math.inf, 0.9),
        (-10.0, 0.9),
    ],
)
def test_noise_outside_of_the_figures_is_nan(range_m: float, reflectivity: float) -> None:
    assert np.isnan(range_noise_m(scanner_with(*TABLE), range_m, reflectivity=reflectivity))


def test_a_scanner_without_a_table_answers_nan_of_the_shape_asked_for() -> None:
    found = range_noise_m(load_scanner("rtc360"), np.ones((2, 3)), reflectivity=0.5)
    assert found.shape == (2, 3)
    assert np.isnan(found).all()


def test_one_figure_is_known_at_its_own_place_alone() -> None:
    scanner = scanner_with((60.0, 0.8, 0.003))
    np.testing.assert_array_equal(
        range_noise_m(scanner, [59.0, 60.0, 61.0, 60.0], reflectivity=[0.8, 0.8, 0.8, 0.7]),
        [np.nan, 0.003, np.nan, np.nan],
    )


def test_a_tabulated_reflectivity_needs_no_other() -> None:
    """At 75 m the bright surface has no figure; the dark one has, 65 of 90 m from 1 to 10 mm."""
    scanner = scanner_with((10.0, 0.1, 0.001), (100.0, 0.1, 0.010), (10.0, 0.9, 0.0005), (50.0, 0.9, 0.001))
    found = range_noise_m(scanner, 75.0, reflectivity=[0.1, 0.2])
    np.testing.assert_allclose(found, [0.001 + 0.009 * 65 / 90, np.nan], rtol=1e-12)


def by_hand(rows: tuple[tuple[float, float, float], ...], range_m: float, reflectivity: float) -> float:
    """The rule of docs/formats/scanner.md in plain loops: by range on each curve, then by reflectivity."""

    def curve(one: float) -> float:
        figures = sorted((r, s) for r, known, s in rows if known == one)
        for (r0, s0), (r1, s1) in zip(figures, figures[1:] + figures[-1:], strict=True):
            if range_m == r0:
                return s0
            if r0 < range_m < r1:
                return s0 + (s1 - s0) * (range_m - r0) / (r1 - r0)
        return math.nan

    known = sorted({row[1] for row in rows})
    if reflectivity in known:
        return curve(reflectivity)
    for low, high in pairwise(known):
        if low < reflectivity < high:
            return curve(low) + (curve(high) - curve(low)) * (reflectivity - low) / (high - low)
    return math.nan


ROWS = st.dictionaries(
    st.tuples(st.integers(1, 6).map(lambda k: 10.0 * k), st.sampled_from((0.1, 0.3, 0.8))),
    st.floats(1e-4, 1e-2),
    min_size=1,
    max_size=8,
)


@given(
    figures=ROWS, range_m=st.floats(0, 80), reflectivity=st.one_of(st.sampled_from((0.1, 0.3, 0.8)), st.floats(0, 1))
)
def test_noise_agrees_with_plain_loops(
    figures: dict[tuple[float, float], float], range_m: float, reflectivity: float
) -> None:
    rows = tuple((r, one, sigma) for (r, one), sigma in figures.items())
    rows = tuple(sorted(rows, key=lambda row: (row[1], row[0])))
    found = range_noise_m(scanner_with(*rows), [range_m], reflectivity=reflectivity)
    np.testing.assert_allclose(found, [by_hand(rows, range_m, reflectivity)], rtol=1e-9)


def read(tmp_path: Path, value: object) -> Scanner:
    spec = {
        "name": "mine", "title": "My own", "source": "its manual", "range_min_m": 0.5, "range_max_m": 30,
        "n_azimuths": 8, "elevation_deg": [30, 0], "instrument_height_min_m": 1.0, "instrument_height_max_m": 1.8,
        "range_noise": value,
    }  # fmt: skip
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(spec), encoding="utf-8")
    return load_scanner(path)


def row(**change: object) -> dict[str, object]:
    return {"range_m": 10, "reflectivity": 0.8, "sigma_mm": 0.4, **change}


def test_rows_are_read_in_any_order(tmp_path: Path) -> None:
    rows = [row(range_m=20, sigma_mm=0.5), row(), row(range_m=40, reflectivity=0.1, sigma_mm=3)]
    scanner = read(tmp_path, rows)
    assert scanner.range_noise == ((40.0, 0.1, 0.003), (10.0, 0.8, 0.0004), (20.0, 0.8, 0.0005))
    assert range_noise_m(scanner, 15.0, reflectivity=0.8) == pytest.approx(0.00045)
    assert read(tmp_path, []).range_noise == ()


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ({}, "range_noise: got {}, expected a list"),
        ([row()] * 1001, "range_noise: got 1001 of them, expected at most 1000"),
        ([[10, 0.8, 0.4]], r"range_noise\[0\]: got \[10"),
        ([row(), row()], "twice at 10 m and reflectivity 0.8"),
        ([row(range_m=0)], r"range_noise\[0\].range_m: got 0"),
        ([row(), row(reflectivity=80)], r"range_noise\[1\].reflectivity: got 80"),
        ([row(reflectivity=0)], "reflectivity: got 0"),
        ([row(sigma_mm=0)], "sigma_mm: got 0"),
        ([row(sigma_mm=None)], "sigma_mm: got None"),
        ([row(sigma_m=1)], "unknown entry 'sigma_m'"),
        ([{"range_m": 10}], "got no reflectivity"),
    ],
)
def test_a_bad_row_is_named(tmp_path: Path, value: object, told: str) -> None:
    with pytest.raises(RequirementError, match=told) as caught:
        read(tmp_path, value)
    assert len(str(caught.value).splitlines()) == 1
