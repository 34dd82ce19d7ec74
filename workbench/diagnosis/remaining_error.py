"""The error that a diagnosed arm leaves: what it follows, and how much of it is known to be noise."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arm.chain import Chain
from workbench.base.advice import beside
from workbench.base.wording import joint_list
from workbench.diagnosis.drivers.driver import Shape
from workbench.diagnosis.drivers.evidence import FollowedDriver
from workbench.identification.joint_reading_noise import Readings
from workbench.identification.problem import Noise

MAX_NOISE_RATIO = 1.25
"""Maximum ratio of the residual to the known noise at which it still counts as noise."""
MIN_MAJOR_SHARE = 0.5
"""Share of the remaining error due to joint readings above which the message starts with it."""
LAGGED = "no arm fits joints and places of different times"
CHANGED = "the arm changed among the rows, and the saved one lies between: fit the later rows alone"
"""Why an arm that was fitted to all rows should not be used."""
WORN = "check for friction wind-up, a worn coupling or a poor encoder"
UNSAID = "check whether the load changed from row to row, which no column 'payload' says; if it didn't,"


@dataclass(frozen=True, eq=False, kw_only=True)
class RemainingError:
    """The residuals of the diagnosed arm.

    Args:
        noise: Their standard deviation per axis [m], [rad].
        known_noise: Noise known beforehand: as stated in the rows, else as given, else from repeats; None if
            unknown.
        joint_noise: Noise of joint readings, as far as they show any; None if the readings seem exact.
        followed: Drivers that they follow.
        places: Two places in which they lie instead, or a seat whose rows do; empty without.
        is_loose: Whether it is a seat, which leaves open what the others follow.
    """

    noise: Noise
    known_noise: Noise | None
    joint_noise: Readings | None
    followed: Sequence[FollowedDriver]
    places: str
    is_loose: bool = False

    @property
    def noise_ratio(self) -> float:
        """Ratio of the residuals to the known noise, of positions or orientations; NaN if unknown."""
        if self.known_noise is None:
            return np.nan
        ratios = np.array(self.noise[:2]) / np.array(self.known_noise[:2])
        return float(np.max(ratios, initial=0.0, where=np.isfinite(ratios)))

    @property
    def is_centre(self) -> bool:
        """Whether what is left is that a payload hangs elsewhere, and nothing tells of more."""
        alone = all(f.shape is Shape.HANGS for f in self.followed)
        return bool(self.followed) and alone and not self.noise_ratio > MAX_NOISE_RATIO

    @property
    def is_more_than_noise(self) -> bool:
        """Whether something is left to explain."""
        if np.isnan(self.noise_ratio):
            return bool(self.followed or self.places) and not self.is_centre
        return self.noise_ratio > MAX_NOISE_RATIO

    def scattering(self, unsure: Collection[int] = ()) -> Readings | None:
        """Noise of joint readings where it is most of the error, unless these joints are `unsure`."""
        noise = self.joint_noise
        if noise is None or noise.share <= MIN_MAJOR_SHARE or self.followed or self.places:
            return None
        return noise if {*unsure}.isdisjoint(noise.joints_that_scatter) else None

    @property
    def is_unexplained(self) -> bool:
        """Whether something is left to explain: noise of readings has one size for joints that turn, and one
        for those that slide; other scatter is a joint's own."""
        noise = self.scattering()
        if self.is_more_than_noise or noise is None or noise.digit:
            return self.is_more_than_noise
        return bool(noise.joints_that_scatter) or len({*noise.sigma} - {0.0}) > 2

    @beside("the note on joint readings", "")
    def joint_noise_warning(
        self, chain: Chain, unsure: Collection[int] = (), soft: Collection[int] = ()
    ) -> str:
        """A sentence if noise of the joint readings dominates, as in `scattering`; empty otherwise.

        A load that changes unsaid moves `soft` joints as if their readings scattered.
        """
        noise = self.scattering(unsure)
        if noise is None:
            return ""
        advice = "let the arm settle before reading its joints, or average several readings"
        if noise.joints_that_scatter:
            advice = WORN
        if noise.digit:
            worst = joint_list([int(np.argmax(noise.sigma))]) if noise.joints_that_scatter else "them"
            advice = f"the file gives {worst} to {noise.digit:g}° only, so record more digits"
        size, part = noise.text(chain), f"{100 * noise.share:.0f} %"
        if not (noise.digit or {*soft}.isdisjoint(noise.joints_that_scatter)):
            alike = f"{part} of the remaining error is as if joint readings scattered by {size}"
            return f"{alike}: {UNSAID} {WORN}. "
        return f"The joint readings scatter by {size}, {part} of the remaining error: {advice}. "

    @beside("the text on the remaining error", "was not described")
    def text(self, chain: Chain, said: Sequence[FollowedDriver] = (), unsure: Collection[int] = ()) -> str:
        """Description that continues a sentence: `agrees with the known noise (0.05 mm per axis)`.

        Args:
            said: Drivers that were named before.
            unsure: Joints whose error isn't understood.
        """
        text, drivers = self._compared(unsure), {f.driver for f in said}
        if self.is_centre:
            return f"is where the payload hangs: {self.noise.text} per axis"
        if self.followed:
            more = [f.text for f in self.followed if f.driver not in drivers]
            return f"{text}: it {' and '.join(more) or 'still does'}"
        if self.places:
            return f"{text}: {self.places}"
        if self.joint_noise is None or self.joint_noise.share > MIN_MAJOR_SHARE:
            return text
        size, part = self.joint_noise.text(chain), f"{100 * self.joint_noise.share:.0f} %"
        return f"{text}; {part} of it resembles noise of the joint readings ({size})"

    def _compared(self, unsure: Collection[int]) -> str:
        """The remainder compared with the known noise, if any."""
        size = f"{self.noise.text} per axis"
        if self.known_noise is None:
            if self.is_more_than_noise:
                return "has structure that no known effect explains"
            if self.scattering(unsure) is not None:
                return f"is mostly that of the joint readings: {size}"
            return f"follows nothing that was tried: {size} of unknown origin"
        known = f"the known noise ({self.known_noise.text} per axis)"
        if self.is_more_than_noise:
            return f"is {self.noise_ratio:.1f} times what {known} explains, {size} of unknown origin"
        return f"agrees with {known}" if self.noise_ratio * MAX_NOISE_RATIO > 1.0 else f"is less than {known}"
