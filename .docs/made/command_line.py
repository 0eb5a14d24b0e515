"""Every command with its arguments and options, from the program itself."""

from __future__ import annotations

import inspect
import re

from geomech.shell import cli


def page() -> str:
    """Return a heading for each group of `geomech --help-all`, and for each command its
    usage, text and options."""
    commands = cli.Commands()
    parts = []
    for heading, names in cli.headings().items():
        parts += [
            f"## {heading}",
            *(_command(commands[name.replace("_", "-")]) for name in names),
        ]
    return "\n\n".join(parts)


def _command(command) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [
        p
        for p in command.params
        if p.param_type_name == "option" and not p.hidden and "--help" not in p.opts
    ]
    shared = [p for p in options if p.rich_help_panel]
    options = [p for p in options if not p.rich_help_panel]
    usage = " ".join(
        [
            "geomech",
            command.name,
            *(_placeholder(p) for p in arguments),
            *["[OPTIONS]"] * bool(options),
        ]
    )
    text = " ".join(inspect.cleandoc(command.help or "").split())
    rows = [
        f"| {_names(p)} | {_text(p.help)}{' (required)' * p.required} |"
        for p in arguments + options
    ]
    table = "| argument or option | meaning |\n|---|---|\n" + "\n".join(rows)
    if shared:
        names = ", ".join(f"`{p.opts[0]}`" for p in shared)
        table += f"\n\n[Of figures](../how-to/figures.md#3-draw): {names}."
    return f"### `{command.name}`\n\n{text}\n\n```text\n{usage}\n```\n\n{table}"


def _placeholder(parameter) -> str:
    name = (parameter.metavar or parameter.name.upper()).strip("[]{}")
    return name if parameter.required else f"[{name}]"


def _names(parameter) -> str:
    if parameter.param_type_name == "argument":
        return f"`{(parameter.metavar or parameter.name.upper()).strip('[]{}')}`"
    value = "" if parameter.is_flag else f" {parameter.metavar or _type(parameter)}"
    spellings = [f"{x}{value}" for x in (*parameter.opts, *parameter.secondary_opts)]
    return ", ".join(f"`{x}`".replace("|", r"\|") for x in spellings)


def _type(parameter) -> str:
    kind = parameter.type_descriptor.annotation
    return {int: "N", float: "NUMBER", str: "TEXT"}.get(kind, "VALUE")


def _text(help: str | None) -> str:
    return re.sub(r"(?<!\\)\|", r"\\|", " ".join((help or "").split()))
