"""Visibility of many positions: the same whatever the batch, the order and the engine; bounded memory; progress."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.device import Device
from planner_core.engine import opencl, tuning
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_returns import PatchRows, ReturnRows
from planner_core.engine.tiles import TiledTemplate
from planner_core.errors import DeviceMemoryError
from planner_core.model import Patches, Scene, Visibility
from planner_core.progress import ProgressEvent
from planner_core.scene.patches import make_patches

N_POSITIONS = 23


@pytest.fixture(scope="module")
def positions() -> np.ndarray:
    return np.random.default_rng(1).uniform((-3.9, -2.9, 0.1), (3.9, 2.9, 2.9), (N_POSITIONS, 3))


def assert_same(a: Visibility, b: Visibility) -> None:
    np.testing.assert_array_equal(a.starts, b.starts)
    np.testing.assert_array_equal(a.patch, b.patch)
    assert a.n_patches == b.n_patches


def test_one_scan_at_a_time_is_the_scan_of_all(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=7))
    engine = open_both(scene)[0]
    template = shapes.template_of(15, 101)  # no multiple of a tile
    together = engine.scan(template, positions)
    for index in (0, 7, N_POSITIONS - 1):
        alone = engine.scan(template, positions[index : index + 1])
        np.testing.assert_array_equal(alone.range_m[0], together.range_m[index])
        np.testing.assert_array_equal(alone.patch[0], together.patch[index])


def test_changing_the_template_changes_the_scan(open_both: Callable, shapes: SimpleNamespace) -> None:
    """The tiles of the last template are kept; another one must not be scanned with them."""
    engine = open_both(shapes.scene_of(*shapes.box_of((-1, -1, -1), (1, 1, 1))))[0]
    at = np.zeros((1, 3))
    for rows, columns in ((4, 8), (2, 16), (4, 8)):
        assert engine.scan(shapes.template_of(rows, columns), at).range_m.shape == (1, rows, columns)
    assert np.isnan(engine.scan(shapes.template_of(4, 8, range_max_m=0.5), at).range_m).all()


QUESTIONS: dict[str, Callable] = {
    "visible": lambda engine, *what, **more: engine.visible_patches(*what, **more),
    "counts": lambda engine, *what, **more: engine.patch_returns(*what, **more),
    "moments": lambda engine, *what, **more: engine.patch_returns(*what, moments=True, **more),
}


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("which", [0, 1], ids=["opencl", "open3d"])
def test_an_exception_from_any_progress_event_cancels_and_the_engine_stays_usable(
    own_device: Device, shapes: SimpleNamespace, positions: np.ndarray, which: int, question: str
) -> None:
    scene, patches = engine_parts(shapes)
    parted = {"batch_bytes": 60_000, "band_beams": 100}
    engine = Open3DEngine(scene, patches) if which else OpenCLEngine(scene, patches, own_device, **parted)
    template = shapes.template_of(8, 33)
    ask, positions = QUESTIONS[question], positions[:7]
    events: list[ProgressEvent] = []
    whole = ask(engine, template, positions, progress=events.append)
    held_bytes = own_device.held_bytes
    assert len(events) >= 5
    done = [event.done for event in events]
    assert (done, done[-1], {event.total for event in events}) == (sorted(done), 7, {7})
    for stop in range(len(events)):
        heard: list[ProgressEvent] = []

        def cancel(event: ProgressEvent, heard: list[ProgressEvent] = heard, stop: int = stop) -> None:
            heard.append(event)
            if len(heard) > stop:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt) as raised:
            ask(engine, template, positions, progress=cancel)
        assert heard == events[: stop + 1]
        # Even while the error, and by its traceback every frame of the engine's, lives on.
        assert raised.tb is not None
        assert own_device.held_bytes == held_bytes
    again = ask(engine, template, positions)
    np.testing.assert_array_equal(again.starts, whole.starts)
    np.testing.assert_array_equal(again.patch, whole.patch)


def engine_parts(shapes: SimpleNamespace) -> tuple[Scene, Patches]:
    scene = shapes.scene_of(*shapes.clutter_of(5, seed=9))
    return scene, make_patches(scene, max_area_m2=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS)
def test_batches_hold_no_more_than_the_memory_they_are_given(
    own_device: Device, shapes: SimpleNamespace, positions: np.ndarray, question: str
) -> None:
    limit_bytes = 3_000_000  # of which the moments of one position take most
    engine = OpenCLEngine(*engine_parts(shapes), own_device, batch_bytes=limit_bytes)
    template = shapes.template_of(16, 100)
    QUESTIONS[question](engine, template, positions[:1])  # its tiles stay
    held_bytes, most = own_device.held_bytes, []
    QUESTIONS[question](engine, template, positions, progress=lambda _: most.append(own_device.held_bytes - held_bytes))
    assert 0 < max(most) <= limit_bytes
    assert own_device.held_bytes == held_bytes


@pytest.mark.parametrize("which", [0, 1], ids=["opencl", "open3d"])
@pytest.mark.parametrize("axis", ["elevation_rad", "azimuth_rad"])
def test_a_template_without_beams_sees_nothing(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray, which: int, axis: str
) -> None:
    engine = open_both(shapes.scene_of(*shapes.box_of((-1, -1, -1), (1, 1, 1))))[which]
    template = replace(shapes.template_of(5, 5), **{axis: np.empty(0)})
    visibility = engine.visible_patches(template, positions)
    assert visibility.starts.tolist() == [0] * (N_POSITIONS + 1)
    assert engine.patch_returns(template, positions).n_returns.size == 0


@pytest.mark.parametrize("kept_beams", [0, 10_000], ids=["dropped", "kept"])
def test_a_scan_in_bands_is_the_scan_of_the_whole_template(
    monkeypatch: pytest.MonkeyPatch, own_device: Device, shapes: SimpleNamespace, positions: np.ndarray, kept_beams: int
) -> None:
    monkeypatch.setattr(opencl, "_KEPT_BEAMS", kept_beams)
    scene = shapes.scene_of(*shapes.clutter_of(40, seed=12))
    patches = make_patches(scene, max_area_m2=0.04)
    template = shapes.template_of(21, 130, range_max_m=6.0)
    whole = OpenCLEngine(scene, patches, own_device).scan(template, positions[:3])
    for band_beams in (1, 1000):
        engine = OpenCLEngine(scene, patches, own_device, band_beams=band_beams)
        held_bytes = own_device.held_bytes
        for _ in range(2):
            parted = engine.scan(template, positions[:3])
            for name in ("range_m", "triangle", "patch", "cos_incidence"):
                assert getattr(parted, name).tobytes() == getattr(whole, name).tobytes(), name
        assert (own_device.held_bytes == held_bytes) == (kept_beams == 0)


def test_tiles_of_a_template_in_bands_are_made_once(
    monkeypatch: pytest.MonkeyPatch, device: Device, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    made: list[int] = []
    real = opencl.TiledTemplate

    def counted(*arguments: object, **more: int) -> object:
        made.append(more["first_row"])
        return real(*arguments, **more)

    monkeypatch.setattr(opencl, "TiledTemplate", counted)
    engine = OpenCLEngine(*engine_parts(shapes), device, band_beams=1000)
    template = shapes.template_of(21, 130)
    for _ in range(2):
        engine.scan(template, positions[:1])
    assert made == [0, 7, 14]


@pytest.mark.slow
def test_progress_of_bands_counts_up_to_all_positions(
    device: Device, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    engine = OpenCLEngine(*engine_parts(shapes), device, batch_bytes=60_000, band_beams=100)
    events: list[ProgressEvent] = []
    engine.visible_patches(shapes.template_of(8, 33), np.tile(positions, (4, 1)), progress=events.append)
    done = [event.done for event in events]
    assert done == sorted(done)
    assert done[-1] == 4 * N_POSITIONS
    assert len(set(done)) > 8


@pytest.mark.usefixtures("no_collections")
def test_memory_that_runs_out_halves_the_batch_and_is_said_once(
    monkeypatch: pytest.MonkeyPatch, device: Device, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    template = shapes.template_of(16, 100)
    expected = OpenCLEngine(*engine_parts(shapes), device).patch_returns(template, positions)
    real = PatchRows.rows

    def scarce(self: PatchRows, tiles: TiledTemplate, positions_m: np.ndarray) -> ReturnRows:
        if len(positions_m) > 5:
            raise DeviceMemoryError("batch of scans: out of memory, expected less")
        return real(self, tiles, positions_m)

    monkeypatch.setattr(PatchRows, "rows", scarce)
    engine = OpenCLEngine(*engine_parts(shapes), device)
    returns = engine.patch_returns(template, positions)
    np.testing.assert_array_equal(returns.patch, expected.patch)
    np.testing.assert_array_equal(returns.n_returns, expected.n_returns)
    assert len(engine.warnings) == 1
    monkeypatch.setattr(PatchRows, "rows", lambda *_: scarce(*_[:2], np.empty((9, 3))))
    with pytest.raises(DeviceMemoryError, match="out of memory"):
        engine.patch_returns(template, positions)


ONE_CORE = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from conftest import clutter_of, scene_of, template_of
from planner_core.device import open_device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.scene.patches import make_patches

scene = scene_of(*clutter_of(60, seed=13))
device = open_device()
engine = OpenCLEngine(scene, make_patches(scene, max_area_m2=0.04), device)
positions = np.random.default_rng(1).uniform((-3.9, -2.9, 0.1), (3.9, 2.9, 2.9), (7, 3))
returns = engine.patch_returns(template_of(40, 300), positions, moments=True)
seen = engine.visible_patches(template_of(40, 300), positions)
moments = {name: getattr(returns.moments, name) for name in returns.moments.__dataclass_fields__}
tree = {f"tree_{name}": getattr(engine.tree, name) for name in ("boxes", "children", "geometry", "triangle", "slot")}
np.savez(sys.argv[2], cores=device.n_compute_units, starts=returns.starts, patch=returns.patch,
         n_returns=returns.n_returns, seen=seen.patch, **moments, **tree)
"""


@pytest.mark.slow
@pytest.mark.opencl
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core only: nothing to compare with")
def test_the_number_of_cores_leaves_no_trace_in_the_bits(tmp_path: Path) -> None:
    results = []
    for count in ("1", ""):
        environment = {name: value for name, value in os.environ.items() if name != "POCL_MAX_PTHREAD_COUNT"}
        environment |= {"POCL_MAX_PTHREAD_COUNT": count} if count else {}
        file = tmp_path / f"cores-{count}.npz"
        subprocess.run(
            [sys.executable, "-c", ONE_CORE, str(Path(__file__).parent), str(file)], check=True, env=environment
        )
        with np.load(file) as loaded:
            results.append(dict(loaded))
    one, many = results
    if one["cores"] == many["cores"]:
        pytest.skip("this driver does not heed POCL_MAX_PTHREAD_COUNT")
    for name in one.keys() - {"cores"}:
        assert one[name].tobytes() == many[name].tobytes(), name


@pytest.mark.slow
@pytest.mark.parametrize(
    "tilings",
    [
        ((8, 32, 8), (4, 8, 1)),
        pytest.param(  # built for seconds
            ((8, 32, 8), (2, 16, 4), (16, 64, 8), (10, 32, 8), (8, 64, 16)), marks=pytest.mark.slow
        ),
    ],
)
@pytest.mark.parametrize("scene", [pytest.param("clutter", marks=pytest.mark.slow), "posts before a fine wall"])
def test_results_are_the_same_whatever_the_tile_and_the_packet(
    device: Device,
    open_both: Callable,
    shapes: SimpleNamespace,
    positions: np.ndarray,
    scene: str,
    tilings: tuple[tuple[int, int, int], ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    corners, triangles = shapes.clutter_of(60, seed=10)
    template = shapes.template_of(21, 130, range_max_m=6.0)
    if scene != "clutter":
        # Some lanes of a packet end on a post and others go on, to one of many nodes behind it.
        wall = shapes.sphere_of(7.0, 60, 120)
        posts = triangles[12:]  # without the room
        corners, triangles = np.concatenate([corners, wall[0]]), np.concatenate([posts, wall[1] + len(corners)])
        template = shapes.template_of(41, 900)
    engine = open_both(shapes.scene_of(corners, triangles))[0]
    batches = []
    for shape in tilings:
        if shape[2] > device.max_lanes:
            continue
        with tuning.use_shape(shape):
            batches.append(engine.scan(template, positions[:3]))
            seen = engine.visible_patches(template, positions[:3])
        for row, patch in zip(np.split(seen.patch, seen.starts[1:-1]), batches[-1].patch, strict=True):
            np.testing.assert_array_equal(row, np.unique(patch[patch >= 0]))
    monkeypatch.setattr(opencl, "_CACHED_RESULTS_BYTES", 0)  # the memory of results is asked for ahead
    batches.append(engine.scan(template, positions[:3]))
    for other in batches[1:]:
        np.testing.assert_array_equal(other.triangle, batches[0].triangle)
        np.testing.assert_array_equal(other.range_m, batches[0].range_m)
        np.testing.assert_array_equal(other.patch, batches[0].patch)
