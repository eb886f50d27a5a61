"""`tlsplan floors`: which floors a scene has, with area and elevation."""

from __future__ import annotations

from pathlib import Path

import click

from ..options import FileOptions, apply, output_options, scene_argument, scene_options


@click.command("floors", epilog="Example:  tlsplan floors building.ifc")
@apply(scene_argument, scene_options, output_options)
def command(scenes: tuple[Path, ...], reading: FileOptions, as_json: bool, quiet: bool) -> None:
    """List the floors of SCENE that stations can stand on, with area and elevation."""
    from planner_core.coverage.plausibility import implausible_floors
    from planner_core.scene.floors import find_floors, other_levels

    from .. import inputs, output
    from ..progress import ProgressReporter

    with ProgressReporter(quiet=quiet or as_json) as reporter:
        loaded = inputs.load(scenes, reading, progress=reporter.show)
        report = find_floors(loaded)  # before warnings: a scene that is no building gets the one line of its refusal
        warnings = (*loaded.report.warnings, *report.warnings, *implausible_floors(loaded, report.floors))
        reporter.warn((*output.repairs(loaded.report, listed_in="--json"), *warnings))
    offset_z_m = float(loaded.offset_m[2])
    if as_json:
        output.as_json(
            {
                "floors": [
                    {
                        "id": floor.id,
                        "name": floor.name,
                        "elevation_m": round(floor.elevation_m + offset_z_m, 4),
                        "ground_area_m2": round(floor.ground_area_m2, 3),
                        "origin": floor.origin,
                        "other_levels": [
                            {"elevation_m": round(height_m + offset_z_m, 4), "ground_area_m2": round(area_m2, 3)}
                            for height_m, area_m2 in other_levels(loaded, floor)
                        ],
                    }
                    for floor in report.floors
                ],
                "glass_area_m2": round(loaded.report.glass_area_m2, 3),
                "mirror_area_m2": round(loaded.report.mirror_area_m2, 3),
                "dropped_faces": list(loaded.report.dropped),
                "warnings": list(warnings),
            }
        )
        return
    output.table(
        ("id", "name", "elevation m", "ground m2", "found by"),
        [
            (f.id, f.name, f"{f.elevation_m + offset_z_m:.3f}", f"{f.ground_area_m2:.1f}", f.origin)
            for f in report.floors
        ],
    )
    for floor in report.floors:
        for height_m, area_m2 in other_levels(loaded, floor):
            output.say(f"{floor.id}  {floor.name}: {area_m2:.1f} m2 of its ground at {height_m + offset_z_m:.3f} m")
    for line in output.materials(loaded.report.glass_area_m2, loaded.report.mirror_area_m2, glass=reading.glass):
        output.say(line)
