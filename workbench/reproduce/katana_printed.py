"""What the Katana thesis works with: its 17 constants, and numbers that it prints."""

CONSTANTS = (
    *(f"joint{i}.theta" for i in range(1, 6)),
    *(f"joint{i}.alpha" for i in range(1, 6)),
    "fixed1.alpha",
    *("joint3.beta", "joint4.beta", "joint3.a", "joint4.a", "joint5.d", "fixed1.d"),
)
"""ΔE of eq. (3.5) in its order: θ1 … θ5, α0 … α5, β2, β3, a3, a4, d5, d6; our joint i holds α_{i−1}."""
PRINTED_INFLUENCE = {"joint2.theta": 0.34e-3, "joint3.alpha": 0.59 * 0.34e-3}
"""Mean influences read from fig. 3.8 [m]: θ2 in §3.6, α2 from its k8 = 0.59."""
