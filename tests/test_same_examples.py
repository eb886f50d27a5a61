"""Hypothesis asks the same examples whatever a worker has loaded before: how tests are dealt out changes none."""

import importlib.util
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st


def drawn() -> list[str]:
    seen = []

    @settings(max_examples=200)
    @given(st.floats() | st.integers())
    def draw(value: float) -> None:
        seen.append(repr(value))

    draw()
    return seen


def test_examples_are_the_same_whatever_is_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = drawn()
    module = tmp_path / "numbers_of_ours.py"
    module.write_text("NUMBERS = " + repr([*(1000.5 + n for n in range(99)), *range(7000, 7099)]))
    spec = importlib.util.spec_from_file_location(module.stem, module)
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    monkeypatch.setitem(sys.modules, module.stem, loaded)
    assert drawn() == before
