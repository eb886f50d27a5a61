"""The command group: finds each command in its own module, loaded only when it is called or listed.

`tlsplan --help` must answer in a fraction of a second, so no module under `commands/` imports anything heavy at its
top: the library and its packages come in inside the function that runs.
"""

from __future__ import annotations

import importlib

import click

COMMANDS = (
    "plan", "view", "export", "batch", "floors", "evaluate", "compare", "simulate", "scanners", "scene", "demo",
    "reproduce", "tlsplib", "doctor", "tune",
)  # fmt: skip


#: Options of the last release by their names of now: taken for one more, with a notice.
RENAMED_OPTIONS = {
    "--as-told": "--accept-implausible",
    "--door-shut": "--door-closed",
    "--fixed": "--scanned",
    "--judge": "--verify",
}


class LazyGroup(click.Group):
    """A click group whose commands live in `tlsplan.commands.<name>` as `command`, listed in the order of use."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Take options by the names of the last release, too."""
        end = args.index("--") if "--" in args else len(args)
        return super().parse_args(ctx, [*map(_renamed, args[:end]), *args[end:]])

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order in which a user meets them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one command; None where there is none of that name."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f".commands.{cmd_name}", package=__package__)
        command = module.command
        assert isinstance(command, click.Command)
        return command


def _renamed(argument: str) -> str:
    name, equals, value = argument.partition("=")
    if name not in RENAMED_OPTIONS:
        return argument
    now = RENAMED_OPTIONS[name]
    click.echo(f"warning: {name} is now {now}; the old name will be removed in the next release", err=True)
    return now + equals + value


@click.command(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Example:  tlsplan plan building.ifc -o plan/   then   tlsplan view plan/",
)
@click.version_option(package_name="tlsplan", prog_name="tlsplan")
@click.option("--debug", is_flag=True, help="Show the Python traceback of an error (for bug reports).")
@click.pass_context
def cli(ctx: click.Context, debug: bool) -> None:
    """Plan terrestrial laser scanning of a building, and prove how good the plan is."""
    from planner_core.environment_variables import date_from_env

    ctx.obj = {"debug": debug}
    date_from_env()  # a wrong one is refused now: NumPy, among others, fails at it as it is imported
