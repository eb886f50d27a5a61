"""Scanning with Open3D's RaycastingScene (Embree): the oracle of the tests, and the engine where OpenCL is missing.

Local frame, metres. The rules all engines keep are at the head of `planner_core.engine.scan_engine`.
"""

from __future__ import annotations

import sys
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np

from planner_core.device.drivers import load_shared_threads
from planner_core.engine.hit_rows import HitRows, Hits
from planner_core.engine.patch_returns import Content, ReturnRows, RowCollector, RowStore, join_bands, no_rows
from planner_core.engine.scan_engine import check_positions, check_rays
from planner_core.engine.traced_surfaces import traced_surfaces
from planner_core.errors import MissingPackageError
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Patches,
    RayHits,
    ScanBatch,
    Scene,
    UInt8Array,
)
from planner_core.progress import Progress, ProgressEvent
from planner_core.scanner.template import bands, directions

#: Beams of a template that are cast at once; a scanner with more is scanned in bands of rows.
_BAND_BEAMS = 2**20


class Open3DEngine(RowCollector):
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
        self._rows = HitRows(self._traced, patches.n_patches)
        self._raycasting = self._prepare(self._traced.scene)

    def cast_rays(
        self, origins_m: FloatArray, directions: FloatArray, *, range_max_m: float, through_glass: bool = False
    ) -> RayHits:
        """See `ScanEngine.cast_rays`."""
        origins, unit = check_rays(origins_m, directions, range_max_m)
        rays = np.concatenate([origins, unit], axis=1).astype(np.float32)
        casting = self._raycasting if through_glass else self._solid
        hits: dict[str, Any] = casting.cast_rays(self._core.Tensor(rays))
        range_m = np.array(hits["t_hit"].numpy(), dtype=np.float32)
        # Compared as float32, as the kernels do; a miss is infinite and so has to be tested by itself.
        inside = (range_m <= np.float32(range_max_m)) & np.isfinite(range_m)
        range_m[~inside] = np.nan
        triangle = np.where(inside, hits["primitive_ids"].numpy().astype(np.int64), -1).astype(np.int32)
        if through_glass:
            triangle = self._traced.in_whole_scene(triangle)
        return RayHits(range_m=range_m, triangle=triangle)

    @cached_property
    def _solid(self) -> Any:
        """What free rays meet: glass is in it. Made when first used, where it is another one."""
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
        rays, marks = _rays_of(_beams(template)), self._rows.no_marks()
        for index, position in enumerate(positions):
            hits = self._scan_one(rays, position)
            of_beam = self._rows.patches(hits, template.range_min_m, template.range_max_m, marks)
            gives = of_beam >= 0
            range_m[index] = np.where(gives, hits.range_m, np.float32(np.nan)).reshape(template.shape)
            triangle[index] = np.where(gives, hits.triangle.astype(np.int32), -1).reshape(template.shape)
            patch[index] = of_beam.reshape(template.shape)
            cos_incidence[index] = self._rows.cos_incidence(of_beam, hits, rays[:, 3:]).reshape(template.shape)
        return ScanBatch(
            range_m=range_m,
            triangle=self._traced.in_whole_scene(triangle),
            patch=patch,
            cos_incidence=cos_incidence,
        )

    def _collect(
        self, template: BeamTemplate, positions_m: FloatArray, content: Content, progress: Progress
    ) -> RowStore:
        """Scan one position after the other; a large template band by band."""
        positions = check_positions(positions_m)
        store = RowStore(self._n_patches)
        parts = list(bands(template, max_beams=_BAND_BEAMS)) if 0 not in template.shape else []
        # Made once where one band is all there is.
        kept = _rays_of(_beams(parts[0].template)) if len(parts) == 1 else None
        marks = self._rows.no_marks()
        for index, position in enumerate(positions):
            row: ReturnRows | None = None
            for band in parts:
                rays = _rays_of(_beams(band.template)) if kept is None else kept
                of_band = self._row(band.template, rays, position, content, marks)
                row = of_band if row is None else join_bands(row, of_band)
            store.append(no_rows(1) if row is None else row)
            progress(ProgressEvent("scan", index + 1, len(positions)))
        return store

    def _row(
        self, template: BeamTemplate, rays: Float32Array, position_m: FloatArray, content: Content, marks: UInt8Array
    ) -> ReturnRows:
        """Row of one position; `marks` are none, before and after."""
        hits = self._scan_one(rays, position_m)
        patch = self._rows.patches(hits, template.range_min_m, template.range_max_m, marks)
        row = self._rows.row(patch, marks, hits, rays[:, 3:], position_m, content)
        marks[row.arrays["patch"]] = 0
        return row

    @property
    def corners_m(self) -> Float32Array:
        """(T, 3, 3) corners of the surfaces that beams meet, numbered as in `first_blockers`."""
        return self._rows.corners_m

    def first_blockers(self, position_m: FloatArray, targets_m: FloatArray | Float32Array) -> Int32Array:
        """(N,) first surface between a position (3,) and each target (N, 3) relative to it; -1: there is none."""
        hits: dict[str, Any] = self._raycasting.cast_rays(self._core.Tensor(_towards(position_m, targets_m)))
        between = hits["t_hit"].numpy() < 1
        return np.where(between, hits["primitive_ids"].numpy().astype(np.int64), -1).astype(np.int32)

    def are_hidden(self, position_m: FloatArray, targets_m: FloatArray | Float32Array) -> BoolArray:
        """Whether a surface lies between a position (3,) and each target (N, 3) relative to it, ends included."""
        rays = self._core.Tensor(_towards(position_m, targets_m))
        return np.array(self._raycasting.test_occlusions(rays, 0.0, 1.0).numpy(), dtype=np.bool_)

    def _scan_one(self, rays: Float32Array, position_m: FloatArray) -> Hits:
        """First hits of rays (N, 6), which are led from the position."""
        rays[:, :3] = position_m.astype(np.float32)
        found: dict[str, Any] = self._raycasting.cast_rays(self._core.Tensor.from_numpy(rays))
        return Hits(*(found[name].numpy() for name in ("t_hit", "primitive_ids", "primitive_uvs")))


def _rays_of(beams: Float32Array) -> Float32Array:
    """(N, 6) rays along the beams (N, 3), from where they are led later."""
    return np.concatenate([np.zeros_like(beams), beams], axis=1)


def _towards(position_m: FloatArray, targets_m: FloatArray | Float32Array) -> Float32Array:
    """(N, 6) rays from a position (3,) to targets (N, 3) relative to it, which they reach at 1."""
    rays = np.empty((targets_m.shape[0], 6), dtype=np.float32)
    rays[:, :3], rays[:, 3:] = position_m, targets_m
    return rays


def _beams(template: BeamTemplate) -> Float32Array:
    """All beams (rows * columns, 3), as every engine rounds them."""
    return directions(template).astype(np.float32).reshape(-1, 3)


def prepare_import() -> None:
    """Let `import open3d` go without Dash and Plotly, and leave Intel's OpenCL runtime room beside it; call it before.

    Open3D loads both on its import for `draw_plotly` alone. They bring 165 MB of web packages along, which the set-up
    leaves out (docs/decisions/0002-set-up.md).
    """
    load_shared_threads()
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
        prepare_import()
        import open3d
    except (ImportError, OSError) as error:
        # OSError: the wheel is there, but a system library that it needs is not.
        raise MissingPackageError(
            f"Open3D can't be loaded ({str(error).splitlines()[0]}), expected a working open3d package; "
            "see `tlsplan doctor`"
        ) from error
    return open3d
