"""Shared samples of two logs are found regardless of the stamps; other samples never match."""

from dataclasses import replace

import numpy as np
import pytest
from tests.log.readers.formats import synthetic_log

from stribeck.errors import LogError
from stribeck.log.overlap import prints, refuse_overlap


def noisy(seed, samples=4000):
    log = synthetic_log(samples)
    return replace(log, position=log.position + np.random.default_rng(seed).normal(0, 1e-4, log.position.shape))


def refuse(own, other):
    refuse_overlap(prints(own), "b.npz", [(prints(other), "a.npz")])


@pytest.mark.parametrize("rows", [slice(None), slice(3000, None), slice(1000, 2000)])
def test_samples_given_twice(rows):
    log = noisy(1)
    part = log.take(rows)
    for other in (part, replace(part, time=part.time - part.time[0] + 1e6)):
        with pytest.raises(LogError, match=r"b\.npz: .* % of its samples are also in a\.npz; use each"):
            refuse(other, log)


def test_halves_that_overlap_a_little():
    log = noisy(1)
    with pytest.raises(LogError, match="2 % of its samples"):
        refuse(log.take(slice(1900, None)), log.take(slice(0, 2000)))
    refuse(log.take(slice(1990, None)), log.take(slice(0, 2000)))  # some messages that a recorder repeated


def test_a_joint_that_repeats_itself_and_whose_signals_are_coarse():
    rng = np.random.default_rng(3)
    time = np.arange(20_000) / 1000
    logs = []
    for _ in range(2):
        log = synthetic_log(len(time), joints=("hip",))
        position = np.round(np.sin(2 * np.pi * time)[:, None] * 650) / 650
        torque = np.round((np.cos(2 * np.pi * time)[:, None] + rng.normal(0, 0.02, (len(time), 1))) * 100) / 100
        logs.append(replace(log, position=position, torque=torque))
    refuse(*logs)


def test_standing_still_is_no_overlap():
    still = synthetic_log(3000)
    still = replace(still, position=np.zeros((3000, 3)), torque=np.ones((3000, 3)))
    assert len(prints(still)) == 0
    refuse(still, still)
