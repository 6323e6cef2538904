"""Every kind of page in a real browser: all of its charts are drawn, without an error in the console."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.fleet.synthetic import write_store
from tests.report.conftest import make_walk, truth_of
from tests.report.test_report import inspection, joint

from stribeck.app.comparison import compare, compare_sides
from stribeck.app.report import write_inspection, write_report
from stribeck.app.report.comparison import write_comparison
from stribeck.app.report.replay import write_replay
from stribeck.app.report.trends import write_trends
from stribeck.app.report.walk_section import walk_section
from stribeck.core.result import Result
from stribeck.design.replaying.comparison import Replay, Replayed
from stribeck.design.replaying.rollouts import RolloutError
from stribeck.service.fleet.trends import find_trends

SEEDS = 6
"""Pages with values of different sizes."""


def sizes(seed: int, count: int) -> list[float]:
    """Draw sizes from 1e-6 to 1e6, often just below a power of ten, where logarithmic axes begin badly."""
    generator = np.random.default_rng(seed)
    exponents = np.sort(generator.uniform(-6, 6, count)) if seed % 2 else generator.uniform(-1.1, 0.1, count)
    return (10**exponents).tolist()


def replay_page(path: Path, seed: int, result: Result) -> None:
    names, horizons = list(result.joints), (0.05, 0.1, 0.2)
    models = []
    for k in range(3):
        relative = iter(sizes(100 * seed + k, len(names) * len(horizons)))
        if seed == 0:
            relative = iter([0.0957 / 0.7] * len(names) * len(horizons))  # the axis begins just below 0.1
        errors = {
            name: [RolloutError(relative=next(relative), rms=1.0, rollouts=9) for _ in horizons] for name in names
        }
        models.append(Replayed(model="arm.urdf", friction=bool(k), torque={}, rollouts=errors))
    found = Replay(
        robot=result.robot, log="log.npz", filter="none", horizons=horizons, models=models, notes=[], stribeck="1"
    )
    write_replay(found, path)


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
        parameters = {
            each: replace(
                found,
                value=factor * found.value,
                standard_error=factor * found.standard_error,
                interval_95=(factor * found.interval_95[0], factor * found.interval_95[1]),
            )
            for each, found in own.parameters.items()
        }
        joints[name] = replace(own, parameters=parameters)
    return replace(result, joints=joints)


def comparison_page(path: Path, seed: int, result: Result) -> None:
    write_comparison(
        compare(result, scaled(result, seed), names=("a", "b")) if seed % 2 else compare_sides(scaled(result, seed)),
        path,
    )


def report_page(path: Path, seed: int, result: Result) -> None:
    write_report(scaled(result, seed), path, reference=truth_of(result), further=[walk_section(make_walk())])


def trends_page(path: Path, seed: int, result: Result) -> None:  # noqa: ARG001 - of stores
    store = path.parent / f"store{seed}"
    write_store(store, robots=1 + seed % 7, logs=2 + seed, joints=2, seed=seed, wear={(0, 1): (6, sizes(seed, 1)[0])})
    write_trends(find_trends(store), path)


PAGES = {
    "replay": replay_page,
    "inspection": inspection_page,
    "comparison": comparison_page,
    "report": report_page,
    "trends": trends_page,
}


@pytest.mark.parametrize("write", PAGES.values(), ids=PAGES)
def test_every_kind_of_page_is_drawn_without_errors(browser, result, tmp_path, write):
    charts = 0
    metrics = {"width": 1280, "height": 12_000, "deviceScaleFactor": 1, "mobile": False}  # all charts are seen
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    browser.get_log("browser")
    for seed in range(SEEDS):
        path = tmp_path / f"{seed}.html"
        write(path, seed, result)
        browser.get(path.as_uri())
        browser.execute_script("document.querySelectorAll('details').forEach(part => part.open = true)")
        places = browser.execute_script("return document.querySelectorAll('[data-chart]').length")
        drawn, end = -1, time.monotonic() + 30
        while drawn < places and time.monotonic() < end:
            browser.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 20))")
            drawn = browser.execute_script("return document.querySelectorAll('[data-chart] .u-over').length")
        assert (drawn, browser.get_log("browser")) == (places, [])
        charts += places
    assert charts >= SEEDS or write is inspection_page
