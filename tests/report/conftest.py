"""A plausible result with its evidence, made from the smooth Stribeck law and a walking rhythm."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.samples import make_samples

from stribeck.base.finding import Finding
from stribeck.base.typing import Array
from stribeck.friction import get_law
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.report import Reference
from stribeck.result import Evidence, JointResult, LogSummary, ParameterEstimate, Result, Validation
from stribeck_simulation.pictures.walk import Footprint, Pose, WalkPicture

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
DRIVER = shutil.which("chromedriver")
FLAGS = "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run"
QUIET = "--disable-background-networking --disable-component-update --disable-sync"
"""Or the browser asks the network."""

LAW = get_law("stribeck")
TRUTH = dict(zip([parameter.name for parameter in LAW.parameters], [1.2, 3.0, 0.6, 0.12, 0.3, 90.0], strict=True))
ARRAYS = ("time", "velocity", "acceleration", "friction_torque", "usable", "block", "support")
"""Fields of samples with a row for each."""
LIMBS = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")
ARMS = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_yaw", "wrist_pitch", "wrist_roll", "gripper")


def joint_names(joints: int) -> tuple[str, ...]:
    """Mirrored legs, then arms, then a torso."""
    mirrored = [f"{side}_{joint}" for joint in (*LIMBS, *ARMS) for side in ("left", "right")]
    return (*mirrored[: joints - 2], "torso_pitch", "torso_yaw")


def walking_samples(names: tuple[str, ...], duration: float, period: float, seed: int) -> tuple[FrictionSamples, Array]:
    """Steps of 0.8 s with both feet down in between, every joint at its own rhythm; samples and the truth."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, duration, period)
    count = len(names)
    rhythm = 2 * np.pi * (1.25 + 0.1 * rng.random(count))
    size = np.where(np.arange(count) == count - 1, 0.004, 0.6 + 1.2 * rng.random(count))  # the last one hardly moves
    phase = 2 * np.pi * rng.random(count)
    angle = rhythm * time[:, None] + phase
    velocity = size * (np.sin(angle) + 0.5 * np.sin(0.37 * angle))
    acceleration = np.gradient(velocity, period, axis=0)
    values = np.array(list(TRUTH.values()))
    truth = values * (0.7 + 0.6 * rng.random((count, len(values))))
    friction = np.column_stack([LAW.torque(velocity[:, j], truth[j]) for j in range(count)])
    friction += 0.25 * rng.standard_normal(friction.shape)
    step = (time / 0.8).astype(np.int64)
    swing_left = step % 2 == 0
    standing = (time % 0.8) < 0.1
    left = np.array(["left" in name for name in names])
    usable = np.where(left, swing_left[:, None], ~swing_left[:, None]) & ~standing[:, None]
    usable[:, [j for j, name in enumerate(names) if "torso" in name]] = True
    samples = make_samples(
        velocity,
        np.where(usable, friction, np.nan),
        names,
        period,
        time=time,
        acceleration=acceleration,
        usable=usable,
        block=step,
        support=np.where(standing, 2, swing_left.astype(np.int64)),
        support_names=("left_foot", "right_foot", "left_foot+right_foot"),
    )
    return samples, truth


def make_joint(samples: FrictionSamples, index: int, truth: Array, weak: bool) -> JointResult:
    """What a fit would say of a joint."""
    name = samples.joint_names[index]
    keep = samples.usable[:, index]
    velocity, friction = samples.velocity[keep, index], samples.friction_torque[keep, index]
    span = (float(velocity.min()), float(velocity.max()))
    common = {
        "samples": int(keep.sum()),
        "velocity_range": span,
        "reversals": int(np.count_nonzero(np.diff(np.sign(velocity)))),
    }
    if max(abs(span[0]), abs(span[1])) < 0.02:
        reason = f"the velocity stays within {span[1]:.3f} rad/s; at least 0.02 rad/s is needed"
        return JointResult(parameters={}, verdict="not excited", reason=reason, **common)
    J = LAW.jacobian(velocity[::7], truth)
    covariance = 0.25**2 * np.linalg.inv(J.T @ J) * (4000.0 if weak else 4.0)
    error = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(error, error)
    parameters = {
        parameter.name: ParameterEstimate(
            value=float(truth[i]),
            standard_error=float(error[i]),
            interval_95=(float(truth[i] - 1.96 * error[i]), float(truth[i] + 1.96 * error[i])),
            unit=parameter.unit,
            verdict="weak" if 3.92 * error[i] > abs(truth[i]) else "identified",
        )
        for i, parameter in enumerate(LAW.parameters)
    }
    residual = friction - LAW.torque(velocity, truth)
    rms = float(np.sqrt(np.mean(residual**2)))
    zero = float(np.sqrt(np.mean(friction**2)))
    verdict = "weak" if any(value.verdict == "weak" for value in parameters.values()) else "identified"
    return JointResult(
        parameters=parameters,
        verdict=verdict,
        reason="the interval of viscous is wider than its value" if verdict == "weak" else "all intervals are narrow",
        **common,
        residual_rms=rms,
        validation=Validation(rms=1.03 * rms, rms_zero_friction=zero, rms_coulomb_only=0.4 * zero),
        positive_power_fraction=0.29 if name == "left_hip_roll" else 0.01,
        correlation=tuple(map(tuple, correlation.tolist())),
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


def build_result(joints: int = 6, duration: float = 40.0, period: float = 0.002, robot: str = "Walker") -> Result:
    names = joint_names(joints)
    samples, truth = walking_samples(names, duration, period, seed=3)
    found = [make_joint(samples, j, truth[j], weak=name == "torso_pitch") for j, name in enumerate(names)]
    return Result(
        robot=robot,
        log=LogSummary(
            path="logs/walk.mcap", sha256="3f" * 32, duration=duration, rate=1 / period, samples_used=len(samples.time)
        ),
        law="stribeck",
        method="curve-fit",
        joints=dict(zip(names, found, strict=True)),
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


def make_walk(steps: int = 30, length: float = 0.3, turn: float = 0.02) -> WalkPicture:
    """A robot of two legs, a trunk and two arms that walks ahead and turns a little to the left at each step."""
    yaw = turn * np.arange(steps)
    way = np.cumsum(length * np.column_stack([np.cos(yaw), np.sin(yaw)]), axis=0)
    side = np.where(np.arange(steps) % 2, -0.1, 0.1)
    prints = [
        Footprint(
            foot="left_foot" if side[k] > 0 else "right_foot",
            place=(float(way[k, 0] - side[k] * np.sin(yaw[k])), float(way[k, 1] + side[k] * np.cos(yaw[k]))),
            yaw=float(yaw[k]),
            size=(0.22, 0.1),
            time=0.8 * k,
        )
        for k in range(steps)
    ]
    time = np.linspace(0.0, 0.8 * (steps - 1), 25 * steps)
    com = np.column_stack([np.interp(time, 0.8 * np.arange(steps), way[:, axis]) for axis in (0, 1)])
    names = tuple(f"{side}_{name}" for side in ("left", "right") for name in ("knee", "ankle_pitch", "elbow"))
    poses = []
    for share in np.linspace(0, 1, 8):
        swing, k = 0.4 * np.cos(2 * np.pi * share), steps // 2
        lines = [((0, 0, 0.9), (0, 0, 1.6))]
        for sign in (1, -1):
            knee, ankle = (sign * 0.2 * swing, sign * 0.1, 0.5), (sign * swing, sign * 0.1, 0.1)
            lines += [((0, sign * 0.1, 0.9), knee), (knee, ankle)]
            lines += [((0, sign * 0.1, 1.4), (-sign * swing, sign * 0.2, 1.0))]
        cosine, sine = np.cos(yaw[k]), np.sin(yaw[k])
        segments = np.array(lines) @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]) + [*way[k], 0]
        root = np.array([*way[k], 0.9, 0.0, 0.0, np.sin(yaw[k] / 2), np.cos(yaw[k] / 2)])
        poses.append(Pose(time=0.8 * (k + 2 * share), segments=segments, configuration=root))
    return WalkPicture(
        footprints=tuple(prints), com_time=time, com=com, poses=tuple(poses), segment_names=("waist", *names)
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


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A browser without the network; tests that need it are skipped where there is none."""
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("no Chromium with its chromedriver on the PATH: the pages are not looked at")
    webdriver = pytest.importorskip(
        "selenium.webdriver", reason="selenium is not installed: the report is not looked at"
    )
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS.split(), *QUIET.split(), f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=DRIVER))
    yield driver
    driver.quit()


@pytest.fixture(scope="session")
def result() -> Result:
    return build_result()
