"""What extensions add to the package by name: choices of stages, variants, readers, commands, flags, datasets, rules.

A distribution adds an :class:`Extension` by an entry point of the group ``sepi.extensions``. It is looked for where a
name is not the core's own, or where all names are listed; docs/develop/extensions.md shows how to write one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, MutableMapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from sepi.errors import SepiError

if TYPE_CHECKING:
    from sepi.stage import Choice

GROUP = "sepi.extensions"
"""Group of the entry points."""

_T = TypeVar("_T")


class Extension(NamedTuple):
    """What an extension adds: names, and for most of them the module that is imported when the name is asked for.

    Attributes
    ----------
    choices : mapping of str to str
        ``STAGE.CHOICE`` to a module; its ``CHOICES[STAGE][CHOICE]`` is the :class:`sepi.stage.Choice`.
    variants : mapping of str to mapping
        Variant to its entry, as for :func:`sepi.variants.variant_from`: methods that ``snakemake comparison`` computes.
    on_request : collection of str
        Variants that need files of the user; ``snakemake comparison`` leaves them out.
    readers : mapping of str to str
        Word for ``--format`` to a module; its ``FORMATS[WORD]`` is the :class:`sepi.io.readers.formats.Format`.
    commands : mapping of str to (str, str)
        Command of ``sepi`` to a module, whose function of that name is the click command, and its line in the list.
    flags : mapping of str to str
        ``COMMAND --FLAG`` to a module, whose ``extended`` takes the core's click command and returns one with the flag.
    datasets : mapping of str to str
        Key of ``config.yaml`` to a module, whose ``Dataset`` is the :class:`sepi.workflow.datasets.Dataset`.
    scenes : mapping of str to str
        Name to a module, whose ``write_scene`` adds to the pictures of each scene of a report, and may write its part
        of a page, as :func:`sepi.report.figures.command` calls it.
    names : mapping of str to str
        Name in ``sepi`` to the module that has it.
    rules : collection of str
        Modules, each of a ``rules.smk`` beside its ``__init__.py``, which the workflow includes.

    Examples
    --------
    >>> from sepi.registry import Extension
    >>> extension = Extension(choices={"optimize.median": "mine.method"}, variants={"median": {"base": "fast"}})
    >>> list(extension.variants), extension.commands
    (['median'], {})
    """

    choices: Mapping[str, str] = {}
    variants: Mapping[str, Mapping[str, Any]] = {}
    on_request: Collection[str] = ()
    readers: Mapping[str, str] = {}
    commands: Mapping[str, tuple[str, str]] = {}
    flags: Mapping[str, str] = {}
    datasets: Mapping[str, str] = {}
    scenes: Mapping[str, str] = {}
    names: Mapping[str, str] = {}
    rules: Collection[str] = ()


@cache
def extensions() -> dict[str, Extension]:
    """Name to extension, of all that are installed; one whose module is gone counts as not installed.

    Raises
    ------
    SepiError
        If the module of one cannot be imported, or has no such extension.
    """
    from importlib.metadata import entry_points

    found: dict[str, Extension] = {}
    for point in entry_points(group=GROUP):
        if point.name in found:
            raise SepiError(f"extension {point.name}: two installed packages have one of this name; remove one of them")
        try:
            found[point.name] = point.load()
        except Exception as error:
            if isinstance(error, ModuleNotFoundError) and f"{point.module}.".startswith(f"{error.name}."):
                continue
            raise SepiError(f"extension {point.name}: cannot be loaded from {point.value}: {error}") from error
    return found


@cache
def added(kind: str) -> dict[str, Any]:
    """What all extensions add of a kind, a field of :class:`Extension` with names.

    Raises
    ------
    SepiError
        If two extensions add the same name.
    """
    owners: dict[str, str] = {}
    found: dict[str, Any] = {}
    for extension, adds in extensions().items():
        for name, what in getattr(adds, kind).items():
            if name in found:
                raise SepiError(f"extensions {owners[name]} and {extension}: both add '{name}' to {kind}")
            found[name], owners[name] = what, extension
    return found


class Known(MutableMapping[str, _T]):
    """The core's own by name, then what extensions add, which is loaded on access.

    Parameters
    ----------
    kind : str
        Field of :class:`Extension`.
    own : mapping
        The core's own; a name ``none`` is listed last.
    loaded : callable, optional
        Makes the value of a name and of what the extension says of it; default: that.
    prefix : str
        What the extension's names begin with, and those here do not.
    """

    def __init__(
        self, kind: str, own: Mapping[str, _T], loaded: Callable[[str, Any], _T] | None = None, prefix: str = ""
    ) -> None:
        self._kind, self._own, self._loaded, self._prefix = kind, dict(own), loaded, prefix
        self._found: dict[str, _T] = {}

    def _added(self) -> dict[str, Any]:
        of_here = {key: what for key, what in added(self._kind).items() if key.startswith(self._prefix)}
        return {key.removeprefix(self._prefix): what for key, what in of_here.items()}

    def __getitem__(self, name: str) -> _T:
        if name in self._own:
            return self._own[name]
        if name not in self._found:
            what = self._added()[name]
            self._found[name] = what if self._loaded is None else self._loaded(name, what)
        return self._found[name]

    def __setitem__(self, name: str, value: _T) -> None:
        self._own[name] = value

    def __delitem__(self, name: str) -> None:
        del self._own[name]

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(dict.fromkeys([*self._own, *self._added()]), key="none".__eq__))

    def __len__(self) -> int:
        return len(list(iter(self)))


def stage_choices(stage: str, own: Mapping[str, Choice]) -> Known[Choice]:
    """The choices of a stage by name: its own, and those of extensions, whose modules are imported on access."""

    def loaded(name: str, module: str) -> Choice:
        choice: Choice = import_module(module).CHOICES[stage][name]
        return choice

    return Known("choices", own, loaded, f"{stage}.")
