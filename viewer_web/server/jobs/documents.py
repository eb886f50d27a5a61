"""The documents of /api/runs: the request of a run, and its state; the same are its files on disk."""

import json
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StrictBool

MOST_TITLE_CHARACTERS = 200
_Point = Annotated[list[float], Field(min_length=3, max_length=3)]


def _plain(value: dict[str, Any]) -> dict[str, Any]:
    """Refuse what Python reads as JSON and nobody else: NaN, half characters, brackets without end."""
    try:
        json.dumps(value, ensure_ascii=False, allow_nan=False).encode()
    except (ValueError, RecursionError) as error:
        raise ValueError("numbers must be finite, texts Unicode, lists inside each other few") from error
    return value


class RunRequest(BaseModel):
    """What a new plan is to meet."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "title": "Ground floor, finer",
                    "requirements": {"coverage": "98 %", "spacing": "6 mm", "planned_floors": ["F0"]},
                    "objective": "fewest",
                    "max_stations": None,
                    "from_review": True,
                    "time_limit_s": 120,
                }
            ]
        },
    )

    title: Annotated[
        str, Field(max_length=MOST_TITLE_CHARACTERS, pattern=r"^[^\x00-\x1f\x7f]*$", description="One line for people.")
    ] = ""
    requirements: Annotated[
        dict[str, Any],
        Field(
            description="Entries of a requirements file, docs/formats/requirements.md. Limits (spacing, range, "
            "incidence, noise), seen_from and planned_floors that are left out are not required; anything else that is "
            "left out, parts of the building and the site too, stays as in the plan."
        ),
        AfterValidator(_plain),
    ] = Field(default_factory=dict)
    objective: Annotated[Literal["fewest", "coverage", "time"], Field(description="As --objective.")] = "fewest"
    max_stations: Annotated[
        int | None, Field(ge=1, le=10_000, strict=True, description="With objective coverage, and only there.")
    ] = None
    from_review: Annotated[
        StrictBool,
        Field(
            description="Whether the review counts: its stations are kept where that costs nothing, or locked; zones, "
            "forbidden places, ground, entrances and doors are taken over. Other objectives than fewest keep no "
            "stations."
        ),
    ] = False
    from_drawing: Annotated[
        StrictBool,
        Field(
            description="Whether the corrected drawing beside the plan counts: it is raised to an IFC file anew, which "
            "takes the place of the one that was planned."
        ),
    ] = False
    time_limit_s: Annotated[
        float | None,
        Field(ge=0, le=604_800, allow_inf_nan=False, description="Of the search; the best plan until then is taken."),
    ] = None


class RunBest(BaseModel):
    """The best stations so far; of a run that has a plan, those of the plan."""

    n_stations: int
    lower_bound: Annotated[int | None, Field(description="Lower bound of the number of stations; null: unknown.")] = (
        None
    )
    fraction_of_achievable: Annotated[float | None, Field(description="Covered; null: not counted yet.")] = None
    stations: Annotated[list[_Point], Field(description="Scene frame, metres; empty: not known yet.")] = Field(
        default_factory=list
    )


class RunDocument(BaseModel):
    """A run, as it stands."""

    id: Annotated[str, Field(examples=["R001"])]
    title: str
    state: Annotated[
        Literal["running", "finished", "cancelled", "failed"],
        Field(description="A cancelled run has a plan where it was cancelled late enough to have one."),
    ]
    cancelling: Annotated[bool, Field(description="It is cancelled, and still goes on.")] = False
    created: Annotated[str, Field(description="UTC.", examples=["2026-11-21T16:30:00Z"])]
    ended: str | None = None
    stage: Annotated[str | None, Field(description="What it is doing.")] = None
    done: Annotated[int | None, Field(description="Steps of `total`, of this stage.")] = None
    total: Annotated[int | None, Field(description="0: not known.")] = None
    note: Annotated[str | None, Field(description="A remark on the stage, for people.")] = None
    best: RunBest | None = None
    message: Annotated[str | None, Field(description="Why it failed, or how it ended; what helps.")] = None
    warnings: Annotated[list[str], Field(description="Of the finished plan.")] = Field(default_factory=list)
    plan: Annotated[
        str | None, Field(description="Its plan folder, below /plan/ of this server.", examples=["runs/R001/plan"])
    ] = None
    request: RunRequest
    resumed_from: Annotated[str | None, Field(description="The run whose best stations it began with.")] = None
    plan_sha256: Annotated[str, Field(description="Of the plan.json that it was requested on.")]
    revision: Annotated[int, Field(description="Of the review then.")]


class RunList(BaseModel):
    """All runs of the plan folder, the oldest first."""

    runs: list[RunDocument]
    obstacle: Annotated[str | None, Field(description="Why no run can be started, as where the scene is missing.")]
