"""The report in a real browser: it renders without errors, on a phone and a desktop, light and dark."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from tests.report.conftest import make_walk, truth_of

from stribeck.report import write_report
from stribeck.result import Result
from stribeck_simulation.pictures.section import walk_section

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
DRIVER = shutil.which("chromedriver")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)

pytestmark = pytest.mark.skipif(
    CHROMIUM is None or DRIVER is None,
    reason="no Chromium with its chromedriver on the PATH: the report is not looked at",
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    webdriver = pytest.importorskip(
        "selenium.webdriver", reason="selenium is not installed: the report is not looked at"
    )
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=DRIVER))
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def page(browser: Any, result: Result, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The report of a walk's result whose names and texts have no place to be broken."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    long = "supercalifragilistic" * 4
    old = "torso_pitch"
    assert result.evidence is not None
    samples = result.evidence.samples
    names = tuple(long if name == old else name for name in samples.joint_names)
    evidence = replace(result.evidence, samples=replace(samples, joint_names=names))
    joints = {long if name == old else name: joint for name, joint in result.joints.items()}
    changed = replace(result, robot=long, joints=joints, evidence=evidence, warnings=[long, *result.warnings])
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
    open_all(page)
    assert page.execute_script("return document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("width", [390, 1280])
def test_every_figure_is_drawn(page: Any, width: int) -> None:
    show(page, width)
    open_all(page)
    sizes = page.execute_script(
        "return [...document.querySelectorAll('.figures svg')].map(s => [s.getBoundingClientRect().width,"
        " s.getBoundingClientRect().height, s.querySelectorAll('path').length])"
    )
    assert len(sizes) > 20
    assert all(wide > 250 and high > 80 and paths > 2 for wide, high, paths in sizes)


def test_texts_of_a_figure_are_large_enough_on_a_phone_and_lie_inside(page: Any) -> None:
    show(page, 390)
    open_all(page)
    texts = page.execute_script(
        "return [...document.querySelectorAll('.figures svg text')].map(t => {const s = t.ownerSVGElement;"
        " const scale = s.getBoundingClientRect().width / s.viewBox.baseVal.width;"
        " const a = t.getBoundingClientRect(), b = s.getBoundingClientRect();"
        " return [parseFloat(getComputedStyle(t).fontSize) * scale,"
        " Math.max(b.left - a.left, a.right - b.right, b.top - a.top, a.bottom - b.bottom), t.textContent]})"
    )
    assert len(texts) > 180
    assert min(size for size, _, _ in texts) > 8
    assert [text for _, outside, text in texts if outside > 3] == []


@pytest.mark.parametrize("width", [390, 768, 1280, 1920])
def test_the_first_screen_is_drawn_and_its_texts_are_large_enough(page: Any, width: int) -> None:
    show(page, width)
    plots = page.execute_script(
        "return [...document.querySelectorAll('.curve')].map(f => [f.querySelectorAll('canvas').length,"
        " f.getBoundingClientRect().width, getComputedStyle(f.querySelector('svg')).display])"
    )
    assert len(plots) == 5
    assert all(canvases == 1 and wide > 130 and drawing == "none" for canvases, wide, drawing in plots)
    sizes = page.execute_script(
        "return [...document.querySelectorAll('header *, .first *')].filter(e => e.offsetParent && [...e.childNodes]"
        ".some(n => n.nodeType === 3 && n.data.trim()))"
        ".map(e => [parseFloat(getComputedStyle(e).fontSize), e.outerHTML])"
    )
    assert len(sizes) > 40
    assert [text for size, text in sizes if size < 11.5] == []


def test_lead_curves_and_first_lines_stand_on_the_first_screen(page: Any) -> None:
    show(page, 1280)
    ends = page.execute_script(
        "return ['.lead', '.curve', '.joints tbody tr']"
        ".map(s => document.querySelector(s).getBoundingClientRect().bottom)"
    )
    assert max(ends) < 800


def test_rows_are_sorted_scales_switched_and_panels_opened_by_their_links(page: Any) -> None:
    show(page, 1280)
    names = "return [...document.querySelectorAll('.joints tbody th')].map(e => e.textContent)"
    before = page.execute_script(names)
    page.execute_script("document.querySelector('.joints th button').click()")
    assert page.execute_script(names) == before
    page.execute_script("document.querySelector('.joints th button').click()")
    assert page.execute_script(names) == before[::-1]
    assert page.execute_script("return document.querySelector('th[aria-sort]').ariaSort") == "descending"
    page.execute_script("document.getElementById('scales').click()")
    assert page.execute_script("return document.querySelectorAll('.curve canvas').length") == 5
    assert not page.execute_script("return document.querySelector('#joint-1').checkVisibility()")
    page.execute_script("document.querySelector('.joints a[href=\"#joint-1\"]').click()")
    page.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 50))")
    assert page.execute_script("return document.querySelector('#joint-1').checkVisibility()")


def test_two_fingers_zoom_the_curves_and_two_taps_show_them_whole(page: Any) -> None:
    show(page, 390)
    page.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
    page.execute_script("document.querySelector('.curve').scrollIntoView({block: 'center', behavior: 'instant'})")
    left, top, width = page.execute_script(
        "const {left, top, width, height} = document.querySelector('.curve .u-over').getBoundingClientRect();"
        "return [left, top + height / 2, width]"
    )

    def touch(kind: str, *places: float) -> None:
        points = [{"x": left + x * width, "y": top, "id": k} for k, x in enumerate(places)]
        page.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def drawn() -> list[str]:
        page.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 100))")
        script = "return [...document.querySelectorAll('.curve canvas')].map(each => each.toDataURL())"
        return list(page.execute_script(script))

    whole = drawn()
    touch("touchStart", 0.4, 0.6)
    touch("touchMove", 0.2, 0.8)
    touch("touchEnd")
    zoomed = drawn()
    assert all(one != other for one, other in zip(whole, zoomed, strict=True))
    for _ in range(2):
        touch("touchStart", 0.5)
        touch("touchEnd")
    page.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
    assert drawn() == whole


def test_nothing_is_loaded(page: Any) -> None:
    show(page, 1280)
    assert page.execute_script("return performance.getEntriesByType('resource').map(each => each.name)") == []


def test_curves_are_drawn_without_script_and_in_print(page: Any) -> None:
    show(page, 690, media="print")
    kinds = page.execute_script(
        "return ['svg', '.uplot'].map(s => getComputedStyle(document.querySelector('.curve ' + s)).display)"
    )
    assert kinds == ["block", "none"]


def test_light_and_dark_differ_and_figures_follow(page: Any) -> None:
    looks = {}
    for scheme in ("light", "dark"):
        show(page, 1280, scheme)
        looks[scheme] = page.execute_script(
            "const ground = getComputedStyle(document.body).backgroundColor;"
            "const text = getComputedStyle(document.querySelector('figure svg text')).fill; return [ground, text]"
        )
    assert looks["light"][0] != looks["dark"][0]
    assert looks["light"][1] != looks["dark"][1]


def test_the_browser_has_nothing_to_complain_about(page: Any) -> None:
    show(page, 1280)
    assert page.get_log("browser") == []
