"""pytest plugin of `tests.mutants`: which tests run which broken lines, and what each test costs.

`hit` stands before each statement that will be broken. Lines of one process go to one file of TLSPLAN_MUTANTS, so that
children of a test count for it. What a fixture of several tests runs counts for all that use it.
"""

from __future__ import annotations

import json
import os
import resource
from collections.abc import Generator
from pathlib import Path

import pytest

_TEST, _FIXTURE = "PYTEST_CURRENT_TEST", "TLSPLAN_MUTANTS_FIXTURE"
_written: set[tuple[int, str, str]] = set()


def hit(number: int) -> None:
    """Record that a broken line is about to run."""
    row = (number, os.environ.get(_TEST, "").rsplit(" (", 1)[0], os.environ.get(_FIXTURE, ""))
    if row not in _written:
        _written.add(row)
        _write({"break": number, "test": row[1], "fixture": row[2]})


def _write(row: dict[str, object]) -> None:
    folder = os.environ.get("TLSPLAN_MUTANTS")
    if folder:  # a test may start a child in an environment of its own
        with Path(folder, f"{os.getpid()}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def _processor_s() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Record what a test costs, and its fixtures."""
    before_s = _processor_s()
    result = yield
    fixtures = sorted(getattr(item, "fixturenames", ()))
    _write({"test": item.nodeid, "processor_s": _processor_s() - before_s, "fixtures": fixtures})
    return result


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef[object]) -> Generator[None, object, object]:
    """Name the fixture that is being made, if several tests share it."""
    if fixturedef.scope == "function":
        return (yield)
    before = os.environ.get(_FIXTURE, "")
    os.environ[_FIXTURE] = fixturedef.argname
    try:
        return (yield)
    finally:
        os.environ[_FIXTURE] = before
