"""Standing feet as rigid constraints (5.5), with unlimited ground reactions."""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot

STIFFNESS, DAMPING = 900.0, 60.0
"""Gains of Baumgarte's correction while a foot settles [1/s^2], [1/s]: critically damped at 30 rad/s."""


class RigidFeet:
    """Feet of one run.

    A foot may be tilted, moving and above the ground at touchdown. An impulse with minimum loss of kinetic energy stops
    it; Baumgarte's correction then levels and lowers it. After settling, its acceleration is exactly zero, and every
    step removes its velocity from integration errors by projection.

    Parameters
    ----------
    robot
        Robot with a floating base, or with a fixed base and no contacts.
    model
        Model of the robot's tree; its armature may change between calls.
    ground
        Height of the ground [m].
    corrected
        Whether feet are stopped, leveled and projected. If not, only their acceleration is zero, as in the paper.
    """

    def __init__(self, robot: Robot, model: pin.Model, ground: float, corrected: bool) -> None:
        self._robot, self._model, self._ground, self._corrected = robot, model, ground, corrected
        self._data, self._impact = model.createData(), model.createData()
        self.feet: tuple[str, ...] = ()
        self._settled: dict[str, float] = {}  # standing foot -> time when it has settled
        self._constraints: dict[str, pin.RigidConstraintModel] = {}
        self._held: tuple[str, ...] = ()
        self._begun = False
        self._standing_set = self._held_set = self._load(self._data, ())
        self._load(self._impact, ())

    def stand(self, feet: tuple[str, ...], time: float, configuration: Array, velocity: Array) -> Array:
        """Set the standing feet, and return the velocity after the impact of new feet, shape (nv,)."""
        changed = feet != self.feet
        if changed:
            landed = [foot for foot in feet if foot not in self.feet]
            # settling time after touchdown [s]; it reduces a tilt of 5 deg to 0.006 deg
            settled = time + 0.3 if self._begun and self._corrected else time
            self._constraints |= {foot: self._plant(foot, configuration) for foot in landed}
            self._settled |= dict.fromkeys(landed, settled)
            self.feet, self._begun = feet, True
            if self._corrected:
                data = self._model.createData()
                velocity = self._projected(data, self._load(data, feet), configuration, velocity)
        held = tuple(foot for foot in feet if self._settled[foot] <= time + 1e-9)  # tolerance for rounded times [s]
        if changed or held != self._held:
            self._hold(held)
        return velocity

    def acceleration(self, configuration: Array, velocity: Array, effort: Array) -> Array:
        """Compute the acceleration due to generalized forces with constrained feet (5.10), shape (nv,)."""
        return np.array(
            pin.constraintDynamics(
                self._model, self._data, configuration, velocity, effort, *self._standing_set, _PROXIMAL
            )
        )

    def held(self, configuration: Array, velocity: Array) -> Array:
        """Remove the velocity of held feet by projection, shape (nv,)."""
        if not (self._held and self._corrected):
            return velocity
        return self._projected(self._impact, self._held_set, configuration, velocity)

    def standing(self) -> NDArray[np.bool_]:
        """Return the mask of standing feet, shape (feet,)."""
        return np.array([foot in self.feet for foot in self._robot.contacts], dtype=bool)

    def wrenches(self) -> Array:
        """Compute force and moment of the ground on each foot of the robot, in its frame, shape (feet, 6)."""
        result = np.zeros((len(self._robot.contacts), 6))
        for foot, data in zip(self.feet, self._standing_set[1], strict=True):
            result[list(self._robot.contacts).index(foot)] = data.contact_force.vector
        return result

    def _plant(self, foot: str, configuration: Array) -> pin.RigidConstraintModel:
        """Build the constraint of a level foot at its position on the ground, with its current heading."""
        contact = self._robot.contacts[foot]
        index = self._model.getFrameId(contact.frame)
        frame, data = self._model.frames[index], self._model.createData()
        pin.framesForwardKinematics(self._model, data, configuration)
        pose = data.oMf[index]
        place = pin.SE3(pose)
        if self._corrected:
            yaw = np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])
            place = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, yaw), np.array([*pose.translation[:2], self._ground]))
        kind = pin.ContactType.CONTACT_6D if contact.kind == "surface" else pin.ContactType.CONTACT_3D
        return pin.RigidConstraintModel(
            kind, self._model, int(frame.parentJoint), frame.placement, 0, place, pin.ReferenceFrame.LOCAL
        )

    def _hold(self, feet: tuple[str, ...]) -> None:
        """Hold these feet exactly, and correct the other standing feet."""
        self._held = feet
        for foot in self.feet:
            gains = (0.0, 0.0) if foot in feet else (STIFFNESS, DAMPING)
            self._constraints[foot].setBaumgarteCorrectorParameters(pin.BaumgarteCorrectorParameters(*gains))
        self._standing_set = self._load(self._data, self.feet)
        self._held_set = self._load(self._impact, feet)

    def _load(
        self, data: pin.Data, feet: tuple[str, ...]
    ) -> tuple[pin.StdVec_RigidConstraintModel, pin.StdVec_RigidConstraintData]:
        """Collect the constraints of some feet for Pinocchio, and prepare their working memory."""
        models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
        for foot in feet:
            models.append(self._constraints[foot])
            datas.append(self._constraints[foot].createData())
        pin.initConstraintDynamics(self._model, data, models, datas)
        return models, datas

    def _projected(
        self,
        data: pin.Data,
        constraints: tuple[pin.StdVec_RigidConstraintModel, pin.StdVec_RigidConstraintData],
        configuration: Array,
        velocity: Array,
    ) -> Array:
        return np.array(pin.impulseDynamics(self._model, data, configuration, velocity, *constraints, 0.0, _PROXIMAL))


_PROXIMAL = pin.ProximalSettings(1e-12, 1e-12, 0.0, 1)
"""Settings for independent constraints, which need only one iteration."""
