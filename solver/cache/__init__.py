"""Caches that keep steps fast and never change a result: transitions, and compiled functions."""
