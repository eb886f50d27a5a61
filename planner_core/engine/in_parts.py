"""A `ScanEngine` for scenes larger than the device: part after part is brought there, hits merge by range.

The same bits as `planner_core.engine.opencl.OpenCLEngine`, which holds the whole tree. Local frame, metres.

Where a scene is scanned in parts, it is known only at the end which hits are first: `HitSums` make rows of patches from
whole scans on the host, to the bit that kernels/patch_returns.cl and patch_rows.cl give; docs/method/returns.md.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.device import MEMORY_VARIABLE, Device
from planner_core.engine.parts import Parts
from planner_core.engine.patch_returns import (
    BATCH_BYTES,
    Content,
    ReturnRows,
    RowCollector,
    RowStore,
    follow_on,
    in_metres,
    join_bands,
    no_rows,
)
from planner_core.engine.scan_engine import check_positions, check_rays
from planner_core.engine.tiles import TiledTemplate
from planner_core.engine.traced_surfaces import traced_surfaces
from planner_core.engine.tree import sphere_of, walk_defines
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    Patches,
    RayHits,
    ScanBatch,
    Scene,
)
from planner_core.progress import Progress, ProgressEvent
from planner_core.scanner.template import bands, directions
from planner_core.scene.patches import squared_edges

#: Beams of a template that are tiled at once; a scanner with more is scanned in bands of rows.
_BAND_BEAMS = 2**20
#: Bytes of a beam's results.
_BEAM_BYTES = 16
#: What of the device's memory the positions of a batch may take: results, and what beams have hit so far.
_BATCH_SHARE = 0.2
#: Positions that progress hears of at the latest.
_CHUNK = 64
_RAYS = 64
_F = np.float32
#: As in kernels/patch_returns.cl.
_UNIT, _FARTHEST, _GREATEST_SQUARE = _F(2**20), _F(1.25), _F(1.99)


class PartedEngine(RowCollector):
    """See the protocol for what the methods take and return."""

    name = "opencl"

    def __init__(self, scene: Scene, patches: Patches, device: Device, *, band_beams: int = _BAND_BEAMS) -> None:
        self.device = device.label
        self._on, self._whole_scene, self._band_beams = device, scene, band_beams
        self._n_patches = patches.n_patches
        self.traced = traced_surfaces(scene, patches)
        depth = self.traced.patches.depth.astype(np.int32)
        self._address: Int32Array = np.stack([self.traced.first_patch, depth], axis=1)
        self.parts = Parts(self.traced.scene, self._address, device)
        self._sums = HitSums(self.traced.scene, self._address)
        self.warnings: tuple[str, ...] = (
            f"the scene of {scene.n_triangles} triangles does not fit into the memory of {device.label}, so it is "
            f"scanned in {len(self.parts.parts)} parts (slower, same results); allow more memory ({MEMORY_VARIABLE}) "
            "or take a larger device; patch mode tests its samples with Open3D there",
        )

    @property
    def opened(self) -> Device:
        """The device, for other work on it."""
        return self._on

    @cached_property
    def _solid(self) -> Parts:
        """What free rays meet: glass is in it."""
        if self.traced.triangle is None:
            return self.parts
        self.parts.leave_device()
        nowhere = np.zeros((self._whole_scene.n_triangles, 2), dtype=np.int32)  # rays ask for no patch
        return Parts(self._whole_scene, nowhere, self._on)

    def _leave_to(self, parts: Parts) -> None:
        """Give back what the scene with or without glass holds: there is room for one of them at a time."""
        for other in (self.parts, self.__dict__.get("_solid")):
            if other is not None and other is not parts:
                other.leave_device()

    def cast_rays(
        self, origins_m: FloatArray, directions: FloatArray, *, range_max_m: float, through_glass: bool = False
    ) -> RayHits:
        """See `ScanEngine.cast_rays`."""
        origins, unit = check_rays(origins_m, directions, range_max_m)
        rays = np.concatenate([origins, unit], axis=1).astype(np.float32)
        hits = self._cast(self.parts if through_glass else self._solid, rays, range_max_m)
        return RayHits(
            range_m=hits.range_m,
            triangle=self.traced.in_whole_scene(hits.triangle) if through_glass else hits.triangle,
        )

    def _cast(self, parts: Parts, rays: Float32Array, range_max_m: float) -> RayHits:
        n_rays = rays.shape[0]
        best, range_m = np.zeros(n_rays, dtype=np.float32), np.empty(n_rays, dtype=np.float32)
        triangle = np.full(n_rays, -1, dtype=np.int32)
        if n_rays == 0:
            return RayHits(range_m=range_m, triangle=triangle)
        self._leave_to(parts)
        per_item = _RAYS if self._on.kind == "cpu" else 1
        program = self._on.program(
            "cast_rays.cl",
            {"LANES": 1, "RAYS": per_item, "WALKS": min(per_item, 4), "INVERSE": 1, **_walk_of(self._on, parts)},
        )
        found = {
            "range": np.empty(n_rays, dtype=np.float32),
            "triangle": np.empty(n_rays, dtype=np.int32),
            "inverse": np.empty(n_rays, dtype=np.float32),
        }
        for index, part in enumerate(parts.parts):
            buffers = parts.on_device(index)
            queries = self._on.upload("rays", {"rays": rays})
            with self._on.outputs("hits", found) as out:
                program.run(
                    "cast_rays",
                    (-(-n_rays // per_item),),
                    *(buffers[name] for name in ("boxes", "children", "geometry", "triangle")),
                    queries["rays"],
                    np.int32(n_rays),
                    np.float32(range_max_m),
                    sphere_of(parts.bounds_m),
                    *(out[name] for name in found),
                )
            queries["rays"].release()
            if index == 0:
                range_m[:] = found["range"]  # the kernel's own NaN, of those that hit nothing anywhere
            numbers = np.load(part.file / "numbers.npy", mmap_mode="r")
            hit = np.flatnonzero(found["triangle"] >= 0)
            own, inverse = numbers[found["triangle"][hit]], found["inverse"][hit]
            nearer = (inverse > best[hit]) | ((inverse == best[hit]) & (own < triangle[hit]))
            hit, own, inverse = hit[nearer], own[nearer], inverse[nearer]
            best[hit], triangle[hit], range_m[hit] = inverse, own, found["range"][hit]
        return RayHits(range_m=range_m, triangle=triangle)

    def scan(self, template: BeamTemplate, positions_m: FloatArray) -> ScanBatch:
        """See `ScanEngine.scan`."""
        positions = check_positions(positions_m).astype(np.float32)
        shape = (positions.shape[0], *template.shape)
        batch = _empty_scans(shape)
        if 0 in shape:
            return batch
        for band in bands(template, max_beams=self._band_beams):
            rows = slice(band.first_row, band.first_row + band.template.shape[0])
            for first in range(0, len(positions), self._n_batch(band.template)):
                some = slice(first, first + self._n_batch(band.template))
                part = self._scan_band(band.template, positions[some])
                for name, whole in vars(batch).items():
                    whole[some, rows] = getattr(part, name)
        return ScanBatch(
            range_m=batch.range_m,
            triangle=self.traced.in_whole_scene(batch.triangle),
            patch=batch.patch,
            cos_incidence=batch.cos_incidence,
        )

    def _n_batch(self, template: BeamTemplate) -> int:
        """Positions whose whole scans are on the host at once."""
        return max(1, min(_CHUNK, BATCH_BYTES // (_BEAM_BYTES * template.shape[0] * template.shape[1])))

    def _scan_band(self, template: BeamTemplate, positions: Float32Array) -> ScanBatch:
        """Full scans of a template that is tiled at once, with triangles as traced."""
        batch = _empty_scans((len(positions), *template.shape))
        self._leave_to(self.parts)
        tiles = TiledTemplate(template, self._on, walk=_walk_of(self._on, self.parts))
        a_position = 2 * _state_bytes(tiles) + _BEAM_BYTES * template.shape[0] * template.shape[1]
        n_batch = max(1, int(_BATCH_SHARE * self._on.memory_bytes / a_position))
        try:
            for first in range(0, len(positions), n_batch):
                some = slice(first, first + n_batch)
                self._scan_tiles(tiles, positions[some], template.range_max_m, _arrays_of(batch, some))
        finally:
            tiles.release()
        return batch

    def _scan_tiles(
        self, tiles: TiledTemplate, positions: Float32Array, range_max_m: float, arrays: dict[str, NDArray[np.generic]]
    ) -> None:
        """Bring one part after the other, and keep what every beam has hit so far on the device meanwhile."""
        program = tiles.program("scan_parts.cl")
        n_bytes = _state_bytes(tiles) * len(positions)
        at = self._on.upload("positions", {"positions": positions})
        state = [self._on.allocate(f"hits so far: {name}", n_bytes) for name in ("range", "triangle")]
        try:
            with self._on.outputs("scans", arrays) as out:
                for buffer in state:
                    self._on.zero(buffer, n_bytes)
                program.run("clear_scans", (arrays["range"].size,), *out.values())
                for index, chosen in self._nearest_first(positions, range_max_m):
                    buffers = self.parts.on_device(index)
                    which = self._on.upload("chosen positions", {"chosen": chosen})
                    program.run(
                        "scan_part",
                        (tiles.n_tiles, chosen.size),
                        *list(buffers.values())[:7],
                        *tiles.beam_arguments,
                        at["positions"],
                        which["chosen"],
                        buffers["numbers"],
                        *state,
                        *out.values(),
                    )
                    self._on.finish("scan of a part")  # before it may have to go
        finally:
            for buffer in (*state, *at.values()):
                buffer.release()

    def _nearest_first(self, positions: Float32Array, range_max_m: float) -> list[tuple[int, Int32Array]]:
        """Parts that are reached by a position, in the order of their distance from the nearest, and by which."""
        reached = []
        for index, part in enumerate(self.parts.parts):
            gap = np.maximum(np.maximum(part.bounds_m[0] - positions, positions - part.bounds_m[1]), 0.0)
            distance_m = np.sqrt((gap.astype(np.float64) ** 2).sum(axis=1))
            # Hits count by their rounded range, and triangles as larger by some 2e-6 rad.
            near = np.flatnonzero(distance_m <= 1.001 * range_max_m + 1e-3).astype(np.int32)
            if near.size:
                reached.append((float(distance_m.min()), index, near))
        return [(index, near) for _, index, near in sorted(reached, key=lambda item: item[:2])]

    def _collect(
        self, template: BeamTemplate, positions_m: FloatArray, content: Content, progress: Progress
    ) -> RowStore:
        positions = check_positions(positions_m).astype(np.float32)
        store = RowStore(self._n_patches)
        parts = list(bands(template, max_beams=self._band_beams)) if 0 not in template.shape else []
        if not parts:
            store.append(no_rows(len(positions)))
            return store
        n_batch = min(self._n_batch(band.template) for band in parts)
        for first in range(0, len(positions), n_batch):
            some = positions[first : first + n_batch]
            rows: ReturnRows | None = None
            for band in parts:
                scans = self._scan_band(band.template, some)
                of_band = follow_on(
                    [self._sums.row(band.template, scans, k, some[k], content) for k in range(len(some))]
                )
                rows = of_band if rows is None else join_bands(rows, of_band)
            if rows is not None:
                store.append(rows)
            progress(ProgressEvent("scan", min(first + n_batch, len(positions)), len(positions)))
        return store


class HitSums:
    """Rows of one scene's scans. address (T, 2) int32: first patch and depth of each triangle."""

    def __init__(self, scene: Scene, address: Int32Array) -> None:
        self._scene, self._address = scene, address

    def row(
        self, template: BeamTemplate, scans: ScanBatch, index: int, position_m: Float32Array, content: Content
    ) -> ReturnRows:
        """Row of scan number `index`, whose triangles are those of this object's scene."""
        of_beam = scans.patch[index].ravel()
        seen = np.flatnonzero(of_beam >= 0)
        patch, place, count = np.unique(of_beam[seen], return_inverse=True, return_counts=True)
        length = np.array([patch.size], dtype=np.int64)
        arrays: dict[str, NDArray[Any]] = {"patch": patch.astype(np.int32)}
        if content is not Content.PATCHES:
            arrays["n_returns"] = count.astype(np.int32)
        if content is Content.MOMENTS:
            some = np.zeros(patch.size, dtype=np.int32)
            some[place] = scans.triangle[index].ravel()[seen]
            beams = directions(template).astype(_F).reshape(-1, 3)[seen]
            hits = (scans.range_m[index].ravel()[seen], scans.cos_incidence[index].ravel()[seen])
            arrays |= self._moments(arrays["patch"], some, place, beams, *hits, position_m)
            arrays = in_metres(arrays)
        return ReturnRows(length=length, arrays=arrays)

    def _moments(
        self,
        patch: Int32Array,
        triangle: Int32Array,
        place: Int64Array,
        beams: Float32Array,
        range_m: Float32Array,
        cosine: Float32Array,
        position_m: Float32Array,
    ) -> dict[str, NDArray[Any]]:
        """`add_hits` of the kernel: every contribution rounded to a whole number by itself."""
        centre, power = self._frames(patch, triangle, position_m)
        scale = np.ldexp(_F(1), -power)[place]
        x, y, z = (np.clip((beams[:, k] * range_m + centre[place, k]) * scale, -_FARTHEST, _FARTHEST) for k in range(3))
        square = np.minimum(x * x + y * y + z * z, _GREATEST_SQUARE)
        w = _F(2) - cosine
        metres = np.rint(range_m)
        parts = (x, y, z, square, w, w * x, w * y, w * z, w * square)
        sums = np.empty((patch.size, 10), dtype=np.int64)
        for k, part in enumerate(parts):
            sums[:, k] = _sum(np.rint(part * _UNIT), place, patch.size)
        rest = np.rint((range_m - metres) * _UNIT)
        sums[:, 9] = (_sum(metres, place, patch.size) << 20) + _sum(rest, place, patch.size)
        extremes = np.stack([np.full(patch.size, np.inf, dtype=_F), np.zeros(patch.size, dtype=_F)], axis=1)
        np.minimum.at(extremes[:, 0], place, range_m)
        np.maximum.at(extremes[:, 1], place, cosine)
        return {"power": power, "sums": sums, "extremes": extremes}

    def _frames(
        self, patch: Int32Array, triangle: Int32Array, position_m: Float32Array
    ) -> tuple[Float32Array, Int32Array]:
        """Origin minus first vertex (P, 3), and the power of two above the longest edge (P,): `frame_of`."""
        corners_m = self._scene.vertices_m[self._scene.triangles[triangle]]
        corners, edges = corners_m.astype(_F), squared_edges(corners_m)
        first, depth = self._address[triangle].T
        code = patch - first
        # weights of vertices 1 and 2 in the corners of the part
        weights = np.zeros((3, 2, patch.size), dtype=_F)
        weights[1, 0], weights[2, 1] = 1, 1
        q = np.array(edges.T, dtype=_F)
        for level in range(int(depth.max(initial=0)) - 1, -1, -1):
            on = depth > level
            weights[:, :, on], q[:, on] = _descend(weights[:, :, on], q[:, on], ((code[on] >> level) & 1) == 1)
        a1, a2 = weights[0]
        at = [corners[:, v, :] for v in range(3)]
        centre = (position_m - at[0]) - (a1[:, None] * (at[1] - at[0]) + a2[:, None] * (at[2] - at[0]))
        above = ((q.max(axis=0).view(np.int32) >> 23) & 255) - 126
        return centre, np.maximum((above + 1) >> 1, -60).astype(np.int32)


def _walk_of(device: Device, parts: Parts) -> dict[str, int]:
    return walk_defines(device, parts.n_levels, max(part.n_bytes for part in parts.parts))


def _state_bytes(tiles: TiledTemplate) -> int:
    """Bytes of one of the two arrays of hits so far, a position: beams that pad tiles are among them."""
    return 4 * tiles.n_tiles * tiles.shape[0] * tiles.shape[1]


def _arrays_of(batch: ScanBatch, some: slice) -> dict[str, NDArray[np.generic]]:
    return {
        "range": batch.range_m[some],
        "triangle": batch.triangle[some],
        "patch": batch.patch[some],
        "cosine": batch.cos_incidence[some],
    }


def _empty_scans(shape: tuple[int, ...]) -> ScanBatch:
    return ScanBatch(
        range_m=np.empty(shape, dtype=np.float32),
        triangle=np.empty(shape, dtype=np.int32),
        patch=np.empty(shape, dtype=np.int32),
        cos_incidence=np.empty(shape, dtype=np.float32),
    )


def _descend(weights: Float32Array, q: Float32Array, second: BoolArray) -> tuple[Float32Array, Float32Array]:
    """One halving: corners' weights (3, 2, N) and squared edges 01, 12, 20 (3, N) of the child."""
    is01 = (q[0] >= q[1]) & (q[0] >= q[2])
    turn = np.where(is01, 0, np.where(q[1] >= q[2], 1, 2))
    rows = np.arange(turn.size)
    qab, qbc, qca = (q[(turn + k) % 3, rows] for k in range(3))
    p, r, s = (weights[(turn + k) % 3, :, rows].T for k in range(3))
    middle = _F(0.5) * (p + r)
    qcm = (_F(2) * qca + _F(2) * qbc - qab) / _F(4)
    child = np.stack([np.where(second, middle, p), np.where(second, r, middle), s])
    return child, np.stack([qab / _F(4), np.where(second, qbc, qcm), np.where(second, qcm, qca)])


def _sum(values: Float32Array, place: Int64Array, n: int) -> Int64Array:
    """Sums of whole numbers below 2^22: exact in float64."""
    return np.bincount(place, weights=values, minlength=n).astype(np.int64)
