"""Who of a cluster's workers is used."""

from __future__ import annotations

from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import until

from planner_core.cluster import connection
from planner_core.cluster.connection import Connection
from planner_core.cluster.worker_pool import WorkerPool


def test_workers_that_never_answer_are_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def silent_future() -> Any:
        return SimpleNamespace(result=lambda timeout: Future[None]().result(timeout), status="pending")

    told: list[str] = []
    cluster = Connection("nowhere", SimpleNamespace(submit=lambda *of, **more: silent_future()), told.append)
    monkeypatch.setattr(cluster, "workers", lambda: {"w1"})
    monkeypatch.setattr(connection, "PATIENCE_S", 0.3)
    pool = WorkerPool(cluster, lambda address: True)

    def is_gone() -> bool:
        pool.find(nothing_done=True)
        return pool.is_gone()

    until(is_gone)
    pool.close()
    assert told == ["no worker for 0 s: this machine goes on alone"]
