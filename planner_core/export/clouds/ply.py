"""Clouds as PLY: binary little-endian points in site coordinates; how a header's count of points becomes known last.

`Clouds` -> one file of all stations, or one a station. What is in them: docs/formats/field-pack/clouds.md.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner_core.export.clouds.each_station import one_file, write_each
from planner_core.export.clouds.file_header import facts, facts_of
from planner_core.export.clouds.points import Clouds, Points, open_clouds
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

_PROPERTIES = (
    ("x", "double", "<f8"),
    ("y", "double", "<f8"),
    ("z", "double", "<f8"),
    ("range", "float", "<f4"),
    ("cos_incidence", "float", "<f4"),
    ("intensity", "float", "<f4"),
    ("row", "int", "<i4"),
    ("column", "int", "<i4"),
    ("triangle", "int", "<i4"),
    ("patch", "int", "<i4"),
    ("station", "int", "<i4"),
)
_RECORD = np.dtype([(name, dtype) for name, _, dtype in _PROPERTIES])


def write_ply(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the clouds of all stations into the file `path`."""
    clouds = open_clouds(plan, options, progress=progress)
    write_points(clouds, clouds.stations, path)
    return clouds.remarks()


def write_ply_split(plan: PlanSource, folder: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write a file a station into `folder`."""
    clouds = open_clouds(plan, options, progress=progress)
    write_each(clouds, [one_file(".ply", write_points)], folder)
    return clouds.remarks()


def write_points(clouds: Clouds, stations: tuple[FieldStation, ...], path: Path) -> None:
    """Write the points of some of the clouds' stations into the file `path`."""
    rows, columns = clouds.template.shape
    room = len(_header(clouds, stations, rows * columns * len(stations)))
    n_points = 0
    with path.open("wb") as file:
        file.write(b" " * room)
        for station in stations:
            for points in clouds.points(station):
                file.write(_records(points, station.number).tobytes())
                n_points += len(points)
        file.seek(0)
        file.write(_header(clouds, stations, n_points, room=room))


def _records(points: Points, station_number: int) -> np.ndarray:
    records = np.empty(len(points), dtype=_RECORD)
    for axis, name in enumerate("xyz"):
        records[name] = points.site_m[:, axis]
    records["range"] = points.range_m
    for name in ("cos_incidence", "intensity", "row", "column", "triangle", "patch"):
        records[name] = getattr(points, name)
    records["station"] = station_number
    return records


def _header(clouds: Clouds, stations: tuple[FieldStation, ...], n_points: int, *, room: int | None = None) -> bytes:
    """The header of `n_points`; a comment of dots fills it up to `room` bytes, which more points would have taken."""
    lines = ["ply", "format binary_little_endian 1.0"]
    lines += [f"comment tlsplan {name} {value}" for name, value in facts(clouds).items()]
    for station in stations:
        lines.append("comment tlsplan " + " ".join(f"{name} {value}" for name, value in facts_of(station).items()))
    end = [f"element vertex {n_points}", *(f"property {kind} {name}" for name, kind, _ in _PROPERTIES), "end_header"]

    def header(dots: int) -> bytes:
        return ("\n".join([*lines, f"comment {'.' * dots}", *end]) + "\n").encode("ascii", "replace")

    shortest = header(1)
    return shortest if room is None else header(1 + room - len(shortest))
