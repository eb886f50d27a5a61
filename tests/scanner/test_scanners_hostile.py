"""Scanner files that nobody would write: whatever they hold, a scanner comes of it or one line that says why not."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.scanner.load_scanner import MAX_BEAMS, load_scanner, scan_modes
from planner_core.scanner.template import make_template

FOLDER = Path(__file__).resolve().parents[2] / "planner_core" / "scanner"
SPECS: list[dict[str, Any]] = [
    json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8")) for name in ("rtc360", "pandar64", "imager-5016")
]
KEYS = sorted({key for spec in SPECS for key in spec} | {"azimuth_deg", "mounting", "range_noise", "beam_diameter_mm"})
NUMBERS = st.one_of(
    st.integers(-(10**25), 10**25), st.floats(), st.sampled_from([0, -0.0, 5e-324, 1e308, 90, -90, 360])
)
WORDS = st.one_of(
    st.text(max_size=30), st.sampled_from(["first", "last", "step", "count", "id", "title", "6mm", "low"])
)
JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, WORDS),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(WORDS, inner, max_size=4)),
    max_leaves=12,
)


def check(path: Path, asked: str) -> None:
    """Read the file: a scanner with a template of sound beams, or one short line."""
    try:
        scan_modes(path)
        scanner = load_scanner(asked)
    except RequirementError as error:
        assert len(str(error).splitlines()) == 1
        assert len(str(error)) < 1000
        return
    assert 1 <= scanner.n_beams <= MAX_BEAMS
    template = make_template(scanner)
    assert np.isfinite(template.elevation_rad).all()
    assert np.isfinite(template.azimuth_rad).all()


@pytest.mark.slow
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(spec=st.sampled_from(SPECS), key=st.sampled_from(KEYS), value=JSON)
def test_any_value_of_any_key_is_read_or_refused_in_one_line(
    tmp_path: Path, spec: dict[str, Any], key: str, value: Any
) -> None:
    path = tmp_path / "any.json"
    path.write_text(json.dumps({**spec, key: value}), encoding="utf-8")
    check(path, str(path))


@pytest.mark.slow
@settings(max_examples=75, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(key=st.sampled_from(["id", "title", "seconds", "spacing_at_10m_mm", "step_deg", "azimuth_step_deg"]), value=JSON)
def test_any_value_in_a_mode_is_read_or_refused_in_one_line(tmp_path: Path, key: str, value: Any) -> None:
    path = tmp_path / "any.json"
    mode = {"id": "low", "title": "12 mm at 10 m", "spacing_at_10m_mm": 12, key: value}
    path.write_text(json.dumps({**SPECS[0], "modes": [mode], "default_mode": "low"}), encoding="utf-8")
    check(path, str(path))


@pytest.mark.slow
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(asked=st.text(max_size=40))
def test_any_mode_asked_for_is_taken_or_refused_in_one_line(asked: str) -> None:
    check(FOLDER / "rtc360.json", f"rtc360:{asked}")


@pytest.mark.parametrize("name", ["two\nlines.json", "two\nlines", "\ud800.json", "tab\t.json:fast", "\x00:6mm"])
def test_a_path_of_odd_characters_is_answered_in_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(RequirementError) as refused:
        load_scanner(f"{tmp_path}/{name}")
    message = str(refused.value)
    assert len(message.splitlines()) == 1
    assert message.isprintable()


def test_a_file_of_two_lines_name_is_read_and_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "two\nlines.json"
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(RequirementError, match=r"two\?lines.json: got no name"):
        load_scanner(path)
