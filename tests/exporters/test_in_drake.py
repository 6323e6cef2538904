"""Exported models for Drake: in it, the mass matrix is the one that was found, rotors and all."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from tests.arm import URDF, write_arm
from tests.exporters.found import FRICTION, found_in, joint_result, robot_of

from stribeck import Robot, export
from stribeck.app.exporters.forms import SPEEDS, Form, nearest

TRANSMISSIONS = """
  <transmission name="one"><type>transmission_interface/SimpleTransmission</type><joint name="shoulder"/>
    <actuator name="motor"><mechanicalReduction>9</mechanicalReduction></actuator></transmission>
  <transmission name="two"><type>transmission_interface/DifferentialTransmission</type><joint name="elbow"/>
    </transmission>
</robot>"""

ROTOR = 0.05
"""Inertia that was found of every joint's rotor [kg m^2]."""


def test_damping_is_the_nearest_and_rotors_stand_in_simple_transmissions(tmp_path: Path) -> None:
    friction = '<joint name="shoulder" type="revolute"><dynamics friction="7"/>'
    text = URDF.replace('<joint name="shoulder" type="revolute">', friction).replace("</robot>", TRANSMISSIONS)
    robot_file = write_arm(tmp_path)
    (tmp_path / "arm.urdf").write_text(text)
    robot = Robot.from_file(robot_file)
    own = joint_result({**FRICTION, "armature": (ROTOR, "kg m^2")})
    result = replace(found_in(robot)[0], joints={"shoulder": own, "elbow": own}, corrections=None)
    export(result, robot, tmp_path / "new.urdf", "drake", inertia=True)
    root = ET.parse(tmp_path / "new.urdf").getroot()
    dynamics = root.find("joint[@name='shoulder']/dynamics")
    assert set(dynamics.attrib) == {"damping"}  # Drake refuses to know of dry friction
    speeds = np.arange(1, SPEEDS + 1) / SPEEDS
    best = speeds @ (1.2 + 0.3 * speeds) / (speeds @ speeds)
    assert float(dynamics.attrib["damping"]) == pytest.approx(best, rel=0.01)
    assert "approximates coulomb 1.2 N m, error" in (tmp_path / "new.urdf").read_text()
    rotor = "actuator/{http://drake.mit.edu}rotor_inertia"
    values = {each.get("name"): [own.get("value") for own in each.findall(rotor)] for each in root.iter("transmission")}
    assert values == {"one": ["0.05"], "two": [], "rotor of elbow": ["0.05"]}


@pytest.mark.parametrize("name", ["arm", "panda", "ur5"])
def test_drake_has_the_inertias_rotors_and_damping(name: str, tmp_path: Path) -> None:
    pytest.importorskip("pydrake", reason="Drake is not installed: pip install drake")
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    robot, _ = robot_of(name, tmp_path)
    result, corrected = found_in(robot)
    own = joint_result({**FRICTION, "armature": (ROTOR, "kg m^2")})
    result = replace(result, joints=dict.fromkeys(robot.joint_names, own))
    export(result, robot, tmp_path / "new.urdf", "drake", inertia=True)
    damping = nearest(result.joints[robot.joint_names[0]], Form({"viscous": ""})).numbers["viscous"]
    plant = MultibodyPlant(time_step=1e-3)
    (instance,) = Parser(plant).AddModels(str(tmp_path / "new.urdf"))
    children = {int(plant.get_joint(joint).child_body().index()) for joint in plant.GetJointIndices(instance)}
    for root in (body for body in plant.GetBodyIndices(instance) if int(body) not in children):  # none named "world"
        plant.WeldFrames(plant.world_frame(), plant.get_body(root).body_frame())
    plant.Finalize()
    joints = [plant.GetJointByName(joint, instance) for joint in robot.joint_names]
    columns = [joint.velocity_start() for joint in joints]
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
