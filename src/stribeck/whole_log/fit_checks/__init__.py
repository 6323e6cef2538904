"""Whether the law describes what was measured."""
