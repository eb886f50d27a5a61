"""Parts of a scene that is larger than a device: a tree each, kept on disk, on the device as long as there is room.

Storey by storey, and storeys that are too large halved. Local frame, metres. What is hit does not depend on the parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from planner_core.device import MEMORY_VARIABLE, Buffer, Device
from planner_core.engine.tree import build_tree
from planner_core.errors import DeviceMemoryError
from planner_core.model import Float32Array, Int32Array, Scene
from planner_core.scene.array_rows import chunks

#: Bytes a triangle while its tree is built (measured: 120 to 127), with its patch's address; and of its largest buffer.
BUILDING_BYTES, _LARGEST_BUFFER_BYTES = 138, 64
#: What of the device may go into building one part: the rest is for what is scanned meanwhile.
_PART_SHARE = 0.5
#: What of the device's memory parts may hold, one at least, which is smaller: the rest is for beams and results.
_HELD_SHARE = 0.5
#: Triangles of a part at least: below it, nothing but bringing parts would be done.
_LEAST_PART = 256
#: Buffers of a tree in the order of the kernels' arguments, then numbers in the whole scene.
_ARRAYS = ("boxes", "children", "geometry", "triangle", "slot", "edges", "address", "numbers")


def fits(device: Device, n_triangles: int) -> bool:
    """Whether one tree of so many triangles can be built, with room for scanning."""
    one_buffer = _LARGEST_BUFFER_BYTES * n_triangles <= device.max_buffer_bytes
    return one_buffer and BUILDING_BYTES * n_triangles <= 0.9 * device.free_bytes


@dataclass(frozen=True)
class Part:
    """One part: where its arrays lie on disk, their bytes, its bounds (2, 3) and the levels of its tree."""

    file: Path
    n_bytes: int
    bounds_m: Float32Array
    n_levels: int


class Parts:
    """All parts of one scene; their files go with this object."""

    def __init__(self, scene: Scene, address: Int32Array, device: Device) -> None:
        """Build and put down one tree after the other; `address` (T, 2) int32: kernels/hit.h.

        Raises
        ------
        DeviceMemoryError
            Memory does not even do for parts of some hundred triangles.
        """
        self._on = device
        self._folder = TemporaryDirectory(prefix="tlsplan-parts-")
        self._held: dict[int, dict[str, Buffer]] = {}
        most = int(
            min(_PART_SHARE * device.free_bytes / BUILDING_BYTES, device.max_buffer_bytes / _LARGEST_BUFFER_BYTES)
        )
        if most < _LEAST_PART:
            raise DeviceMemoryError(
                f"scene in parts: {device.free_bytes} bytes available on {device.label}, expected at least "
                f"{int(_LEAST_PART * BUILDING_BYTES / _PART_SHARE)}; allow more memory ({MEMORY_VARIABLE})"
            )
        self.parts = [self._put_down(scene, address, numbers) for numbers in split(scene, most)]
        low = np.min([part.bounds_m[0] for part in self.parts], axis=0)
        high = np.max([part.bounds_m[1] for part in self.parts], axis=0)
        self.bounds_m: Float32Array = np.stack([low, high])
        self.n_levels = max(part.n_levels for part in self.parts)

    def _put_down(self, scene: Scene, address: Int32Array, numbers: Int32Array) -> Part:
        used, corners = np.unique(scene.triangles[numbers], return_inverse=True)
        own = replace(
            scene,
            vertices_m=scene.vertices_m[used],
            triangles=corners.reshape(-1, 3).astype(np.int32),
            element_of_triangle=scene.element_of_triangle[numbers],
            optics_of_triangle=None,
        )
        tree = build_tree(own, self._on)
        arrays = {name: getattr(tree, name) for name in _ARRAYS[:6]}
        arrays |= {"address": address[numbers], "numbers": numbers}
        file = Path(self._folder.name) / str(numbers[0])
        file.mkdir()
        for name, array in arrays.items():
            np.save(file / f"{name}.npy", array)
        part = Part(file, sum(array.nbytes for array in arrays.values()), tree.bounds_m, tree.n_levels)
        for buffer in tree.on_device.values():
            buffer.release()
        return part

    def on_device(self, index: int) -> dict[str, Buffer]:
        """Buffers of a part by name, in the order of the kernels' arguments; unused ones make room."""
        held = self._held.pop(index, None)
        if held is None:
            part = self.parts[index]
            while self._held and self._held_bytes + part.n_bytes > _HELD_SHARE * self._on.memory_bytes:
                self._give_back(next(iter(self._held)))
            arrays = {name: np.load(part.file / f"{name}.npy", mmap_mode="r") for name in _ARRAYS}
            held = self._on.upload("part of the scene", arrays)
        self._held[index] = held  # the last one used is the last of the dictionary
        return held

    @property
    def _held_bytes(self) -> int:
        return sum(self.parts[index].n_bytes for index in self._held)

    def _give_back(self, index: int) -> None:
        for buffer in self._held.pop(index).values():
            buffer.release()

    def leave_device(self) -> None:
        """Give all of the device's memory back; parts are brought again when they are used."""
        for index in list(self._held):
            self._give_back(index)


def split(scene: Scene, most: int) -> list[Int32Array]:
    """Triangles (K,) int32, ascending, of every part: each at most `most`, storeys as they lie on each other."""
    height_m = np.empty(scene.n_triangles, dtype=np.float32)
    for some in chunks(scene.n_triangles):
        height_m[some] = scene.vertices_m[:, 2][scene.triangles[some]].mean(axis=1)
    starts = np.sort([storey.elevation_m for storey in scene.storeys])[1:]
    storey = np.searchsorted(starts, height_m, side="right").astype(np.int32)
    groups = [np.flatnonzero(storey == k).astype(np.int32) for k in range(starts.size + 1)]
    parts: list[Int32Array] = []
    for group in groups:
        if parts and group.size and parts[-1].size + group.size <= most:
            parts[-1] = np.sort(np.concatenate([parts[-1], group]))
        else:
            parts += _halved(scene, group, most) if group.size else []
    return parts


def _halved(scene: Scene, numbers: Int32Array, most: int) -> Iterator[Int32Array]:
    """Cut across the longest side, between as many triangles to either side, until no part has more than `most`."""
    if numbers.size <= most:
        yield numbers
        return
    middle = np.empty((numbers.size, 3), dtype=np.float32)
    for some in chunks(numbers.size):
        middle[some] = scene.vertices_m[scene.triangles[numbers[some]]].mean(axis=1)
    along = middle[:, int(np.argmax(np.ptp(middle, axis=0)))]
    order = np.argsort(along, kind="stable")
    half = numbers.size // 2
    for side in (order[:half], order[half:]):
        yield from _halved(scene, np.sort(numbers[side]), most)
