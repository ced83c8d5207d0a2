"""Recipes: what is computed for a mesh, as data. A recipe is stored whole in every shard and every checkpoint."""

import json
from dataclasses import asdict, dataclass, fields
from math import isfinite
from pathlib import Path
from typing import Any

from meshshard.errors import UsageError


def log_spaced(first: float, last: float, count: int) -> tuple[float, ...]:
    """`count` times from `first` to `last`, equal ratios between neighbours, both ends exact."""
    ratio = last / first
    return tuple([first * ratio ** (i / (count - 1)) for i in range(count - 1)] + [last])


STEPS = ("weld", "largest_component", "orient")
"""What may be done to a mesh before its features are computed, in the order that the recipe lists."""

SHORTEST, LONGEST = 1e-9, 1e9
"""Of diffusion times: far below a vertex's area, and far beyond the time in which any mesh of radius 1 is even."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """How features are computed. Times are in squared lengths of the normalised mesh (maximum radius 1).

    `laplacian`: "robust" is the intrinsic-Delaunay Laplacian of the tufted cover (Sharp and Crane 2020), "cotangent"
    the plain one. `regularisation` times the identity is added to it. `weld` merges vertices at the same point on the
    working copy. `components`: "separate" pieces do not feel each other's heat, "bridged" ones are joined by weak
    links. `hks_tolerance` is the relative error that HKS values may have against the full spectrum.
    `geodesic` and `shape_diameter` add the fields of these names, `signed_dihedral` the mean signed angle as
    `dihedral_signed`, `official_dihedral` the published code's three channels as `dihedral_official`, `spectrum` that
    many of the lowest eigenpairs.
    `steps` change the mesh that is stored: "weld" merges its vertices at the same point, "largest_component" drops
    the faces of all other pieces, "orient" turns faces so that neighbours agree and closed pieces face outwards.
    `simplify`, after them, collapses edges by quadric error down to that many faces; 0 leaves the mesh as it is.
    """

    name: str
    laplacian: str = "robust"
    regularisation: float = 0.0
    weld: bool = True
    components: str = "separate"
    times: tuple[float, ...] = log_spaced(1e-2, 1.0, 16)
    hks_tolerance: float = 1e-5
    geodesic: bool = False
    shape_diameter: bool = False
    signed_dihedral: bool = False
    official_dihedral: bool = False
    spectrum: int = 0
    steps: tuple[str, ...] = ()
    simplify: int = 0

    def __post_init__(self) -> None:
        if self.laplacian not in ("robust", "cotangent"):
            raise UsageError(f"recipe {self.name}: laplacian is 'robust' or 'cotangent', not {self.laplacian!r}")
        if self.components not in ("separate", "bridged"):
            raise UsageError(f"recipe {self.name}: components is 'separate' or 'bridged', not {self.components!r}")
        if self.spectrum < 0:
            raise UsageError(f"recipe {self.name}: spectrum is a number of eigenpairs, not {self.spectrum}")
        if not set(self.steps) <= set(STEPS) or len(set(self.steps)) < len(self.steps):
            raise UsageError(f"recipe {self.name}: steps are some of {', '.join(STEPS)}, each once, not {self.steps}")
        if self.simplify < 0 or 0 < self.simplify < 4:
            raise UsageError(f"recipe {self.name}: simplify is a number of faces, 4 or more, not {self.simplify}")
        if not self.times or not all(SHORTEST <= t <= LONGEST for t in self.times):
            raise UsageError(
                f"recipe {self.name}: times are numbers from {SHORTEST:g} to {LONGEST:g}, not {self.times}"
            )
        if not (isfinite(self.regularisation) and self.regularisation >= 0):
            raise UsageError(f"recipe {self.name}: regularisation is 0 or more, not {self.regularisation}")
        if not 0 < self.hks_tolerance < 1:
            raise UsageError(f"recipe {self.name}: hks_tolerance is between 0 and 1, not {self.hks_tolerance}")

    @property
    def changes_mesh(self) -> bool:
        """Whether the mesh that is stored is another than that of the file."""
        return bool(self.steps or self.simplify)

    def to_json(self) -> str:
        """One canonical line: sorted keys, no spaces, shortest floats that read back the same."""
        return json.dumps(asdict(self), sort_keys=True, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> "Recipe":
        """The recipe that `to_json` wrote; unknown and missing keys are refused by name."""
        return cls.from_table(json.loads(text), "recipe")

    @classmethod
    def from_table(cls, table: Any, place: str) -> "Recipe":
        """A recipe from a JSON or TOML table; `place` names the file in errors."""
        if not isinstance(table, dict):
            raise UsageError(f"{place}: a recipe is a table of settings, not {type(table).__name__}")
        known = {f.name for f in fields(cls)}
        unknown = sorted(set(table) - known)
        if unknown:
            raise UsageError(f"{place}: unknown recipe settings {unknown}; known are {sorted(known)}")
        if "name" not in table:
            raise UsageError(f"{place}: a recipe needs a name")
        settings: dict[str, Any] = dict(table)
        if "times" in settings:
            if not isinstance(table["times"], list) or not all(isinstance(t, int | float) for t in table["times"]):
                raise UsageError(f"{place}: times is a list of numbers, not {table['times']!r}")
            settings["times"] = tuple(float(t) for t in table["times"])
        if "steps" in settings:
            if not isinstance(table["steps"], list) or not all(isinstance(step, str) for step in table["steps"]):
                raise UsageError(f"{place}: steps is a list of names, not {table['steps']!r}")
            settings["steps"] = tuple(table["steps"])
        for key, value in settings.items():
            default = getattr(cls, key, "")
            wanted: type | tuple[type, ...] = (int, float) if isinstance(default, float) else type(default)
            if not isinstance(value, wanted) or (isinstance(value, bool) and not isinstance(default, bool)):
                raise UsageError(f"{place}: {key} is of type {type(default).__name__}, not {value!r}")
            if isinstance(default, float):
                settings[key] = float(table[key])
        return cls(**settings)


RECIPES = {
    recipe.name: recipe
    for recipe in (
        Recipe(name="paper"),
        Recipe(name="best", geodesic=True, shape_diameter=True),
        Recipe(name="official", laplacian="cotangent", regularisation=1e-8, weld=False, official_dihedral=True),
    )
}
"""The named recipes: `paper` follows the article's text on any surface, `best` adds what
networks learn more from, `official` the published code's channels."""


def find_recipe(name: str) -> Recipe:
    """A named recipe, or one read from a JSON file (as stored in a shard's `recipe` attribute)."""
    if name in RECIPES:
        return RECIPES[name]
    if name.endswith(".json"):
        try:
            return Recipe.from_json(Path(name).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise UsageError(f"cannot read the recipe {name}: {error}") from error
    raise UsageError(f"no recipe is called {name!r}; there are {', '.join(RECIPES)}, or name a .json file")
