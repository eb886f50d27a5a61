"""The registry of formats, and what all of them share: a free target, files that appear whole, a record of what is in.

A writer gets a `PlanSource`, a path to write to (a file that is not there, or an empty folder) and `Options`. It never
looks at the target, replaces, renames or prints; it returns remarks, one line each, for the user.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import CrsNeededError, ExportError, RequirementError
from planner_core.export.options import Options
from planner_core.export.targets import (
    check_file,
    check_folder,
    check_is_no_source,
    size_of,
    target_guarded,
    write_record,
)
from planner_core.plan_folder.atomic import staged_file, staged_folder
from planner_core.plan_folder.plan_settings import ScenePaths
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import Progress, ProgressEvent, silent

STAGE = "export"
ALL = "all"
"""In place of a name: every format, each under its standard name."""

Writer: TypeAlias = Callable[[PlanSource, Path, Options, Progress], tuple[str, ...]]


@dataclass(frozen=True)
class Format:
    """A format that a plan is exported to.

    file_name : its standard name in a pack, suffix and all; without a suffix it is a folder. needs_scene : it is made
    from the scene file besides. options : fields of `Options` that it takes. verified_with : programs that read it in
    tests, and versions.
    """

    name: str
    title: str
    file_name: str
    write: Writer
    needs_scene: bool = False
    options: tuple[str, ...] = ()
    verified_with: str = ""
    in_pack: bool = True
    """Whether `all` holds it."""
    feet: bool = False
    """Whether it can be in feet, or has metres by its own definition; others are in metres, and a remark says so."""
    page: str = ""
    """Its page in docs/formats/field-pack."""

    @property
    def is_folder(self) -> bool:
        """Whether it is a folder of files."""
        return not Path(self.file_name).suffix

    @property
    def example(self) -> str:
        """How it is called."""
        return f"tlsplan export plan/ --format {self.name} -o {self.file_name}{'/' if self.is_folder else ''}"


@dataclass(frozen=True)
class Written:
    """What was written, and in which coordinates.

    remarks : doubts, one line each, for the user; notes : what is to be known of the coordinates.
    """

    path: Path
    n_files: int
    n_bytes: int
    remarks: tuple[str, ...] = ()
    coordinates: str = ""
    notes: tuple[str, ...] = ()


def _lazy(module: str, function: str) -> Writer:
    """Return a writer whose module is imported when it first writes: most need packages of their own."""

    def write(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
        writer: Writer = getattr(importlib.import_module(module), function)
        return writer(plan, path, options, progress)

    return write


CLOUD_OPTIONS = ("stations", "floors", "noise", "seed", "max_points")
"""Of all formats of clouds. None of them is in a pack: clouds are large, and are asked for by name."""

_FORMATS = (
    Format(
        name="csv",
        title="stations as a CSV for controllers and total stations",
        file_name="stations.csv",
        write=_lazy("planner_core.export.csv_profiles", "write_csv"),
        options=("columns", "separator", "decimals", "instrument", "subtract", "floors"),
        verified_with="Python's csv, tlsplan evaluate",
        page="station-lists.md",
        feet=True,
    ),
    Format(
        name="gsi8",
        title="stations as Leica GSI-8, 8 digits to the millimetre",
        file_name="stations-8.gsi",
        write=_lazy("planner_core.export.gsi", "write_gsi8"),
        options=("instrument", "gsi_unit", "subtract", "floors"),
        verified_with="a parser of the format's description, geocompy",
        in_pack=False,
        page="station-lists.md",
        feet=True,
    ),
    Format(
        name="gsi16",
        title="stations as Leica GSI-16, to 0.1 mm",
        file_name="stations-16.gsi",
        write=_lazy("planner_core.export.gsi", "write_gsi16"),
        options=("instrument", "gsi_unit", "subtract", "floors"),
        verified_with="a parser of the format's description, geocompy",
        page="station-lists.md",
        feet=True,
    ),
    Format(
        name="landxml",
        title="stations and route as LandXML 1.2",
        file_name="stations.xml",
        write=_lazy("planner_core.export.landxml", "write_landxml"),
        options=("floors",),
        verified_with="ElementTree, rules of the schema; by hand LandXML-1.2.xsd (xmlschema 4.3)",
        page="station-lists.md",
        feet=True,
    ),
    Format(
        name="geojson",
        title="stations, links, route and floors as GeoJSON",
        file_name="stations.geojson",
        write=_lazy("planner_core.export.geojson", "write_geojson"),
        options=("geojson_crs", "floors"),
        verified_with="GDAL (pyogrio), pyproj",
        page="station-lists.md",
        feet=True,
    ),
    Format(
        name="kml",
        title="stations, links, route and floors as KML",
        file_name="stations.kml",
        write=_lazy("planner_core.export.kml", "write_kml"),
        options=("instrument", "kml_heights", "floors"),
        verified_with="GDAL's LIBKML (pyogrio)",
        page="station-lists.md",
        feet=True,
    ),
    Format(
        name="dxf",
        title="a drawing: cut walls, stations as blocks, links, route, a sheet per floor",
        file_name="drawing.dxf",
        write=_lazy("planner_core.export.dxf", "write_dxf"),
        options=("floors", "paper", "cut_m"),
        verified_with="ezdxf 1.4 (audit), GDAL (pyogrio)",
        page="drawings.md",
        feet=True,
    ),
    Format(
        name="ifc",
        title="stations only, as IFC4, in the storeys of their floors",
        file_name="stations.ifc",
        write=_lazy("planner_core.export.ifc_stations", "write_ifc"),
        options=("floors",),
        verified_with="IfcOpenShell 0.9: geometry, validate with express rules",
        page="drawings.md",
        feet=True,
    ),
    Format(
        name="ifc-model",
        title="a copy of the plan's own IFC file with the stations in its storeys",
        file_name="model-with-stations.ifc",
        write=_lazy("planner_core.export.ifc_stations", "write_ifc_model"),
        needs_scene=True,
        options=("floors",),
        verified_with="IfcOpenShell 0.9: geometry, validate",
        in_pack=False,
        page="drawings.md",
        feet=True,
    ),
    Format(
        name="bcf",
        title="comments and unseen elements as issues with camera and snapshot, BCF 2.1",
        file_name="issues.bcfzip",
        write=_lazy("planner_core.export.bcf", "write_bcf"),
        options=("max_topics", "floors"),
        verified_with="ElementTree, rules of the schemas; by hand bcf-client 0.9, BCF 2.1's XSDs (xmlschema 4.3)",
        in_pack=False,
        page="bcf.md",
        feet=True,
    ),
    Format(
        name="usd-stations",
        title="stations only, as one USD layer: tripods, cameras, figures",
        file_name="stations.usda",
        write=_lazy("planner_core.export.usd_stations", "write_usd_stations"),
        options=("floors",),
        verified_with="usd-core 26.11: UsdValidation, all validators",
        page="drawings.md",
    ),
    Format(
        name="usdz",
        title="the whole USD stage in one file: building, heat maps, stations, clouds, review",
        file_name="plan.usdz",
        write=_lazy("planner_core.export.usdz", "write_usdz"),
        verified_with="usd-core 26.11: UsdValidation, all validators",
        in_pack=False,
        page="usd.md",
    ),
    Format(
        name="robot",
        title="a robot's mission: waypoints, paths and occupancy grids",
        file_name="robot",
        write=_lazy("planner_core.export.robot", "write_robot"),
        needs_scene=True,
        options=("floors",),
        verified_with="Pillow, PyYAML, GDAL (pyogrio), Open3D",
        page="robot.md",
    ),
    Format(
        name="pdf",
        title="sheets to print: cover, floors to scale, station tables, charts",
        file_name="sheets.pdf",
        write=_lazy("planner_core.export.sheets.pdf", "write_pdf"),
        options=("paper", "floors", "cut_m"),
        verified_with="pypdf 7.1, PDFium (pypdfium2)",
        page="sheets.md",
        feet=True,
    ),
    Format(
        name="html",
        title="the same as one page for browsers, with nothing beside it",
        file_name="sheets.html",
        write=_lazy("planner_core.export.sheets.html_page", "write_html"),
        options=("paper", "floors", "cut_m"),
        verified_with="Python's html.parser and ElementTree; by hand Chromium 156",
        page="sheets.md",
        feet=True,
    ),
    Format(
        name="e57",
        title="simulated scans of all stations, each with its pose, in one file",
        file_name="clouds.e57",
        write=_lazy("planner_core.export.clouds.e57", "write_e57"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="e57 0.2 (Rust), pye57 0.4",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="e57-split",
        title="the same, one file per station",
        file_name="e57",
        write=_lazy("planner_core.export.clouds.e57", "write_e57_split"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="e57 0.2 (Rust), pye57 0.4",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="las",
        title="simulated clouds of all stations as LAS 1.4",
        file_name="clouds.las",
        write=_lazy("planner_core.export.clouds.las", "write_las"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="laspy 2.7; byte by byte against the specification",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="las-split",
        title="the same, one file per station",
        file_name="las",
        write=_lazy("planner_core.export.clouds.las", "write_las_split"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="laspy 2.7; byte by byte against the specification",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="laz",
        title="simulated clouds of all stations as LAZ (LAS 1.4, compressed)",
        file_name="clouds.laz",
        write=_lazy("planner_core.export.clouds.las", "write_laz"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="laspy 2.7 with lazrs 0.8",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="laz-split",
        title="the same, one file per station",
        file_name="laz",
        write=_lazy("planner_core.export.clouds.las", "write_laz_split"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="laspy 2.7 with lazrs 0.8",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="ply",
        title="simulated clouds of all stations as PLY",
        file_name="clouds.ply",
        write=_lazy("planner_core.export.clouds.ply", "write_ply"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="Open3D 0.20, trimesh 5",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="ply-split",
        title="the same, one file per station",
        file_name="ply",
        write=_lazy("planner_core.export.clouds.ply", "write_ply_split"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="Open3D 0.20, trimesh 5",
        in_pack=False,
        page="clouds.md",
    ),
    Format(
        name="exr",
        title="simulated range images, an OpenEXR file and a preview per station",
        file_name="exr",
        write=_lazy("planner_core.export.clouds.exr", "write_exr"),
        needs_scene=True,
        options=CLOUD_OPTIONS,
        verified_with="OpenEXR 3.5, OpenImageIO 3.2",
        in_pack=False,
        page="clouds.md",
    ),
)

FORMATS: dict[str, Format] = {each.name: each for each in _FORMATS}
"""By the name that `tlsplan export --format` takes; in the order in which they are listed."""


def formats_named(names: Sequence[str]) -> tuple[Format, ...]:
    """Return the formats of these names, `all` for every one, each once.

    Raises
    ------
    RequirementError
        There is none of a name.
    """
    wanted: dict[str, Format] = {}
    for name in names:
        if name == ALL:
            wanted.update((each.name, each) for each in _FORMATS if each.in_pack)
        elif name in FORMATS:
            wanted[name] = FORMATS[name]
        else:
            raise RequirementError(f"format: got {name!r}, expected one of {', '.join((*FORMATS, ALL))}; see --list")
    return tuple(wanted.values())


def export_plan(
    name: str,
    plan: Path | PlanSource,
    target: Path,
    options: Options = Options(),  # noqa: B008 - frozen
    *,
    overwrite: bool = False,
    scene: ScenePaths = None,
    frame: FrameRequest | None = None,
    progress: Progress = silent,
) -> Written:
    """Write a plan in one format; it appears whole or not at all.

    Parameters
    ----------
    name
        Of `FORMATS`.
    plan
        The plan folder; or the plan, once opened, with `scene` and `frame` as told then.
    target
        The file or the folder to write; folders above are made.
    overwrite
        Replace a file, or a folder that was written here before.

    Raises
    ------
    OutputExistsError
        The target is there, and is not to be replaced.
    HandoverError, PlanFolderError, CoordinatesError, SceneError
        What it is written from is not there or does not do; or the target can't be written.
    """
    (chosen,) = formats_named([name])
    opened = plan if isinstance(plan, PlanSource) else open_plan(plan, scene=scene, frame=frame)
    _check_scene(opened, (chosen,))
    with target_guarded(opened, target):
        if chosen.is_folder:
            check_folder(target, overwrite=overwrite)
            with staged_folder(target, replace=overwrite) as staging:
                remarks = _write(chosen, opened, staging, options, progress)
                write_record(opened, _names_of([chosen]), staging, _subtracted_m(opened, [chosen], options))
        else:
            check_file(target, overwrite=overwrite)
            check_is_no_source(opened, target)
            target.parent.mkdir(parents=True, exist_ok=True)
            with staged_file(target) as staging:
                remarks = _write(chosen, opened, staging, options, progress)
                check_file(target, overwrite=overwrite)  # minutes may have gone by
    return _written(opened if chosen.feet else in_metres(opened), target, remarks)


def export_pack(
    names: Sequence[str],
    plan: Path | PlanSource,
    target: Path,
    options: Options = Options(),  # noqa: B008 - frozen
    *,
    overwrite: bool = False,
    scene: ScenePaths = None,
    frame: FrameRequest | None = None,
    progress: Progress = silent,
) -> Written:
    """Write a plan in several formats into one folder, each under its standard name; as `export_plan`.

    Of all formats, those that need a CRS are left out of a plan without one, those that need the scene file where it
    is not found, and remarks say so. What is asked for by its own name, or with a scene file that is told, is refused.
    """
    chosen = formats_named(names)
    opened = plan if isinstance(plan, PlanSource) else open_plan(plan, scene=scene, frame=frame)
    chosen, left_out = _without_scene(opened, chosen, names)
    _check_scene(opened, chosen)
    held: list[Format] = []
    told: dict[str, list[str]] = {}
    with target_guarded(opened, target):
        check_folder(target, overwrite=overwrite)
        with staged_folder(target, replace=overwrite) as staging:
            for n_done, each in enumerate(chosen):
                progress(ProgressEvent(STAGE, n_done, len(chosen), each.name))
                path = staging / each.file_name
                if each.is_folder:
                    path.mkdir()
                try:
                    for remark in dict.fromkeys(_write(each, opened, path, options, progress)):
                        told.setdefault(remark, []).append(each.name)
                    held.append(each)
                except CrsNeededError as error:
                    if ALL not in names:
                        raise
                    left_out.append(f"left out: {error}")
            write_record(opened, _names_of(held), staging, _subtracted_m(opened, held, options))
    # What several formats remark, as on the way to longitude and latitude, is told once.
    remarks = [f"{', '.join(by)}: {remark}" for remark, by in told.items()]
    return _written(opened, target, (*left_out, *remarks))


def _write(chosen: Format, plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write in the unit of the plan's site coordinates, or in metres where the format has no other."""
    if chosen.feet or not plan.frame.unit.is_feet:
        return chosen.write(plan, path, options, progress)
    remarks = chosen.write(in_metres(plan), path, options, progress)
    return (*remarks, f"in metres, not in {plan.frame.unit.many}: the format has no other unit")


def in_metres(plan: PlanSource) -> PlanSource:
    """Return the plan with site coordinates that are written in metres."""
    return replace(plan, frame=plan.frame.in_metres())


def _written(plan: PlanSource, target: Path, remarks: Sequence[str]) -> Written:
    frame = plan.frame
    return Written(target, *size_of(target), (*frame.warnings, *remarks), frame.crs_line, frame.notes)


def _names_of(formats: Sequence[Format]) -> dict[str, str]:
    """Name -> what it is called in a folder."""
    return {each.name: each.file_name for each in formats}


def _subtracted_m(plan: PlanSource, formats: Sequence[Format], options: Options) -> dict[str, list[float]]:
    """File -> E, N, H taken off its coordinates, metres, of formats that take the option; none where nothing is."""
    if not any(options.subtract):
        return {}
    taken_off_m = [float(value) * plan.frame.unit.metres for value in options.subtract]
    return {each.file_name: taken_off_m for each in formats if "subtract" in each.options}


def _without_scene(
    plan: PlanSource, chosen: tuple[Format, ...], names: Sequence[str]
) -> tuple[tuple[Format, ...], list[str]]:
    """Return the formats that can be had, and remarks on those of `all` that need a scene file which is not found."""
    spare = [each for each in chosen if each.needs_scene and each.name not in names]
    if not spare or plan.told_scene:
        return chosen, []
    try:
        plan.scene_paths()
    except ExportError as error:
        remarks = [f"left out: {each.name}: {error}" for each in spare]
        return tuple(each for each in chosen if each not in spare), remarks
    return chosen, []


def _check_scene(plan: PlanSource, formats: Sequence[Format]) -> None:
    """Say at once that the scene is missing, before minutes of work."""
    if any(each.needs_scene for each in formats):
        plan.scene_paths()
