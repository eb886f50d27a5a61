"""Scanning with Open3D's RaycastingScene (Embree): the oracle of the tests, and the engine where OpenCL is missing.

Local frame, metres. The rules all engines keep are at the head of `planner_core.scan.engine`.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Patches,
    PatchReturns,
    RayHits,
    ScanBatch,
    Scene,
    Visibility,
)
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scan.engine import check_positions, check_rays
from planner_core.scan.optics import traced_surfaces
from planner_core.scan.patch_returns import Content, Rows, RowStore, count_returns, join_bands, no_rows, sum_returns
from planner_core.scan.surfaces import round_surfaces
from planner_core.scan.template import bands, directions
from planner_core.scene.patches import patch_code, patch_triangles, squared_edges

#: Beams of a template that are cast at once; a scanner with more is scanned in bands of rows.
_BAND_BEAMS = 2**20


class Open3DEngine:
    """A `ScanEngine` on the host's cores. See the protocol for what the methods take and return."""

    name = "open3d"

    def __init__(self, scene: Scene, patches: Patches, *, warnings: tuple[str, ...] = ()) -> None:
        open3d = import_open3d()
        self._core = open3d.core
        self.device = f"Open3D {open3d.__version__} (Embree, CPU)"
        self.warnings = warnings
        self._open3d, self._whole_scene = open3d, scene
        self._n_patches = patches.n_patches
        self._traced = traced_surfaces(scene, patches)
        self._patches, self._first_patch = self._traced.patches, self._traced.first_patch
        self._depth = self._patches.depth
        traced = self._traced.scene
        surfaces = round_surfaces(traced)
        self._normal = surfaces.normal
        self._edges = squared_edges(traced.vertices_m[traced.triangles])
        self._rounded = replace(traced, vertices_m=traced.vertices_m.astype(np.float32).astype(np.float64))
        self._raycasting = self._prepare(traced)

    def cast_rays(self, origins_m: FloatArray, directions: FloatArray, *, range_max_m: float) -> RayHits:
        """See `ScanEngine.cast_rays`."""
        origins, unit = check_rays(origins_m, directions, range_max_m)
        rays = np.concatenate([origins, unit], axis=1).astype(np.float32)
        range_m, triangle, _ = self._first_hits(self._solid, rays, 0.0, range_max_m)
        return RayHits(range_m=range_m, triangle=triangle)

    @cached_property
    def _solid(self) -> Any:
        """What free rays meet: glass is in it. Made when first asked for, where it is another one."""
        return self._raycasting if self._traced.triangle is None else self._prepare(self._whole_scene)

    def _prepare(self, scene: Scene) -> Any:
        raycasting = self._open3d.t.geometry.RaycastingScene()
        raycasting.add_triangles(
            self._core.Tensor(scene.vertices_m.astype(np.float32)),
            self._core.Tensor(scene.triangles.astype(np.uint32)),
        )
        return raycasting

    def scan(self, template: BeamTemplate, positions_m: FloatArray) -> ScanBatch:
        """See `ScanEngine.scan`."""
        positions = check_positions(positions_m)
        shape = (positions.shape[0], *template.shape)
        range_m = np.empty(shape, dtype=np.float32)
        triangle = np.empty(shape, dtype=np.int32)
        patch = np.empty(shape, dtype=np.int32)
        cos_incidence = np.empty(shape, dtype=np.float32)
        beams = _beams(template)
        for index, position in enumerate(positions):
            hits = self._scan_one(template, beams, position)
            range_m[index] = hits[0].reshape(template.shape)
            triangle[index] = hits[1].reshape(template.shape)
            patch[index] = self._patch(hits[1], hits[2]).reshape(template.shape)
            cos_incidence[index] = self._cos_incidence(beams, hits[1]).reshape(template.shape)
        return ScanBatch(
            range_m=range_m,
            triangle=self._traced.in_whole_scene(triangle),
            patch=patch,
            cos_incidence=cos_incidence,
        )

    def visible_patches(
        self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent
    ) -> Visibility:
        """See `ScanEngine.visible_patches`."""
        return self._collect(template, positions_m, Content.PATCHES, progress).visibility()

    def patch_returns(
        self, template: BeamTemplate, positions_m: FloatArray, *, moments: bool = False, progress: Progress = silent
    ) -> PatchReturns:
        """See `ScanEngine.patch_returns`."""
        content = Content.MOMENTS if moments else Content.COUNTS
        return self._collect(template, positions_m, content, progress).patch_returns(content)

    def _collect(
        self, template: BeamTemplate, positions_m: FloatArray, content: Content, progress: Progress
    ) -> RowStore:
        """Scan one position after the other; a large template band by band."""
        positions = check_positions(positions_m)
        store = RowStore(self._n_patches)
        parts = list(bands(template, max_beams=_BAND_BEAMS)) if 0 not in template.shape else []
        # Made once where one band is all there is.
        kept = _beams(parts[0].template) if len(parts) == 1 else None
        for index, position in enumerate(positions):
            row: Rows | None = None
            for band in parts:
                beams = _beams(band.template) if kept is None else kept
                of_band = self._row(band.template, beams, position, content)
                row = of_band if row is None else join_bands(row, of_band)
            store.append(no_rows(1) if row is None else row)
            progress(ProgressEvent("scan", index + 1, len(positions)))
        return store

    def _row(self, template: BeamTemplate, beams: Float32Array, position_m: FloatArray, content: Content) -> Rows:
        range_m, triangle, uv = self._scan_one(template, beams, position_m)
        hit = np.flatnonzero(triangle >= 0)
        range_m, triangle, uv = range_m[hit], triangle[hit], uv[hit]
        patch = self._patch(triangle, uv)
        if content is not Content.MOMENTS:
            return count_returns(patch, content)
        origin = position_m.astype(np.float32).astype(np.float64)
        point_m = origin + beams[hit].astype(np.float64) * range_m[:, None].astype(np.float64)
        first_vertex_m = self._first_vertices(triangle, patch)
        return sum_returns(patch, point_m - first_vertex_m, self._cos_incidence(beams[hit], triangle), range_m)

    def _first_vertices(self, triangle: Int32Array, patch: Int32Array) -> FloatArray:
        """(N, 3) float64, the first vertex of the patches that lie on the triangles (N,)."""
        used, place = np.unique(triangle, return_inverse=True)
        part = replace(self._rounded, triangles=self._rounded.triangles[used])
        depth = self._depth[used]
        vertices = patch_triangles(part, replace(self._patches, depth=depth))[:, 0]
        first = np.cumsum(1 << depth.astype(np.int64)) - (1 << depth.astype(np.int64))
        first_vertices: FloatArray = vertices[first[place] + (patch - self._first_patch[triangle])]
        return first_vertices

    def are_hidden(self, position_m: FloatArray, targets_m: FloatArray) -> BoolArray:
        """Whether a surface lies between a position (3,) and each target (N, 3) relative to it, ends included."""
        rays = np.empty((targets_m.shape[0], 6), dtype=np.float32)
        rays[:, :3], rays[:, 3:] = position_m, targets_m
        return np.array(self._raycasting.test_occlusions(self._core.Tensor(rays), 0.0, 1.0).numpy(), dtype=np.bool_)

    def _scan_one(
        self, template: BeamTemplate, beams: Float32Array, position_m: FloatArray
    ) -> tuple[Float32Array, Int32Array, Float32Array]:
        rays = np.empty((beams.shape[0], 6), dtype=np.float32)
        rays[:, :3] = position_m.astype(np.float32)
        rays[:, 3:] = beams
        range_m, triangle, uv = self._first_hits(self._raycasting, rays, template.range_min_m, template.range_max_m)
        swallowed = (triangle >= 0) & ~self._traced.returns[triangle]
        range_m[swallowed], triangle[swallowed] = np.nan, -1
        return range_m, triangle, uv

    def _first_hits(
        self, raycasting: Any, rays: Float32Array, range_min_m: float, range_max_m: float
    ) -> tuple[Float32Array, Int32Array, Float32Array]:
        """Range, triangle and barycentric (u, v) of rays (N, 6) with unit directions."""
        hits: dict[str, Any] = raycasting.cast_rays(self._core.Tensor(rays))
        range_m = np.array(hits["t_hit"].numpy(), dtype=np.float32)
        # Compared as float32, as the kernels do; a miss is infinite and so has to be asked for by itself.
        inside = (range_m >= np.float32(range_min_m)) & (range_m <= np.float32(range_max_m)) & np.isfinite(range_m)
        triangle = np.where(inside, hits["primitive_ids"].numpy().astype(np.int64), -1).astype(np.int32)
        range_m[~inside] = np.nan
        return range_m, triangle, np.array(hits["primitive_uvs"].numpy(), dtype=np.float32)

    def _patch(self, triangle: Int32Array, uv: Float32Array) -> Int32Array:
        patch = np.full(triangle.shape, -1, dtype=np.int32)
        hit = np.flatnonzero(triangle >= 0)
        of, at = triangle[hit], uv[hit]
        weights = np.stack([np.float32(1) - at[:, 0] - at[:, 1], at[:, 0], at[:, 1]], axis=1)
        patch[hit] = self._first_patch[of] + patch_code(weights, self._edges[of], self._depth[of])
        return patch

    def _cos_incidence(self, beams: Float32Array, triangle: Int32Array) -> Float32Array:
        cosine = np.abs((beams * self._normal[triangle]).sum(axis=1, dtype=np.float32))
        return np.where(triangle >= 0, np.minimum(cosine, np.float32(1)), np.float32(np.nan)).astype(np.float32)


def _beams(template: BeamTemplate) -> Float32Array:
    """All beams (rows * columns, 3), as every engine rounds them."""
    return directions(template).astype(np.float32).reshape(-1, 3)


def leave_out_drawing() -> None:
    """Let `import open3d` go without Dash and Plotly; call it before.

    Open3D loads both on its import for `draw_plotly` alone. They bring 165 MB of web packages along, which the set-up
    leaves out (docs/decisions/0002-set-up.md).
    """
    drawing = ModuleType("open3d.visualization.draw_plotly")
    vars(drawing).update(dict.fromkeys(("get_plotly_fig", "draw_plotly", "draw_plotly_server")))
    sys.modules.setdefault(drawing.__name__, drawing)


def import_open3d() -> Any:
    """Return the package `open3d`, without its drawing.

    Raises
    ------
    MissingPackageError
        It can't be loaded.
    """
    try:
        leave_out_drawing()
        import open3d
    except (ImportError, OSError) as error:
        # OSError: the wheel is there, but a system library that it needs is not.
        raise MissingPackageError(
            f"Open3D can't be loaded ({str(error).splitlines()[0]}), expected a working open3d package; "
            "see `tlsplan doctor`"
        ) from error
    return open3d
