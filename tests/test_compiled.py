"""Work shared out to threads: each item once, and few items in the thread that waits for them."""

import threading

import pytest

from planner_core import compiled


@pytest.mark.parametrize(("n", "is_here"), [(0, True), (9, True), (63, True), (64, False), (1000, False)])
def test_shared_work_has_each_item_once_and_few_items_need_no_thread(
    n: int, is_here: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "n_usable_cores", lambda: 4)
    items, threads = [], set()

    def work(first: int, end: int) -> None:
        items.extend(range(first, end))
        threads.add(threading.current_thread())

    compiled.share_out(work, n)
    assert sorted(items) == list(range(n))
    assert (threads == {threading.current_thread()}) == is_here
