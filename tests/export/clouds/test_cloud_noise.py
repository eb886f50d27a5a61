"""Noise of clouds against the figures that it is drawn by: sigma, distribution, independence, dropouts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cloud_room import FRAME, REFLECTIVITY, SCANNER, edited_plan, expected_scan
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from planner_core.coverage.observations import Observations, with_noise
from planner_core.errors import ExportError
from planner_core.export.clouds.noise import deviates, noise_model
from planner_core.export.clouds.points import Clouds, open_clouds
from planner_core.export.options import Options
from planner_core.model import Scanner
from planner_core.plan_folder.plan_source import PlanSource, open_plan

MASK = 2**64 - 1
#: Least probability of what is seen, were the model true; seeds are fixed, so a test fails always or never.
RARE = 1e-3


def philox(counter: int, key: tuple[int, int]) -> list[int]:
    """Philox4x64-10 by Salmon et al. 2011, in whole numbers of Python."""
    c, k = [counter, 0, 0, 0], list(key)
    for _ in range(10):
        high0, low0 = divmod(0xD2E7470EE14C6C93 * c[0], 2**64)
        high1, low1 = divmod(0xCA5A826395121157 * c[2], 2**64)
        c = [high1 ^ c[1] ^ k[0], low1, high0 ^ c[3] ^ k[1], low0]
        k = [(k[0] + 0x9E3779B97F4A7C15) & MASK, (k[1] + 0xBB67AE8584CAA73B) & MASK]
    return c


def test_philox_of_this_test_is_the_published_one() -> None:
    expected = [0x16554D9ECA36314C, 0xDB20FE9D672D0FDC, 0xD7E772CEE186176B, 0x7E68B68AEC7BA23B]
    assert philox(0, (0, 0)) == expected  # of the authors' known answers


def test_deviates_are_those_of_the_beams_counter() -> None:
    import hashlib

    station = int.from_bytes(hashlib.sha256(b"S007").digest()[:8], "little")
    found = deviates(11, "S007", first_beam=1_000_000, n_beams=3)
    for beam in range(3):
        # NumPy counts on before it draws.
        u = [((word >> 11) + 1) * 2.0**-53 for word in philox(1_000_001 + beam, (11, station))]
        first, second = np.sqrt(-2 * np.log(u[0])), np.sqrt(-2 * np.log(u[2]))
        expected = (
            first * np.cos(2 * np.pi * u[1]),
            second * np.cos(2 * np.pi * u[3]),
            second * np.sin(2 * np.pi * u[3]),
        )
        np.testing.assert_allclose(found[beam], expected, rtol=1e-13)


@given(st.integers(0, 2**63), st.integers(0, 10**9), st.integers(1, 40), st.integers(1, 40))
@settings(max_examples=50, deadline=None)
def test_deviates_do_not_depend_on_how_beams_are_cut(seed: int, first: int, n_one: int, n_other: int) -> None:
    together = deviates(seed, "S001", first_beam=first, n_beams=n_one + n_other)
    apart = [
        deviates(seed, "S001", first_beam=first, n_beams=n_one),
        deviates(seed, "S001", first_beam=first + n_one, n_beams=n_other),
    ]
    np.testing.assert_array_equal(together, np.concatenate(apart))


@pytest.mark.slow
def test_deviates_are_normal_and_independent() -> None:
    drawn = deviates(0, "S001", first_beam=0, n_beams=200_000)
    for column in drawn.T:
        assert stats.kstest(column, "norm").pvalue > RARE
    correlation = np.corrcoef(drawn.T) - np.eye(3)
    assert np.abs(correlation).max() < 4 / np.sqrt(len(drawn))
    neighbours = np.corrcoef(drawn[:-1, 0], drawn[1:, 0])[0, 1]
    assert abs(neighbours) < 4 / np.sqrt(len(drawn))
    for other in (
        deviates(1, "S001", first_beam=0, n_beams=200_000),
        deviates(0, "S002", first_beam=0, n_beams=200_000),
    ):
        assert abs(np.corrcoef(drawn[:, 0], other[:, 0])[0, 1]) < 4 / np.sqrt(len(drawn))


# ------------------------------------------------------------------------------------------------ sigma
@given(st.floats(1.0, 10.0), st.floats(0.1, 0.8))
@settings(max_examples=100, deadline=None)
def test_sigma_is_what_requirements_are_judged_by_where_the_table_reaches(range_m: float, returned: float) -> None:
    observations = Observations(
        starts=np.array([0, 1]), patch=np.zeros(1, np.int32), n_patches=1, spacing_m=np.zeros(1, np.float32),
        range_m=np.array([range_m], np.float32), incidence_rad=np.array([np.arccos(returned)], np.float32),
    )  # fmt: skip
    judged = with_noise(observations, SCANNER, reflectivity=1.0).noise_m
    assert judged is not None
    drawn_by = noise_model(SCANNER).range_sigma_m(np.array([range_m]), np.array([returned]))
    # The border of the table is one of float32 there.
    if np.isfinite(judged[0]):
        np.testing.assert_allclose(drawn_by, judged, rtol=1e-4)


def test_sigma_beyond_the_table_grows_as_the_signal_falls() -> None:
    model = noise_model(SCANNER)
    at = {
        "nearer": (0.5, 0.8, 0.0004),
        "whiter": (1.0, 1.0, 0.0004),
        "darker, a quarter": (1.0, 0.025, 0.0008 * 2),
        "twice as far": (40.0, 0.8, 0.001 * 2),
        "twice as far and a quarter": (20.0, 0.025, 0.002 * 2 * 2),
        # 0.1 has no figure at 20 m: 0.002 * 2; half way to 0.8, which has one.
        "between, one of them unknown": (20.0, 0.45, (0.004 + 0.001) / 2),
    }
    range_m, returned, expected = (np.array(column) for column in zip(*at.values(), strict=True))
    np.testing.assert_allclose(model.range_sigma_m(range_m, returned), expected, rtol=1e-12)
    assert model.beyond_table(range_m, returned).all()
    assert not model.beyond_table(np.array([5.0]), np.array([0.5])).any()


@pytest.mark.slow
@given(st.floats(0.2, 60.0), st.floats(0.005, 1.0))
@settings(max_examples=200, deadline=None)
def test_sigma_makes_no_leap_and_is_positive(range_m: float, returned: float) -> None:
    model = noise_model(SCANNER)
    sigma = model.range_sigma_m(np.array([range_m, range_m * (1 + 1e-9)]), np.array([returned, returned * (1 - 1e-9)]))
    assert sigma[0] >= 0.0004 - 1e-12
    np.testing.assert_allclose(sigma[0], sigma[1], rtol=1e-6)


def test_sigma_of_one_row_alone_is_known_everywhere() -> None:
    model = noise_model(replace(SCANNER, range_noise=((10.0, 0.5, 0.001),)))
    range_m, returned = np.array([10.0, 10.0, 5.0, 20.0]), np.array([0.5, 0.125, 0.9, 0.5])
    np.testing.assert_allclose(model.range_sigma_m(range_m, returned), [0.001, 0.002, 0.001, 0.002])


def test_a_scanner_without_table_scatters_by_its_ranging_accuracy() -> None:
    model = noise_model(replace(SCANNER, range_noise=(), ranging_accuracy=(0.001, 1e-4)))
    range_m = np.array([1.0, 50.0])
    np.testing.assert_allclose(model.range_sigma_m(range_m, np.array([0.9, 0.1])), 0.001 + 1e-4 * range_m)
    assert not model.beyond_table(range_m, np.array([0.9, 0.001])).any()


def test_a_scanner_without_figures_has_no_noise_to_draw(plan_folder: Path, tmp_path: Path) -> None:
    bare = replace(SCANNER, range_noise=(), ranging_accuracy=None)
    with pytest.raises(ExportError, match=r"scanner test has no figures of range noise.*leave --noise out"):
        noise_model(bare)
    folder = edited_plan(plan_folder, tmp_path, range_noise=[], ranging_accuracy=None)
    with pytest.raises(ExportError, match="no figures"):
        open_clouds(open_plan(folder), Options(noise=True))


# --------------------------------------------------------------------------------------------- of clouds
def noisy(source: PlanSource, seed: int = 0) -> Clouds:
    return open_clouds(source, Options(noise=True, seed=seed))


def of_first(clouds: Clouds) -> np.ndarray:
    return np.concatenate([block.range_m for block in clouds.blocks(clouds.stations[0])])


def chi_squared_p(standard: np.ndarray, n_bins: int = 40) -> float:
    """Probability of worse counts in bins that a standard normal fills evenly."""
    edges = stats.norm.ppf(np.linspace(0, 1, n_bins + 1))
    counts, _ = np.histogram(standard, bins=edges)
    return float(stats.chisquare(counts).pvalue)


def test_ranges_scatter_by_the_table_at_their_range_and_incidence(source: PlanSource) -> None:
    exact, clouds = of_first(open_clouds(source, Options())), noisy(source, seed=1)
    expected = expected_scan("S001")
    residual = of_first(clouds) - exact
    # The table by hand: linear in range in each of its two reflectivities, then between these.
    dark = np.interp(expected.range_m, [1, 10], [0.0008, 0.002])
    white = np.interp(expected.range_m, [1, 20], [0.0004, 0.001])
    share = (REFLECTIVITY * expected.cosine - 0.1) / 0.7
    inside = np.isfinite(residual) & (share >= 0) & (expected.range_m >= 1)
    standard = residual[inside] / (dark + share * (white - dark))[inside]
    assert standard.size > 10_000
    assert chi_squared_p(standard) > RARE
    wrong_by_a_tenth = standard * 1.1
    assert chi_squared_p(wrong_by_a_tenth) < RARE


def test_angles_scatter_by_the_scanners_accuracy(source: PlanSource) -> None:
    clouds = noisy(source, seed=2)
    (points,) = clouds.points(clouds.stations[0])
    x, y, z = points.from_sensor_m.T
    elevation = np.arctan2(z, np.hypot(x, y)) - np.array(SCANNER.elevation_rad)[points.row]
    azimuth = np.arctan2(y, x) - 2 * np.pi * points.column / SCANNER.n_azimuths
    below_zenith = points.row > 2  # above, an azimuth may turn round
    assert chi_squared_p(elevation[below_zenith] / 1e-4) > RARE
    assert chi_squared_p(((azimuth + np.pi) % (2 * np.pi) - np.pi)[below_zenith] / 1e-4) > RARE


def test_without_noise_clouds_are_exact_and_have_no_seed(source: PlanSource) -> None:
    one, other = (of_first(open_clouds(source, Options(seed=seed))) for seed in (0, 1))
    np.testing.assert_array_equal(one, other)
    np.testing.assert_allclose(one, expected_scan("S001").range_m, atol=2e-5)


@pytest.mark.slow
def test_a_seed_gives_the_same_noise_again_and_another_seed_another(source: PlanSource) -> None:
    np.testing.assert_array_equal(of_first(noisy(source, 4)), of_first(noisy(source, 4)))
    assert (of_first(noisy(source, 4)) != of_first(noisy(source, 5))).mean() > 0.99


def test_weak_returns_drop_out_by_range_incidence_and_reflectivity(plan_folder: Path, tmp_path: Path) -> None:
    # Without table: 90 % white is seen up to 5 m, so 60 % to 4.08 m head on, and less far aslant.
    folder = edited_plan(plan_folder, tmp_path, range_noise=[], ranging_accuracy=[1e-6, 0.0], range_max_m=5.0)
    clouds = noisy(open_plan(folder, frame=FRAME))
    found = np.isfinite(of_first(clouds))
    expected = expected_scan("S001", replace(SCANNER, range_max_m=5.0))
    with np.errstate(invalid="ignore"):
        strong = REFLECTIVITY * expected.cosine / expected.range_m**2 >= 0.9 / 5.0**2
    np.testing.assert_array_equal(found, strong)
    n_hit = int(np.isfinite(expected.range_m).sum())
    assert 0 < clouds.tally.n_dropped == n_hit - found.sum()
    assert f"{clouds.tally.n_dropped} weak returns dropped" in " ".join(clouds.remarks())


def test_what_a_data_sheet_has_a_figure_for_does_not_drop_out() -> None:
    dim: Scanner = replace(SCANNER, range_max_m=5.0)  # its table goes on to 0.1 at 10 m
    model = noise_model(dim)
    assert model.least_signal == pytest.approx(0.1 / 10.0**2)
    assert model.comes_back(np.array([5.0, 5.0, np.nan]), np.array([0.03, 0.02, np.nan])).tolist() == [
        True,
        False,
        False,
    ]


def test_noise_takes_no_range_out_of_the_scanners_own(plan_folder: Path, tmp_path: Path) -> None:
    folder = edited_plan(
        plan_folder, tmp_path, range_noise=[[1.0, 0.01, 0.5]], range_min_m=1.5, range_max_m=4.0
    )  # a scanner that is half a metre off, which no scanner is
    clouds = noisy(open_plan(folder))
    range_m = of_first(clouds)
    kept = np.isfinite(range_m)
    assert range_m[kept].min() >= 1.5
    assert range_m[kept].max() <= 4.0
    assert clouds.tally.n_dropped > 100


def test_remarks_tell_what_noise_was_drawn_by(source: PlanSource, plan_folder: Path, tmp_path: Path) -> None:
    clouds = noisy(source)
    of_first(clouds)
    told = " ".join(clouds.remarks())
    assert "by its table of range noise, angles by 20.6 arcseconds" in told
    assert "outside" not in told
    narrow = noisy(
        open_plan(edited_plan(plan_folder, tmp_path / "narrow", range_noise=[[1.0, 0.4, 1e-9], [9.0, 0.4, 1e-9]]))
    )
    of_first(narrow)
    n_beyond = (np.abs(REFLECTIVITY * expected_scan("S001").cosine - 0.4) > 1e-9).sum()
    assert f"{n_beyond} of {SCANNER.n_beams} points lie outside" in " ".join(narrow.remarks())
    other = noisy(open_plan(edited_plan(plan_folder, tmp_path / "none", range_noise=[], ranging_accuracy=[0.001, 0.0],
                                        angular_accuracy_rad=None)))  # fmt: skip
    of_first(other)
    assert "by its ranging accuracy, taken as one sigma, no angles" in " ".join(other.remarks())
    (points,) = other.points(other.stations[0])
    exact = np.array(SCANNER.elevation_rad)[points.row]
    np.testing.assert_array_equal(points.elevation_rad, exact)
