"""A log against models: the torque that they ask for, and how the joints move under the torque that was measured."""
