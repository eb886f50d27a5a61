"""JSON Schemas in docs/formats: those that `make docs` makes of the models."""

import json
from pathlib import Path

import jsonschema
import pytest
from tlsplan.document_schemas import schema_texts

FORMATS = Path(__file__).resolve().parents[2] / "docs" / "formats"
TEXTS = schema_texts()


@pytest.mark.parametrize(("name", "text"), TEXTS.items(), ids=TEXTS)
def test_committed_schema_is_what_its_model_generates(name: str, text: str) -> None:
    assert (FORMATS / name).read_text(encoding="utf-8") == text, "run `make docs`"


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_schemas_are_ones(text: str) -> None:
    jsonschema.Draft202012Validator.check_schema(json.loads(text))


def test_every_schema_of_the_documentation_is_generated() -> None:
    assert {file.name for file in FORMATS.glob("*.schema.json")} == set(TEXTS)
