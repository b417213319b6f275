"""Which tests may run at the same time, where pytest-xdist spreads them over processes."""

from __future__ import annotations

import pytest


# Before pytest-xdist looks at the groups.
@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the tests of a file into one process, and all tests with a number of ranks into another.

    The tests of a file share the fixtures of its module. Ranks that wait for each other keep their
    cores busy, so that two runs of two ranks on two cores take longer than one after the other.
    """
    for item in items:
        parameters = getattr(item, "callspec", None)
        ranks = parameters.params.get("ranks", 1) if parameters else 1
        item.add_marker(pytest.mark.xdist_group("ranks" if ranks != 1 else item.path.stem))
