"""Modules and recipes for simulators: run in Pinocchio, else against the names of the simulator's own source."""

import json
import re
import sys
from collections import defaultdict
from dataclasses import make_dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from tests.arm import write_arm
from tests.exporters.found import FRICTION, found_in, joint, joint_result, module, of_joints

from stribeck import Robot, export

GAINS = (np.array([40.0, 30.0, np.nan]), np.array([2.0, 1.0, 0.0]))
DRIVES: dict[str, Any] = {"command_gains": GAINS, "command_delay": np.array([0.004, 0.004, 0.0])}
"""Of a robot file without gains of the sliding joint."""
FOUND = FRICTION | {"armature": (0.05, "kg m^2")}
FORCE = {"viscous": (20.0, "N s/m"), "coulomb": (3.0, "N"), "offset": (0.0, "N"), "armature": (0.4, "kg")}


def written(
    target: str, folder: Path, friction: str | None = None, joints: int = 3, **drives: Any
) -> tuple[Path, Robot]:
    """Write what was found of an arm with a sliding joint, whose elbow has a rotor alone."""
    robot = replace(Robot.from_file(write_arm(folder)), **drives)
    elbow = joint_result({"armature": (0.1, "kg m^2")})
    found = {"shoulder": joint_result(FOUND), "elbow": elbow, "slide": joint_result(FORCE)}
    found = dict([*found.items()][:joints])
    result = replace(found_in(robot)[0], joints=found, corrections=None)
    export(result, robot, folder / "found.yaml", target, friction=friction)
    return folder / "found.yaml", robot


def test_pinocchio_has_it(tmp_path: Path) -> None:
    path, robot = written("pinocchio", tmp_path)
    model, own = pin.Model(robot.tree.model), module(path)
    own.set_friction(model)
    assert list(model.names)[1:] == ["shoulder", "elbow", "slide"]
    np.testing.assert_array_equal(model.upperDryFrictionLimit, [1.2, 0.0, 3.0])
    np.testing.assert_array_equal(model.lowerDryFrictionLimit, [-1.2, 0.0, -3.0])
    np.testing.assert_array_equal(model.damping, [0.3, 0.0, 20.0])
    neutral, still, acceleration = pin.neutral(model), np.zeros(3), np.array([1.0, -2.0, 3.0])
    models = (model, robot.tree.model)
    torque, without = (pin.rnea(each, each.createData(), neutral, still, acceleration) for each in models)
    np.testing.assert_allclose(torque - without, [0.05, -0.2, 1.2], atol=1e-12)
    np.testing.assert_allclose(pin.aba(model, model.createData(), neutral, still, torque), acceleration, atol=1e-9)
    other = pin.Model(robot.tree.model)
    other.names[3] = "knee"
    with pytest.raises(ValueError, match="no joint 'slide'; it has shoulder, elbow, knee"):
        own.set_friction(other)
    assert not other.damping.any()


@pytest.mark.parametrize("effort", ["effort_limit_sim", "joint_effort_limit"], ids=["2.3", "3.0"])
def test_isaac_lab_gets_keywords_of_its_actuators(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, effort: str) -> None:
    words = ("armature", "friction", "dynamic_friction", "viscous_friction", effort)
    fields = ["joint_names_expr", "stiffness", "damping", *((word, Any, None) for word in words)]
    delays = [(word, int, 0) for word in ("min_delay", "max_delay")]
    kinds = {"ImplicitActuatorCfg": fields, "DelayedPDActuatorCfg": [*fields, *delays]}
    stub = SimpleNamespace(**{name: make_dataclass(name, own) for name, own in kinds.items()})  # fields of Isaac Lab
    monkeypatch.setitem(sys.modules, "isaaclab", SimpleNamespace(actuators=stub))  # type: ignore[arg-type]
    path, _ = written("isaaclab", tmp_path)
    own = module(path)
    first, second = own.actuators(stiffness=80.0, damping=2.0).values()
    assert first.joint_names_expr == ["shoulder", "slide"]
    assert first.friction == first.dynamic_friction == {"shoulder": 1.2, "slide": 3.0}
    assert first.viscous_friction == {"shoulder": 0.3, "slide": 20.0}
    assert (second.joint_names_expr, second.armature, second.friction) == (["elbow"], {"elbow": 0.1}, None)
    assert (second.stiffness, second.damping, getattr(second, effort)) == (80.0, 2.0, None)  # the model has no limit
    assert getattr(first, effort) == {"shoulder": 100.0, "slide": 100.0}
    other = make_dataclass("PaceDCMotorCfg", [*fields, ("max_delay", int, 0)])
    first, _ = own.actuators(stiffness=80.0, damping=2.0, kind=other, max_delay=3).values()
    assert (type(first), first.max_delay, first.armature["shoulder"]) == (other, 3, 0.05)
    path, _ = written("isaaclab", tmp_path, joints=1, **DRIVES)
    shoulder, elbow, slide = module(path).actuators(timestep=0.002).values()
    assert (shoulder.stiffness, shoulder.damping) == ({"shoulder": 40.0}, {"shoulder": 2.0})
    assert (shoulder.min_delay, shoulder.max_delay, shoulder.friction) == (2, 2, {"shoulder": 1.2})
    assert (elbow.joint_names_expr, elbow.stiffness, elbow.friction) == (["elbow"], {"elbow": 30.0}, None)
    assert (slide.joint_names_expr, slide.stiffness, slide.max_delay) == (["slide"], None, 0)  # of the USD file


def test_mjlab_gets_keywords_of_its_actuators(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("armature", "frictionloss", "viscous_damping", "effort_limit", "delay_min_lag", "delay_max_lag")
    fields = ["target_names_expr", "stiffness", "damping", *((word, Any, None) for word in words)]
    actuator = make_dataclass("BuiltinPositionActuatorCfg", fields, kw_only=True)  # of mjlab 1.3 and newer
    stub = SimpleNamespace(BuiltinPositionActuatorCfg=actuator)
    monkeypatch.setitem(sys.modules, "mjlab", SimpleNamespace(actuator=stub))  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "mjlab.actuator", stub)  # type: ignore[arg-type]
    path, _ = written("mjlab", tmp_path)
    shoulder, elbow, slide = module(path).actuators(stiffness=80.0, damping=2.0)
    assert (shoulder.target_names_expr, shoulder.stiffness, shoulder.damping) == (("shoulder",), 80.0, 2.0)
    assert (shoulder.frictionloss, shoulder.viscous_damping, shoulder.armature) == (1.2, 0.3, 0.05)
    assert (elbow.frictionloss, elbow.armature, elbow.effort_limit) == (None, 0.1, None)
    assert (slide.viscous_damping, slide.effort_limit) == (20.0, 100.0)
    path, _ = written("mjlab", tmp_path, joints=1, **DRIVES)
    own = module(path)
    with pytest.raises(ValueError, match="no gains of joint 'slide'; pass its stiffness"):
        own.actuators()
    shoulder, elbow, slide = own.actuators(stiffness={"slide": 900.0}, damping={"slide": 30.0}, timestep=0.002)
    assert (shoulder.stiffness, shoulder.damping, shoulder.delay_min_lag) == (40.0, 2.0, 2)
    assert (elbow.stiffness, elbow.frictionloss, elbow.delay_max_lag) == (30.0, None, 2)
    assert (slide.stiffness, slide.damping, slide.delay_max_lag) == (900.0, 30.0, None)
    assert (tmp_path / "found.py").read_text().count(",  # friction kept from the model") == 2
    model = own.with_friction(mujoco.MjSpec.from_file(str(tmp_path / "arm.urdf"))).compile()
    np.testing.assert_array_equal(model.dof_solref, [(0.001, 1.0)] * 3)


@pytest.fixture
def recipes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The functions of the docs, with the joints of a YAML file."""
    monkeypatch.chdir(tmp_path)
    written("yaml", tmp_path, "plain")
    page = (Path(__file__).parents[2] / "docs/export.md").read_text().partition("## Newton, Genesis")[2]
    names: dict[str, Any] = {"export": lambda *_, **__: None, "result": None}
    for block in re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL):
        exec(block, names)
    return names


def test_a_builder_of_newton_gets_it_by_label(recipes: dict[str, Any]) -> None:
    builder = SimpleNamespace(
        joint_label=["a/fixed_base", "a/shoulder", "a/elbow", "a/slide", "b/shoulder"],
        joint_qd_start=[0, 0, 1, 2, 3],
        **{f"joint_{word}": [0.0] * 4 for word in ("friction", "damping", "armature")},
        custom_attributes={"mujoco:solreffriction": SimpleNamespace(values=None)},
    )
    recipes["set_newton"](builder)
    assert builder.joint_friction == [1.2, 0.0, 3.0, 1.2]
    assert builder.joint_damping == [0.3, 0.0, 20.0, 0.3]
    assert builder.joint_armature == [0.05, 0.1, 0.4, 0.05]
    (sharp,) = builder.custom_attributes.values()
    assert sharp.values == {at: [0.001, 1.0] for at in (0, 2, 3)}


def test_genesis_gets_one_call_a_word(recipes: dict[str, Any]) -> None:
    calls: dict[str, dict[int, float]] = defaultdict(dict)

    class Entity:
        def get_joint(self, name: str) -> SimpleNamespace:
            return SimpleNamespace(dofs_idx_local=[["shoulder", "elbow", "slide"].index(name)])

        def __getattr__(self, name: str) -> Any:
            return lambda values, at: calls[name].update(dict(zip(at, values, strict=True)))

    recipes["set_genesis"](Entity())
    assert calls == {
        "set_dofs_frictionloss": {0: 1.2, 2: 3.0},
        "set_dofs_damping": {0: 0.3, 2: 20.0},
        "set_dofs_armature": {0: 0.05, 1: 0.1, 2: 0.4},
    }


def test_a_stage_gets_efforts_and_degrees(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    units = {"meters": 1.0}
    stub = SimpleNamespace(
        Sdf=SimpleNamespace(ValueTypeNames=SimpleNamespace(Float="float", DoubleArray="double[]")),
        Tf=SimpleNamespace(MakeValidIdentifier=str),
        UsdGeom=SimpleNamespace(GetStageMetersPerUnit=lambda _: units["meters"]),
        UsdPhysics=SimpleNamespace(GetStageKilogramsPerUnit=lambda _: 1.0),
    )
    monkeypatch.setitem(sys.modules, "pxr", stub)  # type: ignore[arg-type]
    found: dict[str, dict[str, float]] = defaultdict(dict)

    def prim(name: str, kind: str) -> SimpleNamespace:
        def attribute(word: str, _: str, custom: bool) -> SimpleNamespace:
            assert not custom
            return SimpleNamespace(Set=lambda value: found[name].update({word: value}))

        return SimpleNamespace(
            GetName=lambda: name,
            GetTypeName=lambda: kind,
            AddAppliedSchema=lambda schema: found[name].update({schema: 1.0}),
            CreateAttribute=attribute,
        )

    kinds = {"base": "Xform", "shoulder": "PhysicsRevoluteJoint", "elbow": "PhysicsRevoluteJoint"}
    joints = [prim(*each) for each in (kinds | {"slide": "PhysicsPrismaticJoint"}).items()]
    path, _ = written("usd", tmp_path)
    own = module(path)
    own.set_friction(SimpleNamespace(Traverse=lambda: joints))
    damping: Any = pytest.approx(0.3 / 57.29577951308232, rel=1e-12)
    efforts: dict[str, Any] = {"dynamicFrictionEffort": 1.2, "staticFrictionEffort": 1.2, "armature": 0.05}
    efforts["viscousFrictionCoefficient"] = damping
    newton = {"friction": 1.2, "damping": damping, "armature": 0.05}
    wanted = {f"physxJointAxis:angular:{word}": value for word, value in efforts.items()}
    wanted |= {f"newton:{word}": value for word, value in newton.items()} | {"mjc:solreffriction": (0.001, 1.0)}
    assert found["shoulder"] == wanted | {"PhysxJointAxisAPI:angular": 1.0, "NewtonJointAPI": 1.0}
    assert found["slide"]["physxJointAxis:linear:viscousFrictionCoefficient"] == 20.0
    assert found["slide"]["newton:damping"] == 20.0
    assert "base" not in found
    with pytest.raises(ValueError, match="the stage has no joint 'slide'"):
        own.set_friction(SimpleNamespace(Traverse=lambda: joints[:3]))
    units["meters"] = 0.01
    with pytest.raises(ValueError, match=r"are 0.01 m and 1 kg; expected 1 m and 1 kg"):
        own.set_friction(SimpleNamespace(Traverse=lambda: joints))


@pytest.mark.parametrize("target", ["isaaclab", "mjlab", "pinocchio", "python", "usd"])
def test_names_cannot_break_a_module(target: str, tmp_path: Path) -> None:
    name = 'a"""\'b.c{x}\\'
    write_arm(tmp_path)
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
        assert next(iter(own.JOINTS)) == name


def test_bam_has_the_friction_that_depends_on_load(tmp_path: Path) -> None:
    """The equation of BAM's model M4, with motor and external torque opposite; a joint without load has none."""
    found = {"coulomb": 1.0, "viscous": 0.2, "stribeck_gain": 0.5, "stribeck_velocity": 0.1, "offset": 0.3}
    own = replace(joint(**found, load=0.04), mean_load=6.0, load_deviation=3.0)
    plain = joint("coulomb-viscous", coulomb=0.7, viscous=0.1, offset=0.0)
    result, robot = of_joints(tmp_path, own, plain)
    export(replace(result, law="auto"), robot, tmp_path / "found.json", "bam")
    numbers = [*json.loads((tmp_path / "found.json").read_text())["joints"].values()]
    for each, p in zip((own, plain), numbers, strict=True):
        assert (p["model"], p["load_friction_stribeck"]) == ("m4", 0.0)
        for v in (0.02, 0.1, 0.5, 1.0):
            for tau in (3.0, 8.0):
                fading = np.exp(-((v / p["dtheta_stribeck"]) ** p["alpha"]))
                level = p["friction_base"] + fading * p["friction_stribeck"] + p["load_friction_base"] * abs(-tau - tau)
                expected = float(replace(each, law="auto").friction([v], load=tau)[0])
                assert level + p["friction_viscous"] * v == pytest.approx(expected, rel=0.03)
