"""A mutant in a process that has loaded the original: new code for its functions, the new library for the old one."""

import gc
import inspect
import shutil
import sys
from pathlib import Path
from types import CodeType, FunctionType


def loaded_functions(folder: Path) -> dict[str, list[FunctionType]]:
    """Return all functions of modules below a folder, by file: found once, before the forks."""
    gc.unfreeze()  # tests/conftest.py freezes what is loaded when the tests are collected: it would not be listed
    found: dict[str, list[FunctionType]] = {}
    for f in gc.get_objects():
        if type(f) is FunctionType and f.__code__.co_filename.startswith(str(folder)):
            found.setdefault(f.__code__.co_filename, []).append(f)
    return found


def swap_python(path: Path, old: str, new: str, loaded: dict[str, list[FunctionType]]) -> bool:
    """Give the functions of a loaded module the code of its changed text; False where only a new start helps."""
    if str(path) not in loaded:
        return True  # it will be loaded from the changed file
    was, now = (_codes(compile(text, str(path), "exec")) for text in (old, new))
    if [c.co_qualname for c in was] != [c.co_qualname for c in now]:
        return False
    news = {a: b for a, b in zip(was, now, strict=True) if a != b}
    if any(not c.co_flags & inspect.CO_NEWLOCALS and not _holds(c, news) for c in news):
        return False  # the body of the module or of a class
    changed = [f for f in loaded[str(path)] if f.__code__ in news]
    for f in changed:
        f.__code__ = news[f.__code__]
    return bool(changed)


def _codes(code: CodeType) -> list[CodeType]:
    return [code, *(c for k in code.co_consts if isinstance(k, CodeType) for c in _codes(k))]


def _holds(code: CodeType, some: dict[CodeType, CodeType]) -> bool:
    """Whether a code differs because a code within it does."""
    return any(k in some for k in code.co_consts if isinstance(k, CodeType))


def swap_core(path: Path) -> None:
    """Load the library anew; block types that tests hold get its tables."""
    from hystfmu.core import library

    held = library.block_types()
    # the loader knows a file by its place on the disk
    library.PACKAGE = path.parent / "swapped"
    library.PACKAGE.mkdir(exist_ok=True)
    fresh = library.PACKAGE / path.name
    fresh.unlink(missing_ok=True)
    shutil.copyfile(path, fresh)
    for module in [m for name, m in list(sys.modules.items()) if name.startswith("hystfmu.")]:
        for value in list(vars(module).values()):
            if hasattr(value, "cache_clear"):
                value.cache_clear()
    types = library.block_types()
    for name, block in held.items():
        block.__dict__.update(types[name].__dict__)
