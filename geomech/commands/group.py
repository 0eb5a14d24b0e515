"""The group of all commands: its help under headings, and the old spellings of what was renamed."""

from __future__ import annotations

from itertools import groupby

from typer.core import TyperGroup

from geomech.commands import renamed


class Group(TyperGroup):
    """Commands that are listed under the headings that typer calls panels, which it shows by itself only with rich's markup."""

    def format_commands(self, ctx, formatter) -> None:
        wide = max(map(len, self.commands))
        for heading, some in groupby(
            self.commands.values(), lambda command: command.rich_help_panel
        ):
            with formatter.section(heading):
                rows = [
                    (
                        c.name.ljust(wide),
                        c.get_short_help_str(formatter.width - 6 - wide),
                    )
                    for c in some
                ]
                formatter.write_dl(rows)

    def resolve_command(self, ctx, args: list[str]) -> tuple:
        return super().resolve_command(ctx, renamed.current(args))
