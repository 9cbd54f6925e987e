"""The command line: one file a command, the only package that prints.

A command is a ``click.Command`` that returns its exit status (``None`` is 0). What goes wrong is raised
as an ``EtcError`` and becomes one line here. Commands import the engine inside their functions, so that
``--help`` loads nothing but click.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

import click

from etc_engine.cli.streams import PipeClosedError, guarded_streams
from etc_engine.cli.threads import hold_one_thread
from etc_engine.errors import EtcError

COMMANDS = {
    "pack": "etc_engine.cli.pack:pack_command",
    "solve": "etc_engine.cli.solve:solve_command",
    "homogenize": "etc_engine.cli.homogenize:homogenize_command",
    "sweep": "etc_engine.cli.sweep:sweep_command",
    "compare": "etc_engine.cli.compare:compare_command",
    "report": "etc_engine.cli.report:report_command",
    "info": "etc_engine.cli.info:info_command",
    "rerun": "etc_engine.cli.rerun:rerun_command",
    "models": "etc_engine.cli.models:models_command",
    "export": "etc_engine.cli.export:export_command",
    "materials": "etc_engine.cli.materials:materials_command",
    "keys": "etc_engine.cli.keys:keys_command",
    "transient": "etc_engine.cli.transient:transient_command",
    "warm": "etc_engine.cli.warm:warm_command",
    "serve": "etc_engine.cli.serve:serve_command",
    "submit": "etc_engine.cli.submit:submit_command",
    "status": "etc_engine.cli.status:status_command",
    "fetch": "etc_engine.cli.fetch:fetch_command",
}

EXIT_DONE = 0
EXIT_BUG = 1
EXIT_REFUSED = 2
EXIT_PIPE = 141  # what a shell reports of a process whose reader has left, such as `head`; silent
EXIT_INTERRUPTED = 130  # what a shell reports of a process that Ctrl-C ended


class CommandTable(click.Group):
    """A click group whose commands are imported when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Names of the commands, in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - click's signature
        """The command of that name; None when there is no such command."""
        if cmd_name not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[cmd_name].partition(":")
        command = getattr(import_module(module), attribute)
        if not isinstance(command, click.Command):
            raise TypeError(f"{COMMANDS[cmd_name]} is not a click command")
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The commands, each with the whole first sentence of its help."""
        rows = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.get_short_help_str(limit=200)) for name, command in rows if command])


def _print_version(ctx: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if not wanted or ctx.resilient_parsing:
        return
    from importlib.metadata import PackageNotFoundError, version

    try:
        number = version("etc-engine")
    except PackageNotFoundError:
        number = "unknown (not installed)"
    click.echo(f"etc-engine {number}")
    ctx.exit()


@click.command(cls=CommandTable, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Show the version and exit.",
)
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Effective thermal conductivity of particle systems, and its statistics over random realizations.

    etc-engine COMMAND --help explains a command.

    Completion of commands and options in bash: eval "$(_ETC_ENGINE_COMPLETE=bash_source etc-engine)". For zsh and fish
    use zsh_source and fish_source.
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit status; what goes wrong is one line on stderr."""
    hold_one_thread()
    with guarded_streams():
        return _run(arguments)


def _run(arguments: Sequence[str] | None) -> int:
    try:
        status = cli.main(args=arguments, prog_name="etc-engine", standalone_mode=False)
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx else "etc-engine"
        return _refuse(f"{error.format_message()} (see: {where} --help)", EXIT_REFUSED)
    except click.ClickException as error:
        return _refuse(error.format_message(), EXIT_REFUSED)
    except EtcError as error:
        return EXIT_PIPE if isinstance(error, PipeClosedError) else _refuse(str(error), EXIT_REFUSED)
    except (click.Abort, KeyboardInterrupt):
        return _refuse("interrupted", EXIT_INTERRUPTED)
    except Exception as error:
        if os.environ.get("ETC_ENGINE_TRACEBACK"):
            raise
        what = f"unexpected {type(error).__name__}: {error}"
        if "no locator available" in what:  # the words of numba
            from etc_engine.kernels import NOWHERE

            what = NOWHERE
        return _refuse(f"{what} (set ETC_ENGINE_TRACEBACK=1 to see where)", EXIT_BUG)
    return status if isinstance(status, int) else EXIT_DONE


def _refuse(message: str, status: int) -> int:
    click.echo("etc-engine: " + " ".join(message.split()), err=True)
    return status


def main() -> NoReturn:
    """Entry point of the console script."""
    sys.exit(run())
