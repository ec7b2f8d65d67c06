"""Benchmarks: ratios measured in one run, from medians."""
