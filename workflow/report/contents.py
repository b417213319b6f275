"""The table of contents: the sections by their names, and all sections of a report.

A section is a function from the data to its content, and an entry here. The order of the entries
is that of the report.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..shipped import STUDIES as OF_THE_PAPER
from . import verdict
from .blocks import Content, Section, missing, nothing_run
from .data import Data
from .sections import (
    agitation,
    checks,
    coming_to_rest,
    counting,
    dimer_contacts,
    dimer_orientation,
    dimer_packing_fraction,
    dimer_wall,
    dimers_soft,
    number_of_spheres,
    pictures,
    protocol,
    reference,
    repose,
    response,
    sphere_contacts,
    sphere_wall,
    structure,
    tolerance_and_force,
)
from .sections.any_study import study_section
from .sections.provenance import commands, provenance_section


@dataclass(frozen=True)
class Entry:
    """One section of a report on the paper's studies.

    Attributes
    ----------
    title : the section's heading
    build : the function that makes the section's content from the data
    studies : names of the studies that it shows, the most important one first; none for a section
        that shows every study or needs none
    topic : what its numbers and sentences belong to in the verdict, where they do not say it
    """

    title: str
    build: Callable[[Data], Content]
    studies: Sequence[str] = ()
    topic: str = ""

    def section(self, name: str, data: Data) -> Section:
        """Return the section, with a note in it if there is nothing to show."""
        content = self.build(data)
        run = commands(data, self.studies[:1])
        note = missing(run[0]) if run else nothing_run()
        blocks = content.blocks or [note]
        return Section(
            name,
            self.title,
            blocks,
            tuple(content.comparisons),
            tuple(self.studies),
            tuple(content.statements),
            self.topic,
        )


SECTIONS: Mapping[str, Entry] = {
    "figure-4": Entry("Figure 4: spheres fall", pictures.falling_spheres, ["figure-4"]),
    "figure-5": Entry(
        "Figure 5: the packing comes to rest",
        coming_to_rest.coming_to_rest,
        ["table-2", "more-seeds"],
        verdict.COMING_TO_REST,
    ),
    "table-1": Entry(
        "Table 1: tolerance and random force",
        tolerance_and_force.tolerance_and_force,
        ["table-1", "more-seeds"],
    ),
    "counting": Entry(
        "What counts as a contact at a loose tolerance", counting.counting, ["counting", "table-1"]
    ),
    "agitated": Entry(
        "Contacts while agitated and at rest",
        agitation.agitation,
        ["table-1", "table-2", "protocol"],
        verdict.CONTACTS,
    ),
    "table-2": Entry(
        "Table 2: number of spheres",
        number_of_spheres.number_of_spheres,
        ["table-2"],
        verdict.PACKING_FRACTION,
    ),
    "figure-6": Entry(
        "Figure 6: packing fraction near a wall",
        sphere_wall.sphere_wall,
        ["table-2"],
        verdict.WALL_PROFILE,
    ),
    "figure-7": Entry(
        "Figure 7: distribution of contacts",
        sphere_contacts.sphere_contacts,
        ["table-2"],
        verdict.CONTACTS,
    ),
    "figure-8": Entry("Figure 8: network of contacts", pictures.network, ["figure-8"]),
    "figure-9": Entry("Figure 9: one dimer", pictures.one_dimer),
    "figure-10": Entry("Figure 10: dimers fall", pictures.falling_dimers, ["figure-10"]),
    "anisotropy": Entry(
        "Orientation of dimers", dimer_orientation.against_aspect, ["dimers"], verdict.ORIENTATION
    ),
    "dimers-agitation": Entry(
        "Orientation of dimers and the random force",
        dimer_orientation.against_force,
        ["dimers-agitation"],
        verdict.ORIENTATION,
    ),
    "figure-11": Entry(
        "Figure 11: packing fraction against aspect ratio",
        dimer_packing_fraction.dimer_packing_fraction,
        ["dimers"],
        verdict.PACKING_FRACTION_OF_DIMERS,
    ),
    "figure-12": Entry(
        "Figure 12: dimers near a wall", dimer_wall.dimer_wall, ["dimers"], verdict.WALL_PROFILE
    ),
    "figure-13": Entry(
        "Figure 13: contacts and neighbours",
        dimer_contacts.contacts_and_neighbours,
        ["dimers"],
        verdict.CONTACTS_OF_DIMERS,
    ),
    "figure-14": Entry(
        "Figure 14: distribution of contacts and neighbours",
        dimer_contacts.distributions,
        ["dimers"],
        verdict.CONTACTS_OF_DIMERS,
    ),
    "structure": Entry(
        "Are the packings random? Structure", structure.structure, ["table-2", "dimers"]
    ),
    "forces": Entry("Contact forces", structure.forces, ["table-2", "dimers"]),
    "dimers-soft": Entry(
        "Where dimers are densest: hard and soft contacts", dimers_soft.dimers_soft, ["dimers-soft"]
    ),
    "reference": Entry(
        "Reference values: isostaticity, small gaps, weak forces",
        reference.reference,
        ["reference"],
    ),
    "repose": Entry("Angle of repose without friction", repose.repose, ["repose"]),
    "response": Entry("Response of a packing", response.response, ["response"]),
    "protocol": Entry("Time step, random force and drag", protocol.protocol, ["protocol"]),
    "checks": Entry("Overlap and resolution of every case", checks.checks),
}


def all_sections(data: Data, files: Sequence[str]) -> list[Section]:
    """Return all sections: those of the paper if any of its studies is there, and the others.

    Parameters
    ----------
    data : what the files hold
    files : names of the files
    """
    sections: list[Section] = []
    if any(name in data.studies for name in OF_THE_PAPER):
        sections += [entry.section(name, data) for name, entry in SECTIONS.items()]
    sections += [
        study_section(study) for name, study in data.studies.items() if name not in OF_THE_PAPER
    ]
    return [*sections, provenance_section(data, files)]
