"""Clouds as E57 (ASTM E2807): a scan and its pose a station, points in the scanner's own frame, in the grid of beams.

`Clouds` -> one file of all stations, or one a station. The scanner's frame: the scene's directions, origin in the
sensor; the pose takes it to site coordinates. What is in them: docs/formats/field-pack/clouds.md.
"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.export.clouds.each_station import one_file, write_each
from planner_core.export.clouds.file_header import facts, facts_of, guid_of, wkt_of
from planner_core.export.clouds.points import Clouds, Points, open_clouds
from planner_core.export.options import Options
from planner_core.model import FloatArray
from planner_core.operating_system import not_written
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

STEP_M = 0.0001
"""Of coordinates: 0.1 mm."""
_INTENSITY_STEPS = 65535
_TELLING_SCALE = 1e-6
"""Scale of the site's grid, less 1, from which a remark is due: a millimetre in a kilometre."""


def write_e57(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the scans of all stations into the file `path`."""
    clouds = open_clouds(plan, options, progress=progress)
    _write(clouds, clouds.stations, path)
    return (*clouds.remarks(), *_remarks(clouds))


def write_e57_split(plan: PlanSource, folder: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write a file a station into `folder`."""
    clouds = open_clouds(plan, options, progress=progress)
    write_each(clouds, [one_file(".e57", _write)], folder)
    return (*clouds.remarks(), *_remarks(clouds))


def _remarks(clouds: Clouds) -> tuple[str, ...]:
    scale = clouds.frame.horizontal_scale
    if abs(scale - 1.0) < _TELLING_SCALE:
        return ()
    return (
        f"the site's grid has a scale of {scale:.8f}, poses of E57 have none: points keep true distances around "
        "their station, as real scans do",
    )


def _write(clouds: Clouds, stations: tuple[FieldStation, ...], path: Path) -> None:
    from pye57 import libe57

    try:
        file = libe57.ImageFile(str(path), "w")
        try:
            _E57(file, clouds).write(stations)
            file.close()
        except BaseException:
            if file.writerCount() == 0:  # an interrupt may come between a writer's making and its first point
                file.cancel()
            raise
    except libe57.E57Exception as error:
        # Of all that can go wrong while writing only the disk is not our own doing. Further lines are of its sources.
        raise not_written(path, str(error).partition("\n")[0]) from error


def rotation_of(matrix: FloatArray) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z), w >= 0, of the rotation nearest to a (4, 4) affine matrix's linear part."""
    left, _, right = np.linalg.svd(matrix[:3, :3])
    turn = left @ right
    # The largest of the four squares is well away from 0: divide by that one (Shepperd 1978).
    trace = float(np.trace(turn))
    squares = np.array([trace, *(2.0 * np.diag(turn) - trace)])
    k = int(np.argmax(squares))
    big = np.sqrt(1.0 + squares[k]) / 2.0
    off = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    quaternion = np.empty(4)
    if k == 0:
        quaternion[0], quaternion[1:] = big, off / (4.0 * big)
    else:
        axis = k - 1
        quaternion[0] = off[axis] / (4.0 * big)
        quaternion[1:] = (turn[:, axis] + turn[axis, :]) / (4.0 * big)
        quaternion[k] = big
    w, x, y, z = (float(value) + 0.0 for value in (quaternion if quaternion[0] >= 0 else -quaternion))
    return w, x, y, z


class _E57:
    """Builds the tree of one file."""

    def __init__(self, file: Any, clouds: Clouds) -> None:
        from pye57 import libe57

        self._lib, self._file, self._clouds = libe57, file, clouds

    def write(self, stations: tuple[FieldStation, ...]) -> None:
        lib, root = self._lib, self._file.root()
        self._file.extensionsAdd("", lib.E57_V1_0_URI)
        root.set("formatName", self._text("ASTM E57 3D Imaging Data File"))
        of_one = stations[0] if len(stations) == 1 else None
        root.set("guid", self._text(guid_of(self._clouds) if of_one is None else guid_of(self._clouds, of_one)))
        root.set("versionMajor", self._whole(lib.E57_FORMAT_MAJOR))
        root.set("versionMinor", self._whole(lib.E57_FORMAT_MINOR))
        root.set("e57LibraryVersion", self._text(lib.E57_LIBRARY_ID))
        root.set("coordinateMetadata", self._text(wkt_of(self._clouds.frame)))
        scans = lib.VectorNode(self._file, True)
        root.set("data3D", scans)
        root.set("images2D", lib.VectorNode(self._file, True))
        for station in stations:
            self._scan(scans, station)

    def _scan(self, scans: Any, station: FieldStation) -> None:
        clouds, lib = self._clouds, self._lib
        scan = lib.StructureNode(self._file)
        scans.append(scan)
        scan.set("guid", self._text(guid_of(clouds, station)))
        scan.set("name", self._text(station.id))
        named = {**facts(clouds), **facts_of(station)}
        scan.set("description", self._text("; ".join(f"{name}: {value}" for name, value in named.items())))
        scan.set("sensorModel", self._text(clouds.settings.scanner.title))
        scan.set("pose", self._pose(station))
        n_rows, n_columns = clouds.template.shape
        scan.set("indexBounds", self._structure({
            "rowMinimum": self._whole(0),
            "rowMaximum": self._whole(n_rows - 1),
            "columnMinimum": self._whole(0),
            "columnMaximum": self._whole(n_columns - 1),
            "returnMinimum": self._whole(0),
            "returnMaximum": self._whole(0),
        }))  # fmt: skip
        scan.set("intensityLimits", self._structure({
            "intensityMinimum": lib.FloatNode(self._file, 0.0), "intensityMaximum": lib.FloatNode(self._file, 1.0),
        }))  # fmt: skip
        # The box is known when the last point is, and the tree is written when the file is closed.
        low_m, high_m = self._points(scan, station)
        scan.set("cartesianBounds", self._structure({
            f"{axis}{end}": lib.FloatNode(self._file, float(values[k]))
            for end, values in (("Minimum", low_m), ("Maximum", high_m))
            for k, axis in enumerate("xyz")
        }))  # fmt: skip

    def _pose(self, station: FieldStation) -> Any:
        rotation = dict(zip("wxyz", rotation_of(self._clouds.frame.matrix), strict=True))
        translation = dict(zip("xyz", station.site_m, strict=True))
        return self._structure({
            name: self._structure({axis: self._lib.FloatNode(self._file, float(v)) for axis, v in values.items()})
            for name, values in (("rotation", rotation), ("translation", translation))
        })  # fmt: skip

    def _points(self, scan: Any, station: FieldStation) -> tuple[FloatArray, FloatArray]:
        """Stream the points of a station into its scan -> least and greatest coordinates, of zeros where none."""
        lib = self._lib
        node = lib.CompressedVectorNode(self._file, self._prototype(), lib.VectorNode(self._file, True))
        scan.set("points", node)
        n_rows, n_columns = self._clouds.template.shape
        capacity = min(max(self._clouds.block_beams, n_columns), n_rows * n_columns)
        arrays, buffers = self._buffers(capacity)
        writer = node.writer(buffers)
        low_m, high_m = np.full(3, np.inf), np.full(3, -np.inf)
        try:
            for points in self._clouds.points(station):
                rounded_m = _fill(arrays, points)
                low_m, high_m = np.minimum(low_m, rounded_m.min(axis=0)), np.maximum(high_m, rounded_m.max(axis=0))
                writer.write(len(points))
        except BaseException:
            # libE57 crashes where a file is cancelled before its writer is closed.
            with contextlib.suppress(lib.E57Exception):
                writer.close()
            raise
        writer.close()
        return (low_m, high_m) if np.isfinite(low_m).all() else (np.zeros(3), np.zeros(3))

    def _prototype(self) -> Any:
        lib, file = self._lib, self._file
        n_rows, n_columns = self._clouds.template.shape
        reach = int(np.ceil(self._clouds.template.range_max_m / STEP_M)) + 1
        return self._structure({
            **{f"cartesian{axis}": lib.ScaledIntegerNode(file, 0, -reach, reach, STEP_M, 0.0) for axis in "XYZ"},
            "cartesianInvalidState": lib.IntegerNode(file, 0, 0, 2),
            "intensity": lib.ScaledIntegerNode(file, 0, 0, _INTENSITY_STEPS, 1.0 / _INTENSITY_STEPS, 0.0),
            "rowIndex": lib.IntegerNode(file, 0, 0, n_rows - 1),
            "columnIndex": lib.IntegerNode(file, 0, 0, n_columns - 1),
        })  # fmt: skip

    def _buffers(self, capacity: int) -> tuple[dict[str, Any], Any]:
        """Arrays that the writer takes points from, again and again."""
        lib = self._lib
        names = [f"cartesian{axis}" for axis in ("X", "Y", "Z", "InvalidState")]
        names += ["intensity", "rowIndex", "columnIndex"]
        # Of the types with 32 bits or more it knows NumPy's `longlong` alone on every system.
        arrays: dict[str, Any] = {name: np.zeros(capacity, dtype=np.longlong) for name in names}
        buffers = lib.VectorSourceDestBuffer()
        for name, array in arrays.items():
            buffers.append(lib.SourceDestBuffer(self._file, name, array, capacity, True, False))
        return arrays, buffers

    def _structure(self, children: dict[str, Any]) -> Any:
        node = self._lib.StructureNode(self._file)
        for name, child in children.items():
            node.set(name, child)
        return node

    def _text(self, value: str) -> Any:
        return self._lib.StringNode(self._file, value)

    def _whole(self, value: int) -> Any:
        return self._lib.IntegerNode(self._file, int(value))


def _fill(arrays: dict[str, Any], points: Points) -> FloatArray:
    """Put points into the writer's arrays -> (N, 3) their coordinates as written, metres."""
    n, steps = len(points), np.rint(points.from_sensor_m / STEP_M)
    for k, axis in enumerate("XYZ"):
        arrays[f"cartesian{axis}"][:n] = steps[:, k]
    arrays["intensity"][:n] = np.rint(points.intensity.astype(np.float64) * _INTENSITY_STEPS)
    arrays["rowIndex"][:n] = points.row
    arrays["columnIndex"][:n] = points.column
    return np.asarray(steps * STEP_M)
