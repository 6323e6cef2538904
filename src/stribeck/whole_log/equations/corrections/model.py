"""Corrections of the model: inertial parameters of bodies and payloads, rotor inertias, differences between logs."""

import math

import numpy as np
from scipy.linalg import helmert

from stribeck.base.typing import Array
from stribeck.robot.inertial_parameters import SIZE, carried
from stribeck.settings import Priors
from stribeck.whole_log.constants import FRICTION_OF_LOGS
from stribeck.whole_log.equations.corrections.correction import Correction, CorrectionLayout, Signals

PAYLOAD = (0.05, 0.02, 0.01)
"""Prior errors of a payload relative to its mass: mass [1], first moments [m], second moments [m^2]."""

BODIES = Correction(
    name="bodies", columns=lambda signals: signals.by_inertia, size=lambda layout: layout.inertial_parameters.size
)
"""Inertial parameters of bodies; their coordinates are nonlinear (`model/bodies.py`)."""


def _by_payloads(signals: Signals) -> Array:
    """Select the derivatives by the payloads' parameters in their links' frames, zero of absent ones."""
    robot, rows = signals.mode.robot, signals.by_inertia.shape[:2]
    found = np.zeros((*rows, len(robot.payloads), SIZE))
    for k, payload in enumerate(robot.payloads):
        frame = robot.tree.model.frames[robot.tree.model.getFrameId(payload.link)]
        if signals.carried[k]:
            own = signals.by_inertia[:, :, SIZE * (frame.parentJoint - 1) : SIZE * frame.parentJoint]
            found[:, :, k] = own @ carried(frame.placement.homogeneous)
    return found.reshape(*rows, -1)


PAYLOADS = Correction(
    name="payloads",
    columns=_by_payloads,
    scales=lambda _, layout: np.outer(layout.payloads, np.repeat(PAYLOAD, [1, 3, 6])).ravel(),
    size=lambda layout: SIZE * len(layout.payloads),
)
"""Inertial parameters of payloads."""


def _by_rotors(signals: Signals) -> Array:
    rotors = list(signals.layout.rotors)
    turned = signals.state.acceleration[:, signals.mode.joints] @ signals.on_joints[:, rotors]
    return np.asarray(turned[:, None] * signals.acting[:, rotors])


def _rotor_scales(priors: Priors, layout: CorrectionLayout) -> Array:
    return np.asarray(np.where(layout.armature > 0, priors.rotor_share * layout.armature, priors.rotor))


ROTORS = Correction(name="rotors", columns=_by_rotors, scales=_rotor_scales, size=lambda layout: len(layout.rotors))
"""Rotor inertias [kg m^2]."""


def _log_scales(_: Priors, layout: CorrectionLayout) -> Array:
    """Compute scales relative to that of offsets [1]."""
    contrasts, effects, joints = layout.log_effects
    return np.tile(np.repeat([1.0, *2 * [FRICTION_OF_LOGS]][:effects], joints), contrasts)


LOG_EFFECTS = Correction(name="log_effects", scales=_log_scales, size=lambda layout: math.prod(layout.log_effects))
"""Offset and friction that differ between logs [N m], as contrasts; `EquationSequence` adds the columns."""


def effects_of_logs(layout: CorrectionLayout, contrasts: Array) -> Array:
    """Convert contrasts to the difference of each log's effects from their mean, shape (effects, logs, joints)."""
    own = contrasts.reshape(layout.log_effects).transpose(1, 0, 2)
    return np.asarray(contrasts_of_logs(layout.log_effects[0] + 1).T @ own)


def contrasts_of_logs(logs: int) -> Array:
    """Return orthonormal rows with zero sum, shape (logs - 1, logs): deviations of logs from their mean."""
    return np.asarray(helmert(logs))
