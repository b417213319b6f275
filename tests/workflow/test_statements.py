"""Statements of the documentation about stored results, computed again from their files alone.

Nothing of the report is used: numbers are read with h5py, and every mean and error is made here.
"""

from __future__ import annotations

import json
import math
import re
import statistics
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.stats import ttest_1samp

from tests.workflow.test_links import ROOT, documents

RESULTS = ROOT / "results"
# What the deck has where a result does not tell another value.
FORCE, STEP = 30.0, 0.01


def said() -> str:
    """Return the text of all documents but the changelog, each line break a space."""
    pages = (path for path in documents() if path.name != "CHANGELOG.md")
    return " ".join(" ".join((ROOT / path).read_text().split()) for path in pages)


def read(study: str) -> list[dict[str, Any]]:
    """Return of each result of a study its variables, its numbers and the contacts' shares."""
    found = []
    for path in sorted((RESULTS / study).glob("*.h5")):
        with h5py.File(path) as file:
            record = json.loads(file.attrs["record"])
            row = {"deck": record["deck"]}
            for stage in record["stages"][::-1]:
                row |= stage["variables"]
            row |= {name: float(value[()]) for name, value in file["numbers"].items()}
            if "distribution/contacts" in file:
                row["shares"] = file["distribution/contacts"][()]
            found.append(row)
    assert found
    return found


def standard_error(values: Any) -> float:
    return float(np.std(values, ddof=1)) / math.sqrt(len(values))


def mean_and_error(values: Any, digits: int = 2) -> str:
    return f"{np.mean(values):.{digits}f} ± {standard_error(values):.{digits}f}"


def of_one_seed_each(rows: list[dict[str, Any]], count: int) -> list[dict[str, Any]]:
    """Return the rows, of which each is a run of its own."""
    assert len({row["seed"] for row in rows}) == len(rows) == count
    return rows


def test_the_packing_depends_on_the_random_force() -> None:
    """By more than three standard errors, which is no chance in one comparison (Gauss: 0.3 %)."""
    pairs: dict[int, dict[float, dict[str, Any]]] = {}
    for row in read("more-seeds"):
        if float(row["tolerance"]) != 0.0005:
            continue
        pairs.setdefault(int(row["seed"]), {})[float(row["random_force"])] = row
    assert len(pairs) == 36
    apart = {
        name: [pair[FORCE][name] - pair[0.0][name] for pair in pairs.values()]
        for name in ("packing_fraction", "coordination_number")
    }
    more = 100 * np.array(apart["packing_fraction"])
    assert np.mean(more) > 3 * standard_error(more)
    assert f"denser by {mean_and_error(more)} percentage points" in said()
    p = ttest_1samp(more, 0.0).pvalue
    assert f"the same start, p = {p:.3f})" in said()
    assert f"It has {mean_and_error(apart['coordination_number'], 3)} more contacts" in said()


def test_how_many_runs_reach_a_plateau() -> None:
    """From some frame on all are within 0.1 % of the mean of the last quarter of the frames."""
    times: dict[float, list[float]] = {0.0: [], FORCE: []}
    for path in sorted((RESULTS / "more-seeds").glob("*.h5")):
        with h5py.File(path) as file:
            variables = json.loads(file.attrs["record"])["stages"][0]["variables"]
            if float(variables["tolerance"]) != 0.0005:
                continue
            force = variables["random_force"]
            phi = file["evolution/packing_fraction"][()]
            time = file["evolution/time"][()]
        last = np.mean(phi[-max(1, len(phi) // 4) :])
        outside = np.flatnonzero(~(np.abs(phi / last - 1) <= 0.001))
        first = outside[-1] + 1 if len(outside) else 0
        times[float(force)].append(time[first] if first < len(phi) else math.inf)
    reached = {force: int(np.isfinite(values).sum()) for force, values in times.items()}
    middle = {force: statistics.median(values) for force, values in times.items()}
    assert (
        f"{reached[FORCE]} of 36 runs reach a plateau of the packing fraction, after a median of "
        f"{middle[FORCE]:.2f} units of time; without it {reached[0.0]} of 36 do, and the median is "
        f"{middle[0.0]:.2f}."
    ) in said()


def drops_while_agitated() -> dict[tuple[float, float], list[float]]:
    """Return how many contacts fewer there are than at rest, by random force and time step."""
    drops: dict[tuple[float, float], list[float]] = {}
    for row in read("protocol"):
        if float(row["drag"]) == 0.5:
            drop = row["coordination_number"] - row["coordination_number_agitated"]
            drops.setdefault((float(row["random_force"]), float(row["dt"])), []).append(drop)
    assert {len(values) for values in drops.values()} == {9}
    return drops


def test_contacts_while_agitated_depend_on_force_and_time_step() -> None:
    drops = drops_while_agitated()
    text = said()

    def these(*keys: tuple[float, float]) -> str:
        *first, last = (mean_and_error(drops[key]) for key in keys)
        return f"{', '.join(first)} and {last}"

    by_force = these((10, STEP), (FORCE, STEP), (100, STEP))
    assert f"fewer by {by_force} for forces of 10, 30 and 100" in text
    by_step = these((FORCE, STEP / 2), (FORCE, STEP), (FORCE, 2 * STEP))
    assert f"for 30 by {by_step} with steps of 0.005, 0.01 and 0.02" in text
    # The square of the force times the step is the same.
    alike = these((42.4, STEP / 2), (FORCE, STEP), (21.2, 2 * STEP))
    assert f"the difference is {alike} in these steps" in text


@pytest.mark.slow
def test_contacts_at_a_loose_tolerance_depend_on_the_count() -> None:
    found: dict[tuple[Any, ...], list[float]] = {}
    own: dict[float, list[float]] = {}
    for row in read("counting"):
        if float(row["tolerance"]) < 0.005:
            assert row["tolerance_measuring"] == row["tolerance"]
            own.setdefault(float(row["tolerance"]), []).append(row["coordination_number"])
            continue
        steps = tuple(float(row[name]) for name in ("dt", "dt_resting", "dt_measuring"))
        key = (row["solver"], float(row["tolerance_measuring"]), steps)
        found.setdefault(key, []).append(row["coordination_number"])
    assert {len(values) for values in found.values()} == {9}
    text = said()
    of_table = {
        solver: [
            row["coordination_number"]
            for row in read("table-1")
            if (float(row["tolerance"]), row["solver"]) == (0.005, solver)
        ]
        for solver in ("apgd", "uzawa")
    }
    assert f"ours are {mean_and_error(of_table['apgd'])}, and" in text
    assert f"Uzawa, {mean_and_error(of_table['uzawa'])}." in text
    tight = found["apgd", 1e-5, (0.01, 0.02, 0.1)]
    assert f"counted at 0.00001 r they have {mean_and_error(tight)}." in text
    same = [mean_and_error(found["apgd", 0.005, (h, h, h)]) for h in (0.005, 0.01, 0.02)]
    assert f"from start to end it is {same[0]}, {same[1]} and {same[2]} (steps" in text
    assert {len(values) for values in own.values()} == {9}
    assert (
        f"tolerance have {mean_and_error(of_table['apgd'])} at 0.005 r, "
        f"{mean_and_error(own[5e-4])} at 0.0005 r and {mean_and_error(own[5e-5])} at 0.00005 r"
    ) in text
    usual = [
        np.mean([r["coordination_number"] for r in rows])
        for rows in (
            [r for r in read("table-1") if float(r["tolerance"]) == tolerance and r["random_force"]]
            for tolerance in (5e-4, 5e-5)
        )
    ]
    assert {f"{z:.2f}" for z in (np.mean(tight), *usual)} == {"6.00", "6.01"}
    assert "where all three have 6.00 or 6.01" in text


def test_how_much_single_frames_scatter_at_rest() -> None:
    """Of the 20 frames of the phase of rest, in the mean over four runs."""
    scatter = []
    for path in sorted((RESULTS / "table-2").glob("spheres_particles=10000_*.h5")):
        with h5py.File(path) as file:
            steps = file["evolution/step"][()]
            z = file["evolution/coordination_number"][()][(steps > 600) & (steps <= 800)]
        assert len(z) == 20
        scatter.append(np.std(z, ddof=1) / np.mean(z))
    assert len(scatter) == 4
    assert f"varies by {100 * np.mean(scatter):.2f} % from frame to frame" in said()


def reference(name: str, digits: int) -> tuple[str, str]:
    """Return a number of the reference packings, of spheres and of dimers of L/d = 1.5."""
    rows = read("reference")
    spheres = [row for row in rows if row["deck"] == "spheres"]
    dimers = [row for row in rows if float(row.get("aspect_ratio", 0)) == 1.5]
    of_spheres, of_dimers = (
        mean_and_error([row[name] for row in of_one_seed_each(kind, 4)], digits)
        for kind in (spheres, dimers)
    )
    return of_spheres, of_dimers


def test_contacts_of_the_box_and_of_the_whole_packing() -> None:
    spheres, dimers = reference("coordination_number", 3)
    assert f"The box has {spheres} contacts a sphere" in said()
    assert f"and {dimers} a dimer of L/d = 1.5" in said()
    spheres, dimers = reference("excess_contacts", 2)
    assert f"and {spheres} more for each 1,000 of them (dimers {dimers})" in said()


def test_contacts_by_layers() -> None:
    """Of the floor, and of the last layer with half as many particles as the middle one."""
    ends: dict[str, list[tuple[float, float]]] = {"spheres": [], "1.5": []}
    for path in sorted((RESULTS / "reference").glob("*.h5")):
        with h5py.File(path) as file:
            variables = json.loads(file.attrs["record"])["stages"][0]["variables"]
            name = str(variables.get("aspect_ratio", "spheres"))
            if name not in ends:
                continue
            z = file["layers/coordination_number"][()]
            particles = file["layers/particles"][()]
        full = np.flatnonzero(particles >= particles[len(particles) // 2] / 2)
        ends[name].append((z[0], z[full[-1]]))
    floor, top = np.mean(ends["spheres"], axis=0)
    low, high = np.mean(ends["1.5"], axis=0)
    assert (
        f"the layer at the floor has {floor:.1f} contacts with other spheres and the last full one "
        f"below the free surface {top:.1f}, dimers {low:.1f} and {high:.1f}"
    ) in said()


def test_reference_exponents() -> None:
    spheres, dimers = reference("gap_exponent", 3)
    assert f"exponent is {spheres}, and {dimers} for dimers of L/d = 1.5" in said()


def exponent_of_weak_forces(low: float, high: float) -> list[str]:
    """Return that of spheres and of dimers of L/d = 1.5, between two bounds of the stored bins.

    A density x^(s - 1) has the share (b^s - a^s) / s in a bin from a to b: the likeliest s of many.
    """
    exponents = np.arange(-1.0, 1.0, 0.0005) + 1.00025
    found: dict[str, list[float]] = {"spheres": [], "1.5": []}
    for path in sorted((RESULTS / "reference").glob("*.h5")):
        with h5py.File(path) as file:
            variables = json.loads(file.attrs["record"])["stages"][0]["variables"]
            name = str(variables.get("aspect_ratio", "spheres"))
            middles, density = file["forces/local_ratio"][()], file["forces/local_density"][()]
        if name not in found:
            continue
        half = math.sqrt(middles[1] / middles[0])
        inside = (middles > low) & (middles < high)
        edges = np.append(middles[inside] / half, middles[inside][-1] * half)
        parts = np.diff(edges[:, None] ** exponents, axis=0)
        likely = (density[inside] * np.diff(edges)) @ np.log(parts / parts.sum(axis=0))
        found[name].append(exponents[np.argmax(likely)] - 1)
    assert all(len(values) == 4 for values in found.values())
    digits = 3 if low > 0.01 else 2
    return [mean_and_error(values, digits) for values in found.values()]


def test_weak_forces_are_no_single_power() -> None:
    spheres, dimers = exponent_of_weak_forces(0.018, 0.3)
    assert f"its exponent is {spheres}, for dimers {dimers};" in said()
    spheres, dimers = exponent_of_weak_forces(0.001, 0.018)
    assert f"it is {spheres} and {dimers}:" in said()


def test_nobody_has_0_or_1_contacts_in_the_measuring_box() -> None:
    """The shares are those of the box: of the other spheres the files tell nothing."""
    runs = of_one_seed_each([row for row in read("dimers") if row["deck"] == "spheres"], 4)
    for row in runs:
        assert row["particles_in_box"] < 0.2 * row["particles"]
        assert not np.pad(row["shares"], (0, 13))[[0, 1, 11, 12]].any()
    assert "No sphere in the measuring box has 0, 1, 11 or 12 contacts" in said()


def test_how_dimers_lie() -> None:
    """Beside the paper's numbers over what its own centre distance, of L/d = 1.8, would give."""
    found: dict[tuple[str, float], list[list[float]]] = {}
    errors = []
    for row in read("dimers-agitation"):
        ratios = [row[f"a_{axis}"] / row["a_isotropic"] for axis in "xyz"]
        found.setdefault((row["start"], float(row["random_force"])), []).append(ratios)
        errors += [row[f"a_{axis}_error"] / row["a_isotropic"] / 2 for axis in "xyz"]
    text = said()

    def components(start: str, force: float) -> str:
        assert len(found[start, force]) == 4
        x, y, z = np.mean(found[start, force], axis=0)
        return f"{x:.3f}, {y:.3f} and {z:.3f}"

    assert f"y (gravity) and z of {components('random', FORCE)} times" in text
    # Of the mean of four runs of so few dimers in the box.
    assert f"{np.mean(errors):.2f}" == "0.02"
    assert "each ± 0.02; the" in text
    assert f"A force of 200 leaves {components('random', 200)}:" in text
    assert f"make them forget it ({components('regular', FORCE)});" in text
    assert f"without any force they do not ({components('regular', 0)})." in text


def densest(rows: list[dict[str, Any]], name: str) -> str:
    """Return the aspect ratio of the densest dimers of some runs, from L/d = 1.2 to 1.6.

    It is the top of a cubic through the means. One run scatters by what all of them, with three or
    more values at an aspect ratio, do; the error follows by moving each mean by a little.
    """
    groups: dict[float, list[float]] = {}
    for row in rows:
        if 1.2 <= float(row["aspect_ratio"]) <= 1.6:
            groups.setdefault(float(row["aspect_ratio"]), []).append(100 * row[name])
    x = np.array(sorted(groups))
    assert len(x) >= 5
    means = np.array([np.mean(groups[at]) for at in x])
    counts = np.array([len(groups[at]) for at in x])

    def top(y: Any) -> float:
        slope = np.poly1d(np.polyfit(x - 1.4, y, 3, w=np.sqrt(counts))).deriv()
        (place,) = (r.real for r in slope.roots if slope.deriv()(r.real) < 0)
        return float(place) + 1.4

    errors = of_one_run(name) / np.sqrt(counts)
    moved = [(top(means + 1e-4 * unit) - top(means)) / 1e-4 for unit in np.eye(len(x))]
    return f"{top(means):.2f} ± {np.linalg.norm(np.array(moved) * errors):.2f}"


def of_one_run(name: str) -> float:
    """Return the standard deviation of a number of one run of 10,000 dimers, pooled."""
    groups: dict[tuple[float, float], list[float]] = {}
    for row in read("dimers"):
        if row["deck"] == "dimers":
            key = float(row["aspect_ratio"]), float(row["random_force"])
            groups.setdefault(key, []).append(100 * row[name])
        elif name in row:
            groups.setdefault((1.0, 0.0), []).append(100 * row[name])
    squares = sum(
        np.var(values, ddof=1) * (len(values) - 1) for values in groups.values() if values[1:]
    )
    return math.sqrt(squares / sum(len(values) - 1 for values in groups.values()))


def shaken_by(force: float) -> list[dict[str, Any]]:
    return [r for r in read("dimers") if r["deck"] == "dimers" and r["random_force"] == force]


@pytest.mark.slow
def test_where_dimers_are_densest() -> None:
    raw = [densest(shaken_by(force), "packing_fraction") for force in (FORCE, 200)]
    necks = [densest(shaken_by(force), "packing_fraction_with_necks") for force in (FORCE, 200)]
    hard, soft = (
        densest([r for r in read("dimers-soft") if r["contacts"] == contacts], "packing_fraction")
        for contacts in ("hard", "soft")
    )
    assert (
        f"Poured without any force they are densest at {hard} (hard contacts), and from the same "
        f"starts at {soft} with LAMMPS's soft ones."
    ) in said()
    assert (
        f"densest at L/d = {raw[0]} when a force of 30 has shaken them, and at {raw[1]} with a "
        f"force of 200; with the volume of the necks at {necks[0]} and {necks[1]}"
    ) in said()


def test_how_far_dimers_lie_down() -> None:
    a_y: dict[float, list[float]] = {}
    for row in shaken_by(FORCE):
        a_y.setdefault(float(row["aspect_ratio"]), []).append(row["a_y"] / row["a_isotropic"])
    at = {aspect: f"{np.mean(values):.2f}" for aspect, values in a_y.items()}
    assert f"falls from {at[1.2]} at L/d = 1.2 to {at[1.8]} at 1.8, and is {at[2.0]} at 2" in said()


def test_how_many_contacts_a_dimer_has() -> None:
    rows = [row for row in read("dimers") if row["deck"] == "dimers"]
    means: dict[tuple[float, float], list[float]] = {}
    for row in rows:
        key = float(row["aspect_ratio"]), float(row["random_force"])
        means.setdefault(key, []).append(row["coordination_number"])
    z = [np.mean(values) for values in means.values()]
    assert f"have {min(z):.2f} to {max(z):.2f} contacts" in said()


def test_the_angle_of_repose() -> None:
    """That of two beds, each in the mean over the tilts at which it has flowed.

    A bed between walls 1 apart with a plane surface of slope s and mean height H has its centre at
    x = 1/2 + s / (12 H) and y = H/2 + s^2 / (24 H).
    """
    left: dict[int, list[float]] = {}
    for path in sorted((RESULTS / "repose").glob("*.h5")):
        with h5py.File(path) as file:
            stages = json.loads(file.attrs["record"])["stages"]
            angle = float(stages[1]["variables"]["angle"])
            seed = int(stages[0]["variables"]["seed"])
            slopes = []
            for numbers in (file["numbers"], file["before/numbers"]):
                off, y = numbers["centre_x"][()] - 0.5, numbers["centre_y"][()]
                # With s = 12 H off the second one is y = H/2 + 6 H off^2.
                slopes.append(math.degrees(math.atan(12 * off * y / (0.5 + 6 * off**2))))
        if angle > 10:
            left.setdefault(seed, []).append(angle - (slopes[0] - slopes[1]))
    assert [len(values) for values in left.values()] == [2, 2]
    beds = [float(np.mean(values)) for values in left.values()]
    assert f"stays behind by {mean_and_error(beds, 1)} degrees (two beds)" in said()


def test_how_much_longer_uzawa_takes() -> None:
    """The table of states, both solvers from zero."""
    lines = (RESULTS / "README.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    ms = {
        (row[0], row[1]): float(row[3]) for row in cells if len(row) == 8 and row[1][:1].isdigit()
    }
    ratios = [
        f"{ms['uzawa from zero', at] / ms['sweeps from zero', at]:.0f}"
        for at in ("0.0005", "5e-05", "5e-06")
    ]
    assert f"takes {ratios[0]}, {ratios[1]} and {ratios[2]} times as long as `sweeps` at" in said()


# The pages of the fix


def page(name: str) -> str:
    return " ".join((ROOT / "docs" / name).read_text().split())


def test_what_is_said_of_velocities_is_said_with_the_accuracy() -> None:
    """tests/fix/test_slow_contacts.py measures it."""
    text = page("method/projection.md")
    assert "Nothing bounces: " not in text
    said = "a rigid contact of any speed separates with at most the part `accuracy`, a thousandth,"
    assert said in text


def test_the_number_of_contacts_shows_no_trend_with_the_time_step() -> None:
    """The page's own table, at each tolerance; rows of two time steps are independent."""
    lines = (ROOT / "docs/measured/contacts.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    number = re.compile(r"([\d.]+) ± [\d.]+ \(([\d.]+)\)")
    found: dict[str, list[tuple[float, float]]] = {}
    for row in cells:
        # Of our own solver: apgd, or sweeps in a table of today's.
        if len(row) == 6 and row[0] != "uzawa" and (z := number.fullmatch(row[5])) is not None:
            found.setdefault(row[2], []).append((float(z[1]), float(z[2])))
    assert len(found) == 3
    for at_steps in found.values():
        assert len(at_steps) == 3
        low, high = min(at_steps), max(at_steps)
        assert high[0] - low[0] <= 2 * math.hypot(low[1], high[1])
    assert "z shows no trend with h." in page("measured/contacts.md")


def test_newton_off_is_not_said_to_need_nothing() -> None:
    """What the fix does for it stands with it; tests/fix/test_scene_changes.py runs it."""
    text = page("reference/fix-inelastic.md")
    assert "and any `newton`." not in text
    assert "LAMMPS then sizes its messages for the pair style alone" in text
