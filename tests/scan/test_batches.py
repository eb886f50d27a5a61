"""Visibility of many positions: the same whatever the batch, the order and the engine; bounded memory; progress."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.device import Device
from planner_core.model import Visibility
from planner_core.progress import ProgressEvent
from planner_core.scan import tuning
from planner_core.scan.opencl import OpenCLEngine
from planner_core.scene.patches import make_patches

N_POSITIONS = 23


@pytest.fixture(scope="module")
def positions() -> np.ndarray:
    return np.random.default_rng(1).uniform((-3.9, -2.9, 0.1), (3.9, 2.9, 2.9), (N_POSITIONS, 3))


def assert_same(a: Visibility, b: Visibility) -> None:
    np.testing.assert_array_equal(a.starts, b.starts)
    np.testing.assert_array_equal(a.patch, b.patch)
    assert a.n_patches == b.n_patches


def test_visibility_is_the_distinct_patches_of_the_scan(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=2))
    template = shapes.template_of(24, 130, range_min_m=0.3, range_max_m=4.0)
    for engine in open_both(scene)[:2]:
        batch = engine.scan(template, positions)
        visibility = engine.visible_patches(template, positions)
        assert visibility.n_positions == N_POSITIONS
        for index in range(N_POSITIONS):
            seen = batch.patch[index]
            np.testing.assert_array_equal(visibility.row(index), np.unique(seen[seen >= 0]))


def test_visibility_is_the_same_whatever_the_batch_size(
    device: Device, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=3))
    patches = make_patches(scene, max_area_m2=0.04)
    template = shapes.template_of(16, 100, range_max_m=5.0)
    whole = OpenCLEngine(scene, patches, device).visible_patches(template, positions)
    for batch_bytes in (1, 3 * 10**5, 5 * 10**5 + 7):
        assert_same(
            OpenCLEngine(scene, patches, device, batch_bytes=batch_bytes).visible_patches(template, positions), whole
        )


def test_visibility_is_the_same_whatever_the_order_of_positions(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=4))
    engine = open_both(scene)[0]
    template = shapes.template_of(16, 100)
    forward, backward = (engine.visible_patches(template, at) for at in (positions, positions[::-1]))
    for index in range(N_POSITIONS):
        np.testing.assert_array_equal(forward.row(index), backward.row(N_POSITIONS - 1 - index))


def test_engines_see_the_same_patches(open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=5))
    ours, oracle, patches = open_both(scene)
    template = shapes.template_of(32, 300)
    a, b = (engine.visible_patches(template, positions) for engine in (ours, oracle))
    differing = sum(np.setxor1d(a.row(i), b.row(i)).size for i in range(N_POSITIONS))
    # A patch that one beam alone meets, at its rim.
    assert differing <= 1e-3 * b.patch.size, f"{differing} of {b.patch.size}"
    assert patches.n_patches == a.n_patches


def test_repeated_runs_give_the_same_bytes(open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=6))
    template = shapes.template_of(16, 100)
    first, second = (open_both(scene)[0].scan(template, positions) for _ in range(2))
    for name in ("range_m", "triangle", "patch", "cos_incidence"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes(), name


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


@pytest.mark.parametrize("which", [0, 1], ids=["opencl", "open3d"])
def test_progress_counts_up_to_all_positions(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray, which: int
) -> None:
    engine = open_both(shapes.scene_of(*shapes.clutter_of(5, seed=8)))[which]
    events: list[ProgressEvent] = []
    engine.visible_patches(shapes.template_of(4, 16), positions, progress=events.append)
    done = [event.done for event in events]
    assert done == sorted(done)
    assert done[-1] == N_POSITIONS
    assert {event.total for event in events} == {N_POSITIONS}


@pytest.mark.parametrize("which", [0, 1], ids=["opencl", "open3d"])
def test_an_exception_from_progress_cancels_and_the_engine_stays_usable(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray, which: int
) -> None:
    engine = open_both(shapes.scene_of(*shapes.clutter_of(5, seed=9)))[which]
    template = shapes.template_of(4, 16)

    def cancel(_: ProgressEvent) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.visible_patches(template, positions, progress=cancel)
    assert engine.visible_patches(template, positions).n_positions == N_POSITIONS


def test_results_are_the_same_whatever_the_tile_and_the_packet(
    monkeypatch: pytest.MonkeyPatch, open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray
) -> None:
    engine = open_both(shapes.scene_of(*shapes.clutter_of(60, seed=10)))[0]
    batches = []
    for shape in ((8, 32, 8), (4, 8, 1), (2, 16, 4), (16, 64, 8)):
        monkeypatch.setattr(tuning, "_TILE_SHAPE", dict.fromkeys(("cpu", "gpu", "other"), shape))
        # A new template object: the engine keeps the tiles of the last one.
        batches.append(engine.scan(shapes.template_of(21, 130, range_max_m=6.0), positions[:3]))
    for other in batches[1:]:
        np.testing.assert_array_equal(other.triangle, batches[0].triangle)
        np.testing.assert_array_equal(other.range_m, batches[0].range_m)
        np.testing.assert_array_equal(other.patch, batches[0].patch)
