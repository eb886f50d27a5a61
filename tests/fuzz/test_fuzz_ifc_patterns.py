"""The witness of the campaign of IFC patterns: every pattern a few times, and a silent difference would be seen."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from pathlib import Path

import ifcopenshell
import pytest

from tests.fuzz import fuzz_ifc_patterns as fuzz
from tests.fuzz.ifc_facts import Facts, facts_of, write_house
from tests.scene.conftest import native_readers_here


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Facts]:
    path = tmp_path_factory.mktemp("sound") / "sound.ifc"
    write_house(path, random.Random("two storeys"))
    with native_readers_here():
        return path, facts_of(path)


@pytest.mark.slow
def test_patterns_change_nothing_in_silence(capsys: pytest.CaptureFixture[str]) -> None:
    count = 3 * len(fuzz.PATTERNS)
    assert fuzz.main(["--count", str(count), "--first", "5000", "--minutes", "60", "--seed", "20"]) == 0
    out = capsys.readouterr().out
    assert out.endswith("\n0 faults\n")
    for name in fuzz.PATTERNS:
        outcomes = re.search(rf"^{name} .*\{{(.+)\}}$", out, re.MULTILINE)
        assert outcomes and re.search("sound|warned|refused", outcomes[1]), f"{name} was not applied: {out}"


def test_rooms_that_nobody_brings_back_are_a_fault(
    sound: tuple[Path, Facts], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pattern, path = fuzz.PATTERNS["rooms a storey off"], tmp_path / "changed.ifc"
    model = ifcopenshell.open(sound[0])
    assert pattern.change(model, random.Random(1))
    model.write(str(path))
    with native_readers_here():
        assert fuzz.tried(pattern, sound[1], path).outcome == "as sound"
        monkeypatch.setattr("planner_core.scene.rooms._on_their_storeys", lambda scene: scene)
        found = fuzz.tried(pattern, sound[1], path)
    assert found.outcome == "silent"
    assert "rooms (4 of 4" in found.detail


def test_each_fact_that_differs_is_named(sound: tuple[Path, Facts]) -> None:
    facts = sound[1]
    assert facts.differences(facts) == []
    (height_m, area_m2), *others = facts.floors
    guid = next(iter(facts.surfaces))
    for name, other in {
        "floors": replace(facts, floors=((height_m + 0.05, area_m2), *others)),
        "floors ": replace(facts, floors=((height_m, 1.05 * area_m2), *others)),
        "floors  ": replace(facts, floors=tuple(others)),
        "rooms": replace(facts, rooms={}),
        "surfaces": replace(facts, surfaces=facts.surfaces | {guid: (1.0, -1.0)}),
        "place": replace(facts, place=(0.0, 0.0)),
    }.items():
        (line,) = other.differences(facts)
        assert line.startswith(name.strip())
