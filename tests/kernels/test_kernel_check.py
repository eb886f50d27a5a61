"""The witness of `make kernel-check`: one run of it under oclgrind, and one without; and faults would be seen."""

import shutil
import sys
from pathlib import Path
from types import ModuleType

import pytest

from planner_core.device import Device


@pytest.fixture(scope="module")
def check() -> ModuleType:
    sys.path.insert(0, str(Path(__file__).parent))
    import check_kernels

    sys.path.remove(str(Path(__file__).parent))
    return check_kernels


@pytest.mark.slow  # `make test-slow` alone installs oclgrind
@pytest.mark.skipif(shutil.which("oclgrind") is None, reason="oclgrind is not installed")
def test_kernels_neither_race_nor_leave_their_memory_and_those_that_do_are_reported(
    check: ModuleType, tmp_path: Path
) -> None:
    found = check.run(["cpu"], flags=(check.RACES,), folder=tmp_path)
    assert found.report == ""
    assert check.all_kernels() - found.kernels == set()
    assert check.missed_faults(tmp_path) == []


@pytest.mark.slow
def test_unwritten_memory_and_the_shape_of_tiles_do_not_reach_the_results(
    check: ModuleType, device: Device, tmp_path: Path
) -> None:
    plain = check.run(["cpu"], flags=None, folder=tmp_path)
    assert plain.report == ""
    assert check.all_kernels() - plain.kernels == set()
    assert check.run(["gpu", "--poison", "0xff"], flags=None, folder=tmp_path).results == plain.results


@pytest.mark.slow
def test_a_program_that_ends_badly_is_a_report(check: ModuleType, tmp_path: Path) -> None:
    found = check.run(["no-such-form"], flags=None, folder=tmp_path)
    assert "ended with 2" in found.report


def test_a_kernel_that_nobody_launches_is_named(
    check: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(check.shutil, "which", lambda _: "/usr/bin/oclgrind")
    monkeypatch.setattr(check, "missed_faults", lambda _: [])
    monkeypatch.setattr(check, "run", lambda *_, **__: check.Run(frozenset({"scan_tiles"}), "same", ""))
    assert check.main() == 1
    said = capsys.readouterr().out
    assert "never launched" in said
    assert "cast_rays" in said
    monkeypatch.setattr(check, "all_kernels", lambda: frozenset({"scan_tiles"}))
    assert check.main() == 0
    answers = iter("ab" * 20)
    monkeypatch.setattr(check, "run", lambda *_, **__: check.Run(frozenset({"scan_tiles"}), next(answers), ""))
    assert check.main() == 1
    assert "results differ" in capsys.readouterr().out
