"""The benchmark of what a scene does not use cuts that, and nothing else."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.benchmark.scenes_without import (
    COUNTED_WIDTH,
    PARTS,
    ROOT,
    TURNING,
    build,
    instructions,
    run,
    scene,
)
from tests.helpers.bodies import body_scene, dimer, placed
from tests.helpers.cpp_functions import functions, give_bodies
from tests.helpers.lammps_run import plugin_file, run_lmp
from tests.helpers.programs import missing
from tests.helpers.scenes import scene as scene_of

RADIUS = 0.05
EPS = 0.001 * RADIUS
SOURCE = """
namespace a {
// int Box::size() { return 0; }
class Box {
 public:
  int size() const { return n_; }
  const double *place(int i) const
  { return "size() { }"[i] ? x_ : nullptr; }
  struct Row { bool empty() { return true; } };
  template <class T> void each(T &&) const;
};
template <class T> void Box::each(T &&to_do) const { to_do([] { return 1; }); }
double &free_one(int size)
{
  return size > 0 ? one : other;
}
int b::Box::size_of(int) { return 3; }
}    // namespace a
"""


def test_functions_are_found_by_their_names() -> None:
    found = {name: SOURCE[place] for name, place in functions(SOURCE.encode())}
    assert found == {
        "Box::size": "{ return n_; }",
        "Box::place": '{ return "size() { }"[i] ? x_ : nullptr; }',
        "Row::empty": "{ return true; }",
        "Box::each": "{ to_do([] { return 1; }); }",
        "free_one": "{\n  return size > 0 ? one : other;\n}",
        "Box::size_of": "{ return 3; }",
    }


def test_bodies_are_given_to_functions_with_the_name(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "box.cpp").write_text(SOURCE)
    give_bodies(tmp_path, {"Row::empty": "", "Box::size": "return 17;"})
    written = SOURCE.replace("{ return true; }", "{  }").replace("return n_;", "return 17;")
    assert (tmp_path / "deep" / "box.cpp").read_text() == written
    with pytest.raises(LookupError, match=r"^deep defines no function Box::sizes: what is"):
        give_bodies(tmp_path / "deep", {"Box::sizes": "", "Box::size": "return 17;"})


def test_the_sources_define_each_function(tmp_path: Path) -> None:
    """One that has another name now, or is gone, must not leave the benchmark with nothing cut."""
    shutil.copytree(ROOT / "src_fix", tmp_path / "src_fix")
    for bodies in [*PARTS.values(), TURNING]:
        give_bodies(tmp_path / "src_fix", bodies)


@pytest.fixture(scope="module")
def without(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a plugin without bodies, walls and output."""
    return build(tmp_path_factory.mktemp("without"), next(iter(PARTS.values())))


@pytest.mark.slow
def test_the_scene_moves_as_with_all_code(without: Path, tmp_path: Path) -> None:
    """To the last bit: what is cut is nothing that it needs."""
    dumps = []
    for name, plugin in (("whole", plugin_file().parent), ("without", without)):
        dumps.append(tmp_path / name)
        dump = f"dump x all custom 25 {dumps[-1]} id x y z vx vy vz\ndump_modify x format float %a"
        run(plugin, scene(COUNTED_WIDTH, 100, dump))
    assert dumps[0].read_bytes() == dumps[1].read_bytes()


@pytest.mark.slow
def test_what_is_cut_is_gone(without: Path, tmp_path: Path) -> None:
    """A sphere falls through the floor, no contact is listed, and nobody knows of bodies."""
    on_the_floor = scene_of([0.5, RADIUS, 0.5], RADIUS, tmp_path / "wall", tolerance=EPS)
    on_the_floor += "variable y equal y[1]\nthermo_style custom step v_y\nrun 20\n"
    listed = "compute ids all reduce sum f_contact[1] inputs local\nthermo_style custom step c_ids"
    pile = scene(COUNTED_WIDTH, 100, listed)
    dimers = placed(2 * RADIUS * dimer(1.5), [0.5, 0.5, 0.5])
    of_bodies = body_scene(dimers, RADIUS, tmp_path / "body", inertia="point", tolerance=EPS)
    for plugin, there in ((plugin_file().parent, True), (without, False)):
        environment = {"LAMMPS_PLUGIN_PATH": str(plugin)}
        (heights,) = run_lmp(tmp_path / "wall", on_the_floor, environment=environment).runs
        assert (heights["v_y"][-1] > RADIUS - 2 * EPS) == there
        (contacts,) = run_lmp(tmp_path, pile, environment=environment).runs
        assert (contacts["c_ids"][-1] > 0) == there
        bodies = run_lmp(
            tmp_path / "body", of_bodies + "run 1\n", environment=environment, must_pass=there
        )
        assert there or "makes rigid bodies of spheres" in bodies.errors[0]


@pytest.mark.slow
def test_unused_code_costs_next_to_nothing(without: Path) -> None:
    """A scene models only what it requires."""
    if shutil.which("valgrind") is None:
        # It counts instructions; seconds differ from run to run by more than what is measured.
        missing("valgrind is not installed")
    cost = instructions(plugin_file().parent, 20) / instructions(without, 20) - 1
    # It was 1.5 % after version 0.2, from run to run within 0.1 %.
    assert 0 < cost < 0.02
