"""Format `field`: one file for the crew's phone: where to set up next, what became of it, without network or server.

PlanSource -> an HTML page with everything in it: drawn in the scene's metres, with coordinates of the site where these
are known, and the groups of stations that register. It holds the plan as reviewers left it, and the revision of the
review that this was. What the crew enters stays on the phone; the page saves it as a JSON file (`tlsplan/field/1`),
which `tlsplan view` takes into the review by that revision: docs/howto/field-file.md.
"""

from __future__ import annotations

import base64
import hashlib
import json
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.export.options import Options
from planner_core.export.section import floor_section
from planner_core.export.sheets.building import building_of
from planner_core.model import FloatArray, Floor
from planner_core.model.review import ReviewedStation
from planner_core.plan_folder.plan_source import PlanSource, station_numbers
from planner_core.progress import Progress, ProgressEvent
from planner_core.review.stations import reviewed_stations
from planner_core.review.store import ReviewStore

SCHEMA = "tlsplan/field/1"
STAGE = "field file"
#: Lines on a phone: what is shorter is not seen.
_LEAST_LINE_M = 0.15
_CM = 2


def write_field_file(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the page into the file `path`; remarks say what could not be shown.

    Raises
    ------
    PlanFolderError
        The review of the plan can't be read.
    ExportError
        The stage of the plan folder can't be read.
    """
    del options
    progress(ProgressEvent(STAGE, 0, 1))
    store = ReviewStore(plan.folder)
    under, review = store.plan(), store.current()
    walls, remarks = _walls(plan)
    document = {
        "schema": SCHEMA,
        "title": plan.title,
        "plan_sha256": under.sha256,
        "revision": review.revision,
        "floors": [
            {"id": floor.id, "name": floor.name, "bounds": np.round(floor.bounds, _CM).tolist(), "walls": walls[i]}
            for i, floor in enumerate(plan.floors)
        ],
        "site": _site(plan),
        "clearance_m": plan.document["settings"]["clearance_m"],
        "groups": [list(network["stations"]) for network in plan.document["registration"]["networks"]],
        "targets": [
            {"stations": [link.a, link.b], "places": np.round(link.targets_m, _CM).tolist()}
            for link in plan.links
            if link.targets_m
        ],
        "stations": _stations(plan, reviewed_stations(under, review)),
    }
    path.write_text(_page(plan.title, document), encoding="utf-8")
    progress(ProgressEvent(STAGE, 1, 1))
    return remarks


def _site(plan: PlanSource) -> dict[str, Any] | None:
    """The way to site coordinates; None where they are the scene's."""
    frame = plan.frame
    if frame.is_scene:
        return None
    return {
        "name": frame.crs_line,
        "unit": frame.unit.symbol,
        "metres_per_unit": frame.unit.metres,
        "from_scene": frame.matrix[:3].tolist(),
    }


def _stations(plan: PlanSource, reviewed: tuple[ReviewedStation, ...]) -> list[dict[str, Any]]:
    """Stations still to be scanned as reviewers left them, in the order of visits."""
    numbers = station_numbers([each.id for each in reviewed])
    return [
        {
            "id": each.id,
            "number": number,
            "floor": each.floor,
            "position": [round(value, 4) for value in each.position_m],
            "instrument_height_m": each.instrument_height_m,
        }
        for each, number in zip(reviewed, numbers, strict=True)
        if not each.fixed
    ]


def _walls(plan: PlanSource) -> tuple[list[list[list[float]]], tuple[str, ...]]:
    """What stands on each floor, as polylines [x, y, x, y, ...]; and a remark where the building is not known."""
    building = building_of(plan)
    if isinstance(building, str):
        return [[] for _ in plan.floors], (f"the maps have no walls: {building.partition(':')[0]}",)
    offset_m = building.scene.offset_m
    return [
        [
            _flat(line.points_m, line.closed)
            for line in floor_section(
                building.scene,
                Floor(
                    id=floor.id,
                    name=floor.name,
                    elevation_m=floor.elevation_m - float(offset_m[2]),
                    ground_area_m2=0.0,
                    ground_triangles=np.zeros(0, dtype=np.int32),
                    bounds_m=np.array(floor.bounds) - offset_m[:2],
                    origin="slab",
                ),
            )
            if line.length_m >= _LEAST_LINE_M
        ]
        for floor in plan.floors
    ], ()


def _flat(points_m: FloatArray, closed: bool) -> list[float]:
    points_m = np.concatenate([points_m, points_m[:1]]) if closed else points_m
    return [round(float(value), _CM) for value in points_m.ravel()]


def _page(title: str, document: dict[str, Any]) -> str:
    style, script = (files("planner_core.export.field_page").joinpath(name).read_text() for name in _PARTS)
    # A text of the plan must not end the script that it stands in.
    data = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    policy = (
        f"default-src 'none'; style-src '{_hash(style)}'; script-src '{_hash(script)}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    return "\n".join(
        [
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta http-equiv="content-security-policy" content="{policy}">',
            f"<title>{escape(title)} – field</title>\n<style>{style}</style>\n</head>\n<body>",
            '<main id="page"><noscript>This page needs JavaScript.</noscript></main>',
            f'<script id="plan" type="application/json">{data}</script>',
            f"<script>{script}</script>\n</body>\n</html>\n",
        ]
    )


_PARTS = ("field.css", "field.js")


def _hash(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
