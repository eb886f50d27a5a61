"""A scene scanned in parts: the bits of one tree, in bounded memory, chosen where the device is too small."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from slow_cases import all_slow_but

from planner_core.device import Device
from planner_core.engine.in_parts import PartedEngine
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import device_of, open_engine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.parts import fits, split
from planner_core.engine.patch_mode import PatchMode
from planner_core.errors import DeviceMemoryError, RequirementError
from planner_core.model import BeamTemplate, Optics, Patches, Scene, Storey
from planner_core.scene.patches import make_patches

POSITIONS = np.array([[0.1, 0.2, 1.5], [-0.3, 0.1, 4.6], [0.2, -0.4, 1.1], [3.0, 9.0, 1.0]])


@pytest.fixture(scope="module")
def house(shapes: SimpleNamespace) -> tuple[Scene, Patches]:
    """Two storeys full of boxes; walls in one place across them, a mirror, and panes of glass."""
    lower, upper = shapes.clutter_of(700, seed=3), shapes.clutter_of(700, seed=4)
    # In one plane, one with its middle in the lower storey, one in the upper: as near, of two parts.
    panes = np.array([[-2, -1, 5.8], [2, -1, 5.8], [0, -1, 0.2], [-2, -1, 0.2], [2, -1, 0.2], [0, -1, 5.8]])
    vertices = np.concatenate([lower[0], upper[0] + [0, 0, 3], panes])
    n = len(lower[0])
    last = np.array([[0, 1, 2], [3, 4, 5], [3, 4, 5]]) + n + len(upper[0])
    triangles = np.concatenate([lower[1], upper[1] + n, last]).astype(np.int32)
    scene = shapes.scene_of(vertices, triangles)
    optics = np.full(len(triangles), Optics.RETURNS, dtype=np.uint8)
    optics[12:24], optics[24:60] = Optics.STOPS, Optics.PASSES
    storeys = tuple(Storey(f"S{k}", "", 3.0 * k) for k in range(2))
    scene = Scene(**{**vars(scene), "optics_of_triangle": optics, "storeys": storeys})
    return scene, make_patches(scene, max_area_m2=0.1)


@pytest.fixture(scope="module")
def whole(house: tuple[Scene, Patches], device: Device) -> OpenCLEngine:
    return OpenCLEngine(*house, device)


@pytest.fixture(scope="module")
def parted(house: tuple[Scene, Patches], needs_opencl: None) -> PartedEngine:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TLSPLAN_MEMORY", "1.5MB")
        engine = open_engine(*house)
    assert isinstance(engine, PartedEngine)
    assert len(engine.parts.parts) >= 4
    return engine


def template(shapes: SimpleNamespace, **ranges: float) -> BeamTemplate:
    return shapes.template_of(25, 180, **ranges)


def check_same(got: Any, expected: Any) -> None:
    for name, value in vars(expected).items():
        if isinstance(value, np.ndarray):
            assert getattr(got, name).dtype == value.dtype, name
            assert getattr(got, name).tobytes() == value.tobytes(), name
        elif name == "moments" and value is not None:
            check_same(got.moments, value)


@pytest.mark.parametrize(
    "ranges",
    all_slow_but(
        [{"range_min_m": 1.2, "range_max_m": 8.0}], [{}, {"range_max_m": 2.5}, {"range_min_m": 1.2, "range_max_m": 8.0}]
    ),
)
def test_scans_are_those_of_one_tree(
    parted: PartedEngine, whole: OpenCLEngine, shapes: SimpleNamespace, ranges: dict[str, float]
) -> None:
    beams = template(shapes, **ranges)
    expected = whole.scan(beams, POSITIONS)
    assert (expected.triangle >= 0).mean() > 0.1
    check_same(parted.scan(beams, POSITIONS), expected)
    check_same(parted.visible_patches(beams, POSITIONS), whole.visible_patches(beams, POSITIONS))
    for moments in (False, True):
        got, of_one = (e.patch_returns(beams, POSITIONS, moments=moments) for e in (parted, whole))
        check_same(got, of_one)


def test_what_a_beam_truly_meets_comes_before_as_near_a_margin_of_another_part(
    device: Device, shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Sails 1 micrometre beside the beams: hits in their margins count as farther by a 1e-5th, where walls stand. By
    # rounding some are as near as those, to the bit.
    n, steps = 32, np.arange(32)
    sail_m = (3 + 0.01 * steps).astype(np.float32)
    wall_m = sail_m / np.float32(0.99999)
    sails = np.array([[[x, 1e-6, 8 * k - 2], [x, 1e-6, 8 * k + 2], [x, 3, 8 * k]] for k, x in enumerate(sail_m)])
    walls = np.array([[[x, -2, 8 * k - 2], [x, -2, 8 * k + 2], [x, 4, 8 * k]] for k, x in enumerate(wall_m)])
    beams = shapes.template_of(1, 1, high_deg=0.0)
    positions = np.stack([0.0 * steps, 0.0 * steps, 8.0 * steps], axis=1)

    def scene_of(corners: NDArray[np.float64]) -> tuple[Scene, Patches]:
        triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
        scene = shapes.scene_of(corners.reshape(-1, 3), triangles)
        return scene, make_patches(scene, max_area_m2=100.0)

    of_sails, of_walls = (OpenCLEngine(*scene_of(c), device).scan(beams, positions) for c in (sails, walls))
    as_near = (of_sails.range_m == of_walls.range_m).ravel()
    assert as_near.sum() >= 3
    assert (of_sails.patch == -1).all()
    both = scene_of(np.concatenate([sails, walls]))
    monkeypatch.setattr(
        "planner_core.engine.parts.split", lambda scene, most: np.split(np.arange(2 * n, dtype=np.int32), 2)
    )
    got = PartedEngine(*both, device).scan(beams, positions)
    assert (got.triangle.ravel() == n + steps)[as_near].all()
    check_same(got, OpenCLEngine(*both, device).scan(beams, positions))


@pytest.mark.slow
def test_bands_and_batches_leave_no_trace(
    parted: PartedEngine, whole: OpenCLEngine, shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parted, "_band_beams", 2000)
    monkeypatch.setattr(parted, "_n_batch", lambda template: 2)
    beams = template(shapes)
    check_same(parted.scan(beams, POSITIONS), whole.scan(beams, POSITIONS))
    got, of_one = (e.patch_returns(beams, POSITIONS, moments=True) for e in (parted, whole))
    check_same(got, of_one)


@pytest.mark.parametrize("through_glass", [False, True])
def test_free_rays_and_scans_after_them_are_those_of_one_tree(
    parted: PartedEngine, whole: OpenCLEngine, shapes: SimpleNamespace, through_glass: bool
) -> None:
    rng = np.random.default_rng(1)
    origins, ways = rng.uniform((-4, -3, 0), (4, 3, 6), (3000, 3)), rng.normal(size=(3000, 3))
    ways[:500] = [0.0, -1.0, 0.0] - origins[:500] * [1.0, 1.0, 0.0]  # at what lies in one place twice
    for range_max_m in (np.inf, 1.5):
        got, of_one = (
            e.cast_rays(origins, ways, range_max_m=range_max_m, through_glass=through_glass) for e in (parted, whole)
        )
        check_same(got, of_one)
    beams = template(shapes)
    check_same(parted.scan(beams, POSITIONS), whole.scan(beams, POSITIONS))  # there is room for them again


def test_no_positions_rays_or_beams_have_no_results(parted: PartedEngine, shapes: SimpleNamespace) -> None:
    assert parted.scan(template(shapes), np.empty((0, 3))).range_m.shape == (0, 25, 180)
    assert parted.visible_patches(template(shapes), np.empty((0, 3))).starts.tolist() == [0]
    assert parted.cast_rays(np.empty((0, 3)), np.empty((0, 3)), range_max_m=1.0).range_m.size == 0
    no_beams = replace(template(shapes), elevation_rad=np.empty(0))
    assert parted.visible_patches(no_beams, POSITIONS).starts.tolist() == [0] * (len(POSITIONS) + 1)


def test_memory_stays_within_what_is_allowed(
    parted: PartedEngine, shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    most, real = [0], Device._keep

    def keep(self: Device, handle: Any, n_bytes: int, memory: Any = None) -> Any:
        buffer = real(self, handle, n_bytes, memory)
        most[0] = max(most[0], self.held_bytes)
        return buffer

    monkeypatch.setattr(Device, "_keep", keep)
    parted.visible_patches(template(shapes), POSITIONS)
    parted.cast_rays(POSITIONS, POSITIONS + 1.0, range_max_m=np.inf)
    of_all = sum(part.n_bytes for part in parted.parts.parts)
    assert 0 < most[0] <= 1.5e6
    assert sum(buffer.n_bytes for held in parted.parts._held.values() for buffer in held.values()) < of_all
    assert parted.opened.memory_bytes == 1_500_000


def test_parts_are_storeys_and_halves_of_storeys(house: tuple[Scene, Patches]) -> None:
    scene = house[0]
    for most in (1000, 5000, 9000, scene.n_triangles):
        parts = split(scene, most)
        assert sorted(np.concatenate(parts).tolist()) == list(range(scene.n_triangles))
        assert all(0 < part.size <= most and (np.diff(part) > 0).all() for part in parts)
    assert len(split(scene, scene.n_triangles)) == 1
    lower, upper = split(scene, 9000)
    height_m = scene.vertices_m[scene.triangles][:, :, 2].mean(axis=1)
    assert (height_m[lower] < 3).all()
    assert (height_m[upper] >= 3).all()


def test_the_engine_is_chosen_by_memory(
    house: tuple[Scene, Patches], whole: OpenCLEngine, parted: PartedEngine, device: Device
) -> None:
    assert fits(device, 10**6)
    assert not fits(device, 10**9)
    assert "scanned in" in parted.warnings[0]
    assert device_of(parted) is parted.opened


@pytest.mark.slow
def test_patch_mode_of_parts_is_tested_on_the_host(
    house: tuple[Scene, Patches], parted: PartedEngine, shapes: SimpleNamespace
) -> None:
    got, expected = (PatchMode(e, *house).see(template(shapes), POSITIONS[:1]) for e in (parted, Open3DEngine(*house)))
    check_same(got, expected)
    assert got.patch.size > 100


@pytest.mark.parametrize("engine", ["opencl", "auto", "open3d"])
@pytest.mark.parametrize("said", ["lots", "0GB"])
def test_memory_that_makes_no_sense_is_refused_whatever_else_could_scan(
    house: tuple[Scene, Patches], device: Device, monkeypatch: pytest.MonkeyPatch, said: str, engine: str
) -> None:
    monkeypatch.setenv("TLSPLAN_MEMORY", said)
    with pytest.raises(RequirementError, match=f"TLSPLAN_MEMORY: got '{said}', expected a size .*; correct or unset"):
        open_engine(*house, engine=engine)


def test_memory_too_small_for_any_scan_is_refused(
    house: tuple[Scene, Patches], device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TLSPLAN_MEMORY", "0.05MB")
    with pytest.raises(DeviceMemoryError, match="available"):
        open_engine(*house, engine="opencl")
