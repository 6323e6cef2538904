"""One fault of a sensor or the model is named with its size, and a sound log has no cause."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.logs import walk

from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.fit_checks.competing_causes import Cause, find_causes
from stribeck.core.friction import get_law
from stribeck.core.identify.whole_log import identify_whole_log

KNEE = 3


@pytest.fixture(scope="module")
def sound() -> WholeLogFit:
    robot, log = walk("biped", 6.0)
    settings = robot.settings.model_copy(update={"corrections": "calibration"})
    prepared = [prepare(replace(log, foot_wrench=None), robot, settings)]
    return identify_whole_log(prepared, robot, get_law("stribeck"), settings)


def _causes(sound: WholeLogFit, places: dict[int, float]) -> list[Cause]:
    """Find the causes after a change of the left sides in proportion to some corrections' columns."""
    known, change = sound.read.whole, np.zeros(len(sound.read.whole.right))
    for place, size in places.items():
        change[known.friction + place] = size
    square = known.square + float(change @ (2 * known.right + known.information @ change))
    changed = replace(known, right=known.right + known.information @ change, square=square)
    return find_causes(replace(sound, read=replace(sound.read, whole=changed))).rivals


def test_a_sound_log_has_no_cause(sound: WholeLogFit) -> None:
    assert _causes(sound, {}) == []


@pytest.mark.parametrize(
    ("kind", "part", "numbers", "size"),
    [
        ("zero", "zeros", [KNEE], 0.07),
        ("gain", "gains", [KNEE], 0.2),
        ("tilt", "tilts", [1], 0.08),
        ("base delay", "base_delay", [0], 0.03),
    ],
)
def test_a_single_error_is_named_with_its_size(kind, part, numbers, size, sound):
    layout = sound.fit.model.layout
    (cause,) = _causes(sound, {layout.places(part)[number]: size for number in numbers})
    assert cause.kind == kind
    assert cause.places in ((), tuple(numbers))
    assert np.abs(cause.values).max() == pytest.approx(size, rel=0.2)


@pytest.mark.parametrize("wrong", [pytest.param((KNEE,), marks=pytest.mark.long), (0, 5)], ids=["one", "two"])
def test_wrong_gains_are_named_where_gains_are_not_corrected(wrong: tuple[int, ...]) -> None:
    robot, log = walk("quadruped", 8.0)
    gains = np.ones(log.torque.shape[1])
    gains[list(wrong)] = 1.25
    prepared = prepare(replace(log, torque=log.torque * gains), robot, robot.settings)
    causes = find_causes(identify_whole_log([prepared], robot, get_law("stribeck"), robot.settings))
    found = [*causes.rivals, *causes.more_gains]
    assert {(cause.kind, *cause.places) for cause in found} == {("gain", place) for place in wrong}
    for cause in found:
        assert cause.values[0] == pytest.approx(0.2, abs=3 * cause.errors[0])  # of the logged torque


def test_all_masses_together_are_the_scale_of_the_torques(sound: WholeLogFit) -> None:
    layout = sound.fit.model.layout
    own = sound.fit.model.layout.inertial_parameters.ravel()
    rivals = _causes(sound, dict(zip(layout.places("bodies").tolist(), 0.3 * own, strict=True)))
    assert [cause.kind for cause in rivals] == ["scale"]


def test_errors_that_no_single_cause_explains_have_none(sound: WholeLogFit) -> None:
    layout, generator = sound.fit.model.layout, np.random.default_rng(1)
    places = layout.places("zeros")
    assert _causes(sound, dict(zip(places.tolist(), 0.03 * generator.standard_normal(len(places)), strict=True))) == []
