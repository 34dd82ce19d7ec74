"""The palette: one meaning, one colour."""

from workbench.session.state import TargetState

LINK = (233, 237, 242)
JOINT = (92, 112, 146)
FOOT = (92, 112, 146)
PROBE = (120, 130, 146)
PLATE = (203, 210, 220)
GHOST = (245, 158, 11)

REACHED = (45, 155, 120)
SELECTED = (37, 99, 235)
BLOCKED = (217, 119, 6)
OUT_OF_REACH = (220, 68, 55)

REGION = (100, 116, 139)
GRID = (214, 220, 228)
GRID_SECTION = (186, 195, 208)

BEFORE = (220, 68, 55)
AFTER = (45, 155, 120)
ARROW_BEFORE = (168, 26, 170)
ARROW_AFTER = (8, 130, 170)
MARK = (250, 204, 21)


def css(colour: tuple[int, int, int]) -> str:
    """The colour for HTML."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def target_colour(state: TargetState, *, selected: bool) -> tuple[int, int, int]:
    """Colour of a target by its state; trouble shows even where it is selected."""
    if not state.reached:
        return OUT_OF_REACH
    if not state.clear:
        return BLOCKED
    return SELECTED if selected else REACHED
