"""From friction torque samples to parameters with intervals and verdicts."""
