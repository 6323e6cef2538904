"""MCAP files of an arm simulated with MuJoCo, whose messages are in protobuf, in own types and in Foxglove's."""

import json
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from mcap.writer import Writer as McapWriter
from tests.cli.test_cli import run
from tests.log.readers.messages import START
from tests.mujoco_arm import COULOMB, JOINTS, VISCOUS, record, urdf

from stribeck.core.errors import LogError
from stribeck.core.settings import LogTable
from stribeck.io.readers import read_log
from stribeck.io.readers.formats import open_log

TIME = "google.protobuf.Timestamp"
CHANNELS = {"position": "position", "velocity": "velocity", "effort": "torque"}
ONE, SEVERAL = ({"name": f"string{end}"} | dict.fromkeys(CHANNELS, f"double{end or '?'}") for end in ("", "*"))
RATES = dict.fromkeys(("orientation", "angular_velocity", "linear_acceleration"), "arm.Vector")
TYPES = {
    "arm.Own": {"Header": {"stamp": TIME}, "Own": {"header": "arm.Header", **SEVERAL}},
    "foxglove.JointStates": {"State": ONE, "JointStates": {"timestamp": TIME, "joints": "foxglove.State*"}},
    "arm.Motion": {"Vector": dict.fromkeys("xyzw", "double"), "Motion": {"stamp": TIME, **RATES}},
    "arm.Motors": {"Motor": {"angle": "double", "current": "float"}, "Motors": {"motors": "arm.Motor*"}},
}
"""Type -> fields of the messages in its file; `*` is a list, `?` is optional."""


def describe(kind: str) -> list[descriptor_pb2.FileDescriptorProto]:
    """Describe a type: its file, before the one that it imports, as some writers do."""
    file = descriptor_pb2.FileDescriptorProto(name=kind, package=kind.partition(".")[0], syntax="proto3")
    file.dependency.append("google/protobuf/timestamp.proto")
    for name, fields in TYPES[kind].items():
        message = file.message_type.add(name=name)
        for number, (key, own) in enumerate(fields.items(), 1):
            plain = own.strip("*?")
            of_type = f".{plain}" if "." in own else None
            entry = message.field.add(name=key, number=number, label=3 if "*" in own else 1, type_name=of_type)
            entry.type = getattr(entry, f"TYPE_{'MESSAGE' if of_type else plain.upper()}")
            if "?" in own:
                entry.proto3_optional, entry.oneof_index = True, len(message.oneof_decl)
                message.oneof_decl.add(name=f"_{key}")
    return [file, descriptor_pb2.FileDescriptorProto.FromString(timestamp_pb2.DESCRIPTOR.serialized_pb)]


def values_of(kind: str, log: dict[str, np.ndarray], row: int, stamp: int) -> dict[str, object]:
    """Make the values of a message of one row of a log."""
    time = dict(zip(("seconds", "nanos"), divmod(stamp, 10**9), strict=True))
    own = {"name": JOINTS} | {key: log[name][row] for key, name in CHANNELS.items()}
    joints = [dict(zip(own, joint, strict=True)) for joint in zip(*own.values(), strict=True)]
    return {
        "arm.Own": {"header": {"stamp": time}, **own},
        "foxglove.JointStates": {"timestamp": time, "joints": joints},
        "arm.Motion": {"stamp": time, "angular_velocity": {"z": row}, "linear_acceleration": {"z": 9.81}},
        "arm.Motors": {"motors": [{"angle": joint["position"], "current": joint["effort"]} for joint in joints]},
    }[kind]


def write(path: Path, log: dict[str, np.ndarray], kinds: list[str], files: int = 2) -> Path:
    """Write a log as messages of these types; the recorder's time is 7 ms late."""
    with path.open("wb") as out:
        writer = McapWriter(out)
        writer.start()
        for kind in kinds:
            made = message_factory.GetMessages(describe(kind), descriptor_pool.DescriptorPool())[kind]
            data = descriptor_pb2.FileDescriptorSet(file=describe(kind)[2 - files :]).SerializeToString()
            schema = writer.register_schema(kind, "protobuf", data)
            channel = writer.register_channel("/" + kind.replace(".", "/"), "protobuf", schema)
            for row, stamp in enumerate((START + np.round(log["time"] * 1e9).astype(int)).tolist()):
                message = made(**values_of(kind, log, row, stamp))
                writer.add_message(channel, stamp + 7_000_000, message.SerializeToString(), stamp)
        writer.finish()
    return path


@pytest.fixture(scope="module")
def recorded() -> dict[str, np.ndarray]:
    return record([1.5, 2.0, 2.5])


@pytest.mark.parametrize("kind", ["arm.Own", "foxglove.JointStates"])
def test_a_user_finds_the_friction_of_a_log_in_protobuf(kind: str, recorded, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(urdf())
    log, robot, out = write(tmp_path / "log.mcap", recorded, [kind]), tmp_path / "robot.toml", tmp_path / "out"
    read = read_log(log)
    assert all(np.array_equal(getattr(read, channel), recorded[channel]) for channel in CHANNELS.values())
    assert f"{START / 1e9:.6f}" in read.notes[0]  # the message's stamp, not the recorder's
    commands = [["init", tmp_path / "arm.urdf", log, "-o", robot], ["inspect", log, "-r", robot]]
    commands += [["identify", log, "-r", robot, "-o", out, "--law", "coulomb-viscous"]]
    commands += [["export", out / "result.json", "-r", robot, "--to", "mjcf", "-o", tmp_path / "arm.xml"]]
    assert [run(*command) for command in commands] == [0] * 4
    joints = json.loads((out / "result.json").read_text())["joints"]
    assert {joint["verdict"] for joint in joints.values()} == {"identified"}
    found = [[joints[name]["parameters"][key]["value"] for name in JOINTS] for key in ("coulomb", "viscous")]
    np.testing.assert_allclose(found, [COULOMB, VISCOUS], rtol=0.05)


def test_an_imu_without_orientation_and_numbers_that_log_names(recorded, tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", recorded, ["arm.Own", "arm.Motion", "arm.Motors"])
    read = read_log(path)
    assert (read.base_orientation, *read.angular_velocity[:3, 2]) == (None, 0, 1, 2)
    source = open_log(path, LogTable())
    assert source.others == ("/arm/Motors.motors.angle", "/arm/Motors.motors.current")
    loaded, _ = open_log(path, LogTable(position={"name": source.others[0]})).load({"position": [2]})
    np.testing.assert_array_equal(loaded["position"], recorded["position"][:, 2:])


@pytest.mark.parametrize(("files", "words"), [(1, ["'arm.Own'", "FileDescriptorSet"]), (2, ["'stribeck[protobuf]'"])])
def test_types_that_cannot_be_understood(files: int, words: list[str], recorded, tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", recorded, ["arm.Own"], files)
    missing = {"google.protobuf": None} if files == 2 else {}
    with patch.dict("sys.modules", missing), pytest.raises(LogError) as stop:
        read_log(path)
    assert all(word in str(stop.value) for word in [f"{path}: topic '/arm/Own' is in protobuf", *words])
