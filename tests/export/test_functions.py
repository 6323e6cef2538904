"""Friction as code: compiled C, C++, Python and torch say what the result says, and compensation does no harm."""

import csv
import ctypes
import importlib.util
import itertools
import subprocess
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from tests.export.found import found_in, joint_result
from tests.export.test_export import robot_of

from stribeck import export
from stribeck.errors import SettingsError
from stribeck.export.numbers import FORMULAS, numbers_of
from stribeck.friction import LAWS, LAWS_WITH_STATE, get_law
from stribeck.result import JointResult, Result

AUTO = {
    "viscous": 0.3,
    "coulomb": 1.2,
    "stribeck_gain": 0.4,
    "stribeck_velocity": 0.2,
    "offset": -0.4,
    "slope": 35.0,
    "viscous_asymmetry": 0.1,
    "load": 0.07,
    "coulomb_per_kelvin": -0.01,
    "viscous_per_kelvin": -0.02,
    "coulomb_cosine": 0.1,
    "coulomb_sine": -0.05,
    "ripple_cosine": 0.02,
    "ripple_sine": 0.03,
}
VALUES = {
    "viscous_positive": 0.2,
    "viscous_negative": 0.4,
    "coulomb_positive": 1.5,
    "coulomb_negative": 0.5,
    "exponent": 1.3,
    "bristle_travel": 4e-3,
    "bristle_damping": 2.0,
    **AUTO,
}
POINTS = list(itertools.product([-2.0, -0.3, -1e-3, 1e-3, 0.05, 1.7], [-8.0, 0.0, 3.0], [-5.0, 12.0], [-2.0, 0.4]))
"""Velocity, load, temperature, position."""


def joints() -> dict[str, JointResult]:
    """One of each law, one of all terms, one without friction."""
    found = {
        law: joint_result({parameter.name: (VALUES[parameter.name], "1") for parameter in get_law(law).parameters})
        for law in sorted({*LAWS, *LAWS_WITH_STATE})
    }
    terms = joint_result({name: (value, "1") for name, value in AUTO.items()})
    found["auto"] = replace(terms, mean_direction=(0.3, -0.2), ripple_per_turn=4.0, mean_load=2.0, load_deviation=1.0)
    found["auto"] = replace(found["auto"], position_range=(-1.2, 0.9))
    none = replace(joint_result({"offset": (0.1, "N m")}), verdict="no friction", reason="below 0.2 N m")
    return {law: replace(joint, law=law) for law, joint in found.items()} | {"none": replace(none, law="auto")}


def result_of(folder: Path, joint: JointResult, name: str = "elbow */ [x]") -> tuple[Result, object]:
    robot, _ = robot_of("arm", folder)
    robot = replace(robot, joint_names=(name, *robot.joint_names[1:]))
    return replace(found_in(robot, joint.law)[0], joints={name: joint}, corrections=None), robot


def compiled(header: Path, flags: list[str], compiler: str = "cc") -> ctypes.CDLL:
    """Return the functions of a header; warnings are errors."""
    real = "float" if "-DFRICTION_FLOAT" in flags else "double"
    source = header.with_suffix(".cpp" if compiler == "c++" else ".c")
    source.write_text(
        f"""#include "{header.name}"
#ifdef __cplusplus
extern "C" {{
#endif
{real} of({real} v, {real} l, {real} t, {real} q) {{ return friction_torque_at(0, v, l, t, q); }}
{real} mean({real} v, {real} l, {real} t) {{ return friction_torque(0, v, l, t); }}
static friction_state state;
{real} compensation({real} v, {real} w) {{
    const friction_settings own = {{({real})0.8, ({real})0.05, ({real})0.02, ({real})0.01, ({real})0.02, ({real})1.0}};
    return friction_compensation(0, v, w, 0, 0, ({real})0.001, &own, &state);
}}
#ifdef __cplusplus
}}
#endif
"""
    )
    library = header.with_name(f"{source.stem}-{compiler}-{real}.so")
    subprocess.run([compiler, *flags, "-O2", "-shared", "-fPIC", source, "-o", library, "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))
    kind = ctypes.c_float if real == "float" else ctypes.c_double
    for name, count in (("of", 4), ("mean", 3), ("compensation", 2)):
        getattr(loaded, name).argtypes, getattr(loaded, name).restype = [kind] * count, kind
    return loaded


def module_at(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("found", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_law_has_a_formula() -> None:
    assert {*LAWS, *LAWS_WITH_STATE, "auto"} == FORMULAS


@pytest.mark.parametrize(
    ("flags", "compiler", "tolerance"),
    [
        (["-Wall", "-Wextra", "-Werror", "-std=c99", "-pedantic"], "cc", 1e-12),
        (["-Wall", "-Wextra", "-Werror", "-std=c++17", "-pedantic"], "c++", 1e-12),
        (["-Wall", "-Wextra", "-Werror", "-std=c99", "-Wdouble-promotion", "-DFRICTION_FLOAT"], "cc", 2e-6),
    ],
)
def test_compiled_friction_is_the_friction_that_was_found(
    flags: list[str], compiler: str, tolerance: float, tmp_path: Path
) -> None:
    for law, joint in joints().items():
        result, robot = result_of(tmp_path, joint)
        header = tmp_path / f"{law}.h"
        export(result, robot, header, "c")  # type: ignore[arg-type]
        functions = compiled(header, flags, compiler)
        for velocity, load, temperature, position in POINTS:
            at = joint.friction(velocity, load, temperature, position)
            assert functions.of(velocity, load, temperature, position) == pytest.approx(
                at, abs=tolerance, rel=tolerance
            )
            mean = joint.friction(velocity, load, temperature)
            assert functions.mean(velocity, load, temperature) == pytest.approx(mean, abs=tolerance, rel=tolerance)


def test_python_is_the_friction_that_was_found_and_compensates_as_c_does(tmp_path: Path) -> None:
    for law, joint in joints().items():
        result, robot = result_of(tmp_path, joint)
        export(result, robot, tmp_path / f"{law}.py", "python")  # type: ignore[arg-type]
        module = module_at(tmp_path / f"{law}.py")
        (name,) = result.joints
        velocity, load, temperature, position = np.array(POINTS).T
        np.testing.assert_allclose(
            module.friction_torque(name, velocity, load, temperature, position),
            joint.friction(velocity, load, temperature, position),
            atol=1e-12,
        )
        export(result, robot, tmp_path / f"{law}.h", "c")  # type: ignore[arg-type]
        functions, own = compiled(tmp_path / f"{law}.h", ["-std=c99"]), module.Compensation(name, limit=1.0)
        for desired in 0.3 * np.sin(np.linspace(0, 20, 500)):
            measured = desired + 0.01
            assert own.torque(measured, desired, 0.001) == pytest.approx(
                functions.compensation(measured, desired), abs=1e-12
            )


def test_compensation_is_silent_at_rest_bounded_and_does_not_jump(tmp_path: Path) -> None:
    joint = joints()["coulomb-viscous"]
    result, robot = result_of(tmp_path, joint)
    export(result, robot, tmp_path / "found.h", "c")  # type: ignore[arg-type]
    functions = compiled(tmp_path / "found.h", ["-std=c99"])
    noise = 0.02 * np.random.default_rng(0).standard_normal(1000)
    assert all(functions.compensation(measured, 0.005) == 0 for measured in noise)
    torque = np.array([functions.compensation(v, v) for v in np.linspace(0.0, 2.0, 4000)])
    assert torque.max() == 1.0  # the limit
    assert np.abs(np.diff(torque)).max() < 0.1
    before = torque[-1]
    stopped = np.array([functions.compensation(0.0, 0.0) for _ in range(400)])
    assert abs(stopped[-1]) < 1e-6 < before


def test_a_weak_joint_is_compensated_by_half(tmp_path: Path) -> None:
    sure = joints()["stribeck"]
    torques = []
    for joint in (sure, replace(sure, verdict="weak")):
        result, robot = result_of(tmp_path, joint)
        path = tmp_path / f"{joint.verdict}.py"  # of its own: compiled modules of one name and second look the same
        export(result, robot, path, "python", include_weak=True)  # type: ignore[arg-type]
        module = module_at(path)
        own = module.Compensation(next(iter(result.joints)))
        torques.append([own.torque(1.0, 1.0, 0.001) for _ in range(1000)][-1])
    assert torques[1] == pytest.approx(0.5 * torques[0])


def test_a_table_and_yaml_hold_the_same_friction(tmp_path: Path) -> None:
    yaml = pytest.importorskip("yaml")
    joint = joints()["stribeck"]
    result, robot = result_of(tmp_path, joint, 'el"b,ow')
    export(result, robot, tmp_path / "found.csv", "table")  # type: ignore[arg-type]
    lines = (tmp_path / "found.csv").read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert {row["joint"] for row in rows} == set(result.joints)
    speeds = np.array([float(row["velocity"]) for row in rows])
    assert np.all(np.diff(speeds) > 0)
    np.testing.assert_allclose([float(row["friction"]) for row in rows], joint.friction(speeds) + 0.4, atol=1e-6)
    export(result, robot, tmp_path / "found.yaml", "yaml")  # type: ignore[arg-type]
    read = yaml.safe_load((tmp_path / "found.yaml").read_text())
    assert read["joints"]['el"b,ow']["coulomb"] == 1.2


def test_torch_takes_the_same_module(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="torch is not here")
    joint = joints()["auto"]
    result, robot = result_of(tmp_path, joint)
    export(result, robot, tmp_path / "found.py", "python")  # type: ignore[arg-type]
    module = module_at(tmp_path / "found.py")
    points = torch.tensor(POINTS, dtype=torch.float64)
    found = module.friction_torque(next(iter(result.joints)), *points.T, xp=torch)
    np.testing.assert_allclose(found.numpy(), joint.friction(*np.array(POINTS).T), atol=1e-12)


def test_names_that_come_to_the_same_and_laws_without_a_formula_are_refused(tmp_path: Path) -> None:
    joint = joints()["stribeck"]
    result, robot = result_of(tmp_path, joint)
    twice = replace(result, joints={"a b": joint, "a-b": joint})
    robot = replace(robot, joint_names=("a b", "a-b"))  # type: ignore[type-var]
    with pytest.raises(SettingsError, match="joints 'a b' and 'a-b' have the same identifier A_B"):
        export(twice, robot, tmp_path / "found.h", "c")  # type: ignore[arg-type]
    assert not (tmp_path / "found.h").exists()
    with pytest.raises(SettingsError, match="no formula of law 'mine'"):
        numbers_of(replace(joint, law="mine"))
