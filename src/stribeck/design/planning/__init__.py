"""Planning of motions and trajectories that identify friction (docs/plan.md)."""
