"""Registration of user-defined laws that pass all checks."""

# ruff: noqa: ARG001, ARG005 - laws take what they do not use

from collections.abc import Iterator
from typing import Any
from unittest import mock

import pytest
from tests.extra import Quadratic

from stribeck import FrictionLaw, SettingsError, register_law
from stribeck.core.friction import LAWS, Parameter, get_law


@pytest.fixture(autouse=True)
def _laws_as_before() -> Iterator[None]:
    with mock.patch.dict(LAWS):
        yield


def law_with(**changed: Any) -> type[FrictionLaw]:
    """Make a law of Coulomb friction and drag, with some attributes replaced."""
    return type("Drag", (Quadratic,), {"name": "drag", **changed})


def test_a_law_is_known_by_its_name_once_it_is_registered() -> None:
    law = law_with()
    assert register_law(law) is law
    assert isinstance(get_law("drag"), law)
    with pytest.raises(SettingsError, match=r"the name 'drag' is taken; there are .*drag, lugre, stribeck"):
        register_law(law_with())


@pytest.mark.parametrize("name", list(LAWS))
def test_every_law_keeps_the_contract(name: str) -> None:
    """Checks derivatives, passivity, the linear form and bounds at random parameters."""
    law = LAWS.pop(name)
    assert register_law(law) is law


def pushing(self: FrictionLaw, velocity: Any, values: Any) -> Any:
    return -self.jacobian(velocity, values) @ values


def failing(self: FrictionLaw, velocity: Any, values: Any) -> Any:
    raise ZeroDivisionError("no drag")


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "auto": ({"name": "auto"}, "the name 'auto' is taken"),
    "name": ({"name": "My Law"}, "Drag.name is 'My Law'; expected lower-case words"),
    "title": ({"title": None}, "law 'drag' has no title"),
    "bounds": (
        {"parameters": (Quadratic.parameters[0], Parameter(name="drag", symbol="D", unit="1", lower=2.0, upper=1.0))},
        "drag lies from 2 to 1; expected a lower bound below",
    ),
    "raises": ({"torque": failing}, r"at coulomb = .*, drag = .*: raises ZeroDivisionError \(no drag\)"),
    "pushes": ({"torque": pushing}, "passivity violated, R = .* N m at -3 rad/s; expected the sign of the velocity"),
    "jumps": ({"jumps": False}, "jumps by .* N m at standstill; expected jumps = True"),
    "jacobian": (
        {"jacobian": lambda self, v, p: self.basis(v, {}) * 1.01, "torque": lambda self, v, p: self.basis(v, {}) @ p},
        "jacobian has dR/dcoulomb = -1.01 at -3 rad/s; expected -1, the difference quotient",
    ),
    "basis": (
        {"basis": lambda self, v, shape: 2 * Quadratic.basis(self, v, shape), "jacobian": Quadratic.basis},
        "basis and from_linear are not the law",
    ),
    "linear": ({"from_linear": lambda self, c, shape: c}, "from_linear gives .* = -1000; expected 0 to inf"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_law_that_breaks_the_contract_is_refused_in_one_sentence(case: str) -> None:
    changed, words = WRONG[case]
    before = dict(LAWS)
    with pytest.raises(SettingsError, match=rf"^register_law: .*{words}"):
        register_law(law_with(**changed))
    assert before == LAWS
