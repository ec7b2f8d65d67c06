"""The paper put to the test: its claims, its Table 1 and its figures."""
