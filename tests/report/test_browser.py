"""The report in a real browser: it renders without errors, on a phone and a desktop, light and dark."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.report.conftest import make_walk, truth_of

from stribeck.app.report import write_report
from stribeck.app.report.walk_section import walk_section
from stribeck.core.base.finding import Finding
from stribeck.core.result import Result
from stribeck.core.result.estimates import TorqueR2


@pytest.fixture(scope="module")
def page(browser: Any, result: Result, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The report of a walk's result whose names and texts have no place to be broken."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    long = "supercalifragilistic" * 4
    old = "torso_pitch"
    samples = result.evidence.samples
    names = tuple(long if name == old else name for name in samples.joint_names)
    evidence = replace(result.evidence, samples=replace(samples, joint_names=names))
    r2 = TorqueR2(nominal=0.91, corrected=0.985)
    joints = {long if name == old else name: replace(joint, torque_r2=r2) for name, joint in result.joints.items()}
    findings = [Finding(check=long, text=long), *result.findings]
    changed = replace(result, robot=long, joints=joints, evidence=evidence, findings=findings)
    write_report(changed, path, reference=truth_of(result), further=[walk_section(make_walk())])
    browser.get(path.as_uri())
    return browser


def show(page: Any, width: int, scheme: str = "light", media: str = "screen") -> None:
    metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": features})
    page.get(page.current_url.partition("#")[0])


def open_all(page: Any) -> None:
    page.execute_script("document.querySelectorAll('details').forEach(part => part.open = true)")


@pytest.mark.parametrize(("width", "media"), [(390, "screen"), (1280, "screen"), (690, "print")])
def test_nothing_is_wider_than_the_page(page: Any, width: int, media: str) -> None:
    show(page, width, media=media)
    assert page.execute_script("return innerWidth") == width
    assert page.execute_script("return document.documentElement.scrollWidth") <= width
    names = "document.querySelectorAll('.joints tbody th a').forEach(name => name.textContent = 'right_ankle_pitch')"
    page.execute_script(names)
    table = "document.querySelector('.joints-side .scroll')"  # nothing of it is out of sight with usual names
    assert page.execute_script(f"return {table}.scrollWidth <= {table}.clientWidth")
    open_all(page)
    assert page.execute_script("return document.documentElement.scrollWidth") <= width


def wait(page: Any) -> None:
    """Let the page draw what is seen now."""
    page.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 150))")


@pytest.mark.parametrize("width", [390, 1280])
def test_every_chart_is_drawn_when_it_is_seen(page: Any, width: int) -> None:
    show(page, width)
    assert not page.find_elements("css selector", ".figures canvas")
    open_all(page)
    places = page.find_elements("css selector", ".figures .plot")
    assert len(places) > 20
    drawn = (
        "const canvas = arguments[0].querySelector('canvas'), size = [0, 0, canvas.width, canvas.height];"
        " const area = arguments[0].querySelector('.u-over').getBoundingClientRect();"
        " return [area.width, area.height, new Set(canvas.getContext('2d').getImageData(...size).data).size]"
    )
    for place in places:
        page.execute_script("arguments[0].scrollIntoView({behavior: 'instant'})", place)
        wait(page)
        assert np.all(np.array(page.execute_script(drawn, place)) > [180, 70, 10])


def test_the_pointer_reads_values_drags_to_zoom_and_a_double_click_resets(page: Any) -> None:
    from selenium.webdriver import ActionChains

    show(page, 1280)
    page.execute_script("document.querySelectorAll('.section, .panel').forEach(part => part.open = true)")
    for place, output in ((".curve", "#reading"), ("#joint-0", "#joint-0 output")):
        into_view = "document.querySelector(arguments[0]).scrollIntoView({block: 'center', behavior: 'instant'})"
        page.execute_script(into_view, f"{place} .plot")
        wait(page)
        area = page.find_element("css selector", f"{place} .u-over")
        picture = f"return document.querySelector('{place} canvas').toDataURL()"
        whole = page.execute_script(picture)
        ActionChains(page, duration=0).move_to_element_with_offset(area, 20, 10).perform()
        wait(page)
        assert " N m at " in page.find_element("css selector", output).text
        ActionChains(page, duration=50).click_and_hold().move_by_offset(15, 0).release().perform()
        wait(page)
        assert page.execute_script(picture) != whole
        ActionChains(page, duration=0).double_click(area).perform()
        wait(page)
        assert page.execute_script(picture) == whole


def test_lead_curves_and_first_lines_stand_on_the_first_screen_and_nothing_is_loaded(page: Any) -> None:
    show(page, 1280)
    ends = "['.lead', '.curve', '.joints tbody tr'].map(s => document.querySelector(s).getBoundingClientRect().bottom)"
    assert max(page.execute_script(f"return {ends}")) < 800
    assert page.execute_script("return performance.getEntriesByType('resource').map(each => each.name)") == []
    assert page.get_log("browser") == []


def test_rows_are_sorted_scales_switched_and_panels_opened_by_their_links(page: Any) -> None:
    show(page, 1280)
    names = "return [...document.querySelectorAll('.joints tbody th')].map(e => e.textContent)"
    before = page.execute_script(names)
    page.execute_script("document.querySelector('.joints th button').click()")
    assert page.execute_script(names) == before
    page.execute_script("document.querySelector('.joints th button').click()")
    assert page.execute_script(names) == before[::-1]
    assert page.execute_script("return document.querySelector('th[aria-sort]').ariaSort") == "descending"
    wait(page)
    picture = "return document.querySelector('.curve canvas').toDataURL()"
    common = page.execute_script(picture)
    page.execute_script("document.getElementById('scales').click()")
    wait(page)
    assert page.execute_script("return document.querySelectorAll('.curve canvas').length") > 2
    assert page.execute_script(picture) != common
    assert not page.execute_script("return document.querySelector('#joint-1').checkVisibility()")
    page.execute_script("document.querySelector('.joints a[href=\"#joint-1\"]').click()")
    wait(page)
    assert page.execute_script("return document.querySelector('#joint-1').checkVisibility()")


def test_light_and_dark_differ_and_figures_follow(page: Any) -> None:
    looks, colors = [], "getComputedStyle(document.body).backgroundColor, document.querySelector('canvas').toDataURL()"
    for scheme in ("light", "dark"):
        show(page, 1280, scheme)
        wait(page)
        looks.append(page.execute_script(f"return [{colors}]"))
    assert all(light != dark for light, dark in zip(*looks, strict=True))
