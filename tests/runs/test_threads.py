"""BLAS takes one thread while a question is answered, and then as many as before."""

import pytest
import scipy.linalg  # noqa: F401
from threadpoolctl import ThreadpoolController

import geomech
from geomech import scenes
from rft.core.refusal import Refusal

GLASS = scenes.load("three-link-glass").with_numerics(grid=5, phases=32)


def blas():
    """The threads of each library that multiplies matrices."""
    found = ThreadpoolController().select(user_api="blas")
    return [library["num_threads"] for library in found.info()]


@pytest.fixture
def two_threads():
    with ThreadpoolController().limit(limits=2, user_api="blas"):
        yield {2}


def test_a_question_takes_one_and_restores_them(two_threads):
    noted = set()
    over = {"gait.amplitude": [0.5, 0.7]}
    geomech.sweep(GLASS, over=over, progress=lambda _: noted.update(blas()))
    assert noted == {1}
    assert {*blas()} == two_threads


def test_a_refusal_restores_them(two_threads):
    def refuse(_):
        raise Refusal("no more")

    with pytest.raises(Refusal, match="no more"):
        geomech.sweep(GLASS, over={"gait.amplitude": [0.5, 0.7]}, progress=refuse)
    assert {*blas()} == two_threads
