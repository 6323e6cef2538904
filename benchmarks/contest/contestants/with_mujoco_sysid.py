"""mujoco.sysid: friction loss and damping whose rollouts, driven by the logged torques, follow the log.

    python benchmarks/contest/contestants/with_mujoco_sysid.py CASE OUT

Requires mujoco[sysid], and the root of the repository in PYTHONPATH. The program follows its integration test, which
identifies an arm: one modifier per parameter, sensors of position and velocity, `build_residual_fn`,
`optimize(optimizer="mujoco")`, and `calculate_intervals`. Rollouts restart every half second, because an arm without a
controller falls during a whole log. Logs of position commands drive position actuators with the gains of the robot
file; these controlled rollouts last 20 s, and the delay of the drives is another parameter (`SignalTransform.delay`).
"""

from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid
from scipy.signal import butter, sosfiltfilt

from benchmarks.contest.contestants.command import main, names_of, read_case, with_rotors

CUTOFF = 20.0
"""Cutoff for the initial positions of rollouts [Hz]."""
WINDOW = 0.5
"""Duration of a rollout [s]."""
ENDS = 0.25
"""Duration excluded at both ends of a log, where filters settle [s]."""
LONGEST = 20.0
"""Total duration of all rollouts, which are spread evenly over the logs [s]."""
START, MOST = 0.5, 60.0
"""Initial value and upper bound of friction loss [N m] and damping [N m s/rad]."""
OFFSET = 20.0
"""Largest offset of a motor [N m]; the initial offset is zero."""
CONTROLLED = 20.0
"""Duration of a rollout with position commands [s]."""
STEP = 0.001
"""Time step of rollouts with position commands [s]."""
STIFF = [0.005, 1.0], [0.99, 0.999, 0.001, 0.5, 2.0]
"""solref and solimp of friction: with MuJoCo's defaults, joints creep and position errors are five times larger."""
DELAY = 0.01, 0.1
"""Initial value and upper bound of the drives' delay [s]."""
ROTOR = 0.01, 2.0
"""Initial value and upper bound of rotor inertia [kg m^2]."""
LEAST_MASS, LEAST_INERTIA = 1e-4, 1e-6
"""Minimum mass [kg] and inertia [kg m^2] of a body; MuJoCo rejects smaller values."""
ITERATIONS = 20
"""Maximum number of iterations: an arm converges after ten, but the default tolerance requires three times as many."""
NAMES = {"coulomb": "frictionloss", "viscous": "damping", "offset": "offset"}


def load_spec(folder: Path, table: dict[str, Any], joints: list[str], rate: float) -> Any:
    """Load the model with a motor, a position sensor and a velocity sensor at every joint."""
    spec = mujoco.MjSpec.from_file(str(folder / table["model"]))
    spec.option.timestep = STEP if "kp" in table else 1 / max(rate, 500.0)
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
        if "kp" in table:
            motor.set_to_position(kp=table["kp"][joint], kv=table["kd"][joint])
            spec.joint(joint).solref_friction, spec.joint(joint).solimp_friction = STIFF
        else:
            motor.set_to_motor()
        motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE  # its constant is minus the offset
    for kind, sensor in (
        ("position", mujoco.mjtSensor.mjSENS_JOINTPOS),
        ("velocity", mujoco.mjtSensor.mjSENS_JOINTVEL),
    ):
        for joint in joints:
            spec.add_sensor(name=f"{joint}_{kind}", type=sensor, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint)
    return spec


def sequences(spec: Any, logs: list[Any], joints: list[str]) -> Any:
    """Cut logs into windows for mujoco.sysid."""
    model = spec.compile()
    starts, controls, sensors = [], [], []
    places = [model.joint(joint).qposadr[0] for joint in joints]
    columns = [model.joint(joint).dofadr[0] for joint in joints]
    for log in logs:
        period = float(np.median(np.diff(log["time"])))
        position = sosfiltfilt(butter(4, 2 * CUTOFF * period, output="sos"), log["position"], axis=0)
        velocity = np.gradient(position, period, axis=0)
        window = CONTROLLED if "desired_position" in log else WINDOW
        length, cut = round(window / period), round(ENDS / period)
        for begin in range(cut, len(position) - cut - length, length):
            rows = slice(begin, begin + length + 1)
            time = period * np.arange(length + 1)
            q, v = np.zeros(model.nq), np.zeros(model.nv)
            q[places], v[columns] = position[begin], velocity[begin]
            starts.append(sysid.create_initial_state(model, q, v, np.zeros(model.na)))
            if "desired_position" in log:  # a command is held until the next command
                steps = np.arange(round(time[-1] / STEP) + 1) * STEP
                last = np.clip(np.floor(steps / period + 1e-6).astype(int), 0, length)
                controls.append(sysid.TimeSeries(steps, log["desired_position"][rows][last]))
            else:
                controls.append(sysid.TimeSeries(time, np.asarray(log["torque"][rows])))
            seen = np.hstack([position[rows], velocity[rows]])
            sensors.append(sysid.TimeSeries.from_names(time, seen, model))
    kept = np.unique(np.linspace(0, len(starts) - 1, round(LONGEST / window)).astype(int))
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
    case, robot_file, logs = read_case(folder)
    table, joints = robot_file["robot"], names_of(logs[0])
    if case["base"] == "floating":
        return said | {
            "blank": "its rollouts begin with the whole state: the log of a walk has no position and velocity of the "
            "base, and the model no ground"
        }
    if "couplings" in table:  # independent of initial values and bounds of rotor inertias
        return said | {
            "blank": "its parameters belong to single joints, and a motor turns two of this robot's, one with a link "
            "without inertia: its rollouts diverge"
        }
    spec = load_spec(folder, table, joints, case["rate"])
    windows = sequences(spec, logs, joints)
    begin = parameters(joints, with_rotors(table))
    transform = sysid.SignalTransform()
    if "kp" in table:
        begin.add(sysid.Parameter("delay", nominal=DELAY[0], min_value=0.0, max_value=DELAY[1]))
        transform.delay("*", begin["delay"])
    residual = sysid.build_residual_fn(
        models_sequences=[windows], n_threads=1, modify_residual=transform.apply if "kp" in table else None
    )
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
    """Write a motion's torques predicted by the identified model."""
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


if __name__ == "__main__":
    main(answer)
