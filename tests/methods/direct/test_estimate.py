"""What direct least squares say of logs that hold next to nothing (docs/direct.md, 2)."""

import numpy as np
import pytest

from stribeck.methods.direct.estimate import Regression, fit_direct
from stribeck.methods.direct.rows import DirectRows

BODY = np.array([[2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.1]])
"""Mass, first moments and inertia."""


@pytest.mark.parametrize("regression", ["ordinary", "weighted", "robust"])
def test_torques_that_are_the_models_to_the_last_digit_have_no_friction(regression: Regression) -> None:
    generator = np.random.default_rng(0)
    velocity = generator.normal(size=400)
    columns = np.column_stack([generator.normal(size=(400, 10)), velocity, np.sign(velocity)])
    rows = DirectRows(
        left=np.zeros((400, 1)),
        columns=columns[:, None],
        effects=np.zeros((400, 0, 1)),
        used=np.ones((400, 1), dtype=bool),
        kind=np.zeros(1, dtype=np.int64),
        clusters=np.stack([np.arange(400) // 20, np.full(400, -1)]),
    )
    found = fit_direct([rows], BODY, 100.0, np.full(2, 100.0), np.ones(2, dtype=bool), regression)
    np.testing.assert_allclose(found.coefficients, 0.0, atol=1e-9)
    assert np.all(np.diag(found.covariance) > 0)
