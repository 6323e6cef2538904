"""A package that adds a reader, a law and an export target by entry points, as docs/extending.md explains."""

import numpy as np

from stribeck import FrictionLaw
from stribeck.app.exporters.targets import Target
from stribeck.core.friction import Parameter
from stribeck.io.readers.tables import open_csv


class Quadratic(FrictionLaw):
    name, title, jumps = "quadratic", "Coulomb and drag", True
    parameters = (
        Parameter(name="coulomb", symbol="Fc", unit="N m"),
        Parameter(name="drag", symbol="D", unit="N m s^2/rad^2"),
    )

    def torque(self, velocity, values):
        return self.jacobian(velocity, values) @ values

    def jacobian(self, velocity, _):
        return self.basis(velocity, {})

    def basis(self, velocity, _):
        return np.column_stack([np.sign(velocity), velocity * np.abs(velocity)])

    def from_linear(self, coefficients, _):
        return np.maximum(coefficients, 0.0)


def open_txt(path, table):
    return open_csv(path, table)


TEXT = Target(forms={"all": None}, suffix=".txt", text=lambda request: " ".join(request.joints))
POINTS = {"laws": "quadratic = extra:Quadratic", "readers": ".txt = extra:open_txt", "targets": "names = extra:TEXT"}
