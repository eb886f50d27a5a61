"""The interface against its own description: whatever is asked, what is answered is what the document says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis import GenerationMode
from schemathesis.checks import load_all_checks

from viewer_web.server.app import create_app
from viewer_web.server.openapi import openapi_text

from .conftest import TOKEN

load_all_checks()
CHECKS = schemathesis.checks.CHECKS
ADDRESS = "http://127.0.0.1:8000"
COMMITTED = Path(__file__).resolve().parents[2] / "viewer_web" / "src" / "api" / "openapi.json"


@pytest.fixture
def api_schema(plan_folder: Path, built_app: Path) -> object:
    app = create_app(plan_folder, token=TOKEN, built_app=built_app)
    return schemathesis.openapi.from_asgi(
        "/api/openapi.json", app, headers={"x-tlsplan-token": TOKEN, "host": "127.0.0.1:8000"}
    )


@pytest.mark.parametrize(
    "mode", [GenerationMode.POSITIVE, pytest.param(GenerationMode.NEGATIVE, marks=pytest.mark.slow)]
)
def test_every_answer_is_one_that_the_document_describes(api_schema: Any, mode: GenerationMode) -> None:
    # Data of the right form may still name a station that is not there, and is refused then.
    excluded = CHECKS.get_by_names(["positive_data_acceptance"])
    n_operations = 0
    for found in api_schema.exclude(path="/api/events").get_all_operations():
        operation = found.ok()
        if mode is GenerationMode.NEGATIVE and not any(
            body.media_type == "application/json" for body in operation.body
        ):
            continue  # nothing in it can be wrong: the bytes of a photo are any
        n_operations += 1

        @settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
        @given(case=operation.as_strategy(generation_mode=mode))
        def check(case: schemathesis.Case) -> None:
            case.call_and_validate(base_url=ADDRESS, headers={"x-tlsplan-token": TOKEN}, excluded_checks=excluded)

        check()
    assert n_operations == (5 if mode is GenerationMode.POSITIVE else 1)


def test_the_document_in_the_viewers_sources_is_that_of_the_server() -> None:
    assert json.loads(COMMITTED.read_text(encoding="utf-8")) == json.loads(openapi_text()), "run `make api-types`"
