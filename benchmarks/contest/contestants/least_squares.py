"""Baseline that users could write: inverse dynamics, a lowpass, and least squares per joint.

    python -m benchmarks.contest.contestants.least_squares CASE OUT

Positions, torques and the IMU are filtered; velocities and accelerations are central differences. For walking robots,
the IMU gives the motion of the base, and a joint's samples count while no foot of its limb stands. The program uses no
code of stribeck.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.ndimage import binary_dilation
from scipy.signal import butter, sosfiltfilt

from benchmarks.contest.contestants.command import main, names_of, read_case, torque_of, with_rotors

CUTOFF = 20.0
"""Cutoff of all filters [Hz], unless the case contains the band of its torques."""
MOVES = 0.02
"""Share of a joint's top speed below which it is at rest [1]."""
ENDS = 0.25
"""Duration excluded at both ends of a log, where filters settle [s]."""
AROUND = 0.1
"""Duration excluded before and after a foot stands [s]."""
LEAST = 100
"""Minimum number of samples of a joint."""
NAMES = ("coulomb", "viscous", "offset")


def load_model(folder: Path, robot: dict[str, Any]) -> Any:
    """Read Pinocchio's model, without gravity if the base floats (its IMU measures gravity)."""
    path = str(folder / robot["model"])
    floating = robot.get("base", "floating") == "floating"
    if path.endswith(".xml"):
        model = pin.buildModelFromMJCF(path)
    else:
        model = pin.buildModelFromUrdf(path, pin.JointModelFreeFlyer()) if floating else pin.buildModelFromUrdf(path)
    if floating:
        model.gravity.linear = np.zeros(3)
    for joint, value in robot.get("armature", {}).items():
        model.armature[model.joints[model.getJointId(joint)].idx_v] = value
    return model


def rigid_torque(model: Any, names: list[str], q: Any, v: Any, a: Any, base: Any = None) -> Any:
    """Compute torques without friction [N m], shape (T, n); `base` has angular velocity and acceleration, (T, 9)."""
    data, free = model.createData(), base is not None
    joints = [model.joints[model.getJointId(name)] for name in names]
    columns, places = [joint.idx_v for joint in joints], [joint.idx_q for joint in joints]
    found = np.empty_like(q)
    for k in range(len(q)):
        full_q, full_v, full_a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        full_q[places], full_v[columns], full_a[columns] = q[k], v[k], a[k]
        if free:
            full_v[3:6], full_a[:3], full_a[3:6] = base[k, :3], base[k, 3:6], base[k, 6:]
        found[k] = pin.rnea(model, data, full_q, full_v, full_a)[columns]
    return found


def in_the_air(model: Any, table: dict[str, Any], names: list[str], log: Any, period: float) -> Any:
    """Select the samples in which no foot of a joint's limb stands, shape (T, n)."""
    free = np.ones(log["position"].shape, dtype=bool)
    for foot, contact in table.get("contacts", {}).items():
        column = list(log["foot_names"]).index(foot)
        near = binary_dilation(log["contact"][:, column], iterations=max(round(AROUND / period), 1))
        joint = model.frames[model.getFrameId(contact["frame"])].parentJoint
        while joint > 0:
            if model.names[joint] in names:
                free[:, names.index(model.names[joint])] &= ~near
            joint = model.parents[joint]
    return free


def equations(model: Any, table: dict[str, Any], log: Any, cutoff: float) -> tuple[Any, Any, Any, Any]:
    """Compute friction torque, velocity, acceleration and the mask of valid samples of one log, shape (T, n) each."""
    names, period = names_of(log), float(np.median(np.diff(log["time"])))
    lowpass = butter(4, 2 * cutoff * period, output="sos")
    raw = log["position"], torque_of(log, table["robot"], names)
    q, torque = (sosfiltfilt(lowpass, each, axis=0) for each in raw)
    v = np.gradient(q, period, axis=0)
    a = np.gradient(v, period, axis=0)
    base, counts = None, np.ones(q.shape, dtype=bool)
    if table.get("contacts"):
        turning, force = (
            sosfiltfilt(lowpass, log[name], axis=0) for name in ("angular_velocity", "linear_acceleration")
        )
        base = np.hstack([turning, force, np.gradient(turning, period, axis=0)])
        counts = in_the_air(model, table, names, log, period)
    counts &= np.abs(v) > MOVES * np.percentile(np.abs(v), 99, axis=0)
    counts[: round(ENDS / period)] = counts[-round(ENDS / period) :] = False
    return torque - rigid_torque(model, names, q, v, a, base), v, a, counts


def columns_of(v: Any, a: Any, rotors: bool) -> Any:
    """Stack the regressors of Coulomb friction, viscous friction, offset and rotor inertia, shape (T, n, p)."""
    return np.stack([np.sign(v), v, np.ones_like(v), a][: 3 + rotors], axis=2)


def answer(folder: Path, out: Path) -> dict[str, Any]:
    case, table, logs = read_case(folder)
    model, names, rotors = load_model(folder, table["robot"]), names_of(logs[0]), with_rotors(table["robot"])
    parts = [equations(model, table, log, case.get("band", CUTOFF)) for log in logs]
    left, v, a, counts = (np.concatenate(each) for each in zip(*parts, strict=True))
    columns = columns_of(v, a, rotors)
    found = {
        name: np.linalg.lstsq(columns[rows, k], left[rows, k])[0]
        for k, (name, rows) in enumerate(zip(names, counts.T, strict=True))
        if np.sum(rows) >= LEAST
    }
    if case.get("predict"):
        log = np.load(folder / case["predict"])
        q, v, a = (log[name] for name in ("position", "velocity", "acceleration"))
        friction = np.einsum("tnp,np->tn", columns_of(v, a, rotors), np.array([found[name] for name in names]))
        np.savez(out / "torque.npz", torque=rigid_torque(model, names, q, v, a) + friction)
    joints = {
        joint: {name: {"value": float(value)} for name, value in zip(NAMES, found[joint], strict=False)}
        for joint in case["joints"]
        if joint in found
    }
    missing = [joint for joint in case["joints"] if joint not in found]
    needs = ["contact flags", "IMU"] if table.get("contacts") else []
    blank = {"blank": f"never in the air and moving: {', '.join(missing)}"} if missing else {}
    return {"method": "least squares", "version": np.__version__, "needs": needs, "joints": joints, **blank}


if __name__ == "__main__":
    main(answer)
