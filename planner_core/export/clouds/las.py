"""Clouds as LAS 1.4 and LAZ: points of format 6 in site coordinates, with the CRS, station by station.

`Clouds` -> one file of all stations, or one a station. References: ASPRS, LAS Specification 1.4 R15 (2019). What is in
them: docs/formats/field-pack/clouds.md.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import ExportError
from planner_core.export.clouds.each_station import Write, one_file, write_each
from planner_core.export.clouds.file_header import facts, facts_of, wkt_of
from planner_core.export.clouds.points import Clouds, Points, open_clouds
from planner_core.export.options import Options
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

SCALE_M = 0.0001
"""Step of coordinates: 0.1 mm. 32 bits then reach 214 km from the offset."""
_SCAN_ANGLE_STEP_DEG = 0.006
_CREATION_AT = 90
"""Byte of the header where day and year of creation are, two bytes each; 0 and 0: not given."""
_MOST_VLR_BYTES = 65535


def write_las(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the clouds of all stations into the file `path`, not compressed."""
    return _write_together(plan, path, options, progress, _write_plain)


def write_laz(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the clouds of all stations into the file `path`, compressed."""
    return _write_together(plan, path, options, progress, _write_compressed)


def write_las_split(plan: PlanSource, folder: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write a LAS file a station into `folder`."""
    clouds = open_clouds(plan, options, progress=progress)
    write_each(clouds, [one_file(".las", _write_plain)], folder)
    return clouds.remarks()


def write_laz_split(plan: PlanSource, folder: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write a LAZ file a station into `folder`."""
    clouds = open_clouds(plan, options, progress=progress)
    write_each(clouds, [one_file(".laz", _write_compressed)], folder)
    return clouds.remarks()


def _write_together(
    plan: PlanSource, path: Path, options: Options, progress: Progress, write: Write
) -> tuple[str, ...]:
    clouds = open_clouds(plan, options, progress=progress)
    write(clouds, clouds.stations, path)
    return clouds.remarks()


def _write_plain(clouds: Clouds, stations: tuple[FieldStation, ...], path: Path) -> None:
    _write(clouds, stations, path, compress=False)


def _write_compressed(clouds: Clouds, stations: tuple[FieldStation, ...], path: Path) -> None:
    _write(clouds, stations, path, compress=True)


def _write(clouds: Clouds, stations: tuple[FieldStation, ...], path: Path, *, compress: bool) -> None:
    import laspy

    header = _header(clouds, stations)
    with path.open("wb") as file:
        # One thread: LAZ is cut into chunks of as many points whatever the blocks, and the same on any machine.
        backend = laspy.LazBackend.Lazrs if compress else None
        with laspy.LasWriter(file, header, do_compress=compress, laz_backend=backend, closefd=False) as writer:
            for station in stations:
                for points in clouds.points(station):
                    writer.write_points(_records(points, station, header))
        file.seek(_CREATION_AT)
        file.write(bytes(4))  # laspy would have it today


def _header(clouds: Clouds, stations: tuple[FieldStation, ...]) -> Any:
    import laspy
    from laspy.vlrs.known import WktCoordinateSystemVlr

    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, SCALE_M)
    header.offsets = _offsets_m(clouds, stations)
    header.system_identifier = "tlsplan simulation"
    header.generating_software = "tlsplan"
    header.global_encoding.wkt = True  # as point formats from 6 on must have it, even without a system to tell
    index = "u2" if max(clouds.template.shape) <= 2**16 else "u4"
    header.add_extra_dims(
        [
            laspy.ExtraBytesParams("range", "f4", description="metres"),
            laspy.ExtraBytesParams("incidence", "f4", description="degrees from the normal"),
            laspy.ExtraBytesParams("row", index, description="of the grid of beams"),
            laspy.ExtraBytesParams("column", index, description="of the grid of beams"),
        ]
    )
    for extra in header.vlrs.get("ExtraBytesVlr")[0].extra_bytes_structs:
        # laspy 2.7 takes their least and greatest from the first point of each block alone: better left out.
        extra.options &= ~(extra.MIN_BIT_MASK | extra.MAX_BIT_MASK)
    if clouds.frame.crs:
        header.vlrs.append(WktCoordinateSystemVlr(wkt_of(clouds.frame)))
    header.vlrs.append(laspy.VLR("LASF_Spec", 3, "Text Area Description", _description(clouds, stations)))
    return header


def _offsets_m(clouds: Clouds, stations: tuple[FieldStation, ...]) -> FloatArray:
    """Whole hundreds of metres near the stations, so that files of one site have the same ones mostly."""
    middle_m = np.mean([station.site_m for station in stations], axis=0)
    reach_m = np.ptp([station.site_m for station in stations], axis=0).max() + 2 * clouds.template.range_max_m
    if not reach_m < 2**30 * SCALE_M:
        raise ExportError(
            f"LAS: stations and beams reach over {reach_m:.0f} m, expected less than {2**30 * SCALE_M:.0f} m; "
            "export them as one file per station"
        )
    return np.asarray(np.round(middle_m / 100.0) * 100.0)


def _description(clouds: Clouds, stations: tuple[FieldStation, ...]) -> bytes:
    lines = [f"{name}: {value}" for name, value in facts(clouds).items()]
    places = [", ".join(f"{name} {value}" for name, value in facts_of(station).items()) for station in stations]
    whole = "\n".join([*lines, *places]).encode()
    return whole if len(whole) < _MOST_VLR_BYTES else "\n".join(lines).encode()


def _records(points: Points, station: FieldStation, header: Any) -> Any:
    import laspy

    records = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    steps = np.rint((points.site_m - header.offsets) / header.scales).astype(np.int32)
    records.X, records.Y, records.Z = steps.T
    records.intensity = np.rint(points.intensity * 65535.0).astype(np.uint16)
    records.return_number = np.ones(len(points), dtype=np.uint8)
    records.number_of_returns = np.ones(len(points), dtype=np.uint8)
    records.synthetic = np.ones(len(points), dtype=np.uint8)
    # Of the beam against the vertical: straight down is 0.
    from_nadir_deg = 90.0 + np.degrees(points.elevation_rad)
    records.scan_angle = np.rint(from_nadir_deg / _SCAN_ANGLE_STEP_DEG).astype(np.int16)
    records.point_source_id = np.full(len(points), station.number, dtype=np.uint16)
    records["range"] = points.range_m.astype(np.float32)
    records["incidence"] = np.degrees(points.incidence_rad).astype(np.float32)
    records["row"] = points.row
    records["column"] = points.column
    return records
