"""Progress on a stream that is no terminal, and silence."""

import io

from tlsplan.progress import ProgressReporter

from planner_core.progress import ProgressEvent


def shown(events: list[ProgressEvent], *, quiet: bool = False) -> list[str]:
    stream = io.StringIO()
    with ProgressReporter(quiet=quiet, stream=stream) as reporter:
        for event in events:
            reporter.show(event)
    return stream.getvalue().splitlines()


def test_plain_progress_shows_the_first_and_the_last_event_of_a_stage() -> None:
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
