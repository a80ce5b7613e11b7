"""Which link was touched: a force on a link leaves the joints beyond it without torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.external_forces.wrenches import misfit
from robots.common.arrays import Array
from robots.geometry.chain import Chain


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a contact acts.

    Attributes:
        link: the first link on which a force can make this torque, counted from 1.
        reacting: joints that react, counted from 1.
        tool: whether a force at the tool point, without moment, makes this torque.
    """

    link: int
    reacting: tuple[int, ...]
    tool: bool

    def text(self, names: tuple[str, ...]) -> str:
        """Says it in a few words, with the joints' names (n,)."""
        link = f"link {self.link} (after {names[self.link - 1]})"
        if self.tool:
            return "tool" if self.link == len(names) else f"tool, or {link} or beyond"
        return link if self.link == len(names) else f"{link} or beyond"


@dataclass(frozen=True, kw_only=True, eq=False)
class Localiser:
    """Levels from which joints react, as the residual of a healthy robot has them.

    Attributes:
        joint: of each joint's scaled residual, squared (n,).
        link: of the distance to the torques that a force on each link can make (n,).
        tool: of the distance to those of a force at the tool point.
    """

    joint: Array
    link: Array
    tool: float

    def locate(self, chain: Chain, q: Array, residual: Array, covariance: Array, jacobian: Array) -> Place:
        """Finds the first link that explains a residual.

        Args:
            chain: the robot's joints.
            q: positions (n,) at that moment.
            residual: external torque (n,) [N m or N].
            covariance: of it (n, n).
            jacobian: of the tool point (6, n).
        """
        distances = link_misfits(chain, q[None], residual[None], covariance[None])[0]
        reacts = residual**2 / np.diag(covariance) > self.joint
        fits = np.flatnonzero(distances <= self.link)
        link = int(fits[0]) + 1 if len(fits) else len(residual)
        tool = float(misfit(residual[None], covariance[None], jacobian[None, :3])[0]) <= self.tool
        return Place(link=link, reacting=tuple((np.flatnonzero(reacts) + 1).tolist()), tool=tool)


def fit_localiser(chain: Chain, q: Array, residual: Array, covariance: Array, jacobian: Array) -> Localiser:
    """Takes the levels from samples of a healthy robot, arrays (N, ...) as `Localiser.locate` has them."""
    joints = residual**2 / np.einsum("tjj->tj", covariance)
    distances = link_misfits(chain, q, residual, covariance)
    # Share of a healthy robot's samples below the level from which a joint reacts.
    confidence = 0.99
    return Localiser(
        joint=np.quantile(joints, confidence, axis=0),
        link=np.quantile(distances, confidence, axis=0),
        tool=float(np.quantile(misfit(residual, covariance, jacobian[:, :3]), confidence)),
    )


def link_misfits(chain: Chain, q: Array, residual: Array, covariance: Array) -> Array:
    """Gives the squared distance (N, n) of residuals (N, n) from the torques that a wrench on each link can make.

    Those are the range of the transposed Jacobian of the link, whose columns beyond the link are zero.
    """
    poses = chain.transforms(q)  # (N, n, 4, 4)
    n = chain.n
    axes = np.stack([poses[:, j, :3, :3] @ np.asarray(chain.joints[j].axis) for j in range(n)], axis=1)
    origins = poses[:, :, :3, 3]
    result = np.empty(residual.shape)
    for link in range(n):
        jacobian = np.zeros((len(q), 6, n))
        for j in range(link + 1):
            if chain.joints[j].kind == "prismatic":
                jacobian[:, :3, j] = axes[:, j]
            else:
                jacobian[:, :3, j] = np.cross(axes[:, j], origins[:, link] - origins[:, j])
                jacobian[:, 3:, j] = axes[:, j]
        _, s, vt = np.linalg.svd(jacobian, full_matrices=False)
        # Orthonormal rows of the range, so that nearly singular places do not count as regular.
        # Singular values of a Jacobian below this share of the largest are rounding.
        rows = np.where(s[..., None] > 1e-6 * s[..., :1, None], vt, 0.0)
        result[:, link] = misfit(residual, covariance, rows)
    return result
