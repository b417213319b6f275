"""Arguments of both fixes: right ones run, a wrong one among them ends in one clear error."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.helpers.lammps_run import OF_A_LAUNCHER

SERVER = Path(__file__).parents[1] / "helpers" / "argument_server.py"
# [s] An answer takes 0.01.
PATIENCE = 30.0
# The same examples on every machine; all examples share the server.
FUZZED = settings(
    derandomize=True,
    deadline=None,
    max_examples=300,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


class Server:
    """Runs decks in one process; in a new one after a crash."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None

    def ask(self, commands: list[str]) -> dict[str, Any]:
        """Return what became of a deck with these commands."""
        if self._process is None:
            environment = {
                name: value
                for name, value in os.environ.items()
                if not name.startswith(OF_A_LAUNCHER)
            }
            self._process = subprocess.Popen(
                [sys.executable, str(SERVER)],
                cwd=self._folder,
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(commands).encode() + b"\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], PATIENCE)
        line = process.stdout.readline() if ready else b""
        if not line:
            self.close()
            how = "crashed" if ready else f"gave no answer within {PATIENCE} s"
            pytest.fail(f"LAMMPS {how}: {commands}")
        return json.loads(line)

    def close(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    one = Server(tmp_path_factory.mktemp("server"))
    yield one
    one.close()


def assert_one_clear_error(text: str) -> None:
    """One line that speaks of the fix, and LAMMPS's copy of the command below it."""
    error, *rest = text.splitlines()
    assert error.startswith("ERROR"), text
    assert "src_fix/" in error or "fix" in error.lower(), text
    assert all(line.startswith(("Last input line: ", "-->", " ")) for line in rest), text
    # Nor a message of the language's own library.
    assert "std::" not in text
    assert "basic_string" not in text


def assert_runs(answer: dict[str, Any], commands: list[str]) -> None:
    assert not answer["error"], (commands, answer["error"])
    assert answer["finite"]
    assert answer["step"] == 3


# What each keyword takes, and what it does not.
NO_LENGTH = [
    "0",
    "-1",
    "nan",
    "inf",
    "-inf",
    "1e999",
    "1e-999",
    "x",
    "1e-5x",
    "1,5",
    "--1",
    "0x1p-3",
    "v_x",
    "NULL",
    "*",
]
NO_COUNT = ["0", "-5", "1.5", "1e5", "x", "nan", "99999999999999999999", "v_x", "*", "1;2"]
RIGHT = {
    "region": ["container", "container lid", "lid container"],
    "law": ["inelastic", "gluey", "gluey limit 0.5", "restitution 0", "restitution 1"],
    "solver": ["sweeps", "apgd", "uzawa"],
    "accuracy": ["1e-3", "1", "1e-9"],
    "maxiter": ["1000", "100000", "1000 warn", "2147483648"],
    "frozen": ["still"],
    "record": ["step*.npz every 1", "*.npz every 1000", "a.*.b every 2147483647"],
    "shorten": ["yes", "no", "on", "off", "true", "false"],
}
WRONG = {
    "region": ["", "nowhere", "container nowhere", "box2", "1", "*"],
    "rigid": ["", "motion", "motion point", "nofix solid", "motion cube", "gravity point"],
    "law": [
        "",
        "elastic",
        "Gluey",
        "inelastic 1",
        "gluey limit",
        "gluey 0.5",
        *(f"gluey limit {value}" for value in ("0", "-1", "nan", "inf", "1e999", "x", "1 2")),
        *(f"restitution {value}" for value in ("", "1.1", "-0.1", "nan", "x", "0.5 0.5", "0,5")),
        "gluey law restitution 0.5",
    ],
    "solver": ["", "newton", "APGD", "apgd2", "0"],
    "accuracy": ["", "0", "-1", "1.0001", "nan", "inf", "loose"],
    "maxiter": ["", "warn", "10 warning", "10 10", *NO_COUNT],
    "frozen": ["", "nobody", "1", "still still"],
    "record": [
        "",
        "a*.npz",
        "a.npz every 1",
        "a*.npz often 1",
        "a*.npz every",
        "nowhere/a*.npz every 1",
        "every 1",
        *(f"a*.npz every {count}" for count in NO_COUNT),
    ],
    "shorten": ["", "maybe", "2", "yes no", "nan"],
    "colour": ["", "red"],
    "1e-5": [""],
}
LENGTHS = ["1e-5", "2.5E-4", "+1e-3", "1e-02", ".001", "1e-3"]


def options(table: dict[str, list[str]]) -> st.SearchStrategy[str]:
    return st.sampled_from(
        [f"{word} {value}" for word, values in table.items() for value in values]
    )


@FUZZED
@given(
    tolerance=st.sampled_from(LENGTHS),
    chosen=st.lists(options(RIGHT), max_size=5, unique_by=lambda option: option.split()[0]),
)
def test_right_arguments_in_any_order(tolerance: str, chosen: list[str], server: Server) -> None:
    commands = [f"fix contact all inelastic {tolerance} {' '.join(chosen)}"]
    assert_runs(server.ask(commands), commands)


@pytest.mark.slow
@FUZZED
@given(
    tolerance=st.sampled_from(LENGTHS),
    chosen=st.lists(options(RIGHT), max_size=4),
    wrong=options(WRONG),
    at=st.integers(0, 4),
)
def test_one_wrong_option(
    tolerance: str, chosen: list[str], wrong: str, at: int, server: Server
) -> None:
    # A value that is missing would be taken from the option after it.
    after = [] if wrong.endswith(" ") or wrong.startswith(("region", "rigid")) else chosen[at:]
    line = " ".join([*chosen[:at], wrong, *after])
    assert_one_clear_error(server.ask([f"fix contact all inelastic {tolerance} {line}"])["error"])


@pytest.mark.parametrize("tolerance", NO_LENGTH)
def test_a_wrong_tolerance(tolerance: str, server: Server) -> None:
    for commands in (
        [f"fix contact all inelastic {tolerance} region container"],
        ["fix contact all inelastic 1e-5", f"fix_modify contact tolerance {tolerance}"],
    ):
        assert_one_clear_error(server.ask(commands)["error"])


@pytest.mark.slow
@FUZZED
@given(
    words=st.lists(
        st.sampled_from([*RIGHT, *WRONG, *NO_LENGTH, *NO_COUNT, *LENGTHS, "warn", "every", "point"])
        # Not beyond ASCII: LAMMPS's own messages quote half of such a letter.
        | st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1)
        .filter(lambda word: not set(word) & set("\"'#$&"))
        .map(lambda word: word[:50]),
        max_size=8,
    )
)
def test_any_words(words: list[str], server: Server) -> None:
    commands = [f"fix contact all inelastic {' '.join(words)}"]
    answer = server.ask(commands)
    if answer["error"]:
        assert_one_clear_error(answer["error"])
    else:
        assert_runs(answer, commands)


ACCELERATIONS = ["0", "1", "2.5e0", ".5"]
NO_ACCELERATION = ["-1", "nan", "inf", "1e999", "x", "1,5", "--1", "v_x", "NULL", "*"]
SEEDS = ["0", "1", "2147483647"]
NO_SEED = ["-1", "2147483648", "1.5", "1e3", "x", "nan", "99999999999999999999", "v_x", "*"]


@FUZZED
@given(
    acceleration=st.sampled_from(ACCELERATIONS + NO_ACCELERATION),
    seed=st.sampled_from(["", *SEEDS, *NO_SEED]),
    more=st.sampled_from(["", "6", "x"]),
)
def test_random_force(acceleration: str, seed: str, more: str, server: Server) -> None:
    right = acceleration in ACCELERATIONS and seed in SEEDS and not more
    commands = [
        f"fix shake moving random/force {acceleration} {seed} {more if seed else ''}",
        "fix contact all inelastic 1e-4",
    ]
    answer = server.ask(commands)
    if right:
        assert_runs(answer, commands)
    else:
        assert_one_clear_error(answer["error"])
