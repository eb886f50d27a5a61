"""Modules that `plan` imports while a child process reads its file."""

import sys
from importlib import import_module

import pytest
from tlsplan import inputs
from tlsplan.commands.plan import _NEEDED_LATER

from planner_core.progress import ProgressEvent


def test_each_step_of_a_child_imports_the_next_module_and_what_is_missing_is_left_to_who_needs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "this", raising=False)
    monkeypatch.setattr("builtins.print", lambda *_: None)  # which `this` does
    seen: list[ProgressEvent] = []
    show = inputs._importing(seen.append, ["no_such_module", "this"])
    events = [ProgressEvent("load", 0, 0), ProgressEvent("load", 1, 9), ProgressEvent("load", 2, 9)]
    for event, is_imported in zip([*events, events[-1]], (False, False, True, True), strict=True):
        show(event)
        assert ("this" in sys.modules) == is_imported
    assert seen == [*events, events[-1]]


def test_all_that_plan_imports_ahead_is_there() -> None:
    for name in _NEEDED_LATER:
        module, _, function = name.partition(":")
        assert not function or callable(getattr(import_module(module), function))
