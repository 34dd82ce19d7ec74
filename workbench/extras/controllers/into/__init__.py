"""The calibrated arm in a model file of the user's own: frames get new numbers, no other byte.

    D_k = X C_k N_k⁻¹ X⁻¹    how far the calibration moved what hangs on joint k (and the flange)
    new pose = (D_ref G_ref)⁻¹ D_own G_own    of every frame that the file gives relative to another

N and C are nominal and calibrated frames at zero, G those of the file, X the arm's base in it. D_k is
then brought exactly onto the calibrated joint's axis, as the file's nominal numbers may be rounded; as
T(q) = Π exp(ξ_k q_k) T(0), axes and flange at zero are all that counts.
"""
