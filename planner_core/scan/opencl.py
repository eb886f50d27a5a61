"""Scanning on an OpenCL device: packets of beams through a tree of eight-wide nodes, see kernels/README.md.

Local frame, metres. The rules all engines keep are at the head of `planner_core.scan.engine`.
"""

from __future__ import annotations

import numpy as np

from planner_core.device import Buffer, Device
from planner_core.model import (
    BeamTemplate,
    Float32Array,
    FloatArray,
    Int32Array,
    Patches,
    RayHits,
    ScanBatch,
    Scene,
    UInt8Array,
    Visibility,
)
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scan.engine import check_positions, check_rays
from planner_core.scan.surfaces import round_surfaces
from planner_core.scan.tiled_template import TiledTemplate
from planner_core.scan.tree import build_tree
from planner_core.scene.patches import squared_edges

#: Rays a work-group on a CPU: one ray is too little work for a group's overhead.
_RAY_GROUP = 64

#: Marks (one byte a patch and position) that a batch of `visible_patches` may hold; results do not depend on it.
_MARK_BYTES = 256 * 2**20
#: Positions a batch at most, so that progress is heard of.
_MAX_BATCH = 64


class OpenCLEngine:
    """A `ScanEngine` on an OpenCL device. See the protocol for what the methods take and return."""

    name = "opencl"

    def __init__(self, scene: Scene, patches: Patches, device: Device, *, mark_bytes: int = _MARK_BYTES) -> None:
        self.device = device.label
        self.warnings: tuple[str, ...] = ()
        self._on = device
        self._n_patches = patches.n_patches
        self._mark_bytes = mark_bytes
        surfaces = round_surfaces(scene)
        self.tree = build_tree(surfaces, device)
        self._scene = device.upload(
            "scene",
            {
                "boxes": self.tree.boxes,
                "children": self.tree.children,
                "geometry": self.tree.geometry,
                "triangle": self.tree.triangle,
                "slot": self.tree.slot,
                "edges": squared_edges(scene.vertices_m[scene.triangles]),
                "address": np.stack([patches.first_patch[:-1], patches.depth.astype(np.int32)], axis=1),
            },
        )
        low, high = surfaces.corners_m.min(axis=(0, 1)), surfaces.corners_m.max(axis=(0, 1))
        radius = np.float32(1.001 * np.linalg.norm((high.astype(np.float64) - low) / 2))
        self._sphere = np.array([*(low + (high - low) / 2), radius], dtype=np.float32)
        # One node leaves at most 7 siblings on the stack, and the root needs an entry. In steps of 64, so that scenes
        # of different depths share their built programs.
        self._stack = -(-(7 * self.tree.n_levels + 1) // 64) * 64
        self._tiles: TiledTemplate | None = None

    def cast_rays(self, origins_m: FloatArray, directions: FloatArray, *, range_max_m: float) -> RayHits:
        """See `ScanEngine.cast_rays`."""
        origins, unit = check_rays(origins_m, directions, range_max_m)
        rays = np.concatenate([origins, unit], axis=1).astype(np.float32)
        range_m = np.empty(rays.shape[0], dtype=np.float32)
        triangle = np.empty(rays.shape[0], dtype=np.int32)
        if rays.shape[0] == 0:
            return RayHits(range_m=range_m, triangle=triangle)
        program = self._on.program("cast_rays.cl", {"LANES": 1, "STACK": self._stack})
        queries = self._on.upload("rays", {"rays": rays})
        with self._on.outputs("hits", {"range": range_m, "triangle": triangle}) as out:
            program.run(
                "cast_rays",
                (-(-rays.shape[0] // _RAY_GROUP) * _RAY_GROUP,),
                *(self._scene[name] for name in ("boxes", "children", "geometry", "triangle")),
                queries["rays"],
                np.int32(rays.shape[0]),
                np.float32(range_max_m),
                self._sphere,
                out["range"],
                out["triangle"],
                cpu_group=_RAY_GROUP,
            )
        return RayHits(range_m=range_m, triangle=triangle)

    def scan(self, template: BeamTemplate, positions_m: FloatArray) -> ScanBatch:
        """See `ScanEngine.scan`."""
        positions = check_positions(positions_m).astype(np.float32)
        shape = (positions.shape[0], *template.shape)
        batch = ScanBatch(
            range_m=np.empty(shape, dtype=np.float32),
            triangle=np.empty(shape, dtype=np.int32),
            patch=np.empty(shape, dtype=np.int32),
            cos_incidence=np.empty(shape, dtype=np.float32),
        )
        if 0 in shape:
            return batch
        tiles = self._prepare(template)
        at = self._on.upload("positions", {"positions": positions})
        arrays = {
            "range": batch.range_m,
            "triangle": batch.triangle,
            "patch": batch.patch,
            "cosine": batch.cos_incidence,
        }
        with self._on.outputs("scans", arrays) as out:
            tiles.program("scan_tiles.cl").run(
                "scan_tiles",
                (tiles.n_tiles, positions.shape[0]),
                *self._scene.values(),
                *tiles.beam_arguments,
                at["positions"],
                *(out[name] for name in arrays),
            )
        return batch

    def visible_patches(
        self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent
    ) -> Visibility:
        """See `ScanEngine.visible_patches`."""
        positions = check_positions(positions_m).astype(np.float32)
        n_positions = positions.shape[0]
        rows: list[Int32Array] = []
        if n_positions:
            n_batch = max(1, min(n_positions, _MAX_BATCH, self._mark_bytes // self._n_patches))
            marks = np.empty((n_batch, self._n_patches), dtype=np.uint8)
            on_device = self._on.allocate("marks of seen patches", marks.nbytes)
            for first in range(0, n_positions, n_batch):
                batch = positions[first : first + n_batch]
                self._mark(template, batch, on_device, marks)
                rows.extend(np.flatnonzero(row.view(np.bool_)).astype(np.int32) for row in marks[: len(batch)])
                progress(ProgressEvent("scan", len(rows), n_positions))
        starts = np.zeros(n_positions + 1, dtype=np.int64)
        starts[1:] = np.cumsum([row.size for row in rows], dtype=np.int64)
        patch = np.concatenate(rows) if rows else np.empty(0, dtype=np.int32)
        return Visibility(starts=starts, patch=patch, n_patches=self._n_patches)

    def _mark(self, template: BeamTemplate, batch: Float32Array, on_device: Buffer, marks: UInt8Array) -> None:
        """Fill the first rows of `marks`: 1 where a position of the batch sees the patch."""
        tiles = self._prepare(template)
        at = self._on.upload("positions", {"positions": batch})
        self._on.zero(on_device, len(batch) * self._n_patches)
        tiles.program("see_patches.cl").run(
            "mark_patches",
            (tiles.n_tiles, len(batch)),
            *self._scene.values(),
            *tiles.beam_arguments,
            at["positions"],
            on_device,
            np.int32(self._n_patches),
        )
        self._on.read(on_device, marks[: len(batch)])

    def _prepare(self, template: BeamTemplate) -> TiledTemplate:
        """Make and upload the template's tiles, unless the last call had the same template."""
        if self._tiles is None or not self._tiles.fits(template):
            self._tiles = None  # its buffers go before the new ones are made
            self._tiles = TiledTemplate(template, self._on, stack=self._stack)
        return self._tiles
