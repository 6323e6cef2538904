"""Small logs give the frozen numbers; `python -m studies.golden` compares all logs to nine digits."""

import pytest
from studies.golden import METHODS, QUICK, differences, frozen, read


@pytest.mark.parametrize("name", QUICK)
def test_numbers_are_the_frozen_ones(name: str) -> None:
    before, now = read()[name], frozen(QUICK[name], METHODS.get(name, ()))
    for numbers in (before, now):
        numbers["log"] = {array: total for array, (total, _) in numbers["log"].items()}
    assert not list(differences(before, now, 1e-4, name))  # other processors round differently
