"""Speed benchmarks: medians, and ratios of what was measured in the same run."""
