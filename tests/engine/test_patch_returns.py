"""Returns by patch: counts and moments of both engines against sums in float64 over the returns of `scan`."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device
from planner_core.engine import open3d, patch_returns, tuning
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_returns import ReturnRows, join_bands
from planner_core.model import BeamTemplate, Patches, PatchReturns, ReturnMoments, ScanBatch, Scene
from planner_core.scanner.template import directions
from planner_core.scene.patches import make_patches, patch_triangles

MOMENTS = tuple(field.name for field in fields(ReturnMoments))
BOTH = pytest.mark.parametrize("which", [0, 1], ids=["opencl", "open3d"])


@pytest.fixture(scope="module")
def positions() -> np.ndarray:
    return np.random.default_rng(1).uniform((-3.9, -2.9, 0.1), (3.9, 2.9, 2.9), (9, 3))


def brute_force(
    scene: Scene, patches: Patches, template: BeamTemplate, batch: ScanBatch, positions: np.ndarray, index: int
) -> dict[str, np.ndarray]:
    """Sums over a scan's returns, patch by patch and in float64; patches in order."""
    rounded = replace(scene, vertices_m=scene.vertices_m.astype(np.float32).astype(np.float64))
    first_vertex = patch_triangles(rounded, patches)[:, 0]
    patch = batch.patch[index]
    on = patch >= 0
    beams = directions(template).astype(np.float32).astype(np.float64)[on]
    ranges, cosine, patch = (x[index][on].astype(np.float64) for x in (batch.range_m, batch.cos_incidence, batch.patch))
    patch = patch.astype(np.int64)
    p = positions[index].astype(np.float32) + beams * ranges[:, None] - first_vertex[patch]
    w, square = 2 - cosine, (p**2).sum(axis=1)
    seen = np.unique(patch)
    rows: dict[str, list] = {name: [] for name in ("n_returns", *MOMENTS)}
    for one in seen:
        mine = patch == one
        rows["n_returns"].append(mine.sum())
        rows["point_sum_m"].append(p[mine].sum(axis=0))
        rows["square_sum_m2"].append(square[mine].sum())
        rows["weight_sum"].append(w[mine].sum())
        rows["weighted_point_sum_m"].append((w[mine, None] * p[mine]).sum(axis=0))
        rows["weighted_square_sum_m2"].append((w[mine] * square[mine]).sum())
        rows["range_sum_m"].append(ranges[mine].sum())
        rows["least_range_m"].append(ranges[mine].min())
        rows["greatest_cos_incidence"].append(cosine[mine].max())
    return {"patch": seen, **{name: np.array(values) for name, values in rows.items()}}


def assert_same(a: PatchReturns, b: PatchReturns) -> None:
    """The same bits."""
    for name in ("starts", "patch", "n_returns"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    for name in MOMENTS:
        assert getattr(a.moments, name).tobytes() == getattr(b.moments, name).tobytes(), name


def assert_sums_are(returns: PatchReturns, index: int, expected: dict[str, np.ndarray], size_m: np.ndarray) -> None:
    """Sums within rounding: 1e-6 of the patch's longest edge and 3e-6 m a return."""
    row = returns.row(index)
    np.testing.assert_array_equal(returns.patch[row], expected["patch"])
    np.testing.assert_array_equal(returns.n_returns[row], expected["n_returns"])
    assert returns.moments is not None
    n, size = expected["n_returns"], size_m[expected["patch"]]
    point = n * (1e-6 * size + 3e-6)
    square = n * (4e-6 * size**2 + 8e-6 * size + 1e-10)
    bounds = {
        "point_sum_m": point[:, None],
        "square_sum_m2": square,
        "weight_sum": n * 1e-6,
        "weighted_point_sum_m": 2 * point[:, None],
        "weighted_square_sum_m2": 2 * square,
        "range_sum_m": n * 1e-6,
    }
    for name, bound in bounds.items():
        off = np.abs(getattr(returns.moments, name)[row] - expected[name])
        assert (off <= bound).all(), f"{name}: {(off / bound).max()} of the bound"
    np.testing.assert_array_equal(returns.moments.least_range_m[row], expected["least_range_m"].astype(np.float32))
    np.testing.assert_array_equal(
        returns.moments.greatest_cos_incidence[row], expected["greatest_cos_incidence"].astype(np.float32)
    )


def longest_edge_m(scene: Scene, patches: Patches) -> np.ndarray:
    corners = patch_triangles(scene, patches)
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)


@pytest.mark.slow
@BOTH
def test_returns_are_the_sums_over_the_scan(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray, which: int
) -> None:
    scene, positions = shapes.scene_of(*shapes.clutter_of(60, seed=2)), positions[:4]
    *engines, patches = open_both(scene, 0.1)
    template = shapes.template_of(45, 333, range_min_m=0.3, range_max_m=5.0)  # no multiple of a tile
    batch = engines[which].scan(template, positions)
    returns = engines[which].patch_returns(template, positions, moments=True)
    size_m = longest_edge_m(scene, patches)
    for index in range(len(positions)):
        expected = brute_force(scene, patches, template, batch, positions, index)
        assert_sums_are(returns, index, expected, size_m)
        row = returns.row(index)
        np.testing.assert_allclose(
            returns.mean_range_m[row], expected["range_sum_m"] / expected["n_returns"], atol=1e-6
        )


def test_engines_count_the_same_returns(open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=3))
    ours, oracle, patches = open_both(scene)
    template = shapes.template_of(48, 300)
    a, b = (engine.patch_returns(template, positions, moments=True) for engine in (ours, oracle))
    counts = np.zeros((2, len(positions), patches.n_patches), dtype=np.int64)
    for which, returns in enumerate((a, b)):
        for index in range(len(positions)):
            row = returns.row(index)
            counts[which, index, returns.patch[row]] = returns.n_returns[row]
    # Beams within rounding of a line between two patches, and in the margin of a triangle.
    assert np.abs(counts[0] - counts[1]).sum() <= 1e-3 * counts[1].sum()
    assert a.moments is not None
    assert b.moments is not None
    one = a.patch.size == b.patch.size and bool((a.patch == b.patch).all())
    if one:
        same = a.n_returns == b.n_returns
        np.testing.assert_allclose(a.mean_range_m[same], b.mean_range_m[same], atol=1e-4)


@BOTH
def test_counts_without_moments_are_the_same_counts(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray, which: int
) -> None:
    engine = open_both(shapes.scene_of(*shapes.clutter_of(30, seed=4)))[which]
    template = shapes.template_of(16, 100)
    counts, full = (engine.patch_returns(template, positions, moments=moments) for moments in (False, True))
    seen = engine.visible_patches(template, positions)
    assert counts.moments is None
    for returns in (counts, full):
        np.testing.assert_array_equal(returns.n_returns, full.n_returns)
        np.testing.assert_array_equal(returns.visibility.starts, seen.starts)
        np.testing.assert_array_equal(returns.visibility.patch, seen.patch)
        assert returns.visibility.n_patches == seen.n_patches
    with pytest.raises(ValueError, match="moments=True"):
        _ = counts.mean_range_m


def one_triangle(shapes: SimpleNamespace) -> Scene:
    return shapes.scene_of(np.array([[-2.0, -2, 0], [3, -2, 0], [-2, 4, 0]]), np.array([[0, 1, 2]], dtype=np.int32))


@BOTH
def test_a_station_that_sees_nothing_has_an_empty_row_among_the_others(
    open_both: Callable, shapes: SimpleNamespace, which: int
) -> None:
    engine = open_both(one_triangle(shapes), 0.5)[which]
    template = shapes.template_of(9, 40, low_deg=-90, high_deg=0, range_max_m=10.0)
    positions = np.array([[0, 0, 50.0], [0, 0, 2.0], [0, 0, 60.0], [0.1, 0, 2.0], [0, 0, 70.0]])
    returns = engine.patch_returns(template, positions, moments=True)
    seen = np.diff(returns.starts) > 0
    assert seen.tolist() == [False, True, False, True, False]
    assert returns.n_returns.min() >= 1
    nothing = engine.patch_returns(template, positions[::4], moments=True)
    assert nothing.starts.tolist() == [0, 0, 0]
    assert nothing.moments is not None
    assert nothing.moments.point_sum_m.shape == (0, 3)
    assert nothing.moments.least_range_m.dtype == np.float32
    none = engine.patch_returns(template, np.empty((0, 3)), moments=True)
    assert none.starts.tolist() == [0]
    assert none.mean_range_m.shape == (0,)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    area_m2=st.sampled_from([0.003, 0.04, 0.7, 50.0]),
    rows=st.integers(1, 40),
    columns=st.integers(1, 70),
)
def test_returns_of_any_small_scene_are_the_sums_over_its_scan(
    device: Device, shapes: SimpleNamespace, seed: int, area_m2: float, rows: int, columns: int
) -> None:
    """Triangles of any size and shape, needles and crossing ones among them, as far as 200 m from the origin."""
    rng = np.random.default_rng(seed)
    n_triangles = int(rng.integers(1, 60))
    shift = rng.uniform(-200, 200, 3) * rng.integers(0, 2)
    spread = rng.choice([0.01, 0.3, 3.0], (n_triangles, 1, 1))
    corners = rng.uniform(-4, 4, (n_triangles, 1, 3)) + spread * rng.normal(size=(n_triangles, 3, 3)) + shift
    triangles = np.arange(3 * n_triangles, dtype=np.int32).reshape(-1, 3)
    scene = shapes.scene_of(corners.reshape(-1, 3), triangles)
    patches = make_patches(scene, max_area_m2=area_m2)
    engine = OpenCLEngine(scene, patches, device)
    template = shapes.template_of(rows, columns, low_deg=-80, high_deg=85, range_max_m=12.0)
    positions = rng.uniform(-3, 3, (2, 3)) + shift
    batch = engine.scan(template, positions)
    returns = engine.patch_returns(template, positions, moments=True)
    size_m = longest_edge_m(scene, patches)
    for index in range(2):
        expected = brute_force(scene, patches, template, batch, positions, index)
        if expected["patch"].size:
            assert_sums_are(returns, index, expected, size_m)
        else:
            assert returns.row(index) == slice(returns.starts[index], returns.starts[index])


@pytest.mark.parametrize(
    "tilings",
    [
        ((8, 32, 8), (4, 8, 1)),
        pytest.param(  # built for seconds
            ((8, 32, 8), (2, 16, 4), (16, 64, 8), (32, 64, 2), (4, 64, 16)), marks=pytest.mark.slow
        ),
    ],
)
def test_tiles_leave_no_trace_in_the_bits(
    device: Device,
    open_both: Callable,
    shapes: SimpleNamespace,
    positions: np.ndarray,
    tilings: tuple[tuple[int, int, int], ...],
) -> None:
    engine = open_both(shapes.scene_of(*shapes.clutter_of(60, seed=5)))[0]
    template = shapes.template_of(37, 211, range_max_m=6.0)
    found = []
    for shape in tilings:
        if shape[2] > device.max_lanes:
            continue
        with tuning.use_shape(shape):
            found.append(engine.patch_returns(template, positions[:4], moments=True))
    for other in found[1:]:
        assert_same(found[0], other)


def test_sums_of_a_tile_do_not_overflow(open_both: Callable, shapes: SimpleNamespace) -> None:
    """2048 grazing returns at the far end of one patch, in one tile of one lane: w x comes to 4e9 units."""
    corners = np.array([[0, 0, 0], [15.8, 0, 0], [15.8, 2.0, 0]])
    engine = open_both(shapes.scene_of(corners, np.array([[0, 1, 2]], dtype=np.int32)), 100.0)[0]
    template = BeamTemplate(np.linspace(-0.05, 0.05, 64), np.linspace(-0.1, -0.11, 32), 0.0, 100.0)
    with tuning.use_shape((32, 64, 1)):
        returns = engine.patch_returns(template, np.array([[14.0, 0.5, 0.15]]), moments=True)
    assert returns.n_returns.tolist() == [2048]
    beams = directions(template).reshape(-1, 3)
    w, x = 2 + beams[:, 2], 14.0 + beams[:, 0] * (0.15 / -beams[:, 2])
    assert returns.moments is not None
    assert returns.moments.weighted_point_sum_m[0, 0] == pytest.approx((w * x).sum(), rel=1e-6)
    assert returns.moments.weight_sum[0] == pytest.approx(w.sum(), rel=1e-6)
    assert (w * x).sum() * 2**20 / 16 > 2**31


@pytest.mark.parametrize("joiners", [1, 100, 10**6])
def test_slices_of_a_row_leave_no_trace(
    monkeypatch: pytest.MonkeyPatch, open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray, joiners: int
) -> None:
    """A GPU joins a position's lists with many work-items, each for a slice of its patches."""
    engine = open_both(shapes.scene_of(*shapes.clutter_of(30, seed=6)), 0.5)[0]
    template = shapes.template_of(20, 100)
    expected = engine.patch_returns(template, positions, moments=True)
    monkeypatch.setattr(patch_returns, "_JOINERS", {"cpu": joiners})
    assert_same(engine.patch_returns(template, positions, moments=True), expected)


@pytest.mark.slow
@pytest.mark.parametrize("band_beams", [1, 700, 2500])
def test_bands_and_batches_leave_no_trace(
    device: Device, shapes: SimpleNamespace, positions: np.ndarray, band_beams: int
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(40, seed=7))
    patches = make_patches(scene, max_area_m2=0.04)
    template = shapes.template_of(25, 130, range_max_m=6.0)
    at_once = OpenCLEngine(scene, patches, device)
    whole, seen = at_once.patch_returns(template, positions, moments=True), at_once.visible_patches(template, positions)
    for batch_bytes in (1, 10**6):
        parted = OpenCLEngine(scene, patches, device, batch_bytes=batch_bytes, band_beams=band_beams)
        assert_same(parted.patch_returns(template, positions, moments=True), whole)
        found = parted.visible_patches(template, positions)
        assert (found.starts.tolist(), found.patch.tolist()) == (seen.starts.tolist(), seen.patch.tolist())


@pytest.mark.slow
def test_bands_of_the_oracle_change_its_sums_by_rounding_alone(
    monkeypatch: pytest.MonkeyPatch, open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    engine = open_both(shapes.scene_of(*shapes.clutter_of(30, seed=8)))[1]
    template = shapes.template_of(25, 130)
    whole = engine.patch_returns(template, positions, moments=True)
    monkeypatch.setattr(open3d, "_BAND_BEAMS", 700)
    parted = engine.patch_returns(template, positions, moments=True)
    np.testing.assert_array_equal(parted.patch, whole.patch)
    np.testing.assert_array_equal(parted.n_returns, whole.n_returns)
    for name in MOMENTS:
        np.testing.assert_allclose(getattr(parted.moments, name), getattr(whole.moments, name), rtol=1e-12, atol=1e-12)


def test_rows_of_two_bands_join_to_those_of_their_union() -> None:
    """Positions 0, 1, 2; the middle one sees nothing in the upper band, the last nothing at all."""
    upper = ReturnRows(np.array([3, 0, 0]), {"patch": np.array([1, 4, 9]), "n_returns": np.array([1, 2, 3])})
    lower = ReturnRows(np.array([2, 1, 0]), {"patch": np.array([4, 5, 4]), "n_returns": np.array([10, 20, 30])})
    joined = join_bands(upper, lower)
    assert joined.length.tolist() == [4, 1, 0]
    assert joined.arrays["patch"].tolist() == [1, 4, 5, 9, 4]
    assert joined.arrays["n_returns"].tolist() == [1, 12, 20, 3, 30]


STORE_ROWS = """
import numpy as np, pathlib, sys
from planner_core.engine.patch_returns import ReturnRows, RowStore

def resident_bytes(which):
    line = next(x for x in pathlib.Path("/proc/self/status").read_text().splitlines() if x.startswith(which))
    return 1024 * int(line.split()[1])

rows = ReturnRows(np.array([100_000, 0]), {"patch": np.arange(100_000, dtype=np.int32)})
before = resident_bytes("VmRSS")
store = RowStore(n_patches=100_000)
for _ in range(640):
    store.append(rows)
seen = store.visibility()
assert seen.patch.nbytes == 256_000_000
assert (seen.patch.reshape(640, -1) == rows.arrays["patch"]).all()
assert seen.starts[-2:].tolist() == [64_000_000, 64_000_000]
pathlib.Path(sys.argv[1]).write_text(str((resident_bytes("VmHWM") - before) / seen.patch.nbytes))
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no /proc: resident memory can't be read here")
def test_storing_rows_needs_little_more_memory_than_the_result(tmp_path: Path) -> None:
    """256 MB of rows, in a process of their own; concatenating them would need twice as much."""
    subprocess.run([sys.executable, "-c", STORE_ROWS, str(tmp_path / "peak")], check=True)
    assert 1.0 <= float((tmp_path / "peak").read_text()) < 1.5
