"""Caches of solver steps and of compiled functions, which never change a result."""
