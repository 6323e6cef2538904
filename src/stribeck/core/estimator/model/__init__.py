"""The fitted model: friction curves and corrections of the robot in one parameter vector."""
