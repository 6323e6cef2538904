from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

from stribeck.base.finding import Finding
from stribeck.inspection import Inspection, JointInspection
from stribeck.report import write_inspection


def joint(reach: float, sign: str, correlation: float | None = 0.97, delay: float | None = 0.0021) -> JointInspection:
    return JointInspection(
        position_range=(-reach, 0.5 * reach),
        velocity_range=(-3 * reach, 3 * reach),
        torque_range=(-20 * reach, 40 * reach),
        correlation=correlation,
        delay=delay,
        sign=sign,  # type: ignore[arg-type]
    )


@pytest.fixture
def inspection() -> Inspection:
    return Inspection(
        robot="Walker",
        path="logs/walk.mcap",
        samples=40_000,
        duration=40.0,
        rate=1000.0,
        jitter=1.2e-5,
        duplicates=3,
        gaps=[(10.25, 10.31)],
        missing={"torque": 7},
        channels={"time": [40_000], "position": [40_000, 3], "torque": [40_000, 3]},
        support_source="foot forces",
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


def test_the_page_says_what_the_log_holds(inspection: Inspection, tmp_path: Path) -> None:
    path = tmp_path / "inspection.html"
    write_inspection(inspection, path)
    html = path.read_text(encoding="utf-8")
    text = unescape(html)
    for expected in ("1000 Hz", "12.0 µs", "opposite", "10.2500", "head <b>", "left_knee <script>", "foot forces"):
        assert expected in text
    assert "<script>" not in html.partition("</main>")[0]
    write_inspection(replace(inspection, findings=[], audit=[], gaps=[], phases=[], notes=[]), path)
    html = path.read_text(encoding="utf-8")
    assert 'id="findings"' not in html
    assert 'id="timeline"' not in html
    assert "no gaps" in html
    assert list(tmp_path.iterdir()) == [path]
