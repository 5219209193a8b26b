"""An arm that is computed: each joint follows its setpoint as a first-order servo."""

from __future__ import annotations

from collections import deque
from math import exp

import numpy as np

from fras_motion.kinematics import Joints

from .base import Measured, Setpoint

__all__ = ["SimulatedDriver"]

# A dead time of three ticks is three ticks, whatever the division's last digit.
_ROUNDING = 1e-9


class SimulatedDriver:
    """First-order joint servo with optional dead time and measurement noise.

    Parameters
    ----------
    time_constant_s : float
        Time constant tau of every joint and of the jaw [s]; 0 is an ideal arm.
    noise_rad, noise_m : float
        Standard deviation of what is measured, of angles [rad] and of the insertion [m].
    seed : int
        Seed of the noise; the sequence starts anew at each reset.
    delay_s : float
        Dead time until a setpoint takes effect [s].

    Notes
    -----
    tau dq/dt = u - q with u constant over a time h has the exact solution
    q(t + h) = u + (q(t) - u) exp(-h / tau). With a dead time that is no multiple of a tick, a
    tick has two such pieces.
    """

    def __init__(
        self,
        time_constant_s: float = 0.01,
        noise_rad: float = 0.0,
        noise_m: float = 0.0,
        seed: int = 0,
        delay_s: float = 0.0,
    ) -> None:
        self._time_constant_s = time_constant_s
        self._delay_s = delay_s
        self._noise = np.array([noise_rad, noise_rad, noise_m, *[noise_rad] * 4])
        self._noisy = bool(self._noise.any())
        self._seed = seed
        self._generator = np.random.default_rng(seed)
        self._goal: tuple[float, ...] = ()
        self._sent: deque[tuple[float, ...]] = deque()
        self._state: tuple[float, ...] = ()
        self._last: tuple[float, ...] = ()

    def reset(self, setpoint: Setpoint) -> Measured:
        """Stand at a setpoint, at rest; the noise starts anew.

        Parameters
        ----------
        setpoint : Setpoint
            Where a trial begins.

        Returns
        -------
        Measured
            The arm at tick 0, its velocities zero.
        """
        self._generator = np.random.default_rng(self._seed)
        self._state = (*setpoint.joints, setpoint.jaw_rad)
        self._goal = self._state
        self._sent = deque([self._state])
        self._last = self._measure()
        return _measured(self._last, (0.0,) * 6)

    def resume(self, setpoint: Setpoint, measured: Measured, tick: int) -> Measured:
        """Go on from where the arm was seen last; setpoints under way have arrived.

        Parameters
        ----------
        setpoint, measured
            See `Driver.resume`.
        tick : int
            Seeds the noise anew, together with its own seed.

        Returns
        -------
        Measured
            As given.
        """
        self._generator = np.random.default_rng((self._seed, tick))
        self._state = self._last = (*measured.joints, measured.jaw_rad)
        self._goal = (*setpoint.joints, setpoint.jaw_rad)
        self._sent = deque([self._goal])
        return measured

    def send(self, setpoint: Setpoint) -> None:
        """Follow a setpoint from now on, see `Driver.send`.

        Parameters
        ----------
        setpoint : Setpoint
            What holds until the next one.
        """
        self._goal = (*setpoint.joints, setpoint.jaw_rad)

    def measure(self, dt_s: float) -> Measured:
        """Let a tick pass.

        Parameters
        ----------
        dt_s : float
            Duration of the tick [s].

        Returns
        -------
        Measured
            The arm at the end of the tick.
        """
        ticks, late_s = divmod(self._delay_s + _ROUNDING * dt_s, dt_s)
        late_s = max(0.0, late_s - _ROUNDING * dt_s)
        self._sent.append(self._goal)
        while len(self._sent) > int(ticks) + 2:
            self._sent.popleft()
        # The setpoints that arrive before and in this tick; at rest the first of all is old enough.
        older, newer = self._sent[0], self._sent[max(0, len(self._sent) - 1 - int(ticks))]
        self._follow(older, late_s)
        self._follow(newer, dt_s - late_s)
        now = self._measure()
        before, self._last = self._last, now
        return _measured(
            now, tuple((b - a) / dt_s for a, b in zip(before[:6], now[:6], strict=True))
        )

    def _follow(self, goal: tuple[float, ...], time_s: float) -> None:
        if time_s <= 0.0:
            return
        left = exp(-time_s / self._time_constant_s) if self._time_constant_s > 0.0 else 0.0
        self._state = tuple(u + (q - u) * left for u, q in zip(goal, self._state, strict=True))

    def _measure(self) -> tuple[float, ...]:
        if not self._noisy:
            return self._state
        errors: list[float] = self._generator.normal(0.0, self._noise).tolist()
        return tuple(q + e for q, e in zip(self._state, errors, strict=True))


def _measured(values: tuple[float, ...], velocities: tuple[float, ...]) -> Measured:
    return Measured(_six(values[:6]), _six(velocities), values[6])


def _six(values: tuple[float, ...]) -> Joints:
    a, b, c, d, e, f = values
    return (a, b, c, d, e, f)
