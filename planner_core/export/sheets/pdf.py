"""Format `pdf`: the sheets of a plan to print, to scale. PlanSource -> PDF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from planner_core.export.options import Options
from planner_core.export.sheets.sheet_set import Contents, Page, gather, pages_of
from planner_core.plan_folder.drawing.pdf_canvas import PdfBook
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import Progress, ProgressEvent

STAGE = "sheets"


def write_pdf(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the sheets into the file `path`; remarks say what could not be shown.

    Raises
    ------
    RequirementError, ExportError, MissingPackageError
        See `planner_core.export.sheets.sheet_set.gather`.
    """
    progress(ProgressEvent(STAGE, 0, 0, "reading the plan folder"))
    contents = gather(plan, options)
    pages = pages_of(contents, options.paper)
    _write(contents, pages, path, progress)
    progress(ProgressEvent(STAGE, len(pages), len(pages)))
    return contents.remarks


def _write(contents: Contents, pages: Sequence[Page], path: Path, progress: Progress) -> None:
    plan = contents.plan
    floors = f": {', '.join(floor.name for floor in contents.part)}" if contents.part else ""
    book = PdfBook(path, title=f"Scan plan of {plan.title}{floors}", subject=f"Coordinates: {plan.frame.crs_line}")
    for number, page in enumerate(pages, start=1):
        progress(ProgressEvent(STAGE, number - 1, len(pages), page.title))
        page.draw(
            book.page(page.sheet.width_mm, page.sheet.height_mm, title=page.title, zoom=page.zoom), number, len(pages)
        )
        book.turn()
    book.close()
