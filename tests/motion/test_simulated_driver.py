from math import exp

import numpy as np
import pytest

from fras_motion.drivers import Setpoint, SimulatedDriver

HOME = Setpoint((0.0, 0.1, 0.12, 0.0, -0.2, 0.3), 1.0)
THERE = Setpoint((0.2, 0.0, 0.15, 0.1, 0.2, -0.3), -0.3)


def test_ideal_arm_is_at_its_setpoint():
    driver = SimulatedDriver(0.0)
    assert driver.reset(HOME).joints == HOME.joints
    measured = driver.servo(THERE, 0.02)
    assert (measured.joints, measured.jaw_rad) == (THERE.joints, THERE.jaw_rad)
    np.testing.assert_allclose(
        measured.joint_velocities, (np.array(THERE.joints) - HOME.joints) / 0.02
    )


@pytest.mark.parametrize("ticks", [1, 2, 5])
def test_servo_approaches_as_a_first_order_lag(ticks):
    driver = SimulatedDriver(0.01)
    measured = driver.reset(HOME)
    for _ in range(ticks):
        measured = driver.servo(THERE, 0.02)
    left = exp(-ticks * 0.02 / 0.01)
    expected = np.array(THERE.joints) + (np.array(HOME.joints) - THERE.joints) * left
    np.testing.assert_allclose(measured.joints, expected, atol=1e-14)
    assert measured.jaw_rad == pytest.approx(-0.3 + 1.3 * left)


def test_noise_is_seeded_starts_anew_at_reset_and_does_not_drift():
    def walk(driver):
        return [driver.reset(HOME)] + [driver.servo(HOME, 0.02) for _ in range(200)]

    one = SimulatedDriver(0.01, noise_rad=1e-4, noise_m=1e-6, seed=3)
    first, again = walk(one), walk(one)
    assert first == again
    assert first == walk(SimulatedDriver(0.01, noise_rad=1e-4, noise_m=1e-6, seed=3))
    assert first != walk(SimulatedDriver(0.01, noise_rad=1e-4, noise_m=1e-6, seed=4))
    errors = np.array([m.joints for m in first]) - HOME.joints
    np.testing.assert_allclose(errors.std(axis=0), [1e-4, 1e-4, 1e-6, 1e-4, 1e-4, 1e-4], rtol=0.25)
    assert np.abs(errors.mean(axis=0)).max() < 3e-5
