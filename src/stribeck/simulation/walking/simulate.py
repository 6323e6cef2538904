"""Simulation of a walk with feedback from the sensors, recorded as a log."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import pinocchio as pin

from stribeck.core.base.threads import one_blas_thread
from stribeck.core.base.typing import Array
from stribeck.core.errors import StribeckError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.friction import FrictionTruth
from stribeck.simulation.mujoco.model import PHYSICS_STEP, compile_body
from stribeck.simulation.mujoco.simulator import TOUCH, VERTICAL_FORCE, MujocoSim
from stribeck.simulation.prescribed.exact import Truth
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.sensors.measure import Sensors, measure
from stribeck.simulation.sensors.profiles import SensorProfile
from stribeck.simulation.walking.balance.controller import WalkingController
from stribeck.simulation.walking.balance.tasks import Gains
from stribeck.simulation.walking.balance.terms import Dynamics
from stribeck.simulation.walking.estimator import Measurement, StateEstimator
from stribeck.simulation.walking.footsteps import Push, Steps
from stribeck.simulation.walking.plan import Plan, plan_walk
from stribeck.simulation.walking.recorder import Recorder
from stribeck.simulation.walking.start import start_standing

PERIOD = 1e-3
"""Sampling period of sensors and log [s]."""
HELD = 2
"""Number of periods with constant torque: estimator and controller run at 500 Hz, in 40 % less time than at 1 kHz."""


class FellError(StribeckError):
    """The simulated robot fell."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Conditions:
    """Conditions of a walk.

    Attributes
    ----------
    friction
        Friction of the joints in the tree's order; none if None. It is used for one run.
    state
        State for the controller: estimated from the sensors, or the ground truth.
    profile, seed
        Profile of the sensors, and seed of their errors.
    pushes
        Pushes on the base.
    believed
        Model of controller and estimator; the robot's model if None.
    gains
        Gains of the controller.
    soles
        Soles of feet without a simple shape in the model.
    physics_step
        Step of the physics [s].
    compensation
        Function from estimated and desired joint velocities [rad/s], shape (n,) each, to torques that are added to the
        controller's [N m], shape (n,). It is called in every control period; joints are in the tree's order.
    """

    friction: FrictionTruth | None = None
    state: Literal["estimated", "true"] = "estimated"
    profile: SensorProfile = field(default_factory=SensorProfile)
    seed: int = 0
    pushes: Sequence[Push] = ()
    believed: pin.Model | None = None
    gains: Gains = field(default_factory=Gains)
    soles: Mapping[str, Sole] = field(default_factory=dict)
    physics_step: float = PHYSICS_STEP
    compensation: Callable[[Array, Array], Array] | None = None


@dataclass(frozen=True, eq=False)
class Walk:
    """Simulated walk: measured log, ground truth, and plan.

    Attributes
    ----------
    swing_error
        Position error of the swing foot in the controller [m], shape (T, 3); zero in double support, None for ideal
        motions.
    """

    log: RobotLog
    truth: Truth
    plan: Plan
    swing_error: Array | None = None


def simulate_walk(
    robot: Robot,
    walk: Sequence[Steps],
    posture: Mapping[str, float],
    conditions: Conditions,
    progress: Callable[[float], None] = lambda _: None,
) -> Walk:
    """Simulate a walk, torque-controlled at 500 Hz and logged at 1 kHz.

    Parameters
    ----------
    robot
        Robot with two flat feet, from a robot file.
    walk
        Groups of steps in their order; empty to stand.
    posture
        Initial joint positions by name [rad], which the robot stays near.
    conditions
        Conditions of the walk.
    progress
        Callback `progress(fraction)`.

    Raises
    ------
    FellError
        If the robot falls; the message says when.
    BalanceError
        If no torques keep the feet on the ground.
    SettingsError
        If the robot cannot be simulated, or the posture allows no stance.
    """
    body = compile_body(robot, conditions.soles, conditions.physics_step)
    start = start_standing(robot, Dynamics(robot, body.soles), posture)
    dynamics = Dynamics(robot, body.soles, conditions.believed)
    plan = plan_walk(walk, start.feet, np.sqrt(-dynamics.gravity[2] / start.height), PERIOD)
    controller = WalkingController(robot, dynamics, body.soles, start, body.torque_limit, plan, conditions.gains)
    known = conditions.state == "true"
    estimator = None if known else StateEstimator(dynamics, start.configuration, HELD * plan.period)
    friction = conditions.friction or FrictionTruth(len(start.posture))
    sim = MujocoSim(body, friction, start.configuration, plan.period)
    recorder = Recorder(robot, body, plan.samples, plan.period)
    sensors = Sensors(
        conditions.profile,
        joints=len(start.posture),
        feet=len(robot.contacts),
        samples=plan.samples,
        period=plan.period,
        seed=conditions.seed,
    )
    with one_blas_thread():
        errors = _run(sim, controller, recorder, estimator, sensors, conditions, progress)
    exact = recorder.log()
    truth = replace(recorder.truth(friction.parameters), foot_wrench=exact.foot_wrench)
    return Walk(measure(exact, sensors), truth, plan, errors)


def _run(
    sim: MujocoSim,
    controller: WalkingController,
    recorder: Recorder,
    estimator: StateEstimator | None,
    sensors: Sensors,
    conditions: Conditions,
    progress: Callable[[float], None],
) -> Array:
    """Run the plan in a loop of measurement, estimation and control; return the swing foot's error."""
    plan, robot = controller.plan, recorder.robot
    errors = np.empty((plan.samples, 3))
    touch, torque = np.zeros((len(robot.contacts), TOUCH)), np.zeros(len(robot.joint_names))
    # a fall: the base is below this share of its initial height
    lowest = 0.6 * controller.start.configuration[2]
    for k in range(plan.samples):
        now = sim.now()
        recorder.see(now, touch)
        if k % HELD == 0:
            if estimator is None:
                configuration, velocity = now.configuration, now.velocity
            else:
                configuration, velocity = estimator.update(_read(recorder, sensors, k))
            torque = controller.torque(k, configuration, velocity)
            if conditions.compensation is not None:
                torque = torque + conditions.compensation(velocity[6:], controller.desired_velocity())
        errors[k] = controller.swing_error
        applied, first, touch = sim.advance(torque, _push_at(conditions.pushes, k * plan.period))
        recorder.act(applied, first)
        if not now.configuration[2] > lowest:  # also true for NaN
            raise FellError(f"{robot.name} fell {k * plan.period:.2f} s after the start, {_place(plan, k)}")
        if k % 100 == 0:
            progress(k / plan.samples)
    return errors


def _read(recorder: Recorder, sensors: Sensors, k: int) -> Measurement:
    """Measure a sample: joints without delay, IMU and feet with delay."""
    then = max(k - sensors.late, 0)
    position = recorder.configuration[k, 7:][recorder.rows]
    return Measurement(
        sensors.position(k, position)[recorder.columns],
        sensors.orientation(k, recorder.configuration[then, 3:7]),
        sensors.angular_velocity(k, recorder.velocity[then, 3:6]),
        sensors.linear_acceleration(k, recorder.specific_force[then]),
        sensors.vertical_force(k, recorder.touch_before[then, :, VERTICAL_FORCE]),
    )


def _push_at(pushes: Sequence[Push], time: float) -> Array | None:
    acting = [np.array(push.force) for push in pushes if push.start <= time < push.start + push.duration]
    return np.asarray(np.sum([np.zeros(3), *acting], axis=0)) if pushes else None


def _place(plan: Plan, sample: int) -> str:
    """Describe the phase of the plan at a sample."""
    return f"at step {plan.step[sample] + 1} of {len(plan.steps)}" if plan.steps else "standing"
