"""Scale of torques and external torques, by the model, its effort limits and the robot's weight."""

import json
from collections.abc import Collection, Mapping, Sequence
from math import ceil

import numpy as np
import pinocchio as pin
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from stribeck.audit.evidence import AuditData
from stribeck.audit.hypotheses import Hypothesis, compete, rivals
from stribeck.audit.motion import angle_between, gravity_torques, tilted
from stribeck.audit.regression import FEWEST, GainFit, fit
from stribeck.base.finding import Finding, Setting, rounded
from stribeck.base.typing import Array, IntArray
from stribeck.dynamics.root_motion import gravity_in_root_link
from stribeck.dynamics.state import root_quaternions
from stribeck.robot import Robot
from stribeck.robot.kinematics import link_of

BINS_FOR_GAIN = 75
"""Fewest bins for a gain [1]; errors of the model dominate shorter motions."""
SURE = 4.0
"""Deviation of a gain from one that counts as significant [standard errors]."""
NEAR = 1.6
"""Factor [1] up to which gains can be explained by wrong inertias."""
FAR = 5.0
"""Factor [1] of most joints' gains that makes the log unusable; effort limits and weights have smaller errors."""
MOST = 0.6
"""Share of the joints with evidence [1] above which a cause concerns all joints."""
UNITS = {1000.0: "N mm or mN m", 1e-3: "kN m", 100.0: "N cm", 0.10197: "kgf m", 10.197: "kgf cm", 10197.0: "gf cm"}
UNITS |= {8.851: "in lbf", 0.7376: "ft lbf", 141.6: "oz in"}
"""Factor relative to N m -> unit."""
EXACT, NEARBY = 0.03, 0.15
"""Largest logarithm of a factor relative to a unit's [1]: such that it is this unit, or may be. Units that are a power
of 1000 may be missed by more, because no other cause comes close."""
TILTED = float(np.deg2rad(2.0))
"""Smallest tilt of the base that is reported [rad]."""
SOME = 0.08
"""Smallest logarithm of a gain that is reported, if no other cause explains the torques as well [1]."""


def judged(found: GainFit, largest: float) -> bool:
    """Whether the model's variation is large relative to friction and noise, and not tiny relative to other joints'."""
    if found.share < 0.8 or found.leverage < 0.2 or found.swing < 2e-3 * largest:
        return False
    return abs(found.gain) * found.swing > found.friction_and_error


def concerns_most(count: int, examined: int, joints: Sequence[object]) -> bool:
    """Whether a cause concerns most of the examined joints, and at least two, unless the robot has one."""
    return count >= max(min(2, len(joints)), MOST * examined)


def _off(found: GainFit) -> bool:
    return not 1 / NEAR < abs(found.gain) < NEAR and abs(abs(found.gain) - 1) > SURE * found.error


def check_scales(evidence: AuditData, fits: dict[int, GainFit], joints: list[int]) -> list[Finding]:
    """Report torques of implausible size: gains that differ from one, exceeded bounds, levels.

    Friction adds to the model's torque, up to ten times the load with large gears: an RMS below 1/8 or above 100 times
    the model's has another cause.
    """
    off = {k: found for k, found in fits.items() if _off(found) and _surely(found)}
    competing = compete(evidence, joints) if all(found.gain > 0 for found in fits.values()) else []
    if causes := _causes(evidence, rivals(competing), bool(off)):
        return causes
    if concerns_most(len(off), len(fits), evidence.joints):
        return [_scale_of_all(evidence, {k: abs(found.gain) for k, found in off.items()})]
    bounded = _out_of_bounds(evidence, [k for k in joints if k not in off])
    if any(finding.stops for finding in bounded):
        return bounded
    levels = _levels(evidence, joints)
    if len(fits) < 2 and len(levels) >= 2 and not any(0.125 < level < 100.0 for level in levels.values()):
        return [_scale_of_all(evidence, levels)]
    if competing:
        return bounded
    off = {k: found for k, found in off.items() if evidence.moves(k)}  # a gear at rest can carry any torque
    if off:
        other = _of_rotors_and_tilts(evidence)
        off = {k: found for k, found in off.items() if (own := fit(evidence, k, beside=other[:, k])) and _off(own)}
    if not off or len(evidence.rows) < BINS_FOR_GAIN:
        return bounded
    gains = {k: (found.gain, found.error) for k, found in off.items()}
    return [_gain_finding(evidence, gains), *bounded]


def _gain_finding(evidence: AuditData, gains: Mapping[int, tuple[float, float]]) -> Finding:
    own = gains.items()
    gear = all(not 1 / 12 < abs(gain) < 12 for gain, _ in gains.values())
    return Finding.of(
        "torque-gain",
        {
            evidence.joints[k]: f" ({gain:.3g} ± {2 * error:.1g} times the model's)"
            for k, (gain, error) in gains.items()
        },
        gear=", as if a gear ratio were missing" if gear else "",
        settings=[scale_setting(evidence.robot, {evidence.joints[k]: 1 / abs(gain) for k, (gain, _) in own})],
    )


def _causes(evidence: AuditData, found: Sequence[Hypothesis], off: bool) -> list[Finding]:
    """Report the only cause that explains the torques, or a list of causes; empty if its effect is small."""
    if not any(large := [_large(evidence, each, off) for each in found]):
        return []
    found = [each for each, own in zip(found, large, strict=True) if own or each.kind == "body"]
    if {each.kind for each in found} == {"gain", "common gain"}:
        found = [each for each in found if each.kind == "common gain"]
    if len(found) > 1:
        return [Finding.of("several-causes.audit", causes="; ".join(_words(evidence, each) for each in found))]
    cause, names = found[0], evidence.joints
    if cause.kind == "gravity":
        return [tilted(evidence, evidence.robot.gravity + cause.values)]
    if cause.kind == "body":
        return [_body_finding(evidence, cause)]
    values = np.resize(1 + cause.values, len(cause.places))
    gains = {k: float(gain) for k, gain in zip(cause.places, values, strict=True) if abs(np.log(gain)) > SOME}
    if cause.kind == "common gain" or len(gains) == len(names) > 1:
        return [_scale_of_all(evidence, gains)]
    errors = {k: own.error if (own := fit(evidence, k)) else 0.0 for k in gains}
    return [_gain_finding(evidence, {k: (gain, errors[k]) for k, gain in gains.items()})]


def _large(evidence: AuditData, cause: Hypothesis, off: bool) -> bool:
    """Whether a cause changes friction noticeably; bodies are corrected by the fit unless they look like a gain."""
    if cause.kind == "gravity":
        return angle_between(evidence.robot.gravity, evidence.robot.gravity + cause.values) > TILTED
    if cause.kind == "body":
        return off
    for k, change in zip(cause.places, np.resize(cause.values, len(cause.places)), strict=True):
        # errors of all bodies can imitate a gain; a real one also shows in the fit of its torque
        own = fit(evidence, k)
        if abs(np.log1p(change)) > SOME and (own is None or abs(np.log(abs(own.gain))) > SOME / 2):
            return True
    return False


def _words(evidence: AuditData, cause: Hypothesis) -> str:
    if cause.kind == "gravity":
        turned = angle_between(evidence.robot.gravity, evidence.robot.gravity + cause.values)
        return f"a base that is tilted by {np.rad2deg(turned):.2g}°"
    if cause.kind == "body":
        return f"a body: {_body_words(evidence, cause)}"
    if cause.kind == "common gain":
        factor = float(1 + cause.values[0])
        return f"one gain of all torques ({factor:.3g}): {_possible_causes(factor)}"
    each = zip(cause.places, cause.values.tolist(), strict=True)
    return f"gains of torques ({', '.join(f'{evidence.joints[k]} {1 + value:.3g}' for k, value in each)})"


def _body_words(evidence: AuditData, cause: Hypothesis) -> str:
    tree, joint = evidence.robot.tree, cause.places[0] + 1
    own, more = tree.model.inertias[joint], float(cause.values[0])
    if abs(more) < 0.05 * own.mass:  # gravity does not show the mass of a body that only turns
        away = 1e3 * float(np.linalg.norm(cause.values[1:4])) / own.mass
        return f"{link_of(tree, joint).name} appears to have its center of mass {away:.0f} mm elsewhere"
    return f"{link_of(tree, joint).name} appears {abs(more):.2g} kg {'heavier' if more > 0 else 'lighter'}"


def _body_finding(evidence: AuditData, cause: Hypothesis) -> Finding:
    """Report a body that is heavier or lighter than in the model; what is heavier can be stated as a payload."""
    robot, (mass, *moment), joint = evidence.robot, cause.values[:4].tolist(), cause.places[0] + 1
    if mass < 0.05 * robot.tree.model.inertias[joint].mass:
        return Finding.of("bodies-differ.audit", evidence=_body_words(evidence, cause))
    link = link_of(robot.tree, joint)
    com = ", ".join(f"{value:.4f}" for value in link.placement.actInv(np.array(moment) / mass))
    end = ceil(float(np.ptp(evidence.prepared.log.time)))
    table = f"{{ link = {json.dumps(str(link.name))}, mass = {mass:.4g}, com = [{com}], spans = [[0, {end}]] }}"
    return Finding.of("payload.audit", evidence=_body_words(evidence, cause), tables=table)


def _of_rotors_and_tilts(evidence: AuditData) -> Array:
    """Compute the torques of other errors: of a missing rotor per kg m^2, and of an IMU's tilt per rad.

    Shape (B, k, 0 to 4): rotors in the torques of link-side sensors, where friction's shapes have none, and three axes.
    """
    log, gravity = evidence.prepared.log, evidence.robot.gravity
    other = evidence.acceleration[:, :, None]
    if evidence.robot.torque_source != "link_side_sensor":
        other = other[..., :0]
    if evidence.robot.base != "floating" or log.base_orientation is None:
        return other
    axes = Rotation.from_quat(log.base_orientation[evidence.rows]).as_matrix()
    turned = np.cross(axes.transpose(0, 2, 1), gravity)  # gravity's change in the world for each axis
    tilted = np.einsum("bkw,baw->bka", gravity_torques(evidence, evidence.robot, np.eye(3)), turned)
    return np.dstack([other, tilted])


def _surely(found: GainFit) -> bool:
    """Whether the gain is wrong even if all of the error is in the model (reverse regression)."""
    other = abs(found.gain) / found.share
    return not 1 / NEAR < other < NEAR and (other > 1) == (abs(found.gain) > 1)


def _levels(evidence: AuditData, joints: list[int]) -> dict[int, float]:
    """Divide the RMS of the torque by the model's, for the joints with the largest loads and nonzero torque."""
    model = np.array([_rms(evidence.model[:, k]) for k in joints])
    if len(model) == 0 or not model.max() > 0:
        return {}
    carrying = [(k, size) for k, size in zip(joints, model.tolist(), strict=True) if size > 0.2 * model.max()]
    levels = {k: _rms(evidence.torque[np.isfinite(evidence.model[:, k]), k]) / size for k, size in carrying}
    return {k: level for k, level in levels.items() if level > 0}


def _rms(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else 0.0


def _scale_of_all(evidence: AuditData, gains: dict[int, float]) -> Finding:
    """Report torques in another unit, or factors that are no unit with all causes that they may have."""
    middle = float(np.median(list(gains.values())))
    common = all(abs(np.log(gain / middle)) < 0.3 for gain in gains.values())
    unit = _unit(middle) if common else None
    guess = f"as if they were in {UNITS[unit]}" if unit else "by one factor" if common else "with a factor per joint"
    return Finding.of(
        "torque-scale" if unit else "torque-scale.unclear",
        [evidence.joints[k] for k in gains],
        stops=not 1 / FAR < middle < FAR,
        factor=middle,
        guess=guess,
        evidence=", ".join(f"{evidence.joints[k]} {gain:.3g}" for k, gain in list(gains.items())[:6]),
        settings=[scale_setting(evidence.robot, dict.fromkeys(evidence.joints, 1 / (unit or 1.0)))],
        causes=_possible_causes(middle if common else None),
    )


def _possible_causes(factor: float | None) -> str:
    """List causes of a factor of all torques that is no unit; None if each joint has its own factor."""
    causes = ['currents (unit = "A" in [log.torque])', "torques before the gear (their scale is the gear ratio)"]
    if factor is None:
        return ", ".join([*causes, "or shares of each joint's rated torque"])
    causes += ['positions in another unit (unit = "turn" or "deg" in [log.position])', "or wrong masses of the model"]
    near = [
        f"{unit} (scale = {1 / ratio:.4g})" for ratio, unit in UNITS.items() if abs(np.log(factor / ratio)) < NEARBY
    ]
    return ", ".join([*near, *causes])


def _unit(factor: float) -> float | None:
    """Find the unit in `UNITS` that makes torques larger by a factor; None if none does."""
    nearest = min(UNITS, key=lambda ratio: abs(np.log(factor / ratio)))
    return nearest if abs(np.log(factor / nearest)) < (NEARBY if nearest in (1e3, 1e-3) else EXACT) else None


def _out_of_bounds(evidence: AuditData, joints: list[int]) -> list[Finding]:
    """Report torques that contradict the robot's weight or the model's effort limits.

    These limit the scale of joints whose model torque is too small a share of the torque for a gain.
    """
    carried = _weight_carried(evidence)
    if carried is not None and not 1 / FAR < carried < FAR:
        unit = _unit(carried)
        if unit is None:
            causes = _possible_causes(carried)
            return [Finding.of("torque-scale.weight-unclear", evidence.joints, factor=carried, causes=causes)]
        setting, named = scale_setting(evidence.robot, dict.fromkeys(evidence.joints, 1 / unit)), UNITS[unit]
        return [Finding.of("torque-scale.weight", evidence.joints, factor=carried, unit=named, settings=[setting])]
    reached = {k: times for k, times in _over_limits(evidence).items() if k in joints}
    over = {evidence.joints[k]: f" ({times:.3g} times)" for k, times in reached.items() if times > FAR}
    if not over:
        return []
    most = concerns_most(len(over), len(reached), evidence.joints)
    setting = scale_setting(evidence.robot, dict.fromkeys(evidence.joints if most else over, 1e-3))
    check = "torque-scale.limits" if most else "torque-gain.limits"
    return [Finding.of(check, over, stops=most, settings=[setting])]


def _over_limits(evidence: AuditData) -> dict[int, float]:
    """Divide the largest torque of each joint by its effort limit.

    Limits below the torque that the motion requires are ignored.
    """
    limits = evidence.robot.effort_limits[evidence.robot.torque_controlled]
    if len(evidence.rows) < FEWEST:
        return {}
    needed = np.percentile(np.nan_to_num(np.abs(evidence.model)), 99, axis=0)
    reached = np.percentile(np.abs(evidence.torque), 99, axis=0)
    return {k: float(reached[k] / limits[k]) for k in np.flatnonzero(np.isfinite(limits) & (limits > needed)).tolist()}


def _weight_carried(evidence: AuditData) -> float | None:
    """Estimate the share of the robot's weight that the torques of standing legs carry; None if undetermined.

    The wrenches W on the feet are unknown, but `S^T tau = g - J^T W` at rest. With P the null space of J (and of the
    joints whose torque is unknown) `P^T S^T tau = P^T g`: one factor is fitted to 200 postures. It is undetermined if
    the cosine between the two sides is below 0.7.
    """
    robot, log = evidence.robot, evidence.prepared.log
    if robot.base == "fixed":
        return None
    feet_of = [[foot for foot in name.split("+") if foot in robot.contacts] for name in evidence.support_names]
    standing = np.array([bool(feet) for feet in feet_of], dtype=bool)
    bins = np.flatnonzero(standing[evidence.support]) if len(standing) else np.empty(0, dtype=np.int64)
    if len(bins) < FEWEST:
        return None
    bins = bins[:: -(-len(bins) // 200)]
    gravity = _gravity(evidence, bins, feet_of)
    model = pin.Model(robot.tree.model)
    data = model.createData()
    position, torque = log.position[evidence.rows[bins]], np.zeros(model.nv)
    place = 6 + np.argsort(robot.tree.columns)[robot.torque_controlled]
    unknown = np.delete(np.eye(model.nv), [*range(6), *place.tolist()], axis=0)
    product = needed = carried = 0.0
    for row, k in enumerate(bins.tolist()):  # dense algebra of one posture at a time
        configuration = pin.neutral(model)
        configuration[7:] = position[row, robot.tree.columns]
        model.gravity.linear = gravity[row]
        weight = pin.computeGeneralizedGravity(model, data, configuration)
        pin.computeJointJacobians(model, data, configuration)
        pin.updateFramePlacements(model, data)
        jacobians = [
            pin.getFrameJacobian(model, data, model.getFrameId(contact.frame), pin.ReferenceFrame.LOCAL)[: contact.size]
            for contact in (robot.contacts[foot] for foot in feet_of[evidence.support[k]])
        ]
        free = null_space(np.vstack([*jacobians, unknown]))
        torque[place] = evidence.torque[k]
        own, asked = free.T @ torque, free.T @ weight
        product, needed, carried = product + own @ asked, needed + asked @ asked, carried + own @ own
    if needed == 0 or product < 0.7 * np.sqrt(needed * carried):
        return None
    return float(product / needed)


def _gravity(evidence: AuditData, bins: IntArray, feet_of: list[list[str]]) -> Array:
    """Compute gravity in root link coordinates [m/s^2], shape (B, 3); without an orientation a foot is level."""
    robot, log, rows = evidence.robot, evidence.prepared.log, evidence.rows[bins]
    if log.base_orientation is not None:
        turned = root_quaternions(robot, log.position[rows], log.base_orientation[rows])
        return gravity_in_root_link(turned, robot.gravity)
    first = [feet_of[support][0] for support in evidence.support[bins]]
    return np.array(
        [
            robot.foot_pose(foot, position[None])[0][0] @ robot.gravity
            for foot, position in zip(first, log.position[rows], strict=True)
        ]
    )


def check_external(evidence: AuditData, left_out: Collection[str] = ()) -> list[Finding]:
    """Report external torques with a wrong sign or size; joints that are omitted have been reported.

    The measured torque minus friction and inverse dynamics is the opposite of the external torque, if friction resists;
    otherwise the measured torque is wrong.
    """
    off: dict[str, GainFit] = {}
    for k, name in enumerate(evidence.joints):
        external = evidence.external[:, k]
        if name in left_out or not external.any():
            continue
        dynamics = evidence.model[:, k] + external
        found = fit(evidence, k, model=-external, torque=evidence.torque[:, k] - dynamics)
        if found is None or not judged(found, found.swing) or found.dissipation < 0:
            continue
        if not 1 / NEAR < found.gain < NEAR and abs(found.gain - 1) > SURE * found.error:
            off[name] = found
    if not off:
        return []
    return [
        Finding.of(
            "external-torque",
            {
                name: f" ({found.gain:.3g} ± {2 * found.error:.1g} times the expected torque)"
                for name, found in off.items()
            },
            stops=len(off) >= MOST * len(evidence.joints),
            settings=[
                scale_setting(evidence.robot, {name: each.gain for name, each in off.items()}, "external_torque")
            ],
        )
    ]


def scale_setting(robot: Robot, factors: Mapping[str, float], channel: str = "torque") -> Setting:
    """Make the setting that multiplies a channel by a factor per joint, in addition to the present scale.

    It is one number if all joints with a torque have the same factor, otherwise one value per joint name of the log;
    without a value if the present scale is a list in the log's joint order.
    """
    table, present = f"log.{channel}", getattr(robot.log_table, channel).scale
    joints = [robot.joint_names[column] for column in robot.torque_controlled]
    if isinstance(present, list):
        return Setting(table, "scale")
    if set(factors) == set(joints) and len(set(factors.values())) == 1 and not isinstance(present, dict):
        return Setting(table, "scale", rounded(present * next(iter(factors.values())), 4))
    logged = {model: name for name, model in robot.log_table.joint_names.items()}
    scales = {}
    for joint in joints:
        name = logged.get(joint, joint)
        before = present.get(name, 1.0) if isinstance(present, dict) else present
        if joint in factors or before != 1:
            scales[name] = rounded(before * factors.get(joint, 1.0), 4)
    return Setting(table, "scale", scales)
