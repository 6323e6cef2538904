"""The R^2 of the torque is of parts that the fit has not seen, at one bandwidth for all methods."""

import numpy as np
import pytest
from tests.arm import arm_log

from stribeck import Robot, Settings, identify
from stribeck.core.equations.friction_torque.preparation import prepare, quiet
from stribeck.core.equations.friction_torque.stage import FrictionTorqueStage
from stribeck.core.friction import get_law
from stribeck.core.identify import METHODS, Fitted
from stribeck.core.log import RobotLog


@pytest.fixture(scope="module")
def log(arm: Robot) -> RobotLog:
    return arm_log(arm, duration=20.0, rate=250.0)


def fitted(log: RobotLog, arm: Robot, method: str) -> tuple[Fitted, FrictionTorqueStage, Settings]:
    settings = Settings(method=method, law="stribeck")
    prepared = [prepare(log, arm, settings)]
    stage = FrictionTorqueStage(None, quiet, prepared[0], arm, settings)
    return METHODS[method].find(prepared, arm, get_law("stribeck"), settings, stage, quiet), stage, settings


def test_the_curve_fits_r2_is_of_its_held_out_blocks(log: RobotLog, arm: Robot) -> None:
    found, stage, settings = fitted(log, arm, "curve-fit")
    friction = stage(found.logs, arm, settings)
    (samples,) = found.unseen.samples(friction, found.logs, arm)
    for column in range(len(samples.joint_names)):
        blocks = np.unique(friction.samples.block[friction.samples.usable[:, column]])
        held_out = blocks[np.arange(len(blocks)) % settings.holdout == settings.holdout // 2]
        assert set(samples.block[samples.usable[:, column]]) == set(held_out)


def test_the_whole_logs_r2_is_of_segments_that_its_fit_has_not_seen(log: RobotLog, arm: Robot) -> None:
    found, stage, settings = fitted(log, arm, "whole-log")
    friction = stage(found.logs, arm, settings)
    nominal, corrected = found.unseen.samples(friction, found.logs, arm)
    parts = [(phase.first, phase.last) for phase in found.unseen.logs[0].support.phases]
    assert 0 < sum(last - first for first, last in parts) < 0.5 * len(log.time)
    rows = np.concatenate([log.time[first:last] for first, last in parts])
    for samples in (nominal, corrected):
        assert set(samples.time) <= set(rows)
    for name, fit in found.unseen.fits.items():
        assert not np.array_equal(fit.values, found.fits[name].values)
        np.testing.assert_allclose(fit.values[:2], found.fits[name].values[:2], rtol=0.2)


def test_all_methods_are_measured_at_one_bandwidth(log: RobotLog, arm: Robot) -> None:
    results = [identify(log, arm, Settings(), law="stribeck", method=method) for method in ("curve-fit", "whole-log")]
    assert len({dict(result.evidence.provenance)["Filter"] for result in results if result.evidence}) == 1
    for name in arm.joint_names:
        shares = [result.joints[name].torque_r2 for result in results]
        assert all(share is not None and share.best > 0.99 for share in shares)
