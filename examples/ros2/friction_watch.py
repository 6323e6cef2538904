"""ROS 2 node that tracks joint friction and publishes diagnostics once per second.

    python friction_watch.py result.json robot.toml RATE [STATE_FILE]

Subscribes to `joint_states` and `imu`, and to `contacts/<foot>` (std_msgs/Bool) for each contact of the robot file; a
legged robot without these topics is not tracked. Joint names, signs and units are those of the robot file, positions in
rad, torques in N m.
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from stribeck import Robot, read_result
from stribeck.service.online import OnlineFriction

OK, WARN = 0, 1


class FrictionMonitor:
    """Passes messages to `OnlineFriction` and makes diagnostics of its state; independent of ROS."""

    def __init__(self, result: str | Path, robot: str | Path, rate: float) -> None:
        self.robot = Robot.from_file(robot)
        self.online = OnlineFriction(read_result(result), self.robot, rate)
        self._base: tuple[list[float], list[float]] | None = None
        self._contact: dict[str, bool] = {}
        self._places: dict[tuple[str, ...], list[int]] = {}

    def imu(self, message: Any) -> None:
        """Keep the orientation and the angular velocity of the base."""
        turn, spin = message.orientation, message.angular_velocity
        self._base = [turn.x, turn.y, turn.z, turn.w], [spin.x, spin.y, spin.z]

    def contact(self, foot: str, message: Any) -> None:
        """Keep whether a foot stands."""
        self._contact[foot] = bool(message.data)

    def joint_state(self, message: Any) -> list[str]:
        """Use a sample; returns alarms as text."""
        names, known = tuple(message.name), len(self._contact) == len(self.robot.contacts)
        if self.robot.base == "floating" and (self._base is None or not known):
            return []
        if names not in self._places:
            self._places[names] = [names.index(name) for name in self.robot.joint_names]
        signals = [
            np.asarray(each)[self._places[names]] for each in (message.position, message.velocity, message.effort)
        ]
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        contact = [self._contact[foot] for foot in self.robot.contacts] if self.robot.base == "floating" else None
        return [alarm.line for alarm in self.online.update(stamp, *signals, self._base, contact)]

    def diagnostics(self, types: Any, header: Any) -> Any:
        """Make a DiagnosticArray of the message types of `diagnostic_msgs.msg`."""
        status = []
        for name, own in self.online.state().items():
            alarm = self.online.alarms.get(name)
            values = {
                "friction": own.friction,
                "low": own.interval_95[0],
                "high": own.interval_95[1],
                "identified": own.baseline,
                "observed motion [s]": own.motion,
            }
            status.append((WARN if alarm else OK, f"friction of {name}", alarm.line if alarm else "normal", values))
        for name, alarm in self.online.alarms.items():
            if alarm.kind != "joint":
                status.append((WARN, name, alarm.line, {"change": alarm.change}))
        return types.DiagnosticArray(
            header=header,
            status=[
                types.DiagnosticStatus(
                    level=level if getattr(types, "PLAIN_LEVEL", False) else bytes([level]),
                    name=name,
                    message=text,
                    hardware_id=self.robot.name,
                    values=[types.KeyValue(key=key, value=f"{value:.4g}") for key, value in values.items()],
                )
                for level, name, text, values in status
            ],
        )


def main() -> None:
    """Run the node until ROS shuts down."""
    import diagnostic_msgs.msg as types
    import rclpy
    from sensor_msgs.msg import Imu, JointState
    from std_msgs.msg import Bool, Header

    result, robot, rate, *state = sys.argv[1:]
    monitor, saved = FrictionMonitor(result, robot, float(rate)), time.monotonic()
    if state and Path(state[0]).exists():
        monitor.online.load(state[0])
    rclpy.init()
    node = rclpy.create_node("friction_watch")
    publisher = node.create_publisher(types.DiagnosticArray, "diagnostics", 10)

    def publish() -> None:
        nonlocal saved
        publisher.publish(monitor.diagnostics(types, Header(stamp=node.get_clock().now().to_msg())))
        if state and time.monotonic() - saved > 60:
            saved = time.monotonic()
            monitor.online.save(state[0])

    node.create_subscription(
        JointState,
        "joint_states",
        lambda message: [node.get_logger().warn(line) for line in monitor.joint_state(message)],
        100,
    )
    node.create_subscription(Imu, "imu", monitor.imu, 100)
    for foot in monitor.robot.contacts:
        node.create_subscription(
            Bool, f"contacts/{foot}", lambda message, foot=foot: monitor.contact(foot, message), 100
        )
    node.create_timer(1.0, publish)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
