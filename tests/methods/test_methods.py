"""Methods keep one contract: nothing outside one knows which ran, and each says which settings it uses."""

import ast
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pyarrow.parquet as pq
import pytest
from tests.arm import arm_log, save_npz
from tests.cli.test_cli import run

from stribeck import Robot, Settings, identify, read_log
from stribeck.core.base.checked_table import flat
from stribeck.core.base.finding import Finding
from stribeck.core.base.parts import SERVICES
from stribeck.core.equations.friction_torque import preparation
from stribeck.core.equations.friction_torque.stage import FrictionTorqueStage
from stribeck.core.errors import SettingsError
from stribeck.core.friction import LAWS, get_law
from stribeck.core.identify import METHODS, Fitted, Method
from stribeck.core.identify.contract import SHARED
from stribeck.core.judgement.curve_fit.problem import joint_problem
from stribeck.core.log import RobotLog
from stribeck.core.result import read_result
from stribeck.core.settings import FilterSettings
from stribeck.paper.curve_fit.fit import fit_joint

SOURCE = Path(__file__).parents[2] / "src/stribeck"
NAMES = tuple(METHODS)
"""Of stribeck's own methods: tests add another for a while."""

OTHER = {"tilt": "flat", "double_support": "fit", "standing_legs": True}
"""Settings of robots on feet by key, each another than the usual one."""
ON_AN_ARM = {"loss": "huber", "fit_armature": True, "filter_torque": True, "averaged_law": True}
ON_AN_ARM |= {"rest": 0.1, "block": 0.5, "holdout": 4, "observer_bandwidth": 5.0}
ON_AN_ARM |= {"corrections": "none", "regression": "robust"}
OTHER |= ON_AN_ARM


@pytest.fixture(scope="module")
def log(arm: Robot) -> RobotLog:
    return arm_log(arm, duration=12, rate=250)


SAID = Finding(check="said", text="all samples")


@pytest.fixture
def all_samples(monkeypatch: pytest.MonkeyPatch) -> str:
    """A third method: it holds nothing out."""

    def find(prepared, robot, law, settings, friction_torque, progress):  # type: ignore[no-untyped-def] # noqa: ARG001
        samples = friction_torque(prepared, robot, settings).samples
        fits = {joint: fit_joint(joint_problem(samples, joint, law, settings)) for joint in samples.joint_names}
        return Fitted(fits=fits, validations=dict.fromkeys(fits), robot=robot, logs=prepared, findings=[SAID])

    method = Method(defaults=lambda _: {"law": "stribeck"}, name="all-samples", uses=SHARED, laws=LAWS, find=find)
    monkeypatch.setitem(METHODS, method.name, method)
    return method.name


def test_a_third_method_goes_through_the_spine_and_the_command_line(arm, log, all_samples, tmp_path, capsys):
    result = identify(log, arm.path, method=all_samples)
    assert (result.method, result.warnings, result.corrections) == (all_samples, ["all samples"], None)
    assert {joint.validation for joint in result.joints.values()} == {None}
    settings = {label for label, _ in result.evidence.provenance}
    assert "Setting rest" in settings
    assert "Setting holdout" not in settings
    path = save_npz(log, tmp_path / "log.npz")
    command = ("identify", path, "--robot", arm.path, "--method", all_samples, "-o", tmp_path / "out")
    assert run(*command) == 0
    read = read_result(tmp_path / "out/result.json")
    assert read.joints == result.joints
    assert pq.read_table(tmp_path / "out/friction_torque.parquet").num_rows == read.log.samples_used
    assert "all samples (stribeck explain said)" in capsys.readouterr().out
    assert run(*command, "--overwrite", "--set", "holdout=3") == 2
    said = capsys.readouterr().err
    assert "holdout is 3, which the method 'all-samples' does not use; leave it out, or set holdout = 5" in said


def test_nothing_asks_which_method_ran() -> None:
    """A name of a method stands only in its own file, and as the default of the setting and in the help."""
    named = Counter(
        str(path.relative_to(SOURCE))
        for path in SOURCE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant) and node.value in NAMES
    )
    own = dict.fromkeys(("core/identify/whole_log.py", "paper/ground_reaction.py", "paper/direct/method.py"), 1)
    own["paper/curve_fit/method.py"] = 2  # the observer is a curve fit of another friction torque
    assert named == own | {"core/settings.py": 1, "app/cli/options.py": 1}


STEPS = ("regularise", "find_support_phases")
"""Functions that prepare a log."""


@pytest.mark.parametrize("method", ["curve-fit", "whole-log", "direct"])
def test_each_log_is_prepared_once(arm: Robot, method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = {name: mock.Mock(wraps=getattr(preparation, name)) for name in STEPS}
    for name, step in calls.items():
        monkeypatch.setattr(preparation, name, step)
    calls["read_log"] = mock.Mock(wraps=read_log)
    monkeypatch.setitem(SERVICES, "read_log", calls["read_log"])
    logs = {name: arm_log(arm, 6.0, 250.0, seed) for seed, name in enumerate(("a.npz", "b.npz"))}
    paths = [save_npz(log, tmp_path / name) for name, log in logs.items()]
    identify(paths, arm, method=method, law="coulomb-viscous", table=tmp_path / "f.parquet")
    assert [step.call_count for step in calls.values()] == [2] * len(calls)


@pytest.mark.parametrize("corrections", ["none", "inertia"])
def test_no_stage_copies_a_log_without_need(arm: Robot, corrections: str) -> None:
    """Logs of hours lie on disk once."""
    log = arm_log(arm, duration=6.0)
    settings = Settings(method="whole-log", corrections=corrections)
    prepared = [preparation.prepare(log, arm, settings)]
    stage = FrictionTorqueStage(None, preparation.quiet, prepared[0], arm, settings)
    finding = METHODS["whole-log"].find(prepared, arm, get_law("stribeck"), settings, stage, preparation.quiet)
    for name, channel in finding.logs[0].log.channels().items():
        assert np.shares_memory(channel, getattr(log, name)), name


@pytest.mark.parametrize("method", METHODS)
def test_settings_that_a_method_does_not_use_are_refused(arm: Robot, log: RobotLog, method: str) -> None:
    refused = [key for key in OTHER if key not in METHODS[method].uses]
    assert refused
    for key in refused:
        with pytest.raises(SettingsError, match=f"{key} is .*, which the method '{method}' does not use"):
            identify(log, arm, Settings(method=method).model_copy(update={key: OTHER[key]}))


def test_every_setting_is_of_some_method_and_no_method_uses_what_is_none() -> None:
    assert {key for method in METHODS.values() for key in method.uses} == set(flat(Settings()))


ON_FEET = "ground-reaction"


@pytest.fixture(scope="module")
def found_with(arm: Robot, log: RobotLog, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., tuple[str, Any]]:
    """Result and table of a method, with a setting changed or without."""
    filtered = FilterSettings(kind="savitzky-golay", window=31)
    measured = replace(log, velocity=None, acceleration=None)

    @cache
    def found(method: str, key: str = "") -> tuple[str, Any]:
        table = tmp_path_factory.mktemp("table") / "friction.parquet"
        settings = Settings(method=method, filter=filtered, law="coulomb-viscous")
        settings = settings.model_copy(update={key: OTHER[key]} if key else {})
        return identify(measured, arm, settings, table=table).to_json(), pq.read_table(table)

    return found


@pytest.mark.parametrize(
    ("method", "key"),
    [(name, key) for name, method in METHODS.items() for key in ON_AN_ARM if key in method.uses and name != ON_FEET],
)
def test_a_setting_that_is_used_changes_something(found_with, method, key):
    (before, table), (after, other) = found_with(method), found_with(method, key)
    assert before != after or not table.equals(other)
