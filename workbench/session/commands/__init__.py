"""Commands: all requests to a session, one file per subject; new files are discovered automatically."""

import pkgutil
from importlib import import_module

for _file in pkgutil.iter_modules(__path__, f"{__name__}."):
    import_module(_file.name)
