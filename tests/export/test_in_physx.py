"""Exported joint friction in PhysX: read from USD it holds and resists as was stated."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.arm import write_arm
from tests.export.found import found_in
from tests.export.test_forms import joint

from stribeck import Robot, export

STEP = 1e-3
"""Of the simulation [s]."""

SCENE = """#usda 1.0
(
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
)
def PhysicsScene "scene"
{
    float physics:gravityMagnitude = 0
}
def Xform "arm" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
{
    def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 1
        float3 physics:diagonalInertia = (1, 1, 1)
    }
    def Xform "link" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysxRigidBodyAPI"])
    {
        float physics:mass = 1
        float3 physics:diagonalInertia = (1, 1, 1)
        float physxRigidBody:angularDamping = 0
    }
    def PhysicsFixedJoint "root"
    {
        rel physics:body1 = </arm/base>
    }
    def PhysicsRevoluteJoint "shoulder" (prepend apiSchemas = [SCHEMAS])
    {
        rel physics:body0 = </arm/base>
        rel physics:body1 = </arm/link>
ATTRIBUTES
    }
}
"""


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of PhysX's tensor bindings
def test_physx_holds_and_resists_as_was_stated(tmp_path: Path) -> None:
    ovphysx = pytest.importorskip("ovphysx", reason="PhysX is not installed: pip install 'stribeck[targets]'")
    from ovphysx.samples.python_samples.tensor_bindings import attach_scene

    robot = Robot.from_file(write_arm(tmp_path))
    own = joint(coulomb=1.2, viscous=0.3, stribeck_gain=0.25, stribeck_velocity=0.005, armature=0.05, offset=0.0)
    result = replace(found_in(robot, "auto")[0], joints={"shoulder": own}, corrections=None)
    export(result, robot, tmp_path / "found.json", "physx")
    found = json.loads((tmp_path / "found.json").read_text())["joints"]["shoulder"]
    schemas = ", ".join(f'"{name}"' for name in found["usd"].pop("apiSchemas"))
    attributes = "\n".join(f"        float {name} = {value}" for name, value in found["usd"].items())
    scene = SCENE.replace("SCHEMAS", schemas).replace("ATTRIBUTES", attributes)
    (tmp_path / "arm.usda").write_text(scene)

    ovphysx.PhysX.set_cpu_mode(True)
    physx = ovphysx.PhysX()
    stage = attach_scene(physx, tmp_path / "arm.usda", "arm")
    kinds = ovphysx.types.TensorType

    def bound(kind: str) -> Any:
        return physx.create_tensor_binding(pattern="/arm", tensor_type=getattr(kinds, f"ARTICULATION_DOF_{kind}"))

    def read(kind: str) -> np.ndarray:
        values = np.zeros(bound(kind).shape, dtype=np.float32)
        bound(kind).read(values)
        return values.ravel()

    def write(kind: str, value: float) -> None:
        bound(kind).write(np.full(bound(kind).shape, value, dtype=np.float32))

    static, dynamic, viscous = found["PxJointFrictionParams"].values()
    assert dynamic == pytest.approx(1.2, rel=0.01)
    assert static == pytest.approx(1.5, rel=0.05)
    np.testing.assert_allclose(read("FRICTION_PROPERTIES"), [static, dynamic, viscous], rtol=1e-6)
    np.testing.assert_allclose(read("ARMATURE"), [0.05], rtol=1e-6)
    for speed in (0.5, 1.0, 2.0):
        write("VELOCITY", speed)
        physx.step_sync(STEP)
        resisting = (speed - read("VELOCITY")[0]) / STEP * 1.05
        assert resisting == pytest.approx(dynamic + viscous * speed, rel=3e-3)
    for torque, moves in ((0.95 * static, False), (1.05 * static, True)):
        write("VELOCITY", 0.0)
        for _ in range(50):
            write("ACTUATION_FORCE", torque)
            physx.step_sync(STEP)
        assert (read("VELOCITY")[0] > 1e-3) == moves
    physx.wait_task(physx.detach_ovstage())
    stage.destroy()
