import os

import pytest
from hypothesis import settings

# The same examples on every run; `make soak` asks for others, and more, with --hypothesis-profile=default.
settings.register_profile("repeatable", max_examples=50, derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--soak", type=int, default=10_000, help="steps of the random soak of the solver")
    parser.addoption(
        "--vector-steps", type=int, default=400, help="steps of the vector environments beside single ones"
    )


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Keeps what tests compile out of the user's cache."""
    os.environ["CCR_GYM_CACHE"] = str(tmp_path_factory.mktemp("cache"))
