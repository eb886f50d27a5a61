"""JSON Schemas of documents, generated from their models: `python -m tlsplan.document_schemas FOLDER` writes them."""

from __future__ import annotations

import sys
from pathlib import Path

from pydantic import BaseModel

from planner_core.documents import schema_text
from planner_core.drawings.drawn_building import DrawnBuilding
from planner_core.plan_folder.plan_model.document import PlanDocument
from planner_core.requirements.entries import RequirementsFile
from planner_core.scanner.scanner_file import ScannerFile

from .batch.sites_file import SitesFile

#: By the name of the document, of which the file is NAME.schema.json.
MODELS: dict[str, type[BaseModel]] = {
    "requirements": RequirementsFile,
    "scanner": ScannerFile,
    "plan": PlanDocument,
    "sites": SitesFile,
    "drawing": DrawnBuilding,
}


def schema_texts() -> dict[str, str]:
    """Return the text of each file, by its name."""
    return {f"{name}.schema.json": schema_text(model, f"tlsplan:{name}:1") for name, model in MODELS.items()}


if __name__ == "__main__":
    for name, text in schema_texts().items():
        (Path(sys.argv[1]) / name).write_text(text, encoding="utf-8")
