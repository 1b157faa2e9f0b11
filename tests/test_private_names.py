"""Nothing leans on names that other packages keep to themselves: their next version may have none of them."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
OWN = ("sepi", "bench")
# documented all the same
PUBLIC = {"os._exit"}


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def private_names(source: str) -> Iterator[str]:
    """Private names of other packages that a source imports, or takes from what it has imported of them."""
    tree, foreign = ast.parse(source), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom) and not getattr(node, "level", 0):
            for alias in node.names:
                path = f"{getattr(node, 'module', '')}.{alias.name}".strip(".")
                if path.split(".")[0] not in OWN:
                    foreign.add((alias.asname or alias.name).split(".")[0])
                    yield from (path for part in path.split(".") if is_private(part))
    for node in ast.walk(tree):
        inner: ast.AST = node
        while isinstance(inner, ast.Attribute):
            inner = inner.value
        taken = isinstance(node, ast.Attribute) and isinstance(inner, ast.Name) and inner.id in foreign
        if taken and is_private(node.attr):
            yield ast.unparse(node)


def test_no_private_name_of_another_package_is_used() -> None:
    for path in (path for folder in (*OWN, "tools") for path in (ROOT / folder).rglob("*.py")):
        assert set(private_names(path.read_text())) <= PUBLIC, path
