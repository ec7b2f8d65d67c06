"""The paper's results, reproduced."""
