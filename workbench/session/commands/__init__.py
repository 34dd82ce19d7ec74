"""Commands: everything that can be asked of a session, one file per subject; new files are found here."""

import pkgutil
from importlib import import_module

for _file in pkgutil.iter_modules(__path__, f"{__name__}."):
    import_module(_file.name)
