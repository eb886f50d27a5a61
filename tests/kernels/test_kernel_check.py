"""`make kernel-check` itself: it sees faults, and no kernel escapes it. The whole of it takes a minute and oclgrind."""

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


@pytest.mark.slow  # as `make test-slow` alone installs oclgrind
@pytest.mark.skipif(shutil.which("oclgrind") is None, reason="oclgrind is not installed; `make kernel-check` does it")
def test_the_checker_reports_an_access_out_of_bounds_a_race_and_an_uninitialised_value(
    check: ModuleType, tmp_path: Path
) -> None:
    assert check.missed_faults(tmp_path) == []


@pytest.mark.slow
def test_all_kernels_are_exercised_and_unwritten_memory_does_not_reach_the_results(
    check: ModuleType, device: Device, tmp_path: Path
) -> None:
    plain = check.run(["cpu"], flags=None, folder=tmp_path)
    assert plain.report == ""
    assert check.all_kernels() - plain.kernels == set()
    widest = [["cpu-16", "--poison", "0xff"]] if device.max_lanes >= 16 else []
    for arguments in (["cpu", "--poison", "0xff"], ["cpu-4"], *widest, ["gpu", "--poison", "0xff"]):
        assert check.run(arguments, flags=None, folder=tmp_path).results == plain.results, arguments


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
