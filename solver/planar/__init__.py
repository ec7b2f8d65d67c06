"""The robot in the plane (eq. 4 and 5): one cable, and obstacles in its plane."""
