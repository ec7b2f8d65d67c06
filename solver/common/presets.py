"""Robots that people have, by name: one row of the table each, with the source of its numbers.

A row describes a rod in space. In the plane the cables on the side of −x act together: two at ±120° are one cable at
half the offset, whose tension is the sum of theirs; cables at ±90° do not bend the robot and are left out.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from solver.common.rod import Cable
from solver.common.validation import check_positive, check_whole, refusal

NITI = 60e3  # Young's modulus of austenitic nickel–titanium, typical [N/mm²]


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """A robot of the table.

    Attributes:
        length_mm: Length of the backbone, L0 [mm].
        segments: Number of segments n, a multiple of ``sections``.
        offset_mm: Distance a of the cables from the backbone [mm].
        rigidity: Flexural rigidity EI [N·mm²].
        max_tension: Cable tension the motor can hold [N].
        torsion_ratio: GJ over EI.
        sections: Number of sections of equal length; the cables of each end at its last disk.
        cables: Number of cables of a section, 3 or 4, evenly spaced around the backbone from +x on; 0 for those a robot
            has by default: one in the plane, two 90° apart in space.
        source: Where the numbers come from.
    """

    length_mm: float
    segments: int
    offset_mm: float
    rigidity: float
    max_tension: float
    torsion_ratio: float = 0.77
    sections: int = 1
    cables: int = 4
    source: str


def round_rigidity(modulus: float, diameter_mm: float) -> float:
    """Return the flexural rigidity of a round solid rod, E·π d⁴/64 [N·mm²], for a modulus in N/mm²."""
    return modulus * math.pi / 64 * diameter_mm**4


PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        "prototype": Preset(
            length_mm=180.0,
            segments=18,
            offset_mm=8.0,
            rigidity=5000.0,
            max_tension=15.0,
            cables=0,
            source="Ashwin, Mahapatra, Ghosal 2021, section 2.1: L0, a and n; EI is assumed, as it prints none",
        ),
        "three_cables": Preset(
            length_mm=180.0,
            segments=18,
            offset_mm=8.0,
            rigidity=5000.0,
            max_tension=15.0,
            cables=3,
            source="the prototype with three of its twelve holes in use, 120° apart",
        ),
        "rao_2021": Preset(
            length_mm=200.0,
            segments=20,
            offset_mm=8.0,
            rigidity=round_rigidity(54e3, 1.4),
            max_tension=30.0,
            sections=2,
            cables=3,
            source="Rao, Peyron, Lilge, Burgner-Kahrs 2021 (doi 10.3389/frobt.2020.630245) and the code published with "
            "it: E = 54 GPa, ν = 0.3, backbone 1.4 mm; tension limit typical",
        ),
        "snake_arm": Preset(
            length_mm=1000.0,
            segments=40,
            offset_mm=20.0,
            rigidity=round_rigidity(NITI, 4.0),
            max_tension=200.0,
            sections=2,
            source="typical: an inspection arm with disks of 40 mm, 25 mm apart, on a NiTi rod of 4 mm with E = 60 GPa",
        ),
        "neuroendoscope": Preset(
            length_mm=60.0,
            segments=24,
            offset_mm=0.7,
            rigidity=round_rigidity(NITI, 0.4),
            max_tension=10.0,
            sections=2,
            source="Kato, Okumura, Song, Golby, Hata 2015 (doi 10.1109/TMECH.2014.2372635): two sections, 60 mm long, "
            "1.7 mm wide, which leaves a = 0.7 mm; the rest typical, stiff as a NiTi rod of 0.4 mm with E = 60 GPa",
        ),
        "guidewire": Preset(
            length_mm=20.0,
            segments=20,
            offset_mm=0.3,
            rigidity=round_rigidity(NITI, 0.2),
            max_tension=2.0,
            source="typical: the steerable tip of a 0.035-inch (0.89 mm) guidewire, stiff as a NiTi core of 0.2 mm "
            "with E = 60 GPa",
        ),
    }
)


def preset_fields(name: str, changes: Mapping[str, Any], space: int) -> dict[str, Any]:
    """Return the fields of a robot of the plane or of space, with changes; cables follow changed segments and offset.

    Args:
        name: Name of the preset.
        changes: Fields that are to be others.
        space: Dimensions of a point, 2 or 3.

    Raises:
        ValueError: If there is no such preset, or its sections cannot be of equal length.
    """
    if not (isinstance(name, str) and name in PRESETS):
        raise refusal("name of a preset", name, f"one of {', '.join(PRESETS)}")
    row = PRESETS[name]
    names = ("length_mm", "segments", "offset_mm", "rigidity", "max_tension", *(("torsion_ratio",) * (space == 3)))
    fields = {"model": "rod", **{field: getattr(row, field) for field in names}, **changes}
    if row.cables and "cables" not in changes:
        fields["cables"] = _cables(row, fields["segments"], fields["offset_mm"], space)
    return fields


def _cables(row: Preset, segments: object, offset_mm: object, space: int) -> tuple[Cable, ...]:
    """Return the cables of all sections, those of the section at the base first."""
    count, offset = check_whole("segments", segments, 2, 4096), check_positive("offset_mm", offset_mm)
    if count % row.sections:
        raise refusal("segments", count, f"a multiple of {row.sections}, the number of sections, or give cables=")
    ends = [*(count * section // row.sections for section in range(1, row.sections)), None]  # None is the tip
    return tuple(cable for end in ends for cable in _section_cables(row.cables, end, offset, space))


def _section_cables(count: int, end: int | None, offset: float, space: int) -> tuple[Cable, ...]:
    if space == 3:
        return tuple(Cable(angle=2 * math.pi * k / count, end=end) for k in range(count))
    return Cable(end=end), Cable(angle=math.pi, offset_mm=offset / 2 if count == 3 else None, end=end)
