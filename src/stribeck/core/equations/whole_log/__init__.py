"""The weak form of a log's equation of motion, the input of the whole-log fit."""
