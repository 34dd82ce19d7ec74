"""Region: the workspace cuboid of a calibration, and the cubes that it is divided into.

The cubes are those of ARIA §4.2: side L, counted along x, y, z from the minimum corner. Where L does not
divide an edge the cubes are made slightly smaller along it, so that whole cubes fill the cuboid.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.arguments import Length, admit
from workbench.base.errors import OptionError
from workbench.base.types import Vector3, frozen


@dataclass(frozen=True, eq=False, kw_only=True)
class Region:
    """A cuboid along the axes of the robot's base.

    Args:
        min: Lower corner [m].
        max: Upper corner [m].
        cube: Maximum side of a cube [m].
    """

    min: Vector3
    max: Vector3
    cube: Length = 0.05

    def __post_init__(self):
        admit(self)
        for axis in range(3):
            if not self.min[axis] < self.max[axis]:
                raise OptionError(
                    f"the region is empty along {'xyz'[axis]}: min {self.min[axis]:g} m is not below max "
                    f"{self.max[axis]:g} m; give the smaller corner as min",
                    option="max",
                    found="xyz"[axis],
                )
        if not self.cube > 0:
            text = f"the side of the region's cubes must be positive, got {self.cube:g} m"
            raise OptionError(text, option="cube", found=self.cube)
        for corner in ("min", "max"):
            object.__setattr__(self, corner, frozen(np.array(getattr(self, corner), float)))

    @cached_property
    def size(self) -> Vector3:
        """Edges of the cuboid [m]."""
        return frozen(self.max - self.min)

    @cached_property
    def shape(self) -> tuple[int, int, int]:
        """Number of cubes along each edge."""
        x, y, z = (max(int(np.ceil(edge / self.cube - 1e-9)), 1) for edge in self.size)
        return x, y, z

    @property
    def cube_text(self) -> str:
        """The requested side and, if it does not divide the edges, the size that fills them."""
        edges = 1e3 * self.size / self.shape
        requested = f"{1e3 * self.cube:g} mm"
        if np.allclose(edges, 1e3 * self.cube, rtol=1e-6):
            return f"cubes of {requested}"
        text = " × ".join(f"{edge:.4g}" for edge in edges)
        return f"cells of {text} mm (cubes of {requested} do not fill the region)"

    @property
    def cubes(self) -> int:
        """Number of cubes."""
        return int(np.prod(self.shape))

    @cached_property
    def centres(self) -> Float[np.ndarray, "cubes 3"]:
        """Centres of all cubes [m], in the order in which `cells` counts them: z fastest."""
        grid = np.indices(self.shape).reshape(3, -1).T
        return frozen(self.min + (grid + 0.5) * self.size / self.shape)

    def contains(self, points: Float[np.ndarray, "rows 3"]) -> Bool[np.ndarray, " rows"]:
        """Which points [m] lie inside or on the boundary."""
        return np.all((points >= self.min) & (points <= self.max), axis=-1)

    def cells(self, points: Float[np.ndarray, "rows 3"]) -> Int[np.ndarray, " rows"]:
        """Number of the cube that each point [m] lies in, an index into `centres`; −1 outside."""
        index = np.floor((points - self.min) / self.size * self.shape).astype(np.int64)
        flat = np.ravel_multi_index(index.T, self.shape, mode="clip")
        return np.where(self.contains(points), flat, -1)

    def sample(self, rows: int, *, rng: np.random.Generator) -> Float[np.ndarray, "rows 3"]:
        """Points spread evenly at random [m]."""
        return rng.uniform(self.min, self.max, (rows, 3))
