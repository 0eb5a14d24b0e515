"""What a refusal tells: the words that it names, and which facts it has."""

from __future__ import annotations

import contextlib

import pytest
from words import in_order

from rft.core.refusal import Refusal

FACTS = ("where", "value", "because", "instead")


def facts(refusal: Refusal) -> list[str]:
    """Return which facts a refusal has beside what is wrong."""
    given = {
        "where": bool(refusal.where),
        "value": refusal.value is not ...,
        "because": bool(refusal.because),
        "instead": bool(refusal.instead),
    }
    return [fact for fact in FACTS if given[fact]]


@contextlib.contextmanager
def refuses(said: str, within: str = ""):
    """Expect a refusal in one line; none where ``said`` is "".

    said: words that it names, in their order, and after a | its facts, such as
    "alpha_2 unit rads | where instead". within: what it names before all that."""
    if not said:
        yield
        return
    named, _, told = said.partition(" |")
    with pytest.raises(Refusal, match=in_order(f"{within} {named}")) as caught:
        yield
    assert "\n" not in str(caught.value)
    assert " ".join(facts(caught.value)) == told.strip(), str(caught.value)
