"""Speed, as ratios measured in one run: `python -m benchmarks.friction_torque`, `.identify`, `.whole_log`, ..."""
