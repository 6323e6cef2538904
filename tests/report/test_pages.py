"""Every kind of page in a real browser: all of its charts are drawn, without an error in the console."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.fleet.synthetic import write_store
from tests.report.conftest import truth_of
from tests.report.test_report import inspection, joint

from stribeck.app.comparison import compare, compare_sides
from stribeck.app.report import write_inspection, write_report
from stribeck.app.report.curves import write_comparison
from stribeck.app.report.replay import write_replay
from stribeck.app.report.trends import write_trends
from stribeck.core.judgement.torque_error import TorqueError
from stribeck.core.result import Result
from stribeck.design.replaying.comparison import LoggedMotion, Replay, Replayed
from stribeck.design.replaying.rollouts import RolloutError
from stribeck.service.fleet.trends import find_trends


def sizes(seed: int, count: int) -> list[float]:
    """Draw sizes from 1e-6 to 1e6."""
    return (10 ** np.sort(np.random.default_rng(seed).uniform(-6, 6, count))).tolist()


def replay_page(path: Path, seed: int, result: Result) -> None:
    names, horizons, time = list(result.joints), (0.05, 0.1, 0.2), np.linspace(0.0, 9.0, 400)
    reach = dict(zip(names, sizes(seed, len(names)), strict=True))
    wave = {name: size * np.sin(time) for name, size in reach.items()}
    error = TorqueError(r2=0.5, rms=0.1, samples=9)
    moved = {name: (time[::50], np.tile(wave[name][::50, None], 20)) for name in names}
    errors = {name: [RolloutError(relative=reach[name], rms=1.0, rollouts=9)] * 3 for name in names}
    shown = {"predicted": {name: 0.5 * wave[name] for name in names}, "positions": moved}
    own = Replayed(model="arm.urdf", friction=False, torque=dict.fromkeys(names, error), rollouts=errors, **shown)
    models = [own, own, replace(own, friction=True)]
    motion = LoggedMotion(torque_time=time, torque=wave, position_time=time, position=wave)
    about = {"filter": "none", "horizons": horizons, "notes": [], "stribeck": "1", "motion": motion}
    write_replay(Replay(robot=result.robot, log="log.npz", models=models, **about), path)
    assert "<strong>Torque error 0.1 → 0.1 N m</strong>" in path.read_text()


def inspection_page(path: Path, seed: int, result: Result) -> None:
    reach = sizes(seed, 3)
    joints = {name: joint(own, "agrees") for name, own in zip(result.joints, reach, strict=False)}
    joints["slide"] = replace(joint(reach[0], "unclear"), prismatic=True)
    phases = [(own, own + 1.0, "left_foot", True) for own in reach]
    found = replace(inspection(), phases=phases, joints=joints, findings=[], audit=[], gaps=[], missing={})
    write_inspection(found, path)
    assert " m<" in path.read_text() or " m\n" in path.read_text()  # the unit of the prismatic joint


def scaled(result: Result, seed: int) -> Result:
    """Multiply the friction of each joint by a size."""
    joints = {}
    for (name, own), factor in zip(result.joints.items(), sizes(seed, len(result.joints)), strict=True):
        parameters = {}
        for each, found in own.parameters.items():
            value, error, low, high = (factor * x for x in (found.value, found.standard_error, *found.interval_95))
            parameters[each] = replace(found, value=value, standard_error=error, interval_95=(low, high))
        joints[name] = replace(own, parameters=parameters)
    return replace(result, joints=joints)


def comparison_page(path: Path, seed: int, result: Result) -> None:
    other = scaled(result, seed)
    write_comparison(compare(result, other, names=("a", "b")) if seed % 2 else compare_sides(other), path)


def report_page(path: Path, seed: int, result: Result) -> None:
    write_report(scaled(result, seed), path, reference=truth_of(result))


def trends_page(path: Path, seed: int, result: Result) -> None:  # noqa: ARG001 - of stores
    store = path.parent / f"store{seed}"
    write_store(store, robots=1 + seed % 7, logs=2 + seed, joints=2, seed=seed, wear={(0, 1): (6, sizes(seed, 1)[0])})
    write_trends(find_trends(store), path)


@pytest.mark.parametrize("write", [replay_page, inspection_page, comparison_page, report_page, trends_page])
def test_every_kind_of_page_is_drawn_without_errors(browser, result, tmp_path, write):
    charts = 0
    browser.errors.clear()
    for seed in range(6):  # values of different sizes
        path = tmp_path / f"{seed}.html"
        write(path, seed, result)
        browser.show(path, 1280, height=12_000)  # all charts are seen
        browser.open_all()
        places = browser.run("document.querySelectorAll('[data-chart]').length")
        drawn, end = -1, time.monotonic() + 30
        while drawn < places and time.monotonic() < end:
            browser.draw()
            drawn = browser.run("document.querySelectorAll('[data-chart] .u-over').length")
        assert (drawn, browser.errors) == (places, [])
        widths = browser.run("[...document.querySelectorAll('.figures .u-over')].map(each => each.clientWidth)")
        assert min(widths, default=100) > 80
        charts += places
    assert charts >= 6 or write is inspection_page
