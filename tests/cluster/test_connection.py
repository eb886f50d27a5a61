"""What is told where there are no workers to be had."""

from __future__ import annotations

import sys

import pytest

from planner_core.cluster import executor
from planner_core.cluster.connection import n_local_workers
from planner_core.cluster.executor import open_cluster
from planner_core.errors import ClusterError, MissingPackageError
from planner_core.operating_system import n_usable_cores


def test_without_dask_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingPackageError, match=r"pip install tlsplan\[cluster\]"), open_cluster("local", tell=print):
        pass


def test_no_scheduler_and_no_number_are_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executor, "_CONNECTS_WITHIN_S", 1.0)
    with pytest.raises(ClusterError, match="expected a Dask scheduler"), open_cluster("tcp://127.0.0.1:9", tell=print):
        pass
    with pytest.raises(ClusterError, match="local:N with 1 to 1000 workers"), open_cluster("local:many", tell=print):
        pass


def test_workers_of_this_machine_are_as_many_as_are_asked_for() -> None:
    asked = ["local", "local:1", "local:1000", "tcp://10.0.0.1:8786"]
    assert [*map(n_local_workers, asked)] == [n_usable_cores(), 1, 1000, 0]
