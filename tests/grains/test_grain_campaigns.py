"""Campaigns of experiments in grains: their rows, without LAMMPS."""

from pathlib import Path

import numpy as np
import pytest

from figures.grains.campaigns import grains
from rft.grains import Experiment, Run


def run_with_random_forces(experiment, store):
    """Return a run in which the body stays and forces are random."""
    n = 400
    t = experiment.duration * np.arange(1, n + 1) / n
    rng = np.random.default_rng(1)
    profile = rng.normal(size=(n, len(experiment.body.radius), 3))
    return Run(
        t,
        force=profile.sum(1),
        moment=0 * t,
        profile=profile,
        arc_length=experiment.body.arc_length,
        pose=np.zeros((n, 3)),
        centre=np.zeros((n, 2)),
        alpha=np.zeros((n, 0)),
        work=t,
        kinetic=0 * t,
        energy=np.zeros((2, 2)),
        overlaps=np.ones((2, 2)),
        facts={"packing": 0.6, "surface": 0.05},
    )


@pytest.mark.parametrize("name", grains.CAMPAIGNS)
def test_every_experiment_of_a_campaign_gives_its_columns(name, monkeypatch):
    monkeypatch.setattr(Experiment, "run", run_with_random_forces)
    monkeypatch.setattr(grains, "BEDS", (1,))
    head, *rows = grains.CAMPAIGNS[name](Path("store"))
    assert rows
    assert {len(row) for row in rows} == {len(head)}
