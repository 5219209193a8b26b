"""The patient's scenario: the trial's, as the tissue is and not as the model believes it."""

import math
from random import Random
from typing import Final

import msgspec

from fras_common.scenario.errors import ScenarioError
from fras_common.scenario.model import Disc, PatientSection, Scenario, TissueSection

DRAWS: Final = 1000
MAX_YOUNG_MODULUS_PA: Final = 1e9
MAX_RADIUS_M: Final = 1.0


def patient_scenario(scenario: Scenario, file: str = "scenario") -> Scenario | None:
    """Derive the scenario of the patient from that of the trial.

    Young's modulus and the discs' radii are multiplied; the centre of each disc moves by
    `disc_shift_m`, each in a direction of its own, drawn from the patient's seed among those that
    leave it on the tissue. Everything else is the trial's.

    Parameters
    ----------
    scenario : Scenario
        Resolved.
    file : str
        What an error names.

    Returns
    -------
    Scenario or None
        Without a patient of its own; None where the trial has none.

    Raises
    ------
    ScenarioError
        Values that make no tissue: too stiff, a disc that is too large or has no place, or nothing
        that holds tissue without a bed. Or the scenario has no scene yet.

    Notes
    -----
    Only sums, products and square roots, which every processor rounds alike: an audit derives the
    same bits on any machine.
    """
    patient, tissue, scene = scenario.patient, scenario.tissue, scenario.scene
    if isinstance(patient, msgspec.UnsetType):
        return None
    if scene is None:
        raise ScenarioError(file, "scene", None, "draw it before the patient's is derived from it")
    young_modulus_pa = tissue.young_modulus_pa * patient.young_modulus_factor
    if not 0.0 < young_modulus_pa <= MAX_YOUNG_MODULUS_PA:
        raise ScenarioError(
            file, "patient.young_modulus_factor", patient.young_modulus_factor,
            f"makes {young_modulus_pa:.4g} Pa of tissue.young_modulus_pa: above 0 and at most "
            f"{MAX_YOUNG_MODULUS_PA:.4g} Pa",
        )  # fmt: skip
    discs = _moved(scene.discs, patient, tissue, file)
    if not tissue.bed and tissue.mesh_file is None and not _holds(discs, tissue):
        raise ScenarioError(
            file, "patient.disc_radius_factor", patient.disc_radius_factor,
            "leaves no node attached, and tissue that is attached nowhere needs tissue.bed",
        )  # fmt: skip
    return msgspec.structs.replace(
        scenario,
        tissue=msgspec.structs.replace(tissue, young_modulus_pa=young_modulus_pa),
        scene=msgspec.structs.replace(scene, discs=discs),
        patient=msgspec.UNSET,
    )


def _moved(
    discs: tuple[Disc, ...], patient: PatientSection, tissue: TissueSection, file: str
) -> tuple[Disc, ...]:
    random = Random(patient.seed)
    moved: list[Disc] = []
    for index, disc in enumerate(discs):
        radius_m = disc.radius_m * patient.disc_radius_factor
        if radius_m > MAX_RADIUS_M:
            raise ScenarioError(
                file, "patient.disc_radius_factor", patient.disc_radius_factor,
                f"makes {radius_m:.4g} m of scene.discs[{index}].radius_m: at most "
                f"{MAX_RADIUS_M:.4g} m",
            )  # fmt: skip
        center_m = _shifted(disc.center_m, patient.disc_shift_m, tissue, random)
        if center_m is None:
            raise ScenarioError(
                file, "patient.disc_shift_m", patient.disc_shift_m,
                f"in no direction drawn does scene.discs[{index}].center_m = "
                f"{list(disc.center_m)} stay on the tissue, {tissue.size_m[0]:g} m by "
                f"{tissue.size_m[1]:g} m: less, or another patient.seed",
            )  # fmt: skip
        moved.append(Disc(center_m=center_m, radius_m=radius_m))
    return tuple(moved)


def _shifted(
    center_m: tuple[float, float], shift_m: float, tissue: TissueSection, random: Random
) -> tuple[float, float] | None:
    """Move a centre in the first direction drawn that leaves it on the tissue."""
    for _ in range(DRAWS):
        x, y = 2.0 * random.random() - 1.0, 2.0 * random.random() - 1.0
        squared = x * x + y * y
        # Uniform in direction, as what lies in the unit disc is; next to nothing has none.
        if not 1e-6 < squared <= 1.0:
            continue
        step = shift_m / math.sqrt(squared)
        moved = (center_m[0] + step * x, center_m[1] + step * y)
        if all(0.0 <= one <= extent for one, extent in zip(moved, tissue.size_m[:2], strict=True)):
            return moved
    return None


def _holds(discs: tuple[Disc, ...], tissue: TissueSection) -> bool:
    """Whether a bottom node of the box lies in a disc: if any does, the one nearest its centre."""
    for disc in discs:
        apart_m: list[float] = []
        for place, extent, count in zip(
            disc.center_m, tissue.size_m[:2], tissue.node_counts[:2], strict=True
        ):
            spacing = extent / (count - 1)
            apart_m.append(abs(round(place / spacing) * spacing - place))
        if math.hypot(*apart_m) <= disc.radius_m:
            return True
    return False
