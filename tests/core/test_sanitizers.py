"""The C++ test programs, built and run under the address and undefined-behaviour sanitizers."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.building import REPOSITORY, cmake, generator, run


@pytest.mark.slow
def test_core_and_npz_are_clean_under_the_sanitizers(tmp_path: Path) -> None:
    build = str(tmp_path)
    run(
        *cmake(),
        *("-S", str(REPOSITORY), "-B", build),
        *generator(),
        "-DINELASTIC_PYTHON=OFF",
        "-DINELASTIC_TESTS=ON",
        "-DINELASTIC_SANITIZE=ON",
        "-DCMAKE_CXX_FLAGS=-Werror",  # -Wall -Wextra are the project's own
    )
    run(*cmake(), "--build", build)
    run(*cmake(), "--build", build, "--target", "test")  # ctest, wherever it is
