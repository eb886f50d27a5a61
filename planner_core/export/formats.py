"""The registry of formats that plans are exported to; `planner_core.export.write` writes them.

A writer gets a `PlanSource`, a path to write to (a file that is not there, or an empty folder) and `Options`. It never
looks at the target, replaces, renames or prints; it returns remarks, one line each, for the user.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from planner_core.errors import RequirementError
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import Progress

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
    """Whether `all` holds it: a small file that is no variant of another."""
    feet: bool = False
    """Whether it can be in feet, or has metres by its own definition; others are in metres, with a remark.

    docs/howto/feet.md has a row for each."""
    page: str = ""
    """Its page in docs/formats/field-pack."""
    holds_review: bool = False
    """Whether it is written from the plan and its review side by side."""
    by_station: bool = False
    """Whether it has files of clouds by station, which others may write: `planner_core.export.clouds.each_station`."""

    @property
    def is_folder(self) -> bool:
        """Whether it is a folder of files."""
        return not Path(self.file_name).suffix

    @property
    def example(self) -> str:
        """How it is called."""
        return f"tlsplan export plan/ --format {self.name} -o {self.file_name}{'/' if self.is_folder else ''}"


def _lazy(module: str, function: str) -> Writer:
    """Return a writer whose module is imported when it first writes: most need packages of their own."""

    def write(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
        writer: Writer = getattr(importlib.import_module(module), function)
        return writer(plan, path, options, progress)

    return write


CLOUD_OPTIONS = ("stations", "floors", "noise", "seed", "max_points")
"""Of all formats of clouds. None of them is in a pack: clouds are large, and are named explicitly."""

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
        title="comments, and unseen surface by room, as issues with camera and snapshot, BCF 2.1",
        file_name="issues.bcfzip",
        write=_lazy("planner_core.export.bcf", "write_bcf"),
        options=("max_topics", "floors"),
        verified_with="ElementTree, rules of the schemas; by hand bcf-client 0.9, BCF 2.1's XSDs (xmlschema 4.3)",
        in_pack=False,
        holds_review=True,
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
        holds_review=True,
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
        write=_lazy("planner_core.export.sheets.sheet_set", "write_pdf"),
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
        name="field",
        title="one page for the crew's phone, without network: done, moved, skipped, notes; taken into the review",
        file_name="field.html",
        write=_lazy("planner_core.export.field_file", "write_field_file"),
        verified_with="Chromium",
        in_pack=False,
        holds_review=True,
        feet=True,
        page="../../howto/field-file.md",
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
        by_station=True,
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
        by_station=True,
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
        by_station=True,
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
        by_station=True,
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
        by_station=True,
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
