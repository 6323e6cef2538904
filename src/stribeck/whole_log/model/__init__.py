"""What is fitted: friction curves and corrections of the model in one parameter vector."""
