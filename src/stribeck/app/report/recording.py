"""Recordings for the Rerun viewer: torque, friction, velocity and position over time, with one tab per joint."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from stribeck.app.report.torques import elapsed, predictions
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.base.typing import Array
from stribeck.core.errors import require_extra
from stribeck.core.result import Result

Curves = Mapping[tuple[str, str, str], tuple[Array, Array]]
"""Times from zero [s] and values, shape (N,) each, by joint, quantity and label."""


def curves_of_result(result: Result) -> Curves:
    """Collect torque, friction torque and velocity of each joint with friction, over all logs."""
    evidence = result.evidence
    assert evidence is not None  # of an identification
    samples, curves = evidence.samples, {}
    time = elapsed(samples)
    for column, name in enumerate(samples.joint_names):
        joint = result.joints.get(name)
        if joint is None or not joint.parameters or samples.torque is None or column >= samples.torque.shape[1]:
            continue
        measured, without, predicted = predictions(joint, samples, column)
        offset = joint.values.get("offset", 0.0)
        curves[name, "torque", "measured"] = time, measured
        curves[name, "torque", "without friction"] = time, without
        curves[name, "torque", "with friction"] = time, predicted
        curves[name, "friction", "measured"] = time, measured - without + offset
        curves[name, "friction", "identified"] = time, predicted - without + offset
        curves[name, "velocity", "measured"] = time, samples.velocity[:, column]
    return curves


def write_recording(curves: Curves, path: Path, name: str) -> None:
    """Write a recording of this name for the Rerun viewer, completely or not at all.

    Raises
    ------
    SettingsError
        If rerun-sdk is not installed.
    """
    require_extra("rerun", "rerun")
    viewer, blueprint = import_module("rerun"), import_module("rerun.blueprint")
    tabs = {joint: [kind for tab, kind, _ in curves if tab == joint] for joint, _, _ in curves}
    views = [
        blueprint.Vertical(
            *(blueprint.TimeSeriesView(name=k, origin=_path(joint, k)) for k in dict.fromkeys(kinds)), name=joint
        )
        for joint, kinds in tabs.items()
    ]
    with whole_or_not_at_all(path) as temporary, viewer.RecordingStream("stribeck") as recording:
        recording.send_recording_name(name)
        recording.save(str(temporary), default_blueprint=blueprint.Blueprint(blueprint.Tabs(*views)))
        for key, (time, values) in curves.items():
            index = viewer.TimeColumn("log", duration=time)
            recording.send_columns(_path(*key), indexes=[index], columns=viewer.Scalars.columns(scalars=values))
        recording.flush()
        recording.disconnect()


def _path(*parts: str) -> str:
    return str(import_module("rerun").new_entity_path(list(parts)))
