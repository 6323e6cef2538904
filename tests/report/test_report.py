import time
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from stribeck.errors import SettingsError
from stribeck.friction import LAWS, get_law
from stribeck.report import write_report
from stribeck.report.heading import heading
from stribeck.result import Corrections, CurvePoint, JointResult, Result, Validation

VOID = {"meta", "link", "br", "wbr", "img", "hr"}
SELF_CLOSED_IN_SVG = {"path", "use", "rect", "image", "circle"}


class Page(HTMLParser):
    """Reads a page strictly: every element closed in order, ids unique; keeps what the tests ask for."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.tags.append((tag, values))
        if "id" in values:
            self.ids.append(str(values["id"]))
        self.references += [str(values[key]) for key in ("src", "href", "xlink:href", "action") if key in values]

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def written(result: Result, folder: Path) -> str:
    path = folder / "report.html"
    write_report(result, path)
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def html(result: Result, tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(result, tmp_path_factory.mktemp("report"))


def test_the_page_is_well_formed_and_its_links_lead_somewhere(html: str) -> None:
    page = Page(html)
    assert len(page.ids) == len(set(page.ids))
    inside = {reference[1:] for reference in page.references if reference.startswith("#")}
    assert inside <= set(page.ids)
    assert ("html", {"lang": "en"}) in page.tags


def test_the_page_refers_to_nothing_outside(html: str) -> None:
    page = Page(html)
    assert all(reference.startswith(("#", "data:")) for reference in page.references)
    assert "http" not in html
    assert "url(" not in html.replace("url(#", "")
    assert "@import" not in html
    assert "<script" not in html


def test_every_figure_and_table_says_what_it_is(html: str) -> None:
    page = Page(html)
    names = [tag for tag, _ in page.tags]
    drawings = [values for tag, values in page.tags if tag == "svg" and values.get("aria-hidden") != "true"]
    assert names.count("figure") == names.count("figcaption") == len(drawings) > 20
    assert all(values["role"] == "img" and values["aria-label"] for values in drawings)
    assert names.count("table") == names.count("caption") == 5
    assert names.count("h1") == 1


def test_the_verdict_table_comes_first_and_numbers_keep_their_unit(html: str) -> None:
    page = Page(html)
    sections = [values["id"] for tag, values in page.tags if tag == "section"]
    assert sections == ["verdicts", "warnings", "joints", "sides", "power", "timeline", "provenance"]
    for expected in (
        "identified",
        "weak",
        "not excited",
        "N m s/rad",
        "left_hip_roll: passivity violated",
        "3f3f3f",
        "walker.urdf",
    ):
        assert expected in page.text


def test_joints_without_friction_do_not_count_in_what_is_explained(result: Result) -> None:
    law, joints = get_law(result.law), {}
    moved = [name for name, joint in result.joints.items() if joint.parameters]
    rubbing, others = moved[:2], moved[2:]
    assert len(others) > len(rubbing)
    for name in moved:
        found = dict(result.joints[name].parameters)
        for each in ("viscous", "coulomb"):
            found[each] = replace(found[each], interval_95=(0.1 if name in rubbing else 0.0, 2.0))
        left = Validation(rms=0.2 if name in rubbing else 1.0, rms_zero_friction=1.0, rms_coulomb_only=0.5)
        joints[name] = replace(result.joints[name], parameters=found, validation=left)
    assert "<strong>80" in heading(replace(result, joints=joints), law)
    without = replace(result, joints={name: joints[name] for name in others})
    assert "of the friction torque" not in heading(without, law)


def test_joints_without_motion_get_no_numbers(result: Result, html: str) -> None:
    panel = html[html.index('id="joint-5"') : html.index("</article>", html.index('id="joint-5"'))]
    assert result.joints["torso_yaw"].verdict == "not excited"
    assert "the velocity stays within" in panel
    assert "<dl" not in panel
    assert panel.count("<svg") == 1  # the raw samples


def test_friction_as_a_whole_stands_in_table_and_panel(result: Result, tmp_path: Path) -> None:
    points = [(0.2, 5.0), (1.0, 6.0), (2.0, 8.0)]
    curve = tuple(
        CurvePoint(velocity=v, value=r, standard_error=0.2, interval_95=(r - 0.4, r + 0.4), unit="N m")
        for v, r in points
    )
    known, none = list(result.joints)[:2]
    joints = result.joints | {
        known: replace(result.joints[known], curve=curve),
        none: replace(result.joints[none], curve=curve, parameters={}, verdict="no friction"),
    }
    html = written(replace(result, joints=joints), tmp_path)
    assert html.count("6.00 ± 0.40 N m at 1 rad/s") == 2
    assert "5.00 ± 0.40 at 0.20<br>8.00 ± 0.40 at 2.0" in html
    assert html.count("below 8.4 N m") == 2
    assert "samples only, no friction is detectable" in html


def test_the_same_result_gives_the_same_bytes(result: Result, html: str, tmp_path: Path) -> None:
    assert written(result, tmp_path) == html


def test_texts_are_escaped(result: Result, tmp_path: Path) -> None:
    evil = '<script>alert("x")</script> & $x^$'
    assert result.evidence is not None
    evidence = replace(
        result.evidence,
        notes=[evil],
        provenance=[(evil, evil)],
        phases=[(0.0, 1.0, evil, True)],
        samples=replace(result.evidence.samples, joint_names=(evil, *result.evidence.samples.joint_names[1:])),
    )
    joints = {evil if name == "left_hip_yaw" else name: joint for name, joint in result.joints.items()}
    joints[evil] = replace(joints[evil], reason=evil)
    changed = replace(result, robot=evil, warnings=[evil], joints=joints, evidence=evidence)
    html = written(changed, tmp_path)
    page = Page(html)
    assert "<script" not in html
    assert page.text.count('alert("x")') >= 8


def test_a_result_without_its_samples_is_refused(result: Result, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no samples to draw"):
        write_report(replace(result, evidence=None), tmp_path / "report.html")
    assert list(tmp_path.iterdir()) == []


def test_parts_of_the_log_that_disagree_are_told_as_a_number(result: Result, tmp_path: Path) -> None:
    disagreeing = replace(result, corrections=Corrections(chi_square=1.0, disagreement=6.25))
    assert "2.5 times as much" in " ".join(written(disagreeing, tmp_path).split())


def test_little_is_enough(result: Result, tmp_path: Path) -> None:
    """No samples, close-up, phases, covariance, warnings or numbers: the page says so and stands."""
    assert result.evidence is not None
    nothing = {name: getattr(result.evidence.samples, name)[:0] for name in ("time", "velocity", "usable", "block")}
    samples = replace(
        result.evidence.samples,
        **nothing,
        acceleration=nothing["velocity"],
        friction_torque=nothing["velocity"],
        support=nothing["block"],
    )
    evidence = replace(
        result.evidence, samples=samples, covariance={}, phases=[], close_up=None, provenance=[], notes=[]
    )
    joints = {
        name: replace(joint, validation=None, residual_rms=None, positive_power_fraction=None)
        for name, joint in result.joints.items()
    }
    page = Page(written(replace(result, evidence=evidence, joints=joints, warnings=[]), tmp_path))
    sections = [values["id"] for tag, values in page.tags if tag == "section"]
    assert sections == ["verdicts", "joints", "sides", "provenance"]


def test_a_sliding_joint_has_newtons(result: Result, tmp_path: Path) -> None:
    assert result.evidence is not None
    assert "[m/s]" not in written(result, tmp_path)
    sliding = replace(result, evidence=replace(result.evidence, prismatic=frozenset(["left_hip_yaw"])))
    page = Page(written(sliding, tmp_path))
    assert "velocity [m/s]" in page.text
    assert "friction [N]" in page.text


def test_sides_that_differ_beyond_their_errors_are_marked(result: Result, tmp_path: Path) -> None:
    left, right = result.joints["left_hip_yaw"], result.joints["right_hip_yaw"]

    def marked(other: JointResult) -> int:
        joints = {"left_hip_yaw": left, "right_hip_yaw": other}
        html = written(replace(result, joints=joints), tmp_path)
        return html.count('class="value differs"')

    twin = replace(right, parameters=left.parameters)
    coulomb = left.parameters["coulomb"]
    step, (low, high) = 4 * coulomb.standard_error, coulomb.interval_95
    apart = replace(coulomb, value=coulomb.value + step, interval_95=(low + step, high + step))
    assert marked(twin) == 0
    assert marked(replace(twin, parameters={**left.parameters, "coulomb": apart})) == 1


@pytest.mark.parametrize("name", sorted(LAWS))
def test_every_law_has_its_report(result: Result, tmp_path: Path, name: str) -> None:
    law = get_law(name)
    joint = result.joints["left_hip_yaw"]
    coulomb = joint.parameters["coulomb"]
    parameters = {parameter.name: replace(coulomb, unit=parameter.unit) for parameter in law.parameters}
    joints = {side: replace(joint, parameters=parameters) for side in ("left_hip_yaw", "right_hip_yaw")}
    page = Page(written(replace(result, law=name, joints=joints), tmp_path))
    assert law.title in page.text
    assert ("Stribeck velocity ±" in page.text) == ("stribeck_velocity" in parameters)
    assert [values["id"] for tag, values in page.tags if tag == "section"].count("sides") == 1


def test_a_ten_minute_log_of_thirty_joints_stays_small(make_result, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    result = make_result(joints=30, duration=600.0, period=0.01)
    began = time.process_time()
    html = written(result, tmp_path)
    assert len(html.encode()) < 4e6
    assert time.process_time() - began < 20  # about 4 s; generous, as machines differ
