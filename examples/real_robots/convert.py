"""Convert the published data of real robots to logs, models and robot files for stribeck.

`python examples/real_robots/convert.py DATA_FOLDER OUT_FOLDER` writes OUT_FOLDER/<robot>/: robot.toml, the model, and
the logs. The script does only conversions that a robot file cannot express: gears, missing torques, faults of a model.
"""

import csv
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
from scipy.spatial.transform import Rotation

HERE = Path(__file__).parent

_PAIRS = ("hip_roll", "hip_yaw", "hip_pitch", "knee", "knee_joint", "ankle_joint")
CASSIE_STATE = (
    *("qw", "qx", "qy", "qz", "x", "y", "z"),
    *(f"{joint}_{side}" for joint in _PAIRS for side in ("left", "right")),
    *(f"{joint}_{side}" for side in ("left", "right") for joint in ("ankle_spring_joint", "toe")),
)
"""Columns of a Cassie log with positions; columns of velocities follow."""
CASSIE_MOTORS = tuple(
    f"{joint}_{side}" for joint in ("hip_roll", "hip_yaw", "hip_pitch", "knee", "toe") for side in ("left", "right")
)
"""Columns of a Cassie log with torques."""
SO101_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
_ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow")
_LEG = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
ICUB_JOINTS = (
    *("neck_pitch", "neck_roll", "neck_yaw", "torso_pitch", "torso_roll", "torso_yaw"),
    *(f"{side}_{joint}" for side in ("l", "r") for joint in _ARM),
    *(f"{side}_{joint}" for side in ("l", "r") for joint in _LEG),
)
"""Rows of the iCub's log, one per joint."""
PENDULUM = """<robot name="pendulum"><link name="world"/><link name="arm"><inertial><origin xyz="0 0 -0.4"/>
<mass value="0.6755"/><inertia ixx="0.03" iyy="0.03" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pendulum" type="continuous"><parent link="world"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>
"""


def tx40(data: Path, out: Path) -> None:
    """Staubli TX40: convert from motor side to joint side; motor 6 drives joint 5 as well as joint 6."""
    shutil.copyfile(data / "tx40_mdh_modified.urdf", out / "tx40.urdf")
    raw = np.load(data / "tx40_motor_side.npz")
    gear = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    gear[5, 4] = 32.0  # motor angles = gear @ joint angles, so that joint torques = gear.T @ motor torques
    zero = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
    np.savez(
        out / "log.npz",
        time=np.arange(len(raw["motor_pos"])) / float(raw["fs"]),
        joint_names=[f"joint_{number}" for number in range(1, 7)],
        position=np.linalg.solve(gear, raw["motor_pos"].T).T + zero,
        torque=raw["motor_torque"] @ gear,
    )


def kinova_gen3(data: Path, out: Path) -> None:
    """Kinova Gen3: convert one file per channel, without headers, to one array per channel."""
    shutil.copyfile(data / "kinova.urdf", out / "kinova.urdf")
    files = {"time": "t", "position": "q", "velocity": "q_d", "acceleration": "q_dd", "torque": "tau"}
    for number in range(1, 6):
        channels = {channel: np.loadtxt(data / f"{file}_downsampled_{number}.csv") for channel, file in files.items()}
        np.savez(out / f"log_{number}.npz", joint_names=[f"joint_{joint}" for joint in range(1, 8)], **channels)


def go2(data: Path, out: Path) -> None:
    """Unitree Go2: rename the channels; the robot file has the gains of the joint controllers."""
    shutil.copyfile(data / "go2.xml", out / "go2.xml")
    raw = {name: array.astype(float) for name, array in np.load(data / "go2_traj_0.npz").items()}
    np.savez(
        out / "log.npz",
        time=raw["time"],
        joint_names=[f"{leg}_{joint}_joint" for leg in ("FL", "FR", "RL", "RR") for joint in ("hip", "thigh", "calf")],
        position=raw["dof_pos"],
        desired_position=raw["des_dof_pos"],
    )


def double_pendulum(data: Path, out: Path) -> None:
    """Double pendulum: copy the logs, and fix two faults of the model.

    Its base is fixed to an undeclared link 'world'. The inertias of its links refer to the joints, but a URDF requires
    inertias about the center of mass (smaller by m r^2).
    """
    for number, path in enumerate(sorted(data.glob("*_trajectory.npz")), start=1):
        shutil.copyfile(path, out / f"log_{number}.npz")
    model = ElementTree.parse(data / "design_C.1_model_1.0_acrobot.urdf")
    root = model.getroot()
    root.append(ElementTree.Element("link", name="world"))
    for link in ("Link1", "Link2"):
        inertial = root.find(f"link[@name='{link}']/inertial")
        mass = float(inertial.find("mass").get("value"))
        radius = float(inertial.find("origin").get("xyz").split()[2])
        inertia = inertial.find("inertia")
        for axis in ("ixx", "iyy", "izz"):
            inertia.set(axis, str(float(inertia.get(axis)) - mass * radius**2))
    model.write(out / "double-pendulum.urdf")


def cassie_landings(data: Path, out: Path) -> None:
    """Cassie: select columns by name; only ten of the sixteen joints have a motor and a torque."""
    shutil.copyfile(HERE.parent / "robots" / "cassie" / "cassie.urdf", out / "cassie.urdf")
    joints = CASSIE_STATE[7:]
    torque_columns = [joints.index(name) for name in CASSIE_MOTORS]
    for number in range(29):
        state, motor_torque = np.load(data / f"x_{number:02d}.npy"), np.load(data / f"u_{number:02d}.npy")
        torque = np.zeros((len(state), len(joints)))
        torque[:, torque_columns] = motor_torque
        np.savez(
            out / f"log_{number:02d}.npz",
            time=np.load(data / f"t_{number:02d}.npy"),
            joint_names=joints,
            position=state[:, 7 : len(CASSIE_STATE)],
            base_orientation=state[:, :4],
            torque=torque,
        )


def so101(data: Path, out: Path) -> None:
    """SO-101: parse lists in the cells of its CSV; its torque is a magnitude without a sign."""
    shutil.copyfile(data / "so101.urdf", out / "so101.urdf")
    for path in sorted(data.glob("*.csv")):
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        channels = {
            channel: np.array([json.loads(row[column]) for row in rows])
            for channel, column in (("position", "positions"), ("velocity", "velocities"), ("torque", "torques"))
        }
        time = [float(row["timestamp"]) for row in rows]
        np.savez(out / f"log_{path.stem}.npz", time=time, joint_names=SO101_JOINTS, **channels)


def icub_walk(data: Path, out: Path) -> None:
    """iCub: convert rows to columns, and base angles to a quaternion; its torques were not recorded."""
    shutil.copyfile(data / "model.urdf", out / "icub.urdf")
    with h5py.File(data / "walking.mat") as raw:
        rows = {name: np.asarray(raw[name]) for name in raw if not name.startswith("#")}
    samples = rows["estimatorJointsTime"].size
    wrench = np.zeros((samples, 2, 6))
    for foot, name in enumerate(("lfForceZ", "rfForceZ")):
        wrench[:, foot, 2] = rows[name][0]
    np.savez(
        out / "log.npz",
        time=rows["estimatorJointsTime"][0],
        joint_names=ICUB_JOINTS,
        position=rows["estimatorJointsPos"].T,
        velocity=rows["estimatorJointsVel"].T,
        torque=np.full((samples, len(ICUB_JOINTS)), np.nan),
        base_orientation=Rotation.from_euler("xyz", rows["linkBaseRot"].T).as_quat(),
        foot_names=["left", "right"],
        foot_wrench=wrench,
    )


def with_robot_file(data: Path, out: Path) -> None:
    """Copy model and logs that need no conversion."""
    for path in (*data.glob("*.urdf"), *data.glob("*.xml"), *data.glob("log_*.npz")):
        shutil.copyfile(path, out / path.name)


def airbot_play(data: Path, out: Path) -> None:
    """AIRBOT Play: join tables of positions and torques, which have no time; leave out the motion with a payload."""
    shutil.copyfile(data / "arm.urdf", out / "arm.urdf")
    for motion in ("chirp", "trapezoids"):
        position, torque = (
            np.loadtxt(data / motion / f"{name}.csv", delimiter=",", skiprows=1) for name in ("q", "tau")
        )
        names = [f"joint{number}" for number in range(1, 7)]
        np.savez(
            out / f"log_{motion}.npz", time=np.arange(len(position)) / 100, joint_names=names, position=position,
            torque=torque,
        )  # fmt: skip


def aliengo(data: Path, out: Path) -> None:
    """Unitree Aliengo: copy the log and its model."""
    shutil.copyfile(data.parent / "aliengo-z1" / "aliengo.xml", out / "aliengo.xml")
    shutil.copyfile(data.parent / "aliengo-z1" / "aliengo.npz", out / "log.npz")


def z1(data: Path, out: Path) -> None:
    """Unitree Z1: rename the gripper."""
    raw = dict(np.load(data.parent / "aliengo-z1" / "z1.npz"))
    np.savez(out / "log.npz", **raw | {"joint_names": [*raw["joint_names"][:-1], "jointGripper"]})


def dfki_pendulum(data: Path, out: Path) -> None:
    """DFKI pendulum: copy three motions, and write a model of the published mass, length and inertia."""
    for motion in ("energy_shaping", "sac", "fft_100s"):
        shutil.copyfile(data / f"{motion}.npz", out / f"log_{motion}.npz")
    (out / "pendulum.urdf").write_text(PENDULUM, encoding="utf-8")


CONVERTERS: dict[str, Callable[[Path, Path], None]] = {
    "tx40": tx40,
    "kinova-gen3": kinova_gen3,
    "go2": go2,
    "double-pendulum": double_pendulum,
    "cassie-landings": cassie_landings,
    "so101": so101,
    "icub-walk": icub_walk,
    "kuka-lwr4": with_robot_file,
    "kinova-gen3-drive": with_robot_file,
    "go2-ten-logs": with_robot_file,
    "airbot-play": airbot_play,
    "aliengo": aliengo,
    "z1": z1,
    "dfki-pendulum": dfki_pendulum,
}


def convert(robot: str, data: Path, out: Path) -> Path:
    """Write the robot file, model and logs of one robot below `out`; return their folder.

    If `curve-fit.toml` exists, its settings become a second robot file.
    """
    folder = out / robot
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(HERE / robot / "robot.toml", folder / "robot.toml")
    if (settings := HERE / robot / "curve-fit.toml").exists():
        text = (HERE / robot / "robot.toml").read_text(encoding="utf-8")
        (folder / "curve-fit.toml").write_text(f"{text}\n{settings.read_text(encoding='utf-8')}", encoding="utf-8")
    CONVERTERS[robot](data / robot, folder)
    return folder


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python convert.py DATA_FOLDER OUT_FOLDER")
    for name in CONVERTERS:
        print(convert(name, Path(sys.argv[1]), Path(sys.argv[2])))
