"""The random numbers of ``fix random/force``, against the generator's published answers."""

from __future__ import annotations

import numpy as np
import pytest

from lammps_inelastic import core
from tests.helpers.contact_problems import Floats

WORD = 2**32

# Counter, key, answer: the lines "philox4x32 10" of Random123's tests/kat_vectors
# (github.com/DEShawResearch/random123, version 1.14).
KNOWN_ANSWERS = [
    (
        (0x00000000, 0x00000000, 0x00000000, 0x00000000),
        (0x00000000, 0x00000000),
        (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8),
    ),
    (
        (0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF),
        (0xFFFFFFFF, 0xFFFFFFFF),
        (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD),
    ),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


def philox(counter: tuple[int, ...], key: tuple[int, ...]) -> tuple[int, ...]:
    """Philox 4x32-10 from the definition in the paper (SC'11), in Python's integers."""
    left0, right0, left1, right1 = counter  # L0, R0, L1, R1 of two Feistel pairs, crossed over
    for turn in range(10):
        round_key0 = (key[0] + turn * 0x9E3779B9) % WORD  # golden ratio
        round_key1 = (key[1] + turn * 0xBB67AE85) % WORD  # sqrt(3) - 1
        high0, low0 = divmod(0xD2511F53 * left0, WORD)
        high1, low1 = divmod(0xCD9E8D57 * left1, WORD)
        left0, right0 = high1 ^ right0 ^ round_key0, low1
        left1, right1 = high0 ^ right1 ^ round_key1, low0
    return left0, right0, left1, right1


def expected_vector(seed: int, particle: int, step: int) -> tuple[float, ...]:
    counter = (particle % WORD, particle // WORD, step % WORD, step // WORD)
    words = philox(counter, (seed, 0))
    return tuple(2 * word / (WORD - 1) - 1 for word in words[:3])


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN_ANSWERS)
def test_this_file_knows_philox(
    counter: tuple[int, ...], key: tuple[int, ...], answer: tuple[int, ...]
) -> None:
    assert philox(counter, key) == answer


def test_known_answer_for_zeros() -> None:
    _, _, answer = KNOWN_ANSWERS[0]
    expected = [2 * word / (WORD - 1) - 1 for word in answer[:3]]
    # Two roundings of numbers up to 2.
    assert core.uniform_vector(0, 0, 0) == pytest.approx(expected, abs=5e-16)


@pytest.mark.parametrize(
    ("seed", "particle", "step"),
    [
        (1, 0, 0),
        (0, 1, 0),
        (0, 0, 1),
        (WORD - 1, 2**64 - 1, 2**64 - 1),
        (12345, 2**32, 2**32 + 1),
        (12345, 2**53 + 1, 2**31),
    ],
)
def test_seed_particle_and_step(seed: int, particle: int, step: int) -> None:
    # Two roundings of numbers up to 2.
    assert core.uniform_vector(seed, particle, step) == pytest.approx(
        expected_vector(seed, particle, step), abs=5e-16
    )


def test_many_seeds_particles_and_steps() -> None:
    generator = np.random.default_rng(0)
    for _ in range(300):
        seed = int(generator.integers(WORD))
        particle, step = (int(value) for value in generator.integers(2**63, size=2))
        assert core.uniform_vector(seed, particle, step) == pytest.approx(
            expected_vector(seed, particle, step), abs=5e-16
        )


@pytest.fixture(scope="module")
def sample() -> np.ndarray:
    """100 steps of 300 particles."""
    return np.array(
        [
            [core.uniform_vector(7, particle, step) for particle in range(1, 301)]
            for step in range(100)
        ]
    )


def test_bounds(sample: Floats) -> None:
    assert np.abs(sample).max() <= 1
    # 90,000 numbers come this near to both ends, but for a chance of e^-9 each.
    assert sample.max() > 1 - 2e-4
    assert sample.min() < -1 + 2e-4


def test_mean_and_variance(sample: Floats) -> None:
    count = sample[..., 0].size
    # Four standard deviations, of the mean of x (variance 1/3) and of x^2 (variance 4/45).
    assert np.abs(sample.mean(axis=(0, 1))).max() < 4 * np.sqrt(1 / 3 / count)
    assert np.abs((sample**2).mean(axis=(0, 1)) - 1 / 3).max() < 4 * np.sqrt(4 / 45 / count)


def test_components_particles_and_steps_are_independent(sample: Floats) -> None:
    # Four standard deviations of the mean of a product (variance 1/9) of independent numbers.
    def correlated(one: np.ndarray, other: np.ndarray) -> bool:
        return abs((one * other).mean()) > 4 * np.sqrt(1 / 9 / one.size)

    assert not correlated(sample[..., 0], sample[..., 1])
    assert not correlated(sample[..., 1], sample[..., 2])
    assert not correlated(sample[:, 1:], sample[:, :-1])
    assert not correlated(sample[1:], sample[:-1])


def test_no_two_alike(sample: Floats) -> None:
    vectors = sample.reshape(-1, 3)
    assert len(np.unique(vectors, axis=0)) == len(vectors)
    assert core.uniform_vector(7, 1, 0) != core.uniform_vector(8, 1, 0)


def test_numbers_out_of_range_are_refused() -> None:
    for wrong in [(-1, 0, 0), (WORD, 0, 0), (0, -1, 0), (0, 0, 2**64)]:
        with pytest.raises(TypeError):
            core.uniform_vector(*wrong)
