import os
from collections.abc import Callable

import pytest
from hypothesis import settings

# The same examples on every run; `make soak` asks for others, and more, with --hypothesis-profile=default.
settings.register_profile("repeatable", max_examples=50, derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--soak", type=int, default=10_000, help="steps of the random soak of the solver")
    parser.addoption(
        "--vector-steps", type=int, default=300, help="steps of the vector environments beside single ones"
    )
    parser.addoption(
        "--long", action="store_true", help="more scenes, steps and cases of the tests that have a long form"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the cases that are marked as long, unless they are asked for."""
    if config.getoption("long"):
        return
    config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("long")])
    items[:] = [item for item in items if not item.get_closest_marker("long")]


@pytest.fixture
def many(pytestconfig: pytest.Config) -> Callable[[int, int], int]:
    """Return a function that picks the first of two numbers, and with --long the second, larger one."""
    return lambda few, more: more if pytestconfig.getoption("long") else few


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Keeps what tests compile out of the user's cache."""
    os.environ["CCR_GYM_CACHE"] = str(tmp_path_factory.mktemp("cache"))
