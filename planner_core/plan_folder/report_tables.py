"""Tables of the report: requirements, stations and what each adds, the unseen with its reasons. Plan -> HTML, CSV.

Cells say what a thing is called in the source and, beside it, its room. Coordinates are in the scene frame, metres.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from html import escape

import numpy as np

from planner_core.coverage.percent import reached_percent
from planner_core.model import (
    REASONS,
    FloatArray,
    PartResult,
    Plan,
    PointLimits,
    Scene,
    Station,
    StationReason,
    UnseenSurface,
    Why,
)
from planner_core.model.unseen import COVERED, IN_SOLIDS, reason_in_words

UNSEEN_COLUMNS = ("element", "name", "kind", "source_id", "floor", "unseen_area_m2", "achievable_area_m2")
SURFACE_COLUMNS = (
    "element", "name", "kind", "source_id", "room", "floor", "reason", "area_m2", "n_pieces", "largest_piece_m2",
    "x_m", "y_m", "z_m", "best_x_m", "best_y_m", "best_z_m", "best_adds_m2",
)  # fmt: skip
MAX_UNSEEN_ON_PAGE = 30
MAX_SURFACES_A_REASON = 6
#: Surface of less is not listed on the page.
_SLIVER_M2 = 0.05

#: What the reasons mean, for people.
REASON_TEXTS = {
    "not worth a station": "Positions that see it exist; the requirement is met without them.",
    "too few spots see it": "Seen, but from fewer positions than required.",
    "out of range": "In view, but beyond the maximum range of the scanner or the requirement.",
    "outside the field of view": "In view, but above or below the scanner's field of view.",
    "too oblique": "In view, but at too large an angle of incidence.",
    "too sparse": "In view, but at too large a point spacing, or without a point.",
    "too noisy": "In view, but with more range noise than allowed.",
    "returns no beam": "Glass or mirror.",
    "occluded": "Hidden by something else from every position.",
    "no admissible spot": "In a room, or outdoors, without a valid tripod position.",
    "inside solids": "Faces between building parts: no position sees them.",
}


def table(header: tuple[str, ...], rows: Iterable[tuple[str, ...]], *, numbers_from: int) -> str:
    """Cells are HTML already; columns from `numbers_from` on are aligned as numbers."""

    def cells(tag: str, row: tuple[str, ...]) -> str:
        marks = (' class="n"' if index >= numbers_from else "" for index in range(len(row)))
        return "".join(f"<{tag}{mark}>{cell}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    lines = [f"<tr>{cells('th', header)}</tr>"] if header else []
    lines += [f"<tr>{cells('td', row)}</tr>" for row in rows]
    return '<div class="wide"><table>\n' + "\n".join(lines) + "\n</table></div>"


# ------------------------------------------------------------------------------------------ requirements
def requirements_table(plan: Plan) -> str:
    """Requirements and results; empty where the plan has none."""
    header = ("Requirement", "Points", "", "Required", "Reached", "Of scannable, m²")
    return table(header, map(_result_row, plan.requirements), numbers_from=3) if plan.requirements else ""


def _result_row(result: PartResult) -> tuple[str, ...]:
    met = '<span class="met">met</span>' if result.met else '<b class="warning">not met</b>'
    return (
        escape(result.name),
        _limits_text(result.asked, result.seen_from),
        met,
        f"{100 * result.required:g} %",
        f"{reached_percent(result.fraction_of_achievable, result.required)} %",
        f"{result.achievable_area_m2:.1f}",
    )


def _limits_text(required: PointLimits, seen_from: int) -> str:
    limits = []
    if required.range_m is not None:
        limits.append(f"range {required.range_m:g} m")
    if required.incidence_rad is not None:
        limits.append(f"incidence {np.rad2deg(required.incidence_rad):g}°")
    if required.spacing_m is not None:
        limits.append(f"spacing {1000 * required.spacing_m:g} mm")
    if required.noise_m is not None:
        limits.append(f"noise {1000 * required.noise_m:g} mm")
    text = "at most " + ", ".join(limits) if limits else "seen"
    return text + (f", from {seen_from} stations" if seen_from > 1 else "")


# ---------------------------------------------------------------------------------------------- stations
def stations_table(plan: Plan) -> str:
    """Stations in the order of the plan; what only they see where the plan has reasons."""
    header: tuple[str, ...] = ("No.", "Id", "Floor")
    reasons: dict[str, StationReason] = {}
    if plan.why is not None:
        header += ("Unique surface", "Links to")
        reasons = {reason.station: reason for reason in plan.why.stations}
    n_texts = len(header)
    header += ("x, m", "y, m", "z, m", "Height, m", "Sees, m²", "Unique, m²", "Time on station")
    rows = (_station_row(plan, station, reasons) for station in plan.stations)
    return table(header, rows, numbers_from=n_texts)


def _station_row(plan: Plan, station: Station, reasons: dict[str, StationReason]) -> tuple[str, ...]:
    names = {floor.id: floor.name for floor in plan.survey.floors}
    texts: tuple[str, ...] = (
        str(station.order),
        escape(station.id) + (" (fixed)" if station.fixed else ""),
        escape(names.get(station.floor, station.floor)),
    )
    if plan.why is not None:
        reason = reasons[station.id]
        own = f'<span class="own">{_own_text(plan.survey.scene, reason)}</span>'
        linked = f'<span class="links">{escape(", ".join(reason.linked)) or "<b>none</b>"}</span>'
        texts += (own, linked)
    return (
        *texts,
        *_coordinates(station.position_m + plan.survey.scene.offset_m),
        f"{station.instrument_height_m:.2f}",
        f"{station.covered_area_m2:.1f}",
        f"{station.own_area_m2:.1f}",
        _time_there(plan, station),
    )


def _own_text(scene: Scene, reason: StationReason) -> str:
    parts = (
        f"{_element_name(scene, part.element)}{_in_room(scene, part.room)} ({part.area_m2:.1f} m²)"
        for part in reason.own_parts
        if part.area_m2 >= _SLIVER_M2
    )
    return "; ".join(parts) or "none; it connects others"


def _time_there(plan: Plan, station: Station) -> str:
    """Set-up and scan, minutes and seconds; without the scan where nobody knows how long one takes."""
    if station.fixed:
        return "scanned"
    settings = plan.settings
    scan_s = settings.scanner.seconds_per_scan if settings.seconds_per_scan is None else settings.seconds_per_scan
    total_s = round(settings.set_up_s + (scan_s or 0.0))
    return f"{total_s // 60}:{total_s % 60:02d}" + (" + scan" if scan_s is None else "")


# ------------------------------------------------------------------------------------------------ unseen
def unseen_section(plan: Plan) -> str:
    """What stays unseen: by reason, and the largest surfaces of each; by element where the plan does not say why."""
    return _unseen_by_element(plan) if plan.why is None else "\n".join(_unseen_by_reason(plan, plan.why))


def _unseen_by_reason(plan: Plan, why: Why) -> Iterator[str]:
    total_m2 = sum(why.area_by_reason_m2)
    areas = [(REASONS[k], area) for k, area in enumerate(why.area_by_reason_m2) if k != COVERED and area > 0]
    covered_m2 = why.area_by_reason_m2[COVERED]
    rows = [("<b>covered</b>", "", *_area_and_share(covered_m2, total_m2))]
    rows += [
        (escape(reason_in_words(reason)), REASON_TEXTS[reason], *_area_and_share(area, total_m2))
        for reason, area in areas
    ]
    yield table(("", "What it means", "Area, m²", "Of all"), rows, numbers_from=2)
    for reason, _ in areas:
        largest = [s for s in why.unseen if s.reason == reason and s.area_m2 >= _SLIVER_M2]
        if largest and reason != REASONS[IN_SOLIDS]:
            yield f"<h3>{escape(reason_in_words(reason).capitalize())}</h3>"
            yield _surfaces_table(plan, largest)


def _area_and_share(area_m2: float, total_m2: float) -> tuple[str, str]:
    return f"{area_m2:.1f}", f"{100 * area_m2 / total_m2:.1f} %" if total_m2 > 0 else ""


def _surfaces_table(plan: Plan, surfaces: list[UnseenSurface]) -> str:
    scene = plan.survey.scene
    with_position = any(surface.best_position is not None for surface in surfaces)
    header = (
        "Surface",
        "Kind",
        *(("Room",) if scene.rooms else ()),
        "Floor",
        *(("Best position, sees",) if with_position else ()),
    )
    n_texts = len(header)
    header += ("Area, m²", "Pieces", "Largest, m²", "at x, m", "y, m", "z, m")
    rows = []
    for surface in surfaces[:MAX_SURFACES_A_REASON]:
        piece = surface.pieces[0]
        room = (escape(scene.rooms[surface.room].title) if surface.room >= 0 else "",) if scene.rooms else ()
        rows.append(
            (
                _element_name(scene, surface.element),
                escape(scene.elements[surface.element].kind),
                *room,
                escape(surface.floor),
                *((_position_text(scene, surface),) if with_position else ()),
                f"{surface.area_m2:.2f}",
                str(surface.n_pieces),
                f"{piece.area_m2:.2f}",
                *_coordinates(piece.centroid_m + scene.offset_m, 2),
            )
        )
    more_m2 = sum(surface.area_m2 for surface in surfaces[MAX_SURFACES_A_REASON:])
    n_more = len(surfaces) - MAX_SURFACES_A_REASON
    text = table(header, rows, numbers_from=n_texts)
    return text + (f"\n<p>{n_more} more of {more_m2:.1f} m² in unseen_surfaces.csv.</p>" if n_more > 0 else "")


def _position_text(scene: Scene, surface: UnseenSurface) -> str:
    spot = surface.best_position
    if spot is None:
        return ""
    at = ", ".join(_coordinates(spot.position_m + scene.offset_m, 2))
    return f"({at}): {spot.sees_m2:.2f} m², in all {spot.adds_m2:.2f} m²"


def _unseen_by_element(plan: Plan) -> str:
    largest = sorted(plan.unseen, key=lambda part: (-part.unseen_area_m2, part.element, part.floor))
    elements = plan.survey.scene.elements
    rows = (
        (
            _element_name(plan.survey.scene, part.element),
            escape(elements[part.element].kind),
            escape(part.floor),
            f"{part.unseen_area_m2:.2f}",
            f"{part.achievable_area_m2:.2f}",
        )
        for part in largest[:MAX_UNSEEN_ON_PAGE]
    )
    if not largest:
        return "<p>All scannable surface is seen.</p>"
    text = table(("Element", "Kind", "Floor", "Unseen, m²", "Scannable, m²"), rows, numbers_from=3)
    n_more = len(largest) - MAX_UNSEEN_ON_PAGE
    return text + (f"\n<p>{n_more} more in unseen.csv.</p>" if n_more > 0 else "")


# --------------------------------------------------------------------------------------------------- CSV
def unseen_csv(plan: Plan) -> str:
    """Return the text of unseen.csv: achievable surface that the plan leaves unseen, element by element."""
    rows = []
    for part in plan.unseen:
        element = plan.survey.scene.elements[part.element]
        areas = (f"{part.unseen_area_m2:.3f}", f"{part.achievable_area_m2:.3f}")
        name = plan.survey.scene.label(part.element)
        rows.append((part.element, name, element.kind, element.source_id, part.floor, *areas))
    return _csv(UNSEEN_COLUMNS, rows)


def unseen_surfaces_csv(plan: Plan, why: Why) -> str:
    """Return the text of unseen_surfaces.csv: all that is not covered, by element, room, floor and reason."""
    scene = plan.survey.scene
    rows = []
    for surface in why.unseen:
        element, piece, spot = scene.elements[surface.element], surface.pieces[0], surface.best_position
        best: tuple[str, ...] = ("",) * 4
        if spot is not None:
            best = (*_coordinates(spot.position_m + scene.offset_m), f"{spot.adds_m2:.3f}")
        rows.append(
            (
                surface.element,
                scene.label(surface.element),
                element.kind,
                element.source_id,
                scene.rooms[surface.room].title if surface.room >= 0 else "",
                surface.floor,
                surface.reason,
                f"{surface.area_m2:.4f}",
                surface.n_pieces,
                f"{piece.area_m2:.4f}",
                *_coordinates(piece.centroid_m + scene.offset_m),
                *best,
            )
        )
    return _csv(SURFACE_COLUMNS, rows)


def _csv(header: tuple[str, ...], rows: Iterable[tuple[object, ...]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def _element_name(scene: Scene, element: int) -> str:
    """Break long names where a browser may: Revit's have no blanks."""
    return escape(scene.label(element)).replace(":", ":<wbr>").replace("_", "_<wbr>")


def _in_room(scene: Scene, room: int) -> str:
    return f" in {escape(scene.rooms[room].title)}" if room >= 0 else ""


def _coordinates(position_m: FloatArray, digits: int = 3) -> tuple[str, ...]:
    return tuple(f"{value:.{digits}f}" for value in position_m)
