"""Corrections of the model: inertial parameters of bodies and payloads, rotor inertias, differences between logs."""

import math

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import FRICTION_OF_LOGS
from stribeck.core.equations.whole_log.corrections.correction import Correction, Found, Layout, Signals
from stribeck.core.robot.inertial_parameters import SIZE, carried
from stribeck.core.settings import Priors

BODIES = Correction(
    name="bodies", columns=lambda signals: signals.by_inertia, size=lambda layout: layout.inertial_parameters.size
)
"""Inertial parameters of bodies; their coordinates are nonlinear (`model/bodies.py`)."""


def _by_payloads(signals: Signals) -> Array:
    """Select the derivatives by the payloads' parameters in their links' frames, zero of absent ones."""
    robot, rows = signals.mode.robot, signals.by_inertia.shape[:2]
    derivatives = np.zeros((*rows, len(robot.payloads), SIZE))
    for k, payload in enumerate(robot.payloads):
        frame = robot.tree.model.frames[robot.tree.model.getFrameId(payload.link)]
        if signals.carried[k]:
            block = signals.by_inertia[:, :, SIZE * (frame.parentJoint - 1) : SIZE * frame.parentJoint]
            derivatives[:, :, k] = block @ carried(frame.placement.homogeneous)
    return derivatives.reshape(*rows, -1)


def _payload_scales(_: Priors, layout: Layout) -> Array:
    """Compute prior errors relative to the mass: mass [1], first moments [m], second moments [m^2]."""
    mass, first, second = 0.05, 0.02, 0.01
    return np.outer(layout.payloads, np.repeat([mass, first, second], [1, 3, 6])).ravel()


def _by_rotors(signals: Signals) -> Array:
    rotors = list(signals.layout.rotors)
    turned = signals.state.acceleration[:, signals.mode.joints] @ signals.on_joints[:, rotors]
    return np.asarray(turned[:, None] * signals.acting[:, rotors])


def _rotor_scales(priors: Priors, layout: Layout) -> Array:
    guess = 2.0  # relative error of a rotor inertia that only the model states [1]: many are off by a factor of three
    share = np.where(layout.guessed, guess, priors.rotor_share)
    return np.asarray(np.where(layout.armature > 0, share * layout.armature, priors.rotor))


def _log_scales(_: Priors, layout: Layout) -> Array:
    """Compute scales relative to the scale of offsets [1]."""
    contrasts, effects, joints = layout.log_effects
    return np.tile(np.repeat([1.0, *2 * [FRICTION_OF_LOGS]][:effects], joints), contrasts)


def _describe_offsets(fit: Found) -> dict[str, dict[str, tuple[float, ...]]]:
    offsets = effects_of_logs(fit.layout, fit.values)[:1].sum(axis=0).T.tolist()
    return {"log_offsets": {joint: tuple(offset) for joint, offset in zip(fit.joints, offsets, strict=False)}}


def effects_of_logs(layout: Layout, contrasts: Array) -> Array:
    """Convert contrasts to the difference of each log's effects from their mean, shape (effects, logs, joints)."""
    effects = contrasts.reshape(layout.log_effects).transpose(1, 0, 2)
    return np.asarray(contrasts_of_logs(layout.log_effects[0] + 1).T @ effects)


def contrasts_of_logs(logs: int) -> Array:
    """Return orthonormal rows with zero sum, shape (logs - 1, logs): deviations of logs from their mean."""
    return np.asarray(scipy.linalg.helmert(logs))


MODEL: tuple[Correction, ...] = (
    # Rotor inertias [kg m^2].
    Correction(name="rotors", columns=_by_rotors, scales=_rotor_scales, size=lambda layout: len(layout.rotors)),
    # Inertial parameters of payloads.
    Correction(
        name="payloads", columns=_by_payloads, scales=_payload_scales, size=lambda layout: SIZE * len(layout.payloads)
    ),
    # Offset and friction that differ between logs [N m], as contrasts; `EquationSequence` adds the columns.
    Correction(
        name="log_effects",
        scales=_log_scales,
        size=lambda layout: math.prod(layout.log_effects),
        describe=_describe_offsets,
    ),
)
"""Corrections of the model other than its bodies."""
