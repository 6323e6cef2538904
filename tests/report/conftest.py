"""A plausible result with its evidence, made from the smooth Stribeck law and a walking rhythm."""

import importlib
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from tests.samples import make_samples

from stribeck import Settings
from stribeck.app.report import Reference
from stribeck.core.base.finding import Finding
from stribeck.core.friction import get_law
from stribeck.core.judgement.verdict import judge
from stribeck.core.result import Evidence, LogSummary, Result
from stribeck.core.result.samples import FrictionSamples
from stribeck.paper.curve_fit.fit import fit_law, validate

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run"
QUIET = "--disable-background-networking --disable-component-update --disable-sync"
"""Or the browser asks the network."""

LAW = get_law("stribeck")
TRUTH = np.array([1.2, 3.0, 0.6, 0.12, 0.3, 90.0])
ARRAYS = ("time", "velocity", "acceleration", "friction_torque", "usable", "block", "support")
"""Fields of samples with a row for each."""
NAMES = ("left_hip_yaw", "right_hip_yaw", "left_hip_roll", "right_hip_roll", "torso_pitch", "torso_yaw")
PERIOD = 0.005


def walking_samples(duration: float) -> FrictionSamples:
    """Steps of 0.8 s with both feet down in between, every joint at its own rhythm."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, duration, PERIOD)
    count = len(NAMES)
    rhythm = 2 * np.pi * (1.25 + 0.1 * rng.random(count))
    size = np.where(np.arange(count) == count - 1, 0.004, 0.6 + 1.2 * rng.random(count))  # the last one hardly moves
    phase = 2 * np.pi * rng.random(count)
    angle = rhythm * time[:, None] + phase
    velocity = size * (np.sin(angle) + 0.5 * np.sin(0.37 * angle))
    truth = TRUTH * (0.7 + 0.6 * rng.random((count, len(TRUTH))))
    friction = np.column_stack([LAW.torque(velocity[:, j], truth[j]) for j in range(count)])
    friction += 0.25 * rng.standard_normal(friction.shape)
    step = (time / 0.8).astype(np.int64)
    swing_left = step % 2 == 0
    standing = (time % 0.8) < 0.1
    left = np.array(["left" in name for name in NAMES])
    usable = np.where(left, swing_left[:, None], ~swing_left[:, None]) & ~standing[:, None]
    usable[:, ["torso" in name for name in NAMES]] = True
    return make_samples(
        velocity,
        np.where(usable, friction, np.nan),
        NAMES,
        PERIOD,
        time=time,
        acceleration=np.gradient(velocity, PERIOD, axis=0),
        usable=usable,
        block=step,
        support=np.where(standing, 2, swing_left.astype(np.int64)),
        support_names=("left_foot", "right_foot", "left_foot+right_foot"),
    )


def take(samples: FrictionSamples, start: float, end: float) -> FrictionSamples:
    rows = (samples.time >= start) & (samples.time < end)
    return replace(samples, **{name: getattr(samples, name)[rows] for name in ARRAYS})


def make_phases(duration: float) -> list[tuple[float, float, str, bool]]:
    phases = []
    for step in range(int(duration / 0.8)):
        start = 0.8 * step
        foot = "right_foot" if step % 2 == 0 else "left_foot"
        phases += [(start, start + 0.1, "left_foot+right_foot", False), (start + 0.1, start + 0.8, foot, step % 9 != 4)]
    return phases


def build_result(duration: float = 40.0) -> Result:
    samples, settings = walking_samples(duration), Settings(law=LAW.name)
    fits = fit_law(samples, LAW, settings)
    joints = judge(fits, samples, LAW, settings, validate(fits, samples, LAW, settings)[0])
    for name, fit in fits.items():
        error = np.sqrt(np.diag(fit.covariance))
        correlation = (fit.covariance / np.outer(error, error)).tolist()
        joints[name] = replace(joints[name], correlation=tuple(map(tuple, correlation)))
    joints["torso_pitch"] = replace(joints["torso_pitch"], verdict="weak")
    joints["left_hip_roll"] = replace(joints["left_hip_roll"], positive_power_fraction=0.29)
    return Result(
        robot="Walker",
        log=LogSummary(
            path="logs/walk.mcap", sha256="3f" * 32, duration=duration, rate=1 / PERIOD, samples_used=len(samples.time)
        ),
        law="stribeck",
        method="curve-fit",
        joints=joints,
        findings=[Finding.of("passivity", ["left_hip_roll"], evidence="left_hip_roll (1.4 W)")],
        stribeck="0.1.0",
        evidence=Evidence(
            samples=samples,
            phases=make_phases(duration),
            close_up=take(samples, 8.0, 11.2),
            provenance=[("Filter", "Savitzky-Golay, order 4, window 31 samples"), ("Model", "walker.urdf")],
            notes=["12 samples with a repeated time were dropped."],
        ),
    )


def truth_of(result: Result) -> Reference:
    """A truth whose curves are a tenth higher than the fitted ones."""
    curves, known = {}, {}
    for name, joint in result.joints.items():
        if joint.parameters:
            values = np.array([joint.parameters[parameter.name].value for parameter in LAW.parameters])
            velocity = np.linspace(*joint.velocity_range, 101)
            curves[name] = (velocity, 1.1 * LAW.torque(velocity, values))
            known[name] = {parameter: 1.1 * found.value for parameter, found in joint.parameters.items()}
    return Reference(name="the simulated truth", curves=curves, parameters=known)


class Browser:
    """Chromium, controlled by its own protocol, without the network; it keeps the errors of its console."""

    def __init__(self, profile: Path) -> None:
        flags = [*FLAGS.split(), *QUIET.split(), "--remote-debugging-port=0", f"--user-data-dir={profile}"]
        self.process = subprocess.Popen([str(CHROMIUM), *flags, "about:blank"], stderr=subprocess.DEVNULL)
        place, end = profile / "DevToolsActivePort", time.monotonic() + 60
        while not (place.exists() and place.read_text().count("\n")) and time.monotonic() < end:
            time.sleep(0.05)
        with urlopen(f"http://127.0.0.1:{place.read_text().splitlines()[0]}/json") as answer:
            (page,) = (each for each in json.load(answer) if each["type"] == "page")
        connect = importlib.import_module("websocket").create_connection
        self.socket, self.count = connect(page["webSocketDebuggerUrl"], suppress_origin=True), 0
        self.errors: list[dict[str, Any]] = []
        for domain in ("Runtime", "Log", "Page"):
            self.send(f"{domain}.enable")

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command, and return its answer."""
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while (answer := json.loads(self.socket.recv())).get("id") != self.count:
            if answer.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled"):
                self.errors.append(answer["params"])
        return dict(answer["result"])

    def run(self, script: str) -> Any:
        """Return the value of an expression, or of the promise that it is."""
        answer = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def show(self, path: Path, width: int, height: int = 900, scheme: str = "light", media: str = "screen") -> None:
        """Open a page."""
        self.send(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500
        )
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.send("Emulation.setEmulatedMedia", media=media, features=features)
        self.send("Page.navigate", url=path.as_uri())
        self.run("new Promise(done => document.readyState == 'complete' ? done() : addEventListener('load', done))")

    def open_all(self) -> None:
        """Open all folded parts."""
        self.run("document.querySelectorAll('details').forEach(part => { part.open = true; })")

    def draw(self) -> None:
        """Let the page draw what is seen now."""
        self.run("new Promise(done => requestAnimationFrame(() => setTimeout(done, 150)))")

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """Move, press or release the mouse at a place of the window."""
        self.send("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button="left", **more)


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser; tests that need it are skipped where there is none."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on the PATH: the pages are not looked at")
    pytest.importorskip("websocket", reason="websocket-client is not installed: no page is looked at")
    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.socket.close()
    browser.process.terminate()
    browser.process.wait()


@pytest.fixture(scope="session")
def result() -> Result:
    return build_result()
