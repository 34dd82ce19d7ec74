"""What somebody brings who sees the page for the first time: own files, and clicks that are counted."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from generator import VirtualArm
from playwright.sync_api import Page
from scipy.spatial.transform import Rotation

from workbench.views.page.app import App

DRAWN = "() => (window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0) > 3000"
LONG = 120_000
"""How long anything may take [ms]."""


@dataclass(eq=False)
class Visit:
    """A page of an app that asks what one has; counts what its user does."""

    page: Page
    app: App
    clicks: int = 0

    @classmethod
    def open(cls, page: Page, app: App) -> "Visit":
        page.goto(f"{app.url}/?fixedDpr=1")
        page.wait_for_function(DRAWN, timeout=LONG)
        return cls(page, app)

    def press(self, label: str) -> None:
        """A button that has to be in view without scrolling."""
        button = self.page.get_by_role("button", name=label, exact=True).first
        button.wait_for(timeout=LONG)
        top = button.bounding_box()["y"]
        assert 0 <= top < self.page.viewport_size["height"] - 10, f"'{label}' is out of view"
        button.click(timeout=LONG)
        self.clicks += 1

    def drop(self, which: int, path: Path) -> None:
        """A file on a button of the card, which is no click."""
        self.page.locator(".mantine-Modal-body input[type=file]").nth(which).set_input_files(path)

    def says(self, text: str, testid: str = "hint") -> str:
        """Wait until the page says so; returns all that it says there."""
        place = self.page.locator(f'[data-testid="{testid}"]', has_text=text).first
        place.wait_for(timeout=LONG)
        return place.inner_text()


def own_files(folder: Path) -> tuple[Path, Path]:
    """A URDF and a CSV of an arm that is off by a millimetre and gives way at its second joint."""
    rng, turn = np.random.default_rng(11), np.pi / 2
    chain = np.array(
        [
            (0.0, 0.152, 0.0, turn, 0.0),
            (0.0, 0.0, -0.41, 0.0, 0.0),
            (0.0, 0.0, -0.37, 0.0, 0.0),
            (0.0, 0.115, 0.0, turn, 0.0),
            (0.0, 0.09, 0.0, -turn, 0.0),
            (0.0, 0.085, 0.0, 0.0, 0.0),
        ]
    )
    limits = np.tile([-2.0 * np.pi, 2.0 * np.pi], (6, 1))
    masses, coms = np.array([9.0, 8.0, 5.0, 3.0, 2.0, 1.0]), np.zeros((6, 3))
    nominal = VirtualArm("dh", chain, limits=limits, masses=masses, coms=coms)
    actual = nominal.perturbed(rng, length=1e-3, angle=np.deg2rad(0.3))
    q = 0.4 * nominal.random(rng, 120)
    soft = np.zeros((6, 3))
    soft[1, 2] = 6e-5
    p, r = actual.measure(q, rng, 2e-5, 1e-4, actual.sag(q, compliance=soft))
    heads = [*(f"q{k}[deg]" for k in range(1, 7)), "x[mm]", "y[mm]", "z[mm]", "qw", "qx", "qy", "qz"]
    wxyz = Rotation.from_matrix(r).as_quat()[:, [3, 0, 1, 2]]
    rows = np.hstack([np.rad2deg(q), 1e3 * p, wxyz])
    paths = folder / "own.urdf", folder / "measured.csv"
    paths[0].write_text(_urdf(nominal))
    paths[1].write_text("\n".join([",".join(heads), *(",".join(f"{v:.9g}" for v in row) for row in rows)]))
    return paths


INERTIA = '<inertia ixx="1e-2" ixy="0" ixz="0" iyy="1e-2" iyz="0" izz="1e-2"/>'


def _urdf(arm: VirtualArm) -> str:
    """The arm's URDF: before each joint what follows the joint before it."""
    lines, tail = ['<robot name="own">', '<link name="base"/>'], (0.0, 0.0, 0.0)
    ends = [*zip(arm.table.tolist(), arm.limits.tolist(), arm.masses.tolist(), strict=True), None]
    for k, end in enumerate(ends, start=1):
        a, d, alpha = tail
        name, kind = (f"link{k}", "revolute") if end else ("flange", "fixed")
        before = f"link{k - 1}" if k > 1 else "base"
        mass = f'<inertial><mass value="{end[2]}"/>{INERTIA}</inertial>' if end else ""
        lines += [
            f'<link name="{name}">{mass}</link>',
            f'<joint name="joint{k}" type="{kind}"><parent link="{before}"/><child link="{name}"/>',
            f'<origin xyz="{a} 0 {d}" rpy="{alpha} 0 0"/><axis xyz="0 0 1"/>',
        ]
        if end:
            (_, d, a, alpha, _), (low, high) = end[:2]
            tail = a, d, alpha
            lines.append(f'<limit lower="{low}" upper="{high}" effort="0" velocity="0"/>')
        lines.append("</joint>")
    return "\n".join([*lines, "</robot>"])
