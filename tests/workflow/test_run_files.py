"""Runs whose files were damaged, or exchanged with those of another run: one line says which.

A dump that has lost whole frames, and a log that was cut between two lines, are well formed.
"""

from __future__ import annotations

import gzip
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import AnalysisError, ParticleDump, open_run, read_run_log
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.provenance.finished import other_run
from lammps_inelastic.workflow.results.measure import measure_case
from lammps_inelastic.workflow.study import Outputs, ProfileOutput, read_study
from tests.helpers.few_spheres import TINY
from tests.helpers.pouring import NO_STEPS
from tests.helpers.study_run import BIN, ENVIRONMENT, inelastic, numbers_of, same, warning

PARTICLES, CONTACTS, LOG = "particles.lammpsdump", "contacts.lammpsdump", "log.lammps"
BOX = ["--box", "0", "1", "0", "0.5", "0", "1"]
OUTPUTS = Outputs(points=1000, structure=False, box=(0, 1, 0, 0.5, 0, 1))

Damage = Callable[[Path], None]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study of two cases: 30 spheres in contact, of two seeds."""
    folder = tmp_path_factory.mktemp("story")
    text = TINY.replace("{seeds}", "[1, 2]").replace("settling = 40", "settling = 80")
    (folder / "few.toml").write_text(text)
    done = inelastic("run", folder / "few.toml", "--out", folder / "out")
    assert (done.returncode, done.stderr) == (0, warning(folder / "few.toml"))
    return folder


@pytest.fixture
def runs(study: Path, tmp_path: Path) -> tuple[Path, Path]:
    """Return copies of the folders of both cases."""
    cases = sorted(path for path in (study / "out" / "cases").iterdir() if path.name[0] != ".")
    first, second = (Path(shutil.copytree(case, tmp_path / case.name)) for case in cases)
    return first, second


# How files are damaged


def frames_of(path: Path) -> list[str]:
    return re.split("(?=ITEM: TIMESTEP)", path.read_text())[1:]


def frames(name: str, choose: Callable[[list[str]], list[str]]) -> Damage:
    """Return what leaves only some frames of a dump, in some order."""

    def damage(run: Path) -> None:
        before = frames_of(run / name)
        after = choose(before)
        assert after != before
        (run / name).write_text("".join(after))

    return damage


def lines(change: Callable[[list[str]], list[str]]) -> Damage:
    """Return what changes the lines of the log."""

    def damage(run: Path) -> None:
        before = (run / LOG).read_text().splitlines(keepends=True)
        after = change(before)
        assert after != before
        (run / LOG).write_text("".join(after))

    return damage


def place(lines: list[str], start: str, number: int) -> int:
    """Return the place of a line that begins with some words; the last one is -1."""
    return [index for index, line in enumerate(lines) if line.startswith(start)][number]


def without_run(number: int) -> Damage:
    """Return what cuts a run out of the log, from its header to its last line."""
    return lines(
        lambda log: log[: place(log, "   Step", number)] + log[place(log, "Loop", number) + 1 :]
    )


def replaced(name: str, pattern: str, by: str) -> Damage:
    """Return what replaces the last occurrence of something in a file."""

    def damage(run: Path) -> None:
        text = (run / name).read_text()
        *_, last = re.finditer(pattern, text, re.MULTILINE)
        (run / name).write_text(text[: last.start()] + last.expand(by) + text[last.end() :])

    return damage


def without_contact(run: Path) -> None:
    """Leave one contact out of the last frame: the file stays well formed."""
    before = frames_of(run / CONTACTS)
    *head, last = before
    rows = last.splitlines(keepends=True)
    assert int(rows[3]) == len(rows) - 9 > 0
    rows[3] = f"{int(rows[3]) - 1}\n"
    (run / CONTACTS).write_text("".join([*head, *rows[:-1]]))


def of_frames(name: str, choose: Callable[[list[str]], list[str]], said: str) -> tuple[Damage, str]:
    """Return the change of a dump's frames, and what is then said of the dump."""
    return frames(name, choose), f"{name}: {said}"


# The run of the second phase in a log: before it are one at the start and the two of the first
# phase, of the fall and of what is left after it, which is nothing here.
SECOND_PHASE = 3
TOLD = r"that log\.lammps tells of"
# What is damaged: what is said where the run is measured, looked at, exported. Runs that were
# started by hand have no record; nothing else may say less.
DAMAGES: dict[str, tuple[Damage, str]] = {
    "no first frame": of_frames(
        PARTICLES, lambda f: f[1:], f"the frame of step 0 {TOLD} is missing"
    ),
    "no middle frame": of_frames(
        PARTICLES, lambda f: f[:2] + f[3:], f"the frame of step 40 {TOLD} is missing"
    ),
    "no last frame": of_frames(
        PARTICLES, lambda f: f[:-1], f"the frame of step 135 {TOLD} is missing"
    ),
    "one frame": of_frames(
        PARTICLES,
        lambda f: f[:1],
        rf"7 frames \(steps 20, 40, 60, 80, \.\.\., 135\) {TOLD} are missing",
    ),
    "a frame twice": of_frames(
        PARTICLES, lambda f: [*f[:3], *f[2:]], "the frame of step 40 is there twice"
    ),
    "last frame twice": of_frames(
        PARTICLES, lambda f: [*f, f[-1]], "the frame of step 135 is there twice"
    ),
    "frames exchanged": of_frames(
        PARTICLES, lambda f: [f[1], f[0], *f[2:]], "the frame of step 0 comes after that of step 20"
    ),
    "frame of another step": (
        replaced(PARTICLES, "^120$", "121"),
        f"{PARTICLES}: the frame of step 120 {TOLD} is missing",
    ),
    "no first contacts": of_frames(
        CONTACTS, lambda f: f[1:], f"the frame of step 130 {TOLD} is missing"
    ),
    "no middle contacts": of_frames(
        CONTACTS, lambda f: f[:1] + f[3:], rf"2 frames \(steps 131, 132\) {TOLD} are missing"
    ),
    "contacts of one step": of_frames(
        CONTACTS, lambda f: f[:1], rf"5 frames \(steps 131, 132, 133, 134, 135\) {TOLD} are missing"
    ),
    "no last contacts": of_frames(
        CONTACTS, lambda f: f[:-1], f"the frame of step 135 {TOLD} is missing"
    ),
    "contacts twice": of_frames(
        CONTACTS, lambda f: [*f[:2], *f[1:]], "the frame of step 131 is there twice"
    ),
    "contacts exchanged": of_frames(
        CONTACTS,
        lambda f: [*f[:-2], f[-1], f[-2]],
        "the frame of step 134 comes after that of step 135",
    ),
    "contact of nobody": (
        replaced(CONTACTS, r"^\d+ (?=-?\d+ )", "999 "),
        f"{CONTACTS}: a contact at step 135 names sphere 999",
    ),
    "a contact less": (without_contact, f"{CONTACTS}: .* contacts at step 135, but"),
    "half a log": (
        lines(lambda log: log[: place(log, "Loop", 0) + 1]),
        f"{LOG}: its end is missing, and what is there does not tell of {PARTICLES} and",
    ),
    "a log cut in a run": (
        lines(lambda log: log[: place(log, "Loop", SECOND_PHASE)]),
        f"{LOG}: nothing after step 100 of the run that begins at step 20: it is still under way",
    ),
    "a log cut between runs": (
        lines(lambda log: log[: place(log, "Loop", SECOND_PHASE) + 1]),
        f"{LOG}: its end is missing, and what is there does not tell of {CONTACTS}: it is still",
    ),
    "a log without a run": (
        without_run(SECOND_PHASE),
        f"{LOG}, line .*: a run begins at step 100, but the one before it ended at step 20",
    ),
    "a log without a line": (
        lines(lambda log: [line for line in log if not re.match(r"\s+60 ", line)]),
        f"{LOG}, line .*: a line of thermo output of step 60 is missing, in the run from step 20",
    ),
    "atoms": (
        lines(lambda log: [line.replace("with 30 atoms", "with 31 atoms") for line in log]),
        f"{PARTICLES}: 30 spheres, but 31 atoms in log.lammps",
    ),
}


def without_checksums(run: Path) -> None:
    """Leave only what the files say themselves."""
    path = run / "finished.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"files": {}}))


def refusal(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run `inelastic`, which must refuse with one line and no number; return what it says."""
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("inelastic: ")
    assert said.err.count("\n") == 1
    return said.err


@pytest.mark.parametrize("name", DAMAGES)
def test_damaged_files_are_not_measured(
    runs: tuple[Path, Path], name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, _ = runs
    damage, said = DAMAGES[name]
    damage(run)
    without_checksums(run)
    with pytest.raises(AnalysisError, match=said):
        measure_case(run, OUTPUTS)
    # As if it was started by hand.
    (run / "finished.json").unlink()
    command = ["look", run, *BOX, "--points", 1000, "--no-picture"]
    assert re.search(said, refusal(capsys, *command))
    if "contact" not in name or "contacts" in name:
        export = ["export", run, "--format", "xyz", "--out", tmp_path / "a.xyz"]
        assert re.search(said, refusal(capsys, *export))
        assert not (tmp_path / "a.xyz").exists()


def test_a_log_that_ends_anywhere_is_not_measured(runs: tuple[Path, Path]) -> None:
    """Cut at every line."""
    run, _ = runs
    log = (run / LOG).read_text().splitlines(keepends=True)
    without_checksums(run)
    measure_case(run, OUTPUTS)
    for count in range(len(log)):
        (run / LOG).write_text("".join(log[:count]))
        with pytest.raises(AnalysisError, match=re.escape(f"{LOG}")):
            measure_case(run, OUTPUTS)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([LOG], "contacts at step 135, but .* in the column contacts of log.lammps"),
        ([PARTICLES], "contacts at step 135, but .* in the column contacts of log.lammps"),
        ([CONTACTS], "contacts at step 13., but .* in the|contacts at step 135, but .* in the"),
        ([PARTICLES, CONTACTS], "contacts at step 135, but .* in the column contacts of log"),
    ],
    ids=lambda value: "+".join(value) if isinstance(value, list) else "",
)
def test_files_of_another_run(
    runs: tuple[Path, Path], names: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    run, other = runs
    for name in names:
        shutil.copy(other / name, run / name)
    without_checksums(run)
    with pytest.raises(AnalysisError, match=said):
        measure_case(run, OUTPUTS)
    (run / "finished.json").unlink()
    command = ["look", run, *BOX, "--points", 1000, "--no-picture"]
    assert re.search(said, refusal(capsys, *command))


@pytest.mark.parametrize("name", [LOG, PARTICLES, CONTACTS])
def test_a_file_that_has_changed_at_all(
    runs: tuple[Path, Path], name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    run, _ = runs
    # A place of a sphere, a contact point, a wall time.
    pattern = r"seconds: collect 0.\d*" if name == LOG else r"^(\d+ -?\d+ 0\.\d*)\d\d "
    replaced(name, pattern, "seconds: collect 0.1" if name == LOG else r"\1 ")(run)
    said = f"{name}: is not the file that the run of finished.json has left; run it again"
    with pytest.raises(AnalysisError, match=re.escape(said)):
        measure_case(run, OUTPUTS)
    assert said in refusal(capsys, "look", run, *BOX, "--no-picture")
    assert said in refusal(capsys, "export", run, "--format", "xyz")


def test_the_record_of_another_run(runs: tuple[Path, Path]) -> None:
    run, other = runs
    shutil.copy(other / "finished.json", run / "finished.json")
    with pytest.raises(AnalysisError, match=r"is not the file that the run of finished\.json has"):
        measure_case(run, OUTPUTS)


@pytest.mark.parametrize(
    ("variable", "value", "said"),
    [
        ("steps_measuring", 6, "log.lammps: steps in all 135, but 136 in finished.json"),
        ("particles", 31, "particles.lammpsdump: particles 30, but 31 in finished.json"),
        ("diameter", 0.3, "particles.lammpsdump: diameter 0.2, but 0.3 in finished.json"),
    ],
)
def test_a_run_of_other_variables(
    runs: tuple[Path, Path], variable: str, value: float, said: str
) -> None:
    run, _ = runs
    record = json.loads((run / "finished.json").read_text())
    record["stages"][0]["variables"][variable] = value
    (run / "finished.json").write_text(json.dumps(record))
    with pytest.raises(AnalysisError, match=re.escape(said)):
        measure_case(run, OUTPUTS)


def test_compressed_dumps_are_the_same_files(runs: tuple[Path, Path]) -> None:
    run, _ = runs
    before = measure_case(run, OUTPUTS)
    for name in (PARTICLES, CONTACTS):
        (run / name).write_bytes(gzip.compress((run / name).read_bytes()))
    after = measure_case(run, OUTPUTS)
    assert same(dict(before.values), dict(after.values))


def test_a_frame_can_be_named_by_its_step(
    runs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The others may be missing, or the run be cut off."""
    run, _ = runs
    export = ["export", str(run), "--format", "xyz", "--out", str(tmp_path / "a.xyz")]
    frames(PARTICLES, lambda f: f[:-1])(run)
    assert main([*export, "--step", "40"]) == 0
    assert (tmp_path / "a.xyz").exists()
    lines(lambda log: log[: place(log, "Loop", 2)])(run)
    assert main([*export, "--step", "40"]) == 0
    assert "--step N writes a frame that is there" in refusal(capsys, *export)
    frames(PARTICLES, lambda f: [*f[:3], *f[2:]])(run)
    assert "more than one frame of step 40" in refusal(capsys, *export, "--step", 40)
    frames(CONTACTS, lambda f: f[-1:])(run)
    shutil.copy(runs[1] / PARTICLES, run / PARTICLES)
    replaced(CONTACTS, r"^\d+ (?=-?\d+ )", "999 ")(run)
    assert "names sphere 999" in refusal(capsys, *export, "--step", 135)


@pytest.mark.parametrize("text", ["[" * 100_000, "null", '{"stages": 1}'])
def test_a_record_that_is_none(
    runs: tuple[Path, Path], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It tells of no files, which cannot be compared with it."""
    run, _ = runs
    record = json.loads((run / "finished.json").read_text())
    for content in (text, json.dumps(record | {"files": [1]})):
        (run / "finished.json").write_text(content)
        assert main(["look", str(run), *BOX, "--points", "1000", "--no-picture"]) == 0
        assert bool(other_run(run, record)) == content.startswith("{")


def test_a_log_without_runs(runs: tuple[Path, Path]) -> None:
    run, _ = runs
    text = (run / LOG).read_text()
    (run / LOG).write_text(re.sub(r"^   Step.*?^Loop time.*?$", "", text, flags=re.M | re.S))
    with pytest.raises(AnalysisError, match=r"log\.lammps: tells of no run: a part of it is miss"):
        measure_case(run, OUTPUTS)


def test_a_run_that_goes_on_can_be_looked_at(
    runs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """What the log does not tell yet is no mistake, where contacts are counted by distance."""
    run, _ = runs
    (run / "finished.json").unlink()
    lines(lambda log: log[: place(log, "Loop", SECOND_PHASE) - 3])(run)
    frames(PARTICLES, lambda f: f[:-1])(run)
    command = ["look", str(run), *BOX, "--points", "1000", "--no-picture"]
    said = refusal(capsys, *command)
    assert "nothing after step" in said
    assert "--contact-gap GAP counts contacts in the last frame that is there" in said
    assert main([*command, "--contact-gap", "0.01"]) == 0
    # But a frame of which it tells must be there.
    frames(PARTICLES, lambda f: f[:2] + f[3:])(run)
    assert "frame of step 40" in refusal(capsys, *command, "--contact-gap", "0.01")


@pytest.mark.slow
def test_a_study_says_what_cannot_be_measured(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(study, tmp_path / "copy")
    path, out = tmp_path / "copy" / "few.toml", tmp_path / "copy" / "out"
    shutil.rmtree(out / "results")
    run = out / "cases" / read_study(path).cases[0].name
    frames(PARTICLES, lambda f: f[:-1])(run)
    assert main(["run", str(path), "--out", str(out)]) == 1
    said = capsys.readouterr().out
    assert "few: 1 done, 1 failed" in said
    assert (
        "cannot be measured: particles.lammpsdump: the frame of step 135 that log.lammps tells of "
        f"is missing; delete {run} to run it again" in said
    )
    assert main(["collect", str(path), "--out", str(out)]) == 0
    assert "few: 1 of 2 cases" in capsys.readouterr().out
    # Doing what it says helps.
    shutil.rmtree(run)
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert same(numbers_of(out / "few.h5"), numbers_of(study / "out" / "few.h5"))


def test_a_result_of_another_run(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(study, tmp_path / "copy")
    path, out = tmp_path / "copy" / "few.toml", tmp_path / "copy" / "out"
    assert main(["collect", str(path), "--out", str(out)]) == 0
    assert capsys.readouterr().err == ""
    record = out / "cases" / read_study(path).cases[1].name / "finished.json"
    record.write_text(
        json.dumps(json.loads(record.read_text()) | {"started": "2026-01-01T00:00:00+00:00"})
    )
    assert main(["collect", str(path), "--out", str(out)]) == 0
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith(f"WARNING: {out / 'results' / 'few' / record.parent.name}.h5 is of the")
    assert "2026-01-01T00:00:00+00:00; delete it to measure that" in said


@pytest.mark.slow
def test_every_stage_of_a_run_is_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = TINY.replace("{seeds}", "1").replace('"spheres"', '["spheres", "response"]')
    (tmp_path / "two.toml").write_text(text.replace("seed = 1", "seed = 1\nsteps_changing = 33"))
    out = tmp_path / "out"
    assert main(["run", str(tmp_path / "two.toml"), "--out", str(out)]) == 0
    (run,) = (path for path in (out / "cases").iterdir() if path.name[0] != ".")
    look = [*BOX, "--points", 1000, "--no-picture"]
    # The last stage works in the folder of the case, the first one in its own.
    for stage, other in ((run, run / "spheres"), (run / "spheres", run)):
        whole = (stage / LOG).read_text()
        replaced(LOG, "^Total wall time: .*", "Total wall time: 9:00:00")(stage)
        said = f"{stage / LOG}: is not the file that the run of finished.json has left"
        with pytest.raises(AnalysisError, match=re.escape(said)):
            measure_case(run, OUTPUTS)
        assert said in refusal(capsys, "look", stage, *look)
        assert main([str(word) for word in ["look", other, *look]]) == 0
        (stage / LOG).write_text(whole)
    (run / "spheres" / CONTACTS).unlink()
    with pytest.raises(AnalysisError, match=r"contacts\.lammpsdump: no such file"):
        measure_case(run, OUTPUTS)


def test_a_profile_notes_the_diameter_of_its_slabs(runs: tuple[Path, Path]) -> None:
    """A report cannot know it otherwise where a deck has no variable of that name."""
    slabs = ProfileOutput(reach=0.2, thickness=0.5, points=100)
    values = measure_case(runs[0], OUTPUTS.model_copy(update={"profile": slabs})).values
    assert values["profile/diameter"] == 0.2
    assert values["profile/distance"].tolist() == pytest.approx([0.05, 0.15], rel=1e-12)


def test_a_periodic_box_is_measured_across_its_faces(runs: tuple[Path, Path]) -> None:
    """Deep inside nothing is another; the wall at x, whose profile was asked for, is none now."""
    run, _ = runs
    slabs = ProfileOutput(reach=0.2, thickness=0.5, points=100)
    outputs = OUTPUTS.model_copy(update={"profile": slabs})
    open_box = measure_case(run, outputs).values
    record = json.loads((run / "finished.json").read_text())
    (run / "finished.json").write_text(json.dumps(record | {"files": {}}))
    dump = run / PARTICLES
    dump.write_text(dump.read_text().replace("BOX BOUNDS ff ff ff", "BOX BOUNDS pp ff ff"))
    periodic = measure_case(run, outputs).values
    for name in ("packing_fraction", "coordination_number"):
        # Places are moved by a period and back: round-off.
        there, here = open_box[f"numbers/{name}"], periodic[f"numbers/{name}"]
        assert here == pytest.approx(there, rel=1e-12)
    assert {"profile/distance"} == {"profile/distance"} & (set(open_box) - set(periodic))
    assert np.isinf(periodic["bed/ends"][0]).all()


# Decks with other ways of writing their dumps


def lmp(folder: Path, deck: str, **variables: object) -> Path:
    """Run a shipped deck in a folder; return where its output is."""
    words = [word for name, v in variables.items() for word in ("-var", name, str(v))]
    command = [str(BIN / "lmp"), "-in", str(files("lammps_inelastic.inputs") / f"{deck}.in")]
    subprocess.run(
        [*command, "-screen", "none", *words], cwd=folder, env=ENVIRONMENT, check=True, timeout=120
    )
    return folder / str(variables["out"])


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the start of a packing, `start`, which took no steps."""
    folder = tmp_path_factory.mktemp("start")
    lmp(folder, "spheres", particles=30, diameter=0.2, out="start", **NO_STEPS)
    return folder


SHORT = {
    "steps_agitated": 30,
    "steps_settling": 40,
    "steps_resting": 30,
    "steps_tightening": 7,
    "steps_measuring": 4,
}
FEW = {"particles": 30, "diameter": 0.2}
SETTLING = {"packing": "start/packing.restart", "diameter": 0.2, "time_settling": 0.7}


@pytest.mark.parametrize(
    ("deck", "variables"),
    [
        ("dimers", FEW | SHORT | {"dump_every": 20}),
        ("clusters", FEW | SHORT | {"dump_every": 111}),
        # The last step of each phase is in the dump already.
        ("spheres", FEW | SHORT | {"dump_every": 1}),
        ("spheres", FEW | SHORT | {"steps_tightening": 0, "steps_measuring": 0}),
        (
            "response",
            {"packing": "start/packing.restart", "diameter": 0.2} | {"steps_changing": 33},
        ),
        ("settling", SETTLING),
        # Steps that are shortened; frames that are about as far apart as steps; contacts of a step
        # without a frame of its own.
        ("settling", SETTLING | {"dt": 0.3, "reach": 0.2, "time_between": 0.07}),
        ("settling", SETTLING | {"time_between": 0.004}),
        ("settling", SETTLING | {"time_between": 0.4}),
        ("settling", SETTLING | {"contacts": "soft", "time_between": 0.0123}),
    ],
)
def test_whole_runs_are_whole(start: Path, deck: str, variables: dict[str, object]) -> None:
    run = lmp(start, deck, out="run", **variables)
    try:
        dump = ParticleDump(run / PARTICLES)
        contacts = run / CONTACTS if (run / CONTACTS).exists() else None
        assert (contacts is None) == (variables.get("contacts") == "soft")
        opened = open_run(dump, contacts, read_run_log(run / LOG))
        opened.check_last()
        if contacts is not None:
            *_, last = opened.contact_frames(dump[-1])
            assert last.step == dump[-1].step
        # Every frame but the first is missed where it should be.
        written = read_run_log(run / LOG).written(run / PARTICLES)
        if written is not None:
            whole = frames_of(run / PARTICLES)
            for lost in {0, len(whole) // 2, len(whole) - 1} if len(whole) > 1 else set():
                (run / PARTICLES).write_text("".join(np.delete(whole, lost)))
                with pytest.raises(AnalysisError, match=r"particles\.lammpsdump"):
                    open_run(ParticleDump(run / PARTICLES), contacts, read_run_log(run / LOG))
    finally:
        shutil.rmtree(run)
