"""The sites file as one model: buildings, each with options of `tlsplan plan` by their names; docs/formats/sites.md.

What an option may be is defined once, by the command line (`tlsplan.options`): the model's entries are made of
these options, and their values are read by them, as if they had been typed.
"""

from __future__ import annotations

import glob
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click
from pydantic import BeforeValidator, ConfigDict, Field, WithJsonSchema, create_model, model_validator

from planner_core.documents import Entries, Number, key_of, read_as, shown
from planner_core.errors import RequirementError
from planner_core.requirements.yaml_or_json import read_document

from ..commands.plan import problem_of
from ..group import RENAMED_OPTIONS
from ..options import (
    FileOptions,
    Length,
    OfFile,
    apply,
    drawing_options,
    method_choice,
    prior_options,
    problem_options,
    scene_argument,
    scene_options,
    verify_option,
)

_REMEDY = "see docs/formats/sites.md"
_MOST_SITES = 100_000
#: What text of `scene` is a pattern of names.
_PATTERN = re.compile(r"[*?\[]")


@click.command("site")
@apply(scene_argument, problem_options, prior_options, method_choice, scene_options, drawing_options, verify_option)
def _site(**values: Any) -> Any:
    """Make the settings of a site, as `tlsplan plan` makes its own: what is refused here would be refused there."""
    return problem_of(**{name: value for name, value in values.items() if name not in _NOT_SETTINGS})


_NOT_SETTINGS = ("scenes", "reading", "drawn", "n_verify")
#: By their names in the file: those of `tlsplan plan` that say what is planned, not where it is written or shown.
OPTIONS = {
    key_of(option.opts[0]): option
    for option in _site.params
    if isinstance(option, click.Option) and option.expose_value
}
_EARLIER = {key_of(old): key_of(now) for old, now in RENAMED_OPTIONS.items()}
_OF_READING = frozenset(FileOptions.__dataclass_fields__)


def _schema(option: click.Option) -> dict[str, Any]:
    kind = option.type
    if option.is_flag:
        return {"type": "boolean"}
    if isinstance(kind, click.Choice):
        one: dict[str, Any] = {"enum": [str(each) for each in kind.choices]}
    elif isinstance(kind, click.IntRange | click.FloatRange):
        least, most = ("exclusiveMinimum" if kind.min_open else "minimum"), "maximum"
        bounds = {name: value for name, value in ((least, kind.min), (most, kind.max)) if value is not None}
        one = {"type": "integer" if isinstance(kind, click.IntRange) else "number", **bounds}
    elif kind is click.INT:
        one = {"type": "integer"}
    else:
        one = {"type": ["string", "number"] if isinstance(kind, Length) or kind is click.STRING else "string"}
    return {"anyOf": [one, {"type": "array", "items": one}]} if option.multiple else one


def _value_of(option: click.Option) -> BeforeValidator:
    """What the file may say of an option, before the option itself reads it: one text or number, or several."""
    kinds = (bool,) if option.is_flag else (str, int, float)

    def fits(value: object) -> bool:
        return isinstance(value, kinds) and (option.is_flag or not isinstance(value, bool))

    def read(value: object) -> object:
        several = isinstance(value, list | tuple)
        if value is not None and not (all(map(fits, value)) and option.multiple if several else fits(value)):  # type: ignore[call-overload]
            one = "true or false" if option.is_flag else "a text or a number"
            raise RequirementError(
                f"got {shown(value)}, expected {one}{', or a list of them' if option.multiple else ''}; {_REMEDY}"
            )
        return value

    return BeforeValidator(read)


if TYPE_CHECKING:
    _OptionEntries = Entries
else:
    _OptionEntries = create_model(
        "OptionEntries",
        __base__=Entries,
        **{
            name: (
                Annotated[Any, _value_of(option), WithJsonSchema(_schema(option))],
                Field(default=None, description=option.help),
            )
            for name, option in OPTIONS.items()
        },
    )


def _patterns(value: object) -> object:
    return (value,) if isinstance(value, str) else value


class DefaultEntries(_OptionEntries):
    """Of all sites that say nothing else: a portfolio, storeys, and options of `tlsplan plan` without their dashes."""

    @model_validator(mode="before")
    @classmethod
    def _of_earlier_versions(cls, value: object) -> object:
        if not isinstance(value, Mapping):
            return value
        now = {key: _EARLIER.get(key_of(str(key)), key) for key in value}
        return {key if now[key] in value else now[key]: entry for key, entry in value.items()}

    portfolio: Annotated[str, Field(max_length=200)] | None = None
    """The sites that are added up together, such as a client or a town."""
    floors: Annotated[str, Field(pattern="^(together|each)$")] | None = None
    """together: a building is planned as one; each: every storey by itself, in a plan folder of its own."""


class SiteEntries(DefaultEntries):
    """A building, or many of the same kind, and what differs from the defaults."""

    model_config = ConfigDict(json_schema_extra={"required": ["scene"]})

    scene: Annotated[
        tuple[Annotated[str, Field(min_length=1)], ...],
        BeforeValidator(_patterns),
        Field(min_length=1),
        WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}, "minItems": 1}]}),
    ]
    """A file; a pattern such as `schools/*.ifc`, of which each file is a site; or a list: the files of one building."""
    name: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """What it is called, and its plan folder; left out: the file's name without its ending."""


class PriceEntries(Entries):
    """Prices of field work; what is left out costs nothing."""

    currency: Annotated[str, Field(max_length=20)] = ""
    """As it is written behind amounts: EUR."""
    hour: Annotated[Number, Field(ge=0)] = 0.0
    """Of the crew's hour in the field."""
    station: Annotated[Number, Field(ge=0)] = 0.0
    """Of a station besides: targets, registration, storage."""


class SitesFile(Entries):
    """Buildings to plan with `tlsplan batch`."""

    defaults: DefaultEntries | None = None
    prices: PriceEntries | None = None
    sites: Annotated[tuple[SiteEntries, ...], Field(min_length=1, max_length=_MOST_SITES)]


@dataclass(frozen=True, eq=False)
class BatchSite:
    """A building to plan. arguments : of `tlsplan plan`, besides the scene's files. reading : those of them that say
    how files are read. values : of the options as read, by their names. files : other files that these name.
    """

    name: str
    portfolio: str
    scenes: tuple[Path, ...]
    each_floor: bool
    arguments: tuple[str, ...]
    reading: tuple[str, ...]
    values: Mapping[str, Any]
    files: tuple[Path, ...]
    missing: str = ""
    """Why there is nothing to plan; empty: there is."""


def read_sites(path: Path) -> tuple[tuple[BatchSite, ...], PriceEntries | None]:
    """Read a sites file, YAML or JSON; files that it names are beside it.

    Raises
    ------
    RequirementError
        It can't be read, has an entry that is not understood, or that `tlsplan plan` would refuse; in one line.
    """
    file = read_as(
        SitesFile, read_document(path, of="sites", such_as="sites: [scene: a.ifc]"), f"{path}: ", remedy=_REMEDY
    )
    defaults = file.defaults or DefaultEntries()
    sites: dict[str, BatchSite] = {}
    for number, entries in enumerate(file.sites):
        for site in _sites(path, f"sites[{number}]", defaults, entries):
            if site.name in sites:
                raise RequirementError(
                    f"{path}: sites[{number}]: got a second site {site.name}, expected names that differ; give a name"
                )
            sites[site.name] = site
    return tuple(sites.values()), file.prices


def _sites(path: Path, place: str, defaults: DefaultEntries, entries: SiteEntries) -> list[BatchSite]:
    values = {**_given(defaults), **_given(entries)}
    scene, name = values.pop("scene"), values.pop("name", None)
    portfolio, floors = values.pop("portfolio", ""), values.pop("floors", "together")
    groups = _buildings(path.parent, scene)
    if name is not None and len(groups) > 1:
        raise RequirementError(
            f"{path}: {place}: got the name {shown(name)} for {len(groups)} files, expected one for each; leave it out"
        )
    arguments, files = _arguments(path.parent, values)
    reading, _ = _arguments(path.parent, {key: value for key, value in values.items() if _reads(key)})
    made = []
    for scenes in groups:
        try:
            context = _site.make_context("site", [*map(str, scenes), *arguments])
            with context:
                _site.invoke(context)
        except click.UsageError as error:
            raise RequirementError(f"{path}: {place}: {error.format_message()}; {_REMEDY}") from error
        except RequirementError as error:
            raise RequirementError(f"{path}: {place}: {error}") from error
        missing = next((_why_missing(each) for each in scenes if not each.is_file()), "")
        if missing and _PATTERN.search(scenes[0].name) and len(scenes) == 1:
            missing = f"{scenes[0]}: no file has such a name; check the pattern and the folder"
        called = _plain(name or scenes[0].stem)
        values = {option.name: context.params[str(option.name)] for option in OPTIONS.values()}
        each_floor, words, of_reading = floors == "each", tuple(arguments), tuple(reading)
        made.append(BatchSite(called, portfolio, scenes, each_floor, words, of_reading, values, tuple(files), missing))
    return made


def _why_missing(scene: Path) -> str:
    if scene.is_dir():
        return f"{scene}: it is a folder, expected a scene file; name the files in it, such as {scene.name}/*.ifc"
    return f"{scene}: there is no such file; check the name and the folder"


def _given(entries: Entries) -> dict[str, Any]:
    return {name: getattr(entries, name) for name in type(entries).model_fields if name in entries.given()}


def _reads(key: str) -> bool:
    return OPTIONS[key].name in _OF_READING


def _buildings(base: Path, scene: tuple[str, ...]) -> list[tuple[Path, ...]]:
    """The files of each building. A pattern that nothing matches, and files that are not there, stay as they are."""
    if len(scene) > 1 or not _PATTERN.search(scene[0]) or (base / scene[0]).exists():
        return [tuple(base / each for each in scene)]
    pattern = str(Path(glob.escape(str(base)), scene[0]))
    found = sorted(Path(each) for each in glob.glob(pattern, recursive=True))  # noqa: PTH207 (takes absolute ones, too)
    return [(each,) for each in found if each.is_file()] or [(base / scene[0],)]


def _arguments(base: Path, values: Mapping[str, Any]) -> tuple[list[str], list[Path]]:
    """Write options as they are typed, with paths from the sites file's folder; and the files that they name."""
    words, files = [], []
    for key, entry in values.items():
        option = OPTIONS[key]
        if option.is_flag:
            words += [option.opts[0]] if entry else option.secondary_opts[:1]
            continue
        for value in entry if isinstance(entry, list | tuple) else (entry,):
            text = value if isinstance(value, str) else repr(value)
            file = _file_of(base, option, text)
            if file is not None:
                files.append(base / file)
                text = str(base / text)
            words.append(f"{option.opts[0]}={text}")
    return words, files


def _file_of(base: Path, option: click.Option, text: str) -> str | None:
    """The file that a value names; None where it names none. A scanner's mode stands behind it."""
    if isinstance(option.type, click.Path):
        return text
    if option.name == "scanner":
        return next((each for each in (text, text.rpartition(":")[0]) if each and (base / each).is_file()), None)
    return None


def _plain(name: str) -> str:
    """`name` as folders may be called on every system."""
    return re.sub(r"[^\w.-]+", "-", name).strip("-.") or "site"


__all__ = ["OPTIONS", "BatchSite", "OfFile", "PriceEntries", "SitesFile", "read_sites"]
