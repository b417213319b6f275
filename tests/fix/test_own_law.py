"""Contact laws that are not ours: the example of the page, and laws that show what they are told.

All are built as readers build them.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.plugin import include_folder
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_CONTACTS,
    DUMP_PARTICLES,
    FloatArray,
    Frame,
    mass,
    read_dump,
    scene,
)

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "laws.md"
RADIUS = 0.5

# `law witness sides` and `law witness sliding` remember what the contact was told to be in this
# step, `law witness begin` how it slid when it began, as its side 1 sees it; `unturned` is a
# mistake. `remember` is not told the contact: the law relies on being called for all contacts of a
# step in the order in which it was asked, as it is where no step is repeated.
WITNESS = """
#include "inelastic_contact_law_plugin.h"

#include <algorithm>
#include <deque>

using namespace inelastic;

class Witness final : public ContactLaw {
 public:
  explicit Witness(const std::vector<std::string> &words) :
      sides_(words[0] == "sides"), begin_(words[0] == "begin"), unturned_(words.size() > 1)
  {
  }

  int remembers() const override { return 4; }

  Demand ask(const ContactState &c, const double *) const override
  {
    const double last = begin_ ? 1.0 : c.predicted_speed;
    if (sides_)
      told_.push_back({c.radius[0], c.radius[1], double(c.type[0]), double(c.type[1])});
    else
      told_.push_back({c.sliding[0], c.sliding[1], c.sliding[2], last});
    return {};
  }

  bool remember(const Impulse &, double *remembered) const override
  {
    const bool begun = begin_ && remembered[3] != 0.0;
    if (!begun) std::copy(told_.front().begin(), told_.front().end(), remembered);
    told_.pop_front();
    return true;
  }

  void turn_round(double *remembered) const override
  {
    if (unturned_) return;
    for (int d = 0; d < 3; ++d) remembered[d] = -remembered[d];
  }

 private:
  const bool sides_, begin_, unturned_;
  mutable std::deque<std::array<double, 4>> told_;
};

std::unique_ptr<ContactLaw> make(const std::vector<std::string> &words, std::string &)
{ return std::make_unique<Witness>(words); }

INELASTIC_CONTACT_LAW("witness", &make)
"""
VALUES = ("first", "second", "third", "fourth")
DUMP_WITNESS = (
    DUMP_CONTACTS.replace(
        "f_contact[10]", " ".join(f"f_contact[{column}]" for column in range(10, 15))
    )
    + "dump_modify contacts "
    + " ".join(f"colname {column} {name}" for column, name in enumerate(VALUES, 11))
    + "\n"
)


def compile_law(source: str, plugin: Path) -> subprocess.CompletedProcess[str]:
    """Compile a law as the page says, with warnings."""
    compiler = shutil.which("g++")
    assert compiler is not None
    code = plugin.with_suffix(".cpp")
    code.write_text(source)
    command = [compiler, "-std=c++17", "-O1", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror"]
    command += ["-I", include_folder(), str(code), "-o", str(plugin)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def build(source: str, folder: Path) -> Path:
    """Compile a law that compiles; return its plugin."""
    plugin = folder / "own.so"
    done = compile_law(source, plugin)
    assert done.returncode == 0, done.stderr
    return plugin


@pytest.fixture(scope="module")
def witness(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the command that loads the law `witness`."""
    return f"plugin load {build(WITNESS, tmp_path_factory.mktemp('witness'))}"


def example() -> str:
    found = re.search(r"```cpp\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


def version_of_today() -> int:
    found = re.search(
        r"CONTACT_LAW_VERSION = (\d+);",
        (Path(include_folder()) / "inelastic_contact_law.h").read_text(),
    )
    assert found is not None
    return int(found[1])


def deck(folder: Path, law: str, speed: float) -> str:
    return scene(
        [[0.0, RADIUS + 0.1, 0.0]],
        RADIUS,
        folder,
        tolerance=1e-6,
        velocities=[[0.0, -speed, 0.0]],
        box=((-5.0, 5.0), (0.0, 5.0), (-5.0, 5.0)),
        timestep=0.01,
        gravity=False,
        options=f"region container law {law}",
        setup="plugin load ./own.so",
    )


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_example_of_the_page(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    build(example(), tmp_path)
    for speed, after in ((0.5, 0.4), (0.2, 0.0)):
        text = deck(tmp_path, "restitution/above 0.8 0.3", speed)
        lmp(text + DUMP_PARTICLES + "run 100\n", ranks=ranks)
        last = read_dump(tmp_path / "particles.dump")[-1]
        # Velocities are solved to a thousandth of what contacts change.
        assert last.velocities[0, 1] == pytest.approx(after, abs=2e-3 * speed)


def test_its_words_are_checked(tmp_path: Path, refused: Callable[..., str]) -> None:
    build(example(), tmp_path)
    line = refused(deck(tmp_path, "restitution/above 0.8", 1.0) + "run 1\n")
    assert "needs law restitution/above E V, with E from 0 to 1 and a speed V" in line
    line = refused(deck(tmp_path, "restitution/below 0.8", 1.0) + "run 1\n")
    assert "must be inelastic, gluey, restitution or restitution/above, not" in line


def test_the_name_of_another_law(tmp_path: Path, refused: Callable[..., str]) -> None:
    build(example().replace('LAW("restitution/above"', 'LAW("gluey"'), tmp_path)
    line = refused(deck(tmp_path, "gluey", 1.0) + "run 1\n")
    assert "a contact law of fix inelastic has the name gluey already" in line


@pytest.mark.parametrize("age", [1, 2])
def test_a_law_of_an_earlier_version(age: int, tmp_path: Path, refused: Callable[..., str]) -> None:
    version = version_of_today() - age
    assert version >= 0
    source = example().replace('#include "inelastic_contact_law_plugin.h"', "", 1)
    header = (Path(include_folder()) / "inelastic_contact_law_plugin.h").read_text()
    other = header.replace("inelastic::CONTACT_LAW_VERSION", str(version))
    build(other.replace("#pragma once", "") + source, tmp_path)
    line = refused(deck(tmp_path, "restitution/above 0.8 0.3", 1.0) + "run 1\n")
    assert f"was built for version {version} of contact laws, this is version" in line
    assert "build it again" in line


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (
            "bool remember(double, double *) const override { return true; }",
            "marked .override., but does not override",
        ),
        ("static double of(const Demand &asked) { return asked.least_impulse; }", "least_impulse"),
    ],
)
def test_a_source_for_version_1(line: str, told: str, tmp_path: Path) -> None:
    """What changed cannot go unseen."""
    source = example().replace(" private:\n", f"  {line}\n\n private:\n", 1)
    done = compile_law(source, tmp_path / "own.so")
    assert done.returncode != 0
    assert re.search(f"error: .*{told}", done.stderr)


# A contact that may pull, by next to nothing, and counts its steps in vain.
FORGETFUL = """
#include "inelastic_contact_law_plugin.h"

using namespace inelastic;

class Forgetful final : public ContactLaw {
 public:
  int remembers() const override { return 4; }
  Demand ask(const ContactState &, const double *) const override { return Demand::pulls(1e-9); }

  bool remember(const Impulse &, double *remembered) const override
  {
    remembered[0] += 1.0;
    return false;
  }
};

std::unique_ptr<ContactLaw> make(const std::vector<std::string> &, std::string &)
{ return std::make_unique<Forgetful>(); }

INELASTIC_CONTACT_LAW("forgetful", &make)
"""


def test_what_need_not_be_kept_begins_anew(tmp_path: Path, lmp: Runner) -> None:
    build(FORGETFUL, tmp_path)
    lmp(deck(tmp_path, "forgetful", 1.0) + DUMP_WITNESS + "run 20\nrun 20\n")
    counts = np.concatenate([f["first"] for f in read_dump(tmp_path / "contacts.dump")])
    assert len(counts) > 0
    assert (counts == 1.0).all()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{ return 4; }", "{ return 5; }", "remembers 5 values of a contact: 0 to 4 are allowed"),
        ("pulls(1e-9)", 'parts_with(std::nan(""))', "to part with the speed nan"),
        ("pulls(1e-9)", "parts_with(-1.0)", "to part with the speed -1"),
        ("pulls(1e-9)", "pulls(-0.5)", "to carry an impulse of at least 0.5"),
        ("pulls(1e-9)", 'pulls(-std::nan(""))', "of at least nan"),
    ],
)
def test_answers_that_no_law_may_give(
    old: str, new: str, said: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    assert FORGETFUL.count(old) == 1
    build("#include <cmath>\n" + FORGETFUL.replace(old, new), tmp_path)
    line = refused(deck(tmp_path, "forgetful", 1.0) + "run 20\n")
    assert said in line


def ruling_out(solvers: str) -> str:
    """Return the source of the law `forgetful` that names the solvers that serve it."""
    told = f"  std::vector<std::string> solvers() const override {{ return {{{solvers}}}; }}\n\n"
    return FORGETFUL.replace("  int remembers()", told + "  int remembers()")


@pytest.mark.parametrize(
    ("solvers", "option", "said"),
    [
        ('"apgd"', " solver sweeps", "law forgetful needs solver apgd, not sweeps"),
        ('"apgd", "uzawa"', " solver sweeps", "needs solver apgd or uzawa, not sweeps"),
        ('"newton"', "", "law forgetful asks for the solver newton, which is none"),
        ("", "", "law forgetful names no solver that serves it"),
    ],
)
def test_solvers_that_do_not_serve_a_law(
    solvers: str, option: str, said: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    build(ruling_out(solvers), tmp_path)
    assert said in refused(deck(tmp_path, f"forgetful{option}", 1.0) + "run 20\n")


def test_the_first_solver_that_serves_a_law_is_taken(tmp_path: Path, lmp: Runner) -> None:
    """To the last bit: it makes what it makes where it is named."""
    frames = []
    build(ruling_out('"uzawa", "apgd"'), tmp_path)
    for option in ("", " solver uzawa", " solver apgd"):
        lmp(deck(tmp_path, f"forgetful{option}", 1.0) + DUMP_PARTICLES + "run 20\n")
        frames.append((tmp_path / "particles.dump").read_text())
    assert frames[0] == frames[1]


# Two spheres that fall upon one another and slide, and one that slides on a floor, which comes up
# and moves away sideways: place, velocity, radius, type, acceleration.
BIG, SMALL, ON_FLOOR = range(3)
PLACES = np.array([[0.0, 0.0, 0.0], [-0.1, 0.85, 0.05], [2.0, -2.45, 1.0]])
VELOCITIES = np.array([[0.0, 0.1, 0.0], [0.5, -0.3, 0.2], [0.7, -0.4, -0.3]])
RADII = np.array([0.5, 0.3, 0.4])
ACCELERATIONS = np.array([[0.0, 0.0, 0.0], [0.4, -1.0, 0.3], [0.6, -2.0, 0.5]])
FLOOR_SPEED = 0.3
DUMP_FORCED = """
dump particles all custom 1 particles.dump id x y z vx vy vz fx fy fz
dump_modify particles sort id format float %.17g
"""


def sliding_deck(folder: Path, what: str, load: str) -> str:
    forces = "".join(
        f"group one{one} id {one + 1}\n"
        f"fix force{one} one{one} addforce {' '.join(f'{value:.17g}' for value in force)}\n"
        for one, force in enumerate(mass(RADII)[:, None] * ACCELERATIONS)
    )
    deck = scene(
        PLACES,
        RADII,
        folder,
        tolerance=1e-6,
        velocities=VELOCITIES,
        box=((-6.0, 6.0),) * 3,
        timestep=0.005,
        gravity=False,
        spins=[[3.0, -2.0, 1.0]],
        motion="fix motion all nve/sphere",
        options=f"region floor law witness {what}",
        setup=load,
        fixes="variable aside equal 0.9*step*dt\n"
        f"variable up equal {FLOOR_SPEED}*step*dt\n"
        "region floor plane 0 -3 0 0 1 0 move v_aside v_up NULL\n" + forces,
    )
    types = "read_data spheres.data extra/atom/types 2\nset atom 2 type 2\nset atom 3 type 3"
    return deck.replace("read_data spheres.data", types) + DUMP_FORCED + DUMP_WITNESS + "run 200\n"


def rows(folder: Path) -> list[tuple[Frame, FloatArray]]:
    """Return each row of the contact dump with its frame."""
    frames = read_dump(folder / "contacts.dump")
    return [(frame, row) for frame in frames for row in frame.rows]


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_a_law_is_told_of_both_sides(
    ranks: int, witness: str, tmp_path: Path, lmp: Runner
) -> None:
    lmp(sliding_deck(tmp_path, "sides", witness), ranks=ranks)
    seen = set()
    for frame, row in rows(tmp_path):
        one, other = (int(row[frame.columns.index(name)]) for name in ("id1", "id2"))
        told = row[[frame.columns.index(name) for name in VALUES]]
        types = [one, max(other, 0)]
        sizes = [RADII[one - 1], RADII[other - 1] if other > 0 else 0.0]
        assert told.tolist() == [*sizes, *types]
        seen.add((min(one, other), max(one, other)))
    assert seen == {(1, 2), (-1, 3)}


@pytest.mark.parametrize("ranks", [1, 2])
def test_how_a_law_is_told_that_surfaces_slide(
    ranks: int, witness: str, tmp_path: Path, lmp: Runner
) -> None:
    """With all forces but those of contacts, without spins and without the motion of the floor."""
    step = 0.005
    lmp(sliding_deck(tmp_path, "sliding", witness), ranks=ranks)
    particles = {frame.step: frame for frame in read_dump(tmp_path / "particles.dump")}
    pressed = {-1: 0, 1: 0}
    for frame, row in rows(tmp_path):
        if frame.step == 0:
            continue  # half a kick
        now = particles[frame.step]
        # A dump has the velocity after the first half of a step's kick.
        kicked = 0.5 * step * now.vectors("fx fy fz") / mass(RADII)[:, None]
        predicted = now.velocities - kicked + step * ACCELERATIONS
        row_of = dict(zip(frame.columns, row, strict=True))
        one, other = int(row_of["id1"]) - 1, int(row_of["id2"]) - 1
        wall = other < 0
        if wall:
            away = np.array([0.0, 1.0, 0.0])
            apart = predicted[one]
        else:
            away = now.positions[one] - now.positions[other]
            away /= np.linalg.norm(away)
            apart = predicted[one] - predicted[other]
        speed = apart @ away
        told = np.array([row_of[name] for name in VALUES])
        # Round-off of a wall's place, whose motion is a difference, over a time step.
        assert told[:3] == pytest.approx(apart - speed * away, abs=1e-12)
        assert told[3] == pytest.approx(speed - (FLOOR_SPEED if wall else 0.0), abs=1e-12)
        if row_of["force"] > 0.0:
            pressed[-1 if wall else 1] += 1
            assert np.linalg.norm(told[:3]) > 0.1
    assert min(pressed.values()) > 20


# Pairs that fly along y, and slide. Of each the left sphere is above the right one; some have the
# lower ID on the left.
PAIRS = np.array([[-6.0, -7.0, 0.5], [-2.0, -6.7, -0.5], [2.0, -6.4, 0.4], [6.0, -6.1, -0.4]])
LEFT_FIRST = np.array([True, False, False, True])
TO_RIGHT = np.array([np.sqrt(0.75), -0.5, 0.0])
FLIGHT = np.array([0.0, 2.0, 0.0])
APPROACH = -0.2 * TO_RIGHT + [0.01, 0.02, -0.03]  # of the right sphere against the left one


def flying_deck(folder: Path, law: str, load: str) -> str:
    """Return pairs that meet, and then fly and slide, and turn by little.

    LAMMPS sorts the atoms by cells of the size 1. While both spheres of a pair are in one row of
    them along x, the left one comes first; in two rows, the right one.
    """
    places, velocities = [], []
    for centre, left_first in zip(PAIRS, LEFT_FIRST, strict=True):
        pair = [(-0.51, 0.0), (0.51, 1.0)]
        for along, part in pair if left_first else reversed(pair):
            places.append(centre + along * TO_RIGHT)
            velocities.append(FLIGHT + part * APPROACH)
    return scene(
        places,
        RADIUS,
        folder,
        tolerance=1e-6,
        velocities=velocities,
        box=((-9.0, 9.0),) * 3,
        timestep=0.01,
        gravity=False,
        options=f"law witness {law}",
        setup=load + "\nprocessors 1 * 1\natom_modify sort 1 1.0",
    )


def what_is_remembered(
    folder: Path, law: str, load: str, ranks: int, lmp: Runner
) -> dict[int, list[tuple[FloatArray, FloatArray]]]:
    """Return, by pair, in each step the row's normal and values, also after a restart."""
    deck = flying_deck(folder, law, load)
    found: dict[int, list[tuple[FloatArray, FloatArray]]] = {}
    again = deck.replace("read_data spheres.data", "read_restart half.restart")
    for text in (deck + "run 250\nwrite_restart half.restart\n", again + "run 250\n"):
        before, after = text.split("thermo 1\n")
        lmp(f"{before}thermo 1\n{DUMP_WITNESS}{after}", ranks=ranks, into=folder)
        for frame in read_dump(folder / "contacts.dump"):
            values = frame.vectors("nx ny nz"), frame.vectors(" ".join(VALUES))
            for one, normal, told in zip(frame["id1"], *values, strict=True):
                found.setdefault((int(one) - 1) // 2, []).append((normal, told))
    return found


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_is_remembered_turns_round(
    ranks: int, witness: str, tmp_path: Path, lmp: Runner
) -> None:
    """A vector across n keeps its meaning, whichever sphere of a pair is side 1."""
    turned = what_is_remembered(tmp_path / "turned", "begin", witness, ranks, lmp)
    assert turned.keys() == set(range(len(PAIRS)))
    for pair in turned.values():
        assert len(pair) > 490
        normal = pair[0][0]
        expected = APPROACH - (APPROACH @ normal) * normal
        begun = np.sign(normal[0]) * pair[0][1][:3]
        assert begun == pytest.approx(expected, abs=1e-13)  # round-off
        for normal, told in pair:
            assert (np.sign(normal[0]) * told[:3] == begun).all()
        # Which sphere is side 1 changes all the time.
        assert np.count_nonzero(np.diff([normal[0] > 0.0 for normal, _ in pair])) > 5
    # A law that does not turn it loses its meaning in this scene.
    unturned = what_is_remembered(tmp_path / "unturned", "begin unturned", witness, ranks, lmp)
    for pair in unturned.values():
        assert len({tuple(np.sign(normal[0]) * told[:3]) for normal, told in pair}) == 2
