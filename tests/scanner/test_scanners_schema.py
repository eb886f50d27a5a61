"""docs/formats/scanner.schema.json: every file that comes along and every example fits it, and bad ones do not."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from planner_core.errors import RequirementError
from planner_core.scanner.load_scanner import load_scanner

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "planner_core" / "scanner").glob("*.json"))
EXAMPLES = [
    part.split("```")[0]
    for part in (ROOT / "docs" / "formats" / "scanner.md").read_text(encoding="utf-8").split("```json")[1:]
]


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    schema = json.loads((ROOT / "docs" / "formats" / "scanner.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_file_fits_the_schema_and_bears_its_scanners_name(
    file: Path, validator: jsonschema.Draft202012Validator
) -> None:
    spec = json.loads(file.read_text(encoding="utf-8"))
    validator.validate(spec)
    assert spec["name"] == file.stem


@pytest.mark.parametrize("text", EXAMPLES)
def test_every_example_fits_the_schema_and_is_read(
    text: str, validator: jsonschema.Draft202012Validator, tmp_path: Path
) -> None:
    validator.validate(json.loads(text))
    (tmp_path / "example.json").write_text(text, encoding="utf-8")
    assert load_scanner(tmp_path / "example.json").n_beams > 1_000_000


RTC360: dict[str, Any] = json.loads((ROOT / "planner_core" / "scanner" / "rtc360.json").read_text(encoding="utf-8"))
HDL: dict[str, Any] = json.loads((ROOT / "planner_core" / "scanner" / "hdl-64e.json").read_text(encoding="utf-8"))
CHANGES: list[tuple[dict[str, Any], dict[str, Any]]] = [
    (RTC360, {"colour": "red"}),
    (RTC360, {"n_azimuths": 8}),
    (RTC360, {"azimuth_deg": {"step": 1}}),
    (RTC360, {"azimuth_offset_deg": [1]}),
    (RTC360, {"modes": []}),
    (RTC360, {"modes": [{"id": "a", "title": "a"}]}),
    (RTC360, {"modes": [{"id": "a", "title": "a", "step_deg": 1, "spacing_at_10m_mm": 6}]}),
    (RTC360, {"modes": [{"id": "A", "title": "a", "step_deg": 1}]}),
    (RTC360, {"modes": [{"id": "a", "title": "a", "step_deg": 0}]}),
    (RTC360, {"elevation_deg": {"first": 90, "last": -60, "step": 1}}),
    (RTC360, {"elevation_deg": [1, 0]}),
    (RTC360, {"elevation_deg": {"first": 91, "last": -60}}),
    (RTC360, {"source": " "}),
    (RTC360, {"source": None}),
    (RTC360, {"range_noise": [{"range_m": 10, "reflectivity": 2, "sigma_mm": 1}]}),
    (RTC360, {"beam_width_at": "half"}),
    (RTC360, {"ranging_accuracy": {"ppm": 1}}),
    (RTC360, {"mounting": "sideways"}),
    (RTC360, {"instrument_height_max_m": 0}),
    (HDL, {"default_mode": "fast"}),
    (HDL, {"azimuth_deg": {"step": 1}}),
    (HDL, {"n_azimuths": None}),
    (HDL, {"n_azimuths": 1.5}),
    (HDL, {"elevation_deg": {"first": 90, "last": -60}}),
    (HDL, {"elevation_deg": []}),
    (HDL, {"channel_modes": [{"id": "a", "title": "a"}]}),
    (HDL, {"channel_modes": [{"id": "A", "title": "a", "elevation_deg": [1, 0]}]}),
    (HDL, {"channel_modes": [{"id": "a", "title": "a", "elevation_deg": []}]}),
    (HDL, {"n_azimuths": None, "azimuth_deg": {"step": 1}}),
    (RTC360, {"channel_modes": [{"id": "a", "title": "a", "elevation_deg": [1, 0]}]}),
]


@pytest.mark.parametrize(("spec", "change"), CHANGES)
def test_what_the_schema_refuses_reading_refuses_too(
    spec: dict[str, Any], change: dict[str, Any], validator: jsonschema.Draft202012Validator, tmp_path: Path
) -> None:
    changed = {key: value for key, value in {**spec, **change}.items() if value is not None}
    assert not validator.is_valid(changed)
    (tmp_path / "bad.json").write_text(json.dumps(changed), encoding="utf-8")
    with pytest.raises(RequirementError):
        load_scanner(tmp_path / "bad.json")
