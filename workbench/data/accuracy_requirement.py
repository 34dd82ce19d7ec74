"""The requirement of a task on a calibrated arm: ARIA eq. (3), computed and checked row by row.

A needle is pushed in by l from where the arm holds it. The arm is off by d = [d_x, d_y, d_z] there, and
its orientation by Δφ_Y and Δφ_Z across the needle (a turn about the needle moves nothing). Each turn moves
the tip by the chord 2 l sin(Δφ/2); both, equal and at right angles, by √2 times that. In the worst case all
of it adds to d = ‖d‖, and must stay inside the target's radius r_t:

    d + 2√2 l_max sin(Δφ/2) ≤ r_t        ⇒        Δφ_Y = Δφ_Z = 2 arcsin((r_t − d) / (2√2 l_max))

With r_t = 5 mm, l_max = 0.2 m and 1 mm along each axis, d = √3 mm = 1.732 mm, so that
Δφ = 2 arcsin(3.268 / 565.69) = 0.01155 rad = 0.662°: the paper's 0.66° (d is the norm of the three axes;
with d = 1 mm it would be 0.81°). Like the paper's §4.4 the check asks every entry of Δp and Δφ to keep
its limit, whichever axis of the measuring frame it lies along.

Source: ARIA §2.4, eq. (3), Fig. 4; the derivation is ours ("it is easy to show").
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from workbench.base.arguments import Angle, Length, admit
from workbench.base.errors import OptionError
from workbench.data.prediction import RowComponents
from workbench.report.result_fields import POSE


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Maximum errors of an arm at every pose.

    Args:
        position: Maximum position error [m].
        rotation: Maximum orientation error [rad]; None: not judged.
        per_axis: Whether each axis alone has to keep it, as ARIA eq. (3) asks.

    Raises:
        OptionError: a limit that is not positive.
    """

    position: Length
    rotation: Angle | None = None
    per_axis: bool = False

    def __post_init__(self):
        admit(self)
        if not self.position > 0.0 or not (self.rotation is None or self.rotation > 0.0):
            wrong = f"wanted errors must be positive, got {self.text}"
            raise OptionError(wrong, option="wanted", found=self.text)

    @property
    def position_text(self) -> str:
        """The limit of positions alone."""
        return f"{1e3 * self.position:.3g} mm{' per axis' if self.per_axis else ''}"

    @property
    def text(self) -> str:
        angle = "" if self.rotation is None else f" and {np.rad2deg(self.rotation):.2g}°"
        return f"{self.position_text}{angle}"

    def json(self) -> dict[str, float | bool | None]:
        return {**POSE.json(self), "per_axis": self.per_axis}

    def within(self, errors: RowComponents) -> Bool[np.ndarray, " rows"]:
        """Rows that keep it, as far as they were measured."""
        return ~(self.used_by(errors.position, errors.rotation) > 1.0)

    def used_by(
        self, position: Float[np.ndarray, "*rows 3"], rotation: Float[np.ndarray, "*rows 3"]
    ) -> Float[np.ndarray, "*rows"]:
        """The largest share of what is allowed, of all that was measured; above 1 they don't keep it."""
        parts = [position / self.position]
        parts += [rotation / self.rotation] if self.rotation else []
        if self.per_axis:
            return np.fmax.reduce(np.abs(np.concatenate(parts, axis=-1)), axis=-1)
        return np.fmax.reduce([np.linalg.norm(part, axis=-1) for part in parts])

    def within_by_norms(
        self, position: float | Float[np.ndarray, " rows"], rotation: float | Float[np.ndarray, " rows"]
    ) -> Bool[np.ndarray, "*rows"]:
        """Which errors keep it that are known by their lengths alone: predicted ones, distances, markers.

        Where each axis has its limit, the whole length is held against that of one axis. That is on the safe
        side, as no entry is longer than its vector; √3 times as much would do only if all axes shared alike.

        Args:
            position: Lengths ‖d‖ of position errors, or their root mean square [m]; NaN keeps nothing.
            rotation: Angles likewise [rad]; what was not measured (NaN) keeps it.
        """
        turned = np.inf if self.rotation is None else self.rotation
        return np.asarray((position <= self.position) & ~np.greater(rotation, turned))


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """Allowed deviation of the tool.

    Args:
        radius: Radius r_t of what the tip has to hit [m].
        insertion: Maximum distance l_max from the tool to the tip [m].
        per_axis: Maximum error of the tool's position along each axis [m].

    Raises:
        OptionError: a length that is not positive, or a position error that alone misses the target.
    """

    radius: Length = 5e-3
    insertion: Length = 0.2
    per_axis: Length = 1e-3

    def __post_init__(self):
        admit(self)
        if not (self.radius > 0 and self.insertion > 0 and self.per_axis > 0):
            sizes = f"radius {self.radius:g} m, insertion {self.insertion:g} m, {self.per_axis:g} m per axis"
            raise OptionError(f"a requirement needs positive lengths, not {sizes}")
        if self.displacement >= self.radius:
            text = f"{1e3 * self.per_axis:g} mm along each axis add up to {1e3 * self.displacement:.3g} mm"
            radius = f"not less than the target's radius of {1e3 * self.radius:g} mm"
            raise OptionError(f"{text}, {radius}; require less per axis")

    @property
    def displacement(self) -> float:
        """Worst position error d, all three axes at their limit [m]."""
        return float(np.sqrt(3.0)) * self.per_axis

    @property
    def angle(self) -> float:
        """Maximum orientation error about each axis [rad], eq. (3)."""
        sine = (self.radius - self.displacement) / (2.0 * np.sqrt(2.0) * self.insertion)
        return 2.0 * float(np.arcsin(min(sine, 1.0)))

    @property
    def wanted(self) -> Wanted:
        """The two limits: with such errors a needle keeps within the radius, whatever their direction."""
        return Wanted(position=self.per_axis, rotation=self.angle, per_axis=True)


def default_requirement(name: str) -> Wanted | None:
    """The default requirement for an arm by name: eq. (3) for ARIA, none for others."""
    return Requirement().wanted if name == "ARIA" else None
