"""The pictures that results keep: small, and their colours still mean what the legend says."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lammps_inelastic.analysis import ParticleDump
from lammps_inelastic.workflow.pictures import MOST_PIXELS, pictures_of
from lammps_inelastic.workflow.study import Outputs
from tests.analysis.test_pictures import check_legend, pixels_of
from tests.analysis.written_dumps import frame_text


def test_each_colour_of_a_kept_picture_can_be_told_from_the_others(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    places = random.random((300, 3)) * 0.9 + 0.05
    rows = [[n, *place, 0.05, n % 12] for n, place in enumerate(places.tolist(), 1)]
    dump = tmp_path / "particles.lammpsdump"
    dump.write_text(frame_text("ATOMS", 7, "id x y z radius contacts", rows, None))
    ((name, picture),) = pictures_of(ParticleDump(dump), None, Outputs(pictures=(0,))).items()
    path = tmp_path / f"{name}.png"
    path.write_bytes(picture)
    assert max(pixels_of(path).shape) == MOST_PIXELS
    check_legend(path)
