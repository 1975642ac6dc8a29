"""The group of all commands, which each adds itself to; a group with a command that needs no name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click
from click.shell_completion import CompletionItem

import ndtheory
from ndtheory.texts import did_you_mean
from verification.cli.console import guarded


class Commands(click.Group):
    """A group that guards its commands, and suggests the nearest name for an unknown one."""

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, or a group with all its forms."""
        for form in cmd.forms().values() if isinstance(cmd, AdviseGroup) else [cmd]:
            assert form.callback is not None
            form.callback = guarded(form.callback)
        super().add_command(cmd, name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the first word names, and the words after it."""
        name = args[0]
        if not ctx.resilient_parsing and not name.startswith("-") and self.get_command(ctx, name) is None:
            raise click.UsageError(f"No such command {name!r}{did_you_mean(name, self.list_commands(ctx))}", ctx)
        return super().resolve_command(ctx, args)


class AdviseCommand(click.Command):
    """One of several commands on one subject; the error for an option of another one names that command."""

    #: The group that the command belongs to; None until it is added to one.
    group: AdviseGroup | None = None

    allow_extra_args = True  # to be refused here, in words of this command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the words of the command."""
        try:
            extra = super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            known = {} if self.group is None else self.group.forms()
            others = [name for name, form in known.items() if form is not self and takes(form, error.option_name)]
            if not others:
                raise
            root = ctx.find_root().info_name
            of = " and ".join(f"{root} {name}" for name in others)
            raise click.UsageError(f"{error.option_name} is an option of {of}", ctx) from None
        if extra and not ctx.resilient_parsing:
            words = [str(ctx.params[p.name or ""]) for p in self.params if isinstance(p, click.Argument)] + extra
            log = " (a log: after --log)" if takes(self, "--log") else ""
            raise click.UsageError(f"received {' '.join(words)}: needed {self.needed(ctx)}{log}", ctx)
        return extra

    def needed(self, ctx: click.Context) -> str:
        """The arguments of the command, in words."""
        return "options only, and none of them takes this value"


class Default(AdviseCommand):
    """The command of a group that needs no name: its help serves the group, and lists the other commands."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the words of the command; without its argument, say which commands there are besides."""
        try:
            return super().parse_args(ctx, args)
        except click.MissingParameter as error:
            if not isinstance(error.param, click.Argument):
                raise
            raise click.UsageError(f"received nothing: needed {self.needed(ctx)}", ctx) from None

    def needed(self, ctx: click.Context) -> str:
        """The argument and the commands, in words."""
        named = [] if self.group is None else self.group.commands
        return f"one {' '.join(self.arguments(ctx))}, or one of the commands {', '.join(named)} first"

    def arguments(self, ctx: click.Context) -> list[str]:
        """The arguments as the help writes them."""
        return [p.make_metavar(ctx) for p in self.params if isinstance(p, click.Argument)]

    def format_usage(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Both calls, with and without a name."""
        formatter.write_usage(ctx.command_path, " ".join(["[OPTIONS]", *self.arguments(ctx)]))
        formatter.write_usage(ctx.command_path, "COMMAND [OPTIONS]", prefix="   or: ")

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options, and the other commands of the group."""
        super().format_options(ctx, formatter)
        named = {} if self.group is None else self.group.commands
        with formatter.section("Commands"):
            formatter.write_dl([(name, form.get_short_help_str(60)) for name, form in named.items()])


class AdviseGroup(Commands):
    """A group whose default is a command with an argument: a first word that names no command is that argument."""

    def __init__(self, default: Default, forms: Sequence[AdviseCommand]) -> None:
        super().__init__(default.name, help=default.help, commands=list(forms))
        self.default = default
        for form in (default, *forms):
            form.group = self

    def forms(self) -> dict[str, click.Command]:
        """Every command by what is typed for it."""
        argument = next(p.human_readable_name for p in self.default.params if isinstance(p, click.Argument))
        return {f"{self.name} {name}": form for name, form in {argument: self.default, **self.commands}.items()}

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """The group's context if a word names a command, else the default's; options may come first."""
        first = _first_word(self.default, args)
        if first is None or args[first] not in self.commands:
            return self.default.make_context(info_name, args, parent, **extra)
        return super().make_context(info_name, [args[first], *args[:first], *args[first + 1 :]], parent, **extra)

    def complete(self, ctx: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
        """Completions of the name of the group: its commands, and files."""
        names = [CompletionItem(name) for name in self.commands if name.startswith(begun)]
        return [*names, CompletionItem(begun, type="file")]


def takes(command: click.Command, option: str) -> bool:
    """True if a command has this option."""
    return any(option in parameter.opts for parameter in command.params)


def _first_word(command: click.Command, args: Sequence[str]) -> int | None:
    """Index of the first word that is neither an option of a command nor the value of one."""
    place = 0
    while place < len(args):
        word = args[place]
        if not word.startswith("-") or word in ("-", "--"):
            return place
        valued = any(
            word in parameter.opts and isinstance(parameter, click.Option) and not parameter.is_flag
            for parameter in command.params
        )
        place += 2 if valued else 1
    return None


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 80})
@click.version_option(ndtheory.__version__, prog_name="ndtheory", message="%(prog)s %(version)s")
def cli() -> None:
    """Put the convergence theorem for Neumann-Dirichlet contact iterations to work.

    Measure its constants, evaluate its bounds, run the iteration, judge each bound, and advise which theta to take.

    \b
    ndtheory demo                     the Section 6 model, end to end
    ndtheory example section6 > my.toml
    ndtheory compare my.toml          constants, bounds and a run of your problem
    ndtheory advise my.toml           which body first, which theta
    ndtheory verify                   every statement of the paper, checked
    """
