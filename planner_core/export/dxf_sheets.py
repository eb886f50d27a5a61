"""DXF drawings: a sheet a floor, to scale, of this floor's layers only. PlanSource, FloorSection -> paper space."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.export.dxf_document import STYLE, DxfLayer, add_layer, layer_part
from planner_core.export.sheets.paper import PAPERS, drawing_scales, scale_name
from planner_core.model import METRE, FloatArray, LengthUnit
from planner_core.plan_folder import palette
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import PlanSource

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
