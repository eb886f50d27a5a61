"""Formats made of a damaged plan.json: written, or refused in one line; nothing else ever comes out."""

import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from small_pictures import draw_small

from planner_core.errors import LONGEST_LINE, PlannerError
from planner_core.export.write import export_plan
from planner_core.plan_folder.plan_source import open_plan

SOME_FORMATS = ("html", "pdf", "dxf", "csv", "landxml", "geojson", "bcf", "ifc", "usd-stations")
NUMBERS = (0, -1, 1e-9, 1e9, 1e300, -1e300, 5e-324, 10**30, None, "x")
TEXTS = ("", "\x1b[2J\x00", "two\nlines\r\n", "<b>&amp;]]>", "x" * 20_000, "../../x", "\u202e日本", 5, None)
OTHERS = (None, True, [], {}, [[]], [None], "x", -1)


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every list or mapping with a key of it, those of long lists once in a while."""
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in list(keys)[:5]:
        yield value, key
        yield from places(value[key])


def damaged(document: Any, chance: random.Random) -> str:
    for _ in range(chance.choice((1, 1, 2))):
        holder, key = chance.choice(list(places(document)))
        value = holder[key]
        if chance.random() < 0.1:
            del holder[key]
        elif isinstance(value, bool) or value is None or isinstance(value, list | dict):
            holder[key] = chance.choice(OTHERS)
        else:
            holder[key] = chance.choice(TEXTS if isinstance(value, str) else NUMBERS)
    text = json.dumps(document)
    return text[: chance.randrange(len(text))] if chance.random() < 0.05 else text


def n_exported(name: str, folder: Path, damages: range, monkeypatch: pytest.MonkeyPatch) -> int:
    """Number of damaged plans that become a file; the others are refused in one line."""
    draw_small(monkeypatch)
    file = folder / "plan" / "plan.json"
    whole = file.read_text(encoding="utf-8")
    n_written = 0
    for number in damages:
        file.write_text(damaged(json.loads(whole), random.Random(number)), encoding="utf-8")
        try:
            export_plan(name, file.parent, folder / f"{number}.{name}")
        except PlannerError as refused:
            assert "\n" not in str(refused), (name, number)
            assert len(str(refused)) <= LONGEST_LINE, (name, number)
        else:
            n_written += 1
    file.write_text(whole, encoding="utf-8")
    return n_written


@pytest.mark.slow
def test_damaged_plans_are_exported_or_refused_in_one_line(box_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Six damages of its own for each format."""
    n_written = [
        n_exported(name, box_folder, range(6 * at, 6 * at + 6), monkeypatch) for at, name in enumerate(SOME_FORMATS)
    ]
    assert 0 < sum(n_written) < 6 * len(SOME_FORMATS)


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME_FORMATS)
def test_every_format_meets_every_damage(box_folder: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    assert 0 < n_exported(name, box_folder, range(25), monkeypatch) < 25


def test_names_with_line_ends_are_one_line_in_every_format(box_folder: Path) -> None:
    file = box_folder / "plan" / "plan.json"
    document = json.loads(file.read_text(encoding="utf-8"))
    document["floors"][0]["name"] = "Level\n1 \x1b[2J"
    file.write_text(json.dumps(document), encoding="utf-8")
    assert open_plan(file.parent).floors[0].name == r"Level 1 \x1b[2J"
    export_plan("dxf", file.parent, file.parent / "x.dxf")
    assert b"Level 1" in (file.parent / "x.dxf").read_bytes()
