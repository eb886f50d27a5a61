"""The tree over the scene's triangles: blocks of eight triangles, nodes of eight children; layout in kernels/tree.h.

Built on the device by locally-ordered clustering, docs/method/tree.md. Float32, metres, local frame. Deterministic: the
same scene gives the same bytes, on any number of cores.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Buffer, Device
from planner_core.engine.tree_clusters import cluster_triangles
from planner_core.engine.tree_wide import widen
from planner_core.model import Float32Array, FloatArray, Int32Array, Scene

_Scalar = TypeVar("_Scalar", bound=np.generic)

#: Trees larger than this don't fit into a processor's caches: the walk then asks for memory ahead.
_CACHED_BYTES = 16 * 2**20
WIDTH = 8
"""Children of a node and triangles of a block, fixed in the kernels."""


@dataclass(frozen=True)
class Tree:
    """Arrays for the kernels, on the device; properties of the same names copy them to the host when first used.

    on_device : `boxes`, `children`, `geometry`, `triangle`, `slot`, `edges`, in the order of the kernels' arguments.
    """

    device: Device
    on_device: Mapping[str, Buffer]
    n_triangles: int
    n_nodes: int
    n_blocks: int
    n_levels: int
    """Levels of wide nodes."""

    @property
    def n_bytes(self) -> int:
        """Memory of all arrays."""
        return sum(buffer.n_bytes for buffer in self.on_device.values())

    @cached_property
    def boxes(self) -> Float32Array:
        """(N, 6, 8) float32 of every child of every node; an unused child's box is inside out."""
        return self._copy("boxes", np.empty((self.n_nodes, 6, WIDTH), dtype=np.float32))

    @cached_property
    def children(self) -> Int32Array:
        """(N, 8) int32: a node, or ~block."""
        return self._copy("children", np.empty((self.n_nodes, WIDTH), dtype=np.int32))

    @cached_property
    def geometry(self) -> Float32Array:
        """(B, 12, 8) float32: corners and normal of the triangles of every block."""
        return self._copy("geometry", np.empty((self.n_blocks, 12, WIDTH), dtype=np.float32))

    @cached_property
    def triangle(self) -> Int32Array:
        """(B, 8) int32, -1 in an empty lane."""
        return self._copy("triangle", np.empty((self.n_blocks, WIDTH), dtype=np.int32))

    @cached_property
    def slot(self) -> Int32Array:
        """(T,) int32, block * 8 + lane of every triangle."""
        return self._copy("slot", np.empty(self.n_triangles, dtype=np.int32))

    @cached_property
    def edges(self) -> Float32Array:
        """(T, 3) float32, squared edge lengths in m2, see `planner_core.scene.patches.squared_edges`."""
        return self._copy("edges", np.empty((self.n_triangles, 3), dtype=np.float32))

    @cached_property
    def bounds_m(self) -> Float32Array:
        """(2, 3) float32: lowest and highest corner of all triangles."""
        root = np.empty((6, WIDTH), dtype=np.float32)
        self.device.read(self.on_device["boxes"], root)
        return np.stack([root[:3].min(axis=1), root[3:].max(axis=1)])

    @cached_property
    def sphere(self) -> Float32Array:
        """(4,) float32, centre and radius of a sphere round all triangles."""
        return sphere_of(self.bounds_m)

    @cached_property
    def sah_cost(self) -> float:
        """Expected nodes plus blocks that a random line through the tree's box meets: smaller is better.

        Surface area heuristic: a convex box inside another one is met by a line that meets the other with the
        probability of the areas' ratio. One where all triangles lie on one line.
        """
        low, high = self.bounds_m.astype(np.float64)
        used = (self.boxes[:, :3] <= self.boxes[:, 3:]).all(axis=1)
        boxes = self.boxes.astype(np.float64)
        met = float(_half_area(boxes[:, :3], boxes[:, 3:])[used].sum())
        return 1.0 + met / max(float(_half_area(low, high, axis=0)), 1e-30)

    def _copy(self, name: str, into: NDArray[_Scalar]) -> NDArray[_Scalar]:
        self.device.read(self.on_device[name], into)
        return into


def build_tree(scene: Scene, device: Device) -> Tree:
    """Build the tree of a scene of at least one triangle on `device`.

    Raises
    ------
    DeviceError
        The device's memory does not suffice: some 130 bytes a triangle while building.
    """
    triangles = {"vertices": scene.vertices_m.astype(np.float32), "corners": scene.triangles}
    binary = cluster_triangles(device, triangles, scene.n_triangles)
    outline, arrays = widen(device, scene, triangles, binary)
    return Tree(
        device=device,
        on_device=arrays,
        n_triangles=scene.n_triangles,
        n_nodes=outline.n_nodes,
        n_blocks=outline.n_blocks,
        n_levels=len(outline.levels),
    )


def walk_defines(device: Device, n_levels: int, n_bytes: int) -> dict[str, int]:
    """Build options of kernels that walk trees of so many levels and bytes at most."""
    # One node leaves at most 7 siblings on the stack, and the root needs an entry. In steps of 64, so that scenes of
    # different depths share their built programs.
    stack = -(-(7 * n_levels + 1) // 64) * 64
    return {"STACK": stack, "PREFETCH": int(device.kind == "cpu" and n_bytes > _CACHED_BYTES)}


def sphere_of(bounds_m: Float32Array) -> Float32Array:
    """(4,) float32, centre and radius of a sphere round bounds (2, 3)."""
    low, high = bounds_m
    radius = np.float32(1.001 * np.linalg.norm((high.astype(np.float64) - low) / 2))
    return np.array([*(low + (high - low) / 2), radius], dtype=np.float32)


def _half_area(low: FloatArray, high: FloatArray, *, axis: int = 1) -> FloatArray:
    x, y, z = np.moveaxis(high - low, axis, 0)
    return np.asarray(x * y + y * z + z * x)
