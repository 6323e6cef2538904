"""Walking on two feet: footsteps, a plan for the divergent component of motion, and whole-body balance."""
