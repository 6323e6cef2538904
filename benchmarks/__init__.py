"""Speed, as ratios measured in one run: `python -m benchmarks.friction_torque`, `python -m benchmarks.identify`."""
