"""Drawings are read in this process: a child would take most of the time of these tests."""

from importlib import import_module

import pytest

from planner_core import child_process


@pytest.fixture(autouse=True)
def drawings_read_here(request, monkeypatch):
    """Call readers of drawings as functions, but in tests with `in_child` in their names."""
    if "in_child" in request.node.name:
        return
    isolated = child_process.run_isolated

    def run(function, arguments, **options):
        module, _, name = function.partition(":")
        if module.startswith("planner_core.drawings."):
            return getattr(import_module(module), name)(**arguments)
        return isolated(function, arguments, **options)

    monkeypatch.setattr(child_process, "run_isolated", run)
