"""Findings of competing causes, each with the setting that corrects it."""

from collections.abc import Sequence

import numpy as np

from stribeck.audit.scale import scale_line
from stribeck.base.finding import Finding
from stribeck.base.typing import Array
from stribeck.robot import Robot
from stribeck.whole_log.equations.corrections import CORRECTIONS
from stribeck.whole_log.equations.corrections.correction import CorrectionLayout
from stribeck.whole_log.fit_checks.competing_causes import Cause, Causes


def cause_findings(causes: Causes, robot: Robot, joints: Sequence[str], model: CorrectionLayout) -> list[Finding]:
    """Report the cause, the causes that explain the residual about equally well, or all wrong gains."""
    findings = [_finding(cause, robot, joints, model) for cause in (*causes.rivals, *causes.more_gains)]
    if len(findings) < 2:
        return findings
    check = "several-causes.gains" if causes.more_gains else "several-causes"
    named = tuple(dict.fromkeys(joint for finding in findings for joint in finding.joints))
    return [Finding.of(check, named, causes="; ".join(f"{each.check}: {each.text}" for each in findings))]


def _finding(cause: Cause, robot: Robot, joints: Sequence[str], model: CorrectionLayout) -> Finding:
    """Report one cause; numbers of joints and bodies refer to the names."""
    size, error = float(cause.values[0]), 2 * float(cause.errors[0])
    names = [joints[place] for place in cause.places] if cause.kind in ("gain", "rotor", "delay") else []
    if cause.kind in ("scale", "gain"):
        factor = np.exp(size) if cause.kind == "scale" else 1 / (1 - size)
        check, own = ("torque-gain.fit", names) if names else ("torque-scale.fit", _measured(robot))
        setting = scale_line(robot, dict.fromkeys(own, 1 / factor))
        return Finding.of(check, own, factor=factor, error=error * factor, setting=setting, stops=False)
    if correction := next((each for each in CORRECTIONS if each.kind == cause.kind), None):
        assert correction.finding is not None, "a kind of a cause has a finding"
        return correction.finding(cause.places, cause.values, cause.errors, robot)
    if cause.kind == "delay":
        return Finding.of("friction-delay", names, evidence=f"{names[0]} ({1e3 * size:.2g} ms)")
    if cause.kind == "rotor":
        each = zip(names, cause.values.tolist(), cause.errors.tolist(), strict=True)
        sure = {name: f" ({value:.2g} ± {2 * error:.1g} kg m²)" for name, value, error in each if value > 4 * error}
        return Finding.of("rotor-missing", sure)
    (place,) = cause.places
    body = model.bodies[place]
    more = float(model.inertial_parameters[place, 0]) * float(np.expm1(size))
    evidence = f"{body} appears {body_text(more, cause.values[1:])}"
    return Finding.of("bodies-differ", [body], evidence=evidence)


def body_text(more: float, away: Array) -> str:
    """Describe how a body differs from the model: by a mass [kg], and by a shift of its center of mass [m]."""
    heavier = f"{abs(more):.2g} kg {'heavier' if more > 0 else 'lighter'}"
    return f"{heavier} and its center of mass {1e3 * float(np.linalg.norm(away)):.0f} mm elsewhere"


def _measured(robot: Robot) -> list[str]:
    return [robot.joint_names[column] for column in robot.torque_controlled]
