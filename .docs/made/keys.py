"""Every key of a scene file, from the declarations that `geomech reference` prints."""

from __future__ import annotations

from geomech.scenes.format import keys


def page() -> str:
    """Return a heading for each section, a heading for each of its kinds, and a table
    of its keys."""
    return "\n\n".join(_section(name, parts) for name, parts in keys.sections().items())


def _section(name: str, parts: list[keys.Part]) -> str:
    return "\n\n".join([f"## {name}", *map(_part, parts)])


def _part(part: keys.Part) -> str:
    about = " ".join(part.about.split())
    if not part.keys:
        return f"### `{part.title}`\n\n{about}"
    rows = [
        _row(
            key.name,
            keys.worded(key.schema),
            key.unit,
            key.value,
            key.meaning,
            key.degrees,
        )
        for key in part.keys
    ]
    head = "| key | type | unit | default | meaning |\n|---|---|---|---|---|\n"
    return f"### `{part.title}`\n\n{about}\n\n{head}" + "\n".join(rows)


def _row(
    name: str, kind: str, unit: str, value: str, meaning: str, degrees: bool
) -> str:
    def cell(text):
        return text.replace("|", r"\|")

    meaning += f"; in degrees as `{name}_deg`" * degrees
    value = value if value in ("required", "none") else f"`{cell(value)}`"
    return f"| `{name}` | {kind} | {cell(unit)} | {value} | {cell(meaning)} |"
