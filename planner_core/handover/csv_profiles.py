"""Stations as a CSV for controllers and total stations, a line a station in walking order."""

from __future__ import annotations

import csv
from pathlib import Path

from planner_core.errors import RequirementError
from planner_core.handover.options import Options
from planner_core.handover.source import FieldStation, PlanSource
from planner_core.progress import Progress


def write_csv(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write point, easting, northing, height and description; heights of the ground point or of the sensor."""
    if options.columns != "PENZD":
        raise RequirementError(f"--columns: got {options.columns!r}, expected PENZD")
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\r\n")
        for station in plan.stations:
            if not options.floors or {station.floor_id, station.floor_name} & set(options.floors):
                rows.writerow(_row(station, options))
    return ()


def _row(station: FieldStation, options: Options) -> list[str]:
    at_m = station.site_m if options.instrument == "sensor" else station.site_ground_m
    description = f"{station.floor_name} no. {station.number} HI {station.instrument_height_m:.4f}"
    return [station.id, *(f"{value:.4f}" for value in at_m), description]
