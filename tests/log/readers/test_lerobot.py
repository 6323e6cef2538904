"""LeRobot datasets of versions 2.1 and 3."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from tests.log.readers.formats import JOINTS, StubRobot, synthetic_log
from tests.log.readers.test_damaged import check_refused

from stribeck.core.log.sampling import regularise
from stribeck.core.settings import LogTable
from stribeck.io.readers import read_log

FPS = 50
LOG = synthetic_log(60, rate=FPS)
EPISODES = (slice(0, 25), slice(25, 60))
FILES = {"v2.1": "data/chunk-000/episode_{:06d}.parquet", "v3.0": "data/chunk-000/file-{:03d}.parquet"}
STATE = {
    **{f"{joint}.pos": LOG.position[:, j] for j, joint in enumerate(JOINTS)},
    **{f"{joint}.effort": LOG.torque[:, j] for j, joint in enumerate(JOINTS)},
}
"""Names of the entries of a robot's observation."""


def feature(names, width):
    return {"dtype": "float32", "shape": [width], "names": names}


def features_of(**lists):
    """Make features with several entries per row, {name: (array, names)}, in addition to the standard ones."""
    found = {name.replace("__", "."): feature(names, array.shape[1]) for name, (array, names) in lists.items()}
    for name, kind in (("timestamp", "float32"), ("frame_index", "int64"), ("episode_index", "int64")):
        found[name] = {"dtype": kind, "shape": [1], "names": None}
    return found


def dataset(folder, version="v3.0", change=lambda _: None, fps=FPS, episodes=EPISODES, **lists):
    """Write a dataset of some episodes; `lists` are features as in `features_of`, with `.` written as `__`."""
    lists = lists or {"observation__state": (np.stack(list(STATE.values()), 1), list(STATE))}
    path = folder / "dataset"
    (path / "meta").mkdir(parents=True)
    info = {"codebase_version": version, "fps": fps, "robot_type": "so101_follower", "features": features_of(**lists)}
    info["features"]["observation.images.top"] = {"dtype": "video", "shape": [480, 640, 3], "names": ["h", "w", "c"]}
    (path / "meta/info.json").write_text(json.dumps(info))
    for number, rows in enumerate(episodes):
        samples = rows.stop - rows.start
        columns = {
            name.replace("__", "."): pa.FixedSizeListArray.from_arrays(
                pa.array(np.ravel(array[rows]).astype(np.float32)), array.shape[1]
            )
            if version == "v3.0"
            else pa.array(array[rows].astype(np.float32).tolist(), pa.list_(pa.float32()))
            for name, (array, _) in lists.items()
        }
        columns["timestamp"] = pa.array((np.arange(samples) / fps).astype(np.float32))
        columns["frame_index"] = pa.array(np.arange(samples))
        columns["episode_index"] = pa.array(np.full(samples, number))
        change(columns)
        file = path / FILES[version].format(number)
        file.parent.mkdir(parents=True, exist_ok=True)
        pyarrow.parquet.write_table(pa.table(columns), file)
    return path


@pytest.mark.parametrize("version", FILES)
def test_positions_and_efforts_of_the_state_are_read_by_name(version, tmp_path):
    read = read_log(dataset(tmp_path, version), StubRobot(joint_names=JOINTS[::-1]))
    np.testing.assert_allclose(read.position, LOG.position[:, ::-1], atol=1e-6)
    np.testing.assert_allclose(read.torque, LOG.torque[:, ::-1], atol=1e-6)
    assert read.velocity is None
    assert any("2 episodes were concatenated" in note for note in read.notes)
    assert any("do not state units" in note for note in read.notes)


def test_episodes_are_segments(tmp_path):
    table = LogTable(max_gap=3.0)
    _, sampling = regularise(read_log(dataset(tmp_path), StubRobot(log_table=table)), table)
    assert [segment.stop - segment.start for segment in sampling.segments] == [25, 35]


def test_currents_become_torques_if_the_robot_file_defines_them(tmp_path):
    names = [f"{joint}.pos" for joint in JOINTS]
    current = (LOG.torque / 1.5, list(JOINTS))
    path = dataset(tmp_path, observation__state=(np.rad2deg(LOG.position), names), observation__current=current)
    table = {"torque": {"name": "observation.current", "scale": 1.5}, "position": {"unit": "deg"}}
    read = read_log(path, StubRobot(log_table=LogTable.model_validate(table)))
    assert not any("do not state units" in note for note in read.notes)
    np.testing.assert_allclose(read.position, LOG.position, atol=1e-5)
    np.testing.assert_allclose(read.torque, LOG.torque, atol=1e-5)


def rewritten(**changes):
    def maker(folder):
        path = dataset(folder)
        info = json.loads((path / "meta/info.json").read_text())
        (path / "meta/info.json").write_text(json.dumps(info | changes))
        return path

    return maker


def of_positions_alone(folder):
    return dataset(folder, observation__state=(LOG.position, [f"{joint}.pos" for joint in JOINTS]))


@pytest.mark.parametrize(
    ("maker", "words"),
    [
        (of_positions_alone, ["contains no joint torques", "'observation.effort'", "if the arm's driver reports"]),
        (rewritten(features={"action": {}}), ["has features 'action'", "expected 'observation.state'"]),
    ],
)
def test_errors_are_described_in_one_sentence(maker, words, tmp_path):
    check_refused(maker, words, tmp_path)
