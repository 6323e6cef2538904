"""Logs of robots whose motion is prescribed: torques by inverse dynamics."""
