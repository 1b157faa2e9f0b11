"""The stages in order, their choices, and the variants, which name a choice for each stage.

:mod:`sepi.variants.built_in` lists the built-in variants.

Examples
--------
>>> from sepi.variants import STAGES, VARIANT_ENTRIES, VARIANTS
>>> {"best", "fast", "paper", "spo"} <= set(VARIANTS)
True
>>> VARIANTS["paper"].choices
{'initial': 'sepi', 'occlusion': 'half_sepi', 'textureless': 'lti', 'optimize': 'wls'}
>>> VARIANT_ENTRIES["no_sepi"]  # as users write theirs
{'base': 'paper', 'initial': 'structure_tensor'}
>>> list(STAGES["textureless"])  # choices of that stage
['lti', 'uniform_planes', 'none']
>>> STAGES["occlusion"]["half_sepi"].parameters.model_fields["side_reach"].description
'distance within which the nearer surface is searched, pixels'
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from sepi import initial, occlusion, optimize, textureless
from sepi.errors import SepiError
from sepi.registry import Known, added, extensions, stage_choices
from sepi.stage import Choice, Parameters
from sepi.validation import require_known, require_type
from sepi.validation.models import validated
from sepi.variants.built_in import ENTRIES

STAGES: dict[str, Known[Choice]] = {
    "initial": stage_choices("initial", initial.CHOICES),
    "occlusion": stage_choices("occlusion", occlusion.CHOICES),
    "textureless": stage_choices("textureless", textureless.CHOICES),
    "optimize": stage_choices("optimize", optimize.CHOICES),
}
"""Stage to its choices, in the order in which the stages run."""

HANDED_ON = "none"
"""The choice of a stage that is switched off; it is no job and has no file."""

# choices that callers added, as stage and name
_ADDED: set[tuple[str, str]] = set()

_BASE, _CHOICE = "base", "choice"
# a folder's name holds 255 bytes
_LONGEST_LABEL = 120


def add_choice(stage: str, name: str, choice: Choice) -> None:
    """Add a choice of your own to a stage, for variants in this process.

    Adding it again replaces it, as in a notebook whose cell runs twice. See docs/develop/extensions.md for a method
    that the command line and the workflow should know, too.

    Parameters
    ----------
    stage : str
        A key of :data:`STAGES`.
    name : str
        Letters, digits and ``_``; not the name of a built-in choice.
    choice : Choice
        Its parameters and its function.

    Raises
    ------
    SepiError
        If there is no such stage, the name has other characters, or a built-in choice has this name.

    Examples
    --------
    >>> import sepi
    >>> from sepi.variants import Variant, add_choice
    >>> from sepi.scenes import render
    >>> from sepi.stage import Choice, Parameters, require_previous
    >>> def mirrored(light_field, previous, parameters, progress):
    ...     before = require_previous(previous)
    ...     return before.updated(before.disparity[:, ::-1], before.confidence[:, ::-1])
    >>> add_choice("optimize", "mirrored", Choice(Parameters, mirrored))
    >>> light_field = render("slanted_plane", size=64, views=3)
    >>> usual, mine = (
    ...     sepi.estimate_depth(light_field, Variant("sepi", "none", "none", last)) for last in ("none", "mirrored")
    ... )
    >>> bool((mine.disparity == usual.disparity[:, ::-1]).all())
    True
    """
    require_known("stages", [stage], STAGES)
    if not re.fullmatch(r"\w+", name, re.ASCII):
        raise SepiError(f"stage {stage}: a choice's name has letters, digits and '_' only, got {name!r}")
    if name in STAGES[stage] and (stage, name) not in _ADDED:
        raise SepiError(f"stage {stage}: '{name}' is a built-in choice; expected another name")
    STAGES[stage][name] = replace(choice, own_steps=True)
    _ADDED.add((stage, name))


@dataclass(frozen=True)
class Variant:
    """A choice for each stage, and overridden parameters.

    Attributes
    ----------
    initial, occlusion, textureless, optimize : str
        The stages' choices.
    overrides : mapping of str to mapping
        Stage to field to value.

    Raises
    ------
    SepiError
        If a stage has no such choice, or a choice no such field or value.

    Examples
    --------
    The paper's method with another initial depth, and fewer candidates:

    >>> from sepi import estimate_depth
    >>> from sepi.variants import Variant
    >>> from sepi.scenes import render
    >>> variant = Variant(
    ...     initial="structure_tensor", occlusion="half_sepi", textureless="none", optimize="wls",
    ...     overrides={"occlusion": {"num_disparities": 45}},
    ... )
    >>> variant.labels["occlusion"]
    'half_sepi+num_disparities=45'
    >>> estimate_depth(render("dots", size=64, views=5), variant).disparity.shape
    (64, 64)
    """

    initial: str
    occlusion: str
    textureless: str
    optimize: str
    overrides: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for stage, choice in self.choices.items():
            require_known(f"variant, stage {stage}", [choice], STAGES[stage])
        require_known("variant, overrides", self.overrides, STAGES)
        stage_parameters(self)

    @property
    def choices(self) -> dict[str, str]:
        """Stage to choice, in the order of the stages."""
        return {stage: getattr(self, stage) for stage in STAGES}

    @property
    def labels(self) -> dict[str, str]:
        """Stage to the label of its choice and overrides: ``"visibility+use_mixture=False"``."""
        return {stage: choice_label(choice, self.overrides.get(stage, {})) for stage, choice in self.choices.items()}


def choice_label(choice: str, overrides: Mapping[str, Any]) -> str:
    """Label of a choice and its overrides for tables and folders: ``"visibility+use_mixture=False"``.

    Equal overrides give equal labels, in any order and notation of numbers. A label that is too long for a folder, or
    has characters other than letters, digits and ``_ . - + =``, ends with a digest instead.
    """
    parts = [choice, *(f"{name}={_written(overrides[name])}" for name in sorted(overrides))]
    label = "+".join(parts)
    if len(label) <= _LONGEST_LABEL and re.fullmatch(r"[\w.+=-]+", label, re.ASCII):
        return label
    return f"{choice}+{hashlib.sha256(label.encode()).hexdigest()[:12]}"


def _written(value: Any) -> str:
    """Shortest text of a value; 0.0 and 0 have the same."""
    if isinstance(value, float):
        return repr(value).removesuffix(".0").replace("e+", "e")
    return str(value)


def choice_of(label: str) -> str:
    """The choice of a label by :func:`choice_label`."""
    return label.partition("+")[0]


def variant_from(name: str, entries: Mapping[str, Any], where: str, users: tuple[str, ...] = ()) -> Variant:
    """The variant that an entry such as ``{"base": "best", "occlusion": {"use_mixture": False}}`` describes.

    For each stage, an entry has a choice, ``"visibility"``, or a choice with overrides,
    ``{"choice": "visibility", "use_mixture": False}``. With ``base``, stages that it leaves out are those of that
    variant, and overrides without a choice add to that variant's.

    Parameters
    ----------
    name : str
        Name of the variant.
    entries : mapping of str to mapping
        The variant's entry, and those of variants that may be its base.
    where : str
        Where the entries stand, for messages.
    users : tuple of str
        Variants with this one as base; callers leave it empty.

    Returns
    -------
    Variant

    Raises
    ------
    SepiError
        If the entry is not such a mapping, lacks a stage, has an unknown name, or has itself as base.

    Examples
    --------
    >>> from sepi.variants import VARIANT_ENTRIES, variant_from
    >>> entries = {**VARIANT_ENTRIES, "smoother": {"base": "best", "optimize": {"strength": 12.0}}}
    >>> variant = variant_from("smoother", entries, "my variants")
    >>> variant.choices["initial"], variant.overrides
    ('semi_global', {'optimize': {'strength': 12.0}})
    >>> entries["smoother"]["optimize"]["strenght"] = 12.0
    >>> variant_from("smoother", entries, "my variants")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    sepi.errors.SepiError: my variants.smoother.optimize: unknown 'strenght'; did you mean 'strength'? ...
    """
    entry, here = entries[name], f"{where}.{name}"
    if not isinstance(entry, Mapping):
        raise SepiError(f"{here}: expected a choice for each stage, or a base and what differs, got {entry!r}")
    require_known(here, entry, (_BASE, *STAGES))
    base = None
    if _BASE in entry:
        require_known(f"{here}.{_BASE}", [entry[_BASE]], entries)
        if entry[_BASE] in (name, *users):
            raise SepiError(f"{here}.{_BASE}: a variant cannot have itself as base")
        base = variant_from(entry[_BASE], entries, where, (name, *users))
    chosen = {stage: _chosen(stage, entry.get(stage, {}), base, here) for stage in STAGES}
    overrides = {stage: values for stage, (_, values) in chosen.items() if values}
    return Variant(**{stage: choice for stage, (choice, _) in chosen.items()}, overrides=overrides)


def _chosen(stage: str, given: Any, base: Variant | None, where: str) -> tuple[str, dict[str, Any]]:
    """A stage's choice and its overrides."""
    values = {_CHOICE: given} if isinstance(given, str) else given
    if not isinstance(values, Mapping):
        raise SepiError(f"{where}.{stage}: expected a choice, or parameters of one, got {given!r}")
    own = {key: value for key, value in values.items() if key != _CHOICE}
    if _CHOICE in values:
        choice = values[_CHOICE]
        require_known(f"{where}.{stage}", [choice], STAGES[stage])
    elif base is not None:
        choice, own = base.choices[stage], {**base.overrides.get(stage, {}), **own}
    else:
        raise SepiError(f"{where}: no choice for stage '{stage}' (one of {', '.join(STAGES[stage])})")
    checked = validated(STAGES[stage][choice].parameters, own, f"{where}.{stage}")
    # values as the model converts them, such as 0 to 0.0
    return choice, {key: getattr(checked, key) for key in own}


VARIANT_ENTRIES: Known[dict[str, Any]] = Known("variants", ENTRIES)
"""The built-in variants as entries for :func:`variant_from`: the paper's method, the other four columns of its table 4
in order, the text's other occlusion stage, and the paper's method without noise correction; then the most accurate
variant, a fast one, and the most accurate one with a part switched off or replaced by the paper's; then what extensions
add, such as the compared methods."""


def variant_named(name: str) -> Variant:
    """The built-in variant of this name.

    Raises
    ------
    SepiError
        If there is none.
    """
    require_known("variant", [name], VARIANTS)
    return VARIANTS[name]


def stage_parameters(
    variant: Variant, parameters: Mapping[str, Mapping[str, Any]] | None = None
) -> dict[str, Parameters]:
    """Parameters of each stage of a variant: defaults, overridden first by the variant, then by the caller.

    Parameters
    ----------
    variant : Variant
    parameters : mapping of str to mapping, optional
        Stage to field to value.

    Returns
    -------
    dict of str to Parameters
        By stage, in the order of the stages.

    Raises
    ------
    SepiError
        If a stage or a field is unknown or a value is not allowed; the message names it.

    Examples
    --------
    >>> from sepi.variants import VARIANTS, stage_parameters
    >>> settings = stage_parameters(VARIANTS["paper"], {"initial": {"num_disparities": 91}})
    >>> settings["initial"].num_disparities, settings["initial"].window_radius
    (91, 3)
    """
    require_type("variant", variant, Variant, "a Variant")
    given = parameters or {}
    require_type("parameters", given, Mapping, "stages with their parameters")
    require_known("parameters", given, STAGES)
    for stage, own in given.items():
        require_type(f"parameters: {stage}", own, Mapping, "parameters with their values")
    return {
        stage: validated(
            STAGES[stage][choice].parameters,
            {**variant.overrides.get(stage, {}), **given.get(stage, {})},
            f"{stage}.{choice}",
        )
        for stage, choice in variant.choices.items()
    }


class _BuiltIn(Known[Any]):
    """Variants made when looked up, since compared methods load their modules."""

    def __getitem__(self, name: str) -> Any:
        if name not in self._found:
            self._found[name] = variant_from(name, VARIANT_ENTRIES, "variants")
        return self._found[name]


VARIANTS: Mapping[str, Variant] = _BuiltIn("variants", ENTRIES)
"""Name to built-in variant."""


def needing_files() -> frozenset[str]:
    """Built-in variants that need files of the user, so that reports have them only on request."""
    return frozenset(name for extension in extensions().values() for name in extension.on_request)


def compared_methods() -> tuple[str, ...]:
    """Built-in variants that extensions add, other authors' methods, in the order of tables."""
    return tuple(name for name in added("variants") if name not in needing_files())
