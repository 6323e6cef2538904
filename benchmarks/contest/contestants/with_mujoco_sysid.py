"""mujoco.sysid: friction loss and damping whose rollouts, driven by the logged torques, follow the log.

    python benchmarks/contest/contestants/with_mujoco_sysid.py CASE OUT

Needs mujoco[sysid] alone. Used as its integration test identifies an arm: parameters with a modifier each, sensors
of position and velocity, `build_residual_fn`, `optimize(optimizer="mujoco")`, and `calculate_intervals`. Its rollouts
begin anew every half second: over a whole log an arm that nobody controls falls.
"""

import json
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid
from scipy.signal import butter, sosfiltfilt

CUTOFF = 20.0
"""Of the positions that rollouts begin with [Hz]."""
WINDOW = 0.5
"""[s]"""
ENDS = 0.25
"""Left out at both ends of a log, where filters swing in [s]."""
LONGEST = 20.0
"""Of all windows together, which are spread evenly over the logs [s]."""
START, MOST = 0.5, 60.0
"""Friction loss [N m] and damping [N m s/rad] to begin with, and bound."""
OFFSET = 20.0
"""Largest offset of a motor [N m], which starts at none."""
ROTOR = 0.01, 2.0
"""Rotor inertia likewise [kg m^2]."""
LEAST_MASS, LEAST_INERTIA = 1e-4, 1e-6
"""Of bodies for which a model has less, which MuJoCo refuses [kg], [kg m^2]."""
ITERATIONS = 20
"""At most: it has converged after ten on an arm, and goes on for three times as many by its own tolerance."""
NAMES = {"coulomb": "frictionloss", "viscous": "damping", "offset": "offset"}


def load_spec(folder: Path, table: dict[str, Any], joints: list[str], rate: float) -> Any:
    """Return the model with a motor, a position and a velocity sensor at every joint."""
    spec = mujoco.MjSpec.from_file(str(folder / table["model"]))
    spec.option.timestep = 1 / max(rate, 500.0)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    spec.option.gravity = table.get("gravity", [0.0, 0.0, -9.81])
    spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS, LEAST_INERTIA
    drawn = [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_MESH]
    free = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]  # a case's base is fixed
    for each in [*spec.keys, *spec.actuators, *spec.sensors, *drawn, *spec.meshes, *free]:
        spec.delete(each)
    for joint in joints:
        spec.joint(joint).armature = table.get("armature", {}).get(joint, spec.joint(joint).armature)
        spec.joint(joint).actfrclimited = False
        motor = spec.add_actuator(name=f"{joint}_motor", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
        motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE  # whose constant is less the offset
        spec.add_sensor(
            name=f"{joint}_position",
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=joint,
        )
    for joint in joints:
        spec.add_sensor(
            name=f"{joint}_velocity",
            type=mujoco.mjtSensor.mjSENS_JOINTVEL,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=joint,
        )
    return spec


def sequences(spec: Any, logs: list[Any], joints: list[str]) -> Any:
    """Return windows of logs as mujoco.sysid reads them."""
    model = spec.compile()
    starts, controls, sensors = [], [], []
    places = [model.joint(joint).qposadr[0] for joint in joints]
    columns = [model.joint(joint).dofadr[0] for joint in joints]
    for log in logs:
        period = float(np.median(np.diff(log["time"])))
        position = sosfiltfilt(butter(4, 2 * CUTOFF * period, output="sos"), log["position"], axis=0)
        velocity = np.gradient(position, period, axis=0)
        length, cut = round(WINDOW / period), round(ENDS / period)
        for begin in range(cut, len(position) - cut - length, length):
            rows = slice(begin, begin + length + 1)
            time = period * np.arange(length + 1)
            q, v = np.zeros(model.nq), np.zeros(model.nv)
            q[places], v[columns] = position[begin], velocity[begin]
            starts.append(sysid.create_initial_state(model, q, v, np.zeros(model.na)))
            controls.append(sysid.TimeSeries(time, np.asarray(log["torque"][rows])))
            seen = np.hstack([position[rows], velocity[rows]])
            sensors.append(sysid.TimeSeries.from_names(time, seen, model))
    kept = np.unique(np.linspace(0, len(starts) - 1, round(LONGEST / WINDOW)).astype(int))
    labels = [f"window_{number}" for number in kept]
    chosen = ([each[number] for number in kept] for each in (starts, controls, sensors))
    return sysid.ModelSequences("robot", spec, labels, *chosen)


def parameters(joints: list[str], rotors: bool) -> Any:
    found = sysid.ParameterDict()
    for joint in joints:
        for name in [*NAMES.values(), *["armature"] * rotors]:
            start, most = {"armature": ROTOR, "offset": (0.0, OFFSET)}.get(name, (START, MOST))
            least = -most if name == "offset" else 0.0

            def modify(spec: Any, parameter: Any, joint: str = joint, name: str = name) -> None:
                value = parameter.value[0]
                if name == "offset":
                    spec.actuator(f"{joint}_motor").biasprm[0] = -value
                else:
                    setattr(spec.joint(joint), name, [value, 0.0, 0.0] if name == "damping" else value)

            found.add(
                sysid.Parameter(f"{joint} {name}", nominal=start, min_value=least, max_value=most, modifier=modify)
            )
    return found


def answer(folder: Path, out: Path) -> dict[str, Any]:
    said: dict[str, Any] = {"method": "mujoco.sysid", "version": version("mujoco"), "needs": ["fixed base"]}
    case = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    table = tomllib.loads((folder / "robot.toml").read_text(encoding="utf-8"))["robot"]
    if case["base"] == "floating":
        return said | {
            "blank": "its rollouts begin with the whole state: the log of a walk has no position and velocity of the "
            "base, and the model no ground"
        }
    if "couplings" in table:  # whatever the rotor inertias that it begins with and their bounds
        return said | {
            "blank": "its parameters belong to single joints, and a motor turns two of this robot's, one with a link "
            "without inertia: its rollouts diverge"
        }
    logs = [np.load(folder / log) for log in case["logs"]]
    joints = [str(name) for name in logs[0]["joint_names"]]
    rotors = table.get("torque_source", "link_side_sensor") != "link_side_sensor"
    spec = load_spec(folder, table, joints, case["rate"])
    windows = sequences(spec, logs, joints)
    residual = sysid.build_residual_fn(models_sequences=[windows], n_threads=1)
    begin = parameters(joints, rotors)
    found, result = sysid.optimize(begin, residual, optimizer="mujoco", verbose=False, max_iters=ITERATIONS)
    residuals, _, _ = residual(result.x, found)
    _, half = sysid.calculate_intervals([np.ravel(each) for each in residuals], result.jac)
    values = {
        name: (float(found[name].value[0]), float(width)) for name, width in zip(found.parameters, half, strict=True)
    }
    print(*values.items(), sep="\n")
    if case.get("predict"):
        predict(spec, found, np.load(folder / case["predict"]), joints, out)
    said["joints"] = {
        joint: {name: _estimate(*values[f"{joint} {label}"]) for name, label in NAMES.items()}
        for joint in case["joints"]
    }
    return said


def _estimate(value: float, half: float) -> dict[str, Any]:
    return {"value": value} | ({"interval_95": [value - half, value + half]} if np.isfinite(half) else {})


def predict(spec: Any, found: Any, log: Any, joints: list[str], out: Path) -> None:
    """Write the torques that the identified model needs for a motion."""
    model = sysid.apply_param_modifiers_spec(found, spec).compile()
    data = mujoco.MjData(model)
    places = [model.joint(joint).qposadr[0] for joint in joints]
    columns = [model.joint(joint).dofadr[0] for joint in joints]
    torque, rigid = np.empty_like(log["position"]), np.zeros(model.nv)
    for k, (q, v, a) in enumerate(zip(log["position"], log["velocity"], log["acceleration"], strict=True)):
        data.qpos[places], data.qvel[columns], data.qacc[columns] = q, v, a
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_rne(model, data, 1, rigid)
        torque[k] = rigid[columns] + model.dof_armature[columns] * a
    torque += (
        log["velocity"] * np.ravel(model.dof_damping[columns])
        + np.sign(log["velocity"]) * model.dof_frictionloss[columns]
        + np.array([found[f"{joint} offset"].value[0] for joint in joints])
    )
    np.savez(out / "torque.npz", torque=torque)


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    (out / "answer.json").write_text(json.dumps(answer(folder, out)), encoding="utf-8")


if __name__ == "__main__":
    main()
