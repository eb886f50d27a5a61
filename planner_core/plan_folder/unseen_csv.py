"""All that stays unseen as CSV: by element, and by surface with its reason. Plan -> text, scene frame, metres.

The report and sheets list the largest alone.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

from planner_core.model import FloatArray, Plan, Why

UNSEEN_COLUMNS = ("element", "name", "kind", "source_id", "floor", "unseen_area_m2", "achievable_area_m2")
SURFACE_COLUMNS = (
    "element", "name", "kind", "source_id", "room", "floor", "reason", "area_m2", "n_pieces", "largest_piece_m2",
    "x_m", "y_m", "z_m", "best_x_m", "best_y_m", "best_z_m", "best_adds_m2",
)  # fmt: skip


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


def _coordinates(position_m: FloatArray) -> tuple[str, ...]:
    return tuple(f"{value:.3f}" for value in position_m)
