"""What the solvers in the plane and in space share."""
