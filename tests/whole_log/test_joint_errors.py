"""Errors of friction and bodies together: draws from what a result tells are those from the fit's own covariance."""

import numpy as np
import pytest
from tests.arm import arm_log, write_arm
from tests.result.made import of_one_log

from stribeck import Robot, Settings, identify
from stribeck.app.exporters.posterior import drawn
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.uncertainty.intervals import joint_coordinates
from stribeck.core.identify import whole_log
from stribeck.core.judgement.curve_fit.problem import to_external
from stribeck.core.result import Result
from stribeck.core.robot.inertial_parameters import SIZE, pseudo_inertia, shape_coordinates
from stribeck.simulation.sensors.measure import with_noise

DRAWS = 3000


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[WholeLogFit, Result]:
    """Return the fit to a short noisy log, and its result."""
    robot = Robot.from_file(write_arm(tmp_path_factory.mktemp("arm")))
    log = with_noise(arm_log(robot, duration=8.0, rate=500.0), position=5e-5, torque=0.2, seed=1)
    own, fits = whole_log.identify_whole_log, []

    def kept(*arguments: object) -> WholeLogFit:
        fits.append(own(*arguments))  # type: ignore[arg-type]
        return fits[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(whole_log, "identify_whole_log", kept)
        result = identify(log, robot, Settings(law="coulomb-viscous", corrections="inertia"))
    return fits[-1], result


def of_fit(found: WholeLogFit, result: Result) -> np.ndarray:
    """Return draws of friction and bodies from the covariance of the fit's coordinates, shape (DRAWS, k)."""
    drawn_x = np.random.default_rng(0).multivariate_normal(found.fit.x, found.fit.covariance, DRAWS, method="eigh")
    columns = []
    for joint, name in enumerate(found.joints):
        own = joint_coordinates(found, joint)
        logs = np.array([parameter.logarithmic for parameter in own.parameters])
        values = to_external(drawn_x[:, own.places], np.tile(logs, (DRAWS, 1)))
        kept = [parameter.name in result.joints[name].parameters for parameter in own.parameters]
        columns.append(values[:, kept])
    bodies = drawn_x[:, found.fit.layout.part("bodies")].reshape(DRAWS, -1, SIZE)
    columns.append(np.stack([found.fit.model.bodies.log_cholesky(each).ravel() for each in bodies]))
    return np.concatenate(columns, axis=1)


def of_result(result: Result) -> np.ndarray:
    """Return the same from what the result tells."""
    rows = []
    for each in drawn(result, DRAWS):
        row = [parameter.value for joint in each.joints.values() for parameter in joint.parameters.values()]
        for body in each.corrections.bodies.values():
            mass, inertia = body.mass[1], body.inertia[1]
            shape = shape_coordinates(pseudo_inertia(np.array([mass, 0.0, 0.0, 0.0, *inertia])))
            row += [np.log(mass), *body.centre_of_mass[1], *shape]
        rows.append(row)
    return np.array(rows)


def test_draws_of_a_result_are_those_of_the_fit(found: tuple[WholeLogFit, Result]) -> None:
    fit, result = found
    one, other = of_fit(fit, result), of_result(of_one_log(result))
    assert np.isfinite(other).all()
    freely = other.std(axis=0) > 0
    np.testing.assert_allclose(other[:, freely].std(axis=0), one.std(axis=0)[freely], rtol=0.1)
    off = np.corrcoef(other[:, freely].T) - np.corrcoef(one[:, freely].T)
    assert np.sqrt(np.mean(off**2)) < 0.03
    assert np.abs(off).max() < 0.15
