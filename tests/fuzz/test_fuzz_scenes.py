"""The witness of the campaign of damaged scenes: a few changes of every format, and faults would be seen."""

from pathlib import Path

import pytest

from planner_core.errors import PlannerError
from tests.fuzz import fuzz_scenes as fuzz


@pytest.mark.slow
def test_changed_scenes_are_read_or_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert fuzz.main(["--count", "40", "--first", "1000", "--minutes", "600", "--seed", "20"]) == 0
    assert capsys.readouterr().out.endswith("\n0 faults\n")


@pytest.mark.parametrize(("script", "limit_s", "outcome"), [("read line; exit 3", 200, "crash"), ("cat", 0.2, "hang")])
def test_a_process_that_ends_or_hangs_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, limit_s: float, outcome: str
) -> None:
    interpreter = tmp_path / "python"
    interpreter.write_text(f"#!/bin/sh\n{script} >/dev/null\n")
    interpreter.chmod(0o755)
    monkeypatch.setattr(fuzz.sys, "executable", str(interpreter))
    monkeypatch.setattr(fuzz, "HANGS_AFTER_S", limit_s)
    loader = fuzz.Loader()
    assert loader.load(tmp_path / "scene.obj", skip_bad_faces=False).outcome == outcome
    loader.close()


class TwoLinesError(PlannerError):
    def __str__(self) -> str:
        return "one\ntwo"


@pytest.mark.parametrize("error", [KeyError("x"), TwoLinesError()], ids=repr)
def test_an_error_that_is_no_line_for_the_user_is_seen(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(fuzz, "load_scene", fail)
    assert fuzz._loaded(Path("scene.obj"), False)[0] == "internal error"
