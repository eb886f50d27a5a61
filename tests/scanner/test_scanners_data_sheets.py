"""The survey scanners that come along, against figures typed here by hand from the sources that their files name."""

import math

import numpy as np
import pytest

from planner_core.scanner.load_scanner import MAX_BEAMS, list_scanners, load_scanner, scan_modes
from planner_core.scanner.template import make_template

# name, range in m, vertical field in degrees, default mode, its step in degrees, seconds
SHEETS = [
    ("rtc360", (0.5, 130.0), (90.0, -60.0), "medium", math.degrees(0.0006), 111.0),
    ("blk360-g2", (0.5, 45.0), (90.0, -45.0), "dense", math.degrees(0.0012), 30.0),
    ("p50", (0.4, 1000.0), (90.0, -55.0), "6.3mm", math.degrees(0.00063), None),
    ("vz-400i", (0.0, 800.0), (60.0, -40.0), "panorama-40", 0.04, None),
    ("imager-5016", (0.3, 360.0), (90.0, -70.0), "6mm", math.degrees(0.0006), None),
]


@pytest.mark.parametrize(("name", "range_m", "field_deg", "mode", "step_deg", "seconds"), SHEETS)
def test_a_survey_scanner_is_as_its_sources_say(
    name: str,
    range_m: tuple[float, float],
    field_deg: tuple[float, float],
    mode: str,
    step_deg: float,
    seconds: float | None,
) -> None:
    scanner = load_scanner(name)
    assert (scanner.range_min_m, scanner.range_max_m) == range_m
    assert (scanner.mode, scanner.seconds_per_scan) == (mode, seconds)
    elevation_deg = np.rad2deg(scanner.elevation_rad)
    assert (elevation_deg[0], elevation_deg[-1]) == pytest.approx(field_deg, abs=1e-12)
    # Even beams, off the sheet's step by no more than rounding to a whole number of steps makes.
    assert 360.0 / scanner.n_azimuths == pytest.approx(step_deg, rel=0.5 / scanner.n_azimuths)
    assert np.ptp(np.diff(elevation_deg)) < 1e-10
    assert -np.diff(elevation_deg)[0] == pytest.approx(step_deg, rel=0.5 / (scanner.n_channels - 1))
    assert scanner.azimuth_range_rad is None
    assert not scanner.inverted


MODES = {
    "rtc360": {"low": (12.0, 86.0), "medium": (6.0, 111.0), "high": (3.0, 162.0)},
    "blk360-g2": {"fast-plus": (50.0, 7.0), "fast": (25.0, 13.0), "dense": (12.0, 30.0), "dense-plus": (6.0, 75.0)},
    "p50": {f"{mm:g}mm": (mm, None) for mm in (50.0, 25.0, 12.5, 6.3, 3.1, 1.6, 0.8)},
    "imager-5016": {"extremely-high": (0.8, None)},
}


@pytest.mark.parametrize("name", MODES)
def test_modes_have_the_spacings_and_seconds_of_their_sources(name: str) -> None:
    found = {
        mode.id: (round(mode.azimuth_step_rad * 10_000, 9), mode.seconds)
        for mode in scan_modes(name)
        if mode.azimuth_step_rad == mode.elevation_step_rad
    }
    assert found == MODES[name]


def test_accuracy_and_beam_are_as_their_sources_say() -> None:
    rtc360, p50, vz, imager = (load_scanner(name) for name in ("rtc360", "p50", "vz-400i", "imager-5016"))
    assert rtc360.ranging_accuracy == pytest.approx((0.001, 10e-6))
    assert rtc360.angular_accuracy_rad == pytest.approx(18 / 3600 * math.pi / 180)
    assert p50.angular_accuracy_rad == pytest.approx(8 / 3600 * math.pi / 180)
    assert p50.ranging_accuracy == pytest.approx((0.003, 0.0))
    assert vz.ranging_accuracy == pytest.approx((0.005, 0.0))
    assert p50.dual_axis_compensator
    assert (vz.beam_divergence_rad, vz.beam_width_at) == (pytest.approx(0.35e-3), "1/e2")
    assert (imager.beam_divergence_rad, imager.wavelength_m) == (pytest.approx(0.6e-3), pytest.approx(1500e-9))
    assert imager.angular_accuracy_rad == pytest.approx(14.4 / 3600 * math.pi / 180)


def test_the_beam_of_the_blk360_g2_is_as_its_source_says() -> None:
    scanner = load_scanner("blk360-g2")
    assert (scanner.beam_divergence_rad, scanner.beam_diameter_m) == (pytest.approx(0.4e-3), pytest.approx(2.25e-3))
    assert (scanner.beam_width_at, scanner.wavelength_m) == ("FWHM", pytest.approx(830e-9))
    assert scanner.ranging_accuracy is None, "4 mm at 10 m are of a point, angles included"


def test_only_the_field_of_view_of_the_x7_is_unconfirmed() -> None:
    scanner = load_scanner("x7")
    assert scanner.ranging_accuracy == pytest.approx((0.002, 0.0))
    assert "field of view unconfirmed" in scanner.title
    assert not scanner.range_noise, "one bound at 60 m is no table"


def test_accuracy_of_the_hdl_64e_is_what_two_simulators_quote() -> None:
    scanner = load_scanner("hdl-64e")
    assert scanner.ranging_accuracy == pytest.approx((0.02, 0.0))
    assert scanner.wavelength_m == pytest.approx(905e-9)
    assert "blensor" in scanner.source and "helios" in scanner.source


def test_the_nominal_channels_of_the_hdl_64e_are_two_even_blocks() -> None:
    """+2 to -8.33 at 1/3 degree, -8.83 to -24.33 at 1/2 degree: 32 each, half a degree between the blocks."""
    scanner = load_scanner("hdl-64e:channels")
    elevation_deg = np.rad2deg(scanner.elevation_rad)
    assert (scanner.n_azimuths, elevation_deg.size) == (4500, 64)
    assert (elevation_deg[0], elevation_deg[31]) == pytest.approx((2.0, -8.33), abs=0.005)
    assert (elevation_deg[32], elevation_deg[-1]) == pytest.approx((-8.83, -24.33))
    np.testing.assert_allclose(-np.diff(elevation_deg[:32]), 1 / 3, atol=2e-4)
    np.testing.assert_allclose(-np.diff(elevation_deg[32:]), 1 / 2, atol=1e-9)
    assert "unconfirmed" in scanner.title and "A-LOAM" in scanner.source
    plain = load_scanner("hdl-64e")
    np.testing.assert_allclose(np.rad2deg(plain.elevation_rad), np.linspace(2.0, -24.9, 64))
    assert "unconfirmed" not in plain.title
    assert (scanner.range_max_m, scanner.ranging_accuracy) == (plain.range_max_m, plain.ranging_accuracy)


def test_scanners_whose_ranges_are_not_told_to_scatter_are_these() -> None:
    silent = [each.name for each in list_scanners() if each.ranging_accuracy is None]
    assert silent == ["blk360-g2", "pandar64", "x12", "x9"]


def test_what_no_source_tells_is_absent() -> None:
    assert all(scanner.range_noise == () for scanner in list_scanners())
    assert load_scanner("rtc360").beam_divergence_rad is None
    assert load_scanner("rtc360").dual_axis_compensator is None
    assert load_scanner("hdl-64e").seconds_per_scan is None
    assert load_scanner("hdl-64e").mode == ""


@pytest.mark.parametrize("scanner", list_scanners(), ids=lambda scanner: scanner.name)
def test_every_scanner_has_a_template_of_its_beams(scanner) -> None:  # type: ignore[no-untyped-def]
    template = make_template(scanner)
    assert template.shape == (scanner.n_channels, scanner.n_azimuths)
    assert scanner.n_beams <= MAX_BEAMS
    assert scanner.source.strip()
    assert "://" not in scanner.source, "no addresses in the repository"


@pytest.mark.parametrize(
    ("name", "height_m", "radius_m"), [("rtc360", 1.5, 1.5 / math.sqrt(3)), ("blk360-g2", 1.5, 1.5)]
)
def test_the_blind_spot_below_follows_from_the_field(name: str, height_m: float, radius_m: float) -> None:
    """Lowest beam 60 (45) degrees down: from 1.5 m the floor is blind within 1.5 / tan 60 (1.5 / tan 45)."""
    lowest_rad = load_scanner(name).elevation_rad[-1]
    assert height_m / math.tan(-lowest_rad) == pytest.approx(radius_m)


# name, range in m, vertical field in degrees: recalled from data sheets that could not be opened
UNCONFIRMED = [
    ("focus-premium-70", (0.5, 70.0), 300.0),
    ("focus-premium-150", (0.5, 150.0), 300.0),
    ("focus-premium-350", (0.5, 350.0), 300.0),
    ("x7", (0.6, 80.0), 282.0),  # field alone
    ("x9", (0.6, 150.0), 282.0),
    ("x12", (0.3, 365.0), 320.0),
]


@pytest.mark.parametrize(("name", "range_m", "field_deg"), UNCONFIRMED)
def test_an_unconfirmed_scanner_says_so_and_holds_no_more_than_a_plan_needs(
    name: str, range_m: tuple[float, float], field_deg: float
) -> None:
    scanner = load_scanner(name)
    assert "unconfirmed" in scanner.title
    assert "recalled, not looked up" in scanner.source
    assert (scanner.range_min_m, scanner.range_max_m) == range_m
    # A field of f degrees about the horizontal axis reaches the zenith and ends f / 2 from it on either side.
    below_deg = field_deg / 2 - 90.0
    assert np.rad2deg(scanner.elevation_rad[-1]) == pytest.approx(-below_deg, abs=1e-9)
    assert [mode.id for mode in scan_modes(name)] == ["ours"]
    assert scanner.seconds_per_scan is None
    assert scanner.beam_divergence_rad is None
    assert not scanner.range_noise
