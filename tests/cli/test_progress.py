"""Progress on a stream that is no terminal, and silence."""

import contextlib
import io

import pytest
from tlsplan import progress
from tlsplan.progress import ProgressReporter

from planner_core.progress import ProgressEvent


def shown(events: list[ProgressEvent], *, quiet: bool = False) -> list[str]:
    stream = io.StringIO()
    with ProgressReporter(quiet=quiet, stream=stream) as reporter:
        for event in events:
            reporter.show(event)
    return stream.getvalue().splitlines()


def test_plain_progress_shows_the_first_and_the_last_event_of_a_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "PLAIN_LINE_EVERY_S", float("inf"))
    events = [ProgressEvent("scan", done, 100) for done in range(101)]
    assert shown(events) == ["scan: 0 of 100", "scan: 100 of 100"]


def test_plain_progress_does_not_repeat_the_end_of_a_stage() -> None:
    assert shown([ProgressEvent("load", 1, 1), ProgressEvent("load", 1, 1)]) == ["load: 1 of 1"]


def test_plain_progress_shows_notes_and_unknown_totals() -> None:
    assert shown([ProgressEvent("load", 0, 0, "reading a.ifc")]) == ["load: ...  reading a.ifc"]


def test_quiet_shows_nothing() -> None:
    assert shown([ProgressEvent("scan", 1, 1)], quiet=True) == []


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_terminal_progress_draws_a_bar_with_the_stage_and_the_count() -> None:
    stream = Terminal()
    with ProgressReporter(quiet=False, stream=stream) as reporter:
        reporter.show(ProgressEvent("scan", 3, 7))
        reporter.show(ProgressEvent("scan", 7, 7))
    assert "scan" in stream.getvalue()
    assert "7/7" in stream.getvalue()


def test_warnings_are_shown_at_once_and_each_once_even_when_quiet() -> None:
    stream = io.StringIO()
    with ProgressReporter(quiet=True, stream=stream) as reporter:
        reporter.warn(["far origin", "no slab"])
        reporter.warn(["no slab"])
        assert stream.getvalue().splitlines() == ["warning: far origin", "warning: no slab"]


def test_last_words_are_shown_when_all_is_over_even_of_what_fails() -> None:
    stream = io.StringIO()
    with contextlib.suppress(ValueError), ProgressReporter(quiet=True, stream=stream) as reporter:
        reporter.warn_last(["struck twice"])
        reporter.warn(["no slab"])
        assert stream.getvalue().splitlines() == ["warning: no slab"]
        raise ValueError
    assert stream.getvalue().splitlines() == ["warning: no slab", "warning: struck twice"]


def test_terminal_progress_of_common_width_shows_the_count_beside_a_long_remark(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    stream = Terminal()
    with ProgressReporter(quiet=False, stream=stream) as reporter:
        reporter.show(ProgressEvent("engine", 1, 1, "opencl: pthread-AMD EPYC (Portable Computing Language)"))
        reporter.show(ProgressEvent("candidates", 1234, 5678, "Level 1"))
    last = [line for line in stream.getvalue().splitlines() if "candidates" in line][-1]
    assert "1234/5678" in last
    assert "Level 1" in last
