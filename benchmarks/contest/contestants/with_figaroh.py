"""FIGAROH: base parameters, friction, rotors and offsets at once, by least squares on the regressor of a fixed robot.

    python benchmarks/contest/contestants/with_figaroh.py CASE OUT

Requires figaroh and the root of the repository in PYTHONPATH. The program follows the authors' example of the Staubli
TX40: `BaseIdentification` with its filter, decimation and QR decomposition, `solve(decimate=True)`, and intervals from
its standard deviations.
"""

from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.load_robot import load_robot
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced

from benchmarks.contest.contestants.command import main, names_of, read_case, torque_of, with_rotors

CUTOFF = 20.0
"""Cutoff of FIGAROH's lowpass [Hz]."""
MEDIAN = 1
"""Window of FIGAROH's median filter [samples]; its default of 5 flattens all reversals in a log of 500 Hz."""
EXAMPLE = {"tx40": (100.0, 5)}
"""Cutoff and median filter of FIGAROH's example, by robot."""
ENDS = 0.25
"""Duration excluded at both ends of a log, where filters settle [s]."""
DECIMATED = 50.0
"""Minimum rate after decimation [Hz]; FIGAROH's default factor of 10 suits the 5 kHz of its example."""
FACTOR = 10
TEMPLATE = Path(__file__).with_name("figaroh.yaml")
NAMES = {"coulomb": "fs", "viscous": "fv", "offset": "off"}


class Identification(BaseIdentification):
    """FIGAROH's identification, fitted to several logs together."""

    def __init__(self, robot: Any, config_file: str, joints: list[str], logs: list[Any]) -> None:
        """Set the joints of the logs, as in the example."""
        super().__init__(robot, config_file)
        self.logs = logs
        numbers = [robot.model.getJointId(joint) for joint in joints]
        moved = [robot.model.joints[number] for number in numbers]
        self.identif_config |= {
            "active_joints": joints,
            "act_Jid": numbers,
            "act_J": moved,
            "act_idxq": [joint.idx_q for joint in moved],
            "act_idxv": [joint.idx_v for joint in moved],
            "idx_act_joints": [number - 1 for number in numbers],
        }

    def load_trajectory_data(self, data_source: str | None = None) -> dict[str, Any]:
        """Return the first log without derivatives; FIGAROH differentiates."""
        del data_source
        return dict(self.logs[0])

    def process_kinematics_data(self, filter_config: Any = None) -> None:
        """Filter and differentiate each log, and remove its ends, as in the example."""
        parts = []
        for log in self.logs:
            self.raw_data = log
            self.filter_kinematics_data(filter_config)
            cut = round(ENDS / self.identif_config["ts"])
            kept = {**self.processed_data, "torques": log["torques"]}
            parts.append({name: values[cut:-cut] for name, values in kept.items()})
        self.processed_data = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def process_torque_data(self, **_: Any) -> Any:
        """Return the torques of the remaining samples."""
        return self.processed_data["torques"]


def configuration(joints: list[str], rate: float, cutoff: float, median: int, rotors: bool) -> dict[str, Any]:
    """Fill in the template of FIGAROH's configuration."""
    filled: dict[str, Any] = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    properties, task = filled["robot"]["properties"], filled["tasks"]["identification"]
    zeros = [0.0] * len(joints)
    properties["joints"]["active_joints"] = joints
    properties["mechanics"] = {
        "friction_coefficients": {"viscous": zeros, "static": zeros},
        "actuator_inertias": zeros,
        "joint_offsets": zeros,
    }
    task["problem"]["model_components"]["actuator_inertia"] = rotors
    task["signal_processing"] |= {"sampling_frequency": rate, "cutoff_frequency": cutoff}
    task["signal_processing"]["filter_params"]["med_fil"] = median
    return filled


def answer(folder: Path, out: Path) -> dict[str, Any]:
    said: dict[str, Any] = {"method": "FIGAROH", "version": version("figaroh"), "needs": ["fixed base"]}
    case, robot_file, logs = read_case(folder)
    table = robot_file["robot"]
    if case["base"] == "floating":
        return said | {"blank": "its regressor of joint torques knows no ground reactions: a robot has to be fixed"}
    if not table["model"].endswith(".urdf"):
        return said | {"blank": "it reads only URDF, and the published model is MJCF"}
    robot = load_robot(str(folder / table["model"]), package_dirs=str(folder))
    joints = names_of(logs[0])
    cutoff, median = EXAMPLE.get(case["robot"], (CUTOFF, MEDIAN))
    settings = configuration(joints, case["rate"], cutoff, median, with_rotors(table))
    (out / "figaroh.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    order = sorted(range(len(joints)), key=lambda k: int(robot.model.getJointId(joints[k])))
    own = [
        {
            "timestamps": log["time"],
            "positions": log["position"][:, order],
            "velocities": None,
            "accelerations": None,
            "torques": torque_of(log, table, joints)[:, order],
        }
        for log in logs
    ]
    found = Identification(robot, str(out / "figaroh.yaml"), [joints[k] for k in order], own)
    found.initialize()
    factor = min(FACTOR, max(1, int(case["rate"] / DECIMATED)))
    found.solve(decimate=factor > 1, decimation_factor=factor, plotting=False, save_results=False)
    values = dict(zip(found.params_base, found.phi_base, strict=True))
    errors = dict(zip(found.params_base, np.abs(found.std_relative * found.phi_base) / 100, strict=True))
    print(*(f"{name} {value:.4g}" for name, value in values.items()), sep="\n")
    if case.get("predict"):
        predict(found, np.load(folder / case["predict"]), order, out)
    said["joints"] = {joint: of_joint(joint, values, errors) for joint in case["joints"]}
    return said


def of_joint(joint: str, values: dict[str, float], errors: dict[str, float]) -> dict[str, Any]:
    """Select a joint's parameters; skip parameters that FIGAROH identifies only in a sum with others."""
    found = {}
    for name, short in NAMES.items():
        label = f"{short}_{joint}"
        if label in values:
            found[name] = {"value": float(values[label]), "standard_error": float(errors[label])}
    return found


def predict(found: Any, log: Any, order: list[int], out: Path) -> None:
    """Write a motion's torques predicted from the identified base parameters."""
    motion = [log[name][:, order] for name in ("position", "velocity", "acceleration")]
    regressor = build_regressor_basic(found.robot, *motion, found.identif_config)
    reduced = build_regressor_reduced(regressor, found._idx_eliminated)
    torque = (reduced[:, found._base_indices] @ found.phi_base).reshape(len(order), -1).T
    unsorted = np.empty_like(torque)
    unsorted[:, order] = torque
    np.savez(out / "torque.npz", torque=unsorted)


if __name__ == "__main__":
    main(answer)
