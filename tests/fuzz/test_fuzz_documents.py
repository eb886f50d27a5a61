"""What campaigns of damaged documents found stays mended, and a campaign sees what it looks for."""

import argparse
from pathlib import Path

import pytest

from planner_core.errors import RequirementError
from tests.fuzz import fuzz_documents as fuzz


def campaign(folder: Path, count: int, seed: int) -> tuple[int, list[str]]:
    told = argparse.Namespace(seed=seed, first=0, count=count, minutes=60.0, kinds="", keep="")
    counts, faults = fuzz.campaign(told, folder)
    return sum(counts.values()), faults


@pytest.mark.parametrize("name", fuzz.KNOWN)
def test_what_was_found_is_read_or_refused_in_one_line(tmp_path: Path, name: str) -> None:
    kind, file, contents = fuzz.KNOWN[name]
    path = tmp_path / file
    path.write_bytes(contents)
    assert fuzz.tried(fuzz.kinds()[kind], path).outcome in ("read", "refused")


def test_sound_documents_are_read(tmp_path: Path) -> None:
    for name, kind in fuzz.kinds().items():
        for base, contents in kind.sound:
            path = tmp_path / name / base
            fuzz._plan_at(path, contents)
            assert fuzz.tried(kind, path) == fuzz.Result("read", ""), (name, base)


def test_changed_documents_are_read_or_refused_in_one_line(tmp_path: Path) -> None:
    assert campaign(tmp_path, 60, seed=20) == (60, [])


@pytest.mark.slow
def test_a_thousand_changed_documents_are_read_or_refused_in_one_line(tmp_path: Path) -> None:
    assert campaign(tmp_path, 1000, seed=21) == (1000, [])


def fail(path: Path) -> None:
    raise KeyError(path.name)


def refuse_in_two_lines(path: Path) -> None:
    class TwoLinesError(RequirementError):
        def __str__(self) -> str:
            return "one\ntwo"

    raise TwoLinesError


def hang(path: Path) -> None:
    try:
        while True:
            pass
    except Exception:  # noqa: BLE001 (as code under test may do)
        return


@pytest.mark.slow
@pytest.mark.parametrize(
    ("read", "outcome", "detail"),
    [
        (fail, "internal error", "KeyError: 'x'"),
        (refuse_in_two_lines, "internal error", "odd message"),
        (hang, "hang", "takes more than"),
    ],
)
def test_faults_are_seen(monkeypatch: pytest.MonkeyPatch, read: object, outcome: str, detail: str) -> None:
    monkeypatch.setattr(fuzz, "HANGS_AFTER_S", 0.2)
    result = fuzz.tried(fuzz.Kind((), read), Path("x"))
    assert result.outcome == outcome
    assert detail in result.detail
