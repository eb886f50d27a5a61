"""Small inputs with known right answers, in ../shared/data/reality; tests skip where the folder is missing."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "reality"


def reality(name: str) -> Path:
    """Return the path of one of the files."""
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(f"{name} is not beside the repository (../shared/data/reality)")
    return path
