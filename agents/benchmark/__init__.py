"""The benchmark: episodes, metrics, tables and figures."""
