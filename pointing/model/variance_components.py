"""A linear model of many runs, some of whose coefficients change from run to run, and how much they do.

The observations y of all runs are Xβ + Σ_c Z_c u_c + e with u_c ~ N(0, θ_c T_c) and e ~ N(0, 1): all is whitened, in
units of the scatter of a single observation. β, the values without any change, are known by nothing else; they are
taken out of the likelihood, which is then the *restricted* one (Patterson & Thompson 1971, Biometrika 58, 545). With
V = 1 + Σ θ_c Z_c T_c Z_cᵀ, P = V⁻¹ − V⁻¹X(XᵀV⁻¹X)⁻¹XᵀV⁻¹, w_c = Z_cᵀPy and G_ab = Z_aᵀPZ_b

    −2 ln L = ln|V| + ln|XᵀV⁻¹X| + yᵀPy,  ∂ln L/∂θ_c = ½(w_cᵀT_c w_c − tr T_c G_cc),  F_ab = ½ tr T_a G_ab T_b G_ba,

and Fisher's scoring with Levenberg's damping, held at θ ≥ 0, finds the maximum.

With few runs the likeliest variance is often zero where the true one is not, and a prediction that believes it is too
sure: of five runs with a drift of half their noise z² is 3. Predictions therefore use the *expected* variances, the
mean over θ ≥ 0 of each one's likelihood, normal about its maximum by Fisher's information: z² is then about 1.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ROUNDS = 100
_SETTLED = 1e-4  # gain in ln L below which the maximum is found
_FAR = 8.0  # σ
_LEAST_DAMPING = 1e-6  # two variances that the runs do not tell apart share what there is


@dataclass(frozen=True, eq=False)
class Component:
    """What one variance belongs to.

    Parameters
    ----------
    term : int
        Column of the coefficient in X.
    kind : {"walk", "jump"}
        How it changes.
    design : (N, R) array
        Z: derivative of the observations by the coefficient's change in each of R runs.
    between : (R + 1, R + 1) array
        T: covariance of the changes between runs, for a variance of one; the last one is the run to come.
    """

    term: int
    kind: Literal["walk", "jump"]
    design: Array
    between: Array

    @cached_property
    def known(self) -> Array:
        """T of the runs that were observed."""
        return self.between[:-1, :-1]


@dataclass(frozen=True, eq=False)
class RunsModel:
    """The whitened observations of all runs.

    Parameters
    ----------
    observations : (N,) array
        y.
    design : (N, k) array
        X.
    components : tuple of Component
        With one variance each.
    """

    observations: Array
    design: Array
    components: tuple[Component, ...]

    def estimated(self, start: Array) -> "Estimate":
        """Maximise the restricted likelihood over the variances, from a start (C,)."""
        best, damping = Estimate(self, start), 1e-3
        for _ in range(_ROUNDS):
            gradient, information = best.slopes
            free = (best.variances > 0.0) | (gradient > 0.0)
            if not free.any():
                break
            part = information[np.ix_(free, free)]
            step = np.zeros_like(best.variances)
            step[free] = np.linalg.solve(part + damping * np.diag(np.diag(part)), gradient[free])
            new = Estimate(self, np.maximum(best.variances + step, 0.0))
            gain = new.log_likelihood - best.log_likelihood
            if gain < 0.0:
                damping *= 10.0
            else:
                best, damping = new, max(damping / 10.0, _LEAST_DAMPING)
            if abs(gain) < _SETTLED:
                break
        return best


@dataclass(frozen=True, eq=False)
class Estimate:
    """A model at given variances.

    Parameters
    ----------
    model : RunsModel
        The model.
    variances : (C,) array
        θ.
    """

    model: RunsModel
    variances: Array

    @cached_property
    def _inverse(self) -> Array:
        """V⁻¹."""
        return np.asarray(np.linalg.inv(self._covariance))

    @cached_property
    def _covariance(self) -> Array:
        """V."""
        v = np.eye(len(self.model.observations))
        for each, variance in zip(self.model.components, self.variances, strict=True):
            v += each.design @ (variance * each.known) @ each.design.T
        return v

    @cached_property
    def _seen(self) -> Array:
        """V⁻¹X."""
        return self._inverse @ self.model.design

    @cached_property
    def _fixed(self) -> Array:
        """Covariance (k, k) of β: (XᵀV⁻¹X)⁻¹."""
        matrix = self.model.design.T @ self._seen
        scale = np.sqrt(np.diag(matrix))
        return np.asarray(np.linalg.inv(matrix / np.outer(scale, scale)) / np.outer(scale, scale))

    @cached_property
    def _projection(self) -> Array:
        """P."""
        return np.asarray(self._inverse - self._seen @ self._fixed @ self._seen.T)

    @cached_property
    def log_likelihood(self) -> float:
        """Restricted, but for a constant."""
        y = self.model.observations
        size = np.linalg.slogdet(self._covariance)[1] - np.linalg.slogdet(self._fixed)[1]
        return -0.5 * float(size + y @ self._projection @ y)

    @cached_property
    def slopes(self) -> tuple[Array, Array]:
        """Gradient (C,) of ln L and Fisher's information (C, C)."""
        parts = self.model.components
        weighted = [self._projection @ each.design for each in parts]
        gradient, information = np.empty(len(parts)), np.empty((len(parts), len(parts)))
        for a, one in enumerate(parts):
            pull = weighted[a].T @ self.model.observations
            gradient[a] = 0.5 * (pull @ one.known @ pull - np.sum(one.known * (one.design.T @ weighted[a])))
            for b, other in enumerate(parts[: a + 1]):
                between = one.design.T @ weighted[b]
                information[a, b] = 0.5 * np.sum((one.known @ between @ other.known) * between)
                information[b, a] = information[a, b]
        return gradient, information

    @cached_property
    def expected(self) -> "Estimate":
        """The model at the expected variances: means of each one's likelihood over what is possible."""
        gradient, information = self.slopes
        spread = 1.0 / np.sqrt(np.diag(information))
        middle = self.variances + np.where(self.variances > 0.0, 0.0, gradient * spread**2)
        pairs = zip(middle, spread, strict=True)
        return Estimate(self.model, np.array([_mean_of_positive(float(mean), float(sigma)) for mean, sigma in pairs]))

    def coefficients(self, run: int) -> tuple[Array, Array]:
        """Best linear unbiased prediction (k,) of a run's coefficients with its covariance; −1 is the next run."""
        k = self.model.design.shape[1]
        own, shared = np.zeros((k, k)), np.zeros((k, len(self.model.observations)))
        for each, variance in zip(self.model.components, self.variances, strict=True):
            own[each.term, each.term] += variance * each.between[run, run]
            shared[each.term] += each.design @ (variance * each.between[:-1, run])
        fixed = self._fixed @ (self._seen.T @ self.model.observations)
        values = fixed + shared @ (self._projection @ self.model.observations)
        reach = np.eye(k) - shared @ self._seen
        covariance = own - shared @ self._inverse @ shared.T + reach @ self._fixed @ reach.T
        return values, (covariance + covariance.T) / 2.0


def _mean_of_positive(mean: float, sigma: float) -> float:
    """Mean of what is positive of a normal distribution."""
    apart = mean / sigma
    if apart < -_FAR:
        return sigma / -apart  # the asymptote of the same
    density = math.exp(-apart * apart / 2.0) / math.sqrt(math.tau)
    return mean + sigma * density / (0.5 * math.erfc(-apart / math.sqrt(2.0)))


def random_walk(runs: int) -> Array:
    """Covariance (R + 1, R + 1) of a random walk that begins at nothing with the first run."""
    steps = np.arange(runs + 1.0)
    return np.asarray(np.minimum.outer(steps, steps))


def independent(runs: int) -> Array:
    """Covariance (R + 1, R + 1) of values that have nothing to do with each other."""
    return np.eye(runs + 1)
