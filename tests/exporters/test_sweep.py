"""One joint swept at steady speeds in every target: it resists as the law says, within the loss that was stated."""

import csv
import ctypes
import itertools
import re
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from tests.exporters.found import joint, joint_result, module, of_joint, of_joints, robot_of
from tests.exporters.test_models import STEP, compiled
from tests.mujoco_arm import JOINTS, friction, record, urdf

from stribeck import Robot, export, identify, read_log
from stribeck.app.exporters import TARGETS
from stribeck.app.exporters.forms import SPEEDS, nearest
from stribeck.app.exporters.joints import joint_terms
from stribeck.app.exporters.text_files import FORMULAS, numbers_of
from stribeck.core.errors import SettingsError
from stribeck.core.friction import LAWS, LAWS_WITH_STATE, get_law
from stribeck.core.result import JointResult, Result

EFFECT = {"coulomb": 2.0, "viscous": 0.3, "stribeck_gain": 0.5, "stribeck_velocity": 0.1, "offset": 0.0}
TERMS = {"stribeck_gain": 0.4, "stribeck_velocity": 0.2, "offset": -0.4, "slope": 35.0, "viscous_asymmetry": 0.1}
TERMS |= {"viscous": 0.3, "coulomb": 1.2, "load": 0.07, "coulomb_per_kelvin": -0.01, "viscous_per_kelvin": -0.02}
TERMS |= {"coulomb_cosine": 0.1, "coulomb_sine": -0.05, "ripple_cosine": 0.02, "ripple_sine": 0.03}
VALUES = TERMS | {"exponent": 1.3, "bristle_travel": 4e-3, "bristle_damping": 2.0}
VALUES |= {"viscous_positive": 0.2, "viscous_negative": 0.4, "coulomb_positive": 1.5, "coulomb_negative": 0.5}
POINTS = list(itertools.product([-2.0, -0.3, -1e-3, 1e-3, 0.05, 1.7], [-8.0, 0.0, 3.0], [-5.0, 12.0], [-2.0, 0.4]))
"""Velocity, load, temperature, position."""

Sweep = Callable[[Path, str, Robot, np.ndarray], np.ndarray]
"""File, joint, robot, speeds -> the torque that resists."""


def driven(model: mujoco.MjModel, name: str, speeds: np.ndarray) -> np.ndarray:
    """Return the torque that resists at each step of a joint that moves at these speeds, but stays where it is."""
    data, found = mujoco.MjData(model), []
    dof, place = model.joint(name).dofadr[0], model.joint(name).qposadr[0]
    for speed in speeds:
        data.qvel[:], data.qpos[place] = 0.0, 0.0
        data.qvel[dof] = speed
        mujoco.mj_forward(model, data)
        found.append(-(data.qfrc_passive + data.qfrc_actuator + data.qfrc_constraint)[dof])
        mujoco.mj_step(model, data)
    return np.array(found)


def in_mujoco(path: Path, name: str, _: Robot, speeds: np.ndarray) -> np.ndarray:
    model = compiled(path)
    steps = [50 + int(0.01 / (abs(speed) * STEP)) for speed in speeds]  # until the torque is steady
    return np.array([driven(model, name, np.full(n, v))[-1] for n, v in zip(steps, speeds, strict=True)])


def in_urdf(path: Path, name: str, _: Robot, speeds: np.ndarray) -> np.ndarray:
    dynamics = ET.parse(path).getroot().find(f"joint[@name='{name}']/dynamics").attrib
    return float(dynamics.get("friction", 0.0)) * np.sign(speeds) + float(dynamics["damping"]) * speeds


def in_table(path: Path, name: str, _: Robot, speeds: np.ndarray) -> np.ndarray:
    rows = list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))
    assert {row["joint"] for row in rows} == {name}
    velocity, friction = (np.array([float(row[word]) for row in rows]) for word in ("velocity", "friction"))
    assert np.all(np.diff(velocity) > 0)
    return np.interp(speeds, velocity, friction)


SWEEPS: dict[str, tuple[str, Sweep]] = {
    "plain": ("mjcf", in_mujoco),
    "lugre": ("mjcf", in_mujoco),
    "urdf": ("urdf", in_urdf),
    "drake": ("drake", in_urdf),
    "table": ("table", in_table),
}


def line_of(result: Result, name: str, target: str, form: str | None, include_weak: bool = False) -> str:
    """Describe what the file of a target states of a joint."""
    forms = TARGETS[target].forms
    return str(joint_terms(result, forms[form or next(iter(forms))], include_weak=include_weak)[name])


@pytest.mark.parametrize("kind", SWEEPS)
def test_a_joint_resists_as_the_law_does_within_the_loss_that_was_stated(kind: str, tmp_path: Path) -> None:
    target, sweep = SWEEPS[kind]
    form = kind if kind in TARGETS[target].forms else None
    own = joint(**EFFECT, slope=80.0)
    speeds = np.arange(1, SPEEDS + 1) / SPEEDS
    speeds = np.concatenate([-speeds[::8], speeds])
    result, robot, name = of_joint(own, tmp_path, "toro" if target == "mjcf" else "arm")
    export(result, robot, tmp_path / "found.xml", target, friction=form)
    terms = joint_terms(result, TARGETS[target].forms[form or next(iter(TARGETS[target].forms))])[name]
    loss = terms.fit.remains if terms.fit else 0.0
    off = np.sqrt(np.mean((sweep(tmp_path / "found.xml", name, robot, speeds) - own.friction(speeds)) ** 2))
    assert off == pytest.approx(loss, rel=0.3, abs=3e-3)
    assert ("approximates" in str(terms)) == (loss > 0)
    assert off < {"lugre": 0.02, "table": 1e-3, "drake": 1.5}.get(kind, 0.3)


@pytest.mark.parametrize("form", ["plain", "lugre"])
@pytest.mark.parametrize("robot", ["panda", "go2", "toro"])
def test_a_model_comes_to_rest_at_usual_steps(robot: str, form: str, tmp_path: Path) -> None:
    """After a push of 0.01 rad/s without gravity; LuGre friction only up to the step in the file's head."""
    machine, _ = robot_of(robot, tmp_path)
    result, _ = of_joints(tmp_path, *[joint(**EFFECT, slope=80.0)] * len(machine.joint_names), robot=robot)
    export(result, machine, tmp_path / "new.xml", "mjcf", friction="lugre" if form == "lugre" else None)
    model, (head, _, body) = compiled(tmp_path / "new.xml"), (tmp_path / "new.xml").read_text().partition("-->")
    steps = {float(step) for step in re.findall("stable at steps of ([0-9.]+) ms", head)} or {2.0, 5.0}
    assert (' lugre="' in body) == (form == "lugre") == (len(steps) == 1)
    dofs = [model.joint(name).dofadr[0] for name in machine.joint_names]
    for model.opt.timestep in np.array([*steps]) / 1e3:
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[dofs] = model.qpos0, 0.01
        for _ in range(round(2 / model.opt.timestep)):
            mujoco.mj_step(model, data)
        assert abs(data.qvel[dofs]).max() < 1e-3


def test_bristles_that_were_found_are_those_of_the_motor(tmp_path: Path) -> None:
    """After a reversal at 0.2 rad/s, until friction is steady again."""
    own = joint("lugre", **EFFECT, bristle_travel=0.01, bristle_damping=1.5)
    result, robot, name = of_joint(own, tmp_path, "toro")
    export(result, robot, tmp_path / "new.xml", "mjcf", friction="lugre")
    line = line_of(result, name, "mjcf", "lugre")
    assert "sigma_1 1.5 N m s/rad, sigma_0 200 N m/rad" in line
    assert "bristle" not in line
    velocity = np.repeat([0.2, -0.2], round(0.4 / STEP))
    found = driven(compiled(tmp_path / "new.xml"), name, velocity)
    after = slice(len(velocity) // 2, None)
    np.testing.assert_allclose(found[after], own.friction(velocity, period=STEP)[after], atol=0.02)
    weak = {k: replace(p, verdict="weak") if "bristle" in k else p for k, p in own.parameters.items()}
    result = replace(result, joints={name: replace(own, parameters=weak)})
    line = line_of(result, name, "mjcf", "lugre")
    assert "sigma" not in line
    assert "bristle_travel 0.01, bristle_damping 1.5" in line


def joints() -> dict[str, JointResult]:
    """One of each law, one of all terms, one without friction."""
    laws = sorted({*LAWS, *LAWS_WITH_STATE})
    found = {law: joint(law, **{own.name: VALUES[own.name] for own in get_law(law).parameters}) for law in laws}
    found["auto"] = replace(joint(**TERMS), mean_direction=(0.3, -0.2), ripple_per_turn=4.0, mean_load=2.0)
    found["auto"] = replace(found["auto"], load_deviation=1.0, position_range=(-1.2, 0.9))
    none = joint_result({"offset": (0.1, "N m")})
    return found | {"none": replace(none, verdict="no friction", reason="below 0.2 N m", law="auto")}


HEADER = (Path(__file__).parent / "sweep.c").read_text()


def functions(own: JointResult, folder: Path, name: str, compiler: str = "cc -std=c99") -> ctypes.CDLL:
    """Return the functions of a joint's header; warnings are errors."""
    result, robot, _ = of_joint(own, folder)
    export(result, robot, folder / f"{name}.h", "c")
    real = "float" if "-DFRICTION_FLOAT" in compiler else "double"
    source, library = folder / f"{name}.{'cpp' if 'c++' in compiler else 'c'}", folder / f"{name}.so"
    source.write_text(HEADER.format(name=name, real=real))
    flags = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-shared", "-fPIC"]
    subprocess.run([*compiler.split(), *flags, source, "-o", library, "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))
    kind = ctypes.c_float if real == "float" else ctypes.c_double
    for function, count in (("of", 4), ("mean", 3), ("compensation", 2)):
        getattr(loaded, function).argtypes, getattr(loaded, function).restype = [kind] * count, kind
    return loaded


@pytest.mark.parametrize(
    ("compiler", "tolerance"),
    [("cc -std=c99", 1e-12), ("c++ -std=c++17", 1e-12), ("cc -std=c99 -Wdouble-promotion -DFRICTION_FLOAT", 2e-6)],
)
def test_compiled_friction_is_the_friction_that_was_found(compiler: str, tolerance: float, tmp_path: Path) -> None:
    assert {*LAWS, *LAWS_WITH_STATE, "auto"} == {*FORMULAS}
    for law, own in joints().items():
        header = functions(own, tmp_path, law, compiler)
        for point in POINTS:
            assert header.of(*point) == pytest.approx(own.friction(*point), abs=tolerance, rel=tolerance)
            assert header.mean(*point[:3]) == pytest.approx(own.friction(*point[:3]), abs=tolerance, rel=tolerance)


def test_python_is_the_friction_that_was_found_and_compensates_as_c_does(tmp_path: Path) -> None:
    for law, own in joints().items():
        result, robot, name = of_joint(own, tmp_path)
        export(result, robot, tmp_path / law, "python")
        found, point = module(tmp_path / law), np.array(POINTS).T
        np.testing.assert_allclose(found.friction_torque(name, *point), own.friction(*point), atol=1e-12)
        measured = found.friction_torque(name, *point, offset=True)
        np.testing.assert_allclose(measured, own.friction(*point, offset=True), atol=1e-12)
        header, compensation = functions(own, tmp_path, law), found.Compensation(name, limit=1.0)
        for desired in 0.3 * np.sin(np.linspace(0, 20, 500)):
            torque = compensation.torque(desired + 0.01, desired, 0.001)
            assert torque == pytest.approx(header.compensation(desired + 0.01, desired), abs=1e-12)


def test_compensation_is_silent_at_rest_bounded_and_does_not_jump(tmp_path: Path) -> None:
    header = functions(joints()["coulomb-viscous"], tmp_path, "found")
    noise = 0.02 * np.random.default_rng(0).standard_normal(1000)
    assert all(header.compensation(measured, 0.005) == 0 for measured in noise)
    torque = np.array([header.compensation(v, v) for v in np.linspace(0.0, 2.0, 4000)])
    assert torque.max() == 1.0  # the limit
    assert np.abs(np.diff(torque)).max() < 0.1
    stopped = np.array([header.compensation(0.0, 0.0) for _ in range(400)])
    assert abs(stopped[-1]) < 1e-6 < torque[-1]


def test_odd_names_stay_and_equal_identifiers_and_laws_without_a_formula_are_refused(tmp_path: Path) -> None:
    own = joints()["stribeck"]
    result, robot, _ = of_joint(own, tmp_path)

    def named(*names: str) -> tuple[object, Robot]:
        return replace(result, joints=dict.fromkeys(names, own)), replace(robot, joint_names=names)

    export(*named('el"b,ow'), tmp_path / "found.csv", "table")
    rows = [line for line in (tmp_path / "found.csv").read_text().splitlines() if not line.startswith("#")]
    assert {row["joint"] for row in csv.DictReader(rows)} == {'el"b,ow'}
    export(*named('el"b,ow'), tmp_path / "found.yaml", "yaml")
    read = yaml.safe_load((tmp_path / "found.yaml").read_text())
    assert read["joints"]['el"b,ow']["coulomb"] == 1.2
    export(*named("=SUM(A1)", "-x"), tmp_path / "names.csv", "table")
    rows = [line for line in (tmp_path / "names.csv").read_text().splitlines() if not line.startswith("#")]
    assert {row["joint"] for row in csv.DictReader(rows)} == {"'=SUM(A1)", "'-x"}  # spreadsheets read them as text
    small = replace(own, parameters=own.parameters | {"viscous": replace(own.parameters["viscous"], value=1e-5)})
    odd = "e\N{ROBOT FACE}\u202e\\: #\x07"
    both = replace(result, robot=odd, joints={odd: replace(small, mean_temperature=1e-5)})
    export(both, replace(robot, joint_names=(odd,)), tmp_path / "odd.yaml", "yaml")
    read = yaml.safe_load((tmp_path / "odd.yaml").read_text())
    numbers = {"mean_temperature": 1e-5} | numbers_of(small)
    assert read["robot"] == odd
    assert {key: read["joints"][odd][key] for key in numbers} == numbers  # YAML 1.1 reads 1e-05 as a text
    export(*named("elbow */ [x]"), tmp_path / "found.h", "c")
    subprocess.run(["cc", "-Wall", "-Werror", "-fsyntax-only", tmp_path / "found.h"], check=True)
    with pytest.raises(SettingsError, match="joints 'a b' and 'a-b' have the same identifier A_B"):
        export(*named("a b", "a-b"), tmp_path / "none.h", "c")
    assert not (tmp_path / "none.h").exists()
    with pytest.raises(SettingsError, match="no formula for law 'mine'"):
        numbers_of(replace(own, law="mine"))


LAW = {"gain": 0.3, "stribeck_velocity": 0.1}
FAST = 5.0
"""Speed beyond the log [rad/s]."""


@pytest.fixture(scope="module", params=[pytest.param(1, marks=pytest.mark.long), 2], ids=["elbow", "wrist"])
def slow(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    """Identify the arm while one joint moves at most at 0.2 rad/s; return that joint, result, robot and folder."""
    folder = tmp_path_factory.mktemp("slow")
    (folder / "arm.urdf").write_text(urdf())
    robot = Robot.from_model(folder / "arm.urdf", base="fixed")
    speed = np.where(np.arange(3) == request.param, 0.2, 2.5)
    np.savez(folder / "log.npz", joint_names=np.array(JOINTS), **record(speed, **LAW))
    result = identify(read_log(folder / "log.npz", robot), robot)
    assert result.joints[JOINTS[request.param]].curve[-1].velocity < 0.3
    return request.param, result, robot, folder


FORMS = {"mjcf": "plain", "lugre": "lugre", "urdf": None, "drake": None}


@pytest.mark.parametrize("target", [*FORMS, "python"])
def test_friction_at_high_speed_is_near_the_truth(slow, target: str) -> None:
    k, result, robot, folder = slow
    name, path = JOINTS[k], folder / f"{target}.xml"
    form = FORMS.get(target)
    kind = "mjcf" if target == "lugre" else target
    lines = export(result, robot, path, kind, friction=form, joints=[name], include_weak=True)
    speeds = np.array([FAST])
    if target == "python":
        found = module(path).friction_torque(name, speeds)
    else:
        found = (in_mujoco if kind == "mjcf" else in_urdf)(path, name, robot, speeds)
    ratio = float(found[0] / friction(np.full(3, FAST), **LAW)[k])
    assert 0.25 < ratio < 2.0
    line = line_of(result, name, kind, form, include_weak=True)
    assert "rad/s, friction is estimated with that of the other joints: " in line
    assert f"Extrapolated beyond the log's speeds, with the other joints: {name}." in lines


@pytest.mark.parametrize("form", ["lugre", "plain"])
def test_within_the_log_the_model_has_the_friction_that_was_identified(slow, form: str) -> None:
    """At five speeds of each joint: in the inner half of the 95 % interval, or as near as the form comes."""
    _, result, robot, folder = slow
    path = folder / "within.xml"
    export(result, robot, path, "mjcf", friction=form, include_weak=True)
    for name, own in result.joints.items():
        speeds = own.curve[-1].velocity * np.array([0.1, 0.3, 0.5, 0.8, 1.0])
        halves = np.interp(speeds, *np.array([(point.velocity, point.half_width) for point in own.curve]).T)
        loss = nearest(own, TARGETS["mjcf"].forms[form]).largest[0]
        off = np.abs(in_mujoco(path, name, robot, speeds) - own.friction(speeds))
        assert np.all(off <= np.maximum(halves / 2, 1.03 * loss))
