"""Scores of answers: errors relative to the ground truth, per joint."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.signal import butter, sosfiltfilt

from benchmarks.contest import schema
from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError

FAR = 0.25
"""Relative error of Coulomb or viscous friction above which a number marked as good is a confident error [1]."""
ERRORS = 3.0
"""Error, in standard errors, above which a number marked as good is a confident error [1]."""
NORMAL = 1.959964
"""Half width of a 95 % interval in standard errors [1]."""
REST = 0.01
"""Share of a joint's top speed below which it is at rest [1]."""
ENDS = 0.25
"""Duration excluded at both ends of a log, where filters settle [s]."""
DIGITS = 4

Rounded = Annotated[float, Field(allow_inf_nan=False)]


class Score(schema.Table):
    """Score of an answer; joints without an answer are missing.

    Attributes
    ----------
    contestant, robot, condition
        Name of the contestant, robot and condition of the case.
    asked
        Number of queried joints.
    offset
        Error of the offset by joint [N m].
    relative
        Absolute relative error of Coulomb and viscous friction, by parameter and joint [1].
    curve
        RMS difference between estimated and true curve, divided by the RMS of the true curve, by joint [1].
    covered
        Number of 95 % intervals that cover the truth, and of all.
    far, beyond
        Count of good numbers with a relative error above `FAR`, or an error above `ERRORS` standard errors.
    good, with_errors
        Count of good numbers, and of good numbers with a standard error.
    held_out
        RMS of the unexplained torque, divided by the torque that the model without friction leaves unexplained, by
        joint [1]; only for real robots.
    seconds, memory
        Processor time of the whole process per second of log [1], and its peak memory [MB].
    blank
        Reason for a missing or incomplete answer.
    """

    contestant: str
    robot: str
    condition: str
    asked: int
    version: str = ""
    needs: list[schema.Need] = []
    offset: dict[str, Rounded] = {}
    relative: dict[str, dict[str, Rounded]] = {}
    curve: dict[str, Rounded] = {}
    covered: tuple[int, int] = (0, 0)
    far: list[str] = []
    beyond: list[str] = []
    good: int = 0
    with_errors: int = 0
    held_out: dict[str, Rounded] = {}
    seconds: float | None = None
    memory: float | None = None
    blank: str | None = None


def score(contestant: str, case_folder: Path, truth_folder: Path, answered: Path) -> Score:
    """Score the answer that a contestant wrote to a folder.

    Raises
    ------
    SettingsError
        If the answer violates the schema.
    """
    case, truth = (
        schema.read(schema.Case, case_folder / schema.CASE),
        schema.read(schema.Truth, truth_folder / schema.TRUTH),
    )
    answer = schema.read(schema.Answer, answered / schema.ANSWER)
    schema.check_answer(answer, case, answered / schema.ANSWER)
    found = Score(
        contestant=contestant,
        robot=case.robot,
        condition=case.condition,
        asked=len(case.joints),
        version=answer.version,
        needs=answer.needs,
        blank=answer.blank,
    )
    found = found.model_copy(update=against_truth(case, truth.joints, answer.joints))
    if case.predict and (answered / schema.TORQUE).exists():
        held_out = torque_left(
            case, case_folder / schema.PREDICT, truth_folder / schema.TORQUE, answered / schema.TORQUE
        )
        found = found.model_copy(update={"held_out": held_out})
    return found


def against_truth(
    case: schema.Case, truth: Mapping[str, schema.KnownFriction], answered: Mapping[str, schema.JointAnswer]
) -> dict[str, object]:
    """Compute the score's fields for answered joints with known friction."""
    known = {joint: found for joint, found in answered.items() if joint in truth}
    pairs = [
        (name, joint, estimate, getattr(truth[joint], name))
        for joint, found in known.items()
        for name in schema.PARAMETERS
        if (estimate := getattr(found, name)) is not None
    ]
    relative: dict[str, dict[str, float]] = {name: {} for name in schema.PARAMETERS[:2]}
    offset, covered = dict[str, float](), list[bool]()
    curve, far, beyond = {}, [], []
    for name, joint, estimate, true in pairs:
        off = estimate.value - true
        relative.get(name, offset)[joint] = _rounded(abs(off / true if name in relative else off))
        if interval := _interval(estimate):
            covered.append(interval[0] <= true <= interval[1])
        if estimate.good and name in relative and abs(off) > FAR * true:
            far.append(f"{joint} {name}")
        if estimate.good and estimate.standard_error is not None and abs(off) > ERRORS * estimate.standard_error:
            beyond.append(f"{joint} {name}")
    for joint, found in known.items():
        if (shape := curve_of(found, np.array(case.joints[joint].velocity))) is not None:
            true_curve = np.array(truth[joint].curve)
            curve[joint] = _rounded(_rms(shape - true_curve) / _rms(true_curve))
    good = [estimate for _, _, estimate, _ in pairs if estimate.good]
    shares = {"good": len(good), "with_errors": sum(each.standard_error is not None for each in good)}
    return {
        "offset": offset,
        "relative": relative,
        "covered": (sum(covered), len(covered)),
        "curve": curve,
        "far": far,
        "beyond": beyond,
        **shares,
    }


def curve_of(found: schema.JointAnswer, velocity: Array) -> Array | None:
    """Compute R(v) without offset from an answer [N m]; None if the answer does not determine it."""
    if found.curve is not None:
        return np.array(found.curve)
    if found.coulomb is None or found.viscous is None:
        return None
    return np.asarray(found.coulomb.value * np.sign(velocity) + found.viscous.value * velocity)


def _interval(estimate: schema.Estimate) -> tuple[float, float] | None:
    if estimate.interval_95 or estimate.standard_error is None:
        return estimate.interval_95
    half = NORMAL * estimate.standard_error
    return estimate.value - half, estimate.value + half


def torque_left(case: schema.Case, motion: Path, truth: Path, predicted: Path) -> dict[str, float]:
    """Divide the torque unexplained by a prediction by the torque unexplained by the rigid model, per joint [1].

    Both are compared up to the case's frequency band, while the joint moves.

    Raises
    ------
    SettingsError
        If the shapes of prediction and log differ.
    """
    with np.load(motion) as log, np.load(truth) as known, np.load(predicted) as found:
        velocity, names = log["velocity"], [str(name) for name in log["joint_names"]]
        torque, rigid, said = known["torque"], known["rigid"], found["torque"]
    if said.shape != torque.shape:
        raise SettingsError(f"{predicted}: torque has shape {said.shape}; expected {torque.shape}, as in {motion}")
    assert case.band is not None
    lowpass = butter(4, 2 * case.band / case.rate, output="sos")
    cut = round(ENDS * case.rate)
    moving = (np.abs(velocity) > REST * np.percentile(np.abs(velocity), 99, axis=0))[cut:-cut]
    left, without = (sosfiltfilt(lowpass, torque - each, axis=0)[cut:-cut] for each in (np.nan_to_num(said), rigid))
    return {
        name: _rounded(_rms(left[moving[:, k], k]) / _rms(without[moving[:, k], k]))
        for k, name in enumerate(names)
        if np.isfinite(said[:, k]).all()
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
