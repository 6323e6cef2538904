"""Where nothing stands, the equations hold without any force, and friction shows in every joint."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from stribeck import Robot, Settings
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.phases import SupportPhase, SupportPhases, phases_of_segment
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import PreparedLog, prepare
from stribeck.core.equations.whole_log.build import WeakForm, weak_form
from stribeck.core.equations.whole_log.segments import cut_segments
from stribeck.core.log import RobotLog
from stribeck.core.log.sampling import regularise
from stribeck.core.settings import FilterSettings
from stribeck.simulation.robots import MODELS

COULOMB = 2.0


def falling(robot: Robot, duration: float) -> tuple[RobotLog, Array]:
    """Return a robot that falls freely while all joints swing, integrated from the whole equation of motion."""
    model, generator = robot.tree.model, np.random.default_rng(3)
    data, n, order = model.createData(), len(robot.joint_names), robot.tree.columns
    size, pace, phase = generator.uniform(0.1, 0.4, n), generator.uniform(6, 12, n), generator.uniform(0, 6, n)

    def joints(t: float) -> tuple[Array, Array, Array]:
        q = size * np.sin(pace * t + phase)
        return q, size * pace * np.cos(pace * t + phase), -(pace**2) * q

    def dense(t: float, y: Array) -> tuple[Array, Array]:
        """Return the base's acceleration and the joints' torques; y is its quaternion and velocity."""
        q, v, a = (each[order] for each in joints(t))
        configuration = np.concatenate([np.zeros(3), y[:4] / np.linalg.norm(y[:4]), q])
        inertia = pin.crba(model, data, configuration).copy()
        bias = pin.nonLinearEffects(model, data, configuration, np.concatenate([y[4:], v]))
        base = np.linalg.solve(inertia[:6, :6], -(bias[:6] + inertia[:6, 6:] @ a))
        torque = np.empty(n)
        torque[order] = inertia[6:] @ np.concatenate([base, a]) + bias[6:]
        return base, torque

    def change(t: float, y: Array) -> Array:
        x, z = y[:4], y[7:]
        turned = 0.5 * np.concatenate([x[3] * z + np.cross(x[:3], z), [-x[:3] @ z]])
        return np.concatenate([turned, dense(t, y)[0]])

    time = np.arange(0.0, duration, 1e-3)
    start = np.concatenate([[0.1, -0.2, 0.05, 0.97], np.zeros(3), [0.5, -1.0, 0.7]])
    y = solve_ivp(change, (0, duration), start, t_eval=time, rtol=1e-9, atol=1e-10).y.T
    torque = np.stack([dense(t, row)[1] for t, row in zip(time, y, strict=True)])
    friction = COULOMB * np.tanh(np.stack([joints(t)[1] for t in time]))
    log = RobotLog(
        time=time,
        joint_names=robot.joint_names,
        position=np.stack([joints(t)[0] for t in time]),
        torque=torque + friction,
        base_orientation=y[:, :4] / np.linalg.norm(y[:, :4], axis=1, keepdims=True),
        contact=np.zeros((len(time), len(robot.contacts)), dtype=bool),
        foot_names=tuple(robot.contacts),
    )
    return log, friction


def form_of(robot: Robot, log: RobotLog, corrections: str = "none") -> WeakForm:
    log, sampling = regularise(log, robot.log_table)
    settings = Settings.model_validate({"corrections": corrections})
    whole, touching = sampling.segments[0], np.zeros_like(log.contact)
    phases = tuple(phases_of_segment(log.contact, touching, tuple(robot.contacts), log.time, whole, settings.support))
    support = SupportPhases(phases=phases, source="flags")
    prepared = PreparedLog(log=log, sampling=sampling, support=support, prints=np.zeros(0, dtype=np.uint64))
    return weak_form(robot, prepared, np.arange(len(robot.joint_names)), settings)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return Robot.from_file(MODELS / "toro.toml")


@pytest.fixture(scope="module")
def fall(robot: Robot) -> tuple[RobotLog, Array]:
    return falling(robot, 0.4)


def test_the_residual_of_a_flight_is_the_friction_of_every_joint(robot: Robot, fall: tuple[RobotLog, Array]) -> None:
    log, friction = fall
    form = form_of(robot, log)
    assert [segment.feet for segment in form.segments] == [()]
    found = form.equations(form.segments[0], 0)
    assert found.projection.shape[1:] == (len(robot.joint_names),) * 2
    assert not found.standing.any()
    segment = form.segments[0]
    through = form.filters.window.apply(friction[segment.first : segment.last])
    expected = np.einsum("kij,kj->ki", found.projection, through)
    np.testing.assert_allclose(found.residual, expected, atol=2e-3 * COULOMB)
    assert np.abs(np.linalg.eigvalsh(found.projection @ found.projection.transpose(0, 2, 1))).min() > 0.01


def test_signs_of_quaternions_change_no_column(robot: Robot, fall: tuple[RobotLog, Array]) -> None:
    log, _ = fall
    assert log.base_orientation is not None
    signs = np.where(np.arange(len(log.time)) // 50 % 2, 1.0, -1.0)[:, None]
    flipped = replace(log, base_orientation=signs * log.base_orientation)
    plain, other = (
        form.equations(form.segments[0], 0) for each in (log, flipped) if (form := form_of(robot, each, "calibration"))
    )
    np.testing.assert_allclose(other.regressors, plain.regressors, atol=1e-9)


def test_columns_of_a_flight_are_those_of_wrong_inertias_and_zeros(robot: Robot, fall: tuple[RobotLog, Array]) -> None:
    form = form_of(robot, fall[0], "calibration")
    found = form.equations(form.segments[0], 0)
    model = pin.Model(robot.tree.model)
    body = model.getJointId(robot.joint_names[3])
    wrong = model.inertias[body].toDynamicParameters() * 1.001
    model.inertias[body] = pin.Inertia.FromDynamicParameters(wrong)
    other = form_of(replace(robot, tree=replace(robot.tree, model=model)), fall[0], "calibration")
    change = other.equations(other.segments[0], 0).residual - found.residual
    at = form.corrections.bodies.index(str(robot.tree.model.names[body])) * 10
    expected = -(found.regressors[:, :, at : at + 10] @ (0.001 / 1.001 * wrong))
    np.testing.assert_allclose(change, expected, atol=0.02 * np.abs(expected).max())


def test_friction_torques_of_a_flight_are_those_of_every_joint(robot: Robot, fall: tuple[RobotLog, Array]) -> None:
    """Verdicts rest on these samples: the fit uses flights too."""
    log, friction = fall
    standing = np.broadcast_to(log.time[:, None] < 0.06, log.contact.shape)
    before_it_tips_over = replace(log, contact=standing).take(slice(0, 330))
    ready = prepare(before_it_tips_over, robot, robot.settings)
    settings = Settings(filter=FilterSettings(kind="savitzky-golay", window=9))
    chunks = [chunk for chunk in torque_chunks(ready, robot, settings) if "flight" in chunk.samples.support_names]
    assert chunks
    for chunk in chunks:
        samples = chunk.samples
        flies = samples.support == samples.support_names.index("flight")
        legs = samples.usable[flies].all(axis=0)
        assert legs.sum() >= 12
        expected = friction[chunk.rows[flies]][:, robot.torque_controlled]
        np.testing.assert_allclose(samples.friction_torque[flies], expected, atol=0.02 * COULOMB)


def test_short_flights_are_used_where_the_log_has_no_long_ones() -> None:
    edges = range(0, 1800, 90)
    phases = tuple(
        SupportPhase(
            start=row, stop=row + 90, feet=feet, kind="double", first=row, last=row, steady_first=row, steady_last=row
        )
        for row, feet in zip(edges, [(), ("a", "b")] * 10, strict=True)
    )
    whole = (slice(0, 1800),)
    segments = cut_segments(phases, whole, period=1e-3, margin=10, shortest=53)
    assert len(segments) >= 18
    long = (*phases, replace(phases[0], start=1800, stop=3800))
    found = cut_segments(long, (slice(0, 3800),), period=1e-3, margin=10, shortest=53)
    assert sum(segment.first < 1800 for segment in found) <= 1  # the first one has no touchdown
