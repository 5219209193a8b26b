"""The patient's scenario: what differs from the trial's, what does not, and what is no tissue."""

import math
import re
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_common.codec import content_digest, encode
from fras_common.scenario import (
    Disc,
    PatientSection,
    PlannerSection,
    Scenario,
    ScenarioError,
    SceneSection,
    TissueSection,
    check,
    load,
    patient_scenario,
    resolve,
    to_toml,
)

TRIAL = resolve(Scenario(seed=2))


def with_patient(scenario: Scenario = TRIAL, **section: Any) -> Scenario:
    return msgspec.structs.replace(scenario, patient=PatientSection(**section))


def derived(scenario: Scenario) -> Scenario:
    found = patient_scenario(scenario)
    assert found is not None
    return found


def discs_of(scenario: Scenario) -> tuple[Disc, ...]:
    assert scenario.scene is not None
    return scenario.scene.discs


def test_a_trial_without_a_patient_is_encoded_and_written_as_before() -> None:
    assert patient_scenario(TRIAL) is None
    assert not TRIAL.has_patient
    assert b"patient" not in encode(TRIAL)
    assert "patient" not in to_toml(TRIAL)
    # Of the version before there could be one, whose criterion was another by default.
    before = Scenario(planner=PlannerSection(criterion="weighted"))
    assert content_digest("t", before, b"") == BEFORE


BEFORE = "0f3fe31dfdf5f1c5bc059d0681be5d488d6f0c9a1b7d17cb2875c6cd72a84300"


def test_a_patient_that_differs_in_nothing_has_the_trials_scenario() -> None:
    assert derived(with_patient(seed=9)) == TRIAL


def test_stiffness_place_and_size_differ_and_nothing_else() -> None:
    scenario = with_patient(
        young_modulus_factor=1.3, disc_shift_m=0.005, disc_radius_factor=0.5, seed=1
    )
    patient = derived(scenario)
    assert patient.tissue.young_modulus_pa == 1.3 * TRIAL.tissue.young_modulus_pa
    pairs = list(zip(discs_of(TRIAL), discs_of(patient), strict=True))
    assert len(pairs) > 1
    for before, after in pairs:
        assert math.dist(before.center_m, after.center_m) == pytest.approx(0.005, rel=1e-12)
        assert after.radius_m == 0.5 * before.radius_m
    ways = {
        round(math.atan2(b.center_m[1] - a.center_m[1], b.center_m[0] - a.center_m[0]), 6)
        for a, b in pairs
    }
    assert len(ways) == len(pairs)
    same = msgspec.structs.replace(
        patient,
        tissue=TRIAL.tissue,
        scene=TRIAL.scene,
    )
    assert same == TRIAL
    assert check(patient) == patient


def test_the_seed_draws_the_directions_and_the_same_seed_the_same() -> None:
    one, again, other = (derived(with_patient(disc_shift_m=0.005, seed=n)) for n in (1, 1, 2))
    assert one == again
    assert discs_of(one) != discs_of(other)


@pytest.mark.parametrize("seed", range(20))
def test_a_disc_at_the_corner_stays_on_the_tissue(seed: int) -> None:
    scene = SceneSection(
        roi_m=(0.05, 0.06, 0.0), discs=(Disc(center_m=(0.0, 0.12), radius_m=0.02),)
    )
    scenario = with_patient(Scenario(scene=scene), disc_shift_m=0.03, seed=seed)
    (disc,) = discs_of(derived(scenario))
    assert 0.0 <= disc.center_m[0] <= 0.1
    assert 0.0 <= disc.center_m[1] <= 0.12
    assert math.dist(disc.center_m, (0.0, 0.12)) == pytest.approx(0.03, rel=1e-12)


LOOSE = TissueSection(bed=False)


@pytest.mark.parametrize(
    ("section", "tissue", "key", "named"),
    [
        ({"young_modulus_factor": 1000.0}, TissueSection(young_modulus_pa=2e6),
         "patient.young_modulus_factor", "at most 1e+09 Pa"),
        ({"disc_shift_m": 0.2}, TissueSection(), "patient.disc_shift_m", "stay on the tissue"),
        ({"disc_radius_factor": 100.0}, TissueSection(), "patient.disc_radius_factor",
         "at most 1 m"),
        ({"disc_radius_factor": 0.001}, LOOSE, "patient.disc_radius_factor", "needs tissue.bed"),
    ],
)  # fmt: skip
def test_values_that_make_no_tissue_are_refused_by_name(
    section: dict[str, Any], tissue: TissueSection, key: str, named: str
) -> None:
    trial = resolve(Scenario(seed=2, tissue=tissue))
    for refuse in (check, resolve, patient_scenario):
        with pytest.raises(ScenarioError, match=re.escape(named)) as caught:
            refuse(with_patient(trial, **section))
        assert caught.value.values["key"] == key


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("young_modulus_factor = 0", "patient.young_modulus_factor"),
        ("young_modulus_factor = nan", "patient.young_modulus_factor"),
        ("disc_shift_m = -1", "patient.disc_shift_m"),
        ("disc_radius_factor = inf", "patient.disc_radius_factor"),
        ("seed = 1.5", "patient.seed"),
        ("young_modulus = 1.3", "patient.young_modulus"),
    ],
)
def test_and_so_is_what_the_file_may_not_say(tmp_path: Path, text: str, key: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(f"[patient]\n{text}\n")
    with pytest.raises(ScenarioError) as caught:
        load(path)
    assert caught.value.values["key"] == key


def test_without_a_scene_nothing_is_derived() -> None:
    scenario = with_patient(Scenario(), disc_shift_m=0.2)
    assert check(scenario) == scenario
    with pytest.raises(ScenarioError, match="scene"):
        patient_scenario(scenario)


def test_it_survives_its_file(tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    scenario = with_patient(disc_shift_m=0.005, seed=3)
    path.write_text(to_toml(scenario))
    assert load(path) == scenario
