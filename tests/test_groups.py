"""Tests that share work are dealt out together: a plugin that forgets groups says nothing and doubles the time."""

import os

import pytest


@pytest.mark.xdist_group("groups")
def test_groups_reach_who_deals_tests_out(request: pytest.FixtureRequest) -> None:
    if "PYTEST_XDIST_WORKER" not in os.environ:
        pytest.skip("one process runs all tests")
    assert request.node.nodeid.endswith("@groups")
