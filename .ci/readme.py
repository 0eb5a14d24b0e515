"""The long description of the package: README.md, whose links within the repository are
made absolute."""

import pathlib
import re

from hatchling.metadata.plugin.interface import MetadataHookInterface


def absolute(text: str, repository: str, version: str) -> str:
    """Return Markdown whose relative links and pictures lead to the files of that
    version in the repository."""

    def link(match: re.Match) -> str:
        picture, label, target = match.groups()
        if target.startswith("#"):
            return match[0]
        return f"{picture}[{label}]({repository}/{'raw' if picture else 'blob'}/v{version}/{target})"

    pieces = re.split(
        r"(^```.*?^```$)", text, flags=re.M | re.S
    )  # blocks of code stand at odd places
    pieces[::2] = [
        re.sub(r"(!?)\[([^]]*)\]\((?![a-z]+:)([^)\s]+)\)", link, prose)
        for prose in pieces[::2]
    ]
    return "".join(pieces)


class Readme(MetadataHookInterface):
    """Fills in the dynamic field `readme`."""

    def update(self, metadata: dict) -> None:
        """Set `metadata["readme"]` from README.md, project.urls and the version."""
        text = (pathlib.Path(self.root) / "README.md").read_text(encoding="utf-8")
        version = re.search(
            r'^VERSION = "(.*)"',
            (pathlib.Path(self.root) / "geomech/core/version.py").read_text(),
            re.M,
        )[1]
        text = absolute(text, metadata["urls"]["Repository"], version)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
