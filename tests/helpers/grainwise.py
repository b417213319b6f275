"""Compares each grain's velocity in recorded problems with that of the exact solution.

A record holds the problem of a step and the velocities and impulses with which the fix ended it.
Here the same problem is solved far deeper; the residual of that solution, and what it bounds, are
computed by NumPy from the arrays of the record, without the code that solved it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from lammps_inelastic import core
from lammps_inelastic.workflow.tradeoff.states import records_in

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

GRAVITY = 9.81
# What is promised: a grain's velocity is off by no more than the larger of QUIET g h and ACCURACY
# times its contacts' impulses over its mass, for all grains of a step but one in a thousand, and
# for those by no more than MOST times that.
QUIET = 0.02
ACCURACY = 1e-3
MOST = 5.0
FEW = 1e-3
# A solution is exact where no velocity can be off by more than this part of what is promised.
PART = 0.2
# Residuals [g h^2] to which it is solved: the second where the first leaves too much.
EXACT = 1e-10
FURTHER = 1e-12
# What some problems need at most. Others, whose grains some contacts hold hardly at all, need
# millions: where the velocities of these are not exact by then, Clarabel is asked.
MOST_ITERATIONS = 100_000
# Bounds of the bins in which ratios are printed.
BINS = (0.0, 1e-3, 1e-2, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0, np.inf)


@dataclass(frozen=True)
class Grains:
    """The grains of a problem: free spheres and bodies that can move.

    Attributes
    ----------
    of_particle : index of each particle's grain; -1 for one that cannot move, (n,)
    mass : mass, (g,)
    share : each particle's part of the mass of its grain, (n,)
    """

    of_particle: Indices
    mass: Floats
    share: Floats

    def centre(self, velocity: Floats) -> Floats:
        """Return the velocities of the centres of mass, (g, 3)."""
        moves = self.of_particle >= 0
        weighted = (self.share[:, None] * velocity)[moves]
        found = np.zeros((self.mass.size, 3))
        np.add.at(found, self.of_particle[moves], weighted)
        return found

    def largest_of_members(self, values: Floats) -> Floats:
        """Return the largest of the values (n,) of each grain's spheres, (g,)."""
        moves = self.of_particle >= 0
        found = np.zeros(self.mass.size)
        np.maximum.at(found, self.of_particle[moves], values[moves])
        return found


def grains_of(record: core.Record) -> Grains:
    """Return the grains of a problem."""
    problem = record.problem
    free = problem.inverse_mass > 0
    of_particle = np.full(free.size, -1, np.int64)
    mass = 1 / np.where(free, problem.inverse_mass, 1.0)
    if problem.bodies is None:
        of_particle[free] = np.arange(free.sum())
        return Grains(of_particle, mass[free], free.astype(float))
    body, inverse = problem.bodies.body, problem.bodies.inverse_mass
    in_body = body >= 0
    moving = np.flatnonzero(inverse > 0)
    number = np.full(inverse.size, -1, np.int64)
    number[moving] = np.arange(moving.size)
    of_particle[in_body] = number[body[in_body]]
    alone = free & ~in_body
    of_particle[alone] = moving.size + np.arange(alone.sum())
    masses = np.concatenate([1 / inverse[moving], mass[alone]])
    share = np.zeros(free.size)
    moves = of_particle >= 0
    share[moves] = record.arrays["mass"][moves] / masses[of_particle[moves]]
    return Grains(of_particle, masses, share)


def velocity_of(problem: core.Problem, impulse: Floats) -> Floats:
    """Return V* + M^-1 G^T lambda, in plain NumPy."""
    push = np.zeros_like(problem.predicted_velocity)
    pairs = problem.second >= 0
    along = impulse[:, None] * problem.normal
    np.add.at(push, problem.first, along)
    np.add.at(push, problem.second[pairs], -along[pairs])
    change = push * problem.inverse_mass[:, None]
    if problem.bodies is not None:
        bodies = problem.bodies
        inside = bodies.body >= 0
        arm, number = bodies.arm[inside], bodies.body[inside]
        force = np.zeros((bodies.inverse_mass.size, 3))
        torque = np.zeros_like(force)
        np.add.at(force, number, push[inside])
        np.add.at(torque, number, np.cross(arm, push[inside]))
        slide = bodies.inverse_mass[:, None] * force
        turn = np.einsum("bij,bj->bi", bodies.inverse_inertia, torque)
        change[inside] = slide[number] + np.cross(turn[number], arm)
    return problem.predicted_velocity + change


def gap_at_end(problem: core.Problem, velocity: Floats, impulse: Floats) -> Floats:
    """Return w = gap + h G V + C lambda of each constraint, in plain NumPy."""
    second = np.where(problem.second[:, None] >= 0, velocity[problem.second], 0.0)
    approach = np.einsum("ij,ij->i", problem.normal, velocity[problem.first] - second)
    return problem.gap + problem.timestep * approach + problem.compliance * impulse


@dataclass(frozen=True)
class Exact:
    """A deep solution of a problem.

    Attributes
    ----------
    velocity : (n, 3)
    impulse : (m,)
    iterations : that it took
    residual : largest overlap, and largest gap under an impulse, as NumPy finds them, length
    bound : by how much the velocity of the centre of the lightest grain can be off at most

    The bound: with the exact solution lambda', w' = w(lambda'),

    h |V - V'|^2_M  <=  (lambda - lambda') . (w - w')
                    <=  (lambda - l) . max(w, 0) + (lambda' - l) . max(-w, 0)

    as lambda, lambda' >= l, w' >= 0 and (lambda' - l) . w' = 0. In the last product lambda' - l,
    which is not known, is taken to be at most twice lambda - l, or the mean of the scene where that
    is more.
    """

    velocity: Floats
    impulse: Floats
    iterations: int
    residual: float
    bound: float


def solve(record: core.Record, gravity: float = GRAVITY) -> Exact:
    """Solve a problem until its velocities are off by at most PART of what is promised.

    Where the package's solver does not get there, Clarabel's impulses are tried, and what the
    solver makes of them. Returns what is exact by its bound; if nothing is, what has the least.
    """
    unit = gravity * record.problem.timestep
    length = unit * record.problem.timestep

    def enough(found: Exact) -> bool:
        return found.bound <= PART * QUIET * unit

    found = [_solve(record, EXACT * length, record.arrays["impulse"])]
    if not enough(found[-1]) and found[-1].residual <= 1.01 * EXACT * length:
        found.append(_solve(record, FURTHER * length, found[-1].impulse))
    if not any(map(enough, found)):
        found.append(judged(record, clarabel_impulses(record, gravity), 0))
        found.append(_solve(record, EXACT * length, found[-1].impulse))
        found.append(_solve(record, FURTHER * length, found[-1].impulse))
    best = min(found, key=lambda one: (not enough(one), one.bound))
    return replace(best, iterations=sum(one.iterations for one in found))


def _solve(record: core.Record, tolerance: float, impulse: Floats) -> Exact:
    found = core.project(
        replace(record.problem, impulse_guess=impulse),
        core.Limits(tolerance, max_iterations=MOST_ITERATIONS),
    )
    return judged(record, found.impulse, found.iterations)


def jacobian(problem: core.Problem) -> sparse.csr_matrix:
    """Return G (m, 3 n): (G V)_c = n_c . (v_first - v_second)."""
    normal = problem.normal
    pairs = problem.second >= 0
    axes, contacts = np.arange(3), np.arange(len(problem.first))
    rows = np.concatenate([np.repeat(contacts, 3), np.repeat(contacts[pairs], 3)])
    columns = [
        (3 * ends[:, None] + axes).ravel() for ends in (problem.first, problem.second[pairs])
    ]
    values = np.concatenate([normal.ravel(), -normal[pairs].ravel()])
    shape = len(problem.first), 3 * len(problem.inverse_mass)
    return sparse.csr_matrix((values, (rows, np.concatenate(columns))), shape=shape)


def root(problem: core.Problem) -> sparse.csr_matrix:
    """Return R with M^-1 = R R^T: V = R y for coordinates y of unit mass.

    Those of free spheres are their velocities times the root of the mass; those of a body are its
    velocity and its angular velocities about the axes of inertia, so scaled.
    """
    inverse_mass, bodies = problem.inverse_mass, problem.bodies
    number = len(inverse_mass)
    body = np.full(number, -1) if bodies is None else bodies.body
    free = np.flatnonzero((body < 0) & (inverse_mass > 0))
    rows = [(3 * free[:, None] + np.arange(3)).ravel()]
    columns = [np.arange(3 * free.size)]
    values = [np.repeat(np.sqrt(inverse_mass[free]), 3)]
    width = 3 * free.size
    if bodies is not None:
        inside = np.flatnonzero(body >= 0)
        of, arm = body[inside], bodies.arm[inside]
        inverse_moments, axes = np.linalg.eigh(bodies.inverse_inertia)
        # Point masses on a line do not turn about it.
        inverse_moments[inverse_moments < 1e-9 * inverse_moments[:, -1:]] = 0
        motions = [np.sqrt(bodies.inverse_mass)[of, None] * one for one in np.eye(3)]
        for k in range(3):
            turns = axes[:, :, k] * np.sqrt(inverse_moments[:, k : k + 1])
            motions.append(np.cross(turns[of], arm))
        for k, motion in enumerate(motions):
            rows.append((3 * inside[:, None] + np.arange(3)).ravel())
            columns.append(np.repeat(width + 6 * of + k, 3))
            values.append(motion.ravel())
        width += 6 * len(bodies.inverse_mass)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_matrix(entries, shape=(3 * number, width))


def clarabel_impulses(record: core.Record, gravity: float = GRAVITY) -> Floats:
    """Return impulses by Clarabel, an interior-point method that shares nothing with the fix.

    minimise 1/2 (y . y + s . s) - l . (G R y + (C / h)^1/2 s)
    subject to (gap / h + G V*) + G R y + (C / h)^1/2 s >= 0

    in units of g h, g h^2 and the median mass; the dual variables are lambda - l.
    """
    problem = record.problem
    h = problem.timestep
    unit, mass = gravity * h, float(np.median(record.arrays["mass"]))
    constraints = jacobian(problem)
    gap = problem.gap + h * (constraints @ problem.predicted_velocity.ravel())
    soft = problem.compliance * mass / h
    springs = np.flatnonzero(soft > 0)
    columns = np.arange(springs.size)
    roots = sparse.csr_matrix(
        (np.sqrt(soft[springs]), (springs, columns)), shape=(gap.size, springs.size)
    )
    moves = sparse.hstack([np.sqrt(mass) * (constraints @ root(problem)), roots]).tocsc()
    least = problem.least_impulse / (mass * unit)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    # Out of reach, so that it goes as far as round-off lets it; the impulses are judged later.
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-15
    solution = clarabel.DefaultSolver(
        sparse.identity(moves.shape[1], format="csc"),
        -(moves.T @ least),
        sparse.csc_matrix(-moves),
        gap / (unit * h),
        [clarabel.NonnegativeConeT(gap.size)],
        settings,
    ).solve()
    return mass * unit * (np.maximum(np.array(solution.z), 0.0) + least)


def judged(record: core.Record, impulse: Floats, iterations: int) -> Exact:
    """Judge impulses by NumPy alone."""
    problem = record.problem
    least = problem.least_impulse
    if np.any(impulse < least):
        raise ValueError("an impulse is below its least one")
    velocity = velocity_of(problem, impulse)
    w = gap_at_end(problem, velocity, impulse)
    above = impulse - least
    residual = max(-w.min(initial=0.0), w[above > 0].max(initial=0.0))
    pushing = above[above > 0]
    others = np.maximum(2 * above, pushing.mean() if pushing.size else 0.0)
    product = above @ np.maximum(w, 0.0) + others @ np.maximum(-w, 0.0)
    lightest = grains_of(record).mass.min()
    bound = float(np.sqrt(product / (problem.timestep * lightest)))
    return Exact(velocity, impulse, iterations, float(residual), bound)


@dataclass(frozen=True)
class Compared:
    """The grains of one recorded step against the exact solution.

    Attributes
    ----------
    step, timestep, iterations : of the record
    bodies : number of grains that are bodies
    unit : g h
    error : of the velocities of the centres of mass [g h], (g,)
    member_error : the largest of the spheres of each grain [g h], (g,)
    allowed : what is promised for each grain [g h], (g,)
    exact : the exact solution
    residual : of the fix's impulses, by NumPy [g h^2]
    """

    step: int
    timestep: float
    iterations: int
    bodies: int
    unit: float
    error: Floats
    member_error: Floats
    allowed: Floats
    exact: Exact
    residual: float

    @property
    def ratio(self) -> Floats:
        """Error over what is promised; of a body the largest of its centre and its spheres."""
        return np.maximum(self.error, self.member_error) / self.allowed

    @property
    def most_of_nearly_all(self) -> float:
        """The ratio that all grains keep but one in a thousand."""
        return largest_but(self.ratio, FEW)

    @property
    def kept(self) -> bool:
        """Whether the step keeps the promise."""
        return self.most_of_nearly_all <= 1 and float(self.ratio.max(initial=0.0)) <= MOST


def largest_but(values: Floats, part: float) -> float:
    """Return the largest value when the part of the largest ones, rounded down, is left out."""
    if values.size == 0:
        return 0.0
    return float(np.sort(values)[-1 - int(part * values.size * (1 + 1e-12))])


def compare(
    record: core.Record,
    *,
    gravity: float = GRAVITY,
    nominal_timestep: float | None = None,
    exact: Exact | None = None,
) -> Compared:
    """Compare a record's velocities with the exact ones.

    Parameters
    ----------
    nominal_timestep : gives the unit g h; the record's own step by default
    exact : solution to compare with; found here by default
    """
    a, problem = record.arrays, record.problem
    h = problem.timestep
    unit = gravity * (nominal_timestep or h)
    exact = exact or solve(record, gravity)
    grains = grains_of(record)
    impulses = np.zeros(problem.inverse_mass.size)
    size = np.abs(exact.impulse)
    pairs = problem.second >= 0
    np.add.at(impulses, problem.first, size)
    np.add.at(impulses, problem.second[pairs], size[pairs])
    moves = grains.of_particle >= 0
    total = np.bincount(grains.of_particle[moves], impulses[moves], grains.mass.size)
    off = a["velocity"] - exact.velocity
    return Compared(
        step=record.step,
        timestep=h,
        iterations=int(a["iterations"]),
        bodies=0 if problem.bodies is None else int((problem.bodies.inverse_mass > 0).sum()),
        unit=unit,
        error=np.linalg.norm(grains.centre(off), axis=1) / unit,
        member_error=grains.largest_of_members(np.linalg.norm(off, axis=1)) / unit,
        allowed=np.maximum(QUIET, ACCURACY * total / grains.mass / unit),
        exact=exact,
        residual=judged(record, a["impulse"], 0).residual / (unit * h),
    )


def part_of(record: core.Record, chosen: NDArray[np.bool_]) -> core.Record:
    """Return the record of some of the spheres alone.

    Raises ValueError if one of their constraints, or bodies, is with another sphere.

    Parameters
    ----------
    chosen : which spheres, (n,)
    """
    a, problem = record.arrays, record.problem
    pairs = problem.second >= 0
    mine = chosen[problem.first]
    if np.any(mine[pairs] != chosen[problem.second[pairs]]):
        raise ValueError("the spheres have constraints with others")
    arrays: dict[str, NDArray[Any]] = {}
    contacts, spheres = len(problem.first), len(chosen)
    of_contacts = {"id1", "id2", "normal", "gap", "compliance", "gap_now", "wall_motion"}
    of_contacts |= {"impulse", "impulse_guess", "least_impulse"}
    bodies = np.zeros(0, bool)
    if "molecule" in a:
        inside, outside = (set(a["molecule"][which].tolist()) - {0} for which in (chosen, ~chosen))
        if inside & outside:
            raise ValueError("the spheres have bodies with others")
        bodies = np.isin(a["body_molecule"], list(inside))
    for name, values in a.items():
        if name.startswith("body_"):
            arrays[name] = values[bodies]
        elif name in of_contacts:
            assert len(values) == contacts
            arrays[name] = values[mine]
        elif values.ndim > 0:
            assert len(values) == spheres
            arrays[name] = values[chosen]
        else:
            arrays[name] = values
    if not bodies.any():
        for name in [name for name in arrays if name.startswith("body_")] + ["molecule", "arm"]:
            arrays.pop(name, None)
    return core.Record(arrays)


def compare_folder(folder: Path, after: int = 2, **options: Any) -> list[Compared]:
    """Compare the records of a folder whose steps are later than `after`, in their order."""
    records = (core.read_record(path) for path in records_in(folder))
    return [compare(one, **options) for one in records if one.step > after]


HEADING = (
    "   step        h  grains  iter   residual | centre: rms    99 %   99.9 %     max |"
    " spheres: 99.9 %   max | ratio 99.9 %     max |  exact: iter  residual   bound"
)


def line(one: Compared) -> str:
    """Return the figures of a step; residuals in g h^2, velocities in g h."""
    e, member = one.error, one.member_error
    rms = float(np.sqrt(np.mean(e**2))) if e.size else 0.0
    h2 = one.unit * one.timestep
    return (
        f"{one.step:7d} {one.timestep:8.4g} {e.size:7d} {one.iterations:5d} {one.residual:10.2e} | "
        f"{rms:11.4f} {largest_but(e, 0.01):7.4f} {largest_but(e, FEW):8.4f} {e.max():7.3f} | "
        f"{largest_but(member, FEW):15.4f} {member.max():5.3f} | "
        f"{one.most_of_nearly_all:12.3f} {one.ratio.max():7.3f} | "
        f"{one.exact.iterations:12d} {one.exact.residual / h2:9.1e} "
        f"{one.exact.bound / one.unit:7.1e} {'' if one.kept else ' NOT KEPT'}"
    )


def histogram(compared: Sequence[Compared]) -> str:
    """Return how many grains of all steps have which ratio."""
    ratios = np.concatenate([one.ratio for one in compared])
    counts = np.histogram(ratios, BINS)[0]
    lines = [
        f"  ratio {low:6g} to {high:6g}: {count:9d} grains, {100 * count / ratios.size:9.5f} %"
        for (low, high), count in zip(pairwise(BINS), counts, strict=True)
    ]
    return "\n".join(lines)


def summary(compared: Sequence[Compared]) -> str:
    """Return the worst of all steps."""
    kept = sum(one.kept for one in compared)
    nearly = max(compared, key=lambda one: one.most_of_nearly_all)
    worst = max(compared, key=lambda one: float(one.ratio.max()))
    rms = [float(np.sqrt(np.mean(one.error**2))) for one in compared]
    bound = max(one.exact.bound / one.unit for one in compared)
    return (
        f"{kept} of {len(compared)} steps keep the bound; ratio of 99.9 % of the grains at most "
        f"{nearly.most_of_nearly_all:.2f} (step {nearly.step}), of all {worst.ratio.max():.2f} "
        f"(step {worst.step}); rms error median {np.median(rms):.4f}, largest {max(rms):.4f} g h; "
        f"exact solutions are good to {bound:.1e} g h"
    )


def assert_kept(steps_of: Mapping[str, Sequence[Compared]]) -> None:
    """Print the figures of some scenes, by their names, and fail if a step breaks the promise."""
    for name, compared in steps_of.items():
        print(f"{name}: {summary(compared)}\n{histogram(compared)}")
    for name, compared in steps_of.items():
        # What is compared with is good to a quarter of the smallest error that is judged.
        assert max(one.exact.bound / one.unit for one in compared) <= 0.25 * QUIET
        broken = [one for one in compared if not one.kept]
        first = "\n".join(line(one) for one in broken[:20])
        assert not broken, (
            f"{name}: {len(broken)} of {len(compared)} steps do not keep it\n{HEADING}\n{first}"
        )
