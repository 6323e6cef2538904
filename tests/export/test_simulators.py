"""Files for simulators: run where the simulator is there, else against what its own documentation says."""

import importlib.util
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from tests.arm import write_arm
from tests.export.found import FRICTION, found_in, joint_result
from tests.export.test_forms import joint

from stribeck import Robot, export

MODULES = ["isaaclab", "newton", "genesis", "pinocchio"]
FOUND = FRICTION | {"armature": (0.05, "kg m^2")}
FORCE = {"viscous": (20.0, "N s/m"), "coulomb": (3.0, "N"), "offset": (0.0, "N"), "armature": (0.4, "kg")}


def written(target: str, folder: Path) -> tuple[Path, Robot]:
    """Write what was found of an arm with a sliding joint, whose elbow has a rotor alone."""
    robot = Robot.from_file(write_arm(folder))
    found = {
        "shoulder": joint_result(FOUND),
        "elbow": joint_result({"armature": (0.1, "kg m^2")}),
        "slide": joint_result(FORCE),
    }
    result = replace(found_in(robot)[0], joints=found, corrections=None)
    path = folder / f"found_{target}"
    export(result, robot, path, target)
    return path, robot


def module(path: Path) -> ModuleType:
    """Return the module that was written."""
    path = path.rename(path.with_suffix(".py"))
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    own = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(own)
    return own


def test_pinocchio_has_it(tmp_path: Path) -> None:
    path, robot = written("pinocchio", tmp_path)
    model = pin.Model(robot.tree.model)
    module(path).set_friction(model)
    assert list(model.names)[1:] == ["shoulder", "elbow", "slide"]
    np.testing.assert_array_equal(model.upperDryFrictionLimit, [1.2, 0.0, 3.0])
    np.testing.assert_array_equal(model.lowerDryFrictionLimit, [-1.2, 0.0, -3.0])
    np.testing.assert_array_equal(model.damping, [0.3, 0.0, 20.0])
    neutral = pin.neutral(model)
    more = pin.crba(model, model.createData(), neutral) - pin.crba(
        robot.tree.model, robot.tree.model.createData(), neutral
    )
    np.testing.assert_allclose(np.triu(more), np.diag([0.05, 0.1, 0.4]), atol=1e-12)
    still, acceleration = np.zeros(3), np.array([1.0, -2.0, 3.0])
    torque = pin.rnea(model, model.createData(), neutral, still, acceleration)
    without = pin.rnea(robot.tree.model, robot.tree.model.createData(), neutral, still, acceleration)
    np.testing.assert_allclose(torque - without, [0.05, -0.2, 1.2], atol=1e-12)
    np.testing.assert_allclose(pin.aba(model, model.createData(), neutral, still, torque), acceleration, atol=1e-9)


def test_pinocchio_without_the_joint_is_left_as_it_was(tmp_path: Path) -> None:
    path, robot = written("pinocchio", tmp_path)
    model = pin.Model(robot.tree.model)
    model.names[3] = "knee"
    with pytest.raises(ValueError, match="no joint 'slide'; it has shoulder, elbow, knee"):
        module(path).set_friction(model)
    assert not model.damping.any()


def test_isaac_lab_gets_keywords_of_its_actuators(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass
    class ImplicitActuatorCfg:  # the fields of Isaac Lab 2.3 and 3.0 that are written
        joint_names_expr: list[str]
        stiffness: float | None
        damping: float | None
        armature: dict[str, float] | None = None
        friction: dict[str, float] | None = None
        dynamic_friction: dict[str, float] | None = None
        viscous_friction: dict[str, float] | None = None

    stub = SimpleNamespace(ImplicitActuatorCfg=ImplicitActuatorCfg)
    monkeypatch.setitem(sys.modules, "isaaclab", SimpleNamespace(actuators=stub))  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "isaaclab.actuators", stub)  # type: ignore[arg-type]
    path, _ = written("isaaclab", tmp_path)
    first, second = module(path).actuators(stiffness=80.0, damping=2.0).values()
    assert first.joint_names_expr == ["shoulder", "slide"]
    assert first.friction == first.dynamic_friction == {"shoulder": 1.2, "slide": 3.0}
    assert first.viscous_friction == {"shoulder": 0.3, "slide": 20.0}
    assert (second.joint_names_expr, second.armature, second.friction) == (["elbow"], {"elbow": 0.1}, None)
    assert (second.stiffness, second.damping) == (80.0, 2.0)


def test_a_stribeck_effect_is_what_holds_at_rest_in_physx(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path))
    own = joint(coulomb=2.0, viscous=0.3, stribeck_gain=0.5, stribeck_velocity=0.02, offset=0.0)
    result = replace(found_in(robot, "auto")[0], joints={"shoulder": own}, corrections=None)
    export(result, robot, tmp_path / "found.json", "physx")
    friction = json.loads((tmp_path / "found.json").read_text())["joints"]["shoulder"]["PxJointFrictionParams"]
    assert friction["dynamicFrictionEffort"] == pytest.approx(2.0, abs=0.03)
    assert friction["staticFrictionEffort"] == pytest.approx(3.0, abs=0.01)


def test_physx_has_efforts_and_usd_degrees(tmp_path: Path) -> None:
    path, _ = written("physx", tmp_path)
    joints = json.loads(path.read_text())["joints"]
    assert joints["shoulder"] == {
        "PxJointFrictionParams": {
            "staticFrictionEffort": 1.2,
            "dynamicFrictionEffort": 1.2,
            "viscousFrictionCoefficient": 0.3,
        },
        "armature": 0.05,
        "usd": {
            "apiSchemas": ["PhysxJointAxisAPI:angular"],
            "physxJointAxis:angular:dynamicFrictionEffort": 1.2,
            "physxJointAxis:angular:viscousFrictionCoefficient": pytest.approx(0.3 / 57.29577951308232, rel=1e-12),
            "physxJointAxis:angular:staticFrictionEffort": 1.2,
            "physxJointAxis:angular:armature": 0.05,
        },
    }
    assert joints["slide"]["usd"]["physxJointAxis:linear:viscousFrictionCoefficient"] == 20.0
    assert joints["elbow"] == {
        "armature": 0.1,
        "usd": {"apiSchemas": ["PhysxJointAxisAPI:angular"], "physxJointAxis:angular:armature": 0.1},
    }


def test_genesis_gets_one_call_a_word(tmp_path: Path) -> None:
    """Calls of genesis-world 1.4: set_dofs_<word>(values, dofs_idx_local)."""
    path, _ = written("genesis", tmp_path)
    calls = []

    class Entity:
        def get_joint(self, name: str) -> SimpleNamespace:
            return SimpleNamespace(dofs_idx_local=[["shoulder", "elbow", "slide"].index(name)])

        def set_dofs_frictionloss(self, values: list[float], dofs_idx_local: list[int]) -> None:
            calls.append(("frictionloss", values, dofs_idx_local))

        def set_dofs_damping(self, values: list[float], dofs_idx_local: list[int]) -> None:
            calls.append(("damping", values, dofs_idx_local))

        def set_dofs_armature(self, values: list[float], dofs_idx_local: list[int]) -> None:
            calls.append(("armature", values, dofs_idx_local))

    module(path).set_friction(Entity())
    assert calls[:3] == [("frictionloss", [1.2], [0]), ("damping", [0.3], [0]), ("armature", [0.05], [0])]
    assert calls[3:] == [
        ("armature", [0.1], [1]),
        ("frictionloss", [3.0], [2]),
        ("damping", [20.0], [2]),
        ("armature", [0.4], [2]),
    ]


def test_a_builder_of_newton_gets_it_by_label(tmp_path: Path) -> None:
    path, _ = written("newton", tmp_path)
    builder = SimpleNamespace(
        joint_label=["a/fixed_base", "a/shoulder", "a/elbow", "a/slide", "b/shoulder"],
        joint_qd_start=[0, 0, 1, 2, 3],
        joint_friction=[0.0] * 4,
        joint_damping=[0.0] * 4,
        joint_armature=[0.0] * 4,
    )
    own = module(path)
    own.set_friction(builder)
    assert builder.joint_friction == [1.2, 0.0, 3.0, 1.2]
    assert builder.joint_damping == [0.3, 0.0, 20.0, 0.3]
    assert builder.joint_armature == [0.05, 0.1, 0.4, 0.05]
    builder.joint_label[2] = "a/knee"
    with pytest.raises(ValueError, match="no joint 'elbow'; it has fixed_base, shoulder, knee, slide"):
        own.set_friction(builder)


def test_newton_reads_the_same_from_its_builder_and_from_usd(tmp_path: Path) -> None:
    newton = pytest.importorskip("newton", reason="Newton is not installed: pip install 'stribeck[targets]'")
    from pxr import Usd, UsdGeom, UsdPhysics

    path, robot = written("newton", tmp_path)
    own = module(path)
    builder = newton.ModelBuilder()
    builder.add_urdf(str(robot.model_path))
    own.set_friction(builder)
    stage = Usd.Stage.CreateNew(str(tmp_path / "arm.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.ArticulationRootAPI.Apply(UsdGeom.Xform.Define(stage, "/arm").GetPrim())
    links = [UsdGeom.Xform.Define(stage, f"/arm/link{k}") for k in range(4)]
    for link in links:
        UsdPhysics.RigidBodyAPI.Apply(link.GetPrim())
        UsdPhysics.MassAPI.Apply(link.GetPrim()).CreateMassAttr(1.0)
    kinds = [UsdPhysics.FixedJoint, *[UsdPhysics.RevoluteJoint] * 2, UsdPhysics.PrismaticJoint]
    for k, (kind, name) in enumerate(zip(kinds, ["root", *robot.joint_names], strict=True)):
        prim = kind.Define(stage, f"/arm/{name}")
        prim.CreateBody0Rel().SetTargets([link.GetPath() for link in links[:k][-1:]])
        prim.CreateBody1Rel().SetTargets([links[k].GetPath()])
    own.author_friction(stage)
    stage.Save()
    read = newton.ModelBuilder()
    read.add_usd(str(tmp_path / "arm.usda"))
    for word in ("friction", "damping", "armature"):
        expected = getattr(builder, f"joint_{word}")
        assert expected == [own.JOINTS[name].get(word, 0.0) for name in robot.joint_names]
        np.testing.assert_allclose(getattr(read, f"joint_{word}"), expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("target", MODULES)
def test_names_cannot_break_a_module(target: str, tmp_path: Path) -> None:
    name = 'a"""\'b.c{x}\\'
    robot = Robot.from_file(write_arm(tmp_path))
    text = (tmp_path / "arm.urdf").read_text().replace("shoulder", "a&quot;&quot;&quot;'b.c{x}\\")
    (tmp_path / "arm.urdf").write_text(text)
    robot = Robot.from_file(tmp_path / "robot.toml")
    assert robot.joint_names[0] == name
    result = replace(found_in(robot)[0], joints={name: joint_result(FOUND)}, corrections=None)
    export(result, robot, tmp_path / "found", target)
    own = module(tmp_path / "found")
    if target == "isaaclab":
        assert own.ACTUATORS[0]["joint_names_expr"] == ['a"""\'b\\.c\\{x\\}\\\\']
    else:
        assert list(own.JOINTS) == [name]
