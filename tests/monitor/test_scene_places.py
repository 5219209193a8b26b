"""From wherever one looks at first, the right instrument is on the right."""

import numpy as np
import pytest

from fras_log.export.facts import Instrument
from fras_monitor.commands import Place
from fras_monitor.page.scene import LOOK_AT_M, PLACES
from fras_monitor.shapes import NAME_M, name_place_m
from fras_monitor.words import ARMS
from fras_motion.kinematics.cell import BASES_IN_WORLD

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("place", PLACES)
def test_the_right_instrument_is_seen_on_the_right(place: Place):
    sight = np.array(LOOK_AT_M) - np.array(PLACES[place])
    to_the_right = np.cross(sight, UP)
    along = {
        ARMS[arm]: float(np.array(base.position_m) @ to_the_right)
        for arm, base in BASES_IN_WORLD.items()
    }
    assert along["right instrument"] > along["left instrument"]


def test_a_name_stands_on_the_shaft_it_belongs_to():
    drawn = Instrument(
        tip_m=(0.0, 0.0, 0.0), tip_xyzw=(0.0, 0.0, 0.0, 1.0), jaw_rad=0.0,
        blades_m=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        hinge_m=(0.0, 0.0, 0.0), wrist_m=(0.0, 0.0, 0.01), remote_centre_m=(0.0, 0.1, 0.01),
    )  # fmt: skip
    assert name_place_m(drawn) == pytest.approx((0.0, NAME_M, 0.01))
