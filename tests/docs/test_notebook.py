"""The page on Python: its code runs, as it stands but for the time of the search, on a small building."""

import re
from pathlib import Path

import pytest
from small_pictures import draw_blank

import scenes_synthetic
from planner_core.model import Proven

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "notebook.md"


def test_the_code_of_the_page_plans_writes_exports_and_evaluates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.S)
    scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / "building.ifc")
    monkeypatch.chdir(tmp_path)
    draw_blank(monkeypatch)
    quick = code.replace("grid_step_m=1.0)", "grid_step_m=1.0, method=Proven(work_limit=0.1))")
    assert quick != code
    exec(compile(quick, str(PAGE), "exec"), {"Proven": Proven})
    ours, theirs = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"\d+ stations \(lower bound \d+\), [\d.]+ % of \d+ m2 scannable, connected", ours)
    assert theirs.startswith("2 stations")
    assert (tmp_path / "building-plan" / "plan.json").is_file()
    assert {path.name for path in (tmp_path / "field-pack").iterdir()} >= {"stations.csv", "drawing.dxf"}
