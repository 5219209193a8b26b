from math import exp

import numpy as np
import pytest

from fras_motion.drivers import Measured, Setpoint, SimulatedDriver

HOME = Setpoint((0.0, 0.1, 0.12, 0.0, -0.2, 0.3), 1.0)
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
THERE = Setpoint((0.2, 0.0, 0.15, 0.1, 0.2, -0.3), -0.3)


def followed(driver: SimulatedDriver, setpoint: Setpoint, dt_s: float) -> Measured:
    driver.send(setpoint)
    return driver.measure(dt_s)


def test_ideal_arm_is_at_its_setpoint():
    driver = SimulatedDriver(0.0)
    assert driver.reset(HOME).joints == HOME.joints
    measured = followed(driver, THERE, 0.02)
    assert (measured.joints, measured.jaw_rad) == (THERE.joints, THERE.jaw_rad)
    np.testing.assert_allclose(
        measured.joint_velocities, (np.array(THERE.joints) - HOME.joints) / 0.02
    )


@pytest.mark.parametrize("ticks", [1, 2, 5])
def test_servo_approaches_as_a_first_order_lag(ticks):
    driver = SimulatedDriver(0.01)
    measured = driver.reset(HOME)
    for _ in range(ticks):
        measured = followed(driver, THERE, 0.02)
    left = exp(-ticks * 0.02 / 0.01)
    expected = np.array(THERE.joints) + (np.array(HOME.joints) - THERE.joints) * left
    np.testing.assert_allclose(measured.joints, expected, atol=1e-14)
    assert measured.jaw_rad == pytest.approx(-0.3 + 1.3 * left)


def test_noise_is_seeded_starts_anew_at_reset_and_does_not_drift():
    def walk(driver):
        return [driver.reset(HOME)] + [followed(driver, HOME, 0.02) for _ in range(200)]

    one = SimulatedDriver(0.01, noise_rad=1e-4, noise_m=1e-6, seed=3)
    first, again = walk(one), walk(one)
    assert first == again
    assert first == walk(SimulatedDriver(0.01, noise_rad=1e-4, noise_m=1e-6, seed=3))
    assert first != walk(SimulatedDriver(0.01, noise_rad=1e-4, noise_m=1e-6, seed=4))
    errors = np.array([m.joints for m in first]) - HOME.joints
    np.testing.assert_allclose(errors.std(axis=0), [1e-4, 1e-4, 1e-6, 1e-4, 1e-4, 1e-4], rtol=0.25)
    assert np.abs(errors.mean(axis=0)).max() < 3e-5


@pytest.mark.parametrize("delay_s", [0.0, 0.02, 0.03, 0.055, 0.06, 0.1])
def test_dead_time_puts_the_whole_course_off_by_itself(delay_s: float) -> None:
    """Against the exact answer to a step: nothing until the delay, then the lag from there."""
    driver, dt_s, tau_s = SimulatedDriver(0.01, delay_s=delay_s), 0.02, 0.01
    driver.reset(HOME)
    for tick in range(1, 12):
        measured = followed(driver, THERE, dt_s)
        left = exp(-max(0.0, tick * dt_s - delay_s) / tau_s)
        expected = np.array(THERE.joints) + (np.array(HOME.joints) - THERE.joints) * left
        np.testing.assert_allclose(measured.joints, expected, atol=1e-12)


def test_dead_time_keeps_the_order_of_setpoints() -> None:
    driver = SimulatedDriver(0.0, delay_s=0.03)
    driver.reset(HOME)
    jaws = [
        followed(driver, Setpoint(HOME.joints, jaw), 0.02).jaw_rad
        for jaw in (0.9, 0.8, 0.7, 0.6, 0.5)
    ]
    assert jaws == [1.0, 0.9, 0.8, 0.7, 0.6]
    assert driver.reset(THERE).jaw_rad == THERE.jaw_rad
    assert followed(driver, THERE, 0.02).jaw_rad == THERE.jaw_rad


def test_a_driver_that_takes_over_goes_on_as_the_one_before_would_have():
    one, other = SimulatedDriver(0.01), SimulatedDriver(0.01)
    one.reset(HOME)
    seen = followed(one, THERE, 0.02)
    assert other.resume(THERE, seen, 7) == seen
    for _ in range(3):
        assert other.measure(0.02) == one.measure(0.02)


def test_noise_after_a_takeover_depends_on_the_tick_alone():
    def noisy(tick):
        driver = SimulatedDriver(0.01, noise_rad=1e-4, seed=3)
        driver.resume(HOME, Measured(HOME.joints, STILL, HOME.jaw_rad), tick)
        return driver.measure(0.02)

    assert noisy(7) == noisy(7)
    assert noisy(7) != noisy(8)


def test_a_takeover_with_dead_time_stands_at_its_setpoint():
    driver = SimulatedDriver(0.0, delay_s=0.05)
    driver.resume(THERE, Measured(HOME.joints, STILL, HOME.jaw_rad), 7)
    assert driver.measure(0.02).joints == THERE.joints
