"""Identify friction and inertial parameters together by least squares on the regressor (docs/other-methods.md)."""
