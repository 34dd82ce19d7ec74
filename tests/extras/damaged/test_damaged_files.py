"""Files of strangers, damaged: each is read or is one sentence, whatever was done to it.

`MUTANTS=50000 pytest tests/extras/damaged` takes minutes; the few of every run take seconds.
"""

import os
import random
import warnings

from damaged_files import damaged, readers

from workbench.base.errors import WorkbenchError

MUTANTS = int(os.environ.get("MUTANTS", 400))
LONGEST = 600
"""Maximum length of a sentence."""


def test_a_damaged_file_is_one_sentence(tmp_path):
    wrong, sound = {}, readers(tmp_path)
    for kind, (name, content, read) in sound.items():
        path = tmp_path / name
        path.write_bytes(content)
        read(path)  # the sound one is read
        for seed in range(MUTANTS // len(sound)):
            path.write_bytes(damaged(content, random.Random(f"{kind} {seed}")))
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    read(path)
            except WorkbenchError as error:
                if len(str(error)) > LONGEST or "\n" in str(error):
                    wrong[kind, seed] = str(error)
            except Exception as error:
                wrong[kind, seed] = repr(error)
    assert not wrong
