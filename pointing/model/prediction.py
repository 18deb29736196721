"""Where a model sees a star, and how well it knows that.

What is stated is of components: each of dX along axis 1 and dY along axis 2 lies within its own σ in 68.3 % of all
cases. `sigma` is the root mean square of their distance, √(σ_X² + σ_Y²): between 63.2 % (the error goes all ways
alike) and 68.3 % (it goes one way only) of all places lie within it, because a distance is spread by Rayleigh's law
and a component by Gauss's.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pointing.model.functions import Real
from pointing.model.pointing_model import PointingModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Prediction:
    """A model with the uncertainty of its coefficients.

    Parameters
    ----------
    model : PointingModel
        The model.
    free : tuple of bool
        Which of its terms are uncertain.
    covariance : (k, k) array
        Of the free terms' coefficients, square radians.
    scatter : float
        Standard deviation of one component of a single observation, radians.
    """

    model: PointingModel
    free: tuple[bool, ...]
    covariance: Array
    scatter: float

    def place_covariance(self, lon: Real, lat: Real, *, observation: bool = False) -> Array:
        """Covariance of the model's place on the sky at mechanical coordinates.

        Parameters
        ----------
        lon, lat : float or array
            Of the telescope's axes, radians.
        observation : bool
            Of a single observation instead, its scatter included.

        Returns
        -------
        (3, …) array
            Square radians: XX, XY, YY, X along axis 1 and Y along axis 2.
        """
        _, _, jacobian = self.model.star_and_jacobian(lon, lat)
        free = [pair for pair, is_free in zip(jacobian.by_coefficient, self.free, strict=True) if is_free]
        shape = np.shape(lat)
        rows = np.array([[np.broadcast_to(part, shape) for part in pair] for pair in free]).reshape(-1, 2, *shape)
        found = np.einsum("ic...,ij,jd...->cd...", rows, self.covariance, rows, optimize=True)
        more = self.scatter**2 if observation else 0.0
        return np.stack((found[0, 0] + more, found[0, 1], found[1, 1] + more))

    def sigma(self, lon: Real, lat: Real, *, observation: bool = False) -> Real:
        """Root mean square distance on the sky between the model's place and the true one, √(σ_X² + σ_Y²).

        Parameters and units are those of `place_covariance`; radians.
        """
        xx, _, yy = self.place_covariance(lon, lat, observation=observation)
        return np.sqrt(xx + yy)
