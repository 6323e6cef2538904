"""A part of a long log tells the curves nearly, and the rest of it in fewer coefficients says what the whole would."""

import pytest
from tests.whole_log.logs import arm_log

from stribeck import Robot, identify
from stribeck.settings import Settings
from stribeck.whole_log import estimate
from stribeck_simulation.sensors.measure import with_noise


@pytest.mark.parametrize("law", [pytest.param("stribeck", marks=pytest.mark.long), "auto"])
def test_the_rest_of_a_log_says_what_the_whole_would(law: str, arm: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    log = with_noise(arm_log(40.0), position=5e-5, torque=0.2, seed=2)
    whole = identify(log, arm, Settings(law=law))
    rests: list[int] = []

    def counted(*arguments: object) -> object:
        rests.append(sum(map(len, arguments[4])))  # type: ignore[call-overload]
        return with_rest(*arguments)  # type: ignore[arg-type]

    with_rest = estimate._with_rest
    monkeypatch.setattr(estimate, "_with_rest", counted)
    monkeypatch.setattr(estimate, "SELECTION_SEGMENTS", 16)
    for name, joint in identify(log, arm, Settings(law=law)).joints.items():
        assert joint.parameters.keys() == whole.joints[name].parameters.keys()
        assert joint.verdict == "identified"
        for key, own in whole.joints[name].parameters.items():
            off = (joint.parameters[key].value - own.value) / own.standard_error
            assert abs(off) < 0.1, (name, key)
            assert joint.parameters[key].standard_error == pytest.approx(own.standard_error, rel=0.03), (name, key)
    assert sum(rests) > 0
