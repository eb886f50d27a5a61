"""Clouds of stations as streams: blocks of rows of the beam grid, and the points that come back in them.

`PlanSource`, `Options` -> `Clouds`; a station -> blocks, one after the other. Memory holds what is cast at once and one
block, however many beams a scan has. Coordinates: scene and site, metres; frames: the head of `planner_core.model`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import ExportError, RequirementError
from planner_core.export.chosen import chosen_stations
from planner_core.export.clouds.noise import NoiseModel, deviates, noise_model
from planner_core.export.options import Options
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    PlanSettings,
    ScanBatch,
    SiteFrame,
    Survey,
)
from planner_core.plan_folder.plan_settings import settings_of
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scanner.template import Band, bands

STAGE = "clouds"
_BLOCK_BEAMS = 2**16
"""Beams of a block, unless one row has more: some 150 bytes each while it is worked on. Larger arrays come from a heap
that they fragment, so that memory creeps up as blocks go by; docs/benchmarks/clouds.md has figures."""
_BLOCKS_CAST = 8
"""Blocks whose beams are cast at once, 16 bytes a beam: few calls keep devices busy."""


@dataclass(frozen=True, eq=False)
class ScanBlock:
    """Rows `first_row` and on of one station's scan, R x C beams, noise and all.

    range_m : (R, C) float64, NaN where nothing comes back. cos_incidence, intensity : (R, C) float32, NaN likewise;
    intensity is reflectivity x cos(incidence), in 0 to 1. triangle, patch : (R, C) int32, -1 where nothing comes back.
    turned_rad : (R, C, 2) float64, by how much azimuth and elevation of a beam are off; None: by nothing.
    """

    station: FieldStation
    template: BeamTemplate
    """Of the block's rows alone."""
    first_row: int
    range_m: FloatArray
    cos_incidence: Float32Array
    intensity: Float32Array
    triangle: Int32Array
    patch: Int32Array
    turned_rad: FloatArray | None = None

    def points(self, frame: SiteFrame) -> Points:
        """The block's returns, row by row."""
        row, column = np.nonzero(np.isfinite(self.range_m))
        azimuth = self.template.azimuth_rad[column]
        elevation = self.template.elevation_rad[row]
        if self.template.azimuth_offset_rad is not None:
            azimuth = azimuth + self.template.azimuth_offset_rad[row]
        if self.turned_rad is not None:
            azimuth = azimuth + self.turned_rad[row, column, 0]
            elevation = elevation + self.turned_rad[row, column, 1]
        range_m = self.range_m[row, column]
        level_m = range_m * np.cos(elevation)
        from_sensor_m = np.stack(
            [level_m * np.cos(azimuth), level_m * np.sin(azimuth), range_m * np.sin(elevation)], axis=1
        )
        scene_m = self.station.position_m + from_sensor_m
        cosine = np.clip(self.cos_incidence[row, column].astype(np.float64), 0.0, 1.0)
        return Points(
            row=(row + self.first_row).astype(np.int32),
            column=column.astype(np.int32),
            from_sensor_m=from_sensor_m,
            scene_m=scene_m,
            site_m=frame.to_site(scene_m),
            range_m=range_m,
            elevation_rad=elevation,
            incidence_rad=np.arccos(cosine),
            cos_incidence=self.cos_incidence[row, column],
            intensity=self.intensity[row, column],
            triangle=self.triangle[row, column],
            patch=self.patch[row, column],
        )


@dataclass(frozen=True, eq=False)
class Points:
    """N returns of one station.

    row, column : (N,) int32, of the scan's grid of beams. from_sensor_m : (N, 3) float64, from the sensor's origin, in
    the scene's directions; scene_m, site_m : (N, 3) float64. range_m, elevation_rad (of the beam, up from level),
    incidence_rad : (N,) float64. cos_incidence, intensity : (N,) float32. triangle, patch : (N,) int32.
    """

    row: Int32Array
    column: Int32Array
    from_sensor_m: FloatArray
    scene_m: FloatArray
    site_m: FloatArray
    range_m: FloatArray
    elevation_rad: FloatArray
    incidence_rad: FloatArray
    cos_incidence: Float32Array
    intensity: Float32Array
    triangle: Int32Array
    patch: Int32Array

    def __len__(self) -> int:
        return int(self.range_m.size)


@dataclass(eq=False)
class BeamTally:
    """What became of the beams of all blocks so far."""

    n_points: int = 0
    n_dropped: int = 0
    """Too weak to be measured, with noise."""
    n_beyond_table: int = 0
    """Points whose noise the scanner's table does not reach."""


@dataclass(frozen=True, eq=False)
class Clouds:
    """The simulated clouds of stations.

    title : of the scene. identity : what, with the stations, distinguishes these clouds from all others. frame : of
    the site.
    template : the beams that are cast: every `step`-th row and column of the scanner's. noise : None: exact.
    scan_engine : of the survey's scene; None: opened when first needed. tally counts on as blocks are made.
    """

    title: str
    identity: tuple[str, ...]
    frame: SiteFrame
    settings: PlanSettings
    survey: Survey
    stations: tuple[FieldStation, ...]
    template: BeamTemplate
    step: int
    noise: NoiseModel | None
    seed: int
    progress: Progress
    block_beams: int = field(default_factory=lambda: _BLOCK_BEAMS)
    scan_engine: ScanEngine | None = None
    tally: BeamTally = field(default_factory=BeamTally)

    @property
    def reflectivity(self) -> float:
        """Of every surface, met head on: the one that the plan's requirements were judged with."""
        return self.settings.requirements.reflectivity

    @cached_property
    def engine(self) -> ScanEngine:
        """What casts the beams."""
        return self.scan_engine or open_engine(self.survey.scene, self.survey.patches)

    def blocks(self, station: FieldStation) -> Iterator[ScanBlock]:
        """Scan from a station, block by block, top row first.

        Blocks don't depend on each other, nor on how many there are: a beam's result is the same bits in any.
        """
        position_m = (station.position_m - self.survey.scene.offset_m)[None]
        n_rows, n_columns = self.template.shape
        n_beams = n_rows * n_columns
        n_before = self.stations.index(station) * n_beams
        for cast in bands(self.template, max_beams=_BLOCKS_CAST * self.block_beams):
            scan = self.engine.scan(cast.template, position_m)
            for part in bands(cast.template, max_beams=self.block_beams):
                first_row = cast.first_row + part.first_row
                block = self._block(station, first_row, part.template, _rows(scan, part))
                self.tally.n_points += int(np.isfinite(block.range_m).sum())
                yield block
                done = n_before + (first_row + part.template.shape[0]) * n_columns
                self.progress(ProgressEvent(STAGE, done, n_beams * len(self.stations), station.id))

    def points(self, station: FieldStation) -> Iterator[Points]:
        """Returns of a station, block by block; blocks without any are left out."""
        for block in self.blocks(station):
            points = block.points(self.frame)
            if len(points):
                yield points

    def remarks(self) -> tuple[str, ...]:
        """What a user should know of the clouds written, one line each."""
        lines = list(self.engine.warnings)
        if self.step > 1:
            n_rows, n_columns = self.template.shape
            lines.append(
                f"clouds are thinned: one row and column of beams in {self.step}, {n_rows} x {n_columns} of "
                f"{self.survey.template.shape[0]} x {self.survey.template.shape[1]} per station"
            )
        if self.noise is not None:
            lines += _noise_remarks(self.noise, self.tally)
        return tuple(lines)

    def _block(self, station: FieldStation, first_row: int, template: BeamTemplate, scan: ScanBatch) -> ScanBlock:
        block = ScanBlock(
            station=station,
            template=template,
            first_row=first_row,
            range_m=scan.range_m[0].astype(np.float64),
            cos_incidence=scan.cos_incidence[0],
            intensity=np.float32(self.reflectivity) * scan.cos_incidence[0],
            triangle=scan.triangle[0],
            patch=scan.patch[0],
        )
        return block if self.noise is None else self._with_noise(block, self.noise)

    def _with_noise(self, block: ScanBlock, noise: NoiseModel) -> ScanBlock:
        """Let ranges and angles scatter, and drop what is too weak or no longer within the scanner's range."""
        returned = block.intensity.astype(np.float64)
        hit = np.isfinite(block.range_m)
        kept = noise.comes_back(block.range_m, returned)
        deviate = self._deviates(block)
        range_m = np.full(block.range_m.shape, np.nan)
        sigma_m = noise.range_sigma_m(block.range_m[kept], returned[kept])
        range_m[kept] = block.range_m[kept] + sigma_m * deviate[kept][:, 0]
        with np.errstate(invalid="ignore"):  # NaN compares false: no return stays none
            kept &= (range_m >= block.template.range_min_m) & (range_m <= block.template.range_max_m)
        self.tally.n_dropped += int(hit.sum() - kept.sum())
        self.tally.n_beyond_table += int(noise.beyond_table(block.range_m[kept], returned[kept]).sum())
        return replace(
            block,
            range_m=np.where(kept, range_m, np.nan),
            cos_incidence=_kept(block.cos_incidence, kept),
            intensity=_kept(block.intensity, kept),
            triangle=np.where(kept, block.triangle, np.int32(-1)),
            patch=np.where(kept, block.patch, np.int32(-1)),
            turned_rad=deviate[..., 1:] * noise.angle_sigma_rad if noise.angle_sigma_rad else None,
        )

    def _deviates(self, block: ScanBlock) -> FloatArray:
        """(R, C, 3) of the block's beams, counted as in the scanner's whole grid, whatever is left out of it."""
        whole_columns = self.survey.template.shape[1]
        out = np.empty((*block.range_m.shape, 3))
        for row in range(out.shape[0]):
            first = (block.first_row + row) * self.step * whole_columns
            drawn = deviates(self.seed, block.station.id, first_beam=first, n_beams=whole_columns)
            out[row] = drawn[:: self.step]
        return out


def open_clouds(source: PlanSource, options: Options, *, progress: Progress = silent) -> Clouds:
    """Make ready to scan from a plan's stations.

    Raises
    ------
    RequirementError
        A station or floor that is not there, or `max_points` below 1.
    ExportError
        The scene is not found; noise is required of a scanner without figures; a plan without stations.
    SceneError
        The scene can't be read.
    """
    settings = settings_of(source.document)
    stations = cloud_stations(source, options)
    noise = noise_model(settings.scanner) if options.noise else None
    survey = source.survey(progress=progress)
    scene = source.document["scene"]
    step = thinning_step(survey.template.shape, options.max_points)
    return Clouds(
        title=source.title,
        identity=(
            str(scene["sha256"]),
            *(str(file["sha256"]) for file in scene.get("other_files", ())),
            json.dumps([scene["load_options"], source.document["scanner"]], sort_keys=True),
        ),
        frame=source.frame,
        settings=settings,
        survey=survey,
        stations=stations,
        template=every_nth(survey.template, step),
        step=step,
        noise=noise,
        seed=options.seed,
        progress=progress,
    )


def cloud_stations(source: PlanSource, options: Options) -> tuple[FieldStation, ...]:
    """Stations that `options` names by id and by floor, in visiting order; all where it names none."""
    there = {station.id for station in source.stations}
    for name in options.stations:
        if name not in there:
            raise RequirementError(
                f"station: got {name!r}, expected one of {', '.join(sorted(there)[:40])}; plan.json lists them"
            )
    of_floors = chosen_stations(source, options)
    chosen = tuple(station for station in of_floors if not options.stations or station.id in options.stations)
    if not chosen:
        raise ExportError(f"{source.folder}: no station to scan from, expected at least one; choose others")
    return chosen


def thinning_step(shape: tuple[int, int], max_points: int | None) -> int:
    """Least step at which every step-th row and column of a grid of beams are at most `max_points` beams."""
    if max_points is None:
        return 1
    if max_points < 1:
        raise RequirementError(f"max_points: got {max_points}, expected at least 1; leave it out for every point")
    n_rows, n_columns = shape
    # Every n-th row and column are at least 1 / n^2 of all beams: no lesser step than this can do.
    step = max(1, math.isqrt(n_rows * n_columns // max_points) - 1)
    while -(-n_rows // step) * -(-n_columns // step) > max_points:
        step += 1
    return step


def every_nth(template: BeamTemplate, step: int) -> BeamTemplate:
    """Every `step`-th row and column of a template, the first ones included; the same object where that is all."""
    if step == 1:
        return template
    offset = template.azimuth_offset_rad
    return replace(
        template,
        azimuth_rad=np.ascontiguousarray(template.azimuth_rad[::step]),
        elevation_rad=np.ascontiguousarray(template.elevation_rad[::step]),
        azimuth_offset_rad=None if offset is None else np.ascontiguousarray(offset[::step]),
    )


def _rows(scan: ScanBatch, part: Band) -> ScanBatch:
    """The rows of a part of what was cast."""
    rows = np.s_[:, part.first_row : part.first_row + part.template.shape[0]]
    return ScanBatch(scan.range_m[rows], scan.triangle[rows], scan.patch[rows], scan.cos_incidence[rows])


def _kept(values: Float32Array, kept: BoolArray) -> Float32Array:
    return np.where(kept, values, np.float32(np.nan))


def _noise_remarks(noise: NoiseModel, tally: BeamTally) -> list[str]:
    scanner = noise.scanner
    of_range = "its table of range noise" if scanner.range_noise else "its ranging accuracy, taken as one sigma"
    of_angles = (
        f"angles by {math.degrees(noise.angle_sigma_rad) * 3600:.3g} arcseconds"
        if noise.angle_sigma_rad
        else "no angles"
    )
    lines = [f"noise of {scanner.name}: ranges by {of_range}, {of_angles}; {tally.n_dropped} weak returns dropped"]
    if tally.n_beyond_table:
        lines.append(
            f"{tally.n_beyond_table} of {tally.n_points} points lie outside the scanner's table: their noise is "
            "estimated from its nearest figure"
        )
    return lines
