"""The report in a real browser: it renders without errors, on a phone and a desktop, light and dark."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.report.conftest import Browser, truth_of

from stribeck.app.report import write_report
from stribeck.core.base.finding import Finding
from stribeck.core.result import Result, TorqueR2

LIMBS = "hip_pitch hip_roll hip_yaw knee ankle_pitch ankle_roll shoulder_pitch shoulder_roll shoulder_yaw elbow"
LIMBS += " wrist_roll wrist_pitch wrist_yaw"
HUMANOID = [f"{side}_{limb}_joint" for side in ("left", "right") for limb in LIMBS.split()]
HUMANOID += [f"waist_{way}_joint" for way in ("yaw", "roll", "pitch")]
"""Names of 29 joints as Unitree's G1 has them."""


@pytest.fixture(scope="module")
def page(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of a walk's result whose names and texts have no place to be broken."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    long = "supercalifragilistic" * 4
    old = "torso_pitch"
    samples = result.evidence.samples
    names = tuple(long if name == old else name for name in samples.joint_names)
    load = 5.0 * np.sin(samples.time)[:, None]
    samples = replace(samples, joint_names=names, torque=samples.friction_torque + load)
    r2 = TorqueR2(nominal=0.91, corrected=0.985)
    joints = {long if name == old else name: replace(joint, torque_r2=r2) for name, joint in result.joints.items()}
    findings = [Finding(check=long, text=long), *result.findings]
    evidence = replace(result.evidence, samples=samples)
    changed = replace(result, robot=long, joints=joints, evidence=evidence, findings=findings)
    write_report(changed, path, reference=truth_of(result))
    return path


@pytest.mark.parametrize(("width", "media"), [(390, "screen"), (1280, "screen"), (690, "print")])
def test_nothing_is_wider_than_the_page(page: Path, browser: Browser, width: int, media: str) -> None:
    browser.show(page, width, media=media)
    assert browser.run("innerWidth") == width
    assert browser.run("document.documentElement.scrollWidth") <= width
    browser.open_all()
    assert browser.run("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("units", [("N m",), ("A", "N m")])
def test_no_table_of_29_joints_is_wider_than_its_card(result, browser, tmp_path, units):
    """With the names of a real robot, weak parameters, rotor inertia, warnings and two units of the torque."""
    like = result.joints["left_hip_yaw"]
    rotor = replace(like.parameters["coulomb"], value=0.0123, standard_error=4e-4, unit="kg m^2", verdict="weak")
    like = replace(like, parameters={**like.parameters, "armature": rotor}, verdict="weak")
    joints = {name: replace(like, torque_unit=units[k % len(units)]) for k, name in enumerate(HUMANOID)}
    findings = [Finding(check="friction-drift", text="friction drifts", joints=tuple(HUMANOID))]
    write_report(replace(result, joints=joints, findings=findings), tmp_path / "report.html")
    for width in (1280, 1920):
        browser.show(tmp_path / "report.html", width)
        browser.open_all()
        edges = "e => e.querySelector('table').getBoundingClientRect().right - e.getBoundingClientRect().right"
        over = browser.run(f"[...document.querySelectorAll('.scroll')].map({edges})")
        assert max(over) <= 1, (width, over)
    assert browser.run("document.querySelector('.joints tbody th').textContent.trim()") == "left_hip_pitch"


def test_the_pointer_reads_values_drags_to_zoom_and_a_double_click_resets(page: Path, browser: Browser) -> None:
    browser.show(page, 1280)
    browser.run("document.querySelectorAll('.section, .panel').forEach(part => { part.open = true; })")
    for place, output in ((".curve", "#reading"), ("#joint-0", "#joint-0 output")):
        browser.run(f"document.querySelector('{place} .plot').scrollIntoView({{block: 'center', behavior: 'instant'}})")
        browser.draw()
        corner = "(r => [r.x + r.width / 2, r.y + r.height / 2])"
        x, y = browser.run(f"{corner}(document.querySelector('{place} .u-over').getBoundingClientRect())")
        picture = f"document.querySelector('{place} canvas').toDataURL()"
        whole = browser.run(picture)
        browser.mouse("Moved", x + 20, y)
        browser.draw()
        assert " N m at " in browser.run(f"document.querySelector('{output}').textContent")
        browser.mouse("Pressed", x + 20, y, clickCount=1)
        browser.mouse("Moved", x + 35, y, buttons=1)
        browser.mouse("Released", x + 35, y, clickCount=1)
        browser.draw()
        assert browser.run(picture) != whole
        for clicks in (1, 2):
            browser.mouse("Pressed", x, y, clickCount=clicks)
            browser.mouse("Released", x, y, clickCount=clicks)
        browser.draw()
        assert browser.run(picture) == whole


def test_lead_curves_and_first_lines_stand_on_the_first_screen_and_nothing_is_loaded(page, browser):
    browser.errors.clear()
    browser.show(page, 1280)
    ends = "['.lead', '.curve', '.joints tbody tr'].map(s => document.querySelector(s).getBoundingClientRect().bottom)"
    assert max(browser.run(ends)) < 800
    assert browser.run("performance.getEntriesByType('resource').map(each => each.name)") == []
    assert browser.errors == []


def test_rows_are_sorted_and_panels_opened_by_their_links(page: Path, browser: Browser) -> None:
    browser.show(page, 1280)
    names = "[...document.querySelectorAll('.joints tbody th')].map(e => e.textContent)"
    before = browser.run(names)
    browser.run("document.querySelector('.joints th button').click()")
    assert browser.run(names) == before
    browser.run("document.querySelector('.joints th button').click()")
    assert browser.run(names) == before[::-1]
    assert browser.run("document.querySelector('th[aria-sort]').ariaSort") == "descending"
    assert not browser.run("document.querySelector('#joint-1').checkVisibility()")
    browser.run("document.querySelector('.joints a[href=\"#joint-1\"]').click()")
    browser.draw()
    assert browser.run("document.querySelector('#joint-1').checkVisibility()")


def test_light_and_dark_differ_and_figures_follow(page: Path, browser: Browser) -> None:
    looks, colors = [], "getComputedStyle(document.body).backgroundColor, document.querySelector('canvas').toDataURL()"
    for scheme in ("light", "dark"):
        browser.show(page, 1280, scheme=scheme)
        browser.draw()
        looks.append(browser.run(f"[{colors}]"))
    assert all(light != dark for light, dark in zip(*looks, strict=True))
