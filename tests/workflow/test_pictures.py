"""The pictures that results keep: small, and their colours still mean what the legend says."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lammps_inelastic.analysis import ContactFrame, ParticleDump
from lammps_inelastic.workflow.looking.pictures import MOST_PIXELS, pictures_of
from lammps_inelastic.workflow.study import Outputs
from tests.helpers.pixels import check_legend, pixels_of
from tests.helpers.written_dumps import frame_text


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


def test_the_contact_network_is_that_of_a_slab_in_the_middle(tmp_path: Path) -> None:
    """A contact in front of the slab is not drawn, one in it is."""
    # Heights 0.1 to 0.9, z from 0.1 to 0.9: the slab of three diameters reaches from 0.35 to 0.65.
    places = [[0.2, 0.1, 0.1], [0.3, 0.1, 0.1], [0.6, 0.1, 0.5], [0.7, 0.1, 0.5], [0.5, 0.9, 0.9]]
    rows = [[n, *place, 0.05] for n, place in enumerate(places, 1)]
    dump = tmp_path / "particles.lammpsdump"
    dump.write_text(frame_text("ATOMS", 7, "id x y z radius", rows, None))

    def picture(*pairs: tuple[int, int]) -> bytes:
        none = np.zeros((len(pairs), 3))
        contacts = ContactFrame(
            7, np.array(pairs), none, none, np.zeros(len(pairs)), np.ones(len(pairs))
        )
        drawn = pictures_of(ParticleDump(dump), contacts, Outputs(network=True))
        assert list(drawn) == ["network"]
        return drawn["network"]

    middle = picture((3, 4))
    assert picture((1, 2), (3, 4)) == middle
    assert picture((1, 2)) != middle
