"""Layers of the viewer against figures worked out beam by beam from whole scans, in plain NumPy and float64."""

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import best_figures, joint_spacing_m, observations_from
from stages import surveyed_as

from planner_core.coverage.observations import with_noise
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import REASONS, FloatArray, Plan, PointLimits, Why
from planner_core.plan_folder.carry_over import foreign_entries
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.viewer_layers import (
    NONE,
    Layer,
    layer_file_names,
    layer_files,
    layers_of,
    seen_bytes,
)

RHO = 0.6


def sigma_m(range_m: FloatArray, reflectivity: FloatArray) -> FloatArray:
    """A plane, which tables reproduce wherever they are read between their rows."""
    return 0.001 + 0.0005 * range_m - 0.0008 * reflectivity


@pytest.fixture(scope="module")
def noisy(plan: Plan) -> Plan:
    """The plan with a scanner that knows its noise, for what sends back 0.2 to 0.9, within 5 m."""
    rows = [(r, rho) for rho in (0.2, 0.9) for r in (0.3, 2.0, 5.0)]
    table = tuple((r, rho, float(sigma_m(np.float64(r), np.float64(rho)))) for r, rho in rows)
    scanner = replace(plan.settings.scanner, range_noise=table)
    asked = replace(plan.settings.requirements, reflectivity=RHO)
    settings = replace(plan.settings, scanner=scanner, requirements=asked)
    return replace(plan, survey=surveyed_as(plan.survey, settings), settings=settings)


@pytest.fixture(scope="module")
def files(noisy: Plan, engine: ScanEngine) -> dict[str, bytes]:
    return dict(layer_files(noisy, engine))


@dataclass(frozen=True)
class Looked:
    """By station and patch, (S, P) float64; NaN where the station does not see the patch."""

    range_m: FloatArray
    incidence_deg: FloatArray
    spacing_m: FloatArray


@pytest.fixture(scope="module")
def looked(noisy: Plan, engine: ScanEngine) -> Looked:
    n_patches, area_m2 = noisy.survey.patches.n_patches, noisy.survey.patches.area_m2
    rows = []
    for station in noisy.stations:
        scan = engine.scan(noisy.survey.template, station.position_m[None])
        hit = scan.patch[0] >= 0
        patch = scan.patch[0][hit]
        n = np.bincount(patch, minlength=n_patches).astype(np.float64)
        with np.errstate(invalid="ignore", divide="ignore"):
            range_m = np.bincount(patch, scan.range_m[0][hit].astype(np.float64), n_patches) / n
            cosine = np.bincount(patch, scan.cos_incidence[0][hit].astype(np.float64), n_patches) / n
            spacing_m = np.where(n > 0, np.sqrt(area_m2 / n), np.nan)
        rows.append((range_m, np.degrees(np.arccos(np.clip(cosine, 0, 1))), spacing_m))
    return Looked(*(np.stack(each) for each in zip(*rows, strict=True)))


def document_of(files: dict[str, bytes]) -> dict[str, Any]:
    read: dict[str, Any] = json.loads(files["viewer/layers.json"])
    return read


def layer_read(files: dict[str, bytes], name: str) -> FloatArray:
    """What a viewer makes of the layer: figures (P,), NaN for none."""
    document = document_of(files)
    layer = next(layer for layer in document["layers"] if layer["id"] == name)
    steps = np.frombuffer(files[f"viewer/{layer['file']}"], dtype="<u2")
    assert steps.size == document["n_patches"]
    return np.where(steps == layer["none"], np.nan, steps * layer["step"])


def assert_within_a_step(files: dict[str, bytes], name: str, expected: FloatArray, *, more: float = 0.0) -> None:
    step = next(layer["step"] for layer in document_of(files)["layers"] if layer["id"] == name)
    found = layer_read(files, name)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.51 * step + more)


def least(figures: FloatArray) -> FloatArray:
    return np.where(np.isnan(figures).all(axis=0), np.nan, np.fmin.reduce(figures, axis=0))


def test_range_layer_is_the_least_mean_range_over_the_stations(files: dict[str, bytes], looked: Looked) -> None:
    assert_within_a_step(files, "range", least(looked.range_m))


def test_incidence_layer_is_the_least_angle_in_degrees(files: dict[str, bytes], looked: Looked) -> None:
    # Near head-on, an angle hangs on the last digits of its cosine's float32.
    assert_within_a_step(files, "incidence", least(looked.incidence_deg), more=0.05)


def test_spacing_layer_is_that_of_the_points_of_all_stations_together(files: dict[str, bytes], looked: Looked) -> None:
    density = np.nansum(looked.spacing_m**-2.0, axis=0)
    joint_m = np.where(density > 0, np.where(density > 0, density, 1.0) ** -0.5, np.nan)
    assert_within_a_step(files, "spacing", joint_m)
    several = (~np.isnan(looked.spacing_m)).sum(axis=0) > 1
    assert several.any()
    assert (joint_m[several] < np.nanmin(looked.spacing_m[:, several], axis=0)).all()


def test_noise_layer_is_the_least_noise_and_none_where_the_table_ends(files: dict[str, bytes], looked: Looked) -> None:
    back = RHO * np.cos(np.radians(looked.incidence_deg))
    known = (back >= 0.2) & (back <= 0.9) & (looked.range_m >= 0.3) & (looked.range_m <= 5.0)
    # A figure at the table's rim may fall to either side in float32.
    rim = (np.abs(back - 0.2) < 1e-4) | (np.abs(looked.range_m - 5.0) < 1e-4)
    sure = ~rim.any(axis=0)
    expected = least(np.where(known, sigma_m(looked.range_m, back), np.nan))
    found = layer_read(files, "noise")
    np.testing.assert_array_equal(np.isnan(found)[sure], np.isnan(expected)[sure])
    np.testing.assert_allclose(found[sure], expected[sure], rtol=0, atol=1e-6)
    seen = ~np.isnan(looked.range_m).all(axis=0)
    assert (np.isnan(expected) & seen).any()
    assert (~np.isnan(expected)).any()


def test_scanner_without_noise_figures_has_no_noise_layer(plan: Plan, engine: ScanEngine) -> None:
    assert [layer.id for layer in layers_of(plan.settings.scanner)] == ["range", "incidence", "spacing"]
    assert "viewer/layers/noise.u16" not in dict(layer_files(plan, engine))


def test_bits_of_a_station_are_the_patches_that_its_scan_has_returns_on(
    files: dict[str, bytes], looked: Looked, noisy: Plan
) -> None:
    total = np.zeros(noisy.survey.patches.n_patches, dtype=np.int64)
    for row, station in enumerate(noisy.stations):
        content = files[f"viewer/seen/{station.id}.bits"]
        bits = [content[patch // 8] >> (patch % 8) & 1 for patch in range(total.size)]
        np.testing.assert_array_equal(bits, ~np.isnan(looked.range_m[row]))
        assert len(content) == -(-total.size // 8)
        total += bits
    np.testing.assert_array_equal(total, noisy.times_seen)


@given(st.data())
def test_patches_seen_and_met_are_read_back_from_their_bits(data: st.DataObject) -> None:
    n_patches = data.draw(st.integers(1, 70))
    patches = st.sets(st.integers(0, n_patches - 1)).map(lambda drawn: np.array(sorted(drawn), dtype=np.int32))
    seen, met = data.draw(patches), data.draw(patches)
    n_bytes = -(-n_patches // 8)
    content = seen_bytes(seen, met, n_patches)
    assert len(content) == 2 * n_bytes
    for row, patch in ((content[:n_bytes], seen), (content[n_bytes:], met)):
        assert [p for p in range(8 * n_bytes) if row[p // 8] >> (p % 8) & 1] == patch.tolist()
    assert seen_bytes(seen, seen, n_patches) == content[:n_bytes]


def test_layers_by_samples_are_those_of_the_metrics_over_all_stations(noisy: Plan) -> None:
    engine = open_engine(noisy.survey.scene, noisy.survey.patches, engine="open3d")
    settings = replace(noisy.settings, scan_mode="patches")
    told = replace(noisy, survey=surveyed_as(noisy.survey, settings), settings=settings)
    positions_m = np.stack([station.position_m for station in told.stations])
    observations = observations_from(told.survey, told.settings, engine, positions_m)
    observations = with_noise(observations, told.settings.scanner, reflectivity=RHO)
    made = dict(layer_files(told, engine))
    expected = {
        "range": best_figures(observations, "range_m"),
        "incidence": np.degrees(best_figures(observations, "incidence_rad")),
        "noise": best_figures(observations, "noise_m"),
        "spacing": joint_spacing_m(observations),
    }
    for name, figures in expected.items():
        assert_within_a_step(made, name, np.where(np.isfinite(figures), figures, np.nan))


# --------------------------------------------------------------------------------------- steps and files
@given(st.floats(0, 1e4), st.sampled_from([2e-5, 0.001, 0.05]))
def test_figures_are_within_half_a_step_up_to_the_largest(figure: float, step: float) -> None:
    steps = Layer("x", "", "m", step).quantised(np.array([figure]))[0]
    assert abs(steps * step - min(figure, (NONE - 1) * step)) <= step / 2 + 1e-9


def test_figures_that_are_not_there_are_none() -> None:
    steps = Layer("x", "", "m", 0.5).quantised(np.array([np.inf, np.nan, 0.0, 1e9]))
    assert steps.tolist() == [NONE, NONE, 0, NONE - 1]


@pytest.mark.parametrize(
    ("range_max_m", "step"),
    [(1.0, 2e-5), (65.534, 0.001), (65.6, 0.002), (120.0, 0.002), (2000.0, 0.05)],
)
def test_range_step_is_the_least_round_one_that_reaches_the_scanners_range(
    plan: Plan, range_max_m: float, step: float
) -> None:
    layers = layers_of(replace(plan.settings.scanner, range_max_m=range_max_m))
    assert next(layer.step for layer in layers if layer.id == "range") == step


def with_what_only_planners_know(plan: Plan) -> Plan:
    """Reasons and what candidates meet, made up."""
    n = plan.survey.patches.n_patches
    reason = (np.arange(n) % len(REASONS)).astype(np.uint8)
    reason[::7] = 255
    times_met = (np.arange(2 * n).reshape(2, n) % 256).astype(np.uint8)
    why = Why(
        stations=(),
        curve=(),
        unseen=(),
        reason_of_patch=reason,
        area_by_reason_m2=(0.0,) * len(REASONS),
        piece_of_patch=(np.arange(n) % 300 - 1).astype(np.int32),
    )
    return replace(
        plan, why=why, qualities=(PointLimits(), PointLimits(range_m=3.1, incidence_rad=1.2)), times_met=times_met
    )


def test_what_the_planner_knows_by_patch_is_written_as_it_is(noisy: Plan, engine: ScanEngine) -> None:
    told = with_what_only_planners_know(noisy)
    made = dict(layer_files(told, engine))
    document = document_of(made)
    assert told.why is not None
    assert told.times_met is not None
    assert made["viewer/reason.u8"] == told.why.reason_of_patch.tobytes()
    pieces = np.array([i % 300 - 1 for i in range(noisy.survey.patches.n_patches)])
    assert np.array_equal(np.frombuffer(made["viewer/pieces.i32"], dtype="<i4"), pieces)
    assert document["reasons"] == list(REASONS)
    assert document["out_of_scope"] == 255
    assert document["pieces"] == "pieces.i32"
    assert made["viewer/achievable.u8"] == b"".join(row.tobytes() for row in told.times_met)
    assert document["qualities"] == [
        {"spacing_m": None, "range_m": None, "incidence_rad": None, "noise_m": None},
        {"spacing_m": None, "range_m": 3.1, "incidence_rad": 1.2, "noise_m": None},
    ]


def test_what_nobody_looked_for_is_not_written(files: dict[str, bytes]) -> None:
    assert "viewer/reason.u8" not in files
    assert "viewer/pieces.i32" not in files
    assert "viewer/achievable.u8" not in files
    document = document_of(files)
    assert document["reasons"] == document["qualities"] == []
    assert document["pieces"] is None


@pytest.mark.slow
def test_files_are_those_that_are_named_beforehand_and_count_as_the_plans_own(
    noisy: Plan, engine: ScanEngine, tmp_path: Any
) -> None:
    nowhere = np.full_like(noisy.survey.floor_of_triangle, -1)
    told = with_what_only_planners_know(noisy)
    survey = replace(told.survey, floors=(), planned=(), floor_of_triangle=nowhere)
    told = replace(told, survey=survey, stations=(), links=(), coverage_by_floor=(), coverage_curve=())
    assert [name for name, _ in layer_files(told, engine)] == list(layer_file_names(told))
    write_plan_folder(told, tmp_path / "plan", engine=engine)
    assert foreign_entries(tmp_path / "plan") == ()
    for name in layer_file_names(told):
        assert (tmp_path / "plan" / name).is_file()
