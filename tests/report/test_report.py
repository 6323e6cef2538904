"""The report: its order, texts, curves, findings and ground truth, and the page of an inspection."""

import json
import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.arm import URDF, arm_log
from tests.report.conftest import truth_of
from tests.result.made import point

from stribeck import Robot, Settings, identify, inspect_log
from stribeck.app.cli.console import print_result
from stribeck.app.report import write_inspection, write_report
from stribeck.app.report.curves import friction_curve
from stribeck.app.report.overview import robot_picture
from stribeck.app.report.page import short_names
from stribeck.check.inspection import Inspection, JointInspection
from stribeck.core.base.finding import Finding
from stribeck.core.errors import SettingsError
from stribeck.core.friction import get_law
from stribeck.core.result import Corrections, JointResult, Result, TorqueR2
from stribeck.core.result.estimates import verdict_place
from stribeck.core.result.tables import advice

FOLDED = ["joints", "verdicts", "correlations", "sides", "torque-source", "timeline", "provenance"]


class Page(HTMLParser):
    """Reads a page strictly: every element closed in order; keeps what the tests ask for."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in {"meta", "link", "br", "wbr", "img", "hr"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data

    def values(self, key: str) -> list[str]:
        """Return every value of an attribute."""
        return [str(values[key]) for _, values in self.tags if key in values]

    @property
    def parts(self) -> list[str]:
        """Return the anchors of the page's sections, open and folded."""
        return [str(v["aria-labelledby"]).removesuffix("-title") for tag, v in self.tags if tag == "section"]


def written(result: Result, folder: Path) -> str:
    path = folder / "report.html"
    write_report(result, path)
    return path.read_text(encoding="utf-8")


def charts_of(html: str) -> dict[str, Any]:
    """Return the charts that a page draws, by name."""
    found = re.search(r'<script type="application/json" id="charts">(.*?)</script>', html)
    return dict(json.loads(found[1]))


@pytest.fixture(scope="module")
def html(result: Result, tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(result, tmp_path_factory.mktemp("report"))


def test_the_page_is_sound_refers_to_nothing_outside_and_says_what_everything_is(html: str) -> None:
    page, charts = Page(html), charts_of(html)
    ids, references = page.values("id"), page.values("href") + page.values("src") + page.values("action")
    assert len(ids) == len(set(ids))
    assert {reference[1:] for reference in references if reference.startswith("#")} <= set(ids)
    assert all(reference.startswith(("#", "data:")) for reference in references)
    places = [values for _, values in page.tags if "data-chart" in values]
    assert sorted(str(values["data-chart"]) for values in places) == sorted(charts)
    assert all(values["role"] == "img" and values["aria-label"] for values in places)
    names = [tag for tag, _ in page.tags]
    assert names.count("figure") == names.count("figcaption") == len(charts) > 20
    assert names.count("table") == names.count("caption") == 5


def test_the_first_screen_comes_first_and_the_rest_is_folded(html: str) -> None:
    page = Page(html)
    assert page.parts == ["friction", "warnings", *FOLDED]
    folded = [values for tag, values in page.tags if tag == "details"]
    assert sum(values["class"] == "section" for values in folded) == len(FOLDED)
    assert not any("open" in values for values in folded)
    for expected in ("identified", "not excited", "N m s/rad", "left_hip_roll (1.4 W)", "3f3f3f", "walker.urdf"):
        assert expected in page.text


def with_curve(joint: JointResult, *values: float, **changed: Any) -> JointResult:
    curve = tuple(point(velocity, value, 0.4) for velocity, value in zip((0.2, 1.0, 2.0), values, strict=True))
    return replace(joint, curve=curve, **changed)


def test_joints_have_a_line_a_panel_and_a_row_and_those_without_friction_one_line(result, tmp_path):
    joints = result.joints.items()
    joints = {name: with_curve(own, 5.0, 6.0, 8.0) if own.parameters else own for name, own in joints}
    rubbing, weak, *others, torso = joints
    joints[rubbing] = replace(joints[rubbing], torque_r2=TorqueR2(nominal=0.5, corrected=0.9871))
    joints[weak] = with_curve(joints[weak], 0.1, 0.1, 3.0, verdict="weak")
    for name in others[:2]:
        joints[name] = with_curve(joints[name], 0.0, 0.0, 0.1, verdict="no friction", parameters={})
    html = written(replace(result, joints=joints), tmp_path)
    rows = html[html.index('<table class="joints">') : html.index("</table>")].split("<tr")[2:]
    named = [row for row in rows if "</th>" in row]
    shown = [rubbing, weak, *others[2:], torso]
    for name, row in zip(shown, named, strict=True):
        assert all(text in row for text in (f">{name}<", joints[name].verdict, advice(joints[name])))
    assert all(text in named[0] for text in ("5.0", "6.0", "8.0", "± 0.4"))
    assert named[1].count("&lt; 0.50") == 1  # not significant: a bound
    assert "2 of 6 joints: friction too small to resolve: below 0.5 N m" in rows[-1]
    assert all(name in Page(f"<table><tbody><tr{rows[-1]}</table>").text for name in others[:2])
    folded = html[html.index('<details class="section">') :]
    assert folded.count("6.0 ± 0.4 N m at 1 rad/s") == folded.count("below 0.5 N m") == 2  # panels of two joints
    assert "Torque R² in held-out parts of the log: 0.987, with the model as given 0.500" in folded
    panel = folded[folded.index('id="joint-5"') : folded.index("</article>", folded.index('id="joint-5"'))]
    assert "<dl" not in panel  # not excited: no numbers
    assert panel.count("data-chart") == 1  # the raw samples


def test_findings_are_sorted_by_severity_and_by_unknown_friction(
    result: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    joints = {name: with_curve(joint, 1.0, 2.0, 3.0) for name, joint in result.joints.items()}
    known, least_known = list(joints)[:2]
    joints[least_known] = replace(joints[least_known], curve=(point(1.0, 2.0, 1.5),))
    cures = {"sign": "scale = -1", "gain": "scale = 2", "delay": "delay = 0.1", "clock": "rate = 2", "zero": "zero = 1"}
    findings = [
        Finding(check=check, text=f"a wrong <{check}>", cure=cure, joints=(least_known if check == "gain" else known,))
        for check, cure in cures.items()
    ]
    findings = [*findings[1:4], replace(findings[4], note=True), replace(findings[0], stops=True)]
    changed = replace(result, joints=joints, findings=findings)
    print_result(changed)
    said = capsys.readouterr().out
    assert [line.split("<")[1].split(">")[0] for line in said.splitlines() if "warning: " in line] == [*cures][:3]
    assert "1 more warning in the report: clock" in said
    html = written(changed, tmp_path)
    section = html[html.index('<section id="warnings"') :].partition("</section>")[0]
    assert section.count("<li") == 5
    places = [section.index(words) for words in ("&lt;delay", "<summary>2 more", "&lt;clock", "&lt;zero")]
    assert places == sorted(places)
    for finding in findings:
        assert f'<code class="cure">{finding.cure}</code>' in section
        assert f"<code>{finding.place}</code>" in section
    assert html.count('<a href="#warnings">warned</a>') == 2
    for verdict in {joint.verdict for joint in result.joints.values()}:
        assert f"<code>{verdict_place(verdict)}</code>" in html


def test_a_curve_is_the_law_without_its_offset_and_its_band_that_of_the_judged_speeds(result: Result) -> None:
    law, joint = get_law(result.law), result.joints["left_hip_yaw"]
    curve = friction_curve(joint, prismatic=False)
    values = np.array([joint.parameters[parameter.name].value for parameter in law.parameters])
    v = curve.velocity
    resisting = (law.torque(v, values) - law.torque(-v, values)) / 2
    np.testing.assert_allclose(curve.torque, resisting, atol=1e-12)
    speeds, half = np.array([(point.velocity, point.half_width) for point in joint.curve]).T
    np.testing.assert_allclose(np.interp(speeds, v, curve.band[1] - curve.torque), half, rtol=0.05)
    np.testing.assert_allclose(curve.band.sum(axis=0), 2 * curve.torque)
    assert friction_curve(replace(joint, verdict="no friction"), prismatic=False) is None
    judged = friction_curve(with_curve(joint, 1.0, 2.0, 3.0, parameters={}, verdict="weak"), prismatic=False)
    assert judged is not None  # a joint without a law is drawn through the speeds it was judged at
    assert (judged.torque.tolist(), judged.band[1].tolist()) == ([1.0, 2.0, 3.0], [1.4, 2.4, 3.4])


def test_texts_are_escaped(result: Result, tmp_path: Path) -> None:
    evil = '<script>alert("x")</script> & $x^$'
    samples = replace(result.evidence.samples, joint_names=(evil, *result.evidence.samples.joint_names[1:]))
    evidence = replace(
        result.evidence, notes=[evil], provenance=[(evil, evil)], phases=[(0.0, 1.0, evil, True)], samples=samples
    )
    joints = {evil if name == "left_hip_yaw" else name: joint for name, joint in result.joints.items()}
    joints[evil] = replace(joints[evil], reason=evil)
    changed = replace(result, robot=evil, findings=[Finding(check=evil, text=evil)], joints=joints, evidence=evidence)
    html = written(changed, tmp_path)
    assert "<script>alert" not in html
    assert Page(html).text.count('alert("x")') >= 8


def test_a_result_without_its_samples_is_refused(result: Result, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="the result has no samples; expected"):
        write_report(replace(result, evidence=None), tmp_path / "report.html")
    assert list(tmp_path.iterdir()) == []


def test_a_sliding_joint_has_newtons_and_a_log_that_disagrees_a_number(result: Result, tmp_path: Path) -> None:
    evidence = replace(result.evidence, prismatic=frozenset(["left_hip_yaw"]))
    changed = replace(result, evidence=evidence, corrections=Corrections(chi_square=1.0, disagreement=6.25))
    html = written(changed, tmp_path)
    for name, labels in (("j00", ("velocity [m/s]", "friction [N]")), ("j10", ("velocity [rad/s]", "friction [N m]"))):
        chart = charts_of(html)[name]
        assert (chart["x"]["label"], chart["y"]["label"]) == labels
    assert "2.5 times as much as noise" in " ".join(html.split())


def test_ground_truth_is_shown_next_to_the_estimates(result: Result, html: str, tmp_path: Path) -> None:
    write_report(result, tmp_path / "with.html", reference=truth_of(result))
    shown = (tmp_path / "with.html").read_text(encoding="utf-8")
    body = html[html.index("<body>") : html.index('id="charts"')].lower()
    assert "truth" not in body
    assert shown.count("<small>truth ") == 5 * 6  # a panel each
    assert shown.count("<br>truth ") == 5 * 6  # a row each
    assert "the simulated truth" in shown


def joint(reach: float, sign: str, correlation: float | None = 0.97, delay: float | None = 0.0021) -> JointInspection:
    return JointInspection(
        position_range=(-reach, 0.5 * reach),
        velocity_range=(-3 * reach, 3 * reach),
        torque_range=(-20 * reach, 40 * reach),
        correlation=correlation,
        delay=delay,
        sign=sign,  # type: ignore[arg-type]
    )


def inspection() -> Inspection:
    about: dict[str, Any] = {"robot": "Walker", "path": "logs/walk.mcap", "support_source": "foot forces"}
    about |= {"samples": 40_000, "duration": 40.0, "rate": 1000.0, "jitter": 1.2e-5, "duplicates": 3}
    about |= {"gaps": [(10.25, 10.31)], "missing": {"torque": 7}}
    about["channels"] = {"time": [40_000], "position": [40_000, 3], "torque": [40_000, 3]}
    return Inspection(
        **about,
        phases=[(0.8 * k, 0.8 * k + 0.75, ("left_foot", "right_foot")[k % 2], k != 4) for k in range(50)],
        filter="Savitzky-Golay, 31 samples, order 4",
        joints={
            "left_hip": joint(0.6, "agrees"),
            "left_knee": joint(0.9, "opposite", correlation=-0.95),
            "head <b>": joint(0.0, "unclear", None, None),
        },
        findings=["left_knee <script>: wrong sign of the torque"],
        audit=[Finding(check="torque-sign", text="left_knee <script>: wrong sign of the torque")],
        notes=["3 samples with a repeated time were dropped."],
    )


def test_the_page_shows_the_inspection(tmp_path: Path) -> None:
    path = tmp_path / "inspection.html"
    write_inspection(inspection(), path)
    html = path.read_text(encoding="utf-8")
    text = unescape(html)
    for expected in ("1000 Hz", "0.0120 ms", "opposite", "10.2500", "head <b>", "left_knee <script>", "foot forces"):
        assert expected in text
    assert "<script>" not in html.partition("</main>")[0]
    write_inspection(replace(inspection(), findings=[], audit=[], gaps=[], phases=[], notes=[]), path)
    html = path.read_text(encoding="utf-8")
    assert 'id="findings"' not in html
    assert 'id="timeline"' not in html
    assert "no gaps" in html
    assert "No problem found" in html
    assert list(tmp_path.iterdir()) == [path]


def test_pages_of_an_arm_show_its_robot_the_friction_of_its_model_and_its_torques(tmp_path: Path) -> None:
    """A log of a bolted arm has no contact modes; names lose the words that all of them have."""
    text = re.sub('joint name="([a-z]+)"', r'joint name="arm_\1_joint"', URDF)
    path = tmp_path / "arm.urdf"
    path.write_text(text.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><dynamics friction="0.7" damping="0.4"/>'))
    robot = Robot.from_model(path, base="fixed")
    log, names = arm_log(robot, duration=10.0, rate=200.0), ["shoulder", "elbow", "slide"]
    result = identify(log, robot, Settings(law="stribeck", method="curve-fit"))
    html = written(result, tmp_path)
    assert html.count("<circle") == 3
    moved = {name: replace(joint, position_range=(1.0, 1.2)) for name, joint in result.joints.items()}
    assert robot_picture(robot, result) != robot_picture(robot, replace(result, joints=moved))
    assert "model 0.7" in html
    assert short_names(result.joints) == {f"arm_{name}_joint": name for name in names}
    assert short_names(["lwr_0_joint", "lwr_1_joint"]) == {"lwr_0_joint": "lwr_0", "lwr_1_joint": "lwr_1"}
    matrix = charts_of(html)["m"]
    assert matrix["x"]["names"] == names
    write_inspection(inspect_log(log, robot), tmp_path / "inspection.html")
    page = (tmp_path / "inspection.html").read_text()
    assert 'id="timeline"' not in page
    assert [line["name"] for line in charts_of(page)["m0"]["lines"]] == ["measured", "model"]
