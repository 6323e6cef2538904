"""Friction torque attributed to each joint and each coupling."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stribeck.core.friction import FrictionLaw
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.result.samples import FrictionSamples


def own_friction(
    samples: FrictionSamples,
    fits: Mapping[str, JointFit],
    law: FrictionLaw,
    couplings: Mapping[str, Mapping[str, float]],
) -> FrictionSamples:
    """Subtract the torque of fitted rotor inertias, and separate the friction of couplings into columns.

    A coupling's column is its fitted friction plus its least-squares share of the torque that the fits of its joints do
    not explain. `couplings` contains the coefficients of the joints, by coupling.
    """
    names = (*samples.joint_names, *couplings)
    sums = [[coupling.get(joint, 0.0) for joint in samples.joint_names] for coupling in couplings.values()]
    acting = np.column_stack([np.eye(len(samples.joint_names)), *sums])
    torque = samples.friction_torque.copy()
    for name, weights in zip(names, acting.T, strict=True):
        if name in fits and "armature" in fits[name].names:
            joints, inertia = np.flatnonzero(weights), fits[name].by_name["armature"]
            torque[:, joints] -= inertia * np.outer(samples.acceleration[:, joints] @ weights[joints], weights[joints])
    if not couplings:
        return replace(samples, friction_torque=torque)
    velocity = samples.velocity @ acting
    friction = np.zeros(velocity.shape)
    for column, name in enumerate(names):
        if name in fits:
            friction[:, column] = law.torque(velocity[:, column], fits[name].law_values(law))
    unexplained = torque - friction @ acting.T
    parts = [np.flatnonzero(weights) for weights in acting.T]  # a coupling requires all of its joints
    shares = [
        unexplained[:, part] @ np.linalg.pinv(row[part, None])[0] for part, row in zip(parts, acting.T, strict=True)
    ]
    return replace(
        samples,
        joint_names=names,
        velocity=velocity,
        acceleration=samples.acceleration @ acting,
        friction_torque=friction + np.column_stack(shares),
        usable=np.column_stack([samples.usable[:, part].all(axis=1) for part in parts]),
        prismatic=tuple(all(samples.slides(joint) for joint in part.tolist()) for part in parts),
        jerk=None if samples.jerk is None else samples.jerk @ acting,
        snap=None if samples.snap is None else samples.snap @ acting,
        sharp_velocity=None if samples.sharp_velocity is None else samples.sharp_velocity @ acting,
    )
