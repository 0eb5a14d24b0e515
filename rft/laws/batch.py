"""Media of one law that share a batch of samples: their coefficients are arrays, one
number for each sample, as parameters of effects may be.

Only sums of dry and viscous terms (`rft.laws.base.TermLaw`) can share a batch; media of
other laws are solved one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rft.core.refusal import Refusal
from rft.laws.base import (
    TermLaw,
    TermNumbers,
    has_only_drags,
    is_frozen,
    is_mirror,
    speed_exponent,
    term_numbers,
)


@dataclass(frozen=True)
class MediumBatch(TermLaw):
    """A medium for each sample of a batch, made by `batched_medium`.

    index: (B,), of the medium of each sample. media: (M,). terms_of_samples:
    coefficients, as in `rft.laws.base.TermNumbers` with an axis (B,) of samples behind
    the others."""

    index: np.ndarray = field(repr=False)
    media: tuple
    terms_of_samples: TermNumbers = field(repr=False)

    @property
    def dry(self) -> tuple:
        return tuple(self.terms_of_samples.dry)

    @property
    def viscous(self) -> np.ndarray:
        return self.terms_of_samples.viscous[0]

    @property
    def mirror(self) -> bool:
        return is_mirror(self.media[0])

    def take(self, index: Any) -> MediumBatch:
        """Return the media of the samples ``index``."""
        numbers = TermNumbers(*(x[..., index] for x in self.terms_of_samples))
        return MediumBatch(self.index[index], self.media, numbers)

    def runs(self) -> Iterator[tuple[Any, slice]]:
        """Yield the medium of each run of samples in one medium, and the run."""
        changes = np.flatnonzero(np.diff(self.index)) + 1
        stops = [*changes.tolist(), self.index.size]
        for start, stop in zip([0, *stops], stops):
            yield self.media[self.index[start]], slice(start, stop)


def batch_form(medium: Any) -> tuple | None:
    """Return what media must have in common to share a batch; None for a medium that
    shares none.

    Examples
    --------
    >>> from rft import Granular, Viscous
    >>> from rft.laws.batch import batch_form
    >>> batch_form(Granular(1.8, 0.24)) == batch_form(Granular(0.5, 0.3))
    True
    >>> batch_form(Granular(1.8, 0.24)) == batch_form(Viscous())
    False
    """
    kind = type(medium)
    is_sum_of_terms = (
        isinstance(medium, TermLaw)
        and kind.traction is TermLaw.traction
        and kind.slopes is TermLaw.slopes
    )
    if not is_sum_of_terms or not has_only_drags(medium):
        return None
    return kind, len(medium.dry), speed_exponent(medium), is_mirror(medium)


def batched_medium(media: Sequence, counts: Sequence[int]) -> Any:
    """Return one medium for a batch, made from media of one `batch_form`, each of them
    for ``count`` samples in a row; the medium itself where all are the same.

    Examples
    --------
    >>> from rft import Chain, Granular, body_velocity
    >>> from rft.laws.batch import batched_medium
    >>> sands = [Granular(1.8, 0.24), Granular(0.5, 0.3)]
    >>> both = batched_medium(sands, counts=[1, 2])
    >>> solution = body_velocity(both, Chain(), [0.5, 0.3], [[1.0, 0.0]] * 3)
    >>> alone = body_velocity(sands[1], Chain(), [0.5, 0.3], [1.0, 0.0])
    >>> bool(abs(solution.xi[2] - alone.xi).max() < 1e-12)
    True
    """
    if all(_is_same(medium, media[0]) for medium in media):
        return media[0]
    forms = {batch_form(medium) for medium in media}
    if len(forms) > 1 or None in forms:
        raise Refusal(
            "media in a batch must be of one law, a sum of dry and viscous terms",
            value=media,
        )
    index = np.repeat(np.arange(len(media)), counts)
    numbers = [term_numbers(medium) for medium in media]
    of_media = (np.stack(arrays, -1) for arrays in zip(*numbers))
    of_samples = TermNumbers(*(x[..., index] for x in of_media))
    return MediumBatch(index, tuple(media), of_samples)


def _is_same(a: Any, b: Any) -> bool:
    """Return whether two media are one, or immutable and equal."""
    return a is b or (type(a) is type(b) and is_frozen(a) and a == b)


def for_samples(medium: Any, function: Callable[[Any], Any]) -> np.ndarray:
    """Return the numbers function(medium) as an array (...), or (..., B) for the
    samples of a batch of media."""
    if not isinstance(medium, MediumBatch):
        return np.array(function(medium), float)
    of_media = np.stack([np.array(function(each), float) for each in medium.media], -1)
    return of_media[..., medium.index]


def members(medium: Any) -> tuple:
    """Return the media of a batch, or the medium alone."""
    return medium.media if isinstance(medium, MediumBatch) else (medium,)
