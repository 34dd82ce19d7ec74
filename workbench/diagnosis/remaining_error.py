"""The error that a diagnosed arm leaves: how much of it is noise, of the instrument or of joint readings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arm.chain import Chain
from workbench.base.advice import beside
from workbench.diagnosis.claims.structure import Structure
from workbench.diagnosis.search.evidence import Offer
from workbench.identification.joint_reading_noise import Readings
from workbench.identification.problem import Noise

MAX_NOISE_RATIO = 1.25
"""Maximum ratio of the residual to the known noise at which it still counts as noise."""
MIN_MAJOR_SHARE = 0.5
"""Share of the remaining error due to joint readings above which the message starts with it."""
LET_SETTLE = "let the arm settle before reading its joints, or average several readings"
"""Advice if all joints scatter."""
CHECK_DRIVES = "check for friction wind-up, a worn coupling or a poor encoder"
"""Advice if only some joints do."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RemainingError:
    """The residuals of the diagnosed arm.

    Args:
        noise: Their standard deviation per axis [m], [rad].
        known_noise: Noise known beforehand: as stated in the rows, else as given, else from repeats; None if
            unknown.
        joint_noise: Noise of joint readings, as far as they show any; None if the readings seem exact.
        structure: Axes along which neighbouring rows have similar residuals; None if the test failed.
        distrusted: Significant candidates that cross-validation did not confirm.
    """

    noise: Noise
    known_noise: Noise | None
    joint_noise: Readings | None
    structure: Structure | None
    distrusted: Sequence[Offer]

    @property
    def is_structured(self) -> bool:
        """Whether there is structure apart from joints whose readings scatter."""
        scatter = self.joint_noise is not None and self.joint_noise.joints_that_scatter
        axes = () if self.structure is None else self.structure.found
        return any(not (scatter and axis.is_of_joint) for axis in axes)

    @property
    def noise_ratio(self) -> float:
        """Ratio of the instrument's part to the known noise; NaN if none is known."""
        of_instrument = self.noise.position
        if self.joint_noise is not None and not self.is_structured:
            of_instrument *= np.sqrt(1.0 - self.joint_noise.share)
        return np.nan if self.known_noise is None else of_instrument / self.known_noise.position

    @property
    def is_more_than_noise(self) -> bool:
        """Whether something is left to explain."""
        if np.isnan(self.noise_ratio):
            return bool(self.is_structured or self.distrusted)
        return self.noise_ratio > MAX_NOISE_RATIO

    @beside("the note on joint readings", "")
    def joint_noise_warning(self, chain: Chain) -> str:
        """A sentence if noise of the joint readings dominates; empty otherwise."""
        noise = self.joint_noise
        if noise is None or self.is_structured or noise.share <= MIN_MAJOR_SHARE:
            return ""
        advice = CHECK_DRIVES if noise.joints_that_scatter else LET_SETTLE
        if noise.digit:
            advice = f"the file gives them to {noise.digit:g}° only, so record more digits"
        size, part = noise.text(chain), f"{100 * noise.share:.0f} %"
        return f"The joint readings scatter by {size}, {part} of the remaining error: {advice}. "

    @beside("the text on the remaining error", "was not described")
    def text(self, chain: Chain) -> str:
        """Description that continues a sentence: `agrees with the known noise (0.05 mm per axis)`."""
        text = self._compared()
        if self.structure is not None and self.is_structured:
            text += f": it {self.structure.sentence}"
        if self.joint_noise is None or (not self.is_structured and self.joint_noise.share > MIN_MAJOR_SHARE):
            return text
        size, part = self.joint_noise.text(chain), f"{100 * self.joint_noise.share:.0f} %"
        if self.is_structured:
            return (
                f"{text}; {part} of it resembles joint-reading noise ({size}) or an effect that was not found"
            )
        return f"{text}; noise of the joint readings ({size}) accounts for {part} of it"

    def _compared(self) -> str:
        """The remainder compared with the known noise, or with chance."""
        ratio = self.noise_ratio
        if self.known_noise is not None and np.isfinite(ratio):
            known = f"the known noise ({1e3 * self.known_noise.position:.2g} mm per axis)"
            if self.is_more_than_noise:
                return f"is {ratio:.1f} times what {known} explains"
            return f"agrees with {known}" if ratio * MAX_NOISE_RATIO > 1.0 else f"is less than {known}"
        if self.is_more_than_noise:
            return "has structure that no known effect explains"
        if self.structure is None:
            return "is attributed to noise, as its structure could not be tested"
        if self.structure.found:
            return f"{self.structure.sentence} in the readings of joints that scatter"
        if self.structure.tests:
            return "shows no structure and is attributed to noise"
        return "is attributed to noise: too few rows to test for structure"
