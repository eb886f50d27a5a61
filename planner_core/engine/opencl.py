"""Scanning on an OpenCL device: packets of beams through a tree of eight-wide nodes, see kernels/README.md.

Local frame, metres. The rules all engines keep are at the head of `planner_core.engine.scan_engine`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property

import numpy as np

from planner_core.device import Buffer, Device, in_batches
from planner_core.engine.patch_returns import (
    BATCH_BYTES,
    Content,
    PatchRows,
    ReturnRows,
    RowCollector,
    RowStore,
    follow_on,
    join_bands,
    no_rows,
)
from planner_core.engine.scan_engine import check_positions, check_rays
from planner_core.engine.tiles import TiledTemplate
from planner_core.engine.traced_surfaces import traced_surfaces
from planner_core.engine.tree import Tree, build_tree, walk_defines
from planner_core.model import (
    BeamTemplate,
    Float32Array,
    FloatArray,
    Patches,
    RayHits,
    ScanBatch,
    Scene,
)
from planner_core.progress import Progress, ProgressEvent
from planner_core.scanner.template import Band, bands

#: Free rays a work-item and how many of those it has under way at once, a wave. A CPU looks ahead into the next steps
#: of several walks; other devices have work-items for that. Measured: docs/method/scan-engine.md.
_RAYS = {"cpu": (256, 32)}
#: Results of a position larger than this don't fit into the cache of a core: their memory is prefetched, too.
_CACHED_RESULTS_BYTES = 2**20

#: Positions that one making of a band's tiles serves, and that progress hears of at the latest.
_CHUNK = 64
#: Beams of a template that are tiled at once; a scanner with more is scanned in bands of rows.
_BAND_BEAMS = 2**20
#: Beams of a template whose tiles are kept on the device for the next call, 12 bytes a beam and little more.
_KEPT_BEAMS = 2**23


class OpenCLEngine(RowCollector):
    """A `ScanEngine` on an OpenCL device. See the protocol for what the methods take and return."""

    name = "opencl"

    def __init__(
        self,
        scene: Scene,
        patches: Patches,
        device: Device,
        *,
        batch_bytes: int = BATCH_BYTES,
        band_beams: int = _BAND_BEAMS,
    ) -> None:
        self.device = device.label
        self.warnings: tuple[str, ...] = ()
        self._on = device
        self._whole_scene = scene
        self._n_patches = patches.n_patches
        self._batch_bytes, self._band_beams = batch_bytes, band_beams
        self.traced = traced_surfaces(scene, patches)
        self.tree = build_tree(self.traced.scene, device)
        address = np.stack([self.traced.first_patch, self.traced.patches.depth.astype(np.int32)], axis=1)
        self._scene = {**self.tree.on_device, **device.upload("scene", {"address": address})}
        whole = self.traced.triangle
        # Arguments of `scan_tiles` that name triangles as the whole scene does.
        self._names = (
            device.upload("scene", {"whole": np.zeros(1, dtype=np.int32) if whole is None else whole})["whole"],
            np.int32(whole is not None),
        )
        self._walk = _walk_of(self.tree)
        self._kept_template: BeamTemplate | None = None
        self._kept: dict[int, TiledTemplate] = {}

    @property
    def on_device(self) -> tuple[Device, Mapping[str, Buffer], int]:
        """The device, the scene's buffers by name (tree.h, block.h, hit.h), STACK of this tree: for other kernels."""
        return self._on, self._scene, self._walk["STACK"]

    @cached_property
    def _solid(self) -> Tree:
        """The tree that free rays go through: glass is in it. Made when first used, where it is another one."""
        return self.tree if self.traced.triangle is None else build_tree(self._whole_scene, self._on)

    def cast_rays(
        self, origins_m: FloatArray, directions: FloatArray, *, range_max_m: float, through_glass: bool = False
    ) -> RayHits:
        """See `ScanEngine.cast_rays`."""
        origins, unit = check_rays(origins_m, directions, range_max_m)
        rays = np.empty((len(origins), 6), dtype=np.float32)
        rays[:, :3], rays[:, 3:] = origins, unit
        if not through_glass:
            return self.cast_prepared(rays, range_max_m=range_max_m)
        hits = self._cast(self.tree, rays, range_max_m)
        return replace(hits, triangle=self.traced.in_whole_scene(hits.triangle))

    def cast_prepared(self, rays: Float32Array, *, range_max_m: float) -> RayHits:
        """`cast_rays` for rays (N, 6), origin and UNIT direction, that nobody checks."""
        return self._cast(self._solid, rays, range_max_m)

    def _cast(self, tree: Tree, rays: Float32Array, range_max_m: float) -> RayHits:
        range_m = np.empty(rays.shape[0], dtype=np.float32)
        triangle = np.empty(rays.shape[0], dtype=np.int32)
        if rays.shape[0] == 0:
            return RayHits(range_m=range_m, triangle=triangle)
        per_item, walks = _RAYS.get(self._on.kind, (1, 1))
        wave = {"RAYS": per_item, "WALKS": walks, "PAIRS": int(self._on.max_lanes >= 16)}
        program = self._on.program("cast_rays.cl", {"LANES": 1, **wave, **_walk_of(tree)})
        hits = {"range": range_m, "triangle": triangle}
        with self._on.inputs("rays", {"rays": rays}) as queries, self._on.outputs("hits", hits) as out:
            program.run(
                "cast_rays",
                (-(-rays.shape[0] // per_item),),
                *(tree.on_device[name] for name in ("boxes", "children", "geometry", "triangle")),
                queries["rays"],
                np.int32(rays.shape[0]),
                np.float32(range_max_m),
                tree.sphere,
                out["range"],
                out["triangle"],
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
        at = self._on.upload("positions", {"positions": positions})
        arrays = {
            "range": batch.range_m,
            "triangle": batch.triangle,
            "patch": batch.patch,
            "cosine": batch.cos_incidence,
        }
        n_bytes = sum(array.nbytes for array in arrays.values()) // len(positions)
        ahead = int(self._on.kind == "cpu" and n_bytes > _CACHED_RESULTS_BYTES)
        with self._on.outputs("scans", arrays) as out:
            for band in self._bands(template):
                with self._tiled(band, template) as tiles:
                    tiles.program("scan_tiles.cl", AHEAD=ahead).run(
                        "scan_tiles",
                        (tiles.n_tiles, positions.shape[0]),
                        *self._scene.values(),
                        *tiles.beam_arguments,
                        at["positions"],
                        *self._names,
                        *(out[name] for name in arrays),
                    )
                    if not _is_kept(template):
                        self._on.finish("scan of a band")  # before its tiles go
        return batch

    def _collect(
        self, template: BeamTemplate, positions_m: FloatArray, content: Content, progress: Progress
    ) -> RowStore:
        """Stream positions through the device chunk by chunk; of a large template, band by band in every chunk.

        Nothing is queued while `progress` runs, so that whatever it raises leaves the device at rest.
        """
        positions = check_positions(positions_m).astype(np.float32)
        n_positions, store = len(positions), RowStore(self._n_patches)
        parts = self._bands(template)
        with PatchRows(
            self._on, self._scene, n_patches=self._n_patches, content=content, batch_bytes=self._batch_bytes
        ) as patch_rows:
            for first in range(0, n_positions, _CHUNK):
                chunk = positions[first : first + _CHUNK]
                # Of S positions and B bands, S / B are done when one band is.
                rows = [no_rows(len(chunk))]
                for index, band in enumerate(parts):

                    def report(done: int, first: int = first, n_before: int = index * len(chunk)) -> None:
                        progress(ProgressEvent("scan", first + (n_before + done) // len(parts), n_positions))

                    with self._tiled(band, template) as tiles:
                        of_band = self._rows_of_band(patch_rows, tiles, chunk, report)
                    rows = of_band if index == 0 else [join_bands(follow_on(rows), follow_on(of_band))]
                for batch in rows:
                    store.append(batch)
        return store

    def _rows_of_band(
        self, patch_rows: PatchRows, tiles: TiledTemplate, chunk: Float32Array, report: Callable[[int], None]
    ) -> list[ReturnRows]:
        """Rows of a chunk of positions, in batches as large as memory allows; `report` gets how many are done."""
        batches: list[ReturnRows] = []

        def work(first: int, end: int) -> None:
            batches.append(patch_rows.rows(tiles, chunk[first:end]))
            report(end)

        in_batches(len(chunk), patch_rows.n_batch(tiles), work, on_smaller=self._warn)
        return batches

    def _bands(self, template: BeamTemplate) -> list[Band]:
        return list(bands(template, max_beams=self._band_beams)) if 0 not in template.shape else []

    @contextmanager
    def _tiled(self, band: Band, template: BeamTemplate) -> Iterator[TiledTemplate]:
        """Tiles of one of a template's bands: kept for the next call with this template, or for now if it is large."""
        tiles = self._kept.get(band.first_row)
        if tiles is not None and self._kept_template is template and tiles.has_wanted_shape:
            yield tiles
            return
        if self._kept_template is not template:
            self._kept.clear()  # its buffers go before the new ones are made
        tiles = TiledTemplate(
            band.template, self._on, walk=self._walk, first_row=band.first_row, image_rows=template.shape[0]
        )
        if _is_kept(template):
            self._kept_template, self._kept[band.first_row] = template, tiles
            yield tiles
            return
        try:
            yield tiles
        finally:
            tiles.release()

    def _warn(self, line: str) -> None:
        """Tell of smaller batches once: every chunk finds out for itself."""
        self.warnings = self.warnings or (line,)


def _walk_of(tree: Tree) -> dict[str, int]:
    return walk_defines(tree.device, tree.n_levels, tree.n_bytes)


def _is_kept(template: BeamTemplate) -> bool:
    return template.shape[0] * template.shape[1] <= _KEPT_BEAMS
