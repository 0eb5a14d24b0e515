"""What a model of the fluid provides."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np


class Sites(NamedTuple):
    """Places along a body at which the fluid's forces act, in the middle of parts that
    fill its links from tail to head.

    link: (n,), index of the link of each site, ascending. ahead: (n,), distance of the
    site before the centre of its link, body lengths. half: (n,), half length of the
    part of the link that the site stands for, body lengths."""

    link: np.ndarray
    ahead: np.ndarray
    half: np.ndarray


def divided(fractions: np.ndarray, counts: np.ndarray) -> Sites:
    """Return sites in the middle of equal parts of links.

    fractions: (links,), lengths of the links, body lengths. counts: (links,), number of
    parts of each."""
    link = np.repeat(np.arange(len(fractions)), counts)
    part = np.concatenate([np.arange(count) for count in counts])
    step = (fractions / counts)[link]
    ahead = (part + 0.5) * step - fractions[link] / 2
    return Sites(link, ahead, step / 2)


class FluidModel(Protocol):
    """A model of the flow around a chain of links.

    radius: of the links, body lengths."""

    @property
    def radius(self) -> float: ...

    def sites(self, fractions: np.ndarray) -> Sites:
        """Return the sites of links with lengths (links,), body lengths."""

    def mobility(
        self, sites: Sites, centre: np.ndarray, heading: np.ndarray
    ) -> np.ndarray:
        """Return the symmetric matrices (B, 2 n, 2 n) that give velocities of the sites
        from forces on them, first all x, then all y.

        centre: complex (B, n), x + i y of the sites. heading: complex (B, n), exp(i
        theta) of their links."""
