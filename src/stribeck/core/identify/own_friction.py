"""Friction torque attributed to each joint and each coupling."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.friction import FrictionLaw
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot


def own_friction(
    samples: FrictionSamples,
    fits: Mapping[str, JointFit],
    law: FrictionLaw,
    robot: Robot,
    couplings: Sequence[str],
) -> FrictionSamples:
    """Subtract the torque of fitted rotors, and separate the friction of couplings into columns.

    A coupling's column is its fitted friction plus its least-squares share of the torque that the fits of its joints do
    not explain. Other couplings share this torque if these joints have no separate friction.
    """
    names, joints = (*samples.joint_names, *couplings), len(samples.joint_names)
    acting = np.hstack([np.eye(joints), robot.coefficients(samples.joint_names, couplings)])
    torque = samples.friction_torque.copy()
    for name, weights in zip(names, acting.T, strict=True):
        if name in fits and "armature" in fits[name].names:
            moved, inertia = np.flatnonzero(weights), fits[name].by_name["armature"]
            torque[:, moved] -= inertia * np.outer(samples.acceleration[:, moved] @ weights[moved], weights[moved])
    if not couplings:
        return replace(samples, friction_torque=torque)
    velocity = samples.velocity @ acting
    friction = np.zeros(velocity.shape)
    for column, name in enumerate(names):
        if name in fits:
            friction[:, column] = law.torque(velocity[:, column], fits[name].law_values(law))
    unexplained = torque - friction @ acting.T
    parts = [np.flatnonzero(weights) for weights in acting.T]  # a coupling requires all of its joints
    for column, part in enumerate(parts):
        shared = column >= joints and not robot.bare.isdisjoint(robot.couplings[names[column]])
        others = [k for k in range(joints, len(names)) if shared and k != column and acting[part, k].any()]
        friction[:, column] += unexplained[:, part] @ np.linalg.pinv(acting[part][:, [column, *others]])[0]
    return replace(
        samples,
        joint_names=names,
        velocity=velocity,
        acceleration=samples.acceleration @ acting,
        friction_torque=friction,
        usable=np.column_stack([samples.usable[:, part].all(axis=1) for part in parts]),
        prismatic=tuple(all(samples.slides(joint) for joint in part.tolist()) for part in parts),
        jerk=None if samples.jerk is None else samples.jerk @ acting,
        snap=None if samples.snap is None else samples.snap @ acting,
        sharp_velocity=None if samples.sharp_velocity is None else samples.sharp_velocity @ acting,
    )
