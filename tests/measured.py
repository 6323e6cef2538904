"""Robots simulated only with MuJoCo, with drives and friction, and logs of their joint torques and IMU."""

import mujoco
import numpy as np
from mujoco import rollout

IMU = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": "imu"}


def compiled(spec, rng, step, names, friction, armature, drive):
    """Compile a robot whose bodies are heavier or lighter than stated, by 3 % (standard deviation).

    Its joints have Coulomb and viscous friction, rotors and torque sensors; `drive(actuator, name)` sets the gains.
    """
    for name, coulomb, viscous in zip(names, *friction, strict=True):
        joint = spec.joint(name)
        drive(spec.add_actuator(target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT), name)
        joint.frictionloss, joint.damping, joint.armature = coulomb, [viscous, 0, 0], armature
        joint.solimp_friction, joint.solref_friction = [0.99, 0.999, 0.001, 0.5, 2], [0.005, 1]
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_JOINTACTFRC, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name)
    for kind in (mujoco.mjtSensor.mjSENS_GYRO, mujoco.mjtSensor.mjSENS_ACCELEROMETER):
        spec.add_sensor(type=kind, **IMU)
    spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model = spec.compile()
    factor = 1 + 0.03 * rng.standard_normal(model.nbody)
    model.body_mass[:] *= factor
    model.body_inertia[:] *= factor[:, None]
    return model


def record(folder, model, rng, names, place, command, rate, **channels):
    """Simulate a robot from a place and write a noisy log, without the first 2 s; channels are per time step."""
    data, step, joints = mujoco.MjData(model), model.opt.timestep, len(names)
    data.qpos[:] = place
    state, sensed = rollout.rollout(model, data, np.concatenate([[0.0], data.qpos, data.qvel])[None], command[None])
    every, first = round(1 / rate / step), round(2 / step)
    sensed = sensed[0, first + 1 :: every]  # sensors belong to the start of a step
    state, normal = state[0, first::every][: len(sensed)], rng.standard_normal
    torque, turning, acceleration = np.split(sensed, [joints, joints + 3], axis=1)
    position = state[:, 8 : 8 + joints]
    np.savez(
        folder / "log.npz",
        time=np.arange(len(sensed)) / rate,
        joint_names=np.array(names),
        position=position + 2e-5 * normal(position.shape),
        torque=torque + 0.05 * normal(torque.shape),
        base_orientation=state[:, [5, 6, 7, 4]] + 1e-4 * normal((len(state), 4)),
        angular_velocity=turning + 3e-3 * normal(turning.shape),
        linear_acceleration=acceleration + 0.05 * normal(acceleration.shape),
        **{name: values[: len(sensed)] for name, values in channels.items()},
    )
