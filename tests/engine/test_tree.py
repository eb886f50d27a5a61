"""The tree holds every triangle once in tight boxes, depends on no chunk or packet, and is a good one."""

import hashlib
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device, Program, sort
from planner_core.engine import tree
from planner_core.engine.traced_surfaces import round_surfaces
from planner_core.engine.tree import Tree, build_tree
from planner_core.model import Scene
from planner_core.scene.patches import squared_edges

ARRAYS = ("boxes", "children", "geometry", "triangle", "slot", "edges")
BINNED_SAH = Path(__file__).parents[1] / "benchmarks" / "binned_sah.py"


def walk(tree: Tree, corners: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield every used box and the corners (n, 3) below it; check on the way that all is there once."""
    seen, visited = np.zeros(len(corners), dtype=int), np.zeros(tree.n_nodes, dtype=int)
    filled = np.zeros(tree.n_blocks, dtype=int)

    def below(node: int, level: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        assert level <= tree.n_levels
        visited[node] += 1
        for lane in range(8):
            box, child = tree.boxes[node, :, lane], int(tree.children[node, lane])
            if (box[:3] > box[3:]).all():
                assert child == 0
                continue
            if child >= 0:
                parts = list(below(child, level + 1))
                yield from parts
                yield box, np.concatenate([points for _, points in parts])
                continue
            held = tree.triangle[~child]
            used = held[held >= 0]
            filled[~child] += 1
            seen[used] += 1
            assert (tree.slot[used] == ~child * 8 + np.flatnonzero(held >= 0)).all()
            yield box, corners[used].reshape(-1, 3)

    yield from below(0, 1)
    assert (seen == 1).all(), "every triangle once"
    assert (visited == 1).all(), "every node once"
    assert (filled == 1).all(), "every block once"


def check_tree(tree: Tree, scene: Scene) -> None:
    surfaces = round_surfaces(scene)
    for box, points in walk(tree, surfaces.corners_m):
        np.testing.assert_array_equal(box, np.concatenate([points.min(axis=0), points.max(axis=0)]))
    block, lane = np.divmod(tree.slot, 8)
    np.testing.assert_array_equal(tree.geometry[block, :9, lane].reshape(-1, 3, 3), surfaces.corners_m)
    np.testing.assert_array_equal(tree.geometry[block, 9:, lane], surfaces.normal)
    np.testing.assert_array_equal(tree.edges, squared_edges(scene.vertices_m[scene.triangles]))
    assert tree.triangle.shape == (tree.n_blocks, 8)
    assert 7 * tree.n_levels < 400, "the stack of a beam stays in its cache"


def digest(tree: Tree) -> str:
    return hashlib.sha256(b"".join(getattr(tree, name).tobytes() for name in ARRAYS)).hexdigest()


def soup(seed: int, count: int, kind: str) -> np.ndarray:
    """Corners (count, 3, 3) of triangles that a builder may stumble over."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 3, 3))
    if kind == "flat":
        corners[..., 2] = 3.0
    elif kind == "on one line":
        corners[..., 1:] = 0.0
    elif kind == "few places":
        corners = corners[rng.integers(0, max(1, count // 40), count)]
    elif kind == "one place":
        corners = np.broadcast_to(corners[:1], corners.shape)
    elif kind == "points":
        corners = np.repeat(corners[:, :1], 3, axis=1)
    elif kind == "huge spread":
        corners = corners * 10.0 ** rng.uniform(-6, 6, (count, 1, 1))
    elif kind == "far and small":
        corners = 1e-3 * corners + np.where(rng.random((count, 1, 1)) < 0.1, 5e5, 0.0)
    return np.ascontiguousarray(corners)


KINDS = ("anywhere", "flat", "on one line", "few places", "one place", "points", "huge spread", "far and small")


@pytest.fixture
def scene_of_corners(shapes: SimpleNamespace):
    return lambda corners: shapes.scene_of(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


@pytest.fixture(scope="module")
def binned_sah() -> ModuleType:
    spec = importlib.util.spec_from_file_location("binned_sah", BINNED_SAH)
    module = importlib.util.module_from_spec(spec)
    sys.modules["binned_sah"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.one_of(st.integers(1, 20), st.integers(60, 70), st.integers(1, 700)),
    kind=st.sampled_from(KINDS),
)
def test_a_tree_holds_every_triangle_once_in_tight_boxes(
    device: Device, shapes: SimpleNamespace, seed: int, count: int, kind: str
) -> None:
    corners = soup(seed, count, kind)
    scene = shapes.scene_of(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    check_tree(build_tree(scene, device), scene)


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 8, 9, 64, 65, 5000])
def test_a_tree_of_triangles_in_one_place_is_shallow(device: Device, scene_of_corners, count: int) -> None:
    scene = scene_of_corners(soup(1, count, "one place"))
    tree = build_tree(scene, device)
    check_tree(tree, scene)
    assert tree.n_levels <= 2 + np.log2(count) / 2


@pytest.mark.parametrize("growth", [1.001, 1.03])
def test_a_row_in_which_each_is_nearest_to_the_one_before_takes_few_rounds(
    device: Device, scene_of_corners, monkeypatch: pytest.MonkeyPatch, growth: float
) -> None:
    # Gaps grow along the row, so that by distance alone one pair a round would merge.
    at = np.cumsum(growth ** np.arange(1000))
    corners = at[:, None, None] * np.ones(3) + 0.2 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1]])
    rounds = []
    run = Program.run

    def counted(program: Program, kernel: str, *arguments: object, **named: int) -> None:
        rounds.append(kernel == "find_nearest")
        run(program, kernel, *arguments, **named)

    monkeypatch.setattr(Program, "run", counted)
    tree = build_tree(scene_of_corners(corners), device)
    assert sum(rounds) < 120
    assert tree.n_levels <= 20


@pytest.mark.slow
def test_a_tree_of_many_treelets_is_right(device: Device, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.sphere_of(1.0, 60, 120))
    check_tree(build_tree(scene, device), scene)


def test_blocks_are_nearly_full_and_memory_is_small(device: Device, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.sphere_of(1.0, 60, 120))
    tree = build_tree(scene, device)
    assert scene.n_triangles > 7 * tree.n_blocks
    assert tree.n_bytes == sum(getattr(tree, name).nbytes for name in ARRAYS)
    assert tree.n_bytes < 100 * scene.n_triangles


def test_building_gives_all_its_memory_back_but_the_tree(own_device: Device, shapes: SimpleNamespace) -> None:
    tree = build_tree(shapes.scene_of(*shapes.sphere_of(1.0, 20, 40)), own_device)
    assert own_device.held_bytes == tree.n_bytes


@pytest.mark.parametrize("kind", [pytest.param("anywhere", marks=pytest.mark.slow), "few places"])
def test_a_tree_does_not_depend_on_chunks_or_packets(
    device: Device, scene_of_corners, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    scene = scene_of_corners(soup(5, 3000, kind))
    first = digest(build_tree(scene, device))
    assert digest(build_tree(scene, device)) == first
    monkeypatch.setattr(sort, "_MIN_CHUNK", 7)
    assert digest(build_tree(scene, device)) == first
    monkeypatch.setattr(sort, "_DIGIT_BITS", {})
    monkeypatch.setattr(tree, "_LANES", {})
    assert digest(build_tree(scene, device)) == first
    for few_clusters, few_nodes in ((200, 10), (1, 0), (10**6, 10**6)):  # rounds and levels one launch has for itself
        monkeypatch.setattr(tree, "_FEW_CLUSTERS", {device.kind: few_clusters})
        monkeypatch.setattr(tree, "_FEW_NODES", {device.kind: few_nodes})
        assert digest(build_tree(scene, device)) == first


def test_normals_and_edges_are_the_same_without_float64_on_the_device(
    device: Device, shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(30, seed=3))
    here = build_tree(scene, device)
    assert tree.has_float64(device), "PoCL has it: without it this would compare a thing with itself"
    monkeypatch.setattr(tree, "has_float64", lambda device: False)
    assert digest(build_tree(scene, device)) == digest(here)


def test_the_cost_is_the_sum_of_all_boxes_areas_over_the_roots(device: Device, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(40, seed=4))
    tree = build_tree(scene, device)

    def area(points: np.ndarray) -> float:
        x, y, z = np.ptp(points.astype(np.float64), axis=0)
        return 2.0 * (x * y + y * z + z * x)

    corners = round_surfaces(scene).corners_m
    expected = 1.0 + sum(area(points) for _, points in walk(tree, corners)) / area(corners.reshape(-1, 3))
    assert tree.sah_cost == pytest.approx(expected, rel=1e-12)
    np.testing.assert_array_equal(tree.bounds_m, [corners.min(axis=(0, 1)), corners.max(axis=(0, 1))])


# What is built for tiles of beams rather than for lines may cost a line a little more where triangles are small.
@pytest.mark.slow
@pytest.mark.parametrize(("make", "at_most"), [("clutter", 1.0), ("sphere", 1.05), ("soup", 1.05)])
def test_a_tree_is_no_worse_than_one_of_binned_splits(
    device: Device, shapes: SimpleNamespace, binned_sah: ModuleType, scene_of_corners, make: str, at_most: float
) -> None:
    scene = {
        "clutter": lambda: shapes.scene_of(*shapes.clutter_of(250, seed=2)),
        "sphere": lambda: shapes.scene_of(*shapes.sphere_of(1.0, 30, 60)),
        "soup": lambda: scene_of_corners(soup(2, 3000, "anywhere") * 0.05 + soup(3, 3000, "points")),
    }[make]()
    reference = binned_sah.build(round_surfaces(scene).corners_m)
    tree = build_tree(scene, device)
    assert binned_sah.sah_cost(tree.boxes) == pytest.approx(tree.sah_cost)
    assert tree.sah_cost <= at_most * binned_sah.sah_cost(reference.boxes)
    assert tree.n_blocks <= len(reference.triangle)


def test_normals_are_those_of_the_rounded_triangles(shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.sphere_of(2.0, 10, 20))
    surfaces = round_surfaces(scene)
    corners = surfaces.corners_m.astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(surfaces.normal, cross / np.linalg.norm(cross, axis=1, keepdims=True), atol=1e-7)
    none = round_surfaces(shapes.scene_of(np.zeros((3, 3)), np.array([[0, 1, 2]])))
    assert (none.normal == 0).all()


def test_building_takes_130_bytes_a_triangle(
    own_device: Device, shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = shapes.scene_of(*shapes.sphere_of(2.0, 60, 120))
    most, real = [0], Device._keep

    def keep(self: Device, handle: object, n_bytes: int, memory: object = None) -> object:
        buffer = real(self, handle, n_bytes, memory)
        most[0] = max(most[0], self.held_bytes)
        return buffer

    monkeypatch.setattr(Device, "_keep", keep)
    tree = build_tree(scene, own_device)
    assert 120 < most[0] / scene.n_triangles < 130
    del tree
    assert own_device.held_bytes == 0
