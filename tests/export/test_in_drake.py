"""Exported models in Drake: the mass matrix is the one that was found, rotors and all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from tests.export.found import FRICTION, found_in, joint_result
from tests.export.test_export import robot_of

from stribeck import export
from stribeck.export.forms import nearest, viscous

ROTOR = 0.05
"""Inertia that was found of every joint's rotor [kg m^2]."""


@pytest.mark.parametrize("name", ["arm", "panda", "ur5"])
def test_drake_has_the_inertias_rotors_and_damping(name: str, tmp_path: Path) -> None:
    pytest.importorskip("pydrake", reason="Drake is not installed: pip install 'stribeck[targets]'")
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    robot, _ = robot_of(name, tmp_path)
    result, corrected = found_in(robot)
    own = joint_result({**FRICTION, "armature": (ROTOR, "kg m^2")})
    result = replace(result, joints=dict.fromkeys(robot.joint_names, own))
    export(result, robot, tmp_path / "new.urdf", "drake")
    plant = MultibodyPlant(time_step=1e-3)
    (instance,) = Parser(plant).AddModels(str(tmp_path / "new.urdf"))
    children = {int(plant.get_joint(joint).child_body().index()) for joint in plant.GetJointIndices(instance)}
    for root in (body for body in plant.GetBodyIndices(instance) if int(body) not in children):  # none named "world"
        plant.WeldFrames(plant.world_frame(), plant.get_body(root).body_frame())
    plant.Finalize()
    joints = [plant.GetJointByName(joint, instance) for joint in robot.joint_names]
    columns = [joint.velocity_start() for joint in joints]
    damping = nearest(result.joints[robot.joint_names[0]], viscous()).numbers["viscous"]
    assert [joint.default_damping() for joint in joints] == pytest.approx([damping] * len(joints), rel=0.01)
    model, context = corrected.tree.model, plant.CreateDefaultContext()
    for seed in range(5):
        angles = np.random.default_rng(seed).normal(size=len(joints))
        positions = np.zeros(plant.num_positions())
        positions[[joint.position_start() for joint in joints]] = angles
        plant.SetPositions(context, positions)
        position = pin.integrate(model, pin.neutral(model), angles)
        expected = pin.crba(model, model.createData(), position)
        expected = np.triu(expected) + np.triu(expected, 1).T + ROTOR * np.eye(model.nv)
        found = plant.CalcMassMatrix(context)[np.ix_(columns, columns)]
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())
