"""Parts shared by the solvers in the plane and in space."""
