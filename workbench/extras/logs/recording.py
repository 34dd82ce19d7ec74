"""The choice among bodies, topics or frames of a recording."""

from workbench.base.errors import OptionError
from workbench.base.remedy import remedy
from workbench.base.wording import listed
from workbench.data.readers.columns_option import Naming


def chosen(names: list[str], naming: Naming | None, what: str, key: str) -> str:
    """The only name, or that which `--columns "key=NAME"` chooses."""
    pairs = naming.pairs if naming is not None else ()
    wanted = next((pair.right[0].name for pair in pairs if pair.left.name == key), None)
    if wanted in names:
        return wanted
    if wanted is None and len(names) == 1:
        return names[0]
    why = f"'{wanted}' is none of them" if wanted is not None else "more than one"
    elsewhere = "choose with 'workbench identify --columns', or load a CSV here"
    how = remedy(f'choose with columns="{key}=NAME" (--columns)', page=elsewhere)
    raise OptionError(f"{what} {listed(names)}: {why}; {how}")
