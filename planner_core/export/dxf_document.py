"""DXF drawings: an empty document, layers with colours, where it is on Earth, and bytes without a clock.

AutoCAD 2010 (AC1024), the first version that knows GeoData; written by ezdxf. Coordinates are the site's, in its unit.
"""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.export.sheets.paper import PAPERS, drawing_scales, scale_name
from planner_core.model import FOOT, METRE, US_SURVEY_FOOT, FloatArray, LengthUnit, SiteFrame
from planner_core.plan_folder import palette
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import PlanSource

try:
    from ezdxf import filemanagement
    from ezdxf.document import CREATED_BY_EZDXF, WRITTEN_BY_EZDXF
    from ezdxf.enums import InsertUnits
    from ezdxf.lldxf.tagwriter import TagWriter
    from ezdxf.units import M
    from ezdxf.version import __version__
except ImportError as error:
    raise MissingPackageError(
        f"DXF needs the package ezdxf, which can't be imported ({error}): pip install ezdxf"
    ) from error

VERSION = "AC1024"
APP = "TLSPLAN"
"""Under this name entities carry what they are of (extended data)."""
STYLE = "TLSPLAN"

#: 2000-01-01 as a Julian date: the clock has no say in our files.
_DATE = 2451545.0
#: Layers' names may not hold these.
_FORBIDDEN = str.maketrans(dict.fromkeys("<>/\\\":;?*|=`,'\r\n\t", "_"))
#: $INSUNITS, and what the coordinate systems of AutoCAD call a unit: its FOOT is the US survey foot.
_UNITS = {
    METRE: (int(M), "METER"),
    FOOT: (int(InsertUnits.Feet), "IFOOT"),
    US_SURVEY_FOOT: (int(InsertUnits.USSurveyFeet), "FOOT"),
}
#: Strings of extended data end here.
_LONGEST = 255


@dataclass(frozen=True)
class DxfLayer:
    """How a layer is drawn: sRGB colour in [0, 1], nearest colour by number, width of lines in 1/100 mm."""

    name: str
    description: str
    colour: tuple[float, float, float]
    number: int
    width: int = 25
    dashed: bool = False
    on: bool = True


def layer_part(name: str) -> str:
    """Turn a floor's id into the beginning of layers' names."""
    return name.translate(_FORBIDDEN).strip().upper() or "FLOOR"


def new_document(unit: LengthUnit = METRE) -> Any:
    """Make an empty document: one unit, one text style, dashed lines."""
    document = filemanagement.new(VERSION, units=_UNITS[unit][0])
    document.header["$MEASUREMENT"] = 0 if unit.is_feet else 1
    document.header["$LUNITS"] = 2
    document.header["$LUPREC"] = 4
    document.header["$LTSCALE"] = unit.of(1.0)  # dashes are as long as in metres
    document.appids.new(APP)
    document.styles.new(STYLE, dxfattribs={"font": "arial.ttf"})
    document.linetypes.add("DASHED-025", pattern=[0.4, 0.25, -0.15], description="dashes of 0.25 m")
    return document


def add_layer(document: Any, layer: DxfLayer) -> None:
    """Add a layer; one of the name that is there already stays."""
    if layer.name in document.layers:
        return
    added = document.layers.add(
        layer.name,
        color=layer.number,
        true_color=rgb_number(layer.colour),
        linetype="DASHED-025" if layer.dashed else "Continuous",
        lineweight=layer.width,
    )
    added.description = layer.description
    if not layer.on:
        added.off()


def rgb_number(colour: tuple[float, float, float]) -> int:
    """Red, green and blue in [0, 1] as DXF's one number."""
    red, green, blue = (round(255 * part) for part in colour)
    return red << 16 | green << 8 | blue


def say(entity: Any, **facts: object) -> None:
    """Attach what an entity is of, as `key=value` strings of extended data; empty values are left out."""
    strings = [f"{key}={value}"[:_LONGEST] for key, value in facts.items() if str(value)]
    if strings:
        entity.set_xdata(APP, [(1000, string) for string in strings])


def place_on_earth(document: Any, frame: SiteFrame, near: FloatArray) -> tuple[str, ...]:
    """Say in the document where it is. near : (2,) E, N of the drawing, in its unit. Returns remarks.

    Every reader finds the system's name among the drawing's properties. Programs that place drawings on maps read it
    from GeoData, which holds EPSG codes only.
    """
    document.header.custom_vars.append("Coordinates", frame.crs_line)
    if frame.crs:
        document.header.custom_vars.append("CRS", frame.crs)
    if frame.vertical_crs:
        document.header.custom_vars.append("Vertical CRS", frame.vertical_crs)
    authority, _, code = frame.crs.partition(":")
    if not frame.crs:
        return ()
    if authority.upper() != "EPSG" or not code.isdigit():
        return (f"DXF places drawings on Earth by EPSG codes only: {frame.name} is named in its properties",)
    if frame.unit is not frame.crs_unit:
        return (f"DXF places drawings on Earth in the unit of their CRS only: {frame.name} is named in its properties",)
    east, north = (float(value) for value in near)
    geodata = document.modelspace().new_geodata()
    of_drawing, axis_unit = _UNITS[frame.unit]
    document.units = M  # ezdxf knows no survey feet here
    geodata.setup_local_grid(
        design_point=(east, north, 0.0), reference_point=(east, north, 0.0), crs=_crs_xml(frame.name, code, axis_unit)
    )
    document.units = of_drawing
    for axis in ("horizontal", "vertical"):
        geodata.dxf.set(f"{axis}_units", of_drawing)
        geodata.dxf.set(f"{axis}_unit_scale", frame.unit.metres)
    return ()


def _crs_xml(name: str, code: str, unit: str) -> str:
    """Define a projected system by its EPSG code: eastings first."""
    axes = "".join(
        f"<CoordinateSystemAxis><AxisOrder>{order}</AxisOrder><AxisName>{axis}</AxisName>"
        f"<AxisAbbreviation>{axis[0]}</AxisAbbreviation><AxisDirection>{way}</AxisDirection></CoordinateSystemAxis>"
        for order, axis, way in ((1, "Easting", "east"), (2, "Northing", "north"))
    )
    quoted = escape(name, {'"': "&quot;"})
    return (
        '<?xml version="1.0" encoding="UTF-16" standalone="no" ?>'
        '<Dictionary version="1.0" xmlns="http://www.osgeo.org/mapguide/coordinatesystem">'
        f'<ProjectedCoordinateSystem id="{quoted}"><Name>{quoted}</Name><Authority>EPSG,{code}</Authority>'
        f'<Axis uom="{unit}">{axes}</Axis></ProjectedCoordinateSystem>'
        f'<Alias id="{code}" type="CoordinateSystem"><ObjectId>{quoted}</ObjectId>'
        "<Namespace>EPSG Code</Namespace></Alias></Dictionary>"
    )


def write_document(document: Any, path: Path, *, name: str) -> None:
    """Write the document. name : of what it shows, which its ids follow from.

    The same document, the same bytes: `Drawing.saveas` would put in the time and random ids.
    """
    document.commit_pending_changes()
    document.update_all()
    # ezdxf holds the classes of a version as a set, whose order differs from run to run.
    document.classes.classes = dict(sorted(document.classes.classes.items()))
    space = document.modelspace().dxf
    document.header["$EXTMIN"], document.header["$EXTMAX"] = space.extmin, space.extmax
    for variable in ("$TDCREATE", "$TDUCREATE", "$TDUPDATE", "$TDUUPDATE"):
        document.header[variable] = _DATE
    version = "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, f"tlsplan/dxf/{name}")).upper() + "}"
    document.header["$VERSIONGUID"] = document.header["$FINGERPRINTGUID"] = version
    metadata = document.ezdxf_metadata()
    metadata[CREATED_BY_EZDXF] = metadata[WRITTEN_BY_EZDXF] = f"tlsplan, ezdxf {__version__}"
    document.header["$HANDSEED"] = str(document.entitydb.handles)
    with path.open("w", encoding=document.output_encoding, errors="dxfreplace", newline="\r\n") as stream:
        document.export_sections(TagWriter(stream, write_handles=True, dxfversion=document.dxfversion))


# ---------------------------------------------------------------------------------------------------------- dxf sheets
# DXF drawings: a sheet a floor, to scale, of this floor's layers only. PlanSource, FloorSection -> paper space.

TITLE_LAYER = "SHEET-TITLE"
_MARGIN_MM = 10.0
#: Height of the strip with the title.
_TITLE_MM = 20.0
#: Around the ground: walls, and stations near them.
_AROUND_M = 1.0


def add_sheet(document: Any, plan: PlanSource, floor: FloorSection, *, paper: str, hidden: list[str]) -> None:
    """Add a layout with one viewport to a document. paper : of `PAPERS`. hidden : layers that it does not show."""
    height_mm, width_mm = PAPERS[paper]
    add_layer(document, DxfLayer(TITLE_LAYER, "titles of sheets", palette.INK, 7))
    layout = _layout(document, floor)
    layout.page_setup(size=(width_mm, height_mm), margins=(0, 0, 0, 0), units="mm", scale=(1, 1))
    view_mm = np.array([width_mm - 2 * _MARGIN_MM, height_mm - 2 * _MARGIN_MM - _TITLE_MM])
    low_m, high_m = _window_m(plan, floor)
    unit = plan.frame.unit
    scale = scale_for(high_m - low_m, view_mm, unit)
    named = scale_name(scale, unit)
    viewport = layout.add_viewport(
        center=(width_mm / 2, _MARGIN_MM + _TITLE_MM + view_mm[1] / 2),
        size=(float(view_mm[0]), float(view_mm[1])),
        view_center_point=tuple(unit.of_array((low_m + high_m) / 2).tolist()),
        view_height=unit.of(float(view_mm[1]) / 1000 * scale),
        dxfattribs={"layer": TITLE_LAYER},
    )
    viewport.frozen_layers = hidden
    n_stations = len(plan.stations_of(floor.id))
    lines = (
        (f"{plan.title}, {floor.name}", 5.0, 12.0),
        (
            f"1:{scale}{f' ({named})' if named else ''} on {paper}   {n_stations} stations   {plan.frame.crs_line}",
            3.0,
            5.0,
        ),
    )
    for text, size_mm, up_mm in lines:
        layout.add_text(text, height=size_mm, dxfattribs={"style": STYLE, "layer": TITLE_LAYER}).set_placement(
            (_MARGIN_MM, _MARGIN_MM + up_mm - 3.0)
        )


def scale_for(size_m: FloatArray, view_mm: FloatArray, unit: LengthUnit = METRE) -> int:
    """The largest scale at which (2,) metres fit (2,) millimetres of paper; the smallest if none does."""
    scales = drawing_scales(unit)
    return next((scale for scale in scales if (size_m * 1000 / scale <= view_mm).all()), scales[-1])


def _layout(document: Any, floor: FloorSection) -> Any:
    """Make the floor's layout; the first takes the place of the empty one that every document has."""
    name = f"{layer_part(floor.id)} {floor.name}".translate(str.maketrans("<>/\\\":;?*|=`,'", "_" * 14))[:80]
    if "Layout1" in document.layouts:
        document.layouts.rename("Layout1", name)
        return document.layouts.get(name)
    taken = {each.casefold() for each in document.layouts.names()}
    return document.layouts.new(name if name.casefold() not in taken else f"{name} ({len(taken)})")


def _window_m(plan: PlanSource, floor: FloorSection) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest E, N of the floor's ground and stations, and a little around."""
    (x0, y0), (x1, y1) = floor.bounds
    z = floor.elevation_m
    points_m = [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]
    points_m += [station.position_m.tolist() for station in plan.stations_of(floor.id)]
    site_m = plan.frame.to_site(np.array(points_m, dtype=np.float64))[:, :2]
    return np.asarray(site_m.min(axis=0) - _AROUND_M), np.asarray(site_m.max(axis=0) + _AROUND_M)
